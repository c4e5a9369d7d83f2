//! Reports of a calibration: text for a terminal, JSON, a page.

use super::fit::{Fit, short};
use super::knots::Extended;
use super::pictures;
use super::poses::Pose;
use super::result::Calibrated;
use crate::file::calibration_file::Hysteresis;
use gait_fit::html;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Largest number of rows on the page, which limits its size.
const MOST_ROWS: usize = 5000;

/// The headings of the table of poses, with their units.
const HEADINGS: [&str; 9] =
    ["angle/deg", "rows", "volts/V", "SD/mV", "SD/deg", "drift/deg", "up-down/deg", "error/deg", "left out"];

/// The table of poses, a row each.
fn cells(fit: &Fit) -> Vec<[String; 9]> {
    let table = Extended::new(&fit.calibration);
    let row = |(pose, why): (&Pose, &Option<super::fit::LeftOut>)| {
        let maybe = |value: Option<f64>, digits: usize| {
            // Adding 0 removes the sign of a rounded zero.
            let scale = 10_f64.powi(digits as i32);
            value.map_or("-".into(), |value| format!("{:.digits$}", (value * scale).round() / scale + 0.0))
        };
        // Where the sensor is saturated, volts do not convert to degrees.
        let kept = |value: Option<f64>| value.filter(|_| why.is_none());
        let slope = table.slope(pose.volts);
        let apart = pose.up_v.zip(pose.down_v).map(|(up, down)| table.degrees(up) - table.degrees(down));
        [
            short(pose.angle_deg),
            pose.rows.to_string(),
            format!("{:.4}", pose.volts),
            maybe(pose.sd_v.map(|sd| sd * 1e3), 2),
            maybe(kept(pose.sd_v.map(|sd| sd * slope)), 3),
            maybe(kept(pose.drift_v().map(|drift| drift * slope)), 3),
            maybe(kept(apart), 3),
            maybe(kept(Some(table.degrees(pose.volts) - pose.angle_deg)), 3),
            why.map_or(String::new(), |why| why.words().into()),
        ]
    };
    fit.poses.iter().zip(&fit.left_out).map(row).collect()
}

/// Direction of the volts with the angle, and the number of joined poses.
fn monotone(fit: &Fit) -> String {
    let rises = fit.poses.first().zip(fit.poses.last()).is_some_and(|(first, last)| first.volts < last.volts);
    let way = if rises { "rise" } else { "fall" };
    let joined = match fit.pooled {
        0 => "no poses joined".into(),
        n => format!("{n} poses joined because noise had reversed their order"),
    };
    format!("volts {way} with the angle, {joined}")
}

/// The angles that are left out of the table.
fn saturation(fit: &Fit) -> String {
    let there = fit.poses.iter().zip(&fit.left_out).filter(|(_, why)| why.is_some());
    let angles: Vec<String> = there.map(|(pose, _)| short(pose.angle_deg)).collect();
    if angles.is_empty() { "none".into() } else { format!("left out of the table: {} degrees", angles.join(", ")) }
}

/// Name and value of each result.
fn summary(calibrated: &Calibrated) -> Vec<(&'static str, String)> {
    let fit = &calibrated.fit;
    let (low, high) = fit.calibration.span();
    let (low_v, high_v) = fit.calibration.volts_span();
    let hysteresis = match fit.hysteresis {
        None => "not known".into(),
        Some(Hysteresis { largest, mean }) => format!("{largest:.3} degrees at most, {mean:.3} on average"),
    };
    let (worst, line) = fit.worst_deg;
    let in_table = fit.left_out.iter().filter(|why| why.is_none()).count();
    vec![
        ("rows", format!("{} at {} angles, {in_table} of them in the table", fit.residuals.len(), fit.poses.len())),
        (
            "table",
            format!(
                "{} points, {:.2} to {:.2} degrees, {:.4} to {:.4} V",
                fit.calibration.points().len(),
                low.degrees(),
                high.degrees(),
                low_v.0,
                high_v.0
            ),
        ),
        ("residual", format!("{:.3} degrees rms over the rows, {worst:.3} at worst (line {line})", fit.rms_deg)),
        ("at the poses' means", format!("{:.3} degrees at worst", fit.worst_pose_deg)),
        (
            "at a pose outside of the table",
            fit.unknown_pose_deg.map_or("not known".into(), |deg| format!("{deg:.3} degrees at worst")),
        ),
        ("hysteresis", hysteresis),
        ("monotone", monotone(fit)),
        ("saturation", saturation(fit)),
        (
            "noise",
            fit.noise_v.map_or("not known".into(), |sd| format!("{:.2} mV standard deviation in a visit", sd * 1e3)),
        ),
        ("one code of 12 bit", format!("up to {:.3} degrees", fit.code_deg)),
    ]
}

