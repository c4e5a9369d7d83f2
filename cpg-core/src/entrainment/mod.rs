//! Entrainment: a generator whose four joints follow a walking person in phase and stride frequency, measured by one joint sensor.
//!
//! ```text
//! y -> plausibility -> phase lock -> phi, w -> bounded phase -> psi -> a_j = stand_j + s (S_j(psi) + c_j - stand_j)
//! ```
//! y is the measured angle of one hip or knee. The phase lock estimates the person's gait phase phi and its angular frequency w. A template S_j
//! for each joint j (the person's mean stride as a Fourier series) gives the four angles a_j, with a [`correction`] c_j where one was learned
//! (without, c_j = 0). The measured angle never drives a joint directly: the driven phase psi follows phi with bounded acceleration and never
//! decreases, the amplitude s moves with bounded acceleration between 0 (standing in the pose `stand`) and 1 (walking), and c_j is small and moves
//! with bounded acceleration. So angles and rates are continuous for any sequence of samples, and
//! [`Follower::acceleration_bound`] is an upper bound of the joints' acceleration.
//!
//! | state ([`Lock`]) | meaning | target of s | ends when |
//! |---|---|---|---|
//! | stopped | the person stands, or there is no signal | 0 | the joint moves at half of its usual rate or faster |
//! | seeking | the joint moves; phase and stride frequency are searched | as before | the phase error has been small for [`FollowerConfig::settle_s`] |
//! | locked | phase and stride frequency are known | 1 | the person stops, the lock is lost, or the sensor has a fault |
//! | holding | the sensor has a fault; the follower continues with the stride frequency of 2.4 s ago and the phase of 0.6 s ago | as before | samples have been good for [`FollowerConfig::good_s`], or the hold has lasted [`FollowerConfig::freewheel_s`] |
//!
//! **A stop** is found when the joint moves at about a third of the predicted rate or less and does not speed up again, or its amplitude is below
//! [`PlausibilityConfig::amplitude`]. The driven phase then halts and s falls to 0. **A fault** that ends within a hold changes only psi; after
//! a longer one the joints stand, and follow again when the sensor is good. A stuck sensor differs from a standing leg only in how abruptly
//! the motion ended, see [`PlausibilityConfig::abrupt`].
//!
//! **A slow drift** of the measured joint's mean is taken up by that joint's angle within [`FollowerConfig::drift_limit`]; an offset that is
//! there at the lock, or that jumps, is not ([`Follower::drift`]).
//!
//! **Stride events** ([`EventSource`]) support the angle: peaks of a knee find the phase of a person who begins to walk sooner, a foot switch
//! corrects the phase during a fault. With two recorded persons and heel strikes from their own recorded knees, the root mean square phase error
//! 2 s after the loss of the sensor is 5.4 and 2.8 degrees of the stride with a switch, 9.5 and 10.0 without. While locked, events have no
//! effect.
//!
//! | to | see |
//! |---|---|
//! | follow a person with four joints | [`FollowerConfig`], [`Follower`] |
//! | correct the joints by what the sensor shows of this stride | [`correction`] |
//! | estimate phase and stride frequency from an angle only | [`phase_lock`] |
//! | estimate them from heel strikes or peaks only | [`stride_events`] |
//! | get fundamental, quadrature and mean of a periodic signal | [`quadrature_filter`] |
//! | compare with an adaptive-frequency oscillator | [`AdaptiveHopfConfig`] |
//!
//! ```
//! use cpg_core::{Follow, Generator};
//! use cpg_core::entrainment::{FollowerConfig, Lock};
//! use cpg_core::entrainment::phase_lock::Template;
//! use cpg_core::waveform::shape::Shape;
//! use joint_units::{Joint, Period, Phase, Radians};
//! let hip = Template::new(Radians(0.1), [0.35, -0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 8])?;
//! let mut legs = FollowerConfig::default().build([hip; 4], Joint::LeftHip, Period::MILLISECOND)?;
//! for tick in 0..6000 {
//!     let person = Phase::from_cycles(0.3 + tick as f32 * 1e-3 / 1.2); // strides of 1.2 s, the template's are of 1.1
//!     legs.observe(Some(Radians(hip.at(person).angle)));
//!     legs.step();
//! }
//! assert_eq!(legs.status().state, Lock::Locked);
//! assert!((legs.status().stride_s - 1.2).abs() < 0.02);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

mod adaptive_hopf;
mod bounded_phase;
mod config;
pub mod correction;
mod drift;
mod events;
mod follower;
mod history;
pub mod phase_lock;
mod plausibility;
pub mod quadrature_filter;
mod stop_detector;
pub mod stride_events;

pub use adaptive_hopf::{AdaptiveHopfConfig, AdaptiveHopfEstimator};
pub use config::{FollowStatus, FollowerConfig, Lock};
pub use correction::Corrections;
pub use events::EventSource;
pub use follower::Follower;
pub use plausibility::{PlausibilityConfig, SensorFault};
