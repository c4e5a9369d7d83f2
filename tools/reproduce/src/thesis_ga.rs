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
//!
//! Crossover alone makes no new gene, so a population loses its differences in about fifty generations. A child that equals a parent has the
//! parent's cost and is not simulated: of 98,002 evaluations about 1 % are. No cost and no random number changes by that.

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
        let elite = self.elite.min(points.len());
        let others = points.len() - elite;
        let crossed = ((self.crossover * others as f64).round() as usize).min(others);
        let selection = Selection::of(points.len(), 2 * crossed + (others - crossed));
        // The generations take turns in the same memory.
        let mut next = points.clone();
        let (mut order, mut parents, mut known) = (vec![], vec![], vec![]);
        for _ in 1..self.generations {
            if evaluator.done() {
                return;
            }
            best_first(&costs, &mut order);
            selection.choose(&order, random, &mut parents);
            let (kept, children) = next.split_at_mut(elite);
            for (kept, &index) in kept.iter_mut().zip(&order) {
                kept.copy_from_slice(&points[index]);
            }
            self.fill(children, &points, &parents, crossed, random);
            known_costs(children, &points, &costs, &parents, crossed, &mut known);
            let child_costs = evaluator.costs_beside(children, &known);
            costs = order[..elite].iter().map(|&index| costs[index]).chain(child_costs).collect();
            std::mem::swap(&mut points, &mut next);
        }
        if self.hybrid && !evaluator.done() {
            pattern_search(evaluator, 0.1);
        }
    }

    /// The next generation without its elite: `crossed` children of two parents, and mutants of the other parents.
    fn fill(
        &self,
        children: &mut [Vec<f64>],
        points: &[Vec<f64>],
        parents: &[usize],
        crossed: usize,
        random: &mut Random,
    ) {
        let (of_two, mutants) = children.split_at_mut(crossed);
        let (pairs, single) = parents.split_at(2 * crossed);
        for (child, pair) in of_two.iter_mut().zip(pairs.chunks_exact(2)) {
            two_point(&points[pair[0]], &points[pair[1]], random, child);
            if random.unit() < self.mutation {
                self.mutate(child, random);
            }
        }
        for (mutant, &parent) in mutants.iter_mut().zip(single) {
            mutant.copy_from_slice(&points[parent]);
            self.mutate(mutant, random);
        }
    }

    fn mutate(&self, genes: &mut [f64], random: &mut Random) {
        for gene in genes {
            if random.unit() < self.gene_rate {
                *gene = random.unit();
            }
        }
    }
}

/// For each child the cost of a parent that it equals.
fn known_costs(
    children: &[Vec<f64>],
    points: &[Vec<f64>],
    costs: &[f64],
    parents: &[usize],
    crossed: usize,
    known: &mut Vec<Option<f64>>,
) {
    let (pairs, single) = parents.split_at(2 * crossed);
    let parents_of = pairs.chunks_exact(2).chain(single.chunks_exact(1));
    let equal = |(child, parents): (&Vec<f64>, &[usize])| {
        parents.iter().find(|&&parent| points[parent] == *child).map(|&parent| costs[parent])
    };
    known.clear();
    known.extend(children.iter().zip(parents_of).map(equal));
}

/// The individuals by their costs, lowest first, and of equal costs in their order.
fn best_first(costs: &[f64], order: &mut Vec<usize>) {
    // Each cost beside its place: compared faster than places through their costs.
    let mut keys: Vec<(f64, usize)> = costs.iter().copied().zip(0..).collect();
    keys.sort_unstable_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
    order.clear();
    order.extend(keys.iter().map(|(_, index)| index));
}

/// Selection "remainder" by rank. What it needs of the ranks is computed once, because it is the same in every generation.
struct Selection {
    wanted: usize,
    /// How often each rank is a parent for certain.
    whole: Vec<usize>,
    /// What is left of its expectation, by which the other places are drawn.
    fractions: Vec<f64>,
    sum: f64,
    /// The sums of the fractions up to each rank.
    ends: Vec<f64>,
}

/// Differences of sums that rounding does not reach: sums of some hundred fractions err by less than 1e-12.
const SURELY: f64 = 1e-9;

impl Selection {
    /// Of `wanted` parents among so many individuals.
    fn of(individuals: usize, wanted: usize) -> Self {
        let weights: Vec<f64> = (1..=individuals).map(|rank| 1.0 / libm::sqrt(rank as f64)).collect();
        let scale = wanted as f64 / weights.iter().sum::<f64>();
        let expectations: Vec<f64> = weights.iter().map(|weight| scale * weight).collect();
        let whole = expectations.iter().map(|e| *e as usize).collect();
        let fractions: Vec<f64> = expectations.iter().map(|e| e.fract()).collect();
        let sum = fractions.iter().sum();
        let add = |end: &mut f64, fraction: &f64| {
            *end += fraction;
            Some(*end)
        };
        let ends = fractions.iter().scan(0.0, add).collect();
        Self { wanted, whole, fractions, sum, ends }
    }

