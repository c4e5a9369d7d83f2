//! Studies that are kept: the thesis' search for its parameters, beside searches that need fewer evaluations, and the gaits of persons.
//!
//! | module | content |
//! |---|---|
//! | [`population`] | errors of many networks at once, in SIMD vectors |
//! | [`objective`] | what is minimised: squared errors, and the thesis' signed form |
//! | [`genes`] | which numbers of a network are free, and their ranges |
//! | [`table_1`] | the thesis' Table 1 as an individual |
//! | [`thesis_ga`], [`pattern_search`] | the thesis' genetic algorithm and the pattern search that ends it |
//! | [`micro_ga`] | the micro-GA that the thesis names as future work |
//! | [`papers`] | both papers computed again: figures, tables, searches, claims with their verdicts, as a page |
//! | [`charts`] | charts of generators that run, also for the commands of `footfall` |
//! | [`processor`] | the processor time of the program |
//! | [`levenberg`] | Levenberg-Marquardt from many random starts |
//! | [`gait_family`] | walks and runs of recorded persons as functions of the cadence, and their errors |
//! | [`normative_band`] | hip and knee of persons who walk, as mean and standard deviation |
//!
//! | example | content |
//! |---|---|
//! | `gait_family` | the numbers of `cpg_core::gait::family`, and the tables of their errors |
//! | `normative_band` | the numbers of `gait_fit::normative` |
//!
//! The fits that the product uses (CMA-ES, Levenberg-Marquardt, the orbit check) are in [`gait_fit::search`].
//!
//! Searches run in f32 at 5 ms, where Runge-Kutta errs by less than 1e-4 degrees on any network that keeps walking. Some individuals
//! of a wide box score better there than they are, so every champion is scored again in f64 at 1 ms ([`reference_errors`]).
//!
//! The thesis' network recovered from its own waveform:
//! ```
//! use gait_fit::search::cma_es::CmaEs;
//! use gait_fit::search::{Evaluator, Network, Random};
//! use reproduce::{Genes, Grid, Objective, Target, errors, reference_errors, set_s};
//!
//! let truth = set_s();
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
#![forbid(unsafe_code)]

pub mod charts;
pub mod gait_family;
pub mod genes;
pub mod levenberg;
pub mod micro_ga;
pub mod normative_band;
pub mod objective;
pub mod papers;
pub mod pattern_search;
pub mod population;
pub mod processor;
pub mod table_1;
pub mod thesis_ga;

pub use genes::{Genes, Parameter};
pub use objective::{Errors, Objective, Target};
pub use population::{Grid, angles, errors, reference_errors};
pub use table_1::{from_config, set_s};
