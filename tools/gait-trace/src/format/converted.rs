//! Writes conditioned joints as CSV or OpenSim motion, with a record of the conversion that readers of the file can use.
//!
//! ```text
//! # footfall convert 0.1.0                                   CSV: comments above the header
//! # source: walk.c3d
//! # source-sha256: 9f86d0...
//! # options: --unit degrees
//! # low-pass: 6 Hz                                            or: off
//! # signs: left_hip known, right_hip known, left_knee known, ...     what each sign rests on
//! # changed: left knee: extension is positive in the file (-57.7 to -3.8 deg: too far for flexion of a knee); the sign was changed
//! time_s,left_hip_deg,...
//! ```
//! In a motion file the same lines are in the header, `footfall-convert=0.1.0`, `source=walk.c3d`, .... A value that the source does not
//! have stays missing: an empty cell in CSV, `NaN` in a motion file.
//!
//! The angles are flexion positive as far as that is known, and `signs` says how far ([`SignBasis`]): a reader of the file takes no sign as
//! known that was assumed, and none as found that was changed by the shape of the strides.

use crate::clean::condition::Conditioned;
use crate::format::conversion_record::{self, CSV_MARK, MOT_MARK, Record};
use crate::format::opensim::coordinate;
use crate::raw::SignBasis;
use joint_units::Joint;
use std::io::{self, Write};

/// A file format that conversions are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values, as [`crate::format::csv_file`] reads them.
    Csv,
    /// OpenSim motion, version 1, in degrees.
    Mot,
}

/// The record of a conversion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conversion {
    /// Version of the program that converted.
    pub version: String,
    /// The file that was converted.
    pub source: String,
    /// Its SHA-256, in hex.
    pub source_sha256: String,
    /// The options that were given, in words.
    pub options: String,
    /// Cut-off of the low-pass that the values went through, Hz.
    pub low_pass_hz: Option<f64>,
    /// What was changed or is doubtful, one sentence each.
    pub changes: Vec<String>,
}

impl Conversion {
    /// The record in a file; `None` for a file that is no conversion.
    ///
    /// # Errors
    /// It is a conversion, but its record does not say whether it was filtered.
    ///
    /// ```
    /// use gait_trace::format::converted::Conversion;
    /// let text = b"# footfall convert 0.1.0\n# source: walk.c3d\n# low-pass: 6 Hz\ntime_s,left_hip_deg\n0,1\n";
    /// let record = Conversion::of_bytes(text)?.unwrap();
    /// assert_eq!((record.source.as_str(), record.low_pass_hz), ("walk.c3d", Some(6.0)));
    /// assert_eq!(Conversion::of_bytes(b"time_s,left_hip_deg\n0,1\n")?, None);
    /// assert!(Conversion::of_bytes(b"# footfall convert 0.1.0\ntime_s,left_hip_deg\n").is_err());
    /// # Ok::<(), String>(())
    /// ```
    pub fn of_bytes(bytes: &[u8]) -> Result<Option<Self>, String> {
        let Some(record) = Record::of_bytes(bytes) else { return Ok(None) };
        let one = |key: &str| record.one(key).unwrap_or_default().to_owned();
        let filter = one("low-pass");
        let low_pass_hz = match filter.strip_suffix(" Hz").map(str::parse) {
            Some(Ok(hz)) => Some(hz),
            None if filter == "off" => None,
            _ => {
                return Err(format!(
                    "the record of the conversion says `low-pass: {filter}`; allowed are `off` and a number of Hz: convert the source again"
                ));
            }
        };
        Ok(Some(Self {
            version: one(Record::VERSION),
            source: one("source"),
            source_sha256: one("source-sha256"),
            options: one("options"),
            low_pass_hz,
            changes: record.all("changed").map(str::to_owned).collect(),
        }))
    }

    /// Keys and values below the mark, in order, each on one line.
    fn pairs(&self, signs: &[Option<SignBasis>; Joint::COUNT]) -> Vec<(&'static str, String)> {
        let low_pass = self.low_pass_hz.map_or("off".into(), |hz| format!("{hz} Hz"));
        let mut pairs = vec![
            ("source", one_line(&self.source)),
            ("source-sha256", one_line(&self.source_sha256)),
            ("options", one_line(&self.options)),
            ("low-pass", low_pass),
            (conversion_record::SIGNS, conversion_record::signs(signs)),
        ];
        pairs.extend(self.changes.iter().map(|change| ("changed", one_line(change))));
        pairs
    }
}

fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Writes the joints with the record. Values that the source does not have stay missing.
///
/// # Errors
/// Those of the writer.
pub fn write_to(out: &mut dyn Write, format: Format, joints: &Conditioned, conversion: &Conversion) -> io::Result<()> {
    let there: Vec<Joint> = Joint::ALL.into_iter().filter(|joint| joints.joint(*joint).is_some()).collect();
    let times = joints.recording.time_s();
    let version = one_line(&conversion.version);
    let (separator, missing) = match format {
        Format::Csv => {
            writeln!(out, "{CSV_MARK}{version}")?;
            conversion.pairs(&joints.signs).iter().try_for_each(|(key, value)| writeln!(out, "# {key}: {value}"))?;
            write!(out, "time_s")?;
            there.iter().try_for_each(|joint| write!(out, ",{}_deg", joint.name()))?;
            (',', "")
        }
        Format::Mot => {
            let (rows, columns) = (times.len(), there.len() + 1);
            writeln!(out, "Coordinates\nversion=1\nnRows={rows}\nnColumns={columns}\ninDegrees=yes")?;
            writeln!(out, "{MOT_MARK}{version}")?;
            conversion.pairs(&joints.signs).iter().try_for_each(|(key, value)| writeln!(out, "{key}={value}"))?;
            write!(out, "endheader\ntime")?;
            there.iter().try_for_each(|joint| write!(out, "\t{}", coordinate(*joint)))?;
            ('\t', "NaN")
        }
    };
    let columns: Vec<&[f64]> = there.iter().filter_map(|joint| joints.joint(*joint)).collect();
    let mut gaps: Vec<_> = there.iter().map(|joint| joints.missing[*joint as usize].iter().peekable()).collect();
    for (row, time) in times.iter().enumerate() {
        write!(out, "\n{time}")?;
        for (values, gaps) in columns.iter().zip(&mut gaps) {
            // Gaps are in order and apart.
            while gaps.next_if(|(_, to)| *to <= row).is_some() {}
            match gaps.peek() {
                Some((from, _)) if *from <= row => write!(out, "{separator}{missing}")?,
                _ => write!(out, "{separator}{}", values[row])?,
            }
        }
    }
    writeln!(out)
}
