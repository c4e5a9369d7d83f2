//! Calibration: volts to an angle by a measured table, and the inverse.
//!
//! A table has 2 to [`MAX_POINTS`] points. Volts rise from point to point; the angle rises or falls throughout, so that each
//! angle has one voltage. Between the points the angle follows [`Interpolation`]; outside them there is [`OutOfTable`], never
//! an extrapolation.
//!
//! A table that reaches into a sensor's saturation, where the angle changes while the volts hardly do, is **refused**
//! ([`CalibrationError::Saturated`]): noise of one code would be several degrees there. End the table before that range; samples in it then are
//! out of the table.

use crate::interpolation::{Interpolation, Interval, slopes};
use crate::point::{CalibrationPoint, MAX_POINTS};
use core::fmt;
use joint_units::{Radians, Volts};

/// Largest voltage of a point; the least is 0.
pub const MAX_VOLTS: Volts = Volts(30.0);

/// Least rise of volts from point to point: a little more than one code of 12 bit at 3.3 V.
pub const MIN_VOLTS_STEP: Volts = Volts(1e-3);

/// Least change of angle from point to point, 0.05 degrees: below it a table is not strictly monotone within what a
/// goniometer can be read to, and has no usable inverse.
pub const MIN_ANGLE_STEP: Radians = Radians::from_degrees(0.05);

/// Steepest table, 400 degrees a volt (in radians a volt): one code of 12 bit at 3.3 V is a third of a degree. Beyond it the
/// sensor saturates or its signal is too small to measure a joint with.
pub const MAX_SLOPE: f32 = Radians::from_degrees(400.0).0;

/// Allowed angles of a table: -60 to 170 degrees, flexion positive. That is the range of a hip or a knee with a margin for a goniometer that is
/// mounted at an angle.
pub const ANATOMY: (Radians, Radians) = (Radians::from_degrees(-60.0), Radians::from_degrees(170.0));

/// Why a table was refused. `index` counts from 0 and is the point at fault, or the second one of a pair at fault.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CalibrationError {
    /// Fewer than 2 or more than [`MAX_POINTS`] points.
    Count {
        /// How many points there are.
        points: usize,
    },
    /// A value is infinite or not a number.
    NotFinite {
        /// The point.
        index: usize,
        /// `volts` or `angle`.
        field: &'static str,
    },
    /// Volts below 0 or above [`MAX_VOLTS`].
    VoltsRange {
        /// The point.
        index: usize,
        /// Its volts.
        volts: Volts,
    },
    /// An angle that no joint takes, see [`ANATOMY`].
    Anatomy {
        /// The point.
        index: usize,
        /// Its angle.
        angle: Radians,
    },
    /// Volts do not rise by at least [`MIN_VOLTS_STEP`] from the point before: not sorted, doubled, or too close.
    VoltsStep {
        /// The point.
        index: usize,
        /// Rise of its volts from the point before.
        rise: Volts,
    },
    /// The angle hardly changes from the point before, see [`MIN_ANGLE_STEP`].
    AngleStep {
        /// The point.
        index: usize,
        /// Change of its angle from the point before.
        change: Radians,
    },
    /// The angle changes its direction: it falls where the table rises, or the reverse.
    AngleOrder {
        /// The point.
        index: usize,
        /// Change of its angle from the point before.
        change: Radians,
    },
    /// The table is steeper than [`MAX_SLOPE`] before this point: the sensor saturates.
    Saturated {
        /// The point.
        index: usize,
        /// Slope from the point before in radians a volt.
        slope: f32,
    },
}

impl CalibrationError {
    /// The point at fault, counted from 0, so that a reader of files can name the line.
    #[must_use]
    pub const fn index(&self) -> Option<usize> {
        match *self {
            Self::Count { .. } => None,
            Self::NotFinite { index, .. }
            | Self::VoltsRange { index, .. }
            | Self::Anatomy { index, .. }
            | Self::VoltsStep { index, .. }
            | Self::AngleStep { index, .. }
            | Self::AngleOrder { index, .. }
            | Self::Saturated { index, .. } => Some(index),
        }
    }

