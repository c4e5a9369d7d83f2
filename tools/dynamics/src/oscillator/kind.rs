//! What is known of a kind of oscillator: names, parameters, ranges, time scales.

use generator_file::model::Model;

/// A parameter of an oscillator.
#[derive(Debug)]
pub struct Parameter {
    /// Name, as in the type of `cpg_core::oscillator`.
    pub name: &'static str,
    /// Value without another one.
    pub default: f64,
    /// Smallest allowed value.
    pub least: f64,
    /// Largest allowed value.
    pub most: f64,
}

/// Makes a model of these parameters at this period, s.
type Build = fn(&Kind, &[f64], f64) -> Result<Box<dyn Model>, String>;

/// A kind of oscillator. Functions take the parameters in their order.
#[derive(Debug)]
pub struct Kind {
    /// Name behind `oscillator:`.
    pub name: &'static str,
    /// What it is, in words.
    pub what: &'static str,
    /// Unit of its time, for axes.
    pub time_unit: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Names of its states.
    pub variables: &'static [&'static str],
    /// Where it starts.
    pub start: &'static [f64],
    /// About half the range of each state on the cycle.
    pub(super) scale: fn(&[f64]) -> Vec<f64>,
    /// About how long a cycle is.
    pub(super) cycle: fn(&[f64]) -> f64,
    /// About the fastest rate of its states.
    pub(super) rate: fn(&[f64]) -> f64,
    /// The model at a step of the integration.
    pub(super) build: Build,
}
