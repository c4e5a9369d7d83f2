//! Finds the header of a CSV file below lines of free text, as recorders write them: the name of the subject, the date, the rate.
//!
//! A header names a time and a joint, or the columns of the caller's map, and stands above rows of as many fields. Where exactly one line
//! below the first one does, it is the header. Where the first line is one, or a row of numbers, nothing is searched.

use crate::fault::{Fault, TraceError};
use crate::format::joint_names::{joint_of, sideless_of};
use crate::format::text_table::{Delimiter, column_called, finite, is_separator_line, lines};
use crate::format::time_names::{is_frame, stamp_of, time_of};
use crate::format::title;
use crate::format::unit::without_volts;
use crate::options::ReadOptions;
use std::borrow::Cow;

/// The header must be among this many lines.
const MOST_LINES: usize = 200;
/// Rows of units or of components may be between the header and the numbers.
const MOST_BETWEEN: usize = 3;

/// What the lines at the beginning of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preamble {
    /// The first line is the header, or a row of numbers, or nothing is known.
    None,
    /// The header is in this line.
    UpTo(u64),
    /// No header was found; the first row of numbers is in this line, and its number of fields differs from that of the first line.
    Unclear { first_row: u64, fields: usize },
}

/// Looks for the header.
///
/// # Errors
/// Several lines may be the header.
pub(crate) fn find(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<Preamble, TraceError> {
    let rows: Vec<(u64, &str)> = lines(name, text)
        .map_while(Result::ok)
        .filter(|(_, row)| !row.trim().is_empty() && !row.trim_start().starts_with('#') && !is_separator_line(row))
        .take(MOST_LINES)
        .collect();
    let split: Vec<(Delimiter, Vec<Cow<'_, str>>)> = rows
        .iter()
        .enumerate()
        .map(|(n, (_, row))| {
            let delimiter = Delimiter::of_line(row, rows[n + 1..].iter().map(|(_, row)| *row));
            (delimiter, delimiter.fields(row).unwrap_or_default())
        })
        .collect();
    let is_table = |n: usize| {
        let fields = split[n].1.len();
        split[n + 1..].iter().take(MOST_BETWEEN + 1).any(|row| is_numbers(row) && row.1.len().abs_diff(fields) <= 1)
    };
    let Some((first, rest)) = split.split_first() else { return Ok(Preamble::None) };
    if is_header(&first.1, how) || is_numbers(first) {
        return Ok(Preamble::None);
    }
    let found: Vec<u64> =
        (1..split.len()).filter(|&n| is_header(&split[n].1, how) && is_table(n)).map(|n| rows[n].0).collect();
    match found.as_slice() {
        [line] => Ok(Preamble::UpTo(*line)),
        [] => {
            let row = rest.iter().position(is_numbers).map(|n| (rows[n + 1].0, rest[n].1.len()));
            let differs = row.filter(|(_, fields)| fields.abs_diff(first.1.len()) > 1);
            Ok(differs.map_or(Preamble::None, |(first_row, fields)| Preamble::Unclear { first_row, fields }))
        }
        [one, other, ..] => Err(TraceError::new(name, Some(*one), Fault::SeveralHeaders { other: *other })),
    }
}

/// An error if a line above the header names another quantity than joint angles.
///
/// # Errors
/// The first such line.
pub(crate) fn check_titles(name: &str, text: &str, header: u64) -> Result<(), TraceError> {
    for (line, row) in lines(name, text).map_while(Result::ok).take_while(|(line, _)| *line < header) {
        let fields = Delimiter::of_header(row).fields(row).unwrap_or_default();
        if let Some(what) = title::other_in_line(&fields) {
            return Err(TraceError::new(name, Some(line), Fault::TitleOfOther { what }));
        }
    }
    Ok(())
}

/// Whether a row is of numbers, of which some may be missing.
fn is_numbers((delimiter, fields): &(Delimiter, Vec<Cow<'_, str>>)) -> bool {
    let comma = *delimiter != Delimiter::Char(',');
    let numbers = fields.iter().filter(|field| finite(field, comma).is_ok()).count();
    numbers >= 2 && 2 * numbers > fields.iter().filter(|field| !field.is_empty()).count()
}

/// Whether the fields are headings of a time and of a joint, by their names or by the caller's map.
fn is_header(fields: &[Cow<'_, str>], how: &ReadOptions<'_>) -> bool {
    let is_mapped = |wanted: &str| wanted.parse::<usize>().is_err() && column_called(fields, wanted).is_some();
    let is_joint =
        |field: &str| joint_of(without_volts(field)).is_some() || sideless_of(without_volts(field)).is_some();
    let is_time = |field: &str| time_of(field).is_some() || stamp_of(field).is_some() || is_frame(field);
    let has_time = how.rate_hz.is_some()
        || how.time.as_deref().map_or_else(|| fields.iter().any(|field| is_time(field)), is_mapped);
    let has_joint = how.map.iter().any(|(_, wanted)| is_mapped(wanted)) || fields.iter().any(|field| is_joint(field));
    has_time && has_joint && fields.iter().all(|field| finite(field, false).is_err())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Preamble {
        find("a.csv", text, &ReadOptions::default()).unwrap()
    }

    #[test]
    fn the_header_is_found_below_free_text() {
        let table = "time;left_hip;left_knee\n0;1;2\n0,01;2;3\n";
        assert_eq!(found(table), Preamble::None);
        assert_eq!(found(&format!("Patient: Max, born 1970\n\nRate: 200 Hz\n{table}")), Preamble::UpTo(4));
        assert_eq!(found("time,left_hip,left_knee\ns,deg,deg\n0,1,2\n"), Preamble::None);
        assert_eq!(found("Type,Name\ntime,left_hip\ns,deg\n0,1\n"), Preamble::UpTo(2));
        // A sentence about a knee is no header of a table.
        assert_eq!(
            found("Report,time of the left knee\na,b,c,d\n0,1,2,3\n"),
            Preamble::Unclear { first_row: 3, fields: 4 }
        );
        let remark = "Report\ntime,left knee\na\nb\nc\nd\n";
        assert_eq!(found(&format!("{remark}{table}")), Preamble::UpTo(7));
        assert_eq!(found("a,b\n0,1\n"), Preamble::None);
        assert_eq!(found("0,1\n1,2\n"), Preamble::None);
        assert_eq!(found(&format!("sep=;\n{table}")), Preamble::None);
        let commas = "Zeit;Knie links;Knie rechts;Hüfte links\n0,00;1,5;2,5;3,5\n";
        assert_eq!(found(&format!("Patient;Max\n{commas}")), Preamble::UpTo(2));
    }

    #[test]
    fn columns_of_the_map_make_a_header_and_two_headers_are_an_error() {
        let mut how = ReadOptions::default();
        how.add_map("time=clock,left_knee=C2").unwrap();
        assert_eq!(find("a", "Walk 1\nclock,C1,C2\n0,1,2\n", &how).unwrap(), Preamble::UpTo(2));
        let table = "time,left_hip\n0,1\n";
        let error = find("a.csv", &format!("Trials\n{table}Trial 2\n{table}"), &ReadOptions::default()).unwrap_err();
        assert!(error.to_string().starts_with("a.csv:2: this line and line 5 may be the header"), "{error}");
    }
}
