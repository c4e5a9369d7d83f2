//! Conversions: what the source has comes back bit for bit, what it does not have stays missing, and the record is read back.

mod synthetic;

use gait_trace::format::converted::{self, Conversion, Format};
use gait_trace::format::{csv_file, open};
use gait_trace::{RawJoints, ReadOptions, Rules, condition};
use joint_units::Joint;
use proptest::prelude::*;
use synthetic::{column, walk};

fn written(raw: &RawJoints, format: Format, conversion: &Conversion) -> Vec<u8> {
    let rules = Rules { jump_bend_deg: f64::INFINITY, ..Rules::default() };
    let mut text = Vec::new();
    converted::write_to(&mut text, format, &condition(raw, &rules).unwrap(), conversion).unwrap();
    text
}

fn read(name: &str, text: &[u8]) -> RawJoints {
    open::of_bytes(name, text, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn record(hz: Option<f64>) -> Conversion {
    Conversion {
        version: "9.9.9".into(),
        source: "a walk, of 2026: day=1.c3d".into(),
        source_sha256: "0f".repeat(32),
        options: "--map left_hip=3 --unit degrees".into(),
        low_pass_hz: hz,
        changes: vec!["left knee: the sign was changed".into(), "endheader".into(), "time_s: two\nlines".into()],
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Gaps of any length, also at the ends, in any joint.
    #[test]
    fn values_come_back_and_gaps_stay_gaps(
        from in 0_usize..300, length in 1_usize..200, joint in prop::sample::select(Joint::ALL.to_vec()), jump in 0_usize..300,
    ) {
        let mut raw = walk(3.0, 100.0, 1.1, 0.1);
        let last = raw.time_s.len();
        column(&mut raw, joint)[from..(from + length).min(last)].fill(f64::NAN);
        // A jump is what was measured.
        column(&mut raw, Joint::RightKnee)[jump] += 11.0;
        for (name, format) in [("walk.csv", Format::Csv), ("walk.mot", Format::Mot)] {
            let back = read(name, &written(&raw, format, &record(None)));
            prop_assert_eq!(&back.time_s, &raw.time_s);
            for (back, raw) in back.joints.iter().zip(&raw.joints) {
                let (back, raw) = (&back.as_ref().unwrap().angle_deg, &raw.as_ref().unwrap().angle_deg);
                let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
                prop_assert!(back.len() == raw.len() && back.iter().zip(raw).all(same), "{}", name);
            }
        }
    }

    #[test]
    fn the_record_is_read_back(hz in prop::option::of(1.0_f64..40.0), is_csv in any::<bool>()) {
        let format = if is_csv { Format::Csv } else { Format::Mot };
        let text = written(&walk(3.0, 100.0, 1.1, 0.1), format, &record(hz));
        let mut wanted = record(hz);
        wanted.changes[2] = "time_s: two lines".into();
        prop_assert_eq!(Conversion::of_bytes(&text), Ok(Some(wanted)));
    }
}

#[test]
fn the_strict_reader_takes_a_conversion_without_gaps() {
    let raw = walk(3.0, 100.0, 1.1, 0.1);
    let text = written(&raw, Format::Csv, &record(Some(6.0)));
    let recording = csv_file::parse("walk.csv", text.as_slice()).unwrap();
    assert_eq!(recording.channel("left_hip").unwrap().values(), raw.joints[0].as_ref().unwrap().angle_deg);
    // A comment between the rows is none.
    let text = String::from_utf8(text).unwrap() + "# end\n";
    assert!(csv_file::parse("walk.csv", text.as_bytes()).is_err());
}

#[test]
fn other_files_have_no_record() {
    for text in [
        "",
        "time_s,left_hip_deg\n0,1\n",
        "# a comment\ntime_s,x\n",
        "Coordinates\nversion=1\nendheader\ntime\n",
        "\u{0}\u{1}",
    ] {
        assert_eq!(Conversion::of_bytes(text.as_bytes()), Ok(None), "{text:?}");
    }
    for text in ["# footfall convert 1\n# low-pass: six\ntime_s\n", "x\nfootfall-convert=1\nendheader\n"] {
        assert!(Conversion::of_bytes(text.as_bytes()).unwrap_err().contains("convert the source again"), "{text:?}");
    }
}
