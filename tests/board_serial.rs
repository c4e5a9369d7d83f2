//! Requests to the flashed image on the virtual board, through its serial port: they take effect at the tick that is acknowledged, inside the
//! limits and as on the host, bit for bit; what is malformed changes nothing; and nothing arms.

use footfall::board::lines::{self, BoardLine, RECORDS};
use footfall_tests::board::Board;
use footfall_tests::degraded::Random;
use footfall_tests::gestures::{self, ARM};
use footfall_tests::host::Host;
use footfall_tests::recordings::default_volts_file;
use generator_file::file::GeneratorFile;
use joint_loop::tuning::{Action, Answer, Outcome, Parameter, Request};
use joint_loop::{GateConfig, GeneratorConfig, SupervisorState};
use std::ffi::OsString;
use std::fs::File;
use std::io::Write;
use std::net::TcpListener;
use std::process::{Command, ExitCode};
use std::sync::mpsc::channel;
use std::time::Duration;
use test_suite::terminal::Terminal;
use test_suite::{report, tests};
use wire::{Answered, MAX_FRAME_BYTES, frame_request};

fn main() -> ExitCode {
    test_suite::run(tests![
        changes_at_random_phases_take_effect_as_acknowledged(Image),
        malformed_frames_are_counted_and_change_nothing(Image),
        no_request_arms_and_one_stops(Image),
        a_stop_in_a_flood_of_requests_stops(Image),
        a_request_makes_no_tick_longer_than_its_bound(Image),
        the_serial_line_carries_every_rate_and_requests(Image),
        the_commands_of_footfall_use_the_port(Image),
        the_raw_log_is_watched_through_a_server(Image, Program),
        keys_of_the_live_screen_change_the_board_and_none_arms(Image, Program, Terminal),
        keys_tune_the_virtual_board_that_is_watched(Image, Program, Terminal),
    ])
}

/// Changes in a run; `FOOTFALL_REQUESTS` sets another number.
const REQUESTS: u16 = 25;

