//! The thesis' genetic algorithm ("Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory", IIITA
//! Allahabad), with its settings: population 100, uniform random start, elite 2, selection "remainder", two-point crossover 0.99,
//! uniform mutation 0.001 with gene rate 0.01, 1000 generations, then a pattern search.
//!
//! The thesis used MATLAB's toolbox; settings that it does not state are those of the toolbox:
//! - Scaling: by rank. The expectation of the n-th best is proportional to 1/sqrt(n) and sums to the number of parents wanted.
//! - Selection "remainder": each parent is chosen as often as the integer part of its expectation; the other places are drawn by roulette over the
//!   fractions. Parents are then shuffled.
//! - Crossover 0.99 (its text; its table says 0.999): of the 98 that are not elite, 97 are children of two parents, with
//!   the genes between two cuts from the second.
//! - The other 1 is a mutant: a parent in which each gene is drawn again with probability 0.01 (the gene rate).
//! - Mutation 0.001: each child of a crossover is mutated in the same way with this probability.
//! - Elites keep their costs; they are not evaluated again. So 1000 generations are 100 + 999 x 98 = 98,002 evaluations.

use crate::pattern_search::pattern_search;
use gait_fit::search::{Evaluator, Random};

/// Settings; the defaults are those of the thesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThesisGa {
    /// Individuals, at least 1.
    pub population: usize,
    /// Number of the best individuals that are kept unchanged.
    pub elite: usize,
    /// Fraction of the others that are children of two parents.
    pub crossover: f64,
    /// Probability that such a child is mutated.
    pub mutation: f64,
    /// Probability that a gene of a mutant is drawn again.
    pub gene_rate: f64,
    /// Number of generations, including the first.
    pub generations: usize,
    /// Whether a pattern search follows.
    pub hybrid: bool,
}

impl Default for ThesisGa {
    fn default() -> Self {
        Self {
            population: 100,
            elite: 2,
            crossover: 0.99,
            mutation: 0.001,
            gene_rate: 0.01,
            generations: 1000,
            hybrid: true,
        }
    }
}

impl ThesisGa {
    /// Runs for all generations or until the evaluator is done.
    pub fn run(&self, evaluator: &mut Evaluator<'_>, random: &mut Random) {
        let dimensions = evaluator.dimensions();
        let mut points: Vec<Vec<f64>> = (0..self.population.max(1)).map(|_| random.point(dimensions)).collect();
        let mut costs = evaluator.costs(&points);
        let others = self.population.saturating_sub(self.elite);
        let crossed = ((self.crossover * others as f64).round() as usize).min(others);
        let selection = Selection::of(points.len(), 2 * crossed + (others - crossed));
        for _ in 1..self.generations {
            if evaluator.done() {
                return;
            }
            let mut order: Vec<usize> = (0..points.len()).collect();
            order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
            let children = self.children(&points, &selection.parents(&order, random), crossed, random);
            let child_costs = evaluator.costs(&children);
            let elite = order.iter().take(self.elite);
            costs = elite.clone().map(|&i| costs[i]).chain(child_costs).collect();
            points = elite.map(|&i| points[i].clone()).chain(children).collect();
        }
        if self.hybrid && !evaluator.done() {
            pattern_search(evaluator, 0.1);
        }
    }

    /// The next generation without its elite: `crossed` children of two parents, and mutants of the other parents.
    fn children(&self, points: &[Vec<f64>], parents: &[usize], crossed: usize, random: &mut Random) -> Vec<Vec<f64>> {
        let (pairs, single) = parents.split_at(2 * crossed);
        let mut children = Vec::with_capacity(crossed + single.len());
        for pair in pairs.chunks_exact(2) {
            let mut child = two_point(&points[pair[0]], &points[pair[1]], random);
            if random.unit() < self.mutation {
                self.mutate(&mut child, random);
            }
            children.push(child);
        }
        for &parent in single {
            let mut child = points[parent].clone();
            self.mutate(&mut child, random);
            children.push(child);
        }
        children
    }

    fn mutate(&self, genes: &mut [f64], random: &mut Random) {
        for gene in genes {
            if random.unit() < self.gene_rate {
                *gene = random.unit();
            }
        }
    }
}

/// Selection "remainder" by rank. What it needs of the ranks is computed once, because it is the same in every generation.
struct Selection {
    wanted: usize,
    /// How often each rank is a parent for certain.
    whole: Vec<usize>,
    /// What is left of its expectation, by which the other places are drawn.
    fractions: Vec<f64>,
    sum: f64,
}

