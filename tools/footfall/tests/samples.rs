//! The samples: what the program makes, what the folder holds, what `footfall sample` writes, and whether the readers take them.

mod common;
#[path = "../examples/samples/make.rs"]
mod make;

use common::{footfall, said};
use footfall::command::sample::SAMPLES;
use footfall::command::sync::{coded, edges, paired};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples")
}

#[test]
fn each_sample_is_what_the_program_makes() {
    let made = make::all();
    for (name, content) in &made {
        let kept = std::fs::read(folder().join(name)).unwrap_or_default();
        assert!(kept == *content, "samples/{name}: make it again with `cargo run -p footfall --example samples`");
    }
    let names: BTreeSet<String> = made.iter().map(|(name, _)| (*name).to_owned()).chain(["README.md".into()]).collect();
    let kept = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert_eq!(kept.collect::<BTreeSet<_>>(), names);
    let bytes: usize = made.iter().map(|(_, content)| content.len()).sum();
    assert!(bytes < 1_000_000, "{bytes} bytes");
}

#[test]
fn the_command_has_the_same_files_and_the_page_names_each() {
    let made = make::all();
    let page = std::fs::read_to_string(folder().join("README.md")).unwrap();
    assert_eq!(
        SAMPLES.iter().map(|sample| sample.name).collect::<Vec<_>>(),
        made.iter().map(|of| of.0).collect::<Vec<_>>()
    );
    for (sample, (name, content)) in SAMPLES.iter().zip(&made) {
        assert!(sample.content == content && sample.taken_by.contains("{}"), "{name}");
        assert!(page.contains(&format!("`{name}`")), "samples/README.md does not name {name}");
    }
}

#[test]
fn a_sample_is_listed_printed_and_written() {
    let target = tempfile::tempdir().unwrap();
    let at = |name: &str| target.path().join(name).into_os_string().into_string().unwrap();
    let list = footfall(["sample"]);
    assert!(SAMPLES.iter().all(|sample| said(&list).contains(sample.name)), "{}", said(&list));
    assert_eq!(footfall(["sample", "walk.c3d"]).stdout, std::fs::read(folder().join("walk.c3d")).unwrap());
    let written = footfall(["sample", "rows.csv", "-o", &at("rows.csv")]);
    let words = said(&written);
    assert!(written.status.success() && words.contains(&format!("written: {}", at("rows.csv"))), "{words}");
    assert!(words.contains("next: for example: footfall calibrate"), "{words}");
    let kept = footfall(["sample", "rows.csv", "-o", &at("rows.csv")]);
    assert!(kept.status.code() == Some(2) && said(&kept).contains("--force"), "{}", said(&kept));
    assert!(footfall(["sample", "rows.csv", "-o", &at("rows.csv"), "--force"]).status.success());
    let unknown = footfall(["sample", "run.csv"]);
    assert!(
        unknown.status.code() == Some(2) && said(&unknown).contains("allowed is one of walk.csv"),
        "{}",
        said(&unknown)
    );
    assert_eq!(footfall(["sample", "-o", &at("x")]).status.code(), Some(2));
    // All or nothing: a file that is there keeps the others away.
    assert_eq!(footfall(["sample", "--all", "-o", &at("")]).status.code(), Some(2));
    assert!(footfall(["sample", "--all", "-o", &at("all")]).status.success());
    assert_eq!(std::fs::read_dir(at("all")).unwrap().count(), SAMPLES.len());
}

/// The clocks come back as the program set them.
#[test]
fn the_clocks_of_the_edges_come_back() {
    let read = |name: &str| edges::read(&folder().join(name)).unwrap().edges;
    let fit = coded::fit(&read("edges.csv")).unwrap();
    assert!((fit.clocks.drift_ppm - 35.0).abs() < 1.0 && (fit.clocks.offset_s - 41.5).abs() < 1e-4, "{fit:?}");
    let fit = paired::fit(&read("line-board.csv"), &read("line-recorder.csv"), false).unwrap();
    assert!((fit.clocks.drift_ppm - 35.0).abs() < 1.0 && (fit.clocks.offset_s - 38.5).abs() < 2e-4, "{fit:?}");
    assert_eq!(fit.unused, (0, 0));
}
