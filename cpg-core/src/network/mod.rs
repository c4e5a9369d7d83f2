//! Networks of coupled oscillators: coupling graphs, Rayleigh networks, symmetric cells.
//!
//! | to | see |
//! |---|---|
//! | walk: oscillators whose links hold the phase of every joint (R1) | [`phase_coupled`] |
//! | do the same on a chip without a floating-point unit | `phase_coupled_fixed` (feature `fixed-point`) |
//! | repeat the thesis | [`thesis`] |
//! | study gaits by symmetry, of two and four legs | [`symmetric_cells`] |
//! | couple other joints than hips and knees | [`graph`] |

pub mod graph;
pub mod phase_coupled;
#[cfg(feature = "fixed-point")]
pub mod phase_coupled_fixed;
pub(crate) mod second_order;
pub mod symmetric_cells;
pub mod thesis;
