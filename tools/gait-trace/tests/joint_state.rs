//! `sensor_msgs/msg/JointState` of ROS 2 in MCAP: files of independent writers, the choice of a topic, stamps, and damaged messages.

mod support;

#[path = "support/damage.rs"]
mod damage;

use damage::held;
use gait_trace::format::open;
use gait_trace::{Done, Finding, FindingKind, Level, RawJoints, ReadOptions, Rules, condition};
use joint_units::Joint;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::Cursor;
use support::{joint, walk};

const DEFINITION: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const LEGS: [&str; 4] = ["left_hip", "right_hip", "left_knee", "right_knee"];

fn read(bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, String> {
    open::of_bytes("walk.mcap", bytes, how).map_err(|error| error.to_string())
}

/// Values of a message, aligned behind the four bytes of the encapsulation.
#[derive(Default)]
struct Little(Vec<u8>);

impl Little {
    fn word(&mut self, value: u32) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.word(text.len() as u32 + 1);
        self.0.extend(text.bytes().chain([0]));
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.word(numbers.len() as u32);
        for number in numbers {
            self.0.resize(self.0.len().next_multiple_of(8), 0);
            self.0.extend(number.to_le_bytes());
        }
    }
}

fn message(stamp_ms: u32, names: &[&str], positions: &[f64]) -> Vec<u8> {
    let mut out = Little::default();
    out.word(stamp_ms / 1000);
    out.word(stamp_ms % 1000 * 1_000_000);
    out.text("base_link");
    out.word(names.len() as u32);
    names.iter().for_each(|name| out.text(name));
    out.numbers(positions);
    out.numbers(&[]);
    out.numbers(&[]);
    [vec![0, 1, 0, 0], out.0].concat()
}

/// Messages in one chunk: topic, schema, definition, log time in ms, bytes.
type Logged<'a> = (&'a str, &'a str, &'a str, u64, Vec<u8>);

