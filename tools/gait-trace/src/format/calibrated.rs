//! Columns in volts become angles through a calibration; a calibration that no column uses is an error.

use crate::fault::{Fault, TraceError};
use crate::format::angle_unit::AngleUnit;
use crate::format::column::{AngleColumn, Place};
use crate::format::text_table::short;
use crate::format::unit::Said;
use crate::options::ReadOptions;
use crate::recording::{Channel, Quantity};
use hgod_adc::Calibration;
use joint_units::Volts;

/// Converts the columns in volts to degrees. With a calibration a column without unit is in volts, unless another one says so.
pub(crate) fn convert(
    place: &Place<'_>,
    columns: &mut [AngleColumn],
    how: &ReadOptions<'_>,
    notes: &mut Vec<String>,
) -> Result<(), TraceError> {
    let is = |said: Said| move |column: &&AngleColumn| column.said == said;
    let any_volts = columns.iter().any(|column| column.said == Said::Volts);
    let Some(calibration) = how.calibration else {
        return match columns.iter().find(is(Said::Volts)) {
            Some(column) => {
                Err(place.at(place.header, Some(column), Fault::NoCalibration { channel: short(&column.heading) }))
            }
            None => Ok(()),
        };
    };
    if let Some(unsaid) = columns.iter().find(is(Said::Nothing)) {
        let fault = match how.unit {
            Some(unit) if !any_volts => Some(Fault::UnitAndCalibration { unit: unit.words() }),
            None if any_volts => Some(Fault::NoUnit { why: ", and another column is in volts by its name".into() }),
            _ => None,
        };
        if let Some(fault) = fault {
            return Err(place.at(place.header, Some(unsaid), fault));
        }
    }
    if !any_volts {
        for column in columns.iter_mut().filter(|column| column.said == Said::Nothing) {
            column.said = Said::Volts;
            notes.push(format!(
                "`{}` names no unit; it is read as volts, because a calibration is given.",
                short(&column.heading)
            ));
        }
    }
    let Some(first) = columns.first() else { return Ok(()) };
    if columns.iter().all(|column| column.said != Said::Volts) {
        let said = first.said.unit().map_or("an angle", AngleUnit::words);
        return Err(place.at(place.header, Some(first), Fault::CalibrationUnused { said }));
    }
    for column in columns.iter_mut().filter(|column| column.said == Said::Volts) {
        at_sensor(column, how, notes);
        convert_column(place, column, calibration, notes)?;
    }
    Ok(())
}

/// Volts at the pin of a board become volts at the sensor. Those of other recorders are taken at the sensor.
fn at_sensor(column: &mut AngleColumn, how: &ReadOptions<'_>, notes: &mut Vec<String>) {
    let Some(divider) = how.divider.filter(|divider| *divider != 1.0) else { return };
    let channel = short(&column.heading);
    if matches!(Channel::of_column(&column.heading), Some((_, Quantity::PinVolts))) {
        column.values.iter_mut().for_each(|value| *value *= f64::from(divider));
        notes.push(format!("`{channel}`: volts at the pin, multiplied by {divider}, the divider of the calibration."));
    } else {
        notes.push(format!(
            "`{channel}`: read as volts at the sensor; the divider of the calibration, {divider}, is for columns named after a pin (`PA1`)."
        ));
    }
}

/// Volts converted to degrees; NaN outside of the calibration table, which is never extrapolated.
fn convert_column(
    place: &Place<'_>,
    column: &mut AngleColumn,
    calibration: &Calibration,
    notes: &mut Vec<String>,
) -> Result<(), TraceError> {
    column.said = Said::Calibrated;
    let (mut least, mut most, mut known, mut outside) = (f64::INFINITY, f64::NEG_INFINITY, 0_usize, 0_usize);
    for value in column.values.iter_mut().filter(|value| !value.is_nan()) {
        (least, most) = (least.min(*value), most.max(*value));
        known += 1;
        *value = match calibration.angle(Volts(*value as f32)) {
            Ok(angle) => f64::from(angle.degrees()),
            Err(_) => {
                outside += 1;
                f64::NAN
            }
        };
    }
    let (low, high) = calibration.volts_span();
    let (low, high) = (low.0, high.0);
    let channel = short(&column.heading);
    if known > 0 && outside == known {
        let found = format!("{least:.3} to {most:.3} V, completely outside of the calibration table");
        let allowed = format!("{low:.3} to {high:.3} V");
        return Err(place.at(None, None, Fault::HeaderField { field: channel, found, allowed }));
    }
    if outside > 0 {
        notes.push(format!(
            "`{channel}`: {outside} of {known} values are outside of the calibration table ({low:.3} to {high:.3} V) and are treated as missing."
        ));
    }
    Ok(())
}
