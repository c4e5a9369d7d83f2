//! MCAP files: joints out of JSON messages, and what becomes of files that are cut, bent or not ours.

use gait_trace::ReadOptions;
use gait_trace::format::open;
use joint_units::Joint;
use mcap::records::{MessageHeader, Metadata};
use mcap::{WriteOptions, Writer};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Cursor;

/// Messages a chunk.
const CHUNK: usize = 100;

/// A file of messages: topic, encoding, time in ms, text.
fn file(messages: &[(&str, &str, u64, String)]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let options = WriteOptions::new().chunk_size(None).disable_seeking(true);
    let mut writer: Writer<_> = options.create(&mut out).unwrap();
    for (n, (topic, encoding, ms, text)) in messages.iter().enumerate() {
        let schema = writer.add_schema("any", "jsonschema", b"{}").unwrap();
        let channel_id = writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: ms * 1_000_000, publish_time: 0 };
        writer.write_to_known_channel(&header, text.as_bytes()).unwrap();
        if (n + 1).is_multiple_of(CHUNK) {
            writer.flush().unwrap();
        }
    }
    let lost = BTreeMap::from([("lost_samples".to_owned(), "7".to_owned())]);
    writer.write_metadata(&Metadata { name: "end".into(), metadata: lost }).unwrap();
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

fn angle(n: usize) -> f64 {
    30.0 + 30.0 * (n as f64 * 0.006).sin()
}

/// A knee of so many samples, and a channel that is none.
fn knee(samples: usize) -> Vec<u8> {
    let message = |n: usize| {
        let value = if n == 5 { Value::Null } else { json!(angle(n)) };
        let text = json!({ "tick": n, "verdict": "good", "left_knee_deg": value }).to_string();
        ("/sensor", "json", n as u64, text)
    };
    let other = |n: usize| ("/log", "json", n as u64, json!({ "set_left_hip_deg": 1, "text": "a" }).to_string());
    let messages: Vec<_> = (0..samples).flat_map(|n| [message(n), other(n)]).collect();
    file(&messages)
}

fn read(bytes: &[u8]) -> Result<gait_trace::RawJoints, String> {
    open::of_bytes("walk.bin", bytes, &ReadOptions::default()).map_err(|error| error.to_string())
}

#[test]
fn joints_times_gaps_and_losses_are_read() {
    let raw = read(&knee(300)).unwrap();
    assert_eq!((raw.time_s.len(), raw.time_s[299]), (300, 0.299));
    let knee = raw.joints[Joint::LeftKnee as usize].as_ref().unwrap();
    assert_eq!(knee.column, "/sensor.left_knee_deg");
    assert!(knee.angle_deg[5].is_nan());
    assert!((0..300).all(|n| n == 5 || knee.angle_deg[n] == angle(n)));
    assert_eq!(raw.joints.iter().flatten().count(), 1, "a setpoint is no measured joint");
    assert_eq!(raw.format, "MCAP, JSON, 1 joints of 2 channels");
    assert!(raw.notes.iter().any(|note| note.contains("7 lost samples")), "{:?}", raw.notes);
}

#[test]
fn channels_of_the_same_times_make_one_table_and_a_map_chooses() {
    let one = |topic: &'static str, field: &str, n: usize, at: f64| {
        (topic, "json", n as u64, format!("{{\"{field}\": {at}}}"))
    };
    let messages: Vec<_> =
        (0..50).flat_map(|n| [one("/a", "hip_flexion_l", n, angle(n)), one("/b", "gonio_deg", n, -angle(n))]).collect();
    let bytes = file(&messages);
    let mut how = ReadOptions::default();
    how.add_map("right_knee=/b.gonio_deg").unwrap();
    let raw = open::of_bytes("walk.mcap", &bytes, &how).unwrap();
    assert_eq!(raw.time_s.len(), 50);
    let of = |joint: Joint| raw.joints[joint as usize].as_ref().unwrap().angle_deg.clone();
    assert!(of(Joint::RightKnee).iter().zip(of(Joint::LeftHip)).all(|(b, a)| *b == -a));
    how.add_map("left_knee=/c").unwrap();
    let error = open::of_bytes("walk.mcap", &bytes, &how).unwrap_err().to_string();
    assert!(error.contains("the map takes `left_knee` from `/c`") && error.contains("`/b.gonio_deg`"), "{error}");
}

