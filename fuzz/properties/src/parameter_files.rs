//! Generator, network and robot files: an accepted file builds, and what is written from it is read as the same.

use std::fmt::Debug;

use generator_file::file::GeneratorFile;
use generator_file::network_file::NetworkFile;
use generator_file::robot_file::RobotFile;
use joint_loop::RecordName;
use joint_loop::store::{generator_record, robot_record};
use joint_units::Period;

/// The name of every file here.
const FILE: &str = "a.toml";

/// Reads the bytes as text, writes what is accepted, and reads that.
fn written_and_read<T: PartialEq + Debug, E: std::fmt::Display>(
    bytes: &[u8],
    parse: impl Fn(&str) -> Result<T, E>,
    write: impl Fn(&T) -> String,
) -> Option<T> {
    let text = std::str::from_utf8(bytes).ok()?;
    match parse(text) {
        Ok(file) => {
            let written = write(&file);
            let again =
                parse(&written).unwrap_or_else(|error| panic!("what was written is refused: {error}\n{written}"));
            assert_eq!(again, file, "{written}");
            Some(file)
        }
        Err(error) => {
            assert!(error.to_string().starts_with(FILE), "{error}");
            None
        }
    }
}

/// Generator files: an accepted one builds, and its flash record has its parameters.
pub fn generator(bytes: &[u8]) {
    let Some(file) = written_and_read(bytes, |text| GeneratorFile::parse(FILE, text), GeneratorFile::to_toml) else {
        return;
    };
    let config = file.set.config();
    if let Err(error) = config.build(Period::MILLISECOND) {
        panic!("the file is accepted, but no generator is built: {error}");
    }
    let record = generator_record::record_of(&config, &RecordName::BUILT_IN);
    let stored = generator_record::read(record.bytes()).expect("a generator that is built has a record");
    assert_eq!(stored.expect("not erased").config, config);
}

/// Files of networks with more than four joints.
pub fn network(bytes: &[u8]) {
    written_and_read(bytes, |text| NetworkFile::parse(FILE, text), NetworkFile::to_toml);
}

/// Robot files: an accepted one builds, and its flash record has its numbers.
pub fn robot(bytes: &[u8]) {
    let Some(file) = written_and_read(bytes, |text| RobotFile::parse(FILE, text), RobotFile::to_toml) else { return };
    let record = robot_record::record_of(&file.robot, &file.name);
    let stored = robot_record::read(record.bytes()).expect("a robot that is built has a record").expect("not erased");
    assert_eq!((stored.name, stored.robot.servos), (file.name, file.robot.servos));
}
