//! `footfall gait-error`: prints the difference between each generator and the mean stride of a healthy adult.
//!
//! The stride is the mean of the two whole strides of the default recording. Each generator runs onto its limit cycle and is then read out
//! over ten strides; see [`generator_file::gait_error`].

use clap::Args;
use cpg_core::gait::catalogue::{STRIDE_S, Visitor, each};
use cpg_core::joints::features::Features;
use cpg_core::{BuildError, Generator};
use generator_file::gait_error::{GaitError, Readout, as_built, readout};
use joint_units::{Joint, Period, Radians};
use std::fmt::Write as _;

use crate::board::feed;
use crate::failure::Failure;

/// Options of `footfall gait-error`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
}

/// Points of the stride.
const POINTS: usize = 200;

/// Strides for settling.
const SETTLE_STRIDES: u32 = 60;

/// Strides that are read out.
const STRIDES: usize = 10;

/// The result of one generator.
struct Row {
    name: &'static str,
    /// Weights and the offset.
    weights: usize,
    readout: Readout,
    as_built: GaitError,
}

/// Runs the command.
///
/// # Errors
/// A generator cannot be built.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut rows = Rows { wanted: mean_stride()?, rows: vec![], error: None };
    each(Period::MILLISECOND, &mut rows);
    if let Some(error) = rows.error {
        return Err(Failure::run(error));
    }
    let text = if options.json { object(&rows.rows) + "\n" } else { table(&rows.rows) };
    crate::output::print(&text)
}

/// The mean stride of the recording, degrees, by joint.
fn mean_stride() -> Result<[Vec<f64>; 4], Failure> {
    let (_, recording) = feed::default_trace().map_err(Failure::run)?;
    let looped = recording.looped(feed::RATE_HZ).map_err(Failure::run)?;
    let stride_s = looped.recording.duration_s() / looped.strides as f64;
    let mut wanted: [Vec<f64>; 4] = Default::default();
    for (joint, points) in Joint::ALL.into_iter().zip(&mut wanted) {
        let channel = looped.recording.channel(joint.name()).map_err(Failure::run)?;
        *points = (0..POINTS)
            .map(|k| {
                let of = |stride: usize| (stride as f64 + k as f64 / POINTS as f64) * stride_s;
                let sum: f64 = (0..looped.strides).map(|stride| looped.recording.at(channel, of(stride))).sum();
                sum / looped.strides as f64
            })
            .collect();
    }
    Ok(wanted)
}

struct Rows {
    wanted: [Vec<f64>; 4],
    rows: Vec<Row>,
    error: Option<String>,
}

impl Visitor for Rows {
    fn generator<G: Generator<4> + Features + Clone>(&mut self, name: &'static str, built: Result<G, BuildError>) {
        match built {
            Ok(generator) => self.rows.push(row(name, generator, &self.wanted)),
            Err(why) => self.error = Some(format!("{name}: {why}")),
        }
    }
}