    /// The field of the point at fault: `volts` or `angle`.
    #[must_use]
    pub const fn field(&self) -> Option<&'static str> {
        match *self {
            Self::Count { .. } => None,
            Self::NotFinite { field, .. } => Some(field),
            Self::VoltsRange { .. } | Self::VoltsStep { .. } | Self::Saturated { .. } => Some("volts"),
            Self::Anatomy { .. } | Self::AngleStep { .. } | Self::AngleOrder { .. } => Some("angle"),
        }
    }
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let (Some(index), Some(field)) = (self.index(), self.field()) {
            write!(f, "points[{index}].{field}: ")?;
        }
        match self {
            Self::Count { points } => write!(f, "{points} points: allowed is 2 to {MAX_POINTS}"),
            Self::NotFinite { .. } => write!(f, "not a finite number"),
            Self::VoltsRange { volts, .. } => write!(f, "{} V: allowed is 0 to {} V", volts.0, MAX_VOLTS.0),
            Self::Anatomy { angle, .. } => {
                let (low, high) = (ANATOMY.0.degrees(), ANATOMY.1.degrees());
                write!(f, "{:.2} degrees: allowed is {low:.0} to {high:.0} degrees", angle.degrees())
            }
            Self::VoltsStep { rise, .. } => {
                write!(f, "{} V more than the point before: must be at least {} V", rise.0, MIN_VOLTS_STEP.0)
            }
            Self::AngleStep { change, .. } => {
                let least = MIN_ANGLE_STEP.degrees();
                write!(f, "{:.4} degrees from the point before: must be at least {least:.2} degrees", change.degrees())
            }
            Self::AngleOrder { change, .. } => {
                let change = change.degrees();
                write!(f, "{change:.4} degrees from the point before, against the direction of the table: ")?;
                write!(f, "must rise throughout or fall throughout")
            }
            Self::Saturated { slope, .. } => {
                let (slope, most) = (Radians(*slope).degrees(), Radians(MAX_SLOPE).degrees());
                write!(f, "{slope:.0} degrees a volt from the point before: allowed is up to {most:.0}; ")?;
                write!(f, "the sensor saturates here, end the table before it")
            }
        }
    }
}

impl core::error::Error for CalibrationError {}

/// A value lies outside the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum OutOfTable {
    /// Less than the least of the table.
    Below,
    /// More than the greatest of the table.
    Above,
    /// Not a number.
    NotANumber,
}

impl fmt::Display for OutOfTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Below => "below the calibration table",
            Self::Above => "above the calibration table",
            Self::NotANumber => "not a number",
        })
    }
}

impl core::error::Error for OutOfTable {}

/// A checked calibration table: converts volts to an angle and back.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    points: [CalibrationPoint; MAX_POINTS],
    /// How many of `points` are in use, 2 to 32.
    len: usize,
    /// Slope at each point in radians a volt; `None` for straight lines.
    slopes: Option<[f32; MAX_POINTS]>,
    /// Whether the angle rises with the volts.
    rising: bool,
}

