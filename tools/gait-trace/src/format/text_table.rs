//! Bytes to lines, fields and numbers, with a limit on each. Used for text files of other programs.
//!
//! Shared by the readers of CSV, OpenSim and oscilloscope files. The project's own CSV has a stricter reader,
//! [`csv_file`](crate::format::csv_file).

use crate::fault::{Fault, TraceError};
use crate::format::number::decimal;
use memchr::memchr;
use std::borrow::Cow;

/// Largest length of a line, bytes: a row of 4096 columns of 20 digits has about 80 thousand.
pub(crate) const MAX_LINE: usize = 1 << 20;
/// Largest number of rows: 4.6 hours at 1 kHz, and more than the 14 million of a long oscilloscope capture. Times, lines and four
/// joints of that many rows take less than a gigabyte.
pub(crate) const MAX_ROWS: usize = 1 << 24;
/// Largest number of columns.
pub(crate) const MAX_COLUMNS: usize = 4096;

/// Begins a text in UTF-8 that some programs write, such as spreadsheets.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Ends a text of some programs, as the end of a file was marked in DOS (Ctrl-Z).
const END_MARK: u8 = 0x1a;

/// The bytes as text, without the marks that some programs put at its beginning and its end.
pub(crate) fn text<'a>(name: &str, bytes: &'a [u8]) -> Result<&'a str, TraceError> {
    let start = if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    let bytes = &bytes[start..];
    let bytes = bytes.strip_suffix(&[END_MARK]).unwrap_or(bytes);
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(TraceError::new(name, None, Fault::Empty));
    }
    let (text, valid) = match std::str::from_utf8(bytes) {
        Ok(text) => (text, bytes.len()),
        Err(error) => ("", error.valid_up_to()),
    };
    let bad = first_control(&bytes[..valid]).unwrap_or(valid);
    let Some(&byte) = bytes.get(bad) else { return Ok(text) };
    let hint = match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => " (UTF-16: save it as UTF-8)",
        [b'P', b'K', 3, 4, ..] => " (a zip file, perhaps a spreadsheet: export it as CSV)",
        [0x1f, 0x8b, ..] => " (compressed: unpack it first)",
        _ if byte >= 0x80 => " (another character set: save it as UTF-8)",
        _ => "",
    };
    let line = 1 + bytes[..bad].iter().filter(|&&byte| byte == b'\n').count() as u64;
    Err(TraceError::new(name, Some(line), Fault::Bytes { byte, offset: start + bad, hint }))
}

/// The place of the first control character that is not part of a text.
pub(crate) fn first_control(bytes: &[u8]) -> Option<usize> {
    let control = |byte: &u8| byte.is_ascii_control() && !matches!(byte, b'\n' | b'\r' | b'\t');
    // A block is looked through without a jump, in vectors; only one that has such a character is searched.
    const BLOCK: usize = 1024;
    let block = bytes.chunks(BLOCK).position(|block| block.iter().fold(false, |any, byte| any | control(byte)))?;
    let from = block * BLOCK;
    bytes[from..].iter().position(control).map(|place| from + place)
}

/// The lines of a text, which end in LF or CR LF, or in CR where there is no LF.
pub(crate) fn bare_lines(text: &str) -> BareLines<'_> {
    let end = if memchr(b'\n', text.as_bytes()).is_some() { b'\n' } else { b'\r' };
    BareLines { rest: text, end }
}

/// The lines of a text, see [`bare_lines`].
pub(crate) struct BareLines<'a> {
    rest: &'a str,
    /// What each line ends in.
    end: u8,
}

impl<'a> BareLines<'a> {
    /// The lines of a piece of a text whose lines end in LF or CR LF, although the piece itself may have no LF.
    pub(crate) const fn in_lf(text: &'a str) -> Self {
        Self { rest: text, end: b'\n' }
    }

    /// Whether the last line has no end.
    pub(crate) fn is_open(&self) -> bool {
        !self.rest.is_empty() && !self.rest.ends_with(['\n', '\r'])
    }

