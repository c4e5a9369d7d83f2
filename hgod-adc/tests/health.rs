//! Each validity: after what time it comes, when it goes again, and that a walking or standing leg never gets one.

mod support;

use hgod_adc::{
    HealthConfig, Pull, SPIKE_MS, STUCK_MS, Sensor, SensorState, Validity, WIRE_FAULT_MAX_MS, WIRE_FAULT_MS,
};
use joint_units::{AdcCode, Period, RadPerSec, Radians};
use support::{CAL, Noise, config, knee_degrees, nominal, sensor};

/// Verdicts of a fresh sensor on the codes.
fn validities(sensor: &Sensor, codes: impl IntoIterator<Item = u16>) -> Vec<Validity> {
    let mut state = SensorState::default();
    codes.into_iter().map(|code| sensor.sample(&mut state, AdcCode(code), CAL).validity).collect()
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
                (Pull::Down, 0, Validity::Open),
                (Pull::Down, 81, Validity::Open),
                (Pull::Down, 4014, Validity::Short),
                (Pull::Up, 4095, Validity::Open),
                (Pull::Up, 81, Validity::Short),
            ] {
                let sensor = with_health(period, HealthConfig { pull, wire_ms, ..Default::default() });
                let seen = validities(&sensor, (0..10).map(alive).chain([code; 200]));
                assert!(seen[..10].iter().all(|&validity| validity == Validity::Good));
                let after = &seen[10..];
                let named = after.iter().position(|&validity| validity == want).unwrap();
                assert!(after[..named].iter().all(|&validity| validity == Validity::Saturated));
                assert!(after[named..].iter().all(|&validity| validity == want));
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
        let seen = validities(&sensor(), [code; 100]);
        assert!(seen.iter().all(|&validity| validity == Validity::OutOfTable), "{code}");
    }
}

#[test]
fn a_wire_fault_clears_after_as_long_as_it_takes_to_report() {
    let seen = validities(&sensor(), (0..10).map(alive).chain([3; 500]).chain((0..100).map(alive)));
    let back = &seen[510..];
    assert!(back[..19].iter().all(|&validity| validity == Validity::Open), "{back:?}");
    assert!(back[19..].iter().all(|&validity| validity == Validity::Good), "{back:?}");
}

#[test]
fn a_wire_from_rail_to_rail_is_reported_by_its_place() {
    let seen = validities(&sensor(), [3; 30].into_iter().chain([4090; 30]));
    assert_eq!((seen[29], seen[30], seen[59]), (Validity::Open, Validity::Saturated, Validity::Short));
    let seen = validities(&sensor(), [4090; 30].into_iter().chain([3; 30]));
    assert_eq!((seen[29], seen[30], seen[59]), (Validity::Short, Validity::Saturated, Validity::Open));
}

#[test]
fn a_wire_open_more_than_half_of_the_time_is_found() {
    let open = |duty: usize| {
        validities(&sensor(), (0..1000).map(|n| if n % 10 < duty { 3 } else { alive(n) })).contains(&Validity::Open)
    };
    assert!(open(7) && !open(3));
}

#[test]
fn a_constant_code_is_stuck_until_it_changes() {
    for (micros, stuck_ms) in [(1000, 1000), (1000, 200), (2500, 1000), (100_000, 5000)] {
        let period = Period::from_micros(micros).unwrap();
        let ticks = usize::from(stuck_ms) * 1000 / micros as usize;
        let sensor = with_health(period, HealthConfig { stuck_ms, ..Default::default() });
        let seen = validities(&sensor, (0..7).map(alive).chain(vec![2005; ticks + 50]).chain([2006, 2006]));
        let same = &seen[7..ticks + 57];
        assert!(same[..ticks].iter().all(|&validity| validity == Validity::Good), "{micros} {stuck_ms}");
        assert!(same[ticks..].iter().all(|&validity| validity == Validity::Stuck), "{micros} {stuck_ms}");
        assert_eq!(seen[ticks + 57..], [Validity::Good; 2]);
    }
}

