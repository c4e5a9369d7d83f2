//! What a reader says about its format: one row of the table in `docs/formats.md`.

/// One format.
pub(crate) struct Description {
    /// Name and usual extensions.
    pub(crate) name: &'static str,
    /// By what it is recognised.
    pub(crate) recognised: &'static str,
    /// Where the unit of the values comes from.
    pub(crate) units: &'static str,
    /// Which of several axes is flexion.
    pub(crate) axes: &'static str,
    /// Which direction is positive.
    pub(crate) signs: &'static str,
    /// Where times and rate come from.
    pub(crate) rate: &'static str,
    /// Options that override an assumption.
    pub(crate) options: &'static [&'static str],
}

/// How signs are treated in a format that defines them.
pub(crate) const DEFINED: &str = "flexion positive, by definition of the format";
/// How signs are treated in a format that defines none.
pub(crate) const SIGNS: &str = "the file's, then made flexion positive (see below)";