/// A recorder that was stopped: the complete chunks are read, with a note that the end is missing.
#[test]
fn a_file_without_its_end_is_read_up_to_the_last_whole_chunk() {
    let whole = knee(300);
    let chunk_ends: Vec<usize> = (0..whole.len()).step_by(97).chain([whole.len() - 1]).collect();
    let mut most = 0;
    for cut in chunk_ends {
        match read(&whole[..cut]) {
            Ok(raw) => {
                assert_eq!(raw.time_s.len() % (CHUNK / 2), 0, "cut at {cut}");
                assert!(raw.notes.iter().any(|note| note.contains("The file has no end record")), "cut at {cut}");
                assert!(raw.time_s.len() >= most, "cut at {cut}");
                most = raw.time_s.len();
            }
            Err(error) => assert!(most == 0 && error.contains("walk.bin: "), "cut at {cut}: {error}"),
        }
    }
    assert_eq!(most, 300);
}

#[test]
fn damage_is_reported() {
    let good = knee(300);
    let mut bent = good.clone();
    let middle = good.windows(13).position(|bytes| bytes == b"left_knee_deg").unwrap();
    bent[middle] ^= 1;
    let mut long = good.clone();
    long[9..17].copy_from_slice(&u64::MAX.to_le_bytes());
    let text = |text: &str| (0..30).map(|n| ("/sensor", "json", n, text.to_owned())).collect::<Vec<_>>();
    let cdr = file(&(0..30).map(|n| ("/joint_states", "cdr", n, "\0\u{1}".to_owned())).collect::<Vec<_>>());
    let two = r#"{"left_knee_deg": 10, "l_knee_flexion_deg": 20}"#;
    let mut later = text(r#"{"left_knee_deg": 10}"#);
    later[20].3 = r#"{"left_knee_deg": "ten"}"#.into();
    let mut junk = text(r#"{"left_knee_deg": 10}"#);
    junk[20].3 = "{".into();
    let mut huge = text(r#"{"left_knee_deg": 10}"#);
    huge[20].3 = format!("{{\"left_knee_deg\": {}1{}}}", "[".repeat(40_000), "]".repeat(40_000));
    let lz4 = {
        let mut bytes = good.clone();
        // The chunk's compression is an empty string: chunk, two times, size, check sum, length 0.
        let chunk = bytes.windows(9).position(|at| at[0] == 6 && at[3..9] == [0; 6]).unwrap();
        let length = u64::from_le_bytes(bytes[chunk + 1..chunk + 9].try_into().unwrap()) + 3;
        bytes[chunk + 1..chunk + 9].copy_from_slice(&length.to_le_bytes());
        bytes[chunk + 37..chunk + 41].copy_from_slice(&3_u32.to_le_bytes());
        bytes.splice(chunk + 41..chunk + 41, *b"lz4");
        bytes
    };
    for (what, bytes, words) in [
        ("a bit", bent, "Chunk CRC failed"),
        ("a length", long, "longer than the whole file"),
        ("magic alone", mcap::MAGIC.to_vec(), "no column is recognised as a joint"),
        ("not compressed", lz4, "a chunk that is compressed with lz4 is damaged"),
        ("another encoding", cdr, "no column is recognised as a joint; there are the channels `/joint_states (cdr)`"),
        ("no joint", file(&text(r#"{"x": 1}"#)), "no column is recognised as a joint; there are `/sensor.x`"),
        ("two", file(&text(two)), "are both recognised as `left_knee`"),
        ("a word", file(&later), "`/sensor.left_knee_deg` is \"ten\"; allowed is a number or null"),
        ("no JSON", file(&junk), "message: is not a JSON object"),
        ("a long message", file(&huge), "message: 80020 bytes; allowed are up to 65536"),
        ("one message", file(&text(r#"{"left_knee_deg": 10}"#)[..1]), "1 rows of numbers; allowed are 2 or more"),
    ] {
        let error = read(&bytes).map(|raw| raw.notes).expect_err(what);
        assert!(error.starts_with("walk.bin: ") && error.contains(words), "{what}: {error}");
    }
}

proptest! {
    #[test]
    fn nothing_panics(at in 0_usize..20_000, with in any::<u64>(), width in 1_usize..9, cut in 0_usize..30_000) {
        let mut bytes = knee(120);
        let at = at % (bytes.len() - 8);
        bytes[at..at + width].copy_from_slice(&with.to_le_bytes()[..width]);
        let end = bytes.len() - cut % bytes.len() / 4;
        let _ = read(&bytes[..end]);
    }
}