    /// Whether the lines end in CR alone.
    pub(crate) const fn end_in_cr(&self) -> bool {
        self.end == b'\r'
    }

    /// The lines that are left.
    pub(crate) const fn rest(&self) -> &'a str {
        self.rest
    }

    /// Leaves out so many bytes, which are whole lines with their ends.
    pub(crate) fn skip_bytes(&mut self, bytes: usize) {
        self.rest = &self.rest[bytes..];
    }
}

impl<'a> Iterator for BareLines<'a> {
    type Item = &'a str;

    #[inline]
    fn next(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        let row = match memchr(self.end, self.rest.as_bytes()) {
            Some(at) => {
                let row = &self.rest[..at];
                self.rest = &self.rest[at + 1..];
                row
            }
            None => std::mem::take(&mut self.rest),
        };
        Some(row.strip_suffix('\r').unwrap_or(row))
    }
}

/// The lines with their numbers from 1; a line that is too long is an error.
pub(crate) fn lines<'a>(name: &'a str, text: &'a str) -> impl Iterator<Item = Result<(u64, &'a str), TraceError>> {
    numbered(text).map(move |(line, row)| check_length(name, line, row).map(|()| (line, row)))
}

/// The lines with their numbers from 1, of any length.
pub(crate) fn numbered(text: &str) -> impl Iterator<Item = (u64, &str)> {
    (1..).zip(bare_lines(text))
}

/// An error if a line is too long.
#[inline]
pub(crate) fn check_length(name: &str, line: u64, row: &str) -> Result<(), TraceError> {
    match row.len() {
        bytes if bytes > MAX_LINE => Err(TraceError::new(name, Some(line), Fault::LongLine { bytes, most: MAX_LINE })),
        _ => Ok(()),
    }
}

/// Whether a byte is a character of its own that is seen, as most characters of a table are: no blank, and no part of another character.
pub(crate) const fn is_seen(byte: Option<&u8>) -> bool {
    matches!(byte, Some(b'!'..=b'~'))
}

/// Whether a line has nothing but blanks.
#[inline]
pub(crate) fn is_blank(row: &str) -> bool {
    !is_seen(row.as_bytes().first()) && row.trim().is_empty()
}

/// Whether a line is a comment: its first character other than a blank is `#`.
#[inline]
pub(crate) fn is_comment(row: &str) -> bool {
    match row.as_bytes().first() {
        Some(first) if is_seen(Some(first)) => *first == b'#',
        _ => row.trim_start().starts_with('#'),
    }
}

/// Without surrounding blanks.
#[inline]
fn trimmed(field: &str) -> &str {
    let bytes = field.as_bytes();
    if is_seen(bytes.first()) && is_seen(bytes.last()) { field } else { field.trim() }
}

/// Calls `take` with each place of a byte, the first one first: eight bytes are compared at a time, because fields are short.
#[inline]
fn each_place(byte: u8, bytes: &[u8], mut take: impl FnMut(usize)) {
    const ONES: u64 = u64::MAX / 255;
    const LOW: u64 = 0x7f * ONES;
    let (words, rest) = bytes.as_chunks::<8>();
    for (n, word) in words.iter().enumerate() {
        let other = u64::from_le_bytes(*word) ^ (ONES * u64::from(byte));
        // The highest bit of each byte that is 0, and no other bit (Warren, "Hacker's Delight", 6-1).
        let mut zeros = !(((other & LOW) + LOW) | other | LOW);
        while zeros != 0 {
            take(8 * n + zeros.trailing_zeros() as usize / 8);
            zeros &= zeros - 1;
        }
    }
    let from = bytes.len() - rest.len();
    rest.iter().enumerate().filter(|(_, other)| **other == byte).for_each(|(at, _)| take(from + at));
}

