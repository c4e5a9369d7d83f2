//! Writes OpenSim motion files.

use super::header::is_end;
use crate::format::whole_file;
use crate::recording::{Quantity, Recording};
use joint_units::Joint;
use std::io::{self, Write};
use std::path::Path;

/// OpenSim's name of a joint.
pub(crate) const fn coordinate(joint: Joint) -> &'static str {
    match joint {
        Joint::LeftHip => "hip_flexion_l",
        Joint::RightHip => "hip_flexion_r",
        Joint::LeftKnee => "knee_angle_l",
        Joint::RightKnee => "knee_angle_r",
    }
}

/// Writes a recording as a motion file, version 1, in degrees, completely or not at all. Channels that are joints get OpenSim's
/// names, other angles keep theirs. Flexion stays positive. Reading the file gives the same bits.
///
/// # Errors
/// A channel is not an angle, or the file cannot be written.
pub fn write(path: &Path, recording: &Recording) -> io::Result<()> {
    whole_file::write(path, |out| {
        let title = path.file_stem().map_or_else(|| "motion".into(), |stem| stem.to_string_lossy().into_owned());
        write_to(out, &title, recording)
    })
}

/// Writes the text of a motion file; `title` is its first line.
///
/// # Errors
/// A channel is not an angle, the title has more than one line, or an error of the writer.
///
/// ```
/// use gait_trace::{Channel, Quantity, Recording};
/// use gait_trace::format::opensim;
/// let knee = Channel::new("left_knee", Quantity::Angle, vec![10.0, 20.5]);
/// let mut text = Vec::new();
/// opensim::write_to(&mut text, "walk", &Recording::build(vec![0.0, 0.5], vec![knee])?)?;
/// let text = String::from_utf8(text)?;
/// assert_eq!(text, "walk\nversion=1\nnRows=2\nnColumns=2\ninDegrees=yes\nendheader\ntime\tknee_angle_l\n0\t10\n0.5\t20.5\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_to(out: &mut dyn Write, title: &str, recording: &Recording) -> io::Result<()> {
    let refuse = |why: String| Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    if title.contains(char::is_control) || is_end(title) {
        return refuse(format!("title `{}`; allowed is one line of text", title.escape_debug()));
    }
    let channels = recording.channels();
    if let Some(volts) = channels.iter().find(|channel| channel.quantity() != Quantity::Angle) {
        return refuse(format!("`{}` holds {}; allowed are angles", volts.name(), volts.quantity().unit()));
    }
    let (rows, columns) = (recording.time_s().len(), channels.len() + 1);
    writeln!(out, "{title}\nversion=1\nnRows={rows}\nnColumns={columns}\ninDegrees=yes\nendheader")?;
    write!(out, "time")?;
    for channel in channels {
        let joint = Joint::ALL.into_iter().find(|joint| joint.name() == channel.name());
        match joint {
            Some(joint) => write!(out, "\t{}", coordinate(joint))?,
            None => write!(out, "\t{}", channel.name())?,
        }
    }
    for (row, time) in recording.time_s().iter().enumerate() {
        write!(out, "\n{time}")?;
        for channel in channels {
            write!(out, "\t{}", channel.values()[row])?;
        }
    }
    writeln!(out)
}
