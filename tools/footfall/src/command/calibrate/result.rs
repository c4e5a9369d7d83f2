//! The result of a calibration: the table with its origin, how it was measured, and notes.

use hgod_adc::{FilterConfig, HealthConfig, ReferenceConfig, SensorConfig};
use joint_units::Period;
use time::OffsetDateTime;

use super::fit::{self, Fit, Settings, short};
use super::rows::Rows;
use crate::board::default_loop;
use crate::failure::Failure;
use crate::file::calibration_file::{Measured, WiredSensor};

/// Which sensor was measured, and when.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The sensor's name.
    pub sensor: String,
    /// The day as YYYY-MM-DD; `None` for today in UTC.
    pub date: Option<String>,
    /// Volts at the sensor for one volt at the pin.
    pub divider: f64,
}

/// A calibration with its origin and notes.
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
    /// Notes for the user.
    pub notes: Vec<String>,
    /// What a person should look at.
    pub warnings: Vec<String>,
}

/// Smallest range of the angles of a table, degrees: a joint with a sensor turns by 60 and more, and 90 degrees are 1.6 radians.
const LEAST_RANGE_DEG: f64 = 10.0;

/// Fits the rows.
///
/// # Errors
/// What is wrong with the rows; `source` is the name of their file.
pub fn calibrate(source: &str, rows: &Rows, settings: &Settings, identity: Identity) -> Result<Calibrated, Failure> {
    let Identity { sensor: name, date, divider } = identity;
    let fit = fit::fit(rows, settings).map_err(|fault| {
        let place = fault.line.map_or(String::new(), |line| format!(":{line}"));
        Failure::input(format!("{source}{place}: column `{}`: {}", rows.signal, fault.what))
    })?;
    let sensor = WiredSensor { calibration: fit.calibration.clone(), divider: divider as f32 };
    let rounded = |degrees: f64| ((degrees * 1e4).round() / 1e4) as f32;
    let measured = Measured {
        sensor: name,
        // `Date` is displayed in ISO 8601 format.
        date: date.unwrap_or_else(|| OffsetDateTime::now_utc().date().to_string()),
        rms_deg: rounded(fit.rms_deg),
        worst_deg: rounded(fit.worst_deg.0),
        hysteresis: fit.hysteresis,
    };
    let mut notes = rows.notes.clone();
    notes.extend(remarks(&fit, &sensor));
    let warnings = few_degrees(&fit).into_iter().collect();
    Ok(Calibrated { source: source.into(), fit, sensor, measured, notes, warnings })
}

/// A warning if the table covers a few degrees only, as angles in radians under a heading of degrees do.
fn few_degrees(fit: &Fit) -> Option<String> {
    let (least, most) = fit.calibration.span();
    let (least, most) = (f64::from(least.degrees()), f64::from(most.degrees()));
    let (low, high) = fit.calibration.volts_span();
    (most - least < LEAST_RANGE_DEG).then(|| {
        format!(
            "the table covers {} to {} degrees only, over {:.3} V: are the angles in radians? allowed is a column `angle_rad` for them; a reading beyond the table gives no angle",
            short(least),
            short(most),
            high.0 - low.0
        )
    })
}

/// Notes for the user beside the numbers.
fn remarks(fit: &Fit, sensor: &WiredSensor) -> Vec<String> {
    let mut notes = Vec::new();
    for why in [fit::LeftOut::Clipped, fit::LeftOut::Saturated, fit::LeftOut::NearTheEnd] {
        let there = fit.poses.iter().zip(&fit.left_out).filter(|(_, left_out)| **left_out == Some(why));
        let angles: Vec<String> = there.map(|(pose, _)| short(pose.angle_deg)).collect();
        if !angles.is_empty() {
            let (angles, words) = (angles.join(", "), why.words());
            notes.push(format!(
                "{words}: {angles} degrees: not in the table, so that a reading there is outside of the table"
            ));
        }
    }
    if fit.inside > 0 {
        let inside = fit.inside;
        notes.push(format!("{inside} rows of poses outside of the table still give an angle within the table"));
    }
    if fit.pooled > 0 {
        notes.push(format!("{} poses were joined because noise had reversed their order", fit.pooled));
    }
    if fit.hysteresis.is_none() {
        notes.push("the hysteresis is not known; to measure it, sweep up and down".into());
    }
    if fit.noise_v.is_none() {
        notes.push("the spread is not known; to measure it, take several rows at each angle".into());
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
