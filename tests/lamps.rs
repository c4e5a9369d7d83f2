//! The lamps of the flashed image, on the virtual board: the pattern of each state, and of each reason why the board stays off.

use firmware::board::f4_discovery::BOARD;
use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SENSORS_SECTOR};
use firmware_shared::lamp::Shown;
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::ARM;
use footfall_tests::lamps::Lamps;
use generator_file::file::GeneratorFile;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, sensor_record};
use joint_loop::{RecordName, RobotConfig};
use std::path::Path;
use std::process::ExitCode;
use test_suite::tests;
use wire::Subject;

fn main() -> ExitCode {
    test_suite::run(tests![
        disarmed_and_armed_boards_show_it(Image),
        shadow_mode_shows_it(ShadowImage),
        a_fault_shows_it(Image),
        repeated_crashes_show_the_lock_out(Image),
        a_board_that_stays_off_shows_why(Image),
    ])
}

/// Runs a board for so many seconds with these options.
fn run(board: &Board, secs: f64, options: &[&str]) -> (Lamps, Ran) {
    Lamps::of_run(&BOARD, board, secs, options)
}

fn disarmed_and_armed_boards_show_it() {
    let board = Board::find();
    let (lamps, _) = run(&board, 5.0, &[]);
    lamps.assert_shown(Shown::Disarmed, 300);
    let (lamps, _) = run(&board, 5.0, &["--emergency-stop", "100"]);
    lamps.assert_shown(Shown::StopUntested, 200);
    let (lamps, ran) = run(&board, 4.0, &["--press", ARM]);
    lamps.assert_shown(Shown::Armed, 500);
    assert!(!ran.pulses.is_empty());
    // The sector of the robot is erased: the built-in robot walks.
    let (_file, sector) = sector(ROBOT_SECTOR, &[0xFF; 16]);
    let (lamps, ran) = run(&board, 4.0, &["--press", ARM, "--flash", &sector]);
    lamps.assert_shown(Shown::ArmedBuiltIn, 500);
    assert!(!ran.pulses.is_empty());
}

/// These bytes as an option of the virtual board, and their file.
fn sector(address: u32, bytes: &[u8]) -> (tempfile::NamedTempFile, String) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let option = format!("{address:#010x}={}", file.path().display());
    (file, option)
}

fn shadow_mode_shows_it() {
    let (lamps, ran) = run(&Board::shadow(), 5.0, &["--press", ARM]);
    lamps.assert_shown(Shown::Shadow, 500);
    assert!(ran.pulses.is_empty());
}

fn a_fault_shows_it() {
    // The second press of the emergency stop is no test.
    let (lamps, ran) = run(&Board::find(), 5.0, &["--press", ARM, "--emergency-stop", "0.05:0.05", "0.15:0.05"]);
    lamps.assert_shown(Shown::Fault, 300);
    assert!(ran.pulses.is_empty());
}

fn repeated_crashes_show_the_lock_out() {
    let crashes: Vec<String> = (1..=8).map(|n| format!("{}", f64::from(n) * 0.5)).collect();
    let mut options = vec![];
    for at in &crashes {
        options.extend(["--panic", at]);
    }
    let (lamps, ran) = run(&Board::find(), 9.0, &options);
    assert!(ran.boots.last().unwrap().refused.iter().any(|refused| refused.subject == Subject::Arming));
    lamps.assert_shown(Shown::LockedOut, 4_700);
}

/// Clock, records and configuration; the button does nothing.
fn a_board_that_stays_off_shows_why() {
    let board = Board::find();
    let damaged = [0; 16];
    // A follower of the left hip, and a sensor on the left knee.
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../samples");
    let follower = GeneratorFile::read(&samples.join("follower.toml")).unwrap().set.config();
    let follower = generator_record::record_of(&follower, &RecordName::BUILT_IN);
    let defaults = Parameters::with_defaults(None, None, RobotConfig::default_biped()).unwrap();
    let knee = sensor_record::record_of(&defaults.sensors, &RecordName::BUILT_IN);
    for (subject, sectors) in [
        (Subject::Clock, vec![]),
        (Subject::GeneratorRecord, vec![(GENERATOR_SECTOR, &damaged[..])]),
        (Subject::SensorRecord, vec![(SENSORS_SECTOR, &damaged)]),
        (Subject::RobotRecord, vec![(ROBOT_SECTOR, &damaged)]),
        (Subject::Configuration, vec![(GENERATOR_SECTOR, follower.bytes()), (SENSORS_SECTOR, knee.bytes())]),
    ] {
        let files: Vec<_> = sectors.iter().map(|(address, bytes)| sector(*address, bytes)).collect();
        let mut options = vec!["--press", "1"];
        options.extend(files.iter().flat_map(|(_, option)| ["--flash", option]));
        options.extend((subject == Subject::Clock).then_some("--hse-dead"));
        let (lamps, ran) = run(&board, 8.0, &options);
        assert_eq!(ran.boots[0].refused.iter().map(|refused| refused.subject).collect::<Vec<_>>(), [subject]);
        // Without the crystal the core waits for it at 16 MHz, a tenth of a second and more.
        lamps.assert_shown(Shown::Off(subject), 1_000);
        assert!(ran.pulses.is_empty() && ran.end.edges_before_arming == 0, "{subject:?}");
    }
}
