//! Writes recordings of any size: the same walk, in each format as its programs write it.

use anyhow::{Context, Result};
use clap::ValueEnum as _;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

#[allow(dead_code, reason = "the tests of the reader use the other number formats")]
#[path = "../../gait-trace/tests/support/c3d_writer.rs"]
mod c3d_writer;

use c3d_writer::{C3d, Format as Numbers};

/// A format of the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Format {
    Csv,
    OpenSim,
    C3d,
    Trc,
    Mcap,
    Scope,
}

impl Format {
    pub(crate) const ALL: [Self; 6] = [Self::Csv, Self::OpenSim, Self::C3d, Self::Trc, Self::Mcap, Self::Scope];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Csv => "CSV, 5 columns",
            Self::OpenSim => "OpenSim .mot, 13 columns",
            Self::C3d => "C3D, 40 points",
            Self::Trc => "TRC, 12 markers",
            Self::Mcap => "MCAP, JointState",
            Self::Scope => "oscilloscope CSV, 2 columns",
        }
    }

    /// The word for it in a command line.
    pub(crate) fn argument(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    pub(crate) const fn extension(self) -> &'static str {
        match self {
            Self::Csv | Self::Scope => "csv",
            Self::OpenSim => "mot",
            Self::C3d => "c3d",
            Self::Trc => "trc",
            Self::Mcap => "mcap",
        }
    }

    /// Bytes of a row, to know how many fit into a file.
    const fn row_bytes(self) -> u64 {
        match self {
            Self::Csv => 41,
            Self::OpenSim => 149,
            Self::C3d => 640,
            Self::Trc => 385,
            Self::Mcap => 190,
            Self::Scope => 23,
        }
    }

    /// Writes a file of about `bytes` bytes.
    pub(crate) fn write(self, path: &Path, bytes: u64) -> Result<()> {
        let rows = (bytes / self.row_bytes()).max(1000) as usize;
        let file = File::create(path).with_context(|| format!("writing {}", path.display()))?;
        let mut out = BufWriter::with_capacity(1 << 20, file);
        let written = match self {
            Self::Csv => csv(&mut out, rows, 1000.0),
            Self::OpenSim => open_sim(&mut out, rows),
            Self::C3d => out.write_all(&c3d(rows)),
            Self::Trc => trc(&mut out, rows),
            Self::Mcap => return mcap(out, rows),
            Self::Scope => scope(&mut out, rows),
        };
        written.and_then(|()| out.flush()).with_context(|| format!("writing {}", path.display()))
    }
}

/// A stride, seconds.
const STRIDE_S: f64 = 1.1;

/// Angles of the four joints at a time, degrees; `leaves` makes each stride and each person a little different.
pub(crate) fn joints(time_s: f64, person: usize) -> [f64; 4] {
    let slow = 1.0 + 0.02 * (0.37 * time_s + person as f64).sin();
    let size = 1.0 + 0.1 * (1.7 * person as f64).sin();
    let hip = |lead: f64| {
        let p = TAU * (time_s / STRIDE_S + lead);
        8.0 + size * slow * (21.0 * p.cos() - 4.0 * (2.0 * p).cos())
    };
    let knee = |lead: f64| {
        let p = TAU * (time_s / STRIDE_S + lead) + 1.5;
        24.0 + size * slow * (20.0 * p.cos() + 15.0 * (2.0 * p).cos())
    };
    [hip(0.0), hip(0.5), knee(0.0), knee(0.5)]
}

/// The project's CSV, `rate_hz` rows a second.
pub(crate) fn csv_of(out: &mut impl Write, rows: usize, rate_hz: f64, person: usize) -> std::io::Result<()> {
    writeln!(out, "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg")?;
    for row in 0..rows {
        let time = row as f64 / rate_hz;
        let [a, b, c, d] = joints(time, person);
        writeln!(out, "{time:.4},{a:.4},{b:.4},{c:.4},{d:.4}")?;
    }
    Ok(())
}

fn csv(out: &mut impl Write, rows: usize, rate_hz: f64) -> std::io::Result<()> {
    csv_of(out, rows, rate_hz, 0)
}

fn open_sim(out: &mut impl Write, rows: usize) -> std::io::Result<()> {
    let names = "time\tpelvis_tilt\tpelvis_list\tpelvis_rotation\tpelvis_tx\tpelvis_ty\tpelvis_tz\thip_flexion_l\thip_flexion_r\t\
                 knee_angle_l\tknee_angle_r\tankle_angle_l\tankle_angle_r";
    writeln!(out, "Coordinates\nversion=1\nnRows={rows}\nnColumns=13\ninDegrees=yes\nendheader\n{names}")?;
    for row in 0..rows {
        let time = row as f64 / 1000.0;
        let [a, b, c, d] = joints(time, 0);
        let sway = 0.1 * (TAU * time).sin();
        write!(
            out,
            "{time:.8}\t{sway:.8}\t{:.8}\t{:.8}\t{time:.8}\t{:.8}\t{sway:.8}",
            2.0 * sway,
            3.0 * sway,
            0.9 + sway
        )?;
        writeln!(out, "\t{a:.8}\t{b:.8}\t{:.8}\t{:.8}\t{:.8}\t{:.8}", -c, -d, 0.2 * c, 0.2 * d)?;
    }
    Ok(())
}

