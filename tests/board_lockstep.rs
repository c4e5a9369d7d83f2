//! The flashed image on the virtual board, step by step with a program: equal to a run from a file, equal twice, safe against wrong requests.

use std::io::Write;
use std::process::{Command, ExitCode, Stdio};

use footfall_tests::board::{Board, Ran};
use footfall_tests::lockstep::Conversation;
use footfall_tests::recordings::default_volts;
use joint_loop::RobotConfig;
use joint_units::{Joint, Radians};
use serde_json::{Value, json};
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_first_line_names_protocol_and_joints(Image),
        the_requests_of_the_page_have_the_answers_of_the_page(Image),
        steps_through_a_file_are_the_run_from_that_file(Image),
        equal_conversations_have_equal_answers(Image),
        a_refused_request_changes_nothing(Image),
        an_input_that_ends_in_a_line_is_an_error(Image),
        the_end_of_requests_ends_the_run(Image),
        a_supply_that_drops_resets_the_board(Image),
        a_press_of_the_stop_ends_the_pulses(Image),
        the_lamps_are_those_at_the_pins(Image),
        the_answer_has_the_angles_of_modelled_servos(Image),
        a_script_of_faults_runs_beside_the_steps(Image),
        an_option_that_steps_cannot_have_is_refused(Image),
        it_walks_alike_in_steps_of_1_and_of_5_ms(Image),
    ])
}

/// Inputs of a person who walks, sample by sample.
struct Inputs {
    step_us: u64,
    steps: u64,
    volts: Vec<f64>,
}

impl Inputs {
    /// Of so many steps of this length: the default recording, of 1 ms, each sample at the beginning of a step.
    fn new(step_us: u64, steps: u64) -> Self {
        let recording = default_volts();
        let values = recording.channels()[0].values();
        let at = |step: u64| values[(step * step_us / 1000) as usize % (values.len() - 1)];
        Self { step_us, steps, volts: (0..=steps).map(at).collect() }
    }

    /// The keys of a step: linear from sample to sample, the gestures that arm, steps of the foot, a press that stops.
    fn keys(&self, step: u64) -> Value {
        let (begin_us, us) = (step * self.step_us, self.step_us);
        let now = |at_ms: u64| (at_ms * 1000).next_multiple_of(us) == begin_us;
        let n = step as usize;
        let mut keys = json!({"volts": {"PA1": [self.volts[n], self.volts[n + 1]]}});
        for (at_ms, key, value) in PRESSES {
            if now(at_ms) {
                keys[key] = json!(value);
            }
        }
        let mut levels = serde_json::Map::new();
        for (at_ms, high) in FOOT {
            if now(at_ms) {
                levels.insert("PC5".into(), json!(high));
            }
        }
        if step > 0 && step.is_multiple_of(EDGE_STEPS) {
            levels.insert("PC6".into(), json!(is_high(step)));
        }
        if !levels.is_empty() {
            keys["levels"] = levels.into();
        }
        keys
    }

    /// Options of a run with the same inputs from files.
    fn options(&self, folder: &std::path::Path) -> Vec<String> {
        let time_s = |us: u64| us as f64 / 1e6;
        let at_s = |ms: u64| time_s((ms * 1000).next_multiple_of(self.step_us));
        let rows =
            self.volts.iter().enumerate().map(|(n, volts)| format!("{},{volts}\n", time_s(n as u64 * self.step_us)));
        let feed = folder.join("volts.csv");
        std::fs::write(&feed, format!("time_s,PA1\n{}", rows.collect::<String>())).expect("written");
        // The edges of a press: `--press` adds two times up.
        let press = |key: &str| {
            let times: Vec<f64> = PRESSES.iter().filter(|one| one.1 == key).map(|one| at_s(one.0)).collect();
            times.chunks(2).map(|both| format!("{}:{}", both[0], both[1] - both[0])).collect::<Vec<_>>()
        };
        let mut options = vec!["--secs".into(), time_s(self.steps * self.step_us).to_string()];
        options.extend(["--volts".into(), feed.display().to_string(), "--press".into()]);
        options.extend(press("button"));
        options.push("--emergency-stop".into());
        options.extend(press("stop"));
        let edges: String = FOOT.iter().map(|(ms, high)| format!("{},{}\n", at_s(*ms), u8::from(*high))).collect();
        let foot = folder.join("foot.csv");
        std::fs::write(&foot, format!("time_s,level\n{edges}")).expect("written");
        options.extend(["--edges".into(), format!("PC5={}", foot.display())]);
        let steps = (EDGE_STEPS..self.steps).step_by(EDGE_STEPS as usize);
        let edges = steps.map(|step| format!("{},{}\n", time_s(step * self.step_us), u8::from(is_high(step))));
        let line = folder.join("line.csv");
        std::fs::write(&line, format!("time_s,level\n{}", edges.collect::<String>())).expect("written");
        options.extend(["--edges".into(), format!("PC6={}", line.display())]);
        options
    }

