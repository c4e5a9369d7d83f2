//! The phase and the amplitude that drive the joints: each follows its target with bounded acceleration.
//!
//! The law is that of `math/braking.rs`: `rate' = clamp(4 k (v - rate), -A, A)`, where v is the rate of the target plus a rate towards it
//! that can still be braked. A target may jump (a new lock, an event, the start of a hold); phase, amplitude and their rates are continuous
//! all the same, and so are the joints' angles and rates. The phase never decreases, and its rate has an upper limit.

use core::f32::consts::TAU;

use joint_units::Phase;
use joint_units::order::{greater, lesser};

use crate::math::braking::Braking;

/// A phase that follows a target phase with bounded acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BoundedPhase {
    /// The phase now.
    pub(crate) phase: Phase,
    /// Its rate, rad/s; 0 or above.
    pub(crate) rate: f32,
}

impl BoundedPhase {
    /// Advances by one control period towards `phase`, the target at the end of the period, which moves at `target_rate` rad/s. The rate stays
    /// at most `fastest` rad/s.
    pub(crate) fn follow(&mut self, phase: Phase, target_rate: f32, fastest: f32, law: &Braking) {
        let left = phase.radians_after(self.phase).0 - self.rate * law.period_s;
        self.advance(law.next_rate(self.rate, left, target_rate), fastest, law);
    }

    /// Advances by one control period while braking to rate 0.
    pub(crate) fn halt(&mut self, law: &Braking) {
        self.advance(law.next_rate(self.rate, 0.0, 0.0), f32::MAX, law);
    }

    fn advance(&mut self, rate: f32, fastest: f32, law: &Braking) {
        // A rate above the bound is braked to it, because a clamp would make the rate jump.
        let brake = law.acceleration * law.period_s;
        let rate = lesser(greater(rate, 0.0), greater(self.rate - brake, fastest));
        let by = 0.5 * (self.rate + rate) * law.period_s;
        self.phase += Phase::from_cycles(by * (1.0 / TAU));
        self.rate = rate;
    }
}

/// A number that moves to a constant target with bounded acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BoundedNumber {
    /// The number now.
    pub(crate) value: f32,
    /// Its rate, 1/s.
    pub(crate) rate: f32,
}

impl BoundedNumber {
    /// Advances by one control period towards the target, which is reached exactly.
    pub(crate) fn approach(&mut self, target: f32, law: &Braking) {
        let left = target - self.value;
        if left.abs() < 1e-6 && self.rate.abs() < 1e-4 {
            *self = Self { value: target, rate: 0.0 };
            return;
        }
        let rate = law.next_rate(self.rate, left, 0.0);
        self.value += 0.5 * (self.rate + rate) * law.period_s;
        self.rate = rate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: Braking = Braking { stiffness: 12.0, acceleration: 50.0, period_s: 1e-3 };

    /// From any phase it arrives without overshoot in the rate's sign, and stays; rates are bounded, accelerations too.
    #[test]
    fn a_phase_is_caught_up_with_within_bounds() {
        for start in 0..64u32 {
            let mut follower = BoundedPhase { phase: Phase(start << 26), rate: 5.7 };
            let mut leader = Phase(0);
            let lead = 5.7;
            for tick in 0..4000 {
                leader += Phase::from_cycles(lead * LAW.period_s / TAU);
                let before = follower.rate;
                follower.follow(leader, lead, 14.0, &LAW);
                assert!((0.0..=14.0).contains(&follower.rate), "start {start}, tick {tick}");
                assert!((follower.rate - before).abs() <= 50.0 * LAW.period_s * 1.001, "start {start}, tick {tick}");
                let off = leader.radians_after(follower.phase).0.abs();
                assert!(tick < 3000 || off < 1e-3, "start {start}, tick {tick}: {off} rad");
            }
        }
    }

    #[test]
    fn a_halt_ends_at_rest_and_a_number_at_its_target() {
        let mut phase = BoundedPhase { phase: Phase(0), rate: 14.0 };
        let mut number = BoundedNumber::default();
        for tick in 0..1000 {
            phase.halt(&LAW);
            let before = number;
            number.approach(1.0, &Braking { stiffness: 16.0, acceleration: 100.0, ..LAW });
            assert!((number.rate - before.rate).abs() <= 0.1001 && (0.0..1.002).contains(&number.value), "tick {tick}");
            assert!(tick < 400 || number.value > 0.98);
        }
        assert!(phase.rate < 1e-3 && number == BoundedNumber { value: 1.0, rate: 0.0 });
    }
}
