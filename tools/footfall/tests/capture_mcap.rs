//! Captures as MCAP: compressed chunks with an index, Unix times from a zero that is stated or measured, and the two forms of joint states.

mod support;

use gait_trace::format::mcap_file;
use mcap::records::Record;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};
use support::{Bench, SimulatedBoard};

fn walked(secs: u32) -> Vec<String> {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    simulated.end();
    simulated.lines
}

fn run(command: &mut Command) -> Output {
    let output = command.stdin(Stdio::null()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

fn record(bench: &Bench, name: &str, more: &[&str]) -> PathBuf {
    let file = bench.path(name);
    run(bench.watch().args(["--json", "--secs", "3"]).args(more).arg("--record").arg(&file));
    file
}

/// The messages of each topic, with their log and publish times, and the metadata.
#[derive(Default)]
struct Content {
    messages: BTreeMap<String, Vec<(u64, u64, Vec<u8>)>>,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
}

fn content(file: &PathBuf) -> Content {
    let mut content = Content::default();
    let mut topics = BTreeMap::new();
    let cut = mcap_file::records("a capture", &std::fs::read(file).unwrap(), |_, record| {
        match record {
            Record::Channel(channel) => {
                topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => {
                let of = content.messages.entry(topics[&header.channel_id].clone()).or_default();
                of.push((header.log_time, header.publish_time, data.to_vec()));
            }
            Record::Metadata(metadata) => {
                content.metadata.insert(metadata.name, metadata.metadata);
            }
            _ => {}
        }
        Ok(())
    });
    assert!(!cut.unwrap());
    content
}

fn now_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64
}

fn json(payload: &[u8]) -> Value {
    serde_json::from_slice(payload).unwrap()
}

#[test]
fn times_are_of_the_epoch_and_chunks_compressed() {
    let bench = Bench::plays(&walked(3));
    let file = record(&bench, "walk.mcap", &["--start-time", "1700000000.5"]);
    let bytes = std::fs::read(&file).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.chunk_indexes.len(), 4, "one a second, and the rest");
    for chunk in &summary.chunk_indexes {
        assert_eq!(chunk.compression, "zstd");
    }
    let sum = |of: fn(&mcap::records::ChunkIndex) -> u64| summary.chunk_indexes.iter().map(of).sum::<u64>();
    let [packed, whole] = [sum(|chunk| chunk.compressed_size), sum(|chunk| chunk.uncompressed_size)];
    assert!(packed * 3 < whole, "{packed} {whole}");
    let content = content(&file);
    let sensor = &content.messages["/sensor"];
    assert_eq!((sensor.len(), summary.stats.unwrap().channel_message_counts[&1]), (3000, 3000));
    for (log, publish, payload) in sensor {
        let tick = json(payload)["tick"].as_u64().unwrap();
        assert_eq!((*log, *publish), (1_700_000_000_500_000_000 + tick * 1_000_000, *log));
    }
    assert_eq!(content.metadata["clock"]["zero_unix_ns"], "1700000000500000000");
    assert_eq!(content.messages["/robot_description"][0].0, 1_700_000_000_500_000_000, "no message at 1970");
}

/// The stamps and angles of both forms, each read by its own rules.
#[test]
fn both_forms_of_the_joint_states_agree() {
    let bench = Bench::plays(&walked(3));
    let content = content(&record(&bench, "walk.mcap", &[]));
    let (ros, foxglove) = (&content.messages["/joint_states"], &content.messages["/foxglove_joint_states"]);
    assert_eq!((ros.len(), foxglove.len()), (300, 300));
    for ((at, _, cdr), (also_at, _, text)) in ros.iter().zip(foxglove) {
        assert_eq!(at, also_at);
        let state = json(text);
        let whole = |bytes: &[u8]| u64::from(u32::from_le_bytes(bytes.try_into().unwrap()));
        let stamp = whole(&cdr[4..8]) * 1_000_000_000 + whole(&cdr[8..12]);
        let (sec, nsec) = (&state["timestamp"]["sec"], &state["timestamp"]["nsec"]);
        assert_eq!((stamp, sec.as_u64().unwrap() * 1_000_000_000 + nsec.as_u64().unwrap()), (*at, *at));
        // Positions stand before two empty lists.
        let positions = &cdr[cdr.len() - 40..cdr.len() - 8];
        for (position, joint) in positions.chunks(8).zip(state["joints"].as_array().unwrap()) {
            assert_eq!(f64::from_le_bytes(position.try_into().unwrap()), joint["position"].as_f64().unwrap());
        }
    }
    let joints = &json(&content.messages["/joints"][2999].2);
    let last = &json(&foxglove[299].2)["joints"][2];
    let radians = joints["set_left_knee_deg"].as_f64().unwrap().to_radians();
    assert_eq!(last["name"], "set_left_knee");
    assert!((last["position"].as_f64().unwrap() - radians).abs() < 1e-6);
}

#[test]
fn a_stated_start_gives_equal_bytes_and_none_the_present() {
    let bench = Bench::plays(&walked(3));
    let [one, two] = ["one.mcap", "two.mcap"].map(|name| record(&bench, name, &["--start-time", "1700000000"]));
    assert!(std::fs::read(one).unwrap() == std::fs::read(two).unwrap());
    let before = now_ns();
    let file = record(&bench, "now.mcap", &[]);
    let zero: u64 = content(&file).metadata["clock"]["zero_unix_ns"].parse().unwrap();
    assert!((before..now_ns()).contains(&zero));
    let beside: Value = json(&std::fs::read(bench.path("now.mcap.json")).unwrap());
    assert_eq!(beside["clock"]["zero_unix_ns"], zero);
    // Readers of recordings begin at that zero.
    let raw = gait_trace::format::open::read(&file, &gait_trace::ReadOptions::default()).unwrap();
    assert_eq!((raw.time_s[0], raw.time_s[2999]), (0.001, 3.0));
}

/// A board that is recorded from the middle of its run: what arrives now is of now, whatever its tick.
#[test]
fn a_real_board_has_the_time_of_arrival() {
    let lines = walked(3);
    let bench = Bench::plays(&lines);
    let objects = lines.iter().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let hex: String = objects.filter_map(|object| object["hex"].as_str().map(str::to_owned)).collect();
    let bytes: Vec<u8> =
        (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect();
    std::fs::write(bench.path("log.rtt"), &bytes[bytes.len() / 2..]).unwrap();
    let file = bench.path("late.mcap");
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("record").arg("--elf").arg(bench.path("fw.elf")).arg("--rtt").arg(bench.path("log.rtt"));
    let before = now_ns();
    run(command.arg("--out").arg(&file));
    let content = content(&file);
    let (first, _, payload) = &content.messages["/sensor"][0];
    assert!(json(payload)["tick"].as_u64().unwrap() > 1000);
    assert!((before..now_ns()).contains(first), "{first}");
}
