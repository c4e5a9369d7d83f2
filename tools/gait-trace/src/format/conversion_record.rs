//! The record that `footfall convert` writes into a file: lines of a key and a value, and what they say of the signs.
//!
//! A program that saves the file again may put a byte order mark before it and fill its lines up with separators, as spreadsheets do: the
//! record is read all the same.

use crate::format::joint_names::joint_of;
use crate::format::text_table::BYTE_ORDER_MARK;
use crate::raw::{SignBasis, SignSource};
use joint_units::Joint;

/// Begins the first line of a CSV file with a record.
pub(crate) const CSV_MARK: &str = "# footfall convert ";
/// Begins the first line of the record in a motion file.
pub(crate) const MOT_MARK: &str = "footfall-convert=";
/// The key of the signs.
pub(crate) const SIGNS: &str = "signs";

/// Most lines of a record.
const MOST_LINES: usize = 1000;

/// Keys and values, in order.
pub(crate) struct Record(Vec<(String, String)>);

impl Record {
    /// The key of the program's version.
    pub(crate) const VERSION: &'static str = "footfall convert";

    /// The record of a CSV or a motion file; `None` for a file that is no conversion.
    pub(crate) fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        let lines = || bytes.split(|&byte| byte == b'\n').map(String::from_utf8_lossy).take(MOST_LINES);
        let first = lines().next()?;
        if let Some(version) = first.strip_prefix(CSV_MARK) {
            let comments = lines().skip(1).map_while(|line| bare(&line).strip_prefix("# ").map(str::to_owned));
            let pairs = comments.filter_map(|line| line.split_once(": ").map(owned));
            return Some(Self(std::iter::once(owned((Self::VERSION, bare(version)))).chain(pairs).collect()));
        }
        let header = || lines().take_while(|line| !line.trim().eq_ignore_ascii_case("endheader"));
        let version = header().find_map(|line| line.strip_prefix(MOT_MARK).map(str::to_owned))?;
        let pairs = header().filter_map(|line| line.split_once('=').map(owned));
        Some(Self(std::iter::once(owned((Self::VERSION, &version))).chain(pairs).collect()))
    }

    /// All values of a key.
    pub(crate) fn all<'r>(&'r self, key: &'r str) -> impl Iterator<Item = &'r str> {
        self.0.iter().filter(move |(name, _)| name == key).map(|(_, value)| value.as_str())
    }

    /// The first value of a key.
    pub(crate) fn one<'r>(&'r self, key: &'r str) -> Option<&'r str> {
        self.all(key).next()
    }

    /// What it says of the sign of the column with this name. What was assumed when the file was written is not known now either, and what
    /// the shape of the strides showed is shown by them again.
    pub(crate) fn sign_of(&self, column: &str) -> SignSource {
        let basis = joint_of(column).and_then(|(joint, _)| {
            let signs = self.one(SIGNS)?.split(',').filter_map(|sign| sign.trim().split_once(' '));
            let mut own = signs.filter(|(name, _)| *name == joint.name()).map(|(_, word)| word.trim());
            let word = own.next()?;
            SignBasis::ALL.into_iter().find(|basis| basis.name() == word)
        });
        match basis {
            Some(basis @ (SignBasis::Named | SignBasis::Known | SignBasis::Turned)) => SignSource::Converted(basis),
            Some(SignBasis::Shape | SignBasis::Assumed) | None => SignSource::Unknown,
        }
    }
}

/// The line of the signs, for [`Record::sign_of`].
pub(crate) fn signs(signs: &[Option<SignBasis>; Joint::COUNT]) -> String {
    let there = Joint::ALL.into_iter().zip(signs);
    let words = there.filter_map(|(joint, basis)| Some(format!("{} {}", joint.name(), basis.as_ref()?.name())));
    words.collect::<Vec<_>>().join(", ")
}

/// A line of a table without the separators that a spreadsheet adds up to the width of the table.
fn bare(line: &str) -> &str {
    line.trim_end_matches(|c: char| c.is_whitespace() || matches!(c, ',' | ';'))
}

fn owned((key, value): (&str, &str)) -> (String, String) {
    (key.trim().into(), value.trim().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_assumed_is_not_known_when_it_is_read() {
        let text = b"# footfall convert 0.1.0\n# signs: left_hip known, right_hip assumed, left_knee named, right_knee turned\ntime_s\n";
        let record = Record::of_bytes(text).unwrap();
        assert_eq!(record.sign_of("left_hip_deg"), SignSource::Converted(SignBasis::Known));
        assert_eq!(record.sign_of("hip_flexion_r"), SignSource::Unknown);
        assert_eq!(record.sign_of("left_knee_deg"), SignSource::Converted(SignBasis::Named));
        assert_eq!(record.sign_of("knee_angle_r"), SignSource::Converted(SignBasis::Turned));
        assert_eq!(record.sign_of("pelvis"), SignSource::Unknown);
        // Nothing, or another word, is no knowledge.
        for signs in ["", "# signs: left_hip\n", "# signs: left_hip surely\n", "# signs: left_hip shape\n"] {
            let text = format!("# footfall convert 0.1.0\n{signs}time_s\n");
            assert_eq!(Record::of_bytes(text.as_bytes()).unwrap().sign_of("left_hip_deg"), SignSource::Unknown);
        }
    }
}
