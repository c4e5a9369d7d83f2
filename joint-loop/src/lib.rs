//! One control period of a robot with four joints: converts a sample of the board to limited servo pulses.
//!
//! [`JointLoop::tick`] is a pure function of the loop's state and the [`Sample`]: it has no clock and no I/O, allocates nothing
//! and cannot panic. Firmware, host replay and tests call the same function, and the same inputs give the same bits. The gate
//! limits every setpoint, for any output of generator and sensor. Pulses exist only in the three moving states of the
//! supervisor, and only a deliberate hold of the button starts a motion: a request of a host can stop it, not start it.
//!
//! | module | contents |
//! |---|---|
//! | [`control`] | tick, supervisor, monitor, fault table, button, test of the emergency stop, trim |
//! | [`motion`] | blend, gate, limits, servo map |
//! | [`setup`] | configuration, robot, sensors, default loop |
//! | [`generator`] | the generators of a board, one file for each kind |
//! | [`store`] | records in flash: generator, sensors, robot |
//! | [`tuning`] | changes while the loop runs: table of parameters, requests, transition |
//! | [`io`] | interface to the board, frame, time code |
//!
//! ```
//! use cpg_core::Unguided;
//! use cpg_core::gait::default_walk::default_walk;
//! use joint_loop::{LoopConfig, Sample, SupervisorState};
//! use joint_units::{Joint, Period};
//!
//! // A generator that needs no sensor.
//! let mut config = LoopConfig::default_biped();
//! config.monitor.sensor_required = false;
//! let walk = Unguided(default_walk(Period::MILLISECOND)?);
//! let mut joints = config.build(Period::MILLISECOND, walk, [])?;
//! let idle = Sample::default();
//! let pressed = Sample { button: true, ..idle };
//!
//! // Boot, then disarmed: no pulses.
//! for _ in 0..100 {
//!     assert_eq!(joints.tick(&idle).pulses, None);
//! }
//! assert_eq!(joints.state(), SupervisorState::Disarmed);
//!
//! // The release after a hold of 0.5 s arms (debounced, 20 ms). The first pulses are those of the park pose: hips at 0 degrees, knees at 5.
//! for _ in 0..500 {
//!     assert_eq!(joints.tick(&pressed).pulses, None);
//! }
//! let first = (0..25).find_map(|_| joints.tick(&idle).pulses).expect("armed");
//! assert_eq!(first.map(|pulse| pulse.0), [1500, 1500, 1056, 1944]);
//!
//! // Ramp for 2 s, walk for 2 s. The gate does not limit the default walk.
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
//! // A second press stops at once: it ramps to the park pose in one second and then switches the outputs off.
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
//! - **tick**: one control period, and the call for it. Missed periods are counted and not made up.
//! - **sample**: the board's inputs of one tick. **reading**: the angle and validity that `hgod-adc` computes from a code.
//! - **validity**: what is known about one sensor sample: good, open, short, ...
//! - **generator**: a program that makes joint angles. **follower**: a generator whose phase is locked to a person's.
//! - **target**: an angle before the gate. **setpoint**: an angle after the gate. **pulse**: the width of a servo pulse.
//! - **park pose**: the pose at the start and at the end of a motion. **weight**: share of the generator in the target, 0 to 1.
//! - **demand**: what the monitor asks of the supervisor: go, stop or fault. **cause**: why the supervisor left a state.
//! - **limited**: a limit of the gate changed a setpoint. A status, not a fault.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod control;
mod error;
pub mod generator;
pub mod io;
pub mod motion;
pub mod setup;
pub mod store;
pub mod tuning;

pub use control::fault_table::{
    FOLLOWER_BRIDGE_MS, FOLLOWER_LOST_MS, FREEWHEEL_MS, FaultResponse, PARK_MS, Response, SENSOR_TOLERANCE_MS,
    fault_response,
};
pub use control::monitor::{MonitorConfig, WALK_S};
pub use control::supervisor::{Cause, SupervisorState};
pub use control::supply::{DIPS, DIPS_MS, RIPPLE_MS, SUPPLY_TOLERANCE_MS};
pub use control::tick::JointLoop;
pub use control::watchdog_clock::WatchdogHz;
pub use error::LoopError;
pub use generator::follow::FollowConfig;
pub use generator::shape::{SERIES_HARMONICS, SeriesConfig, ShapeConfig};
pub use generator::{BoardGenerator, GeneratorConfig};
pub use io::board::{BoardFaults, Command, Debugger, MAX_ELAPSED, Sample};
pub use io::conditions::{BAD, Conditions, SensorCounts};
pub use io::frame::{Frame, SetpointHash};
pub use motion::blend::BlendConfig;
pub use motion::gate::{Gate, GateState, GateStatus, NonFinite};
pub use motion::servo::ServoMap;
pub use setup::config::LoopConfig;
pub use setup::robot::{
    DEFAULT_PARK, Direction, GateConfig, JointRange, POSE_LIMITS, PoseLimit, PoseSense, ServoConfig, anatomy,
};
pub use setup::robot_config::{FollowerRules, Robot, RobotConfig};
pub use setup::sensors::{JointSensor, JointSensors, JointSensorsError, SENSOR_JOINT, SENSORS};
pub use store::flash_record::FlashRecordError;
pub use store::record_name::RecordName;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