#[test]
fn a_stuck_band_finds_a_stuck_sensor_with_a_noisy_converter() {
    let dither = |stuck_band| {
        let sensor = with_health(Period::MILLISECOND, HealthConfig { stuck_band, ..Default::default() });
        validities(&sensor, (0..3000).map(alive)).contains(&Validity::Stuck)
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
        assert_eq!(reading.validity, Validity::Good, "tick {tick}");
        assert!(tick < 100 || (reading.angle.degrees() - angle.degrees()).abs() < 6.0, "tick {tick}");
    }
    assert!(standing > 150_000);
}

#[test]
fn a_jump_is_impossible_until_a_joint_could_have_made_it() {
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
        if reading.validity == Validity::Good {
            break reading;
        }
        // For less than 5 ms it may be a spike.
        let name = if rejected < 4 { Validity::Spike } else { Validity::Rate };
        assert_eq!((reading.validity, reading.angle), (name, last.angle));
        rejected += 1;
    };
    assert_eq!(rejected, 37);
    // A gap this long is not bridged: the filter starts afresh, it does not glide for 60 degrees.
    assert!((accepted.angle.degrees() - 70.0).abs() < 0.1);
}

/// What a wrong sample of each fault is, where a sound one would have this code: the code, and that of VREFINT.
fn wrong(validity: Validity, sensor: &Sensor, sound: AdcCode) -> (AdcCode, AdcCode) {
    // 50 degrees away, which takes a joint 32 ms.
    let angle = sensor.calibration().angle(sensor.reference().volts(sound, nominal())).unwrap().degrees();
    let to = if angle < 20.0 { angle + 50.0 } else { angle - 50.0 };
    let away = sensor.code(Radians::from_degrees(to), nominal()).unwrap();
    match validity {
        Validity::Good => (sound, CAL),
        Validity::Open | Validity::Saturated => (AdcCode(3), CAL),
        Validity::Short => (AdcCode(4090), CAL),
        Validity::Stuck => unreachable!("the code of the last right sample"),
        Validity::Spike | Validity::Rate => (away, CAL),
        Validity::OutOfTable => (AdcCode(500), CAL),
        // 2.99 V: 3.3 V is 1501.
        Validity::SupplyLow => (sound, AdcCode(1657)),
        other => panic!("{other} has no code here"),
    }
}

/// The constant of each validity is exact: said with the n-th wrong sample, not with the one before; at phases all over the stride.
#[test]
fn each_validity_comes_after_its_time_to_the_millisecond() {
    let sensor = sensor();
    let knee = |tick: u32| {
        let angle = Radians::from_degrees(knee_degrees(f64::from(tick) * 1e-3 / 1.1));
        sensor.code(angle, nominal()).unwrap()
    };
    for fault in Validity::ALL.into_iter().filter(|&validity| validity != Validity::Good) {
        for start in (500..1600).step_by(11) {
            let mut state = SensorState::default();
            let last = knee(start - 1);
            for tick in 0..start {
                // A leg that happens to be at rest would begin the count of unchanged codes before the fault.
                let code = if tick == start - 2 { AdcCode(last.0 + 1) } else { knee(tick) };
                assert_eq!(sensor.sample(&mut state, code, CAL).validity, Validity::Good);
            }
            let mut validity = |n: u32| {
                let (code, vrefint) = match fault {
                    Validity::Stuck => (last, CAL),
                    _ => wrong(fault, &sensor, knee(start + n)),
                };
                sensor.sample(&mut state, code, vrefint).validity
            };
            let said = (1..=2000).find(|&n| validity(n) == fault);
            assert_eq!(said, Some(u32::from(fault.detection_ms())), "{fault} from tick {start}");
        }
    }
}

#[test]
fn the_constants_are_those_of_the_default_limits() {
    let config = HealthConfig::default();
    assert_eq!((config.wire_ms, config.stuck_ms, config.spike_ms), (WIRE_FAULT_MS, STUCK_MS, SPIKE_MS));
}

