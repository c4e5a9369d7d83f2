//! Damaged exports of Vicon Nexus, Visual3D and GCD, one of each kind of damage: a clear error that says where and what is allowed.

#[path = "support/damage.rs"]
mod damage;

use damage::{MARGIN, check, damage, held};
use gait_trace::format::open;
use gait_trace::{Axis, ReadOptions};
use std::path::Path;

fn text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name);
    std::fs::read_to_string(path).expect("a file of the corpus")
}

/// The text with one line replaced; lines count from 1.
fn with(text: &str, line: usize, row: &str) -> String {
    let mut rows: Vec<&str> = text.lines().collect();
    rows[line - 1] = row;
    rows.join("\n") + "\n"
}

/// The text without the lines from one on.
fn up_to(text: &str, line: usize) -> String {
    text.lines().take(line - 1).collect::<Vec<_>>().join("\n") + "\n"
}

/// A row with one field replaced.
fn field(text: &str, line: usize, delimiter: char, index: usize, value: &str) -> String {
    let row = text.lines().nth(line - 1).expect("a row");
    let mut fields: Vec<&str> = row.split(delimiter).collect();
    fields[index] = value;
    with(text, line, &fields.join(&delimiter.to_string()))
}

#[test]
fn exports_of_vicon() {
    // Line 1 title, 2 rate, 3 names, 4 components, 5 units, 6 to 29 rows.
    let good = text("vicon/semicolons_decimal_commas.csv");
    let change = |line, index, value: &str| field(&good, line, ';', index, value);
    let row = good.lines().nth(9).expect("a row");
    let long = (0..5000).map(|n| format!(";A:m{n};;")).collect::<String>();
    check(
        vec![
            damage(
                "other sections alone",
                "a.csv",
                good.replace("Model Outputs", "Trajectories"),
                &["a.csv: no section `Model Outputs`; there are `Trajectories`; allowed is an export with it"],
            ),
            damage(
                "a title alone",
                "a.csv",
                "Model Outputs\n",
                &["a.csv:1: `the rate` is missing", "four lines below"],
            ),
            damage("no names", "a.csv", up_to(&good, 3), &["a.csv:1: `the names of the outputs` is missing"]),
            damage("no units", "a.csv", up_to(&good, 5), &["a.csv:1: `the row of units` is missing"]),
            damage("no rows", "a.csv", up_to(&good, 6), &["a.csv:3: 0 rows of numbers; allowed are 2 or more"]),
            damage("one row", "a.csv", up_to(&good, 7), &["a.csv:6: 1 rows of numbers"]),
            damage("no rate", "a.csv", with(&good, 2, "fast"), &["a.csv:2: `the rate below Model Outputs` is `fast`"]),
            damage(
                "rate 0",
                "a.csv",
                with(&good, 2, "0"),
                &["a.csv:2: ", "is `0`; allowed is a number of frames a second"],
            ),
            damage("no frames", "a.csv", change(4, 0, "Time"), &["a.csv:4: `column 1` is `Time`; allowed is `Frame`"]),
            damage("no sub frames", "a.csv", change(4, 1, "X"), &["a.csv:4: `column 2` is `X`"]),
            damage(
                "no x",
                "a.csv",
                change(4, 5, "A"),
                &[
                    "a.csv:4: `Anna:LHipAngles` is without component x; allowed is an output with the components X, Y and Z",
                ],
            ),
            damage(
                "angles in millimetres",
                "a.csv",
                change(5, 5, "mm"),
                &["a.csv:5: `the unit of Anna:LHipAngles` is `mm`; allowed is deg or rad"],
            ),
            damage(
                "degrees called radians",
                "a.csv",
                good.replace("deg", "rad"),
                &["column 6 `Anna:LHipAngles`", "wrong unit?"],
            ),
            damage(
                "a word",
                "a.csv",
                change(10, 5, "lost"),
                &["a.csv:10: column 6 `Anna:LHipAngles X`: `lost` is not a number; allowed is a decimal number"],
            ),
            damage(
                "infinite",
                "a.csv",
                change(10, 15, "1e999"),
                &["a.csv:10: column 16 `Anna:LKneeAngles Y`: `1e999` is not finite"],
            ),
            damage(
                "half a frame",
                "a.csv",
                change(10, 0, "4,5"),
                &["a.csv:10: column 1 `Frame`: `4,5` is not the number"],
            ),
            damage("a frame beyond any", "a.csv", change(10, 0, "1e300"), &["a.csv:10: column 1", "0 to 1000000000"]),
            damage(
                "a sub frame below 0",
                "a.csv",
                change(10, 1, "-1"),
                &["a.csv:10: column 2 `Sub Frame`: `-1` is not"],
            ),
            damage(
                "no frame number",
                "a.csv",
                change(10, 0, ""),
                &["a.csv:10: column 1 `Frame`: `` is not the number"],
            ),
            damage("a short row", "a.csv", with(&good, 10, "5;0;1,5"), &["a.csv:10: 3 fields; allowed are 29"]),
            damage(
                "a long row",
                "a.csv",
                with(&good, 10, &format!("{row};7")),
                &["a.csv:10: 30 fields; allowed are 29"],
            ),
            damage(
                "a blank line between rows",
                "a.csv",
                with(&good, 10, ""),
                &["a.csv:11: rows of numbers below the blank line that ends `Model Outputs`"],
            ),
            damage("two sections", "a.csv", format!("{good}\n{good}"), &["a.csv:31: a second header; allowed is one"]),
            damage("two sections, no line between", "a.csv", format!("{good}{good}"), &["a.csv:30: a second header"]),
            damage(
                "a joint twice",
                "a.csv",
                good.replace("RHipAngles", "LHipAngles"),
                &["a.csv:3: `Anna:LHipAngles` and `Anna:LHipAngles` are both recognised as `left_hip`"],
            ),
            damage(
                "several subjects",
                "a.csv",
                good.replace("Anna:RKnee", "Bert:RKnee"),
                &[
                    "a.csv:3: the file has joint angles of several subjects: `Anna`, `Bert`; allowed is one",
                    "--map left_hip=",
                ],
            ),
            damage(
                "no angles",
                "a.csv",
                good.replace("Angles", "Power"),
                &["a.csv:3: no column is recognised as a joint; there are `Anna:LAnklePower`"],
            ),
            damage(
                "nothing but gaps",
                "a.csv",
                "Model Outputs\n100\n,,LHipAngles,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n1,0,,,\n2,0,,,\n",
                &["a.csv:3: no row has a number in any joint column"],
            ),
            damage("an open quote", "a.csv", change(10, 5, "\"1"), &["a.csv:10: a quote is opened and not closed"]),
            damage(
                "15,000 columns",
                "a.csv",
                with(&good, 3, &long),
                &["a.csv:3: 15001 columns; allowed are up to 4096"],
            ),
            damage(
                "a line of 2 MB",
                "a.csv",
                with(&good, 10, &"9".repeat(2_000_000)),
                &["a.csv:10: a line of 2000000 bytes"],
            ),
        ],
        &ReadOptions::default(),
    );
    let refused = |what, how: ReadOptions<'_>, says: &'static [&'static str]| {
        check(vec![damage(what, "a.csv", good.clone(), says)], &how);
    };
    let mapped = |map: &str| {
        let mut how = ReadOptions::default();
        how.add_map(map).expect("a map");
        how
    };
    refused("a rate", ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() }, &["its own time in its frames"]);
    refused("a column of times", mapped("time=1"), &["a column of times is given", "allowed is without it"]);
    refused(
        "a map to no output",
        mapped("left_hip=LHip"),
        &["a.csv:3: the map takes `left_hip` from `LHip`; the file has `Anna:LAnkleAngles`, `Anna:LHipAngles`"],
    );
    refused(
        "a map to forces",
        mapped("left_hip=Anna:LHipForce"),
        &["a.csv:3: `LHipForce` states the quantity `force`, which is no angle"],
    );
}

