//! The motion of the generator of a file on the host, at 1 ms: of four joints as a board computes it, in f32; of six or eight in f64.

use cpg_core::gait::six_and_eight_joints::{WithAnkles, WithArms};
use cpg_core::network::graph::Graph;
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::{Generator, Rk4};
use joint_units::{Joint, Period};

use crate::file::GeneratorSet;
use crate::led::Led;
use crate::network_file::{JOINTS, NetworkSet};

/// One moment of the motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time since the start, s.
    pub time_s: f64,
    /// Phase of the gait, 0 to 1.
    pub phase: f64,
    /// Angles in the order of the joints, degrees.
    pub angles_deg: Vec<f64>,
}

/// The motion of a network of six or eight joints from its start up to `until_s`, every `every_ms` milliseconds.
///
/// # Errors
/// The network cannot be built; the text says why.
pub fn of_network(set: &NetworkSet, until_s: f64, every_ms: u32) -> Result<Vec<Moment>, String> {
    match (set.config::<6, 7>(), set.config::<8, 10>()) {
        (Some(config), _) => network::<WithAnkles, 6, 7>(&config, until_s, every_ms),
        (_, Some(config)) => network::<WithArms, 8, 10>(&config, until_s, every_ms),
        _ => Err("a network has 6 joints and 7 links, or 8 joints and 10 links".into()),
    }
}

/// The motion of a generator of four joints from its start, which is the boot of a board, up to `until_s`, every `every_ms` milliseconds. A follower
/// gets the angles of a simulated person who walks the template at the stride of the file.
///
/// # Errors
/// The generator cannot be built; the text says why.
pub fn of_set(set: &GeneratorSet, until_s: f64, every_ms: u32) -> Result<Vec<Moment>, String> {
    Ok(moments(Led::new(set, Period::MILLISECOND)?, until_s, every_ms))
}

/// Names of the joints of [`of_set`] in their order.
#[must_use]
pub fn four_joints() -> &'static [&'static str] {
    &JOINTS[..Joint::COUNT]
}

fn network<G: Graph<N, E>, const N: usize, const E: usize>(
    config: &RobustConfig<N, E, f64>,
    until_s: f64,
    every_ms: u32,
) -> Result<Vec<Moment>, String> {
    let built: Result<Robust<G, N, E, f64, Rk4>, _> = config.build(Period::MILLISECOND);
    Ok(moments(built.map_err(|error| error.to_string())?, until_s, every_ms))
}

fn moments<const N: usize>(mut generator: impl Generator<N>, until_s: f64, every_ms: u32) -> Vec<Moment> {
    let mut moments = vec![];
    for tick in 0..=(until_s * 1e3) as u32 {
        if tick.is_multiple_of(every_ms.max(1)) {
            moments.push(Moment {
                time_s: f64::from(tick) * 1e-3,
                phase: f64::from(generator.phase().cycles()),
                angles_deg: generator.angles().map(|angle| f64::from(angle.degrees())).to_vec(),
            });
        }
        generator.step();
    }
    moments
}
