//! The generator file of a phase-coupled network of six or eight joints, which runs on the host: the control loop of the boards drives four.
//!
//! ```toml
//! schema = 2
//! generator = "phase-coupled"
//!
//! [provenance]                     # as in crate::file
//!
//! [phase-coupled]
//! natural_period_s = 1.0847
//! nonlinearity = 0.5
//! coupling = [0.5, ...]            # a number a link, in the order of the network's graph
//!
//! [[phase-coupled.joints]]         # six or eight of these, in the order of `JOINTS`
//! name = "left_hip"
//! amplitude_deg = 20.0
//! offset_deg = 5.0
//! phase_deg = 0.0
//! range_deg = [-30.0, 60.0]        # the angles that the certificate allows
//! ```

use std::path::Path;

use cpg_core::BuildError;
use cpg_core::gait::six_and_eight_joints::{WithAnkles, WithArms, ankles_config, arms_config};
use cpg_core::network::graph::Graph;
use cpg_core::network::phase_coupled::RobustConfig;
use joint_loop::LoopConfig;
use joint_units::{Joint, Phase, Radians};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

use crate::file::{GeneratorFile, LIST_OF_JOINTS, MAKE_AGAIN, Provenance, SCHEMA, serialize};
use crate::toml_file::{FileError, FileKind, Problem, TomlFile, Top};

/// Names of the joints in their order. A network of six joints has the first six.
pub const JOINTS: [&str; 8] = [
    Joint::LeftHip.name(),
    Joint::RightHip.name(),
    Joint::LeftKnee.name(),
    Joint::RightKnee.name(),
    "left_ankle",
    "right_ankle",
    "left_shoulder",
    "right_shoulder",
];

/// Name of the kind and of its table.
const KIND: &str = "phase-coupled";

/// Ranges of ankle (dorsiflexion positive) and shoulder (flexion positive), degrees: normal ranges of motion of the American Academy of
/// Orthopaedic Surgeons ("Joint Motion: Method of Measuring and Recording", 1965).
const ANKLE_DEG: [f32; 2] = [-50.0, 20.0];
const SHOULDER_DEG: [f32; 2] = [-60.0, 180.0];

/// Least and greatest number of a phase lead, degrees.
const PHASE_DEG: f32 = 360.0;
/// Least and greatest angle of a range, degrees.
const RANGE_DEG: f32 = 180.0;

/// One joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkJoint {
    /// Its name, one of [`JOINTS`].
    pub name: String,
    /// Amplitude A, degrees, 0 to 180.
    pub amplitude_deg: f32,
    /// Offset a0, degrees, -180 to 180.
    pub offset_deg: f32,
    /// Phase lead, degrees of the cycle, -360 to 360.
    pub phase_deg: f32,
    /// Least and greatest angle that the certificate allows, degrees.
    pub range_deg: [f32; 2],
}

/// The parameters of a network of six or eight joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkSet {
    /// Period of the linear part, seconds, 0.1 to 100.
    pub natural_period_s: f32,
    /// Strength eps with which the amplitude returns, 0.01 to 2.
    pub nonlinearity: f32,
    /// Strength kap of each link, 0 to 2, in the order of the graph's edges.
    pub coupling: Vec<f32>,
    /// The joints, in the order of [`JOINTS`].
    pub joints: Vec<NetworkJoint>,
}

impl NetworkSet {
    /// A configuration with the default ranges: those of the default robot for hips and knees, and normal ranges of motion of people for
    /// ankles and shoulders. `N` is 6 or 8; joints beyond the names are left out.
    #[must_use]
    pub fn of_config<const N: usize, const E: usize>(config: &RobustConfig<N, E>) -> Self {
        let joints = JOINTS.into_iter().zip(config.amplitudes).zip(config.offsets).zip(config.phases);
        let joints = joints.enumerate().map(|(index, (((name, amplitude), offset), lead))| NetworkJoint {
            name: name.into(),
            amplitude_deg: tenth(amplitude.degrees()),
            offset_deg: tenth(offset.degrees()),
            phase_deg: tenth(lead.cycles() * 360.0),
            range_deg: default_range_deg(index),
        });
        Self {
            natural_period_s: config.natural_period,
            nonlinearity: config.nonlinearity,
            coupling: config.coupling.to_vec(),
            joints: joints.collect(),
        }
    }

    /// The configuration in SI units; `None` if the set has another number of joints or links.
    #[must_use]
    pub fn config<const N: usize, const E: usize>(&self) -> Option<RobustConfig<N, E, f64>> {
        let coupling: [f32; E] = self.coupling.as_slice().try_into().ok()?;
        let joints: &[NetworkJoint; N] = self.joints.as_slice().try_into().ok()?;
        Some(RobustConfig {
            natural_period: f64::from(self.natural_period_s),
            nonlinearity: f64::from(self.nonlinearity),
            coupling: coupling.map(f64::from),
            phases: joints.each_ref().map(|joint| Phase::from_cycles(joint.phase_deg / 360.0)),
            amplitudes: joints.each_ref().map(|joint| Radians::from_degrees(joint.amplitude_deg)),
            offsets: joints.each_ref().map(|joint| Radians::from_degrees(joint.offset_deg)),
        })
    }