#[test]
fn exports_of_visual3d() {
    // Lines 1 to 5 header, 6 to 29 rows; columns: ITEM, TIME, three of a marker, then three of each joint.
    let good = text("visual3d/time_and_markers.txt").replace('\r', "");
    let change = |line, index, value: &str| field(&good, line, '\t', index, value);
    check(
        vec![
            damage(
                "cut behind the types",
                "a.txt",
                up_to(&good, 4),
                &["a.txt:3: `folders` is missing; allowed is five"],
            ),
            damage("cut behind the folders", "a.txt", up_to(&good, 5), &["a.txt:4: `ITEM and components` is missing"]),
            damage("cut behind the header", "a.txt", up_to(&good, 6), &["a.txt:2: 0 rows of numbers"]),
            damage("one row", "a.txt", up_to(&good, 7), &["a.txt:6: 1 rows of numbers"]),
            damage(
                "no ITEM",
                "a.txt",
                change(5, 0, "ROW"),
                &["a.txt:5: `the first column` is `ROW`; allowed is `ITEM`"],
            ),
            damage(
                "no joints",
                "a.txt",
                good.replace("LINK_MODEL_BASED", "TARGET"),
                &["a.txt:2: no column is recognised as a joint; there are `TIME`, `L_KNEE`"],
            ),
            damage(
                "a word",
                "a.txt",
                change(9, 5, "lost"),
                &["a.txt:9: column 6 `Left Hip Angle X`: `lost` is not a number; allowed is a decimal number"],
            ),
            damage(
                "infinite",
                "a.txt",
                change(9, 5, "-inf"),
                &["a.txt:9: column 6 `Left Hip Angle X`: `-inf` is not finite"],
            ),
            damage("no time", "a.txt", change(9, 1, ""), &["a.txt:9: column 2 `TIME`: `` is not a number"]),
            damage(
                "a time that is a word",
                "a.txt",
                change(9, 1, "0:02"),
                &["a.txt:9: column 2 `TIME`: `0:02` is not"],
            ),
            damage(
                "a decimal comma among points",
                "a.txt",
                change(9, 1, "0,02"),
                &["a.txt:9: numbers with decimal commas here, and with decimal points elsewhere; allowed is one"],
            ),
            damage("a short row", "a.txt", with(&good, 9, "4\t0.02\t1"), &["a.txt:9: 3 fields; allowed are 17"]),
            damage(
                "a long row",
                "a.txt",
                with(&good, 9, &(good.lines().nth(8).expect("a row").to_owned() + "\t7")),
                &["a.txt:9: 18 fields; allowed are 17"],
            ),
            damage("two files in one", "a.txt", format!("{good}{good}"), &["a.txt:30: ", "allowed"]),
            damage(
                "a joint twice",
                "a.txt",
                good.replace("Right Hip Angle", "L_Hip_Angle"),
                &["a.txt:2: `Left Hip Angle` and `L_Hip_Angle` are both recognised as `left_hip`"],
            ),
            damage(
                "several recordings",
                "a.txt",
                good.replacen("walk1.c3d\n", "walk2.c3d\n", 1),
                &["a.txt:2: the file has joint angles of several recordings, ranges or folders: ", "walk2.c3d"],
            ),
            damage("an open quote", "a.txt", change(9, 5, "\"1"), &["a.txt:9: a quote is opened and not closed"]),
            damage(
                "15,000 columns",
                "a.txt",
                with(&good, 2, &"\tx".repeat(15_000)),
                &["a.txt:2: 15001 columns; allowed are up to 4096"],
            ),
        ],
        &ReadOptions::default(),
    );
    let frames = text("visual3d/frames.txt");
    let how = ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() };
    check(
        vec![
            damage(
                "half an item",
                "a.txt",
                field(&frames, 9, '\t', 0, "3.5"),
                &["a.txt:9: column 1 `ITEM`: `3.5` is not the number of a frame"],
            ),
            damage("an item beyond any", "a.txt", field(&frames, 9, '\t', 0, "1e200"), &["a.txt:9: column 1 `ITEM`"]),
        ],
        &how,
    );
    let x_alone = "\ta\n\tLeft Knee Angle\n\tDERIVED\n\tF\nITEM\tX\n1\t5\n2\t6\n";
    let how = ReadOptions { rate_hz: Some(100.0), axis: Some(Axis::Z), ..ReadOptions::default() };
    check(vec![damage("no z", "a.txt", x_alone, &["a.txt:2: `Left Knee Angle` is without component z"])], &how);
}

