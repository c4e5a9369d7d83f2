//! The ankles of a recording of hips and knees, cut at the strides of hips and knees.
//!
//! The readers know four joints. The ankles are read by a second pass over the same bytes, in which the columns of the ankles are mapped
//! to the places of the hips, so every format, unit and option applies to them. Their sign stays that of the file (dorsiflexion positive
//! in OpenSim and Plug-in Gait), nothing is filtered, and no jump is repaired.

use crate::fault::TraceError;
use crate::format::open::of_bytes;
use crate::options::ReadOptions;
use crate::raw::RawJoint;
use crate::stride::cycle::POINTS;
use crate::stride::spans::Span;
use joint_units::Joint;

/// Names of the two joints.
pub const ANKLES: [&str; 2] = ["left_ankle", "right_ankle"];

/// Columns that are sought, left and right, in this order.
pub const COLUMNS: [[&str; 2]; 5] = [
    ["ankle_angle_l", "ankle_angle_r"],
    ["/jointset/ankle_l/ankle_angle_l/value", "/jointset/ankle_r/ankle_angle_r/value"],
    ["left_ankle_deg", "right_ankle_deg"],
    ["left_ankle", "right_ankle"],
    ["LAnkleAngles", "RAnkleAngles"],
];

/// Why there are no ankles.
#[derive(Debug, thiserror::Error)]
pub enum AnklesError {
    /// No pair of columns has a name that is known.
    #[error(
        "{file}: no columns of both ankles; sought were {}; allowed is --ankles LEFT,RIGHT with the names of two columns",
        COLUMNS.map(|pair| pair.join(" and ")).join(", ")
    )]
    NotFound {
        /// The recording.
        file: String,
    },
    /// The columns that the caller named cannot be read.
    #[error("--ankles {columns}: {why}")]
    Columns {
        /// The columns, left and right, with a comma between.
        columns: String,
        /// The reason, with the file.
        why: String,
    },
    /// A stride has too long a part without a value.
    #[error(
        "{file}: `{column}` has no value from {from_s:.3} s to {to_s:.3} s, within a stride of hips and knees; allowed are gaps of up to {most_s} s"
    )]
    Gap {
        /// The recording.
        file: String,
        /// The column.
        column: String,
        /// Last time with a value before the gap, s.
        from_s: f64,
        /// First time with a value behind it, s.
        to_s: f64,
        /// Longest gap that is allowed, s.
        most_s: f64,
    },
}

/// Both ankles as the file has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Ankles {
    file: String,
    time_s: Vec<f64>,
    joints: [RawJoint; 2],
}

impl Ankles {
    /// Reads the ankles of a recording's bytes: the columns of these names, or those of [`COLUMNS`] for `None`.
    ///
    /// # Errors
    /// There are no such columns, or they cannot be read.
    ///
    /// ```
    /// use gait_trace::ReadOptions;
    /// use gait_trace::ankles::Ankles;
    /// let mut text = String::from("time_s,left_hip_deg,left_ankle_deg,right_ankle_deg\n");
    /// for row in 0..30 {
    ///     text += &format!("{},20,{},-{row}\n", f64::from(row) * 0.01, 10 - row);
    /// }
    /// let ankles = Ankles::read("walk.csv", text.as_bytes(), &ReadOptions::default(), None)?;
    /// assert_eq!(ankles.columns(), ["left_ankle_deg", "right_ankle_deg"]);
    /// # Ok::<(), gait_trace::ankles::AnklesError>(())
    /// ```
    pub fn read(
        name: &str,
        bytes: &[u8],
        how: &ReadOptions<'_>,
        columns: Option<&[String; 2]>,
    ) -> Result<Self, AnklesError> {
        if let Some(columns) = columns {
            let read = of_columns(name, bytes, how, columns);
            let read = read.map_err(|why| AnklesError::Columns { columns: columns.join(","), why: why.to_string() })?;
            return read.ok_or_else(|| AnklesError::NotFound { file: name.into() });
        }
        let known = COLUMNS.iter().map(|pair| pair.map(str::to_owned));
        let mut read = known.filter_map(|pair| of_columns(name, bytes, how, &pair).ok().flatten());
        read.next().ok_or_else(|| AnklesError::NotFound { file: name.into() })
    }

    /// Names of the columns, left and right.
    #[must_use]
    pub fn columns(&self) -> [&str; 2] {
        self.joints.each_ref().map(|joint| joint.column.as_str())
    }

    /// Each stride as a closed cycle of both ankles, degrees: the difference of end and start is spread evenly, as for hips and knees.
    /// `start_s` is the file's time of the spans' zero. Between two values the angle is a straight line.
    ///
    /// # Errors
    /// A stride has a part longer than `most_s` without a value.
    pub fn cycles(&self, spans: &[Span], start_s: f64, most_s: f64) -> Result<Vec<[[f64; POINTS]; 2]>, AnklesError> {
        spans
            .iter()
            .map(|span| {
                let mut cycle = [[0.0; POINTS]; 2];
                for (points, joint) in cycle.iter_mut().zip(&self.joints) {
                    let values: Vec<(f64, f64)> = self.values(joint, start_s).collect();
                    let at = |part: f64| {
                        let time_s = span.start_s + (span.end_s - span.start_s) * part;
                        between(&values, time_s, most_s).map_err(|(from_s, to_s)| AnklesError::Gap {
                            file: self.file.clone(),
                            column: joint.column.clone(),
                            from_s,
                            to_s,
                            most_s,
                        })
                    };
                    let open = at(1.0)? - at(0.0)?;
                    for (k, point) in points.iter_mut().enumerate() {
                        let part = k as f64 / POINTS as f64;
                        *point = at(part)? + open * (0.5 - part);
                    }
                }
                Ok(cycle)
            })
            .collect()
    }

