//! Generators of four, six and eight joints behind one trait, since the number of joints is known only when a file is read.

use cpg_core::gait::named::DefaultGait;
use cpg_core::gait::six_and_eight_joints::{WithAnkles, WithArms};
use cpg_core::network::phase_coupled::Robust;
use cpg_core::{Generator, Rk4, StateFault};
use generator_file::network_file::NetworkSet;
use joint_loop::BoardGenerator;
use joint_units::{Period, Phase};

/// A generator of any number of joints.
pub(crate) trait Stepped: Send + Sync {
    /// Advances by one control period.
    fn step(&mut self);
    /// Number of joints.
    fn joints(&self) -> usize;
    /// Appends the angles, radians.
    fn angles(&self, out: &mut Vec<f32>);
    /// Appends their rates, rad/s.
    fn rates(&self, out: &mut Vec<f32>);
    /// Phase of the gait.
    fn phase(&self) -> Phase;
    /// Amplitude relative to that of the limit cycle.
    fn amplitude(&self) -> f32;
    /// Whether every state is finite and within its bound.
    fn check(&self) -> Result<(), StateFault>;
    /// Returns to the state after the build.
    fn reset(&mut self);
    /// The generator of a board, which can be given measurements; `None` for the others.
    fn of_board(&mut self) -> Option<&mut BoardGenerator> {
        None
    }
}

macro_rules! stepped {
    ($($built:ty: $joints:literal $(, $of_board:ident)?;)+) => {$(
        impl Stepped for $built {
            fn step(&mut self) {
                Generator::<$joints>::step(self);
            }

            fn joints(&self) -> usize {
                $joints
            }

            fn angles(&self, out: &mut Vec<f32>) {
                out.extend(Generator::<$joints>::angles(self).map(|angle| angle.0));
            }

            fn rates(&self, out: &mut Vec<f32>) {
                out.extend(Generator::<$joints>::rates(self).map(|rate| rate.0));
            }

            fn phase(&self) -> Phase {
                Generator::<$joints>::phase(self)
            }

            fn amplitude(&self) -> f32 {
                Generator::<$joints>::amplitude(self)
            }

            fn check(&self) -> Result<(), StateFault> {
                Generator::<$joints>::check(self)
            }

            fn reset(&mut self) {
                Generator::<$joints>::reset(self);
            }

            $(fn $of_board(&mut self) -> Option<&mut BoardGenerator> {
                Some(self)
            })?
        }
    )+};
}

type Six = Robust<WithAnkles, 6, 7, f64, Rk4>;
type Eight = Robust<WithArms, 8, 10, f64, Rk4>;

stepped! {
    BoardGenerator: 4, of_board;
    DefaultGait: 4;
    Six: 6;
    Eight: 8;
}

/// Builds a network of six or eight joints.
pub(crate) fn network(set: &NetworkSet, period: Period) -> Result<Box<dyn Stepped>, String> {
    if let Some(config) = set.config::<6, 7>() {
        let built: Six = config.build(period).map_err(|error| error.to_string())?;
        return Ok(Box::new(built));
    }
    let config = set.config::<8, 10>().ok_or("a network has 6 joints and 7 links, or 8 joints and 10 links")?;
    let built: Eight = config.build(period).map_err(|error| error.to_string())?;
    Ok(Box::new(built))
}