#[test]
fn gait_cycle_data() {
    let good = text("gcd/both_legs.gcd").replace('\r', "");
    let line_of = |part: &str| 1 + good.lines().position(|row| row.starts_with(part)).expect("the block");
    let hip = line_of("!LeftHipFlexExt");
    assert_eq!(hip, 15);
    check(
        vec![
            damage(
                "a mark alone",
                "a.gcd",
                "#!DST-0.1 GCD\n",
                &["a.gcd: no column is recognised as a joint; there are none"],
            ),
            damage(
                "no joints",
                "a.gcd",
                good.replace("HipFlexExt", "HipPower").replace("KneeFlexExt", "KneePower"),
                &["a.gcd: no column is recognised as a joint; there are `LeftStrideTime`"],
            ),
            damage(
                "a word",
                "a.gcd",
                with(&good, 20, "lost"),
                &["a.gcd:20: column 1 `LeftHipFlexExt`: `lost` is not a number; allowed is a decimal number"],
            ),
            damage(
                "a word beside",
                "a.gcd",
                with(&good, 20, "1 lost"),
                &["a.gcd:20: column 1 `LeftHipFlexExt`: `lost`"],
            ),
            damage("infinite", "a.gcd", with(&good, 20, "1e999"), &["a.gcd:20: ", "`1e999` is not finite"]),
            damage(
                "a row is missing",
                "a.gcd",
                with(&good, 20, ""),
                &["a.gcd:171: `RightHipFlexExt` is of 51 points; allowed is 50, as `LeftHipFlexExt` has"],
            ),
            damage("cut off", "a.gcd", up_to(&good, 200), &["points; allowed is 51, as `LeftHipFlexExt` has"]),
            damage("a block without rows", "a.gcd", up_to(&good, 16), &["a.gcd:15: 0 rows of numbers; allowed are 2"]),
            damage("one point", "a.gcd", up_to(&good, 17), &["a.gcd:15: 1 rows of numbers"]),
            damage(
                "a joint twice",
                "a.gcd",
                format!("{good}{good}"),
                &["a.gcd: `LeftHipFlexExt` and `LeftHipFlexExt` are both recognised as `left_hip`"],
            ),
            damage(
                "a stride time of 0",
                "a.gcd",
                good.replace("1.093", "0"),
                &["a.gcd:7: `LeftStrideTime` is 0; allowed is one number: seconds above 0"],
            ),
            damage(
                "a contact beyond the cycle",
                "a.gcd",
                good.replace("49.390", "149"),
                &[
                    "a.gcd:9: `LeftOppositeFootContact` is 149; allowed is one number: percent of the cycle, from 20 to 80, for example 50.5; a fraction such as 0.505 is not",
                ],
            ),
            damage(
                "no contact",
                "a.gcd",
                good.replace("\n49.390", ""),
                &["a.gcd:9: `LeftOppositeFootContact` is missing"],
            ),
            damage(
                "nothing but gaps",
                "a.gcd",
                "#!DST\n!LeftHipFlexExt\nnan\nNaN\n",
                &["a.gcd: no row has a number in any joint column"],
            ),
        ],
        &ReadOptions::default(),
    );
    let axis = ReadOptions { axis: Some(Axis::X), ..ReadOptions::default() };
    check(
        vec![damage("an axis", "a.gcd", good.clone(), &["an axis is given (`--axis`), but this file has no"])],
        &axis,
    );
    let rate = ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() };
    check(vec![damage("a rate", "a.gcd", good.clone(), &["its own time in the points of its cycle"])], &rate);
}

/// Memory follows the rows that are read: neither a large frame number nor the rows of other sections cost any.
#[test]
fn memory_is_that_of_the_file() {
    let head =
        "Model Outputs\n1e6\n,,LHipAngles,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n1000000000,0,1,2,3\n1,0,2,3,4\n";
    let devices = format!("Devices\n1000\n{}\n{head}", "1,0,0.5,0.25\n".repeat(100_000));
    let text = format!("Devices\n1000\n,,Plate\nFrame,Sub Frame,Fx,Fy\n,,N,N\n{}", devices.split_once('\n').unwrap().1);
    let how = ReadOptions { unit: Some("degrees".parse().unwrap()), ..ReadOptions::default() };
    let (raw, held) = held(|| open::of_bytes("a.csv", text.as_bytes(), &how));
    assert_eq!(raw.unwrap_or_else(|error| panic!("{error}")).time_s.len(), 2);
    assert!(held < MARGIN, "{held} bytes for {} of file", text.len());
}
