//! Every file of the corpus, and 50 damaged copies of each, through every reader: no panic, and whatever is read
//! satisfies the guarantees of `RawJoints`. The same seeds, the same files, each time.

#[path = "support/guarantees.rs"]
mod guarantees;
mod support;

use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::open;
use gait_trace::format::{c3d, gcd, mapped_csv, mcap_file, mvnx, opensim, scope, trc, vicon, visual3d};
use gait_trace::{Axis, ReadOptions};
use gait_trace::{RawJoints, TraceError};
use std::path::{Path, PathBuf};

/// Damaged copies of each file of the corpus.
const COPIES: u64 = 50;
/// The same in `no_damage_of_many_makes_a_reader_panic`.
const MANY_COPIES: u64 = 450;
/// Damaged copies of each text export of a laboratory, in `no_damage_of_an_export_makes_its_reader_panic`.
const EXPORT_COPIES: u64 = 30_000;

type Reader = fn(&str, &[u8], &ReadOptions<'_>) -> Result<RawJoints, TraceError>;
const READERS: &[(&str, Reader)] = &[
    ("a", open::of_bytes),
    ("a.csv", mapped_csv::parse),
    ("a.mot", opensim::parse),
    ("a.c3d", c3d::parse),
    ("a.csv", scope::parse),
    ("a.trc", trc::parse),
    ("a.mcap", mcap_file::parse),
    ("a.mvnx", mvnx::parse),
    ("a.csv", vicon::parse),
    ("a.txt", visual3d::parse),
    ("a.gcd", gcd::parse),
];

fn corpus() -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let inside = |folder: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let folders = inside(&folder).into_iter().filter(|path| path.is_dir());
    let mut files: Vec<PathBuf> = folders.flat_map(|folder| inside(&folder)).collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), std::fs::read(&path).unwrap())).collect()
}

/// All ways to ask.
fn ways<'a>(calibration: &'a hgod_adc::Calibration) -> [ReadOptions<'a>; 7] {
    let mut channel = ReadOptions { calibration: Some(calibration), ..ReadOptions::default() };
    channel.add_map("left_knee=CH1,right_knee=3").unwrap();
    let mut alone = ReadOptions { calibration: Some(calibration), ..ReadOptions::default() };
    alone.add_map("left_knee=CH1").unwrap();
    let mut numbers =
        ReadOptions { unit: Some(AngleUnit::Degrees), calibration: Some(calibration), ..ReadOptions::default() };
    numbers.add_map("time=1,left_hip=2").unwrap();
    // Not by a command line's text: a map refuses a column with two meanings.
    numbers.map.push((joint_units::Joint::LeftKnee, "2".into()));
    let mut volts = ReadOptions { calibration: Some(calibration), ..ReadOptions::default() };
    volts.add_map("time=1,left_knee=2").unwrap();
    let axis = ReadOptions { axis: Some(Axis::Z), ..ReadOptions::default() };
    let rate = ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() };
    [ReadOptions::default(), channel, alone, numbers, volts, rate, axis]
}

/// Marsaglia's xorshift64*: the same numbers everywhere.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % end.max(1)
    }
}

/// Pieces that parsers trip over.
const PIECES: &[&[u8]] = &[
    b"nan",
    b"-inf",
    b"1e999",
    b"99999999999999999999",
    b"\"",
    b"\"\"",
    b",,,,,,",
    b"\n\n",
    b"\r",
    b"\t",
    b"endheader\n",
    b"=",
    b"\xff\xfe",
    b"\0\0\0\0",
    b"nRows=4294967296\n",
    b"#",
    b"<!DOCTYPE a [<!ENTITY b \"c\">]>",
    b"</frame>",
    b"<jointAngle>1 2 3",
    b"&b;",
    b"\nModel Outputs\n",
    b"\n\n100\n",
    b"Frame,Sub Frame,X,Y,Z\n",
    b"Bert:LHipAngles",
    b"ITEM\t",
    b"\tNODATA\t",
    b"\n!LeftKneeFlexExt 1\n",
    b"\n!LeftOppositeFootContact\n",
    b"$\n",
];