    fn converse(&self, options: &[&str]) -> Ran {
        Board::find().converse(options, |board| {
            for step in 0..self.steps {
                board.step(self.step_us, self.keys(step));
            }
        })
    }
}

/// Presses: when, ms, of what, and whether it is the beginning.
const PRESSES: [(u64, &str, bool); 6] = [
    (45, "stop", true),
    (70, "stop", false),
    (75, "button", true),
    (385, "button", false),
    (3_500, "button", true),
    (3_600, "button", false),
];

/// Edges at the foot switch: when, ms, and the level.
const FOOT: [(u64, bool); 4] = [(800, true), (1_450, false), (1_900, true), (2_600, false)];

/// Steps between two edges at the synchronisation input, whose times the board logs to a microsecond.
const EDGE_STEPS: u64 = 23;

/// The level of that input after the edge at a step.
fn is_high(step: u64) -> bool {
    !(step / EDGE_STEPS).is_multiple_of(2)
}

/// The lines of a run without those of the protocol.
fn run_lines(ran: &Ran) -> Vec<&str> {
    let of_protocol = |line: &&str| {
        ["lockstep", "step", "error"].iter().any(|kind| line.starts_with(&format!("{{\"type\":\"{kind}\"")))
    };
    ran.output.lines().filter(|line| !of_protocol(line)).collect()
}

/// The same lines, bit for bit. Says which the first other one is.
fn assert_same(left: &[&str], right: &[&str]) {
    for (n, (left, right)) in left.iter().zip(right).enumerate() {
        assert_eq!(left, right, "line {n}");
    }
    assert_eq!(left.len(), right.len());
}

fn the_first_line_names_protocol_and_joints() {
    let ran = Board::find().converse(&[] as &[&str], |board| {
        let first = board.line();
        assert_eq!((&first["type"], &first["version"]), (&json!("lockstep"), &json!(1)));
        let joints = first["joints"].as_array().expect("the default robot");
        let names: Vec<_> = joints.iter().map(|joint| (joint["pin"].as_str(), joint["joint"].as_str())).collect();
        let expected = [("PE9", "left_hip"), ("PE11", "right_hip"), ("PE13", "left_knee"), ("PE14", "right_knee")];
        assert_eq!(names, expected.map(|(pin, joint)| (Some(pin), Some(joint))));
        // The firmware's own map of an angle to a pulse.
        let robot = RobotConfig::default_biped();
        for ((line, servo), joint) in joints.iter().zip(robot.servos).zip(Joint::ALL) {
            let key = |key: &str| line[key].as_f64().expect("a number");
            let map = servo.build(joint).expect("the default robot is valid");
            for degrees in [5.0, 30.0] {
                let us = key("neutral_us") + (f64::from(degrees) - key("deg_at_neutral")) * key("us_per_deg");
                let pulse = map.pulse(Radians::from_degrees(degrees)).expect("finite");
                assert!((f64::from(pulse.0) - us).abs() <= 0.51, "{line}: {us} us, {pulse:?}");
            }
        }
    });
    assert_eq!(ran.code, Some(0));
}

