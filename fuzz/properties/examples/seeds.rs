//! Writes the inputs that fuzzing begins with: small valid ones for each target that needs a structure no fuzzer guesses.
//!
//! ```sh
//! cargo run -p fuzz-properties --no-default-features --example seeds -- fuzz/corpus
//! ```
//! Readers of gait begin with `tools/gait-trace/tests/corpus`, captures with what `footfall record` writes.

use std::path::Path;

use generator_file::file::GeneratorFile;
use generator_file::network_file::NetworkFile;
use generator_file::robot_file::RobotFile;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::tuning::{Action, Parameter, Request};
use joint_loop::{GeneratorConfig, RecordName, RobotConfig, Sample, SupervisorState};
use joint_units::{Joint, PulseMicros};
use wire::{Call, Change, Edge, Inputs, MAX_BYTES, MAX_FRAME_BYTES, Record, encode, frame_record, frame_request};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1).ok_or("the folder of the corpus is missing")?;
    let folder = Path::new(&folder);
    flash_records(folder)?;
    wire_records(folder)?;
    parameter_files(folder)?;
    host_files(folder)?;
    loop_inputs(folder)
}

fn write(folder: &Path, target: &str, name: &str, bytes: &[u8]) -> Result<()> {
    let folder = folder.join(target);
    std::fs::create_dir_all(&folder)?;
    Ok(std::fs::write(folder.join(name), bytes)?)
}

/// The follower of `samples`, and the defaults.
fn generators() -> Result<Vec<(String, GeneratorFile)>> {
    let mut all = Vec::new();
    for name in GeneratorFile::DEFAULTS {
        all.push((name.to_owned(), GeneratorFile::default_of(name).ok_or("a default")?));
    }
    for name in ["generator", "follower"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../samples/{name}.toml"));
        all.push((name.to_owned(), GeneratorFile::read(&path)?));
    }
    Ok(all)
}

