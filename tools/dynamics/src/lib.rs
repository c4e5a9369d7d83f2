//! Analyses of oscillators and generators as dynamical systems: phase response, lock range, basins, bifurcations.
//!
//! A [`System`](system::System) is a single oscillator by name or a generator of `footfall certify`. Each analysis is one module:
//!
//! | module | question |
//! |---|---|
//! | [`phase_response`] | by how much does a kick shift the phase? |
//! | [`tongue`] | which periodic inputs lock it, and n cycles to m? |
//! | [`basin`] | which attractor does each start reach? |
//! | [`bifurcation`] | where does it begin to oscillate as a parameter changes? |
//!
//! ```
//! use dynamics::cycle::Cycle;
//! use dynamics::phase_response::response;
//! use dynamics::system::System;
//! let hopf = System::read("oscillator:hopf")?;
//! let cycle = Cycle::of(&hopf)?;
//! // A kick of a tenth of the radius along x, at eight phases.
//! let points = response(&cycle, 0, 0.1, 8);
//! // At a quarter of the cycle it turns the point (0, 1) back by atan(0.1).
//! assert!((points[2].shift.expect("it comes back") + 0.1f64.atan() / std::f64::consts::TAU).abs() < 1e-4);
//! # Ok::<(), String>(())
//! ```
#![forbid(unsafe_code)]

pub mod basin;
pub mod bifurcation;
pub mod cycle;
pub mod oscillator;
pub mod phase_response;
pub mod settle;
pub mod system;
pub mod tongue;
