//! Takes up a slow drift of the measured joint's mean, so that the joint's angle moves with it.
//!
//! ```text
//! v = clamp(k (clamp(o - o_0, -limit, limit) - d), -R, R),   d'' = (v - d') / T,   k = 0.2 1/s, R = 0.1 degrees/s, T = 1 s
//! ```
//! o is the offset of the sensor that the phase lock learns, o_0 that offset when the lock has lasted for 8 s less the d of then, d the part
//! that is taken up. So an offset that is there at the lock (a sensor that was mounted askew) is not taken up, and within a stride of 1.1 s
//! the angle moves by 0.11 degrees at most. If o - o_0 is 2 degrees or more from d, the offset did not drift but jumped: v is 0 until they
//! are close again. Without a lock v is 0, and o_0 is set again in the next lock.
//!
//! The rate is at most 0.27 (limit - |d|), so d stays within the limit: the line d' = s (limit - d) with the slower pole s = 0.276 of the
//! linear law is not crossed.

/// Time of a lock after which the offset is the reference, s.
const SETTLE_S: f32 = 8.0;
/// Gain k, 1/s.
const GAIN: f32 = 0.2;
/// Largest rate R, rad/s: 0.1 degrees per second.
pub(super) const FASTEST: f32 = 0.1 / 57.295_78;
/// Time constant T of the rate, s.
pub(super) const RATE_S: f32 = 1.0;
/// Distance from which on an offset jumped, rad: 2 degrees.
const JUMP: f32 = 2.0 / 57.295_78;

/// The part of the offset that is taken up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Drift {
    /// d, rad.
    pub(super) value: f32,
    /// Its rate, rad/s.
    pub(super) rate: f32,
    /// o_0, rad; `None` until the lock has lasted.
    reference: Option<f32>,
    /// Time of the lock, s.
    locked: f32,
}

impl Drift {
    pub(super) const fn new() -> Self {
        Self { value: 0.0, rate: 0.0, reference: None, locked: 0.0 }
    }

    /// Takes the learned offset of one tick, rad, or `None` without a lock.
    pub(super) fn step(&mut self, offset: Option<f32>, limit: f32, period_s: f32) {
        let wanted = match (offset, self.reference) {
            (Some(offset), Some(reference)) => {
                let drifted = offset - reference;
                let left = drifted.max(-limit).min(limit) - self.value;
                let jumped = (drifted - self.value).abs() >= JUMP;
                if jumped { 0.0 } else { (GAIN * left).clamp(-FASTEST, FASTEST) }
            }
            (Some(offset), None) => {
                self.locked += period_s;
                self.reference = (self.locked >= SETTLE_S).then_some(offset - self.value);
                0.0
            }
            (None, _) => {
                self.reference = None;
                self.locked = 0.0;
                0.0
            }
        };
        self.rate += (wanted - self.rate) * (period_s / RATE_S);
        self.value += self.rate * period_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: f32 = 0.07;

    /// Runs a lock with an offset over the time; checks the bounds in each tick. Returns d in degrees at the end.
    fn taken_up(secs: u32, offset: impl Fn(f32) -> f32) -> f32 {
        let mut drift = Drift::new();
        for tick in 0..secs * 1000 {
            let before = drift;
            drift.step(Some(offset(tick as f32 * 1e-3).to_radians()), LIMIT, 1e-3);
            assert!(drift.value.abs() <= LIMIT * 1.0001, "tick {tick}: {drift:?}");
            assert!(drift.rate.abs() <= FASTEST * 1.0001, "tick {tick}: {drift:?}");
            assert!((drift.rate - before.rate).abs() <= 2.0 * FASTEST * 1e-3 / RATE_S * 1.001, "tick {tick}");
        }
        drift.value.to_degrees()
    }

    #[test]
    fn a_slow_drift_is_taken_up_and_nothing_else() {
        let slow = taken_up(50, |t| 0.06 * t);
        assert!((2.0..2.5).contains(&slow), "{slow}: 2.5 degrees since the reference, a lag of 0.3");
        assert_eq!(taken_up(60, |_| 8.0), 0.0, "an offset from the begin on");
        assert_eq!(taken_up(60, |t| if t < 20.0 { 0.0 } else { 3.0 }), 0.0, "an offset that jumps");
        let small = taken_up(60, |t| if t < 20.0 { 0.0 } else { 1.0 });
        assert!((small - 1.0).abs() < 0.01, "{small}");
        let limit = taken_up(300, |t| -0.06 * t);
        assert!((limit + LIMIT.to_degrees()).abs() < 0.05, "{limit}");
    }

    /// Offsets that wander, jump and vanish: d stays within the limit, and a lock that ends stops it within seconds.
    #[test]
    fn it_stays_within_the_limit_whatever_comes() {
        taken_up(400, |t| 5.0 * (0.05 * t).sin() + if (t as u32 / 17).is_multiple_of(3) { 1.5 } else { 0.0 });
        let mut drift = Drift { value: 0.0, rate: FASTEST, reference: Some(0.0), locked: SETTLE_S };
        for _ in 0..10_000 {
            drift.step(None, LIMIT, 1e-3);
        }
        assert!(drift.rate < 1e-6 && drift.reference.is_none());
    }
}
