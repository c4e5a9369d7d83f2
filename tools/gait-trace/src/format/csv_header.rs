//! Parses the header of a CSV file with any header: where the time comes from, and the column of each joint.

use crate::fault::{Fault, TraceError};
use crate::format::angle_unit::AngleUnit;
use crate::format::components::{Components, Triple};
use crate::format::extension_columns;
use crate::format::joint_names::{joint_of, sideless_of, unit_of};
use crate::format::stated;
use crate::format::text_table::{column_called, listed, short};
use crate::format::time_names::{is_frame, is_share, other_unit_of_time, stamp_of, time_of};
use crate::format::unit::{Said, seconds_of, volts_in, volts_of, without_volts};
use crate::options::{Axis, ReadOptions};
use joint_units::Joint;
use std::borrow::Cow;

/// A column that was chosen for a joint.
pub(crate) struct Chosen {
    pub(crate) joint: Joint,
    pub(crate) index: usize,
    pub(crate) heading: String,
    pub(crate) said: Said,
    /// The numbers are in units of `10^power`.
    pub(crate) power: i32,
    pub(crate) values: Vec<f64>,
    /// The components of the joint, if this is the first of several.
    pub(crate) triple: Option<Triple>,
}

impl Chosen {
    fn of(joint: Joint, index: usize, heading: &str) -> Self {
        let named = joint_of(heading).and_then(|(_, unit)| unit).or_else(|| unit_of(heading));
        let (said, power) = match volts_in(heading) {
            Some(power) => (Said::Volts, power),
            None => (named.map_or(Said::Nothing, Said::Unit), 0),
        };
        Self { joint, index, heading: heading.to_owned(), said, power, values: Vec::new(), triple: None }
    }

    /// Whether a column is another component of this joint.
    pub(crate) fn is_component(&self, column: usize) -> bool {
        self.triple.as_ref().is_some_and(|triple| triple.has(column))
    }

    /// The only hip or knee of a file that names no side, as a recording of a single sensor does.
    fn sideless(headings: &[String], how: &ReadOptions<'_>) -> Option<Self> {
        let all = || headings.iter().enumerate();
        let mut found =
            all().filter_map(|(index, heading)| sideless_of(without_volts(heading)).map(|what| (index, what)));
        let (index, (joints, unit)) = found.next()?;
        if found.next().is_some() {
            return None;
        }
        let joint = how.sideless.filter(|joint| joints.contains(joint)).unwrap_or(joints[0]);
        let mut chosen = Self::of(joint, index, &headings[index]);
        if chosen.said == Said::Nothing {
            chosen.said = unit.map_or(Said::Nothing, Said::Unit);
        }
        Some(chosen)
    }
}

/// Source of the rows' times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TimeSource {
    /// A column of times in units of `10^power` seconds; `None` where nothing names the unit.
    Column { index: usize, power: Option<i32> },
    /// A column that counts frames.
    Frames { index: usize, rate_hz: f64 },
    /// The number of the row.
    Rows { rate_hz: f64 },
}

impl TimeSource {
    /// The column.
    pub(crate) fn index(self) -> Option<usize> {
        match self {
            Self::Column { index, .. } | Self::Frames { index, .. } => Some(index),
            Self::Rows { .. } => None,
        }
    }
}

/// The parsed header.
pub(crate) struct Header {
    pub(crate) headings: Vec<String>,
    pub(crate) time: TimeSource,
    pub(crate) chosen: Vec<Chosen>,
    /// The axes of the columns that the map chose among components, each once.
    pub(crate) mapped_axes: Vec<Axis>,
    /// The only joint names no side.
    is_sideless: bool,
}

