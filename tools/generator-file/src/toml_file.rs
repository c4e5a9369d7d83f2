//! Reads TOML files with serde. Each error has the file, the line, the key, the value and what is allowed.
//!
//! Use: [`TomlFile::read`], then [`TomlFile::top`], then [`Top::layout`], and [`Top::read`] for the whole or [`Top::get`] for one key.

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error, ValueDeserializer};

/// Largest size of a file in bytes: 1 MiB.
pub const MAX_BYTES: usize = 1 << 20;

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FileKind {
    /// The parameters of a generator.
    Generator,
    /// The servos and limits of a robot.
    Robot,
    /// The calibration of a sensor.
    Sensor,
}

impl FileKind {
    /// The kind in words, with its article.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Generator => "a generator file",
            Self::Robot => "a robot file",
            Self::Sensor => "a sensor file",
        }
    }

    /// The options that take it, in words.
    #[must_use]
    pub const fn option(self) -> &'static str {
        match self {
            Self::Generator => "`--generator`",
            Self::Robot => "`--robot`",
            Self::Sensor => "`--sensor` or `--calibration`",
        }
    }

    /// The kind of a file by the keys that only this kind has; `None` if there is no such key, or those of several kinds.
    fn of(has: impl Fn(&str) -> bool) -> Option<Self> {
        let any = |keys: &[&str]| keys.iter().any(|key| has(key));
        let kinds = [
            (Self::Generator, any(&["generator", "provenance"])),
            (
                Self::Robot,
                any(&[
                    "min_supply_v",
                    "require_brown_out_reset",
                    "pose",
                    "left_hip",
                    "right_hip",
                    "left_knee",
                    "right_knee",
                ]),
            ),
            (Self::Sensor, any(&["points", "divider", "interpolation"])),
        ];
        let mut found = kinds.into_iter().filter(|(_, is)| *is).map(|(kind, _)| kind);
        found.next().filter(|_| found.next().is_none())
    }
}

/// What is wrong with a file or one of its values, and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// More than [`MAX_BYTES`].
    #[error("is larger than {MAX_BYTES} bytes; allowed is up to that")]
    TooLarge,
    /// The bytes are not UTF-8.
    #[error("is not text; allowed is a TOML file in UTF-8")]
    NotText,
    /// The file is empty. The text says what to do.
    #[error("is empty; allowed is a file with `schema` and the keys of its kind: {0}")]
    Empty(&'static str),
    /// The file is of another kind.
    #[error("is {}, which belongs to {}; allowed here is {}: {help}", .found.words(), .found.option(), .wanted.words())]
    OtherKind {
        /// What it is.
        found: FileKind,
        /// What is allowed.
        wanted: FileKind,
        /// How a file of the right kind is made.
        help: &'static str,
    },
    /// The text is not TOML.
    #[error("is not TOML: {0}")]
    Syntax(String),
    /// A key that is unknown at its place, with the known ones.
    #[error("unknown field; allowed here: {0}")]
    Unknown(String),
    /// A key that is not there. The text says what to do.
    #[error("is missing; the key must be there: {0}")]
    Missing(&'static str),
    /// A value of another type.
    #[error("is {found}; allowed is {allowed}")]
    Type {
        /// What was found, in words.
        found: String,
        /// What is allowed, in words.
        allowed: String,
    },
    /// A number outside its range, or not finite.
    #[error("is {value}; allowed is {allowed}")]
    Range {
        /// What was found.
        value: String,
        /// What is allowed, in words.
        allowed: String,
    },
    /// A rule of the program part that uses the values. The text says what is wrong and what is allowed.
    #[error("{0}")]
    Rule(String),
}

/// A [`Problem`] and its place, printed as ``generator.toml:7: field `shape.stride_s`: is 0.1; allowed is 0.2 to 20 s``.
#[derive(Debug, Clone, PartialEq)]
pub struct FileError {
    /// Name of the file as the caller gave it.
    pub file: String,
    /// Line, counted from 1; `None` if the problem is about the whole file.
    pub line: Option<usize>,
    /// Path of the key: `gate.range_deg.left_hip`; `None` if the problem is about no key.
    pub field: Option<String>,
    /// What is wrong.
    pub problem: Problem,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&place(&self.file, self.line))?;
        if let Some(field) = &self.field {
            write!(f, "field `{field}`: ")?;
        }
        self.problem.fmt(f)
    }
}

