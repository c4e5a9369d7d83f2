//! R1, a network of phase-coupled oscillators, as a generator of a board.
//!
//! Record: kind 1; natural period, nonlinearity, couplings, phases, amplitudes, offsets, in the units of the configuration.

use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::{BuildError, Rk4};
use joint_units::{Joint, Period, Radians};

use crate::generator::kind::BoardKind;
use crate::store::flash_record::{WordError, WordReader, WordWriter};

#[cfg(feature = "serde")]
pub use set::{PhaseCoupledJoint, PhaseCoupledSet, PhaseCoupledSet as Set};

/// Configuration: four joints and the links hip-hip, knee-knee, left leg, right leg.
pub type Config = RobustConfig<{ Joint::COUNT }, 4>;
/// The built network.
pub type Built = Robust<Biped, { Joint::COUNT }, 4>;

impl BoardKind for Config {
    type Built = Built;
    const NAME: &'static str = "phase-coupled";
    const RECORD_KIND: u16 = 1;
    const WORDS: usize = 2 + 4 + 3 * Joint::COUNT;

    fn build(&self, period: Period) -> Result<Built, BuildError> {
        Config::build::<Biped, Rk4>(self, period)
    }

    fn write(&self, words: &mut WordWriter<'_>) {
        words.floats(&[self.natural_period, self.nonlinearity]);
        words.floats(&self.coupling);
        words.phases(&self.phases);
        words.floats(&self.amplitudes.map(|angle| angle.0));
        words.floats(&self.offsets.map(|angle| angle.0));
    }

    fn read(words: &mut WordReader<'_>) -> Result<Self, WordError> {
        Ok(Self {
            natural_period: words.float()?,
            nonlinearity: words.float()?,
            coupling: words.floats()?,
            phases: words.phases()?,
            amplitudes: words.floats()?.map(Radians),
            offsets: words.floats()?.map(Radians),
        })
    }
}

#[cfg(feature = "serde")]
mod set {
    use super::{Config, Radians};
    use crate::generator::file::{JOINTS, Key, KindSet, SetError, Unit, check_phases, phase};
    use serde::{Deserialize, Serialize};

    /// One joint.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct PhaseCoupledJoint {
        /// Amplitude A, degrees.
        pub amplitude_deg: f32,
        /// Offset a0, degrees.
        pub offset_deg: f32,
        /// Phase lead, degrees of the cycle, -360 to 360.
        pub phase_deg: f32,
    }

    /// The parameters in the units of the generator file.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(from = "Table", into = "Table")]
    pub struct PhaseCoupledSet {
        /// Period of the linear part, seconds.
        pub natural_period_s: f32,
        /// Strength eps with which the amplitude returns, 0.01 to 2.
        pub nonlinearity: f32,
        /// Strength kap of the links hip-hip, knee-knee, left leg, right leg, 0 to 2.
        pub coupling: [f32; 4],
        /// The joints.
        pub joints: [PhaseCoupledJoint; 4],
    }

    impl PhaseCoupledSet {
        /// A configuration, with angles to the whole degree.
        #[must_use]
        pub fn rounded(config: &Config) -> Self {
            let whole = |degrees: f32| (degrees + 0.5_f32.copysign(degrees)) as i32 as f32;
            let mut joints = [PhaseCoupledJoint { amplitude_deg: 0.0, offset_deg: 0.0, phase_deg: 0.0 }; 4];
            let angles = config.amplitudes.iter().zip(&config.offsets).zip(&config.phases);
            for (joint, ((amplitude, offset), lead)) in joints.iter_mut().zip(angles) {
                *joint = PhaseCoupledJoint {
                    amplitude_deg: whole(amplitude.degrees()),
                    offset_deg: whole(offset.degrees()),
                    phase_deg: whole(lead.cycles() * 360.0),
                };
            }
            Self {
                natural_period_s: config.natural_period,
                nonlinearity: config.nonlinearity,
                coupling: config.coupling,
                joints,
            }
        }
    }

    impl KindSet for PhaseCoupledSet {
        type Config = Config;
        const KEYS: &'static [Key] = &[
            Key { field: "natural_period", key: "natural_period_s", names: &[], unit: Unit::Seconds },
            Key { field: "nonlinearity", key: "nonlinearity", names: &[], unit: Unit::One },
            Key {
                field: "coupling",
                key: "coupling.*",
                names: &["hips", "knees", "left_leg", "right_leg"],
                unit: Unit::One,
            },
            Key { field: "amplitudes", key: "*.amplitude_deg", names: &JOINTS, unit: Unit::Degrees },
            Key { field: "offsets", key: "*.offset_deg", names: &JOINTS, unit: Unit::Degrees },
        ];
        const RUST_IMPORTS: &'static str = "use cpg_core::network::phase_coupled::RobustConfig;\nuse joint_loop::GeneratorConfig;\nuse joint_units::{Phase, Radians};\n";

        fn config(&self) -> Config {
            Config {
                natural_period: self.natural_period_s,
                nonlinearity: self.nonlinearity,
                coupling: self.coupling,
                phases: self.joints.map(|joint| phase(joint.phase_deg)),
                amplitudes: self.joints.map(|joint| Radians::from_degrees(joint.amplitude_deg)),
                offsets: self.joints.map(|joint| Radians::from_degrees(joint.offset_deg)),
            }
        }

        fn stride_guess_s(&self) -> f64 {
            f64::from(self.natural_period_s)
        }

        fn check_form(&self) -> Result<(), SetError> {
            check_phases("*.phase_deg", self.joints.map(|joint| joint.phase_deg))
        }
    }

    /// The layout of the table.
    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Table {
        natural_period_s: f32,
        nonlinearity: f32,
        coupling: Links,
        left_hip: PhaseCoupledJoint,
        right_hip: PhaseCoupledJoint,
        left_knee: PhaseCoupledJoint,
        right_knee: PhaseCoupledJoint,
    }

    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Links {
        hips: f32,
        knees: f32,
        left_leg: f32,
        right_leg: f32,
    }

    impl From<Table> for PhaseCoupledSet {
        fn from(table: Table) -> Self {
            let Links { hips, knees, left_leg, right_leg } = table.coupling;
            Self {
                natural_period_s: table.natural_period_s,
                nonlinearity: table.nonlinearity,
                coupling: [hips, knees, left_leg, right_leg],
                joints: [table.left_hip, table.right_hip, table.left_knee, table.right_knee],
            }
        }
    }

    impl From<PhaseCoupledSet> for Table {
        fn from(set: PhaseCoupledSet) -> Self {
            let [hips, knees, left_leg, right_leg] = set.coupling;
            let [left_hip, right_hip, left_knee, right_knee] = set.joints;
            Self {
                natural_period_s: set.natural_period_s,
                nonlinearity: set.nonlinearity,
                coupling: Links { hips, knees, left_leg, right_leg },
                left_hip,
                right_hip,
                left_knee,
                right_knee,
            }
        }
    }
}
