//! Random numbers that are the same on every machine.

/// A number from 0 up to 1, never 1, from random bits.
#[must_use]
pub fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Standard normal (Box and Muller), from two numbers from 0 up to 1, never 1.
#[must_use]
pub fn normal(mut unit: impl FnMut() -> f64) -> f64 {
    let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit()));
    radius * libm::cos(std::f64::consts::TAU * unit())
}

/// Splitmix64.
#[derive(Debug, Clone)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Uniform from 0 to 1.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        unit(z ^ (z >> 31))
    }

    /// Uniform from -size to size.
    pub(crate) fn within(&mut self, size: f64) -> f64 {
        size * (2.0 * self.unit() - 1.0)
    }

    /// Standard normal.
    pub(crate) fn normal(&mut self) -> f64 {
        normal(|| self.unit())
    }
}
