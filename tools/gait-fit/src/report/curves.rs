//! Charts over the gait cycle: left over right; every stride, their mean, the generator, the normative band; and the residuals.

use std::fmt::Write as _;

use gait_trace::stride::cycle::{Cycle, POINTS};
use joint_units::Joint;
use picture::inline::{Chart, Layer, whole};

use super::recorded::figure;
use super::words::{is_judged, spaced};
use crate::fit::Fit;
use crate::html::{self, escape, number};
use crate::normative;

/// Most strides that are drawn for a joint; more would be one grey area, and a large page.
const MOST_STRIDES: usize = 40;
/// Name and class of the lines of a chart.
const LINES: [(&str, &str); 8] = [
    ("left, mean stride", "left"),
    ("right, mean stride", "right dashed"),
    ("normative band", "others"),
    ("single strides", "stride"),
    ("mean stride", "mean"),
    ("generator", "fit"),
    ("as driven, after the limits", "driven"),
    ("strides, one standard deviation", "band"),
];

/// The mean strides of both legs, left over right in one chart.
pub(super) fn of_the_person(page: &mut String, fit: &Fit) {
    *page += "<section><h2>Left over right</h2>";
    html::paragraph(page, &format!("Each leg is on its own cycle. {}", fit.measures.cycle_start.words()));
    if let Some([left, right]) = fit.measures.cycle_start.foot_off_percent {
        html::paragraph(
            page,
            &format!(
                "Stance ends at the vertical line: {left:.0} % of the cycle at the left leg, {right:.0} % at the right, estimated where the ankle is \
                 furthest behind its hip (Zeni et al. 2008); in a recording with the events of a laboratory, at most 2.3 % of the cycle early."
            ),
        );
    }
    if has_band(fit) {
        html::paragraph(page, &normative::words());
        if let Some(cadence) = fit.measures.cadence_steps_per_min
            && !(normative::CADENCES.0 - 0.5..=normative::CADENCES.1 + 0.5).contains(&cadence)
        {
            html::paragraph(
                page,
                &format!("The cadence of this recording, {cadence:.1} steps a minute, is outside of that range."),
            );
        }
    } else {
        html::paragraph(page, "The normative band is not shown: its 0 % is initial contact, which was not found here.");
    }
    let mut used = vec!["left", "right dashed"];
    used.extend(has_band(fit).then_some("others"));
    legend(page, &used);
    *page += "<div class=\"charts\">";
    for (part, legs) in [("hip", [Joint::LeftHip, Joint::RightHip]), ("knee", [Joint::LeftKnee, Joint::RightKnee])] {
        figure(page, &both_legs(fit, part, legs), &format!("legs-{part}"), part);
    }
    *page += "</div></section>";
}

/// The mean stride of a joint of both legs, each over the cycle of its own leg.
fn both_legs(fit: &Fit, part: &str, legs: [Joint; 2]) -> Chart {
    let mut layers: Vec<Layer> = has_band(fit).then(|| band(legs[0])).into_iter().collect();
    let mean = fit.strides.mean();
    let own = |joint: Joint| fit.measures.cycle_start.own_cycle(&mean, joint);
    let classes = ["left", "right dashed"];
    layers.extend(classes.into_iter().zip(legs).map(|(class, joint)| line(class, &own(joint), 1)));
    if let Some(offs) = fit.measures.cycle_start.foot_off_percent {
        let angles = legs.map(own);
        let least = angles.as_flattened().iter().copied().fold(f64::MAX, f64::min);
        let most = angles.as_flattened().iter().copied().fold(f64::MIN, f64::max);
        layers.extend(
            classes.into_iter().zip(offs).map(|(class, off)| Layer::Line(class, vec![(off, least), (off, most)])),
        );
    }
    let range = |joint: Joint| number(Some(fit.measures.motion[joint as usize].range_deg), 1);
    let description = format!(
        "Mean angle of the left and the right {part} over the cycle of their own leg; the range of the left one is {} degrees, of the right one {} degrees.",
        range(legs[0]),
        range(legs[1])
    );
    Chart::new(&format!("Left and right {part}"), &description, ["gait cycle of the same leg, %", "angle, deg"], layers)
        .along(0.0..=100.0)
}