    /// About how long a stride is, seconds: the limit cycle is longer than the natural period by eps^2/16.
    #[must_use]
    pub fn stride_guess_s(&self) -> f64 {
        f64::from(self.natural_period_s) * (1.0 + f64::from(self.nonlinearity).powi(2) / 16.0)
    }

    /// Pairs of linked joints, by their places; empty for a number of joints that no network has.
    #[must_use]
    pub fn links(joints: usize) -> &'static [(usize, usize)] {
        match joints {
            6 => &<WithAnkles as Graph<6, 7>>::EDGES,
            8 => &<WithArms as Graph<8, 10>>::EDGES,
            _ => &[],
        }
    }

    /// The first key that is not allowed, in the table of the kind, and what is allowed.
    fn not_allowed(&self) -> Option<(String, String)> {
        let (count, links) = (self.joints.len(), Self::links(self.joints.len()));
        if links.is_empty() {
            return Some(("joints".into(), "a list of 6 joints (hips, knees, ankles) or 8 (and shoulders)".into()));
        }
        for (index, (joint, name)) in self.joints.iter().zip(JOINTS).enumerate() {
            let key = |key: &str| format!("joints[{index}].{key}");
            if joint.name != name {
                return Some((key("name"), format!("\"{name}\"; the order is {}", JOINTS[..count].join(", "))));
            }
            if !(-PHASE_DEG..=PHASE_DEG).contains(&joint.phase_deg) {
                return Some((key("phase_deg"), format!("a number from -{PHASE_DEG} to {PHASE_DEG} degrees")));
            }
            let [least, most] = joint.range_deg;
            if !(-RANGE_DEG <= least && least < most && most <= RANGE_DEG) {
                let allowed = format!("two numbers from -{RANGE_DEG} to {RANGE_DEG} degrees, the smaller one first");
                return Some((key("range_deg"), allowed));
            }
        }
        if self.coupling.len() != links.len() {
            let ends: Vec<String> = links.iter().map(|&(a, b)| format!("{} - {}", JOINTS[a], JOINTS[b])).collect();
            let allowed = format!("a list of {} numbers, one a link: {}", links.len(), ends.join(", "));
            return Some(("coupling".into(), allowed));
        }
        let checked = match count {
            6 => self.config::<6, 7>().map(|config| config.validate()),
            _ => self.config::<8, 10>().map(|config| config.validate()),
        };
        checked?.err().map(in_file)
    }
}

/// Key and allowed values of a configuration's error, in the units of the file.
fn in_file(error: BuildError) -> (String, String) {
    let (field, range) = match error {
        BuildError::NotFinite { field, .. } => (field, None),
        BuildError::OutOfRange { field, min, max, .. } => (field, Some((min, max))),
        other => return (String::new(), other.to_string()),
    };
    let index = field.index.unwrap_or(0);
    let (key, is_angle) = match field.name {
        "natural_period" => ("natural_period_s".into(), false),
        "coupling" => (format!("coupling[{index}]"), false),
        "amplitudes" => (format!("joints[{index}].amplitude_deg"), true),
        "offsets" => (format!("joints[{index}].offset_deg"), true),
        other => (other.to_string(), false),
    };
    let of = |value: f32| if is_angle { Radians(value).degrees() } else { value };
    let allowed = range.map(|(least, most)| format!("a number from {} to {}", of(least), of(most)));
    (key, allowed.unwrap_or_else(|| "a finite number".into()))
}

/// The default range of a joint by its place, degrees.
#[must_use]
pub fn default_range_deg(index: usize) -> [f32; 2] {
    let gate = LoopConfig::default_biped().gate;
    match gate.range.get(index) {
        Some(range) => [tenth(range.least.degrees()), tenth(range.most.degrees())],
        None if index < 6 => ANKLE_DEG,
        None => SHOULDER_DEG,
    }
}

/// Rounded to a tenth: 75 degrees, not the nearest f32 of it in radians.
fn tenth(degrees: f32) -> f32 {
    (f64::from(degrees) * 10.0).round() as f32 / 10.0
}

/// A generator file of six or eight joints.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkFile {
    /// Provenance of the numbers.
    pub provenance: Provenance,
    /// The numbers.
    pub set: NetworkSet,
}

impl NetworkFile {
    /// Names of [`NetworkFile::default_of`].
    pub const DEFAULTS: [&str; 2] = ["six-joints", "eight-joints"];

    /// A default: `six-joints` (hips, knees and ankles) or `eight-joints` (and shoulders), at a stride of 1.1 s.
    #[must_use]
    pub fn default_of(name: &str) -> Option<Self> {
        let set = match name {
            "six-joints" => NetworkSet::of_config(&ankles_config()),
            "eight-joints" => NetworkSet::of_config(&arms_config()),
            _ => return None,
        };
        let made_by = format!("footfall {}", env!("CARGO_PKG_VERSION"));
        Some(Self { provenance: Provenance { source: "default".into(), made_by, ..Provenance::default() }, set })
    }

