//! Which frequency Hu's half-centre takes on a joint, by the joint's resonance and the feedback.
//!
//! `cargo run -p cpg-core --example hu`

use cpg_core::oscillator::hu::{Hu, HuConfig};
use joint_units::Period;

pub(crate) const NATURAL_HZ: [f64; 7] = [0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 3.0];
pub(crate) const FEEDBACK: [f64; 3] = [0.0, 1.0, 3.0];

/// Upward crossings of zero per second, from 60 s to 160 s: of the joint's angle and of the difference of the firing rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frequencies {
    pub(crate) joint: f64,
    pub(crate) pair: f64,
}

/// Counts upward crossings of zero, placed between two ticks by the chord.
#[derive(Default)]
struct Crossings {
    last: f64,
    first: Option<f64>,
    latest: f64,
    intervals: u32,
}

impl Crossings {
    fn sample(&mut self, time: f64, tick: f64, value: f64) {
        if self.last < 0.0 && value >= 0.0 {
            self.latest = time - tick * value / (value - self.last);
            if self.first.is_some() {
                self.intervals += 1;
            }
            self.first = self.first.or(Some(self.latest));
        }
        self.last = value;
    }

    fn frequency(&self) -> f64 {
        self.first.map_or(0.0, |first| f64::from(self.intervals) / (self.latest - first))
    }
}

pub(crate) fn frequencies(natural_hz: f64, feedback: f64) -> Frequencies {
    let mut hu: Hu<f64> =
        HuConfig::standard(natural_hz, feedback).build(Period::MILLISECOND).expect("a valid configuration");
    let (mut joint, mut pair) = (Crossings::default(), Crossings::default());
    for tick in 1..=160_000 {
        hu.step();
        if tick >= 60_000 {
            let time = f64::from(tick) * 1e-3;
            joint.sample(time, 1e-3, hu.angle());
            let [x1, x2] = hu.potentials();
            pair.sample(time, 1e-3, x1 - x2);
        }
    }
    Frequencies { joint: joint.frequency(), pair: pair.frequency() }
}

#[allow(dead_code)]
fn main() {
    println!("frequency of the joint in Hz (of the pair, where it is another)\n");
    let row = |name: &str, cells: [String; 7]| {
        println!("{name:<8} {}", cells.map(|cell| format!("{cell:>16}")).concat());
    };
    row("f_n", NATURAL_HZ.map(|hz| format!("{hz} Hz")));
    for feedback in FEEDBACK {
        let cells = NATURAL_HZ.map(|natural_hz| {
            let Frequencies { joint, pair } = frequencies(natural_hz, feedback);
            if (joint - pair).abs() < 1e-3 { format!("{joint:.4}") } else { format!("{joint:.4} ({pair:.4})") }
        });
        row(&format!("h = {feedback}"), cells);
    }
}
