//! Columns of a CSV file that tell recordings apart, such as subject and trial: rows of several recordings are never read as one.
//!
//! Such a column is recognised by its name, or by long blocks of rows with the same text ([`row_labels`](super::row_labels)). By its name it has words or whole numbers, and fewer values than half its rows: a column with another
//! value in nearly every row counts rows. The caller's [`RowFilter`] chooses the rows.

use crate::clean::rules::MOST_PERCENT_ROWS;
use crate::fault::{Fault, TraceError};
use crate::format::row_labels::Label;
use crate::format::text_table::{column_called, listed, short};
use crate::options::RowFilter;
use crate::shell_word;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Names of columns that separate recordings, in lower case, without blanks and signs.
const NAMES: [&str; 53] = [
    "subject",
    "subj",
    "sub",
    "participant",
    "patient",
    "person",
    "proband",
    "volunteer",
    "user",
    "trial",
    "session",
    "recording",
    "record",
    "run",
    "take",
    "visit",
    "condition",
    "dataset",
    "file",
    "side",
    "leg",
    "limb",
    "name",
    "sujeto",
    "proefpersoon",
    "pat",
    "patid",
    "pid",
    "mrn",
    "group",
    "cond",
    "day",
    "rep",
    "repetition",
    "athlete",
    "bout",
    "probandennummer",
    "patientennummer",
    "versuch",
    "versuchsperson",
    "testperson",
    "essai",
    "walkno",
    "player",
    "video",
    "clip",
    "trackid",
    "bodyid",
    "actor",
    "set",
    "human",
    "animal",
    "skeleton",
];
/// What may follow such a name.
const ENDS: [&str; 8] = ["id", "no", "nr", "num", "number", "name", "code", "label"];
/// The names of these that are sides.
const SIDES: [&str; 3] = ["side", "leg", "limb"];
/// A column with more values counts rows.
const MOST_VALUES: usize = 1000;

/// Whether a heading is that of a column that tells recordings apart.
fn is_mark(heading: &str) -> bool {
    let plain = plain(heading);
    plain == "id"
        || NAMES.iter().any(|name| plain.strip_prefix(name).is_some_and(|end| end.is_empty() || ENDS.contains(&end)))
}

fn plain(text: &str) -> String {
    text.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect()
}

/// A column that may tell recordings apart, with its values and the number of rows of each.
struct Mark {
    index: usize,
    heading: String,
    values: BTreeMap<String, usize>,
    /// A value is a fraction, or there are too many values.
    is_other: bool,
}

impl Mark {
    fn take(&mut self, field: &str) {
        if self.is_other || field.is_empty() {
            return;
        }
        if let Some(rows) = self.values.get_mut(field) {
            *rows += 1;
            return;
        }
        let is_fraction = field.parse::<f64>().is_ok_and(|number| number.fract() != 0.0);
        self.is_other = is_fraction || self.values.len() == MOST_VALUES;
        self.values.insert(field.to_owned(), 1);
    }

    /// Whether there is another value in nearly every row.
    fn counts_rows(&self) -> bool {
        self.values.len() > 1 && 2 * self.values.len() > self.values.values().sum::<usize>()
    }

    fn listed(&self) -> String {
        listed_values(&self.values)
    }
}

/// Values, each with its number of rows, in words.
fn listed_values(values: &BTreeMap<String, usize>) -> String {
    const MOST: usize = 24;
    let each = |(value, rows): (&String, &usize)| format!("`{}` ({rows} rows)", short(value));
    let mut text = values.iter().take(MOST).map(each).collect::<Vec<_>>().join(", ");
    if values.len() > MOST {
        text += &format!(" and {} more", values.len() - MOST);
    }
    text
}

/// Whether the times are percent of a cycle, in which labels are phases.
fn is_percent(time_s: &[f64]) -> bool {
    let is = |first: &f64, last: &f64| first.abs() < 0.1 && (last - 100.0).abs() < 0.1;
    time_s.len() <= MOST_PERCENT_ROWS && time_s.first().zip(time_s.last()).is_some_and(|(first, last)| is(first, last))
}

/// The caller's filter of a column, and the values that the column has.
struct Filter {
    index: usize,
    rows: RowFilter,
    seen: Mark,
}

/// The columns that tell recordings apart, and the rows that are read.
pub(crate) struct RowMarks {
    marks: Vec<Mark>,
    labels: Vec<Label>,
    filters: Vec<Filter>,
    rows: usize,
    taken: usize,
}

