//! How much is measured.

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Extent {
    /// Runs of each measurement.
    pub(crate) runs: usize,
    /// The largest file of a reader, bytes.
    pub(crate) largest_file: u64,
    /// The largest export of an oscilloscope, bytes.
    pub(crate) largest_scope: u64,
    /// Numbers of recordings in a folder.
    pub(crate) recordings: &'static [usize],
    /// Generations of the genetic algorithm.
    pub(crate) generations: usize,
}

impl Extent {
    /// A measurement.
    pub(crate) const WHOLE: Self = Self {
        runs: 5,
        largest_file: 64 << 20,
        largest_scope: 238_000_000,
        recordings: &[10, 100, 1000],
        generations: 1000,
    };
    /// Whether everything works.
    pub(crate) const QUICK: Self =
        Self { runs: 1, largest_file: 1 << 18, largest_scope: 3 << 20, recordings: &[1, 2], generations: 3 };
}
