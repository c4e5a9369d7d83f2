//! Entrainment on recorded walkers, on the host core: one sensor of a person who walks drives four joints.
//!
//! What is measured here is the core that the board runs, fed with recorded angles at 1 kHz. The recording that ships is always used,
//! those beside the workspace when they are there. Each measured number is printed (`--nocapture`).

use cpg_core::entrainment::{EventSource, FollowerConfig, Lock};
use cpg_core::waveform::shape::Shape;
use cpg_core::{Follow, Generator};
use footfall::command::entrain::entrain;
use footfall::command::entrain::run;
use footfall::command::entrain::run::Tick;
use footfall_tests::degraded::{self, Random, Series};
use footfall_tests::people::{PEOPLE, Person, default_loop, people, people_of};
use footfall_tests::statistics::{median, rms};
use footfall_tests::swings::{phantoms, range_deg, standing, tops};
use footfall_tests::traces::many;
use gait_trace::format::csv_file;
use joint_units::{Joint, Period, Phase, Radians};
use std::f64::consts::TAU;
use std::path::Path;

/// 1,000 starts on the mean stride of the shipped walker's hips: any phase, any frequency from -40 to +40 %. Locked means within 18
/// degrees and 3 % for good; never locked within 10 s is a false lock.
#[test]
fn a_thousand_starts() {
    let walker = default_loop(Joint::LeftHip, 12.0);
    let mut random = Random(20_240_607);
    let (mut locks, mut never) = (vec![], 0);
    for start in 0..1000 {
        let sensor = if start % 2 == 0 { Joint::LeftHip } else { Joint::RightHip };
        let mut config = FollowerConfig::default();
        let stride_s = 1.1;
        config.lock.stride_s = (stride_s / (0.6 + 0.8 * random.unit())) as f32;
        let mut legs = config.build(walker.templates, sensor, Period::MILLISECOND).expect("built");
        let (mut cycles, mut last_bad) = (random.unit(), 0);
        for tick in 0..10_000 {
            cycles += 1e-3 / stride_s;
            let phase = Phase::from_cycles(cycles.fract() as f32);
            legs.observe(Some(Radians(walker.templates[sensor as usize].at(phase).angle)));
            legs.step();
            let off = f64::from(phase.radians_after(legs.phase_lock().phase()).0).to_degrees();
            let slow = f64::from(legs.phase_lock().frequency().0) * stride_s / TAU - 1.0;
            if off.abs() > 18.0 || slow.abs() > 0.03 {
                last_bad = tick;
            }
        }
        never += u32::from(last_bad > 9000 || legs.status().state != Lock::Locked);
        locks.push(f64::from(last_bad) * 1e-3);
    }
    let middle = median(&mut locks);
    println!("1,000 starts: median {middle:.2} s, worst {:.2} s, {never} false", locks[999]);
    assert_eq!(never, 0);
    assert!(middle <= 3.0, "median {middle} s");
    assert!(locks[999] <= 4.0, "worst {} s", locks[999]);
}

/// One hip measured, four joints driven: root mean square difference from the recorded joints, 15 to 50 s, and no hold.
#[test]
fn one_hip_drives_four_joints() {
    for sensor in [Joint::LeftHip, Joint::RightHip] {
        for walker in people("one hip drives four joints", sensor) {
            let run = entrain(&walker.recording, sensor, None).expect("entrained");
            let verdict = run.following;
            let rmse = verdict.steady_rmse_deg.map(|rmse| rmse.expect("all joints"));
            println!("{} {}: {rmse:.2?}, {:?}", walker.name, sensor.name(), verdict.lock_s);
            let other = if sensor == Joint::LeftHip { Joint::RightHip } else { Joint::LeftHip };
            assert!(rmse[sensor as usize] <= 1.5, "{}: {rmse:?}", walker.name);
            assert!(rmse[other as usize] <= 1.8, "{}: {rmse:?}", walker.name);
            assert!(rmse[2] <= 2.3 && rmse[3] <= 2.3, "{}: {rmse:?}", walker.name);
            assert_eq!((verdict.false_locks, verdict.holds.len()), (0, 0), "{}", walker.name);
            assert!(verdict.lock_s.is_some_and(|lock| lock < 2.5));
            let settled = &run.ticks[5000..];
            assert!(settled.iter().all(|tick| tick.state == Lock::Locked && tick.amplitude == 1.0), "{}", walker.name);
        }
    }
    // The recording that ships is two strides: templates and trace are the same, so that only tracking is left.
    for sensor in Joint::ALL {
        let walker = default_loop(sensor, 25.0);
        let verdict = entrain(&walker.recording, sensor, None).expect("entrained").following;
        println!("shipped {}: {:.2?}", sensor.name(), verdict.steady_rmse_deg.map(Option::unwrap));
        assert!(verdict.steady_rmse_deg.iter().all(|rmse| rmse.is_some_and(|rmse| rmse < 3.0)), "{verdict:?}");
        assert_eq!((verdict.false_locks, verdict.holds.len()), (0, 0));
    }
}