impl std::error::Error for FileError {}

/// Begin of an error in a file: `loop.toml:3: `.
#[must_use]
pub fn place<N: fmt::Display>(file: &str, line: Option<N>) -> String {
    line.map_or(format!("{file}: "), |line| format!("{file}:{line}: "))
}

/// Reads the text of a file.
///
/// # Errors
/// The file cannot be read, is too large or is not UTF-8.
fn read_text(path: &Path) -> Result<String, FileError> {
    let file = path.display().to_string();
    let fail = |problem| FileError { file: file.clone(), line: None, field: None, problem };
    let unreadable = |error: std::io::Error| fail(Problem::Unreadable(error.to_string()));
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(path).map_err(unreadable)?;
    std::io::Read::read_to_end(&mut std::io::Read::take(opened, MAX_BYTES as u64 + 1), &mut bytes)
        .map_err(unreadable)?;
    if bytes.len() > MAX_BYTES {
        return Err(fail(Problem::TooLarge));
    }
    String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        FileError { line: Some(line), ..fail(Problem::NotText) }
    })
}

/// The text of a file and its name.
#[derive(Debug)]
pub struct TomlFile {
    file: String,
    text: String,
}

impl TomlFile {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read, is too large or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Ok(Self::of_text(&path.display().to_string(), read_text(path)?))
    }

    /// Takes a text that was read already; `file` is its name in errors.
    #[must_use]
    pub fn of_text(file: &str, text: String) -> Self {
        Self { file: file.into(), text }
    }

    /// The keys at the top. `help` says how a correct file is made, for errors.
    ///
    /// # Errors
    /// The text is not TOML, or empty.
    pub fn top(&self, help: &'static str) -> Result<Top<'_>, FileError> {
        let tree = DeTable::parse(&self.text).map_err(|error| FileError {
            file: self.file.clone(),
            line: error.span().map(|span| self.line(span.start)),
            field: None,
            problem: Problem::Syntax(format!("{}; allowed is TOML 1.0", error.message())),
        })?;
        if tree.get_ref().is_empty() {
            return Err(FileError { file: self.file.clone(), line: None, field: None, problem: Problem::Empty(help) });
        }
        Ok(Top { file: self, tree, help })
    }

    /// Line of a byte offset, counted from 1.
    fn line(&self, offset: usize) -> usize {
        1 + self.text.as_bytes().iter().take(offset).filter(|&&byte| byte == b'\n').count()
    }
}

/// A parsed file: the keys at the top of the file.
#[derive(Debug)]
pub struct Top<'a> {
    file: &'a TomlFile,
    tree: Spanned<DeTable<'a>>,
    help: &'static str,
}

impl<'a> Top<'a> {
    /// Checks that the file is of a kind, then the key `schema` against the known versions, oldest first, each with its keys at the top. Returns the version.
    ///
    /// # Errors
    /// A file of another kind, another version, a key that the version does not have, or no `schema`.
    pub fn layout(&self, wanted: FileKind, known: &[(u32, &[&str])]) -> Result<u32, FileError> {
        if let Some(found) = FileKind::of(|key| self.tree.get_ref().contains_key(key)).filter(|found| *found != wanted)
        {
            let problem = Problem::OtherKind { found, wanted, help: self.help };
            return Err(FileError { file: self.file.file.clone(), line: None, field: None, problem });
        }
        if !self.tree.get_ref().contains_key("schema") {
            known.last().map_or(Ok(()), |(_, keys)| self.only(keys))?;
        }
        let found: i64 = self.get("schema")?;
        if let Some((version, keys)) = known.iter().find(|(version, _)| i64::from(*version) == found) {
            return self.only(keys).map(|()| *version);
        }
        let old = known.first().is_some_and(|(oldest, _)| found < i64::from(*oldest));
        let value = format!("{found}{}", if old { ": this is an old file" } else { "" });
        let versions: Vec<String> = known.iter().map(|(version, _)| version.to_string()).collect();
        let allowed = format!("{}, the version of this file's layout: {}", versions.join(" or "), self.help);
        Err(self.error("schema", Problem::Range { value, allowed }))
    }

