//! Reads gait cycle data (GCD) of Vicon Clinical Manager, Polygon and others: one normalised cycle of each leg.
//!
//! The first line begins with `#!DST`. A block is a line `!NAME` (`!LeftHipFlexExt`, `!KneeFlexExt`, `!LeftStrideTime`), which a number
//! may follow, and a row for each point: its value, or a mean and its deviation. Points are at equal steps from one initial contact to
//! the next, usually 51. Lines `$NAME` begin blocks of text.
//!
//! The cycle of each leg begins with the contact of its own foot. Both are put on the cycle of the left leg: the right one is moved by
//! `LeftOppositeFootContact` percent, in whole points, so that every angle is one of the file. The time runs from 0 to 1, as in an OpenSim
//! file of one cycle.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::description::{DEFINED, Description};
use crate::format::joint_names::{joint_of, sideless_of};
use crate::format::outputs::{self, Output};
use crate::format::row_lines::RowLines;
use crate::format::text_table::{bare_lines, check_rows, lines, listed, number_or_missing, short, text};
use crate::format::unit::Said;
use crate::options::ReadOptions;
use crate::raw::{RawJoints, SignSource};
use joint_units::Joint;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "GCD, gait cycle data of Vicon Clinical Manager and Polygon (`.gcd`)",
    recognised: "a first line that begins with `#!DST`",
    units: "by the values",
    axes: "blocks `!LeftHipFlexExt`, `!RightKneeFlexExt`, `!LeftHipAngles`, ... (of three components the first), or `!HipFlexExt` without side",
    signs: DEFINED,
    rate: "none: a cycle from 0 to 1 (see below)",
    options: &["--map", "--unit", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// The part of the left cycle at which the right foot makes contact, where the file has none.
const HALF_PERCENT: f64 = 50.0;

/// What the contact of the other foot may be. In any gait it is far from the ends of the cycle; a value near 0 is a fraction, or wrong.
const CONTACT: &str = "percent of the cycle, from 20 to 80, for example 50.5; a fraction such as 0.505 is not";

/// Whether the text begins like a file of the DST family.
pub(crate) fn looks_like(text: &str) -> bool {
    let first = bare_lines(text).find(|row| !row.trim().is_empty()).unwrap_or_default().trim_start();
    first.get(..5).is_some_and(|start| start.eq_ignore_ascii_case("#!DST"))
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with its line; or its joints have different numbers of points.
///
/// ```
/// use gait_trace::format::gcd;
/// use gait_trace::ReadOptions;
/// let rows: String = (0..51).map(|n| format!("{}\n", 20 + n % 50)).collect();
/// let text = format!("#!DST-0.1 GCD\n!LeftStrideTime 1\n1.1\n!LeftKneeFlexExt 1\n{rows}");
/// let raw = gcd::parse("walk.gcd", text.as_bytes(), &ReadOptions::default())?;
/// assert_eq!((raw.time_s[0], raw.time_s[25], raw.time_s[50]), (0.0, 0.5, 1.0));
/// assert_eq!(raw.joints[2].as_ref().unwrap().angle_deg[25], 45.0);
/// assert!(raw.notes.iter().any(|note| note.contains("`--stride-time 1.1`")));
/// # Ok::<(), gait_trace::TraceError>(())
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let text = text(name, bytes)?;
    if how.rate_hz.is_some() {
        return Err(TraceError::new(name, None, Fault::RateAndTime { has: "the points of its cycle".into() }));
    }
    if how.time.is_some() {
        return Err(TraceError::new(name, None, Fault::NoTimeColumn { has: "a part of the cycle" }));
    }
    let mut notes = Vec::new();
    let heads = heads(name, text)?;
    let chosen = chosen(&heads, how, &mut notes).map_err(|fault| TraceError::new(name, None, fault))?;
    let of_side = |what: &str| heads.iter().position(|head| head.name.eq_ignore_ascii_case(what));
    let wanted = [of_side("LeftStrideTime").or(of_side("RightStrideTime")).or(of_side("StrideTime"))]
        .into_iter()
        .chain([of_side("LeftOppositeFootContact"), of_side("RightOppositeFootContact")]);
    let wanted: Vec<Option<usize>> = wanted.collect();
    let indices = chosen.iter().map(|&(_, index)| index).chain(wanted.iter().flatten().copied());
    let mut blocks = read(name, text, &heads, &indices.collect::<Vec<_>>())?;
    let scalars = blocks.split_off(chosen.len());
    let joints = blocks;
    let first = &joints[0];
    let points = first.values.len();
    if let Some(other) = joints.iter().find(|block| block.values.len() != points) {
        let head = &heads[other.head];
        let allowed = format!("{points}, as `{}` has", short(&heads[first.head].name));
        let found = format!("of {} points", other.values.len());
        let fault = Fault::HeaderField { field: short(&head.name), found, allowed };
        return Err(TraceError::new(name, Some(head.line), fault));
    }
    if points < 2 {
        return Err(TraceError::new(name, Some(heads[first.head].line), Fault::TooFewRows { rows: points }));
    }
    notes.push(format!(
        "The file is one gait cycle of {points} points, from initial contact to initial contact; the time runs from 0 to 1."
    ));
    let mut scalar = scalars.iter();
    let mut next = |index: Option<usize>| index.and_then(|_| scalar.next());
    if let Some(block) = next(wanted[0]) {
        let stride_s = one(name, &heads, block, "seconds above 0", |value| value > 0.0)?;
        let head = short(&heads[block.head].name);
        notes.push(format!(
            "`{head}` of the file is {stride_s}: `--stride-time {stride_s}` gives the cycle that duration."
        ));
    }
    let (left, right) = (next(wanted[1]), next(wanted[2]));
    let is_left = |joint: Joint| matches!(joint, Joint::LeftHip | Joint::LeftKnee);
    let both = chosen.iter().any(|&(joint, _)| is_left(joint)) && chosen.iter().any(|&(joint, _)| !is_left(joint));
    let steps = if both { moved(name, &heads, [left, right], points, &mut notes)? } else { 0 };
    if joints.iter().any(|block| block.has_more) {
        notes.push("Rows have a second number or more, such as a deviation; only the first is read.".into());
    }
    if !text.ends_with(['\n', '\r']) {
        notes.push("The last line has no line end: if the file was cut off, its last number may be wrong.".into());
    }
    let row_lines = first.lines.clone();
    let column = |(&(joint, index), block): (&(Joint, usize), Block)| {
        let values = if is_left(joint) { block.values } else { turned(&block.values, steps) };
        let heading = heads[index].name.clone();
        let is_named = joint_of(&heading).is_some() || sideless_of(&heading).is_some();
        let sign = SignSource::by_format(is_named, "by definition of GCD");
        AngleColumn { joint, heading, index, said: Said::Angle, sign, values }
    };
    let columns = chosen.iter().zip(joints).map(column).collect();
    let place = Place { file: name, header: None, lines: &row_lines };
    let joints = in_degrees(&place, columns, how, &mut notes)?;
    let count = joints.iter().flatten().count();
    let format = format!("GCD, one normalised gait cycle of {points} points, {count} joints of {} blocks", heads.len());
    let time_s = (0..points).map(|n| n as f64 / (points - 1) as f64).collect();
    Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts: vec![] })
}

