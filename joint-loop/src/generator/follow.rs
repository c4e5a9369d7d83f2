//! A follower as a generator of a board: the Fourier series of [`crate::generator::shape`], with the phase locked to that of a person.
//!
//! Record: kind 4; index of the sensor's joint in [`Joint::ALL`], index of the source of events in [`EventSource::ALL`], the words of a
//! shape, then the usual innovation and the gains of the corrections, in the units and the order of [`Corrections`].

use cpg_core::entrainment::correction::{INPUTS, TERMS};
use cpg_core::entrainment::phase_lock::PhaseLockConfig;
use cpg_core::entrainment::{Corrections, EventSource, FollowStatus, Follower, FollowerConfig};
use cpg_core::{BuildError, Follow};
use hgod_adc::FilterConfig;
use joint_units::{Joint, Period, Radians};

use crate::generator::kind::BoardKind;
use crate::generator::shape::ShapeConfig;
use crate::store::flash_record::{WordError, WordReader, WordWriter, choice};

#[cfg(feature = "serde")]
pub use set::{CorrectionsJoint, CorrectionsSet, FollowSet, FollowSet as Set};

/// A follower: the joint with the sensor that it follows, the events beside the sensor's angle, and the shapes of its joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowConfig {
    /// The joint that is measured.
    pub sensor: Joint,
    /// Source of the events of the stride beside the angle.
    pub events: EventSource,
    /// The person's mean stride: the templates. Its stride time is within the range of [`PhaseLockConfig::stride_s`].
    pub shape: ShapeConfig,
    /// Corrections of the joints; [`Corrections::NONE`] for none.
    pub corrections: Corrections,
}

/// Configuration.
pub type Config = FollowConfig;
/// The built follower.
pub type Built = Follower;

impl FollowConfig {
    /// The configuration of the follower: it compensates the delay of the sensor's filter; everything else as in
    /// [`FollowerConfig::default`].
    #[must_use]
    pub fn entrained(&self) -> FollowerConfig {
        let lock = PhaseLockConfig { stride_s: self.shape.stride_s, ..PhaseLockConfig::default() };
        let delay_s = FilterConfig::default().delay_s(Period::MILLISECOND);
        FollowerConfig { lock, delay_s, events: self.events, ..FollowerConfig::default() }
    }
}

impl BoardKind for FollowConfig {
    type Built = Built;
    const NAME: &'static str = "follow";
    const RECORD_KIND: u16 = 4;
    const WORDS: usize = 2 + <ShapeConfig as BoardKind>::WORDS + 1 + Joint::COUNT * INPUTS * TERMS;

    fn build(&self, period: Period) -> Result<Built, BuildError> {
        let follower = self.entrained().build(self.shape.shapes()?, self.sensor, period)?;
        follower.with_corrections(&self.corrections)
    }

    fn write(&self, words: &mut WordWriter<'_>) {
        words.push(self.sensor as u32);
        words.push(self.events as u32);
        self.shape.write(words);
        words.floats(&[self.corrections.usual_innovation.0]);
        words.floats(self.corrections.gains.as_flattened().as_flattened());
    }

    fn read(words: &mut WordReader<'_>) -> Result<Self, WordError> {
        let sensor = choice(words, "sensor", &Joint::ALL)?;
        let events = choice(words, "events", &EventSource::ALL)?;
        let shape = ShapeConfig::read(words)?;
        let mut corrections = Corrections { usual_innovation: Radians(words.float()?), ..Corrections::NONE };
        for terms in corrections.gains.as_flattened_mut() {
            *terms = words.floats()?;
        }
        Ok(Self { sensor, events, shape, corrections })
    }

    fn follows(&self) -> Option<Joint> {
        Some(self.sensor)
    }

    fn observe(built: &mut Built, angle: Option<Radians>) {
        built.observe(angle);
    }

    fn heel_strike(built: &mut Built) {
        built.heel_strike();
    }

    fn follow_status(built: &Built) -> Option<FollowStatus> {
        built.follow_status()
    }
}

#[cfg(feature = "serde")]
mod set {
    use super::{Corrections, EventSource, FollowConfig, INPUTS, Joint, Radians, TERMS};
    use crate::generator::file::{Allowed, JOINTS, Key, KeyPath, KindSet, SetError, Unit, one_of};
    use crate::generator::shape::{ShapeJoint, ShapeSet};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    const EVENTS: [&str; 3] = [EventSource::ALL[0].name(), EventSource::ALL[1].name(), EventSource::ALL[2].name()];

