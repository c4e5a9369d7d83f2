//! What can be analysed: a single oscillator by name, or a generator by name or from a file, with changed parameters.

use std::path::Path;

use generator_file::file::GeneratorFile;
use generator_file::model::Model;
use generator_file::subject::Subject;
use joint_units::Period;

use crate::oscillator::{KINDS, Oscillator};

/// What stands before the name of a single oscillator.
pub const PREFIX: &str = "oscillator:";
/// Steps a stride of a generator, at most.
const STEPS: f64 = 200.0;

/// What is analysed.
// There are few of them.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone)]
pub enum System {
    /// A single oscillator.
    Oscillator(Oscillator),
    /// A generator.
    Generator(Subject),
}

impl System {
    /// The system of a text: `oscillator:NAME`, a name of [`Subject::names`], or the path of a generator file.
    ///
    /// # Errors
    /// There is none of the name, or the file cannot be read; the text says what is allowed.
    pub fn read(text: &str) -> Result<Self, String> {
        let known = || {
            let oscillators = KINDS.iter().map(|kind| format!("{PREFIX}{}", kind.name));
            oscillators.chain(Subject::names().into_iter().map(|(name, _)| name.to_owned())).collect::<Vec<_>>()
        };
        if let Some(name) = text.strip_prefix(PREFIX) {
            let found = Oscillator::named(name).map(Self::Oscillator);
            return found.ok_or_else(|| {
                let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
                format!("`{text}`: allowed behind `{PREFIX}` is one of {}", names.join(", "))
            });
        }
        let path = Path::new(text);
        match Subject::named(text).filter(|_| !path.exists()) {
            Some(subject) => Ok(Self::Generator(subject)),
            // A word without an ending is a name, else the name of a file.
            None if !path.exists() && path.extension().is_none() && path.components().count() == 1 => {
                Err(format!("`{text}`: allowed is a generator file, or one of {}", known().join(", ")))
            }
            None => {
                Ok(Self::Generator(Subject::Set(GeneratorFile::read(path).map_err(|error| error.to_string())?.set)))
            }
        }
    }

    /// The same with another value of a parameter: one of an oscillator, or a number in the table of a generator file, as
    /// `nonlinearity`, `coupling.hips` or `left_hip.amplitude_deg`.
    ///
    /// # Errors
    /// No such parameter, or a value that is not allowed; the text says what is.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, String> {
        match self {
            Self::Oscillator(oscillator) => Ok(Self::Oscillator(oscillator.with(name, value)?)),
            Self::Generator(Subject::Set(set)) => {
                let file = GeneratorFile { provenance: Default::default(), set: set.clone() };
                let mut table: toml::Table =
                    file.to_toml().parse().map_err(|error: toml::de::Error| error.to_string())?;
                let kind = table.get_mut(set.name()).ok_or("a generator file without its table")?;
                let Some(number) = number(kind, name) else {
                    let mut names = vec![];
                    list(kind, "", &mut names);
                    return Err(format!("`{name}`: allowed is one of {}", names.join(", ")));
                };
                *number = toml::Value::Float(value);
                let changed =
                    GeneratorFile::parse("", &table.to_string()).map_err(|error| without_place(&error.to_string()))?;
                Ok(Self::Generator(Subject::Set(changed.set)))
            }
            Self::Generator(_) => Err(format!(
                "`{name}`: this generator has no parameters; allowed is a generator file, phase-coupled, thesis, thesis-double or {PREFIX}NAME"
            )),
        }
    }

    /// Unit of time, for axes.
    #[must_use]
    pub fn time_unit(&self) -> &'static str {
        match self {
            Self::Oscillator(oscillator) => oscillator.kind.time_unit,
            Self::Generator(_) => "s",
        }
    }

    /// About how long a cycle is, in its unit of time.
    #[must_use]
    pub fn cycle(&self) -> f64 {
        match self {
            Self::Oscillator(oscillator) => oscillator.cycle(),
            Self::Generator(subject) => subject.stride_guess_s(),
        }
    }

    /// A model of it, and the time of one of its steps.
    ///
    /// # Errors
    /// It cannot be built, or its only state is a phase; the text says why.
    pub fn model(&self) -> Result<(Box<dyn Model>, f64), String> {
        self.model_in_parts(1)
    }

    /// The same with a step that is divided by `parts`.
    ///
    /// # Errors
    /// As [`System::model`].
    pub fn model_in_parts(&self, parts: u32) -> Result<(Box<dyn Model>, f64), String> {
        let subject = match self {
            Self::Oscillator(oscillator) => {
                let step = oscillator.step() / f64::from(parts);
                return Ok((oscillator.model(step)?, step));
            }
            Self::Generator(subject) => subject,
        };
        let mut micros = (1e6 * self.cycle() / STEPS).clamp(1.0, f64::from(Period::MAX_MICROS)) as u32;
        loop {
            let part = (micros / parts).max(1);
            let period = Period::from_micros(part).ok_or("no such step")?;
            match subject.model(period) {
                Ok(Some(model)) => return Ok((model, f64::from(part) * 1e-6)),
                Ok(None) => return Err(ONLY_A_PHASE.into()),
                // A stiff model allows only shorter steps.
                Err(_) if micros > 1_000 => micros = (micros / 2).max(1_000),
                Err(why) => return Err(why),
            }
        }
    }

    /// About half the range of each state on the cycle.
    ///
    /// # Errors
    /// As [`System::model`].
    pub fn scale(&self) -> Result<Vec<f64>, String> {
        if let Self::Oscillator(oscillator) = self {
            return Ok(oscillator.scale());
        }
        let (mut model, step) = self.model()?;
        if model.has_joint_states() {
            return Ok(vec![1.0; model.state().len()]);
        }
        let stride = (self.cycle() / step).ceil() as usize;
        model.advance(20 * stride);
        let (mut least, mut most) = (model.state(), model.state());
        for _ in 0..2 * stride {
            model.advance(1);
            for (index, value) in model.state().into_iter().enumerate() {
                (least[index], most[index]) = (least[index].min(value), most[index].max(value));
            }
        }
        Ok(least.iter().zip(&most).map(|(least, most)| (0.5 * (most - least)).max(1e-3)).collect())
    }

    /// The index of the state that a kick or an input acts on: that of this name; without one the first, or, of a network of joints, the velocity of
    /// the first joint.
    ///
    /// # Errors
    /// There is none; the text lists them.
    pub fn kicked(&self, name: Option<&str>) -> Result<usize, String> {
        if let Some(name) = name {
            return self.variable(name).map_err(|why| format!("--variable {why}"));
        }
        let (model, _) = self.model()?;
        Ok(if model.has_joint_states() { model.names().len() / 2 } else { 0 })
    }

    /// The index of a state of this name.
    ///
    /// # Errors
    /// There is none; the text lists them.
    pub fn variable(&self, name: &str) -> Result<usize, String> {
        let names = self.model()?.0.names();
        let found = names.iter().position(|known| known == name);
        found.ok_or_else(|| format!("`{name}`: allowed is one of {}", names.join(", ")))
    }
}

