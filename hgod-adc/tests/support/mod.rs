//! A sensor, a gait and noise for the tests of the chain.
#![allow(dead_code, reason = "each test file uses a part of it")]

use hgod_adc::rk09k;
use hgod_adc::{Calibration, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig, Supply};
use joint_units::{AdcCode, Period, Volts};

/// The factory's reading of the internal reference; the same reading in operation means 3.3 V.
pub(crate) const CAL: AdcCode = AdcCode(1501);

/// A potentiometer's curve from -52 to 88 degrees over 0.87 to 2.9 V, on a supply of its own.
pub(crate) fn config() -> SensorConfig {
    let points = rk09k::points::<17>(Volts(3.3), 0.265, 0.88);
    SensorConfig {
        reference: ReferenceConfig::stm32f4(CAL),
        calibration: Calibration::new(&points, Interpolation::MonotoneCubic).unwrap(),
        filter: FilterConfig::default(),
        health: HealthConfig::default(),
    }
}

pub(crate) fn sensor() -> Sensor {
    config().build(Period::MILLISECOND).unwrap()
}

pub(crate) fn nominal() -> Supply {
    Supply::new(Volts(3.3)).unwrap()
}

/// A knee in walking: two harmonics, 3 to 62 degrees; `cycles` counts strides.
pub(crate) fn knee_degrees(cycles: f64) -> f32 {
    let turn = std::f64::consts::TAU * cycles;
    (26.0 - 18.0 * (turn + 0.6).cos() - 17.0 * (2.0 * turn + 0.1).cos()) as f32
}

/// Seeded noise: an xorshift generator, and the sum of twelve uniform numbers for a normal one.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    /// 0 to 1.
    pub(crate) fn uniform(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// Mean 0, standard deviation 1.
    pub(crate) fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.uniform()).sum::<f32>() - 6.0
    }
}