/// The line that begins a block of numbers.
struct Head {
    line: u64,
    /// The name, without the number of its components.
    name: String,
}

/// The name of the block that a line begins; `Some(None)` for a block of text.
fn head_of(row: &str) -> Option<Option<&str>> {
    match row.trim_start().split_at_checked(1)? {
        ("!", rest) => {
            let name = rest.split_whitespace().next().unwrap_or_default();
            Some(Some(name.split('-').next().unwrap_or_default()))
        }
        ("$", _) => Some(None),
        _ => None,
    }
}

fn heads(name: &str, text: &str) -> Result<Vec<Head>, TraceError> {
    let mut heads = Vec::new();
    for row in lines(name, text) {
        let (line, row) = row?;
        if let Some(Some(block)) = head_of(row) {
            check_rows(heads.len()).map_err(|fault| TraceError::new(name, Some(line), fault))?;
            heads.push(Head { line, name: block.into() });
        }
    }
    Ok(heads)
}

/// The block of each joint; of names without side those of one leg, with a note.
fn chosen(heads: &[Head], how: &ReadOptions<'_>, notes: &mut Vec<String>) -> Result<Vec<(Joint, usize)>, Fault> {
    let output = |name: String| Output { group: String::new(), name, is_angle: true, columns: [None; 3] };
    let mut outputs: Vec<Output> = heads.iter().map(|head| output(head.name.clone())).collect();
    let is_sideless = |output: &Output| sideless_of(&output.name).is_some();
    if how.map.is_empty() && !outputs.iter().any(|output| output.joint().is_some()) && outputs.iter().any(is_sideless) {
        let is_right = matches!(how.sideless, Some(Joint::RightHip | Joint::RightKnee));
        let side = if is_right { "Right" } else { "Left" };
        let named: Vec<String> = outputs.iter().filter(|output| is_sideless(output)).map(Output::label).collect();
        outputs.iter_mut().filter(|output| is_sideless(output)).for_each(|output| output.name.insert_str(0, side));
        notes.push(format!(
            "{} name no side; they are read as those of the {} leg.",
            listed(&named),
            side.to_lowercase()
        ));
    }
    outputs::choose(&outputs, "subjects", how)
}

