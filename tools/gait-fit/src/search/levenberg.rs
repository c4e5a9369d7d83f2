//! Levenberg-Marquardt for least squares in the unit box.
//!
//! The crate `levenberg-marquardt` (MINPACK's algorithm) takes a complete Jacobian at once, so its forward differences are one batch
//! with one point per coordinate. A coordinate is x = (1 + sin u)/2, which cannot leave the box and is smooth at its border.

use std::cell::RefCell;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::evaluator::Evaluator;

/// Difference of u for the derivatives: about the root of f64's precision, where truncation and rounding errors are equal.
const STEP: f64 = 1e-7;

/// Residuals of a batch of points; `None` for a point without residuals.
pub type Residuals<'a> = dyn FnMut(&[Vec<f64>]) -> Vec<Option<Vec<f64>>> + 'a;

struct Problem<'a, 'b, 'c, 'd> {
    evaluator: RefCell<&'a mut Evaluator<'b>>,
    residuals: RefCell<&'c mut Residuals<'d>>,
    u: DVector<f64>,
    now: Option<DVector<f64>>,
}

impl Problem<'_, '_, '_, '_> {
    /// The cost of a point is the mean of its squared residuals.
    fn batch(&self, u: &[DVector<f64>]) -> Vec<Option<DVector<f64>>> {
        let points: Vec<Vec<f64>> = u.iter().map(|u| u.iter().map(|&u| inside(u)).collect()).collect();
        let all = (self.residuals.borrow_mut())(&points);
        let costs: Vec<f64> = all.iter().map(|r| r.as_ref().map_or(f64::INFINITY, |r| mean_square(r))).collect();
        self.evaluator.borrow_mut().note(&points, &costs);
        all.into_iter().map(|r| r.map(DVector::from_vec)).collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_, '_, '_, '_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, u: &DVector<f64>) {
        self.u.copy_from(u);
        // Missing residuals end the run once the goal is reached or the budget used up; the crate has no other way.
        let over = self.evaluator.borrow().done();
        self.now = if over { None } else { self.batch(std::slice::from_ref(u)).swap_remove(0) };
    }

    fn params(&self) -> DVector<f64> {
        self.u.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.now.clone()
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let now = self.now.as_ref()?;
        if self.evaluator.borrow().done() {
            return None;
        }
        let steps: Vec<DVector<f64>> = (0..self.u.len())
            .map(|axis| {
                let mut u = self.u.clone();
                u[axis] += STEP;
                u
            })
            .collect();
        let mut jacobian = DMatrix::zeros(now.len(), steps.len());
        for (axis, moved) in self.batch(&steps).into_iter().enumerate() {
            jacobian.set_column(axis, &((moved? - now) / STEP));
        }
        Some(jacobian)
    }
}

/// One run from `start`, for which the evaluator must not be done.
pub fn levenberg(evaluator: &mut Evaluator<'_>, residuals: &mut Residuals<'_>, start: &[f64]) {
    let u = DVector::from_iterator(start.len(), start.iter().map(|&x| outside(x)));
    let mut problem =
        Problem { evaluator: RefCell::new(evaluator), residuals: RefCell::new(residuals), u: u.clone(), now: None };
    problem.set_params(&u);
    if problem.now.is_some() {
        // The evaluator keeps the best point; the reason for the end is not needed.
        let _ = LevenbergMarquardt::new().with_patience(30).minimize(problem);
    }
}

fn inside(u: f64) -> f64 {
    0.5 * (1.0 + libm::sin(u))
}

fn outside(x: f64) -> f64 {
    // At the border the derivative is 0 and the search could not leave it.
    libm::asin((2.0 * x - 1.0).clamp(-0.9999, 0.9999))
}

fn mean_square(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_the_minimum_inside_and_on_the_border() {
        for (peak, expected) in [(0.3, 0.3), (1.4, 1.0)] {
            // exp decay through three points, the second coordinate its rate.
            let mut residuals = |points: &[Vec<f64>]| -> Vec<Option<Vec<f64>>> {
                let one = |x: &Vec<f64>| {
                    Some(
                        (0..5)
                            .map(|t| {
                                let t = f64::from(t);
                                x[0] * (-x[1] * t).exp() - peak * (-0.7 * t).exp()
                            })
                            .collect(),
                    )
                };
                points.iter().map(one).collect()
            };
            let mut unused = |_: &[Vec<f64>]| vec![];
            let mut quiet = |_| ();
            let mut evaluator = Evaluator::new(2, &mut unused, &mut quiet).with_budget(500);
            levenberg(&mut evaluator, &mut residuals, &[0.5, 0.5]);
            let best = evaluator.best().expect("a point").to_vec();
            assert!((best[0] - expected).abs() < 1e-4, "{best:?}");
            if peak < 1.0 {
                assert!((best[1] - 0.7).abs() < 1e-6 && evaluator.best_cost() < 1e-16, "{best:?}");
                assert!(evaluator.evaluations() < 100);
            }
        }
    }
}
