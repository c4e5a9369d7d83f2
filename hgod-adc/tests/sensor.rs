//! The whole chain: exhaustive over codes, hostile streams, spikes, a sagging supply, and what is refused.

mod support;

use hgod_adc::{
    Calibration, CalibrationPoint, Excitation, HealthConfig, Interpolation, RangeError, SensorError, SensorState,
    Supply, Validity,
};
use joint_units::{AdcCode, Period, Radians, Volts};
use proptest::prelude::*;
use support::{CAL, Noise, config, knee_degrees, nominal, sensor};

#[test]
fn every_code_at_every_supply_has_its_validity() {
    let sensor = sensor();
    let (low, high) = sensor.calibration().span();
    let (least, greatest) = sensor.calibration().volts_span();
    let mut seen = [0_u32; Validity::ALL.len()];
    for vrefint in [0, 1, 1375, 1376, 1400, 1501, 1579, 1651, 1652, 4095, 4096, u16::MAX] {
        let supply = 3.3 * 1501.0 / f64::from(vrefint);
        for code in (0..=4095).chain([4096, u16::MAX]) {
            let volts = f64::from(code.min(4095)) / 4095.0 * supply;
            let want = if !(3.0..=3.6).contains(&supply) {
                Validity::SupplyLow
            } else if !(82..=4013).contains(&code) {
                Validity::Saturated
            } else if volts < f64::from(least.0) || volts > f64::from(greatest.0) {
                Validity::OutOfTable
            } else {
                Validity::Good
            };
            let reading = sensor.sample(&mut SensorState::default(), AdcCode(code), AdcCode(vrefint));
            assert_eq!((reading.code, reading.validity), (AdcCode(code), want), "vrefint {vrefint}");
            assert!(reading.volts.0.is_finite() && (low..=high).contains(&reading.angle));
            match want {
                Validity::Good => assert_eq!(Ok(reading.angle), sensor.calibration().angle(reading.volts)),
                _ => assert_eq!(reading.angle, Radians(0.0)),
            }
            if want != Validity::SupplyLow {
                assert!((f64::from(reading.volts.0) - volts).abs() < 1e-6);
            }
            seen[want as usize] += 1;
        }
    }
    assert!(
        [Validity::Good, Validity::Saturated, Validity::OutOfTable, Validity::SupplyLow]
            .iter()
            .all(|&v| seen[v as usize] > 800)
    );
}

#[test]
fn the_first_angle_is_the_one_nearest_to_a_standing_leg() {
    for (from, to, want) in [(-20.0, 60.0, 0.0), (15.0, 60.0, 15.0), (-50.0, -10.0, -10.0)] {
        let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
        let mut config = config();
        config.calibration = Calibration::new(&[point(0.5, from), point(2.5, to)], Interpolation::Linear).unwrap();
        let sensor = config.build(Period::MILLISECOND).unwrap();
        let reading = sensor.sample(&mut SensorState::default(), AdcCode(0), CAL);
        assert_eq!(reading.angle, Radians::from_degrees(want));
    }
}

#[test]
fn a_lost_supply_reading_keeps_the_last_scale_and_angle() {
    let sensor = sensor();
    let mut state = SensorState::default();
    let good = sensor.sample(&mut state, AdcCode(2000), AdcCode(1450));
    for vrefint in [0, 1700, 1000, 5000] {
        let bad = sensor.sample(&mut state, AdcCode(2000), AdcCode(vrefint));
        assert_eq!((bad.validity, bad.volts, bad.angle), (Validity::SupplyLow, good.volts, good.angle));
    }
    assert_eq!(sensor.sample(&mut state, AdcCode(2000), AdcCode(1450)), good);
}

/// Servos pull the supply from 3.6 to 3.0 V within 100 ms while the leg stands at an angle.
#[test]
fn a_sagging_supply_hardly_moves_the_angle() {
    let sensor = sensor();
    let mut state = SensorState::default();
    let angle = Radians::from_degrees(60.0);
    let mut worst = 0.0_f32;
    for tick in 0..3000 {
        let sag = (f64::from(tick) * std::f64::consts::TAU / 200.0).cos();
        let supply = Supply::new(Volts((3.3 + 0.29 * sag) as f32)).unwrap();
        let code = sensor.code(angle, supply).unwrap();
        let reading = sensor.sample(&mut state, code, sensor.reference().vrefint(supply));
        assert_eq!(reading.validity, Validity::Good);
        let now = sensor.calibration().angle(reading.volts).unwrap();
        worst = worst.max((now.degrees() - 60.0).abs());
    }
    println!("supply 3.01 to 3.59 V: worst unfiltered angle error {worst:.3} deg");
    assert!(worst < 0.15, "{worst}");
}

/// Spikes of a random code on a walking knee, 1 to 100 a second.
#[test]
fn spikes_hardly_move_the_filtered_angle() {
    let sensor = sensor();
    for per_second in [1.0, 10.0, 100.0] {
        let (mut clean, mut spiky) = (SensorState::default(), SensorState::default());
        let mut noise = Noise(7);
        let (mut worst, mut spikes) = (0.0_f32, 0);
        for tick in 0..60_000 {
            let angle = Radians::from_degrees(knee_degrees(f64::from(tick) * 1e-3 / 1.1));
            let code = sensor.code(angle, nominal()).unwrap();
            let spike = noise.uniform() < per_second * 1e-3 && tick > 0;
            let other = AdcCode((noise.uniform() * 4095.0) as u16);
            let reference = sensor.sample(&mut clean, code, CAL);
            let reading = sensor.sample(&mut spiky, if spike { other } else { code }, CAL);
            assert_eq!(reading.code, if spike { other } else { code });
            spikes += u32::from(spike);
            worst = worst.max((reading.angle.degrees() - reference.angle.degrees()).abs());
        }
        println!("{per_second} spikes/s ({spikes} in 60 s): filtered angle off by {worst:.3} deg at most");
        assert!(spikes > 30 && worst < 2.0);
    }
}