/// The numbers of a block.
struct Block {
    head: usize,
    /// The first number of each row.
    values: Vec<f64>,
    lines: RowLines,
    /// Some row has more numbers.
    has_more: bool,
}

/// Reads the blocks of these heads, in this order.
fn read(name: &str, text: &str, heads: &[Head], wanted: &[usize]) -> Result<Vec<Block>, TraceError> {
    let block = |&head: &usize| Block { head, values: Vec::new(), lines: RowLines::default(), has_more: false };
    let mut blocks: Vec<Block> = wanted.iter().map(block).collect();
    let mut begun = 0;
    let mut open: Vec<usize> = Vec::new();
    for row in lines(name, text) {
        let (line, row) = row?;
        match head_of(row) {
            Some(Some(_)) => {
                open = (0..wanted.len()).filter(|&index| wanted[index] == begun).collect();
                begun += 1;
                continue;
            }
            Some(None) => {
                open.clear();
                continue;
            }
            None if row.trim().is_empty() || row.trim_start().starts_with('#') => continue,
            None => {}
        }
        for &index in &open {
            let block = &mut blocks[index];
            let at = |f: Fault| TraceError::new(name, Some(line), f).in_column(0, &heads[block.head].name);
            check_rows(block.values.len()).map_err(at)?;
            let mut fields = row.split_whitespace();
            let value = number_or_missing(fields.next().unwrap_or_default(), true).map_err(at)?;
            for field in fields {
                number_or_missing(field, true).map_err(at)?;
                block.has_more = true;
            }
            block.values.push(value);
            block.lines.push(line);
        }
    }
    Ok(blocks)
}

/// The only number of a block, which must be as `is` says.
fn one(
    name: &str,
    heads: &[Head],
    block: &Block,
    allowed: &'static str,
    is: impl Fn(f64) -> bool,
) -> Result<f64, TraceError> {
    match block.values.as_slice() {
        &[value] if is(value) => Ok(value),
        values => {
            let found = values.iter().take(3).map(f64::to_string).collect::<Vec<_>>().join(", ");
            let found = if found.is_empty() { "missing".into() } else { found };
            let head = &heads[block.head];
            let fault =
                Fault::HeaderField { field: short(&head.name), found, allowed: format!("one number: {allowed}") };
            Err(TraceError::new(name, Some(head.line), fault))
        }
    }
}

/// By how many points the cycle of the right leg begins after that of the left one.
fn moved(
    name: &str,
    heads: &[Head],
    contacts: [Option<&Block>; 2],
    points: usize,
    notes: &mut Vec<String>,
) -> Result<usize, TraceError> {
    let percent = |block: &Block| one(name, heads, block, CONTACT, |v| (20.0..=80.0).contains(&v));
    let (percent, by) = match contacts {
        [Some(left), _] => (percent(left)?, "by `LeftOppositeFootContact`"),
        [None, Some(right)] => (100.0 - percent(right)?, "by `RightOppositeFootContact`"),
        [None, None] => (HALF_PERCENT, "assumed, because the file has no `LeftOppositeFootContact`"),
    };
    let intervals = points - 1;
    let steps = (percent / 100.0 * intervals as f64).round() as usize;
    notes.push(format!(
        "The cycle of the right leg begins at {percent:.1} % of that of the left leg ({by}); it is moved there, by {steps} of {intervals} points."
    ));
    Ok(steps)
}

/// A closed cycle, moved to later by a number of points.
fn turned(values: &[f64], steps: usize) -> Vec<f64> {
    let intervals = values.len().saturating_sub(1).max(1);
    let back = steps % intervals;
    if back == 0 {
        return values.to_vec();
    }
    (0..values.len()).filter_map(|n| values.get((n + intervals - back) % intervals).copied()).collect()
}
