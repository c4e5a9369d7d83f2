//! Damaged C3D files: corrupt pointers, counts that promise gigabytes, cut sections, chains that lead nowhere.

mod support;

#[path = "support/damage.rs"]
mod damage;

use damage::{check, damage, held};
use gait_trace::ReadOptions;
use gait_trace::format::open;
use support::c3d_of_angles;
use support::c3d_writer::{C3d, Format};

/// A C3D file with some bytes changed.
fn patched(good: &[u8], changes: &[(usize, &[u8])]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for (at, change) in changes {
        bytes[*at..*at + change.len()].copy_from_slice(change);
    }
    bytes
}

/// Where a parameter's name begins; its link is behind it, then type, rank and data.
fn parameter(bytes: &[u8], name: &str) -> usize {
    let record = [&[name.len() as u8, 1], name.as_bytes()].concat();
    bytes.windows(record.len()).position(|window| window == record).unwrap_or_else(|| panic!("{name}")) + 2
}

#[test]
fn c3d_files() {
    let good = c3d_of_angles(Format::Intel, None).bytes();
    let at = |name: &str| parameter(&good, name) + name.len();
    let (used, scale, rate, labels, start) =
        (at("USED") + 4, at("SCALE") + 4, at("RATE") + 4, at("LABELS"), at("DATA_START") + 4);
    let most = 65535_u16.to_le_bytes();
    let with = |changes: &[(usize, &[u8])]| patched(&good, changes);
    let unnamed = |name: &str| with(&[(parameter(&good, name), b"?")]);
    let others = vec![("LASI".to_owned(), vec![Some([1.0, 2.0, 3.0]); 40]); 3];
    let lying: Vec<(String, Vec<Option<[f32; 3]>>)> =
        [("LHJC", [0.0, 1.0, 900.0]), ("LKJC", [400.0, 1.0, 900.0]), ("LAJC", [800.0, 1.0, 901.0])]
            .map(|(name, place)| (name.to_owned(), vec![Some(place); 40]))
            .into();
    let unseen = vec![("LKneeAngles".to_owned(), vec![None; 40])];
    // Labels of length 0, 255 to the 6th of them, take no bytes in the file.
    let endless = [vec![0xff, 7, 0], vec![255; 6]].concat();
    check(
        vec![
            damage(
                "cut within the header",
                "a.c3d",
                good[..100].to_vec(),
                &["byte 512: the parameter section is beyond the end of the file, at 100"],
            ),
            damage(
                "one byte",
                "a.c3d",
                good[..1].to_vec(),
                &["byte 0: the header is beyond the end of the file, at 1"],
            ),
            damage(
                "cut behind the header",
                "a.c3d",
                good[..512].to_vec(),
                &["byte 512: the parameter section is beyond"],
            ),
            damage("cut within the parameters", "a.c3d", good[..600].to_vec(), &["a.c3d: byte 5", "; allowed is"]),
            damage(
                "cut before the data",
                "a.c3d",
                good[..1024].to_vec(),
                &["byte 16: the pointer to the data is block 3 of a file of 1024 bytes"],
            ),
            damage(
                "cut within the data",
                "a.c3d",
                good[..9000].to_vec(),
                &[
                    "byte 6: the number of frames is 374 of 80 bytes each, with data for 99 (truncated?); allowed is up to 99",
                ],
            ),
            damage(
                "another key",
                "a.c3d",
                with(&[(1, b"Q")]),
                &["byte 1: the key of the header is 0x51; allowed is 0x50"],
            ),
            damage("zeros", "a.c3d", vec![0; 1 << 20], &["byte 1: the key of the header is 0x00"]),
            damage(
                "parameters in block 0",
                "a.c3d",
                with(&[(0, &[0])]),
                &["byte 0: the pointer to the parameter section is block 0"],
            ),
            damage(
                "parameters beyond the end",
                "a.c3d",
                with(&[(0, &[200])]),
                &["byte 101888: the parameter section is beyond the end"],
            ),
            damage(
                "parameters in the data",
                "a.c3d",
                with(&[(0, &[9])]),
                &["byte 4099: the processor is", "84 (Intel), 85 (DEC) or 86 (MIPS)"],
            ),
            damage(
                "an unknown processor",
                "a.c3d",
                with(&[(515, &[99])]),
                &["byte 515: the processor is 99; allowed is 84 (Intel)"],
            ),
            damage(
                "another processor",
                "a.c3d",
                with(&[(515, &[86])]),
                &["byte 16: the pointer to the data is block 768 of a file"],
            ),
            damage(
                "no points",
                "a.c3d",
                with(&[(2, &[0, 0]), (used, &[0, 0])]),
                &["byte 2: the number of points is 0"],
            ),
            damage(
                "points that do not agree",
                "a.c3d",
                with(&[(2, &[9, 0])]),
                &["byte 2: the number of points is 9; allowed is 5, as POINT:USED says"],
            ),
            damage(
                "a huge number of points",
                "a.c3d",
                with(&[(2, &most), (used, &most)]),
                &["byte 6: the number of frames is 374 of 1048560 bytes each, with data for 0"],
            ),
            damage(
                "4 GB and more of zeros announced",
                "a.c3d",
                [with(&[(2, &most), (used, &most), (8, &[0xfe, 0xff])]), vec![0; 1 << 20]].concat(),
                &["the number of frames is 65534 of 1048560 bytes each, with data for 1"],
            ),
            damage(
                "a huge number of analog values",
                "a.c3d",
                with(&[(4, &most)]),
                &["of 262220 bytes each, with data for 0"],
            ),
            damage(
                "the last frame before the first",
                "a.c3d",
                with(&[(6, &[9, 0, 1, 0]), (at("FRAMES") + 4, &[0, 0])]),
                &["byte 6: the first and last frame is 9 and 1"],
            ),
            damage("one frame", "a.c3d", with(&[(8, &[1, 0])]), &["1 rows of numbers; allowed are 2 or more"]),
            damage(
                "no rate",
                "a.c3d",
                with(&[(rate, &[0; 4]), (20, &[0; 4])]),
                &["byte 20: the frame rate is 0; allowed is above 0"],
            ),
            damage(
                "a rate that is not a number",
                "a.c3d",
                with(&[(rate, &f32::NAN.to_le_bytes()), (20, &f32::NAN.to_le_bytes())]),
                &["byte 20: the frame rate is NaN"],
            ),
            damage(
                "no scale",
                "a.c3d",
                with(&[(scale, &[0; 4])]),
                &["byte 12: the scale of the points is 0; allowed is below 0 for floats"],
            ),
            damage(
                "a scale that is not a number",
                "a.c3d",
                with(&[(scale, &f32::INFINITY.to_le_bytes())]),
                &["byte 12: the scale of the points is inf"],
            ),
            damage(
                "integers called floats",
                "a.c3d",
                patched(&c3d_of_angles(Format::Intel, Some(0.01)).bytes(), &[(scale, &(-0.01_f32).to_le_bytes())]),
                &["the number of frames is 374", "truncated?"],
            ),
            damage(
                "data in the header",
                "a.c3d",
                with(&[(start, &[1, 0])]),
                &["byte 16: the pointer to the data is block 1"],
            ),
            damage(
                "data beyond the end",
                "a.c3d",
                with(&[(start, &most)]),
                &["byte 16: the pointer to the data is block 65535"],
            ),
            damage(
                "a link out of the section",
                "a.c3d",
                with(&[(labels, &[0xff, 0x7f])]),
                &["the link to the next parameter is 32767, beyond the section's end at 1024"],
            ),
            damage(
                "an unknown type",
                "a.c3d",
                with(&[(labels + 2, &[3])]),
                &["the type of parameter LABELS is 3; allowed is -1, 1, 2 or 4"],
            ),
            damage(
                "too many dimensions",
                "a.c3d",
                with(&[(labels + 3, &[200])]),
                &["the number of dimensions of parameter LABELS is 200; allowed is 0 to 7"],
            ),
            damage(
                "a parameter larger than the file",
                "a.c3d",
                with(&[(labels + 4, &[255, 255])]),
                &["the size of parameter LABELS is [255, 255], more than the rest of the file"],
            ),
            damage("endless empty labels", "a.c3d", with(&[(labels + 2, &endless)]), &["POINT:LABELS is missing"]),
            damage(
                "16 million labels",
                "a.c3d",
                [with(&[(labels + 2, &[0xff, 4, 1, 255, 255, 255])]), vec![b'x'; 17 << 20]].concat(),
                &["neither joint angles nor joint centres: the points are"],
            ),
            damage(
                "no names",
                "a.c3d",
                unnamed("LABELS"),
                &["POINT:LABELS is missing; allowed is the names of the points"],
            ),
            damage(
                "markers of the pelvis alone",
                "a.c3d",
                C3d::new(Format::Intel, None, 100.0, others).bytes(),
                &["neither joint angles nor joint centres: the points are `LASI`", "`LHJC`"],
            ),
            damage(
                "a person who lies",
                "a.c3d",
                C3d::new(Format::Intel, None, 100.0, lying).bytes(),
                &["the direction of walking does not follow from the trajectories"],
            ),
            damage(
                "points that nobody saw",
                "a.c3d",
                C3d::new(Format::Intel, None, 100.0, unseen).bytes(),
                &["no row has a number"],
            ),
            damage(
                "degrees called radians",
                "a.c3d",
                {
                    let mut file = c3d_of_angles(Format::Dec, None);
                    file.texts[0].2 = "rad";
                    file.bytes()
                },
                &["column 2 `Anna:LHipAngles`", "wrong unit?"],
            ),
        ],
        &ReadOptions::default(),
    );
}

