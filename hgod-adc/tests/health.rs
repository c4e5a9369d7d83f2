//! Each verdict: after what time it comes, when it goes again, and that a walking or standing leg never gets one.

mod support;

use hgod_adc::{HealthConfig, Pull, Sensor, SensorState, Verdict, WIRE_FAULT_MAX_MS};
use joint_units::{AdcCode, Period, RadPerSec, Radians};
use support::{CAL, Noise, config, knee_degrees, nominal, sensor};

/// Verdicts of a fresh sensor on the codes.
fn verdicts(sensor: &Sensor, codes: impl IntoIterator<Item = u16>) -> Vec<Verdict> {
    let mut state = SensorState::default();
    codes.into_iter().map(|code| sensor.sample(&mut state, AdcCode(code), CAL).verdict).collect()
}

fn with_health(period: Period, health: HealthConfig) -> Sensor {
    let mut config = config();
    config.health = health;
    config.filter.cutoff_hz = 1.0; // allowed at the longest period
    config.build(period).unwrap()
}

/// A code in the middle of the table that changes by one from sample to sample.
fn alive(n: usize) -> u16 {
    2000 + (n % 2) as u16
}

#[test]
fn an_open_or_shorted_wire_is_named_in_time_at_every_period() {
    for micros in [333, 1000, 2500, 7000, 50_000, 100_000] {
        let period = Period::from_micros(micros).unwrap();
        for wire_ms in [1, 7, 20, WIRE_FAULT_MAX_MS] {
            for (pull, code, want) in [
                (Pull::Down, 0, Verdict::Open),
                (Pull::Down, 81, Verdict::Open),
                (Pull::Down, 4014, Verdict::Short),
                (Pull::Up, 4095, Verdict::Open),
                (Pull::Up, 81, Verdict::Short),
            ] {
                let sensor = with_health(period, HealthConfig { pull, wire_ms, ..Default::default() });
                let seen = verdicts(&sensor, (0..10).map(alive).chain([code; 200]));
                assert!(seen[..10].iter().all(|&verdict| verdict == Verdict::Good));
                let after = &seen[10..];
                let named = after.iter().position(|&verdict| verdict == want).unwrap();
                assert!(after[..named].iter().all(|&verdict| verdict == Verdict::Saturated));
                assert!(after[named..].iter().all(|&verdict| verdict == want));
                let (least, most) = ((u32::from(wire_ms) - 1) * 1000, u32::from(wire_ms) * 1000);
                let time = named as u32 * micros;
                assert!(time <= most, "{time} us for {wire_ms} ms at {micros} us");
                assert!(time + 2 * micros > least, "{time} us is early for {wire_ms} ms at {micros} us");
            }
        }
    }
}

#[test]
fn the_codes_beside_the_end_bands_are_not_broken_wires() {
    for code in [82, 4013] {
        let seen = verdicts(&sensor(), [code; 100]);
        assert!(seen.iter().all(|&verdict| verdict == Verdict::OutOfTable), "{code}");
    }
}

#[test]
fn a_wire_is_believed_again_after_as_long_as_it_was_doubted() {
    let seen = verdicts(&sensor(), (0..10).map(alive).chain([3; 500]).chain((0..100).map(alive)));
    let back = &seen[510..];
    assert!(back[..19].iter().all(|&verdict| verdict == Verdict::Open), "{back:?}");
    assert!(back[19..].iter().all(|&verdict| verdict == Verdict::Good), "{back:?}");
}

#[test]
fn a_wire_that_goes_from_rail_to_rail_is_named_by_where_it_is() {
    let seen = verdicts(&sensor(), [3; 30].into_iter().chain([4090; 30]));
    assert_eq!((seen[29], seen[30], seen[59]), (Verdict::Open, Verdict::Saturated, Verdict::Short));
    let seen = verdicts(&sensor(), [4090; 30].into_iter().chain([3; 30]));
    assert_eq!((seen[29], seen[30], seen[59]), (Verdict::Short, Verdict::Saturated, Verdict::Open));
}

