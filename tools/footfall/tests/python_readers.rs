//! Programs in Python as independent readers: a capture by `mcap` and `rosbags`, with the examples of `examples/ros2`, its robot by
//! `yourdfpy`, its joint states by Foxglove's package, and a run that is served by `websockets`.

mod support;

use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};
use support::{Bench, SimulatedBoard};
use test_suite::tests;

fn main() -> ExitCode {
    test_suite::run(tests![
        a_capture_is_read_with_its_times_states_and_robot(Python),
        the_examples_read_a_capture_as_ros_2(Python),
        a_client_in_python_gets_joints_live(Python),
    ])
}

fn walked(secs: u32) -> Vec<String> {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    simulated.end();
    simulated.lines
}

/// Runs a script; gives what it prints.
fn python(script: &Path, arguments: &[&str]) -> String {
    let output = Command::new(test_suite::python()).arg(script).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn readers(arguments: &[&str]) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/readers.py");
    serde_json::from_str(&python(&script, arguments)).unwrap()
}

/// A capture of three seconds that begins at a stated time.
fn capture(bench: &Bench) -> String {
    let file = bench.path("walk.mcap");
    let mut command = bench.watch();
    command.args(["--json", "--secs", "3", "--start-time", "1700000000", "--record"]).arg(&file);
    assert!(command.stdin(Stdio::null()).output().unwrap().status.success());
    file.into_os_string().into_string().unwrap()
}

fn a_capture_is_read_with_its_times_states_and_robot() {
    let bench = Bench::plays(&walked(3));
    let file = capture(&bench);
    let read = readers(&["capture", &file, bench.folder.path().to_str().unwrap()]);
    assert_eq!(read["compression"], serde_json::json!(["zstd"]));
    let sensor = read["sensor"].as_array().unwrap();
    assert_eq!(sensor.len(), 3000);
    for row in sensor {
        let [log, publish, tick] = [0, 1, 2].map(|n| row[n].as_u64().unwrap());
        assert_eq!((log, publish), (1_700_000_000_000_000_000 + tick * 1_000_000, log));
    }
    let states = read["states"].as_array().unwrap();
    assert_eq!((states.len(), &read["known"]), (300, &true.into()));
    assert_eq!(
        (&states[0]["timestamp"]["sec"], &states[0]["timestamp"]["nsec"]),
        (&1_700_000_000.into(), &10_000_000.into())
    );
    assert_eq!(read["schema"]["required"], serde_json::json!(["timestamp", "joints"]));
    let names = ["set_left_hip", "set_left_knee", "set_right_hip", "set_right_knee"];
    let mut joints: Vec<&str> =
        read["robot"]["joints"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    joints.sort_unstable();
    assert_eq!(joints, names);
    // Flexion of the hip swings the thigh, 0.2 m long, forward: x is forward, y to the left.
    let shank_m = [0, 1, 2].map(|axis| read["robot"]["shank_m"][axis].as_f64().unwrap());
    assert_eq!(shank_m, [0.2, 0.06, 0.0]);
}

fn the_examples_read_a_capture_as_ros_2() {
    let bench = Bench::plays(&walked(3));
    let (file, ros) = (capture(&bench), bench.path("ros2.mcap"));
    let ros = ros.to_str().unwrap();
    let example = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/ros2").join(name);
    python(&example("ros2_topics.py"), &[&file, ros]);
    let printed = python(&example("read_ros2.py"), &[ros]);
    let states = readers(&["capture", &file, bench.folder.path().to_str().unwrap()])["states"].clone();
    let rows: Vec<Vec<&str>> = printed.lines().map(|line| line.split(' ').collect()).collect();
    assert_eq!(rows.len(), 300);
    for (row, state) in rows.iter().zip(states.as_array().unwrap()) {
        let stamp = &state["timestamp"];
        let ns = stamp["sec"].as_u64().unwrap() * 1_000_000_000 + stamp["nsec"].as_u64().unwrap();
        assert_eq!(row[0].parse::<u64>().unwrap(), ns);
        for n in 0..4 {
            assert_eq!(row[1 + n], state["joints"][n]["name"]);
            assert_eq!(row[5 + n].parse::<f64>().unwrap(), state["joints"][n]["position"].as_f64().unwrap());
        }
    }
}

fn a_client_in_python_gets_joints_live() {
    let bench = Bench::paced(&walked(2));
    let began_ns = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64;
    let mut command = bench.watch();
    command.args(["--json", "--secs", "2", "--foxglove", "127.0.0.1:0"]);
    let mut child =
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    let mut errors = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("foxglove: ") {
        line.clear();
        assert!(errors.read_line(&mut line).unwrap() > 0, "the address");
    }
    let address = line.trim_end().strip_prefix("foxglove: ").unwrap().to_owned();
    let reading = std::thread::spawn(move || errors.read_to_end(&mut Vec::new()));
    let read = readers(&["live", &address, bench.path("go").to_str().unwrap()]);
    let mut text = String::new();
    child.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    assert!(child.wait().unwrap().success());
    reading.join().unwrap().unwrap();

    let messages = read["messages"].as_array().unwrap();
    assert_eq!(messages.len(), 200);
    assert!(messages.iter().all(|message| message[0].as_u64().unwrap() >= began_ns));
    // The last line of `--json` before the result has the setpoints of the last frame.
    let mut ticks = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let last = ticks.rfind(|object| object["type"] == "tick").unwrap();
    for n in 0..4 {
        let radians = last["setpoint_deg"][n].as_f64().unwrap().to_radians();
        assert!((messages[199][1]["joints"][n]["position"].as_f64().unwrap() - radians).abs() < 1e-6);
    }
}