fn file(messages: &[Logged<'_>]) -> Vec<u8> {
    let messages: Vec<Logged<'_>> = messages
        .iter()
        .map(|(topic, schema, text, ms, data)| (*topic, *schema, *text, ms * 1000, data.clone()))
        .collect();
    file_us(&messages)
}

/// The same, with log times in microseconds.
fn file_us(messages: &[Logged<'_>]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let options = WriteOptions::new().chunk_size(None).disable_seeking(true);
    let mut writer: Writer<_> = options.create(&mut out).unwrap();
    for (topic, schema, definition, us, data) in messages {
        let schema = writer.add_schema(schema, "ros2msg", definition.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: us * 1000, publish_time: 0 };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

fn of_state<'a>(topic: &'a str, ms: u64, data: Vec<u8>) -> Logged<'a> {
    (topic, "sensor_msgs/msg/JointState", DEFINITION, ms, data)
}

fn radians(n: usize, k: usize) -> f64 {
    0.4 + 0.3 * ((n + 7 * k) as f64 * 0.05).sin()
}

/// All four joints on a topic, with log times 5 ms behind the stamps.
fn legs(topic: &str, scale: f64) -> Vec<Logged<'_>> {
    let state = |n: usize| message(n as u32 * 10, &LEGS, &[0, 1, 2, 3].map(|k| scale * radians(n, k)));
    (0..60).map(|n| of_state(topic, n as u64 * 10 + 5, state(n))).collect()
}

/// The files are written by rosbags 0.11 (zstd) and mcap 1.6 (lz4, big endian; no compression) for Python from the first rows of the
/// walk; the names of the joints are in reverse in every other message, and one message has no left knee.
#[test]
fn files_of_independent_writers_give_the_walk() {
    let walk = walk();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/mcap");
    for name in ["ros2_zstd.mcap", "ros2_lz4_big_endian.mcap", "ros2_uncompressed.mcap"] {
        let raw = open::read(&folder.join(name), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let channels = if name == "ros2_zstd.mcap" { 2 } else { 1 };
        assert_eq!(raw.format, format!("MCAP, ROS 2 JointState, 4 joints of {channels} channels"));
        assert_eq!(raw.time_s.len(), 24);
        for (n, time) in raw.time_s.iter().enumerate() {
            let stamp = 1_700_000_000.25 + (n as f64 * 1e9 / 150.0).round() / 1e9;
            assert!((time - stamp).abs() < 3e-7, "{name}: {time} {stamp}");
        }
        for which in Joint::ALL {
            let found = raw.joints[which as usize].as_ref().unwrap();
            for (n, (angle, wanted)) in found.angle_deg.iter().zip(joint(&walk, which)).enumerate() {
                let is_missing = n == 7 && which == Joint::LeftKnee;
                assert_eq!(angle.is_nan(), is_missing, "{name} {which:?} {n}");
                assert!(is_missing || (angle - wanted).abs() < 1e-13, "{name} {which:?} {n}: {angle} {wanted}");
            }
        }
        let ignored = raw.notes == ["8 messages of `/chatter` are not read."];
        assert!(if channels == 2 { ignored } else { raw.notes.is_empty() }, "{:?}", raw.notes);
    }
}

#[test]
fn several_topics_are_refused_and_an_option_chooses() {
    let both = file(&[legs("/joint_states", 1.0), legs("/joint_commands", 0.5)].concat());
    let error = read(&both, &ReadOptions::default()).unwrap_err();
    let words =
        "joints are in several topics: `/joint_commands`, `/joint_states`; allowed is one: choose with `--topic TOPIC`";
    assert!(error.contains(words), "{error}");
    let chosen = |topic: &str| ReadOptions { topic: Some(topic.into()), ..ReadOptions::default() };
    for (topic, scale) in [("/joint_states", 1.0), ("/joint_commands", 0.5)] {
        let raw = read(&both, &chosen(topic)).unwrap();
        assert_eq!(raw.joints[0].as_ref().unwrap().column, format!("{topic}.left_hip"));
        for (k, found) in raw.joints.iter().flatten().enumerate() {
            assert!((0..60).all(|n| found.angle_deg[n] == (scale * radians(n, k)).to_degrees()), "{topic}");
        }
        assert_eq!((raw.time_s.len(), raw.time_s[59]), (60, 0.59), "stamps, not log times");
        assert!(raw.notes[0].starts_with("60 messages of `/joint_"), "{:?}", raw.notes);
    }
    let mut how = ReadOptions::default();
    how.add_map("left_hip=/joint_states.left_hip,right_knee=/joint_commands.right_knee").unwrap();
    let error = read(&both, &how).unwrap_err();
    assert!(error.contains("are both recognised as `right_hip`"), "{error}");
    how.add_map("right_hip=/joint_states.right_hip,left_knee=/joint_states.left_knee").unwrap();
    assert_eq!(read(&both, &how).unwrap().joints.iter().flatten().count(), 4);
    let error = read(&both, &chosen("/joint_state")).unwrap_err();
    assert!(error.contains("no topic `/joint_state`") && error.contains("`/joint_states (cdr)`"), "{error}");
    let error = open::of_bytes("a.csv", b"time_s,left_hip_deg\n0,1\n1,2\n", &chosen("/a")).unwrap_err().to_string();
    assert!(error.contains("a topic is given (`--topic`), but this is no MCAP file"), "{error}");
}

/// Other publishers of the topic, messages without positions, and headers without stamps.
#[test]
fn what_is_left_out_is_a_note() {
    let mut messages = legs("/joint_states", 1.0);
    for n in 0..60 {
        messages.push(of_state("/joint_states", n * 10 + 6, message(n as u32 * 10 + 1, &["waist"], &[0.5])));
    }
    messages.push(of_state("/joint_states", 700, message(700, &LEGS, &[])));
    let raw = read(&file(&messages), &ReadOptions::default()).unwrap();
    assert_eq!(
        (raw.time_s.len(), raw.notes.as_slice()),
        (60, &["1 messages have no positions and are left out.".to_owned()][..])
    );

    let unstamped: Vec<Logged<'_>> =
        (0..60).map(|n| of_state("/joint_states", n * 10 + 5, message(0, &LEGS, &[0.1, 0.2, 0.3, 0.4]))).collect();
    let raw = read(&file(&unstamped), &ReadOptions::default()).unwrap();
    assert_eq!(raw.time_s[59], 0.595);
    assert_eq!(
        raw.notes,
        ["No header of `/joint_states` has a stamp; the times are those at which the messages were received."]
    );
}

/// Messages without stamps, each received late by up to eight tenths of a step: the rows are at equal steps, and only what is lost is a gap.
#[test]
fn delays_of_messages_without_stamps_are_no_gaps() {
    let walk = walk();
    // Microseconds of delay.
    let delay = |n: usize| (n * 7919 % 97) as u64 * 55;
    let of = |lost: std::ops::Range<usize>| {
        let messages: Vec<Logged<'_>> = (0..walk.time_s().len())
            .filter(|n| !lost.contains(n))
            .map(|n| {
                let positions = Joint::ALL.map(|which| joint(&walk, which)[n].to_radians());
                let log_us = n as u64 * 6_666 + delay(n);
                ("/joint_states", "sensor_msgs/msg/JointState", DEFINITION, log_us, message(0, &LEGS, &positions))
            })
            .collect();
        condition(&read(&file_us(&messages), &ReadOptions::default()).unwrap(), &Rules::default()).unwrap()
    };
    let whole = of(0..0);
    let received = |finding: &Finding| matches!(finding.what, FindingKind::ReceivedTimes { share } if share > 0.5);
    assert!(whole.findings.len() == 1 && received(&whole.findings[0]), "{:?}", whole.findings);
    assert_eq!((whole.findings[0].level(), whole.findings[0].done), (Level::Warning, Done::Resampled));
    let words = whole.findings[0].to_string();
    assert!(words.contains("at which messages were received") && words.ends_with("put at equal time steps"), "{words}");
    assert_eq!(whole.recording.time_s().len(), walk.time_s().len());
    for which in Joint::ALL {
        for (found, recorded) in whole.joint(which).unwrap().iter().zip(joint(&walk, which)) {
            assert!((found - recorded).abs() < 1e-9, "{which:?}: {found} {recorded}");
        }
    }
    // One message that is lost, and twenty.
    for lost in [100..101, 180..200] {
        let holed = of(lost.clone());
        assert_eq!(holed.recording.time_s().len(), walk.time_s().len());
        assert!(holed.missing.iter().all(|gaps| *gaps == [(lost.start, lost.end)]), "{:?}", holed.missing);
    }
}

/// The definition decides: the same fields by another name are read, other fields by the same name are not.
#[test]
fn the_definition_decides() {
    let other = DEFINITION.replace("float64[] position", "float32[] position");
    let with = |schema: &'static str, definition: &'static str| -> Result<RawJoints, String> {
        let messages: Vec<Logged<'_>> = legs("/legs", 1.0)
            .into_iter()
            .map(|(topic, _, _, ms, data)| (topic, schema, definition, ms, data))
            .collect();
        read(&file(&messages), &ReadOptions::default())
    };
    let other: &'static str = other.leak();
    assert_eq!(with("exo/msg/Legs", DEFINITION).unwrap().joints.iter().flatten().count(), 4);
    assert_eq!(with("sensor_msgs/msg/JointState", "").unwrap().joints.iter().flatten().count(), 4);
    let error = with("sensor_msgs/msg/JointState", other).unwrap_err();
    assert!(error.contains("no column is recognised as a joint; there are the channels `/legs (cdr)`"), "{error}");
    // Beside joints that are read, the refusal is a note.
    let mut messages = legs("/joint_states", 1.0);
    messages.push(("/old", "sensor_msgs/msg/JointState", other, 0, vec![0, 1, 0, 0]));
    let raw = read(&file(&messages), &ReadOptions::default()).unwrap();
    let note = "`/old` is not read: its definition is not that of sensor_msgs/msg/JointState.";
    assert_eq!(raw.notes, [note, "1 messages of `/old` are not read."]);
}

#[test]
fn damaged_messages_are_refused_with_their_place() {
    let good = message(100, &LEGS, &[0.1, 0.2, 0.3, 0.4]);
    let with = |at: usize, value: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        bytes
    };
    let count = good.windows(4).position(|at| at == b"left").unwrap() - 8;
    let text = good.windows(4).position(|at| at == b"base").unwrap();
    for (what, bytes, words) in [
        ("cut", good[..60].to_vec(), "and the message has 56; allowed is a whole message"),
        ("empty", Vec::new(), "has 0 bytes; allowed are 4 or more"),
        ("another encapsulation", with(0, &[0, 3]), "its encapsulation is 00 03; allowed are 00 00 (CDR, big endian)"),
        ("big endian by mistake", with(0, &[0, 0]), "allowed"),
        (
            "a huge count of names",
            with(count, &u32::MAX.to_le_bytes()),
            "name has 4294967295 elements; allowed are up to",
        ),
        (
            "nanoseconds",
            with(8, &2_000_000_000_u32.to_le_bytes()),
            "nanosec is 2000000000; allowed is below 1000000000",
        ),
        ("a name that is no text", with(text, &[0xff, 0xfe]), "header.frame_id is no text; allowed is UTF-8"),
        ("one position", message(100, &LEGS, &[0.1]), "1 positions of 4 joints; allowed are as many"),
        ("a long message", message(100, &["left_hip"; 9000], &[0.1; 9000]), "allowed are up to 65536"),
    ] {
        let mut messages = legs("/joint_states", 1.0);
        messages[30].4 = bytes;
        let bytes = file(&messages);
        let (error, held) = held(|| read(&bytes, &ReadOptions::default()).expect_err(what));
        assert!(error.starts_with("walk.mcap: before byte ") && error.contains(words), "{what}: {error}");
        assert!(held < 3 * bytes.len() as isize + damage::MARGIN, "{what}: {held} bytes held");
    }
}

/// A chunk with a compression and a size, and no check sum.
fn chunk(compression: &str, size: u64, data: &[u8]) -> Vec<u8> {
    let mut record = [0_u64.to_le_bytes(), 0_u64.to_le_bytes(), size.to_le_bytes()].concat();
    record.extend(0_u32.to_le_bytes());
    record.extend((compression.len() as u32).to_le_bytes());
    record.extend(compression.bytes());
    record.extend((data.len() as u64).to_le_bytes());
    record.extend(data);
    [mcap::MAGIC.to_vec(), vec![6], (record.len() as u64).to_le_bytes().to_vec(), record].concat()
}

/// A zstd frame of blocks that each repeat one byte 128 KiB times.
fn zstd_bomb(blocks: usize) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 0x50];
    for n in 0..blocks {
        let header = (128_u32 << 10 << 3) | 2 | u32::from(n + 1 == blocks);
        frame.extend(&header.to_le_bytes()[..3]);
        frame.push(0);
    }
    frame
}

