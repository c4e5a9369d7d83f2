//! The parameter file of a walker: which generator, its numbers with their units in the names, and where they came from.
//!
//! Four kinds: `robust` (R1), `thesis` (eqs 13-16), `shape` (one phase, a Fourier series a joint) and `follow` (the same, led by the gait
//! sensor). Numbers are written in the shortest form that reads back to the same bits, so a file makes an exact round trip. Every field has
//! to be there but `events` of a follower, which without a word are none.

mod reading;
mod writing;

use cpg_core::Rk4;
use cpg_core::entrainment::EventSource;
use cpg_core::gait::default_walk::default_config;
use cpg_core::network::graph::{Biped, HipKnee, LeftRight};
use cpg_core::network::phase_coupled::RobustConfig;
use cpg_core::network::thesis::ThesisConfig;
use cpg_core::oscillator::rayleigh::RayleighConfig;
pub use joint_loop::SERIES_HARMONICS;
use joint_loop::{BoardGenerator, FollowConfig, GeneratorConfig, SeriesConfig, ShapeConfig};
use joint_units::{Joint, Period, Phase, Radians};

use crate::certificate::Specimen;
use crate::specimen::Orbiting;

/// Version of the layout.
pub const SCHEMA: u32 = 1;

/// One joint of R1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustJoint {
    /// Amplitude A, degrees.
    pub amplitude_deg: f32,
    /// Offset a0, degrees.
    pub offset_deg: f32,
    /// Phase lead, degrees of the cycle.
    pub phase_deg: f32,
}

/// R1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustSet {
    /// Period of the linear part, seconds.
    pub natural_period_s: f32,
    /// eps.
    pub nonlinearity: f32,
    /// kap of the links hip-hip, knee-knee, left leg, right leg.
    pub coupling: [f32; 4],
    /// The joints.
    pub joints: [RobustJoint; 4],
}

/// One joint of the thesis' network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThesisJoint {
    /// alpha, 1/s.
    pub alpha_per_s: f32,
    /// p, s^2/deg^2.
    pub p_s2_per_deg2: f32,
    /// mu, rad/s.
    pub mu_rad_per_s: f32,
    /// a0, degrees.
    pub offset_deg: f32,
    /// Phase lead of the start, degrees of the cycle.
    pub start_phase_deg: f32,
}

/// The thesis' network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThesisSet {
    /// [k12, k21] of the hips and [k34, k43] of the knees, 1/s.
    pub difference_per_s: [[f32; 2]; 2],
    /// [k13, k31] of the left leg and [k24, k42] of the right, 1/(deg s).
    pub product_per_deg_s: [[f32; 2]; 2],
    /// The joints.
    pub joints: [ThesisJoint; 4],
}

/// One joint of the programmable generator.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeJoint {
    /// Mean, degrees.
    pub mean_deg: f32,
    /// Cosine coefficients from the first harmonic on, degrees; up to [`SERIES_HARMONICS`].
    pub cos_deg: Vec<f32>,
    /// Sine coefficients, as many.
    pub sin_deg: Vec<f32>,
}

/// The programmable generator.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeSet {
    /// Stride, seconds.
    pub stride_s: f32,
    /// The joints.
    pub joints: [ShapeJoint; 4],
}

/// A generator with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum GeneratorSet {
    /// R1.
    Robust(RobustSet),
    /// The thesis' network.
    Thesis(ThesisSet),
    /// Phase and shape.
    Shape(ShapeSet),
    /// Phase and shape that follow the gait sensor.
    Follow(FollowSet),
}

/// Where a set came from. All texts may be empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Provenance {
    /// The recording, or `shipped`.
    pub source: String,
    /// SHA-256 of the recording, in hex.
    pub source_sha256: String,
    /// Program and version.
    pub made_by: String,
    /// What was asked of it: method, seed.
    pub settings: String,
}

/// Phase and shape that follow the gait sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowSet {
    /// The joint that the sensor is worn on.
    pub sensor: Joint,
    /// What tells moments of the stride beside the angle.
    pub events: EventSource,
    /// What the walker does.
    pub shape: ShapeSet,
}

/// A file.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneratorFile {
    /// Where the numbers came from.
    pub provenance: Provenance,
    /// The numbers.
    pub set: GeneratorSet,
}

