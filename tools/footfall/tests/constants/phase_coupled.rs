// Written by `footfall pack --rust`. Angles in radians, times in seconds.
use cpg_core::network::phase_coupled::RobustConfig;
use joint_loop::GeneratorConfig;
use joint_units::{Phase, Radians};

/// A generator fitted to: a test
#[rustfmt::skip]
#[allow(clippy::all)]
pub const GENERATOR: GeneratorConfig = GeneratorConfig::PhaseCoupled(
    RobustConfig {
        natural_period: 1.0847774,
        nonlinearity: 0.5,
        coupling: [
            0.5,
            0.5,
            0.5,
            0.5,
        ],
        phases: [
            Phase(
                0,
            ),
            Phase(
                2147483648,
            ),
            Phase(
                954437177,
            ),
            Phase(
                3101920825,
            ),
        ],
        amplitudes: [
            Radians(
                0.34906584,
            ),
            Radians(
                0.34906584,
            ),
            Radians(
                0.5235988,
            ),
            Radians(
                0.5235988,
            ),
        ],
        offsets: [
            Radians(
                0.08726646,
            ),
            Radians(
                0.08726646,
            ),
            Radians(
                0.5235988,
            ),
            Radians(
                0.5235988,
            ),
        ],
    },
);
