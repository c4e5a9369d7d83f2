//! The loop: one sample set in, one gated servo command out, once every control period.
//!
//! # Contract
//! [`JointLoop::tick`] is a pure function of the loop's own state and the [`Sample`]: it takes no clock, does no I/O, allocates
//! nothing and cannot panic. The board, a host replay and a test call the same function, and the same inputs give the same
//! bits everywhere. Whatever the generator or the sensor does, the gate bounds what the servos are told; nothing is told at
//! all unless the supervisor is in one of its three moving states, and those are entered only by a press of the button.
//!
//! ```
//! use cpg_core::gait::default_walk::default_walk;
//! use joint_loop::{LoopConfig, Sample, SupervisorState};
//! use joint_units::{Joint, Period};
//!
//! // From its own rhythm, with no sensor on the leg.
//! let mut config = LoopConfig::default_biped();
//! config.monitor.sensor_required = false;
//! let mut joints = config.build(Period::MILLISECOND, default_walk(Period::MILLISECOND)?, [])?;
//! let idle = Sample::default();
//! let pressed = Sample { button: true, ..idle };
//!
//! // Boot, then disarmed: no pulse, however long it takes.
//! for _ in 0..100 {
//!     assert_eq!(joints.tick(&idle).pulses, None);
//! }
//! assert_eq!(joints.state(), SupervisorState::Disarmed);
//!
//! // A press (20 ms, debounced) arms; the first pulse is the park pose, hips at 0 degrees and knees at 5.
//! let first = (0..25).find_map(|_| joints.tick(&pressed).pulses).expect("armed");
//! assert_eq!(first.map(|pulse| pulse.0), [1500, 1500, 1056, 1944]);
//!
//! // Ramp for 2 s, walk for 2 s. The gate lets the rhythm pass as it is.
//! let mut widest = 0.0_f32;
//! for _ in 0..4_000 {
//!     assert!(joints.tick(&idle).pulses.is_some());
//!     let knee = joints.frame().setpoints[Joint::LeftKnee as usize];
//!     widest = widest.max(knee.degrees());
//!     assert!(!joints.frame().limited.any());
//! }
//! assert_eq!(joints.state(), SupervisorState::Walking);
//! assert!((60.0..63.0).contains(&widest), "{widest}");
//!
//! // A second press stops to the park pose within a second, and then the outputs are off.
//! for _ in 0..25 {
//!     joints.tick(&pressed);
//! }
//! assert_eq!(joints.state(), SupervisorState::Stopping);
//! for _ in 0..1_000 {
//!     joints.tick(&idle);
//! }
//! assert_eq!((joints.state(), joints.tick(&idle).pulses), (SupervisorState::Disarmed, None));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Glossary
//! - **tick**: one call of the loop, or one control period of the counter that numbers them: a missed period is counted but
//!   never made up for.
//! - **sample**: what the board delivers for one tick; **reading**: what `hgod-adc` makes of it.
//! - **target**: the angle that the blend asks for; **setpoint**: the angle that the gate lets pass; **command**: the pulse
//!   widths that the servos are given, or none.
//! - **park pose**: where the joints start from and come back to; **weight**: the share of the generator in the target, 0 to 1.
//! - **demand**: what the watched conditions ask of the supervisor: go, stop, or fault; **cause**: why.
//! - **limited**: the gate held a setpoint back from its target. A status, not a fault.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod control;
mod error;
pub mod generator;
pub mod io;
pub mod motion;
pub mod setup;
pub mod store;

pub use control::fault_table::{
    FOLLOWER_BRIDGE_MS, FREEWHEEL_MS, FaultResponse, PARK_MS, Response, SENSOR_TOLERANCE_MS, fault_response,
};
pub use control::monitor::MonitorConfig;
pub use control::supervisor::{Cause, SupervisorState};
pub use control::tick::JointLoop;
pub use error::LoopError;
pub use generator::follow::FollowConfig;
pub use generator::shape::{SERIES_HARMONICS, SeriesConfig, ShapeConfig};
pub use generator::{BoardGenerator, GeneratorConfig};
pub use io::board::{BoardFaults, Command, MAX_ELAPSED, Sample};
pub use io::frame::{Frame, SetpointHash};
pub use motion::blend::BlendConfig;
pub use motion::gate::{Gate, GateState, GateStatus, NonFinite};
pub use motion::servo::ServoMap;
pub use setup::config::LoopConfig;
pub use setup::robot::{
    DEFAULT_PARK, Direction, GateConfig, JointRange, POSE_LIMITS, PoseLimit, PoseSense, ServoConfig, anatomy,
};
pub use setup::sensors::{JointSensor, JointSensors, JointSensorsError, SENSOR_JOINT, SENSORS};
pub use store::flash_record::FlashRecordError;