impl Header {
    pub(crate) fn understand(
        name: &str,
        line: u64,
        headings: Vec<String>,
        headless: bool,
        how: &ReadOptions<'_>,
    ) -> Result<Self, TraceError> {
        let time = time_source(name, line, &headings, headless, how)?;
        let fault = |fault| TraceError::new(name, Some(line), fault);
        let mut chosen: Vec<Chosen> = Vec::new();
        let components = Components::of(&headings);
        let mut mapped_axes: Vec<Axis> = Vec::new();
        for joint in Joint::ALL {
            let index = match how.column_of(joint) {
                Some(wanted) => Some(mapped(name, line, &headings, joint.name(), wanted)?),
                None => {
                    let taken = |index: &usize| {
                        how.map.iter().any(|(_, wanted)| column_called(&headings, wanted) == Some(*index))
                    };
                    let is_joint = |name: &str| joint_of(name).is_some_and(|(found, _)| found == joint);
                    let free = |index: &usize| !taken(index);
                    let mut named: Vec<usize> = (0..headings.len()).filter(free).collect();
                    // Angles go before volts of the same joint.
                    match named.iter().any(|&index| is_joint(&headings[index])) {
                        true => named.retain(|&index| is_joint(&headings[index])),
                        false => named.retain(|&index| is_joint(without_volts(&headings[index]))),
                    }
                    // So do columns of one angle before components that are no angles.
                    if named.iter().any(|&index| !components.is_no_angle(index, &headings)) {
                        named.retain(|&index| !components.is_no_angle(index, &headings));
                    }
                    let mut found = named.into_iter();
                    let index = found.next();
                    let again = || index.and_then(|index| renamed_copy(&headings, index));
                    if let (Some(index), Some(other)) = (index, found.next().or_else(again)) {
                        let (first, second) = (short(&headings[index]), short(&headings[other]));
                        let fault = fault(Fault::TwoColumns { joint: joint.name(), first, second });
                        return Err(fault.in_column(other, &headings[other]));
                    }
                    index
                }
            };
            let is_mapped = how.column_of(joint).is_some();
            if let Some(index) = index {
                let at = |f: Fault| fault(f).in_column(index, &headings[index]);
                let check = if is_mapped { stated::check } else { stated::check_found };
                check(&headings[index], how).map_err(at)?;
                if let Some(columns) = components.quaternion(index, &headings) {
                    return Err(at(Fault::Quaternion { columns, joint: joint.name() }));
                }
                let axis = components.axis_of(index).filter(|axis| is_mapped && !mapped_axes.contains(axis));
                mapped_axes.extend(axis);
            }
            if let Some(index) = index.filter(|index| time.index() == Some(*index)) {
                let heading = short(&headings[index]);
                return Err(fault(Fault::TimeAsJoint { joint: joint.name() }).in_column(index, &heading));
            }
            chosen.extend(index.map(|index| {
                let triple = if is_mapped { None } else { components.triple(index, &headings) };
                Chosen { triple, ..Chosen::of(joint, index, &headings[index]) }
            }));
        }
        if let Some(fault) = merged_heading(&headings, &chosen, how) {
            return Err(TraceError::new(name, Some(line), fault));
        }
        let sideless = if chosen.is_empty() { Chosen::sideless(&headings, how) } else { None };
        let is_sideless = sideless.is_some();
        chosen.extend(sideless);
        if chosen.is_empty() {
            let volts: Vec<&String> = headings.iter().filter(|heading| volts_in(heading).is_some()).collect();
            let others: Vec<&String> = headings
                .iter()
                .enumerate()
                .filter(|(index, _)| time.index() != Some(*index))
                .map(|(_, heading)| heading)
                .collect();
            return Err(fault(match volts.as_slice() {
                // With a calibration the columns are channels of a recorder.
                [] if how.calibration.is_some() => Fault::NoChannelMap { have: listed(&others) },
                [] => {
                    let first = (0..headings.len()).find(|index| time.index() != Some(*index)).unwrap_or(0);
                    let example = match extension_columns::advice(&headings, |_| false) {
                        Some(advice) => format!(" ({advice})"),
                        None => example("left_hip", &headings, first),
                    };
                    Fault::NoJoints { have: listed(&headings), example }
                }
                volts => Fault::NoChannelMap { have: listed(volts) },
            }));
        }
        Ok(Self { headings, time, chosen, mapped_axes, is_sideless })
    }

    /// The columns of the time and of the joints, without further components.
    pub(crate) fn used(&self) -> impl Iterator<Item = usize> {
        self.time.index().into_iter().chain(self.chosen.iter().map(|chosen| chosen.index))
    }

    /// Whether all numbers are in the units themselves, not in a decimal multiple.
    pub(crate) fn is_in_units(&self) -> bool {
        let time = match self.time {
            TimeSource::Column { power, .. } => power.unwrap_or(0),
            TimeSource::Frames { .. } | TimeSource::Rows { .. } => 0,
        };
        time == 0 && self.chosen.iter().all(|chosen| chosen.power == 0)
    }