impl GeneratorSet {
    /// `robust`, `thesis`, `shape` or `follow`.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self {
            GeneratorSet::Robust(_) => "robust",
            GeneratorSet::Thesis(_) => "thesis",
            GeneratorSet::Shape(_) => "shape",
            GeneratorSet::Follow(_) => "follow",
        }
    }

    /// About how long a stride is, seconds.
    #[must_use]
    pub fn stride_guess_s(&self) -> f64 {
        match self {
            GeneratorSet::Robust(set) => f64::from(set.natural_period_s),
            GeneratorSet::Thesis(set) => std::f64::consts::TAU / f64::from(set.joints[0].mu_rad_per_s),
            GeneratorSet::Shape(set) | GeneratorSet::Follow(FollowSet { shape: set, .. }) => f64::from(set.stride_s),
        }
    }

    /// What the board is given, see [`joint_loop::store::generator_record`].
    #[must_use]
    pub fn config(&self) -> GeneratorConfig {
        match self {
            GeneratorSet::Robust(set) => GeneratorConfig::Robust(set.config()),
            GeneratorSet::Thesis(set) => GeneratorConfig::Thesis(set.config()),
            GeneratorSet::Shape(set) => GeneratorConfig::Shape(set.config()),
            GeneratorSet::Follow(set) => GeneratorConfig::Follow(FollowConfig {
                sensor: set.sensor,
                events: set.events,
                shape: set.shape.config(),
            }),
        }
    }

    /// The generator as the board runs it.
    ///
    /// # Errors
    /// The rule that a number breaks.
    pub fn generator(&self, period: Period) -> Result<BoardGenerator, String> {
        self.config().build(period).map_err(|error| error.to_string())
    }

    /// The generator in f64, for the certificate; none where the only state is a phase, which nothing can push off its cycle.
    ///
    /// # Errors
    /// The rule that a number breaks.
    pub fn specimen(&self, period: Period) -> Result<Option<Box<dyn Specimen>>, String> {
        let specimen: Box<dyn Specimen> = match self {
            GeneratorSet::Robust(set) => {
                let config = set.config();
                let config = RobustConfig {
                    natural_period: f64::from(config.natural_period),
                    nonlinearity: f64::from(config.nonlinearity),
                    coupling: config.coupling.map(f64::from),
                    phases: config.phases,
                    amplitudes: config.amplitudes,
                    offsets: config.offsets,
                };
                Box::new(Orbiting(config.build::<Biped, Rk4>(period).map_err(|e| e.to_string())?))
            }
            GeneratorSet::Thesis(set) => Box::new(Orbiting(
                set.config::<f64>().build::<LeftRight, HipKnee, Rk4>(period).map_err(|e| e.to_string())?,
            )),
            GeneratorSet::Shape(_) | GeneratorSet::Follow(_) => return Ok(None),
        };
        Ok(Some(specimen))
    }
}

impl RobustSet {
    /// The core's configuration.
    #[must_use]
    pub fn config(&self) -> RobustConfig<4, 4> {
        RobustConfig {
            natural_period: self.natural_period_s,
            nonlinearity: self.nonlinearity,
            coupling: self.coupling,
            phases: self.joints.map(|joint| phase(joint.phase_deg)),
            amplitudes: self.joints.map(|joint| Radians::from_degrees(joint.amplitude_deg)),
            offsets: self.joints.map(|joint| Radians::from_degrees(joint.offset_deg)),
        }
    }
}

