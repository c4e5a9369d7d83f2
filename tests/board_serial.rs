//! Requests to the flashed image on the virtual board, through its serial port: they take effect at the tick that is acknowledged, inside the
//! limits and as on the host, bit for bit; what is malformed changes nothing; and nothing arms.

use firmware::board::f4_discovery::BOARD;
use footfall::board::serial::{Port, Records};
use footfall::file::capture::rtt::Came;
use footfall_tests::board::{Board, Ran};
use footfall_tests::degraded::Random;
use footfall_tests::recordings::default_volts_file;
use generator_file::robot_file::RobotFile;
use joint_loop::tuning::{Action, Answer, Outcome, Parameter, Request};
use joint_loop::{Direction, GateConfig, GeneratorConfig, SupervisorState};
use joint_units::Joint;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use test_suite::{report, tests};
use wire::{Answered, MAX_FRAME_BYTES, Record, frame_request};

fn main() -> ExitCode {
    test_suite::run(tests![
        changes_at_random_phases_take_effect_as_acknowledged(Image),
        malformed_frames_are_counted_and_change_nothing(Image),
        no_request_arms_and_one_stops(Image),
        the_commands_of_footfall_use_the_port(Image),
        a_servo_is_trimmed_through_the_port(Image),
        a_lamp_shows_that_a_press_would_trim(Image),
    ])
}

/// Changes in a run; `FOOTFALL_REQUESTS` sets another number.
const REQUESTS: u16 = 25;

/// A port, its records, and the answers that have not been asked for.
struct Host {
    port: Port,
    records: Records,
    answers: Vec<Answered>,
    /// Tick of the last frame.
    tick: u32,
    state: SupervisorState,
    counts: wire::Port,
}

impl Host {
    fn open(path: &Path) -> Self {
        let port = Port::open(path, true).expect("the board's port");
        let (records, answers) = (Records::default(), Vec::new());
        let (state, counts) = (SupervisorState::Boot, wire::Port::default());
        Self { port, records, answers, tick: 0, state, counts }
    }

    /// Reads on until something holds, half a minute of the board at most.
    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let last = self.tick + 30_000;
        while !done(self) {
            assert!(self.tick < last, "{what}: not within half a minute, tick {}", self.tick);
            let Came::Bytes(bytes) = self.port.next_within(Duration::from_secs(60)) else { panic!("{what}: no bytes") };
            for record in self.records.push(&bytes) {
                match record {
                    Ok(Record::Frame(frame)) => (self.tick, self.state) = (frame.tick, frame.state),
                    Ok(Record::Answered(answer)) => self.answers.push(answer),
                    Ok(Record::Port(counts)) => self.counts = counts,
                    Ok(_) | Err(_) => {}
                }
            }
        }
    }

    fn wait(&mut self, ticks: u32) {
        let until = self.tick + ticks;
        self.until("frames", |host| host.tick >= until);
    }

    fn ask(&mut self, number: u16, action: Action) {
        self.port.send(&Request { number, action }).expect("sent");
    }

    fn answered(&self, number: u16, outcome: Outcome) -> bool {
        self.answers.iter().any(|answer| answer.number == number && answer.outcome == outcome)
    }
}

/// Options of a board whose sensor is moved by a recorded walk, and whose button is pressed once.
fn walks(press: &str) -> [OsString; 5] {
    ["--volts".into(), default_volts_file().into(), "--loop".into(), "--press".into(), press.into()]
}

/// What is the same in each of these runs: nothing irregular, and every line the host's to the bit.
fn assert_sound(ran: &Ran) {
    assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (Some(0), 0, 0, 1));
    let books = &ran.books;
    assert_eq!((books.different, books.not_compared, books.lost_lines), (0, 0, 0), "{:?}", books.differences);
    let last = ran.boots[0].ticks.last().expect("frames");
    assert_eq!((last.missed, last.late), (0, 0));
}

