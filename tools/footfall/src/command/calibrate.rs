//! `footfall calibrate`: known angles and what the sensor said there become the calibration that the board takes.
//!
//! | module | what it is for |
//! |---|---|
//! | [`rows`] | a file of known angles and volts or codes |
//! | [`poses`] | rows of the same angle: mean, spread, drift, up and down |
//! | [`monotone`] | the nearest rising sequence |
//! | [`knots`] | which poses become points |
//! | [`fit`](mod@fit) | all of it: the table, or a fault with a name |
//! | [`report`] | what is told of it: text, JSON, a page, a picture |
//! | [`guide`] | the same with live codes, one angle after the other, and the codes on the screen |

pub mod fit;
pub mod guide;
pub mod knots;
mod live;
pub mod monotone;
pub mod poses;
pub mod report;
pub mod rows;

use crate::board::default_loop;
use crate::failure::Failure;
use crate::file::calibration_file;
use crate::file::calibration_file::{Measured, WiredSensor};
use clap::Args;
use fit::{Fit, Settings};
use gait_trace::format::whole_file;
use hgod_adc::{FilterConfig, HealthConfig, Interpolation, MAX_POINTS, ReferenceConfig, SensorConfig, Supply};
use joint_units::{AdcCode, Period, Volts};
use rows::{Reading, Rows, Scale};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use time::OffsetDateTime;

/// Options of `footfall calibrate`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Rows of known angles: CSV with `angle_deg` or `angle_rad`, `volts` or `code`, and perhaps `vrefint` and `direction`
    #[arg(value_name = "ROWS", required_unless_present = "guide", conflicts_with = "guide")]
    pub rows: Option<PathBuf>,
    /// Where to write the calibration
    #[arg(short, long, value_name = "TOML")]
    pub out: PathBuf,
    /// What the sensor is called
    #[arg(long, value_name = "NAME", default_value = "gait sensor", value_parser = calibration_file::name_argument)]
    pub sensor: String,
    /// The day of the measurement [default: today, in UTC]
    #[arg(long, value_name = "YYYY-MM-DD", value_parser = calibration_file::date_argument)]
    pub date: Option<String>,
    /// Between the points
    #[arg(long, value_enum, default_value = "monotone_cubic")]
    pub interpolation: Between,
    /// Most points of the table, 2 to 32
    #[arg(long, value_name = "N", default_value_t = MAX_POINTS as u8, value_parser = clap::value_parser!(u8).range(2..=MAX_POINTS as i64))]
    pub points: u8,
    /// Volts at the sensor for one volt at the pin, 0.05 to 20
    #[arg(long, value_name = "RATIO", default_value_t = 1.0, value_parser = |text: &str| within(text, 0.05..=20.0))]
    pub divider: f64,
    /// Supply of the converter when the codes were taken, 1.8 to 3.6 V
    #[arg(long, value_name = "VOLTS", conflicts_with = "vrefint_cal", value_parser = |text: &str| within(text, 1.8..=3.6))]
    pub supply: Option<f64>,
    /// The factory's reading of the internal reference: the supply is then that of each row's `vrefint`
    #[arg(long, value_name = "CODE")]
    pub vrefint_cal: Option<u16>,
    /// The supply at which the factory read it, 1.8 to 3.6 V
    #[arg(long, value_name = "VOLTS", default_value_t = 3.3, requires = "vrefint_cal", value_parser = |text: &str| within(text, 1.8..=3.6))]
    pub vdda_at_cal: f64,
    /// The column of angles; its name ends in _deg or _rad
    #[arg(long, value_name = "COLUMN")]
    pub angle_column: Option<String>,
    /// The column of volts at the sensor
    #[arg(long, value_name = "COLUMN", conflicts_with = "codes_column")]
    pub volts_column: Option<String>,
    /// The column of 12 bit codes
    #[arg(long, value_name = "COLUMN")]
    pub codes_column: Option<String>,
    /// Rows whose angles differ by less are one pose, 0.05 to 10 degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.05, value_parser = |text: &str| within(text, 0.05..=10.0))]
    pub same_deg: f64,
    /// Largest standard deviation of a visit to a pose, 0.01 to 20 degrees
    #[arg(long, value_name = "DEG", default_value_t = 2.0, value_parser = |text: &str| within(text, 0.01..=20.0))]
    pub most_sd_deg: f64,
    /// An end is saturated where the volts move by less than this share of what they do in the middle, 0 to 0.9
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = |text: &str| within(text, 0.0..=0.9))]
    pub saturated_share: f64,
    /// Write a page with numbers and pictures
    #[arg(long, value_name = "HTML")]
    pub report: Option<PathBuf>,
    /// Write the pictures alone
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,
    /// Ask for one angle after the other and take live codes
    #[arg(long, requires = "codes")]
    pub guide: bool,
    /// With --guide, where the live codes come from: a file, a pipe, or - for standard input; lines of `CODE` or
    /// `CODE VREFINT`, or the board's log
    #[arg(long, value_name = "FILE", requires = "guide")]
    pub codes: Option<PathBuf>,
    /// With --guide, the angles to ask for, in this order
    #[arg(long, value_name = "DEG,...", requires = "guide", value_delimiter = ',', allow_hyphen_values = true, default_values_t = guide::ANGLES_DEG, value_parser = |text: &str| within(text, -60.0..=170.0))]
    pub angles: Vec<f64>,
    /// With --guide, how many samples to take at an angle, 10 to 100000: 2000 are 2 s of the board
    #[arg(long, value_name = "N", requires = "guide", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(10..=100_000))]
    pub samples: u32,
    /// With --guide, the largest standard deviation of an angle's codes, 0.1 to 500; above, the angle is asked for again
    #[arg(long, value_name = "CODES", requires = "guide", default_value_t = 8.0, value_parser = |text: &str| within(text, 0.1..=500.0))]
    pub most_sd_codes: f64,
    /// With --guide, keep the rows here, to calibrate from them again
    #[arg(long, value_name = "CSV", requires = "guide")]
    pub keep_rows: Option<PathBuf>,
}

