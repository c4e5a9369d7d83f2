//! The searches on the thesis' network: what each reaches, and the same bits from the same seed.

use gait_fit::search::cma_es::CmaEs;
use gait_fit::search::{Evaluator, Network, Random};
use reproduce::levenberg::levenberg_from_many;
use reproduce::micro_ga::micro_ga;
use reproduce::thesis_ga::ThesisGa;
use reproduce::{Genes, Grid, Objective, Target, angles, errors, reference_errors, set_s};

fn costs<'a>(genes: &'a Genes, target: &'a Target) -> impl FnMut(&[Vec<f64>]) -> Vec<f64> + 'a {
    |points| {
        let networks: Vec<Network> = points.iter().map(|point| genes.decode(point)).collect();
        errors(&networks, target, Grid::SEARCH, false).iter().map(|e| Objective::ANGLE.cost(e)).collect()
    }
}

fn problem() -> (Genes, Target) {
    let truth = set_s();
    (Genes::thesis(truth), Target::of_network(&truth, 5.0, 5))
}

/// A thousand generations and the pattern search: below one degree, but far above 0.001.
#[test]
fn the_thesis_algorithm_recovers_its_waveform_to_a_degree() {
    let (genes, target) = problem();
    let (mut of, mut quiet) = (costs(&genes, &target), |_| ());
    let mut evaluator = Evaluator::new(12, &mut of, &mut quiet);
    ThesisGa::default().run(&mut evaluator, &mut Random::new(1));
    // 100 and 999 times 98, then at most 2000 for each gene and one poll.
    assert!((98_002..=98_002 + 24_024).contains(&evaluator.evaluations()), "{}", evaluator.evaluations());
    let champion = genes.decode(evaluator.best().expect("a point"));
    let rmse = reference_errors(&champion, &target, Grid::FINE).rmse_deg();
    assert!((0.02..1.0).contains(&rmse), "{rmse}");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_threads() {
    let (genes, target) = problem();
    let run = |method: usize, threads: usize, seed: u64| -> Vec<(usize, u64)> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let (mut of, mut quiet) = (costs(&genes, &target), |_| ());
            let mut evaluator = Evaluator::new(12, &mut of, &mut quiet).with_budget(4000);
            let mut random = Random::new(seed);
            match method {
                0 => ThesisGa { generations: 30, ..ThesisGa::default() }.run(&mut evaluator, &mut random),
                1 => micro_ga(&mut evaluator, &mut random),
                _ => CmaEs { population: 40, ..CmaEs::default() }.run(&mut evaluator, &mut random),
            }
            evaluator.history().iter().map(|&(at, cost)| (at, cost.to_bits())).collect()
        })
    };
    for method in 0..3 {
        let one = run(method, 1, 3);
        assert!(one.len() > 5);
        assert_eq!(one, run(method, 3, 3), "method {method}");
        assert_ne!(one, run(method, 1, 4), "method {method}");
    }
}

/// Least squares need a few hundred evaluations for what the genetic algorithm does not reach in 122,000.
#[test]
fn levenberg_and_cma_es_find_the_genes_themselves() {
    let (genes, target) = problem();
    let networks = |points: &[Vec<f64>]| -> Vec<Network> { points.iter().map(|point| genes.decode(point)).collect() };
    let mut residuals = |points: &[Vec<f64>]| -> Vec<Option<Vec<f64>>> {
        let list = angles(&networks(points), &target, Grid::SEARCH);
        let difference = |a: Vec<[f64; 4]>| {
            (!a.is_empty())
                .then(|| a.iter().zip(&target.angles).flat_map(|(a, b)| (0..4).map(move |i| a[i] - b[i])).collect())
        };
        list.into_iter().map(difference).collect()
    };
    for seed in 1..=3 {
        let (mut of, mut quiet) = (costs(&genes, &target), |_| ());
        let mut evaluator = Evaluator::new(12, &mut of, &mut quiet).with_budget(2000).with_goal(1e-6);
        levenberg_from_many(&mut evaluator, &mut residuals, &mut Random::new(seed));
        let best = genes.decode(evaluator.best().expect("a point"));
        assert!(evaluator.best_cost() <= 1e-6 && evaluator.evaluations() < 1000, "{}", evaluator.evaluations());
        for (got, want) in best.joints.iter().zip(&set_s().joints) {
            assert!((got.difference - want.difference).abs() < 1e-3, "{got:?}");
        }
    }
    let (mut of, mut quiet) = (costs(&genes, &target), |_| ());
    let mut evaluator = Evaluator::new(12, &mut of, &mut quiet).with_budget(30_000).with_goal(1e-6);
    CmaEs::default().run(&mut evaluator, &mut Random::new(1));
    assert!(evaluator.best_cost() <= 1e-6, "{} after {}", evaluator.best_cost(), evaluator.evaluations());
}
