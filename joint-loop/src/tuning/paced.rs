//! A generator at another speed: steps of its own period, and the angles between them by a straight line.
//!
//! A generator is built for one period. At speed s its time advances by s periods in a tick; between two of its steps the angle is
//! interpolated, which is wrong by at most w'' h^2 / 8 (w'' the acceleration, h the period): 0.005 degrees at 400 rad/s^2 and 1 ms.

use cpg_core::Generator;
use joint_units::{Joint, Radians};

/// Where between its last two steps a generator is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Paced {
    /// 1 is at the last step, above 0.
    fraction: f32,
    /// Angles at the step before it; not read while `fraction` is 1.
    before: [Radians; Joint::COUNT],
}

impl Paced {
    /// At the present step of a generator.
    pub(crate) const START: Self = Self { fraction: 1.0, before: [Radians(0.0); Joint::COUNT] };

    /// Advances by a tick at a speed: at most two steps at speeds up to 2. Whether every state is finite and inside its bound afterwards.
    pub(crate) fn step(&mut self, generator: &mut impl Generator<{ Joint::COUNT }>, speed: f32) -> bool {
        self.fraction += speed;
        for _ in 0..2 {
            if self.fraction > 1.0 {
                self.fraction -= 1.0;
                // Only the angles before the last step of a tick are read. Above 1 another step follows.
                if self.fraction < 1.0 {
                    self.before = generator.angles();
                }
                generator.step();
            }
        }
        generator.check().is_ok()
    }

    /// The angles; at speed 1 the generator's own, bit for bit.
    pub(crate) fn angles(&self, generator: &impl Generator<{ Joint::COUNT }>) -> [Radians; Joint::COUNT] {
        let mut angles = generator.angles();
        if self.fraction != 1.0 {
            for (angle, before) in angles.iter_mut().zip(self.before) {
                angle.0 = before.0 + (angle.0 - before.0) * self.fraction;
            }
        }
        angles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::gait::default_walk::default_walk;
    use joint_units::Period;

    /// The angles before a step are not read at speed 1: leaving them out changes no bit when the speed changes after it.
    #[test]
    fn the_angles_are_those_with_every_step_kept() {
        let mut generator = default_walk(Period::MILLISECOND).expect("in range");
        let mut paced = Paced::START;
        let (mut plain, mut fraction) = (generator, 1.0_f32);
        let mut before = plain.angles();
        for tick in 0..20_000_u32 {
            let speed = [1.0, 0.5, 1.0, 1.25, 2.0, 0.75, 1.0, 1.5][(tick / 37 % 8) as usize];
            paced.step(&mut generator, speed);
            fraction += speed;
            for _ in 0..2 {
                if fraction > 1.0 {
                    before = plain.angles();
                    plain.step();
                    fraction -= 1.0;
                }
            }
            let mut angles = plain.angles();
            if fraction != 1.0 {
                for (angle, before) in angles.iter_mut().zip(before) {
                    angle.0 = before.0 + (angle.0 - before.0) * fraction;
                }
            }
            let bits = |angles: [Radians; Joint::COUNT]| angles.map(|angle| angle.0.to_bits());
            assert_eq!(bits(paced.angles(&generator)), bits(angles), "tick {tick}");
        }
    }
}