    /// Checks that the file has no other keys at its top than these.
    ///
    /// # Errors
    /// Names the first other key.
    pub fn only(&self, keys: &[&str]) -> Result<(), FileError> {
        let table = self.tree.get_ref();
        let unknown = table.keys().filter(|key| !keys.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(()),
            Some(key) => Err(self.error_at(key.get_ref(), key.span().start, Problem::Unknown(list(keys)))),
        }
    }

    /// The whole file, or those of its keys that `T` has.
    ///
    /// # Errors
    /// The first value that is missing or not of its type.
    pub fn read<T: Deserialize<'a> + Serialize>(&self) -> Result<T, FileError> {
        let read = T::deserialize(Deserializer::from(self.tree.clone())).map_err(|error| self.in_file(&error, 0))?;
        let again = toml::Table::try_from(&read).unwrap_or_default();
        for (key, value) in self.tree.get_ref() {
            let key: &str = key.get_ref();
            self.whole_lists(key, value, again.get(key))?;
        }
        Ok(read)
    }

    /// Refuses a list that is longer than what was read of it: serde's arrays leave the rest unread.
    fn whole_lists(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        read: Option<&toml::Value>,
    ) -> Result<(), FileError> {
        match (value.get_ref(), read) {
            (DeValue::Table(table), Some(toml::Value::Table(read))) => table.iter().try_for_each(|(key, value)| {
                let key: &str = key.get_ref();
                self.whole_lists(&format!("{path}.{key}"), value, read.get(key))
            }),
            (DeValue::Array(list), Some(toml::Value::Array(read))) if list.len() > read.len() => {
                Err(self.not_allowed(path, &list_of(read.len(), list.first().map(Spanned::get_ref))))
            }
            (DeValue::Array(list), Some(toml::Value::Array(read))) => {
                list.iter().zip(read).enumerate().try_for_each(|(index, (value, read))| {
                    self.whole_lists(&format!("{path}[{index}]"), value, Some(read))
                })
            }
            _ => Ok(()),
        }
    }

    /// Whether there is a value at this path: `phase-coupled.joints`.
    #[must_use]
    pub fn has(&self, path: &str) -> bool {
        find(self.tree.get_ref(), path).1.is_some()
    }

    /// The value of a key at the top.
    ///
    /// # Errors
    /// It is missing, or not of the type `T`.
    pub fn get<T: Deserialize<'a> + Serialize>(&self, key: &str) -> Result<T, FileError> {
        self.get_with(key, |value| T::deserialize(value))
    }

    /// The value of a key at the top, deserialized by `read`.
    ///
    /// # Errors
    /// It is missing, or `read` refuses it.
    pub fn get_with<T: Serialize>(
        &self,
        key: &str,
        read: impl FnOnce(ValueDeserializer<'a>) -> Result<T, Error>,
    ) -> Result<T, FileError> {
        let Some(value) = self.tree.get_ref().get(key) else {
            return Err(self.error_at(key, 0, Problem::Missing(self.help)));
        };
        let place = value.span().start;
        let read = read(ValueDeserializer::from(value.clone())).map_err(|error| self.in_file(&error, place))?;
        self.whole_lists(key, value, toml::Value::try_from(&read).ok().as_ref())?;
        Ok(read)
    }

    /// Converts an error of the deserializer; `place` is the byte offset of the value, if the error has none of its own.
    fn in_file(&self, error: &Error, place: usize) -> FileError {
        let place = error.span().map_or(place, |span| span.start);
        // The whole file begins where its first key does.
        let whole = error.span().is_some_and(|span| span == self.tree.span());
        let path = if whole { String::new() } else { path_at(self.tree.get_ref(), place).unwrap_or_default() };
        match error.message().strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
            Some(missing) => {
                let path = if path.is_empty() { missing.to_owned() } else { format!("{path}.{missing}") };
                self.error_at(&path, place, Problem::Missing(self.help))
            }
            None if error.message() == "floating-point number overflowed" => self.not_allowed(&path, "a finite number"),
            None => {
                let list = find(self.tree.get_ref(), &path).1.and_then(DeValue::as_array);
                let entry = list.and_then(|list| list.first()).map(Spanned::get_ref);
                self.error_at(&path, place, problem_of(error.message(), entry))
            }
        }
    }

    /// An error at a byte offset, with the path of the key.
    fn error_at(&self, path: &str, offset: usize, problem: Problem) -> FileError {
        FileError {
            file: self.file.file.clone(),
            line: Some(self.file.line(offset)),
            field: Some(path.into()),
            problem,
        }
    }

    /// An error at a key: `shape.left_hip.cos_deg[2]`.
    #[must_use]
    pub fn error(&self, path: &str, problem: Problem) -> FileError {
        self.error_at(path, find(self.tree.get_ref(), path).0, problem)
    }

    /// The path of the first number outside of a range in the list at a path; `None` if there is no list, or no such number.
    #[must_use]
    pub fn outside(&self, path: &str, range: &std::ops::RangeInclusive<f32>) -> Option<String> {
        let list = find(self.tree.get_ref(), path).1?.as_array()?;
        let number = |entry: &DeValue<'_>| match entry {
            DeValue::Integer(integer) => integer.to_string().parse::<f32>().ok(),
            DeValue::Float(float) => float.as_str().parse::<f32>().ok(),
            _ => None,
        };
        let index = list.iter().position(|entry| number(entry.get_ref()).is_some_and(|x| !range.contains(&x)))?;
        Some(format!("{path}[{index}]"))
    }

    /// The error that the value of a key is not allowed; the value is taken from the file.
    #[must_use]
    pub fn not_allowed(&self, path: &str, allowed: &str) -> FileError {
        let (offset, value) = find(self.tree.get_ref(), path);
        let value = match value {
            Some(DeValue::Integer(integer)) => integer.to_string(),
            Some(DeValue::Float(float)) => float.as_str().into(),
            Some(other) => in_words(other),
            None => "not there".into(),
        };
        self.error_at(path, offset, Problem::Range { value, allowed: allowed.into() })
    }
}

