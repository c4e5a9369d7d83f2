//! A walker's parameters from TOML: every number within its range, the first that is not named with its line.

use std::path::Path;

use cpg_core::entrainment::EventSource;
use joint_units::{Joint, Period};

use super::{
    FOLLOW, FollowSet, GeneratorFile, GeneratorSet, LINKS, PROVENANCE, Provenance, ROBUST, RobustJoint, RobustSet,
    SCHEMA, SERIES_HARMONICS, SHAPE, ShapeJoint, ShapeSet, THESIS, ThesisJoint, ThesisSet,
};
use crate::toml_table::{Document, FileError, Problem, Section};

impl GeneratorFile {
    /// Reads a file.
    ///
    /// # Errors
    /// The first thing that is wrong with it, with line and field.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of(&Document::read(path)?)
    }

    /// Reads a text; `name` is what errors call it.
    ///
    /// # Errors
    /// As [`GeneratorFile::read`].
    pub fn parse(name: &str, text: &str) -> Result<Self, FileError> {
        Self::of(&Document::of_text(name, text.into()))
    }

    fn of(document: &Document) -> Result<Self, FileError> {
        let tree = document.parse()?;
        let kinds = ["robust", "thesis", "shape", "follow"];
        let all = ["schema", "generator", "provenance", "robust", "thesis", "shape", "follow"];
        let top = document.top(tree.get_ref(), &all)?;
        top.schema(SCHEMA)?;
        let kind = top.word("generator", &kinds.map(|kind| (kind, kind)))?;
        // Numbers of a generator that is not asked for are a mistake, not a reserve.
        let top = document.top(tree.get_ref(), &["schema", "generator", "provenance", kind])?;
        let from = top.table("provenance", &PROVENANCE)?;
        let provenance = Provenance {
            source: from.text("source")?,
            source_sha256: from.text("source_sha256")?,
            made_by: from.text("made_by")?,
            settings: from.text("settings")?,
        };
        let set = match kind {
            "robust" => GeneratorSet::Robust(robust(&top)?),
            "thesis" => GeneratorSet::Thesis(read_thesis(&top)?),
            "shape" => GeneratorSet::Shape(shape(&top.table("shape", &SHAPE)?)?),
            _ => {
                let section = top.table("follow", &FOLLOW)?;
                let sensor = section.word("sensor", &Joint::ALL.map(|joint| (joint.name(), joint)))?;
                let events = if section.has("events") {
                    section.word("events", &EventSource::ALL.map(|source| (source.name(), source)))?
                } else {
                    EventSource::None
                };
                GeneratorSet::Follow(FollowSet { sensor, events, shape: shape(&section)? })
            }
        };
        // The core has the last word: relations between numbers are its rules.
        match set.generator(Period::MILLISECOND) {
            Ok(_) => Ok(Self { provenance, set }),
            Err(rule) => Err(document.at(kind, Problem::Rule(rule))),
        }
    }
}

/// Reads each joint's table.
fn joints<T: Clone>(
    section: &Section<'_>,
    fields: &[&str],
    read: impl Fn(&Section<'_>) -> Result<T, FileError>,
) -> Result<[T; 4], FileError> {
    let mut all = vec![];
    for joint in Joint::ALL {
        all.push(read(&section.table(joint.name(), fields)?)?);
    }
    Ok([all[0].clone(), all[1].clone(), all[2].clone(), all[3].clone()])
}

fn robust(top: &Section<'_>) -> Result<RobustSet, FileError> {
    let section = top.table("robust", &ROBUST)?;
    let links = section.table("coupling", &LINKS)?;
    let mut coupling = [0.0; 4];
    for (kap, name) in coupling.iter_mut().zip(LINKS) {
        *kap = links.number(name, 0.0, 2.0, "")?;
    }
    Ok(RobustSet {
        natural_period_s: section.number("natural_period_s", 0.1, 100.0, " s")?,
        nonlinearity: section.number("nonlinearity", 0.01, 2.0, "")?,
        coupling,
        joints: joints(&section, &["amplitude_deg", "offset_deg", "phase_deg"], |joint| {
            Ok(RobustJoint {
                amplitude_deg: joint.number("amplitude_deg", 0.0, 180.0, " degrees")?,
                offset_deg: joint.number("offset_deg", -180.0, 180.0, " degrees")?,
                phase_deg: joint.number("phase_deg", -360.0, 360.0, " degrees")?,
            })
        })?,
    })
}

fn read_thesis(top: &Section<'_>) -> Result<ThesisSet, FileError> {
    let section = top.table("thesis", &THESIS)?;
    let gains = |table: &str, names: [&str; 2], unit: &str| {
        let table = section.table(table, &names)?;
        let pair = |name: &str| table.pair(name, -10.0, 10.0, unit).map(|(a, b)| [a, b]);
        Ok::<_, FileError>([pair(names[0])?, pair(names[1])?])
    };
    let fields = ["alpha_per_s", "p_s2_per_deg2", "mu_rad_per_s", "offset_deg", "start_phase_deg"];
    Ok(ThesisSet {
        difference_per_s: gains("difference_per_s", ["hips", "knees"], " 1/s")?,
        product_per_deg_s: gains("product_per_deg_s", ["left_leg", "right_leg"], " 1/(deg s)")?,
        joints: joints(&section, &fields, |joint| {
            Ok(ThesisJoint {
                alpha_per_s: joint.number("alpha_per_s", 1e-6, 1000.0, " 1/s")?,
                p_s2_per_deg2: joint.number("p_s2_per_deg2", 1e-12, 1e6, " s^2/deg^2")?,
                mu_rad_per_s: joint.number("mu_rad_per_s", 0.3, 32.0, " rad/s")?,
                offset_deg: joint.number("offset_deg", -180.0, 180.0, " degrees")?,
                start_phase_deg: joint.number("start_phase_deg", -360.0, 360.0, " degrees")?,
            })
        })?,
    })
}

fn shape(section: &Section<'_>) -> Result<ShapeSet, FileError> {
    Ok(ShapeSet {
        stride_s: section.number("stride_s", 0.2, 20.0, " s")?,
        joints: joints(section, &["mean_deg", "cos_deg", "sin_deg"], |joint| {
            let coefficients = |key: &str| joint.numbers(key, (1, SERIES_HARMONICS), (-180.0, 180.0), " degrees");
            let read = ShapeJoint {
                mean_deg: joint.number("mean_deg", -180.0, 180.0, " degrees")?,
                cos_deg: coefficients("cos_deg")?,
                sin_deg: coefficients("sin_deg")?,
            };
            if read.cos_deg.len() != read.sin_deg.len() {
                let rule = format!(
                    "has {} numbers; allowed is as many as `cos_deg`, {}",
                    read.sin_deg.len(),
                    read.cos_deg.len()
                );
                return Err(joint.error_at("sin_deg", Problem::Rule(rule)));
            }
            Ok(read)
        })?,
    })
}
