//! Tables by joint: ranges of motion, left against right, and errors.

use super::words::is_judged;
use crate::fit::Fit;
use crate::html::{self, number};
use crate::judge::JointFit;
use crate::measures::{Difference, Motion};
use crate::normative;
use joint_units::Joint;

/// Range of motion, a column a joint.
pub(super) fn motion(page: &mut String, fit: &Fit) {
    let measures = &fit.measures;
    *page += "<section><h2>Range of motion</h2>";
    html::paragraph(
        page,
        "Least and greatest angle of the mean stride, flexion positive, in degrees; their places in percent of the cycle of the same leg.",
    );
    let row = |name: &str, value: &dyn Fn(&Motion) -> String| -> Vec<String> {
        std::iter::once(name.to_owned()).chain(measures.motion.iter().map(value)).collect()
    };
    let mut rows = vec![
        row("least, deg", &|motion| number(Some(motion.min_deg), 1)),
        row("at, %", &|motion| number(Some(motion.min_at_percent), 0)),
        row("greatest, deg", &|motion| number(Some(motion.max_deg), 1)),
        row("at, %", &|motion| number(Some(motion.max_at_percent), 0)),
        row("range, deg", &|motion| number(Some(motion.range_deg), 1)),
        row("SD of the range over strides, deg", &|motion| number(motion.range_sd_deg, 1)),
        row("range of the generator, deg", &|motion| number(Some(motion.generator_range_deg), 1)),
    ];
    if measures.cycle_start.initial_contact {
        let of = Joint::ALL.map(|joint| {
            let (mean, sd) = normative::band(joint).range_deg;
            format!("{} ± {}", number(Some(mean), 1), number(Some(sd), 1))
        });
        rows.push(std::iter::once("range of the normative persons, deg".to_owned()).chain(of).collect());
    }
    html::table(page, "Range of motion by joint", &heads("angle"), rows);
    let [hip, knee] = &measures.left_minus_right;
    let row = |name: &str, value: fn(&Difference) -> f64| {
        [name.to_owned(), number(Some(value(hip)), 1), number(Some(value(knee)), 1)]
    };
    html::table(
        page,
        "Left minus right, degrees",
        &["of", "hip", "knee"],
        [row("least", |d| d.min_deg), row("greatest", |d| d.max_deg), row("range", |d| d.range_deg)],
    );
    if !is_judged(fit) {
        html::paragraph(page, "A dash is a value that cannot be known from one stride.");
    }
    *page += "</section>";
}

/// Errors, a column a joint.
pub(super) fn errors(page: &mut String, fit: &Fit) {
    *page += "<section><h2>Errors by joint</h2>";
    html::paragraph(
        page,
        &format!("Root mean square errors in degrees. Strides that were not fitted: {}.", fit.held_out.words()),
    );
    let row = |name: &str, value: &dyn Fn(&JointFit) -> Option<f64>| -> Vec<String> {
        std::iter::once(name.to_owned()).chain(fit.joints.iter().map(|joint| number(value(joint), 2))).collect()
    };
    let rows = [
        row("on strides that were not fitted", &|joint| joint.rmse_heldout_deg),
        row("the same of the mean of the fitted strides (floor)", &|joint| joint.heldout_floor_deg),
        row("to the mean stride", &|joint| Some(joint.rmse_mean_stride_deg)),
        row("to the mean stride, as driven", &|joint| joint.rmse_driven_deg),
        row("SD from stride to stride", &|joint| joint.stride_sd_deg),
        row("peak: generator minus mean stride", &|joint| Some(joint.peak_error_deg)),
        row("peak, later by % of the cycle", &|joint| Some(joint.peak_timing_percent)),
        row("phase, early by degrees of the cycle", &|joint| Some(joint.phase_error_deg)),
    ];
    html::table(page, "Errors by joint, degrees", &heads("error"), rows);
    html::paragraph(
        page,
        if is_judged(fit) {
            "Standard deviations are root mean squares over all strides, each closed to a cycle. The floor is the person's own variability: a generator that was fitted to that mean cannot be expected to have a smaller error."
        } else {
            "A dash is a value that cannot be known from one stride. The error to the mean stride is that to the one stride that was fitted."
        },
    );
    if fit.joints.iter().any(|joint| joint.rmse_driven_deg.is_none()) {
        html::paragraph(page, "As driven: a dash, because the generator does not walk on the robot.");
    }
    *page += "</section>";
}

/// The heads of the columns: that of the rows, and the joints.
fn heads(first: &str) -> [&str; 5] {
    [first, "left hip", "right hip", "left knee", "right knee"]
}

/// The heads are in the order of the joints.
#[cfg(test)]
#[test]
fn heads_are_the_joints() {
    let names = Joint::ALL.map(|joint| super::words::spaced(joint.name()));
    assert_eq!(heads("")[1..], names.each_ref().map(String::as_str));
}
