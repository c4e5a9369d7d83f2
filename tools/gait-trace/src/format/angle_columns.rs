//! Converts joint columns to degrees: decides the unit and removes impossible values.
//!
//! Columns in volts go through the calibration first ([`calibrated`]). For the others the unit is, in this order: the caller's; the file's
//! (heading or header); the one that the values imply, with a note. The values imply *degrees* if each column has one beyond 2 pi, since no
//! joint turns that far in radians, and *radians* if none of at least [`ENOUGH`] is beyond [`RADIANS_END`]: hip and knee move farther than
//! that in degrees during walking. In between the unit is unknown, which is an error. A file that names degrees but has only values below
//! [`RADIANS_END`] is an error too. Radians are not inferred for a column whose values may be volts: one that names neither a joint nor an
//! angle (`ADC`, `Channel A`), or whose mean is beyond [`RADIANS_MEAN`].

use crate::fault::{Fault, TraceError};
use crate::format::angle_unit::AngleUnit;
use crate::format::calibrated;
pub(crate) use crate::format::column::{AngleColumn, Place};
use crate::format::joint_names::{joint_of, sideless_of};
use crate::format::normalised;
use crate::format::text_table::listed;
use crate::format::turns;
use crate::format::unit::Said;
use crate::options::ReadOptions;
use crate::raw::{RawJoint, UnitSource};
use crate::recording::{MAX_ANGLE_DEG, Quantity};
use joint_units::Joint;
use std::f64::consts::TAU;

/// Fewest values from which a unit is inferred or checked.
const ENOUGH: usize = 20;
/// Largest angle of a joint in radians: 200 degrees.
const RADIANS_END: f64 = 3.5;
/// Largest mean of a joint in radians, without its sign: 63 degrees. The knee of a runner has 50; a goniometer has its middle at half the supply.
const RADIANS_MEAN: f64 = 1.1;
/// Up to one value in this many may be beyond [`MAX_ANGLE_DEG`] and counts as a glitch; with more the unit is wrong.
const GLITCH_SHARE: usize = 100;

/// Most different numbers that are codes for missing values.
const MOST_CODES: usize = 3;

/// The joints in degrees, for [`crate::RawJoints`].
pub(crate) fn in_degrees(
    place: &Place<'_>,
    mut columns: Vec<AngleColumn>,
    how: &ReadOptions<'_>,
    notes: &mut Vec<String>,
) -> Result<[Option<RawJoint>; Joint::COUNT], TraceError> {
    columns.retain(|column| {
        let any = column.values.iter().any(|value| !value.is_nan());
        if !any {
            notes.push(format!("`{}` has no number in any row and is ignored.", column.heading));
        }
        any
    });
    if columns.is_empty() {
        return Err(place.at(place.header, None, Fault::NoValues));
    }
    calibrated::convert(place, &mut columns, how, notes)?;
    // The caller's unit holds for the columns that are not computed.
    let is_computed = |column: &AngleColumn| matches!(column.said, Said::Computed | Said::Calibrated);
    if let Some(unit) = how.unit
        && columns.iter().all(is_computed)
    {
        if how.calibration.is_some() {
            return Err(place.at(place.header, columns.first(), Fault::UnitAndCalibration { unit: unit.words() }));
        }
        notes.push("The requested unit has no effect: the angles are computed, and are in degrees.".into());
    }
    for column in columns.iter_mut().filter(|column| !is_computed(column)) {
        let largest = || extent_of(&column.values).0;
        let (turn, is_known) = match how.unit.or(column.said.unit()) {
            Some(AngleUnit::Degrees) => (360.0, true),
            Some(AngleUnit::Radians) => (TAU, true),
            None if largest() > TAU * (1.0 + 1e-3) => (360.0, true),
            None => (TAU, false),
        };
        notes.extend(turns::take_out(&column.heading, &mut column.values, turn, is_known));
    }
    let guess = match how.unit {
        Some(_) => None,
        None => guess(place, &columns, notes)?,
    };
    let mut joints: [Option<RawJoint>; Joint::COUNT] = Default::default();
    for column in columns {
        let said = column.said.unit();
        let asked = if is_computed(&column) { None } else { how.unit };
        let unit = asked.or(said).or(guess).unwrap_or(AngleUnit::Degrees);
        let source = match (asked, column.said) {
            (Some(asked), _) => UnitSource::Requested(asked),
            (None, Said::Unit(unit)) => UnitSource::Stated(unit),
            (None, Said::Format(unit, why)) => UnitSource::Format(unit, why),
            (None, Said::Computed) => UnitSource::Computed,
            (None, Said::Calibrated) => UnitSource::Calibrated,
            (None, Said::Nothing | Said::Angle | Said::Volts) => UnitSource::Inferred(unit),
        };
        if let (Some(asked), Some(said)) = (asked, said)
            && asked != said
        {
            let (heading, asked, said) = (&column.heading, asked.words(), said.words());
            notes.push(format!("`{heading}`: read as {asked}, as requested, although the file names {said}."));
        }
        let joint = column.joint as usize;
        joints[joint] = Some(without_glitches(place, column, (unit, source), notes)?);
    }
    Ok(joints)
}