impl Selection {
    /// Of `wanted` parents among so many individuals.
    fn of(individuals: usize, wanted: usize) -> Self {
        let weights: Vec<f64> = (1..=individuals).map(|rank| 1.0 / libm::sqrt(rank as f64)).collect();
        let scale = wanted as f64 / weights.iter().sum::<f64>();
        let expectations: Vec<f64> = weights.iter().map(|weight| scale * weight).collect();
        let whole = expectations.iter().map(|e| *e as usize).collect();
        let fractions: Vec<f64> = expectations.iter().map(|e| e.fract()).collect();
        let sum = fractions.iter().sum();
        Self { wanted, whole, fractions, sum }
    }

    /// The parents in random order; `order` lists the individuals, best first.
    fn parents(&self, order: &[usize], random: &mut Random) -> Vec<usize> {
        let mut parents = Vec::with_capacity(self.wanted + 1);
        for (&index, &times) in order.iter().zip(&self.whole) {
            parents.extend(std::iter::repeat_n(index, times));
        }
        while parents.len() < self.wanted {
            let mut at = random.unit() * self.sum;
            let slot = self.fractions.iter().position(|fraction| {
                at -= fraction;
                at < 0.0
            });
            parents.push(order[slot.unwrap_or(order.len() - 1)]);
        }
        parents.truncate(self.wanted);
        random.shuffle(&mut parents);
        parents
    }
}

/// The genes of `first` with those between two different cuts from `second`.
fn two_point(first: &[f64], second: &[f64], random: &mut Random) -> Vec<f64> {
    let cut = random.below(first.len());
    // A second cut at a different border between genes.
    let other = (cut + 1 + random.below(first.len().max(2) - 1)) % first.len();
    let (low, high) = (cut.min(other), cut.max(other));
    let mut child = first.to_vec();
    child[low..high].copy_from_slice(&second[low..high]);
    child
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_are_chosen_by_rank() {
        let order: Vec<usize> = (0..100).rev().collect();
        let mut random = Random::new(3);
        let selection = Selection::of(100, 195);
        let mut counts = [0.0; 100];
        for _ in 0..4000 {
            let parents = selection.parents(&order, &mut random);
            assert_eq!(parents.len(), 195);
            for parent in parents {
                counts[parent] += 1.0 / 4000.0;
            }
        }
        let sum: f64 = (1..=100).map(|rank| 1.0 / f64::from(rank).sqrt()).sum();
        for (rank, index) in order.into_iter().enumerate() {
            let expected = 195.0 / sum / ((rank + 1) as f64).sqrt();
            assert!((counts[index] - expected).abs() < 0.08, "{rank}: {} for {expected}", counts[index]);
            assert!(counts[index] >= expected.floor());
        }
    }

    /// The parents are those of a selection that computes everything in each generation, with the same random numbers.
    #[test]
    fn parents_are_those_of_the_whole_computation() {
        let whole = |order: &[usize], wanted: usize, random: &mut Random| -> Vec<usize> {
            let weights: Vec<f64> = (1..=order.len()).map(|rank| 1.0 / libm::sqrt(rank as f64)).collect();
            let scale = wanted as f64 / weights.iter().sum::<f64>();
            let expectations: Vec<f64> = weights.iter().map(|weight| scale * weight).collect();
            let mut parents = vec![];
            for (&index, expectation) in order.iter().zip(&expectations) {
                parents.extend(std::iter::repeat_n(index, *expectation as usize));
            }
            let fractions: f64 = expectations.iter().map(|e| e.fract()).sum();
            while parents.len() < wanted {
                let mut at = random.unit() * fractions;
                let slot = expectations.iter().position(|e| {
                    at -= e.fract();
                    at < 0.0
                });
                parents.push(order[slot.unwrap_or(order.len() - 1)]);
            }
            parents.truncate(wanted);
            random.shuffle(&mut parents);
            parents
        };
        for (individuals, wanted) in [(100, 176), (100, 195), (7, 3), (1, 1), (33, 64)] {
            let selection = Selection::of(individuals, wanted);
            let (mut a, mut b) = (Random::new(11), Random::new(11));
            for generation in 0..200 {
                let mut order: Vec<usize> = (0..individuals).collect();
                order.rotate_left(generation % individuals);
                assert_eq!(selection.parents(&order, &mut a), whole(&order, wanted, &mut b));
            }
        }
    }

    #[test]
    fn a_child_has_one_run_of_genes_of_its_second_parent() {
        let (mut random, mut lengths) = (Random::new(1), [0; 13]);
        for _ in 0..2000 {
            let child = two_point(&[0.0; 12], &[1.0; 12], &mut random);
            let changes = child.windows(2).filter(|w| w[0] != w[1]).count();
            let length = child.iter().filter(|gene| **gene == 1.0).count();
            assert!(changes <= 2 && (1..12).contains(&length), "{child:?}");
            lengths[length] += 1;
        }
        assert!(lengths[1..12].iter().all(|&n| n > 0), "{lengths:?}");
    }
}
