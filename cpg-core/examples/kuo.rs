//! Clock, feedback or both: Kuo's pendulum under disturbance, sensor noise and sensor loss.
//!
//! `cargo run -p cpg-core --example kuo`

use cpg_core::oscillator::kuo::{Drive, Kuo, KuoConfig, Measurement, Pendulum};

/// Damping ratio of the limb.
pub(crate) const DAMPING: f64 = 0.1;
/// One tick, in the model's time.
pub(crate) const TICK: f64 = 0.01;

/// What the limb and its sensor suffer. Both are white: their standard deviation over a time t is `process * sqrt(t)` of rate, and
/// `sensor / sqrt(t)` of a mean over t of what is measured.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    pub(crate) process: f64,
    pub(crate) sensor: f64,
}

/// What the control gets to see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Sensor {
    Good,
    /// Reads zero and says it is valid.
    Dead,
    /// Reads zero and says it is not.
    Flagged,
}

/// Peaks of the limb between its passages through zero: mean, standard deviation, number. A limb that stands still has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peaks {
    pub(crate) mean: f64,
    pub(crate) deviation: f64,
    pub(crate) count: u64,
    /// Largest angle in the last tenth of the run.
    pub(crate) last: f64,
}

/// splitmix64 and the polar form of Box and Muller.
pub(crate) struct Gauss(pub(crate) u64);

impl Gauss {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn next(&mut self) -> f64 {
        loop {
            let (x, y) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let square = x * x + y * y;
            if square > 0.0 && square < 1.0 {
                return x * (-2.0 * square.ln() / square).sqrt();
            }
        }
    }
}

/// Runs limb and control together for `time`, and counts peaks after the first 50.
pub(crate) fn trial(drive: Drive<f64>, noise: Noise, sensor: Sensor, seed: u64, time: f64) -> Peaks {
    let limb = Pendulum::new(DAMPING).expect("a damping inside its range");
    let config = KuoConfig { damping: DAMPING, amplitude: 1.0, drive };
    let mut control: Kuo<f64> = config.build(TICK).expect("a valid configuration");
    let mut gauss = Gauss(seed);
    let mut state = control.estimate();
    let (mut peak, mut sum, mut squares, mut count, mut last) = (0.0f64, 0.0, 0.0, 0u64, 0.0f64);
    let ticks = (time / TICK) as u64;
    for tick in 0..ticks {
        let blur = noise.sensor / TICK.sqrt();
        let measured = match sensor {
            Sensor::Good => {
                Measurement { angle: state[0] + blur * gauss.next(), rate: state[1] + blur * gauss.next(), valid: true }
            }
            Sensor::Dead | Sensor::Flagged => Measurement { angle: 0.0, rate: 0.0, valid: sensor == Sensor::Dead },
        };
        let kick = control.step(&measured);
        let before = state[0];
        limb.advance(&mut state, TICK, kick.as_ref());
        state[1] += noise.process * TICK.sqrt() * gauss.next();
        if before * state[0] < 0.0 {
            if tick as f64 * TICK > 50.0 {
                (sum, squares, count) = (sum + peak, squares + peak * peak, count + 1);
            }
            peak = 0.0;
        }
        peak = peak.max(state[0].abs());
        if tick > ticks - ticks / 10 {
            last = last.max(state[0].abs());
        }
    }
    let mean = sum / (count.max(1)) as f64;
    Peaks { mean, deviation: (squares / (count.max(1)) as f64 - mean * mean).max(0.0).sqrt(), count, last }
}

/// The same gain on angle and rate.
pub(crate) fn hybrid(gain: f64) -> Drive<f64> {
    Drive::Hybrid { gain: [gain, gain] }
}

#[allow(dead_code)]
fn main() {
    let limb = Pendulum::new(DAMPING).expect("a damping inside its range");
    let cycle = limb.cycle(1.0);
    println!(
        "impulse {:.8}, half period {:.8}, period {:.8}",
        cycle.impulse,
        cycle.half_period,
        2.0 * cycle.half_period
    );

    let (seed, time) = (1, 40_000.0);
    println!(
        "\npeaks, seed {seed}, {time} time units of {TICK}\n{:<34} {:>5} {:>6} {:>7} {:>7}",
        "", "q", "r", "mean", "sd"
    );
    let row = |name: &str, drive, process, noise, sensor| {
        let peaks = trial(drive, Noise { process, sensor: noise }, sensor, seed, time);
        println!("{name:<34} {process:>5} {noise:>6} {:>7.3} {:>7.3}", peaks.mean, peaks.deviation);
    };
    row("feed-forward", Drive::FeedForward, 0.05, 0.02, Sensor::Good);
    row("feedback", Drive::Feedback, 0.05, 0.0, Sensor::Good);
    row("feedback", Drive::Feedback, 0.05, 0.02, Sensor::Good);
    for gain in [0.2, 0.5, 1.0, 3.0, 10.0, 30.0, 50.0] {
        row(&format!("hybrid, L = {gain}"), hybrid(gain), 0.05, 0.02, Sensor::Good);
    }
    row("hybrid, L = (10, 30)", Drive::Hybrid { gain: [10.0, 30.0] }, 0.05, 0.02, Sensor::Good);
    println!("sensor lost");
    row("feed-forward", Drive::FeedForward, 0.05, 0.02, Sensor::Dead);
    row("feedback, no noise", Drive::Feedback, 0.0, 0.0, Sensor::Dead);
    row("hybrid, L = 0.5, still believed", hybrid(0.5), 0.05, 0.02, Sensor::Dead);
    row("hybrid, L = 0.5, flagged", hybrid(0.5), 0.05, 0.02, Sensor::Flagged);
}
