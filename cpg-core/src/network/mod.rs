//! Networks of coupled oscillators: coupling graphs, Rayleigh networks, symmetric cells.

pub mod graph;
pub mod phase_coupled;
#[cfg(feature = "fixed-point")]
pub mod phase_coupled_fixed;
pub(crate) mod second_order;
pub mod symmetric_cells;
pub mod thesis;
