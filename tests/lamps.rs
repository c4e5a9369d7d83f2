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
    let folder = tempfile::tempdir().unwrap();
    let sector = |name: &str, address: u32, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        format!("{address:#010x}={}", path.display())
    };
    let damaged = [0; 16];
    // A follower of the left hip, and a sensor on the left knee.
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../samples");
    let follower = GeneratorFile::read(&samples.join("follower.toml")).unwrap().set.config();
    let follower = generator_record::record_of(&follower, &RecordName::BUILT_IN);
    let defaults = Parameters::with_defaults(None, None, RobotConfig::default_biped()).unwrap();
    let knee = sensor_record::record_of(&defaults.sensors, &RecordName::BUILT_IN);
    for (subject, options) in [
        (Subject::Clock, vec!["--hse-dead".to_owned()]),
        (Subject::GeneratorRecord, vec!["--flash".into(), sector("generator", GENERATOR_SECTOR, &damaged)]),
        (Subject::SensorRecord, vec!["--flash".into(), sector("sensors", SENSORS_SECTOR, &damaged)]),
        (Subject::RobotRecord, vec!["--flash".into(), sector("robot", ROBOT_SECTOR, &[0xFF; 16])]),
        (
            Subject::Configuration,
            vec![
                "--flash".into(),
                sector("follower", GENERATOR_SECTOR, follower.bytes()),
                "--flash".into(),
                sector("knee", SENSORS_SECTOR, knee.bytes()),
            ],
        ),
    ] {
        let options: Vec<&str> = options.iter().map(String::as_str).chain(["--press", "1"]).collect();
        let (lamps, ran) = run(&board, 8.0, &options);
        assert_eq!(ran.boots[0].refused.iter().map(|refused| refused.subject).collect::<Vec<_>>(), [subject]);
        // Without the crystal the core waits for it at 16 MHz, a tenth of a second and more.
        lamps.assert_shown(Shown::Off(subject), 1_000);
        assert!(ran.pulses.is_empty() && ran.end.edges_before_arming == 0, "{subject:?}");
    }
}
