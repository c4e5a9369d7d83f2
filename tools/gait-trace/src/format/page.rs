//! The page `docs/formats.md`, generated from the descriptions of the readers.

use crate::format::description::Description;
use crate::format::{c3d, gcd, mapped_csv, mcap_file, mvnx, opensim, scope, trc, unsupported, vicon, visual3d};
use std::fmt::Write as _;

const ALL: &[&Description] = &[
    &mapped_csv::DESCRIPTION,
    &scope::DESCRIPTION,
    &opensim::DESCRIPTION,
    &c3d::DESCRIPTION,
    &trc::DESCRIPTION,
    &vicon::DESCRIPTION,
    &visual3d::DESCRIPTION,
    &gcd::DESCRIPTION,
    &mcap_file::DESCRIPTION,
    &mvnx::DESCRIPTION,
];

const HEAD: &str = "# Formats of recordings

<!-- Generated from the readers; FOOTFALL_WRITE_DOCS=1 cargo test -p gait-trace --test formats_page writes this file again. -->

`footfall fit`, `convert` and `entrain` read these formats; the content decides which one a file has, the extension only where the content
does not. What a file does not say is either assumed, and then reported as a note, or asked for in an error that names the option. A
calibration for a file without volts is an error, and so are volts without one where a heading or a row of units names them. A column
without a unit is read as volts if a calibration is given, else as angles: look at what `footfall check --trace` says of it.

";

const TAIL: &str = "
## Angles, and other quantities

Forces, speeds, activations and errors are written in columns that are named after joints too. A table holds angles if something says so: the format,
a heading with a unit of angles, or what the row of OpenSim above lists. A title line that names another quantity is refused, in an OpenSim file
(`PositionErrors`, `Static Optimization`) and above the header of a CSV file (`Joint moments`); where a title says nothing, `--unit degrees` or `--unit radians`
says that the columns are angles. Where only the unit in degrees speaks for angles they are read, with a warning.

## Warnings and guesses

What a file does not say and the program guesses is a warning, and `--strict` refuses a recording with a warning: angles by their unit alone, a component of the
angles by its movement, a sign that the shape of the strides changed, a sign of knees by the shape. The message names the option that confirms it.

## Signs

Results are flexion positive. Where the format defines flexion as positive, or the angle is computed from positions, the sign is known, and no movement
changes it: a stiff, a locked or an overextended knee may have any shape. Plug-in Gait defines it for the first component of `LHipAngles`, `RHipAngles`,
`LKneeAngles` and `RKneeAngles`, GCD and MVNX for hips and knees, OpenSim for `hip_flexion`, by its name. A sign that is known and makes a joint impossible is an
error that names the option.

Other hips are judged by the shape of their strides and by the lead of the knee: where both show extension as positive the sign is
changed, with a warning, because it is a guess. Where they show nothing, as in less than a stride, it is assumed that flexion is positive, with a warning
too. `--hip-sign flexion` or `--hip-sign extension` names the sign of both hips, goes before all of this, and ends the warning. A person who walks backwards moves nearly as in a recording of walking that is played backwards, and
neither the shape nor the lead of the knee is then that of walking: give the option for such a file, where its sign is not known. A finding says where
the shape contradicts a sign that is known or named. Visual3D defines no sign: it is that of the model, and an angle may be negated there. Where
positions are such that the knees bend to the other side, the hips are changed with them: left and right may be exchanged in the file.

The sign of other knees is one decision for both: a knee that is beyond -40 degrees and stays below +15 counts extension as positive, one beyond
+40 that stays above -15 counts flexion as positive, and so do means beyond 25 degrees. A knee with recurvatum, at -27 to 14 degrees, shows no sign, and follows the other one; so does a
knee that hardly moves. Where the angles of neither knee decide, the shape of the
strides does, which is a guess; where it is unclear too, `--knee-sign flexion` or `--knee-sign extension` is required. In CSV, MCAP and Visual3D files two knees that each show a sign, and different ones, are each read
with their own, as two goniometers have; the knees of an OpenSim model, of a C3D file or of markers have one sign, with which both are possible, or are refused. An OpenSim file does not name its model:
gait2354, gait2392 and the models made from them count a bent knee as negative, Rajagopal's, Lai's and OpenCap's as positive; the knees show which. A sign that was changed is reported for each joint, with its angles and the reason. A hip that moves by less than 5 degrees shows no sign:
that of its file is assumed, with a warning, unless it is known or named; so are two knees of which neither moves. Knees with a mean beyond 120 degrees are the angle between thigh and shank, of which a straight leg has 180: they are refused.