/// Options of a board whose sensor is moved by a recorded walk, and whose button is pressed once, with this value of `--press`.
fn walks(press: &str) -> [OsString; 5] {
    ["--volts".into(), default_volts_file().into(), "--loop".into(), "--press".into(), press.into()]
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
    let ran = Board::find().run_with_host(walks(ARM), move |path, _| {
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
    ran.assert_sound();
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
    let ran = Board::find().run_with_host(walks(ARM), move |path, _| {
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
    ran.assert_sound();
    let (answers, counts) = receive.recv().expect("sent");
    assert_eq!(counts, wire::Port { malformed: 1_000, ..wire::Port::default() });
    assert!(answers.is_empty() && ran.boots[0].calls.iter().all(|(_, call)| call.request.is_none()));
    report!("1000 malformed frames refused in {} ticks", ran.books.calls);
}

fn no_request_arms_and_one_stops() {
    let ran = Board::find().run_with_host(walks(&gestures::hold(6.0)), move |path, _| {
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
        // Back to the defaults: from here on the hold of the button arms.
        for (number, parameter) in (200..).zip(Parameter::ALL) {
            host.ask(number, Action::Set { parameter, thousandths: parameter.range()[2] });
            host.wait(20);
        }
        assert!(host.tick < 6_000, "before the hold");
        host.until("walking", |host| host.state == SupervisorState::Walking);
        host.ask(300, Action::Stop);
        host.until("disarmed again", |host| host.state == SupervisorState::Disarmed);
        assert!(host.answered(300, Outcome::InEffect));
        host.wait(500);
    });
    ran.assert_sound();
    assert_eq!(ran.end.edges_before_arming, 0);
    // No pulse but between the release and the end of the short ramp.
    let first = ran.pulses.iter().find(|(_, us)| us.iter().any(Option::is_some)).expect("pulses");
    assert!(first.0 > 6.0, "{first:?}");
    let stop = ran.boots[0].calls.iter().rev().find(|(_, call)| call.request.is_some()).expect("a stop").0;
    let stopped = ran.boots[0].ticks.iter().find(|frame| frame.tick > stop && frame.state == SupervisorState::Disarmed);
    assert!(stopped.expect("it stops").tick - stop <= 820);
}

/// More requests than the board takes, one a tick, and a stop among them: it has a place of its own.
fn a_stop_in_a_flood_of_requests_stops() {
    const FLOOD: u16 = 400;
    for place in [0, FLOOD / 2, FLOOD - 1] {
        let ran = Board::find().run_with_host(walks(ARM), move |path, _| {
            let mut host = Host::open(&path);
            host.until("walking", |host| host.state == SupervisorState::Walking);
            for number in 0..FLOOD {
                let speed = Action::Set { parameter: Parameter::Speed, thousandths: 1_000 };
                host.ask(number, if number == place { Action::Stop } else { speed });
            }
            host.until("disarmed", |host| host.state == SupervisorState::Disarmed);
        });
        ran.assert_sound();
        let taken = ran.boots[0].calls.iter().filter(|(_, call)| call.request.is_some()).count();
        assert!(taken < usize::from(FLOOD) * 3 / 4, "{taken} of {FLOOD} requests were taken: it was no flood");
    }
}

/// Instructions that a tick with a request may take, by ratchets.toml.
fn most_instructions_with_a_request() -> i64 {
    let text = include_str!("../ratchets.toml");
    let ratchets: toml::Table = text.parse().expect("ratchets.toml is TOML");
    let entry = &ratchets["in_tests"]["request-tick-instructions"];
    let number = |key: &str| entry[key].as_integer().expect("a number");
    number("value") * (100 + number("margin_percent")) / 100
}

/// Each gait by name, from which the tick that takes the request is built, and every other parameter.
fn a_request_makes_no_tick_longer_than_its_bound() {
    let ran = Board::find().run_with_host(walks(ARM), move |path, _| {
        let mut host = Host::open(&path);
        host.until("walking", |host| host.state == SupervisorState::Walking);
        let gaits = (1..=4).chain([0]).map(|gait| (Parameter::Gait, gait * 1_000));
        let others = Parameter::ALL.into_iter().map(|parameter| (parameter, parameter.range()[2]));
        for (number, (parameter, thousandths)) in (0..).zip(gaits.chain(others)) {
            host.ask(number, Action::Set { parameter, thousandths });
            // Staged, in effect at the end of the stride, and led in within a second.
            host.wait(if parameter == Parameter::Gait { 2_600 } else { 100 });
        }
    });
    ran.assert_sound();
    let longest = ran.boots[0].costs.iter().map(|cost| cost.longest_cycles).max().expect("costs");
    let most = most_instructions_with_a_request();
    report!("the longest tick with a request takes {longest} instructions, at most {most}");
    assert!(i64::from(longest) <= most, "{longest} instructions, more than {most}");
}

/// At 1 Mbaud: nothing is dropped at 100 frames a second while requests come, and of a board with one sensor nothing at 1,000.
fn the_serial_line_carries_every_rate_and_requests() {
    let ran = Board::find().run_with_host(walks(ARM), move |path, _| {
        let mut host = Host::open(&path);
        host.until("walking", |host| host.state == SupervisorState::Walking);
        let set = |parameter, thousandths| Action::Set { parameter, thousandths };
        for (first, hz) in [(1_u16, 100), (101, 1_000)] {
            host.ask(first, set(Parameter::RecordRate, hz * 1_000));
            host.until("in effect", |host| host.answered(first, Outcome::InEffect));
            let (frames, bytes, tick) = (host.frames, host.bytes, host.tick);
            for number in first + 1..first + 6 {
                host.ask(number, set(Parameter::Speed, 900 + i32::from(number)));
                host.until("in effect", |host| host.answered(number, Outcome::InEffect));
            }
            host.wait(2_000);
            let seconds = f64::from(host.tick - tick) * 1e-3;
            let [frames_hz, bytes_hz] =
                [host.frames - frames, host.bytes - bytes].map(|count| f64::from(count) / seconds);
            report!("record_rate {hz}: {frames_hz:.0} frames and {bytes_hz:.0} bytes a second");
            assert!((frames_hz - f64::from(hz)).abs() < 0.02 * f64::from(hz), "{frames_hz} of {hz} frames a second");
            // Ten bits a byte, and a tenth to spare.
            assert!(bytes_hz < 90_000.0, "{bytes_hz} bytes a second");
            assert_eq!(host.counts.not_sent, 0, "{hz} frames a second");
        }
    });
    ran.assert_sound();
}

fn the_commands_of_footfall_use_the_port() {
    let folder = tempfile::tempdir().expect("a folder");
    let capture = folder.path().join("walk.csv");
    let (elf, out) = (std::env::var("FOOTFALL_ELF").expect("FOOTFALL_ELF"), capture.display().to_string());
    let [default, read_back, given] =
        ["walk.toml", "read.toml", "given.toml"].map(|name| folder.path().join(name).display().to_string());
    let file = GeneratorFile::default_of("phase-coupled").expect("a generator file");
    std::fs::write(&default, file.to_toml()).expect("written");
    let ran = Board::find().run_with_host(walks(ARM), |path, _| {
        let port = path.display().to_string();
        Host::open(&path).until("walking", |host| host.state == SupervisorState::Walking);
        let call = |words: &[&str]| {
            footfall::cli::call(std::iter::once("footfall").chain(words.iter().copied()).map(Into::into))
        };
        let set = |words: &[&str]| call(&[&["set", "--serial", &port], words].concat());
        set(&["speed", "1.25"]).expect("in effect");
        set(&["offset_left_hip", "-2.5", "--json"]).expect("in effect");
        set(&["--show"]).expect("a report");
        call(&["save", &default, "--serial", &port, "-o", &read_back]).expect("a generator");
        let error = call(&["save", &default, "--serial", &port, "--at-rest", "-o", &read_back, "--force"]);
        assert!(error.expect_err("it walks").to_string().contains("in the state `walking`"));
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
    ran.assert_sound();
    let requests: Vec<String> =
        ran.boots[0].calls.iter().filter_map(|(_, call)| call.request).map(|request| request.to_string()).collect();
    let actions: Vec<&str> =
        requests.iter().filter_map(|text| text.split_once(' ')).map(|(_, action)| action).collect();
    assert_eq!(actions, ["set speed 1.25", "set offset_left_hip -2.5", "undo", "set follow 0", "stop"]);
    let rows = std::fs::read_to_string(&capture).expect("a recording");
    assert!(rows.lines().count() > 2_000 && rows.starts_with("time_s,boot,tick,"), "{}", rows.lines().count());
    // What was read back is what was set, and the board reported each change in its tick.
    let words = ["footfall", "save", &default, "--set", "speed=1.25", "--set", "offset_left_hip=-2.5", "-o", &given];
    footfall::cli::call(words.into_iter().map(Into::into)).expect("a generator");
    let [read_back, given] = [read_back, given].map(|path| std::fs::read_to_string(path).expect("a file"));
    assert_eq!(read_back, given);
    let boot = &ran.boots[0];
    let settings = boot.watch(&GeneratorConfig::default_walk(), |joints| *joints.settings());
    assert!(boot.settings.len() >= 5, "{}", boot.settings.len());
    for report in &boot.settings {
        let place = boot.calls.iter().position(|(tick, _)| *tick == report.tick).expect("a call");
        assert_eq!(report.values, settings[place], "tick {}", report.tick);
    }
    // Nothing was lost on the way.
    assert!(rows.lines().skip(1).all(|row| row.ends_with(",0")));
}

/// A person at the live screen of `footfall watch --serial`.
fn keys_of_the_live_screen_change_the_board_and_none_arms() {
    let (send, receive) = channel();
    let program = std::env::var("FOOTFALL_BIN").expect("FOOTFALL_BIN");
    let ran = Board::find().run_with_host(walks(ARM), move |path, _| {
        let line = format!("{program} watch --serial {}", path.display());
        let mut terminal = Terminal::run(&line, 120, 40);
        let _ = terminal.sees(" walking ");
        assert!(terminal.shows().contains("1/12 gait = "), "{}", terminal.shows());
        let shown = raise_speed(&mut terminal);
        let (_, after) = shown.split_once("in effect at tick ").expect("a tick");
        let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
        send.send(digits.parse::<u32>().expect("a number")).expect("received");
        assert!(terminal.sees("speed = 1.05").contains("allowed are 0.5 to 1.5"), "{}", terminal.shows());
        terminal.presses("u");
        let _ = terminal.sees("undo: in effect at tick ");
        terminal.presses("u");
        let _ = terminal.sees("undo: in effect at tick ");
        terminal.presses("s");
        let _ = terminal.sees("stop: stops from tick ");
        let _ = terminal.sees(" disarmed ");
        // Nothing arms.
        terminal.presses(" \r\u{1b}[C\u{1b}[Dusa");
        std::thread::sleep(Duration::from_secs(1));
        assert!(terminal.shows().contains(" disarmed "), "{}", terminal.shows());
        terminal.presses("q");
        let (code, text) = terminal.ends();
        assert_eq!(code, Some(0), "{text}");
    });
    ran.assert_sound();
    assert_eq!(ran.end.edges_after_disarming, 0);
    let seen = receive.recv().expect("sent");
    let boot = &ran.boots[0];
    let answers: Vec<Vec<Answer>> =
        boot.watch(&GeneratorConfig::default_walk(), |joints| joints.answers().collect::<Vec<_>>());
    let effect = answers.into_iter().flatten().find(|answer| answer.outcome == Outcome::InEffect).expect("an effect");
    assert_eq!(effect.tick, seen, "the tick on the screen is that of the loop");
    let requests: Vec<String> =
        boot.calls.iter().filter_map(|(_, call)| call.request).map(|it| it.to_string()).collect();
    let actions: Vec<&str> =
        requests.iter().filter_map(|text| text.split_once(' ')).map(|(_, action)| action).collect();
    assert_eq!(actions[..4], ["set speed 1.05", "undo", "undo", "stop"], "{actions:?}");
}

/// Goes down from the gait to the speed and raises it by one step; what the screen shows then. Whether the speed is known before depends on whether
/// the boot was seen.
fn raise_speed(terminal: &mut Terminal) -> String {
    terminal.presses("\u{1b}[B");
    let _ = terminal.sees("2/12 speed = ");
    terminal.presses("\u{1b}[C");
    terminal.sees("set speed 1.05: in effect at tick ")
}

/// A person at the live screen of `footfall watch --tune`, which runs the virtual board itself.
fn keys_tune_the_virtual_board_that_is_watched() {
    let of = |name: &str| std::env::var(name).unwrap_or_else(|_| panic!("{name}"));
    let [program, elf, board] = ["FOOTFALL_BIN", "FOOTFALL_ELF", "FOOTFALL_VIRTUAL_BOARD"].map(of);
    let line = format!("{program} watch --elf {elf} --virtual-board {board} --tune --pace");
    let mut terminal = Terminal::run(&line, 120, 40);
    let _ = terminal.sees("1/12 gait = own");
    let _ = raise_speed(&mut terminal);
    let _ = terminal.sees("speed = 1.05");
    terminal.presses("u");
    let _ = terminal.sees("speed = 1 ");
    terminal.presses("q");
    let (code, text) = terminal.ends();
    assert_eq!(code, Some(0), "{text}");
}

/// The bytes that OpenOCD's or J-Link's server would pass on, from a server that plays them, cut anywhere.
fn the_raw_log_is_watched_through_a_server() {
    let ran = Board::find().run(["--secs", "3", "--press", ARM]);
    let mut log = Vec::new();
    for line in ran.output.lines() {
        if let BoardLine::Rtt { channel: RECORDS, bytes, .. } = lines::parse(line).expect("a line") {
            log.extend(bytes);
        }
    }
    let server = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("tcp:{}", server.local_addr().expect("an address"));
    // The second connection begins in the middle of a frame.
    let serving = std::thread::spawn(move || {
        for from in [0, log.len() / 2 + 3] {
            let (mut peer, _) = server.accept().expect("a connection");
            log[from..].chunks(101).for_each(|piece| peer.write_all(piece).expect("sent"));
        }
    });
    let watch = || {
        let mut command = Command::new(std::env::var_os("FOOTFALL_BIN").expect("FOOTFALL_BIN"));
        let output = command.args(["watch", "--json", "--rtt", &address]).output().expect("it runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("text");
        let objects = text.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("an object"));
        let ticks = objects.filter(|object| object["type"] == "tick");
        ticks.map(|tick| (tick["tick"].as_u64(), tick["setpoint_hash"].to_string())).collect::<Vec<_>>()
    };
    let frames = ran.boots[0].ticks.iter();
    let sent: Vec<_> =
        frames.map(|frame| (Some(frame.tick.into()), format!("\"{:016x}\"", frame.setpoint_hash))).collect();
    assert_eq!(watch(), sent);
    let late = watch();
    assert!(late.len() > 100 && sent.ends_with(&late), "{} of {}", late.len(), sent.len());
    serving.join().expect("served");
}
