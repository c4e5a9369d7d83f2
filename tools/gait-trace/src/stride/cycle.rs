//! One stride of four joints, resampled to a fixed number of points: the target of fits.

use crate::stride::metrics::rmse;
use joint_units::Joint;

/// Number of points of a cycle. Point `k` is at the cycle fraction `k / POINTS`; the cycle is closed, so point `POINTS` is point 0.
pub const POINTS: usize = 200;

/// Four joints over one stride, degrees, in the order of [`Joint::ALL`].
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle(pub [[f64; POINTS]; Joint::COUNT]);

impl Cycle {
    /// Root mean square difference of each joint, degrees.
    #[must_use]
    pub fn rmse_deg(&self, other: &Self) -> [f64; Joint::COUNT] {
        std::array::from_fn(|joint| rmse(&self.0[joint], &other.0[joint]).unwrap_or(f64::NAN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rmse_is_per_joint() {
        let flat = Cycle([[1.0; POINTS]; 4]);
        let mut other = flat.clone();
        other.0[2] = [-2.0; POINTS];
        assert_eq!(flat.rmse_deg(&other), [0.0, 0.0, 3.0, 0.0]);
    }
}