/// Two walkers and a runner twice, a hip and a knee measured, 12 bits and noise of 0.1 degrees on top: not one hold, not one stop, not one
/// false lock in 7 minutes.
#[test]
fn sound_sensors_are_believed() {
    let names = [PEOPLE[0], PEOPLE[1], "welker_007_run_natural", "welker_007_run_exotendon"];
    let mut total = 0;
    for sensor in [Joint::RightHip, Joint::LeftKnee] {
        for walker in people_of(&names, "sound sensors", sensor) {
            let noisy: Vec<f64> = degraded::noise(&walker.samples(sensor), 0.1, 5).into_iter().flatten().collect();
            let ticks = run::run(&mut walker.legs(sensor), degraded::quantised(&noisy, 300.0));
            let locked = ticks.iter().position(|tick| tick.state == Lock::Locked).expect("locked");
            assert!(locked < 3000, "{} {}: locked after {locked} ms", walker.name, sensor.name());
            let later = &ticks[4000..];
            let wrong = later.iter().position(|tick| tick.state != Lock::Locked);
            assert_eq!(wrong, None, "{} {}", walker.name, sensor.name());
            let verdict = run::judge(&ticks, &walker.recording, sensor, &walker.learned);
            assert_eq!((verdict.false_locks, verdict.holds.len()), (0, 0), "{} {}", walker.name, sensor.name());
            total += ticks.len();
        }
    }
    println!("sound sensors: {} s without a verdict", total / 1000);
}

/// Recorded walkers, starts 12 phases apart, 40 % too slow to 40 % too fast: within 18 degrees for good.
#[test]
fn recorded_walkers_are_locked_on_from_anywhere() {
    for walker in people("starts on recorded walkers", Joint::LeftHip) {
        let samples = walker.samples(Joint::LeftHip);
        let mut all = vec![];
        for factor in [0.6, 0.8, 1.2, 1.4] {
            for start in 0..12 {
                let from = 15_000 + (f64::from(start) * walker.learned.stride_s * 1000.0 / 12.0) as usize;
                let stride_s = walker.learned.stride_s / factor;
                let mut legs = run::follower(walker.templates, Joint::LeftHip, stride_s).expect("built");
                let ticks = run::run(&mut legs, samples[from..from + 12_000].iter().copied().map(Some));
                let bad = ticks.iter().enumerate().rposition(|(n, tick)| {
                    let phase = walker.learned.phase_at((from + n) as f64 * 1e-3).rem_euclid(1.0);
                    Phase::from_cycles(phase as f32).radians_after(tick.estimate).0.abs() > 18f32.to_radians()
                });
                all.push(bad.map_or(0.0, |tick| tick as f64 * 1e-3));
            }
        }
        let middle = median(&mut all);
        println!("{}: {} starts, median {middle:.2} s, worst {:.2} s", walker.name, all.len(), all[all.len() - 1]);
        assert!(middle <= 2.5 && all[all.len() - 1] <= 4.5, "{}: {middle} {:?}", walker.name, all.last());
    }
}

