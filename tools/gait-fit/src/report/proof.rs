//! Other generators on the same stride, the certificate, and how to repeat the fit.

use std::fmt::Write as _;

use picture::inline::{Chart, Layer};

use super::recorded::figure;
use crate::fit::{Fit, Kind};
use crate::html::{self, escape, number};

/// Errors above this are those of a search that has only begun, degrees.
const BEGINNING_DEG: f64 = 30.0;

pub(super) fn sections(page: &mut String, fit: &Fit, command: &str) {
    compared(page, fit);
    certificate(page, fit);
    again(page, fit, command);
}

fn compared(page: &mut String, fit: &Fit) {
    if fit.compared.is_empty() {
        return;
    }
    *page += "<section><h2>Other generators on the same mean stride</h2>";
    let rows = fit.compared.iter().map(|other| {
        let holds = match other.holds {
            None => "no state except the phase",
            Some(true) => "yes",
            Some(false) => "no",
        };
        let errors = other.rmse_deg.map(|rmse| number(Some(rmse), 2));
        std::iter::once(other.name.clone()).chain(errors).chain([holds.to_owned()]).collect::<Vec<_>>()
    });
    html::table(
        page,
        "Root mean square errors of other generators, degrees",
        &["generator", "left hip", "right hip", "left knee", "right knee", "kicks and random starts come back"],
        rows,
    );
    *page += "<h3>Error against effort</h3><div class=\"charts\">";
    let harmonics = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0].into_iter().zip(&fit.compared);
    let errors = harmonics.map(|(n, other)| (n, gait_trace::root_mean_square(&other.rmse_deg))).collect();
    let y = "RMSE of all joints, deg";
    let shape = Chart::new(
        "Phase and shape, error over harmonics",
        "The root mean square error of all joints falls with the number of harmonics; the table above has the numbers.",
        ["harmonics", y],
        vec![Layer::Line("plain", errors)],
    );
    figure(page, &shape, "effort-shape", "phase and shape");
    if !fit.history.is_empty() {
        let steps = fit.history.iter().filter(|(_, best)| *best < BEGINNING_DEG).map(|(n, best)| (*n as f64, *best));
        let search = Chart::new(
            "The thesis' network, error over evaluations",
            "The best error that the search has found, over the number of networks that it has simulated.",
            ["evaluations", y],
            vec![Layer::Line("plain", steps.collect())],
        );
        figure(page, &search, "effort-thesis", "the thesis' network, CMA-ES");
    }
    *page += "</div></section>";
}

fn certificate(page: &mut String, fit: &Fit) {
    let certificate = &fit.certificate;
    let returns = &certificate.returns;
    let no_state = returns.kicks == 0;
    let multiplier = returns.multipliers.first().map_or("none".into(), |largest| format!("{largest:.3}"));
    let settling = returns.settling_s.map_or("a kick is lost".into(), |s| format!("{s:.2} s"));
    let of = |some: u32, all: u32| {
        if no_state { "not applicable: no state except the phase".into() } else { format!("{some} of {all}") }
    };
    let following = certificate.following.iter().flat_map(generator_file::following::Following::in_words);
    let facts = [
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
    ];
    *page += "<section><h2>Certificate</h2>";
    if certificate.drive.why_not.is_some() || !certificate.excesses.is_empty() {
        html::paragraph(
            page,
            "Where limits of the robot are named with a place in the stride, 0 % is phase 0 of the generator: the left hip is most flexed.",
        );
    }
    html::table(
        page,
        "What was tried on the generator",
        &[],
        facts.into_iter().chain(following).map(|(name, value)| [name.to_owned(), value]),
    );
    *page += "</section>";
}

fn again(page: &mut String, fit: &Fit, command: &str) {
    let search = if fit.settings.generator == Kind::Thesis || fit.settings.compare {
        format!("seed {}, {} evaluations", fit.settings.seed, fit.settings.evaluations)
    } else {
        "no random numbers".into()
    };
    // Writing to a String cannot fail.
    let _ = write!(page, "<section><h2>Repeating this fit</h2><pre>{}</pre>", escape(command));
    html::table(
        page,
        "What the fit was made from",
        &[],
        [
            ["recording, SHA-256", &fit.source.sha256],
            ["program", &fit.file.provenance.made_by],
            ["settings", &format!("{}; {search}", fit.settings)],
        ],
    );
    let _ = write!(page, "<h3>Parameters</h3><pre>{}</pre></section>", escape(&fit.file.to_toml()));
}
