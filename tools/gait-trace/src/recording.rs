//! A recording as a table: strictly increasing times in seconds and channels of finite numbers, all of one length, at least two rows.
//!
//! Times may be unevenly spaced. The quantity of a channel follows from the name of its column:
//! `left_knee_deg` is the angle `left_knee` in degrees, `PA1` the volts at a pin of that name.

use joint_units::Radians;

/// Largest absolute angle that is accepted, degrees. A larger one means a wrong unit or a damaged file.
pub const MAX_ANGLE_DEG: f64 = 200.0;

/// Smallest voltage that is accepted at a pin of the converter, volts: just beyond its absolute maximum ratings.
pub const MIN_PIN_VOLTS: f64 = -0.5;
/// Largest voltage that is accepted at a pin, volts; see [`MIN_PIN_VOLTS`].
pub const MAX_PIN_VOLTS: f64 = 6.0;

/// The quantity that a channel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Joint angle in degrees, flexion positive.
    Angle,
    /// Volts at a pin of the microcontroller.
    PinVolts,
}

impl Quantity {
    /// Smallest and largest accepted value, in [`Self::unit`].
    #[must_use]
    pub const fn allowed(self) -> (f64, f64) {
        match self {
            Self::Angle => (-MAX_ANGLE_DEG, MAX_ANGLE_DEG),
            Self::PinVolts => (MIN_PIN_VOLTS, MAX_PIN_VOLTS),
        }
    }

    /// Name of the unit.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Angle => "degrees",
            Self::PinVolts => "volts",
        }
    }
}

/// One column of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    name: String,
    quantity: Quantity,
    values: Vec<f64>,
}

impl Channel {
    /// A channel; [`Recording::build`] checks its values.
    #[must_use]
    pub fn new(name: impl Into<String>, quantity: Quantity, values: Vec<f64>) -> Self {
        Self { name: name.into(), quantity, values }
    }

    /// The name without the unit: `left_knee`, `PA1`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The quantity.
    #[must_use]
    pub const fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// The values, in degrees or volts.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The angles in radians, as the cores take them.
    pub fn radians(&self) -> impl ExactSizeIterator<Item = Radians> + '_ {
        self.values.iter().map(|&degrees| Radians::from_degrees(degrees as f32))
    }

    /// Name and quantity of a column from its heading; `None` for a heading that is neither an angle nor a pin.
    ///
    /// ```
    /// use gait_trace::{Channel, Quantity};
    /// assert_eq!(Channel::of_column("left_knee_deg"), Some(("left_knee", Quantity::Angle)));
    /// assert_eq!(Channel::of_column("PA1"), Some(("PA1", Quantity::PinVolts)));
    /// assert_eq!(Channel::of_column("left_knee_rad"), None);
    /// ```
    #[must_use]
    pub fn of_column(column: &str) -> Option<(&str, Quantity)> {
        if let Some(name) = column.strip_suffix("_deg") {
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            return (!name.is_empty() && name.chars().all(plain)).then_some((name, Quantity::Angle));
        }
        let (port, number) = (column.strip_prefix('P')?.get(..1)?, column.get(2..)?);
        let is_pin = matches!(port.as_bytes(), [b'A'..=b'I'])
            && number.parse::<u8>().is_ok_and(|n| n < 16 && n.to_string() == number);
        is_pin.then_some((column, Quantity::PinVolts))
    }

    /// The heading of the column: the inverse of [`Channel::of_column`].
    #[must_use]
    pub fn column(&self) -> String {
        match self.quantity {
            Quantity::Angle => format!("{}_deg", self.name),
            Quantity::PinVolts => self.name.clone(),
        }
    }
}

/// Why a table is not valid. `row` counts the rows of numbers from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// Fewer than two rows.
    #[error("{rows} rows of numbers; allowed are 2 or more")]
    TooFewRows {
        /// Number of rows.
        rows: usize,
    },
    /// There is no channel besides time.
    #[error("no channel besides the time; allowed are 1 or more")]
    NoChannels,
    /// A channel has more or fewer rows than the time column.
    #[error("channel `{channel}` has {found} rows; allowed are {wanted}, one per time")]
    Length {
        /// The channel.
        channel: String,
        /// Number of its rows.
        found: usize,
        /// Number of times.
        wanted: usize,
    },
    /// Two channels have one name.
    #[error("channel `{channel}` occurs twice; allowed is once")]
    Twice {
        /// The channel.
        channel: String,
    },
    /// A time is not finite.
    #[error("row {row}: time {value} s; allowed is a finite number")]
    TimeNotFinite {
        /// The row.
        row: usize,
        /// The time.
        value: f64,
    },
    /// A time is not later than the time of the row before.
    #[error("row {row}: time {value} s after {before} s; allowed is a later time in each row")]
    TimeOrder {
        /// The row.
        row: usize,
        /// The time.
        value: f64,
        /// The time of the row before.
        before: f64,
    },
    /// A value is not finite or out of range; usually the unit is wrong.
    #[error("row {row}: `{channel}` is {value} {unit}; allowed is {least} to {most}")]
    Value {
        /// The row.
        row: usize,
        /// The channel.
        channel: String,
        /// The value.
        value: f64,
        /// Unit of the values.
        unit: &'static str,
        /// Smallest allowed value.
        least: f64,
        /// Largest allowed value.
        most: f64,
    },
}