    /// Reads a text; `name` stands for the file in errors.
    ///
    /// # Errors
    /// The first error in the text, with line and key.
    pub fn parse(name: &str, text: &str) -> Result<Self, FileError> {
        Self::of(&TomlFile::of_text(name, text.into()).top(MAKE_AGAIN)?)
    }

    fn of(top: &Top<'_>) -> Result<Self, FileError> {
        top.layout(FileKind::Generator, &[(SCHEMA, &["schema", "generator", "provenance", KIND])])?;
        let kind: String = top.get("generator")?;
        if kind != KIND {
            let problem = Problem::Type { found: format!("the text \"{kind}\""), allowed: format!("\"{KIND}\"") };
            return Err(top.error("generator", problem));
        }
        let provenance = top.get("provenance")?;
        let set: NetworkSet = top.get(KIND)?;
        match set.not_allowed() {
            None => Ok(Self { provenance, set }),
            Some((key, allowed)) => Err(top.not_allowed(&format!("{KIND}.{key}"), &allowed)),
        }
    }

    /// The text of the file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        // Strings, numbers and tables with scalars first: TOML can represent all of them.
        toml::to_string(self).unwrap_or_default()
    }
}

impl Serialize for NetworkFile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize(serializer, KIND, &self.provenance, &self.set)
    }
}

/// What a generator file holds, where any number of joints is allowed.
// There are few of them.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum HostGenerator {
    /// A generator of hips and knees, which a board can run.
    FourJoints(GeneratorFile),
    /// A network of six or eight joints.
    Network(NetworkFile),
}

impl HostGenerator {
    /// Reads a file.
    ///
    /// # Errors
    /// The first error in the file, with line and key.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of(&TomlFile::read(path)?)
    }

    /// Reads a text; `name` stands for the file in errors.
    ///
    /// # Errors
    /// As [`HostGenerator::read`].
    pub fn parse(name: &str, text: &str) -> Result<Self, FileError> {
        Self::of(&TomlFile::of_text(name, text.into()))
    }

    fn of(file: &TomlFile) -> Result<Self, FileError> {
        let top = file.top(MAKE_AGAIN)?;
        if top.has(LIST_OF_JOINTS) {
            return NetworkFile::of(&top).map(Self::Network);
        }
        GeneratorFile::of(file).map(Self::FourJoints)
    }

    /// The text of the file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        match self {
            Self::FourJoints(file) => file.to_toml(),
            Self::Network(file) => file.to_toml(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_make_an_exact_round_trip() {
        for (name, joints) in [("six-joints", 6), ("eight-joints", 8)] {
            let file = NetworkFile::default_of(name).unwrap();
            assert_eq!(file.set.joints.len(), joints);
            let text = file.to_toml();
            assert_eq!(NetworkFile::parse("x.toml", &text).unwrap_or_else(|e| panic!("{e}\n{text}")), file);
        }
    }

    #[test]
    fn four_joints_are_asked_for_in_words() {
        for name in NetworkFile::DEFAULTS {
            let text = NetworkFile::default_of(name).unwrap().to_toml();
            let error = GeneratorFile::parse("x.toml", &text).unwrap_err().to_string();
            assert!(error.starts_with("x.toml:"), "{error}");
            for part in ["six or eight joints", "drives four joints", "without `--joints`", "footfall certify"] {
                assert!(error.contains(part), "{error}");
            }
        }
    }

    #[test]
    fn errors_name_the_key_and_what_is_allowed() {
        let text = NetworkFile::default_of("six-joints").unwrap().to_toml();
        for (from, to, parts) in [
            (
                "name = \"left_ankle\"",
                "name = \"left_toe\"",
                ["joints[4].name", "\"left_ankle\"; the order is left_hip"],
            ),
            (
                "range_deg = [-50.0, 20.0]",
                "range_deg = [20.0, -50.0]",
                ["joints[4].range_deg", "the smaller one first"],
            ),
            ("amplitude_deg = 12.0", "amplitude_deg = 181.0", ["joints[4].amplitude_deg", "from 0 to 180"]),
            ("phase_deg = 140.0", "phase_deg = 400.0", ["joints[4].phase_deg", "from -360 to 360"]),
            (
                "coupling = [0.5, ",
                "coupling = [",
                ["phase-coupled.coupling", "7 numbers, one a link: left_hip - right_hip"],
            ),
            ("coupling = [0.5, ", "coupling = [2.5, ", ["coupling[0]", "from 0 to 2"]),
            ("nonlinearity = 0.5", "nonlinearity = 3.0", ["phase-coupled.nonlinearity", "from 0.01 to 2"]),
            ("offset_deg = 0.0", "offset = 0.0", ["joints[4].offset", "unknown field"]),
        ] {
            assert!(text.contains(from), "{from}\n{text}");
            let error = NetworkFile::parse("x.toml", &text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{to}: {error}");
        }
        let last = text.rfind("[[").unwrap();
        let error = NetworkFile::parse("x.toml", &text[..last]).unwrap_err().to_string();
        assert!(error.contains("is a list of 5; allowed is a list of 6 joints"), "{error}");
    }
}
