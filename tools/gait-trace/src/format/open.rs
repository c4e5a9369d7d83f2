//! Reads a recording of any known format. The content decides which reader is used; the extension decides where the content does not.
//!
//! | content | reader |
//! |---|---|
//! | the first bytes of a kind that is not read: BVH, rosbag, images, ... | an error that names it |
//! | the magic bytes of MCAP | [`mcap_file`] |
//! | second byte 0x50, and bytes that are not text | [`c3d`] |
//! | XML with the element `mvnx` | [`mvnx`] |
//! | a first line that begins with `PathFileType` | [`trc`] |
//! | the title of a section of Vicon Nexus, and a rate below it | [`vicon`] |
//! | a third line of signal types of Visual3D, or `ITEM` in the fifth | [`visual3d`] |
//! | a first line that begins with `#!DST` | [`gcd`] |
//! | a line `endheader` | [`opensim`] |
//! | the header of an oscilloscope export | [`scope`] |
//! | other text | [`mapped_csv`] |
//!
//! Nothing is repaired here: times may run backwards, values may be missing, signs are the file's.
//!
//! ```
//! use gait_trace::ReadOptions;
//! use gait_trace::format::open;
//! use joint_units::Joint;
//! let text = b"t;hip;kneel [deg]\n0;20,5;3\n0,01;20,1;\n0,02;19,4;6\n";
//! let mut how = ReadOptions::default();
//! how.add_map("left_hip=hip,left_knee=3")?;
//! how.unit = Some("degrees".parse()?);
//! let raw = open::of_bytes("walk.csv", text, &how)?;
//! assert_eq!(raw.time_s, [0.0, 0.01, 0.02]);
//! assert_eq!(raw.joints[Joint::LeftHip as usize].as_ref().unwrap().angle_deg, [20.5, 20.1, 19.4]);
//! assert!(raw.joints[Joint::LeftKnee as usize].as_ref().unwrap().angle_deg[1].is_nan());
//! assert!(raw.joints[Joint::RightHip as usize].is_none());
//! assert!(raw.format.starts_with("CSV, semicolons"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::fault::{Fault, TraceError};
use crate::format::blocks::Blocks;
use crate::format::csv_file::MAX_BYTES;
use crate::format::rows::read_blocks;
use crate::format::{
    c3d, gcd, mapped_csv, mcap_file, mvnx, opensim, scope, text_table, trc, unsupported, vicon, visual3d,
};
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Reads a file. A file of more than [`MAX_BYTES`] is refused before it is read.
///
/// # Errors
/// The first fault of the file, with its place.
pub fn read(path: &Path, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let name = path.display().to_string();
    let io = |error| TraceError::new(&name, None, Fault::Io(error));
    let mut file = std::fs::File::open(path).map_err(io)?;
    let too_large = || TraceError::new(&name, None, Fault::TooLarge { most: MAX_BYTES });
    let announced = file.metadata().map_err(io)?.len();
    if announced > MAX_BYTES {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(HEAD_BYTES.min(announced as usize));
    file.by_ref().take(HEAD_BYTES as u64).read_to_end(&mut bytes).map_err(io)?;
    if announced > HEAD_BYTES as u64
        && let Some(rows) = InRows::of_head(&name, &bytes)
        && let Some(joints) = rows.read(&name, &mut file, how)?
    {
        return Ok(joints);
    }
    // A pipe has no known length, and a file may grow: the limit is checked on the bytes that arrive.
    bytes.reserve_exact((announced as usize).saturating_sub(bytes.len()));
    if announced > HEAD_BYTES as u64 {
        file.seek(SeekFrom::Start(bytes.len() as u64)).map_err(io)?;
    }
    let rest = MAX_BYTES + 1 - bytes.len() as u64;
    file.by_ref().take(rest).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(too_large());
    }
    of_bytes(&name, &bytes, how)
}