#[test]
fn a_parameter_chain_that_runs_in_circles_ends() {
    let good = c3d_of_angles(Format::Intel, None).bytes();
    for link in 0..40_u16 {
        for name in ["USED", "LABELS", "RATE"] {
            let at = parameter(&good, name) + name.len();
            // Whatever it leads to, it is an end: an error, or parameters that happen to be read.
            let bytes = patched(&good, &[(at, &link.to_le_bytes())]);
            let (_, held) = held(|| open::of_bytes("a.c3d", &bytes, &ReadOptions::default()).is_ok());
            assert!(held < 8 << 20, "{name} to {link}: {held} bytes");
        }
    }
}

/// The rate of the parameters is taken, and the header's is said where it is another.
#[test]
fn a_rate_of_the_header_that_is_another_is_said() {
    let good = c3d_of_angles(Format::Intel, None).bytes();
    let notes = |bytes: &[u8]| open::of_bytes("a.c3d", bytes, &ReadOptions::default()).expect("a recording").notes;
    assert!(!notes(&good).iter().any(|note| note.contains("POINT:RATE")));
    for (rate, said) in [(75.0_f32, "75 Hz"), (0.0, "0 Hz")] {
        let notes = notes(&patched(&good, &[(20, &rate.to_le_bytes())]));
        let note = format!("The header gives {said}, POINT:RATE gives 150 Hz; the latter is used.");
        assert!(notes.contains(&note), "{notes:?}");
    }
}