    /// Times from the spans' zero, and values; rows without a value are left out.
    fn values<'a>(&'a self, joint: &'a RawJoint, start_s: f64) -> impl Iterator<Item = (f64, f64)> + 'a {
        let rows = self.time_s.iter().zip(&joint.angle_deg).filter(|(_, angle)| angle.is_finite());
        rows.map(move |(time, angle)| (time - start_s, *angle))
    }
}

fn of_columns(
    name: &str,
    bytes: &[u8],
    how: &ReadOptions<'_>,
    columns: &[String; 2],
) -> Result<Option<Ankles>, TraceError> {
    const PLACES: [Joint; 2] = [Joint::LeftHip, Joint::RightHip];
    let mut how = how.clone();
    how.map.retain(|(joint, _)| !PLACES.contains(joint));
    how.map.extend(PLACES.into_iter().zip(columns.iter().cloned()));
    let raw = of_bytes(name, bytes, &how)?;
    let [left, right, ..] = raw.joints;
    Ok(left.zip(right).map(|(left, right)| Ankles { file: raw.file, time_s: raw.time_s, joints: [left, right] }))
}

/// The value at a time on the line between its neighbours; the times of the neighbours if they are more than `most_s` apart, or missing.
fn between(values: &[(f64, f64)], time_s: f64, most_s: f64) -> Result<f64, (f64, f64)> {
    // The end of a span may be beyond the last row by a rounding error.
    const ROUNDING_S: f64 = 1e-6;
    let after = values.partition_point(|(time, _)| *time <= time_s);
    let nearest = |index: usize| values.get(index).filter(|(time, _)| (time - time_s).abs() <= ROUNDING_S);
    match (after.checked_sub(1).and_then(|before| values.get(before)), values.get(after)) {
        (Some(&(from, a)), Some(&(to, b))) if to - from <= most_s => Ok(a + (b - a) * (time_s - from) / (to - from)),
        _ if nearest(after).is_some() => Ok(values[after].1),
        _ if after > 0 && nearest(after - 1).is_some() => Ok(values[after - 1].1),
        (from, to) => Err((from.map_or(time_s, |from| from.0), to.map_or(time_s, |to| to.0))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ankles(angle: impl Fn(f64) -> f64) -> Ankles {
        let time_s: Vec<f64> = (0..300).map(|row| 5.0 + f64::from(row) * 0.01).collect();
        let left = time_s.iter().map(|t| angle(t - 5.0)).collect();
        let right = time_s.iter().map(|t| -angle(t - 5.0)).collect();
        let joints = [RawJoint::degrees("l", left), RawJoint::degrees("r", right)];
        Ankles { file: "walk".into(), time_s, joints }
    }

    const SPANS: [Span; 1] = [Span { start_s: 0.5, end_s: 1.6 }];

    #[test]
    fn a_stride_is_cut_at_its_span_and_closed() {
        let wave = |t: f64| 12.0 * (std::f64::consts::TAU * t / 1.1).sin() + 2.0 * t;
        let cycles = ankles(wave).cycles(&SPANS, 5.0, 0.1).unwrap();
        for (k, (left, right)) in cycles[0][0].iter().zip(&cycles[0][1]).enumerate() {
            let t = 0.5 + 1.1 * k as f64 / POINTS as f64;
            // Closed: without the slope, and with the mean of the stride.
            assert!((left - (wave(t) - 2.0 * (t - 1.05))).abs() < 0.01 && (left + right).abs() < 1e-9, "{k}: {left}");
        }
    }

    #[test]
    fn a_gap_within_a_stride_is_an_error_and_one_outside_is_none() {
        let gap = |from: f64| ankles(move |t| if (from - 0.005..from + 0.295).contains(&t) { f64::NAN } else { t });
        assert!(gap(2.0).cycles(&SPANS, 5.0, 0.1).is_ok());
        let error = gap(1.0).cycles(&SPANS, 5.0, 0.1).unwrap_err().to_string();
        assert!(error.contains("`l` has no value from 0.990 s to 1.300 s") && error.contains("up to 0.1 s"), "{error}");
    }

    #[test]
    fn columns_that_are_not_there_are_named() {
        let text = "time_s,left_hip_deg\n0,1\n0.01,1\n";
        let read = |columns: Option<&[String; 2]>| {
            Ankles::read("walk.csv", text.as_bytes(), &ReadOptions::default(), columns).unwrap_err().to_string()
        };
        let error = read(None);
        assert!(error.contains("ankle_angle_l and ankle_angle_r") && error.contains("--ankles LEFT,RIGHT"), "{error}");
        let error = read(Some(&["foot_l".into(), "foot_r".into()]));
        assert!(error.starts_with("--ankles foot_l,foot_r: walk.csv") && error.contains("foot_l"), "{error}");
    }
}
