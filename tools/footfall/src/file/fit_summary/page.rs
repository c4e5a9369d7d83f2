//! The page of all fits in a folder: sorted by the error on strides that were not fitted, with small pictures, and the files without a fit.

use gait_fit::html::{self, escape, number, percent_encoded};
use joint_units::Joint;
use picture::inline::{Chart, Layer};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

use super::result_file::curves_of;

/// Title of the page, by which a summary is recognised, and its heading.
const TITLES: [&str; 2] = ["fits", "Fits of a folder"];

/// Sorts the table by the column whose head is clicked. Without it the page is sorted already.
const SCRIPT: &str = include_str!("sort.js");

/// Heads of the columns before those of the joints.
const HEADS: [&str; 8] = [
    "recording",
    "held-out error, deg",
    "times the floor",
    "strides",
    "stride time, s",
    "CV, %",
    "as driven, deg",
    "walks",
];

/// The column by which the page is sorted.
const SORTED: usize = 1;

/// The page. `folder` is where it will be.
pub(super) fn page(folder: &Path, all: &[Value]) -> String {
    let mut page = html::begin(TITLES[0], TITLES[1]);
    let with = |key: &str| all.iter().filter(|outcome| outcome[key].is_string()).collect::<Vec<_>>();
    let (failed, skipped) = (with("error"), with("skipped"));
    let mut fitted = with("generator");
    let error = |outcome: &Value| outcome["rmse_heldout_deg"].as_f64().unwrap_or(f64::INFINITY);
    fitted.sort_by(|a, b| error(a).total_cmp(&error(b)));
    counts(&mut page, &fitted, failed.len(), skipped.len());
    if !fitted.is_empty() {
        html::paragraph(
            &mut page,
            "The held-out error is that on strides that were not fitted, root mean square over the four joints; the floor is the same error of the \
             person's own mean stride. Small pictures: the mean stride as a solid line and the generator dashed, each leg on its own cycle, and \
             the held-out error of the joint in degrees.",
        );
        table(&mut page, folder, &fitted);
    }
    reasons(&mut page, "Refused files", "Files that could not be fitted, with the reason", &failed, "error");
    reasons(&mut page, "Skipped files", "Files that are no recordings of gait, with the reason", &skipped, "skipped");
    // Writing to a String cannot fail.
    let _ = write!(page, "<script>{SCRIPT}</script>");
    page + html::END
}

fn counts(page: &mut String, fitted: &[&Value], failed: usize, skipped: usize) {
    let of = |is: &dyn Fn(&Value) -> bool| fitted.iter().filter(|outcome| is(outcome)).count();
    let stands = of(&|outcome| outcome["certificate"]["drive"]["walks"] != true);
    let unjudged = of(&|outcome| outcome["rmse_heldout_deg"].is_null());
    let rows = [
        ("files", fitted.len() + failed + skipped),
        ("fitted", fitted.len()),
        ("fitted, and does not walk on the robot", stands),
        ("fitted from one stride, so that the held-out error is not known", unjudged),
        ("refused", failed),
        ("skipped as no recording of gait", skipped),
    ];
    html::table(page, "Number of files", &[], rows.map(|(name, count)| [name.to_owned(), count.to_string()]));
}

/// A cell: its HTML, and the key by which its column is sorted.
struct Cell(String, String);

fn table(page: &mut String, folder: &Path, fitted: &[&Value]) {
    *page += "<h2>Fits</h2><div class=\"table\" role=\"region\" aria-label=\"Fits\" tabindex=\"0\">\
              <table class=\"cards\" role=\"table\"><caption>Fits, the smallest held-out error first</caption><thead role=\"rowgroup\"><tr role=\"row\">";
    let joints = Joint::ALL.map(|joint| joint.name().replace('_', " "));
    let heads: Vec<&str> = HEADS.into_iter().chain(joints.iter().map(String::as_str)).collect();
    for (n, head) in heads.iter().enumerate() {
        let sorted = if n == SORTED { " aria-sort=\"ascending\"" } else { "" };
        let _ = write!(page, "<th scope=\"col\" role=\"columnheader\"{sorted}>{head}</th>");
    }
    *page += "</tr></thead><tbody role=\"rowgroup\">";
    for (n, outcome) in fitted.iter().enumerate() {
        *page += "<tr role=\"row\">";
        let curves = curves_of(outcome);
        let cells =
            cells(folder, outcome).into_iter().chain((0..Joint::COUNT).map(|j| joint_cell(outcome, &curves, n, j)));
        for (k, (Cell(html, key), head)) in cells.zip(&heads).enumerate() {
            let key = escape(&key);
            let _ = if k == 0 {
                write!(page, "<th scope=\"row\" role=\"rowheader\" data-sort=\"{key}\">{html}</th>")
            } else {
                write!(page, "<td role=\"cell\" data-sort=\"{key}\" data-label=\"{head}\">{html}</td>")
            };
        }
        *page += "</tr>";
    }
    *page += "</tbody></table></div>";
}

