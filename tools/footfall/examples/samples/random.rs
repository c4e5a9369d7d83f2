//! Reproducible noise, equal on every computer: integer arithmetic, and sums of `f64`.

/// SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Noise(u64);

impl Noise {
    /// A sequence of its own for every seed.
    pub(crate) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform from 0 to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normal: the sum of twelve uniform numbers, with this standard deviation and the mean 0.
    pub(crate) fn normal(&mut self, deviation: f64) -> f64 {
        deviation * ((0..12).map(|_| self.uniform()).sum::<f64>() - 6.0)
    }
}