fn damaged(dice: &mut Dice, good: &[u8], other: &[u8]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=dice.below(3) {
        let at = dice.below(bytes.len());
        match dice.below(7) {
            0 => bytes.truncate(at),
            1 => (0..=dice.below(8)).for_each(|_| {
                let at = dice.below(bytes.len());
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << dice.below(8);
                }
            }),
            2 => {
                let piece = PIECES[dice.below(PIECES.len())];
                bytes.splice(at..at, piece.iter().copied());
            }
            3 => {
                let from = dice.below(other.len());
                let end = (from + dice.below(600)).min(other.len());
                let until = (at + dice.below(600)).min(bytes.len());
                bytes.splice(at..until, other[from..end].iter().copied());
            }
            4 => {
                let until = (at + 1 + dice.below(64)).min(bytes.len());
                let value = [0, 0xff, 0x7f, 0x80, b'9'][dice.below(5)];
                bytes.get_mut(at..until).unwrap_or_default().fill(value);
            }
            // The first kilobyte is where the headers are.
            5 => {
                let at = dice.below(bytes.len().min(1024));
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = dice.below(256) as u8;
                }
            }
            _ => {
                let until = (at + dice.below(200)).min(bytes.len());
                bytes.drain(at.min(until)..until);
            }
        }
    }
    bytes
}

#[test]
fn the_corpus_is_read_by_the_reader_that_it_is_for() {
    let calibration = support::calibration();
    let files = corpus();
    assert!(files.len() >= 30, "{} files", files.len());
    for (path, bytes) in &files {
        let read = ways(&calibration).iter().any(|how| match open::of_bytes(&path.to_string_lossy(), bytes, how) {
            Ok(raw) => {
                guarantees::check(&raw);
                true
            }
            Err(_) => false,
        });
        let found = path.file_name().unwrap().to_string_lossy().starts_with("found_");
        assert!(read || found, "{} was not read", path.display());
    }
}

#[test]
fn no_damage_makes_a_reader_panic() {
    damaged_copies_are_read_or_refused(COPIES);
}

/// Takes minutes: `cargo test -p gait-trace --test mutations -- --ignored no_damage_of_many`.
#[test]
#[ignore = "minutes: 450 damaged copies of each file, through every reader; run it with --ignored after a change of the readers"]
fn no_damage_of_many_makes_a_reader_panic() {
    damaged_copies_are_read_or_refused(MANY_COPIES);
}

fn damaged_copies_are_read_or_refused(copies: u64) {
    let calibration = support::calibration();
    let ways = ways(&calibration);
    let files = corpus();
    let (mut read, mut refused) = (0, 0);
    for (index, (_, good)) in files.iter().enumerate() {
        for copy in 0..copies {
            let mut dice = Dice(0x9e37_79b9_7f4a_7c15 ^ ((index as u64) << 32 | (copy + 1)));
            let other = &files[dice.below(files.len())].1;
            let bytes = damaged(&mut dice, good, other);
            for how in &ways {
                for &(name, reader) in READERS {
                    match reader(name, &bytes, how) {
                        Ok(raw) => {
                            guarantees::check(&raw);
                            read += 1;
                        }
                        Err(error) => {
                            assert!(error.to_string().starts_with(name));
                            refused += 1;
                        }
                    }
                }
            }
        }
    }
    println!("{read} read, {refused} refused");
    // Damage of all kinds: some of it leaves a file that can be read, most of it does not.
    assert!(read > 1000 && refused > 10_000, "{read} read, {refused} refused");
}

/// 30,000 damaged copies of each text export of a laboratory, through the reader that the content chooses and through its own. Takes
/// minutes: `cargo test -p gait-trace --test mutations -- --ignored`.
#[test]
#[ignore = "minutes: 200,000 damaged files; run it with --ignored after a change of the readers of text exports"]
fn no_damage_of_an_export_makes_its_reader_panic() {
    let calibration = support::calibration();
    let ways = ways(&calibration);
    let own: [(&str, Reader); 3] = [("vicon", vicon::parse), ("visual3d", visual3d::parse), ("gcd", gcd::parse)];
    let files = corpus();
    let (mut damaged_files, mut read, mut refused) = (0, 0, 0);
    for (index, (path, good)) in files.iter().enumerate() {
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
        let Some((_, own)) = own.iter().find(|(name, _)| folder == *name) else { continue };
        for copy in 0..EXPORT_COPIES {
            let mut dice = Dice(0x2545_f491_4f6c_dd1d ^ ((index as u64) << 40 | (copy + 1)));
            let other = &files[dice.below(files.len())].1;
            let bytes = damaged(&mut dice, good, other);
            damaged_files += 1;
            let how = &ways[dice.below(ways.len())];
            for result in [open::of_bytes("a", &bytes, how), own("a", &bytes, how), own("a", &bytes, &ways[0])] {
                match result {
                    Ok(raw) => {
                        guarantees::check(&raw);
                        read += 1;
                    }
                    Err(error) => {
                        assert!(error.to_string().starts_with('a'));
                        refused += 1;
                    }
                }
            }
        }
    }
    println!("{damaged_files} damaged files, {read} reads gave joints, {refused} were refused");
    assert!(damaged_files >= 200_000 && read > 20_000 && refused > 100_000, "{damaged_files}: {read} and {refused}");
}