/// Cadence steps from 1.1 to 0.9 s of stride at 24 phases: within 18 degrees and 3 % again in 1.5 s, locked all the while.
#[test]
fn a_step_of_cadence() {
    let walker = default_loop(Joint::LeftHip, 12.0);
    for sensor in [Joint::LeftHip, Joint::RightHip] {
        let mut worst = 0.0f64;
        for start in 0..24 {
            let mut legs = run::follower(walker.templates, sensor, 1.1).expect("built");
            let mut cycles = f64::from(start) / 24.0;
            for tick in 0..14_000 {
                let stride_s = if tick < 10_000 { 1.1 } else { 0.9 };
                cycles += 1e-3 / stride_s;
                let phase = Phase::from_cycles(cycles.fract() as f32);
                legs.observe(Some(Radians(walker.templates[sensor as usize].at(phase).angle)));
                legs.step();
                if tick >= 10_000 {
                    assert_eq!(legs.status().state, Lock::Locked);
                    let off = f64::from(phase.radians_after(legs.phase_lock().phase()).0).to_degrees();
                    let slow = f64::from(legs.phase_lock().frequency().0) * stride_s / TAU - 1.0;
                    if off.abs() > 18.0 || slow.abs() > 0.03 {
                        worst = worst.max(f64::from(tick - 10_000) * 1e-3);
                    }
                }
            }
        }
        println!("cadence step, {}: worst {worst:.2} s", sensor.name());
        assert!(worst <= 1.5, "{}: {worst} s", sensor.name());
    }
}

/// The sensor is lost at 16 times of the walk, in four ways: how soon that is told, and how far the phase is off 1 and 2 s later.
#[test]
fn a_lost_sensor_on_recorded_walkers() {
    for walker in people("sensor loss on recorded walkers", Joint::LeftHip) {
        let samples = walker.samples(Joint::LeftHip);
        for (kind, soon, after) in [
            ("invalid", 0.02, [10.0, 13.0]),
            ("stuck", 0.09, [11.0, 15.0]),
            ("zero", 0.12, [11.0, 15.0]),
            ("noise", 0.1, [10.0, 13.0]),
        ] {
            let (mut told, mut off, mut stops) = (vec![], [vec![], vec![]], 0);
            for n in 0..16 {
                let at = 20_000 + 1370 * n;
                let mut random = Random(n as u32);
                let series = samples[..at + 3500].iter().enumerate().map(|(tick, &angle)| match kind {
                    _ if tick < at => Some(angle),
                    "invalid" => None,
                    "stuck" => Some(samples[at - 1]),
                    "zero" => Some(0.0),
                    _ => Some(15.0 * random.normal()),
                });
                let ticks = run::run(&mut walker.legs(Joint::LeftHip), series);
                assert!(ticks[5000..at].iter().all(|tick| tick.state == Lock::Locked), "a false hold before the fault");
                let first = ticks[at..].iter().position(|tick| tick.state != Lock::Locked).expect("told");
                if ticks[at + first].state == Lock::Holding {
                    told.push(first as f64 * 1e-3);
                    for (second, off) in off.iter_mut().enumerate() {
                        let tick = at + 1000 * (second + 1);
                        off.push(walker.off(&ticks[tick], tick));
                    }
                } else {
                    // At the top of a swing a sensor that sticks is a leg that stands: the joints stop.
                    stops += 1;
                }
                let still = ticks[at..].iter().position(|tick| tick.amplitude == 0.0);
                assert!(still.is_some_and(|tick| tick <= 3000), "{kind} at {at}: walks on blind, {still:?}");
            }
            let (middle, rms) = (median(&mut told), [rms(&off[0]), rms(&off[1])]);
            println!("{} {kind}: told {middle:.3} s median, {stops} of 16 as a stop; rms {rms:.1?} deg", walker.name);
            assert!(middle <= soon && told.len() >= 10, "{kind}: {middle} s, {stops} stops");
            assert!(rms[0] < after[0] && rms[1] < after[1], "{} {kind}: {rms:?}", walker.name);
        }
    }
}

