//! The numbers of the report as CSV.

use std::fmt::Write as _;

use gait_trace::root_mean_square;
use gait_trace::stride::cycle::{Cycle, POINTS};
use joint_units::Joint;

use super::curves::{residual, sd_at_points};
use crate::fit::Fit;

/// Decimals of an angle.
const DIGITS: usize = 4;

/// The curves: a row for each point of the cycle. Every joint is on the cycle of its own leg. Values that are not known are empty.
#[must_use]
pub fn cycle_csv(fit: &Fit) -> String {
    let mut csv = String::from("cycle_percent");
    for name in Joint::ALL.map(Joint::name) {
        for column in ["mean", "sd", "generator", "driven", "residual"] {
            // Writing to a String cannot fail.
            let _ = write!(csv, ",{name}_{column}_deg");
        }
    }
    csv.push('\n');
    let own = |cycle: &Cycle, joint| fit.measures.cycle_start.own_cycle(cycle, joint);
    let mean = fit.strides.mean();
    let columns = Joint::ALL.map(|joint| {
        [
            Some(own(&mean, joint)),
            (fit.strides.cycles().len() > 1).then(|| sd_at_points(fit, joint)),
            Some(own(&fit.cycle, joint)),
            fit.driven.as_ref().map(|driven| own(driven, joint)),
            Some(residual(fit, joint)),
        ]
    });
    for k in 0..POINTS {
        let _ = write!(csv, "{}", 100.0 * k as f64 / POINTS as f64);
        for column in columns.iter().flatten() {
            let _ = match column {
                Some(values) => write!(csv, ",{:.DIGITS$}", values[k]),
                None => write!(csv, ","),
            };
        }
        csv.push('\n');
    }
    csv
}

/// The strides: number, times in the recording, duration, and the error of the generator on each. Of a recording that is one cycle, times are
/// fractions of it.
#[must_use]
pub fn strides_csv(fit: &Fit) -> String {
    let mut csv = String::from("stride,start_s,end_s,stride_time_s");
    for name in Joint::ALL.map(Joint::name) {
        let _ = write!(csv, ",{name}_rmse_deg");
    }
    csv += ",rmse_deg\n";
    for (n, (span, stride)) in fit.strides.spans.iter().zip(fit.strides.cycles()).enumerate() {
        let (start, end) = (span.start_s + fit.conditioned.start_s, span.end_s + fit.conditioned.start_s);
        let _ = write!(csv, "{},{start:.4},{end:.4},{:.4}", n + 1, end - start);
        let errors = stride.rmse_deg(&fit.cycle);
        for error in errors.into_iter().chain([root_mean_square(&errors)]) {
            let _ = write!(csv, ",{error:.DIGITS$}");
        }
        csv.push('\n');
    }
    csv
}
