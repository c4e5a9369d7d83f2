//! The pages of `footfall fit`: well-formed, complete without a network, readable by a screen reader, and with the numbers of `--json`.

mod common;
mod page;

use common::{DEFAULT, footfall, said, table, walk};
use page::{Element, check_structure, held_files, numbers, rows};
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;
use std::process::Output;

/// A fit with its page and its object.
fn fitted(recording: &Path, more: &[&str]) -> (Vec<Element>, String, Value) {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let fixed: [OsString; 6] =
        ["fit".into(), recording.into(), "--report".into(), page.clone().into(), "--json".into(), "--force".into()];
    let output: Output =
        footfall(fixed.into_iter().chain(more.iter().map(Into::into)).chain(["--evaluations".into(), "1000".into()]));
    let value = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", said(&output)));
    let text = std::fs::read_to_string(page).unwrap();
    (check_structure(&text), text, value)
}

fn near(shown: Option<f64>, exact: &Value, digits: i32) -> bool {
    match (shown, exact.as_f64()) {
        (Some(shown), Some(exact)) => (shown - exact).abs() <= 0.5001 * 10_f64.powi(-digits),
        (None, None) => true,
        _ => false,
    }
}

#[test]
fn the_page_has_the_numbers_of_the_object() {
    let (all, text, value) = fitted(Path::new(DEFAULT), &[]);
    assert!(!text.contains("<script"));
    for (caption, head, key, digits) in [
        ("Errors by joint", "on strides that were not fitted", "rmse_heldout_deg", 2),
        ("Errors by joint", "to the mean stride", "rmse_mean_stride_deg", 2),
        ("Errors by joint", "to the mean stride, as driven", "rmse_driven_deg", 2),
        ("Errors by joint", "SD from stride to stride", "stride_sd_deg", 2),
    ] {
        for (joint, shown) in numbers(&all, caption, head).into_iter().enumerate() {
            let exact = &value["joints"][joint][key];
            assert!(near(shown, exact, digits), "{head}: {shown:?} {exact}");
        }
    }
    let measures = &value["measures"];
    for (head, key) in [("least, deg", "min_deg"), ("greatest, deg", "max_deg"), ("range, deg", "range_deg")] {
        for (joint, shown) in numbers(&all, "Range of motion", head).into_iter().enumerate() {
            let exact = &measures["motion"][joint][key];
            assert!(near(shown, exact, 1), "{head}: {shown:?} {exact}");
        }
    }
    for (pair, shown) in numbers(&all, "Left minus right", "range").into_iter().enumerate() {
        assert!(near(shown, &measures["left_minus_right"][pair]["range_deg"], 1), "{shown:?}");
    }
    // The ranges are those of the other table of errors.
    for joint in 0..4 {
        let (a, b) = (&measures["motion"][joint]["range_deg"], &value["joints"][joint]["range_deg"]);
        assert!((a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 0.1, "{a} {b}");
    }
    let times = rows(&all, "Times and strides");
    let cadence = measures["cadence_steps_per_min"].as_f64().unwrap();
    let stride_s = measures["stride_time_s"].as_f64().unwrap();
    assert!((cadence - 120.0 / stride_s).abs() < 1e-9);
    assert!(measures["stride_time_sd_s"].is_null() && value["strides"] == 2);
    let variability = "not known from 2 strides: from 3 on, the ends of each are found on their own";
    for text in [format!("{cadence:.1} steps a minute"), format!("{stride_s:.4} s"), variability.into()] {
        assert!(times.iter().any(|row| row[1] == text), "{text}: {times:?}");
    }
    let headline = format!("{:.2} degrees", value["rmse_heldout_deg"].as_f64().unwrap());
    assert!(all.iter().any(|p| p.attribute("class") == Some("number") && p.text == headline), "{headline}");
}

#[test]
fn the_page_says_what_it_is_and_has_the_person_first() {
    let (all, text, _) = fitted(Path::new(DEFAULT), &[]);
    let heading = all.iter().find(|element| element.name == "h1").unwrap();
    assert!(
        heading.text.starts_with("Gait report: ") && text.contains("<title>Footfall: gait report, "),
        "{heading:?}"
    );
    assert!(text.contains(concat!("Made by footfall ", env!("CARGO_PKG_VERSION"), " from CSV")));
    let order =
        ["The person", "Range of motion", "Left over right", "The generator: ", "Generator over the gait cycle"];
    let places = order.map(|heading| text.find(&format!("<h2>{heading}")).unwrap_or_else(|| panic!("{heading}")));
    assert!(places.is_sorted(), "{places:?}");
    // Both legs are in one picture, which no other one is: two pictures, of the hips and of the knees.
    for id in ["legs-hip", "legs-knee"] {
        let labelled = format!("{id}-t {id}-d");
        let at = all.iter().position(|svg| svg.attribute("aria-labelledby") == Some(&labelled)).expect(id);
        let lines = all.iter().filter(|line| line.name == "polyline" && line.parent == Some(at));
        // The curves, then the upright lines at which a foot leaves the ground.
        assert_eq!(
            lines.filter_map(|line| line.attribute("class")).collect::<Vec<_>>(),
            ["left", "right dashed", "left", "right dashed"],
            "{id}"
        );
    }
}

/// The CSV in the page has the errors that were printed: they are computed again from its columns.
#[test]
fn the_files_in_the_page_have_the_numbers_of_the_fit() {
    let (all, _, value) = fitted(Path::new(DEFAULT), &[]);
    let files = held_files(&all);
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["gaitkit_fukuchi_healthy.csv.cycle.csv", "gaitkit_fukuchi_healthy.csv.strides.csv"]);
    let mut lines = files[0].1.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let table: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!((table.len(), head.len()), (200, 21));
    let column = |name: String| {
        let at = head.iter().position(|head| **head == name).unwrap_or_else(|| panic!("{name} in {head:?}"));
        table.iter().map(move |row| row[at]).collect::<Vec<f64>>()
    };
    let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    for (n, joint) in ["left_hip", "right_hip", "left_knee", "right_knee"].into_iter().enumerate() {
        let of = |what: &str| column(format!("{joint}_{what}_deg"));
        let (mean, generator, residual) = (of("mean"), of("generator"), of("residual"));
        let difference: Vec<f64> = generator.iter().zip(&mean).map(|(a, b)| a - b).collect();
        assert!(difference.iter().zip(&residual).all(|(a, b)| (a - b).abs() < 2e-4));
        let errors = &value["joints"][n];
        assert!((rms(&residual) - errors["rmse_mean_stride_deg"].as_f64().unwrap()).abs() < 1e-3);
        assert!((rms(&of("sd")) - errors["stride_sd_deg"].as_f64().unwrap()).abs() < 1e-3);
        let least = mean.iter().copied().fold(f64::MAX, f64::min);
        let motion = &value["measures"]["motion"][n];
        assert!((least - motion["min_deg"].as_f64().unwrap()).abs() < 1e-3);
        let at = motion["min_at_percent"].as_f64().unwrap();
        assert!((mean[(2.0 * at).round() as usize] - least).abs() < 1e-3, "{at}");
    }
    let strides = &files[1].1;
    assert_eq!(strides.lines().count() as u64, 1 + value["strides"].as_u64().unwrap());
    let times: Vec<f64> =
        strides.lines().skip(1).map(|line| line.split(',').nth(3).unwrap().parse().unwrap()).collect();
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    assert!((mean - value["measures"]["stride_time_s"].as_f64().unwrap()).abs() < 1e-3);
}