/// The recording does not have the requested channel.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no channel `{wanted}`; the recording has {have}")]
pub struct NoChannel {
    /// The requested name.
    pub wanted: String,
    /// The names of the recording's channels.
    pub have: String,
}

/// A checked table of times and channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    time_s: Vec<f64>,
    channels: Vec<Channel>,
}

impl Recording {
    /// Checks the table and builds the recording.
    ///
    /// # Errors
    /// The first rule that the table breaks.
    ///
    /// ```
    /// use gait_trace::{Channel, Quantity, Recording, RecordingError};
    /// let knee = |values| vec![Channel::new("knee", Quantity::Angle, values)];
    /// assert!(Recording::build(vec![0.0, 0.5], knee(vec![10.0, 20.0])).is_ok());
    /// let backwards = Recording::build(vec![0.5, 0.5], knee(vec![10.0, 20.0]));
    /// assert_eq!(backwards, Err(RecordingError::TimeOrder { row: 1, value: 0.5, before: 0.5 }));
    /// ```
    pub fn build(time_s: Vec<f64>, channels: Vec<Channel>) -> Result<Self, RecordingError> {
        if channels.is_empty() {
            return Err(RecordingError::NoChannels);
        }
        if time_s.len() < 2 {
            return Err(RecordingError::TooFewRows { rows: time_s.len() });
        }
        for (row, &value) in time_s.iter().enumerate() {
            if !value.is_finite() {
                return Err(RecordingError::TimeNotFinite { row, value });
            }
            let before = row.checked_sub(1).map_or(f64::NEG_INFINITY, |before| time_s[before]);
            if value <= before {
                return Err(RecordingError::TimeOrder { row, value, before });
            }
        }
        for (index, channel) in channels.iter().enumerate() {
            let name = || channel.name.clone();
            if channels[..index].iter().any(|other| other.name == channel.name) {
                return Err(RecordingError::Twice { channel: name() });
            }
            if channel.values.len() != time_s.len() {
                let (found, wanted) = (channel.values.len(), time_s.len());
                return Err(RecordingError::Length { channel: name(), found, wanted });
            }
            let (least, most) = channel.quantity.allowed();
            if let Some(row) = channel.values.iter().position(|value| !(least..=most).contains(value)) {
                let (value, unit) = (channel.values[row], channel.quantity.unit());
                return Err(RecordingError::Value { row, channel: name(), value, unit, least, most });
            }
        }
        Ok(Self { time_s, channels })
    }

    /// The times, in seconds.
    #[must_use]
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// All channels, in the order of the file.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Time from the first to the last row, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }

    /// The channel of that name.
    ///
    /// # Errors
    /// The recording has no such channel; the error lists its channels.
    pub fn channel(&self, name: &str) -> Result<&Channel, NoChannel> {
        self.channels.iter().find(|channel| channel.name == name).ok_or_else(|| NoChannel {
            wanted: name.into(),
            have: self.channels.iter().map(|channel| format!("`{}`", channel.name)).collect::<Vec<_>>().join(", "),
        })
    }

    /// A recording of one channel only.
    ///
    /// # Errors
    /// As [`Recording::channel`].
    pub fn only(&self, name: &str) -> Result<Self, NoChannel> {
        Ok(Self { time_s: self.time_s.clone(), channels: vec![self.channel(name)?.clone()] })
    }

    /// The channel of a joint: the one of the joint's name (`left_knee`), or the only channel of a recording if its name does not name
    /// another joint or the other side (`knee`, `left`, `PA1`).
    ///
    /// # Errors
    /// The recording has no such channel.
    pub fn of_joint(&self, joint: joint_units::Joint) -> Result<&Channel, NoChannel> {
        match self.channels.as_slice() {
            [only] if !contradicts(only.name(), joint) => Ok(only),
            _ => self.channel(joint.name()),
        }
    }

    /// The value of a channel at a time in seconds: linear between rows, constant beyond both ends.
    #[must_use]
    pub fn at(&self, channel: &Channel, time_s: f64) -> f64 {
        let right = self.time_s.partition_point(|&row| row <= time_s);
        let last = self.time_s.len().min(channel.values.len()) - 1;
        if right == 0 {
            return channel.values[0];
        }
        if right > last {
            return channel.values[last];
        }
        let (t0, t1) = (self.time_s[right - 1], self.time_s[right]);
        let (v0, v1) = (channel.values[right - 1], channel.values[right]);
        v0 + (v1 - v0) * ((time_s - t0) / (t1 - t0))
    }
}

