//! Reads recordings of a person's gait, of any format, as joint angles.

use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::converted::Conversion;
use gait_trace::format::csv_file::MAX_BYTES;
use gait_trace::format::open::{HEAD_BYTES, InRows, of_bytes};
use gait_trace::{
    Axis, Fault, Finding, Level, LowPass, PositiveDirection, RawJoints, ReadOptions, RowFilter, Rules, TraceError,
};
use hgod_adc::Calibration;
use joint_units::Joint;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::board::image::{sha256, sha256_of};
use crate::failure::Failure;
use crate::file::bounded;
use crate::file::calibration_file::{self, WiredSensor};
use crate::messages;

/// How recordings are read.
#[derive(Debug, Clone)]
pub struct ReadSettings {
    /// Columns of joints and time, as on the command line: `left_hip=COLUMN,time=COLUMN`.
    pub map: Vec<String>,
    /// Unit of the angles where the file does not state it.
    pub unit: Option<AngleUnit>,
    /// Low-pass filter before all other processing.
    pub low_pass: LowPass,
    /// Calibration for recordings of volts.
    pub calibration: Option<SensorCalibration>,
    /// Frames a second, where the file has no times, or too coarse ones.
    pub rate_hz: Option<f64>,
    /// Rows of a CSV file that are read.
    pub only: Vec<RowFilter>,
    /// Axis of flexion of angles with three components.
    pub axis: Option<Axis>,
    /// Topic of the joints of an MCAP file.
    pub topic: Option<String>,
    /// What the file counts as positive at the knees.
    pub knee_sign: Option<PositiveDirection>,
    /// What the file counts as positive at the hips.
    pub hip_sign: Option<PositiveDirection>,
    /// The leg that the file does not have is the other one, half a stride later.
    pub mirror: bool,
    /// Each leg of a cycle counts from its own contact.
    pub own_cycles: bool,
    /// Duration of the stride of a recording whose time is the fraction of a cycle, seconds.
    pub stride_s: Option<f64>,
    /// The joint of a recording whose only joint has no side in its name.
    pub sideless: Option<Joint>,
}

/// The findings that are warnings.
#[must_use]
pub fn warnings(findings: &[Finding]) -> Vec<String> {
    findings.iter().filter(|finding| finding.level() >= Level::Warning).map(ToString::to_string).collect()
}

/// A number of warnings at the end of a line, with a comma before it; nothing for none.
#[must_use]
pub fn and_warnings(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => ", 1 warning".into(),
        more => format!(", {more} warnings"),
    }
}

/// What `--strict` allows: notes, and no warning.
///
/// # Errors
/// Lists the warnings.
pub fn no_warning(name: &str, findings: &[Finding]) -> Result<(), Failure> {
    let warnings = warnings(findings);
    if warnings.is_empty() {
        return Ok(());
    }
    Err(Failure::run(format!("{name}: --strict allows no warning: {}", warnings.join("; "))))
}

/// A calibration and the file that it is from.
#[derive(Debug, Clone)]
pub struct SensorCalibration {
    /// The file.
    pub path: PathBuf,
    /// The curve.
    pub curve: Calibration,
    /// Volts at the sensor for one volt at the pin.
    pub divider: f32,
}

impl SensorCalibration {
    /// Reads the calibration of a sensor file.
    ///
    /// # Errors
    /// The file cannot be read or is wrong.
    pub fn read(path: PathBuf) -> Result<Self, Failure> {
        let WiredSensor { calibration: curve, divider } = calibration_file::read(&path).map_err(Failure::input)?;
        Ok(Self { path, curve, divider })
    }
}

impl ReadSettings {
    /// Checks the map.
    ///
    /// # Errors
    /// The map is wrong.
    pub fn check(&self) -> Result<(), Failure> {
        self.options().map(drop)
    }

    /// The rules by which a recording that was read is conditioned.
    #[must_use]
    pub fn rules(&self) -> Rules {
        let Self { low_pass, knee_sign, hip_sign, mirror, own_cycles, stride_s, .. } = *self;
        Rules { low_pass, knee_sign, hip_sign, mirror, own_cycles, stride_s, ..Rules::default() }
    }