impl RowMarks {
    /// The columns of a header; those that are `used` as time or joint tell nothing apart.
    pub(crate) fn of(headings: &[String], used: &[usize], only: &[RowFilter]) -> Result<Self, Fault> {
        let mark =
            |index: usize| Mark { index, heading: headings[index].clone(), values: BTreeMap::new(), is_other: false };
        let filter = |rows: &RowFilter| {
            let missing = || Fault::WhereColumn { wanted: rows.column.clone(), have: listed(headings) };
            let index = column_called(headings, &rows.column).ok_or_else(missing)?;
            Ok(Filter { index, rows: rows.clone(), seen: mark(index) })
        };
        let filters = only.iter().map(filter).collect::<Result<Vec<_>, _>>()?;
        let is_mark = |index: &usize| is_mark(&headings[*index]) && !used.contains(index);
        let marks = (0..headings.len()).filter(is_mark).map(mark).collect();
        let is_free = |index: &usize| !is_mark(index) && !used.contains(index);
        let labels =
            (0..headings.len()).filter(is_free).filter_map(|index| Label::of(index, &headings[index])).collect();
        Ok(Self { marks, labels, filters, rows: 0, taken: 0 })
    }

    /// Whether a row is read.
    pub(crate) fn takes(&mut self, fields: &[Cow<'_, str>]) -> bool {
        let field = |index: usize| fields.get(index).map_or("", |field| &**field);
        self.rows += 1;
        let mut taken = true;
        for filter in &mut self.filters {
            filter.seen.take(field(filter.index));
            taken &= filter.rows.takes(field(filter.index));
        }
        if taken {
            let row = self.taken;
            self.labels.retain_mut(|label| label.take(row, field(label.index)));
            self.taken += 1;
            self.marks.iter_mut().for_each(|mark| mark.take(field(mark.index)));
        }
        taken
    }

    /// Whether no field of a further row matters: every row is read, and no column may still tell recordings apart.
    pub(crate) fn are_settled(&self) -> bool {
        self.marks.is_empty() && self.labels.is_empty() && self.filters.is_empty()
    }

    /// A row is read, and no column matters ([`Self::are_settled`]).
    pub(crate) fn take_unmarked(&mut self) {
        self.rows += 1;
        self.taken += 1;
    }

    /// Whether the rows that were read are of the left leg, where a column names the leg.
    pub(crate) fn is_left(&self) -> Option<bool> {
        let side = self.marks.iter().find(|mark| SIDES.iter().any(|side| plain(&mark.heading).starts_with(side)))?;
        match (side.values.len(), plain(side.values.keys().next()?).as_str()) {
            (1, "l" | "left" | "lt") => Some(true),
            (1, "r" | "right" | "rt") => Some(false),
            _ => None,
        }
    }

    /// An error if the rows that were read are of several recordings, or if no row is; `line` is that of the header, and `time_s` are the
    /// times of the rows.
    pub(crate) fn check(
        &self,
        name: &str,
        line: u64,
        time_s: &[f64],
        notes: &mut Vec<String>,
    ) -> Result<(), TraceError> {
        if self.taken == 0 && self.rows > 0 {
            let takes_none = |filter: &&Filter| !filter.seen.values.keys().any(|value| filter.rows.takes(value));
            // Each value may be there, but in other rows than the others.
            let filter = self.filters.iter().find(takes_none).or(self.filters.last());
            if let Some(Filter { index, rows, seen }) = filter {
                let fault = Fault::NoSuchRows { value: short(&rows.value), have: seen.listed() };
                return Err(TraceError::new(name, Some(line), fault).in_column(*index, &seen.heading));
            }
        }
        let is_filtered = |mark: &&Mark| self.filters.iter().any(|filter| filter.index == mark.index);
        for mark in self.marks.iter().filter(|mark| !mark.is_other && !is_filtered(mark)) {
            let heading = short(&mark.heading);
            match mark.values.keys().next().map(|value| short(value)) {
                Some(first) if mark.values.len() > 1 && !mark.counts_rows() => {
                    let [example, all] = [&*first, "*"].map(|value| shell_word(format!("{heading}={value}")));
                    let fault = Fault::SeveralRecordings { values: mark.listed(), example, all };
                    return Err(TraceError::new(name, Some(line), fault).in_column(mark.index, &mark.heading));
                }
                Some(value) if mark.values.len() == 1 => notes.push(format!("`{heading}` is `{value}` in all rows.")),
                _ => {}
            }
        }
        let is_chosen = |index: usize| self.filters.iter().any(|filter| filter.index == index);
        let mut labels = self.labels.iter().filter(|label| !is_chosen(label.index) && !is_percent(time_s));
        if let Some(label) = labels.find(|label| label.marks(time_s)) {
            let heading = short(&label.heading);
            let first = label.values.keys().next().map(|value| short(value)).unwrap_or_default();
            let [example, all] = [&*first, "*"].map(|value| shell_word(format!("{heading}={value}")));
            let fault = Fault::SeveralRecordings { values: listed_values(&label.values), example, all };
            return Err(TraceError::new(name, Some(line), fault).in_column(label.index, &label.heading));
        }
        let (taken, rows) = (self.taken, self.rows);
        for Filter { rows: filter, seen, .. } in &self.filters {
            let heading = short(&seen.heading);
            notes.push(if filter.takes_all() {
                format!(
                    "`{heading}` has {} values; rows of all of them are read as one recording, as requested.",
                    seen.values.len()
                )
            } else {
                format!(
                    "Only rows with `{}` in `{heading}` are read, as requested: {taken} of {rows}.",
                    short(&filter.value)
                )
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(headings: &[&str], rows: &[&[&str]], only: &[&str]) -> Result<(Vec<String>, usize), String> {
        let headings: Vec<String> = headings.iter().map(|heading| (*heading).to_owned()).collect();
        let only: Vec<RowFilter> = only.iter().map(|text| text.parse().unwrap()).collect();
        let mut marks = RowMarks::of(&headings, &[0], &only).map_err(|fault| fault.to_string())?;
        let fields = |row: &[&str]| row.iter().map(|field| Cow::Owned((*field).to_owned())).collect::<Vec<_>>();
        let taken = rows.iter().filter(|row| marks.takes(&fields(row))).count();
        let mut notes = Vec::new();
        marks.check("a.csv", 1, &[], &mut notes).map_err(|error| error.to_string())?;
        Ok((notes, taken))
    }

    #[test]
    fn names_of_subjects_and_trials_are_recognised() {
        for name in
            ["subject", "Subject ID", "id", "participant_no", "trial", "Trial Number", "side", "PatientName", "run"]
        {
            assert!(is_mark(name), "{name}");
        }
        for name in ["subjective", "idle", "trials_left", "speed", "frame", "stride", "side_force", "running", "width"]
        {
            assert!(!is_mark(name), "{name}");
        }
    }

    #[test]
    fn several_values_are_an_error_and_one_is_a_note() {
        let rows: Vec<Vec<&str>> = (0..8).map(|n| vec!["0", if n % 2 == 0 { "Anna" } else { "Bert" }]).collect();
        let rows: Vec<&[&str]> = rows.iter().map(Vec::as_slice).collect();
        let error = check(&["t", "subject"], &rows, &[]).unwrap_err();
        assert!(error.starts_with("a.csv:1: column 2 `subject`: "), "{error}");
        assert!(
            error.contains("`Anna` (4 rows), `Bert` (4 rows)") && error.contains("`--where subject=Anna`"),
            "{error}"
        );
        let (notes, taken) = check(&["t", "subject"], &rows, &["subject=Bert"]).unwrap();
        assert!(
            taken == 4 && notes == ["Only rows with `Bert` in `subject` are read, as requested: 4 of 8."],
            "{notes:?}"
        );
        let (notes, taken) = check(&["t", "subject"], &rows, &["2=*"]).unwrap();
        assert!(taken == 8 && notes[0].contains("has 2 values; rows of all of them"), "{notes:?}");
        let (notes, _) = check(&["t", "subject"], &rows[..1], &[]).unwrap();
        assert_eq!(notes, ["`subject` is `Anna` in all rows."]);
        assert!(check(&["t", "subject"], &rows, &["subject=Carl"]).unwrap_err().contains("no row has `Carl`"));
        assert!(check(&["t", "subject"], &rows, &["who=Anna"]).unwrap_err().contains("names the column `who`"));
    }

    #[test]
    fn a_column_that_counts_rows_tells_nothing_apart() {
        let rows: Vec<[String; 2]> = (0..40).map(|n| ["0".into(), n.to_string()]).collect();
        let rows: Vec<Vec<&str>> = rows.iter().map(|row| row.iter().map(String::as_str).collect()).collect();
        let rows: Vec<&[&str]> = rows.iter().map(Vec::as_slice).collect();
        assert_eq!(check(&["t", "id"], &rows, &[]).unwrap().0, Vec::<String>::new());
        let fractions: Vec<&[&str]> = vec![&["0", "0.5"], &["0", "0.5"], &["0", "1.5"], &["0", "1.5"]];
        assert!(check(&["t", "trial"], &fractions, &[]).is_ok());
    }
}
