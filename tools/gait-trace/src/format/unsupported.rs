//! Names kinds of files that are recognised and not read, and says how their content can be read.

use crate::fault::{Fault, TraceError};
use memchr::memmem;

/// A kind of file that is not read.
pub(crate) struct Unsupported {
    /// What it is, with its article.
    pub(crate) what: &'static str,
    /// What to do instead.
    pub(crate) instead: &'static str,
    is: fn(&[u8]) -> bool,
}

const PICTURE: &str = "export the numbers behind the picture as CSV";
const UNPACK: &str = "unpack it first";
const TRACK: &str = "a video has no angles: track it with a program that writes joint angles or markers, and read its CSV, .mot or .trc";
const TABLE: &str = "write the joint angles as CSV (`pandas.DataFrame.to_csv`)";
const ANGLES: &str = "export the joint angles as CSV (`time_s,left_hip_deg,...`) or as an OpenSim motion file from the program that made it";

/// All kinds that are recognised, in the order in which they are tried.
pub(crate) const ALL: &[Unsupported] = &[
    Unsupported {
        what: "a BVH motion capture file",
        instead: ANGLES,
        is: |bytes| trimmed(bytes).starts_with(b"HIERARCHY"),
    },
    Unsupported {
        what: "a JSON file",
        instead: "write the joint angles as CSV (`time_s,left_hip_deg,...`), a row a sample (`pandas.read_json`, `to_csv`)",
        is: |bytes| {
            let mut text = trimmed(bytes).iter().copied().filter(|byte| !byte.is_ascii_whitespace());
            matches!((text.next(), text.next()), (Some(b'{'), Some(b'"')) | (Some(b'['), Some(b'{' | b'[' | b'"')))
        },
    },
    Unsupported {
        what: "a rosbag of ROS 1",
        instead: "convert it to MCAP (`mcap convert`), or write the joint angles of its messages as CSV (`rostopic echo -p`)",
        is: |bytes| bytes.starts_with(b"#ROSBAG V"),
    },
    Unsupported {
        what: "a Git LFS pointer, which stands for a larger file that was not downloaded",
        instead: "fetch the file itself: `git lfs pull`",
        is: |bytes| trimmed(bytes).starts_with(b"version https://git-lfs"),
    },
    Unsupported { what: "a PNG image", instead: PICTURE, is: |bytes| bytes.starts_with(b"\x89PNG") },
    Unsupported { what: "a JPEG image", instead: PICTURE, is: |bytes| bytes.starts_with(b"\xff\xd8\xff") },
    Unsupported {
        what: "a PDF document",
        instead: "export the numbers in it as CSV",
        is: |bytes| bytes.starts_with(b"%PDF-"),
    },
    Unsupported {
        what: "an Excel workbook (.xlsx)",
        instead: "export the sheet as CSV",
        is: |bytes| is_zip_with(bytes, b"xl/"),
    },
    Unsupported {
        what: "an OpenDocument spreadsheet (.ods)",
        instead: "export the sheet as CSV",
        is: |bytes| is_zip_with(bytes, b"opendocument"),
    },
    Unsupported {
        what: "a Simulink model (.slx)",
        instead: "a model has no recording: write the logged joint angles as CSV in MATLAB (`writetable`)",
        is: |bytes| is_zip_with(bytes, b"simulink/"),
    },
    Unsupported { what: "arrays of NumPy (.npz)", instead: TABLE, is: |bytes| is_zip_with(bytes, b".npy") },
    Unsupported {
        what: "a zip file, perhaps a spreadsheet",
        instead: "unpack it, or export the sheet as CSV",
        is: |bytes| bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06"),
    },
    Unsupported {
        what: "a compressed file (gzip)",
        instead: "unpack it first: `gunzip`",
        is: |bytes| bytes.starts_with(b"\x1f\x8b"),
    },
    Unsupported {
        what: "a compressed file (bzip2, xz, zstd, 7z or rar)",
        instead: UNPACK,
        is: |bytes| {
            const MAGIC: [&[u8]; 5] =
                [b"BZh", b"\xfd7zXZ\0", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf\x27\x1c", b"Rar!\x1a\x07"];
            MAGIC.iter().any(|magic| bytes.starts_with(magic)) && contains(bytes, b"\0")
        },
    },
    Unsupported {
        what: "an old Excel workbook (.xls), or another file of Microsoft Office",
        instead: "export the sheet as CSV",
        is: |bytes| bytes.starts_with(b"\xd0\xcf\x11\xe0"),
    },
    Unsupported {
        what: "a MATLAB file (.mat)",
        instead: "write the joint angles as CSV in MATLAB (`writetable`)",
        is: |bytes| bytes.starts_with(b"MATLAB 5.0 MAT-file") || bytes.starts_with(b"MATLAB 7.3 MAT-file"),
    },
    Unsupported {
        what: "an HDF5 file, perhaps of MATLAB, pandas or a motion capture program",
        instead: "write its joint angles as CSV (`h5py` in Python, `h5read` and `writetable` in MATLAB)",
        is: |bytes| bytes.starts_with(b"\x89HDF\r\n"),
    },
    Unsupported {
        what: "a Parquet, Feather or Arrow file",
        instead: TABLE,
        is: |bytes| [&b"PAR1"[..], b"FEA1", b"ARROW1\0\0"].iter().any(|magic| bytes.starts_with(magic)),
    },
    Unsupported { what: "an array of NumPy (.npy)", instead: TABLE, is: |bytes| bytes.starts_with(b"\x93NUMPY") },
    Unsupported {
        what: "a LabVIEW measurement (.tdms, .lvm)",
        instead: "export it as CSV with a header of names and units",
        is: |bytes| bytes.starts_with(b"TDSm") || trimmed(bytes).starts_with(b"LabVIEW Measurement"),
    },
    Unsupported {
        what: "a Qualisys export of trajectories or forces (.tsv)",
        instead: "export the trial as C3D from QTM, with markers of hip, knee and ankle or with joint angles",
        is: |bytes| trimmed(bytes).starts_with(b"NO_OF_FRAMES") || trimmed(bytes).starts_with(b"NO_OF_SAMPLES"),
    },
    Unsupported {
        what: "an OptiTrack Motive export of positions (.csv)",
        instead: "export the take as C3D or TRC from Motive",
        is: |bytes| trimmed(bytes).starts_with(b"Format Version,"),
    },
    Unsupported {
        what: "an Acclaim motion or skeleton (.amc, .asf)",
        instead: ANGLES,
        is: |bytes| {
            let text = uncommented(bytes);
            let is_skeleton = text.starts_with(b":version") && contains(text, b":units");
            trimmed(bytes).starts_with(b"#!OML:ASF") || text.starts_with(b":FULLY-SPECIFIED") || is_skeleton
        },
    },
    Unsupported {
        what: "an FBX scene",
        instead: ANGLES,
        is: |bytes| bytes.starts_with(b"Kaydara FBX Binary") || trimmed(bytes).starts_with(b"; FBX"),
    },
    Unsupported {
        what: "a glTF scene (.glb)",
        instead: ANGLES,
        is: |bytes| bytes.starts_with(b"glTF") && contains(bytes, b"\0"),
    },
    Unsupported {
        what: "a video",
        instead: TRACK,
        is: |bytes| {
            let from = |at: usize, magic: &[u8]| bytes.get(at..).is_some_and(|rest| rest.starts_with(magic));
            from(4, b"ftyp") || (from(0, b"RIFF") && from(8, b"AVI ")) || from(0, b"\x1a\x45\xdf\xa3")
        },
    },
    Unsupported {
        what: "an SQLite database, perhaps a bag of ROS 2",
        instead: "convert a bag to MCAP (`ros2 bag convert`), or export the joint angles as CSV",
        is: |bytes| bytes.starts_with(b"SQLite format 3\0"),
    },
    Unsupported {
        what: "a web page (HTML), perhaps the page of a download instead of the file",
        instead: "download the file itself",
        is: |bytes| {
            let head: Vec<u8> = trimmed(bytes).iter().take(14).map(u8::to_ascii_lowercase).collect();
            head.starts_with(b"<!doctype html") || head.starts_with(b"<html")
        },
    },
];

/// Kinds of files whose content is not known: their extension, what they are, what to do instead. A file of one that is text is read.
pub(crate) const BY_EXTENSION: [(&str, &str, &str); 7] = [
    ("qtm", "a Qualisys measurement", "export the trial as C3D from QTM"),
    ("tak", "an OptiTrack Motive take", "export the take as C3D or TRC from Motive"),
    ("x2d", "camera data of Vicon", "export the trial as C3D, or as ASCII with model outputs, from Nexus"),
    ("cmo", "a Visual3D workspace", "export the joint angles as text from Visual3D (`Export_Data_To_Ascii_File`)"),
    ("cmz", "a Visual3D workspace", "export the joint angles as text from Visual3D (`Export_Data_To_Ascii_File`)"),
    ("mat", "an old MATLAB file", "write the joint angles as CSV in MATLAB (`writetable`)"),
    ("mvn", "an Xsens recording", "export it as MVNX or C3D from Xsens MVN"),
];

/// An error that names the kind of a file that is not text, by its extension in lower case.
pub(crate) fn by_extension(name: &str, extension: &str) -> Option<TraceError> {
    let (_, what, instead) = BY_EXTENSION.into_iter().find(|(known, ..)| *known == extension)?;
    Some(TraceError::new(name, None, Fault::Unsupported { what, instead }))
}

/// An error that names the kind of file, if it is one of those that are not read.
pub(crate) fn check(name: &str, bytes: &[u8]) -> Result<(), TraceError> {
    match ALL.iter().find(|kind| (kind.is)(bytes)) {
        Some(kind) => Err(TraceError::new(name, None, Fault::Unsupported { what: kind.what, instead: kind.instead })),
        None => Ok(()),
    }
}

/// Without a byte order mark and blanks in front.
fn trimmed(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start()
}

/// Behind lines that begin with `#`, which Acclaim files have for comments.
fn uncommented(bytes: &[u8]) -> &[u8] {
    let mut rest = trimmed(bytes);
    while rest.starts_with(b"#") {
        let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        rest = rest[end..].trim_ascii_start();
    }
    rest
}

/// Whether it is a zip file whose first kilobytes contain a piece.
fn is_zip_with(bytes: &[u8], piece: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") && contains(bytes, piece)
}

/// Whether the first kilobytes contain a piece; the entries of a workbook are there.
fn contains(bytes: &[u8], piece: &[u8]) -> bool {
    memmem::find(&bytes[..bytes.len().min(4096)], piece).is_some()
}