impl Calibration {
    /// Checks the points, in order, and prepares the interpolation.
    ///
    /// # Errors
    /// The first point that breaks a rule, its field and what is allowed.
    ///
    /// ```
    /// use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
    /// use joint_units::{Radians, Volts};
    /// let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    ///
    /// let table = [point(0.5, 90.0), point(1.5, 30.0), point(2.5, -20.0)];
    /// let calibration = Calibration::new(&table, Interpolation::Linear)?;
    /// assert!((calibration.angle(Volts(1.0))?.degrees() - 60.0).abs() < 1e-4);
    /// assert!((calibration.volts(Radians::from_degrees(5.0))?.0 - 2.0).abs() < 1e-6);
    /// assert!(calibration.angle(Volts(2.6)).is_err());
    ///
    /// let bent = [point(0.5, 90.0), point(1.5, 30.0), point(2.5, 40.0)];
    /// let error = Calibration::new(&bent, Interpolation::Linear).unwrap_err();
    /// assert_eq!((error.index(), error.field()), (Some(2), Some("angle")));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn new(points: &[CalibrationPoint], interpolation: Interpolation) -> Result<Self, CalibrationError> {
        let count = CalibrationError::Count { points: points.len() };
        let [first, second, ..] = points else { return Err(count) };
        if points.len() > MAX_POINTS {
            return Err(count);
        }
        let rising = second.angle.0 > first.angle.0;
        let mut before = None;
        for (index, point) in points.iter().enumerate() {
            check_point(index, point)?;
            if let Some(before) = before {
                check_step(index, before, point, rising)?;
            }
            before = Some(point);
        }
        let mut table = [CalibrationPoint::default(); MAX_POINTS];
        for (slot, point) in table.iter_mut().zip(points) {
            *slot = *point;
        }
        let slopes = match interpolation {
            Interpolation::Linear => None,
            Interpolation::MonotoneCubic => Some(slopes(points)),
        };
        Ok(Self { points: table, len: points.len(), slopes, rising })
    }

    /// The angle at volts. At a point of the table it is the point's angle exactly.
    ///
    /// # Errors
    /// The volts lie outside the table.
    pub fn angle(&self, volts: Volts) -> Result<Radians, OutOfTable> {
        self.angle_near(volts, &mut 0)
    }

    /// The same, where the point right of the volts is mostly that of the last call: `right` keeps it, and any value may be there at first.
    pub(crate) fn angle_near(&self, volts: Volts, right: &mut usize) -> Result<Radians, OutOfTable> {
        let holds = |near: &Interval| near.left.volts <= volts && volts < near.right.volts;
        if let Some(near) = self.interval(*right).filter(holds) {
            return Ok(Radians(near.angle(volts.0)));
        }
        // A joint that moves is in a neighbour of it.
        for next in [right.wrapping_add(1), right.wrapping_sub(1)] {
            if let Some(near) = self.interval(next).filter(holds) {
                *right = next;
                return Ok(Radians(near.angle(volts.0)));
            }
        }
        let (first, last) = self.ends();
        inside(volts.0, first.volts.0, last.volts.0)?;
        *right = self.points().partition_point(|point| point.volts <= volts);
        Ok(self.interval(*right).map_or(last.angle, |interval| Radians(interval.angle(volts.0))))
    }

    /// The volts at an angle: the inverse of [`Calibration::angle`].
    ///
    /// `angle(volts(a))` differs from `a` by the rounding of volts to `f32` times the slope there: less than 0.0003 degrees
    /// for tables up to 3.6 V and 0.003 degrees up to 30 V. A cubic is inverted by 32 halvings: meant for the host.
    ///
    /// # Errors
    /// The angle lies outside the table.
    pub fn volts(&self, angle: Radians) -> Result<Volts, OutOfTable> {
        let (low, high) = self.span();
        inside(angle.0, low.0, high.0)?;
        let right = self
            .points()
            .partition_point(|point| if self.rising { point.angle <= angle } else { point.angle >= angle });
        Ok(self.interval(right).map_or(self.ends().1.volts, |interval| Volts(interval.volts(angle.0))))
    }

    /// The points of the table, as given.
    #[must_use]
    pub fn points(&self) -> &[CalibrationPoint] {
        self.points.get(..self.len).unwrap_or(&self.points)
    }

    /// Least and greatest angle of the table.
    #[must_use]
    pub fn span(&self) -> (Radians, Radians) {
        let (first, last) = self.ends();
        if self.rising { (first.angle, last.angle) } else { (last.angle, first.angle) }
    }

    /// Least and greatest volts of the table.
    #[must_use]
    pub fn volts_span(&self) -> (Volts, Volts) {
        let (first, last) = self.ends();
        (first.volts, last.volts)
    }

    /// How the angle runs between the points.
    #[must_use]
    pub const fn interpolation(&self) -> Interpolation {
        if self.slopes.is_some() { Interpolation::MonotoneCubic } else { Interpolation::Linear }
    }

    fn ends(&self) -> (CalibrationPoint, CalibrationPoint) {
        match self.points() {
            [first, .., last] => (*first, *last),
            // Never reached: a table has at least two points.
            _ => Default::default(),
        }
    }

    /// The interval that ends at the point `right`; `None` at the end of the table.
    fn interval(&self, right: usize) -> Option<Interval> {
        let begin = right.checked_sub(1)?;
        let [left, right] = *self.points().get(begin..)?.first_chunk()?;
        let slopes = match &self.slopes {
            None => None,
            Some(slopes) => slopes.get(begin..)?.first_chunk().map(|&[left, right]| (left, right)),
        };
        Some(Interval { left, right, slopes })
    }
}

