//! One table of all fits in a folder: as CSV, as JSON, as a page.

mod page;
mod result_file;

use joint_units::Joint;
use serde_json::{Value, json};
use std::path::Path;

use crate::failure::Failure;
use crate::file::bounded;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output::{check as check_output, write_text};
use result_file::FILE;

pub use result_file::MOST_BYTES;

const ERRORS: [&str; 3] = ["rmse_mean_stride_deg", "rmse_heldout_deg", "stride_sd_deg"];

/// The summaries, and what the text of one begins with or contains.
const SUMMARIES: [(&str, &str); 3] = [
    ("summary.csv", "recording,generator,"),
    ("summary.json", "\"recording\":"),
    ("summary.html", "<title>Footfall: fits</title>"),
];

/// End of the name of a result.
const RESULT: &str = ".fit.json";

/// End of the name of a file that says why a recording was skipped.
pub const SKIPPED: &str = ".skipped.json";

/// Refuses to replace files of the summaries' names that are not summaries, unless that is allowed.
///
/// # Errors
/// There is such a file.
pub fn check(folder: &Path, overwrite: Overwrite) -> Result<(), Failure> {
    SUMMARIES.iter().try_for_each(|(name, mark)| {
        let path = folder.join(name);
        let own = bounded::text(&path, MOST_BYTES).is_ok_and(|text| text.contains(mark));
        check_output(&path, if own { Overwrite::OWN } else { overwrite })
    })
}

/// Reads every result of `footfall fit` in a folder and writes `summary.csv`, `summary.json` and `summary.html` beside them. Returns how many
/// recordings failed.
///
/// # Errors
/// The folder has no results or a wrong one, or a file may not be replaced or cannot be written.
pub fn write(folder: &Path, overwrite: Overwrite) -> Result<usize, Failure> {
    check(folder, overwrite)?;
    let all = outcomes(folder)?;
    let tried: Vec<&Value> = all.iter().filter(|outcome| outcome["skipped"].is_null()).collect();
    let rows: Vec<Vec<String>> = tried.iter().map(|outcome| row(outcome)).collect();
    write_text(&folder.join("summary.csv"), &csv(&rows), Overwrite::OWN)?;
    write_text(
        &folder.join("summary.json"),
        &(Value::Array(tried.iter().map(|outcome| short(outcome)).collect()).to_string() + "\n"),
        Overwrite::OWN,
    )?;
    write_text(&folder.join("summary.html"), &page::page(folder, &all), Overwrite::OWN)?;
    let failed = all.iter().filter(|outcome| outcome["error"].is_string()).count();
    messages::status(format_args!(
        "summary of {} recordings, {failed} of them failed: {}",
        tried.len(),
        folder.join("summary.html").display()
    ));
    Ok(failed)
}

fn outcomes(folder: &Path) -> Result<Vec<Value>, Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: cannot be read: {error}", folder.display()));
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .map_err(wrong)?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| [RESULT, SKIPPED].into_iter().any(|end| path.to_string_lossy().ends_with(end)))
        .collect();
    names.sort();
    if names.is_empty() {
        return Err(Failure::input(format!(
            "{}: has no result of `footfall fit` (*.fit.json); run `footfall fit` with this folder as --out",
            folder.display()
        )));
    }
    let read = |path: &std::path::PathBuf| {
        let wrong_file = |why: String| {
            Failure::input(format!("{}: {why}; allowed is a file that `footfall fit` wrote", path.display()))
        };
        let bytes = bounded::bytes(path, MOST_BYTES).map_err(|why| wrong_file(why.to_string()))?;
        let outcome: Value = serde_json::from_slice(&bytes).map_err(|error| wrong_file(error.to_string()))?;
        let ended = ["error", "generator", "skipped"].into_iter().any(|key| outcome[key].is_string());
        if outcome["recording"].is_string() && ended {
            Ok(without_curves(outcome, path))
        } else {
            Err(wrong_file("is no result of a fit".into()))
        }
    };
    names.iter().map(read).collect()
}

