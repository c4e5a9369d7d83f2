//! The search method CMA-ES with restarts (Hansen, "The CMA evolution strategy: a tutorial", arXiv 1604.00772). BIPOP (Hansen, GECCO
//! 2009) alternates between doubled populations and small ones of random size and step; IPOP (Auger and Hansen, CEC 2005) only doubles.
//!
//! It is written here because the available crates evaluate one point at a time, while a population evaluated in SIMD lanes costs as
//! much as a single point. `nalgebra` computes the eigenvalues. Points outside of the unit box are evaluated at its border with a
//! penalty for the distance.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::evaluator::Evaluator;
use super::random::Random;

/// The restarts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restart {
    /// No restart.
    Never,
    /// Twice the population each time.
    Ipop,
    /// Alternately twice the population and a small one.
    Bipop,
}

/// Settings.
#[derive(Debug, Clone, PartialEq)]
pub struct CmaEs {
    /// Population of the first run; 16 individuals fill a SIMD vector.
    pub population: usize,
    /// Initial standard deviation, as a fraction of each range.
    pub sigma: f64,
    /// Start of the first run; the others start at a random point.
    pub start: Option<Vec<f64>>,
    /// The restarts.
    pub restart: Restart,
    /// Number of random points evaluated before a run without a given start; the run starts at the best. With 1, a single point is used.
    pub scouts: usize,
    /// A run ends when its recent best costs differ by less than this fraction.
    pub tolerance: f64,
}

impl Default for CmaEs {
    fn default() -> Self {
        Self { population: 16, sigma: 0.3, start: None, restart: Restart::Bipop, scouts: 1, tolerance: 1e-9 }
    }
}

impl CmaEs {
    /// Runs until the evaluator is done, or for one run if there are no restarts. The evaluator needs a budget.
    pub fn run(&self, evaluator: &mut Evaluator<'_>, random: &mut Random) {
        if evaluator.done() {
            return;
        }
        let first = self.start.clone().unwrap_or_else(|| self.scout(evaluator, random));
        let (mut large, mut spent_large, mut spent_small) = (self.population, 0, 0);
        spent_large += self.run_once(evaluator, random, &first, self.sigma, large);
        while !evaluator.done() && self.restart != Restart::Never {
            let start = self.scout(evaluator, random);
            if self.restart == Restart::Ipop || spent_large <= spent_small {
                large *= 2;
                spent_large += self.run_once(evaluator, random, &start, self.sigma, large);
            } else {
                let half_ratio = 0.5 * large as f64 / self.population as f64;
                let small = self.population as f64 * libm::pow(half_ratio, random.unit() * random.unit());
                let sigma = self.sigma * libm::pow(10.0, -2.0 * random.unit());
                spent_small += self.run_once(evaluator, random, &start, sigma, (small as usize).max(self.population));
            }
        }
    }

