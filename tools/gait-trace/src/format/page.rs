//! The page `docs/formats.md`, generated from the descriptions of the readers.

use crate::format::description::Description;
use crate::format::{c3d, gcd, mapped_csv, mcap_file, mvnx, opensim, scope, trc, vicon, visual3d};
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

`footfall fit`, `convert`, `entrain` and `check --trace` read these formats. The content decides which one a file has, the extension only where the content
does not. What a file does not say is either assumed and reported, or asked for in an error that names the option: run
`cargo footfall check --trace samples/walk.mot` on your file first. A column without a unit is read as volts if a calibration is given, else as angles.

";

const TAIL: &str = "
Other files (BVH, JSON, MATLAB, Excel, HDF5, Parquet, NumPy, TDMS, rosbag, Qualisys TSV, Motive CSV, video, archives, ...) are refused with a message that
names the file and the export to choose instead.

## Warnings and guesses

What the file does not say and the program guesses is a warning; `--strict` refuses a recording with a warning. The message names the option that confirms
the guess. Forces, speeds and moments have columns named after joints too: a file whose title names another quantity is refused, and where nothing says
that the columns are angles, `--unit degrees` or `--unit radians` says it.

## Signs

Results are flexion positive. Where the format defines the sign, or the angle is computed from positions, the sign is known and no movement changes it.
Plug-in Gait defines it for the first component of `LHipAngles`, `RHipAngles`, `LKneeAngles` and `RKneeAngles`; GCD and MVNX for hips and knees; OpenSim for
`hip_flexion`.

- **Other hips** are judged by the shape of their strides and by the lead of the knee. Where both show extension as positive the sign is changed, with a
  warning; where nothing shows it, flexion is assumed, with a warning. `--hip-sign flexion|extension` decides for both hips. Give it for a person who walks
  backwards.
- **Other knees** get one sign for both. A knee beyond -40 degrees that stays below +15 counts extension as positive, one beyond +40 that stays above -15
  flexion, and so do means beyond 25 degrees. Else the shape of the strides decides, which is a guess, or `--knee-sign flexion|extension` is required. In
  CSV, MCAP and Visual3D files each knee may have a sign of its own.
- **OpenSim** files do not name their model: gait2354 and gait2392 count a bent knee as negative, Rajagopal's, Lai's and OpenCap's models as positive; the
  knees show which. Knees with a mean beyond 120 degrees are the angle between thigh and shank and are refused.
- A column whose name counts extension as positive (`left_hip_extension_deg`) is read only where a map names it.

`footfall convert` writes flexion positive. A line `signs` of its record has a word for each joint, by which the file is read again:

| word | flexion is positive because | when the file is read again |
|---|---|---|
| `named` | an option named the sign | known: the sign is not changed |
| `known` | the format, the positions or the angles of the knees say so | known: the sign is not changed |
| `shape` | the shape of the strides shows it, and nothing was changed | judged by the shape again |
| `turned` | the shape of the strides showed the other sign, which was changed | not changed again, and a warning again |
| `assumed` | nothing shows it | judged again, and a warning again |

An option names the sign of the file that is read: for a conversion give `--hip-sign flexion`, also where `--hip-sign extension` was right for its source.

## Cycles and legs

- A time from 0 to 1, or from 0 to 100 with at most 401 rows, is the fraction of one cycle if the angles at both ends agree. `--stride-time S` gives the
  duration. The heading of such a column is `pct`, `gait_cycle_percent`, `% gait cycle` or `cycle_fraction`.
- Curves that each count from the contact of their own foot, as reports print them, are refused unless `--own-cycles` says so: the right leg is then moved by
  half of the cycle. A GCD file's right leg is moved by `LeftOppositeFootContact` percent, else by half of the cycle.
- A file of one leg is refused for a fit. `--mirror` makes the other leg, half a stride later.
- If two of two or three strides differ by more than 5 degrees (root mean square), as in a turn, a warning says where; of four and more, those that
  differ are left out.

## Components, columns, subjects

- Of several components of an angle (`left_knee_angle_x`, `_y`, `_z`) the one that clearly moves most at the knees is read for all joints, with a warning;
  else `--axis x|y|z` or a map is required. Plug-in Gait's names have flexion in X. Positions and quaternions are errors.
- `--map left_hip=COLUMN,...` names a column by its heading or its number. In CSV, OpenSim and oscilloscope files columns are counted from 1, with the column
  of the time; in other formats by the list in the error. A map does not turn another quantity (`left_hip (mA)`, `Left Hip Moment`) into an angle.
- Several values in a column such as `subject`, `id`, `trial`, `session` or `side` are an error that lists them: `--where subject=S01` chooses, may be
  repeated, and `--where 'subject=*'` reads all rows. Times that begin again and rows that alternate between recordings are errors too.
- A file of Vicon Nexus, Visual3D or C3D with several subjects, recordings or ranges is refused with their names. A map of one joint chooses for all:
  `--map left_hip=Anna:LHipAngles`, `--map 'left_hip=walk2.c3d:Left Hip Angle'`, `--map 'left_hip=walk.c3d#2:Left Hip Angle'` for the second range.

## Units, times, gaps

- Without a unit, the values imply degrees or radians. If that is not clear, `--unit degrees`, `--unit radians`, or `--calibration FILE` for volts is required.
- `--rate HZ` counts frames, or rows without a time. It replaces times that are rounded too coarsely if they agree with it. Median steps of 0.5 s or more,
  and times with which a joint moves at more than 2000 degrees a second for a quarter of the time, are errors that name the likely unit.
- Empty fields, `nan`, `NA`, errors of spreadsheets (`#N/A`, `#DIV/0!`) and `-1.#IND` are missing values.
- Of positions, up is the axis along which the hips are above the ankles. Where the legs lean from it by more than 8 degrees in the mean, or 14 in a turn, a
  warning says so: the axis may be tilted, which displaces the hips by as much.
";

/// The text of the page.
///
/// ```
/// assert!(gait_trace::format::page::markdown().contains("| OpenSim motion and storage (`.mot`, `.sto`) |"));
/// ```
#[must_use]
pub fn markdown() -> String {
    let mut text = HEAD.to_owned();
    text += "| format | recognised by | units | axis of flexion | sign | time and rate | options |\n";
    text += "|---|---|---|---|---|---|---|\n";
    for format in ALL {
        let Description { name, recognised, units, axes, signs, rate, options } = format;
        let options: Vec<String> = options.iter().map(|option| format!("`{option}`")).collect();
        let options = options.join(", ");
        let _ = writeln!(text, "| {name} | {recognised} | {units} | {axes} | {signs} | {rate} | {options} |");
    }
    text += TAIL;
    text
}
