//! The thesis' network of Rayleigh oscillators (equations 13 to 16) as a generator of a board.
//!
//! Record: kind 2; alpha, p, mu, offset of each joint, difference gains, product gains, phases, in the units of the configuration.

use cpg_core::network::graph::{HipKnee, LeftRight};
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::oscillator::rayleigh::RayleighConfig;
use cpg_core::{BuildError, Rk4};
use joint_units::{Joint, Period};

use crate::generator::kind::BoardKind;
use crate::store::flash_record::{WordError, WordReader, WordWriter};

#[cfg(feature = "serde")]
pub use set::{ThesisJoint, ThesisSet, ThesisSet as Set};

/// Configuration.
pub type Config = ThesisConfig;
/// The built network.
pub type Built = Thesis;

impl BoardKind for Config {
    type Built = Built;
    const NAME: &'static str = "thesis";
    const RECORD_KIND: u16 = 2;
    const WORDS: usize = 4 * Joint::COUNT + 8 + Joint::COUNT;

    fn build(&self, period: Period) -> Result<Built, BuildError> {
        Config::build::<LeftRight, HipKnee, Rk4>(self, period)
    }

    fn write(&self, words: &mut WordWriter<'_>) {
        for joint in &self.joints {
            words.floats(&[joint.alpha, joint.p, joint.mu, joint.offset]);
        }
        self.difference.iter().chain(&self.product).for_each(|pair| words.floats(pair));
        words.phases(&self.phases);
    }

    fn read(words: &mut WordReader<'_>) -> Result<Self, WordError> {
        let mut joints = [RayleighConfig { alpha: 0.0, p: 0.0, mu: 0.0, offset: 0.0 }; Joint::COUNT];
        for joint in &mut joints {
            let [alpha, p, mu, offset] = words.floats()?;
            *joint = RayleighConfig { alpha, p, mu, offset };
        }
        Ok(Self {
            joints,
            difference: [words.floats()?, words.floats()?],
            product: [words.floats()?, words.floats()?],
            phases: words.phases()?,
        })
    }
}

#[cfg(feature = "serde")]
mod set {
    use super::{Config, RayleighConfig, ThesisConfig};
    use crate::generator::file::{JOINTS, Key, KindSet, SetError, Unit, check_phases, phase};
    use cpg_core::Scalar;
    use serde::{Deserialize, Serialize};

