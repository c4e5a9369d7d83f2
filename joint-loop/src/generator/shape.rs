//! One phase and a Fourier series for each joint, as a generator of a board.
//!
//! Record: kind 3; stride, then mean, cosines and sines of each joint, in the units of the configuration.

use cpg_core::waveform::shape::{FourierShape, PhaseShape, PhaseShapeConfig};
use cpg_core::{BuildError, Field};
use joint_units::{Joint, Period, Radians};

use crate::generator::kind::BoardKind;
use crate::store::flash_record::{WordError, WordReader, WordWriter};

#[cfg(feature = "serde")]
pub use set::{Coefficients, ShapeJoint, ShapeSet, ShapeSet as Set};

/// Harmonics of a joint's Fourier series. A fit of fewer has zeros above.
pub const SERIES_HARMONICS: usize = 8;

/// Fields of each joint in a [`BuildError`]: mean, cosines, sines.
const FIELDS: [[&str; 3]; Joint::COUNT] = [
    ["left_hip.mean", "left_hip.cos", "left_hip.sin"],
    ["right_hip.mean", "right_hip.cos", "right_hip.sin"],
    ["left_knee.mean", "left_knee.cos", "left_knee.sin"],
    ["right_knee.mean", "right_knee.cos", "right_knee.sin"],
];

/// One joint's Fourier series, see [`FourierShape`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesConfig {
    /// Mean angle, within ±[`cpg_core::waveform::shape::MAX_COEFFICIENT`] rad, as all coefficients.
    pub mean: Radians,
    /// Coefficients of the cosines of harmonic 1, 2, ..., rad.
    pub cos: [f32; SERIES_HARMONICS],
    /// Coefficients of the sines, rad.
    pub sin: [f32; SERIES_HARMONICS],
}

/// One phase, and a Fourier series for each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeConfig {
    /// Stride time, within [`cpg_core::waveform::shape::STRIDE_RANGE_S`] seconds.
    pub stride_s: f32,
    /// The joints, in the order of [`Joint::ALL`].
    pub joints: [SeriesConfig; Joint::COUNT],
}

/// Configuration.
pub type Config = ShapeConfig;
/// The built generator.
pub type Built = PhaseShape<FourierShape<SERIES_HARMONICS>, { Joint::COUNT }>;

impl ShapeConfig {
    /// The waveform of each joint.
    ///
    /// # Errors
    /// Names the joint and the coefficient that is out of range.
    pub fn shapes(&self) -> Result<[FourierShape<SERIES_HARMONICS>; Joint::COUNT], BuildError> {
        let [left_hip, right_hip, left_knee, right_knee] = &self.joints;
        Ok([
            left_hip.shape(Joint::LeftHip)?,
            right_hip.shape(Joint::RightHip)?,
            left_knee.shape(Joint::LeftKnee)?,
            right_knee.shape(Joint::RightKnee)?,
        ])
    }
}

impl SeriesConfig {
    fn shape(&self, joint: Joint) -> Result<FourierShape<SERIES_HARMONICS>, BuildError> {
        let [mean, cos, sin] = FIELDS.get(joint as usize).copied().unwrap_or_default();
        FourierShape::new(self.mean, self.cos, self.sin).map_err(|error| {
            of_joint(error, |name| match name {
                "mean" => mean,
                "cos" => cos,
                _ => sin,
            })
        })
    }
}

/// The error with the name of its field replaced by one that names the joint.
pub(crate) fn of_joint(error: BuildError, rename: impl FnOnce(&str) -> &'static str) -> BuildError {
    let named = |field: Field| Field { name: rename(field.name), ..field };
    match error {
        BuildError::NotFinite { field, value } => BuildError::NotFinite { field: named(field), value },
        BuildError::OutOfRange { field, value, min, max } => {
            BuildError::OutOfRange { field: named(field), value, min, max }
        }
        _ => error,
    }
}

impl BoardKind for ShapeConfig {
    type Built = Built;
    const NAME: &'static str = "shape";
    const RECORD_KIND: u16 = 3;
    const WORDS: usize = 1 + Joint::COUNT * (1 + 2 * SERIES_HARMONICS);

    fn build(&self, period: Period) -> Result<Built, BuildError> {
        PhaseShapeConfig { shapes: self.shapes()?, stride_s: self.stride_s }.build(period)
    }

    fn write(&self, words: &mut WordWriter<'_>) {
        words.floats(&[self.stride_s]);
        for joint in &self.joints {
            words.floats(&[joint.mean.0]);
            words.floats(&joint.cos);
            words.floats(&joint.sin);
        }
    }

    fn read(words: &mut WordReader<'_>) -> Result<Self, WordError> {
        let stride_s = words.float()?;
        let mut joints =
            [SeriesConfig { mean: Radians(0.0), cos: [0.0; SERIES_HARMONICS], sin: [0.0; SERIES_HARMONICS] };
                Joint::COUNT];
        for joint in &mut joints {
            *joint = SeriesConfig { mean: Radians(words.float()?), cos: words.floats()?, sin: words.floats()? };
        }
        Ok(Self { stride_s, joints })
    }
}

