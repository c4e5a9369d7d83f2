//! What was recorded: phase portraits, the recording itself, and what was found in it.

use std::fmt::Write as _;

use gait_trace::Channel;
use gait_trace::stride::cycle::{Cycle, POINTS};
use joint_units::Joint;
use picture::inline::{Chart, Layer, whole};

use super::words::spaced;
use crate::fit::Fit;
use crate::html::{self, escape};

/// Most points of a line over the recording; more would not be visible.
const MOST_POINTS: usize = 1500;

pub(super) fn sections(page: &mut String, fit: &Fit) {
    *page += "<section><h2>Phase portraits</h2>";
    html::paragraph(page, "Angular velocity over angle: the mean stride as a solid line, the generator dashed.");
    *page += "<div class=\"charts\">";
    for joint in Joint::ALL {
        figure(
            page,
            &portrait(fit, joint),
            &format!("portrait-{}", joint.name().replace('_', "-")),
            &spaced(joint.name()),
        );
    }
    *page += "</div></section><section><h2>The recording</h2>";
    html::paragraph(page, "The left leg in blue, the right one in violet; grey parts were left out.");
    *page += "<div class=\"charts\">";
    for part in ["hip", "knee"] {
        figure(page, &timeline(fit, part), &format!("recording-{part}"), &format!("{part}s"));
    }
    *page += "</div><h3>Findings</h3>";
    if fit.conditioned.findings.is_empty() && fit.strides.left_out.is_empty() {
        html::paragraph(page, "No defect was found and every part of the recording was used.");
    } else {
        let findings = fit.conditioned.findings.iter().map(|finding| format!("{}: {finding}", finding.level().name()));
        html::list(page, findings.chain(fit.strides.left_out.iter().map(ToString::to_string)));
    }
    *page += "</section>";
}

/// A chart with its caption.
pub(super) fn figure(page: &mut String, chart: &Chart, id: &str, caption: &str) {
    // Writing to a String cannot fail.
    let _ = write!(page, "<figure><figcaption>{}</figcaption>{}</figure>", escape(caption), chart.svg(id));
}

fn portrait(fit: &Fit, joint: Joint) -> Chart {
    let rate = POINTS as f64 / (2.0 * fit.period_s);
    let of = |class, cycle: &Cycle| {
        let at = |k: usize| cycle.0[joint as usize][k % POINTS];
        let point = |k: usize| (at(k), (at(k + 1) - at(k + POINTS - 1)) * rate);
        Layer::Line(class, (0..=POINTS).map(point).collect())
    };
    let lines = vec![of("mean", &fit.strides.mean()), of("fit", &fit.cycle)];
    let angles = fit.strides.mean().0[joint as usize].into_iter().chain(fit.cycle.0[joint as usize]);
    let (least, most) = angles.fold((f64::MAX, f64::MIN), |(low, high), angle| (low.min(angle), high.max(angle)));
    let name = spaced(joint.name());
    Chart::new(
        &format!("Phase portrait of the {name}"),
        &format!("Angular velocity of the {name} over its angle, mean stride and generator, as closed curves."),
        ["angle, deg", "velocity, deg/s"],
        lines,
    )
    .along(whole((least, most), 0.05))
}

fn timeline(fit: &Fit, part: &str) -> Chart {
    let recording = &fit.conditioned.recording;
    let mut out: Vec<(f64, f64)> = fit.strides.left_out.iter().map(|part| (part.from_s, part.to_s)).collect();
    out.extend(fit.conditioned.unusable.iter().copied());
    let parts = out.len();
    let every = recording.time_s().len().div_ceil(MOST_POINTS).max(1);
    let of = |channel: &Channel| {
        let class = if channel.name().starts_with("left") { "left" } else { "right" };
        let points = recording.time_s().iter().zip(channel.values()).step_by(every).map(|(t, v)| (*t, *v));
        Layer::Line(class, points.collect())
    };
    let lines = recording.channels().iter().filter(|channel| channel.name().ends_with(part)).map(of);
    let x = if fit.conditioned.normalised_cycle { "cycle" } else { "time, s" };
    Chart::new(
        &format!("The recording, {part}s"),
        &format!("Angles of the left and the right {part} over the whole recording; {parts} parts were left out."),
        [x, "angle, deg"],
        std::iter::once(Layer::Strips("out", out)).chain(lines).collect(),
    )
}