#[test]
fn an_intermittent_wire_is_found_when_it_is_open_more_than_half_of_the_time() {
    let open = |duty: usize| {
        verdicts(&sensor(), (0..1000).map(|n| if n % 10 < duty { 3 } else { alive(n) })).contains(&Verdict::Open)
    };
    assert!(open(7) && !open(3));
}

#[test]
fn a_code_that_does_not_change_for_longer_than_the_time_is_stuck_until_it_does() {
    for (micros, stuck_ms) in [(1000, 1000), (1000, 200), (2500, 1000), (100_000, 5000)] {
        let period = Period::from_micros(micros).unwrap();
        let ticks = usize::from(stuck_ms) * 1000 / micros as usize;
        let sensor = with_health(period, HealthConfig { stuck_ms, ..Default::default() });
        let seen = verdicts(&sensor, (0..7).map(alive).chain(vec![2005; ticks + 50]).chain([2006, 2006]));
        let same = &seen[7..ticks + 57];
        assert!(same[..ticks].iter().all(|&verdict| verdict == Verdict::Good), "{micros} {stuck_ms}");
        assert!(same[ticks..].iter().all(|&verdict| verdict == Verdict::Stuck), "{micros} {stuck_ms}");
        assert_eq!(seen[ticks + 57..], [Verdict::Good; 2]);
    }
}

#[test]
fn a_stuck_band_finds_a_stuck_sensor_with_a_noisy_converter() {
    let dither = |stuck_band| {
        let sensor = with_health(Period::MILLISECOND, HealthConfig { stuck_band, ..Default::default() });
        verdicts(&sensor, (0..3000).map(alive)).contains(&Verdict::Stuck)
    };
    assert!(dither(1) && !dither(0));
}

/// Ten minutes of knee angle at a stride of 1.1 s with a stop of 8 s every 30 s, and converter noise of 2 codes RMS.
#[test]
fn a_walking_and_standing_leg_is_always_good() {
    let sensor = sensor();
    let mut state = SensorState::default();
    let mut noise = Noise(1);
    let (mut walked, mut standing) = (0_u32, 0_u32);
    for tick in 0..600_000_u32 {
        if tick % 30_000 < 22_000 {
            walked += 1
        } else {
            standing += 1
        }
        let angle = Radians::from_degrees(knee_degrees(f64::from(walked) * 1e-3 / 1.1));
        let code = sensor.code(angle, nominal()).unwrap();
        let code = AdcCode((f32::from(code.0) + 2.0 * noise.normal()).round() as u16);
        let vrefint = AdcCode((f32::from(CAL.0) + noise.normal()).round() as u16);
        let reading = sensor.sample(&mut state, code, vrefint);
        assert_eq!(reading.verdict, Verdict::Good, "tick {tick}");
        assert!(tick < 100 || (reading.angle.degrees() - angle.degrees()).abs() < 6.0, "tick {tick}");
    }
    assert!(standing > 150_000);
}

#[test]
fn a_jump_is_an_impossible_rate_until_a_joint_could_have_made_it() {
    let sensor = sensor();
    let code = |degrees| sensor.code(Radians::from_degrees(degrees), nominal()).unwrap();
    let mut state = SensorState::default();
    let mut last = sensor.sample(&mut state, code(10.0), CAL);
    for _ in 0..10 {
        last = sensor.sample(&mut state, code(10.0), CAL);
    }
    // 60 degrees at once: (60 - 3) / 1.5 = 38 ms until a knee of 1500 degrees a second is there.
    let mut rejected = 0;
    let accepted = loop {
        let reading = sensor.sample(&mut state, code(70.0), CAL);
        assert_eq!(reading.code, code(70.0));
        if reading.verdict == Verdict::Good {
            break reading;
        }
        assert_eq!((reading.verdict, reading.angle), (Verdict::Rate, last.angle));
        rejected += 1;
    };
    assert_eq!(rejected, 37);
    // A gap this long is not bridged: the filter starts afresh, it does not glide for 60 degrees.
    assert!((accepted.angle.degrees() - 70.0).abs() < 0.1);
}

