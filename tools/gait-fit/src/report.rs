//! Writes a fit as one self-contained HTML page: errors, plots, findings, and the command that repeats it.

use std::fmt::Write as _;

use gait_trace::stride::cycle::{Cycle, POINTS};
use joint_units::Joint;
use picture::{Band, Curve, Panel, draw};

use crate::fit::{Fit, Kind};
use crate::html::{HEAD, escape, row};
use crate::judge::HeldOut;

/// The page as text. `command` is the command line that repeats the fit.
///
/// # Errors
/// A plot cannot be drawn; the text is that of the drawing library.
pub fn html(fit: &Fit, command: &str) -> Result<String, String> {
    let mut page = String::from(HEAD);
    let title = escape(&fit.source.name);
    // Writing to a String cannot fail.
    let _ = write!(page, "<title>Footfall: {title}</title></head><body><h1>{title}</h1>");
    summary(&mut page, fit);
    joints(&mut page, fit);
    page += "<h2>Mean stride, its variability, and the fit</h2>";
    page += "<p>Band: mean stride plus and minus one standard deviation over the strides. 0 % is phase 0 of the generator, where the left hip is most flexed.</p>";
    page += &draw("Joint angles over the gait cycle", &stride_panels(fit), 2)?;
    page += "<h2>Phase portraits</h2>";
    page += &draw("Angular velocity over angle", &portraits(fit), 2)?;
    page += "<h2>The recording</h2>";
    page += &draw("Joint angles; grey parts were left out", &timeline(fit), 1)?;
    findings(&mut page, fit);
    compared(&mut page, fit)?;
    certificate(&mut page, fit);
    again(&mut page, fit, command);
    page += "</body></html>\n";
    Ok(page)
}

fn summary(page: &mut String, fit: &Fit) {
    let [hip, knee] = fit.strides.asymmetry_deg();
    *page += "<table>";
    for (name, value) in [
        ("generator", fit.file.set.name().to_owned()),
        ("stride time", format!("{:.4} s", fit.period_s)),
        (
            "strides",
            format!(
                "{} used, stride time {:.3} ± {:.3} s",
                fit.strides.cycles().len(),
                fit.strides.period_s,
                fit.strides.period_sd_s()
            ),
        ),
        ("left against right, shifted by half a stride", format!("hip {hip:.1} deg, knee {knee:.1} deg")),
        ("certificate", fit.certificate.status.words().to_owned()),
        ("walks", fit.certificate.drive.in_words()),
        ("recording", fit.format.clone()),
    ] {
        let _ = write!(page, "<tr><td>{}</td><td>{}</td></tr>", escape(name), escape(&value));
    }
    *page += "</table>";
    for note in &fit.notes {
        let _ = write!(page, "<p class=\"note\">{}</p>", escape(note));
    }
}

fn joints(page: &mut String, fit: &Fit) {
    let _ = write!(page, "<h2>Errors</h2><p>Held-out strides: {}.</p><table>", fit.held_out.words());
    row(
        page,
        "th",
        [
            "joint",
            "RMSE to the mean stride, deg",
            "the same as driven, deg",
            "RMSE on held-out strides, deg",
            "floor (own variability), deg",
            "stride-to-stride SD, deg",
            "peak error, deg",
            "peak timing, % of cycle",
            "phase error, deg",
            "range of motion, deg",
        ],
    );
    let number = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.2}"));
    for joint in &fit.joints {
        let cells = [
            joint.name.replace('_', " "),
            number(Some(joint.rmse_mean_stride_deg)),
            number(joint.rmse_driven_deg),
            number(joint.rmse_heldout_deg),
            number(joint.heldout_floor_deg),
            number(joint.stride_sd_deg),
            number(Some(joint.peak_error_deg)),
            number(Some(joint.peak_timing_percent)),
            number(Some(joint.phase_error_deg)),
            number(Some(joint.range_deg)),
        ];
        row(page, "td", cells.iter().map(String::as_str));
    }
    *page += "</table>";
    if fit.held_out != HeldOut::None {
        *page += "<p>Standard deviations are root mean squares over all strides, each closed to a cycle. The floor is the error of the mean of the fitted strides on the held-out ones: the person's own variability.</p>";
    }
}