/// Ticks in which the heel strikes, as the recording itself tells it without an angle of the hip: the left knee, extending at the end of its
/// swing, passes a third of its range. No recording has strikes of a switch.
fn strikes_of_the_knee(walker: &Person) -> Vec<bool> {
    let knee = walker.samples(Joint::LeftKnee);
    let (low, high) = knee.iter().fold((f64::MAX, f64::MIN), |(low, high), &y| (low.min(y), high.max(y)));
    let part = |part: f64| low + part * (high - low);
    let mut swings = false;
    let strikes = knee.iter().map(|&y| {
        swings |= y > part(0.75);
        let strikes = swings && y < part(1.0 / 3.0);
        swings &= !strikes;
        strikes
    });
    strikes.collect()
}

/// Ticks in which the learned phase passes 0.86 cycles, a place of the strike that nobody is told, each 10 ms early or late (standard
/// deviation), as switches are.
fn strikes_of_the_phase(walker: &Person) -> Vec<bool> {
    let rows = walker.samples(Joint::LeftHip).len();
    let (mut random, mut strikes) = (Random(3), vec![false; rows]);
    let place = |n: usize| (walker.learned.phase_at(n as f64 * 1e-3) - 0.86).floor();
    for n in 1..rows {
        if place(n) > place(n - 1) {
            let off = n as f64 + 10.0 * random.normal();
            if let Some(strike) = strikes.get_mut(off.max(0.0) as usize) {
                *strike = true;
            }
        }
    }
    strikes
}

/// The sensor is lost at 16 times of the walk: rms phase error 1 and 2 s later of those that are walked through, without a foot switch
/// and with one, whose place in the stride is learned before.
#[test]
fn a_foot_switch_keeps_the_phase_of_recorded_walkers() {
    for walker in people("a foot switch on recorded walkers", Joint::LeftHip) {
        let samples = walker.samples(Joint::LeftHip);
        let (knee, phase) = (strikes_of_the_knee(&walker), strikes_of_the_phase(&walker));
        for kind in ["invalid", "stuck"] {
            let error = |events: EventSource, strikes: &[bool]| {
                let mut off = [vec![], vec![]];
                for n in 0..16 {
                    let at = 20_000 + 1370 * n;
                    let mut config = FollowerConfig { events, ..FollowerConfig::default() };
                    config.lock.stride_s = walker.learned.stride_s as f32;
                    let mut legs = config.build(walker.templates, Joint::LeftHip, Period::MILLISECOND).expect("built");
                    for tick in 0..at + 2000 {
                        if strikes[tick] {
                            legs.heel_strike();
                        }
                        let lost = if kind == "stuck" { Some(samples[at - 1]) } else { None };
                        let sample = if tick < at { Some(samples[tick]) } else { lost };
                        legs.observe(sample.map(|degrees| Radians::from_degrees(degrees as f32)));
                        legs.step();
                        let second = (tick + 1).checked_sub(at).filter(|gone| gone % 1000 == 0 && *gone > 0);
                        if let Some(second) = second
                            && legs.status().state == Lock::Holding
                        {
                            let truth = walker.learned.phase_at(tick as f64 * 1e-3).rem_euclid(1.0);
                            let off_by = Phase::from_cycles(truth as f32).radians_after(legs.phase());
                            off[second / 1000 - 1].push(f64::from(off_by.0).to_degrees());
                        }
                    }
                }
                assert!(off[1].len() >= 10, "{kind}: {} of 16 are walked through", off[1].len());
                off.map(|off| rms(&off))
            };
            let without = error(EventSource::None, &knee);
            let with_knee = error(EventSource::FootSwitch, &knee);
            let with_jitter = error(EventSource::FootSwitch, &phase);
            println!(
                "{} {kind}: rms {without:.1?} deg, with a foot switch {with_knee:.1?}, with one that jitters by 10 ms {with_jitter:.1?}",
                walker.name
            );
            assert!(with_knee[0] < without[0] && with_knee[1] < 0.65 * without[1], "{} {kind}", walker.name);
            assert!(with_jitter[1] < 0.75 * without[1], "{} {kind}: {with_jitter:?}", walker.name);
        }
    }
}