#[test]
fn a_short_gap_is_bridged_and_a_long_one_resets_the_filter() {
    let sensor = sensor();
    let code = |degrees| sensor.code(Radians::from_degrees(degrees), nominal()).unwrap();
    let settled = sensor.calibration().angle(sensor.reference().volts(code(12.0), nominal())).unwrap();
    let after_gap = |gap: usize| {
        let mut state = SensorState::default();
        for _ in 0..50 {
            sensor.sample(&mut state, code(10.0), CAL);
        }
        // No supply reading: not good, whatever the code.
        for _ in 0..gap {
            sensor.sample(&mut state, code(12.0), AdcCode(0));
        }
        sensor.sample(&mut state, code(12.0), CAL).angle
    };
    // Bridged: the median still holds the step back. Afresh: the new angle at once.
    assert!((after_gap(19).degrees() - 10.0).abs() < 0.1, "{:?}", after_gap(19).degrees());
    assert_eq!(after_gap(20), settled);
}

#[test]
fn parts_that_do_not_fit_each_other_are_refused() {
    let with = |points: &[(f32, f32)], excitation| {
        let table: Vec<_> = points
            .iter()
            .map(|&(v, d)| CalibrationPoint { volts: Volts(v), angle: Radians::from_degrees(d) })
            .collect();
        let mut config = config();
        config.reference.excitation = excitation;
        config.calibration = Calibration::new(&table, Interpolation::Linear).unwrap();
        config.build(Period::MILLISECOND)
    };
    let own = Excitation::Own;
    let index = |error| match error {
        SensorError::TableInEndBand { index, .. } => Some(index),
        _ => None,
    };
    // At 3.6 V code 82 is 0.0721 V; at 3.0 V code 4013 is 2.940 V.
    assert!(with(&[(0.073, 0.0), (1.0, 30.0), (2.939, 90.0)], own).is_ok());
    assert_eq!(with(&[(0.071, 0.0), (1.0, 30.0), (2.939, 90.0)], own).map_err(index).err(), Some(Some(0)));
    assert_eq!(with(&[(0.073, 0.0), (1.0, 30.0), (2.941, 90.0)], own).map_err(index).err(), Some(Some(2)));
    // On the converter's own supply the codes do not move: 4013 is 3.234 V of 3.3 V.
    let shared = Excitation::Converter(Volts(3.3));
    assert!(with(&[(0.067, 0.0), (3.233, 90.0)], shared).is_ok());
    assert_eq!(with(&[(0.067, 0.0), (3.235, 90.0)], shared).map_err(index).err(), Some(Some(1)));
    assert_eq!(
        with(&[(0.01, 0.0), (1.0, 30.0)], own).unwrap_err().to_string(),
        "points[0].volts: reads code 11 where only 82 to 4013 differ from a broken wire; \
         shorten the table or change the divider"
    );
}

#[test]
fn a_bad_part_is_named_by_the_whole() {
    let field = |change: &dyn Fn(&mut hgod_adc::SensorConfig)| {
        let mut config = config();
        change(&mut config);
        match config.build(Period::MILLISECOND) {
            Err(SensorError::Range(RangeError { field, .. })) => field,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(field(&|c| c.reference.divider = f32::NAN), "reference.divider");
    assert_eq!(field(&|c| c.filter.cutoff_hz = 600.0), "filter.cutoff_hz");
    assert_eq!(field(&|c| c.health = HealthConfig { wire_ms: 0, ..c.health }), "health.wire_ms");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_stream_of_samples_gets_an_angle_out_of_the_table(
        samples in proptest::collection::vec((0..4200_u16, prop_oneof![4 => 1300..1700_u16, 1 => any::<u16>()], 0..3_u32), 1..400),
    ) {
        let sensor = sensor();
        let (low, high) = sensor.calibration().span();
        let (mut state, mut last) = (SensorState::default(), Radians(0.0));
        for (code, vrefint, missed) in samples {
            state.missed(missed);
            let again = &mut state.clone();
            let reading = sensor.sample(&mut state, AdcCode(code), AdcCode(vrefint));
            prop_assert_eq!(sensor.sample(again, AdcCode(code), AdcCode(vrefint)), reading);
            prop_assert_eq!(reading.code, AdcCode(code));
            prop_assert!(reading.volts.0.is_finite() && (low..=high).contains(&reading.angle));
            if reading.validity == Validity::Good {
                prop_assert!(sensor.calibration().angle(reading.volts).is_ok());
            } else {
                prop_assert_eq!(reading.angle, last);
            }
            last = reading.angle;
        }
    }

    #[test]
    fn an_angle_goes_to_a_code_and_back_within_half_a_code(fraction in 0.0..=1.0_f32, supply in 3.0..3.6_f32) {
        let sensor = sensor();
        let (low, high) = sensor.calibration().span();
        let angle = Radians((low.0 + fraction * (high.0 - low.0)).min(high.0));
        let supply = Supply::new(Volts(supply)).unwrap();
        let code = sensor.code(angle, supply).unwrap();
        // Half a code is 0.44 mV at 3.6 V; the curve's steepest is 81 degrees a volt.
        let most_deg = 0.45e-3 * 81.5;
        match sensor.calibration().angle(sensor.reference().volts(code, supply)) {
            Ok(back) => prop_assert!((back.degrees() - angle.degrees()).abs() < most_deg),
            // Half a code beyond an end of the curve.
            Err(_) => prop_assert!(low.degrees() + most_deg > angle.degrees() || angle.degrees() > high.degrees() - most_deg),
        }
    }
}