/// Whether a column without unit, with values that may be radians, may be in volts: nothing in its name says that it is an angle, or its mean
/// is that of no joint.
fn may_be_volts(column: &AngleColumn) -> bool {
    let (sum, count) = known(column).fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    let mean = sum.abs() / f64::from(count);
    let no_joint = mean > RADIANS_MEAN && mean <= RADIANS_END;
    let heading = &column.heading;
    let is_angle = joint_of(heading).is_some()
        || sideless_of(heading).is_some()
        || ["hip", "knee", "angle", "flex"].iter().any(|word| heading.to_lowercase().contains(word));
    column.said == Said::Nothing && (!is_angle || no_joint)
}

fn known(column: &AngleColumn) -> impl Iterator<Item = f64> {
    column.values.iter().copied().filter(|value| !value.is_nan())
}

/// The largest absolute value, and the number of values.
fn extent<'a>(columns: impl Iterator<Item = &'a AngleColumn>) -> (f64, usize) {
    columns
        .map(|column| extent_of(&column.values))
        .fold((0.0, 0), |(most, all), (largest, count)| (largest.max(most), all + count))
}

/// The same of one column. Eight values take turns, so that none waits for the one before.
fn extent_of(values: &[f64]) -> (f64, usize) {
    const LANES: usize = 8;
    let (mut largest, mut missing) = ([0.0_f64; LANES], [0_usize; LANES]);
    let mut take = |block: &[f64]| {
        for ((value, largest), missing) in block.iter().zip(&mut largest).zip(&mut missing) {
            *largest = if value.abs() > *largest { value.abs() } else { *largest };
            *missing += usize::from(value.is_nan());
        }
    };
    let (blocks, rest) = values.as_chunks::<LANES>();
    blocks.iter().for_each(|block| take(block));
    take(rest);
    (largest.into_iter().fold(0.0, f64::max), values.len() - missing.into_iter().sum::<usize>())
}