/// The number of the last line if it is a row that was cut short ([`is_cut`]).
pub(crate) fn cut_line(
    text: &str,
    delimiter: Delimiter,
    columns: usize,
    is_number: impl Fn(usize) -> bool,
) -> Option<u64> {
    if text.ends_with(['\n', '\r']) {
        return None;
    }
    let (line, row) = (1..).zip(bare_lines(text)).last()?;
    (!is_blank(row) && !is_comment(row) && is_cut(row, delimiter, columns, is_number)).then_some(line)
}

/// Whether a row without line end, with which the file ends, was cut short: a program that is killed while it writes leaves such a one.
///
/// It has fewer fields than there are `columns`, a quote is open, or its last field is the beginning of a number in a column that
/// `is_number`.
pub(crate) fn is_cut(row: &str, delimiter: Delimiter, columns: usize, is_number: impl Fn(usize) -> bool) -> bool {
    match delimiter.fields(row) {
        Ok(fields) if fields.len() == columns => {
            let comma = delimiter != Delimiter::Char(',');
            is_number(columns - 1) && fields.last().is_some_and(|field| is_begun_number(field, comma))
        }
        Ok(fields) => fields.len() < columns,
        Err(fault) => matches!(fault, Fault::OpenQuote),
    }
}

/// Whether a text is no number, but would be one with more behind it: `-`, `2.5e`, `na`.
fn is_begun_number(text: &str, comma: bool) -> bool {
    let begins_nan = || ["nan", "-nan"].iter().any(|nan| nan.starts_with(&text.to_ascii_lowercase()));
    number_or_missing(text, comma).is_err() && (finite(&format!("{text}0"), comma).is_ok() || begins_nan())
}

/// Whether a line names the delimiter, as some spreadsheets write it above the header: `sep=;`.
pub(crate) fn is_separator_line(row: &str) -> bool {
    row.len() <= 6 && row.to_ascii_lowercase().starts_with("sep=")
}

/// An error if the table already has [`MAX_ROWS`] rows.
pub(crate) fn check_rows(rows: usize) -> Result<(), Fault> {
    if rows < MAX_ROWS { Ok(()) } else { Err(Fault::TooManyRows { most: MAX_ROWS }) }
}

/// What separates the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Delimiter {
    /// `,`, `;` or a tab.
    Char(char),
    /// Any number of blanks and tabs in a row.
    Blanks,
}

impl Delimiter {
    /// The most frequent of `,`, `;` and tab outside of quotes; `,` if none occurs.
    pub(crate) fn of_header(row: &str) -> Self {
        let mut quoted = false;
        let mut counts = [(',', 0), (';', 0), ('\t', 0)];
        for c in row.chars() {
            quoted ^= c == '"';
            if let Some((_, count)) = counts.iter_mut().find(|(delimiter, _)| !quoted && *delimiter == c) {
                *count += 1;
            }
        }
        let best = counts.iter().fold((',', 0), |best, &(c, count)| if count > best.1 { (c, count) } else { best });
        Self::Char(best.0)
    }

    /// As [`Self::of_header`], for a line that may be a row of numbers: blanks if nothing else separates two or more of them, and semicolons or
    /// tabs if numbers are between them, which may have more decimal commas than there are fields.
    pub(crate) fn of_rows(row: &str) -> Self {
        let is_number = |field: &str| field.parse::<f64>().is_ok();
        let blanks = !row.contains([',', ';', '\t']) && row.split_whitespace().nth(1).is_some();
        if blanks && row.split_whitespace().all(is_number) {
            return Self::Blanks;
        }
        let separates = |c: &char| has_numbers_between(row, *c);
        [';', '\t'].into_iter().find(separates).map_or_else(|| Self::of_header(row), Self::Char)
    }

