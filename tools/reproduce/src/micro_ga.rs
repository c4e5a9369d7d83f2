//! Micro-GA (Krishnakumar, SPIE 1196, 1989), which the thesis names as future work: a population of five whose best is always kept,
//! tournament selection, crossover always, no mutation. When the five have become similar, four new random ones join the best.
//!
//! As in the paper, genes are bit strings ([`BITS`] bits each, plain binary), and the crossover cuts the whole string at one place. A
//! cut inside of a gene gives a new value; nothing else changes a gene between restarts. "Similar" means that the others differ from
//! the best in less than a twentieth of the bits.

use gait_fit::search::{Evaluator, Random};

/// Bits of a gene.
pub const BITS: u32 = 16;
/// Individuals.
const POPULATION: usize = 5;

/// Runs until the evaluator is done; give it a budget.
pub fn micro_ga(evaluator: &mut Evaluator<'_>, random: &mut Random) {
    let genes = evaluator.dimensions();
    let newcomer = |random: &mut Random| -> Vec<u16> { (0..genes).map(|_| random.below(1 << BITS) as u16).collect() };
    let mut all: Vec<Vec<u16>> = (0..POPULATION).map(|_| newcomer(random)).collect();
    let mut costs = evaluator.costs(&all.iter().map(|bits| decode(bits)).collect::<Vec<_>>());
    while !evaluator.done() {
        let best = (0..POPULATION).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
        let (champion, lowest) = (all[best].clone(), costs[best]);
        let alike = all.iter().map(|bits| distance(bits, &champion)).sum::<u32>();
        let children: Vec<Vec<u16>> = if alike * 20 < BITS * (genes * (POPULATION - 1)) as u32 {
            (1..POPULATION).map(|_| newcomer(random)).collect()
        } else {
            offspring(&all, &costs, random)
        };
        let child_costs = evaluator.costs(&children.iter().map(|bits| decode(bits)).collect::<Vec<_>>());
        all = std::iter::once(champion).chain(children).collect();
        costs = std::iter::once(lowest).chain(child_costs).collect();
    }
}

/// Four children of two pairs, each parent the better of two neighbours in a shuffled row.
fn offspring(all: &[Vec<u16>], costs: &[f64], random: &mut Random) -> Vec<Vec<u16>> {
    let mut parents = vec![];
    while parents.len() < POPULATION - 1 {
        let mut row: Vec<usize> = (0..POPULATION).collect();
        random.shuffle(&mut row);
        parents.extend(row.chunks_exact(2).map(|two| if costs[two[0]] <= costs[two[1]] { two[0] } else { two[1] }));
    }
    let mut children = vec![];
    for pair in parents.chunks_exact(2) {
        let (a, b) = (&all[pair[0]], &all[pair[1]]);
        let cut = 1 + random.below(BITS as usize * a.len() - 1);
        children.push(cross(a, b, cut));
        children.push(cross(b, a, cut));
    }
    children
}

/// The first `cut` bits of `a`, the rest of `b`.
fn cross(a: &[u16], b: &[u16], cut: usize) -> Vec<u16> {
    let bits = BITS as usize;
    a.iter()
        .zip(b)
        .enumerate()
        .map(|(gene, (&a, &b))| {
            let own = cut.saturating_sub(gene * bits).min(bits);
            let mask = (0xFFFF_u32 << (bits - own)) as u16;
            (a & mask) | (b & !mask)
        })
        .collect()
}

fn distance(a: &[u16], b: &[u16]) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum()
}

fn decode(bits: &[u16]) -> Vec<f64> {
    bits.iter().map(|&gene| f64::from(gene) / f64::from(u16::MAX)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_inside_a_gene_gives_a_new_value() {
        let (a, b) = ([0xFFFF; 3], [0; 3]);
        assert_eq!(cross(&a, &b, 20), [0xFFFF, 0xF000, 0]);
        assert_eq!(cross(&b, &a, 16), [0, 0xFFFF, 0xFFFF]);
        assert_eq!(cross(&a, &b, 47), [0xFFFF, 0xFFFF, 0xFFFE]);
    }

    #[test]
    fn it_restarts_and_keeps_its_best() {
        // Rastrigin's function: many local minima.
        let mut rough = |points: &[Vec<f64>]| -> Vec<f64> {
            let term = |x: &f64| {
                let x = 10.24 * x - 5.12;
                x * x - 10.0 * (std::f64::consts::TAU * x).cos() + 10.0
            };
            points.iter().map(|point| point.iter().map(term).sum()).collect()
        };
        let mut quiet = |_| ();
        let mut evaluator = Evaluator::new(2, &mut rough, &mut quiet).with_budget(20_000).with_goal(1e-2);
        micro_ga(&mut evaluator, &mut Random::new(7));
        assert!(evaluator.best_cost() < 1e-2, "{}", evaluator.best_cost());
        assert!(evaluator.evaluations() > 100);
    }
}
