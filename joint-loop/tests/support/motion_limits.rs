//! The limits of a robot, checked on the setpoints of successive ticks in radians: independent of the gate, which computes in steps.

use joint_loop::GateConfig;
use joint_units::{Joint, Period, Radians};

/// Setpoints have single precision: below 4 rad each is off by at most half of 2^-22 rad, and a difference of differences has four of them.
const ROUNDING_RAD: f64 = 1e-6;

/// The setpoints so far.
#[derive(Debug, Clone)]
pub struct MotionLimits {
    gate: GateConfig,
    /// Seconds of a tick.
    tick_s: f64,
    /// The last setpoints, and the motion of the tick that led to them; `None` where it is not known.
    last: Option<([f64; Joint::COUNT], Option<[f64; Joint::COUNT]>)>,
}

impl MotionLimits {
    /// Limits of a robot, before the first tick.
    #[must_use]
    pub fn new(gate: GateConfig, period: Period) -> Self {
        Self { gate, tick_s: f64::from(period.seconds()), last: None }
    }

    /// The next tick is not bound to the last: the outputs were off.
    pub const fn interrupt(&mut self) {
        self.last = None;
    }

    /// Checks the setpoints of a tick.
    ///
    /// # Panics
    /// A limit does not hold.
    pub fn check(&mut self, setpoints: &[Radians; Joint::COUNT]) {
        let now = setpoints.map(|angle| f64::from(angle.0));
        for (angle, range) in setpoints.iter().zip(&self.gate.range) {
            assert!(*angle >= range.least && *angle <= range.most, "{angle:?} is not in {range:?}");
        }
        for limit in self.gate.pose.iter().flatten() {
            let excess = f64::from(limit.of(setpoints).0) - f64::from(limit.most.0);
            assert!(excess <= ROUNDING_RAD, "{limit:?} is exceeded by {excess} rad: {setpoints:?}");
        }
        let step = self.last.map(|(before, _)| std::array::from_fn(|joint| now[joint] - before[joint]));
        if let Some(step) = &step {
            self.check_step(step);
        }
        self.last = Some((now, step));
    }

    fn check_step(&self, step: &[f64; Joint::COUNT]) {
        for (joint, moved) in step.iter().enumerate() {
            let most = f64::from(self.gate.rate[joint].0) * self.tick_s;
            assert!(moved.abs() <= most + ROUNDING_RAD, "joint {joint} moves by {moved} rad in a tick, at most {most}");
            let Some((_, Some(before))) = self.last else { continue };
            let (change, most) =
                (moved - before[joint], f64::from(self.gate.acceleration[joint].0) * self.tick_s * self.tick_s);
            assert!(
                change.abs() <= most + ROUNDING_RAD,
                "joint {joint}: its step changes by {change} rad, at most {most}"
            );
        }
    }
}
