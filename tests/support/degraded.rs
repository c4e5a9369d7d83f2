//! Degraded copies of a real sensor: what comes where something is broken.
//!
//! Two kinds. [`Stream`] takes a sensor's codes one a tick, as a converter gives them. The functions of the module take a whole series of
//! angles in degrees at the control rate and give it as it comes: pure, with a seed where there is chance; `None` is a sample that is
//! flagged invalid.

use joint_units::AdcCode;
use std::f64::consts::TAU;
use std::ops::Range;

/// A series of angles in degrees, one a tick.
pub type Series = Vec<Option<f64>>;

/// The series as it is.
#[must_use]
pub fn sound(angles: &[f64]) -> Series {
    angles.iter().copied().map(Some).collect()
}

/// Flagged invalid over these ticks.
#[must_use]
pub fn dropout(angles: &[f64], ticks: Range<usize>) -> Series {
    each(angles, |n, angle| (!ticks.contains(&n)).then_some(angle))
}

/// Stays where it is over these ticks.
#[must_use]
pub fn stuck(angles: &[f64], ticks: Range<usize>) -> Series {
    each(angles, |n, angle| Some(if ticks.contains(&n) { angles[ticks.start] } else { angle }))
}

/// Not a number over these ticks, unflagged.
#[must_use]
pub fn not_a_number(angles: &[f64], ticks: Range<usize>) -> Series {
    each(angles, |n, angle| Some(if ticks.contains(&n) { f64::NAN } else { angle }))
}

/// One sample in so many on average is off by up to `size` degrees either way.
#[must_use]
pub fn spikes(angles: &[f64], one_in: u32, size: f64, seed: u32) -> Series {
    let mut random = Random(seed);
    each(angles, |_, angle| {
        let (hit, by) = (random.unit() * f64::from(one_in) < 1.0, size * (2.0 * random.unit() - 1.0));
        Some(if hit { angle + by } else { angle })
    })
}

/// White noise of this standard deviation.
#[must_use]
pub fn noise(angles: &[f64], deviation: f64, seed: u32) -> Series {
    let mut random = Random(seed);
    each(angles, |_, angle| Some(angle + deviation * random.normal()))
}

/// Drifts by so many degrees a second.
#[must_use]
pub fn drift(angles: &[f64], rate: f64) -> Series {
    each(angles, |n, angle| Some(angle + rate * n as f64 * 1e-3))
}

/// A sensor that was mounted askew, or calibrated for another: offset and gain.
#[must_use]
pub fn miscalibrated(angles: &[f64], offset: f64, gain: f64) -> Series {
    each(angles, |_, angle| Some(offset + gain * angle))
}

/// The supply sags by this part at times, for a tenth of a second every `every` ticks: the volts of an uncorrected sensor, whose zero is
/// at mid scale and -`half_scale` at no volts, sag with it.
#[must_use]
pub fn supply_droop(angles: &[f64], part: f64, every: usize, half_scale: f64) -> Series {
    each(angles, |n, angle| {
        Some(if n % every < 100 { (angle + half_scale) * (1.0 - part) - half_scale } else { angle })
    })
}

/// Mains hum of 50 Hz with this amplitude in degrees.
#[must_use]
pub fn mains_hum(angles: &[f64], amplitude: f64) -> Series {
    each(angles, |n, angle| Some(angle + amplitude * (TAU * 50.0 * n as f64 * 1e-3).sin()))
}

/// Rounded to 12 bits of this range.
#[must_use]
pub fn quantised(angles: &[f64], range: f64) -> Series {
    let step = range / 4096.0;
    each(angles, |_, angle| Some((angle / step).round() * step))
}

/// Cut off beyond these ends.
#[must_use]
pub fn clipped(angles: &[f64], least: f64, most: f64) -> Series {
    each(angles, |_, angle| Some(angle.clamp(least, most)))
}

/// The two outer wires of a potentiometer swapped: mirrored about its middle.
#[must_use]
pub fn swapped_wires(angles: &[f64]) -> Series {
    each(angles, |_, angle| Some(-angle))
}

/// Another sensor's series from this tick on: two plugs exchanged.
#[must_use]
pub fn exchanged(angles: &[f64], other: &[f64], from: usize) -> Series {
    each(angles, |n, angle| Some(if n >= from { other.get(n).copied().unwrap_or(angle) } else { angle }))
}

fn each(angles: &[f64], mut of: impl FnMut(usize, f64) -> Option<f64>) -> Series {
    angles.iter().enumerate().map(|(n, &angle)| of(n, angle)).collect()
}

/// A linear congruential generator: the same on every machine.
#[derive(Debug, Clone)]
pub struct Random(pub u32);

impl Random {
    /// 0 to 1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / 16_777_216.0
    }

    /// Of mean 0 and deviation 1: the sum of twelve.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// What is wrong with the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Degraded {
    /// Nothing.
    Sound,
    /// From this tick on the wire is off: the pull-down reads near 0.
    Open(u32),
    /// From this tick on the wire is at the supply.
    Short(u32),
    /// From this tick on the code stays as it is.
    Stuck(u32),
    /// One sample in so many is a spike of electromagnetic noise.
    Spikes(u32),
    /// The wire is off for the first of so many ticks, of so many in all.
    DropOuts {
        /// Ticks off.
        off: u32,
        /// Ticks from one drop-out to the next.
        every: u32,
    },
}

/// A stream of codes under way.
#[derive(Debug, Clone)]
pub struct Stream {
    what: Degraded,
    tick: u32,
    last: AdcCode,
}

impl Stream {
    /// A stream from its first tick on.
    #[must_use]
    pub const fn new(what: Degraded) -> Self {
        Self { what, tick: 0, last: AdcCode(0) }
    }

    /// The code that comes where this one should.
    pub fn code(&mut self, code: AdcCode) -> AdcCode {
        self.tick += 1;
        let tick = self.tick;
        let off = AdcCode(3);
        let given = match self.what {
            Degraded::Sound => code,
            Degraded::Open(from) if tick >= from => off,
            Degraded::Short(from) if tick >= from => AdcCode(4090),
            Degraded::Stuck(from) if tick > from => self.last,
            Degraded::Spikes(every) if tick.is_multiple_of(every) => AdcCode(code.0.saturating_add(900).min(3900)),
            Degraded::DropOuts { off: ticks, every } if tick % every < ticks => off,
            _ => code,
        };
        self.last = given;
        given
    }
}
