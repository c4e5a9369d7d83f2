//! A capture as CSV: one row a sample.
//!
//! ```text
//! time_s,boot,tick,                                                    board's own clock: seconds, boots, ticks of this boot
//! vrefint,                                                             code of the internal reference
//! left_knee_deg,left_knee_validity,left_knee_code,left_knee_volts,     each sensor: angle (empty unless good), measured code
//! state,set_left_hip_deg,...,left_hip_us,...,known,                    loop: setpoints, pulses (0 is none), their source
//! seq,elapsed,flags,request,watchdog_hz,late,missed,limited,lost       counters; request: of a host; watchdog_hz: a new measurement of the
//!                                                                      watchdog's clock; lost: all samples lost before this row
//! ```
//! A sensor's columns have the name of its joint, as those of recordings do. A program that is killed while it writes can leave half a
//! row at the end, which [`gait_trace::format::mapped_csv`] leaves out, with a note.

use super::samples::Sample;
use crate::output;
use hgod_adc::Validity;
use joint_units::Joint;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

#[derive(Debug)]
pub(crate) struct Rows {
    out: File,
    lines: String,
    /// Sensors that have columns.
    columns: usize,
}

impl Rows {
    pub(crate) fn begin(path: &Path, joints: &[Joint]) -> io::Result<Self> {
        let mut out = output::begin(path)?;
        out.write_all(header(joints).as_bytes())?;
        Ok(Self { out, lines: String::new(), columns: joints.len() })
    }

    pub(crate) fn write(&mut self, samples: &[Sample]) -> io::Result<()> {
        self.lines.clear();
        for sample in samples {
            // Writing to a string cannot fail.
            let _ = row(&mut self.lines, sample, self.columns);
        }
        self.out.write_all(self.lines.as_bytes())
    }

    pub(crate) fn finish(&mut self) -> io::Result<()> {
        // A pipe has nothing to flush to disk.
        if self.out.metadata()?.is_file() { self.out.sync_all() } else { Ok(()) }
    }
}

fn header(joints: &[Joint]) -> String {
    let of =
        |prefix: &str, suffix: &str| Joint::ALL.map(|joint| format!("{prefix}{}_{suffix}", joint.name())).join(",");
    let sensor = |joint: &Joint| ["deg", "validity", "code", "volts"].map(|what| format!("{}_{what}", joint.name()));
    let sensors: Vec<String> = joints.iter().flat_map(sensor).collect();
    format!(
        "time_s,boot,tick,vrefint,{},state,{},{},known,seq,elapsed,flags,request,watchdog_hz,late,missed,limited,lost\n",
        sensors.join(","),
        of("set_", "deg"),
        of("", "us")
    )
}

fn row(out: &mut String, sample: &Sample, columns: usize) -> std::fmt::Result {
    let Sample { call, readings, output, .. } = sample;
    let request = call.request.map_or_else(String::new, |request| request.to_string());
    let watchdog_hz = call.watchdog_hz.map_or_else(String::new, |hz| hz.to_string());
    write!(out, "{},{},{},", seconds(sample.time_ns), sample.boot, sample.tick)?;
    write!(out, "{},", call.reference)?;
    for (reading, code) in readings.iter().zip(call.sample().codes).take(columns) {
        if let Some(reading) = reading.filter(|reading| reading.validity == Validity::Good) {
            write!(out, "{}", reading.angle.degrees())?;
        }
        match reading {
            Some(reading) => write!(out, ",{},{},{},", reading.validity, code.0, reading.volts.0)?,
            None => write!(out, ",,{},,", code.0)?,
        }
    }
    match output {
        Some(tick) => {
            out.push_str(tick.state.name());
            for angle in tick.setpoints_deg() {
                write!(out, ",{angle}")?;
            }
            for pulse in tick.pulses_us {
                write!(out, ",{pulse}")?;
            }
            write!(out, ",{},{},{},{}", sample.known.name(), tick.seq, call.elapsed, call.flags.bits())?;
            write!(out, ",{request},{watchdog_hz},{},{},{}", tick.late, tick.missed, tick.limited)?;
        }
        None => write!(out, ",,,,,,,,,,,{},{},{request},{watchdog_hz},,,", call.elapsed, call.flags.bits())?,
    }
    writeln!(out, ",{}", sample.lost)
}

/// Whole nanoseconds as seconds, exactly, without zeros at the end.
pub(crate) fn seconds(ns: u64) -> String {
    let text = format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000);
    text.trim_end_matches('0').trim_end_matches('.').into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact() {
        let texts = [0, 1_000_000, 120_000_000, 1_000_000_000, 20_000_000_000, 4_294_967_295_000_000_001].map(seconds);
        assert_eq!(texts, ["0", "0.001", "0.12", "1", "20", "4294967295.000000001"]);
    }
}
