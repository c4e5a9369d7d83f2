//! Decodes a point of the unit box to a network: which parameters are free, and their ranges.

use gait_fit::search::Network;

/// A parameter that each joint has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// alpha.
    Alpha,
    /// Gain of the difference link.
    Difference,
    /// Gain of the product link.
    Product,
    /// p.
    P,
    /// mu.
    Mu,
    /// a0.
    Offset,
    /// Displacement at the start.
    Displacement,
    /// Velocity at the start.
    Velocity,
}

impl Parameter {
    /// Lowest and highest value, and whether a gene moves on a logarithmic scale between them. The thesis states no ranges; these
    /// contain its Table 1 with a margin.
    ///
    /// | parameter | range | scale |
    /// |---|---|---|
    /// | alpha | 0 to 0.05 1/s | linear |
    /// | gain of a difference link | 0 to 1 1/s | linear |
    /// | gain of a product link | 0 to 0.05 1/(deg s) | linear |
    /// | p | 0.001 to 0.1 (s/deg)^2 | logarithmic |
    /// | mu | 4 to 8 rad/s | linear |
    /// | a0 | -30 to 60 deg | linear |
    /// | displacement at the start | -60 to 60 deg | linear |
    /// | velocity at the start | -400 to 400 deg/s | linear |
    #[must_use]
    pub const fn range(self) -> (f64, f64, bool) {
        match self {
            Parameter::Alpha | Parameter::Product => (0.0, 0.05, false),
            Parameter::Difference => (0.0, 1.0, false),
            Parameter::P => (1e-3, 0.1, true),
            Parameter::Mu => (4.0, 8.0, false),
            Parameter::Offset => (-30.0, 60.0, false),
            Parameter::Displacement => (-60.0, 60.0, false),
            Parameter::Velocity => (-400.0, 400.0, false),
        }
    }

    fn of(self, network: &mut Network, joint: usize) -> &mut f64 {
        let own = &mut network.joints[joint];
        match self {
            Parameter::Alpha => &mut own.alpha,
            Parameter::Difference => &mut own.difference,
            Parameter::Product => &mut own.product,
            Parameter::P => &mut own.p,
            Parameter::Mu => &mut own.mu,
            Parameter::Offset => &mut own.offset,
            Parameter::Displacement => &mut network.start.displacement[joint],
            Parameter::Velocity => &mut network.start.velocity[joint],
        }
    }
}

/// The free parameters, four genes for each; all others are those of `base`.
///
/// ```
/// use gait_fit::search::Network;
/// use reproduce::{Genes, Parameter, set_s};
/// let genes = Genes::thesis(set_s());
/// assert_eq!(genes.count(), 12);
/// let network = genes.decode(&[0.5; 12]);
/// assert_eq!(network.joints[2].difference, 0.5);
/// assert_eq!(network.joints[2].p, set_s().joints[2].p);
/// assert_eq!(genes.and(&[Parameter::P, Parameter::Mu]).count(), 20);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Genes {
    base: Network,
    free: Vec<Parameter>,
}

impl Genes {
    /// These parameters, all others fixed.
    #[must_use]
    pub fn of(base: Network, free: &[Parameter]) -> Self {
        Self { base, free: vec![] }.and(free)
    }

    /// The chromosome of the thesis: 8 gains, 4 alpha.
    #[must_use]
    pub fn thesis(base: Network) -> Self {
        Self::of(base, &[Parameter::Difference, Parameter::Product, Parameter::Alpha])
    }

    /// The same with more parameters free.
    #[must_use]
    pub fn and(mut self, more: &[Parameter]) -> Self {
        for &parameter in more {
            if !self.free.contains(&parameter) {
                self.free.push(parameter);
            }
        }
        self
    }

    /// All 32 parameters.
    #[must_use]
    pub fn all(base: Network) -> Self {
        use Parameter::{Displacement, Mu, Offset, P, Velocity};
        Self::thesis(base).and(&[P, Mu, Offset, Displacement, Velocity])
    }

    /// Number of genes.
    #[must_use]
    pub fn count(&self) -> usize {
        4 * self.free.len()
    }

    /// The network of a point of the unit box; coordinates outside are clamped to it.
    #[must_use]
    pub fn decode(&self, point: &[f64]) -> Network {
        let mut network = self.base;
        for (index, gene) in point.iter().enumerate().take(self.count()) {
            let parameter = self.free[index / 4];
            let (low, high, logarithmic) = parameter.range();
            let part = gene.clamp(0.0, 1.0);
            let value = if logarithmic {
                libm::exp(libm::log(low) + part * (libm::log(high) - libm::log(low)))
            } else {
                low + part * (high - low)
            };
            *parameter.of(&mut network, index % 4) = value;
        }
        network
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table_1::set_s;

    #[test]
    fn each_gene_changes_one_parameter_over_its_range() {
        let base = set_s();
        let genes = Genes::all(base);
        assert_eq!(genes.count(), 32);
        let numbers = |network: &Network| -> Vec<f64> {
            let joint = |j: &gait_fit::search::Oscillator| [j.alpha, j.difference, j.product, j.p, j.mu, j.offset];
            let start = network.start.displacement.iter().chain(&network.start.velocity);
            network.joints.iter().flat_map(joint).chain(start.copied()).collect()
        };
        let middle = numbers(&genes.decode(&[0.5; 32]));
        for gene in 0..32 {
            let (low, high, _) = genes.free[gene / 4].range();
            for (at, value) in [(0.0, low), (1.0, high), (-3.0, low), (9.0, high)] {
                let mut point = [0.5; 32];
                point[gene] = at;
                let moved = numbers(&genes.decode(&point));
                let changed: Vec<f64> = moved.iter().zip(&middle).filter(|(a, b)| a != b).map(|(a, _)| *a).collect();
                assert!(changed.len() == 1 && (changed[0] - value).abs() < 1e-12, "gene {gene} at {at}: {changed:?}");
            }
        }
    }
}
