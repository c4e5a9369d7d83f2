//! `footfall check --record`: what a flash record holds, or a sector that was read from a board.

use joint_loop::store::{generator_record, robot_record, sensor_record};
use std::fmt::Display;
use std::path::Path;

use crate::failure::Failure;
use crate::file::bounded;

/// A sector of the boards, in bytes: no record is longer.
const MOST_BYTES: u64 = firmware::board::SECTOR_BYTES as u64;

/// One line about a sector that is erased or has a whole record.
///
/// # Errors
/// It cannot be read, is longer than a sector, is damaged, or holds something else.
pub(super) fn check(path: &Path) -> Result<String, Failure> {
    let wrong = |why: &dyn Display| Failure::input(format!("{}: {why}", path.display()));
    let bytes = bounded::bytes(path, MOST_BYTES).map_err(|error| wrong(&error))?;
    let line = if bytes.starts_with(&generator_record::MAGIC) {
        generator_record::read(&bytes).map_err(|error| wrong(&error))?.map(|stored| {
            let kind = stored.config.name();
            format!("good: the generator \"{}\", {kind}, check sum {:08x}", stored.name, stored.crc)
        })
    } else if bytes.starts_with(&sensor_record::MAGIC) {
        sensor_record::read(&bytes).map_err(|error| wrong(&error))?.map(|stored| {
            let joints: Vec<&str> = stored.sensors.iter().map(|sensor| sensor.joint.name()).collect();
            let joints = joints.join(", ");
            format!("good: the sensors \"{}\" on {joints}, check sum {:08x}", stored.name, stored.crc)
        })
    } else if bytes.starts_with(&robot_record::MAGIC) {
        robot_record::read(&bytes)
            .map_err(|error| wrong(&error))?
            .map(|stored| format!("good: the robot \"{}\", check sum {:08x}", stored.name, stored.crc))
    } else {
        (!bytes.is_empty() && bytes.iter().all(|byte| *byte == 0xFF)).then(|| "erased".to_owned())
    };
    let line = line.ok_or_else(|| {
        wrong(
            &"no record; allowed is one that begins with FFWK (generator), FFSN (sensors) or FFRB (robot), or a sector of which every byte is 0xFF",
        )
    })?;
    Ok(format!("{}: {line}", path.display()))
}
