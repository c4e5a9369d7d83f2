//! Hazards of servo pulses as angles of modelled servos: the numbers of docs/safety.md, which `FOOTFALL_WRITE_DOCS=1` writes again.

use std::fmt::Write as _;
use std::path::Path;

use servo_model::{DataSheet, Kind, Servo};

/// Scale of the default robot: 1000 us are 90 degrees.
const US_PER_DEGREE: f64 = 1000.0 / 90.0;
const KINDS: [Kind; 2] = [Kind::Analogue, Kind::Digital];
/// A servo frame, s.
const FRAME_S: f64 = 0.02;
/// Longest time from a cut to the supply that `tests/board_pulses.rs` allows, s.
const SUPPLY_S: f64 = 50e-6;

/// The lines of the page between which the table is.
const MARKS: [&str; 2] =
    ["<!-- Table of tests/servos.rs, written by the test -->", "<!-- End of the table of tests/servos.rs -->"];

/// A servo that has stood at this angle for a second, by pulses each 20 ms; the time of the next pulse is 1 s.
fn standing(kind: Kind, degrees: f64) -> Servo {
    let mut servo = Servo::new(DataSheet::of(kind), US_PER_DEGREE, degrees);
    servo.set_supply(0.0, true);
    (0..50).for_each(|frame| servo.pulse(FRAME_S * f64::from(frame), us(degrees)));
    servo.advance(1.0);
    servo
}

fn us(degrees: f64) -> f64 {
    1500.0 + degrees * US_PER_DEGREE
}

/// Largest angle that a pulse of any length, cut from that of 60 degrees, turns the servo by; then the pulses end for a second. The supply goes
/// after the cut, or stays.
fn after_a_cut(kind: Kind, supply_s: Option<f64>) -> f64 {
    let whole = us(60.0) as u32;
    let turned = (1..whole).map(|width| {
        let mut servo = standing(kind, 60.0);
        let ended = 1.0 + f64::from(width) * 1e-6;
        servo.pulse(ended, f64::from(width));
        if let Some(after) = supply_s {
            servo.set_supply(ended + after, false);
        }
        servo.advance(2.0);
        (servo.angle() - 60.0).abs()
    });
    turned.fold(0.0, f64::max)
}

/// Time in which a servo turns from 90 degrees to the park pose at 5 degrees after the first pulse, s, and its highest speed over a frame, degrees/s.
fn first_pulse(kind: Kind) -> (f64, f64) {
    let mut servo = Servo::new(DataSheet::of(kind), US_PER_DEGREE, 90.0);
    servo.set_supply(0.0, true);
    let (mut now, mut fastest) = (0.0, 0.0_f64);
    while (servo.angle() - 5.0).abs() > 0.5 {
        let before = servo.angle();
        servo.pulse(now, us(5.0));
        now += FRAME_S;
        servo.advance(now);
        fastest = fastest.max((servo.angle() - before).abs() / FRAME_S);
        assert!(now < 2.0, "it arrives");
    }
    (now, fastest)
}

/// Time for which an arming at the last pulses holds them (`joint-loop/src/motion/start.rs`), s.
const HELD_S: f64 = 0.5;
/// Largest rate of a setpoint, degrees/s.
const RATE: f64 = 500.0;

/// An arming 60 degrees from the park pose: the angle between the shaft and the first pulse that the servo takes, degrees, if the pulses are held for so long
/// and then go to the park pose.
fn first_taken(kind: Kind, held_s: f64) -> f64 {
    let start_s = DataSheet::of(kind).start_up_s;
    let frames = (start_s / FRAME_S).ceil();
    (RATE * (frames * FRAME_S - held_s)).clamp(0.0, 60.0)
}

/// Torque 0.1 s after the last pulse, with the supply and without it.
fn after_silence(kind: Kind) -> [f64; 2] {
    let mut servo = standing(kind, 10.0);
    servo.advance(1.1);
    let with = servo.torque();
    servo.set_supply(1.1, false);
    [with, servo.torque()]
}

fn table() -> String {
    let mut text = String::from("| what happens | analogue servo | digital servo |\n|---|---|---|\n");
    let mut row = |what: &str, of: &dyn Fn(Kind) -> String| {
        let _ = writeln!(text, "| {what} | {} | {} |", of(Kind::Analogue), of(Kind::Digital));
    };
    row(
        "a pulse is cut at any moment, and the supply goes 50 us later: largest angle that the shaft turns by",
        &|kind| format!("{:.3} degrees", after_a_cut(kind, Some(SUPPLY_S))),
    );
    row("the same, and the supply stays, as on a robot without the rail switch", &|kind| {
        format!("{:.1} degrees", after_a_cut(kind, None))
    });
    row(
        "first pulse at arming (H02), the joint stands 85 degrees from the park pose: time until it is there, highest speed",
        &|kind| {
            let (time, speed) = first_pulse(kind);
            format!("{time:.2} s, {speed:.0} degrees/s")
        },
    );
    row(
        "arming at the last pulses, 60 degrees from the park pose: angle by which the servo jumps to the first pulse that it takes",
        &|kind| format!("{:.1} degrees", first_taken(kind, HELD_S)),
    );
    row("100 ms after the last pulse, the supply stays: torque that is left", &|kind| {
        format!("{:.0} %", after_silence(kind)[0] * 100.0)
    });
    row("the same, and the supply is off", &|kind| format!("{:.0} %", after_silence(kind)[1] * 100.0));
    text
}

#[test]
fn the_page_has_the_numbers_of_the_models() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/safety.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let (head, rest) = page.split_once(MARKS[0]).expect("the first mark");
    let (_, tail) = rest.split_once(MARKS[1]).expect("the last mark");
    let written = format!("{head}{}\n\n{}\n{}{tail}", MARKS[0], table(), MARKS[1]);
    if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some() {
        std::fs::write(&path, &written).expect("written");
        return;
    }
    assert!(
        page == written,
        "docs/safety.md is not up to date; FOOTFALL_WRITE_DOCS=1 writes it. The table is\n{}",
        table()
    );
}

/// The digital servo's start-up is inside of the time for which pulses are held.
#[test]
fn the_pulses_are_held_for_longer_than_a_servo_starts() {
    for kind in KINDS {
        assert!(DataSheet::of(kind).start_up_s + 2.0 * FRAME_S < HELD_S, "{kind:?}");
    }
}

#[test]
fn a_supply_that_goes_with_the_pulse_takes_its_effect_away() {
    for kind in KINDS {
        let [with, without] = [Some(SUPPLY_S), None].map(|supply| after_a_cut(kind, supply));
        assert!(with < 0.05 && without > 5.0, "{kind:?}: {with} and {without} degrees");
    }
}
