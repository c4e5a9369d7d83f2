//! `footfall calibrate`: makes the calibration of a sensor from known angles and the sensor's readings there.
//!
//! | module | what it does |
//! |---|---|
//! | [`rows`] | reads a file of known angles and volts or codes |
//! | [`poses`] | collects rows of the same angle: mean, spread, drift, up and down |
//! | [`monotone`] | finds the nearest rising sequence |
//! | [`knots`] | selects the poses that become points |
//! | [`fit`](mod@fit) | makes the table from rows, or reports the fault |
//! | [`result`] | the table with its origin and notes |
//! | [`report`] | writes the result as text, JSON, a page and a picture |
//! | [`guide`] | takes rows from live codes, one angle after the other |
//! | `samples` | live codes and their statistics |

pub mod fit;
pub mod guide;
pub mod knots;
mod live;
pub mod monotone;
pub mod pictures;
pub mod poses;
pub mod report;
pub mod result;
pub mod rows;
mod samples;

use clap::Args;
use gait_trace::Level;
use hgod_adc::{Interpolation, MAX_POINTS, ReferenceConfig, Supply};
use joint_units::{AdcCode, Volts};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::file::calibration_file;
use crate::messages;
use crate::options::at::At;
use crate::options::overwrite::Overwrite;
use crate::options::value::number;
use crate::output;
use fit::Settings;
use guide::CodeSource;
use result::{Calibrated, Identity, calibrate};
use rows::{Reading, Scale};

/// Options of `footfall calibrate`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Rows of known angles: CSV with `angle_deg` or `angle_rad`, `volts` or `code`, and perhaps `vrefint` and `direction`
    #[arg(value_name = "ROWS", required_unless_present = "guide", conflicts_with_all = ["guide", "codes", "serial", "rtt", "angles", "samples", "most_sd_codes", "keep_rows"])]
    pub rows: Option<PathBuf>,
    /// The sensor file to write
    #[arg(short, long, value_name = "TOML")]
    pub out: PathBuf,
    /// Name of the sensor
    #[arg(long, value_name = "NAME", default_value = "gait sensor", value_parser = calibration_file::name_argument)]
    pub name: String,
    /// The day of the measurement [default: today, in UTC]
    #[arg(long, value_name = "YYYY-MM-DD", value_parser = calibration_file::date_argument)]
    pub date: Option<String>,
    /// Interpolation between the points
    #[arg(long, value_enum, default_value = "monotone_cubic")]
    pub interpolation: Between,
    /// Largest number of points in the table, 2 to 32
    #[arg(long, value_name = "N", default_value_t = MAX_POINTS as u8, value_parser = clap::value_parser!(u8).range(2..=MAX_POINTS as i64))]
    pub points: u8,
    /// Volts at the sensor for one volt at the pin, 0.05 to 20
    #[arg(long, value_name = "RATIO", default_value_t = 1.0, value_parser = number(0.05..=20.0, ""))]
    pub divider: f64,
    /// Supply of the converter when the codes were taken, 1.8 to 3.6 V
    #[arg(long, value_name = "VOLTS", conflicts_with = "vrefint_cal", value_parser = number(1.8..=3.6, ""))]
    pub supply: Option<f64>,
    /// The factory code of the internal reference: the supply is then computed from each row's `vrefint`
    #[arg(long, value_name = "CODE")]
    pub vrefint_cal: Option<u16>,
    /// The supply at the factory's measurement, 1.8 to 3.6 V
    #[arg(long, value_name = "VOLTS", default_value_t = 3.3, requires = "vrefint_cal", value_parser = number(1.8..=3.6, ""))]
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
    #[arg(long, value_name = "DEG", default_value_t = 0.05, value_parser = number(0.05..=10.0, ""))]
    pub same_deg: f64,
    /// Largest standard deviation of a visit to a pose, 0.01 to 20 degrees
    #[arg(long, value_name = "DEG", default_value_t = 2.0, value_parser = number(0.01..=20.0, ""))]
    pub most_sd_deg: f64,
    /// An end is saturated where the volts change by less than this share of their change in the middle, 0 to 0.9
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = number(0.0..=0.9, ""))]
    pub saturated_share: f64,
    /// Write a page with numbers and pictures
    #[arg(long, value_name = "HTML")]
    pub report: Option<PathBuf>,
    /// Write the pictures only
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,
    /// Ask for one angle after the other and take live codes
    #[arg(long)]
    pub guide: bool,
    /// With --guide, where the live codes come from, in lines of `CODE` or `CODE VREFINT`: a file, a pipe, or - for standard input
    #[arg(long, value_name = "FILE", requires = "guide")]
    pub codes: Option<PathBuf>,
    /// With --guide, a board whose first sensor's codes are taken
    #[command(flatten)]
    pub at: At,
    /// With --guide, the angles to ask for, in this order
    #[arg(long, value_name = "DEG,...", requires = "guide", value_delimiter = ',', allow_hyphen_values = true, default_values_t = guide::ANGLES_DEG, value_parser = number(-60.0..=170.0, ""))]
    pub angles: Vec<f64>,
    /// With --guide, how many samples to take at an angle, 10 to 100000: 2000 are 2 s of the board
    #[arg(long, value_name = "N", requires = "guide", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(10..=100_000))]
    pub samples: u32,
    /// With --guide, the largest standard deviation of an angle's codes, 0.1 to 500; above it the angle is asked for again
    #[arg(long, value_name = "CODES", requires = "guide", default_value_t = 8.0, value_parser = number(0.1..=500.0, ""))]
    pub most_sd_codes: f64,
    /// With --guide, keep the rows in this file, to calibrate from them again
    #[arg(long, value_name = "CSV", requires = "guide")]
    pub keep_rows: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Interpolation between the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Between {
    /// Straight
    Linear,
    /// By the monotone cubic of Fritsch and Carlson
    MonotoneCubic,
}

