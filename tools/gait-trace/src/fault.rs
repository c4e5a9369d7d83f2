//! Errors of a recording's file: file, line, column, what was found, what is allowed and what to do.

use crate::recording::{Quantity, RecordingError};
use std::fmt;

/// What is wrong with a file. Each text says what is allowed.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[source] std::io::Error),
    /// The file has more bytes than the limit.
    #[error("is larger than {most} bytes; allowed is up to that: cut the recording")]
    TooLarge {
        /// The limit.
        most: u64,
    },
    /// The file is not text.
    #[error("is not text (byte {byte:#04x}); allowed is UTF-8 text: comma-separated values")]
    NotText {
        /// The first byte that is not text.
        byte: u8,
    },
    /// The file has no line.
    #[error("is empty; allowed is a header `time_s,left_knee_deg,...` and rows of numbers below it")]
    Empty,
    /// There are too few rows below the header.
    #[error("{rows} rows of numbers; allowed are 2 or more")]
    TooFewRows {
        /// Number found.
        rows: usize,
    },
    /// A column of the header is missing.
    #[error(
        "column `{wanted}` is missing{hint}; allowed is a header such as `time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg`"
    )]
    MissingColumn {
        /// The missing column.
        wanted: &'static str,
        /// The probable cause.
        hint: &'static str,
    },
    /// There is only a time column.
    #[error("no channel besides `time_s`; allowed are 1 or more, such as `left_knee_deg`")]
    NoChannels,
    /// A heading is neither a joint angle nor a pin.
    #[error(
        "unknown heading; allowed are `time_s`, angles in degrees such as `left_knee_deg`, and volts at a pin such as `PA1`"
    )]
    UnknownColumn,
    /// A heading occurs twice.
    #[error("the heading occurs twice; allowed is once")]
    DuplicateColumn,
    /// A row has more or fewer fields than the header.
    #[error("{found} fields; allowed are {wanted}, as in the header")]
    FieldCount {
        /// Number found.
        found: usize,
        /// Number of headings.
        wanted: usize,
    },
    /// A number has a decimal comma where only a decimal point can be read.
    #[error(
        "`{text}` has a decimal comma; allowed is a decimal point: write the file with decimal points; CSV with decimal commas is read where semicolons or tabs separate the fields"
    )]
    DecimalComma {
        /// The field.
        text: String,
    },
    /// Some numbers have decimal commas and others decimal points.
    #[error(
        "numbers with decimal commas here, and with decimal points elsewhere; allowed is one of both: export again"
    )]
    MixedDecimals,
    /// A row has more fields than the header, and all are whole numbers: decimal commas among commas.
    #[error(
        "{found} fields of whole numbers; allowed are {wanted}, as in the header: numbers with a decimal comma cannot be read where commas separate the fields; write the file with decimal points, or with semicolons between the fields"
    )]
    DecimalCommas {
        /// Number of fields found.
        found: usize,
        /// Number of headings.
        wanted: usize,
    },
    /// A field is not a number.
    #[error("`{text}` is not a number; allowed is a decimal number such as -12.5")]
    NotANumber {
        /// The field.
        text: String,
    },
    /// A field of a column of times is a time of day.
    #[error(
        "`{text}` is a time of day; allowed are numbers in s, ms, us or ns: write the time as seconds from the first row (`time_s`), or delete the column and give the rate of the rows (`--rate HZ`)"
    )]
    ClockTime {
        /// The field.
        text: String,
    },
    /// A field is not finite.
    #[error("`{text}` is not finite; allowed is a decimal number such as -12.5")]
    NotFinite {
        /// The field.
        text: String,
    },
    /// A value is out of range; usually the unit is wrong.
    #[error("{value} {unit} is out of range (wrong unit?); allowed is {least} to {most} {unit}", unit = .quantity.unit(), least = .quantity.allowed().0, most = .quantity.allowed().1)]
    Magnitude {
        /// The value.
        value: f64,
        /// The quantity that the column holds.
        quantity: Quantity,
    },
    /// The table as a whole is not valid.
    #[error("{0}")]
    Table(#[source] RecordingError),
    /// A time is not later than the time of the row before.
    #[error("time {value} s after {before} s; allowed is a later time in each row")]
    TimeOrder {
        /// The time.
        value: f64,
        /// The time of the row before.
        before: f64,
    },
    /// The file is not text; with the place of the first wrong byte.
    #[error("byte {byte:#04x} at offset {offset} is not text{hint}; allowed is UTF-8 text")]
    Bytes {
        /// The first byte that is not text.
        byte: u8,
        /// Its offset, counted from 0.
        offset: usize,
        /// What the file probably is.
        hint: &'static str,
    },
    /// The format is not known.
    #[error(
        "has an unknown format: {why}; allowed are CSV, OpenSim .mot and .sto, C3D, MCAP, and CSV exports of Rigol, Siglent, Tektronix and Keysight oscilloscopes"
    )]
    UnknownFormat {
        /// What was found.
        why: String,
    },
    /// The file is of a kind that is recognised and not read.
    #[error("this is {what}; Footfall does not read it: {instead}; allowed are the formats that docs/formats.md lists")]
    Unsupported {
        /// The kind of file, with its article.
        what: &'static str,
        /// What to do instead.
        instead: &'static str,
    },
    /// A file holds another quantity, or may do so.
    #[error(
        "{what}; allowed are files of joint angles: by the title `Coordinates` or `inverse kinematics`, by columns `/.../value`, by speeds beside them (`hip_flexion_l_u`), by a `pelvis_ty` in metres, or by `--unit degrees|radians` where the title names no other quantity"
    )]
    NotAngles {
        /// What the file says, or does not say.
        what: String,
    },
    /// A line above the header of a table names another quantity.
    #[error(
        "this line names {what}, and not joint angles, and the table is below it; allowed are angles in degrees or radians: `--unit degrees|radians` if they are, or delete the line"
    )]
    TitleOfOther {
        /// The quantity or its unit, in words.
        what: String,
    },
    /// The column of the times is mapped to a joint.
    #[error("the column of the times is mapped to {joint}; allowed is a column of angles or volts")]
    TimeAsJoint {
        /// The joint.
        joint: &'static str,
    },
    /// A field of the header cannot be used.
    #[error("`{field}` is {found}; allowed is {allowed}")]
    HeaderField {
        /// The field.
        field: String,
        /// Its value.
        found: String,
        /// Allowed values.
        allowed: String,
    },
    /// A field of a binary file cannot be used.
    #[error("byte {offset}: {field} is {found}; allowed is {allowed}")]
    Binary {
        /// Its offset, counted from 0.
        offset: usize,
        /// The field.
        field: String,
        /// Its value.
        found: String,
        /// Allowed values.
        allowed: String,
    },
    /// The XML of a file cannot be read.
    #[error("the XML cannot be read: {what}; allowed is a whole file of well-formed XML")]
    Xml {
        /// What is wrong.
        what: String,
    },
    /// A record of an MCAP file cannot be used.
    #[error("before byte {offset}: {what}")]
    Mcap {
        /// Number of bytes read so far.
        offset: u64,
        /// What is wrong, and what is allowed.
        what: String,
    },
    /// A quote is not closed on its line.
    #[error(
        "a quote is opened and not closed on this line; allowed are pairs of \" on one line: remove line breaks inside of quotes"
    )]
    OpenQuote,
    /// A line is too long.
    #[error("a line of {bytes} bytes; allowed are up to {most}")]
    LongLine {
        /// Length of the line, bytes.
        bytes: usize,
        /// The limit.
        most: usize,
    },
    /// There are more rows than the limit.
    #[error("more than {most} rows; allowed are up to that: cut the recording or reduce its rate")]
    TooManyRows {
        /// The limit.
        most: usize,
    },
    /// There are more columns than the limit.
    #[error("{found} columns; allowed are up to {most}")]
    TooManyColumns {
        /// Number found.
        found: usize,
        /// The limit.
        most: usize,
    },
    /// The header occurs again below rows of numbers.
    #[error("a second header; allowed is one, at the top: put each recording in a file of its own")]
    SecondHeader,
    /// Lines of text are above a table whose header is not recognised.
    #[error(
        "no header is recognised: this line has {found} fields, and the rows of numbers from line {first_row} on have {fields}; allowed is a header with a time and a joint (`time_s,left_knee_deg`) above rows of as many fields: delete the lines of text above the header, or name its columns with `--map time=COLUMN,left_hip=COLUMN,...`"
    )]
    NoHeader {
        /// Number of fields of the first line.
        found: usize,
        /// The line of the first row of numbers.
        first_row: u64,
        /// Number of its fields.
        fields: usize,
    },
    /// The header is separated by blanks.
    #[error(
        "the {words} words of this line are separated by blanks, as the numbers below it are; allowed are blanks between numbers only, since a heading may have one inside: separate the fields by commas, semicolons or tabs, or delete this line and name the columns by their numbers (`--map time=1,left_hip=2,...`)"
    )]
    BlankHeader {
        /// Number of words.
        words: usize,
    },
    /// Several lines may be the header.
    #[error("this line and line {other} may be the header; allowed is one table: put each in a file of its own")]
    SeveralHeaders {
        /// The other line.
        other: u64,
    },
    /// No column is recognised as the time.
    #[error(
        "no column is recognised as the time{hint}; the columns are {have}; allowed is one called `time`, `time_s`, `t`, `Time (s)` or `time_ms`, `--map time=COLUMN`{example}, or `--rate HZ` for rows at equal time steps"
    )]
    NoTime {
        /// What the file has.
        have: String,
        /// The probable cause.
        hint: &'static str,
        /// Some columns are joints.
        has_joints: bool,
        /// A map for the file, in words; empty where there is none.
        example: String,
    },
    /// No column is recognised as a joint.
    #[error(
        "no column is recognised as a joint; there are {have}; allowed are names such as `left_hip_deg`, `hip_flexion_l`, `LKneeAngles`, or `--map left_hip=COLUMN,...`{example}"
    )]
    NoJoints {
        /// What the file has.
        have: String,
        /// A map for the file, in words; empty where there is none.
        example: String,
    },
    /// The map names a column that the file does not have.
    #[error(
        "the map takes `{joint}` from `{wanted}`; the file has {have}; allowed is one of these, or its number from 1"
    )]
    MapColumn {
        /// The joint, or `time`.
        joint: &'static str,
        /// The column in the map.
        wanted: String,
        /// What the file has.
        have: String,
    },
    /// Two columns are recognised as the same joint.
    #[error(
        "`{first}` and `{second}` are both recognised as `{joint}`; allowed is one: choose with `--map {joint}=COLUMN`"
    )]
    TwoColumns {
        /// The joint, or `time`.
        joint: &'static str,
        /// The first column.
        first: String,
        /// The second column.
        second: String,
    },
    /// A column that the map gives a joint states another quantity than an angle.
    #[error(
        "`{column}` states {what}, which is no angle; a map chooses a column, not what it holds: allowed are angles in degrees or radians, and volts with `--calibration FILE`"
    )]
    NoAngle {
        /// The heading.
        column: String,
        /// The unit or the quantity that it states, in words.
        what: String,
    },
    /// A column that the map gives a joint has an unknown unit in brackets.
    #[error(
        "`{column}`: `{what}` may be a unit, and is no known one of angles; allowed are degrees, radians, volts with `--calibration FILE`, or `--unit degrees|radians` if the values are angles"
    )]
    UnknownUnit {
        /// The heading.
        column: String,
        /// What is in brackets.
        what: String,
    },
    /// The columns of a joint are a quaternion.
    #[error(
        "{columns} are the components of a quaternion, not angles; allowed are columns of joint angles in degrees or radians: convert the quaternions to joint angles first, or name a column of angles with `--map {joint}=COLUMN`"
    )]
    Quaternion {
        /// The columns of its components.
        columns: String,
        /// The joint.
        joint: &'static str,
    },
    /// The columns of a joint are components that nothing calls angles.
    #[error(
        "{columns} are components without a word or a unit of an angle, as positions of markers have them, not joint angles; allowed are columns of joint angles: headings that say so (`left_knee_angle_x`, `left_knee_x (deg)`), `--map` with a column of angles for every joint, or `--axis x|y|z` if the components are angles"
    )]
    Positions {
        /// The columns of the components.
        columns: String,
    },
    /// A joint has several components and none is clearly flexion.
    #[error(
        "{columns} are components of the angles of one joint, and it is unclear which one is flexion: {why}; allowed is `--axis x|y|z` for all joints, or `--map` with the column of every joint"
    )]
    UnclearFlexion {
        /// The columns of the components.
        columns: String,
        /// Why it is unclear.
        why: String,
    },
    /// The values of all joints were put between the same limits.
    #[error(
        "no unit is stated, and the values of every joint run exactly between 0 and 1 or -1 and 1: they are normalised by their smallest and largest value, and no longer angles; allowed are the angles before the normalisation, or `--unit radians` if they are radians"
    )]
    Normalised,
    /// Many values are the same impossible number.
    #[error(
        "{codes} in {rows} of {of} rows is no angle and looks like a code for missing values; allowed are angles of up to {most} degrees, and an empty field or `nan` where a value is missing: replace the code by an empty field"
    )]
    MissingCode {
        /// The numbers.
        codes: String,
        /// The rows that have them.
        rows: usize,
        /// All rows.
        of: usize,
        /// Largest allowed angle, degrees.
        most: f64,
    },
    /// The unit of the angles is unknown.
    #[error(
        "the unit of the angles is unknown{why}; allowed are a suffix `_deg` or `_rad`, `[deg]` or `(rad)`, `--unit degrees|radians`, or `--calibration FILE` for volts"
    )]
    NoUnit {
        /// Why the unit does not follow from the values.
        why: String,
    },
    /// The unit that the file names does not fit its values.
    #[error(
        "the file names {said}, but the largest of {values} values is {largest:.3} (radians?); allowed is `--unit degrees` or `--unit radians` to confirm the unit"
    )]
    UnitDoubt {
        /// The unit that the file names.
        said: &'static str,
        /// Number of values.
        values: usize,
        /// The largest value.
        largest: f64,
    },
    /// The time steps are too long for seconds.
    #[error(
        "read as seconds, the median time step is {step}, too long for a gait ({likely}?); allowed is a heading with the right unit, such as {heading}, or `--map time=COLUMN` for another column"
    )]
    TimeUnit {
        /// The median time step.
        step: f64,
        /// What the times probably are.
        likely: &'static str,
        /// The heading that says so.
        heading: &'static str,
    },
    /// The time steps are too short for seconds, which nothing states.
    #[error(
        "the heading names no unit; read as seconds, the median time step is {step:e}, too short for a recording of angles (minutes, hours or days?); allowed is a heading with the unit of the time (`time_s`, `time_ms`) and times in that unit, `--map time=COLUMN` for another column, or `--calibration FILE` for an oscilloscope's volts"
    )]
    TimeTooShort {
        /// The median time step.
        step: f64,
    },
    /// The heading of the times names a unit that is not read.
    #[error(
        "the heading names the unit `{unit}`, which is not read; allowed are times in s, ms, us or ns (`time_s`, `Time (ms)`): convert the times, or delete the column and give the rate of the rows (`--rate HZ`)"
    )]
    TimeOfUnit {
        /// The unit.
        unit: String,
    },
    /// Columns beside those of the joints have no heading.
    #[error(
        "`{first}` and the other joints each have a column without a heading on their right, as a cell over several components leaves it, and it is unclear which column is flexion; allowed is a heading in every column (`Left Knee Angle X`), or `--map left_hip=COLUMN,...` with the number of the column of every joint"
    )]
    MergedHeading {
        /// The heading of the first joint.
        first: String,
    },
    /// A column is in volts and there is no calibration.
    #[error(
        "`{channel}` is in volts; allowed is with a calibration that converts volts to angles (`--calibration FILE`)"
    )]
    NoCalibration {
        /// The channel.
        channel: String,
    },
    /// A calibration is given and no column is in volts.
    #[error(
        "a calibration is given (`--calibration`), but no column is in volts: the file says that this one is {said}; allowed is without `--calibration`, or with `--map JOINT=COLUMN` of columns in volts"
    )]
    CalibrationUnused {
        /// What the column holds.
        said: &'static str,
    },
    /// A column without unit cannot be both volts and an angle.
    #[error(
        "both `--calibration` and `--unit {unit}` are given; allowed is `--calibration` for volts or `--unit` for angles"
    )]
    UnitAndCalibration {
        /// The requested unit.
        unit: &'static str,
    },
    /// A column counts frames and the rate is unknown.
    #[error("the column counts frames; allowed is with the rate in frames a second (`--rate HZ`)")]
    NoRate,
    /// The rate is given and the file has its own times.
    #[error("a rate is given (`--rate`), but the file has its own time in {has}; allowed is without `--rate`")]
    RateAndTime {
        /// What the time is from.
        has: String,
    },
    /// An axis is given and the file has no angles of three components.
    #[error(
        "an axis is given (`--axis`), but {what}; allowed is `--axis` for C3D, Vicon and Visual3D files with joint angles, and for CSV files with columns of their components (`LKneeAngles_X`, `LKneeAngles_Y`, ...)"
    )]
    NoAxes {
        /// What the file has instead.
        what: &'static str,
    },
    /// A topic is given and the file has no topics.
    #[error("a topic is given (`--topic`), but this is no MCAP file; allowed is `--topic` for MCAP files")]
    NoTopics,
    /// No topic of that name has fields that may be joints.
    #[error(
        "no topic `{wanted}` with numbers of joints (`--topic`); the file has {have}; allowed is one of these with joints"
    )]
    NoTopic {
        /// The topic that is asked for.
        wanted: String,
        /// What the file has.
        have: String,
    },
    /// The joints are in several topics.
    #[error(
        "joints are in several topics: {have}; allowed is one: choose with `--topic TOPIC`, or give each joint with `--map left_hip=TOPIC.NAME,...`"
    )]
    SeveralTopics {
        /// The topics.
        have: String,
    },
    /// A column tells several recordings apart.
    #[error(
        "the rows of several recordings are in one table: {values}; allowed is one: choose with `--where {example}`, or read all rows with `--where {all}` if this column does not tell recordings apart"
    )]
    SeveralRecordings {
        /// The values and their numbers of rows.
        values: String,
        /// A filter that chooses one.
        example: String,
        /// A filter that takes all.
        all: String,
    },
    /// No row has the value that is asked for.
    #[error("no row has `{value}` (`--where`); there are {have}; allowed is one of these")]
    NoSuchRows {
        /// The value.
        value: String,
        /// The values of the column.
        have: String,
    },
    /// A filter of rows names a column that the file does not have.
    #[error(
        "`--where` names the column `{wanted}`; the file has {have}; allowed is one of these, or its number from 1"
    )]
    WhereColumn {
        /// The column in the filter.
        wanted: String,
        /// What the file has.
        have: String,
    },
    /// Rows are chosen in a file of another format than CSV.
    #[error("rows are chosen (`--where`), but this is no CSV file; allowed is `--where` for CSV files")]
    NoRowFilter,
    /// The rate does not agree with the times of the file.
    #[error(
        "a rate is given (`--rate {rate_hz}`), but the times of `{column}` differ from it by up to {apart_s:.6} s: {rows} rows in {span_s} s are {found_hz:.3} Hz; allowed is a difference up to {allowed_s:.6} s: correct the rate, or leave `--rate` out"
    )]
    RateDisagrees {
        /// The given rate, Hz.
        rate_hz: f64,
        /// The column of times.
        column: String,
        /// Largest difference, seconds.
        apart_s: f64,
        /// Number of rows.
        rows: usize,
        /// Time from the first to the last row, seconds.
        span_s: f64,
        /// The rate that these have, Hz.
        found_hz: f64,
        /// Largest allowed difference, seconds.
        allowed_s: f64,
    },
    /// A map is given for a file without columns of joints.
    #[error(
        "a map is given (`--map`), but the file has {has}; allowed is without `--map`: hip, knee and ankle are found by name"
    )]
    NoColumns {
        /// What the file has instead.
        has: &'static str,
    },
    /// A column of times is given and the file has no such column.
    #[error(
        "a column of times is given (`--map time=COLUMN`), but the time is {has}; allowed is without it, and with columns of joints"
    )]
    NoTimeColumn {
        /// What the time is from.
        has: &'static str,
    },
    /// The joints of several subjects, or of several trials, are in one file.
    #[error(
        "the file has joint angles of several {what}: {have}; allowed is one: choose it with `--map {example}`, and the other joints are taken from there too"
    )]
    SeveralGroups {
        /// What there are several of.
        what: &'static str,
        /// Their names.
        have: String,
        /// A map that chooses one.
        example: String,
    },
    /// The markers of several subjects are in one file.
    #[error(
        "the file has markers of several subjects: {have}; allowed is one: export each subject to a file of its own"
    )]
    SeveralSubjects {
        /// Their names.
        have: String,
    },
    /// An export of Vicon Nexus has no section of model outputs.
    #[error(
        "no section `Model Outputs`; there are {have}; allowed is an export with it: process the trial with Plug-in Gait in Nexus, then export it again, or as C3D"
    )]
    NoModelOutputs {
        /// The sections that the file has.
        have: String,
    },
    /// A field is not the number of a frame.
    #[error("`{text}` is not the number of a frame; allowed is a whole number from 0 to 1000000000")]
    NotAFrame {
        /// The field.
        text: String,
    },
    /// Rows continue below the line that ends them.
    #[error(
        "rows of numbers below the blank line that ends `{section}`; allowed are rows without blank lines between them"
    )]
    RowsBelowEnd {
        /// The section.
        section: &'static str,
    },
    /// No channel of an oscilloscope is assigned to a joint.
    #[error("no channel is assigned to a joint; the file has {have}; allowed is `--map left_knee=CHANNEL,...`")]
    NoChannelMap {
        /// What the file has.
        have: String,
    },
    /// The joint columns have no number.
    #[error("no row has a number in any joint column; allowed are gaps, but not only gaps")]
    NoValues,
    /// A file of motion capture has neither joint angles nor joint centres.
    #[error(
        "neither joint angles nor joint centres: the points are {have}; allowed are angles such as `LHipAngles`, `LKneeAngles`, trajectories of hip, knee and ankle such as `LHJC`, `LKJC`, `LAJC`, or markers such as `LASI`, `RASI`, `SACR` for the hips, `LKNE`, `LANK`"
    )]
    NoTrajectories {
        /// What the file has.
        have: String,
    },
    /// The vertical or the walking direction does not follow from the trajectories.
    #[error("{what} does not follow from the trajectories; allowed are {allowed}")]
    NoFrameOfReference {
        /// The vertical, or the walking direction.
        what: &'static str,
        /// What is needed.
        allowed: &'static str,
    },
}

/// A [`Fault`] and its place.
#[derive(Debug)]
pub struct TraceError {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: Option<u64>,
    /// The column, counted from 1, and its heading.
    pub column: Option<(usize, String)>,
    /// What is wrong.
    pub fault: Box<Fault>,
}

impl TraceError {
    pub(crate) fn new(file: &str, line: Option<u64>, fault: Fault) -> Self {
        Self { file: file.into(), line, column: None, fault: Box::new(fault) }
    }

    pub(crate) fn in_column(mut self, index: usize, heading: &str) -> Self {
        // A heading may be as long as its line; an error is for reading.
        self.column = Some((index + 1, heading.chars().take(80).collect()));
        self
    }
}

impl fmt::Display for TraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        if let Some((index, heading)) = &self.column {
            write!(f, "column {index} `{heading}`: ")?;
        }
        self.fault.fmt(f)
    }
}

impl std::error::Error for TraceError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &*self.fault {
            Fault::Io(error) => Some(error),
            Fault::Table(error) => Some(error),
            _ => None,
        }
    }
}
