//! Records in a board's flash: format, names, generator record, robot record, sensor record.

pub mod flash_record;
pub mod generator_record;
pub mod record_name;
pub mod robot_record;
pub mod sensor_record;