/// The settings that the options stand for.
struct Plan {
    rows: Source,
    reading: Reading,
    fit: Settings,
    identity: Identity,
    outputs: Outputs,
}

/// Source of the rows.
enum Source {
    File(PathBuf),
    Guide(guide::Settings),
}

/// The files to write.
struct Outputs {
    toml: PathBuf,
    report: Option<PathBuf>,
    svg: Option<PathBuf>,
    json: bool,
    overwrite: Overwrite,
}

impl Options {
    fn plan(self) -> Result<Plan, Failure> {
        let reading = Reading {
            scale: self.scale()?,
            divider: self.divider,
            angle: self.angle_column,
            volts: self.volts_column,
            codes: self.codes_column,
        };
        let codes = self.codes.map(CodeSource::Lines).or(self.at.given().map(CodeSource::Board));
        let rows = match (self.rows, codes) {
            (Some(path), _) => Source::File(path),
            (None, Some(codes)) => Source::Guide(guide::Settings {
                codes,
                keep_rows: self.keep_rows,
                overwrite: self.overwrite,
                plan: guide::Plan {
                    angles_deg: self.angles,
                    samples: self.samples as usize,
                    most_sd: self.most_sd_codes,
                },
            }),
            (None, None) => {
                return Err(Failure::input("no live codes; allowed are --codes FILE, --serial PORT and --rtt SOURCE"));
            }
        };
        let interpolation = match self.interpolation {
            Between::Linear => Interpolation::Linear,
            Between::MonotoneCubic => Interpolation::MonotoneCubic,
        };
        Ok(Plan {
            rows,
            reading,
            fit: Settings {
                interpolation,
                points: self.points.into(),
                same_deg: self.same_deg,
                most_sd_deg: self.most_sd_deg,
                saturated_share: self.saturated_share,
            },
            identity: Identity { sensor: self.name, date: self.date, divider: self.divider },
            outputs: Outputs {
                toml: self.out,
                report: self.report,
                svg: self.svg,
                json: self.json,
                overwrite: self.overwrite,
            },
        })
    }

    /// Conversion of codes to volts.
    fn scale(&self) -> Result<Scale, Failure> {
        match (self.supply, self.vrefint_cal) {
            (Some(supply), _) => {
                Supply::new(Volts(supply as f32)).map_err(Failure::input)?;
                Ok(Scale::Supply(supply))
            }
            (None, Some(cal)) => {
                let vdda_at_cal = Volts(self.vdda_at_cal as f32);
                let min_supply = Volts(1.8);
                let config = ReferenceConfig { vdda_at_cal, min_supply, ..ReferenceConfig::stm32f4(AdcCode(cal)) };
                let built = config.build();
                built.map(Scale::Reference).map_err(|error| Failure::input(format!("--vrefint-cal: {error}")))
            }
            (None, None) => Ok(Scale::Unknown),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: Options) -> Result<(), Failure> {
    let Plan { rows, reading, fit, identity, outputs } = options.plan()?;
    outputs.check(&rows)?;
    let (source, rows) = match rows {
        Source::File(path) => (path.display().to_string(), rows::read(&path, &reading).map_err(Failure::input)?),
        Source::Guide(settings) => (settings.name(), guide::rows(&settings, &reading)?),
    };
    let calibrated = calibrate(&source, &rows, &fit, identity)?;
    write(&calibrated, &outputs)?;
    output::print(&if outputs.json { format!("{}\n", report::json(&calibrated)) } else { report::text(&calibrated) })?;
    output::notes(&calibrated.notes);
    calibrated.warnings.iter().for_each(|warning| output::levelled(Level::Warning, warning));
    let command = format!("cargo xtask run --sensor left_hip={}", gait_trace::shell_word(&outputs.toml));
    messages::next("run it on the virtual board, here on the left hip", command);
    Ok(())
}

impl Outputs {
    /// Refuses outputs before any work: a guided calibration takes minutes.
    fn check(&self, rows: &Source) -> Result<(), Failure> {
        let (input, kept) = match rows {
            Source::File(path) => (Some(path), None),
            Source::Guide(settings) => match &settings.codes {
                CodeSource::Lines(path) => (Some(path), settings.keep_rows.as_ref()),
                CodeSource::Board(_) => (None, settings.keep_rows.as_ref()),
            },
        };
        let files = [Some(&self.toml), self.report.as_ref(), self.svg.as_ref(), kept];
        let files: Vec<&Path> = files.into_iter().flatten().map(PathBuf::as_path).collect();
        output::check_apart(files.iter().copied(), input.iter().map(|path| path.as_path()))?;
        files.into_iter().try_for_each(|file| output::check(file, self.overwrite))
    }
}

/// Writes the files. All contents are made before the first file is written, so that an error leaves none.
fn write(calibrated: &Calibrated, outputs: &Outputs) -> Result<(), Failure> {
    let toml = calibration_file::to_text(&calibrated.sensor, Some(&calibrated.measured));
    let svg = outputs.svg.as_ref().map(|path| Ok((path, pictures::svg(calibrated)?)));
    let html = outputs.report.as_ref().map(|path| Ok((path, report::html(calibrated))));
    let pictures = [svg, html].into_iter().flatten().collect::<Result<Vec<_>, String>>().map_err(Failure::run)?;
    let texts = std::iter::once((&outputs.toml, toml)).chain(pictures);
    for (path, content) in texts {
        output::write_text(path, &content, outputs.overwrite)?;
        messages::written(path);
    }
    Ok(())
}
