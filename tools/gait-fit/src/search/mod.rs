//! Searches over the oscillator networks: the thesis' genetic algorithm as it stands there, and what finds the same thing sooner.
//!
//! | idea | where |
//! |---|---|
//! | the network, eqs 13-16, one individual a SIMD lane, two vectors in flight, all cores | [`errors`], [`angles`], [`Network`] |
//! | what is made small; the thesis' signed form, for reproduction only | [`Objective`], [`Target`] |
//! | which numbers are free, and their ranges | [`Genes`] |
//! | the thesis' genetic algorithm and its pattern search | [`thesis_ga`], [`pattern_search`] |
//! | micro-GA | [`micro_ga`] |
//! | CMA-ES with IPOP or BIPOP restarts | [`cma_es`] |
//! | Levenberg-Marquardt from many starts, a Jacobian in one batch | [`levenberg`] |
//! | the thesis' network fitted to recorded gait so that it holds | [`fit_thesis`], [`walk_check`] |
//! | R1 fitted to recorded gait | [`fit_robust`] |
//!
//! Everything random comes from a seed and is drawn on one thread: the same seed gives the same bits, on any number of threads.
//! Searches run in f32 at 5 ms, where Runge-Kutta errs by less than 1e-4 degrees on anything that walks, but some individuals of a
//! wide box score better than they are; so every champion is scored again in f64 at 1 ms ([`reference_errors`]).
//!
//! The thesis' network found again from its own waveform:
//! ```
//! use gait_fit::search::cma_es::CmaEs;
//! use gait_fit::search::{Evaluator, Genes, Grid, Network, Objective, Random, Target, errors, reference_errors};
//!
//! let truth = Network::set_s();
//! let target = Target::of_network(&truth, 5.0, 5);
//! let genes = Genes::thesis(truth);
//! let mut costs = |points: &[Vec<f64>]| -> Vec<f64> {
//!     let networks: Vec<Network> = points.iter().map(|point| genes.decode(point)).collect();
//!     errors(&networks, &target, Grid::SEARCH, false).iter().map(|e| Objective::ANGLE.cost(e)).collect()
//! };
//! let mut quiet = |_| ();
//! let mut evaluator = Evaluator::new(genes.count(), &mut costs, &mut quiet).with_budget(20_000).with_goal(0.1 * 0.1);
//! CmaEs::default().run(&mut evaluator, &mut Random::new(1));
//!
//! let champion = genes.decode(evaluator.best().expect("a point"));
//! assert!(reference_errors(&champion, &target, Grid::FINE).rmse_deg() < 0.1);
//! ```

pub mod cma_es;
mod evaluator;
mod genes;
mod lanes;
pub mod levenberg;
pub mod micro_ga;
mod network;
mod objective;
pub mod pattern_search;
mod population;
mod random;
mod robust;
mod settle;
pub mod thesis_ga;
pub mod walk_check;
mod walking;
mod waveform;

pub use evaluator::{Evaluator, Progress};
pub use genes::{Genes, Parameter};
pub use network::{Network, NetworkState, Oscillator};
pub use objective::{Errors, Objective, Target};
pub use population::{Grid, angles, errors, reference_errors};
pub use random::Random;
pub use robust::{Dynamics, RobustFit, fit_robust};
pub use walking::{SearchSettings, ThesisFit, fit_thesis};
