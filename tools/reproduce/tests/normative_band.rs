//! The normative band of the reports, against the recordings that it is from.

use gait_fit::normative::{self, Band, band};
use joint_units::Joint;
use reproduce::normative_band::{Study, numbers, study};
use std::path::Path;
use std::process::ExitCode;
use std::sync::LazyLock;
use test_suite::{tests, traces_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_numbers_are_those_of_the_recordings(Traces),
        the_file_is_what_the_command_writes(Traces),
        the_band_is_that_of_a_walk(),
        every_recording_may_be_used(),
    ])
}

static STUDY: LazyLock<Study> = LazyLock::new(|| study(&traces_folder()).unwrap_or_else(|error| panic!("{error}")));

fn the_numbers_are_those_of_the_recordings() {
    let near = |a: f64, b: f64| (a - b).abs() <= 0.005 + 1e-9;
    for (joint, made) in [(Joint::RightHip, &STUDY.hip), (Joint::RightKnee, &STUDY.knee)] {
        let Band { mean_deg, sd_deg, level_sd_deg, range_deg } = band(joint);
        for k in 0..normative::POINTS {
            assert!(near(mean_deg[k], made.mean_deg[k]) && near(sd_deg[k], made.sd_deg[k]), "{} {k}", joint.name());
        }
        assert!(near(*level_sd_deg, made.level_sd_deg), "{level_sd_deg} {}", made.level_sd_deg);
        assert!(near(range_deg.0, made.range_deg.0) && near(range_deg.1, made.range_deg.1), "{range_deg:?}");
    }
    assert_eq!(normative::PERSONS, STUDY.persons);
    assert!(near(normative::CADENCES.0, STUDY.cadences.0) && near(normative::CADENCES.1, STUDY.cadences.1));
}

fn the_file_is_what_the_command_writes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../gait-fit/src/normative/numbers.rs");
    let text = std::fs::read_to_string(path).expect("the numbers");
    // The formatter breaks the lines of the file.
    let joined = |text: &str| text.split_whitespace().collect::<String>();
    assert!(
        joined(&text) == joined(&numbers(&STUDY)),
        "the numbers differ; `cargo run -p reproduce --example normative_band -- --write` makes them again"
    );
}

/// What every textbook of gait analysis has (Perry and Burnfield 2010): at contact a flexed hip and a nearly straight knee, a small flexion of
/// the knee in early stance and a large one, about 60 degrees, in swing at about 73 %; the hip is extended most in late stance at about 50 %.
fn the_band_is_that_of_a_walk() {
    let (hip, knee) = (&band(Joint::LeftHip).mean_deg, &band(Joint::LeftKnee).mean_deg);
    let percent = |k: usize| 100 * k / normative::POINTS;
    let place = |values: &[f64], of: fn(f64, f64) -> bool, from: usize, to: usize| {
        (from..to).reduce(|best, k| if of(values[k], values[best]) { k } else { best }).unwrap_or(from)
    };
    let swing = place(knee, |a, b| a > b, 25, 50);
    assert!((68..=78).contains(&percent(swing)) && (55.0..75.0).contains(&knee[swing]), "{swing} {}", knee[swing]);
    let loading = place(knee, |a, b| a > b, 0, 15);
    assert!((8..=22).contains(&percent(loading)) && knee[loading] > knee[0] + 3.0, "{loading} {}", knee[loading]);
    let extended = place(hip, |a, b| a < b, 0, 50);
    assert!((46..=58).contains(&percent(extended)), "{extended}");
    assert!(hip[0] > 20.0 && knee[0] < 12.0, "{} {}", hip[0], knee[0]);
}

fn every_recording_may_be_used() {
    let licences = ["Apache-2.0", "BSD-2-Clause", "CC BY 4.0"];
    assert!(normative::sources().all(|source| licences.contains(&source.licence)));
    assert_eq!(normative::sources().count(), 10);
    let words = normative::words();
    // An origin that several recordings have is named once.
    let origins = normative::sources().flat_map(|source| source.origin.split("; "));
    assert!(origins.into_iter().all(|origin| words.matches(origin).count() == 1), "{words}");
    assert!(
        licences.iter().all(|licence| words.contains(licence)) && words.contains("no reference of a population"),
        "{words}"
    );
}
