//! Codes to volts: exhaustive over the converter's codes, against the ratio in f64.

use hgod_adc::stm32f4::MAX_SUPPLY;
use hgod_adc::{Excitation, Reference, ReferenceConfig, Supply, SupplyFault};
use joint_units::{AdcCode, Volts};

const CAL: AdcCode = AdcCode(1501);

fn reference(divider: f32, excitation: Excitation) -> Reference {
    ReferenceConfig { divider, excitation, ..ReferenceConfig::stm32f4(CAL) }.build().unwrap()
}

fn supplies() -> impl Iterator<Item = Supply> {
    [1.8, 2.7, 3.0, 3.137, 3.3, 3.456_7, 3.6].into_iter().map(|volts| Supply::new(Volts(volts)).unwrap())
}

#[test]
fn every_code_becomes_its_volts_and_comes_back() {
    for divider in [0.05, 1.0, 1.5, 2.0, 20.0] {
        for excitation in [Excitation::Own, Excitation::Converter(Volts(3.3))] {
            let reference = reference(divider, excitation);
            for supply in supplies() {
                let full_scale = match excitation {
                    Excitation::Own => f64::from(supply.volts().0),
                    Excitation::Converter(at) => f64::from(at.0),
                } * f64::from(divider);
                let mut before = -1.0;
                for code in (0..=4095).map(AdcCode) {
                    let volts = reference.volts(code, supply);
                    let exact = full_scale * f64::from(code.0) / 4095.0;
                    assert!((f64::from(volts.0) - exact).abs() <= 2e-7 * exact, "{code:?}: {volts:?}, exactly {exact}");
                    assert!(volts.0 > before);
                    before = volts.0;
                    assert_eq!(reference.code(volts, supply), code, "{divider} {supply:?}");
                    // The whole interval of the code reads that code.
                    for part in [-0.49, 0.49] {
                        let inside = (f64::from(code.0) + part) / 4095.0 * full_scale;
                        assert_eq!(reference.code(Volts(inside as f32), supply), code, "{part}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_pin_clips_at_its_rails() {
    let reference = reference(1.0, Excitation::Own);
    let supply = Supply::new(Volts(3.3)).unwrap();
    for (volts, code) in [(-1.0, 0), (f32::NEG_INFINITY, 0), (3.4, 4095), (f32::INFINITY, 4095), (f32::NAN, 0)] {
        assert_eq!(reference.code(Volts(volts), supply), AdcCode(code), "{volts}");
    }
    assert_eq!(reference.volts(AdcCode(u16::MAX), supply), reference.volts(AdcCode::MAX, supply));
}

#[test]
fn every_vrefint_code_is_a_supply_or_a_named_fault() {
    let reference = reference(1.0, Excitation::Own);
    let mut seen = [0; 4];
    for code in 0..=u16::MAX {
        let exact = 3.3 * f64::from(CAL.0) / f64::from(code);
        let which = match reference.supply(AdcCode(code)) {
            Err(SupplyFault::NoReading(kept)) => {
                assert_eq!(kept, AdcCode(code));
                assert!(code == 0 || code > 4095);
                0
            }
            Err(SupplyFault::Low { supply, least }) => {
                assert_eq!(least, Volts(3.0));
                assert!(supply.0 < 3.0 && exact < 3.0 + 1e-6);
                1
            }
            Err(SupplyFault::High(volts)) => {
                assert!(volts.0 > MAX_SUPPLY.0 && exact > 3.6 - 1e-6 && volts.0.is_finite());
                2
            }
            Ok(supply) => {
                assert!((3.0..=3.6).contains(&supply.volts().0));
                assert!((f64::from(supply.volts().0) - exact).abs() < 1e-6);
                assert_eq!(reference.vrefint(supply), AdcCode(code));
                3
            }
            Err(other) => panic!("code {code}: {other}"),
        };
        seen[which] += 1;
    }
    // 3.3 * 1501 / 3.6 = 1375.9 and / 3.0 = 1651.1: codes 1376 to 1651 are in range.
    assert_eq!(seen, [1 + 65_535 - 4095, 4095 - 1651, 1375, 1651 - 1375]);
}

#[test]
fn a_sagging_supply_changes_volts_by_rounding_only() {
    let reference = reference(1.5, Excitation::Own);
    let (mut worst, mut uncorrected) = (0.0_f64, 0.0_f64);
    for millivolts in 3005..=3595 {
        let supply = Supply::new(Volts(millivolts as f32 * 1e-3)).unwrap();
        let measured = reference.supply(reference.vrefint(supply)).unwrap();
        for sensor in [0.3, 1.0, 2.5, 4.4_f32] {
            let volts = reference.volts(reference.code(Volts(sensor), supply), measured);
            // Half a code of the sensor, and half a code of the internal reference on all of it.
            let half_code = 0.5 / 4095.0 * 1.5 * supply.volts().0;
            let half_reference = sensor * 0.5 / f32::from(reference.vrefint(supply).0);
            let error = f64::from((volts.0 - sensor).abs());
            assert!(error <= f64::from(half_code + half_reference) * 1.001, "{sensor} V at {millivolts} mV: {error}");
            worst = worst.max(error);
            let naive = f64::from(reference.code(Volts(sensor), supply).0) / 4095.0 * 3.3 * 1.5;
            uncorrected = uncorrected.max((naive - f64::from(sensor)).abs());
        }
    }
    println!("sag 3.0 to 3.6 V: worst error {:.1} mV, without VREFINT {:.0} mV", worst * 1e3, uncorrected * 1e3);
    assert!(uncorrected > 100.0 * worst);
}

#[test]
fn a_potentiometer_on_the_converters_supply_needs_no_correction() {
    let reference = reference(1.0, Excitation::Converter(Volts(3.3)));
    for supply in supplies() {
        assert_eq!(reference.volts(AdcCode(2048), supply), Volts(2048.0 / 4095.0 * 3.3));
    }
}

#[test]
fn each_bad_field_is_named() {
    let good = ReferenceConfig::stm32f4(CAL);
    let with = |change: &dyn Fn(&mut ReferenceConfig)| {
        let mut config = good;
        change(&mut config);
        config.build().map(|_| "accepted").unwrap_or_else(|error| error.field)
    };
    assert_eq!(with(&|_| ()), "accepted");
    for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0, 20.1] {
        assert_eq!(with(&|c| c.divider = bad), "reference.divider");
    }
    for bad in [0, 1, 1364, 1614, 4095, u16::MAX] {
        assert_eq!(with(&|c| c.vrefint_cal = AdcCode(bad)), "reference.vrefint_cal");
    }
    for bad in [f32::NAN, 0.0, 1.79, 3.61, -3.3, f32::INFINITY] {
        assert_eq!(with(&|c| c.vdda_at_cal = Volts(bad)), "reference.vdda_at_cal");
        assert_eq!(with(&|c| c.min_supply = Volts(bad)), "reference.min_supply");
        assert_eq!(with(&|c| c.excitation = Excitation::Converter(Volts(bad))), "reference.excitation");
        assert_eq!(Supply::new(Volts(bad)).unwrap_err().field, "supply");
    }
}