fn the_requests_of_the_page_have_the_answers_of_the_page() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/virtual-board.md");
    let text = std::fs::read_to_string(page).expect("the page");
    let blocks: Vec<&str> =
        text.split("```json\n").skip(1).map(|rest| rest.split("```").next().expect("its end")).collect();
    let [requests, answers] = blocks[..] else { panic!("{} blocks", blocks.len()) };
    let _ = Board::find().converse(&[] as &[&str], |board| {
        for (request, answer) in requests.lines().zip(answers.lines()) {
            let expected: Value = serde_json::from_str(answer).expect("an object");
            assert_eq!(board.ask(request).last(), Some(&expected), "{request}");
        }
    });
    assert_eq!((requests.lines().count(), answers.lines().count()), (4, 4));
}

fn steps_through_a_file_are_the_run_from_that_file() {
    let board = Board::find();
    let folder = tempfile::tempdir().expect("a folder");
    // Also steps that are no whole number of milliseconds, and with another speed of the processor.
    for (step_us, steps, more) in [
        (300, 5_000, &[][..]),
        (1_000, 4_500, &[]),
        (5_000, 900, &[]),
        (1_700, 2_600, &["--servo", "digital"]),
        (2_300, 1_000, &["--cpi", "1.7", "--servo", "analogue"]),
    ] {
        let inputs = Inputs::new(step_us, steps);
        let options = inputs.options(folder.path());
        let file = board.run(options.iter().map(String::as_str).chain(more.iter().copied()));
        let stepped = inputs.converse(more);
        assert_same(&run_lines(&stepped), &run_lines(&file));
        let secs = inputs.steps as f64 * step_us as f64 * 1e-6;
        assert!(file.pulses.len() as f64 > 40.0 * (secs - 1.0).min(3.0), "it walks: {} frames", file.pulses.len());
        let last = |ran: &Ran| ran.boots[0].ticks.last().expect("frames").setpoint_hash;
        assert_eq!(last(&stepped), last(&file));
        assert_eq!((file.code, stepped.code, stepped.books.different), (Some(0), Some(0), 0));
        assert!(stepped.boots[0].edges.len() as u64 + 5 > steps / EDGE_STEPS, "{} edges", stepped.boots[0].edges.len());
        report!("steps of {step_us} us: {} equal lines, hash {:016x}", run_lines(&file).len(), last(&file));
    }
}

fn equal_conversations_have_equal_answers() {
    let inputs = Inputs::new(1_000, 2_000);
    let [first, second] = [(); 2].map(|()| inputs.converse(&["--servo", "digital"]));
    assert_same(&first.output.lines().collect::<Vec<_>>(), &second.output.lines().collect::<Vec<_>>());
    // Another voltage for one millisecond is another run.
    let mut other = Inputs::new(1_000, 2_000);
    other.volts[1_200] += 0.01;
    assert_ne!(run_lines(&other.converse(&["--servo", "digital"])), run_lines(&first));
}

