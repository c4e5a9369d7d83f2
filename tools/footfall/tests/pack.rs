//! `footfall pack` keeps the parameters of a generator file: as a flash record, and as a Rust constant.

// The constants are written for crates that export them.
#![allow(unreachable_pub)]

use cpg_core::entrainment::{Corrections, EventSource};
use footfall::command::pack::constant;
use generator_file::file::GeneratorFile;
use joint_loop::store::generator_record::{read, record_of};
use joint_loop::store::robot_record;
use joint_loop::{FollowConfig, GeneratorConfig, RecordName, RobotConfig, SeriesConfig, ShapeConfig};
use joint_units::{Joint, Radians};
use std::ffi::OsString;

#[path = "constants/follow.rs"]
mod follow;
#[path = "constants/phase_coupled.rs"]
mod phase_coupled;
#[path = "constants/shape.rs"]
mod shape;
#[path = "constants/thesis.rs"]
mod thesis;

/// Numbers that are awkward to print.
fn awkward() -> ShapeConfig {
    let series = |mean| SeriesConfig {
        mean: Radians(mean),
        cos: [1.0, -0.1, 1e-7, -1.0e-12, 0.333_333_34, 0.0, -0.0, 5e-45],
        sin: [0.5, 0.25, 0.125, 1.0 / 3.0, -2.0 / 3.0, 6.25, -6.25, 1e-30],
    };
    ShapeConfig { stride_s: 1.1, joints: [0.0, -0.5, 1.0 / 3.0, 2.0].map(series) }
}

/// The files are what `pack` writes today, the compiler takes them, and their constants are the very parameters.
#[test]
fn a_constant_in_rust_is_the_file_bit_for_bit() {
    let default = |name| GeneratorFile::default_of(name).unwrap().set.config();
    let followed = FollowConfig {
        sensor: Joint::RightKnee,
        events: EventSource::None,
        shape: awkward(),
        corrections: Corrections::NONE,
    };
    for (name, config, text, compiled) in [
        (
            "phase-coupled",
            default("phase-coupled"),
            include_str!("constants/phase_coupled.rs"),
            phase_coupled::GENERATOR,
        ),
        ("thesis", default("thesis"), include_str!("constants/thesis.rs"), thesis::GENERATOR),
        ("follow", GeneratorConfig::Follow(followed), include_str!("constants/follow.rs"), follow::GENERATOR),
        ("shape", GeneratorConfig::Shape(awkward()), include_str!("constants/shape.rs"), shape::GENERATOR),
    ] {
        let written = constant(&config, "a test");
        assert_eq!(text, written, "{name}");
        assert_eq!(compiled, config, "{name}");
        let bytes = |config| record_of(config, &RecordName::BUILT_IN).bytes().to_vec();
        assert_eq!(bytes(&compiled), bytes(&config), "{name}");
    }
}

/// `defaults robot` prints a file that packs to the record of the default robot, bit for bit.
#[test]
fn the_default_robot_is_printed_and_packed() {
    let folder = tempfile::tempdir().unwrap();
    let (toml, packed) = (folder.path().join("robot.toml"), folder.path().join("robot.bin"));
    let printed =
        std::process::Command::new(env!("CARGO_BIN_EXE_footfall")).args(["defaults", "robot"]).output().unwrap();
    std::fs::write(&toml, &printed.stdout).unwrap();
    let call = |arguments: [OsString; 5]| footfall::cli::call(std::iter::once("footfall".into()).chain(arguments));
    call(["pack".into(), "--robot".into(), toml.into(), "--out".into(), packed.clone().into()]).unwrap();
    let name = RecordName::new("default biped").unwrap();
    let expected = robot_record::record_of(&RobotConfig::default_biped(), &name);
    assert_eq!(std::fs::read(&packed).unwrap(), expected.bytes());
}