fn any_set(random: &mut Random) -> Action {
    // Not `follow`, which only a follower takes.
    let parameter = Parameter::ALL[(random.unit() * 10.0) as usize];
    let [least, most, _] = parameter.range();
    let value = least + (f64::from(most - least) * random.unit()) as i32;
    // Three quarters of the way to the ends of a joint's range, so that the pose limits do not stop the walk.
    let value = if let Parameter::Amplitude(_) = parameter { value * 2 / 3 } else { value };
    Action::Set { parameter, thousandths: if parameter.is_whole() { value / 1000 * 1000 } else { value } }
}

fn changes_at_random_phases_take_effect_as_acknowledged() {
    let requests = std::env::var("FOOTFALL_REQUESTS").map_or(REQUESTS, |text| text.parse().expect("a number"));
    let (send, receive) = channel();
    let ran = Board::find().run_with_host(walks("0.3"), move |path, _| {
        let mut host = Host::open(&path);
        let mut random = Random(7);
        host.until("walking", |host| host.state == SupervisorState::Walking);
        for number in 1..=requests {
            host.wait((random.unit() * 1_100.0) as u32);
            host.ask(number, if number % 10 == 0 { Action::Undo } else { any_set(&mut random) });
            host.until("staged", |host| host.answered(number, Outcome::Staged));
            host.until("in effect", |host| host.answered(number, Outcome::InEffect));
            assert_eq!(host.state, SupervisorState::Walking);
        }
        host.wait(1_500);
        host.until("counts", |host| host.counts.requests == u32::from(requests));
        send.send((host.answers, host.counts)).expect("received");
    });
    assert_sound(&ran);
    let (answers, counts) = receive.recv().expect("sent");
    assert_eq!(counts, wire::Port { requests: requests.into(), ..wire::Port::default() });

    // The host's copy, with the requests as recorded, gives the same answers in the same ticks.
    let limits = GateConfig::default_biped().joint_limits();
    let boot = &ran.boots[0];
    let seen = boot.watch(&GeneratorConfig::default_walk(), |joints| {
        (joints.frame(), joints.answers().collect::<Vec<Answer>>(), *joints.settings())
    });
    let replayed: Vec<Answered> =
        seen.iter().flat_map(|(_, answers, _)| answers.iter().copied().map(Answered::from)).collect();
    assert_eq!(answers, replayed[..answers.len()]);
    let (mut before, mut phases) = (&seen[0], Vec::new());
    for now in &seen[1..] {
        let in_effect = now.1.iter().any(|answer| answer.outcome == Outcome::InEffect);
        assert_eq!(before.2 != now.2, in_effect && before.2 != now.2, "settings change where it is acknowledged");
        if now.1.iter().any(|answer| answer.outcome == Outcome::Staged) {
            phases.push(now.0.tick % 1_100);
        }
        for ((was, is), limits) in before.0.setpoints.iter().zip(now.0.setpoints).zip(&limits) {
            assert!((limits.least.0 - 1e-6..=limits.most.0 + 1e-6).contains(&is.0), "{is:?}");
            assert!((is.0 - was.0).abs() <= limits.rate.0 * 1.001e-3, "{was:?} {is:?}");
        }
        before = now;
    }
    let frames = boot.ticks.len();
    report!("{} requests in {frames} frames, {} replayed ticks equal", phases.len(), ran.books.calls);
    assert_eq!(phases.len(), usize::from(requests));
}

fn malformed_frames_are_counted_and_change_nothing() {
    let (send, receive) = channel();
    let ran = Board::find().run_with_host(walks("0.3"), move |path, _| {
        let mut line = File::options().write(true).open(&path).expect("the board's port");
        let mut host = Host::open(&path);
        let mut random = Random(3);
        host.until("walking", |host| host.state == SupervisorState::Walking);
        let mut buffer = [0; MAX_FRAME_BYTES];
        let action = Action::Set { parameter: Parameter::Speed, thousandths: 500 };
        let good = frame_request(&Request { number: 1, action }, &mut buffer).expect("it fits").to_vec();
        for round in 0..1_000_usize {
            let mut frame = good[..good.len() - 1].to_vec();
            match round % 4 {
                0 => frame.truncate(1 + round % (frame.len() - 1)),
                1 => frame = vec![0xff; 1 + round % 400],
                2 => frame.push(0x2a),
                _ => {
                    let at = round % frame.len();
                    frame[at] = frame[at] % 255 + 1;
                }
            }
            frame.push(0);
            line.write_all(&frame).expect("sent");
            host.wait((random.unit() * 12.0) as u32 + frame.len() as u32 / 100);
        }
        host.until("counts", |host| host.counts.malformed >= 1_000);
        send.send((host.answers, host.counts)).expect("received");
    });
    assert_sound(&ran);
    let (answers, counts) = receive.recv().expect("sent");
    assert_eq!(counts, wire::Port { malformed: 1_000, ..wire::Port::default() });
    assert!(answers.is_empty() && ran.boots[0].calls.iter().all(|(_, call)| call.request.is_none()));
    report!("1000 malformed frames refused in {} ticks", ran.books.calls);
}