fn a_refused_request_changes_nothing() {
    const WRONG: [(&str, &str, &str); 15] = [
        ("hold", "", "the line is not a request"),
        ("[1, 1000]", "", "the line is not a request: it is an array"),
        ("{\"us\": 1000, \"volts\": {\"PA1\": 1}", "", "the line is not a request"),
        (
            "{\"us\": -1000, \"volts\": {\"PA1\": 1}}",
            "us",
            "allowed is a whole number from 1 to 10000000, microseconds",
        ),
        ("{\"us\": 1000, \"pin\": {\"PA1\": 1}}", "", "unknown field `pin`"),
        ("{\"version\": 2, \"us\": 1000}", "version", "this virtual board has version 1"),
        ("{\"us\": 1000, \"volts\": {\"PA1\": 1, \"PB9\": 1}}", "volts.PB9", "not a pin of a converter"),
        ("{\"us\": 1000, \"stop\": true, \"volts\": {\"PA1\": 100}}", "volts.PA1", "must be -10 to 10 V"),
        ("{\"us\": 1000, \"stop\": true, \"levels\": {\"PC7\": true}}", "levels.PC7", "set by --level or --edges"),
        ("{\"us\": 1000, \"levels\": {\"PC5\": true, \"PA0\": true}}", "levels.PA0", "a key of its own: `button`"),
        ("{\"us\": 1000, \"levels\": {\"PB12\": false}}", "levels.PB12", "a key of its own: `stop`"),
        ("{\"us\": 1000, \"button\": \"pressed\"}", "button", "allowed is true or false"),
        ("{\"volts\": {\"PA1\": 1}}", "us", "`us` is missing"),
        ("{\"us\": 1000, \"end\": true}", "end", "stands alone"),
        ("\u{1}", "", "the line is not a request"),
    ];
    let inputs = Inputs::new(1_000, 1_500);
    let options = ["--level", "PC7=0"];
    let undisturbed = inputs.converse(&options);
    let disturbed = Board::find().converse(options, |board| {
        for step in 0..inputs.steps {
            let (line, field, words) = WRONG[step as usize % WRONG.len()];
            let answer = board.ask(line);
            let error = answer.last().expect("a line");
            assert_eq!((&error["type"], &error["field"]), (&json!("error"), &json!(field)), "{line}: {error}");
            assert!(error["text"].as_str().expect("text").contains(words), "{line}: {error}");
            board.step(inputs.step_us, inputs.keys(step));
        }
        let long = format!("{{\"us\": 1000, \"volts\": {{\"{}\": 1}}}}", "P".repeat(70_000));
        assert!(board.ask(&long).last().expect("a line")["text"].as_str().expect("text").contains("longer than 65536"));
    });
    assert_same(&run_lines(&disturbed), &run_lines(&undisturbed));
    assert_eq!(disturbed.code, Some(0));
}

fn an_input_that_ends_in_a_line_is_an_error() {
    let mut errors = Vec::new();
    let ran = Board::find().converse(&[] as &[&str], |board| {
        board.step(5_000, json!({}));
        board.send(b"{\"us\": 5000}");
    });
    errors.extend(ran.remarks.iter().filter(|line| line["type"] == "error"));
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0]["text"].as_str().expect("text").contains("ended in the middle of a line"), "{errors:?}");
    assert!(ran.code == Some(1) && (ran.end.t_s - 0.005).abs() < 1e-6, "the step was not carried out");
}

fn the_end_of_requests_ends_the_run() {
    let at_once = Board::find().converse(&[] as &[&str], |_| {});
    assert_eq!((at_once.code, at_once.end.reason.as_str()), (Some(0), "time"));
    assert!((at_once.end.t_s - 0.001).abs() < 1e-6);
    let asked = Board::find().converse(&[] as &[&str], |board| {
        board.step(2_500, json!({"version": 1}));
        let end = board.ask("{\"end\": true}");
        assert_eq!(end.last().expect("a line")["type"], "end");
    });
    // The next whole millisecond.
    assert!(asked.code == Some(0) && (asked.end.t_s - 0.003).abs() < 1e-6, "{}", asked.end.t_s);
}

/// Steps a walking board of these options to this time, ms, and returns the last answer.
fn walk(board: &mut Conversation, inputs: &Inputs, until_ms: u64) -> Value {
    let mut last = Value::Null;
    for step in 0..until_ms * 1000 / inputs.step_us {
        last = board.step(inputs.step_us, inputs.keys(step)).pop().expect("a line");
    }
    last
}

