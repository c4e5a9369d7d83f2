//! Levenberg-Marquardt from many random starts.

use gait_fit::search::levenberg::{Residuals, levenberg};
use gait_fit::search::{Evaluator, Random};

/// Runs from random starts until the evaluator is done; give it a budget.
pub fn levenberg_from_many(evaluator: &mut Evaluator<'_>, residuals: &mut Residuals<'_>, random: &mut Random) {
    while !evaluator.done() {
        let start = random.point(evaluator.dimensions());
        levenberg(evaluator, residuals, &start);
    }
}
