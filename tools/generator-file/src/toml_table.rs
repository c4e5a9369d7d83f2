//! Reads TOML files field by field; each error has file, line, field, the value and what is allowed.
//!
//! A file is checked in this order: text, syntax, unknown fields (a misspelt field is named as such, not as a
//! missing one), then each field as it is asked for. Every field has to be there; nothing has a silent default.

use std::cell::RefCell;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::toml_file::{in_words, list, read_text};

pub use crate::toml_file::{FileError, MAX_BYTES, Problem};

/// The text of a file and its name.
#[derive(Debug)]
pub struct Document {
    file: String,
    text: String,
    /// Path of each field that was asked for and found, and its offset.
    places: RefCell<Vec<(String, usize)>>,
}

impl Document {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or is no text.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Ok(Self::of_text(&path.display().to_string(), read_text(path)?))
    }

    /// A text; `file` is what errors call it.
    #[must_use]
    pub fn of_text(file: &str, text: String) -> Self {
        Self { file: file.into(), text, places: RefCell::default() }
    }

    /// The table at the top of the tree.
    ///
    /// # Errors
    /// The text is not TOML.
    pub fn parse(&self) -> Result<Spanned<DeTable<'_>>, FileError> {
        DeTable::parse(&self.text).map_err(|error| FileError {
            file: self.file.clone(),
            line: error.span().map(|span| self.line(span.start)),
            field: None,
            problem: Problem::Syntax(format!("{}; allowed is TOML 1.0", error.message())),
        })
    }

    /// The fields at the top, of which there may be no others.
    ///
    /// # Errors
    /// Nothing is there, or something else.
    pub fn top<'a>(&'a self, table: &'a DeTable<'a>, fields: &[&str]) -> Result<Section<'a>, FileError> {
        if table.is_empty() {
            let problem = Problem::Empty(format!("a file with {}", list(fields)));
            return Err(FileError { file: self.file.clone(), line: None, field: None, problem });
        }
        Section { document: self, path: String::new(), offset: 0, table }.only(fields)
    }

    /// An error at a field that has been read already.
    #[must_use]
    pub fn at(&self, field: &str, problem: Problem) -> FileError {
        let places = self.places.borrow();
        // The longest path that was found on the way to the field.
        let place = places
            .iter()
            .filter(|(path, _)| field == path || field.strip_prefix(path.as_str()).is_some_and(|r| r.starts_with('.')))
            .max_by_key(|(path, _)| path.len());
        let line = place.map(|(_, offset)| self.line(*offset));
        FileError { file: self.file.clone(), line, field: Some(field.into()), problem }
    }

    fn line(&self, offset: usize) -> usize {
        1 + self.text.as_bytes().iter().take(offset).filter(|&&byte| byte == b'\n').count()
    }
}

/// A table of fields.
#[derive(Debug, Clone)]
pub struct Section<'a> {
    document: &'a Document,
    /// Path of the table with a dot behind it; empty at the top.
    path: String,
    offset: usize,
    table: &'a DeTable<'a>,
}

impl<'a> Section<'a> {
    /// This table, if it has no other fields than these.
    fn only(self, fields: &[&str]) -> Result<Self, FileError> {
        let unknown = self.table.keys().filter(|key| !fields.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(self),
            Some(key) => Err(self.error(key.get_ref(), key.span().start, Problem::Unknown(list(fields)))),
        }
    }

    fn error(&self, key: &str, offset: usize, problem: Problem) -> FileError {
        let document = self.document;
        let field = Some(format!("{}{key}", self.path));
        FileError { file: document.file.clone(), line: Some(document.line(offset)), field, problem }
    }

    /// An error at a field of this table.
    #[must_use]
    pub fn error_at(&self, key: &str, problem: Problem) -> FileError {
        self.document.at(&format!("{}{key}", self.path), problem)
    }

    fn value(&self, key: &str, allowed: &str) -> Result<&'a Spanned<DeValue<'a>>, FileError> {
        let found = self.table.iter().find(|(name, _)| name.get_ref() == key);
        let (name, value) = found.ok_or_else(|| self.error(key, self.offset, Problem::Missing(allowed.into())))?;
        self.document.places.borrow_mut().push((format!("{}{key}", self.path), name.span().start));
        Ok(value)
    }

    fn wrong_type(&self, key: &str, value: &Spanned<DeValue<'_>>, allowed: &str) -> FileError {
        let problem = Problem::Type { found: in_words(value.get_ref()), allowed: allowed.into() };
        self.error(key, value.span().start, problem)
    }

