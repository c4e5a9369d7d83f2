//! Walks through the elements of an MVNX file and collects the angles of the joints.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::angle_unit::AngleUnit;
use crate::format::choice::columns;
use crate::format::decimals::Decimals;
use crate::format::mvnx::times::{Stamp, times_s};
use crate::format::row_lines::RowLines;
use crate::format::text_table::{MAX_COLUMNS, check_rows, listed, number_or_missing, short};
use crate::format::unit::Said;
use crate::options::ReadOptions;
use crate::raw::{RawJoints, SignSource};
use joint_units::Joint;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use std::collections::BTreeMap;

/// Deepest nesting of elements. A file of Xsens has six.
const MAX_DEPTH: usize = 64;
/// Most types of frames. Xsens has five.
const MAX_TYPES: usize = 16;
/// Highest frame rate, Hz. Xsens records at up to 240.
const MAX_RATE_HZ: f64 = 10_000.0;
/// Angles of a joint, and which of them is flexion.
const ANGLES: usize = 3;
const FLEXION: usize = 2;

/// An element that is read, recognised by its name and by the element around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tag {
    Mvnx,
    Subject,
    Joints,
    Joint,
    Frames,
    Frame,
    JointAngle,
    Other,
}

impl Tag {
    fn of(around: Option<Self>, name: &str) -> Self {
        match (around, name) {
            (None, "mvnx") => Self::Mvnx,
            (Some(Self::Mvnx), "subject") => Self::Subject,
            (Some(Self::Subject), "joints") => Self::Joints,
            (Some(Self::Subject), "frames") => Self::Frames,
            (Some(Self::Joints), "joint") => Self::Joint,
            (Some(Self::Frames), "frame") => Self::Frame,
            (Some(Self::Frame), "jointAngle") => Self::JointAngle,
            _ => Self::Other,
        }
    }
}

/// A joint and the place of its angles in each frame.
struct Chosen {
    joint: Joint,
    index: usize,
    label: String,
    values: Vec<f64>,
}

/// The frame that is being read.
struct Frame {
    stamp: Stamp,
    line: u64,
    /// Numbers of joint angles so far; `None` before the element.
    angles: Option<usize>,
    flexion: [f64; Joint::COUNT],
}

#[derive(Default)]
struct Document {
    version: String,
    subjects: usize,
    rate_hz: Option<f64>,
    labels: Vec<String>,
    chosen: Vec<Chosen>,
    frame: Option<Frame>,
    stamps: Vec<Stamp>,
    lines: RowLines,
    /// Frames that are skipped, by type.
    skipped: BTreeMap<String, u64>,
    untyped: u64,
    decimals: Decimals,
    without_angles: usize,
}

/// Lines of a text, counted forwards.
struct Lines<'a> {
    text: &'a str,
    at: usize,
    line: u64,
}

impl Lines<'_> {
    fn of(&mut self, at: u64) -> u64 {
        let at = usize::try_from(at).unwrap_or(usize::MAX).min(self.text.len());
        let passed = self.text.as_bytes().get(self.at..at).unwrap_or_default();
        self.line += passed.iter().filter(|&&byte| byte == b'\n').count() as u64;
        self.at = self.at.max(at);
        self.line
    }
}

pub(super) fn parse(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    if how.rate_hz.is_some() {
        let has = "`time` and `frameRate`".into();
        return Err(TraceError::new(name, None, Fault::RateAndTime { has }));
    }
    let mut reader = Reader::from_str(text);
    let mut lines = Lines { text, at: 0, line: 1 };
    let mut document = Document::default();
    let mut open: Vec<Tag> = Vec::new();
    loop {
        let event = reader.read_event();
        let line = lines.of(reader.buffer_position());
        let at = |fault| TraceError::new(name, Some(line), fault);
        let damaged = |what: String| at(Fault::Xml { what });
        match event.map_err(|error| damaged(error.to_string().chars().take(200).collect()))? {
            Event::Start(element) => {
                if open.len() == MAX_DEPTH {
                    return Err(damaged(format!("elements are nested more than {MAX_DEPTH} deep")));
                }
                open.push(document.start(open.last().copied(), &element, line, how).map_err(at)?);
            }
            Event::Empty(element) => {
                let tag = document.start(open.last().copied(), &element, line, how).map_err(at)?;
                document.end(tag).map_err(at)?;
            }
            Event::End(_) => {
                if let Some(tag) = open.pop() {
                    document.end(tag).map_err(at)?;
                }
            }
            Event::Text(text) if open.last() == Some(&Tag::JointAngle) => document.angles(&text).map_err(at)?,
            Event::CData(_) | Event::GeneralRef(_) if open.last() == Some(&Tag::JointAngle) => {
                return Err(damaged("`<jointAngle>` has something else than numbers".into()));
            }
            Event::DocType(definition) if definition.contains('[') => {
                return Err(damaged("the document type has definitions of its own, which are not read".into()));
            }
            Event::Eof if !open.is_empty() => return Err(damaged("the file ends within an element (cut off?)".into())),
            Event::Eof => break,
            _ => {}
        }
    }
    document.finish(name, how)
}

