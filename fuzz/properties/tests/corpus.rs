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

const BLOCK: usize = 512;

/// The files `corpus/TARGET/NAME` of the archive, in the format ustar: a block as header, then the bytes, filled up to whole blocks.
fn seeds() -> Vec<Seed> {
    let file = fuzz().join("corpus.tar");
    let archive = std::fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let text = |field: &[u8]| {
        let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
        String::from_utf8(field[..end].to_vec()).expect("text")
    };
    let (mut rest, mut seeds) = (&archive[..], Vec::new());
    while rest.first().is_some_and(|&byte| byte != 0) {
        let (header, after) = rest.split_at(BLOCK);
        let size = usize::from_str_radix(text(&header[124..136]).trim(), 8).expect("an octal size");
        // Folders and the rest of what `tar` may write have no bytes to check.
        if header[156] == b'0' {
            let path = text(&header[..100]);
            let mut parts = path.trim_start_matches("./").split('/').skip(1);
            let (target, name) =
                parts.next().zip(parts.next()).unwrap_or_else(|| panic!("{path}: not corpus/TARGET/NAME"));
            seeds.push(Seed { target: target.to_owned(), name: name.to_owned(), bytes: after[..size].to_vec() });
        }
        rest = &after[size.next_multiple_of(BLOCK)..];
    }
    seeds
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
