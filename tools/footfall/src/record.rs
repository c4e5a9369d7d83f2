//! A run as a file: one row a telemetry line, 100 a second, in the layout of recordings.
//!
//! ```text
//! time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg,      board's time, setpoints
//! measured_deg,verdict,state,                                          sensor, supervisor
//! left_hip_us,right_hip_us,left_knee_us,right_knee_us,                 commanded pulses, 0 is none
//! code,tick,seq,late,missed,limited                                    converter's code (empty: lost on the way), counters
//! sensor2_deg,sensor2_verdict,sensor2_code,...                         further sensors, where the board has them
//! ```
//! Every row is written whole, at once, so that whatever ends the program leaves whole lines. What belongs to the run as a
//! whole is in a file beside it (`out.csv` has `out.csv.json`), first with `"finished": false`, at the end with `true`.

use crate::session::Row;
use gait_trace::whole_file;
use joint_loop::shipped::SENSORS;
use joint_units::Joint;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Version of the layout of both files.
pub const SCHEMA: u32 = 1;

/// A recording under way.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    out: File,
    about: Value,
    rows: u64,
    line: String,
}

impl Recorder {
    /// Begins a recording; `about` says what runs.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn begin(path: &Path, about: Value) -> io::Result<Self> {
        let mut out = File::create(path)?;
        out.write_all(header().as_bytes())?;
        let recorder = Self { path: path.into(), out, about, rows: 0, line: String::new() };
        recorder.write_about(false, &Value::Null)?;
        Ok(recorder)
    }

    /// Writes a row.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn row(&mut self, row: &Row) -> io::Result<()> {
        self.line.clear();
        // Writing to a string cannot fail.
        let _ = write_row(&mut self.line, row);
        self.out.write_all(self.line.as_bytes())?;
        self.rows += 1;
        Ok(())
    }

    /// Ends the recording; `summary` is what the run came to.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn finish(self, summary: &Value) -> io::Result<u64> {
        self.out.sync_all()?;
        self.write_about(true, summary)?;
        Ok(self.rows)
    }

    fn write_about(&self, finished: bool, summary: &Value) -> io::Result<()> {
        let about = json!({
            "schema": SCHEMA,
            "recording": self.path.file_name().map(|name| name.to_string_lossy()),
            "finished": finished,
            "rows": self.rows,
            "footfall": env!("CARGO_PKG_VERSION"),
            "about": self.about,
            "summary": summary,
        });
        whole_file::write(&beside(&self.path), |out| {
            serde_json::to_writer_pretty(&mut *out, &about)?;
            writeln!(out)
        })
    }
}

/// The file beside a recording.
#[must_use]
pub fn beside(recording: &Path) -> PathBuf {
    let mut name = OsString::from(recording);
    name.push(".json");
    name.into()
}

fn header() -> String {
    let of = |suffix: &str| Joint::ALL.map(|joint| format!("{}_{suffix}", joint.name())).join(",");
    let further: String = (0..SENSORS)
        .skip(1)
        .map(|n| n + 1)
        .map(|n| format!(",sensor{n}_deg,sensor{n}_verdict,sensor{n}_code"))
        .collect();
    format!("time_s,{},measured_deg,verdict,state,{},code,tick,seq,late,missed,limited{further}\n", of("deg"), of("us"))
}

fn write_row(out: &mut String, row: &Row) -> std::fmt::Result {
    let tick = &row.tick;
    // Microseconds: the sum of a boot's time and whole milliseconds carries binary dust beyond them.
    write!(out, "{}", (row.time_s * 1e6).round() / 1e6)?;
    for angle in tick.set_deg {
        write!(out, ",{angle}")?;
    }
    write!(out, ",{},{},{}", tick.sensor_deg[0], tick.verdict[0], tick.state.name())?;
    for pulse in tick.pulse_us {
        write!(out, ",{pulse}")?;
    }
    out.push(',');
    let code = |n: usize| row.codes.map_or(String::new(), |codes| codes[n].0.to_string());
    write!(out, "{},{},{},{},{},{}", code(0), tick.tick, tick.seq, tick.late, tick.missed, tick.limited)?;
    for n in (0..SENSORS).skip(1) {
        write!(out, ",{},{},{}", tick.sensor_deg[n], tick.verdict[n], code(n))?;
    }
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::{Line, parse};
    use joint_units::AdcCode;

    fn row() -> Row {
        let line = "tick 20 walking sensor 12.25 deg good set 1.5 -2 30.1 4 deg pulse 1500 1520 0 1944 us late 1 missed 2 \
                    limited 3 seq 18 hash 00000000deadbeef";
        let Ok(Line::Tick(tick)) = parse(line) else { panic!() };
        Row { time_s: 0.1 + 0.02, tick, codes: Some([AdcCode(2048); SENSORS]), equal: Some(true) }
    }

    #[test]
    fn a_recording_is_whole_lines_at_any_time_and_says_when_it_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let about = |key: &str| {
            let text = std::fs::read_to_string(folder.path().join("out.csv.json")).unwrap();
            serde_json::from_str::<Value>(&text).unwrap()[key].clone()
        };
        let mut recorder = Recorder::begin(&path, json!({ "elf_sha256": "ab" })).unwrap();
        assert_eq!(about("finished"), json!(false));
        recorder.row(&row()).unwrap();
        recorder.row(&Row { codes: None, ..row() }).unwrap();
        // Not finished, not closed: what is there is whole.
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [
                "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg,measured_deg,verdict,state,\
                 left_hip_us,right_hip_us,left_knee_us,right_knee_us,code,tick,seq,late,missed,limited",
                "0.12,1.5,-2,30.1,4,12.25,good,walking,1500,1520,0,1944,2048,20,18,1,2,3",
                "0.12,1.5,-2,30.1,4,12.25,good,walking,1500,1520,0,1944,,20,18,1,2,3",
            ]
        );
        assert!(text.ends_with('\n'));
        assert_eq!(recorder.finish(&json!({ "ticks": 20 })).unwrap(), 2);
        assert_eq!(
            (about("finished"), about("rows"), about("about")["elf_sha256"].clone()),
            (json!(true), json!(2), json!("ab"))
        );
        assert_eq!(about("summary")["ticks"], json!(20));
    }
}
