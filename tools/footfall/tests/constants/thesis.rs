// Written by `footfall pack --rust`. Angles in radians, times in seconds.
use cpg_core::network::thesis::NetworkConfig;
use cpg_core::oscillator::rayleigh::RayleighConfig;
use joint_loop::GeneratorConfig;
use joint_units::Phase;

/// A generator fitted to: a test
#[rustfmt::skip]
#[allow(clippy::all)]
pub const GENERATOR: GeneratorConfig = GeneratorConfig::Thesis(
    NetworkConfig {
        joints: [
            RayleighConfig {
                alpha: 0.0014,
                p: 0.02943827,
                mu: 5.7119865,
                offset: 5.0,
            },
            RayleighConfig {
                alpha: 0.002,
                p: 0.020637438,
                mu: 5.7119865,
                offset: 5.0,
            },
            RayleighConfig {
                alpha: 0.0108,
                p: 0.0025781034,
                mu: 5.7119865,
                offset: 30.0,
            },
            RayleighConfig {
                alpha: 0.0108,
                p: 0.0025781034,
                mu: 5.7119865,
                offset: 30.0,
            },
        ],
        difference: [
            [
                0.201,
                0.201,
            ],
            [
                0.3012,
                0.3012,
            ],
        ],
        product: [
            [
                0.0125,
                0.0125,
            ],
            [
                0.0129,
                0.0129,
            ],
        ],
        phases: [
            Phase(
                0,
            ),
            Phase(
                2147483648,
            ),
            Phase(
                3101920825,
            ),
            Phase(
                954437177,
            ),
        ],
    },
);