fn no_request_arms_and_one_stops() {
    let ran = Board::find().run_with_host(walks("6"), move |path, _| {
        let mut host = Host::open(&path);
        host.until("disarmed", |host| host.state == SupervisorState::Disarmed);
        for (number, parameter) in (1..).zip(Parameter::ALL) {
            host.ask(number, Action::Set { parameter, thousandths: parameter.range()[1] });
            host.wait(20);
        }
        for number in 100..110 {
            host.ask(number, [Action::Undo, Action::Stop][usize::from(number % 2)]);
            host.wait(20);
        }
        assert_eq!(host.state, SupervisorState::Disarmed);
        // Back to the defaults: from here on the press of the button arms.
        for (number, parameter) in (200..).zip(Parameter::ALL) {
            host.ask(number, Action::Set { parameter, thousandths: parameter.range()[2] });
            host.wait(20);
        }
        assert!(host.tick < 6_000, "before the press");
        host.until("walking", |host| host.state == SupervisorState::Walking);
        host.ask(300, Action::Stop);
        host.until("disarmed again", |host| host.state == SupervisorState::Disarmed);
        assert!(host.answered(300, Outcome::InEffect));
        host.wait(500);
    });
    assert_sound(&ran);
    assert_eq!(ran.end.edges_before_arming, 0);
    // No pulse but between the press and the end of the short ramp.
    let first = ran.pulses.iter().find(|(_, us)| us.iter().any(Option::is_some)).expect("pulses");
    assert!(first.0 > 6.0, "{first:?}");
    let stop = ran.boots[0].calls.iter().rev().find(|(_, call)| call.request.is_some()).expect("a stop").0;
    let stopped = ran.boots[0].ticks.iter().find(|frame| frame.tick > stop && frame.state == SupervisorState::Disarmed);
    assert!(stopped.expect("it stops").tick - stop <= 820);
}