/// How the angle runs between the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Between {
    /// Straight
    Linear,
    /// By the monotone cubic of Fritsch and Carlson
    MonotoneCubic,
}

fn within(text: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
    let allowed = || format!("allowed is {} to {}", range.start(), range.end());
    text.parse().ok().filter(|number| range.contains(number)).ok_or_else(allowed)
}

impl Options {
    fn settings(&self) -> Settings {
        Settings {
            interpolation: match self.interpolation {
                Between::Linear => Interpolation::Linear,
                Between::MonotoneCubic => Interpolation::MonotoneCubic,
            },
            points: self.points.into(),
            same_deg: self.same_deg,
            most_sd_deg: self.most_sd_deg,
            saturated_share: self.saturated_share,
        }
    }

    fn reading(&self) -> Result<Reading, Failure> {
        let scale = match (self.supply, self.vrefint_cal) {
            (Some(supply), _) => {
                Supply::new(Volts(supply as f32)).map_err(Failure::input)?;
                Scale::Supply(supply)
            }
            (None, Some(cal)) => {
                let vdda_at_cal = Volts(self.vdda_at_cal as f32);
                let min_supply = Volts(1.8);
                let config = ReferenceConfig { vdda_at_cal, min_supply, ..ReferenceConfig::stm32f4(AdcCode(cal)) };
                Scale::Reference(config.build().map_err(|error| Failure::input(format!("--vrefint-cal: {error}")))?)
            }
            (None, None) => Scale::Unknown,
        };
        Ok(Reading {
            scale,
            divider: self.divider,
            angle: self.angle_column.clone(),
            volts: self.volts_column.clone(),
            codes: self.codes_column.clone(),
        })
    }
}