    /// As [`Self::of_rows`], for a line with others below it: a heading may have a comma inside, `Zeit, s;Knie links, °`, so that rows of as
    /// many numbers between semicolons or tabs decide.
    pub(crate) fn of_line<'a>(row: &str, below: impl Iterator<Item = &'a str>) -> Self {
        let own = Self::of_rows(row);
        if own != Self::Char(',') {
            return own;
        }
        let as_many = |below: &str, c: char| row.contains(c) && row.split(c).count() == below.split(c).count();
        let of_numbers =
            |below: &str| [';', '\t'].into_iter().find(|&c| has_numbers_between(below, c) && as_many(below, c));
        // Rows of units or of components may be between the header and the numbers.
        below.take(4).find_map(of_numbers).map_or(own, Self::Char)
    }

    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Char(';') => "semicolons",
            Self::Char('\t') => "tabs",
            Self::Char(_) => "commas",
            Self::Blanks => "blanks",
        }
    }

    /// The fields of a row, without surrounding blanks and quotes.
    pub(crate) fn fields(self, row: &str) -> Result<Vec<Cow<'_, str>>, Fault> {
        let mut fields = Vec::new();
        self.split(row, &mut fields)?;
        Ok(fields)
    }

    /// The same in the memory of another row's fields.
    pub(crate) fn split<'a>(self, row: &'a str, fields: &mut Vec<Cow<'a, str>>) -> Result<(), Fault> {
        fields.clear();
        match self {
            Self::Blanks => fields.extend(row.split_whitespace().map(Cow::Borrowed).take(MAX_COLUMNS + 1)),
            Self::Char(c) if memchr(b'"', row.as_bytes()).is_some() => *fields = quoted_fields(row, c)?,
            Self::Char(c) if c.is_ascii() => {
                let mut from = 0;
                let mut push = |end: usize| {
                    if fields.len() <= MAX_COLUMNS {
                        // A delimiter of ASCII is a character of its own wherever its byte is.
                        fields.push(Cow::Borrowed(trimmed(&row[from..end])));
                    }
                    from = end + 1;
                };
                each_place(c as u8, row.as_bytes(), &mut push);
                push(row.len());
            }
            Self::Char(c) => fields.extend(row.split(c).map(|field| Cow::Borrowed(field.trim())).take(MAX_COLUMNS + 1)),
        }
        if fields.len() > MAX_COLUMNS {
            let found = match self {
                Self::Blanks => row.split_whitespace().count(),
                Self::Char(c) => row.split(c).count(),
            };
            return Err(Fault::TooManyColumns { found, most: MAX_COLUMNS });
        }
        Ok(())
    }
}

/// Whether a character separates fields that are all numbers or empty.
fn has_numbers_between(row: &str, c: char) -> bool {
    row.contains(c) && row.split(c).all(|field| number_or_missing(field.trim(), true).is_ok())
}

/// The fields of a row with quotes; `""` inside of quotes is one quote.
fn quoted_fields(row: &str, delimiter: char) -> Result<Vec<Cow<'_, str>>, Fault> {
    let mut fields = Vec::new();
    let mut rest = row;
    loop {
        let trimmed = rest.trim_start_matches(|c: char| c != delimiter && c.is_whitespace());
        let Some(mut inside) = trimmed.strip_prefix('"') else {
            let (field, after) = rest.split_once(delimiter).map_or((rest, None), |(field, after)| (field, Some(after)));
            fields.push(Cow::Borrowed(field.trim()));
            match after {
                Some(after) if fields.len() <= MAX_COLUMNS => rest = after,
                _ => return Ok(fields),
            }
            continue;
        };
        let mut field = String::new();
        loop {
            let (part, after) = inside.split_once('"').ok_or(Fault::OpenQuote)?;
            field.push_str(part);
            match after.strip_prefix('"') {
                Some(after) => {
                    field.push('"');
                    inside = after;
                }
                None => {
                    inside = after;
                    break;
                }
            }
        }
        let (tail, after) = inside.split_once(delimiter).map_or((inside, None), |(tail, after)| (tail, Some(after)));
        field.push_str(tail.trim_end());
        fields.push(Cow::Owned(field.trim().to_owned()));
        match after {
            Some(after) if fields.len() <= MAX_COLUMNS => rest = after,
            _ => return Ok(fields),
        }
    }
}

