//! The walker's parameters: from the first parameter sector, or built in where that is erased.

use joint_loop::WalkerConfig;
use joint_loop::walker_record::{self, Record, RecordError, Stored};

/// What to walk with. A sector that holds something else than a walker is an error, not a reason for the built-in one: somebody
/// meant this board to walk another way.
pub(crate) fn walker() -> Result<Stored, RecordError> {
    Ok(walker_record::read(sector())?.unwrap_or_else(|| {
        let config = WalkerConfig::default_walk();
        Stored { config, crc: Record::of(&config).crc() }
    }))
}

/// The start of the sector.
#[cfg(target_os = "none")]
fn sector() -> &'static [u8] {
    // SAFETY: flash, mapped and readable from reset on (RM0090 table 5); the program is linked around it (memory.x) and writes no flash.
    unsafe { core::slice::from_raw_parts(walker_record::ADDRESS as *const u8, walker_record::MAX_BYTES) }
}

/// The host has no flash.
#[cfg(not(target_os = "none"))]
fn sector() -> &'static [u8] {
    &[0xFF; walker_record::MAX_BYTES]
}
