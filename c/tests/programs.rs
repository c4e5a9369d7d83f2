//! The header is that of the source, and programs in C and C++ compute the numbers of Rust.

use std::path::{Path, PathBuf};
use std::process::Command;

use cpg_core::Generator;
use cpg_core::gait::default_walk::default_walk;
use footfall_c::control::{FOOTFALL_LOOP_WORDS, FootfallLoop, FootfallLoopConfig, FootfallRecord, footfall_loop_build};
use footfall_c::error::{FOOTFALL_TEXT_BYTES, FootfallError, FootfallStatus};
use footfall_c::generator::{FootfallGenerator, footfall_generator_step};
use joint_loop::control::watchdog_clock::WatchdogHz;
use joint_loop::setup::default_loop::{Parameters, board_loop};
use joint_loop::{BoardFaults, RobotConfig, SENSORS, Sample, SupervisorState};
use joint_units::{AdcCode, Period, Volts};

/// The folder of this package.
fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_header_is_that_of_the_source() {
    let config = cbindgen::Config::from_file(folder().join("cbindgen.toml")).expect("cbindgen.toml");
    let source = ["error", "generator", "control"].map(|name| folder().join(format!("src/{name}.rs")));
    let builder = source.into_iter().fold(cbindgen::Builder::new().with_config(config), cbindgen::Builder::with_src);
    let mut made = Vec::new();
    builder.generate().expect("bindings").write(&mut made);
    let (made, path) = (String::from_utf8(made).expect("text"), folder().join("include/footfall.h"));
    if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some() {
        std::fs::write(&path, &made).expect("written");
    }
    let header = std::fs::read_to_string(path).unwrap_or_default();
    assert!(header == made, "include/footfall.h is old: FOOTFALL_WRITE_DOCS=1 cargo test -p footfall-c writes it");
}

/// The static library, built in the profile of the tests.
fn library() -> PathBuf {
    let output = Command::new(env!("CARGO"))
        .args(["build", "--locked", "--package", "footfall-c", "--message-format=json"])
        .output()
        .expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).expect("text");
    let names = lines.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let files = names.filter_map(|message| message["filenames"].as_array().cloned()).flatten();
    let mut libraries = files.filter_map(|file| file.as_str().map(PathBuf::from));
    libraries.find(|file| file.extension().is_some_and(|end| end == "a")).expect("a static library")
}

/// What an example prints, compiled by this compiler.
fn run(compiler: &str, options: &[&str], example: &str) -> Vec<String> {
    let made = tempfile::tempdir().expect("a folder");
    let program = made.path().join("program");
    let mut compile = Command::new(compiler);
    compile.args(options).args(["-Wall", "-Wextra", "-Werror", "-O1", "-I"]).arg(folder().join("include"));
    compile
        .arg(folder().join("examples").join(example))
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program);
    let compiled = compile.output().expect(compiler);
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(&program).output().expect("the program");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    String::from_utf8(ran.stdout).expect("text").lines().map(str::to_owned).collect()
}

/// The loop of the examples in Rust: hash, state and pulses after 6 s with these codes.
fn loop_in_rust(code: impl Fn(u32) -> u16, sensor_required: bool) -> (u64, SupervisorState, [u16; 4]) {
    let parameters = Parameters::with_defaults(None, None, RobotConfig::default_biped()).expect("defaults");
    let mut joints = board_loop(&parameters, AdcCode(1502), Volts(2.7), sensor_required).expect("a loop");
    for tick in 1..=6000 {
        let mut codes = [AdcCode(0); SENSORS];
        codes[0] = AdcCode(code(tick));
        let faults = if (25..50).contains(&tick) { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE };
        let watchdog_clock = Some(WatchdogHz(32_000));
        let button = tick > 100 && tick <= 700;
        joints.tick(&Sample { codes, vrefint: AdcCode(1652), button, faults, watchdog_clock, ..Sample::default() });
    }
    let frame = joints.frame();
    (frame.setpoint_hash, frame.state, frame.pulses.map(|pulse| pulse.0))
}

