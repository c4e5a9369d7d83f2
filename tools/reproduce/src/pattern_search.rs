//! Generalised pattern search (Torczon, SIAM J. Optim. 7, 1997): evaluate points one mesh length away along every axis in both
//! directions; move to the lowest and double the mesh, or stay and halve it.
//!
//! The thesis ends its genetic algorithm with MATLAB's `patternsearch`, which moves at the first improvement. Here all 2 n points are
//! evaluated ("complete poll"), because in a batch they cost no more than one. Its limits are the same: mesh tolerance 1e-6, 2000 n
//! evaluations. Mesh lengths are fractions of a gene's range.

use gait_fit::search::Evaluator;

/// Continues from the best point of the evaluator with the mesh length `mesh`; does nothing if there is none.
pub fn pattern_search(evaluator: &mut Evaluator<'_>, mut mesh: f64) {
    let Some(mut centre) = evaluator.best().map(<[f64]>::to_vec) else { return };
    let mut cost = evaluator.best_cost();
    let last = evaluator.evaluations().saturating_add(2000 * centre.len());
    while mesh > 1e-6 && evaluator.evaluations() < last && !evaluator.done() {
        let mut poll = vec![];
        for axis in 0..centre.len() {
            for step in [mesh, -mesh] {
                let mut point = centre.clone();
                point[axis] = (point[axis] + step).clamp(0.0, 1.0);
                if point[axis] != centre[axis] {
                    poll.push(point);
                }
            }
        }
        let costs = evaluator.costs(&poll);
        let lowest = (0..poll.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        match lowest.filter(|&i| costs[i] < cost) {
            Some(i) => {
                (centre, cost) = (poll.swap_remove(i), costs[i]);
                mesh = (2.0 * mesh).min(1.0);
            }
            None => mesh *= 0.5,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tilted bowl with its lowest point on the border of the box in one coordinate.
    #[test]
    fn it_descends_and_follows_the_border() {
        let mut bowl = |points: &[Vec<f64>]| -> Vec<f64> {
            points.iter().map(|x| (x[0] - 0.3).powi(2) + (x[1] + 0.5).powi(2) + 0.5 * (x[0] - 0.3) * x[1]).collect()
        };
        let mut quiet = |_| ();
        let mut evaluator = Evaluator::new(2, &mut bowl, &mut quiet);
        pattern_search(&mut evaluator, 0.1);
        assert_eq!(evaluator.evaluations(), 0, "it goes on from a best point, and there is none");
        evaluator.costs(&[vec![0.9, 0.9]]);
        pattern_search(&mut evaluator, 0.1);
        let best = evaluator.best().expect("a point");
        assert!((best[0] - 0.3).abs() < 1e-5 && best[1] == 0.0, "{best:?}");
        assert!(evaluator.evaluations() < 4000);
    }
}
