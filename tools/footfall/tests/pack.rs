//! `footfall pack` keeps the parameters of a generator file: as a flash record, and as a Rust constant.

// The constants are written for crates that export them.
#![allow(unreachable_pub)]

use cpg_core::entrainment::EventSource;
use footfall::command::pack::constant;
use generator_file::file::GeneratorFile;
use joint_loop::store::generator_record::{read, record_of};
use joint_loop::{FollowConfig, GeneratorConfig, SeriesConfig, ShapeConfig};
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
    let followed = FollowConfig { sensor: Joint::RightKnee, events: EventSource::None, shape: awkward() };
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
        assert_eq!(record_of(&compiled).bytes(), record_of(&config).bytes(), "{name}");
    }
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
    assert_eq!(stored.config, file.set.config());

    std::fs::remove_file(&packed).unwrap();
    std::fs::write(&params, file.to_toml().replace("alpha_per_s = 0.0014", "alpha_per_s = -1")).unwrap();
    let failure = call(&["pack".into(), params.into(), "--out".into(), packed.clone().into()]).unwrap_err();
    assert!(failure.exit_code() == 2 && failure.to_string().contains("alpha_per_s"), "{failure}");
    assert!(!packed.exists());
}