fn the_commands_of_footfall_use_the_port() {
    let folder = tempfile::tempdir().expect("a folder");
    let capture = folder.path().join("walk.csv");
    let (elf, out) = (std::env::var("FOOTFALL_ELF").expect("FOOTFALL_ELF"), capture.display().to_string());
    let ran = Board::find().run_with_host(walks("0.3"), |path, _| {
        let port = path.display().to_string();
        Host::open(&path).until("walking", |host| host.state == SupervisorState::Walking);
        let call = |words: &[&str]| {
            footfall::cli::call(std::iter::once("footfall").chain(words.iter().copied()).map(Into::into))
        };
        let set = |words: &[&str]| call(&[&["set", "--serial", &port], words].concat());
        set(&["speed", "1.25"]).expect("in effect");
        set(&["offset_left_hip", "-2.5", "--json"]).expect("in effect");
        call(&["watch", "--serial", &port, "--secs", "0.5"]).expect("frames");
        call(&["record", "--serial", &port, "--elf", &elf, "--secs", "2", "-o", &out]).expect("a recording");
        set(&["--undo"]).expect("in effect");
        for (words, said) in [
            (&["follow", "off"][..], "follows nobody"),
            (&["speed", "2"], "allowed are 0.5 to 1.5"),
            (&["arm", "1"], "is no parameter"),
        ] {
            let error = set(words).expect_err("refused").to_string();
            assert!(error.contains(said), "{error}");
        }
        set(&["--stop"]).expect("it stops");
        // The log, which is read below, has the stop a moment after the port has.
        let mut host = Host::open(&path);
        host.until("disarmed", |host| host.state == SupervisorState::Disarmed);
        host.wait(500);
    });
    assert_sound(&ran);
    let requests: Vec<String> =
        ran.boots[0].calls.iter().filter_map(|(_, call)| call.request).map(|request| request.to_string()).collect();
    let actions: Vec<&str> =
        requests.iter().filter_map(|text| text.split_once(' ')).map(|(_, action)| action).collect();
    assert_eq!(actions, ["set speed 1.25", "set offset_left_hip -2.5", "undo", "set follow 0", "stop"]);
    let rows = std::fs::read_to_string(&capture).expect("a recording");
    assert!(rows.lines().count() > 2_000 && rows.starts_with("time_s,boot,tick,"), "{}", rows.lines().count());
    // Nothing was lost on the way.
    assert!(rows.lines().skip(1).all(|row| row.ends_with(",0")));
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

/// The program as a user runs it: a line each on standard input, and a press of the button when it asks for one.
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
        while !all.contains("press the board's button") {
            assert!(said.read_line(&mut all).expect("text") > 0, "{all}");
        }
        button.press();
        let lines = b"=1460\nangle 0\n=1360\nangle 10\ndone\n";
        answers.write_all(lines).expect("taken");
        said.read_to_string(&mut all).expect("text");
        let printed = std::io::read_to_string(printed).expect("text");
        assert!(
            ended.join().expect("it ends").success() && printed.starts_with("neutral_us = 1460\n"),
            "{all}{printed}"
        );
    });
    assert_sound(&ran);
    // In the file: 10 us a degree, mirrored, and nothing else is changed.
    let after = RobotFile::read(&out).expect("a robot");
    let servo = after.robot.servos[0];
    assert_eq!((servo.neutral.0, servo.direction, servo.angle_at_neutral.0), (1_460, Direction::Mirrored, 0.0));
    assert!((servo.micros_per_radian - 572.96).abs() < 0.01, "{servo:?}");
    let text = std::fs::read_to_string(&out).expect("text");
    assert_eq!(before.lines().zip(text.lines()).filter(|(was, is)| was != is).count(), 3, "{text}");
    // At the pins: the others stay parked, and the servo moves by a microsecond at a time, 50 frames a second.
    let parked = [1500, 1500, 1056, 1944].map(f64::from);
    let pulses: Vec<[f64; 4]> = ran
        .pulses
        .iter()
        .filter_map(|(_, us)| us.iter().copied().collect::<Option<Vec<_>>>()?.try_into().ok())
        .collect();
    assert!(pulses.iter().all(|us| us[1..] == parked[1..]), "{:?}", pulses.iter().find(|us| us[1..] != parked[1..]));
    assert!(pulses.windows(2).all(|pair| (pair[1][0] - pair[0][0]).abs() <= 2.0));
    let ends =
        pulses.iter().map(|us| us[0]).fold((f64::MAX, f64::MIN), |(least, most), us| (least.min(us), most.max(us)));
    // The first pulse is that of the park pose, or one of the first frames after it.
    assert!(ends.0 == 1_360.0 && (1_494.0..=1_500.0).contains(&ends.1), "{ends:?}");
    assert_eq!(ran.end.edges_before_arming, 0);
    report!("{} pulse sets of a trim, {} replayed ticks equal", pulses.len(), ran.books.calls);
}

fn a_lamp_shows_that_a_press_would_trim() {
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
    assert_sound(&ran);
    // Three flashes, a quarter of a second from one to the next.
    let edges = std::fs::read_to_string(&lamp).expect("edges");
    let lit: Vec<f64> =
        edges.lines().filter_map(|row| row.strip_suffix(",1")).map(|t_s| t_s.parse().expect("a time")).collect();
    let is_step = |pair: &[f64]| (pair[1] - pair[0] - 0.25).abs() < 0.005;
    assert!(lit.windows(3).any(|three| three.windows(2).all(is_step)), "{lit:?}");
}