    /// Puts the only joint of a file that names no side on the leg that a column of the rows names, if any.
    pub(crate) fn settle_side(&mut self, is_left: Option<bool>, notes: &mut Vec<String>) {
        let Some(chosen) = self.chosen.first_mut().filter(|_| self.is_sideless) else { return };
        let is_hip = matches!(chosen.joint, Joint::LeftHip | Joint::RightHip);
        chosen.joint = match (is_left, is_hip) {
            (Some(true), true) => Joint::LeftHip,
            (Some(true), false) => Joint::LeftKnee,
            (Some(false), true) => Joint::RightHip,
            (Some(false), false) => Joint::RightKnee,
            (None, _) => chosen.joint,
        };
        let by = if is_left.is_some() { ", by the rows" } else { "" };
        notes.push(format!("`{}` names no side; it is read as {}{by}.", chosen.heading, chosen.joint.name()));
    }

    /// Reads a row of units below the header (`s,deg,deg` or `(ms),(mV)`); false if the row is not one.
    pub(crate) fn take_units(&mut self, name: &str, line: u64, fields: &[Cow<'_, str>]) -> Result<bool, TraceError> {
        let is_number = |field: &Cow<'_, str>| field.parse::<f64>().is_ok();
        if fields.len() != self.headings.len() || fields.iter().any(is_number) {
            return Ok(false);
        }
        let bare = |field: &str| field.trim_matches(['[', ']', '(', ')', ' ']).to_owned();
        let is_unit = |field: &Cow<'_, str>| volts_of(field).is_some() || bare(field).parse::<AngleUnit>().is_ok();
        match &mut self.time {
            TimeSource::Column { index, power } => {
                let Some(unit) = fields.get(*index).and_then(|field| seconds_of(field)) else { return Ok(false) };
                if power.is_some_and(|named| named != unit) {
                    let error = contradicts(name, line, &fields[*index], "the unit that the heading names");
                    return Err(error.in_column(*index, &self.headings[*index]));
                }
                *power = Some(unit);
            }
            _ if !fields.iter().any(is_unit) => return Ok(false),
            _ => {}
        }
        for chosen in &mut self.chosen {
            let unit = bare(&fields[chosen.index]);
            let (said, power) = match (volts_of(&unit), unit.parse()) {
                (Some(power), _) => (Said::Volts, power),
                (None, Ok(unit)) => (Said::Unit(unit), 0),
                (None, Err(_)) => (Said::Nothing, 0),
            };
            if said != Said::Nothing {
                if chosen.said != Said::Nothing && (chosen.said, chosen.power) != (said, power) {
                    let error = contradicts(name, line, &unit, "the unit that the heading names");
                    return Err(error.in_column(chosen.index, &chosen.heading));
                }
                (chosen.said, chosen.power) = (said, power);
            } else if !matches!(unit.as_str(), "" | "-") {
                let fault = Fault::HeaderField {
                    field: "the unit".into(),
                    found: format!("`{}`", short(&unit)),
                    allowed: "degrees, radians, V, mV or uV".into(),
                };
                return Err(TraceError::new(name, Some(line), fault).in_column(chosen.index, &chosen.heading));
            }
        }
        Ok(true)
    }
}

/// A map for this very file, in words.
fn example(what: &str, headings: &[String], index: usize) -> String {
    let heading = headings.get(index).filter(|heading| !heading.is_empty());
    let that = heading.map_or("the column without a heading".into(), |heading| format!("`{}`", short(heading)));
    format!(" (here `--map {what}={}` if that is {that})", index + 1)
}

/// The column that has the heading of this one and a number behind it: pandas renames the second `left_hip` to `left_hip.1`.
fn renamed_copy(headings: &[String], index: usize) -> Option<usize> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_copy = |heading: &String| {
        let rest = heading.strip_prefix(headings[index].as_str()).and_then(|rest| rest.strip_prefix('.'));
        rest.is_some_and(is_number)
    };
    headings.iter().position(is_copy)
}