/// The charts of the generator with their headings and legends.
pub(super) fn of_the_generator(page: &mut String, fit: &Fit) {
    let strides = fit.strides.cycles().len();
    let drawn = drawn_strides(fit).count();
    *page += "<section><h2>Generator over the gait cycle</h2>";
    if strides > 1 {
        html::paragraph(
            page,
            &if drawn < strides {
                format!("{drawn} of {strides} strides are drawn.")
            } else {
                format!("All {strides} strides are drawn.")
            },
        );
    } else {
        html::paragraph(page, "There is one stride; it is the mean stride, and nothing is known of its variability.");
    }
    let mut used = vec!["mean", "fit"];
    used.extend(has_band(fit).then_some("others"));
    used.extend((strides > 1).then_some("stride"));
    used.extend(has_driven(fit).then_some("driven"));
    legend(page, &used);
    charts(page, fit, "cycle", "angle, deg", overlay);
    *page += "<div class=\"block\"><h3>Residuals: generator minus mean stride</h3>";
    let mut used = vec!["fit"];
    if strides > 1 {
        html::paragraph(
            page,
            "A residual inside the band is smaller than the standard deviation of the strides at that point of the cycle.",
        );
        used.push("band");
    }
    used.extend(has_driven(fit).then_some("driven"));
    legend(page, &used);
    charts(page, fit, "residual", "residual, deg", residuals);
    *page += "</div>";
    if !is_judged(fit) {
        html::paragraph(page, "With one stride the residuals are those of the stride that was fitted.");
    }
    *page += "</section>";
}

/// The band is that of a cycle that begins with contact.
fn has_band(fit: &Fit) -> bool {
    fit.measures.cycle_start.initial_contact
}

/// The setpoints are drawn where limits change them.
fn has_driven(fit: &Fit) -> bool {
    fit.driven.is_some() && fit.certificate.drive.limited_ticks > 0
}

/// A legend of the lines with these classes.
fn legend(page: &mut String, used: &[&str]) {
    let entries: Vec<(&str, &str)> = LINES.into_iter().filter(|(_, class)| used.contains(class)).collect();
    html::legend(page, &entries);
}

/// A chart for each joint; the vertical axis is that of both hips, and of both knees.
fn charts(page: &mut String, fit: &Fit, id: &str, y: &str, of: fn(&Fit, Joint) -> (String, Vec<Layer>)) {
    let all = Joint::ALL.map(|joint| {
        let name = spaced(joint.name());
        let (description, layers) = of(fit, joint);
        Chart::new(&name, &description, ["gait cycle of the same leg, %", y], layers).along(0.0..=100.0)
    });
    *page += "<div class=\"charts\">";
    for (n, (chart, joint)) in all.iter().zip(Joint::ALL).enumerate() {
        let (pair, other) = (chart.y_span(), all[n ^ 1].y_span());
        let both = (pair.0.min(other.0), pair.1.max(other.1));
        let svg = chart.clone().between(whole(both, 0.05)).svg(&format!("{id}-{}", joint.name().replace('_', "-")));
        let _ = write!(page, "<figure><figcaption>{}</figcaption>{svg}</figure>", escape(&spaced(joint.name())));
    }
    *page += "</div>";
}

fn percent(k: usize) -> f64 {
    100.0 * k as f64 / POINTS as f64
}

/// A line over the cycle; its first point is drawn again at 100 %.
fn line(class: &'static str, points: &[f64; POINTS], every: usize) -> Layer {
    Layer::Line(class, (0..=POINTS).step_by(every).map(|k| (percent(k), points[k % POINTS])).collect())
}

/// The strides that are drawn, evenly chosen.
fn drawn_strides(fit: &Fit) -> impl Iterator<Item = &Cycle> {
    let all = fit.strides.cycles();
    all.iter().step_by(all.len().div_ceil(MOST_STRIDES).max(1))
}

