//! The thesis' Table 1 as an individual of the searches.

use cpg_core::network::thesis::ThesisConfig;
use cpg_core::oscillator::rayleigh::RayleighConfig;
use gait_fit::search::{Network, NetworkState, Oscillator};

/// Set S: Table 1 of the thesis with what it leaves out (p, mu, a0) as in [`ThesisConfig::set_s`], started at
/// angles of 25, -15, 45, 15 degrees and velocities of 0, 0, 100, -100 degrees per second, which is off its cycle.
#[must_use]
pub fn set_s() -> Network {
    let config = ThesisConfig::<f64>::set_s();
    let mut network = from_config(&config);
    let angles = [25.0, -15.0, 45.0, 15.0];
    network.start.displacement = std::array::from_fn(|i| angles[i] - network.joints[i].offset);
    network.start.velocity = [0.0, 0.0, 100.0, -100.0];
    network
}

/// The network of a configuration of the core, at rest.
#[must_use]
pub fn from_config(config: &ThesisConfig<f64>) -> Network {
    let difference =
        [config.difference[0][0], config.difference[0][1], config.difference[1][0], config.difference[1][1]];
    let product = [config.product[0][0], config.product[1][0], config.product[0][1], config.product[1][1]];
    let joints = std::array::from_fn(|i| {
        let RayleighConfig { alpha, p, mu, offset } = config.joints[i];
        Oscillator { alpha, p, mu, offset, difference: difference[i], product: product[i] }
    });
    Network { joints, start: NetworkState::default() }
}