/// An error if each of several joints that were found by their names has a column without a heading on its right.
fn merged_heading(headings: &[String], chosen: &[Chosen], how: &ReadOptions<'_>) -> Option<Fault> {
    let is_merged = |chosen: &&Chosen| headings.get(chosen.index + 1).is_some_and(String::is_empty);
    let found = || chosen.iter().filter(|chosen| how.column_of(chosen.joint).is_none());
    let first = short(&found().find(is_merged)?.heading);
    (found().count() > 1 && found().all(|chosen| is_merged(&chosen))).then_some(Fault::MergedHeading { first })
}

/// An error where the row of units contradicts the heading.
fn contradicts(name: &str, line: u64, unit: &str, allowed: &str) -> TraceError {
    let (field, found) = ("the unit below the heading".into(), format!("`{}`", short(unit)));
    TraceError::new(name, Some(line), Fault::HeaderField { field, found, allowed: allowed.into() })
}

/// The index of a column of the caller's map.
fn mapped(name: &str, line: u64, headings: &[String], joint: &'static str, wanted: &str) -> Result<usize, TraceError> {
    column_called(headings, wanted).ok_or_else(|| {
        let fault = Fault::MapColumn { joint, wanted: wanted.into(), have: listed(headings) };
        TraceError::new(name, Some(line), fault)
    })
}

/// Where the time comes from: the caller's map, a column of times, a column that counts frames, or the rows.
fn time_source(
    name: &str,
    line: u64,
    headings: &[String],
    headless: bool,
    how: &ReadOptions<'_>,
) -> Result<TimeSource, TraceError> {
    let fault = |fault| TraceError::new(name, Some(line), fault);
    let is_time = |index: &usize| time_of(&headings[*index]).is_some();
    let index = match &how.time {
        Some(wanted) => Some(mapped(name, line, headings, "time", wanted)?),
        None => {
            // A time goes before the part of a cycle beside it.
            let has_time = (0..headings.len()).any(|index| is_time(&index) && !is_share(&headings[index]));
            let mut times =
                (0..headings.len()).filter(is_time).filter(|&index| !has_time || !is_share(&headings[index]));
            let time = times.next();
            if let (Some(time), Some(other)) = (time, times.next()) {
                let (first, second) = (short(&headings[time]), short(&headings[other]));
                return Err(
                    fault(Fault::TwoColumns { joint: "time", first, second }).in_column(other, &headings[other])
                );
            }
            // A stamp of a clock is the time where nothing else is, and no rate is given in its place.
            let stamp = || headings.iter().position(|heading| how.rate_hz.is_none() && stamp_of(heading).is_some());
            time.or_else(stamp).or_else(|| headings.iter().position(|heading| is_frame(heading)))
        }
    };
    if let Some((index, unit)) = index.and_then(|index| Some((index, other_unit_of_time(&headings[index])?))) {
        return Err(fault(Fault::TimeOfUnit { unit }).in_column(index, &headings[index]));
    }
    match (index, how.rate_hz) {
        (Some(index), Some(rate_hz)) if !is_time(&index) => Ok(TimeSource::Frames { index, rate_hz }),
        (Some(index), None) if is_frame(&headings[index]) => {
            Err(fault(Fault::NoRate).in_column(index, &headings[index]))
        }
        (Some(index), _) => Ok(TimeSource::Column { index, power: unit_of_time(&headings[index]) }),
        (None, Some(rate_hz)) => Ok(TimeSource::Rows { rate_hz }),
        (None, None) => {
            let hint = match headings.len() {
                _ if headless => " (the first line is a row of numbers, not a header)",
                1 => " (there is only one column; separate the fields by `,`, `;` or tabs)",
                _ => "",
            };
            let has_joints = headings.iter().any(|heading| joint_of(heading).is_some());
            let example = example("time", headings, 0);
            Err(fault(Fault::NoTime { have: listed(headings), hint, has_joints, example }))
        }
    }
}

/// The unit of a time's heading: of a name for a time, or at the end of any name.
fn unit_of_time(heading: &str) -> Option<i32> {
    let at_end = || {
        let (_, end) = heading.trim_end_matches([']', ')', ' ']).rsplit_once(['_', '[', '(', ' '])?;
        seconds_of(end)
    };
    time_of(heading).or_else(|| stamp_of(heading)).flatten().or_else(at_end)
}
