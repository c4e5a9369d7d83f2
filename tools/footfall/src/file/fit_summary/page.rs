//! The page of all fits in a folder: sorted by the error on strides that were not fitted, with small pictures, and the files without a fit.

use gait_fit::html::{self, escape, number, percent_encoded};
use joint_units::Joint;
use picture::inline::{Chart, Layer};
use serde_json::Value;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use super::result_file::{self, warnings};

/// Title of the page, by which a summary is recognised, and its heading.
const TITLES: [&str; 2] = ["fits", "Gait report: fits of a folder"];

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

/// What the page needs of a result before its row is written.
pub(super) enum Entry {
    Fitted {
        /// The error on strides that were not fitted, degrees; infinite if it is not known.
        error: f64,
        /// Whether the generator walks on the robot.
        walks: bool,
        recording: String,
        /// Its warnings, one after the other; empty if there are none.
        warnings: String,
    },
    Failed {
        recording: String,
        why: String,
    },
    Skipped {
        recording: String,
        why: String,
    },
}

impl Entry {
    pub(super) fn of(outcome: &Value) -> Self {
        let text = |key: &str| outcome[key].as_str().map(str::to_owned);
        let recording = text("recording").unwrap_or_default();
        match (text("skipped"), text("error")) {
            (Some(why), _) => Self::Skipped { recording, why },
            (None, Some(why)) => Self::Failed { recording, why },
            (None, None) => Self::Fitted {
                error: outcome["rmse_heldout_deg"].as_f64().unwrap_or(f64::INFINITY),
                walks: outcome["certificate"]["drive"]["walks"] == true,
                recording,
                warnings: warnings(outcome).join("; "),
            },
        }
    }
}

/// Writes the page of the results in these files, a row at a time. `folder` is where it will be.
pub(super) fn write(out: &mut dyn io::Write, folder: &Path, files: &[PathBuf], entries: &[Entry]) -> io::Result<()> {
    let mut page = html::begin(TITLES[0], TITLES[1]);
    let error = |(_, entry): &(&PathBuf, &Entry)| match entry {
        Entry::Fitted { error, .. } => Some(*error),
        _ => None,
    };
    let mut fitted: Vec<(f64, &PathBuf)> =
        files.iter().zip(entries).filter_map(|of| Some((error(&of)?, of.0))).collect();
    fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
    counts(&mut page, entries);
    if !fitted.is_empty() {
        html::paragraph(
            &mut page,
            "The held-out error is that on strides that were not fitted, root mean square over the four joints; the floor is the same error of the \
             person's own mean stride. Small pictures: the mean stride as a solid line and the generator dashed, each leg on its own cycle, and \
             the held-out error of the joint in degrees.",
        );
        begin_table(&mut page);
        for (n, (_, file)) in fitted.iter().enumerate() {
            row(&mut page, folder, n, &result_file::read(file));
            out.write_all(page.as_bytes())?;
            page.clear();
        }
        page += "</tbody></table></div>";
    }
    let doubtful = entries.iter().filter_map(|entry| match entry {
        Entry::Fitted { recording, warnings, .. } if !warnings.is_empty() => Some([recording, warnings]),
        _ => None,
    });
    reasons(
        &mut page,
        "Warnings",
        "Recordings that were fitted and may not be what they seem, with the reason",
        doubtful,
    );
    let failed = entries.iter().filter_map(|entry| match entry {
        Entry::Failed { recording, why } => Some([recording, why]),
        _ => None,
    });
    reasons(&mut page, "Refused files", "Files that could not be fitted, with the reason", failed);
    let skipped = entries.iter().filter_map(|entry| match entry {
        Entry::Skipped { recording, why } => Some([recording, why]),
        _ => None,
    });
    reasons(&mut page, "Skipped files", "Files that are no recordings of gait, with the reason", skipped);
    write!(out, "{page}<script>{SCRIPT}</script>{}", html::END)
}

fn counts(page: &mut String, entries: &[Entry]) {
    let of = |is: &dyn Fn(&Entry) -> bool| entries.iter().filter(|entry| is(entry)).count();
    let rows = [
        ("files", entries.len()),
        ("fitted", of(&|entry| matches!(entry, Entry::Fitted { .. }))),
        (
            "fitted, with a warning",
            of(&|entry| matches!(entry, Entry::Fitted { warnings, .. } if !warnings.is_empty())),
        ),
        ("fitted, and does not walk on the robot", of(&|entry| matches!(entry, Entry::Fitted { walks: false, .. }))),
        (
            "fitted from one stride, so that the held-out error is not known",
            of(&|entry| matches!(entry, Entry::Fitted { error, .. } if error.is_infinite())),
        ),
        ("refused", of(&|entry| matches!(entry, Entry::Failed { .. }))),
        ("skipped as no recording of gait", of(&|entry| matches!(entry, Entry::Skipped { .. }))),
    ];
    html::table(page, "Number of files", &[], rows.map(|(name, count)| [name.to_owned(), count.to_string()]));
}

/// A cell: its HTML, and the key by which its column is sorted.
struct Cell(String, String);

/// Heads of all columns.
fn heads() -> impl Iterator<Item = String> {
    let joints = Joint::ALL.map(|joint| joint.name().replace('_', " "));
    HEADS.into_iter().map(str::to_owned).chain(joints)
}

fn begin_table(page: &mut String) {
    *page += "<h2>Fits</h2><div class=\"table\" role=\"region\" aria-label=\"Fits\" tabindex=\"0\">\
              <table class=\"cards\" role=\"table\"><caption>Fits, the smallest held-out error first</caption><thead role=\"rowgroup\"><tr role=\"row\">";
    for (n, head) in heads().enumerate() {
        let sorted = if n == SORTED { " aria-sort=\"ascending\"" } else { "" };
        let _ = write!(page, "<th scope=\"col\" role=\"columnheader\"{sorted}>{head}</th>");
    }
    *page += "</tr></thead><tbody role=\"rowgroup\">";
}

/// The row of a result, the `n`th.
fn row(page: &mut String, folder: &Path, n: usize, outcome: &Value) {
    *page += "<tr role=\"row\">";
    let cells = cells(folder, outcome).into_iter().chain((0..Joint::COUNT).map(|j| joint_cell(outcome, n, j)));
    for (k, (Cell(html, key), head)) in cells.zip(heads()).enumerate() {
        let key = escape(&key);
        let _ = if k == 0 {
            write!(page, "<th scope=\"row\" role=\"rowheader\" data-sort=\"{key}\">{html}</th>")
        } else {
            write!(page, "<td role=\"cell\" data-sort=\"{key}\" data-label=\"{head}\">{html}</td>")
        };
    }
    *page += "</tr>";
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
fn joint_cell(outcome: &Value, row: usize, joint: usize) -> Cell {
    let curves = &outcome["curves"][joint];
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

/// A table of files without a fit, if there are any.
fn reasons<'a>(page: &mut String, title: &str, caption: &str, rows: impl Iterator<Item = [&'a String; 2]>) {
    let mut rows = rows.peekable();
    if rows.peek().is_some() {
        let _ = write!(page, "<h2>{title}</h2>");
        html::table(page, caption, &["file", "reason"], rows);
    }
}