fn check_point(index: usize, point: &CalibrationPoint) -> Result<(), CalibrationError> {
    for (field, value) in [("volts", point.volts.0), ("angle", point.angle.0)] {
        if !value.is_finite() {
            return Err(CalibrationError::NotFinite { index, field });
        }
    }
    if point.volts.0 < 0.0 || point.volts > MAX_VOLTS {
        return Err(CalibrationError::VoltsRange { index, volts: point.volts });
    }
    if point.angle < ANATOMY.0 || point.angle > ANATOMY.1 {
        return Err(CalibrationError::Anatomy { index, angle: point.angle });
    }
    Ok(())
}

fn check_step(
    index: usize,
    before: &CalibrationPoint,
    point: &CalibrationPoint,
    rising: bool,
) -> Result<(), CalibrationError> {
    let rise = Volts(point.volts.0 - before.volts.0);
    let change = Radians(point.angle.0 - before.angle.0);
    if rise < MIN_VOLTS_STEP {
        return Err(CalibrationError::VoltsStep { index, rise });
    }
    if change.0.abs() < MIN_ANGLE_STEP.0 {
        return Err(CalibrationError::AngleStep { index, change });
    }
    if (change.0 > 0.0) != rising {
        return Err(CalibrationError::AngleOrder { index, change });
    }
    let slope = change.0.abs() / rise.0;
    if slope > MAX_SLOPE {
        return Err(CalibrationError::Saturated { index, slope });
    }
    Ok(())
}

fn inside(value: f32, low: f32, high: f32) -> Result<(), OutOfTable> {
    if value < low {
        Err(OutOfTable::Below)
    } else if value > high {
        Err(OutOfTable::Above)
    } else if value.is_nan() {
        Err(OutOfTable::NotANumber)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// 100,000 cases, or as many as the variable `FOOTFALL_CASES` says.
    fn cases() -> u32 {
        std::env::var("FOOTFALL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(100_000)
    }

    /// A table of so many points, a third of a volt apart.
    fn table(points: usize, interpolation: Interpolation) -> Calibration {
        let point = |index: usize| CalibrationPoint {
            volts: Volts(index as f32 / 3.0),
            angle: Radians::from_degrees(7.0 * index as f32 - 40.0),
        };
        let points: Vec<_> = (0..points).map(point).collect();
        Calibration::new(&points, interpolation).expect("allowed")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(cases()))]

        /// Whatever place is remembered; at the points, beside them, outside, and for what is no number.
        #[test]
        fn a_remembered_place_changes_no_bit(
            points in 2..=10_usize, cubic: bool, from in any::<usize>(), small in 0..13_usize, volts in -0.5_f32..4.0,
            at in 0..12_u32, ulps in -2_i32..=2, bits: u32, pick in 0..3_usize,
        ) {
            let table = table(points, if cubic { Interpolation::MonotoneCubic } else { Interpolation::Linear });
            let beside = f32::from_bits((at as f32 / 3.0).to_bits().wrapping_add_signed(ulps));
            let volts = Volts([volts, beside, f32::from_bits(bits)][pick]);
            let right = table.points().partition_point(|point| point.volts <= volts);
            let (first, last) = table.ends();
            let slowly = inside(volts.0, first.volts.0, last.volts.0)
                .map(|()| table.interval(right).map_or(last.angle.0, |interval| interval.angle(volts.0)).to_bits());
            for mut place in [from, small] {
                let found = table.angle_near(volts, &mut place).map(|angle| angle.0.to_bits());
                prop_assert_eq!(found, slowly, "{} V from place {}", volts.0, place);
                if let Some(interval) = table.interval(place).filter(|_| found.is_ok()) {
                    // The place that is remembered has the volts, but for those of the last point.
                    let holds = interval.left.volts <= volts && volts < interval.right.volts;
                    prop_assert!(holds || volts == table.volts_span().1, "{} V, place {place}", volts.0);
                }
                // And again, from the place that was found.
                prop_assert_eq!(table.angle_near(volts, &mut place).map(|angle| angle.0.to_bits()), slowly);
            }
        }
    }
}