/// The peaks of recorded knees find phase and cadence sooner: 24 start phases, cadences that are off by up to 40 %.
#[test]
fn peaks_of_recorded_knees() {
    for walker in people("peaks of recorded knees", Joint::LeftKnee) {
        let samples = walker.samples(Joint::LeftKnee);
        let locks = |events: EventSource| {
            let mut all = vec![];
            for start in 0..120 {
                let from = 15_000 + (f64::from(start / 5) * walker.learned.stride_s * 1000.0 / 24.0) as usize;
                let mut config = FollowerConfig { events, ..FollowerConfig::default() };
                config.lock.stride_s = (walker.learned.stride_s / (0.6 + 0.2 * f64::from(start % 5))) as f32;
                let mut legs = config.build(walker.templates, Joint::LeftKnee, Period::MILLISECOND).expect("built");
                let ticks = run::run(&mut legs, samples[from..from + 9000].iter().copied().map(Some));
                let bad = ticks.iter().enumerate().rposition(|(n, tick)| {
                    let phase = walker.learned.phase_at((from + n) as f64 * 1e-3).rem_euclid(1.0);
                    Phase::from_cycles(phase as f32).radians_after(tick.estimate).0.abs() > 18f32.to_radians()
                });
                all.push(bad.map_or(0.0, |tick| tick as f64 * 1e-3));
            }
            [median(&mut all), all[108], all[119]]
        };
        let [without, with] = [EventSource::None, EventSource::Peak].map(locks);
        println!("{}: median, 90 %, worst {without:.2?} s, with peaks {with:.2?} s", walker.name);
        assert!(with[0] + 0.1 < without[0] && with[1] < without[1] && with[2] < without[2], "{}", walker.name);
    }
}

/// A recorded walker brought to a stop within 0.15 to 0.3 s at 24 moments, and set going again after 4 s: how long until all setpoints
/// stand, counted from when the leg does.
#[test]
fn a_walker_who_stops() {
    for (sensor, limit) in [(Joint::LeftHip, 0.7), (Joint::LeftKnee, 0.75)] {
        for walker in people("a walker who stops", sensor) {
            let samples = walker.samples(sensor);
            let (mut still, mut again) = (vec![], vec![]);
            for n in 0..24 {
                let (at, brake) = (20.0 + 1.031 * f64::from(n), if n % 2 == 0 { 0.15 } else { 0.3 });
                let ticks = run::run(&mut walker.legs(sensor), warped(&samples, at, brake, 4.0, at + 12.0));
                let stop = ((at + brake) * 1e3) as usize;
                let moves = ticks[stop..stop + 3500].iter();
                let last = moves.clone().rposition(|tick| tick.rates.iter().any(|rate| rate.abs() > 5.0));
                still.push(last.map_or(0.0, |tick| tick as f64 * 1e-3));
                assert!(moves.clone().all(|tick| tick.state != Lock::Holding), "a stop is no fault");
                let go = ((at + brake + 4.0) * 1e3) as usize;
                let locked = ticks[go..].iter().position(|tick| tick.state == Lock::Locked);
                again.push(locked.expect("it walks again") as f64 * 1e-3);
            }
            let (a, b) = (median(&mut still), median(&mut again));
            println!(
                "{} {}: still {a:.2} s median {:.2} worst after a stop; locked {b:.2} s median {:.2} worst after a start",
                walker.name,
                sensor.name(),
                still[23],
                again[23]
            );
            assert!(still[23] <= limit, "{} {}: {} s", walker.name, sensor.name(), still[23]);
            assert!(b <= 2.5 && again[23] <= 5.0);
        }
    }
}

/// The samples on a clock that stops at `at` seconds, within `brake` seconds, for `pause` seconds, and starts again within half a second.
fn warped(samples: &[f64], at: f64, brake: f64, pause: f64, end: f64) -> impl Iterator<Item = Option<f64>> + '_ {
    // The clock's rate falls as 1 - 3u^2 + 2u^3, whose integral is u - u^3 + u^4/2; it rises as its mirror.
    (0..(end * 1e3) as usize).map(move |tick| {
        let t = tick as f64 * 1e-3;
        let (gone, go) = (t - at, at + brake + pause);
        let clock = if gone < 0.0 {
            t
        } else if gone < brake {
            let u = gone / brake;
            at + brake * (u - u * u * u + 0.5 * u.powi(4))
        } else if t < go {
            at + 0.5 * brake
        } else if t < go + 0.5 {
            let u = (t - go) / 0.5;
            at + 0.5 * brake + 0.5 * (u * u * u - 0.5 * u.powi(4))
        } else {
            at + 0.5 * brake + 0.25 + (t - go - 0.5)
        };
        let place = (clock * 1e3).min((samples.len() - 2) as f64);
        let n = place as usize;
        Some(samples[n] + (samples[n + 1] - samples[n]) * (place - n as f64))
    })
}