A column whose name counts extension as positive (`left_hip_extension_deg`) is read only where a map names it; the message has the map and the options of
the signs.

What `footfall convert` writes is flexion positive as far as that is known. A line `signs` of its record has a word for each joint, and a later read of the file
goes by it:

| word | flexion is positive because | when the file is read again |
|---|---|---|
| `named` | an option named the sign | known: the sign is not changed |
| `known` | the format or the positions say so, or the angles of the knees | known: the sign is not changed |
| `shape` | the shape of the strides shows it, and nothing was changed | judged by the shape again |
| `turned` | the shape of the strides showed the other sign, which was changed; or the knees of the same markers bend to the other side | not changed again, and a warning again; an option confirms it |
| `assumed` | nothing shows it | not known: judged again, and a warning again |

An option names the sign of the file that is read, and in a conversion flexion is positive: `--hip-sign flexion` confirms that, and `--hip-sign extension`,
which was right for the file before, turns the angles back, with a warning where the sign is `named` or `known`.

Without that line nothing is known of the signs of such a file. A spreadsheet may save it again: a byte order mark and separators behind the lines are left out.

## Cycles

A time that runs from 0 to 1, or from 0 to 100 with 401 rows or fewer, is the fraction of one cycle if the angles at both ends are equal
within 3 degrees or a tenth of their range, and do not repeat in halves, thirds or quarters of it: then it is a time of several strides. It is reported, and `--stride-time S` gives the real duration. If the ends differ by more, the
time is read as seconds, which is reported too; `--stride-time S` then makes one stride of it.

Curves whose left and right hips are in phase, or knees where there are no hips, each count from the contact of their own foot, as reports print them. They are refused, unless `--own-cycles` says so:
then the right leg is moved by half of the cycle, which is reported.

A recording in seconds of exactly one cycle is read too, wherever it begins, if its ends meet and its legs are half of it apart.

## One leg

A file with hip and knee of one leg is refused for a fit, which needs both. With `--mirror` the other leg is made from the one that is there, half a stride later; this is reported for each joint.

## Turns

The period of a stride is judged by both legs: after half of a stride each leg is like the other one, so that two different strides of a turn are not taken for one. Where
a recording has two or three strides and two of them differ by more than 5 degrees (root mean square), as in a turn, a warning says where; of four strides and more, those that differ are left out.

A GCD file has a cycle of each leg, each from the contact of its own foot. The right leg is moved to the cycle of the left one, by
`LeftOppositeFootContact` percent, from 20 to 80, in whole points, so that no angle is made up; without that value it is moved by half a cycle. Both are reported.

## Components

A CSV file may have several columns of a joint: `left_knee_angle_x`, `left_knee_angle_y`, `left_knee_angle_z (deg)`. The component that clearly moves most at the
knees is read for all joints, with a warning; where none does, `--axis x|y|z` or a map of every joint is required. Columns with the names of Plug-in Gait (`LKneeAngles_X`) have
flexion in X, as it defines, also where a stiff knee rotates more than it bends; where another component moves by 40 degrees and more, and 2.5 times as far as X, they are of another model, and `--axis` is required. Components whose headings have no
word or unit of an angle are positions of markers, and those with a fourth one, `w`, are quaternions: both are errors.

## Several subjects, recordings or ranges

A table of CSV may have the rows of several recordings, separated by a column called `subject`, `id`, `participant`, `trial`, `session`, `side`, or
another such name, also with `_id`, `_no` or `_name` behind it. Several values in such a column are an error that lists them: `--where subject=S01`
reads the rows with that value, `--where` may be repeated, and `--where 'subject=*'` reads all rows of a column that does not tell recordings apart. One
value is a note. A column with another value in nearly every row counts rows. A column of another name is treated as such a one if it has up to 50
texts, each in long blocks of rows; labels of phases and events come again in each stride. Where no column tells them apart, these are errors: times that begin again;
16 rows or more with the time of the row before, if most have angles farther from it than those of the next time are; and rows that take turns between two
recordings. Other rows with the time of the row before are dropped, which is reported.