/// An attribute of an element, as it is written.
fn attribute(element: &BytesStart<'_>, name: &str) -> Result<Option<String>, Fault> {
    let found = element.try_get_attribute(name).map_err(|error| Fault::Xml { what: short(&error.to_string()) })?;
    Ok(found.map(|attribute| short(&attribute.value)))
}

/// An attribute that is a number.
fn number(element: &BytesStart<'_>, name: &str) -> Result<Option<f64>, Fault> {
    let Some(text) = attribute(element, name)? else { return Ok(None) };
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(Some(value)),
        _ => Err(field(name, &format!("`{text}`"), "a number")),
    }
}

fn field(field: &str, found: &str, allowed: &str) -> Fault {
    Fault::HeaderField { field: field.into(), found: found.into(), allowed: allowed.into() }
}

impl Document {
    fn start(
        &mut self,
        around: Option<Tag>,
        element: &BytesStart<'_>,
        line: u64,
        how: &ReadOptions<'_>,
    ) -> Result<Tag, Fault> {
        let name = element.local_name();
        let tag = Tag::of(around, name.as_ref());
        match tag {
            Tag::Mvnx => self.version = attribute(element, "version")?.unwrap_or_default(),
            Tag::Subject => {
                self.subjects += 1;
                if self.subjects > 1 {
                    return Err(field(
                        "the number of subjects",
                        "2 or more",
                        "1: export each subject to a file of its own",
                    ));
                }
                self.rate_hz = number(element, "frameRate")?;
                if let Some(rate) = self.rate_hz.filter(|rate| !(*rate > 0.0 && *rate <= MAX_RATE_HZ)) {
                    return Err(field("frameRate", &rate.to_string(), &format!("above 0 and up to {MAX_RATE_HZ} Hz")));
                }
            }
            Tag::Joint => {
                if self.labels.len() == MAX_COLUMNS {
                    return Err(Fault::TooManyColumns { found: self.labels.len() + 1, most: MAX_COLUMNS });
                }
                self.labels.push(attribute(element, "label")?.unwrap_or_default());
            }
            Tag::Frame => self.start_frame(element, line, how)?,
            Tag::JointAngle => {
                if let Some(frame) = &mut self.frame
                    && frame.angles.replace(0).is_some()
                {
                    return Err(field("<jointAngle>", "there twice in a frame", "once"));
                }
            }
            Tag::Other if around.is_none() => {
                return Err(field("the first element", &format!("`<{}>`", short(name.as_ref())), "`<mvnx>`"));
            }
            _ => {}
        }
        Ok(tag)
    }

    fn start_frame(&mut self, element: &BytesStart<'_>, line: u64, how: &ReadOptions<'_>) -> Result<(), Fault> {
        let kind = attribute(element, "type")?;
        match kind.as_deref() {
            Some("normal") => {}
            None => self.untyped += 1,
            Some(other) => {
                if self.skipped.len() == MAX_TYPES && !self.skipped.contains_key(other) {
                    return Err(field("the number of types of frames", "too large", &format!("up to {MAX_TYPES}")));
                }
                *self.skipped.entry(other.to_owned()).or_default() += 1;
                self.frame = None;
                return Ok(());
            }
        }
        if self.chosen.is_empty() {
            self.choose(how)?;
        }
        check_rows(self.stamps.len())?;
        let stamp = Stamp { index: number(element, "index")?, time_ms: number(element, "time")? };
        self.frame = Some(Frame { stamp, line, angles: None, flexion: [f64::NAN; Joint::COUNT] });
        Ok(())
    }