fn a_supply_that_drops_resets_the_board() {
    let inputs = Inputs::new(1_000, 3_000);
    let ran = Board::find().converse(&[] as &[&str], |board| {
        let walking = walk(board, &inputs, 2_000);
        assert_eq!((&walking["armed"], &walking["rail"]), (&json!(true), &json!(true)));
        let dropped = board.step(1_000, json!({"volts": {"VDD": 2.45}}));
        let boot = dropped.iter().find(|line| line["type"] == "boot").expect("a reset");
        assert_eq!(boot["cause"], "brown_out");
        assert!((boot["t_s"].as_f64().expect("a time") - 2.0).abs() < 1e-6, "{boot}");
        let last = dropped.last().expect("a line");
        assert_eq!((&last["armed"], &last["rail"]), (&json!(false), &json!(false)));
        // Held in reset as long as the supply is low.
        for _ in 0..50 {
            assert_eq!(board.step(1_000, json!({})).len(), 1);
        }
        board.step(1_000, json!({"volts": {"VDD": 3.0}}));
        board.step(500_000, json!({}));
    });
    assert_eq!((ran.end.resets.len(), ran.boots.len()), (1, 2));
    assert!(ran.pulses.iter().all(|(at, _)| *at < 2.0), "no pulse without another hold");
    assert!(ran.boots[1].ticks.len() > 30, "it runs again: {}", ran.boots[1].ticks.len());
    assert_eq!(ran.code, Some(0));
}

fn a_press_of_the_stop_ends_the_pulses() {
    let inputs = Inputs::new(5_000, 600);
    let ran = Board::find().converse(&[] as &[&str], |board| {
        assert_eq!(walk(board, &inputs, 2_000)["rail"], json!(true));
        let pressed = board.step(1_000, json!({"stop": true})).pop().expect("a line");
        assert_eq!((&pressed["armed"], &pressed["rail"]), (&json!(false), &json!(false)), "within a millisecond");
        board.step(100_000, json!({"stop": false}));
    });
    assert!(ran.pulses.iter().all(|(at, _)| *at < 2.001));
    assert!(ran.pulses.len() > 60);
}

fn the_lamps_are_those_at_the_pins() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["PD12", "PD14"].map(|pin| (pin, folder.path().join(format!("{pin}.csv"))));
    let options =
        files.iter().flat_map(|(pin, file)| ["--record-edges".to_owned(), format!("{pin}={}", file.display())]);
    let inputs = Inputs::new(5_000, 1_000);
    let mut changes: Vec<Value> = Vec::new();
    let _ = Board::find().converse(options, |board| {
        for step in 0..inputs.steps {
            let last = board.step(inputs.step_us, inputs.keys(step)).pop().expect("a line");
            let (until_s, lamps) =
                (last["t_us"].as_f64().expect("a time") * 1e-6, last["lamps"].as_array().expect("a list"));
            let inside =
                |change: &Value| (until_s - 0.0051..=until_s).contains(&change["t_s"].as_f64().expect("a time"));
            assert!(lamps.iter().all(inside), "{last}");
            changes.extend(lamps.iter().cloned());
        }
    });
    for (pin, file) in files {
        let text = std::fs::read_to_string(file).expect("the edges");
        let of_pin = changes.iter().filter(|change| change["pin"] == pin);
        let shown: Vec<String> =
            of_pin.map(|change| format!("{},{}", change["t_s"], u8::from(change["on"] == json!(true)))).collect();
        assert_eq!(shown, text.lines().skip(1).collect::<Vec<_>>(), "{pin}");
    }
    assert!(changes.len() > 3, "{} changes", changes.len());
}