/// What programs write where they have no number, in lower case; PicoScope writes the last two beyond its input range.
const MISSING: [&str; 11] = ["nan", "na", "n/a", "null", "none", "nil", "nodata", "missing", "--", "∞", "-∞"];

/// Whether a field is a missing value: empty, one of the words of [`MISSING`], an error of a spreadsheet (`#N/A`, `#DIV/0!`), or no number as C
/// libraries write it (`-nan(ind)`, `-1.#IND`, `1.#QNAN0`).
pub(crate) fn is_missing(field: &str) -> bool {
    field.is_empty()
        || MISSING.iter().any(|word| field.eq_ignore_ascii_case(word))
        || (field.starts_with(['#', '-', '+', '1', 'n', 'N']) && is_missing_of_a_program(&field.to_ascii_lowercase()))
}

/// The last two kinds, in lower case.
#[cold]
fn is_missing_of_a_program(field: &str) -> bool {
    const SPREADSHEET: [&str; 7] = ["#n/a", "#div/0!", "#value!", "#num!", "#ref!", "#null!", "#name?"];
    let unsigned = field.strip_prefix(['-', '+']).unwrap_or(field);
    let nan =
        unsigned.strip_prefix("nan").map(|rest| rest.is_empty() || (rest.starts_with('(') && rest.ends_with(')')));
    let of_msvc = unsigned.strip_prefix("1.#").map(|rest| {
        ["ind", "qnan", "snan", "nan"]
            .iter()
            .any(|word| rest.strip_prefix(word).is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit())))
    });
    SPREADSHEET.contains(&field) || nan.or(of_msvc).unwrap_or(false)
}

/// A number, or NaN for a missing value. A decimal comma is accepted if `comma` is set.
pub(crate) fn number_or_missing(field: &str, comma: bool) -> Result<f64, Fault> {
    match decimal(field) {
        Some(value) => Ok(value),
        None if is_missing(field) => Ok(f64::NAN),
        None => finite(field, comma),
    }
}

/// A finite number. A decimal comma is accepted if `comma` is set.
pub(crate) fn finite(field: &str, comma: bool) -> Result<f64, Fault> {
    if let Some(value) = decimal(field) {
        return Ok(value);
    }
    // Some programs write a true minus sign.
    let field = if field.is_ascii() { Cow::Borrowed(field) } else { Cow::Owned(field.replace('\u{2212}', "-")) };
    let field = field.as_ref();
    let parsed = if comma && field.contains(',') { field.replacen(',', ".", 1).parse() } else { field.parse::<f64>() };
    match parsed {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(Fault::NotFinite { text: short(field) }),
        Err(_) if field.trim_start_matches(['-', '+']).to_ascii_lowercase().starts_with("1.#inf") => {
            Err(Fault::NotFinite { text: short(field) })
        }
        // One comma and no point: `1,234.5` has thousands.
        Err(_) if field.matches(',').count() == 1 && field.replacen(',', ".", 1).parse::<f64>().is_ok() => {
            Err(Fault::DecimalComma { text: short(field) })
        }
        Err(_) => Err(Fault::NotANumber { text: short(field) }),
    }
}

/// The first 60 characters of a name, for errors.
pub(crate) fn short(name: &str) -> String {
    name.chars().take(60).collect()
}

/// The first 24 names in quotes, for errors.
pub(crate) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    const MOST: usize = 24;
    if names.is_empty() {
        return "none".into();
    }
    let quoted = |name: &S| format!("`{}`", short(name.as_ref()));
    let mut text = names.iter().take(MOST).map(quoted).collect::<Vec<_>>().join(", ");
    if names.len() > MOST {
        text += &format!(" and {} more", names.len() - MOST);
    }
    text
}

