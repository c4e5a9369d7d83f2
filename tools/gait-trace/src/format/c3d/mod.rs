//! Reads C3D files of motion capture: joint angles if the file has them, else hips and knees computed from joint centres or markers.
//!
//! The reader is written here because a damaged file must give an error that names the byte. The crate `c3dio` 0.8 panics on some
//! damaged files and reads some truncated ones as complete, so every check below would be needed in front of it. Analog data are
//! skipped.
//!
//! All three number formats (Intel, DEC, MIPS) and both kinds of points (floats, scaled integers) are read. A point with a negative
//! residual, or at exactly 0, 0, 0, is missing. Only the chosen points are kept, so memory is bounded by the size of the file,
//! whatever its header announces.

mod bytes;
mod processor;
mod section;

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::angle_unit::AngleUnit;
use crate::format::axis;
use crate::format::description::Description;
use crate::format::outputs::{self, Output};
use crate::format::row_lines::RowLines;
use crate::format::segments::{self, LengthUnit, Track};
use crate::format::subjects;
use crate::format::text_table::{check_rows, listed};
use crate::format::unit::Said;
use crate::options::ReadOptions;
use crate::raw::{Doubt, RawJoints};
use bytes::Ctx;
use joint_units::Joint;
use section::{KEY, Layout, Parameters};
use std::collections::HashSet;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "C3D (`.c3d`)",
    recognised: "the second byte, 0x50",
    units: "`POINT:ANGLE_UNITS`; `POINT:UNITS` where hips are computed from the pelvis",
    axes: "angles of one subject: of `LKneeAngles`, ... the first component, as Plug-in Gait defines it; of other names the one that moves most at the knees, else the first, with a warning; joint centres (`LHJC`, ...) or markers of pelvis or hip, knee and ankle (Plug-in Gait, Helen Hayes, CAST, OpenSim: `LASI`, `LKNE`, `LANK`, ...): the plane of vertical and walking direction",
    signs: "flexion positive of the first component of `LHipAngles`, `LKneeAngles`, ... and of what is computed; else the file's, then made flexion positive (see below)",
    rate: "`POINT:RATE`, else the frame rate of the header; a difference is a note",
    options: &["--map", "--unit", "--axis", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// Whether the bytes begin like a C3D file and are not text.
pub(crate) fn looks_like(bytes: &[u8]) -> bool {
    bytes.get(1) == Some(&KEY) && bytes.iter().take(512).any(|&byte| byte == 0)
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with its byte; or the file has neither angles nor joint centres.
///
/// ```
/// use gait_trace::format::c3d;
/// use gait_trace::ReadOptions;
/// let error = c3d::parse("walk.c3d", b"\x02\x51", &ReadOptions::default()).unwrap_err();
/// assert_eq!(error.to_string(), "walk.c3d: byte 1: the key of the header is 0x51; allowed is 0x50: is this a C3D file?");
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let ctx = Ctx { file: name, bytes };
    let mut notes = Vec::new();
    if how.rate_hz.is_some() {
        let has = "the frame rate of its header".into();
        return Err(TraceError::new(name, None, Fault::RateAndTime { has }));
    }
    let parameters = Parameters::parse(&ctx)?;
    let layout = Layout::parse(&ctx, &parameters, &mut notes)?;
    if layout.frames < 2 {
        return Err(TraceError::new(name, None, Fault::TooFewRows { rows: layout.frames }));
    }
    check_rows(layout.frames - 1).map_err(|fault| TraceError::new(name, None, fault))?;
    let file = File { ctx, parameters, layout };
    let mut doubts = Vec::new();
    let (columns, what) = match file.angles(how, &mut notes, &mut doubts)? {
        columns if columns.is_empty() => {
            if how.axis.is_some() {
                let what = "the file has no joint angles";
                return Err(TraceError::new(name, None, Fault::NoAxes { what }));
            }
            (file.segments(&mut notes, &mut doubts)?, "joint centres or markers")
        }
        columns => (columns, "joint angles"),
    };
    let place = Place { file: name, header: None, lines: &RowLines::default() };
    let joints = in_degrees(&place, columns, how, &mut notes)?;
    let File { parameters, layout, .. } = file;
    let numbers = if layout.scale.is_some() { "integers" } else { "floats" };
    let format = format!("C3D, {}, {numbers}, {} Hz, {what}", parameters.processor.words(), layout.rate_hz);
    let time_s = (0..layout.frames).map(|frame| frame as f64 / layout.rate_hz).collect();
    Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts })
}

/// A file whose pointers and counts have been checked against its length.
struct File<'a> {
    ctx: Ctx<'a>,
    parameters: Parameters,
    layout: Layout,
}