    /// Chooses the place of each joint; the list of joints is in front of the frames.
    fn choose(&mut self, how: &ReadOptions<'_>) -> Result<(), Fault> {
        if self.labels.is_empty() {
            return Err(field(
                "<joints>",
                "missing",
                "the list of joints in front of `<frames>`: which angle is which joint",
            ));
        }
        if let Some(wanted) = &how.time {
            return Err(Fault::MapColumn { joint: "time", wanted: wanted.clone(), have: listed(&self.labels) });
        }
        let labels: Vec<&str> = self.labels.iter().map(String::as_str).collect();
        let names: Vec<&str> = labels.iter().map(|label| label.strip_prefix('j').unwrap_or(label)).collect();
        let chosen = columns(&labels, &names, how)?.into_iter().map(|(joint, index)| Chosen {
            joint,
            index,
            label: self.labels[index].clone(),
            values: Vec::new(),
        });
        self.chosen = chosen.collect();
        match self.chosen.is_empty() {
            true => Err(Fault::NoJoints { have: listed(&self.labels), example: String::new() }),
            false => Ok(()),
        }
    }

    fn angles(&mut self, text: &str) -> Result<(), Fault> {
        let Some(Frame { angles: Some(count), flexion, line, .. }) = &mut self.frame else { return Ok(()) };
        for word in text.split_ascii_whitespace() {
            let (joint, component) = (*count / ANGLES, *count % ANGLES);
            *count += 1;
            if component != FLEXION {
                continue;
            }
            for chosen in self.chosen.iter().filter(|chosen| chosen.index == joint) {
                // Blanks separate the numbers, so a comma is a decimal comma.
                flexion[chosen.joint as usize] = number_or_missing(word, true)?;
                self.decimals.take(*line, word);
            }
        }
        Ok(())
    }

    fn end(&mut self, tag: Tag) -> Result<(), Fault> {
        match tag {
            Tag::JointAngle => {
                let wanted = ANGLES * self.labels.len();
                if let Some(Frame { angles: Some(count), .. }) = self.frame
                    && count != wanted
                {
                    let joints = self.labels.len();
                    let allowed = format!("{wanted}, {ANGLES} of each of the {joints} joints in `<joints>`");
                    return Err(field("<jointAngle>", &format!("a list of {count} numbers"), &allowed));
                }
            }
            Tag::Frame => {
                if let Some(frame) = self.frame.take() {
                    self.without_angles += usize::from(frame.angles.is_none());
                    self.stamps.push(frame.stamp);
                    self.lines.push(frame.line);
                    for chosen in &mut self.chosen {
                        chosen.values.push(frame.flexion[chosen.joint as usize]);
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(self, name: &str, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
        let at_end = |fault| TraceError::new(name, None, fault);
        let (frames, mut notes) = (self.stamps.len(), Vec::new());
        if self.subjects == 0 {
            return Err(at_end(field("<subject>", "missing", "one subject with joints and frames")));
        }
        if frames < 2 {
            return Err(at_end(Fault::TooFewRows { rows: frames }));
        }
        if self.without_angles == frames {
            let found = format!("missing in all {frames} frames");
            return Err(at_end(field(
                "<jointAngle>",
                &found,
                "frames with it: include the joint angles in the export",
            )));
        }
        if !self.skipped.is_empty() {
            let count = |(kind, count): (&String, &u64)| format!("{count} of type `{kind}`");
            let skipped = self.skipped.iter().map(count).collect::<Vec<_>>().join(", ");
            notes.push(format!("Frames of poses are skipped: {skipped}."));
        }
        if self.untyped > 0 {
            notes.push(format!("{} frames name no type; they are read as normal frames.", self.untyped));
        }
        self.decimals.check(name, &mut notes)?;
        if self.without_angles > 0 {
            notes.push(format!(
                "{} of {frames} frames have no joint angles; they are missing values.",
                self.without_angles
            ));
        }
        let time_s = times_s(&self.stamps, self.rate_hz, &mut notes).map_err(at_end)?;
        let column = |Chosen { joint, index, label, values }| {
            let said = Said::Format(AngleUnit::Degrees, "by the format");
            let is_named = ["hip", "knee"].iter().any(|joint| label.to_ascii_lowercase().ends_with(joint));
            let sign = SignSource::by_format(is_named, "by definition of MVNX");
            AngleColumn { joint, heading: format!("{label} z"), index: index * ANGLES + FLEXION, said, sign, values }
        };
        let place = Place { file: name, header: None, lines: &self.lines };
        let joints = in_degrees(&place, self.chosen.into_iter().map(column).collect(), how, &mut notes)?;
        let rate = self.rate_hz.map_or(String::new(), |rate| format!(", {rate} Hz"));
        let format = format!("MVNX, version {}{rate}, {} joints", self.version, self.labels.len());
        Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts: vec![] })
    }
}