#[test]
fn a_flash_record_has_the_parameters_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let (params, packed) = (folder.path().join("generator.toml"), folder.path().join("generator.bin"));
    let file = GeneratorFile::default_of("thesis").unwrap();
    std::fs::write(&params, file.to_toml()).unwrap();
    let call =
        |arguments: &[OsString]| footfall::cli::call(std::iter::once("footfall".into()).chain(arguments.to_vec()));
    call(&["pack".into(), params.clone().into(), "--out".into(), packed.clone().into()]).unwrap();
    let stored = read(&std::fs::read(&packed).unwrap()).unwrap().unwrap();
    assert_eq!((stored.config, stored.name.as_str()), (file.set.config(), "generator"));
    let named = |name: &str| {
        call(&[
            "pack".into(),
            params.clone().into(),
            "--name".into(),
            name.into(),
            "--out".into(),
            packed.clone().into(),
            "--force".into(),
        ])
    };
    named("normal walk").unwrap();
    assert_eq!(read(&std::fs::read(&packed).unwrap()).unwrap().unwrap().name.as_str(), "normal walk");
    let refusal = named("a name of more than 24 bytes").unwrap_err();
    assert!(refusal.exit_code() == 2 && refusal.to_string().contains("allowed are 1 to 24 bytes"), "{refusal}");

    std::fs::remove_file(&packed).unwrap();
    std::fs::write(&params, file.to_toml().replace("alpha_per_s = 0.0014", "alpha_per_s = -1")).unwrap();
    let failure = call(&["pack".into(), params.into(), "--out".into(), packed.clone().into()]).unwrap_err();
    assert!(failure.exit_code() == 2 && failure.to_string().contains("alpha_per_s"), "{failure}");
    assert!(!packed.exists());
}

/// `check --record` names what a record holds, alone and in its sector, and says what is wrong with anything else.
#[test]
fn check_tells_records_apart() {
    let folder = tempfile::tempdir().unwrap();
    let samples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples");
    let run = |arguments: &[OsString]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_footfall")).args(arguments).output().unwrap();
        let words = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        (output.status.code(), words)
    };
    let packed = |name: &str, what: &[OsString]| {
        let out = folder.path().join(name);
        let arguments = [&["pack".into(), "--out".into(), out.clone().into()], what].concat();
        assert_eq!(run(&arguments).0, Some(0));
        std::fs::read(out).unwrap()
    };
    let check = |bytes: &[u8]| {
        let file = folder.path().join("checked.bin");
        std::fs::write(&file, bytes).unwrap();
        run(&["check".into(), "--record".into(), file.into()])
    };
    let mut sensor = OsString::from("right_hip=");
    sensor.push(samples.join("sensor.toml"));
    let generator = packed("g.bin", &[samples.join("generator.toml").into()]);
    let sensors = packed("s.bin", &["--sensor".into(), sensor]);
    let robot = packed("r.bin", &["--robot".into(), samples.join("robot.toml").into()]);
    for (bytes, words) in [
        (&generator, "good: the generator \"generator\", shape, check sum "),
        (&sensors, " on right_hip, check sum "),
        (&robot, "good: the robot \"small biped\", check sum "),
    ] {
        let mut sector = bytes.clone();
        sector.resize(16 * 1024, 0xFF);
        let (code, said) = check(&sector);
        assert!(code == Some(0) && said.contains(words), "{said}");
        assert_eq!(check(bytes), (code, said));
        let (code, said) = check(&bytes[..bytes.len() - 4]);
        assert!(code == Some(2) && said.contains("damaged"), "{said}");
        sector[16 * 1024 - 1] = 0;
        let (code, said) = check(&sector);
        assert!(code == Some(2) && said.contains("not erased after the record"), "{said}");
    }
    assert!(check(&[0xFF; 64]).1.ends_with(": erased\n"));
    for bytes in [&b""[..], b"#!/bin/sh", &[0; 64], &[[0xFF; 63].as_slice(), &[0xFE]].concat()] {
        let (code, said) = check(bytes);
        assert!(code == Some(2) && said.contains("no record; allowed is"), "{said}");
    }
    let (code, said) = check(&[0xFF; 16 * 1024 + 1]);
    assert!(code == Some(2) && said.contains("larger than 16384 bytes"), "{said}");
}