/// The filter lags such a knee by 9 degrees: the rate is judged from what was measured, not from what was filtered.
#[test]
fn a_fast_joint_is_not_an_impossible_one() {
    let sensor = sensor();
    let codes = (0..130).map(|ms| sensor.code(Radians::from_degrees((ms - 45) as f32), nominal()).unwrap().0);
    assert!(verdicts(&sensor, codes).iter().all(|&verdict| verdict == Verdict::Good));
}

#[test]
fn a_step_within_the_noise_or_the_rate_is_good() {
    let config = HealthConfig { max_rate: RadPerSec(Radians::from_degrees(500.0).0), ..Default::default() };
    let health = config.build(Period::MILLISECOND).unwrap();
    let turn =
        |degrees: f32, ticks| health.can_turn(Radians(0.1), Radians(0.1 + Radians::from_degrees(degrees).0), ticks);
    for sign in [1.0, -1.0] {
        assert!(turn(sign * 3.49, 1) && !turn(sign * 3.51, 1));
        assert!(turn(sign * 7.99, 10) && !turn(sign * 8.01, 10));
    }
    assert!(turn(200.0, u32::MAX) && !health.can_turn(Radians(f32::NAN), Radians(0.0), 1));
}

#[test]
fn missed_ticks_give_a_joint_the_time_that_they_took() {
    let sensor = sensor();
    let code = |degrees| sensor.code(Radians::from_degrees(degrees), nominal()).unwrap();
    let after = |missed: &[u32]| {
        let mut state = SensorState::default();
        sensor.sample(&mut state, code(10.0), CAL);
        missed.iter().for_each(|&ticks| state.missed(ticks));
        sensor.sample(&mut state, code(22.0), CAL).verdict
    };
    // 12 degrees need (12 - 3) / 1.5 = 6 ms, the sample's own tick included.
    assert_eq!((after(&[]), after(&[4])), (Verdict::Rate, Verdict::Rate));
    assert_eq!((after(&[6]), after(&[2, 4]), after(&[u32::MAX, 2])), (Verdict::Good, Verdict::Good, Verdict::Good));
}

#[test]
fn each_bad_limit_is_named() {
    let with = |change: &dyn Fn(&mut HealthConfig)| {
        let mut config = HealthConfig::default();
        change(&mut config);
        config.build(Period::MILLISECOND).map(|_| "accepted").unwrap_or_else(|error| error.field)
    };
    assert_eq!(with(&|_| ()), "accepted");
    assert_eq!(with(&|c| c.low = AdcCode(1024)), "health.low");
    assert_eq!(with(&|c| c.high = AdcCode(3071)), "health.high");
    assert_eq!(with(&|c| c.high = AdcCode(4096)), "health.high");
    assert_eq!(with(&|c| c.wire_ms = 0), "health.wire_ms");
    assert_eq!(with(&|c| c.wire_ms = 51), "health.wire_ms");
    assert_eq!(with(&|c| c.stuck_ms = 199), "health.stuck_ms");
    assert_eq!(with(&|c| c.stuck_ms = 5001), "health.stuck_ms");
    assert_eq!(with(&|c| c.stuck_band = 9), "health.stuck_band");
    for bad in [f32::NAN, f32::INFINITY, 0.0, -26.0, 175.0] {
        assert_eq!(with(&|c| c.max_rate = RadPerSec(bad)), "health.max_rate", "{bad}");
        assert_eq!(with(&|c| c.rate_noise = Radians(bad)), "health.rate_noise", "{bad}");
    }
}

#[test]
fn a_verdict_and_its_word_are_one() {
    let words = ["good", "open", "short", "saturated", "stuck", "rate", "out_of_table", "supply_low"];
    for (number, (verdict, word)) in Verdict::ALL.into_iter().zip(words).enumerate() {
        assert_eq!((verdict as usize, verdict.to_string().as_str()), (number, word));
        assert_eq!(Verdict::from_name(word), Some(verdict));
    }
    assert_eq!(Verdict::from_name("Good"), None);
}
