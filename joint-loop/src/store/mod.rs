//! Records in flash: framing, generator parameters, sensor calibrations.

pub mod flash_record;
pub mod generator_record;
pub mod sensor_record;
