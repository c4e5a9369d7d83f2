//! Bounded authority: the phase and the amplitude that drive the joints follow those that are wanted, with bounded acceleration.
//!
//! ```text
//! v = w + clamp(k d, ±sqrt(A |d|)),   psi'' = clamp(4 k (v - psi'), ±A),   0 <= psi' <= w_max
//! ```
//! d the way that is left, w the rate of what is followed. Far off, no faster than can be braked with half of A; near, critically
//! damped with both poles at 2k. Whatever jumps (a re-lock, an event, the start of a hold) reaches the joints as a motion whose angle and
//! rate are continuous. The phase never runs backwards.

use core::f32::consts::TAU;

use joint_units::Phase;

/// Way in radians from one phase to another, the short way round.
#[must_use]
pub(crate) fn way(from: Phase, to: Phase) -> f32 {
    to.0.wrapping_sub(from.0) as i32 as f32 * (TAU / 4_294_967_296.0)
}

/// The law of the module: the rate to take next.
fn next_rate(rate: f32, left: f32, lead: f32, stiffness: f32, acceleration: f32, period_s: f32) -> f32 {
    let speed = (stiffness * left.abs()).min(libm::sqrtf(acceleration * left.abs()));
    let wanted = lead + if left > 0.0 { speed } else { -speed };
    let pull = (4.0 * stiffness * (wanted - rate)).max(-acceleration).min(acceleration);
    rate + pull * period_s
}

/// A phase that follows another.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Follower {
    /// Where it is.
    pub(crate) phase: Phase,
    /// Its rate, rad/s.
    pub(crate) rate: f32,
}

impl Follower {
    /// One period after a phase that moves at `lead` rad/s.
    pub(crate) fn follow(
        &mut self,
        phase: Phase,
        lead: f32,
        fastest: f32,
        acceleration: f32,
        stiffness: f32,
        period_s: f32,
    ) {
        // The phase given is that at the end of the period.
        let left = way(self.phase, phase) - self.rate * period_s;
        self.to(next_rate(self.rate, left, lead, stiffness, acceleration, period_s), fastest, acceleration, period_s);
    }

    /// One period on the way to a halt.
    pub(crate) fn halt(&mut self, acceleration: f32, stiffness: f32, period_s: f32) {
        self.to(next_rate(self.rate, 0.0, 0.0, stiffness, acceleration, period_s), f32::MAX, acceleration, period_s);
    }

    fn to(&mut self, rate: f32, fastest: f32, acceleration: f32, period_s: f32) {
        // The bounds of the rate are kept by braking, not by a step, should they ever be met from outside.
        let brake = acceleration * period_s;
        let rate = rate.max(0.0).min(fastest.max(self.rate - brake));
        let by = 0.5 * (self.rate + rate) * period_s;
        self.phase = Phase(self.phase.0.wrapping_add(Phase::from_cycles(by * (1.0 / TAU)).0));
        self.rate = rate;
    }
}

/// A number that glides to another.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Glide {
    /// Where it is.
    pub(crate) value: f32,
    /// Its rate, 1/s.
    pub(crate) rate: f32,
}

impl Glide {
    /// One period on the way; it arrives exactly.
    pub(crate) fn approach(&mut self, target: f32, acceleration: f32, stiffness: f32, period_s: f32) {
        let left = target - self.value;
        if left.abs() < 1e-6 && self.rate.abs() < 1e-4 {
            *self = Self { value: target, rate: 0.0 };
            return;
        }
        let rate = next_rate(self.rate, left, 0.0, stiffness, acceleration, period_s);
        self.value += 0.5 * (self.rate + rate) * period_s;
        self.rate = rate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f32 = 1e-3;

    /// From any phase it arrives without overshoot in the rate's sign, and stays; rates are bounded, accelerations too.
    #[test]
    fn a_phase_is_caught_up_with_within_bounds() {
        for start in 0..64u32 {
            let mut follower = Follower { phase: Phase(start << 26), rate: 5.7 };
            let mut leader = Phase(0);
            let lead = 5.7;
            for tick in 0..4000 {
                leader = Phase(leader.0.wrapping_add(Phase::from_cycles(lead * T / TAU).0));
                let before = follower.rate;
                follower.follow(leader, lead, 14.0, 50.0, 12.0, T);
                assert!((0.0..=14.0).contains(&follower.rate), "start {start}, tick {tick}");
                assert!((follower.rate - before).abs() <= 50.0 * T * 1.001, "start {start}, tick {tick}");
                let off = way(follower.phase, leader).abs();
                assert!(tick < 3000 || off < 1e-3, "start {start}, tick {tick}: {off} rad");
            }
        }
    }

    #[test]
    fn a_halt_ends_at_rest_and_a_glide_at_its_target() {
        let mut follower = Follower { phase: Phase(0), rate: 14.0 };
        let mut glide = Glide::default();
        for tick in 0..1000 {
            follower.halt(50.0, 12.0, T);
            let before = glide;
            glide.approach(1.0, 100.0, 16.0, T);
            assert!((glide.rate - before.rate).abs() <= 0.1001 && (0.0..1.002).contains(&glide.value), "tick {tick}");
            assert!(tick < 400 || glide.value > 0.98);
        }
        assert!(follower.rate < 1e-3 && glide == Glide { value: 1.0, rate: 0.0 });
    }
}
