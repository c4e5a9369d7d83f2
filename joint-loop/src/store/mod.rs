//! Records in a board's flash: format, generator record, sensor record.

pub mod flash_record;
pub mod generator_record;
pub mod sensor_record;
