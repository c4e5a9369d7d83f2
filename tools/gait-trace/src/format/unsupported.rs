//! Names kinds of files that are recognised and not read, and says how their content can be read.

use crate::fault::{Fault, TraceError};

/// A kind of file that is not read.
pub(crate) struct Unsupported {
    /// What it is, with its article.
    pub(crate) what: &'static str,
    /// How it begins, in words.
    pub(crate) begins: &'static str,
    /// What to do instead.
    pub(crate) instead: &'static str,
    is: fn(&[u8]) -> bool,
}

const ANGLES: &str = "export the joint angles as CSV (`time_s,left_hip_deg,...`) or as an OpenSim motion file from the program that made it";

/// All kinds that are recognised, in the order in which they are tried.
pub(crate) const ALL: [Unsupported; 13] = [
    Unsupported {
        what: "a BVH motion capture file",
        begins: "`HIERARCHY`",
        instead: ANGLES,
        is: |bytes| trimmed(bytes).starts_with(b"HIERARCHY"),
    },
    Unsupported {
        what: "a rosbag of ROS 1",
        begins: "`#ROSBAG V`",
        instead: "convert it to MCAP (`mcap convert`), or write the joint angles of its messages as CSV (`rostopic echo -p`)",
        is: |bytes| bytes.starts_with(b"#ROSBAG V"),
    },
    Unsupported {
        what: "a Git LFS pointer, which stands for a larger file that was not downloaded",
        begins: "`version https://git-lfs`",
        instead: "fetch the file itself: `git lfs pull`",
        is: |bytes| trimmed(bytes).starts_with(b"version https://git-lfs"),
    },
    Unsupported {
        what: "a PNG image",
        begins: "0x89 `PNG`",
        instead: "export the numbers behind the picture as CSV",
        is: |bytes| bytes.starts_with(b"\x89PNG"),
    },
    Unsupported {
        what: "a JPEG image",
        begins: "0xff 0xd8 0xff",
        instead: "export the numbers behind the picture as CSV",
        is: |bytes| bytes.starts_with(b"\xff\xd8\xff"),
    },
    Unsupported {
        what: "a PDF document",
        begins: "`%PDF-`",
        instead: "export the numbers in it as CSV",
        is: |bytes| bytes.starts_with(b"%PDF-"),
    },
    Unsupported {
        what: "an Excel workbook (.xlsx)",
        begins: "a zip file with `xl/` in it, or with the extension .xlsx",
        instead: "export the sheet as CSV",
        is: |bytes| bytes.starts_with(b"PK\x03\x04") && contains(bytes, b"xl/"),
    },
    Unsupported {
        what: "a zip file, perhaps a spreadsheet",
        begins: "`PK`",
        instead: "unpack it, or export the sheet as CSV",
        is: |bytes| bytes.starts_with(b"PK\x03\x04"),
    },
    Unsupported {
        what: "a compressed file (gzip)",
        begins: "0x1f 0x8b",
        instead: "unpack it first: `gunzip`",
        is: |bytes| bytes.starts_with(b"\x1f\x8b"),
    },
    Unsupported {
        what: "an old Excel workbook (.xls), or another file of Microsoft Office",
        begins: "0xd0 0xcf 0x11 0xe0",
        instead: "export the sheet as CSV",
        is: |bytes| bytes.starts_with(b"\xd0\xcf\x11\xe0"),
    },
    Unsupported {
        what: "a MATLAB file (.mat)",
        begins: "`MATLAB 5.0 MAT-file`, or 0x89 `HDF`",
        instead: "write the joint angles as CSV in MATLAB (`writetable`)",
        is: |bytes| bytes.starts_with(b"MATLAB 5.0 MAT-file") || bytes.starts_with(b"\x89HDF\r\n"),
    },
    Unsupported {
        what: "an SQLite database, perhaps a bag of ROS 2",
        begins: "`SQLite format 3`",
        instead: "convert a bag to MCAP (`ros2 bag convert`), or export the joint angles as CSV",
        is: |bytes| bytes.starts_with(b"SQLite format 3\0"),
    },
    Unsupported {
        what: "a web page (HTML), perhaps the page of a download instead of the file",
        begins: "`<!doctype html` or `<html`",
        instead: "download the file itself",
        is: |bytes| {
            let head: Vec<u8> = trimmed(bytes).iter().take(14).map(u8::to_ascii_lowercase).collect();
            head.starts_with(b"<!doctype html") || head.starts_with(b"<html")
        },
    },
];

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

/// Whether the first kilobytes contain a piece; the entries of a workbook are there.
fn contains(bytes: &[u8], piece: &[u8]) -> bool {
    bytes[..bytes.len().min(4096)].windows(piece.len()).any(|window| window == piece)
}
