//! The rhythm: central pattern generators that run at a fixed control period, bit-equal on host and board.
//!
//! A central pattern generator (CPG) is a network of oscillators that makes rhythmic joint setpoints without rhythmic input. Every
//! generator here is configured in SI or in its paper's units, validated and folded for one control period by its `build`, and is
//! then a [`Generator`]: one `step` a tick, no clock, no allocation, no panic, no division and no trigonometry in the step.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::gait::default_walk::default_walk;
//! use joint_units::Period;
//! let mut walk = default_walk(Period::MILLISECOND)?;
//! for _ in 0..60_000 {
//!     walk.step();
//! }
//! assert!(walk.check().is_ok() && (walk.amplitude() - 1.0).abs() < 0.04);
//! // A minute is 54.5454 strides of 1.1 s.
//! assert!((walk.phase().cycles() - 0.5454).abs() < 0.02);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```
//!
//! # The generators
//! | module | model | source |
//! |---|---|---|
//! | [`walking`] | the walking set that ships: R1 with four joints | - |
//! | [`bipeds`] | six joints with ankles, eight with arms, on R1 | - |
//! | [`robust`] | R1: Rayleigh oscillators, phase-rotated diffusive links | after the thesis |
//! | [`thesis`] | Rayleigh oscillators, difference and product links | thesis, eqs 13-16 and Table 1 |
//! | [`rayleigh`] | the isolated Rayleigh oscillator | thesis, eqs 5-12 |
//! | [`shape`] | one exact phase, a Fourier or spline shape per joint | - |
//! | [`van_der_pol`], [`hopf`] | van der Pol; Hopf, also with adaptive frequency | 1926; Righetti, Buchli, Ijspeert 2006 |
//! | [`matsuoka`] | mutually inhibiting neurons with adaptation, the half-centre | Matsuoka 1985 |
//! | [`fitzhugh_nagumo`], [`morris_lecar`], [`terman_wang`] | neurons | 1961; 1981; 1995 |
//! | [`golubitsky`] | four and eight symmetric cells: the gaits of two and four legs | Golubitsky et al. 1998, 2006 |
//! | [`obb`], [`smer`], [`hexapod`], [`hexapod_walk`] | edge reversal in integers, the six-legged ladder | Yang et al. 2014 |
//! | [`adaptive_fourier`], [`programmable`] | learn a signal on line | Petric et al. 2011; Righetti, Ijspeert 2006 |
//! | [`half_centre`] | two alike cells that push each other apart; flexor and extensor | Brown 1911 |
//! | [`readout`], [`joint_walker`], [`bank_walk`], [`obb_walk`] | any flow, the bank and the building block as joint angles | - |
//! | [`walkers`], [`features`] | all of them as walkers of four joints at one stride, and what a read-out can use | - |
//! | [`kuo`], [`hu`] | clock, feedback and their hybrid on a pendulum; an oscillator that finds a joint's resonance | Kuo 2002; Hu, Williamson, Pratt |
//! | [`fixed_point`], [`fixed_shape`], [`fixed_trig`] | R1, phase and shape without a floating-point unit | - |
//! | [`gaits`] | the gaits that ship, by name | - |
//! | [`entrainment`] | four joints follow a walking person, from one worn joint sensor | - |
//! | [`phase_lock`], [`sogi`], [`stride_event`] | the walker's phase and cadence: loop, quadrature filter, events | Rodriguez et al. 2006 (the filter) |
//! | [`transition`] | any of them, changed at any tick without a jump | - |
//!
//! The thesis is "Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory" (IIITA Allahabad).
//!
//! A new model of second-order oscillators is one file: its configuration, its vector field ([`SecondOrder`]), and a `build` that
//! folds the one into the other for [`Oscillators`].
//!
//! # Glossary
//! - **limit cycle**: the closed orbit that a generator settles on from any start in its basin.
//! - **phase**: where on that orbit it is, as a part of the cycle; the gait phase is that of the first joint.
//! - **lead**: by how much a joint's phase is ahead of the gait phase.
//! - **harmonic balance**: the amplitude at which a sinusoid gains no energy over a cycle; exact for weak damping.
//! - **time unit**: the fraction of a control period in which an [`Integrator`] counts.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod edge_reversal;
pub mod entrainment;
mod error;
mod follow;
pub mod gait;
mod generator;
pub mod joints;
pub mod math;
pub mod network;
pub mod oscillator;
pub mod transition;
pub mod waveform;

pub use error::{BuildError, Field, NonFinite};
pub use follow::{Follow, Unguided};
pub use generator::{Generator, StateFault};
pub use math::scalar::Scalar;
pub use math::second_order::{Integrator, Rk4, SecondOrder, SemiImplicitEuler};
pub use network::graph::Graph;
pub use network::second_order::{BOUND_FACTOR, OscillatorState, Oscillators};