#[test]
fn a_program_in_c_has_the_numbers_of_rust() {
    let lines = run("cc", &["-std=c11"], "walk.c");
    let mut walk = default_walk(Period::MILLISECOND).expect("the default walk");
    (0..60_000).for_each(|_| walk.step());
    let words: Vec<&str> = lines[0].split(' ').collect();
    // Nine digits are those of one single number.
    let angles = [1, 2, 3, 4].map(|place| words[place].parse::<f32>().expect("an angle"));
    assert_eq!(angles.map(f32::to_bits), walk.angles().map(|angle| angle.0.to_bits()));
    assert_eq!(words[6], walk.phase().0.to_string());

    let triangle = |tick: u32| 1800 + (tick % 1000).min(1000 - tick % 1000) as u16;
    let (hash, state, _) = loop_in_rust(triangle, true);
    assert_eq!(state, SupervisorState::Walking);
    assert_eq!(lines[1], format!("tick 6000 state 3 hash {hash:016x}"));
    assert_eq!(lines[2], "refused 4 speed = 9: must be from 0.5 to 1.5");
    assert_eq!(lines[3], "empty 1");
}

#[test]
fn a_sketch_in_cpp_sets_the_servos_of_rust() {
    let lines = run("c++", &["-std=c++11"], "sketch.cpp");
    let (_, state, [a, b, c, d]) = loop_in_rust(|tick| 1800 + ((tick / 2) % 500) as u16, false);
    assert_eq!(state, SupervisorState::Walking);
    assert_eq!(lines, [format!("servos {a} {b} {c} {d}")]);
}

/// A supply below that of the robot is not hidden by it.
#[test]
fn a_least_supply_beyond_what_is_allowed_is_refused() {
    let none = || FootfallRecord { bytes: std::ptr::null(), length: 0 };
    let build = |min_supply_v: f32| {
        let mut joints = FootfallLoop { words: [0; FOOTFALL_LOOP_WORDS] };
        let (generator, sensors, robot) = (none(), none(), none());
        let config =
            FootfallLoopConfig { generator, sensors, robot, vrefint_cal: 1502, min_supply_v, sensor_required: true };
        let mut error = FootfallError { status: FootfallStatus::Ok, text: [0; FOOTFALL_TEXT_BYTES] };
        // SAFETY: the loop is aligned and used here alone, the records are null, and the error is of its type.
        let status = unsafe { footfall_loop_build(&raw mut joints, &raw const config, &raw mut error) };
        let text = error.text.map(|byte| byte as u8);
        (status, String::from_utf8_lossy(&text).trim_end_matches('\0').to_owned())
    };
    for allowed in [1.8, 2.7, 3.6] {
        assert_eq!(build(allowed), (FootfallStatus::Ok, String::new()), "{allowed}");
    }
    for refused in [-1.0, 0.0, 1.7, 3.7, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let words = format!("min_supply_v is {refused} V; allowed are 1.8 to 3.6 V");
        assert_eq!(build(refused), (FootfallStatus::Loop, words));
    }
}

/// Both are memory of a caller with a mark, and each kind has a mark of its own.
#[test]
fn a_loop_is_no_generator() {
    let mut joints = FootfallLoop { words: [0; FOOTFALL_LOOP_WORDS] };
    let none = || FootfallRecord { bytes: std::ptr::null(), length: 0 };
    let config = FootfallLoopConfig {
        generator: none(),
        sensors: none(),
        robot: none(),
        vrefint_cal: 1502,
        min_supply_v: 2.7,
        sensor_required: true,
    };
    // SAFETY: the loop is aligned and used here alone, the records are null, and no text is asked for.
    let built = unsafe { footfall_loop_build(&raw mut joints, &raw const config, std::ptr::null_mut()) };
    assert_eq!(built, FootfallStatus::Ok);
    // SAFETY: a loop has more words than a generator, and was filled by this library.
    let stepped = unsafe { footfall_generator_step((&raw mut joints).cast::<FootfallGenerator>()) };
    assert_eq!(stepped, FootfallStatus::NotBuilt);
}