    /// The best of [`Self::scouts`] random points.
    fn scout(&self, evaluator: &mut Evaluator<'_>, random: &mut Random) -> Vec<f64> {
        let mut points: Vec<Vec<f64>> = (0..self.scouts.max(1)).map(|_| random.point(evaluator.dimensions())).collect();
        if points.len() == 1 {
            return points.swap_remove(0);
        }
        let costs = evaluator.costs(&points);
        let best = (0..points.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
        points.swap_remove(best)
    }

    /// One complete run; returns its number of evaluations.
    fn run_once(
        &self,
        evaluator: &mut Evaluator<'_>,
        random: &mut Random,
        start: &[f64],
        mut sigma: f64,
        population: usize,
    ) -> usize {
        let n = start.len();
        let nf = n as f64;
        let before = evaluator.evaluations();
        let rates = Rates::of(nf, population);
        let mut mean = DVector::from_column_slice(start);
        let mut covariance = DMatrix::<f64>::identity(n, n);
        let (mut path_sigma, mut path_c) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
        let (mut axes, mut scales) = (DMatrix::<f64>::identity(n, n), DVector::<f64>::from_element(n, 1.0));
        // Limits of the tutorial: generations without improvement, and generations in total.
        let patience = 10 + (30.0 * nf / population as f64) as usize;
        let most = 100 + (50.0 * (nf + 3.0) * (nf + 3.0) / (population as f64).sqrt()) as usize;
        let mut recent: Vec<f64> = vec![];
        for generation in 0..most {
            if evaluator.done() {
                break;
            }
            let steps: Vec<DVector<f64>> = (0..population)
                .map(|_| {
                    let z = DVector::from_fn(n, |_, _| random.normal());
                    &axes * z.component_mul(&scales)
                })
                .collect();
            let points: Vec<Vec<f64>> = steps.iter().map(|y| (&mean + y * sigma).iter().copied().collect()).collect();
            let inside: Vec<Vec<f64>> = points.iter().map(|p| p.iter().map(|x| x.clamp(0.0, 1.0)).collect()).collect();
            let mut costs = evaluator.costs(&inside);
            let typical = median(&costs);
            for ((cost, point), inside) in costs.iter_mut().zip(&points).zip(&inside) {
                let beyond: f64 = point.iter().zip(inside).map(|(a, b)| (a - b) * (a - b)).sum();
                *cost += typical * beyond;
            }
            let mut order: Vec<usize> = (0..population).collect();
            order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
            if !costs[order[0]].is_finite() {
                // All individuals diverged; the run cannot adapt from here.
                break;
            }

            let chosen = || order.iter().zip(&rates.weights).map(|(&i, &w)| (&steps[i], w));
            let step = chosen().fold(DVector::<f64>::zeros(n), |sum, (y, w)| sum + y * w);
            mean += &step * sigma;
            let whitened = &axes * (axes.transpose() * &step).component_div(&scales);
            path_sigma = path_sigma * (1.0 - rates.c_sigma)
                + whitened * (rates.c_sigma * (2.0 - rates.c_sigma) * rates.mu_eff).sqrt();
            let decay = 1.0 - libm::pow(1.0 - rates.c_sigma, 2.0 * (generation + 1) as f64);
            let long = path_sigma.norm() / decay.sqrt() > (1.4 + 2.0 / (nf + 1.0)) * rates.chi;
            let h = if long { 0.0 } else { 1.0 };
            path_c = path_c * (1.0 - rates.c_c) + &step * (h * (rates.c_c * (2.0 - rates.c_c) * rates.mu_eff).sqrt());
            let kept = 1.0 - rates.c_1 - rates.c_mu + (1.0 - h) * rates.c_1 * rates.c_c * (2.0 - rates.c_c);
            covariance = covariance * kept + &path_c * path_c.transpose() * rates.c_1;
            for (y, w) in chosen() {
                covariance += y * y.transpose() * (rates.c_mu * w);
            }
            sigma *= libm::exp((rates.c_sigma / rates.d_sigma) * (path_sigma.norm() / rates.chi - 1.0)).min(2.0);

            let eigen = SymmetricEigen::new(covariance.clone());
            let (least, greatest) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
            if !(least > 0.0 && greatest.is_finite()) || greatest > 1e14 * least || sigma * greatest.sqrt() < 1e-12 {
                break;
            }
            (axes, scales) = (eigen.eigenvectors, eigen.eigenvalues.map(f64::sqrt));

            recent.push(costs[order[0]]);
            if recent.len() > patience {
                recent.remove(0);
                let (low, high) = recent.iter().fold((f64::MAX, f64::MIN), |(l, h), &c| (l.min(c), h.max(c)));
                if high - low <= self.tolerance * high.abs() {
                    break;
                }
            }
        }
        evaluator.evaluations() - before
    }
}

/// Weights and rates, in the symbols of the tutorial.
struct Rates {
    weights: Vec<f64>,
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    chi: f64,
}

impl Rates {
    fn of(n: f64, population: usize) -> Self {
        let half = population / 2;
        let raw: Vec<f64> =
            (1..=half).map(|i| libm::log((population as f64 + 1.0) / 2.0) - libm::log(i as f64)).collect();
        let sum: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
        let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let c_1 = 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff);
        let c_mu = (2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0) * (n + 2.0) + mu_eff)).min(1.0 - c_1);
        Self {
            weights,
            mu_eff,
            c_sigma,
            d_sigma: 1.0 + c_sigma + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0),
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_1,
            c_mu,
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

/// Median of the finite costs.
fn median(costs: &[f64]) -> f64 {
    gait_trace::upper_median(costs.iter().copied().filter(|c| c.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reached(n: usize, settings: &CmaEs, budget: usize, of: impl Fn(&[f64]) -> f64) -> (f64, usize) {
        let mut batch = |points: &[Vec<f64>]| points.iter().map(|x| of(x)).collect();
        let mut quiet = |_| ();
        let mut evaluator = Evaluator::new(n, &mut batch, &mut quiet).with_budget(budget).with_goal(1e-9);
        settings.run(&mut evaluator, &mut Random::new(5));
        (evaluator.best_cost(), evaluator.evaluations())
    }

    /// Rosenbrock's valley in eight dimensions: without an adapted covariance this takes hundreds of thousands of evaluations.
    #[test]
    fn it_adapts_to_a_curved_valley() {
        let rosenbrock = |x: &[f64]| {
            let x: Vec<f64> = x.iter().map(|x| 4.0 * x - 2.0).collect();
            x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
        };
        let (cost, evaluations) = reached(8, &CmaEs::default(), 40_000, rosenbrock);
        assert!(cost <= 1e-9 && evaluations < 30_000, "{cost} after {evaluations}");
    }

    /// One run ends in one of Rastrigin's many minima; restarts find the lowest.
    #[test]
    fn restarts_leave_a_local_minimum() {
        let rastrigin = |x: &[f64]| {
            let term = |x: &f64| {
                let x = 10.24 * x - 4.0;
                x * x - 10.0 * (std::f64::consts::TAU * x).cos() + 10.0
            };
            x.iter().map(term).sum()
        };
        let settings = |restart| CmaEs { restart, ..CmaEs::default() };
        let (once, _) = reached(5, &settings(Restart::Never), 100_000, rastrigin);
        assert!(once > 0.5, "{once}");
        for restart in [Restart::Ipop, Restart::Bipop] {
            let (cost, _) = reached(5, &settings(restart), 100_000, rastrigin);
            assert!(cost <= 1e-9, "{restart:?}: {cost}");
        }
    }
}