/// The default robot, and one with feedback.
fn robots() -> [(&'static str, RobotConfig); 2] {
    let default = RobotConfig::default_biped();
    [("default", default), ("feedback", RobotConfig { feedback: [0.0, -0.5, 0.3, 0.3], ..default })]
}

fn flash_records(folder: &Path) -> Result<()> {
    let name = RecordName::new("a seed")?;
    for (file, generator) in generators()? {
        write(folder, "generator_record", &file, generator_record::record_of(&generator.set.config(), &name).bytes())?;
    }
    let sensors = Parameters::default_sensors(&GeneratorConfig::default_walk())?;
    write(folder, "sensor_record", "default", sensor_record::record_of(&sensors, &name).bytes())?;
    for (file, robot) in robots() {
        write(folder, "robot_record", file, robot_record::record_of(&robot, &name).bytes())?;
    }
    Ok(())
}

fn wire_records(folder: &Path) -> Result<()> {
    let request = Request { number: 7, action: Action::Set { parameter: Parameter::Speed, thousandths: 1250 } };
    let call = Call::of(&Sample { request: Some(request), ..Sample::default() }, 4);
    let records = [
        ("edge", Record::Edge(Edge { tick: 7, offset_us: -3, high: true, lost_before: false })),
        ("change", Record::Change(Change { tick: 7, state: SupervisorState::Walking, cause: joint_loop::Cause::None })),
        ("inputs", Record::Inputs(Inputs { first_tick: 7, calls: [call.clone(), call].into_iter().collect() })),
    ];
    for (name, record) in records {
        let (mut bytes, mut frame) = ([0; MAX_BYTES], [0; MAX_FRAME_BYTES]);
        let bytes = encode(&record, &mut bytes).ok_or("it fits")?;
        write(folder, "wire_record", name, bytes)?;
        write(folder, "wire_frames", name, frame_record(&record, &mut frame).ok_or("it fits")?)?;
    }
    let actions = [
        request.action,
        Action::Stop,
        Action::Undo,
        Action::Trim { joint: Joint::LeftKnee },
        Action::Jog { pulse: PulseMicros(1501) },
    ];
    for (number, action) in (0_u16..).zip(actions) {
        let request = Request { number, action };
        let mut frame = [0; MAX_FRAME_BYTES];
        let frame = frame_request(&request, &mut frame).ok_or("it fits")?;
        write(folder, "wire_frames", &format!("request_{number}"), frame)?;
        // Between the stuffing's first byte and the check sum, for a request without a zero.
        write(folder, "wire_request", &format!("request_{number}"), &frame[1..frame.len() - 5])?;
        write(folder, "setting_words", &format!("request_{number}"), request.to_string().as_bytes())?;
    }
    for (name, words) in [("gait", "gait natural-walk"), ("speed", "speed 1.25"), ("offset", "offset_left_knee -2.5")] {
        write(folder, "setting_words", name, words.as_bytes())?;
    }
    Ok(())
}

fn parameter_files(folder: &Path) -> Result<()> {
    for (name, generator) in generators()? {
        write(folder, "generator_toml", &name, generator.to_toml().as_bytes())?;
    }
    for name in ["six-joints", "eight-joints"] {
        let network = NetworkFile::default_of(name).ok_or("a default")?;
        write(folder, "network_toml", name, network.to_toml().as_bytes())?;
    }
    for (file, robot) in robots() {
        write(folder, "robot_toml", file, RobotFile { robot, ..RobotFile::default_biped() }.to_toml().as_bytes())?;
    }
    let sensor = "schema = 1\ninterpolation = \"monotone_cubic\"\ndivider = 1.0\npoints = [\n    \
        { sensor_v = 0.5, angle_deg = 90.0 },\n    { sensor_v = 2.5, angle_deg = -20.0 },\n]\n";
    write(folder, "sensor_toml", "by_hand", sensor.as_bytes())?;
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples");
    write(folder, "sensor_toml", "measured", &std::fs::read(samples.join("sensor.toml"))?)
}

fn host_files(folder: &Path) -> Result<()> {
    for (name, line) in [
        ("boot", r#"{"type":"boot","t_s":0.0,"cause":"power_on"}"#),
        ("rtt", r#"{"type":"rtt","t_s":0.001,"channel":1,"hex":"0102ff00"}"#),
        ("pulses", r#"{"type":"pulses","t_s":0.5,"us":[1500.0,null,1056.0,1944.0]}"#),
        ("status", r#"{"type":"status","t_s":0.5}"#),
        ("start", r#"{"type":"start","elf_sha256":"00"}"#),
    ] {
        write(folder, "board_line", name, line.as_bytes())?;
    }
    write(folder, "edges", "three", b"time_s,level\n0.5,1\n0.501,0\n1.5,1\n")?;
    write(folder, "graph", "path", b"b = 3\na -> b\n")?;
    write(folder, "graph", "tokens", b"# a ring\na b 1 1\nb c 2 0\nc a 0 2\n")?;
    write(folder, "calibration_rows", "codes", b"angle_deg,code\n10,2048\n20,1024\n30,512\n")?;
    write(folder, "calibration_rows", "volts", b"angle_deg,volts\n10,1.5\n20,1.0\n30,0.5\n")
}

/// Commands of [`fuzz_properties::loop_inputs`].
fn loop_inputs(folder: &Path) -> Result<()> {
    let (time, hold, stop_test) = ([0, 100, 0, 0, 0, 0], [1, 0x90, 1, 0, 0, 0], [2, 60, 0, 0, 0, 0]);
    let [later, press] = [[0, 0xE7, 3, 0, 0, 0], [1, 60, 0, 0, 0, 0]];
    let open_wire = [3, 3, 0, 0x73, 6, 60];
    let clock_fault = [4, 4, 0, 1, 0, 0];
    let speed = [5 + 8 * 4, 1, 10, 0, 0, 0];
    let trim = [5 + 8 * 2, 2, 0, 0, 0, 0];
    let jog = [5 + 8 * 3, 0, 0xDC, 5, 0, 0];
    let walk = [time, stop_test, hold, later, later, later];
    write(folder, "loop_inputs", "walk_and_stop", &[&walk[..], &[press, later]].concat().concat())?;
    write(folder, "loop_inputs", "open_wire", &[&walk[..], &[open_wire, later]].concat().concat())?;
    write(folder, "loop_inputs", "fault", &[&walk[..], &[clock_fault, hold, hold]].concat().concat())?;
    write(folder, "loop_inputs", "speed", &[&walk[..], &[speed, later]].concat().concat())?;
    write(folder, "loop_inputs", "trim", &[time, stop_test, trim, hold, jog, later].concat())
}