    /// Fills the parents in random order; `order` lists the individuals, best first.
    fn choose(&self, order: &[usize], random: &mut Random, parents: &mut Vec<usize>) {
        parents.clear();
        for (&index, &times) in order.iter().zip(&self.whole) {
            parents.extend(std::iter::repeat_n(index, times));
        }
        while parents.len() < self.wanted {
            parents.push(order[self.rank_at(random.unit() * self.sum)]);
        }
        parents.truncate(self.wanted);
        random.shuffle(parents);
    }

    /// The rank at a place of the roulette: the first whose fraction, with those before it taken away, leaves less than nothing.
    fn rank_at(&self, at: f64) -> usize {
        let rank = self.ends.partition_point(|end| *end <= at);
        let begin = rank.checked_sub(1).map_or(f64::NEG_INFINITY, |before| self.ends[before]);
        if self.ends.get(rank).is_some_and(|end| end - at > SURELY) && at - begin > SURELY {
            return rank;
        }
        // At a border between ranks the order of the roundings decides.
        let mut left = at;
        let slot = self.fractions.iter().position(|fraction| {
            left -= fraction;
            left < 0.0
        });
        slot.unwrap_or(self.fractions.len() - 1)
    }
}

/// Fills a child with the genes of `first`, and those between two different cuts from `second`.
fn two_point(first: &[f64], second: &[f64], random: &mut Random, child: &mut [f64]) {
    let cut = random.below(first.len());
    // A second cut at a different border between genes.
    let other = (cut + 1 + random.below(first.len().max(2) - 1)) % first.len();
    let (low, high) = (cut.min(other), cut.max(other));
    child.copy_from_slice(first);
    child[low..high].copy_from_slice(&second[low..high]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_are_chosen_by_rank() {
        let order: Vec<usize> = (0..100).rev().collect();
        let mut random = Random::new(3);
        let selection = Selection::of(100, 195);
        let (mut counts, mut parents) = ([0.0; 100], vec![]);
        for _ in 0..4000 {
            selection.choose(&order, &mut random, &mut parents);
            assert_eq!(parents.len(), 195);
            for &parent in &parents {
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
            let (mut a, mut b, mut parents) = (Random::new(11), Random::new(11), vec![]);
            for generation in 0..200 {
                let mut order: Vec<usize> = (0..individuals).collect();
                order.rotate_left(generation % individuals);
                selection.choose(&order, &mut a, &mut parents);
                assert_eq!(parents, whole(&order, wanted, &mut b));
            }
        }
    }

    /// The rank at every border of the roulette, and beside it by the least steps, is that of taking away one fraction after the other.
    #[test]
    fn the_rank_at_a_border_is_that_of_taking_away() {
        for (individuals, wanted) in [(100, 195), (100, 176), (7, 3), (1, 1), (33, 64)] {
            let selection = Selection::of(individuals, wanted);
            let slowly = |mut at: f64| {
                let ranks = selection.fractions.iter().position(|fraction| {
                    at -= fraction;
                    at < 0.0
                });
                ranks.unwrap_or(individuals - 1)
            };
            let mut random = Random::new(5);
            let between = (0..2000).map(|_| random.unit() * selection.sum).collect::<Vec<f64>>();
            let borders =
                selection.ends.iter().flat_map(|end| (-40..=40).map(move |k| end + f64::from(k) * 1e-16 * end));
            for at in borders.chain(between).filter(|at| *at >= 0.0) {
                assert_eq!(selection.rank_at(at), slowly(at), "{at} of {individuals}");
            }
        }
    }

    /// The order is that of a stable sort by `total_cmp`, with equal costs, infinities and both zeros.
    #[test]
    fn the_best_are_first_and_equal_ones_in_their_order() {
        let mut random = Random::new(4);
        let (mut order, special) =
            (vec![], [f64::INFINITY, -0.0, 0.0, 1.0, f64::NEG_INFINITY, -1.0, -1e-300, f64::NAN]);
        for count in 1..200 {
            let costs: Vec<f64> = (0..count)
                .map(|_| if random.unit() < 0.3 { special[random.below(8)] } else { (random.unit() - 0.2) * 100.0 })
                .collect();
            let mut slowly: Vec<usize> = (0..count).collect();
            slowly.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
            best_first(&costs, &mut order);
            assert_eq!(order, slowly, "{costs:?}");
        }
    }

    /// Every known cost is that of the child, and every child that equals a parent has one.
    #[test]
    fn a_child_that_equals_a_parent_has_its_cost() {
        let cost = |genes: &[f64]| genes.iter().enumerate().map(|(gene, x)| (gene + 1) as f64 * x).sum::<f64>();
        let ga = ThesisGa { mutation: 0.2, gene_rate: 0.1, ..ThesisGa::default() };
        let mut random = Random::new(6);
        let (mut equal, mut new) = (0, 0);
        for _ in 0..200 {
            // Few different genes, so that children equal parents, brothers and others.
            let points: Vec<Vec<f64>> = (0..20).map(|_| (0..5).map(|_| random.below(2) as f64).collect()).collect();
            let costs: Vec<f64> = points.iter().map(|point| cost(point)).collect();
            let parents: Vec<usize> = (0..35).map(|_| random.below(20)).collect();
            let (mut children, mut known) = (vec![vec![0.0; 5]; 18], vec![]);
            ga.fill(&mut children, &points, &parents, 17, &mut random);
            known_costs(&children, &points, &costs, &parents, 17, &mut known);
            assert_eq!(known.len(), children.len());
            for (index, (child, known)) in children.iter().zip(known).enumerate() {
                let own = if index < 17 { &parents[2 * index..2 * index + 2] } else { &parents[34..] };
                assert_eq!(known.is_some(), own.iter().any(|&parent| points[parent] == *child));
                match known {
                    Some(known) => {
                        assert_eq!(known, cost(child));
                        equal += 1;
                    }
                    None => new += 1,
                }
            }
        }
        assert!(equal > 200 && new > 200, "{equal} {new}");
    }

    /// A search that computes every cost finds the same, at the same evaluations.
    #[test]
    fn known_costs_change_no_search() {
        let cost =
            |genes: &[f64]| genes.iter().enumerate().map(|(gene, x)| (x - 0.07 * gene as f64).powi(2)).sum::<f64>();
        let ga = ThesisGa { generations: 60, hybrid: false, ..ThesisGa::default() };
        let (mut of, mut quiet) = (|points: &[Vec<f64>]| points.iter().map(|point| cost(point)).collect(), |_| ());
        let mut evaluator = Evaluator::new(12, &mut of, &mut quiet);
        ga.run(&mut evaluator, &mut Random::new(9));

        let mut random = Random::new(9);
        let mut points: Vec<Vec<f64>> = (0..ga.population).map(|_| random.point(12)).collect();
        let (others, crossed) = (ga.population - ga.elite, 97);
        let selection = Selection::of(ga.population, 2 * crossed + others - crossed);
        let (mut order, mut parents, mut history, mut evaluations) = (vec![], vec![], Vec::<(usize, f64)>::new(), 0);
        for generation in 0..ga.generations {
            let costs: Vec<f64> = points.iter().map(|point| cost(point)).collect();
            for &cost in &costs[if generation == 0 { 0 } else { ga.elite }..] {
                evaluations += 1;
                if history.last().is_none_or(|best| cost < best.1) {
                    history.push((evaluations, cost));
                }
            }
            best_first(&costs, &mut order);
            selection.choose(&order, &mut random, &mut parents);
            let mut next: Vec<Vec<f64>> = order[..ga.elite].iter().map(|&index| points[index].clone()).collect();
            let mut children = vec![vec![0.0; 12]; others];
            ga.fill(&mut children, &points, &parents, crossed, &mut random);
            next.append(&mut children);
            points = next;
        }
        assert_eq!(evaluator.history(), history);
        assert_eq!(evaluator.evaluations(), evaluations);
        assert!(evaluator.computed() < evaluations / 3, "{} of {evaluations}", evaluator.computed());
    }

    #[test]
    fn a_child_has_one_run_of_genes_of_its_second_parent() {
        let (mut random, mut lengths, mut child) = (Random::new(1), [0; 13], [0.5; 12]);
        for _ in 0..2000 {
            two_point(&[0.0; 12], &[1.0; 12], &mut random, &mut child);
            let changes = child.windows(2).filter(|w| w[0] != w[1]).count();
            let length = child.iter().filter(|gene| **gene == 1.0).count();
            assert!(changes <= 2 && (1..12).contains(&length), "{child:?}");
            lengths[length] += 1;
        }
        assert!(lengths[1..12].iter().all(|&n| n > 0), "{lengths:?}");
    }
}