#[cfg(feature = "serde")]
mod set {
    use super::{Radians, SERIES_HARMONICS, SeriesConfig, ShapeConfig};
    use crate::generator::file::{Allowed, JOINTS, Key, KeyPath, KindSet, SetError, Unit};
    use core::fmt;
    use core::ops::Deref;
    use serde::de::{Error, SeqAccess, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// 1 to [`SERIES_HARMONICS`] Fourier coefficients, degrees.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Coefficients {
        values: [f32; SERIES_HARMONICS],
        count: usize,
    }

    impl Coefficients {
        /// Coefficients from 1 to [`SERIES_HARMONICS`] numbers; `None` for another count.
        #[must_use]
        pub fn new(numbers: &[f32]) -> Option<Self> {
            let mut values = [0.0; SERIES_HARMONICS];
            values.get_mut(..numbers.len()).filter(|used| !used.is_empty())?.copy_from_slice(numbers);
            Some(Self { values, count: numbers.len() })
        }

        /// The coefficients in radians; missing harmonics are zero.
        fn radians(&self) -> [f32; SERIES_HARMONICS] {
            self.values.map(|degrees| Radians::from_degrees(degrees).0)
        }
    }

    impl Deref for Coefficients {
        type Target = [f32];

        fn deref(&self) -> &[f32] {
            self.values.get(..self.count).unwrap_or(&[])
        }
    }

    impl Serialize for Coefficients {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(self.iter())
        }
    }

    impl<'de> Deserialize<'de> for Coefficients {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_seq(Numbers)
        }
    }

    struct Numbers;

    impl<'de> Visitor<'de> for Numbers {
        type Value = Coefficients;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "1 to {SERIES_HARMONICS} numbers")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Coefficients, A::Error> {
            let mut all = Coefficients { values: [0.0; SERIES_HARMONICS], count: 0 };
            while let Some(number) = list.next_element()? {
                if let Some(place) = all.values.get_mut(all.count) {
                    *place = number;
                }
                all.count = all.count.saturating_add(1);
            }
            if (1..=SERIES_HARMONICS).contains(&all.count) {
                Ok(all)
            } else {
                Err(A::Error::invalid_length(all.count, &self))
            }
        }
    }

    /// One joint.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct ShapeJoint {
        /// Mean, degrees.
        pub mean_deg: f32,
        /// Cosine coefficients from the first harmonic on, degrees.
        pub cos_deg: Coefficients,
        /// Sine coefficients, as many.
        pub sin_deg: Coefficients,
    }

    /// The parameters in the units of the generator file.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(from = "Table", into = "Table")]
    pub struct ShapeSet {
        /// Stride, seconds.
        pub stride_s: f32,
        /// The joints.
        pub joints: [ShapeJoint; 4],
    }

    impl ShapeSet {
        /// Keys of the fields of a [`ShapeConfig`] in the file.
        pub(crate) const SHAPE_KEYS: &'static [Key] = &[
            Key { field: "stride_s", key: "stride_s", names: &[], unit: Unit::Seconds },
            Key { field: "*.mean", key: "*.mean_deg", names: &[], unit: Unit::Degrees },
            Key { field: "*.cos", key: "*.cos_deg", names: &[], unit: Unit::Degrees },
            Key { field: "*.sin", key: "*.sin_deg", names: &[], unit: Unit::Degrees },
        ];
    }

    impl KindSet for ShapeSet {
        type Config = ShapeConfig;
        const KEYS: &'static [Key] = Self::SHAPE_KEYS;
        const RUST_IMPORTS: &'static str =
            "use joint_loop::{GeneratorConfig, SeriesConfig, ShapeConfig};\nuse joint_units::Radians;\n";

        fn config(&self) -> ShapeConfig {
            let series = |joint: &ShapeJoint| SeriesConfig {
                mean: Radians::from_degrees(joint.mean_deg),
                cos: joint.cos_deg.radians(),
                sin: joint.sin_deg.radians(),
            };
            ShapeConfig { stride_s: self.stride_s, joints: self.joints.each_ref().map(series) }
        }

        fn stride_guess_s(&self) -> f64 {
            f64::from(self.stride_s)
        }

        fn check_form(&self) -> Result<(), SetError> {
            match self.joints.iter().zip(JOINTS).find(|(joint, _)| joint.cos_deg.len() != joint.sin_deg.len()) {
                None => Ok(()),
                Some((joint, name)) => Err(SetError::Value {
                    key: KeyPath::of("*.sin_deg", name),
                    allowed: Allowed::Count(joint.cos_deg.len()),
                }),
            }
        }
    }

    /// The layout of the table.
    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Table {
        stride_s: f32,
        left_hip: ShapeJoint,
        right_hip: ShapeJoint,
        left_knee: ShapeJoint,
        right_knee: ShapeJoint,
    }

    impl From<Table> for ShapeSet {
        fn from(table: Table) -> Self {
            let Table { stride_s, left_hip, right_hip, left_knee, right_knee } = table;
            Self { stride_s, joints: [left_hip, right_hip, left_knee, right_knee] }
        }
    }

    impl From<ShapeSet> for Table {
        fn from(set: ShapeSet) -> Self {
            let [left_hip, right_hip, left_knee, right_knee] = set.joints;
            Self { stride_s: set.stride_s, left_hip, right_hip, left_knee, right_knee }
        }
    }
}
