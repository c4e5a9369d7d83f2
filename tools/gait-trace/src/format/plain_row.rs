//! Rows of plain numbers, as nearly all rows of a table are, in one pass over their text: the line is not searched for its end, nor for its
//! fields, nor is any field copied.
//!
//! A row that has anything else, a quote, a blank, a missing value, is none of them: it is read field by field
//! ([`text_table`](super::text_table)), which gives the same numbers for the rows that are.

use crate::format::number::{decimal, leading};
use crate::format::text_table::{Delimiter, MAX_LINE, is_seen};
use memchr::memchr2;

/// How the rows of a table are read.
pub(crate) struct PlainRow {
    delimiter: u8,
    /// Whether the numbers of each column are used. The others may be words.
    used: Vec<bool>,
}

impl PlainRow {
    /// For a table of so many columns; `None` if its fields are not between characters of ASCII.
    pub(crate) fn of(delimiter: Delimiter, columns: usize, used: impl Fn(usize) -> bool) -> Option<Self> {
        match delimiter {
            Delimiter::Char(c @ (',' | ';' | '\t')) => {
                Some(Self { delimiter: c as u8, used: (0..columns).map(used).collect() })
            }
            _ => None,
        }
    }

    /// Columns of a row.
    pub(crate) fn columns(&self) -> usize {
        self.used.len()
    }

    /// Reads the row at the beginning of a text, a number of each column that is used; its length with its end, LF or CR LF. `None` if it is
    /// no row of plain numbers, of as many fields as there are columns.
    #[inline]
    pub(crate) fn read(&self, text: &str, numbers: &mut [f64]) -> Option<usize> {
        let (last, others) = numbers.get_mut(..self.used.len())?.split_last_mut()?;
        let mut rest = text.as_bytes();
        for (column, number) in others.iter_mut().enumerate() {
            let (value, length) = match leading(rest) {
                Some((value, length)) if rest.get(length) == Some(&self.delimiter) => (value, length),
                _ => self.other(&text[text.len() - rest.len()..], column)?,
            };
            *number = value;
            rest = rest.get(length..)?.strip_prefix(&[self.delimiter])?;
        }
        let (value, length) = match leading(rest) {
            Some((value, length)) if matches!(rest.get(length), Some(b'\n' | b'\r')) => (value, length),
            _ => self.other(&text[text.len() - rest.len()..], self.used.len() - 1)?,
        };
        *last = value;
        let rest = rest.get(length..)?;
        let rest = rest.strip_prefix(b"\r").unwrap_or(rest).strip_prefix(b"\n")?;
        let length = text.len() - rest.len();
        (length <= MAX_LINE).then_some(length)
    }

    /// A field of more digits, or of a column that is not used, and its length: up to the delimiter or the end of the line.
    #[cold]
    fn other(&self, text: &str, column: usize) -> Option<(f64, usize)> {
        let length = memchr2(self.delimiter, b'\n', text.as_bytes())?;
        let field = &text[..length];
        let field = field.strip_suffix('\r').unwrap_or(field);
        let is_word = |byte: u8| is_seen(Some(&byte)) && !matches!(byte, b'"' | b'#');
        let value = match self.used[column] {
            true => decimal(field)?,
            false if field.bytes().all(is_word) => f64::NAN,
            false => return None,
        };
        Some((value, field.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::text_table::{bare_lines, is_blank, is_comment, number_or_missing};
    use proptest::prelude::*;

    /// What is read has the line, the fields and the bits that it has field by field.
    fn check(text: &str, delimiter: char, used: &[bool]) -> Result<bool, TestCaseError> {
        let plain = PlainRow::of(Delimiter::Char(delimiter), used.len(), |column| used[column]).unwrap();
        let mut numbers = vec![0.0; plain.columns()];
        let Some(length) = plain.read(text, &mut numbers) else { return Ok(false) };
        prop_assert!(text[..length].ends_with('\n'));
        let row = bare_lines(text).next().unwrap();
        prop_assert_eq!(text[..length].trim_end_matches(['\r', '\n']), row);
        prop_assert!(!is_blank(row) && !is_comment(row));
        let fields = Delimiter::Char(delimiter).fields(row).unwrap();
        prop_assert_eq!(fields.len(), used.len());
        for ((field, number), _) in fields.iter().zip(&numbers).zip(used).filter(|(_, used)| **used) {
            let expected = number_or_missing(field, delimiter != ',').map(f64::to_bits);
            prop_assert!(expected.is_ok_and(|bits| bits == number.to_bits()), "{} {}", field, number);
        }
        Ok(true)
    }

    proptest! {
        /// Anything at all, of which some are rows.
        #[test]
        fn a_row_that_is_read_has_the_numbers_of_its_fields(
            fields in prop::collection::vec("-?[0-9]{1,20}([.][0-9]{0,20})?([eE]-?[0-9]{1,3})?|[-+.,;\t\r\" #0-9a-zé\u{2212}]{0,4}", 1..5),
            delimiter in prop::sample::select(vec![',', ';', '\t']),
            end in "\r{0,2}\n?.{0,10}",
            mut used in prop::collection::vec(any::<bool>(), 5),
        ) {
            used.truncate(fields.len());
            used[0] |= !used.contains(&true);
            let text = fields.join(&delimiter.to_string()) + &end;
            check(&text, delimiter, &used)?;
        }

        /// Rows of numbers, and of words in columns that are not used, are read.
        #[test]
        fn rows_of_numbers_are_read(
            numbers in prop::collection::vec(any::<f32>().prop_filter("finite", |x| x.is_finite()), 1..9),
            decimals in 0_usize..12,
            word in "[!$-+./-:<-~]{0,12}",
            end in "\r?\n([0-9,.]{0,30}\n)?",
        ) {
            let mut fields: Vec<String> = numbers.iter().map(|x| format!("{:.decimals$}", f64::from(*x))).collect();
            let mut used = vec![true; fields.len()];
            prop_assert!(check(&(fields.join(",") + &end), ',', &used)?);
            fields.push(word);
            used.push(false);
            prop_assert!(check(&(fields.join("\t") + &end), '\t', &used)?);
        }
    }

    #[test]
    fn other_rows_are_left_to_the_fields() {
        for text in [
            "",
            "1,2",
            "1\n",
            "1,2,3\n",
            "1, 2\n",
            "1,\n",
            "1,\"2\"\n",
            "1,nan\n",
            "1,inf\n",
            "1,2\r",
            "1,2\r\r\n",
            "#1,2\n",
        ] {
            assert!(!check(text, ',', &[true, true]).unwrap(), "{text:?}");
        }
        assert!(!check("#,2\n", ',', &[false, true]).unwrap() && check(",2\n", ',', &[false, true]).unwrap());
        assert!(!check(&format!("1,{}\n", "7".repeat(MAX_LINE)), ',', &[true, false]).unwrap());
    }
}