/// Whether a name has a word for another part of the person than the joint: `right_knee`, `left_hip` and `ankle` for the left knee.
fn contradicts(name: &str, joint: joint_units::Joint) -> bool {
    const PARTS: [&str; 20] = [
        "left", "right", "l", "r", "hip", "knee", "ankle", "subtalar", "foot", "toe", "pelvis", "trunk", "lumbar",
        "neck", "head", "shoulder", "elbow", "wrist", "thigh", "shank",
    ];
    let own = |word: &str| joint.name().split('_').any(|own| own == word || (word.len() == 1 && own.starts_with(word)));
    name.split('_').any(|word| PARTS.contains(&word) && !own(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle(name: &str, values: Vec<f64>) -> Channel {
        Channel::new(name, Quantity::Angle, values)
    }

    #[test]
    fn every_rule_is_checked() {
        let times = vec![0.0, 1.0];
        let good = || angle("knee", vec![1.0, 2.0]);
        let build = |times: &[f64], channels: Vec<Channel>| Recording::build(times.to_vec(), channels).unwrap_err();
        assert_eq!(build(&times, vec![]), RecordingError::NoChannels);
        assert_eq!(build(&[0.0], vec![angle("knee", vec![1.0])]), RecordingError::TooFewRows { rows: 1 });
        assert!(matches!(build(&[0.0, f64::NAN], vec![good()]), RecordingError::TimeNotFinite { row: 1, .. }));
        assert!(matches!(build(&[0.0, f64::INFINITY], vec![good()]), RecordingError::TimeNotFinite { row: 1, .. }));
        assert!(matches!(build(&[1.0, 0.0], vec![good()]), RecordingError::TimeOrder { row: 1, .. }));
        assert!(matches!(build(&times, vec![good(), good()]), RecordingError::Twice { .. }));
        assert!(matches!(
            build(&times, vec![angle("knee", vec![1.0])]),
            RecordingError::Length { found: 1, wanted: 2, .. }
        ));
        for bad in [f64::NAN, f64::INFINITY, 200.1, -200.1] {
            let error = build(&times, vec![angle("knee", vec![0.0, bad])]);
            assert!(matches!(error, RecordingError::Value { row: 1, .. }), "{error}");
        }
        assert!(Recording::build(times, vec![angle("knee", vec![-200.0, 200.0])]).is_ok());
    }

    #[test]
    fn headings_give_the_quantity() {
        for bad in ["", "_deg", "Left_deg", "knee deg", "PA16", "PA01", "PJ1", "P", "PA", "knee", "time_s", "PÄ1"] {
            assert_eq!(Channel::of_column(bad), None, "{bad}");
        }
        for good in ["left_hip_deg", "knee_deg", "PA0", "PI15"] {
            let (name, quantity) = Channel::of_column(good).unwrap();
            assert_eq!(Channel::new(name, quantity, vec![]).column(), good);
        }
    }

    #[test]
    fn values_are_linear_between_rows_and_constant_beyond() {
        let recording = Recording::build(vec![1.0, 2.0, 4.0], vec![angle("knee", vec![0.0, 10.0, 0.0])]).unwrap();
        let knee = &recording.channels()[0];
        for (time, want) in [(0.0, 0.0), (1.0, 0.0), (1.25, 2.5), (2.0, 10.0), (3.0, 5.0), (4.0, 0.0), (9.0, 0.0)] {
            assert_eq!(recording.at(knee, time), want, "at {time}");
        }
    }

    #[test]
    fn a_single_channel_stands_for_a_joint_it_may_be() {
        use joint_units::Joint;
        let times = vec![0.0, 1.0];
        let one = Recording::build(times.clone(), vec![angle("knee", vec![1.0, 2.0])]).unwrap();
        assert_eq!(one.of_joint(Joint::LeftKnee).unwrap().name(), "knee");
        assert!(one.of_joint(Joint::LeftHip).is_err(), "a knee is no hip");
        for (name, joint, fits) in [
            ("right_knee", Joint::LeftKnee, false),
            ("left_hip", Joint::LeftKnee, false),
            ("knee_angle_r", Joint::LeftKnee, false),
            ("knee_angle_l", Joint::LeftKnee, true),
            ("ankle", Joint::LeftKnee, false),
            ("left", Joint::LeftKnee, true),
            ("goniometer", Joint::LeftKnee, true),
            ("PA1", Joint::RightHip, true),
        ] {
            let one = Recording::build(times.clone(), vec![angle(name, vec![1.0, 2.0])]).unwrap();
            assert_eq!(one.of_joint(joint).is_ok(), fits, "{name} for {}", joint.name());
        }
        let two = vec![angle("left_hip", vec![1.0, 2.0]), angle("right_hip", vec![1.0, 2.0])];
        let two = Recording::build(times, two).unwrap();
        assert_eq!(two.of_joint(Joint::LeftHip).unwrap().name(), "left_hip");
        let error = two.of_joint(Joint::LeftKnee).unwrap_err().to_string();
        assert_eq!(error, "no channel `left_knee`; the recording has `left_hip`, `right_hip`");
    }
}