/// Why a generator has no phase response, no basin and no bifurcation.
pub const ONLY_A_PHASE: &str = "its only state is a phase, which every kick shifts by the kick; allowed are networks of oscillators and models of the catalogue";

/// The number behind a path such as `left_hip.amplitude_deg`.
fn number<'t>(table: &'t mut toml::Value, path: &str) -> Option<&'t mut toml::Value> {
    let place = path.split('.').try_fold(table, |place, key| place.get_mut(key))?;
    (place.is_float() || place.is_integer()).then_some(place)
}

/// The paths of all numbers.
fn list(value: &toml::Value, path: &str, names: &mut Vec<String>) {
    match value {
        toml::Value::Float(_) | toml::Value::Integer(_) => names.push(path.to_owned()),
        toml::Value::Table(table) => {
            let dot = if path.is_empty() { "" } else { "." };
            table.iter().for_each(|(key, value)| list(value, &format!("{path}{dot}{key}"), names));
        }
        _ => {}
    }
}

/// The text of a file's error without the place in a file that nobody wrote.
fn without_place(text: &str) -> String {
    let is_place = |part: &str| part.chars().all(|c| c.is_ascii_digit());
    let mut rest = text;
    while let Some((first, after)) = rest.split_once(':').filter(|(first, _)| is_place(first)) {
        let _ = first;
        rest = after;
    }
    rest.trim_start().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_nothing_has_is_answered_with_a_list() {
        for wrong in ["oscillator:pendulum", "canter"] {
            let error = System::read(wrong).unwrap_err();
            assert!(error.contains(wrong) && error.contains("van-der-pol"), "{error}");
        }
        assert!(System::read("nowhere/at.toml").unwrap_err().contains("at.toml"));
    }

    #[test]
    fn numbers_of_a_generator_file_are_parameters() {
        let walk = System::read("phase-coupled").unwrap();
        let changed = walk.with("coupling.knees", 0.25).unwrap().with("left_knee.amplitude_deg", 12.0).unwrap();
        let System::Generator(Subject::Set(set)) = changed else { panic!("a set") };
        let generator_file::file::GeneratorSet::PhaseCoupled(set) = set else { panic!("of R1") };
        assert_eq!((set.coupling[1], set.joints[2].amplitude_deg), (0.25, 12.0));
        let error = walk.with("coupling.ankles", 0.25).unwrap_err();
        assert!(error.contains("coupling.left_leg") && error.contains("nonlinearity"), "{error}");
        let error = walk.with("nonlinearity", 7.0).unwrap_err();
        assert!(error.contains("nonlinearity") && error.contains("allowed") && !error.starts_with(':'), "{error}");
        assert!(System::read("hopf").unwrap().with("gain", 1.0).is_err());
    }

    #[test]
    fn a_state_has_the_name_of_its_joint() {
        let walk = System::read("phase-coupled").unwrap();
        assert_eq!(walk.variable("right_knee.velocity"), Ok(7));
        assert!(walk.variable("elbow").unwrap_err().contains("left_hip.displacement"));
        assert!(System::read("fourier").unwrap().model().is_err());
    }
}
