//! The single oscillators that can be named, with their parameters, ranges and time scales.

mod flow;
mod kind;
mod kinds;

use generator_file::model::Model;

pub use kind::{Kind, Parameter};
pub use kinds::KINDS;

/// Longest step of the integration: the longest that a control period can have, of an oscillator in seconds.
const LONGEST_STEP: f64 = 0.1;

/// An oscillator with its parameters.
#[derive(Debug, Clone)]
pub struct Oscillator {
    /// Its kind.
    pub kind: &'static Kind,
    /// Values of its parameters.
    pub values: Vec<f64>,
}

impl Oscillator {
    /// The oscillator of a name, with the default parameters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let kind = KINDS.iter().find(|kind| kind.name == name)?;
        Some(Self { kind, values: kind.parameters.iter().map(|parameter| parameter.default).collect() })
    }

    /// The same with another value of a parameter.
    ///
    /// # Errors
    /// No such parameter, or a value that is not allowed; the text says what is.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, String> {
        let Some(index) = self.kind.parameters.iter().position(|parameter| parameter.name == name) else {
            let names: Vec<&str> = self.kind.parameters.iter().map(|parameter| parameter.name).collect();
            return Err(format!("`{name}`: allowed is one of {}", names.join(", ")));
        };
        let Parameter { least, most, .. } = self.kind.parameters[index];
        if !(least..=most).contains(&value) {
            return Err(format!("{name} = {value}: allowed is {least} to {most}"));
        }
        let mut changed = self.clone();
        changed.values[index] = value;
        Ok(changed)
    }

    /// About half the range of each state on the cycle.
    #[must_use]
    pub fn scale(&self) -> Vec<f64> {
        (self.kind.scale)(&self.values)
    }

    /// About how long a cycle is, in the unit of its time.
    #[must_use]
    pub fn cycle(&self) -> f64 {
        (self.kind.cycle)(&self.values)
    }

    /// A step of the integration, short enough for its fastest state.
    #[must_use]
    pub fn step(&self) -> f64 {
        (self.cycle() / 200.0).min(0.5 / (self.kind.rate)(&self.values)).min(LONGEST_STEP)
    }

    /// The model at a step of the integration.
    ///
    /// # Errors
    /// The step is too long for it.
    pub fn model(&self, step: f64) -> Result<Box<dyn Model>, String> {
        (self.kind.build)(self.kind, &self.values, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_complete_and_runs() {
        for kind in KINDS {
            let oscillator = Oscillator::named(kind.name).expect("listed");
            assert_eq!((kind.start.len(), oscillator.scale().len()), (kind.variables.len(), kind.variables.len()));
            assert!(kind.parameters.iter().all(|p| (p.least..=p.most).contains(&p.default)), "{}", kind.name);
            let mut model = oscillator.model(oscillator.step()).expect(kind.name);
            assert_eq!(model.names(), kind.variables, "{}", kind.name);
            assert!(model.advance(1000) && model.state().iter().all(|x| x.is_finite()), "{}", kind.name);
        }
    }

    #[test]
    fn wrong_parameters_are_named_with_what_is_allowed() {
        let oscillator = Oscillator::named("van-der-pol").expect("listed");
        assert_eq!(oscillator.with("nu", 1.0).unwrap_err(), "`nu`: allowed is one of mu");
        assert_eq!(oscillator.with("mu", -1.0).unwrap_err(), "mu = -1: allowed is 0.001 to 50");
        assert!(oscillator.with("mu", f64::NAN).is_err() && Oscillator::named("pendulum").is_none());
    }
}