/// Reads the bytes of a file. `name` is the name in errors; its extension is used where the content does not decide.
///
/// # Errors
/// As [`read`].
pub fn of_bytes(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let extension = extension_of(name);
    if bytes.is_empty() {
        return Err(TraceError::new(name, None, Fault::Empty));
    }
    unsupported::check(name, bytes)?;
    let is_csv = || matches!(reader_of(name, bytes, &extension), Ok(Chosen::Csv(_)));
    if how.axis.is_some() && extension != "c3d" && !has_axes(bytes) && !is_csv() {
        return Err(TraceError::new(name, None, Fault::NoAxes { what: "this file has no angles of three components" }));
    }
    if how.topic.is_some() && !mcap_file::looks_like(bytes) {
        return Err(TraceError::new(name, None, Fault::NoTopics));
    }
    match reader_of(name, bytes, &extension)? {
        Chosen::Other(_) if !how.only.is_empty() => Err(TraceError::new(name, None, Fault::NoRowFilter)),
        Chosen::Other(reader) => (reader.whole)(name, bytes, how),
        Chosen::Csv(text) => mapped_csv::parse_text(name, text, how),
    }
}

/// The extension of a file's name, in lower case.
fn extension_of(name: &str) -> String {
    Path::new(name).extension().and_then(|text| text.to_str()).unwrap_or_default().to_ascii_lowercase()
}

/// Bytes of the beginning of a file by which [`InRows::of_head`] decides.
pub const HEAD_BYTES: usize = 1 << 20;

/// A large text of a table, whose rows are read without keeping the file in memory.
#[derive(Debug, Clone)]
pub struct InRows {
    /// The first lines of the file, with its header.
    head: String,
    read: InBlocks,
    /// Whether it is CSV with any header, whose rows and components may be chosen.
    is_csv: bool,
}

impl InRows {
    /// From the first [`HEAD_BYTES`] of a file; `None` if there are no more, if the format is not read in rows, or if the lines are so long
    /// that it may only show behind them which format it is: the file is read whole ([`of_bytes`]).
    #[must_use]
    pub fn of_head(name: &str, head: &[u8]) -> Option<Self> {
        Self::of_beginning(name, head.get(..HEAD_BYTES)?)
    }

    /// From a beginning of any length.
    fn of_beginning(name: &str, head: &[u8]) -> Option<Self> {
        let end = head.iter().rposition(|&byte| byte == b'\n')? + 1;
        unsupported::check(name, head).ok()?;
        let (read, least, is_csv) = match reader_of(name, &head[..end], &extension_of(name)).ok()? {
            Chosen::Csv(_) => (read_blocks::<mapped_csv::Table> as InBlocks, MOST_LINES, true),
            Chosen::Other(reader) => reader.in_blocks.map(|(read, least)| (read, least, false))?,
        };
        let text = text_table::text(name, &head[..end]).ok()?;
        let is_row = |row: &&str| {
            row.contains(char::is_alphanumeric) && !text_table::is_comment(row) && !text_table::is_separator_line(row)
        };
        let has_enough = text_table::bare_lines(text).filter(is_row).take(least).count() == least;
        has_enough.then(|| Self { head: text.to_owned(), read, is_csv })
    }

    /// Reads the file from its beginning; the result is that of [`of_bytes`]. `None` if only the whole file shows what is wrong with it, or
    /// with the options.
    ///
    /// # Errors
    /// The first fault of the file, with its place.
    pub fn read(
        &self,
        name: &str,
        source: &mut (impl Read + Seek),
        how: &ReadOptions<'_>,
    ) -> Result<Option<RawJoints>, TraceError> {
        source.rewind().map_err(|error| TraceError::new(name, None, Fault::Io(error)))?;
        self.read_blocks(name, &mut Blocks::of(source), how)
    }

    fn read_blocks(
        &self,
        name: &str,
        blocks: &mut Blocks<'_>,
        how: &ReadOptions<'_>,
    ) -> Result<Option<RawJoints>, TraceError> {
        if how.topic.is_some() || (!self.is_csv && (how.axis.is_some() || !how.only.is_empty())) {
            return Ok(None);
        }
        (self.read)(name, &self.head, blocks, how)
    }
}

/// More lines than any reader looks at to recognise its files and to find their header.
const MOST_LINES: usize = 1001;