    /// The options of the readers of the formats.
    ///
    /// # Errors
    /// The map is wrong.
    pub fn options(&self) -> Result<ReadOptions<'_>, Failure> {
        let mut options = ReadOptions {
            unit: self.unit,
            calibration: self.calibration.as_ref().map(|calibration| &calibration.curve),
            divider: self.calibration.as_ref().map(|calibration| calibration.divider),
            rate_hz: self.rate_hz,
            only: self.only.clone(),
            axis: self.axis,
            topic: self.topic.clone(),
            sideless: self.sideless,
            ..ReadOptions::default()
        };
        for map in &self.map {
            options.add_map(map).map_err(Failure::input)?;
        }
        Ok(options)
    }
}

/// A recording that was read.
#[derive(Debug)]
pub struct Recorded {
    /// The file's name.
    pub name: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// The joints as they are in the file, or what is wrong with them.
    pub joints: Result<RawJoints, TraceError>,
    /// The record of `footfall convert`, if the file has one.
    pub conversion: Option<Conversion>,
}

impl Recorded {
    /// The low-pass to use where `asked` is requested, and a note if it is another one: a file that `footfall convert` has filtered is
    /// not filtered again.
    ///
    /// # Errors
    /// A cut-off is requested for a file that has been filtered.
    pub fn low_pass(&self, asked: LowPass) -> Result<(LowPass, Option<String>), Failure> {
        let Some(Conversion { low_pass_hz: Some(hz), source, .. }) = &self.conversion else { return Ok((asked, None)) };
        match asked {
            LowPass::Off => Ok((LowPass::Off, None)),
            LowPass::Customary => Ok((
                LowPass::Off,
                Some(format!("`footfall convert` filtered this file at {hz} Hz; it is not filtered again")),
            )),
            LowPass::At(_) => Err(Failure::input(format!(
                "{}: `footfall convert` filtered this file at {hz} Hz, and twice is too much: leave --low-pass out, or convert {source} again without it",
                self.name
            ))),
        }
    }

    /// Why the file is no recording of gait at all: it has no time and no joint, no joint, no trajectory, or holds another quantity. `None` for
    /// recordings, also for wrong ones.
    #[must_use]
    pub fn other_than_gait(&self) -> Option<String> {
        let error = self.joints.as_ref().err()?;
        let other = matches!(
            *error.fault,
            Fault::NoTime { has_joints: false, .. }
                | Fault::NoHeader { .. }
                | Fault::NoJoints { .. }
                | Fault::NoTrajectories { .. }
                | Fault::NotAngles { .. }
                | Fault::TitleOfOther { .. }
                | Fault::NoModelOutputs { .. }
        );
        other.then(|| error.to_string())
    }
}

/// Whether a path is a regular file. Opening a named pipe would block until another program writes into it.
///
/// # Errors
/// It is not there, or is something else.
pub fn check_regular(path: &Path) -> Result<(), Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: cannot be read: {error}", path.display()));
    let kind = std::fs::metadata(path).map_err(wrong)?;
    if kind.is_dir() {
        let why =
            "is a folder and no regular file; allowed is a recording on disk (`footfall fit` takes a folder of them)";
        return Err(Failure::input(format!("{}: {why}", path.display())));
    }
    if !kind.is_file() {
        return Err(Failure::input(format!("{}: is no regular file; allowed is a recording on disk", path.display())));
    }
    Ok(())
}

/// The bytes of a recording.
///
/// # Errors
/// It is no regular file, is larger than allowed, or cannot be read.
pub fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    check_regular(path)?;
    let bytes = bounded::bytes(path, MAX_BYTES).map_err(|why| Failure::input(format!("{}: {why}", path.display())))?;
    messages::detail(format_args!("read {}: {} bytes", path.display(), bytes.len()));
    Ok(bytes)
}

