//! Writes a fit as one HTML page for a gait laboratory: errors, measures, curves over the cycle, findings, and the command that repeats it.
//!
//! | module | content |
//! |---|---|
//! | [`curves`] | strides, mean, generator and normative band over the cycle; residuals |
//! | `tables` | errors and ranges of motion, by joint |
//! | [`data`] | the same numbers as CSV |
//! | `recorded` | phase portraits, the recording, its findings |
//! | `words` | names and conditions that these share |
//! | `proof` | other generators, certificate, how to repeat the fit |
//!
//! The page needs no other file, no network and no script ([`crate::html`]).

pub mod curves;
pub mod data;
mod proof;
mod recorded;
mod tables;
mod words;

use std::fmt::Write as _;

use gait_trace::stride::cut::FEWEST_TO_ALIGN;

use crate::fit::Fit;
use crate::html::{self, csv_link, number};
use crate::judge::{JointFit, pooled};

/// The page as text. `command` is the command line that repeats the fit.
#[must_use]
pub fn html(fit: &Fit, command: &str) -> String {
    let mut page =
        html::begin(&format!("gait report, {}", fit.source.name), &format!("Gait report: {}", fit.source.name));
    html::paragraph(&mut page, &format!("Made by {} from {}.", fit.file.provenance.made_by, fit.format));
    fit.notes.iter().for_each(|text| html::note(&mut page, text));
    person(&mut page, fit);
    tables::motion(&mut page, fit);
    curves::of_the_person(&mut page, fit);
    downloads(&mut page, fit);
    headline(&mut page, fit);
    curves::of_the_generator(&mut page, fit);
    tables::errors(&mut page, fit);
    recorded::sections(&mut page, fit);
    proof::sections(&mut page, fit, command);
    page + html::END
}

/// The generator's error that counts, or why there is none.
fn headline(page: &mut String, fit: &Fit) {
    let heldout = pooled(&fit.joints, |joint| joint.rmse_heldout_deg);
    let floor = pooled(&fit.joints, |joint| joint.heldout_floor_deg);
    *page += "<section class=\"headline new-page\"><h2>The generator: error on strides that were not fitted</h2>";
    if let (Some(heldout), Some(floor)) = (heldout, floor) {
        // Writing to a String cannot fail.
        let _ = write!(page, "<p class=\"number\">{} degrees</p>", number(Some(heldout), 2));
        html::paragraph(
            page,
            &format!(
                "Root mean square over the four joints; {}. The same error of the person's own mean stride is {} degrees: the generator's is {} times as large.",
                fit.held_out.words(),
                number(Some(floor), 2),
                number(Some(heldout / floor), 2)
            ),
        );
    } else {
        *page += "<p class=\"number\">not known</p>";
        html::paragraph(
            page,
            "The recording has one stride only, and the generator was fitted to it. What cannot be known from one stride: the error on a stride that \
             was not fitted, and how much the person's strides and stride times vary. Record two strides or more; from 10 on, half of them are kept for \
             the judgement.",
        );
    }
    let driven = match pooled(&fit.joints, |joint: &JointFit| joint.rmse_driven_deg) {
        Some(driven) => format!(
            "As driven, after the limits of the robot, the error to the mean stride is {} degrees; without the limits {}. Walks: {}.",
            number(Some(driven), 2),
            number(pooled(&fit.joints, |joint| Some(joint.rmse_mean_stride_deg)), 2),
            fit.certificate.drive.in_words()
        ),
        None => format!(
            "It does not walk on the robot, so there is no error as driven. Walks: {}.",
            fit.certificate.drive.in_words()
        ),
    };
    html::paragraph(page, &driven);
    let facts = [
        ("generator", format!("{}, stride time {:.4} s", fit.file.set.name(), fit.period_s)),
        ("certificate", fit.certificate.status.words().to_owned()),
    ];
    html::table(page, "Generator", &[], facts.map(|(name, value)| [name.to_owned(), value]));
    *page += "</section>";
}

/// Cadence, stride time and how it varies.
fn person(page: &mut String, fit: &Fit) {
    let measures = &fit.measures;
    let no_seconds = || "not known: the time axis of the recording is a cycle, not seconds".to_owned();
    let too_few = || match fit.strides.cycles().len() {
        0 | 1 => "not known from one stride".to_owned(),
        n => format!("not known from {n} strides: from {FEWEST_TO_ALIGN} on, the ends of each are found on their own"),
    };
    let variability = match (measures.stride_time_sd_s, measures.stride_time_cv_percent) {
        (Some(sd), Some(cv)) => format!("SD {sd:.4} s, CV {cv:.2} %"),
        _ if measures.stride_time_s.is_none() => no_seconds(),
        _ => too_few(),
    };
    let [hip, knee] = fit.strides.asymmetry_deg();
    let facts = [
        (
            "cadence",
            measures.cadence_steps_per_min.map_or_else(no_seconds, |cadence| format!("{cadence:.1} steps a minute")),
        ),
        ("stride time", measures.stride_time_s.map_or_else(no_seconds, |seconds| format!("{seconds:.4} s"))),
        ("variability of the stride time", variability),
        ("strides used", fit.strides.cycles().len().to_string()),
        ("left against right, shifted by half a stride", format!("hip {hip:.1} deg, knee {knee:.1} deg")),
    ];
    *page += "<section><h2>The person</h2>";
    html::table(page, "Times and strides", &[], facts.map(|(name, value)| [name.to_owned(), value]));
    *page += "</section>";
}

fn downloads(page: &mut String, fit: &Fit) {
    let _ = write!(
        page,
        "<section class=\"screen\"><h2>The numbers as CSV</h2><ul class=\"links\"><li>{}: mean, standard deviation, generator, residual, each leg on its own cycle</li>\
         <li>{}: times and errors of each stride</li></ul></section>",
        csv_link(&format!("{}.cycle.csv", fit.source.name), "curves over the cycle", &data::cycle_csv(fit)),
        csv_link(&format!("{}.strides.csv", fit.source.name), "strides", &data::strides_csv(fit))
    );
}