/// Where the longest known part of a path stands, and its value if all of it is known.
fn find<'t>(table: &'t DeTable<'_>, path: &str) -> (usize, Option<&'t DeValue<'t>>) {
    let (key, rest) = path.split_once('.').map_or((path, None), |(key, rest)| (key, Some(rest)));
    let (key, indexes) = key.split_once('[').unwrap_or((key, ""));
    let Some((name, value)) = table.get_key_value(key) else { return (0, None) };
    let mut here = (name.span().start, Some(value.get_ref()));
    for index in indexes.split('[').filter(|index| !index.is_empty()) {
        let entry = |list: &'t DeValue<'_>| list.as_array()?.get(index.trim_end_matches(']').parse::<usize>().ok()?);
        here = match here.1.and_then(entry) {
            Some(entry) => (entry.span().start, Some(entry.get_ref())),
            None => (here.0, None),
        };
    }
    let (here, value) = here;
    match (rest, value.and_then(DeValue::as_table)) {
        (None, _) => (here, value),
        (Some(rest), Some(table)) => match find(table, rest) {
            (0, None) => (here, None),
            found => found,
        },
        (Some(_), None) => (here, None),
    }
}

/// Path of the key or value at a byte offset.
fn path_at(table: &DeTable<'_>, place: usize) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        if key.span().contains(&place) { Some(name.to_string()) } else { path_within(name, value, place) }
    })
}

