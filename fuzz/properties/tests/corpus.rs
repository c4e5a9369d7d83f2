//! Every input that fuzzing has kept, through the property of its target: without a fuzzer, in the ordinary tests.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

#[cfg(feature = "program")]
use fuzz_properties::PROGRAM_TARGETS;
use fuzz_properties::{TARGETS, Target};

#[cfg(not(feature = "program"))]
const PROGRAM_TARGETS: [Target; 0] = [];

fn fuzz() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder above").to_owned()
}

fn all() -> Vec<Target> {
    [&TARGETS[..], &PROGRAM_TARGETS[..]].concat()
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    entries.map(|entry| entry.expect("readable").file_name().into_string().expect("text")).collect()
}

#[test]
fn every_input_of_the_corpus_has_its_property() {
    // The targets one after the other take minutes on one core.
    let (next, targets) = (AtomicUsize::new(0), all());
    let run = || {
        let mut inputs = 0;
        while let Some(target) = targets.get(next.fetch_add(1, Ordering::Relaxed)) {
            let folder = fuzz().join("corpus").join(target.name);
            let files = names(&folder);
            assert!(!files.is_empty(), "{} has no corpus", target.name);
            for file in files {
                let bytes = std::fs::read(folder.join(&file)).expect("readable");
                let outcome = std::panic::catch_unwind(|| (target.check)(&bytes));
                assert!(outcome.is_ok(), "fuzz/corpus/{}/{file} does not have the property of its target", target.name);
                inputs += 1;
            }
        }
        inputs
    };
    let inputs: usize = std::thread::scope(|scope| {
        let threads: Vec<_> =
            (0..std::thread::available_parallelism().map_or(1, usize::from)).map(|_| scope.spawn(run)).collect();
        threads.into_iter().map(|thread| thread.join().expect("every input has its property")).sum()
    });
    println!("{inputs} inputs of {} targets", targets.len());
}

/// A target without a corpus would be fuzzed and never replayed; a corpus without a target would be neither.
#[cfg(feature = "program")]
#[test]
fn targets_corpus_and_fuzzer_have_the_same_names() {
    let targets: BTreeSet<String> = all().iter().map(|target| target.name.to_owned()).collect();
    assert_eq!(targets.len(), all().len());
    assert_eq!(names(&fuzz().join("corpus")), targets);
    let files = targets.iter().map(|name| format!("{name}.rs")).collect::<BTreeSet<_>>();
    assert_eq!(names(&fuzz().join("fuzz_targets")), files);
    let manifest = std::fs::read_to_string(fuzz().join("Cargo.toml")).expect("readable");
    for name in &targets {
        assert!(manifest.contains(&format!("name = \"{name}\"\npath = \"fuzz_targets/{name}.rs\"")), "{name}");
        let source = std::fs::read_to_string(fuzz().join(format!("fuzz_targets/{name}.rs"))).expect("readable");
        assert!(source.contains(&format!("Target `{name}`")), "{name}");
    }
}

/// The corpus is part of every clone.
#[test]
fn the_corpus_is_small() {
    let bytes: u64 = all()
        .iter()
        .flat_map(|target| std::fs::read_dir(fuzz().join("corpus").join(target.name)).expect("a folder"))
        .map(|entry| entry.and_then(|entry| entry.metadata()).expect("readable").len())
        .sum();
    assert!(bytes < 2_000_000, "{bytes} bytes; allowed are 2,000,000: minimise it with `cargo fuzz cmin`");
}