fn percent(k: usize) -> f64 {
    100.0 * k as f64 / POINTS as f64
}

fn joint_title(joint: Joint) -> String {
    joint.name().replace('_', " ")
}

/// A closed cycle from `origin` on; its first point is drawn again at 100 %.
fn curve(name: &str, points: &[f64; POINTS], origin: usize) -> Curve {
    Curve::new(name, (0..=POINTS).map(|k| (percent(k), points[(k + origin) % POINTS])).collect())
}

fn stride_panels(fit: &Fit) -> Vec<Panel> {
    let (mean, strides) = (fit.strides.mean(), fit.strides.cycles());
    let panel = |joint: Joint| {
        let j = joint as usize;
        let sd = |k: usize| {
            let squares: f64 = strides.iter().map(|stride| (stride.0[j][k] - mean.0[j][k]).powi(2)).sum();
            (squares / strides.len() as f64).sqrt()
        };
        let edge = |k: usize| {
            let at = (k + fit.origin) % POINTS;
            (percent(k), mean.0[j][at] - sd(at), mean.0[j][at] + sd(at))
        };
        let curves = vec![curve("mean", &mean.0[j], fit.origin), curve("fit", &fit.cycle.0[j], fit.origin)];
        let panel = Panel::curves(&joint_title(joint), "gait cycle, %", "angle, deg", curves);
        if strides.len() > 1 { panel.banded(vec![Band((0..=POINTS).map(edge).collect())]) } else { panel }
    };
    Joint::ALL.map(panel).into()
}

fn portraits(fit: &Fit) -> Vec<Panel> {
    let mean = fit.strides.mean();
    let portrait = |cycle: &Cycle, j: usize| -> Vec<(f64, f64)> {
        let at = |k: usize| cycle.0[j][k % POINTS];
        let rate = POINTS as f64 / (2.0 * fit.period_s);
        (0..=POINTS).map(|k| (at(k), (at(k + 1) - at(k + POINTS - 1)) * rate)).collect()
    };
    let panel = |joint: Joint| {
        let j = joint as usize;
        let curves = vec![Curve::new("mean", portrait(&mean, j)), Curve::new("fit", portrait(&fit.cycle, j))];
        Panel::curves(&joint_title(joint), "angle, deg", "angular velocity, deg/s", curves)
    };
    Joint::ALL.map(panel).into()
}

fn timeline(fit: &Fit) -> Vec<Panel> {
    let recording = &fit.conditioned.recording;
    let mut shades: Vec<(f64, f64)> = fit.strides.left_out.iter().map(|part| (part.from_s, part.to_s)).collect();
    shades.extend(fit.conditioned.unusable.iter().copied());
    // More points than this would not be visible.
    let every = recording.time_s().len().div_ceil(2000).max(1);
    let x = if fit.conditioned.normalised_cycle { "cycle" } else { "time, s" };
    let panel = |part: &str| {
        let of = |channel: &gait_trace::Channel| {
            let points = recording.time_s().iter().zip(channel.values()).step_by(every).map(|(t, v)| (*t, *v));
            Curve::new(&channel.name().replace('_', " "), points.collect())
        };
        let curves = recording.channels().iter().filter(|channel| channel.name().ends_with(part)).map(of).collect();
        Panel::curves(&format!("{part}s"), x, "angle, deg", curves).shaded(&shades)
    };
    vec![panel("hip"), panel("knee")]
}

fn findings(page: &mut String, fit: &Fit) {
    if fit.conditioned.findings.is_empty() && fit.strides.left_out.is_empty() {
        *page += "<p>No defect was found and every part of the recording was used.</p>";
        return;
    }
    *page += "<ul>";
    for finding in &fit.conditioned.findings {
        let _ = write!(page, "<li>{}</li>", escape(&finding.to_string()));
    }
    for part in &fit.strides.left_out {
        let _ = write!(page, "<li>{}</li>", escape(&part.to_string()));
    }
    *page += "</ul>";
}

