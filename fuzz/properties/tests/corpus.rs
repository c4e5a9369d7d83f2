//! Every seed of `fuzz/corpus.tar`, through the property of its target: without a fuzzer, in the ordinary tests.

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

#[cfg(feature = "program")]
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    entries.map(|entry| entry.expect("readable").file_name().into_string().expect("text")).collect()
}

/// A seed of the archive: its target, its name and its bytes.
struct Seed {
    target: String,
    name: String,
    bytes: Vec<u8>,
}

/// The files `corpus/TARGET/NAME` of the archive.
fn seeds() -> Vec<Seed> {
    let file = fuzz().join("corpus.tar");
    let open = || std::fs::File::open(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut archive = tar::Archive::new(open());
    let entries = archive.entries().expect("an archive").map(|entry| entry.expect("a whole entry"));
    let files = entries.filter(|entry| entry.header().entry_type().is_file());
    let seed = |mut entry: tar::Entry<'_, _>| {
        let path = entry.path().expect("text").to_str().expect("UTF-8").to_owned();
        let parts: Vec<&str> = path.trim_start_matches("./").split('/').collect();
        let ["corpus", target, name] = parts[..] else { panic!("{path}: not corpus/TARGET/NAME") };
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut bytes).expect("readable");
        Seed { target: target.to_owned(), name: name.to_owned(), bytes }
    };
    files.map(seed).collect()
}

#[test]
fn every_seed_has_its_property() {
    // The targets one after the other take long on one core.
    let (next, targets, seeds) = (AtomicUsize::new(0), all(), seeds());
    let run = || {
        while let Some(target) = targets.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mut of_target = seeds.iter().filter(|seed| seed.target == target.name).peekable();
            assert!(of_target.peek().is_some(), "{} has no seed", target.name);
            for Seed { name, bytes, .. } in of_target {
                let outcome = std::panic::catch_unwind(|| (target.check)(bytes));
                assert!(outcome.is_ok(), "corpus/{}/{name} does not have the property of its target", target.name);
            }
        }
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> =
            (0..std::thread::available_parallelism().map_or(1, usize::from)).map(|_| scope.spawn(run)).collect();
        threads.into_iter().for_each(|thread| thread.join().expect("every seed has its property"));
    });
}

/// A target without a seed would be fuzzed and never replayed; a seed without a target would be neither.
#[cfg(feature = "program")]
#[test]
fn targets_corpus_and_fuzzer_have_the_same_names() {
    let targets: BTreeSet<String> = all().iter().map(|target| target.name.to_owned()).collect();
    assert_eq!(targets.len(), all().len());
    assert_eq!(seeds().into_iter().map(|seed| seed.target).collect::<BTreeSet<_>>(), targets);
    let files = targets.iter().map(|name| format!("{name}.rs")).collect::<BTreeSet<_>>();
    assert_eq!(names(&fuzz().join("fuzz_targets")), files);
    let manifest = std::fs::read_to_string(fuzz().join("Cargo.toml")).expect("readable");
    for name in &targets {
        assert!(manifest.contains(&format!("name = \"{name}\"\npath = \"fuzz_targets/{name}.rs\"")), "{name}");
        let source = std::fs::read_to_string(fuzz().join(format!("fuzz_targets/{name}.rs"))).expect("readable");
        assert!(source.contains(&format!("Target `{name}`")), "{name}");
    }
}

/// The archive is part of every clone.
#[test]
fn the_archive_is_small() {
    let (seeds, bytes) = (seeds().len(), std::fs::metadata(fuzz().join("corpus.tar")).expect("readable").len());
    assert!(seeds <= 300 && bytes < 1_000_000, "{seeds} seeds, {bytes} bytes; allowed are 300 and 1,000,000");
}