impl File<'_> {
    /// The points of one subject that hold joint angles: by the map, else by name.
    fn angles(
        &self,
        how: &ReadOptions<'_>,
        notes: &mut Vec<String>,
        doubts: &mut Vec<Doubt>,
    ) -> Result<Vec<AngleColumn>, TraceError> {
        let labels = &self.layout.labels;
        let said = match self.parameters.text(&self.ctx, "POINT:ANGLE_UNITS").first() {
            Some(unit) if !unit.is_empty() => unit.parse::<AngleUnit>().ok(),
            _ => None,
        };
        let outputs = outputs_of(labels);
        if how.map.is_empty() && outputs.iter().all(|output| output.joint().is_none()) {
            return Ok(Vec::new());
        }
        let chosen = outputs::choose(&outputs, "subjects", how);
        let chosen = chosen.map_err(|fault| TraceError::new(self.ctx.file, None, fault))?;
        let points: Vec<(Joint, usize, Track)> =
            chosen.into_iter().map(|(joint, index)| (joint, index, self.track(index))).collect();
        // A model that writes angles beside markers may have given none of them a value.
        let has_legs = || {
            let bare: Vec<&str> = labels.iter().map(|label| subjects::bare(label)).collect();
            segments::find(&bare).iter().any(Option::is_some)
        };
        if how.map.is_empty()
            && has_legs()
            && points.iter().all(|(.., track)| track.iter().all(|point| !segments::is_seen(point)))
        {
            let empty: Vec<&str> = points.iter().map(|&(_, index, _)| labels[index].as_str()).collect();
            notes.push(format!("{} have no value in any frame and are left out.", listed(&empty)));
            return Ok(Vec::new());
        }
        let is_plug_in_gait = points.iter().all(|&(_, index, _)| axis::is_plug_in_gait(&labels[index]));
        let axis = match how.axis {
            Some(axis) => axis,
            None => axis::of_flexion(&points, is_plug_in_gait, notes, doubts).map_err(|why| {
                let columns = listed(&points.iter().map(|&(_, index, _)| labels[index].as_str()).collect::<Vec<_>>());
                TraceError::new(self.ctx.file, None, Fault::UnclearFlexion { columns, why })
            })?,
        };
        let said = Said::angle(said);
        let column = |(joint, index, track): (Joint, usize, Track)| {
            let heading = labels[index].clone();
            AngleColumn {
                joint,
                sign: axis::sign_of_plug_in_gait(&heading, axis),
                heading,
                index,
                said,
                values: track.iter().map(|point| point[axis as usize]).collect(),
            }
        };
        Ok(points.into_iter().map(column).collect())
    }

    /// Hip and knee angles from thighs and shanks.
    fn segments(&self, notes: &mut Vec<String>, doubts: &mut Vec<Doubt>) -> Result<Vec<AngleColumn>, TraceError> {
        let mut bare: Vec<&str> = self.layout.labels.iter().map(|label| subjects::bare(label)).collect();
        let first_text = |name| self.parameters.text(&self.ctx, name).first().cloned();
        let screen_up = first_text("POINT:Y_SCREEN");
        let is_empty = |point: usize| self.track(point).iter().all(|point| !segments::is_seen(point));
        let legs = segments::find_seen(&mut bare, is_empty, notes);
        let fault = |fault| TraceError::new(self.ctx.file, None, fault);
        if legs.iter().all(Option::is_none) {
            return Err(fault(Fault::NoTrajectories { have: listed(&self.layout.labels) }));
        }
        let labels: Vec<&str> = self.layout.labels.iter().map(String::as_str).collect();
        let subjects = subjects::with_legs(&labels);
        if subjects.len() > 1 {
            return Err(fault(Fault::SeveralSubjects { have: listed(&subjects) }));
        }
        notes.extend(segments::one_leg(&legs, &bare));
        let text = first_text("POINT:UNITS").unwrap_or_default();
        let unit = LengthUnit { field: "POINT:UNITS", text: &text };
        let legs = segments::tracks(legs, |index| self.track(index), unit, notes).map_err(fault)?;
        segments::angles(&legs, self.layout.rate_hz, screen_up.as_deref(), notes, doubts).map_err(fault)
    }

    /// One point in all frames.
    fn track(&self, point: usize) -> Track {
        let Layout { frames, data_at, frame_bytes, scale, .. } = self.layout;
        (0..frames).map(|frame| self.point(data_at + frame * frame_bytes, point, scale)).collect()
    }

    fn point(&self, frame_at: usize, point: usize, scale: Option<f32>) -> [f64; 3] {
        const MISSING: [f64; 3] = [f64::NAN; 3];
        let processor = self.parameters.processor;
        let value = |n: usize| -> Option<f32> {
            match scale {
                Some(scale) => {
                    let at = frame_at + (point * 4 + n) * 2;
                    let bytes = self.ctx.bytes.get(at..at + 2)?.try_into().ok()?;
                    let code = processor.u16(bytes) as i16;
                    // The fourth number is a residual and a mask, so it is not scaled.
                    Some(if n == 3 { f32::from(code) } else { f32::from(code) * scale })
                }
                None => {
                    let at = frame_at + (point * 4 + n) * 4;
                    Some(processor.f32(self.ctx.bytes.get(at..at + 4)?.try_into().ok()?))
                }
            }
        };
        let (Some(x), Some(y), Some(z), Some(residual)) = (value(0), value(1), value(2), value(3)) else {
            return MISSING;
        };
        let seen = residual >= 0.0 && [x, y, z].iter().all(|value| value.is_finite()) && [x, y, z] != [0.0; 3];
        if seen { [x, y, z].map(f64::from) } else { MISSING }
    }
}

/// The points as outputs of subjects. Only the first of several points of one name can be chosen.
fn outputs_of(labels: &[String]) -> Vec<Output> {
    let mut seen: HashSet<&str> = HashSet::new();
    let mut outputs = Vec::with_capacity(labels.len());
    for label in labels {
        let first = if seen.insert(label) { label.as_str() } else { "" };
        let (group, name) = first.rsplit_once(':').unwrap_or(("", first));
        let is_angle = name.to_ascii_lowercase().contains("angle");
        outputs.push(Output { group: group.into(), name: name.into(), is_angle, columns: [Some(0), Some(1), Some(2)] });
    }
    outputs
}