/// Text for a terminal.
#[must_use]
pub fn text(calibrated: &Calibrated) -> String {
    let rows = cells(&calibrated.fit);
    let mut text =
        format!("{} of {}, from {}\n", calibrated.measured.sensor, calibrated.measured.date, calibrated.source);
    let widths: [usize; 9] = std::array::from_fn(|column| {
        rows.iter().map(|row| row[column].len()).chain([HEADINGS[column].len()]).max().unwrap_or(0)
    });
    let mut line = |cells: [&str; 9]| {
        let padded: Vec<String> = cells
            .iter()
            .zip(widths)
            .enumerate()
            .map(|(column, (cell, width))| if column == 8 { (*cell).into() } else { format!("{cell:>width$}") })
            .collect();
        let _ = writeln!(text, "{}", padded.join("  ").trim_end());
    };
    let has_left_out = calibrated.fit.left_out.iter().any(Option::is_some);
    line(std::array::from_fn(|column| if column == 8 && !has_left_out { "" } else { HEADINGS[column] }));
    for row in &rows {
        line(std::array::from_fn(|column| row[column].as_str()));
    }
    for (name, value) in summary(calibrated) {
        let _ = writeln!(text, "{name}: {value}");
    }
    text
}

/// All results as JSON.
#[must_use]
pub fn json(calibrated: &Calibrated) -> Value {
    let (fit, measured) = (&calibrated.fit, &calibrated.measured);
    let poses: Vec<Value> = fit
        .poses
        .iter()
        .zip(&fit.left_out)
        .map(|(pose, why)| {
            let table = Extended::new(&fit.calibration);
            let error = why.is_none().then(|| table.degrees(pose.volts) - pose.angle_deg);
            json!({ "pose": pose, "drift_v": pose.drift_v(), "left_out": why, "error_deg": error })
        })
        .collect();
    let points: Vec<Value> = fit
        .calibration
        .points()
        .iter()
        .map(|point| json!({ "sensor_v": point.volts.0, "angle_deg": generator_file::degrees::shortest(point.angle) }))
        .collect();
    json!({
        "type": "calibration",
        "source": calibrated.source,
        "sensor": measured.sensor,
        "date": measured.date,
        "divider": calibrated.sensor.divider,
        "points": points,
        "rms_deg": fit.rms_deg,
        "worst_deg": fit.worst_deg.0,
        "worst_line": fit.worst_deg.1,
        "worst_pose_deg": fit.worst_pose_deg,
        "unknown_pose_deg": fit.unknown_pose_deg,
        "hysteresis": fit.hysteresis,
        "noise_v": fit.noise_v,
        "code_deg": fit.code_deg,
        "pooled": fit.pooled,
        "left_out_rows_inside": fit.inside,
        "poses": poses,
        "residuals": fit.residuals,
        "notes": calibrated.notes,
        "warnings": calibrated.warnings,
    })
}

/// One self-contained HTML page.
#[must_use]
pub fn html(calibrated: &Calibrated) -> String {
    let (fit, measured) = (&calibrated.fit, &calibrated.measured);
    let title = format!("{}, {}", measured.sensor, measured.date);
    let mut page = html::begin(&format!("calibration report, {title}"), &format!("Calibration report: {title}"));
    let version = env!("CARGO_PKG_VERSION");
    html::paragraph(&mut page, &format!("Made by footfall {version} from {}.", calibrated.source));
    calibrated.warnings.iter().chain(&calibrated.notes).for_each(|text| html::note(&mut page, text));
    html::table(
        &mut page,
        "Result",
        &[],
        summary(calibrated).into_iter().map(|(name, value)| [name.to_owned(), value]),
    );
    pictures::charts(&mut page, calibrated);
    page += "<h2>Poses</h2>";
    // The last column is empty where every pose is in the table.
    let shown = if fit.left_out.iter().any(Option::is_some) { HEADINGS.len() } else { HEADINGS.len() - 1 };
    html::table(&mut page, "Poses", &HEADINGS[..shown], cells(fit).into_iter().map(|row| row.into_iter().take(shown)));
    page += "<h2>Points of the table</h2>";
    let points = fit
        .calibration
        .points()
        .iter()
        .map(|point| [point.volts.0.to_string(), generator_file::degrees::shortest(point.angle).to_string()]);
    html::table(&mut page, "Points of the table", &["sensor_v", "angle_deg"], points);
    page += "<h2>Rows</h2>";
    if fit.residuals.len() > MOST_ROWS {
        html::paragraph(&mut page, &format!("The first {MOST_ROWS} of {}.", fit.residuals.len()));
    }
    let rows = fit.residuals.iter().take(MOST_ROWS).map(|row| {
        let error = row.error_deg.map_or("not in the table".into(), |error| format!("{error:.3}"));
        [row.line.to_string(), short(row.angle_deg), format!("{:.4}", row.volts), error]
    });
    html::table(&mut page, "Rows", &["line", "angle/deg", "volts/V", "error/deg"], rows);
    page + html::END
}