/// One real goniometer on one knee, 13 people, with pauses and turns: no phantom stride, and in pauses the setpoints stand from 0.6 s on,
/// see [`footfall_tests::swings`].
#[test]
fn a_real_goniometer_with_pauses_and_turns() {
    let Some(folder) = many("knee goniometers") else { return };
    let (mut followed, mut swings) = (0, 0);
    for path in footfall_tests::traces::csv_files(&folder.join("knee_goniometer")) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let recording = csv_file::read(&path).expect("a good recording");
        let walker = Person::of(&name, recording, Joint::LeftKnee);
        let samples = walker.samples(Joint::LeftKnee);
        let ticks = run::run(&mut walker.legs(Joint::LeftKnee), samples.iter().copied().map(Some));
        let half = 0.5 * range_deg(&walker.templates[2]);
        let driven = tops(ticks.iter().map(|tick| tick.angles[2]), half);
        let phantoms = phantoms(&driven, &samples);
        let real = tops(samples.iter().copied(), half);
        println!("{name}: {} swings recorded, {} driven, phantoms {phantoms:?}", real.len(), driven.len());
        assert!(phantoms.is_empty(), "{name}: {phantoms:?}");
        followed += driven.len();
        swings += real.len();
        for (tick, stood) in ticks.iter().zip(standing(&samples)) {
            let fast = stood > 1601 && tick.rates.iter().any(|rate| rate.abs() > 5.0);
            assert!(!fast, "{name}: setpoints move {} s into a pause", stood as f64 * 1e-3);
        }
    }
    println!("{followed} of {swings} swings followed");
    assert!(followed * 10 >= swings * 7, "{followed} of {swings} swings followed");
}

