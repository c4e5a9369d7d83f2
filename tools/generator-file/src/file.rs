//! The generator file: kind of generator, its numbers with their units in the keys, and their provenance.
//!
//! ```toml
//! schema = 2
//! generator = "shape"            # a kind of joint_loop::GeneratorConfig::NAMES
//!
//! [provenance]                   # texts, which may be empty
//! source = "..."
//! source_sha256 = "..."
//! made_by = "..."
//! settings = "..."
//!
//! [shape]                        # the table of the kind
//! stride_s = 1.1
//! ...
//! ```
//! Layout and ranges of a kind's table are in its file in `joint-loop/src/generator`. Numbers are written in the shortest form that reads
//! back to the same bits. Every key is required, except `events` of a follower, whose default is `none`.

use std::path::Path;

use cpg_core::gait::default_walk::default_config;
use cpg_core::network::thesis::ThesisConfig;
use joint_loop::GeneratorConfig;
pub use joint_loop::SERIES_HARMONICS;
pub use joint_loop::generator::GeneratorSet;
pub use joint_loop::generator::follow::{CorrectionsSet, FollowSet};
pub use joint_loop::generator::phase_coupled::{PhaseCoupledJoint, PhaseCoupledSet};
pub use joint_loop::generator::shape::{Coefficients, ShapeJoint, ShapeSet};
pub use joint_loop::generator::thesis::{ThesisJoint, ThesisSet};
use joint_loop::generator::{Allowed, SetError};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};

use crate::toml_file::{FileError, FileKind, Problem, TomlFile};

/// Version of the layout. In version 1 the kind `phase-coupled` was called `robust`.
pub const SCHEMA: u32 = 2;

/// How a correct file is made, for errors.
pub(crate) const MAKE_AGAIN: &str = "make the file again with `footfall fit` or `footfall defaults generator`";

/// The key that only a network of six or eight joints has ([`crate::network_file`]).
pub(crate) const LIST_OF_JOINTS: &str = "phase-coupled.joints";

/// Why such a network is refused where a generator of four joints is needed.
const HOST_ONLY: &str = "is the list of a network of six or eight joints, which runs on the host only: the control loop of the boards drives four \
    joints, hips and knees. Allowed here is a generator of four joints, as `footfall fit RECORDING` makes it without `--joints`; \
    `footfall certify` and `footfall walk --generator` take this file";

/// Provenance of the parameters. All texts may be empty.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The recording, or `default`.
    pub source: String,
    /// SHA-256 of the recording, in hex.
    pub source_sha256: String,
    /// Program and version.
    pub made_by: String,
    /// Method, seed and other options.
    pub settings: String,
}

/// A generator file.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneratorFile {
    /// Provenance of the numbers.
    pub provenance: Provenance,
    /// The numbers.
    pub set: GeneratorSet,
}

impl GeneratorFile {
    /// Names of [`GeneratorFile::default_of`].
    pub const DEFAULTS: [&str; 3] = ["phase-coupled", "thesis", "thesis-double"];

    /// A default: `phase-coupled` (the default walk), `thesis` (Table 1, set S), `thesis-double` (set D).
    #[must_use]
    pub fn default_of(name: &str) -> Option<Self> {
        let set = match name {
            "phase-coupled" => GeneratorSet::PhaseCoupled(PhaseCoupledSet::rounded(&default_config())),
            "thesis" => GeneratorSet::Thesis(ThesisSet::rounded(&ThesisConfig::set_s())),
            "thesis-double" => GeneratorSet::Thesis(ThesisSet::rounded(&ThesisConfig::set_d())),
            _ => return None,
        };
        let made_by = format!("footfall {}", env!("CARGO_PKG_VERSION"));
        Some(Self { provenance: Provenance { source: "default".into(), made_by, ..Provenance::default() }, set })
    }

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
    /// As [`GeneratorFile::read`].
    pub fn parse(name: &str, text: &str) -> Result<Self, FileError> {
        Self::of(&TomlFile::of_text(name, text.into()))
    }