    /// The parameters in the units of the generator file.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(from = "Table", into = "Table")]
    pub struct FollowSet {
        /// The joint with the sensor.
        pub sensor: Joint,
        /// Source of the events of the stride beside the angle.
        pub events: EventSource,
        /// The person's undisturbed gait.
        pub shape: ShapeSet,
        /// Corrections of the joints.
        pub corrections: Option<CorrectionsSet>,
    }

    /// Corrections of the joints, see [`cpg_core::entrainment::correction`].
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct CorrectionsSet {
        /// The joint with the sensor that the gains were learned with; the follower must have its sensor there.
        #[serde(serialize_with = "joint_name", deserialize_with = "joint")]
        pub sensor: Joint,
        /// Root mean square of the innovation in the recording, degrees.
        pub usual_innovation_deg: f32,
        /// Left hip.
        pub left_hip: CorrectionsJoint,
        /// Right hip.
        pub right_hip: CorrectionsJoint,
        /// Left knee.
        pub left_knee: CorrectionsJoint,
        /// Right knee.
        pub right_knee: CorrectionsJoint,
    }

    /// The gains of a joint: each a mean, then cosine and sine of each harmonic.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct CorrectionsJoint {
        /// Of the constant, degrees.
        pub constant_deg: [f32; TERMS],
        /// Of the low-passed innovations, degrees for each degree.
        pub innovation: [[f32; TERMS]; INPUTS - 1],
    }

    impl CorrectionsJoint {
        fn of(gains: &[[f32; TERMS]; INPUTS]) -> Self {
            let [constant, innovation @ ..] = *gains;
            Self { constant_deg: constant.map(|gain| Radians(gain).degrees()), innovation }
        }

        fn gains(&self) -> [[f32; TERMS]; INPUTS] {
            let constant = self.constant_deg.map(|gain| Radians::from_degrees(gain).0);
            let [a, b, c, d, e, f] = self.innovation;
            [constant, a, b, c, d, e, f]
        }
    }

    impl CorrectionsSet {
        /// In the units of the file, for a follower with this sensor; `None` for none.
        #[must_use]
        pub fn of(corrections: &Corrections, sensor: Joint) -> Option<Self> {
            let [left_hip, right_hip, left_knee, right_knee] = corrections.gains.each_ref().map(CorrectionsJoint::of);
            let usual_innovation_deg = corrections.usual_innovation.degrees();
            let set = Self { sensor, usual_innovation_deg, left_hip, right_hip, left_knee, right_knee };
            (!corrections.is_none()).then_some(set)
        }

        /// In SI units.
        #[must_use]
        pub fn corrections(&self) -> Corrections {
            let joints = [&self.left_hip, &self.right_hip, &self.left_knee, &self.right_knee];
            let gains = joints.map(CorrectionsJoint::gains);
            Corrections { usual_innovation: Radians::from_degrees(self.usual_innovation_deg), gains }
        }
    }

    impl FollowSet {
        /// The configuration.
        #[must_use]
        pub fn in_si_units(&self) -> FollowConfig {
            let corrections = self.corrections.as_ref().map_or(Corrections::NONE, CorrectionsSet::corrections);
            FollowConfig { sensor: self.sensor, events: self.events, shape: self.shape.config(), corrections }
        }
    }

    /// The key of the gains of a low-passed innovation.
    const fn innovation(field: &'static str, key: &'static str) -> Key {
        Key { field, key, names: &[], unit: Unit::One }
    }

    impl KindSet for FollowSet {
        type Config = FollowConfig;
        const KEYS: &'static [Key] = &[
            ShapeSet::SHAPE_KEYS[0],
            ShapeSet::SHAPE_KEYS[1],
            ShapeSet::SHAPE_KEYS[2],
            ShapeSet::SHAPE_KEYS[3],
            Key { field: "usual_innovation", key: "corrections.usual_innovation_deg", names: &[], unit: Unit::Degrees },
            Key { field: "*.correction.constant", key: "corrections.*.constant_deg", names: &[], unit: Unit::Degrees },
            innovation("*.correction.innovation[0]", "corrections.*.innovation[0]"),
            innovation("*.correction.innovation[1]", "corrections.*.innovation[1]"),
            innovation("*.correction.innovation[2]", "corrections.*.innovation[2]"),
            innovation("*.correction.innovation[3]", "corrections.*.innovation[3]"),
            innovation("*.correction.innovation[4]", "corrections.*.innovation[4]"),
            innovation("*.correction.innovation[5]", "corrections.*.innovation[5]"),
        ];
        const RUST_IMPORTS: &'static str = "use cpg_core::entrainment::Corrections;\nuse cpg_core::entrainment::EventSource::*;\nuse joint_loop::{FollowConfig, GeneratorConfig, SeriesConfig, ShapeConfig};\nuse joint_units::Joint::*;\nuse joint_units::Radians;\n";

        fn config(&self) -> FollowConfig {
            self.in_si_units()
        }

        fn stride_guess_s(&self) -> f64 {
            self.shape.stride_guess_s()
        }

        fn check_form(&self) -> Result<(), SetError> {
            self.shape.check_form()?;
            match self.corrections {
                Some(CorrectionsSet { sensor, .. }) if sensor != self.sensor => Err(SetError::Value {
                    key: KeyPath::of("corrections.sensor", ""),
                    allowed: Allowed::Sensor(self.sensor.name()),
                }),
                _ => Ok(()),
            }
        }
    }

    /// The layout of the table.
    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Table {
        #[serde(serialize_with = "joint_name", deserialize_with = "joint")]
        sensor: Joint,
        /// None if the key is not there.
        #[serde(default, serialize_with = "source_name", deserialize_with = "source")]
        events: EventSource,
        stride_s: f32,
        left_hip: ShapeJoint,
        right_hip: ShapeJoint,
        left_knee: ShapeJoint,
        right_knee: ShapeJoint,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        corrections: Option<CorrectionsSet>,
    }

    fn joint<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Joint, D::Error> {
        let place = one_of(deserializer, &JOINTS)?;
        Ok(Joint::ALL.get(place).copied().unwrap_or(Joint::LeftHip))
    }

    fn joint_name<S: Serializer>(joint: &Joint, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(joint.name())
    }

    fn source<'de, D: Deserializer<'de>>(deserializer: D) -> Result<EventSource, D::Error> {
        let place = one_of(deserializer, &EVENTS)?;
        Ok(EventSource::ALL.get(place).copied().unwrap_or_default())
    }

    fn source_name<S: Serializer>(source: &EventSource, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(source.name())
    }

    impl From<Table> for FollowSet {
        fn from(table: Table) -> Self {
            let Table { sensor, events, stride_s, left_hip, right_hip, left_knee, right_knee, corrections } = table;
            let joints = [left_hip, right_hip, left_knee, right_knee];
            Self { sensor, events, shape: ShapeSet { stride_s, joints }, corrections }
        }
    }

    impl From<FollowSet> for Table {
        fn from(set: FollowSet) -> Self {
            let FollowSet { sensor, events, shape: ShapeSet { stride_s, joints }, corrections } = set;
            let [left_hip, right_hip, left_knee, right_knee] = joints;
            Self { sensor, events, stride_s, left_hip, right_hip, left_knee, right_knee, corrections }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::shape::{SERIES_HARMONICS, SeriesConfig};
    use crate::{BoardGenerator, GeneratorConfig};
    use cpg_core::Generator;

    /// The board's enum forwards observations, heel strikes and status to a follower, bit for bit; other kinds have no status.
    #[test]
    fn the_boards_enum_forwards_to_the_follower() {
        let joint = |lead: f32| {
            let (mut cos, mut sin) = ([0.0; SERIES_HARMONICS], [0.0; SERIES_HARMONICS]);
            (cos[0], sin[0]) = (0.35 * lead.cos(), 0.35 * lead.sin());
            SeriesConfig { mean: Radians(0.1), cos, sin }
        };
        let shape = ShapeConfig { stride_s: 1.1, joints: [0.0_f32, 3.1, 1.5, 4.6].map(joint) };
        let follow = FollowConfig {
            sensor: Joint::LeftHip,
            events: EventSource::FootSwitch,
            shape,
            corrections: Corrections::NONE,
        };
        let mut generator = GeneratorConfig::Follow(follow).build(Period::MILLISECOND).unwrap();
        let mut core = follow.entrained().build(shape.shapes().unwrap(), Joint::LeftHip, Period::MILLISECOND).unwrap();
        for tick in 0..16_000u32 {
            let cycles = tick as f32 * 1e-3;
            let angle = (tick < 15_000).then(|| Radians(0.1 + 0.35 * (core::f32::consts::TAU * cycles).cos()));
            core.observe(angle);
            generator.observe(angle);
            if tick % 1000 == 400 {
                core.heel_strike();
                generator.heel_strike();
            }
            core.step();
            generator.step();
            let status = (generator.angles(), generator.follow_status());
            assert_eq!(status, (core.angles(), Some(core.status())), "tick {tick}");
        }
        let BoardGenerator::Follow(follower) = generator else { unreachable!() };
        assert_eq!(follower, core);
        assert!((follower.event_phase().expect("learned").cycles() - 0.4).abs() < 0.01);
        let network = GeneratorConfig::default_walk().build(Period::MILLISECOND).unwrap();
        assert_eq!(network.follow_status(), None);
    }
}
