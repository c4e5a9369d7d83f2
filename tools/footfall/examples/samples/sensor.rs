//! A sensor: its curve, rows of its calibration, and its table.

use super::random::Noise;
use std::fmt::Write as _;

/// Known angles, degrees.
const ANGLES_DEG: std::ops::RangeInclusive<i32> = -40..=130;
const STEP_DEG: usize = 10;
/// Half the difference of the sweeps up and down, V.
const HYSTERESIS_V: f64 = 0.003;
/// Standard deviation of a reading, V.
const NOISE_V: f64 = 0.001;
/// Readings of a visit to an angle.
const READINGS: u32 = 3;

/// Volts at an angle in degrees: nearly a straight line, as a potentiometer's.
pub(super) fn volts(angle_deg: f64) -> f64 {
    let part = (angle_deg - f64::from(*ANGLES_DEG.start())) / f64::from(ANGLES_DEG.end() - ANGLES_DEG.start());
    0.35 + 2.25 * part + 0.3 * part * (1.0 - part)
}

/// Known angles and volts, up and down.
pub(super) fn rows() -> String {
    let mut noise = Noise::new(6);
    let mut text = String::from(
        "# Known angles of a joint and the volts of its sensor there, for `footfall calibrate`.\nangle_deg,volts,direction\n",
    );
    let mut sweep = |angles: &mut dyn Iterator<Item = i32>, direction: &str, shift: f64| {
        for angle in angles {
            for _ in 0..READINGS {
                let volts = volts(f64::from(angle)) + shift + noise.normal(NOISE_V);
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{angle},{volts:.4},{direction}");
            }
        }
    };
    sweep(&mut ANGLES_DEG.step_by(STEP_DEG), "up", -HYSTERESIS_V);
    sweep(&mut ANGLES_DEG.rev().step_by(STEP_DEG), "down", HYSTERESIS_V);
    text
}

/// A sensor file as a person writes it.
pub(super) fn table() -> String {
    let points: String = ANGLES_DEG
        .step_by(STEP_DEG)
        .map(|angle| format!("    {{ sensor_v = {:.4}, angle_deg = {angle} }},\n", volts(f64::from(angle))))
        .collect();
    format!(
        "# The sensor whose readings are in rows.csv.\nschema = 1\ninterpolation = \"monotone_cubic\"\n\
         divider = 1.0                      # volts at the sensor for one volt at the pin\npoints = [\n{points}]\n"
    )
}
