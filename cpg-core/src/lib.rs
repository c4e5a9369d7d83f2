//! Central pattern generators that make joint angles at a fixed control period, bit-equal on host and microcontroller.
//!
//! A central pattern generator (CPG) makes a periodic motion without periodic input: a network of oscillators, a waveform over a phase, or
//! legs scheduled by integers. Every generator has a configuration in SI units (or in those of its paper). `config.build(period)` checks it,
//! computes its constants for one control period and returns a [`Generator`]: one `step` a tick, without clock, allocation or panic. If a generator needs another value, such as a model or
//! templates, it is passed before the period: `config.build(flow, period)`. Types without a control period, such as a waveform, have `new`.
//!
//! To begin: [`gait::default_walk`] walks, [`gait::named`] has gaits by name, [`waveform::shape`] plays your own waveforms, [`entrainment`] follows a
//! person, and [`transition`] makes every change smooth.
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
//! # Modules
//! | module | content | source |
//! |---|---|---|
//! | [`gait::default_walk`] | the default walk: R1 with four joints | - |
//! | [`gait::named`], [`gait::speed_limit`] | gaits by name, behind one type; their speeds within rate limits | - |
//! | [`gait::family`] | walk and run of recorded persons as functions of the cadence, with start and stop | - |
//! | [`gait::six_and_eight_joints`] | R1 with ankles (six joints), and with arms (eight) | - |
//! | [`gait::catalogue`], [`gait::fitted`] | every model as a generator of four joints; the fitted numbers | - |
//! | [`network::phase_coupled`] | R1: Rayleigh oscillators with phase-rotated diffusive links | after the thesis |
//! | `network::phase_coupled_fixed` | R1 without a floating-point unit (feature `fixed-point`) | - |
//! | [`network::thesis`] | Rayleigh oscillators with difference and product links | thesis, eqs 13-16 and Table 1 |
//! | [`network::symmetric_cells`] | four and eight symmetric cells: gaits of two and four legs | Golubitsky et al. 1998, 2006 |
//! | [`oscillator::rayleigh`] | the isolated Rayleigh oscillator | thesis, eqs 5-12 |
//! | [`oscillator::van_der_pol`], [`oscillator::hopf`] | van der Pol; Hopf, also with adaptive frequency | 1926; Righetti, Buchli, Ijspeert 2006 |
//! | [`oscillator::matsuoka`], [`oscillator::half_centre`] | mutually inhibiting neurons with adaptation; two cells in antiphase | Matsuoka 1985; Brown 1911 |
//! | [`oscillator::fitzhugh_nagumo`], [`oscillator::morris_lecar`], [`oscillator::terman_wang`] | neurons | 1961; 1981; 1995 |
//! | [`oscillator::kuo`], [`oscillator::hu`] | clock, feedback and their hybrid on a pendulum; resonance of a joint | Kuo 2002; Hu, Williamson, Pratt |
//! | [`edge_reversal`] | edge reversal in integers: graphs, building blocks, six legs | Yang et al. 2014 |
//! | [`waveform::shape`] | one exact phase, a Fourier or spline waveform for each joint | - |
//! | `waveform::fixed` | the same in fixed point (feature `fixed-point`) | - |
//! | [`waveform::adaptive_fourier`], [`waveform::hopf_bank`] | learn a signal while they run | derived in the modules, after Petric et al. 2011; after Righetti, Ijspeert 2006 |
//! | [`joints`] | from states of a model to joint angles | - |
//! | [`transition`] | any generator to any other without a jump and inside the range of every joint, at any tick | - |
//! | [`entrainment`] | four joints follow a walking person, measured by one joint sensor | - |
//! | [`math`] | integrators, sine, cosine and arc tangent (in fixed point with feature `fixed-point`) | - |
//!
//! The thesis is "Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory" (IIITA Allahabad).
//!
//! # Features
//! - `f64`: [`Scalar`] for `f64`, for reference computations on a host. A microcontroller does not need it.
//! - `fixed-point`: generators in fixed point, for microcontrollers without a floating-point unit.
//! - `defmt`: `defmt::Format` for errors and status. For a target that links a defmt logger.
//!
//! # A new model
//! A model of second-order oscillators is one file: its configuration, its vector field ([`SecondOrder`]), and a `build` that folds
//! the configuration into the field of an [`Oscillators`]. A first-order model implements [`math::first_order::Flow`] and is read out with
//! [`joints::linear`].
//!
//! # Glossary
//! - **generator**: a program that makes joint angles; **gait**: a named pattern of a generator.
//! - **follower**: a generator whose phase is locked to that of a measured **person**, see [`Follow`].
//! - **stride**: one full cycle; **step** of a person: half of it; `step` of a generator: one control period (**tick**).
//! - **limit cycle**: the closed orbit on which a generator settles from any start in its basin.
//! - **phase**: the position on that orbit as a part of the cycle; the gait phase is that of the first joint.
//! - **lead**: how far the phase of a joint is ahead of the gait phase.
//! - **harmonic balance**: the amplitude at which a sinusoid gains no energy over a cycle; exact for weak damping.
//! - **time unit**: the fraction of a control period (1 or 1/2) in which an [`Integrator`] measures time, see [`Integrator::UNITS`].
//! - **cadence**: steps a minute, two a stride; **stride frequency**: 2 pi / stride time, in rad/s.
//! - **template**: a joint's waveform over the gait phase.
//! - **innovation**: measured minus predicted angle; **fundamental**: the first harmonic of a periodic signal.
//! - **fold**: compute the constants of a configuration for one control period, once, in `build`.
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

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