/// The unit that the values of the columns without unit imply; `None` if all columns have a unit.
fn guess(place: &Place<'_>, columns: &[AngleColumn], notes: &mut Vec<String>) -> Result<Option<AngleUnit>, TraceError> {
    let degrees = |column: &&AngleColumn| {
        matches!(column.said, Said::Unit(AngleUnit::Degrees) | Said::Format(AngleUnit::Degrees, _))
    };
    let is_unsaid = |column: &&AngleColumn| matches!(column.said, Said::Nothing | Said::Angle);
    let (largest, values) = extent(columns.iter().filter(degrees));
    if values >= ENOUGH && largest <= RADIANS_END {
        let fault = Fault::UnitDoubt { said: AngleUnit::Degrees.words(), values, largest };
        return Err(place.at(place.header, columns.iter().find(degrees), fault));
    }
    let Some(unsaid) = columns.iter().find(is_unsaid) else { return Ok(None) };
    if columns.iter().all(|column| is_unsaid(&column)) && normalised::is(columns) {
        return Err(place.at(place.header, Some(unsaid), Fault::Normalised));
    }
    let (largest, values) = extent(columns.iter().filter(is_unsaid));
    let no_unit = |why| Err(place.at(place.header, Some(unsaid), Fault::NoUnit { why }));
    let unit = match largest {
        _ if values < ENOUGH => return no_unit(format!(", and {values} values are too few to infer it")),
        _ if largest > TAU => {
            let small = columns.iter().filter(is_unsaid).find(|column| extent(std::iter::once(*column)).0 <= TAU);
            match small.map(|column| (column, extent(std::iter::once(column)))) {
                Some((column, (small, values))) if values >= ENOUGH => {
                    let why = format!(
                        ": its largest value, {small:.3}, may be radians, where another column has {largest:.1}"
                    );
                    return Err(place.at(place.header, Some(column), Fault::NoUnit { why }));
                }
                _ => AngleUnit::Degrees,
            }
        }
        _ if columns.iter().filter(is_unsaid).any(may_be_volts) => {
            return no_unit(format!(": the largest value, {largest:.3}, may be radians or volts"));
        }
        _ if largest <= RADIANS_END => AngleUnit::Radians,
        _ => return no_unit(format!(", and the largest value, {largest:.3}, may be either")),
    };
    notes.push(format!(
        "The file names no unit of its angles; they are read as {} because the largest of {values} values is {largest:.3}.",
        unit.words()
    ));
    Ok(Some(unit))
}