    pub(crate) fn of(file: &TomlFile) -> Result<Self, FileError> {
        let top = file.top(MAKE_AGAIN)?;
        let keys: Vec<&str> =
            ["schema", "generator", "provenance"].into_iter().chain(GeneratorConfig::NAMES.iter().copied()).collect();
        top.layout(FileKind::Generator, &[(SCHEMA, &keys)])?;
        let kind: String = top.get("generator")?;
        let allowed = || format!("one of {}", quoted(GeneratorConfig::NAMES));
        let unknown_kind =
            || top.error("generator", Problem::Type { found: format!("the text \"{kind}\""), allowed: allowed() });
        if !GeneratorConfig::NAMES.contains(&kind.as_str()) {
            return Err(unknown_kind());
        }
        // The table of another kind is an error.
        top.only(&["schema", "generator", "provenance", &kind])?;
        if top.has(LIST_OF_JOINTS) {
            return Err(top.error(LIST_OF_JOINTS, Problem::Rule(HOST_ONLY.into())));
        }
        let provenance: Provenance = top.get("provenance")?;
        let set = top
            .get_with(&kind, |table| GeneratorSet::deserialize(&kind, table).transpose())?
            .ok_or_else(unknown_kind)?;
        match set.check() {
            Ok(()) => Ok(Self { provenance, set }),
            Err(SetError::Value { key, allowed }) => {
                let range = match allowed {
                    Allowed::Range { least, most, .. } => Some(least..=most),
                    Allowed::Finite => Some(f32::MIN..=f32::MAX),
                    _ => None,
                };
                let path = format!("{kind}.{key}");
                // The configuration may know of a list only that one of its numbers is wrong.
                let path = range.and_then(|range| top.outside(&path, &range)).unwrap_or(path);
                Err(top.not_allowed(&path, &allowed.to_string()))
            }
            Err(rule) => Err(top.error(&kind, Problem::Rule(rule.to_string()))),
        }
    }

    /// The text of the file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        // Strings, numbers and tables with scalars first: TOML can represent all of them.
        toml::to_string(self).unwrap_or_default()
    }
}

impl Serialize for GeneratorFile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize(serializer, self.set.name(), &self.provenance, &self.set)
    }
}

