//! Columns of text that change in long blocks of rows, under a heading that is not on the list of names: they tell recordings apart too.
//!
//! A column called `who` with `Anna` in the first half of the rows and `Bert` in the second marks two recordings, whatever it is called.
//! Labels of phases and events come again with each stride, so their blocks are short or many.

use crate::format::text_table::is_missing;
use crate::format::time_names::{is_frame, is_time_like};
use std::collections::BTreeMap;

/// Most values of such a column.
const MOST_VALUES: usize = 50;
/// Shortest block of rows of a recording, seconds: longer than two slow strides.
const LEAST_S: f64 = 3.0;
/// Shortest block where no value comes again, seconds: longer than a phase of a stride.
const LEAST_ONCE_S: f64 = 1.5;
/// Most blocks for each value.
const MOST_BLOCKS: usize = 2;
/// Words of a state, in lower case, which are no names of persons or trials.
const STATES: [&str; 12] = ["true", "false", "yes", "no", "on", "off", "ok", "ja", "nein", "none", "valid", "invalid"];

/// A column of text and the blocks of its values.
pub(crate) struct Label {
    pub(crate) index: usize,
    pub(crate) heading: String,
    /// The number of rows of each value.
    pub(crate) values: BTreeMap<String, usize>,
    /// The first and the last row of each block.
    blocks: Vec<(usize, usize)>,
    /// The value of the row before, if it has one.
    last: Option<String>,
}

impl Label {
    /// A column, unless its heading is that of a time or a counter.
    pub(crate) fn of(index: usize, heading: &str) -> Option<Self> {
        let label = Self { index, heading: heading.into(), values: BTreeMap::new(), blocks: vec![], last: None };
        (!is_frame(heading) && !is_time_like(heading)).then_some(label)
    }

    /// Takes the field of a row; false if the column is none of labels.
    pub(crate) fn take(&mut self, row: usize, field: &str) -> bool {
        if is_missing(field) {
            self.last = None;
            return true;
        }
        if let (true, Some(block)) = (self.last.as_deref() == Some(field), self.blocks.last_mut()) {
            block.1 = row;
        } else {
            let is_number = field.replace(',', ".").parse::<f64>().is_ok();
            let is_word = field.chars().any(char::is_alphabetic);
            if is_number || !is_word || STATES.contains(&field.to_lowercase().as_str()) {
                return false;
            }
            self.blocks.push((row, row));
            self.last = Some(field.to_owned());
        }
        match self.values.get_mut(field) {
            Some(rows) => *rows += 1,
            None => {
                self.values.insert(field.to_owned(), 1);
            }
        }
        self.values.len() <= MOST_VALUES && self.blocks.len() <= MOST_BLOCKS * MOST_VALUES
    }

    /// Whether its values are those of several recordings.
    pub(crate) fn marks(&self, time_s: &[f64]) -> bool {
        let least_s = if self.blocks.len() == self.values.len() { LEAST_ONCE_S } else { LEAST_S };
        let lasts = |&(first, last): &(usize, usize)| match (time_s.get(first), time_s.get(last)) {
            (Some(first), Some(last)) => last - first >= least_s,
            _ => false,
        };
        self.values.len() > 1 && self.blocks.len() <= MOST_BLOCKS * self.values.len() && self.blocks.iter().all(lasts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a column with these values of a row marks recordings, at 100 rows a second.
    fn marks(heading: &str, value: impl Fn(usize) -> &'static str) -> bool {
        let Some(mut label) = Label::of(1, heading) else { return false };
        let time_s: Vec<f64> = (0..1000).map(|n| f64::from(n) * 0.01).collect();
        (0..1000).all(|row| label.take(row, value(row))) && label.marks(&time_s)
    }

    #[test]
    fn labels_that_change_in_long_blocks_mark_recordings() {
        assert!(marks("who", |n| if n < 500 { "Anna" } else { "Bert" }));
        assert!(marks("code", |n| ["P1", "P2", "P3", "P4"][n / 250]));
    }

    #[test]
    fn phases_states_clocks_and_numbers_mark_none() {
        assert!(!marks("phase", |n| if n % 100 < 60 { "stance" } else { "swing" }));
        assert!(!marks("event", |n| if n % 100 == 0 { "contact" } else { "" }));
        assert!(!marks("valid", |n| if n < 500 { "True" } else { "False" }));
        assert!(!marks("date", |n| if n < 500 { "10:01 pm" } else { "10:02 pm" }));
        assert!(!marks("clock", |n| if n < 500 { "10:01" } else { "10:02" }));
        assert!(!marks("level", |n| if n < 500 { "1" } else { "2" }));
        assert!(!marks("who", |_| "Anna"));
        assert!(!marks("phase", |n| if n < 60 { "stance" } else { "swing" }));
    }
}
