//! Converts codes to angles while a wire breaks after 10 ms: `cargo run -p hgod-adc --example hello_adc`.

use hgod_adc::{
    Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, SensorConfig,
    SensorState,
};
use joint_units::{AdcCode, Period, Radians, Volts};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let measured = [(0.5, 120.0), (1.5, 60.0), (2.5, 0.0)];
    let points = measured.map(|(v, deg)| CalibrationPoint { volts: Volts(v), angle: Radians::from_degrees(deg) });
    let sensor = SensorConfig {
        reference: ReferenceConfig::stm32f4(AdcCode(1501)),
        calibration: Calibration::new(&points, Interpolation::Linear)?,
        filter: FilterConfig::default(),
        health: HealthConfig::default(),
    }
    .build(Period::MILLISECOND)?;
    let mut state = SensorState::default();
    for (tick, code) in (0u16..40).map(|tick| (tick, if tick < 10 { 2172 + tick % 2 } else { 3 })) {
        let reading = sensor.sample(&mut state, AdcCode(code), AdcCode(1501));
        if tick % 5 == 0 {
            let (degrees, volts) = (reading.angle.degrees(), reading.volts.0);
            println!("{tick:2} ms: code {code:4}, {volts:.3} V, {degrees:5.1} degrees, {}", reading.validity);
        }
    }
    Ok(())
}
