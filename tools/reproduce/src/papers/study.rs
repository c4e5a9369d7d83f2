//! The result: figures, tables and claims.

use super::claim::Claim;
use super::figure::Figure;

/// A table of the page, also written as CSV.
#[derive(Debug, Clone)]
pub struct Table {
    /// The name of its file, without extension.
    pub name: &'static str,
    /// Its title.
    pub title: String,
    /// What is in it, and how it was computed.
    pub note: String,
    /// The heads of its columns.
    pub head: Vec<String>,
    /// Its rows.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// The table as CSV.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut rows = csv::Writer::from_writer(vec![]);
        for row in std::iter::once(&self.head).chain(&self.rows) {
            // Writing to a vector cannot fail.
            let _ = rows.write_record(row);
        }
        rows.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
    }
}

/// A part of the result.
#[derive(Debug, Clone)]
pub struct Section {
    /// Its title.
    pub title: &'static str,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// Its tables.
    pub tables: Vec<Table>,
}

/// The result.
#[derive(Debug, Clone)]
pub struct Study {
    /// Figures and tables.
    pub sections: Vec<Section>,
    /// The claims, in the order of the papers.
    pub claims: Vec<Claim>,
}

impl Study {
    /// All figures.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.sections.iter().flat_map(|section| &section.figures)
    }

    /// All tables.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.sections.iter().flat_map(|section| &section.tables)
    }
}
