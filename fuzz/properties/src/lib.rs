//! What must hold of any bytes that a decoder is given. Each function takes bytes and panics if a property does not hold.
//!
//! The fuzz targets of the folder above call these functions with bytes that libFuzzer makes; `tests/corpus.rs` calls them with the bytes
//! that were kept. `docs/results.md` says how they are run.

pub mod flash_records;
pub mod gait_files;
/// The same file as in the tests of `gait-trace`, which do without this package.
#[path = "../../../tools/gait-trace/tests/support/guarantees.rs"]
mod guarantees;
#[cfg(feature = "program")]
pub mod host_files;
pub mod loop_inputs;
/// The same file as in the tests of `joint-loop`, which do without this package.
#[path = "../../../joint-loop/tests/support/motion_limits.rs"]
pub mod motion_limits;
pub mod parameter_files;
pub mod wire_records;

/// A fuzz target: its name, which is also the name of its folder in `fuzz/corpus.tar`, and its property.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Name.
    pub name: &'static str,
    /// Panics if a property does not hold for the bytes.
    pub check: fn(&[u8]),
}

const fn target(name: &'static str, check: fn(&[u8])) -> Target {
    Target { name, check }
}

/// The targets of the cores, of parameter files and of readers of gait.
pub const TARGETS: [Target; 21] = [
    target("generator_record", flash_records::generator),
    target("sensor_record", flash_records::sensors),
    target("robot_record", flash_records::robot),
    target("loop_inputs", loop_inputs::check),
    target("wire_record", wire_records::record),
    target("wire_frames", wire_records::frames),
    target("wire_request", wire_records::request),
    target("generator_toml", parameter_files::generator),
    target("network_toml", parameter_files::network),
    target("robot_toml", parameter_files::robot),
    target("gait_open", gait_files::open),
    target("gait_csv", gait_files::csv),
    target("gait_opensim", gait_files::opensim),
    target("gait_c3d", gait_files::c3d),
    target("gait_scope", gait_files::scope),
    target("gait_mcap", gait_files::mcap),
    target("gait_trc", gait_files::trc),
    target("gait_mvnx", gait_files::mvnx),
    target("gait_vicon", gait_files::vicon),
    target("gait_visual3d", gait_files::visual3d),
    target("gait_gcd", gait_files::gcd),
];

/// The targets of what the command-line program reads.
#[cfg(feature = "program")]
pub const PROGRAM_TARGETS: [Target; 9] = [
    target("setting_words", host_files::setting_words),
    target("sensor_toml", host_files::sensor),
    target("board_line", host_files::board_line),
    target("capture_mcap", host_files::capture_mcap),
    target("capture_csv", host_files::capture_csv),
    target("image", host_files::image),
    target("calibration_rows", host_files::calibration_rows),
    target("edges", host_files::edges),
    target("graph", host_files::graph),
];