fn the_answer_has_the_angles_of_modelled_servos() {
    let inputs = Inputs::new(1_000, 2_500);
    let mut angles = Vec::new();
    let ran = Board::find().converse(["--servo", "digital", "--servo-at", "0,0,90,5"], |board| {
        for step in 0..inputs.steps {
            let last = board.step(inputs.step_us, inputs.keys(step)).pop().expect("a line");
            let degrees: [f64; 4] = serde_json::from_value(last["deg"].clone()).expect("four numbers");
            angles.push((last["t_us"].as_u64().expect("a time"), degrees));
        }
    });
    // The lines that every run has each 20 ms, at a time without a pulse.
    let lines = ran.remarks.iter().filter(|line| line["type"] == "servos");
    let mut compared = 0;
    for line in lines {
        let at_us = (line["t_s"].as_f64().expect("a time") * 1e6).round() as u64;
        let in_pulse = ran.pulses.iter().any(|(rise, _)| (0.0..0.003).contains(&(at_us as f64 * 1e-6 - rise)));
        if let Some((_, degrees)) = angles.iter().find(|(t_us, _)| *t_us == at_us).filter(|_| !in_pulse) {
            let at_line: [f64; 4] = serde_json::from_value(line["deg"].clone()).expect("four numbers");
            assert!(degrees.iter().zip(at_line).all(|(a, b)| (a - b).abs() < 0.01), "{degrees:?} {line}");
            compared += 1;
        }
    }
    // The servo turns at 612 degrees a second, also while a pulse lasts. The answer has a new pulse from the end of the last one of its frame, up to 0.89 ms
    // after its own: the turn of that time is in the millisecond that follows.
    let turns = angles.windows(2).map(|pair| (pair[1].1[2] - pair[0].1[2]).abs());
    let fastest = turns.fold(0.0, f64::max);
    assert!((0.55..0.612 * 1.9).contains(&fastest), "{fastest} degrees in a millisecond");
    let moved =
        angles.iter().map(|(_, degrees)| degrees[2]).fold((f64::MAX, f64::MIN), |(a, b), c| (a.min(c), b.max(c)));
    assert!(compared > 60 && moved.1 - moved.0 > 30.0, "{compared} lines, {moved:?}");
}

fn a_script_of_faults_runs_beside_the_steps() {
    const SCRIPT: &str = "[[event]]\nname = \"the wire comes off\"\nat_s = 1.5\ninject = { volts = { pin = \"PA1\", volts = 0.0 } }\nfor_ms = 300\n\
        [[event]]\nname = \"a dip\"\nat_s = 1.9\ninject = { vdd = 2.4 }\nfor_ms = 20\n";
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("script.toml");
    std::fs::write(&script, SCRIPT).expect("written");
    let inputs = Inputs::new(1_000, 2_200);
    let mut options = inputs.options(folder.path());
    let more = ["--script".to_owned(), script.display().to_string()];
    options.extend(more.clone());
    let file = Board::find().run(&options);
    let stepped = inputs.converse(&more.each_ref().map(String::as_str));
    assert_same(&run_lines(&stepped), &run_lines(&file));
    assert_eq!((stepped.end.injections.len(), stepped.boots.len()), (2, 2));
}

fn an_option_that_steps_cannot_have_is_refused() {
    let board = std::env::var_os("FOOTFALL_VIRTUAL_BOARD").expect("FOOTFALL_VIRTUAL_BOARD");
    let elf = std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF");
    for option in ["--volts=a.csv", "--secs=1", "--pace", "--campaign=a.toml"] {
        let mut child = Command::new(&board)
            .arg(&elf)
            .args(["--lockstep", option])
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let _ = child.stdin.take().expect("piped").write_all(b"{\"end\": true}\n");
        let ran = child.wait_with_output().expect("it ends");
        let error = String::from_utf8(ran.stderr).expect("text");
        assert_eq!(ran.status.code(), Some(2), "{option}: {error}");
        assert!(error.contains("cannot be used with"), "{option}: {error}");
    }
}

/// The inputs of a person change by steps of 5 ms in one of them; the moments of arming and of the servo frames do not.
fn it_walks_alike_in_steps_of_1_and_of_5_ms() {
    let [short, long] =
        [(1_000, 6_000), (5_000, 1_200)].map(|(step_us, steps)| Inputs::new(step_us, steps).converse(&[]));
    assert!(short.pulses.len() > 120, "it walks: {} frames", short.pulses.len());
    assert_eq!(short.pulses.len(), long.pulses.len());
    for ((ours, _), (theirs, _)) in short.pulses.iter().zip(&long.pulses) {
        assert!((ours - theirs).abs() < 1e-6, "a frame at {ours} s, in longer steps at {theirs} s");
    }
}