/// The standard deviation and the coefficient of variation are those of the times in the CSV.
#[test]
fn the_stride_time_varies_as_the_strides_do() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("turns.csv");
    // The phase of a stride time of 1.1 s, faster and slower by turns.
    let text = table(13.2, |t| {
        let phase = t / 1.1 + 0.04 * (std::f64::consts::TAU * t / 5.3).sin();
        let p = std::f64::consts::TAU * phase;
        let hip = |lead: f64| 8.0 + 21.0 * (p + lead).cos();
        let knee = |lead: f64| 24.0 + 20.0 * (p + lead + 1.5).cos() + 12.0 * (2.0 * (p + lead) + 1.8).cos();
        [hip(0.0), hip(std::f64::consts::PI), knee(0.0), knee(std::f64::consts::PI)]
    });
    std::fs::write(&file, text).unwrap();
    let (all, _, value) = fitted(&file, &[]);
    let (_, strides) = held_files(&all).swap_remove(1);
    let times: Vec<f64> =
        strides.lines().skip(1).map(|line| line.split(',').nth(3).unwrap().parse().unwrap()).collect();
    let n = times.len() as f64;
    let mean = times.iter().sum::<f64>() / n;
    let sd = (times.iter().map(|time| (time - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let measures = &value["measures"];
    assert!((measures["stride_time_sd_s"].as_f64().unwrap() - sd).abs() < 1e-4 && sd > 0.01, "{sd}");
    assert!((measures["stride_time_cv_percent"].as_f64().unwrap() - 100.0 * sd / mean).abs() < 1e-2);
    let shown = rows(&all, "Times and strides");
    assert!(shown.iter().any(|row| row[1].starts_with(&format!("SD {sd:.3}"))), "{sd} {shown:?}");
}

#[test]
fn one_stride_says_what_it_cannot_know() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("one.csv");
    std::fs::write(&file, walk(1.3, 1.1, 0.0)).unwrap();
    let (all, text, value) = fitted(&file, &[]);
    assert_eq!(value["strides"], 1);
    for key in ["stride_time_sd_s", "stride_time_cv_percent"] {
        assert!(value["measures"][key].is_null(), "{key}");
    }
    assert!(value["rmse_heldout_deg"].is_null() && value["measures"]["motion"][0]["range_sd_deg"].is_null());
    assert!(all.iter().any(|p| p.attribute("class") == Some("number") && p.text == "not known"));
    for words in
        ["What cannot be known from one stride", "not known from one stride", "A dash is a value that cannot be known"]
    {
        assert!(text.contains(words), "{words}");
    }
    assert_eq!(numbers(&all, "Errors by joint", "on strides that were not fitted"), [None; 4]);
    assert!(!all.iter().any(|line| line.attribute("class") == Some("stride")), "there is no second stride to draw");
    let (_, cycle) = held_files(&all).swap_remove(0);
    assert!(cycle.lines().nth(1).unwrap().split(',').nth(2).unwrap().is_empty(), "no standard deviation");
}

/// A recorded walk has a contact and the band; a run has neither, and says why.
#[test]
fn the_page_says_what_zero_is() {
    let (all, text, value) = fitted(Path::new(DEFAULT), &[]);
    assert_eq!(value["measures"]["cycle_start"]["initial_contact"], true);
    assert!(text.contains("0 % is the initial contact of the same leg, estimated from the joint angles"));
    assert!(
        text.contains("no reference of a population") && all.iter().any(|p| p.attribute("class") == Some("others"))
    );
    // Each origin of the band's recordings is named once.
    assert_eq!(text.matches("keenon/nimblephysics").count(), 1, "{}", gait_fit::normative::words());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.csv");
    std::fs::write(&file, walk(9.0, 0.72, 0.0)).unwrap();
    let (all, text, value) = fitted(&file, &["--fit-limits"]);
    assert_eq!(value["measures"]["cycle_start"]["initial_contact"], false);
    assert!(text.contains("Initial contact was not found: 167 steps a minute are a run"), "{}", value["measures"]);
    assert!(text.contains("0 % is where the hip of the same leg is most flexed in the mean stride"));
    assert!(text.contains("The normative band is not shown"));
    assert!(!all.iter().any(|p| p.name == "polygon" && p.attribute("class") == Some("others")));
}

#[test]
fn the_summary_is_sorted_and_counts_every_file() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let put = |name: &str, text: &str| std::fs::write(from.path().join(name), text).unwrap();
    // The strides of the second differ more.
    let varied = |size: f64| {
        table(14.0, |t| {
            let p = std::f64::consts::TAU * t / 1.1;
            let more = 1.0 + size * (0.9 * t).sin();
            let hip = |lead: f64| 8.0 + 21.0 * more * (p + lead).cos();
            let knee =
                |lead: f64| 24.0 + more * (20.0 * (p + lead + 1.5).cos() + 12.0 * (2.0 * (p + lead) + 1.8).cos());
            [hip(0.0), hip(std::f64::consts::PI), knee(0.0), knee(std::f64::consts::PI)]
        })
    };
    put("a & b #1.csv", &varied(0.06));
    put("c.csv", &varied(0.02));
    put("one.csv", &walk(1.3, 1.1, 0.0));
    put("broken.csv", "time_s,left_hip_deg\n0,1\n");
    put("subjects.csv", "subject,age,height_m\n1,30,1.75\n2,41,1.8\n");
    let reports = to.path().join("pages");
    let call: Vec<OsString> = vec![
        "fit".into(),
        from.path().into(),
        "-o".into(),
        to.path().into(),
        "--report".into(),
        reports.clone().into(),
    ];
    let output = footfall(call.into_iter().chain(["--evaluations".into(), "1000".into()]));
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let summary = || check_structure(&std::fs::read_to_string(to.path().join("summary.html")).unwrap());
    let all = summary();
    let fits = rows(&all, "Fits, the smallest held-out error first");
    let order: Vec<&str> = fits[1..].iter().map(|row| row[0].as_str()).collect();
    assert_eq!(order, ["c.csv", "a & b #1.csv", "one.csv"]);
    assert_eq!(fits[3][1], "one stride");
    let shown: Vec<f64> = fits[1..3].iter().map(|row| row[1].parse().unwrap()).collect();
    assert!(shown[0] < shown[1], "{shown:?}");
    let of = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(to.path().join(format!("{name}.fit.json"))).unwrap()).unwrap()
    };
    assert!(near(Some(shown[1]), &of("a & b #1.csv")["rmse_heldout_deg"], 2));
    // Every link leads to a page, and every picture has both lines.
    let links: Vec<&str> = all.iter().filter_map(|element| element.attribute("href")).collect();
    assert_eq!(links, ["pages/c.csv.html", "pages/a%20%26%20b%20%231.csv.html", "pages/one.csv.html"]);
    assert!(reports.join("a & b #1.csv.html").exists());
    let lines = all.iter().filter(|element| element.name == "polyline");
    assert!(
        lines.clone().count() == 3 * 4 * 2 && lines.clone().all(|line| line.attribute("points").unwrap().len() > 300)
    );
    let count = |head: &str| rows(&all, "Number of files").iter().find(|row| row[0] == head).unwrap()[1].clone();
    assert_eq!(["files", "fitted", "refused"].map(count), ["5", "3", "1"]);
    assert_eq!(count("skipped as no recording of gait"), "1");
    assert_eq!(count("fitted from one stride, so that the held-out error is not known"), "1");
    let refused = rows(&all, "Files that could not be fitted");
    assert!(refused[1][0] == "broken.csv" && refused[1][1].contains("broken.csv:"), "{refused:?}");
    assert_eq!(rows(&all, "Files that are no recordings of gait")[1][0], "subjects.csv");

    // Only what a script adds may be pressed; the heads are text without it.
    assert!(!all.iter().any(|element| element.name == "button"));
    // What becomes a recording is no longer listed as skipped.
    put("subjects.csv", &varied(0.03));
    let again = footfall([OsString::from("fit"), from.path().into(), "-o".into(), to.path().into()]);
    assert!(said(&again).contains("1 failed: 5 files"), "{}", said(&again));
    let all = summary();
    assert!(!all.iter().any(|element| element.text.contains("no recordings of gait")));
    assert_eq!(rows(&all, "Fits").len(), 5);
}