impl ThesisSet {
    /// The core's configuration.
    #[must_use]
    pub fn config<T: cpg_core::Scalar>(&self) -> ThesisConfig<T> {
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

impl ShapeSet {
    /// The core's configuration: harmonics that the set does not have are zero.
    #[must_use]
    pub fn config(&self) -> ShapeConfig {
        let radians = |degrees: &[f32]| {
            let mut all = [0.0; SERIES_HARMONICS];
            for (place, degrees) in all.iter_mut().zip(degrees) {
                *place = Radians::from_degrees(*degrees).0;
            }
            all
        };
        let series = |joint: &ShapeJoint| SeriesConfig {
            mean: Radians::from_degrees(joint.mean_deg),
            cos: radians(&joint.cos_deg),
            sin: radians(&joint.sin_deg),
        };
        ShapeConfig { stride_s: self.stride_s, joints: self.joints.each_ref().map(series) }
    }
}

/// The nearest phase to a lead in degrees of the cycle.
fn phase(degrees: f32) -> Phase {
    let cycles = (f64::from(degrees) / 360.0).rem_euclid(1.0);
    Phase((cycles * 4_294_967_296.0).round() as u64 as u32)
}

const PROVENANCE: [&str; 4] = ["source", "source_sha256", "made_by", "settings"];
const ROBUST: [&str; 7] =
    ["natural_period_s", "nonlinearity", "coupling", "left_hip", "right_hip", "left_knee", "right_knee"];
const THESIS: [&str; 6] = ["difference_per_s", "product_per_deg_s", "left_hip", "right_hip", "left_knee", "right_knee"];
const SHAPE: [&str; 5] = ["stride_s", "left_hip", "right_hip", "left_knee", "right_knee"];
const FOLLOW: [&str; 7] = ["sensor", "events", "stride_s", "left_hip", "right_hip", "left_knee", "right_knee"];
const LINKS: [&str; 4] = ["hips", "knees", "left_leg", "right_leg"];

impl GeneratorFile {
    /// A set that ships: `robust` (the default walk), `thesis` (Table 1, set S), `thesis-double` (set D).
    #[must_use]
    pub fn default_of(name: &str) -> Option<Self> {
        let set = match name {
            "robust" => {
                let config = default_config();
                GeneratorSet::Robust(RobustSet {
                    natural_period_s: config.natural_period,
                    nonlinearity: config.nonlinearity,
                    coupling: config.coupling,
                    joints: std::array::from_fn(|joint| RobustJoint {
                        amplitude_deg: config.amplitudes[joint].degrees().round(),
                        offset_deg: config.offsets[joint].degrees().round(),
                        phase_deg: (config.phases[joint].cycles() * 360.0).round(),
                    }),
                })
            }
            "thesis" => thesis(&ThesisConfig::set_s()),
            "thesis-double" => thesis(&ThesisConfig::set_d()),
            _ => return None,
        };
        let made_by = format!("footfall {}", env!("CARGO_PKG_VERSION"));
        Some(Self { provenance: Provenance { source: "shipped".into(), made_by, ..Provenance::default() }, set })
    }
}

fn thesis(config: &ThesisConfig) -> GeneratorSet {
    GeneratorSet::Thesis(ThesisSet {
        difference_per_s: config.difference,
        product_per_deg_s: config.product,
        joints: std::array::from_fn(|joint| ThesisJoint {
            alpha_per_s: config.joints[joint].alpha,
            p_s2_per_deg2: config.joints[joint].p,
            mu_rad_per_s: config.joints[joint].mu,
            offset_deg: config.joints[joint].offset,
            start_phase_deg: (config.phases[joint].cycles() * 360.0).round(),
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::Generator;

    fn shape() -> GeneratorFile {
        let joint =
            |mean_deg| ShapeJoint { mean_deg, cos_deg: vec![20.1, 0.3, -1.25], sin_deg: vec![1e-7, -3.3333333, 0.1] };
        let set = GeneratorSet::Shape(ShapeSet {
            stride_s: 1.123_456_7,
            joints: [joint(1.0), joint(2.0), joint(30.0), joint(31.5)],
        });
        let source = "a \"quoted\" name\\with\nnewline".to_string();
        GeneratorFile { provenance: Provenance { source, ..Provenance::default() }, set }
    }

    fn files() -> Vec<GeneratorFile> {
        let mut files: Vec<_> =
            ["robust", "thesis", "thesis-double"].map(|name| GeneratorFile::default_of(name).unwrap()).into();
        files.push(shape());
        let GeneratorSet::Shape(inner) = shape().set else { unreachable!() };
        files.push(GeneratorFile {
            set: GeneratorSet::Follow(FollowSet {
                sensor: Joint::RightKnee,
                events: EventSource::FootSwitch,
                shape: inner,
            }),
            ..shape()
        });
        files
    }

    #[test]
    fn every_kind_makes_an_exact_round_trip() {
        for file in files() {
            let text = file.to_toml();
            assert_eq!(GeneratorFile::parse("x.toml", &text).unwrap_or_else(|e| panic!("{e}\n{text}")), file);
        }
    }

    /// The shipped robust file builds the very walk that the board ships: same bits for a minute.
    #[test]
    fn the_shipped_file_is_the_shipped_walk() {
        let mut from_file = GeneratorFile::default_of("robust").unwrap().set.generator(Period::MILLISECOND).unwrap();
        let mut shipped = cpg_core::gait::default_walk::default_walk(Period::MILLISECOND).unwrap();
        for _ in 0..60_000 {
            from_file.step();
            shipped.step();
        }
        assert_eq!(from_file.angles(), shipped.angles());
    }

    /// A follower's events may be left out, and then there are none; another word is refused with those that are allowed.
    #[test]
    fn events_may_be_left_out_and_are_one_of_three() {
        let file = files().pop().expect("a follower");
        let text = file.to_toml();
        let GeneratorSet::Follow(set) = &file.set else { unreachable!() };
        assert_eq!(set.events, EventSource::FootSwitch);
        let without = GeneratorFile::parse("x.toml", &text.replace("events = \"foot_switch\"\n", "")).unwrap();
        assert_eq!(without.set, GeneratorSet::Follow(FollowSet { events: EventSource::None, ..set.clone() }));
        let error = GeneratorFile::parse("x.toml", &text.replace("foot_switch", "heel")).unwrap_err().to_string();
        assert!(error.contains("follow.events") && error.contains(r#""none", "peak", "foot_switch""#), "{error}");
    }

    /// Every numeric field broken in turn: the error names file, line and field, and says what is allowed.
    #[test]
    fn each_broken_field_is_named_with_its_line() {
        for file in files() {
            let text = file.to_toml();
            for (index, line) in text.lines().enumerate() {
                let Some((key, _)) = line.split_once(" = ") else { continue };
                for (broken, wanted) in [
                    (format!("{key} = nan"), "allowed"),
                    (format!("{key}x = 1"), "unknown field"),
                    (format!("{key} = @"), "TOML"),
                ] {
                    let mut lines: Vec<&str> = text.lines().collect();
                    lines[index] = &broken;
                    let error = GeneratorFile::parse("walker.toml", &lines.join("\n")).expect_err(&broken).to_string();
                    assert!(error.starts_with(&format!("walker.toml:{}: ", index + 1)), "{broken}: {error}");
                    assert!(error.contains(wanted) && error.contains("allowed"), "{broken}: {error}");
                    assert!(wanted == "TOML" || error.contains(key), "{broken}: {error}");
                }
            }
        }
    }
}
