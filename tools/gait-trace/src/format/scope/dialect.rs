//! Recognises the oscilloscope that wrote a file by the first lines.

use crate::format::text_table::bare_lines;

/// A header must end within this many lines.
pub(super) const MAX_HEADER_LINES: usize = 64;

/// The make of the oscilloscope and the layout of its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dialect {
    RigolSequence,
    RigolSteps,
    RigolTime,
    RigolInline,
    Siglent,
    TektronixSideBySide,
    Tektronix,
    Keysight,
    KeysightOneLine,
}

impl Dialect {
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::RigolSequence | Self::RigolSteps => "Rigol, start and increment",
            Self::RigolTime => "Rigol, time column",
            Self::RigolInline => "Rigol, t0 and tInc",
            Self::Siglent => "Siglent",
            Self::TektronixSideBySide => "Tektronix, header beside the rows",
            Self::Tektronix => "Tektronix",
            Self::Keysight | Self::KeysightOneLine => "Keysight",
        }
    }
}

/// The dialect of a text; `None` if it is not an oscilloscope export.
pub(crate) fn dialect_of(text: &str) -> Option<Dialect> {
    let head: Vec<String> = bare_lines(text)
        .map(|row| row.trim().chars().take(400).collect::<String>().to_ascii_lowercase().replace(['"', ' ', '\t'], ""))
        .filter(|row| !row.is_empty())
        .take(MAX_HEADER_LINES)
        .collect();
    let (first, second) = (head.first()?.as_str(), head.get(1).map_or("", String::as_str));
    let any = |start: &str| head.iter().any(|row| row.starts_with(start));
    if first.contains("tinc=") {
        return Some(Dialect::RigolInline);
    }
    if first.starts_with("x,") && second.starts_with("sequence,") {
        return Some(Dialect::RigolSequence);
    }
    if first.starts_with("x,") && second.starts_with("second,") {
        return Some(Dialect::RigolTime);
    }
    if first.contains("start,increment") && second.starts_with("volt") {
        return Some(Dialect::RigolSteps);
    }
    if first.starts_with("x-axis,") || first.starts_with("x_axis,channel") {
        let has_units = second.starts_with(|c: char| c.is_ascii_alphabetic());
        return Some(if has_units { Dialect::Keysight } else { Dialect::KeysightOneLine });
    }
    if first.starts_with("sec,volt") || first.starts_with("second,volt1") {
        return Some(Dialect::KeysightOneLine);
    }
    if first.starts_with("recordlength,analog") || (any("second,volt") || any("second,value")) {
        return Some(Dialect::Siglent);
    }
    if first.starts_with("recordlength,") && first.split(',').count() >= 5 {
        return Some(Dialect::TektronixSideBySide);
    }
    let tektronix = any("sampleinterval,") || any("recordlength,") || first.starts_with("model,");
    (tektronix && any("time,")).then_some(Dialect::Tektronix)
}
