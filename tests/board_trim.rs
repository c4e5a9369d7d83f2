//! A trim on the flashed image on the virtual board: the program as a user runs it, pulses at the pins, and the lamp.

use firmware::board::f4_discovery::BOARD;
use footfall_tests::board::Board;
use footfall_tests::host::Host;
use generator_file::robot_file::RobotFile;
use joint_loop::tuning::Action;
use joint_loop::{Direction, SupervisorState};
use joint_units::Joint;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_servo_is_trimmed_through_the_port(Image, Program),
        a_lamp_shows_that_the_button_would_trim(Image),
    ])
}

/// Waits for a program beside the caller, which reads what it says; kills it after this time.
fn ends_within(mut child: Child, longest: Duration) -> JoinHandle<ExitStatus> {
    std::thread::spawn(move || {
        let begun = Instant::now();
        loop {
            if let Some(status) = child.try_wait().expect("a program") {
                return status;
            }
            if begun.elapsed() > longest {
                child.kill().expect("a program");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    })
}

/// The program as a user runs it: a line each on standard input, and a hold of the button when it asks for one.
fn a_servo_is_trimmed_through_the_port() {
    let folder = tempfile::tempdir().expect("a folder");
    let [robot, out] = ["robot.toml", "trimmed.toml"].map(|name| folder.path().join(name));
    let before = RobotFile::default_biped().to_toml();
    std::fs::write(&robot, &before).expect("written");
    let (program, trimmed) = (std::env::var_os("FOOTFALL_BIN").expect("FOOTFALL_BIN"), out.clone());
    // No sensor is connected: its wire is open.
    let open = folder.path().join("open.csv");
    std::fs::write(&open, "time_s,PA1\n0,0\n").expect("written");
    // In real time, as a board: a trim ends after five seconds of the board without its host.
    let options = ["--pace".into(), OsString::from("--volts"), open.into()];
    let ran = Board::find().run_with_host(options, move |path, button| {
        // A button that is held at boot is no press.
        Host::open(&path).until("the button is released", |host| host.tick >= 100);
        let mut child = Command::new(program)
            .args(["trim", "left_hip", "--serial"])
            .arg(path)
            .arg("--robot")
            .arg(&robot)
            .arg("-o")
            .arg(&trimmed)
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut said = BufReader::new(child.stderr.take().expect("piped"));
        let (mut answers, printed) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
        let ended = ends_within(child, Duration::from_secs(120));
        let mut all = String::new();
        while !all.contains("hold the board's button") {
            assert!(said.read_line(&mut all).expect("text") > 0, "{all}");
        }
        button.hold();
        let lines = b"=1460\nangle 0\n=1360\nangle 10\ndone\n";
        answers.write_all(lines).expect("taken");
        said.read_to_string(&mut all).expect("text");
        let printed = std::io::read_to_string(printed).expect("text");
        assert!(
            ended.join().expect("it ends").success() && printed.starts_with("neutral_us = 1460\n"),
            "{all}{printed}"
        );
    });
    ran.assert_sound();
    // In the file: 10 us a degree, mirrored, and nothing else is changed.
    let after = RobotFile::read(&out).expect("a robot");
    let servo = after.robot.servos[0];
    assert_eq!((servo.neutral.0, servo.direction, servo.angle_at_neutral.0), (1_460, Direction::Mirrored, 0.0));
    assert!((servo.micros_per_radian - 572.96).abs() < 0.01, "{servo:?}");
    let text = std::fs::read_to_string(&out).expect("text");
    assert_eq!(before.lines().zip(text.lines()).filter(|(was, is)| was != is).count(), 3, "{text}");
    // At the pins: the others stay parked, and the servo moves by a microsecond in 10 ms.
    let parked = [1500, 1500, 1056, 1944].map(f64::from);
    let pulses: Vec<[f64; 4]> = ran
        .pulses
        .iter()
        .filter_map(|(_, us)| us.iter().copied().collect::<Option<Vec<_>>>()?.try_into().ok())
        .collect();
    assert!(pulses.iter().all(|us| us[1..] == parked[1..]), "{:?}", pulses.iter().find(|us| us[1..] != parked[1..]));
    // A frame of 20 ms has the first step of a motion and two more.
    let far = pulses.windows(2).find(|pair| (pair[1][0] - pair[0][0]).abs() > 3.0);
    assert!(far.is_none(), "{far:?}");
    let ends =
        pulses.iter().map(|us| us[0]).fold((f64::MAX, f64::MIN), |(least, most), us| (least.min(us), most.max(us)));
    // The first pulse is that of the park pose, or one of the first frames after it.
    assert!(ends.0 == 1_360.0 && (1_494.0..=1_500.0).contains(&ends.1), "{ends:?}");
    assert_eq!(ran.end.edges_before_arming, 0);
    report!("{} pulse sets of a trim, {} replayed ticks equal", pulses.len(), ran.books.calls);
}

fn a_lamp_shows_that_the_button_would_trim() {
    let folder = tempfile::tempdir().expect("a folder");
    let lamp = folder.path().join("lamp.csv");
    let lamp_pin = format!("{}={}", BOARD.led_pulses.expect("a lamp"), lamp.display());
    let ran = Board::find().run_with_host(["--record-edges", &lamp_pin], |path, _| {
        let mut host = Host::open(&path);
        host.until("disarmed", |host| host.state == SupervisorState::Disarmed);
        host.ask(1, Action::Trim { joint: Joint::LeftKnee });
        host.until("ready", |host| host.state == SupervisorState::TrimReady);
        host.wait(4_500);
    });
    ran.assert_sound();
    // Three flashes, a quarter of a second from one to the next.
    let edges = std::fs::read_to_string(&lamp).expect("edges");
    let lit: Vec<f64> =
        edges.lines().filter_map(|row| row.strip_suffix(",1")).map(|t_s| t_s.parse().expect("a time")).collect();
    let is_step = |pair: &[f64]| (pair[1] - pair[0] - 0.25).abs() < 0.005;
    assert!(lit.windows(3).any(|three| three.windows(2).all(is_step)), "{lit:?}");
}
