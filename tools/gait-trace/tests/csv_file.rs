//! Files in and out: every fault is named with line and column, and what is written is read back bit for bit.

use gait_trace::format::csv_file;
use gait_trace::{Channel, Fault, Quantity, Recording, TraceError};
use proptest::prelude::*;

fn error(bytes: &[u8]) -> TraceError {
    match csv_file::parse("walk.csv", bytes) {
        Ok(recording) => panic!("{:?} was read as {recording:?}", String::from_utf8_lossy(bytes)),
        Err(error) => error,
    }
}

#[test]
fn each_fault_names_file_line_column_and_allowed_values() {
    let number = "allowed is a decimal number such as -12.5";
    for (bytes, place, words, allowed) in [
        (&b""[..], "walk.csv: ", "is empty", "allowed is a header"),
        (b"\n\n\n", "walk.csv: ", "is empty", "allowed is a header"),
        (b"left_knee_deg\n1\n", "walk.csv:1: ", "column `time_s` is missing", "allowed is a header such as"),
        (b"time_s;knee_deg\n0;1\n", "walk.csv:1: ", "separated by `;`", "use `,`"),
        (b"time_s\tknee_deg\n0\t1\n", "walk.csv:1: ", "separated by tabs", "use `,`"),
        (b"0,1,2\n1,2,3\n", "walk.csv:1: ", "not a header", "allowed is a header such as"),
        (b"time_s\n0\n1\n", "walk.csv:1: ", "no channel beside", "allowed are 1 or more"),
        (b"time_s,knee\n0,1\n", "walk.csv:1: column 2 `knee`: ", "unknown heading", "allowed are `time_s`, angles"),
        (b"time_s,knee_rad\n0,1\n", "walk.csv:1: column 2 `knee_rad`: ", "unknown heading", "degrees"),
        (b"time_s,,knee_deg\n0,1,2\n", "walk.csv:1: column 2 ``: ", "unknown heading", "allowed are"),
        (
            b"time_s,knee_deg,knee_deg\n0,1,1\n",
            "walk.csv:1: column 3 `knee_deg`: ",
            "the heading occurs twice",
            "allowed is once",
        ),
        (b"time_s,time_s,knee_deg\n", "walk.csv:1: column 2 `time_s`: ", "twice", "allowed is once"),
        (b"time_s,knee_deg\n", "walk.csv:1: ", "0 rows of numbers", "allowed are 2 or more"),
        (b"time_s,knee_deg\n0,1\n", "walk.csv:2: ", "1 rows of numbers", "allowed are 2 or more"),
        (b"time_s,knee_deg\n0,1\n1\n", "walk.csv:3: ", "1 fields", "allowed are 2, as in the header"),
        (b"time_s,knee_deg\n0,1\n1,2,3\n", "walk.csv:3: ", "3 fields", "allowed are 2, as in the header"),
        (b"time_s,knee_deg\n0,1\n1,abc\n", "walk.csv:3: column 2 `knee_deg`: ", "`abc` is not a number", number),
        (b"time_s,knee_deg\n0,1\n\n\n1,\n", "walk.csv:5: column 2 `knee_deg`: ", "`` is not a number", number),
        (b"time_s,knee_deg\n0,1\n1,1.2.3\n", "walk.csv:3: column 2 `knee_deg`: ", "`1.2.3` is not a number", number),
        (b"time_s,knee_deg\n0,NaN\n", "walk.csv:2: column 2 `knee_deg`: ", "`NaN` is not finite", number),
        (b"time_s,knee_deg\n0,-inf\n", "walk.csv:2: column 2 `knee_deg`: ", "`-inf` is not finite", number),
        (b"time_s,knee_deg\n0,1e999\n", "walk.csv:2: column 2 `knee_deg`: ", "`1e999` is not finite", number),
        (b"time_s,knee_deg\nnan,1\n", "walk.csv:2: column 1 `time_s`: ", "`nan` is not finite", number),
        (
            b"time_s,knee_deg\r\n0,1\r\n0.5,2\r\n0.5,3\r\n",
            "walk.csv:4: column 1 `time_s`: ",
            "time 0.5 s after 0.5 s",
            "allowed is a later time in each row",
        ),
        (
            b"time_s,knee_deg\n0,1\n-1,2\n",
            "walk.csv:3: column 1 `time_s`: ",
            "time -1 s after 0 s",
            "allowed is a later time in each row",
        ),
        (
            b"time_s,knee_deg\n0,1\n1,314.2\n",
            "walk.csv:3: column 2 `knee_deg`: ",
            "314.2 degrees is out of range (wrong unit?)",
            "allowed is -200 to 200 degrees",
        ),
        (
            b"time_s,PA1\n0,1\n1,1650\n",
            "walk.csv:3: column 2 `PA1`: ",
            "1650 volts is out of range (wrong unit?)",
            "-0.5 to 6 volts",
        ),
        (b"\x7fELF\x01\x01\x00\x00", "walk.csv:1: ", "is not text (byte 0x7f)", "allowed is UTF-8 text"),
        (b"time_s,knee_deg\n0,1\n\x89PNG\n", "walk.csv:3: ", "is not text (byte 0x89)", "allowed is UTF-8 text"),
        (b"time_s,knee_deg\n0,1\n1,\x00\n", "walk.csv:3: ", "is not text (byte 0x00)", "allowed is UTF-8 text"),
    ] {
        let message = error(bytes).to_string();
        let shown = String::from_utf8_lossy(bytes);
        assert!(message.starts_with(place), "{shown:?}: {message} does not begin with {place}");
        assert!(message.contains(words), "{shown:?}: {message} does not say {words}");
        assert!(message.contains(allowed), "{shown:?}: {message} does not say {allowed}");
    }
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("missing.csv"), folder.path().to_owned()] {
        let error = csv_file::read(&path).unwrap_err();
        assert!(matches!(*error.fault, Fault::Io(_)), "{error}");
        assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
    }
}