/// The keys at the top of a generator file, in their order.
pub(crate) fn serialize<S: Serializer, T: Serialize>(
    serializer: S,
    kind: &str,
    provenance: &Provenance,
    set: &T,
) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(4))?;
    map.serialize_entry("schema", &SCHEMA)?;
    map.serialize_entry("generator", kind)?;
    map.serialize_entry("provenance", provenance)?;
    map.serialize_entry(kind, set)?;
    map.end()
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::Generator;
    use cpg_core::entrainment::EventSource;
    use joint_units::{Joint, Period};

    fn coefficients(numbers: &[f32]) -> Coefficients {
        Coefficients::new(numbers).expect("1 to 8")
    }

    fn shape() -> GeneratorFile {
        let joint = |mean_deg| ShapeJoint {
            mean_deg,
            cos_deg: coefficients(&[20.1, 0.3, -1.25]),
            sin_deg: coefficients(&[1e-7, -3.3333333, 0.1]),
        };
        let set = GeneratorSet::Shape(ShapeSet {
            stride_s: 1.123_456_7,
            joints: [joint(1.0), joint(2.0), joint(30.0), joint(31.5)],
        });
        let source = "a \"quoted\" name\\with\nnewline".to_string();
        GeneratorFile { provenance: Provenance { source, ..Provenance::default() }, set }
    }

    fn files() -> Vec<GeneratorFile> {
        let mut files: Vec<_> =
            ["phase-coupled", "thesis", "thesis-double"].map(|name| GeneratorFile::default_of(name).unwrap()).into();
        files.push(shape());
        let GeneratorSet::Shape(inner) = shape().set else { unreachable!() };
        files.push(GeneratorFile {
            set: GeneratorSet::Follow(FollowSet {
                sensor: Joint::RightKnee,
                events: EventSource::FootSwitch,
                shape: inner,
                corrections: None,
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

    /// The default file builds the default walk of the board: the same bits after a minute.
    #[test]
    fn the_default_file_is_the_default_walk() {
        let set = GeneratorFile::default_of("phase-coupled").unwrap().set;
        let mut from_file = set.build(Period::MILLISECOND).unwrap();
        let mut built_in = cpg_core::gait::default_walk::default_walk(Period::MILLISECOND).unwrap();
        for _ in 0..60_000 {
            from_file.step();
            built_in.step();
        }
        assert_eq!(from_file.angles(), built_in.angles());
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

    /// serde leaves the rest of a list unread.
    #[test]
    fn a_list_that_is_too_long_is_refused() {
        for file in files() {
            let text = file.to_toml();
            for (index, line) in text.lines().enumerate().filter(|(_, line)| line.contains(" = [")) {
                let one_more = if line.contains("[[") { ", [1.0, 1.0]]" } else { ", 1.0]" };
                let longer = line.strip_suffix(']').expect("a list on one line").to_owned() + one_more;
                let mut lines: Vec<&str> = text.lines().collect();
                lines[index] = &longer;
                let error = GeneratorFile::parse("x.toml", &lines.join("\n")).expect_err(&longer).to_string();
                assert!(error.contains("allowed is"), "{longer}: {error}");
            }
        }
    }

    /// Every number of every list, out of range and of another type: the error names its index and its value.
    #[test]
    fn each_broken_number_of_a_list_is_named_with_index_and_value() {
        let mut broken = 0;
        for file in files() {
            let text = file.to_toml();
            let kind = file.set.name();
            for (line, list) in text.lines().enumerate().filter(|(_, line)| line.contains(" = [")) {
                let (key, list) = list.split_once(" = [").expect("a list");
                let numbers: Vec<&str> = list.trim_end_matches(']').split(", ").collect();
                for index in 0..numbers.len() {
                    for value in ["1e9", "nan", "\"much\"", "true"] {
                        let mut changed = numbers.clone();
                        changed[index] = value;
                        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
                        lines[line] = format!("{key} = [{}]", changed.join(", "));
                        let error =
                            GeneratorFile::parse("x.toml", &lines.join("\n")).expect_err(&lines[line]).to_string();
                        let (place, shown) = (format!("{key}[{index}]`: is "), value.trim_matches('"'));
                        assert!(
                            error.starts_with(&format!("x.toml:{}: field `{kind}.", line + 1))
                                && error.contains(&place)
                                && error.split_once(&place).is_some_and(|(_, rest)| rest.contains(shown))
                                && error.contains("allowed is a"),
                            "{}: {error}",
                            lines[line]
                        );
                        broken += 1;
                    }
                }
            }
        }
        assert!(broken > 200, "{broken}");
    }

    /// Every numeric field broken in turn: the error names file, line and field, and says what is allowed.
    #[test]
    fn each_broken_field_is_named_with_its_line() {
        for file in files() {
            let text = file.to_toml();
            for (index, line) in text.lines().enumerate() {
                let Some((key, value)) = line.split_once(" = ") else { continue };
                // The rest of a text of several lines would be the first error.
                if value == "\"\"\"" || value == "'''" {
                    continue;
                }
                for (broken, wanted) in [
                    (format!("{key} = nan"), "allowed"),
                    (format!("{key}x = 1"), "unknown field"),
                    (format!("{key} = @"), "TOML"),
                ] {
                    let mut lines: Vec<&str> = text.lines().collect();
                    lines[index] = &broken;
                    let error =
                        GeneratorFile::parse("generator.toml", &lines.join("\n")).expect_err(&broken).to_string();
                    assert!(error.starts_with(&format!("generator.toml:{}: ", index + 1)), "{broken}: {error}");
                    assert!(error.contains(wanted) && error.contains("allowed"), "{broken}: {error}");
                    assert!(wanted == "TOML" || error.contains(key), "{broken}: {error}");
                }
            }
        }
    }
}
