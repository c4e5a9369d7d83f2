// Written by `footfall pack --rust`. Angles in radians, times in seconds.
use cpg_core::entrainment::Corrections;
use cpg_core::entrainment::EventSource::*;
use joint_loop::{FollowConfig, GeneratorConfig, SeriesConfig, ShapeConfig};
use joint_units::Joint::*;
use joint_units::Radians;

/// A generator fitted to: a test
#[rustfmt::skip]
#[allow(clippy::all)]
pub const GENERATOR: GeneratorConfig = GeneratorConfig::Follow(
    FollowConfig {
        sensor: RightKnee,
        events: None,
        shape: ShapeConfig {
            stride_s: 1.1,
            joints: [
                SeriesConfig {
                    mean: Radians(
                        0.0,
                    ),
                    cos: [
                        1.0,
                        -0.1,
                        1e-7,
                        -1e-12,
                        0.33333334,
                        0.0,
                        -0.0,
                        6e-45,
                    ],
                    sin: [
                        0.5,
                        0.25,
                        0.125,
                        0.33333334,
                        -0.6666667,
                        6.25,
                        -6.25,
                        1e-30,
                    ],
                },
                SeriesConfig {
                    mean: Radians(
                        -0.5,
                    ),
                    cos: [
                        1.0,
                        -0.1,
                        1e-7,
                        -1e-12,
                        0.33333334,
                        0.0,
                        -0.0,
                        6e-45,
                    ],
                    sin: [
                        0.5,
                        0.25,
                        0.125,
                        0.33333334,
                        -0.6666667,
                        6.25,
                        -6.25,
                        1e-30,
                    ],
                },
                SeriesConfig {
                    mean: Radians(
                        0.33333334,
                    ),
                    cos: [
                        1.0,
                        -0.1,
                        1e-7,
                        -1e-12,
                        0.33333334,
                        0.0,
                        -0.0,
                        6e-45,
                    ],
                    sin: [
                        0.5,
                        0.25,
                        0.125,
                        0.33333334,
                        -0.6666667,
                        6.25,
                        -6.25,
                        1e-30,
                    ],
                },
                SeriesConfig {
                    mean: Radians(
                        2.0,
                    ),
                    cos: [
                        1.0,
                        -0.1,
                        1e-7,
                        -1e-12,
                        0.33333334,
                        0.0,
                        -0.0,
                        6e-45,
                    ],
                    sin: [
                        0.5,
                        0.25,
                        0.125,
                        0.33333334,
                        -0.6666667,
                        6.25,
                        -6.25,
                        1e-30,
                    ],
                },
            ],
        },
        corrections: Corrections::NONE,
    },
);
