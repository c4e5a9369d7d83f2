//! A recorded walk at 1 kHz: its poses, joined by straight lines.

use joint_units::{Joint, Radians};

/// The walk, degrees, at 150 Hz.
static RECORDED: &[[f32; Joint::COUNT]] = &include!(concat!(env!("OUT_DIR"), "/recorded.rs"));
/// Ticks from one pose of it to the next: 20 in three.
const TICKS: [u32; 3] = [7, 7, 6];

/// The pose of each tick.
pub(crate) fn poses() -> impl Iterator<Item = [Radians; Joint::COUNT]> {
    let pairs = RECORDED.array_windows().zip(TICKS.into_iter().cycle());
    pairs.flat_map(|(&[from, to], ticks)| {
        (0..ticks).map(move |tick| {
            let part = tick as f32 / ticks as f32;
            let mut pose = from.map(Radians::from_degrees);
            for (angle, to) in pose.iter_mut().zip(to) {
                angle.0 += (Radians::from_degrees(to).0 - angle.0) * part;
            }
            pose
        })
    })
}
