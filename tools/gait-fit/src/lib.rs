//! From recorded strides to a generator's parameters: fits, judgement on strides that were not fitted, certificates, reports.
//!
//! | module | what it is for |
//! |---|---|
//! | [`fit`](mod@fit) | a recording as read to a walker's file, with everything that is to be said about it |
//! | [`series`] | phase and shape by linear least squares |
//! | [`search`] | the oscillator networks: populations, the thesis' genetic algorithm, CMA-ES, Levenberg-Marquardt |
//! | [`generator_cycle`](mod@generator_cycle) | a stride of a generator as the board walks it |
//! | [`judge`](mod@judge) | errors beside the walker's own variability |
//! | [`report`] | one self-contained HTML page that a gait lab can read |
#![forbid(unsafe_code)]

pub mod fit;
pub mod generator_cycle;
pub mod judge;
pub mod report;
pub mod search;
pub mod series;