fn row<G: Generator<4> + Features>(name: &'static str, mut generator: G, wanted: &[Vec<f64>; 4]) -> Row {
    let stride_ticks = f64::from(STRIDE_S) * 1e3;
    for _ in 0..(f64::from(SETTLE_STRIDES) * stride_ticks) as u32 {
        generator.step();
    }
    // The ticks before and after each point: linear interpolation between them is accurate to 1e-5 of an amplitude.
    let mut features = vec![vec![]; G::COUNT];
    let mut angles: [Vec<f64>; 4] = Default::default();
    let sample = |generator: &G| {
        let mut now = vec![0.0f32; G::COUNT];
        generator.features(&mut now);
        let angles = generator.angles().map(Radians::degrees);
        now.into_iter().chain(angles).map(f64::from).collect::<Vec<f64>>()
    };
    let (mut tick, mut before, mut after) = (0.0, sample(&generator), sample(&generator));
    for k in 0..STRIDES * POINTS {
        let at = k as f64 / POINTS as f64 * stride_ticks;
        while tick <= at {
            before = after;
            generator.step();
            after = sample(&generator);
            tick += 1.0;
        }
        let part = at - (tick - 1.0);
        let between = before.iter().zip(&after).map(|(a, b)| a + part * (b - a));
        for (value, points) in between.zip(features.iter_mut().chain(&mut angles)) {
            points.push(value);
        }
    }
    Row { name, weights: G::COUNT + 1, readout: readout(&features, wanted), as_built: as_built(&angles, wanted) }
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "                    best read-out: hip, knee   1 % noise   weights   as built: hip, knee (deg)\n",
    );
    for row in rows {
        let Row { name, weights, readout, as_built } = row;
        let GaitError { hip_deg, knee_deg } = readout.error;
        let noise_deg = readout.noise_deg;
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{name:<22} {hip_deg:>14.2} {knee_deg:>6.2} {noise_deg:>11.2} {weights:>9} {:>15.2} {:>6.2}",
            as_built.hip_deg, as_built.knee_deg
        );
    }
    text
}

fn object(rows: &[Row]) -> String {
    let row = |row: &Row| {
        serde_json::json!({
            "name": row.name,
            "weights": row.weights,
            "hip_deg": row.readout.error.hip_deg,
            "knee_deg": row.readout.error.knee_deg,
            "noise_deg": row.readout.noise_deg,
            "as_built_hip_deg": row.as_built.hip_deg,
            "as_built_knee_deg": row.as_built.knee_deg,
        })
    };
    serde_json::json!({ "generators": rows.iter().map(row).collect::<Vec<_>>() }).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error equals the residual of a Fourier series of six harmonics, computed here by projection.
    #[test]
    fn the_fourier_shape_reaches_the_floor_of_six_harmonics() {
        let wanted = mean_stride().unwrap();
        let fourier = cpg_core::gait::catalogue::fourier(Period::MILLISECOND).unwrap();
        let got = row("fourier", fourier, &wanted);
        let left = |joint: &[f64]| {
            let n = joint.len() as f64;
            let mut left = joint.to_vec();
            for order in 0..=6 {
                for quarter in [0.0, 0.25] {
                    let wave = |k: usize| (std::f64::consts::TAU * (f64::from(order) * k as f64 / n + quarter)).cos();
                    let size: f64 = (0..joint.len()).map(|k| wave(k) * wave(k)).sum();
                    let part: f64 = joint.iter().enumerate().map(|(k, a)| a * wave(k)).sum::<f64>() / size.max(1e-9);
                    for (k, a) in left.iter_mut().enumerate() {
                        *a -= part * wave(k);
                    }
                }
            }
            left.iter().map(|a| a * a).sum::<f64>() / n
        };
        let hip = (0.5 * (left(&wanted[0]) + left(&wanted[1]))).sqrt();
        let knee = (0.5 * (left(&wanted[2]) + left(&wanted[3]))).sqrt();
        assert!((got.readout.error.hip_deg - hip).abs() < 0.01, "{} {hip}", got.readout.error.hip_deg);
        assert!((got.readout.error.knee_deg - knee).abs() < 0.01, "{} {knee}", got.readout.error.knee_deg);
        assert!(hip < 0.5 && knee < 1.0, "{hip} {knee}");
    }

    /// The best read-out is never worse than the one that was built.
    #[test]
    fn no_read_out_is_worse_than_the_built_in_one() {
        let mut rows = Rows { wanted: mean_stride().unwrap(), rows: vec![], error: None };
        each(Period::MILLISECOND, &mut rows);
        assert_eq!(rows.error, None);
        assert!(rows.rows.len() >= 13);
        for row in rows.rows {
            let all = |error: GaitError| error.hip_deg.powi(2) + error.knee_deg.powi(2);
            assert!(all(row.readout.error) <= all(row.as_built) + 0.05, "{}", row.name);
        }
    }
}