/// Angles as Plug-in Gait names them, and 36 other points: at 1 kHz, because a long file is then still one of many frames.
fn c3d(rows: usize) -> Vec<u8> {
    let names = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];
    let joint = |(joint, name): (usize, &str)| {
        let places = (0..rows).map(|row| Some([joints(row as f64 / 1000.0, 0)[joint] as f32, 0.5, 0.25])).collect();
        (name.to_owned(), places)
    };
    let other = |n: usize| (format!("P{n}"), (0..rows).map(|row| Some([row as f32, n as f32, 1.0])).collect());
    let points = names.into_iter().enumerate().map(joint).chain((0..36).map(other)).collect();
    let mut file = C3d::new(Numbers::Intel, None, 1000.0, points);
    file.texts.push(("POINT", "ANGLE_UNITS", "deg"));
    file.bytes()
}

/// Markers of hips, knees and ankles, and six others, of a person who walks along x.
fn trc(out: &mut impl Write, rows: usize) -> std::io::Result<()> {
    let names = ["LHJC", "RHJC", "LKJC", "RKJC", "LAJC", "RAJC", "M1", "M2", "M3", "M4", "M5", "M6"];
    writeln!(out, "PathFileType\t4\t(X/Y/Z)\twalk.trc")?;
    writeln!(
        out,
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
    )?;
    writeln!(out, "1000\t1000\t{rows}\t{}\tmm\t1000\t1\t{rows}", names.len())?;
    writeln!(out, "Frame#\tTime\t{}", names.join("\t\t\t"))?;
    let components: Vec<String> = (1..=names.len()).map(|n| format!("X{n}\tY{n}\tZ{n}")).collect();
    writeln!(out, "\t\t{}", components.join("\t"))?;
    for row in 0..rows {
        let time = row as f64 / 1000.0;
        let angles = joints(time, 0).map(f64::to_radians);
        let at = 1200.0 * time;
        write!(out, "{}\t{time:.5}", row + 1)?;
        let side = |side: usize| {
            let hip = [at, 900.0, if side == 0 { -90.0 } else { 90.0 }];
            let (thigh, shank) = (angles[side], angles[side] - angles[side + 2]);
            let knee = [hip[0] + 420.0 * thigh.sin(), hip[1] - 420.0 * thigh.cos(), hip[2]];
            let ankle = [knee[0] + 410.0 * shank.sin(), knee[1] - 410.0 * shank.cos(), hip[2]];
            [hip, knee, ankle]
        };
        let (left, right) = (side(0), side(1));
        for place in 0..3 {
            for [x, y, z] in [left[place], right[place]] {
                write!(out, "\t{x:.5}\t{y:.5}\t{z:.5}")?;
            }
        }
        for n in 0..6 {
            write!(out, "\t{:.5}\t{:.5}\t{:.5}", at + f64::from(n), 1200.0, 10.0)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Joint states of ROS 2, in chunks without compression.
fn mcap(out: BufWriter<File>, rows: usize) -> Result<()> {
    const DEFINITION: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
        ================================================================================\nMSG: std_msgs/Header\n\
        builtin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\nMSG: builtin_interfaces/Time\n\
        int32 sec\nuint32 nanosec\n";
    let mut writer: Writer<_> = WriteOptions::new().compression(None).create(out)?;
    let schema = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", DEFINITION.as_bytes())?;
    let channel_id = writer.add_channel(schema, "/joint_states", "cdr", &BTreeMap::new())?;
    for row in 0..rows {
        let time_ns = row as u64 * 1_000_000;
        let header = MessageHeader { channel_id, sequence: row as u32, log_time: time_ns, publish_time: time_ns };
        writer
            .write_to_known_channel(&header, &message(time_ns, joints(row as f64 / 1000.0, 0).map(f64::to_radians)))?;
    }
    writer.finish()?;
    Ok(())
}

/// A message in CDR, little endian: numbers are aligned to their size behind the first four bytes.
fn message(time_ns: u64, positions: [f64; 4]) -> Vec<u8> {
    let mut out: Vec<u8> = Vec::with_capacity(192);
    let word = |out: &mut Vec<u8>, value: u32| {
        out.resize(out.len().next_multiple_of(4), 0);
        out.extend(value.to_le_bytes());
    };
    let text = |out: &mut Vec<u8>, text: &str| {
        word(out, text.len() as u32 + 1);
        out.extend(text.bytes().chain([0]));
    };
    word(&mut out, (time_ns / 1_000_000_000) as u32);
    word(&mut out, (time_ns % 1_000_000_000) as u32);
    text(&mut out, "base_link");
    word(&mut out, 4);
    ["left_hip", "right_hip", "left_knee", "right_knee"].iter().for_each(|name| text(&mut out, name));
    word(&mut out, 4);
    for position in positions {
        out.resize(out.len().next_multiple_of(8), 0);
        out.extend(position.to_le_bytes());
    }
    // No velocities and no efforts.
    word(&mut out, 0);
    word(&mut out, 0);
    [vec![0, 1, 0, 0], out].concat()
}

/// The volts of a goniometer on the left knee as a Tektronix oscilloscope writes them, 100,000 rows a second.
fn scope(out: &mut impl Write, rows: usize) -> std::io::Result<()> {
    writeln!(
        out,
        "Model,MDO3024\nFirmware Version,1.26\n\nHorizontal Units,s\nSample Interval,0.00001\nRecord Length,{rows}\n\
         Vertical Units,V\n,\nLabel,\nTIME,CH1"
    )?;
    for row in 0..rows {
        let time = row as f64 * 1e-5;
        // A hundred rows have the same volts: an oscilloscope samples faster than a knee moves.
        let volts = 0.5 + joints((row / 100) as f64 * 1e-3, 0)[2] / 50.0;
        writeln!(out, "{:012.7},{volts:.7}", time)?;
    }
    Ok(())
}
