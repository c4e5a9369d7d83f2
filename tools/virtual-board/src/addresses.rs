//! Where the flash lies (RM0090 2.3.1, RM0383 2.3).

/// Start address of flash.
pub(crate) const FLASH: u32 = 0x0800_0000;
/// Size of the largest flash of the modelled chips, bytes.
pub(crate) const FLASH_SIZE: u32 = 0x10_0000;
