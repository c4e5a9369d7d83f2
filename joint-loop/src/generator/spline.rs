//! One phase and a periodic cubic spline for each joint, as a generator of a board.
//!
//! Record: kind 5; stride, then the knots of each joint, in the units of the configuration.

use cpg_core::BuildError;
use cpg_core::waveform::shape::{PhaseShape, PhaseShapeConfig, SplineShape};
use joint_units::{Joint, Period, Radians};

use crate::generator::kind::BoardKind;
use crate::generator::shape::of_joint;
use crate::store::flash_record::{WordError, WordReader, WordWriter};

#[cfg(feature = "serde")]
pub use set::{SplineJoint, SplineSet, SplineSet as Set};

/// Knots of a joint's spline, equally spaced over the cycle: knot k at phase k/12.
pub const SPLINE_KNOTS: usize = 12;

/// Field of each joint in a [`BuildError`].
const FIELDS: [&str; Joint::COUNT] = ["left_hip.knots", "right_hip.knots", "left_knee.knots", "right_knee.knots"];

/// One phase, and the knots of each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplineConfig {
    /// Stride time, within [`cpg_core::waveform::shape::STRIDE_RANGE_S`] seconds.
    pub stride_s: f32,
    /// Angles at the knots of each joint, in the order of [`Joint::ALL`], within ±[`cpg_core::waveform::shape::MAX_COEFFICIENT`] rad.
    pub knots: [[Radians; SPLINE_KNOTS]; Joint::COUNT],
}

/// Configuration.
pub type Config = SplineConfig;
/// The built generator.
pub type Built = PhaseShape<SplineShape<SPLINE_KNOTS>, { Joint::COUNT }>;

impl BoardKind for SplineConfig {
    type Built = Built;
    const NAME: &'static str = "spline";
    const RECORD_KIND: u16 = 5;
    const WORDS: usize = 1 + Joint::COUNT * SPLINE_KNOTS;

    fn build(&self, period: Period) -> Result<Built, BuildError> {
        let shape = |joint: Joint| {
            let place = joint as usize & 3;
            SplineShape::new(self.knots[place]).map_err(|error| of_joint(error, |_| FIELDS[place]))
        };
        let shapes =
            [shape(Joint::LeftHip)?, shape(Joint::RightHip)?, shape(Joint::LeftKnee)?, shape(Joint::RightKnee)?];
        PhaseShapeConfig { shapes, stride_s: self.stride_s }.build(period)
    }

    fn write(&self, words: &mut WordWriter<'_>) {
        words.floats(&[self.stride_s]);
        self.knots.iter().for_each(|knots| words.floats(&knots.map(|knot| knot.0)));
    }

    fn read(words: &mut WordReader<'_>) -> Result<Self, WordError> {
        let stride_s = words.float()?;
        let mut knots = [[Radians(0.0); SPLINE_KNOTS]; Joint::COUNT];
        for joint in &mut knots {
            *joint = words.floats()?.map(Radians);
        }
        Ok(Self { stride_s, knots })
    }
}

#[cfg(feature = "serde")]
mod set {
    use super::{Radians, SPLINE_KNOTS, SplineConfig};
    use crate::generator::file::{Key, KindSet, Unit};
    use serde::{Deserialize, Serialize};

    /// One joint.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct SplineJoint {
        /// Angles at the knots, degrees.
        pub knots_deg: [f32; SPLINE_KNOTS],
    }

    /// The parameters in the units of the generator file; the table has the same layout.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct SplineSet {
        /// Stride, seconds.
        pub stride_s: f32,
        /// Left hip.
        pub left_hip: SplineJoint,
        /// Right hip.
        pub right_hip: SplineJoint,
        /// Left knee.
        pub left_knee: SplineJoint,
        /// Right knee.
        pub right_knee: SplineJoint,
    }

    impl KindSet for SplineSet {
        type Config = SplineConfig;
        const KEYS: &'static [Key] = &[
            Key { field: "stride_s", key: "stride_s", names: &[], unit: Unit::Seconds },
            Key { field: "*.knots", key: "*.knots_deg", names: &[], unit: Unit::Degrees },
        ];
        const RUST_IMPORTS: &'static str = "use joint_loop::GeneratorConfig;\nuse joint_loop::generator::spline::SplineConfig;\nuse joint_units::Radians;\n";

        fn config(&self) -> SplineConfig {
            let joints = [self.left_hip, self.right_hip, self.left_knee, self.right_knee];
            SplineConfig {
                stride_s: self.stride_s,
                knots: joints.map(|joint| joint.knots_deg.map(Radians::from_degrees)),
            }
        }

        fn stride_guess_s(&self) -> f64 {
            f64::from(self.stride_s)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GeneratorConfig;
    use crate::store::generator_record::{GeneratorRecordError, read, record_of};
    use crate::store::record_name::RecordName;
    use cpg_core::Generator;

    fn config() -> SplineConfig {
        let knot =
            |joint: f32, k: usize| Radians(0.1 * joint + 0.3 * (core::f32::consts::FRAC_PI_6 * k as f32 + joint).cos());
        let knots = [0.0, 3.1, 1.5, 4.6].map(|joint| core::array::from_fn(|k| knot(joint, k)));
        SplineConfig { stride_s: 1.123_456_7, knots }
    }

    #[test]
    fn a_spline_comes_back_from_its_record() {
        let generator = GeneratorConfig::Spline(config());
        let record = record_of(&generator, &RecordName::BUILT_IN);
        assert_eq!(read(record.bytes()).unwrap().unwrap().config, generator);
    }

    #[test]
    fn a_spline_passes_through_its_knots() {
        let mut generator =
            GeneratorConfig::Spline(SplineConfig { stride_s: 1.2, ..config() }).build(Period::MILLISECOND).unwrap();
        for knot in 0..24 {
            for (joint, angle) in generator.angles().into_iter().enumerate() {
                assert!((angle.0 - config().knots[joint][knot % 12].0).abs() < 1e-3, "knot {knot} of joint {joint}");
            }
            (0..100).for_each(|_| generator.step());
        }
    }

    #[test]
    fn a_knot_out_of_range_is_named_with_its_joint() {
        let mut broken = config();
        broken.knots[2][7] = Radians(7.0);
        let error = read(record_of(&GeneratorConfig::Spline(broken), &RecordName::BUILT_IN).bytes()).unwrap_err();
        assert!(matches!(error, GeneratorRecordError::Parameter(_)));
        assert!(error.to_string().starts_with("left_knee.knots[7] = 7"), "{error}");
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_spline_comes_back_from_its_table() {
        let joint = |first: f32| SplineJoint { knots_deg: core::array::from_fn(|k| first + 0.1 * k as f32) };
        let [left_hip, right_hip, left_knee, right_knee] = [1.0, -2.5, 30.0, 1e-7].map(joint);
        let set = SplineSet { stride_s: 1.123_456_7, left_hip, right_hip, left_knee, right_knee };
        let text = toml::to_string(&set).unwrap();
        assert_eq!(toml::from_str::<SplineSet>(&text), Ok(set));
        let broken = SplineSet { left_hip: SplineJoint { knots_deg: [f32::NAN; SPLINE_KNOTS] }, ..set };
        let error = crate::generator::GeneratorSet::Spline(broken).check().unwrap_err();
        assert_eq!(error.to_string(), "left_hip.knots_deg[0]: allowed is a finite number");
    }
}