/// What the summaries have of a result, without its curves: a folder may have thousands, and each would take a hundred kilobytes.
fn without_curves(mut outcome: Value, path: &Path) -> Value {
    let drive = &outcome["certificate"]["drive"];
    let drive = json!({ "walks": drive["walks"], "why_not": drive["why_not"] });
    let certificate = json!({ "accepted": outcome["certificate"]["accepted"], "drive": drive });
    if let Some(fields) = outcome.as_object_mut() {
        for key in ["curves", "compared", "findings", "left_out", "settings"] {
            fields.remove(key);
        }
        fields.insert("certificate".into(), certificate);
        fields.insert(FILE.into(), path.to_string_lossy().into());
    }
    outcome
}

fn header() -> Vec<String> {
    let mut cells: Vec<String> =
        ["recording", "generator", "period_s", "strides", "asymmetric", "accepted", "walks"].map(String::from).into();
    for joint in Joint::ALL.map(Joint::name) {
        cells.extend(ERRORS.map(|error| format!("{joint}_{error}")));
    }
    cells.extend(["rmse_heldout_deg", "cadence_steps_per_min", "stride_time_cv_percent", "error"].map(String::from));
    cells
}

fn row(outcome: &Value) -> Vec<String> {
    let text = |value: &Value| match value {
        Value::String(text) => text.clone(),
        Value::Null => String::new(),
        Value::Number(number) => number.as_f64().map_or(number.to_string(), |x| {
            if x.fract() == 0.0 && x.abs() < 1e9 { format!("{x:.0}") } else { format!("{x:.4}") }
        }),
        other => other.to_string(),
    };
    let mut cells: Vec<String> = ["recording", "generator", "period_s", "strides", "asymmetric"]
        .into_iter()
        .map(|key| text(&outcome[key]))
        .collect();
    cells.push(text(&outcome["certificate"]["accepted"]));
    cells.push(text(&outcome["certificate"]["drive"]["walks"]));
    for joint in 0..Joint::COUNT {
        cells.extend(ERRORS.map(|error| text(&outcome["joints"][joint][error])));
    }
    let measures = &outcome["measures"];
    cells.push(text(&outcome["rmse_heldout_deg"]));
    cells.extend(["cadence_steps_per_min", "stride_time_cv_percent"].map(|key| text(&measures[key])));
    cells.push(text(&outcome["error"]));
    cells
}

/// A result without the fields that are only in its own file.
fn short(outcome: &Value) -> Value {
    if outcome["error"].is_string() {
        return json!({ "recording": outcome["recording"], "sha256": outcome["sha256"], "error": outcome["error"] });
    }
    json!({
        "recording": outcome["recording"],
        "sha256": outcome["sha256"],
        "generator": outcome["generator"],
        "period_s": outcome["period_s"],
        "strides": outcome["strides"],
        "rmse_heldout_deg": outcome["rmse_heldout_deg"],
        "joints": outcome["joints"],
        "measures": outcome["measures"],
        "asymmetric": outcome["asymmetric"],
        "accepted": outcome["certificate"]["accepted"],
        "walks": outcome["certificate"]["drive"]["walks"],
        "notes": outcome["notes"],
    })
}

fn csv(rows: &[Vec<String>]) -> String {
    let quoted = |cell: &String| {
        if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.clone() }
    };
    let line = |cells: &[String]| cells.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
    std::iter::once(header()).chain(rows.iter().cloned()).map(|cells| line(&cells)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_commas_and_quotes_stay_one_cell() {
        let rows = vec![vec!["a,b".into(), "say \"so\"".into()]];
        assert!(csv(&rows).ends_with("\"a,b\",\"say \"\"so\"\"\"\n"));
    }

    #[test]
    fn a_failure_has_a_row_of_its_own() {
        let cells = row(&json!({ "recording": "x.csv", "error": "x.csv:3: no number" }));
        assert_eq!(cells.len(), header().len());
        assert_eq!((cells[0].as_str(), cells[cells.len() - 1].as_str()), ("x.csv", "x.csv:3: no number"));
    }
}