/// The cells before those of the joints.
fn cells(folder: &Path, outcome: &Value) -> Vec<Cell> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let value = |value: Option<f64>, digits: usize| {
        Cell(number(value, digits), value.map_or(String::new(), |value| value.to_string()))
    };
    let name = text(&outcome["recording"]);
    let report = outcome["report"].as_str().filter(|path| folder.join(path).is_file());
    let link = match report {
        Some(path) => format!("<a href=\"{}\">{}</a>", percent_encoded(path), html::file_name(&name)),
        None => html::file_name(&name),
    };
    let joints = || outcome["joints"].as_array().into_iter().flatten();
    let pooled = |key: &str| {
        let errors: Option<Vec<f64>> = joints().map(|joint| joint[key].as_f64()).collect();
        errors.filter(|errors| !errors.is_empty()).map(|errors| gait_trace::root_mean_square(&errors))
    };
    let held_out = outcome["rmse_heldout_deg"].as_f64();
    let floor = pooled("heldout_floor_deg");
    let drive = &outcome["certificate"]["drive"];
    let walks = if drive["walks"] == true { "yes".into() } else { format!("no: {}", text(&drive["why_not"])) };
    let measures = &outcome["measures"];
    vec![
        Cell(link, name),
        held_out.map_or_else(|| Cell("one stride".into(), String::new()), |error| value(Some(error), 2)),
        value(held_out.zip(floor).map(|(error, floor)| error / floor), 2),
        value(outcome["strides"].as_f64(), 0),
        value(measures["stride_time_s"].as_f64(), 3),
        value(measures["stride_time_cv_percent"].as_f64(), 2),
        value(pooled("rmse_driven_deg"), 2),
        Cell(escape(&walks), walks),
    ]
}

/// The small picture of a joint, and its error on strides that were not fitted.
fn joint_cell(outcome: &Value, curves: &Value, row: usize, joint: usize) -> Cell {
    let curves = &curves[joint];
    let line = |class: &'static str, key: &str| {
        let values = curves[key].as_array().into_iter().flatten().filter_map(Value::as_f64);
        Layer::Line(class, values.enumerate().map(|(k, angle)| (k as f64, angle)).collect())
    };
    let error = outcome["joints"][joint]["rmse_heldout_deg"].as_f64();
    let name = Joint::ALL.get(joint).map_or("", |joint| joint.name()).replace('_', " ");
    let recording = outcome["recording"].as_str().unwrap_or_default();
    let chart = Chart::new(
        &format!("{name} of {recording}"),
        &format!("Mean stride and generator of the {name} over the cycle."),
        ["", ""],
        vec![line("mean", "mean_deg"), line("fit", "generator_deg")],
    );
    let key = error.map_or(String::new(), |error| error.to_string());
    Cell(format!("{} <span>{}</span>", chart.small_svg(&format!("small-{row}-{joint}")), number(error, 2)), key)
}

/// A table of files without a fit.
fn reasons(page: &mut String, title: &str, caption: &str, outcomes: &[&Value], key: &str) {
    if outcomes.is_empty() {
        return;
    }
    let _ = write!(page, "<h2>{title}</h2>");
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    html::table(
        page,
        caption,
        &["file", "reason"],
        outcomes.iter().map(|outcome| [text(&outcome["recording"]), text(&outcome[key])]),
    );
}