/// The index of a column by its exact name, else by its name without regard to case, else by its number from 1.
pub(crate) fn column_called<S: AsRef<str>>(headings: &[S], wanted: &str) -> Option<usize> {
    let wanted = wanted.trim();
    headings
        .iter()
        .position(|heading| heading.as_ref() == wanted)
        .or_else(|| headings.iter().position(|heading| heading.as_ref().eq_ignore_ascii_case(wanted)))
        .or_else(|| wanted.parse::<usize>().ok()?.checked_sub(1).filter(|&index| index < headings.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_protect_delimiters_and_must_close() {
        let fields = |row| Delimiter::Char(',').fields(row).map(|fields| fields.join("|"));
        assert_eq!(fields("a, b ,c").unwrap(), "a|b|c");
        assert_eq!(fields("\"a,b\", \"c \"\"d\"\"\" ,e,").unwrap(), "a,b|c \"d\"|e|");
        assert_eq!(fields("\"\",\"x\"").unwrap(), "|x");
        assert!(matches!(fields("a,\"b,c"), Err(Fault::OpenQuote)));
    }

    #[test]
    fn the_mark_of_dos_at_the_end_is_no_part_of_a_text_and_elsewhere_none() {
        assert_eq!(text("a", b"a,b\r\n1,2\r\n\x1a").unwrap(), "a,b\r\n1,2\r\n");
        assert!(text("a", b"\x1a").unwrap_err().to_string().contains("is empty"));
        assert!(text("a", b"a\x1a\n").unwrap_err().to_string().contains("byte 0x1a at offset 1"));
    }

    #[test]
    fn the_number_of_rows_is_limited() {
        assert!(check_rows(MAX_ROWS - 1).is_ok());
        let full = check_rows(MAX_ROWS).unwrap_err().to_string();
        assert!(full.starts_with("more than 16777216 rows; allowed are up to that"), "{full}");
    }

    #[test]
    fn the_most_frequent_delimiter_is_used() {
        assert_eq!(Delimiter::of_header("a,b,c"), Delimiter::Char(','));
        assert_eq!(Delimiter::of_header("a;b,c;d"), Delimiter::Char(';'));
        assert_eq!(Delimiter::of_header("\"a,b,c,d\"\te"), Delimiter::Char('\t'));
        assert_eq!(Delimiter::of_header("alone"), Delimiter::Char(','));
        // A row with more decimal commas than semicolons.
        assert_eq!(Delimiter::of_rows("0,00;12,5;;-3,1"), Delimiter::Char(';'));
        assert_eq!(Delimiter::of_rows("0,00\t12,5\t-3,1"), Delimiter::Char('\t'));
        assert_eq!(Delimiter::of_rows("0,1,2"), Delimiter::Char(','));
    }

    #[test]
    fn missing_numbers_differ_from_wrong_ones() {
        assert!(number_or_missing("", false).unwrap().is_nan() && number_or_missing("NaN", false).unwrap().is_nan());
        let words = [
            "NA",
            "#N/A",
            "null",
            "∞",
            "-NaN",
            "-nan(ind)",
            "NaN(snan)",
            "-1.#IND",
            "1.#QNAN",
            "-1.#IND00",
            "1.#SNAN0",
            "#DIV/0!",
        ];
        assert!(words.iter().all(|word| number_or_missing(word, false).unwrap().is_nan()));
        for word in ["1.#", "1.#INDX", "nano", "nan(", "#", "-", "-1.#"] {
            assert!(matches!(number_or_missing(word, false), Err(Fault::NotANumber { .. })), "{word}");
        }
        assert!(matches!(number_or_missing("-1.#INF00", false), Err(Fault::NotFinite { .. })));
        assert_eq!(number_or_missing("-1,5", true).unwrap(), -1.5);
        assert_eq!(number_or_missing("\u{2212}1.5", false).unwrap(), -1.5);
        assert!(matches!(number_or_missing("-1,5", false), Err(Fault::DecimalComma { .. })));
        assert!(matches!(number_or_missing("1,000,000", true), Err(Fault::NotANumber { .. })));
        assert!(matches!(number_or_missing("inf", true), Err(Fault::NotFinite { .. })));
    }
}
