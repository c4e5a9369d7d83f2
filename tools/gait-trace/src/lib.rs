//! Recordings of gait on the host: in and out of files, resampled, cut into loops, turned into volts, compared.
//!
//! A [`Recording`] is a table: one strictly increasing time column in seconds, and channels by name. Angles are in degrees,
//! flexion positive, as people read and write them; the cores get radians through [`Channel::radians`].
//!
//! | module | what it is for |
//! |---|---|
//! | [`csv_file`] | CSV in and out: header `time_s,left_hip_deg,...`; every fault of a file has an error that names line and column |
//! | [`open`] | any file: recognises its format and reads its joints |
//! | [`mapped_csv`] | CSV with any header, delimiter and unit; columns by name or by map |
//! | [`opensim`] | OpenSim .mot and .sto, in and out |
//! | [`c3d`] | C3D: joint angles, or hips and knees from joint centres |
//! | [`mcap_file`] | MCAP: joint angles in JSON messages, such as a capture's |
//! | [`scope`] | exports of oscilloscopes: volts to angles through a calibration |
//! | [`joint_names`] | which joint a column is by its name |
//! | [`raw`] | the four joints as a file has them, before repair |
//! | [`recording`] | the table and its rules |
//! | [`cycle`] | one stride, stretched to a fixed number of points |
//! | [`mod@condition`] | from what a file has to what can be fitted: even times, no gaps, no jumps, flexion positive |
//! | [`convention`] | signs and exchanged columns, read off the shape of gait |
//! | [`repair`] | interpolation, bridges, and what a leg cannot have done |
//! | [`strides`] | the strides, what is none and why, and the mean cycle |
//! | [`mod@cut`] | from the beat to strides, with a reason for all that is in none |
//! | [`segment`] | the beat that strides are counted by |
//! | [`resample`] | linear interpolation to a fixed rate |
//! | [`stride`] | the stride period of a periodic recording |
//! | [`looped`] | a whole number of strides that can be played end to end without a jump |
//! | [`volts`] | angles backwards through a calibration: *semi-synthetic* volts |
//! | [`metrics`] | root mean square and peak of a difference |
//! | [`whole_file`] | files that are there whole or not at all |
//!
//! Another file format is one more file beside [`csv_file`] that makes a [`Recording`] and speaks [`TraceError`].
//!
//! ```
//! use gait_trace::Recording;
//! use gait_trace::format::csv_file;
//! let text = "time_s,left_hip_deg,left_knee_deg\n0,20.5,3\n0.01,20.1,4\n0.02,19.4,6\n";
//! let recording = csv_file::parse("walk.csv", text.as_bytes())?;
//! assert_eq!(recording.duration_s(), 0.02);
//! let knee = recording.resample(200.0)?;
//! assert_eq!(knee.channel("left_knee")?.values(), [3.0, 3.5, 4.0, 5.0, 6.0]);
//!
//! let error = csv_file::parse("walk.csv", "time_s,left_knee_deg\n0,3\n0.01,abc\n".as_bytes()).unwrap_err();
//! assert_eq!(error.to_string(), "walk.csv:3: column 2 `left_knee_deg`: `abc` is not a number; allowed is a decimal number such as -12.5");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod clean;
mod fault;
mod finding;
pub mod format;
pub mod options;
pub mod raw;
pub mod recording;
mod series;
pub mod stride;
pub mod volts;

pub use clean::condition::{Conditioned, condition};
pub use clean::condition_error::ConditionError;
pub use clean::resample::ResampleError;
pub use clean::rules::{LowPass, Rules};
pub use fault::{Fault, TraceError};
pub use finding::{Done, Finding, FindingKind};
pub use options::{MapError, ReadOptions};
pub use raw::{RawJoint, RawJoints};
pub use recording::{
    Channel, MAX_ANGLE_DEG, MAX_PIN_VOLTS, MIN_PIN_VOLTS, NoChannel, Quantity, Recording, RecordingError,
};
pub use stride::cycle::Cycle;
pub use stride::looped::{LoopError, Looped};
pub use stride::spans::{LeftOut, Span, StrideError, WhyLeftOut};
pub use stride::strides::Strides;
pub use volts::VoltsError;
