//! The motion of a network of six or eight joints on the host, in f64 at 1 ms.

use cpg_core::gait::six_and_eight_joints::{WithAnkles, WithArms};
use cpg_core::network::graph::Graph;
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::{Generator, Rk4};
use joint_units::Period;

use crate::network_file::NetworkSet;

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

/// The motion from the start up to `until_s`, every `every_ms` milliseconds.
///
/// # Errors
/// The network cannot be built; the text says why.
pub fn motion(set: &NetworkSet, until_s: f64, every_ms: u32) -> Result<Vec<Moment>, String> {
    match (set.config::<6, 7>(), set.config::<8, 10>()) {
        (Some(config), _) => play::<WithAnkles, 6, 7>(&config, until_s, every_ms),
        (_, Some(config)) => play::<WithArms, 8, 10>(&config, until_s, every_ms),
        _ => Err("a network has 6 joints and 7 links, or 8 joints and 10 links".into()),
    }
}

fn play<G: Graph<N, E>, const N: usize, const E: usize>(
    config: &RobustConfig<N, E, f64>,
    until_s: f64,
    every_ms: u32,
) -> Result<Vec<Moment>, String> {
    let built: Result<Robust<G, N, E, f64, Rk4>, _> = config.build(Period::MILLISECOND);
    let mut network = built.map_err(|error| error.to_string())?;
    let mut moments = vec![];
    for tick in 0..=(until_s * 1e3) as u32 {
        if tick.is_multiple_of(every_ms.max(1)) {
            moments.push(Moment {
                time_s: f64::from(tick) * 1e-3,
                phase: f64::from(network.phase().cycles()),
                angles_deg: network.angles().map(|angle| f64::from(angle.degrees())).to_vec(),
            });
        }
        network.step();
    }
    Ok(moments)
}