#[test]
fn endless_input_is_refused_not_swallowed() {
    let error = csv_file::parse("zero", std::io::repeat(b'1')).unwrap_err();
    assert!(matches!(*error.fault, Fault::TooLarge { .. }), "{error}");
}

#[test]
fn what_spreadsheets_and_other_systems_write_is_read() {
    let plain = csv_file::parse("a", "time_s,left_knee_deg\n0,1.5\n1,-2\n".as_bytes()).unwrap();
    for same in [
        "\u{feff}time_s,left_knee_deg\r\n0,1.5\r\n1,-2\r\n",
        " time_s , left_knee_deg \n 0 , 1.5\n\n1,\t-2",
        "\"time_s\",\"left_knee_deg\"\n0.0,1.5e0\n1.0,-2.0\n",
        "left_knee_deg,time_s\n1.5,0\n-2,1\n",
    ] {
        assert_eq!(csv_file::parse("a", same.as_bytes()).unwrap(), plain, "{same:?}");
    }
}

#[test]
fn a_quote_in_a_field_cannot_swallow_the_lines_below_it() {
    let error = error(b"time_s,knee_deg\n0,\"1\n1,2\n2,3\n");
    assert_eq!((error.line, error.column.map(|(n, _)| n)), (Some(2), Some(2)));
}

#[test]
fn writing_leaves_the_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.csv");
    let knee = Channel::new("left_knee", Quantity::Angle, vec![1.0, 2.5]);
    let recording = Recording::build(vec![0.0, 0.25], vec![knee]).unwrap();
    csv_file::write(&path, &recording).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "time_s,left_knee_deg\n0,1\n0.25,2.5\n");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    assert!(csv_file::write(&folder.path().join("no/such/folder.csv"), &recording).is_err());
}

proptest! {
    #[test]
    fn what_is_written_is_read_back_bit_for_bit(
        steps in prop::collection::vec(1e-6_f64..10.0, 2..50), angles in prop::collection::vec(-200.0_f64..200.0, 50),
    ) {
        let times: Vec<f64> = steps.iter().scan(-3.0, |t, step| { *t += step; Some(*t) }).collect();
        let hip = Channel::new("left_hip", Quantity::Angle, angles[..times.len()].to_vec());
        let pin = Channel::new("PC5", Quantity::PinVolts, angles.iter().take(times.len()).map(|a| a.abs() / 40.0).collect());
        let recording = Recording::build(times, vec![hip, pin]).unwrap();
        let mut text = Vec::new();
        csv_file::write_to(&mut text, &recording).unwrap();
        prop_assert_eq!(csv_file::parse("again", text.as_slice()).unwrap(), recording);
    }

    /// Whatever the bytes are: a recording that keeps its rules or an error, never a panic.
    #[test]
    fn junk_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = csv_file::parse("junk", bytes.as_slice());
    }

    #[test]
    fn nearly_good_text_never_panics(text in "(time_s|knee_deg|,|\n|\r|\"|[0-9]{1,3}|-|\\.|e|nan|inf| |;){0,60}") {
        let _ = csv_file::parse("text", text.as_bytes());
    }
}