/// The column in degrees; single values beyond [`MAX_ANGLE_DEG`] become missing.
fn without_glitches(
    place: &Place<'_>,
    mut column: AngleColumn,
    (unit, source): (AngleUnit, UnitSource),
    notes: &mut Vec<String>,
) -> Result<RawJoint, TraceError> {
    let mut values = std::mem::take(&mut column.values);
    // Larger angles have larger values.
    if unit.degrees(extent_of(&values).0) <= MAX_ANGLE_DEG {
        if unit != AngleUnit::Degrees {
            values.iter_mut().for_each(|value| *value = unit.degrees(*value));
        }
        return Ok(RawJoint { column: column.heading, unit: source, sign: column.sign, angle_deg: values });
    }
    let mut first_beyond = None;
    let mut beyond = 0;
    let mut codes: Vec<f64> = Vec::new();
    for (row, value) in values.iter_mut().enumerate() {
        let raw = *value;
        *value = unit.degrees(raw);
        if value.abs() > MAX_ANGLE_DEG {
            first_beyond.get_or_insert((row, *value));
            beyond += 1;
            if codes.len() <= MOST_CODES && !codes.contains(&raw) {
                codes.push(raw);
            }
            *value = f64::NAN;
        }
    }
    if let Some((row, value)) = first_beyond {
        let line = place.lines.get(row);
        if beyond * GLITCH_SHARE > values.len() {
            // Where most values are beyond the limit, it is the unit that is wrong.
            let is_few = codes.len() <= MOST_CODES && codes.len() < beyond && 2 * beyond < values.len();
            if is_few && codes.iter().all(|code| code.fract() == 0.0) {
                let codes = listed(&codes.iter().map(f64::to_string).collect::<Vec<_>>());
                let fault = Fault::MissingCode { codes, rows: beyond, of: values.len(), most: MAX_ANGLE_DEG };
                return Err(place.at(line, Some(&column), fault));
            }
            return Err(place.at(line, Some(&column), Fault::Magnitude { value, quantity: Quantity::Angle }));
        }
        let at = line.map_or_else(|| format!("frame {row}"), |line| format!("line {line}"));
        notes.push(format!(
            "`{}`: {beyond} of {} values are beyond {MAX_ANGLE_DEG} degrees and are treated as missing, the first in {at} ({value:.1}).",
            column.heading,
            values.len()
        ));
    }
    Ok(RawJoint { column: column.heading, unit: source, sign: column.sign, angle_deg: values })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::row_lines::RowLines;
    use crate::raw::SignSource;

    fn column(said: Option<AngleUnit>, values: Vec<f64>) -> AngleColumn {
        let said = said.map_or(Said::Nothing, Said::Unit);
        AngleColumn {
            joint: Joint::LeftKnee,
            heading: "knee".into(),
            index: 1,
            said,
            sign: SignSource::Unknown,
            values,
        }
    }

    fn read(said: Option<AngleUnit>, asked: Option<AngleUnit>, values: Vec<f64>) -> Result<(f64, Vec<String>), String> {
        let place = Place { file: "walk", header: Some(1), lines: &RowLines::default() };
        let mut notes = Vec::new();
        let how = ReadOptions { unit: asked, ..ReadOptions::default() };
        let joints = in_degrees(&place, vec![column(said, values)], &how, &mut notes);
        let joints = joints.map_err(|error| error.to_string())?;
        assert!(joints[0].is_none() && joints[1].is_none() && joints[3].is_none());
        Ok((joints[2].as_ref().unwrap().angle_deg[0], notes))
    }

    #[test]
    fn the_unit_is_requested_named_or_inferred() {
        let degrees = Some(AngleUnit::Degrees);
        let radians = Some(AngleUnit::Radians);
        assert_eq!(read(degrees, None, vec![60.0; 30]).unwrap(), (60.0, vec![]));
        assert!((read(radians, None, vec![1.0; 30]).unwrap().0 - 57.29578).abs() < 1e-5);
        let (value, notes) = read(None, None, vec![60.0; 30]).unwrap();
        assert!(value == 60.0 && notes[0].contains("read as degrees"), "{notes:?}");
        let (value, notes) = read(None, None, vec![1.0; 30]).unwrap();
        assert!((value - 57.29578).abs() < 1e-5 && notes[0].contains("read as radians"), "{notes:?}");
        let (value, notes) = read(radians, degrees, vec![1.0; 30]).unwrap();
        assert!(value == 1.0 && notes[0].contains("as requested, although the file names radians"), "{notes:?}");
    }

    #[test]
    fn an_unknown_unit_is_refused() {
        let degrees = Some(AngleUnit::Degrees);
        assert!(read(None, None, vec![5.0; 30]).unwrap_err().contains("5.000, may be either"));
        assert!(read(None, None, vec![60.0; 19]).unwrap_err().contains("19 values are too few"));
        assert!(
            read(degrees, None, vec![1.0; 30]).unwrap_err().contains("names degrees, but the largest of 30 values")
        );
        assert!(read(degrees, None, vec![1.0; 19]).is_ok());
        assert!(read(Some(AngleUnit::Radians), None, vec![60.0; 30]).unwrap_err().contains("wrong unit?"));
        assert!(read(degrees, None, vec![f64::NAN; 30]).unwrap_err().contains("no row has a number"));
    }

    /// A goniometer on 3.3 V under the name of a joint, and a hip in radians beside a knee in degrees.
    #[test]
    fn volts_and_mixed_units_are_not_guessed() {
        assert!(read(None, None, vec![1.65; 30]).unwrap_err().contains("1.650, may be radians or volts"));
        let place = Place { file: "walk", header: Some(1), lines: &RowLines::default() };
        let hip = AngleColumn { joint: Joint::LeftHip, heading: "hip".into(), ..column(None, vec![0.4; 30]) };
        let both = vec![hip, column(None, vec![60.0; 30])];
        let error = in_degrees(&place, both, &ReadOptions::default(), &mut vec![]).unwrap_err().to_string();
        assert!(
            error.contains("`hip`") && error.contains("0.400, may be radians, where another column has 60.0"),
            "{error}"
        );
    }

    #[test]
    fn one_glitch_in_a_hundred_is_missing_two_are_an_error() {
        let mut values = vec![60.0; 100];
        values[0] = 1e9;
        let (value, notes) = read(Some(AngleUnit::Degrees), None, values.clone()).unwrap();
        assert!(value.is_nan() && notes[0].contains("1 of 100 values are beyond 200 degrees"), "{notes:?}");
        values[1] = -300.0;
        assert!(
            read(Some(AngleUnit::Degrees), None, values)
                .unwrap_err()
                .contains("1000000000 degrees is out of range (wrong unit?)")
        );
    }
}