/// Every degraded copy: finite setpoints, no acceleration beyond the stated bound, and either locked within the stated error over
/// the last 5 s, or not walking on a sensor that is not believed.
#[test]
fn degraded_sensors() {
    let mut all = people("degraded copies of recorded walkers", Joint::LeftHip);
    all.push(default_loop(Joint::LeftHip, 30.0));
    for walker in all {
        let hip: Vec<f64> = walker.samples(Joint::LeftHip).into_iter().take(30_000).collect();
        let knee: Vec<f64> = walker.samples(Joint::LeftKnee).into_iter().take(30_000).collect();
        let right: Vec<f64> = walker.samples(Joint::RightHip).into_iter().take(30_000).collect();
        let fault = 12_000..15_000;
        let low = hip.iter().copied().fold(f64::MAX, f64::min);
        let range = hip.iter().copied().fold(f64::MIN, f64::max) - low;
        // Name, series, phase error that it stays within over the last 5 s where it is locked, and whether it must be.
        let copies: Vec<(&str, Series, f64, bool)> = vec![
            ("sound", degraded::sound(&hip), 5.0, true),
            ("dropout of 3 s", degraded::dropout(&hip, fault.clone()), 5.0, true),
            ("dropouts of 10 ms", (0..30_000).map(|n| (n % 500 >= 10).then_some(hip[n])).collect(), 6.0, true),
            ("stuck for 3 s", degraded::stuck(&hip, fault.clone()), 5.0, true),
            ("not a number for 3 s", degraded::not_a_number(&hip, fault.clone()), 5.0, true),
            ("spikes of 40 deg, one in 50", degraded::spikes(&hip, 50, 40.0, 1), 6.0, true),
            ("noise of 0.3 deg", degraded::noise(&hip, 0.3, 2), 5.0, true),
            ("noise of 15 deg", degraded::noise(&hip, 15.0, 3), 180.0, false),
            ("drift of 0.3 deg/s", degraded::drift(&hip, 0.3), 6.0, true),
            ("drift of 1 deg/s", degraded::drift(&hip, 1.0), 12.0, true),
            ("offset of 8 deg, gain of 0.7", degraded::miscalibrated(&hip, 8.0, 0.7), 5.0, true),
            ("offset of 40 deg", degraded::miscalibrated(&hip, 40.0, 1.0), 5.0, true),
            ("supply droop of 2 %", degraded::supply_droop(&hip, 0.02, 3000, 150.0), 8.0, true),
            ("mains hum of 1 deg", degraded::mains_hum(&hip, 1.0), 5.0, true),
            ("12 bits of 300 deg", degraded::quantised(&hip, 300.0), 5.0, true),
            // A clipped swing ends from one tick to the next, as that of a sensor that sticks: it is not believed.
            ("ends clipped by a tenth", degraded::clipped(&hip, low + 0.1 * range, low + 0.9 * range), 15.0, false),
            ("ends clipped by a third", degraded::clipped(&hip, low + range / 3.0, low + range / 1.5), 15.0, false),
            ("swapped wires", degraded::swapped_wires(&hip), 180.0, false),
            ("plug of the other hip", degraded::exchanged(&hip, &right, 12_000), 180.0, false),
            ("plug of the knee", degraded::exchanged(&hip, &knee, 12_000), 180.0, false),
        ];
        for (name, series, within, must) in copies {
            let mut legs = walker.legs(Joint::LeftHip);
            let bounds = Joint::ALL.map(|joint| f64::from(legs.acceleration_bound(joint).0).to_degrees());
            let ticks = run::run(&mut legs, series);
            for (n, pair) in ticks.windows(2).enumerate() {
                for (joint, bound) in bounds.iter().enumerate() {
                    let acceleration = (pair[1].rates[joint] - pair[0].rates[joint]) / 1e-3;
                    assert!(pair[1].angles[joint].is_finite(), "{name}");
                    assert!(acceleration.abs() <= bound + 30.0, "{name}, tick {n}: {acceleration} deg/s^2");
                }
            }
            let last: Vec<(usize, &Tick)> = ticks.iter().enumerate().skip(ticks.len() - 5000).collect();
            let locked: Vec<f64> =
                last.iter().filter(|(_, t)| t.state == Lock::Locked).map(|&(n, t)| walker.off(t, n)).collect();
            let error = if locked.is_empty() { 0.0 } else { rms(&locked) };
            println!("{} {name}: locked {} of 5000, rms {error:.1} deg", walker.name, locked.len());
            assert!(error <= within, "{}, {name}: {error} deg rms while locked", walker.name);
            assert!(!must || locked.len() == 5000, "{}, {name}: locked {} of 5000", walker.name, locked.len());
        }
    }
}

/// The whole command, on the recording that ships and on files that are no good.
#[test]
fn the_command_says_how_it_ended() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("loop.csv");
    csv_file::write(&path, &default_loop(Joint::LeftHip, 20.0).recording).expect("written");
    let call = |path: &Path, more: &[&str]| {
        let arguments = ["footfall", "entrain"].iter().map(std::ffi::OsString::from);
        let more = more.iter().map(std::ffi::OsString::from);
        footfall::cli::main(arguments.chain([path.into()]).chain(more))
    };
    let picture = folder.path().join("run.svg");
    assert_eq!(call(&path, &["--sensor", "right_knee", "--json", "--svg", &picture.display().to_string()]), 0);
    assert!(std::fs::read_to_string(&picture).expect("drawn").contains("phase error"));
    assert_eq!(call(&folder.path().join("none.csv"), &[]), 2);
    assert_eq!(call(&path, &["--sensor", "left_toe"]), 2);
    assert_eq!(call(&path, &["--generator", &path.display().to_string()]), 2);
    std::fs::write(&path, "time_s,left_hip_deg\n0,1\n1,1\n2,1\n3,1\n").expect("written");
    assert_eq!(call(&path, &[]), 2, "what does not walk");
}