/// Standard deviation of the strides at each point, root mean square over all strides.
pub(super) fn sd_at_points(fit: &Fit, joint: Joint) -> [f64; POINTS] {
    let (mean, all) = (fit.strides.mean(), fit.strides.cycles());
    let j = joint as usize;
    let squares = |k: usize| all.iter().map(|stride| (stride.0[j][k] - mean.0[j][k]).powi(2)).sum::<f64>();
    let mut by_stride = mean.clone();
    by_stride.0[j] = std::array::from_fn(|k| (squares(k) / all.len() as f64).sqrt());
    fit.measures.cycle_start.own_cycle(&by_stride, joint)
}

fn band(joint: Joint) -> Layer {
    let band = normative::band(joint);
    let edge = |n: usize| {
        let (x, k) = (100.0 * n as f64 / normative::POINTS as f64, n % normative::POINTS);
        (x, band.mean_deg[k] - band.sd_deg[k], band.mean_deg[k] + band.sd_deg[k])
    };
    Layer::Band("others", (0..=normative::POINTS).map(edge).collect())
}

fn overlay(fit: &Fit, joint: Joint) -> (String, Vec<Layer>) {
    let own = |cycle: &Cycle| fit.measures.cycle_start.own_cycle(cycle, joint);
    let mut layers = vec![];
    if has_band(fit) {
        layers.push(band(joint));
    }
    if fit.strides.cycles().len() > 1 {
        layers.extend(drawn_strides(fit).map(|stride| line("stride", &own(stride), 2)));
    }
    layers.push(line("mean", &own(&fit.strides.mean()), 1));
    layers.push(line("fit", &own(&fit.cycle), 1));
    if let Some(driven) = fit.driven.as_ref().filter(|_| has_driven(fit)) {
        layers.push(line("driven", &own(driven), 1));
    }
    let motion = &fit.measures.motion[joint as usize];
    let description = format!(
        "Angle of the {} over the cycle of its leg. The mean stride goes from {} degrees at {:.0} % to {} degrees at {:.0} %; the root mean square error of the generator is {} degrees.",
        spaced(motion.name),
        number(Some(motion.min_deg), 1),
        motion.min_at_percent,
        number(Some(motion.max_deg), 1),
        motion.max_at_percent,
        number(Some(fit.joints[joint as usize].rmse_mean_stride_deg), 2)
    );
    (description, layers)
}

/// Generator minus mean stride, over the leg's own cycle, degrees.
pub(super) fn residual(fit: &Fit, joint: Joint) -> [f64; POINTS] {
    let own = |cycle: &Cycle| fit.measures.cycle_start.own_cycle(cycle, joint);
    let (generator, mean) = (own(&fit.cycle), own(&fit.strides.mean()));
    std::array::from_fn(|k| generator[k] - mean[k])
}

fn residuals(fit: &Fit, joint: Joint) -> (String, Vec<Layer>) {
    let residual = residual(fit, joint);
    let mut layers = vec![];
    if fit.strides.cycles().len() > 1 {
        let sd = sd_at_points(fit, joint);
        layers.push(Layer::Band("band", (0..=POINTS).map(|k| (percent(k), -sd[k % POINTS], sd[k % POINTS])).collect()));
    }
    layers.push(line("fit", &residual, 1));
    if let Some(driven) = fit.driven.as_ref().filter(|_| has_driven(fit)) {
        let own = |cycle: &Cycle| fit.measures.cycle_start.own_cycle(cycle, joint);
        let (driven, mean) = (own(driven), own(&fit.strides.mean()));
        layers.push(line("driven", &std::array::from_fn(|k| driven[k] - mean[k]), 1));
    }
    let worst = (0..POINTS).max_by(|a, b| residual[*a].abs().total_cmp(&residual[*b].abs())).unwrap_or(0);
    let description = format!(
        "Generator minus mean stride of the {}; the largest residual is {} degrees, at {:.0} % of the cycle.",
        spaced(joint.name()),
        number(Some(residual[worst]), 2),
        percent(worst)
    );
    (description, layers)
}