/// Impossible samples are counted as an intermittent wire is: spikes on more than half of the samples are a rate, fewer are spikes for
/// ever, and after as many good ones a new jump is a spike again.
#[test]
fn spikes_become_a_rate_above_half_of_the_samples() {
    let sensor = sensor();
    let codes = |degrees| sensor.code(Radians::from_degrees(degrees), nominal()).unwrap().0;
    let (rest, away) = (codes(10.0), codes(80.0));
    let bad = |of: usize| {
        let seen =
            validities(&sensor, (0..990).map(|n| if n > 0 && n % 5 < of { away } else { rest + (n % 2) as u16 }));
        let count = |validity| seen.iter().filter(|&&given| given == validity).count();
        (count(Validity::Spike), count(Validity::Rate), count(Validity::Good))
    };
    // Not those of the very first tick.
    assert_eq!(bad(2), (198 * 2 - 1, 0, 990 - 198 * 2 + 1));
    let (spikes, rates, good) = bad(3);
    assert_eq!((spikes + rates, good), (198 * 3 - 1, 990 - 198 * 3 + 1));
    assert!((5..20).contains(&spikes), "{spikes}");
    let again = [vec![rest], vec![away; 10], vec![rest; 4], vec![away], vec![rest; 6], vec![away]].concat();
    let seen = validities(&sensor, again);
    let jumps: Vec<_> = seen.into_iter().filter(|&validity| validity != Validity::Good).collect();
    let (first, rest) = jumps.split_at(4);
    assert_eq!(first, [Validity::Spike; 4]);
    assert_eq!(rest[..7], [Validity::Rate; 7]);
    assert_eq!(rest[7..], [Validity::Spike]);
}

#[test]
fn the_worse_of_two_can_be_the_reason_of_the_other() {
    use Validity::{Good, Open, OutOfTable, Rate, Saturated, Short, Spike, Stuck, SupplyLow};
    let order = [Good, Spike, Rate, OutOfTable, Stuck, Saturated, Short, Open, SupplyLow];
    assert_eq!(order.len(), Validity::ALL.len());
    for (n, lesser) in order.into_iter().enumerate() {
        for other in order.into_iter().skip(n) {
            assert_eq!((lesser.worse(other), other.worse(lesser)), (other, other));
        }
    }
}

/// The column *found after* of the module's table agrees with the function.
#[test]
fn the_documented_times_are_those_of_the_constants() {
    let doc = include_str!("../src/health.rs");
    let rows: Vec<Vec<&str>> = doc
        .lines()
        .filter_map(|line| line.strip_prefix("//! | "))
        .map(|line| line.trim_end_matches('|').split('|').map(str::trim).collect())
        .collect();
    let mut found = 0;
    for row in &rows {
        for validity in row[0].split(", ").filter_map(Validity::from_name) {
            assert_eq!(row[2], format!("{} ms", validity.detection_ms()), "{validity}");
            found += 1;
        }
    }
    assert_eq!(found, Validity::ALL.len() - 1);
}

/// The filter lags such a knee by 9 degrees: the rate is judged from what was measured, not from what was filtered.
#[test]
fn a_fast_joint_is_not_an_impossible_one() {
    let sensor = sensor();
    let codes = (0..130).map(|ms| sensor.code(Radians::from_degrees((ms - 45) as f32), nominal()).unwrap().0);
    assert!(validities(&sensor, codes).iter().all(|&validity| validity == Validity::Good));
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
        sensor.sample(&mut state, code(22.0), CAL).validity
    };
    // 12 degrees need (12 - 3) / 1.5 = 6 ms, the sample's own tick included.
    assert_eq!((after(&[]), after(&[4])), (Validity::Spike, Validity::Spike));
    assert_eq!((after(&[6]), after(&[2, 4]), after(&[u32::MAX, 2])), (Validity::Good, Validity::Good, Validity::Good));
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
    assert_eq!(with(&|c| c.spike_ms = 0), "health.spike_ms");
    assert_eq!(with(&|c| c.spike_ms = 51), "health.spike_ms");
    for bad in [f32::NAN, f32::INFINITY, 0.0, -26.0, 175.0] {
        assert_eq!(with(&|c| c.max_rate = RadPerSec(bad)), "health.max_rate", "{bad}");
        assert_eq!(with(&|c| c.rate_noise = Radians(bad)), "health.rate_noise", "{bad}");
    }
}

#[test]
fn a_validity_has_one_name() {
    let words = ["good", "open", "short", "saturated", "stuck", "spike", "rate", "out_of_table", "supply_low"];
    for (number, (validity, word)) in Validity::ALL.into_iter().zip(words).enumerate() {
        assert_eq!((validity as usize, validity.to_string().as_str()), (number, word));
        assert_eq!(Validity::from_name(word), Some(validity));
    }
    assert_eq!(Validity::from_name("Good"), None);
}