type Recognise = fn(&str) -> bool;
type Whole = fn(&str, &[u8], &ReadOptions<'_>) -> Result<RawJoints, TraceError>;
type InBlocks = fn(&str, &str, &mut Blocks<'_>, &ReadOptions<'_>) -> Result<Option<RawJoints>, TraceError>;

/// The reader of a format.
#[derive(Clone, Copy)]
struct Reader {
    whole: Whole,
    /// The reader of large files, and how many lines the beginning must have by which it is chosen, not counting blank ones and comments.
    in_blocks: Option<(InBlocks, usize)>,
}

impl Reader {
    const fn whole(whole: Whole) -> Self {
        Self { whole, in_blocks: None }
    }

    const fn rows(whole: Whole, in_blocks: InBlocks) -> Self {
        Self { whole, in_blocks: Some((in_blocks, MOST_LINES)) }
    }
}

/// Text formats that their own readers recognise, in the order in which they are tried.
const OF_TEXT: [(Recognise, Reader); 6] = [
    (mvnx::looks_like, Reader::whole(mvnx::parse)),
    // Its first word is enough, and none of the readers before and behind it would take that.
    (trc::looks_like, Reader { whole: trc::parse, in_blocks: Some((read_blocks::<trc::Table>, trc::HEADER_LINES)) }),
    (vicon::looks_like, Reader::whole(vicon::parse)),
    (visual3d::looks_like, Reader::whole(visual3d::parse)),
    (gcd::looks_like, Reader::whole(gcd::parse)),
    (opensim::looks_like, Reader::rows(opensim::parse, read_blocks::<opensim::Table>)),
];

/// The reader of a file.
enum Chosen<'a> {
    /// That of CSV with any header, for this text.
    Csv(&'a str),
    Other(Reader),
}

fn reader_of<'a>(name: &str, bytes: &'a [u8], extension: &str) -> Result<Chosen<'a>, TraceError> {
    let other = |whole: Whole| Ok(Chosen::Other(Reader::whole(whole)));
    if mcap_file::looks_like(bytes) {
        return other(mcap_file::parse);
    }
    if c3d::looks_like(bytes) {
        return other(c3d::parse);
    }
    let text = match text_table::text(name, bytes) {
        Err(_) if extension == "c3d" => return other(c3d::parse),
        Err(error) => return Err(unsupported::by_extension(name, extension).unwrap_or(error)),
        Ok(text) => text,
    };
    if let Some((_, reader)) = OF_TEXT.into_iter().find(|(looks_like, _)| looks_like(text)) {
        return Ok(Chosen::Other(reader));
    }
    if scope::dialect_of(text).is_some() {
        return Ok(Chosen::Other(Reader::rows(scope::parse, read_blocks::<scope::Table>)));
    }
    match extension {
        "c3d" => other(c3d::parse),
        "mot" | "sto" => other(opensim::parse),
        "gcd" => other(gcd::parse),
        _ => Ok(Chosen::Csv(text)),
    }
}