A file of Vicon Nexus, Visual3D or C3D may have the angles of several subjects, recordings, ranges of a recording or folders. It is refused with
their names. A map of one joint chooses, and the other joints are taken from there too: `--map left_hip=Anna:LHipAngles`,
`--map 'left_hip=walk2.c3d:Left Hip Angle'`, `--map 'left_hip=walk.c3d#2:Left Hip Angle'` for the second range,
`--map 'left_hip=PROCESSED:Left Hip Angle'`.

## Columns and numbers

A map names a column by its heading, or by its number: columns are counted from 1 as they are in the file, with that of the time, in CSV, OpenSim and
oscilloscope files. In the other formats the number counts what the error lists: points of C3D, outputs of Vicon Nexus, signals of Visual3D, blocks of
GCD, joints of MVNX, fields of MCAP. A map does not make an angle of a column that states another unit or quantity: `left_hip (mA)`,
`left_hip_velocity`, `Left Hip Moment`.

## Units that are not stated

Where nothing names the unit, the values imply degrees or radians. If the gait would then be none, with knees that move by less than 25 degrees and
bend by less than 30, or hips that move by less than 12, the unit is asked for: `--unit degrees`, `--unit radians`, or `--calibration FILE` for volts.

## Times

`--rate HZ` counts frames, or rows without a time. It also replaces times that are rounded too coarsely, if they agree with it over the whole file,
within the step to which they are rounded and within half a row; else it is an error with the difference. Messages of joints without stamps have the
times at which they were received. If the rows then fit equal steps they are put there, with a warning where the delays are long; a lost message is a
gap. Times with median steps of 0.5 s or more are no seconds of a gait, and an error that names the likely unit; so are times with which a joint would move at more than 2000
degrees a second for a quarter of the time, as seconds under a heading of milliseconds do.

The part of a cycle has a heading such as `pct`, `gait_cycle_percent`, `% gait cycle` or `cycle_fraction`. A time beside it goes before it.

## Missing values

Empty fields, `nan`, `NA`, errors of spreadsheets (`#N/A`, `#DIV/0!`) and what C libraries write (`-1.#IND`, `-nan(ind)`) are missing values. Rows with nothing between their separators are left out, with a note. Joint
centres and joint angles of motion capture that have no value in any frame are left out too, with a note, and markers are used instead.

## The vertical of positions

Up is the axis of the laboratory along which the hips are above the ankles. In the mean over a walk the legs lean by few degrees from the vertical; where they lean by more than 8, or 14 in a turn, a warning says so: the axis may be
tilted, which displaces the hips by as much.

## Recognised, not read

| file | begins with | instead |
|---|---|---|
";

/// The text of the page.
///
/// ```
/// assert!(gait_trace::format::page::markdown().contains("| OpenSim motion and storage (`.mot`, `.sto`) |"));
/// ```
#[must_use]
pub fn markdown() -> String {
    let mut text = HEAD.to_owned();
    text += "| format | recognised by | units | axis of flexion | sign | time and rate | assumed and reported | options |\n";
    text += "|---|---|---|---|---|---|---|---|\n";
    for format in ALL {
        let Description { name, recognised, units, axes, signs, rate, said, options } = format;
        let options: Vec<String> = options.iter().map(|option| format!("`{option}`")).collect();
        let options = options.join(", ");
        let _ = writeln!(text, "| {name} | {recognised} | {units} | {axes} | {signs} | {rate} | {said} | {options} |");
    }
    text += TAIL;
    for kind in unsupported::ALL {
        let _ = writeln!(text, "| {} | {} | {} |", kind.what, kind.begins, kind.instead);
    }
    for (extension, what, instead) in unsupported::BY_EXTENSION {
        let _ = writeln!(text, "| {what} | the extension .{extension}, and bytes that are not text | {instead} |");
    }
    text
}
