//! Parses the five header lines of a Visual3D text file into signals.

use crate::fault::{Fault, TraceError};
use crate::format::outputs::Output;
use crate::format::text_table::{Delimiter, bare_lines, short};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Kinds of signals whose joint angles are found by name.
const ANGLES: [&str; 2] = ["LINK_MODEL_BASED", "DERIVED"];
/// The kind of the columns of times.
const FRAMES: &str = "FRAME_NUMBERS";
/// Kinds of signals that a third line is recognised by.
const KINDS: [&str; 9] =
    ["LINK_MODEL_BASED", "DERIVED", FRAMES, "TARGET", "ANALOG", "FORCE", "COP", "KINETIC_KINEMATIC", "EVENT_LABEL"];
/// What each header line holds.
const LINES: [&str; 5] = ["file names", "signal names", "signal types", "folders", "`ITEM` and components"];

/// Whether the text begins with the header of a Visual3D file.
pub(super) fn begins(text: &str) -> bool {
    let mut rows = bare_lines(text).map(|row| row.split('\t').map(str::trim));
    let is_kind = |field: &str| KINDS.contains(&field);
    let third = rows.nth(2).is_some_and(|mut row| row.next() == Some("") && row.next().is_some_and(is_kind));
    third || rows.nth(1).is_some_and(|mut row| is_item(row.next().unwrap_or_default()) && row.next().is_some())
}

fn is_item(field: &str) -> bool {
    field.eq_ignore_ascii_case("item")
}

/// One signal: the columns of its components.
struct Signal {
    /// Name of the recording, without its folders.
    file: String,
    name: String,
    kind: String,
    folder: String,
    /// Which of several signals of the same file, name, kind and folder it is, from 1: each is a range of the recording.
    range: usize,
    /// The number of the first component, if components are numbers.
    first: Option<usize>,
    columns: [Option<usize>; 3],
}

/// The parsed header.
pub(super) struct Header {
    /// The line of the signal names.
    pub(super) line: u64,
    pub(super) outputs: Vec<Output>,
    signals: Vec<Signal>,
    /// Number of columns, with that of `ITEM`.
    pub(super) width: usize,
}

impl Header {
    pub(super) fn parse<'a>(
        name: &str,
        rows: &mut impl Iterator<Item = Result<(u64, &'a str), TraceError>>,
    ) -> Result<Self, TraceError> {
        let mut lines: Vec<(u64, Vec<Cow<'a, str>>)> = Vec::new();
        for what in LINES {
            let missing = || {
                let fault = Fault::HeaderField {
                    field: what.replace('`', ""),
                    found: "missing".into(),
                    allowed: format!("five header lines: {}", LINES.join(", ")),
                };
                TraceError::new(name, lines.last().map(|(line, _)| *line), fault)
            };
            let (line, row) = rows.next().ok_or_else(missing)??;
            let fields = Delimiter::Char('\t').fields(row).map_err(|fault| TraceError::new(name, Some(line), fault))?;
            lines.push((line, fields));
        }
        let [files, names, kinds, folders, components] = [0, 1, 2, 3, 4].map(|index| lines[index].1.as_slice());
        let line = lines[1].0;
        let width = components.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1);
        if !components.first().is_some_and(|field| is_item(field)) {
            let (field, found) =
                ("the first column".into(), format!("`{}`", short(components.first().map_or("", |f| f))));
            let fault = Fault::HeaderField { field, found, allowed: "`ITEM`, in the fifth line".into() };
            return Err(TraceError::new(name, Some(lines[4].0), fault));
        }
        let at = |row: &[Cow<'_, str>], column: usize| row.get(column).map_or(String::new(), ToString::to_string);
        let mut signals: Vec<Signal> = Vec::new();
        let mut ranges: BTreeMap<[String; 4], usize> = BTreeMap::new();
        for (column, component) in components.iter().enumerate().take(width).skip(1) {
            let path = at(files, column);
            let file = path.rsplit(['\\', '/']).next().unwrap_or_default().to_owned();
            let (name, kind, folder) = (at(names, column), at(kinds, column), at(folders, column));
            let last = signals
                .last()
                .filter(|last| (&last.file, &last.name, &last.kind, &last.folder) == (&file, &name, &kind, &folder));
            let component = component.to_ascii_lowercase();
            let named = ["x", "y", "z"].iter().position(|axis| *axis == component);
            // Components that are numbers count from that of the first column of the signal.
            let number = component.parse::<usize>().ok();
            let first = last.and_then(|last| last.first);
            let axis = match (named, number, first) {
                (Some(axis), ..) => axis,
                (None, Some(number), Some(first)) if number >= first => number - first,
                (None, Some(_), _) => 0,
                (None, None, _) => continue,
            };
            // A pose has more than three components, and is no angle.
            if axis > 2 {
                continue;
            }
            if last.is_none_or(|last| last.columns[axis].is_some()) {
                let key = [file.clone(), name.clone(), kind.clone(), folder.clone()];
                let range = *ranges.entry(key).and_modify(|range| *range += 1).or_insert(1);
                signals.push(Signal { file, name, kind, folder, range, first: number, columns: [None; 3] });
            }
            if let Some(signal) = signals.last_mut() {
                signal.columns[axis] = Some(column);
            }
        }
        let outputs = outputs(&signals);
        Ok(Self { line, outputs, signals, width })
    }

    /// An error if the type of a signal that the map chose is one that is no angle.
    pub(super) fn check_kind(&self, output: usize) -> Result<(), Fault> {
        let Signal { name, kind, .. } = &self.signals[output];
        if !KINDS.contains(&kind.as_str()) || ANGLES.contains(&kind.as_str()) {
            return Ok(());
        }
        Err(Fault::NoAngle { column: short(name), what: format!("the type `{kind}`") })
    }

    /// The column of the times of a signal's recording, in seconds.
    pub(super) fn time_of(&self, output: usize) -> Option<usize> {
        let of = &self.signals[output];
        let is_time = |signal: &&Signal| {
            (signal.kind.as_str(), signal.file.as_str(), signal.range) == (FRAMES, of.file.as_str(), of.range)
                && signal.name.eq_ignore_ascii_case("time")
        };
        self.signals.iter().find(is_time)?.columns[0]
    }
}

/// The signals as outputs. They are grouped by what distinguishes those that are joint angles: file, range, folder.
fn outputs(signals: &[Signal]) -> Vec<Output> {
    let output = |group: String, signal: &Signal| Output {
        group,
        name: signal.name.clone(),
        is_angle: ANGLES.contains(&signal.kind.as_str()),
        columns: signal.columns,
    };
    let joints: Vec<&Signal> =
        signals.iter().filter(|signal| output(String::new(), signal).joint().is_some()).collect();
    let several = |of: fn(&Signal) -> (&str, usize)| joints.iter().skip(1).any(|signal| of(signal) != of(joints[0]));
    let (files, folders) = (several(|s| (s.file.as_str(), 0)), several(|s| (s.folder.as_str(), 0)));
    let ranges = several(|s| ("", s.range));
    signals
        .iter()
        .map(|signal| {
            let range = if ranges { format!("#{}", signal.range) } else { String::new() };
            let file = if files || ranges { format!("{}{range}", signal.file) } else { String::new() };
            let folder = if folders { signal.folder.as_str() } else { "" };
            let group = [file.as_str(), folder].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>();
            output(group.join(":"), signal)
        })
        .collect()
}