/// Whether the file's angles have three components, of which the caller may choose one.
fn has_axes(bytes: &[u8]) -> bool {
    let of_text = |text: &str| vicon::looks_like(text) || visual3d::looks_like(text);
    c3d::looks_like(bytes) || text_table::text("", bytes).is_ok_and(of_text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
    use joint_units::{Radians, Volts};
    use proptest::prelude::*;

    /// Lines of the files: some more than the beginning needs.
    const LINES: usize = MOST_LINES + 60;

    /// A recording of each kind of header and of each reader that reads rows: name, header, rows, and options as a map and a rate.
    fn recordings() -> Vec<(&'static str, &'static str, String, &'static str, Option<f64>)> {
        let rows = |row: &dyn Fn(f64, f64, f64) -> String| -> String {
            let angles = |n: f64| (20.0 * (0.1 * n).sin(), 30.0 + 25.0 * (0.1 * n).cos());
            (0..LINES).map(|n| row(n as f64, angles(n as f64).0, angles(n as f64).1) + "\n").collect()
        };
        let commas = |text: String| text.replace('.', ",");
        let plain = rows(&|n, hip, knee| format!("{:.2},{hip:.4},{knee:.3},x{}", n * 0.01, n % 7.0));
        let marker = |x: f64, y: f64| format!("\t{x:.3}\t{y:.3}\t-90.5\t{x:.3}\t{y:.3}\t90.5");
        vec![
            ("a.csv", "time_s,left_hip_deg,left_knee_deg,note\n", plain.clone(), "", None),
            ("a.csv", "# by hand\n\ntime_s,left_hip_deg,left_knee_deg,trial\n", plain.replace(",x", ",1.5"), "", None),
            ("a.csv", "# time_s,left_hip_deg,left_knee_deg,note\n", plain.replace(",x", ","), "", None),
            ("a.csv", "Patient: Max\nRate: 100 Hz\n\nframe,hip l,knee l,who\n", plain, "", Some(100.0)),
            (
                "a.txt",
                "sep=;\nZeit;\"Hüfte; links\";knee_l;\"a;b\"\ns;deg;deg;\n",
                commas(rows(&|n, hip, knee| format!("{:.2};{hip:.4};{knee:.3};\"{n};\"", n * 0.01))),
                "left_hip=2",
                None,
            ),
            (
                "a.tsv",
                "time_ms\tLHipAngles_X (deg)\tLHipAngles_Y (deg)\tsubject\n",
                rows(&|n, hip, knee| format!("{:.1}\t{knee:.4}\t{:.4}\tAnna", n * 10.0, hip * 0.1)),
                "",
                None,
            ),
            (
                "a.txt",
                "",
                rows(&|n, hip, knee| format!("{n} {hip:.4}  {knee:.3}")),
                "left_hip=2,left_knee=3",
                Some(50.0),
            ),
            (
                "a.mot",
                "Coordinates\nversion=1\nnRows=1061\nnColumns=3\ninDegrees=yes\nendheader\ntime\thip_flexion_l\tknee_angle_l\n",
                rows(&|n, hip, knee| format!("{:.3}\t{hip:.6}\t{knee:.6}\t", n * 0.005)),
                "",
                None,
            ),
            (
                "a.trc",
                "PathFileType\t4\t(X/Y/Z)\ta.trc\nNumFrames\tNumMarkers\tUnits\n1061\t6\tmm\nFrame#\tTime\tLHJC\t\t\tRHJC\t\t\tLKJC\t\t\tRKJC\t\t\tLAJC\t\t\tRAJC\n\t\tX1\tY1\tZ1\n\n",
                rows(&|n, hip, knee| {
                    let places = [marker(n, 900.0), marker(n + 5.0 * hip, 500.0), marker(n - 5.0 * knee, 100.0)];
                    format!("{n}\t{:.3}{}", n * 0.01, places.concat())
                }),
                "",
                None,
            ),
            (
                "a.csv",
                "Model,MDO3024\nRecord Length,1061\nVertical Units,V\nTIME,CH1\n",
                rows(&|n, _, knee| format!("{:.5},{:.4}", n * 1e-3, 0.5 + knee / 50.0)),
                "left_knee=CH1",
                None,
            ),
        ]
    }

    fn calibration() -> Calibration {
        let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
        Calibration::new(&[point(0.0, -25.0), point(3.0, 125.0)], Interpolation::Linear).unwrap()
    }

    fn options<'a>(map: &str, rate_hz: Option<f64>, calibration: &'a Calibration) -> ReadOptions<'a> {
        let is_volts = map.contains("CH1");
        let mut how = ReadOptions { rate_hz, calibration: is_volts.then_some(calibration), ..ReadOptions::default() };
        if !map.is_empty() {
            how.add_map(map).unwrap();
        }
        how
    }

    /// A source that gives at most so many bytes at once.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let most = buffer.len().min(self.1);
            self.0.read(&mut buffer[..most])
        }
    }

    /// All digits of what is read, or the error.
    fn words(read: Result<RawJoints, TraceError>) -> Result<String, String> {
        read.map(|joints| format!("{joints:?}")).map_err(|error| error.to_string())
    }

    fn longest_line(bytes: &[u8]) -> usize {
        bytes.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::len).max().unwrap_or(0)
    }

    /// The place behind so many lines, or behind all.
    fn behind(lines: usize, bytes: &[u8]) -> usize {
        bytes.split_inclusive(|&byte| byte == b'\n').take(lines).map(<[u8]>::len).sum()
    }

    /// Reads a file whole and in blocks of so many bytes more than its longest line has: the results, if there are blocks.
    #[expect(clippy::type_complexity, reason = "two results of one type")]
    fn both(
        name: &str,
        bytes: &[u8],
        (head, more, at_once): (usize, usize, usize),
        how: &ReadOptions<'_>,
    ) -> Option<(Result<String, String>, Option<Result<String, String>>)> {
        let rows = InRows::of_beginning(name, &bytes[..behind(head, bytes)])?;
        let mut source = Slow(bytes, at_once);
        let read = rows.read_blocks(name, &mut Blocks::of_bytes(longest_line(bytes) + 1 + more, &mut source), how);
        Some((words(of_bytes(name, bytes, how)), read.transpose().map(words)))
    }

    /// A block may end at every byte of a line.
    #[test]
    fn blocks_of_every_size_give_the_whole_file() {
        let calibration = calibration();
        for (name, header, rows, map, rate_hz) in recordings() {
            let how = options(map, rate_hz, &calibration);
            for (end, begin) in [("\n", ""), ("\r\n", "\u{feff}")] {
                let text = format!("{begin}{header}{rows}").replace('\n', end);
                for more in 0..longest_line(text.as_bytes()) {
                    let (whole, blocks) = both(name, text.as_bytes(), (MOST_LINES + 10, more, 9999), &how).unwrap();
                    assert!(whole.is_ok(), "{header}: {whole:?}");
                    assert!(blocks == Some(whole), "{header}: blocks of {more} bytes more than the longest line");
                }
            }
        }
    }

    proptest! {
        /// A file is the same, and so is its error, read whole and in small blocks; the longer files are damaged anywhere and cut anywhere.
        #[test]
        fn a_file_in_blocks_is_the_whole_file(
            kind in any::<prop::sample::Index>(),
            marks in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>(),
                "[-+.,;\t\r\n\" #0-9a-zé]{0,4}|nan|inf|1e999|\n\n|\r\r|\"\n|\nendheader\n|[\u{0}\u{b}]|[0-9.]{9,40}|,x,7|\t\t"), 0..4),
            is_latin in prop::bool::weighted(0.1),
            end in prop::sample::select(vec!["\n", "\n", "\r\n"]),
            begin in prop::sample::select(vec!["", "\u{feff}", "# remark\n", "\n \n"]),
            cut in prop::option::weighted(0.5, 0_usize..40),
            (head, more, at_once) in (12_usize..LINES, 0_usize..500, 1_usize..5000),
        ) {
            let calibration = calibration();
            let recordings = recordings();
            let (name, header, rows, map, rate_hz) = kind.get(&recordings);
            let mut text = format!("{begin}{header}{rows}").replace('\n', end);
            let whole_lines = text.lines().count();
            for (place, is_late, mark) in &marks {
                // Many at the end, where few lines are behind.
                let from = if *is_late { text.len() - 300 } else { 0 };
                let at = text.floor_char_boundary(from + place.index(text.len() - from));
                text.insert_str(at, mark);
            }
            if let Some(cut) = cut {
                text.truncate(text.floor_char_boundary(text.len() - cut));
            }
            let mut bytes = text.into_bytes();
            if is_latin && let Some((place, ..)) = marks.first() {
                let at = place.index(bytes.len());
                bytes[at] = 0xe9;
            }
            // Only a file of markers is recognised by few lines, and by its first word.
            let head = if *name == "a.trc" { head } else { whole_lines - head % 40 };
            let is_recognised = begin != "# remark\n" && (*name != "a.trc" || begin != "\n \n");
            let how = options(map, *rate_hz, &calibration);
            if let Some((whole, blocks)) = both(name, &bytes, (head, more, at_once), &how) {
                match blocks {
                    Some(blocks) => prop_assert_eq!(blocks, whole),
                    None => prop_assert!(text_table::text(name, &bytes).is_err(), "no blocks"),
                }
            } else {
                prop_assert!(!marks.is_empty() || is_latin || cut.is_some() || !is_recognised, "not read in rows");
            }
        }
    }
}
