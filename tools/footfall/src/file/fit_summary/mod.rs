//! One table of all fits in a folder: as CSV, as JSON, as a page.

mod page;
mod result_file;

use joint_units::Joint;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::messages::{self, cell};
use crate::options::overwrite::Overwrite;
use crate::output::{check as check_output, write as write_file, write_text};
use page::Entry;

pub use result_file::MOST_BYTES;
pub(crate) use result_file::warnings;

const ERRORS: [&str; 3] = ["rmse_mean_stride_deg", "rmse_heldout_deg", "stride_sd_deg"];

/// The summaries, and what the text of one has in its first [`MARK_BYTES`].
const SUMMARIES: [(&str, &str); 3] = [
    ("summary.csv", "recording,generator,"),
    ("summary.json", "\"recording\":"),
    ("summary.html", "<title>Footfall: fits</title>"),
];

/// Bytes of a summary that are looked through for its mark: the first result of a long one is shorter.
const MARK_BYTES: u64 = 1 << 20;

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
        let own = head(&path).is_ok_and(|head| head.windows(mark.len()).any(|part| part == mark.as_bytes()));
        check_output(&path, if own { Overwrite::OWN } else { overwrite })
    })
}

/// The first [`MARK_BYTES`] of a file.
fn head(path: &Path) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    if !path.metadata()?.is_file() {
        return Ok(head);
    }
    File::open(path)?.take(MARK_BYTES).read_to_end(&mut head)?;
    Ok(head)
}

/// Reads every result of `footfall fit` in a folder and writes `summary.csv`, `summary.json` and `summary.html` beside them. Returns how many
/// recordings failed; a file that is no result is one of them. One result is in memory at a time, because a folder may have thousands.
///
/// # Errors
/// The folder has no results, or a file may not be replaced or cannot be written.
pub fn write(folder: &Path, overwrite: Overwrite) -> Result<usize, Failure> {
    check(folder, overwrite)?;
    let files = files(folder)?;
    let mut entries = Vec::with_capacity(files.len());
    let mut table = line(&header());
    for file in &files {
        let outcome = result_file::read(file);
        let entry = Entry::of(&outcome);
        if let (Entry::Failed { why, .. }, true) = (&entry, outcome["sha256"].is_null()) {
            messages::warning(why);
        }
        if !matches!(entry, Entry::Skipped { .. }) {
            table += &line(&row(&outcome));
        }
        entries.push(entry);
    }
    let all = || files.iter().zip(&entries);
    let tried = || all().filter(|(_, entry)| !matches!(entry, Entry::Skipped { .. })).map(|(file, _)| file);
    write_text(&folder.join("summary.csv"), &table, Overwrite::OWN)?;
    write_file(&folder.join("summary.json"), Overwrite::OWN, |out| {
        for (n, file) in tried().enumerate() {
            let object = short(&result_file::read(file)).to_string();
            write!(out, "{}{}", if n == 0 { "[" } else { "," }, messages::escaped(&object))?;
        }
        writeln!(out, "{}", if tried().next().is_none() { "[]" } else { "]" })
    })?;
    write_file(&folder.join("summary.html"), Overwrite::OWN, |out| page::write(out, folder, &files, &entries))?;
    let failed = entries.iter().filter(|entry| matches!(entry, Entry::Failed { .. })).count();
    messages::status(format_args!(
        "summary of {} recordings, {failed} of them failed: {}",
        tried().count(),
        folder.join("summary.html").display()
    ));
    Ok(failed)
}

/// The files of the results in a folder, in the order of their names.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let wrong = |error: io::Error| Failure::input(format!("{}: cannot be read: {error}", folder.display()));
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
    Ok(names)
}

fn header() -> Vec<String> {
    let mut cells: Vec<String> =
        ["recording", "generator", "period_s", "strides", "asymmetric", "accepted", "walks"].map(String::from).into();
    for joint in Joint::ALL.map(Joint::name) {
        cells.extend(ERRORS.map(|error| format!("{joint}_{error}")));
    }
    let last = ["rmse_heldout_deg", "cadence_steps_per_min", "stride_time_cv_percent", "warnings", "error"];
    cells.extend(last.map(String::from));
    cells
}

fn row(outcome: &Value) -> Vec<String> {
    let text = |value: &Value| match value {
        Value::String(text) => cell(text).into_owned(),
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
    cells.push(cell(&warnings(outcome).join("; ")).into_owned());
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
        "warnings": warnings(outcome),
    })
}

/// A line of the table.
fn line(cells: &[String]) -> String {
    let quoted = |cell: &String| {
        if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.clone() }
    };
    cells.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_commas_and_quotes_stay_one_cell() {
        assert_eq!(line(&["a,b".into(), "say \"so\"".into()]), "\"a,b\",\"say \"\"so\"\"\"\n");
    }

    /// Names and reasons are of foreign files: a spreadsheet must not take them for formulas. Numbers stay numbers.
    #[test]
    fn foreign_names_are_no_formulas() {
        let cells = row(&json!({
            "recording": "=HYPERLINK(\"http://a\")", "generator": "shape", "period_s": -1.5,
            "findings": [{ "level": "warning", "text": "@\u{1b}[2J\u{202e}" }],
        }));
        assert_eq!((cells[0].as_str(), cells[2].as_str()), ("'=HYPERLINK(\"http://a\")", "-1.5000"));
        assert!(cells.contains(&"'@\\u001b[2J\\u202e".to_owned()), "{cells:?}");
    }

    #[test]
    fn warnings_are_in_the_table_and_in_the_list() {
        let found = |level: &str, text: &str| json!({ "level": level, "text": text });
        let findings = [found("note", "a"), found("warning", "b"), found("warning", "c")];
        let outcome = json!({ "recording": "x.csv", "generator": "shape", "findings": findings });
        let cells = row(&outcome);
        let place = header().iter().position(|head| head == "warnings").unwrap();
        assert_eq!(cells[place], "b; c");
        assert_eq!(short(&outcome)["warnings"], json!(["b", "c"]));
    }

    #[test]
    fn a_failure_has_a_row_of_its_own() {
        let cells = row(&json!({ "recording": "x.csv", "error": "x.csv:3: no number" }));
        assert_eq!(cells.len(), header().len());
        assert_eq!((cells[0].as_str(), cells[cells.len() - 1].as_str()), ("x.csv", "x.csv:3: no number"));
    }
}