    /// One joint.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct ThesisJoint {
        /// alpha, the negative damping at rest, 1/s.
        pub alpha_per_s: f32,
        /// p, the inverse square of the velocity at which the damping changes sign, s^2/deg^2.
        pub p_s2_per_deg2: f32,
        /// mu, the natural frequency, rad/s.
        pub mu_rad_per_s: f32,
        /// a0, the angle about which the joint swings, degrees.
        pub offset_deg: f32,
        /// Phase lead of the start, degrees of the cycle, -360 to 360.
        pub start_phase_deg: f32,
    }

    /// The parameters in the units of the generator file.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(from = "Table", into = "Table")]
    pub struct ThesisSet {
        /// [k12, k21] of the hips and [k34, k43] of the knees, 1/s.
        pub difference_per_s: [[f32; 2]; 2],
        /// [k13, k31] of the left leg and [k24, k42] of the right, 1/(deg s).
        pub product_per_deg_s: [[f32; 2]; 2],
        /// The joints.
        pub joints: [ThesisJoint; 4],
    }

    impl ThesisSet {
        /// A configuration, with phases to the whole degree.
        #[must_use]
        pub fn rounded(config: &Config) -> Self {
            let mut joints = [ThesisJoint {
                alpha_per_s: 0.0,
                p_s2_per_deg2: 0.0,
                mu_rad_per_s: 0.0,
                offset_deg: 0.0,
                start_phase_deg: 0.0,
            }; 4];
            for (joint, (from, lead)) in joints.iter_mut().zip(config.joints.iter().zip(&config.phases)) {
                *joint = ThesisJoint {
                    alpha_per_s: from.alpha,
                    p_s2_per_deg2: from.p,
                    mu_rad_per_s: from.mu,
                    offset_deg: from.offset,
                    // A phase is from 0 to 1 cycle.
                    start_phase_deg: (lead.cycles() * 360.0 + 0.5) as u32 as f32,
                };
            }
            Self { difference_per_s: config.difference, product_per_deg_s: config.product, joints }
        }

        /// The configuration in numbers of type `T`.
        #[must_use]
        pub fn config_of<T: Scalar>(&self) -> ThesisConfig<T> {
            let of = T::from_f32;
            ThesisConfig {
                joints: self.joints.map(|joint| RayleighConfig {
                    alpha: of(joint.alpha_per_s),
                    p: of(joint.p_s2_per_deg2),
                    mu: of(joint.mu_rad_per_s),
                    offset: of(joint.offset_deg),
                }),
                difference: self.difference_per_s.map(|pair| pair.map(of)),
                product: self.product_per_deg_s.map(|pair| pair.map(of)),
                phases: self.joints.map(|joint| phase(joint.start_phase_deg)),
            }
        }
    }

    impl KindSet for ThesisSet {
        type Config = Config;
        const KEYS: &'static [Key] = &[
            Key { field: "alpha", key: "*.alpha_per_s", names: &JOINTS, unit: Unit::PerSecond },
            Key { field: "p", key: "*.p_s2_per_deg2", names: &JOINTS, unit: Unit::SquareSecondsPerSquareDegree },
            Key { field: "mu", key: "*.mu_rad_per_s", names: &JOINTS, unit: Unit::RadiansPerSecond },
            Key { field: "offset", key: "*.offset_deg", names: &JOINTS, unit: Unit::PlainDegrees },
            Key { field: "difference", key: "difference_per_s.*", names: &["hips", "knees"], unit: Unit::PerSecond },
            Key {
                field: "product",
                key: "product_per_deg_s.*",
                names: &["left_leg", "right_leg"],
                unit: Unit::PerDegreeSecond,
            },
        ];
        const RUST_IMPORTS: &'static str = "use cpg_core::network::thesis::NetworkConfig;\nuse cpg_core::oscillator::rayleigh::RayleighConfig;\nuse joint_loop::GeneratorConfig;\nuse joint_units::Phase;\n";

        fn config(&self) -> Config {
            self.config_of()
        }

        fn stride_guess_s(&self) -> f64 {
            let [first, ..] = &self.joints;
            core::f64::consts::TAU / f64::from(first.mu_rad_per_s)
        }

        fn check_form(&self) -> Result<(), SetError> {
            check_phases("*.start_phase_deg", self.joints.map(|joint| joint.start_phase_deg))
        }
    }

    /// The layout of the table.
    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Table {
        difference_per_s: Difference,
        product_per_deg_s: Product,
        left_hip: ThesisJoint,
        right_hip: ThesisJoint,
        left_knee: ThesisJoint,
        right_knee: ThesisJoint,
    }

    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Difference {
        hips: [f32; 2],
        knees: [f32; 2],
    }

    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Product {
        left_leg: [f32; 2],
        right_leg: [f32; 2],
    }

    impl From<Table> for ThesisSet {
        fn from(table: Table) -> Self {
            Self {
                difference_per_s: [table.difference_per_s.hips, table.difference_per_s.knees],
                product_per_deg_s: [table.product_per_deg_s.left_leg, table.product_per_deg_s.right_leg],
                joints: [table.left_hip, table.right_hip, table.left_knee, table.right_knee],
            }
        }
    }

    impl From<ThesisSet> for Table {
        fn from(set: ThesisSet) -> Self {
            let ([hips, knees], [left_leg, right_leg]) = (set.difference_per_s, set.product_per_deg_s);
            let [left_hip, right_hip, left_knee, right_knee] = set.joints;
            Self {
                difference_per_s: Difference { hips, knees },
                product_per_deg_s: Product { left_leg, right_leg },
                left_hip,
                right_hip,
                left_knee,
                right_knee,
            }
        }
    }
}