/// The content of a recording: its bytes, or a large table of text, whose rows are read from the disk.
#[derive(Debug)]
pub struct Content {
    path: PathBuf,
    sha256: String,
    held: Held,
}

#[derive(Debug)]
enum Held {
    Whole(Vec<u8>),
    InRows { file: File, head: Vec<u8>, rows: InRows, state: State },
}

/// By what a file that changes while it is read is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct State {
    length: u64,
    modified: Option<SystemTime>,
}

impl State {
    fn of(file: &File) -> std::io::Result<Self> {
        let data = file.metadata()?;
        Ok(Self { length: data.len(), modified: data.modified().ok() })
    }
}

/// Opens a recording.
///
/// # Errors
/// It is no regular file, is larger than allowed, or cannot be read.
pub fn open(path: &Path) -> Result<Content, Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: cannot be read: {error}", path.display()));
    // What is wrong with the file is found, and said, where it is read whole.
    let large = || -> Option<(File, u64)> {
        let length = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?.len();
        ((HEAD_BYTES as u64)..=MAX_BYTES).contains(&length).then_some((File::open(path).ok()?, length))
    };
    if let Some((mut file, length)) = large() {
        let mut head = vec![0; HEAD_BYTES];
        let filled = file.read_exact(&mut head).is_ok();
        if let Some(rows) = InRows::of_head(&path.display().to_string(), &head).filter(|_| filled) {
            let state = State::of(&file).map_err(wrong)?;
            file.rewind().map_err(wrong)?;
            let sha256 = sha256_of(&mut file).map_err(wrong)?;
            messages::detail(format_args!("read {}: {length} bytes, row by row", path.display()));
            return Ok(Content { path: path.into(), sha256, held: Held::InRows { file, head, rows, state } });
        }
    }
    let bytes = bytes(path)?;
    Ok(Content { path: path.into(), sha256: sha256(&bytes), held: Held::Whole(bytes) })
}

impl Content {
    /// SHA-256 of the file.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Reads the recording.
    ///
    /// # Errors
    /// The map is wrong, or the file can no longer be read or has changed since it was opened. What is wrong with the recording itself is in the result.
    pub fn parse(&mut self, settings: &ReadSettings) -> Result<Recorded, Failure> {
        let (file, head, rows, state) = match &mut self.held {
            Held::Whole(bytes) => return parse_known(&self.path, bytes, self.sha256.clone(), settings),
            Held::InRows { file, head, rows, state } => (file, head, rows, *state),
        };
        let name = self.path.display().to_string();
        let joints = match rows.read(&name, file, &settings.options()?) {
            Ok(None) => return parse(&self.path, &bytes(&self.path)?, settings),
            Ok(Some(joints)) => Ok(joints),
            Err(error) => Err(error),
        };
        // Its rows are read after the sum of its bytes, which would be that of another content.
        if State::of(file).ok() != Some(state) {
            let why = "it was written to while it was read: read it again when the program that writes it has ended";
            return Err(Failure::input(format!("{name}: {why}")));
        }
        let conversion = Conversion::of_bytes(head).map_err(|why| Failure::input(format!("{name}: {why}")))?;
        Ok(Recorded { name, sha256: self.sha256.clone(), joints, conversion })
    }
}

/// Reads a recording from its bytes.
///
/// # Errors
/// The map is wrong. What is wrong with the recording itself is in the result.
pub fn parse(path: &Path, bytes: &[u8], settings: &ReadSettings) -> Result<Recorded, Failure> {
    parse_known(path, bytes, sha256(bytes), settings)
}

/// The same, with the SHA-256 of the bytes.
fn parse_known(path: &Path, bytes: &[u8], sha256: String, settings: &ReadSettings) -> Result<Recorded, Failure> {
    let name = path.display().to_string();
    let joints = of_bytes(&name, bytes, &settings.options()?);
    let conversion = Conversion::of_bytes(bytes).map_err(|why| Failure::input(format!("{name}: {why}")))?;
    Ok(Recorded { name, sha256, joints, conversion })
}