/// A fit with what it was fitted to, ready to be told and written.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// Where the rows came from.
    pub source: String,
    /// The fit.
    pub fit: Fit,
    /// The table as it is wired.
    pub sensor: WiredSensor,
    /// How it was measured.
    pub measured: Measured,
    /// The most of a standard deviation that was allowed, and other remarks.
    pub notes: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let reading = options.reading()?;
    let (source, rows) = match &options.rows {
        Some(path) => (path.display().to_string(), rows::read(path, &reading).map_err(Failure::input)?),
        None => (guide::name(options), guide::rows(options, &reading)?),
    };
    let calibrated = calibrate(&source, &rows, options)?;
    // All that can go wrong with the content goes wrong before the first file is written.
    let toml = calibration_file::to_measured_text(&calibrated.sensor, &calibrated.measured);
    let svg = if options.svg.is_some() { Some(report::svg(&calibrated).map_err(Failure::run)?) } else { None };
    let html = if options.report.is_some() { Some(report::html(&calibrated).map_err(Failure::run)?) } else { None };
    write(&options.out, &toml)?;
    for (path, content) in [(&options.svg, svg), (&options.report, html)] {
        if let (Some(path), Some(content)) = (path, content) {
            write(path, &content)?;
        }
    }
    crate::cli::print(&if options.json {
        format!("{}\n", report::json(&calibrated))
    } else {
        report::text(&calibrated)
    })?;
    for note in &calibrated.notes {
        eprintln!("note: {note}");
    }
    Ok(())
}

/// Fits the rows.
///
/// # Errors
/// What is wrong with them, with `source` as the name of the file.
pub fn calibrate(source: &str, rows: &Rows, options: &Options) -> Result<Calibrated, Failure> {
    let fit = fit::fit(rows, &options.settings()).map_err(|fault| {
        let place = fault.line.map_or(String::new(), |line| format!(":{line}"));
        Failure::input(format!("{source}{place}: column `{}`: {}", rows.signal, fault.what))
    })?;
    let sensor = WiredSensor { calibration: fit.calibration.clone(), divider: options.divider as f32 };
    let rounded = |degrees: f64| ((degrees * 1e4).round() / 1e4) as f32;
    let measured = Measured {
        sensor: options.sensor.clone(),
        // The day is written as ISO 8601 has it.
        date: options.date.clone().unwrap_or_else(|| OffsetDateTime::now_utc().date().to_string()),
        rms_deg: rounded(fit.rms_deg),
        worst_deg: rounded(fit.worst_deg.0),
        hysteresis: fit.hysteresis,
    };
    let mut notes = rows.notes.clone();
    notes.extend(remarks(&fit, &sensor));
    Ok(Calibrated { source: source.into(), fit, sensor, measured, notes })
}

/// What a person should know beside the numbers.
fn remarks(fit: &Fit, sensor: &WiredSensor) -> Vec<String> {
    let mut notes = Vec::new();
    for why in [fit::LeftOut::Clipped, fit::LeftOut::Saturated, fit::LeftOut::NearTheEnd] {
        let there = fit.poses.iter().zip(&fit.left_out).filter(|(_, left_out)| **left_out == Some(why));
        let angles: Vec<String> = there.map(|(pose, _)| report::short(pose.angle_deg)).collect();
        if !angles.is_empty() {
            let (angles, words) = (angles.join(", "), why.words());
            notes.push(format!(
                "{words}: {angles} degrees: not in the table, so that a reading there is out of the table"
            ));
        }
    }
    if fit.inside > 0 {
        let inside = fit.inside;
        notes.push(format!("{inside} rows of poses that are not in the table read as an angle of it all the same"));
    }
    if fit.pooled > 0 {
        notes.push(format!("{} poses were joined where noise had turned their order round", fit.pooled));
    }
    if fit.hysteresis.is_none() {
        notes.push("hysteresis is not known: sweep up and down".into());
    }
    if fit.noise_v.is_none() {
        notes.push("the spread is not known: take several rows at each angle".into());
    }
    let reference = ReferenceConfig {
        divider: sensor.divider,
        min_supply: default_loop::TYPICAL_MIN_SUPPLY,
        ..ReferenceConfig::stm32f4(default_loop::TYPICAL_VREFINT_CAL)
    };
    let (filter, health) = (FilterConfig::default(), HealthConfig::default());
    if let Err(error) =
        (SensorConfig { reference, calibration: sensor.calibration.clone(), filter, health }).build(Period::MILLISECOND)
    {
        notes.push(format!(
            "the default board, at {} V and above, would refuse it: {error}",
            default_loop::TYPICAL_MIN_SUPPLY.0
        ));
    }
    notes
}

fn write(path: &Path, content: &str) -> Result<(), Failure> {
    whole_file::write(path, |out| out.write_all(content.as_bytes()))
        .map_err(|error| Failure::run(format!("{}: cannot be written: {error}", path.display())))
}
