//! A search problem: the genes that are free, the target, and what is minimised.

use gait_fit::search::Network;

use crate::{Genes, Grid, Objective, Target, angles, errors};

/// The problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct Problem<'a> {
    /// Which numbers of a network are free.
    pub(super) genes: &'a Genes,
    /// What it shall do.
    pub(super) target: &'a Target,
    /// The cost.
    pub(super) objective: Objective,
}

impl Problem<'_> {
    fn networks(&self, points: &[Vec<f64>]) -> Vec<Network> {
        points.iter().map(|point| self.genes.decode(point)).collect()
    }

    /// The costs of points of the unit box.
    pub(super) fn costs(&self, points: &[Vec<f64>]) -> Vec<f64> {
        let needs_rates = self.objective != Objective::ANGLE;
        let errors = errors(&self.networks(points), self.target, Grid::SEARCH, needs_rates);
        errors.iter().map(|errors| self.objective.cost(errors)).collect()
    }

    /// The errors of the angles at every sample; none for a network that diverges.
    pub(super) fn residuals(&self, points: &[Vec<f64>]) -> Vec<Option<Vec<f64>>> {
        let difference = |angles: Vec<[f64; 4]>| -> Option<Vec<f64>> {
            let pairs = angles.iter().zip(&self.target.angles);
            (!angles.is_empty()).then(|| pairs.flat_map(|(a, b)| (0..4).map(move |i| a[i] - b[i])).collect())
        };
        angles(&self.networks(points), self.target, Grid::SEARCH).into_iter().map(difference).collect()
    }
}
