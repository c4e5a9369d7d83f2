//! Recordings of gait on the host: reading and writing files, repair, strides, and conversion to sensor volts.
//!
//! A [`Recording`] is a table: one strictly increasing time column in seconds, and channels by name. Angles are in degrees with flexion
//! positive, as people read and write them; [`Channel::radians`] converts them for the cores.
//!
//! The usual path: [`format::open`] reads a file to [`RawJoints`], [`condition`](fn@condition) repairs them to [`Conditioned`] joints at a
//! fixed rate, [`stride::strides`] cuts these into strides and averages them.
//!
//! | module | content |
//! |---|---|
//! | **file formats** | [`format`](mod@format) |
//! | [`format::open`] | any file: recognises the format and reads the joints |
//! | [`format::csv_file`] | the project's own CSV, in and out: header `time_s,left_hip_deg,...`; every error names line and column |
//! | [`format::mapped_csv`] | CSV with any header, delimiter and unit; columns by name or by the caller's map |
//! | [`format::opensim`] | OpenSim .mot and .sto, in and out |
//! | [`format::c3d`] | C3D: joint angles, or hips and knees computed from joint centres |
//! | [`format::trc`] | TRC of motion capture: hips and knees computed from markers of hip, knee and ankle |
//! | [`format::vicon`] | ASCII exports of Vicon Nexus with model outputs |
//! | [`format::visual3d`] | text exports of Visual3D |
//! | [`format::gcd`] | GCD: one normalised gait cycle of each leg |
//! | [`format::mcap_file`] | MCAP: joint angles in JSON messages, or joint states of ROS 2; chunks compressed with zstd or lz4 |
//! | [`format::mvnx`] | MVNX of Xsens MVN: joint angles of inertial sensors |
//! | [`format::scope`] | oscilloscope exports: volts to angles through a calibration |
//! | [`format::page`] | the table of all formats, `docs/formats.md` |
//! | [`format::joint_names`] | which joint a column is, from its name |
//! | [`format::converted`] | writes joints with the record of their conversion, and reads that record |
//! | [`format::whole_file`] | writes a file completely or not at all |
//! | **defects** | [`clean`] |
//! | [`clean::condition`](mod@clean::condition) | from the joints of a file to joints that can be fitted: fixed rate, no gaps, no jumps, flexion positive |
//! | [`clean::rules`] | thresholds of the conditioning, and its low-pass |
//! | [`clean::convention`] | signs and exchanged columns, recognised by the shape of the gait |
//! | [`clean::knee_sign`] | the sign of the knees: one decision for both |
//! | [`clean::hip_sign`] | the sign of a hip: the caller's, that of the format, else by the shape of the gait |
//! | [`clean::positive_direction`] | flexion or extension |
//! | [`clean::anatomy`] | angles that no person has |
//! | [`clean::repair`] | resampling of uneven times, bridges over gaps, jumps |
//! | [`clean::resample`] | linear interpolation to a fixed rate |
//! | **strides** | [`stride`] |
//! | [`stride::strides`] | the strides of four joints and their mean cycle |
//! | [`stride::cut`](mod@stride::cut) | where the strides are, with a reason for every part that is in none |
//! | [`stride::segment`] | the events that strides are counted by |
//! | [`stride::period`] | the stride period of a periodic recording |
//! | [`stride::looped`] | a whole number of strides that can be repeated without a jump |
//! | [`stride::cycle`] | one stride at a fixed number of points |
//! | [`stride::gait_check`] | whether the strides are of a gait at all |
//! | [`stride::metrics`] | root mean square and peak of a difference |
//! | **shared** | |
//! | [`recording`] | the table and its rules |
//! | [`raw`] | the four joints as the file has them, before repair |
//! | [`options`] | what the caller knows and the file does not say |
//! | [`shell_word()`] | a path as a shell reads it, for messages that say what to type |
//! | [`volts`] | angles to *semi-synthetic* volts, backwards through a calibration |
//!
//! A further file format is one more file in [`format`](mod@format) that returns [`RawJoints`] or a [`Recording`] and reports a [`TraceError`].
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

pub mod ankles;
pub mod clean;
mod fault;
mod finding;
pub mod format;
pub mod options;
pub mod raw;
pub mod recording;
mod series;
mod shell_word;
pub mod stride;
pub mod volts;

pub use clean::condition::{Conditioned, condition};
pub use clean::condition_error::ConditionError;
pub use clean::hip_sign::{HipSignReason, TakenHipSign};
pub use clean::knee_sign::{KneeSignReason, TakenKneeSign};
pub use clean::positive_direction::PositiveDirection;
pub use clean::resample::ResampleError;
pub use clean::rules::{LowPass, Rules};
pub use fault::{Fault, TraceError};
pub use finding::{Done, Finding, FindingKind, Level};
pub use options::{Axis, MapError, ReadOptions, RowFilter};
pub use raw::{Doubt, RawJoint, RawJoints, SignBasis, SignSource, UnitSource};
pub use recording::{
    Channel, MAX_ANGLE_DEG, MAX_PIN_VOLTS, MIN_PIN_VOLTS, NoChannel, Quantity, Recording, RecordingError,
};
pub use series::{root_mean_square, upper_median};
pub use shell_word::shell_word;
pub use stride::cycle::Cycle;
pub use stride::looped::{LoopError, Looped};
pub use stride::spans::{LeftOut, Span, StrideError, WhyLeftOut};
pub use stride::strides::Strides;
pub use volts::VoltsError;
