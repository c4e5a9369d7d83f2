//! Bipeds of more than four joints on R1: with ankles, and with ankles and arms. Each is a graph and a configuration, no more.
//!
//! Phases and amplitudes are those of level walking, rounded: the ankle's push-off comes shortly before its leg's knee swings, an arm
//! swings with the leg of the other side.

use joint_units::{Period, Phase, Radians};

use crate::BuildError;
use crate::gait::default_walk::default_config;
use crate::network::graph::Graph;
use crate::network::phase_coupled::{Robust, RobustConfig};

/// Left hip, right hip, left knee, right knee, left ankle, right ankle: left to right, and down each leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WithAnkles;

impl Graph<6, 7> for WithAnkles {
    const EDGES: [(usize, usize); 7] = [(0, 1), (2, 3), (4, 5), (0, 2), (1, 3), (2, 4), (3, 5)];
}

/// The joints of [`WithAnkles`], then left shoulder, right shoulder: each arm linked to the hip of the other side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WithArms;

impl Graph<8, 10> for WithArms {
    const EDGES: [(usize, usize); 10] =
        [(0, 1), (2, 3), (4, 5), (0, 2), (1, 3), (2, 4), (3, 5), (6, 7), (6, 1), (7, 0)];
}

/// Phase lead, amplitude and offset of a joint, in degrees.
type Part = (u16, f32, f32);

const LEFT_HIP: Part = (0, 20.0, 5.0);
const LEFT_KNEE: Part = (80, 30.0, 30.0);
const LEFT_ANKLE: Part = (140, 12.0, 0.0);
const LEFT_ARM: Part = (180, 15.0, 0.0);

const fn right(left: Part) -> Part {
    ((left.0 + 180) % 360, left.1, left.2)
}

/// Hips, knees and ankles at a stride of 1.1 s.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 17.2 ms.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::six_and_eight_joints::with_ankles;
/// let mut walk = with_ankles(joint_units::Period::MILLISECOND)?;
/// for _ in 0..1100 {
///     walk.step();
/// }
/// assert_eq!(walk.angles().len(), 6);
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
pub fn with_ankles(period: Period) -> Result<Robust<WithAnkles, 6, 7>, BuildError> {
    ankles_config().build(period)
}

/// The configuration of [`with_ankles`].
#[must_use]
pub fn ankles_config() -> RobustConfig<6, 7> {
    config([LEFT_HIP, right(LEFT_HIP), LEFT_KNEE, right(LEFT_KNEE), LEFT_ANKLE, right(LEFT_ANKLE)])
}

/// Hips, knees, ankles and arms at a stride of 1.1 s.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 17.2 ms.
pub fn with_arms(period: Period) -> Result<Robust<WithArms, 8, 10>, BuildError> {
    arms_config().build(period)
}

/// The configuration of [`with_arms`].
#[must_use]
pub fn arms_config() -> RobustConfig<8, 10> {
    let legs = [LEFT_HIP, right(LEFT_HIP), LEFT_KNEE, right(LEFT_KNEE), LEFT_ANKLE, right(LEFT_ANKLE)];
    let [a, b, c, d, e, f] = legs;
    config([a, b, c, d, e, f, LEFT_ARM, right(LEFT_ARM)])
}

fn config<const N: usize, const E: usize>(parts: [Part; N]) -> RobustConfig<N, E> {
    RobustConfig {
        natural_period: default_config().natural_period,
        nonlinearity: 0.5,
        coupling: [0.5; E],
        phases: parts.map(|(phase, ..)| Phase::from_cycles(f32::from(phase) / 360.0)),
        amplitudes: parts.map(|(_, amplitude, _)| Radians::from_degrees(amplitude)),
        offsets: parts.map(|(.., offset)| Radians::from_degrees(offset)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Generator;

    /// From a start far off the gait: the stride, every joint's range and its phase against the gait's.
    fn walks<const N: usize>(mut walk: impl Generator<N>, parts: [Part; N]) {
        let mut wraps = vec![];
        let (mut low, mut high, mut peak_at) = ([f32::MAX; N], [f32::MIN; N], [0.0f32; N]);
        for tick in 0..20_000u32 {
            let before = walk.phase();
            walk.step();
            if walk.phase().0 < before.0 {
                wraps.push(tick);
            }
            if tick < 10_000 {
                continue;
            }
            for (joint, angle) in walk.angles().into_iter().enumerate() {
                low[joint] = low[joint].min(angle.0);
                if angle.0 > high[joint] {
                    high[joint] = angle.0;
                    peak_at[joint] = walk.phase().cycles();
                }
            }
        }
        let strides = wraps.len() - 1;
        let stride = f64::from(wraps[strides] - wraps[0]) / strides as f64;
        assert!((stride - 1100.0).abs() < 2.0, "stride of {stride} ms");
        for (joint, (phase, amplitude, offset)) in parts.into_iter().enumerate() {
            let (least, most) = (low[joint].to_degrees(), high[joint].to_degrees());
            assert!((0.5 * (most - least) - amplitude).abs() < 0.06 * amplitude, "joint {joint}: {least} to {most}");
            assert!((0.5 * (most + least) - offset).abs() < 0.5);
            // Most flexed when the gait phase is minus the lead.
            let off = (peak_at[joint] + f32::from(phase) / 360.0 + 0.5).rem_euclid(1.0) - 0.5;
            // The third harmonic moves the peak a little.
            assert!(off.abs() < 0.015, "joint {joint} peaks at {}", peak_at[joint]);
        }
        assert_eq!(walk.check(), Ok(()));
    }

    #[test]
    fn six_and_eight_joints_walk_in_phase() {
        let legs = [LEFT_HIP, right(LEFT_HIP), LEFT_KNEE, right(LEFT_KNEE), LEFT_ANKLE, right(LEFT_ANKLE)];
        let [a, b, c, d, e, f] = legs;
        let mut six = with_ankles(Period::MILLISECOND).unwrap();
        let mut far = six.state();
        far.displacement = [0.3, 0.2, -0.4, 0.1, 0.5, -0.2];
        six.set_state(&far).unwrap();
        walks(six, legs);
        let mut eight = with_arms(Period::MILLISECOND).unwrap();
        let mut far = eight.state();
        far.displacement = [0.3, 0.2, -0.4, 0.1, 0.5, -0.2, 0.4, 0.4];
        eight.set_state(&far).unwrap();
        walks(eight, [a, b, c, d, e, f, LEFT_ARM, right(LEFT_ARM)]);
    }
}