    /// Whether the field is there: for one that may be left out.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        self.table.keys().any(|name| name.get_ref() == key)
    }

    /// A number from `least` to `most`.
    ///
    /// # Errors
    /// It is missing, no number, not finite or out of range.
    pub fn number(&self, key: &str, least: f32, most: f32, unit: &str) -> Result<f32, FileError> {
        let allowed = format!("a number from {least} to {most}{unit}");
        let value = self.value(key, &allowed)?;
        self.number_of(key, value, least, most, &allowed)
    }

    fn number_of(
        &self,
        key: &str,
        value: &Spanned<DeValue<'_>>,
        least: f32,
        most: f32,
        allowed: &str,
    ) -> Result<f32, FileError> {
        let text = match value.get_ref() {
            DeValue::Float(float) => float.as_str(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            _ => return Err(self.wrong_type(key, value, allowed)),
        };
        match text.parse::<f32>() {
            Ok(number) if number >= least && number <= most => Ok(number),
            _ => {
                let problem = Problem::Range { value: text.into(), allowed: allowed.into() };
                Err(self.error(key, value.span().start, problem))
            }
        }
    }

    /// Two numbers, least and most.
    ///
    /// # Errors
    /// As [`Section::number`], or not two of them.
    pub fn pair(&self, key: &str, least: f32, most: f32, unit: &str) -> Result<(f32, f32), FileError> {
        let allowed = format!("two numbers `[least, most]` from {least} to {most}{unit}");
        let value = self.value(key, &allowed)?;
        let [a, b] = value.get_ref().as_array().map(|array| &array[..]).unwrap_or_default() else {
            return Err(self.wrong_type(key, value, &allowed));
        };
        Ok((self.number_of(key, a, least, most, &allowed)?, self.number_of(key, b, least, most, &allowed)?))
    }

    /// `least_count` to `most_count` numbers from `least` to `most`.
    ///
    /// # Errors
    /// As [`Section::number`], or another count of them.
    pub fn numbers(
        &self,
        key: &str,
        (least_count, most_count): (usize, usize),
        (least, most): (f32, f32),
        unit: &str,
    ) -> Result<Vec<f32>, FileError> {
        let allowed = format!("{least_count} to {most_count} numbers from {least} to {most}{unit}");
        let value = self.value(key, &allowed)?;
        let array = value.get_ref().as_array().map(|array| &array[..]);
        let Some(array) = array.filter(|array| (least_count..=most_count).contains(&array.len())) else {
            return Err(self.wrong_type(key, value, &allowed));
        };
        array.iter().map(|value| self.number_of(key, value, least, most, &allowed)).collect()
    }

    /// A text of up to 1000 characters.
    ///
    /// # Errors
    /// It is missing, or something else.
    pub fn text(&self, key: &str) -> Result<String, FileError> {
        let allowed = "a text of up to 1000 characters";
        let value = self.value(key, allowed)?;
        let text = value.get_ref().as_str().filter(|text| text.chars().count() <= 1000);
        text.map(str::to_string).ok_or_else(|| self.wrong_type(key, value, allowed))
    }

    /// A whole number from `least` to `most`.
    ///
    /// # Errors
    /// It is missing, no whole number or out of range.
    pub fn whole(&self, key: &str, least: u32, most: u32, unit: &str) -> Result<u32, FileError> {
        let allowed = format!("a whole number from {least} to {most}{unit}");
        let value = self.value(key, &allowed)?;
        let Some(integer) = value.get_ref().as_integer() else { return Err(self.wrong_type(key, value, &allowed)) };
        match u32::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(number) if (least..=most).contains(&number) => Ok(number),
            _ => Err(self.error(key, value.span().start, Problem::Range { value: integer.to_string(), allowed })),
        }
    }

    /// Yes or no.
    ///
    /// # Errors
    /// It is missing or something else.
    pub fn flag(&self, key: &str) -> Result<bool, FileError> {
        let allowed = "`true` or `false`";
        let value = self.value(key, allowed)?;
        value.get_ref().as_bool().ok_or_else(|| self.wrong_type(key, value, allowed))
    }

    /// One of the words; gives what stands beside it.
    ///
    /// # Errors
    /// It is missing or another one.
    pub fn word<T: Copy>(&self, key: &str, words: &[(&str, T)]) -> Result<T, FileError> {
        let quoted: Vec<String> = words.iter().map(|(word, _)| format!("\"{word}\"")).collect();
        let allowed = format!("one of {}", quoted.join(", "));
        let value = self.value(key, &allowed)?;
        let found = value.get_ref().as_str().and_then(|text| words.iter().find(|(word, _)| *word == text));
        found.map(|(_, meaning)| *meaning).ok_or_else(|| self.wrong_type(key, value, &allowed))
    }

    /// A table with these fields and no others.
    ///
    /// # Errors
    /// It is missing or something else.
    pub fn table(&self, key: &str, fields: &[&str]) -> Result<Section<'a>, FileError> {
        let allowed = format!("a table with {}", list(fields));
        let value = self.value(key, &allowed)?;
        let table = value.get_ref().as_table().ok_or_else(|| self.wrong_type(key, value, &allowed))?;
        let (document, path) = (self.document, format!("{}{key}.", self.path));
        Section { document, path, offset: value.span().start, table }.only(fields)
    }

    /// The tables of a list, each with these fields and no others.
    ///
    /// # Errors
    /// It is missing or something else.
    pub fn tables(&self, key: &str, fields: &[&str]) -> Result<Vec<Section<'a>>, FileError> {
        let allowed = format!("a list of tables with {}", list(fields));
        let value = self.value(key, &allowed)?;
        let array = value.get_ref().as_array().ok_or_else(|| self.wrong_type(key, value, &allowed))?;
        let tables = array.iter().enumerate().map(|(index, entry)| {
            let name = format!("{key}[{index}]");
            let table = entry.get_ref().as_table().ok_or_else(|| self.wrong_type(&name, entry, &allowed))?;
            let (document, path, offset) = (self.document, format!("{}{name}", self.path), entry.span().start);
            document.places.borrow_mut().push((path.clone(), offset));
            Section { document, path: path + ".", offset, table }.only(fields)
        });
        tables.collect()
    }

    /// The schema version, which has to be this one.
    ///
    /// # Errors
    /// It is missing or another one.
    pub fn schema(&self, version: u32) -> Result<(), FileError> {
        let allowed = format!("{version}, the version of this file's layout");
        let value = self.value("schema", &allowed)?;
        let integer = value.get_ref().as_integer().ok_or_else(|| self.wrong_type("schema", value, &allowed))?;
        if integer.as_str() == version.to_string() {
            return Ok(());
        }
        Err(self.error("schema", value.span().start, Problem::Range { value: integer.to_string(), allowed }))
    }
}
