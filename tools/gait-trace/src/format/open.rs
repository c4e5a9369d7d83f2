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
    let extension = Path::new(name).extension().and_then(|text| text.to_str()).unwrap_or_default().to_ascii_lowercase();
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
        Chosen::Other(reader) => reader(name, bytes, how),
        Chosen::Csv(text) => mapped_csv::parse_text(name, text, how),
    }
}

/// Bytes of the beginning of a file by which [`InRows::of_head`] decides.
pub const HEAD_BYTES: usize = 1 << 20;

/// A large export of an oscilloscope, whose rows are read without keeping the file in memory.
#[derive(Debug, Clone)]
pub struct InRows {
    /// The first lines of the file, with its header.
    head: String,
    dialect: scope::Dialect,
}

impl InRows {
    /// From the first [`HEAD_BYTES`] of a file; `None` if the file has no more, or is of another format: it is read whole ([`of_bytes`]).
    #[must_use]
    pub fn of_head(name: &str, head: &[u8]) -> Option<Self> {
        let head = head.get(..HEAD_BYTES)?;
        let end = head.iter().rposition(|&byte| byte == b'\n')? + 1;
        let text = text_table::text(name, &head[..end]).ok()?;
        unsupported::check(name, head).ok()?;
        // No reader recognises its files by more lines than this.
        if text_table::bare_lines(text).filter(|row| !row.trim().is_empty()).count() < MOST_LINES
            || OF_TEXT.iter().any(|(looks_like, _)| looks_like(text))
        {
            return None;
        }
        Some(Self { head: text.to_owned(), dialect: scope::dialect_of(text)? })
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
        if how.axis.is_some() || how.topic.is_some() || !how.only.is_empty() {
            return Ok(None);
        }
        source.rewind().map_err(|error| TraceError::new(name, None, Fault::Io(error)))?;
        scope::parse_blocks(name, &self.head, self.dialect, &mut Blocks::of(source), how)
    }
}

/// More lines than any reader looks at to recognise its files.
const MOST_LINES: usize = 1001;

type Recognise = fn(&str) -> bool;
type Reader = fn(&str, &[u8], &ReadOptions<'_>) -> Result<RawJoints, TraceError>;

/// Text formats that their own readers recognise, in the order in which they are tried.
const OF_TEXT: [(Recognise, Reader); 6] = [
    (mvnx::looks_like, mvnx::parse),
    (trc::looks_like, trc::parse),
    (vicon::looks_like, vicon::parse),
    (visual3d::looks_like, visual3d::parse),
    (gcd::looks_like, gcd::parse),
    (opensim::looks_like, opensim::parse),
];

/// The reader of a file.
enum Chosen<'a> {
    /// That of CSV with any header, for this text.
    Csv(&'a str),
    Other(Reader),
}

fn reader_of<'a>(name: &str, bytes: &'a [u8], extension: &str) -> Result<Chosen<'a>, TraceError> {
    let other = |reader: Reader| Ok(Chosen::Other(reader));
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
        return other(reader);
    }
    if scope::dialect_of(text).is_some() {
        return other(scope::parse);
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