/// As [`path_at`], in the value of this path.
fn path_within(path: &str, value: &Spanned<DeValue<'_>>, place: usize) -> Option<String> {
    let deeper = match value.get_ref() {
        DeValue::Table(inner) => path_at(inner, place).map(|rest| format!("{path}.{rest}")),
        DeValue::Array(list) => {
            list.iter().enumerate().find_map(|(index, entry)| path_within(&format!("{path}[{index}]"), entry, place))
        }
        _ => None,
    };
    deeper.or_else(|| value.span().contains(&place).then(|| path.to_owned()))
}

/// A message of serde as a [`Problem`]; `entry` is the first one of the list that it is about, if it is about one.
fn problem_of(message: &str, entry: Option<&DeValue<'_>>) -> Problem {
    if let Some((_, fields)) = message.strip_prefix("unknown field ").and_then(|rest| rest.split_once(", expected ")) {
        return Problem::Unknown(fields.trim_start_matches("one of ").into());
    }
    let invalid = ["invalid type: ", "invalid value: ", "invalid length "];
    let rest = invalid.iter().find_map(|start| message.strip_prefix(start).map(|rest| (*start, rest)));
    match rest.and_then(|(start, rest)| Some((start, rest.split_once(", expected ")?))) {
        Some((start, (found, allowed))) => {
            let found = if start == "invalid length " { format!("a list of {found}") } else { found_in_words(found) };
            let allowed = allowed
                .strip_prefix("an array of length ")
                .and_then(|count| count.parse().ok())
                .map_or_else(|| expected_in_words(allowed), |count| list_of(count, entry));
            Problem::Type { found, allowed }
        }
        None => Problem::Rule(message.into()),
    }
}

/// Converts serde's words for a value that it found to those of [`in_words`].
fn found_in_words(found: &str) -> String {
    let plain = found.replace('`', "");
    let words = [("string ", "the text "), ("integer ", "the whole number "), ("floating point ", "the number ")];
    let known = words.iter().find_map(|(start, words)| Some(format!("{words}{}", plain.strip_prefix(start)?)));
    known.unwrap_or_else(|| match plain.as_str() {
        "sequence" => "a list".into(),
        "map" => "a table".into(),
        other => other.trim_start_matches("boolean ").into(),
    })
}

/// Converts serde's words for what it expected.
fn expected_in_words(expected: &str) -> String {
    match expected {
        "f32" | "f64" => "a number".into(),
        "i64" => "a whole number".into(),
        "u16" | "u32" => "a whole number, not negative".into(),
        "a sequence" => "a list".into(),
        "a string" => "a text".into(),
        "a boolean" => "`true` or `false`".into(),
        other if other.starts_with("struct ") => "a table".into(),
        other => other.into(),
    }
}

/// A list of this length in words, with what its entries are.
fn list_of(count: usize, entry: Option<&DeValue<'_>>) -> String {
    match entry {
        Some(DeValue::Array(inner)) => format!("a list of {count} lists of {} numbers", inner.len()),
        _ => format!("a list of {count} numbers"),
    }
}

/// Names of keys, quoted.
fn list(fields: &[&str]) -> String {
    fields.iter().map(|field| format!("`{field}`")).collect::<Vec<_>>().join(", ")
}

/// A value of a file in words.
fn in_words(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("the text \"{}\"", text.chars().take(40).collect::<String>()),
        DeValue::Integer(integer) => format!("the whole number {integer}"),
        DeValue::Float(float) => format!("the number {float}"),
        DeValue::Boolean(flag) => format!("`{flag}`"),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(array) => format!("a list of {}", array.len()),
        DeValue::Table(_) => "a table".into(),
    }
}