fn compared(page: &mut String, fit: &Fit) -> Result<(), String> {
    if fit.compared.is_empty() {
        return Ok(());
    }
    *page += "<h2>Other generators on the same mean stride</h2><table>";
    row(
        page,
        "th",
        ["generator", "left hip", "right hip", "left knee", "right knee", "kicks and random starts come back"],
    );
    for other in &fit.compared {
        let mut cells = vec![other.name.clone()];
        cells.extend(other.rmse_deg.map(|rmse| format!("{rmse:.2}")));
        cells.push(match other.holds {
            None => "no state except the phase".into(),
            Some(true) => "yes".into(),
            Some(false) => "no".into(),
        });
        row(page, "td", cells.iter().map(String::as_str));
    }
    *page += "</table><p>Root mean square errors in degrees.</p><h2>Convergence</h2>";
    let harmonics = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0].into_iter().zip(&fit.compared);
    let series =
        Curve::new("", harmonics.map(|(n, other)| (n, gait_trace::root_mean_square(&other.rmse_deg))).collect());
    let mut panels = vec![Panel::curves("phase and shape", "harmonics", "RMSE of all joints, deg", vec![series])];
    if !fit.history.is_empty() {
        // The first points of a search are arbitrary; only those close to a gait are drawn.
        let steps = fit.history.iter().filter(|(_, best)| *best < 30.0).map(|(n, best)| (*n as f64, *best)).collect();
        panels.push(Panel::curves(
            "the thesis' network, CMA-ES",
            "evaluations",
            "RMSE of all joints, deg",
            vec![Curve::new("", steps)],
        ));
    }
    *page += &draw("Error against effort", &panels, 2)?;
    Ok(())
}

fn certificate(page: &mut String, fit: &Fit) {
    let certificate = &fit.certificate;
    let returns = &certificate.returns;
    *page += "<h2>Certificate</h2><table>";
    let no_state = returns.kicks == 0;
    let multiplier = returns.multipliers.first().map_or("none".into(), |largest| format!("{largest:.3}"));
    let settling = returns.settling_s.map_or("a kick is lost".into(), |s| format!("{s:.2} s"));
    let of = |some: u32, all: u32| {
        if no_state { "not applicable: no state except the phase".into() } else { format!("{some} of {all}") }
    };
    let following = certificate.following.iter().flat_map(generator_file::following::Following::in_words);
    for (name, value) in [
        ("result", certificate.refused_because.clone().unwrap_or("accepted".into())),
        ("walks on the robot", certificate.drive.in_words()),
        ("random starts on the orbit", of(returns.converged, returns.starts)),
        (
            "kicks of half an amplitude that come back",
            of(returns.kicks - returns.kicks_lost.len() as u32, returns.kicks),
        ),
        ("settling time after a kick, the worst phase", if no_state { "not applicable".into() } else { settling }),
        ("largest Floquet multiplier", multiplier),
        ("largest stable step in f32", format!("{:.1} ms", certificate.largest_step_ms)),
    ]
    .into_iter()
    .chain(following)
    {
        let _ = write!(page, "<tr><td>{}</td><td>{}</td></tr>", escape(name), escape(&value));
    }
    *page += "</table>";
}

fn again(page: &mut String, fit: &Fit, command: &str) {
    let search = if fit.settings.generator == Kind::Thesis || fit.settings.compare {
        format!("seed {}, {} evaluations", fit.settings.seed, fit.settings.evaluations)
    } else {
        "no random numbers".into()
    };
    let _ = write!(
        page,
        "<h2>Repeating this fit</h2><pre>{}</pre><table><tr><td>recording, SHA-256</td><td><code>{}</code></td></tr>\
         <tr><td>program</td><td>{}</td></tr><tr><td>settings</td><td>{}; {}</td></tr></table><h2>Parameters</h2><pre>{}</pre>",
        escape(command),
        escape(&fit.source.sha256),
        escape(&fit.file.provenance.made_by),
        escape(&fit.settings.to_string()),
        search,
        escape(&fit.file.to_toml())
    );
}