#[test]
fn chunks_are_unpacked_within_limits() {
    let limit = 64 << 20;
    for (what, bytes, words) in [
        ("an unknown compression", chunk("xz", 8, &[1; 8]), "compressed with xz; allowed are none, zstd and lz4"),
        ("not zstd", chunk("zstd", 8, &[1; 8]), "compressed with zstd is damaged"),
        ("not lz4", chunk("lz4", 8, &[1; 8]), "compressed with lz4 is damaged"),
        ("nothing", chunk("zstd", 8, &[]), "a chunk announces 8 bytes and has 0"),
        ("a cut frame", chunk("zstd", 8, &zstd_bomb(3)[..12]), "compressed with zstd is damaged"),
        ("more than announced", chunk("zstd", 1000, &zstd_bomb(3)), "a chunk announces 1000 bytes and has more"),
        ("less than announced", chunk("zstd", 1 << 20, &zstd_bomb(3)), "announces 1048576 bytes and has 393216"),
        (
            "an announced terabyte",
            chunk("zstd", 1 << 40, &zstd_bomb(3)),
            "1099511627776 bytes when unpacked; allowed are up to 67108864",
        ),
        ("an announced 64 MB", chunk("lz4", limit, &[]), "announces 67108864 bytes and has 0"),
    ] {
        let (error, held) = held(|| read(&bytes, &ReadOptions::default()).expect_err(what));
        assert!(error.contains(words) && error.contains("allowed"), "{what}: {error}");
        assert!(held < 2 * damage::MARGIN, "{what}: {held} bytes held for {}", bytes.len());
    }
    // Zeros are records of length 0 and of an unknown kind.
    let many = chunk("zstd", 9 * (1 << 20), &zstd_bomb(72));
    let error = read(&many, &ReadOptions::default()).unwrap_err();
    assert!(error.contains("no column is recognised as a joint"), "{error}");
}

/// The reader of records that is used elsewhere panics on this one.
#[test]
fn an_attachment_that_is_too_short_is_no_panic() {
    let attachment = [vec![9], 20_u64.to_le_bytes().to_vec(), vec![0; 20]].concat();
    let bytes = [mcap::MAGIC.to_vec(), attachment].concat();
    assert!(read(&bytes, &ReadOptions::default()).unwrap_err().contains("no column is recognised as a joint"));
}
