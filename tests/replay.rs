//! The default loop, on the host, on the default recording: what holds at every tick, and what a broken sensor leads to.

use footfall_tests::degraded::Degraded;
use footfall_tests::host_loop::{HostLoop, Ticked};
use footfall_tests::recordings::default_trace;
use hgod_adc::Validity;
use joint_loop::{Cause, LoopConfig, SENSORS, SupervisorState, anatomy, fault_response};
use joint_units::{AdcCode, Joint};
use std::f64::consts::TAU;

/// Ticks of a minute.
const MINUTE: u32 = 60_000;

fn degrees(ticked: &Ticked) -> [f64; 4] {
    ticked.frame.setpoints.map(|angle| f64::from(angle.0).to_degrees())
}

#[test]
fn a_minute_of_walking_keeps_every_limit_of_the_gate() {
    let all = HostLoop::new(Degraded::Sound).arm_and_walk(MINUTE);
    let gate = LoopConfig::default_biped().gate;
    let rate = f64::from(gate.rate[0].0).to_degrees();
    let acceleration = f64::from(gate.acceleration[0].0).to_degrees();
    for (n, ticked) in all.iter().enumerate() {
        let frame = &ticked.frame;
        assert_eq!((frame.tick, frame.missed, frame.late), (n as u32 + 1, 0, 0));
        assert_eq!(frame.validity[0], Some(Validity::Good), "tick {n}");
        for ((joint, angle), range) in Joint::ALL.into_iter().zip(degrees(ticked)).zip(gate.range) {
            let (least, most) = (f64::from(range.least.0).to_degrees(), f64::from(range.most.0).to_degrees());
            assert!((least - 1e-4..=most + 1e-4).contains(&angle), "tick {n}: {} at {angle}", joint.name());
            assert!(range.least.0 >= anatomy::range(joint).least.0 && range.most.0 <= anatomy::range(joint).most.0);
        }
        for limit in gate.pose.iter().flatten() {
            let at = |joint: Joint| degrees(ticked)[joint as usize];
            let together = match limit.sense {
                joint_loop::PoseSense::Sum => at(limit.first) + at(limit.second),
                joint_loop::PoseSense::Difference => at(limit.first) - at(limit.second),
            };
            assert!(together <= f64::from(limit.most.0).to_degrees() + 1e-3, "tick {n}: {limit:?} at {together}");
        }
        // Outputs exactly in the moving states, and widths that a servo may be given.
        assert_eq!(ticked.command.pulses.is_some(), frame.state.moving(), "tick {n}, {}", frame.state.name());
        for pulse in ticked.command.pulses.iter().flatten() {
            assert!((500..=2500).contains(&pulse.0), "tick {n}: {} us", pulse.0);
        }
    }
    // One unit in the last place of an angle of 1 rad, per millisecond and per millisecond squared.
    let (rate_noise, acceleration_noise) = (0.02, 30.0);
    for (n, three) in all.windows(3).enumerate() {
        let [a, b, c] = [degrees(&three[0]), degrees(&three[1]), degrees(&three[2])];
        for joint in 0..4 {
            let speed = (b[joint] - a[joint]) * 1e3;
            let change = (c[joint] - 2.0 * b[joint] + a[joint]) * 1e6;
            assert!(speed.abs() <= rate + rate_noise, "tick {n}: {speed} deg/s");
            assert!(change.abs() <= acceleration + acceleration_noise, "tick {n}: {change} deg/s^2");
        }
    }
    let walking = all.iter().filter(|ticked| ticked.frame.state == SupervisorState::Walking).count();
    assert!(walking > 57_000, "{walking} ticks of walking");
    assert!(all.iter().all(|ticked| !ticked.frame.limited.any()), "the gate has to hold nothing back in a plain walk");
}

#[test]
fn the_walk_has_its_period_and_its_phases() {
    let all = HostLoop::new(Degraded::Sound).arm_and_walk(20_000);
    let settled: Vec<[f64; 4]> = all[8_000..].iter().map(degrees).collect();
    // Rising crossings of the middle, by straight lines between ticks.
    let crossings = |joint: usize, middle: f64| -> Vec<f64> {
        settled
            .windows(2)
            .enumerate()
            .filter(|(_, w)| w[0][joint] < middle && w[1][joint] >= middle)
            .map(|(n, w)| n as f64 + (middle - w[0][joint]) / (w[1][joint] - w[0][joint]))
            .collect()
    };
    let hip = crossings(0, 5.0);
    let strides: Vec<f64> = hip.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(strides.len() >= 9);
    for stride in &strides {
        // 1.1 s by construction; the models' text states it to four figures.
        assert!((stride - 1100.0).abs() < 1.0, "a stride of {stride} ms");
    }
    // Phase of each joint behind the left hip, by its fundamental: 180, 80 and -100 degrees.
    let period = strides.iter().sum::<f64>() / strides.len() as f64;
    let whole = (period * strides.len() as f64) as usize;
    let phase = |joint: usize| {
        let (mut re, mut im) = (0.0, 0.0);
        for (n, pose) in settled[..whole].iter().enumerate() {
            let turn = TAU * n as f64 / period;
            re += pose[joint] * turn.cos();
            im += pose[joint] * turn.sin();
        }
        im.atan2(re)
    };
    for (joint, ahead) in [(1, 180.0), (2, 80.0), (3, -100.0)] {
        let found = (phase(0) - phase(joint)).to_degrees();
        let off = (found - ahead + 540.0_f64).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 12.0, "joint {joint}: {found} degrees ahead of the left hip, {ahead} wanted");
    }
}

#[test]
fn the_measured_angle_is_the_knee_delayed_by_the_filter() {
    let mut walk = HostLoop::new(Degraded::Sound);
    let all = walk.ticks(10_000, false);
    let recording = default_trace();
    let looped = recording.looped(1000.0).unwrap();
    let knee = looped.recording.channel("left_knee").unwrap();
    // One sample of the median and 1 / (2 pi 40 Hz).
    let delay = 5.0;
    let mut worst = 0.0_f64;
    for (n, ticked) in all.iter().enumerate().skip(200) {
        let time = ((n as f64 + 1.0 - delay) * 1e-3) % looped.recording.duration_s();
        let recorded = looped.recording.at(knee, time);
        worst = worst.max((f64::from(ticked.frame.measured[0].0).to_degrees() - recorded).abs());
    }
    // What a delay does not undo: the pole rounds off the corners of the recording.
    assert!(worst < 1.5, "{worst} degrees");
}

#[test]
fn equal_inputs_give_equal_bits_and_others_do_not() {
    let hash = |pressed: u32| {
        let mut walk = HostLoop::new(Degraded::Sound);
        walk.ticks(50, false);
        walk.ticks(pressed, true);
        walk.ticks(5_000, false);
        walk.joints.frame().setpoint_hash
    };
    assert_eq!(hash(350), hash(350));
    // Too short to arm: nothing moves.
    assert_ne!(hash(350), hash(250));
}

#[test]
fn a_second_press_leads_to_the_park_pose_without_a_jump() {
    let mut walk = HostLoop::new(Degraded::Sound);
    let mut all = walk.arm_and_walk(6_000);
    all.extend(walk.ticks(100, true));
    all.extend(walk.ticks(2_000, false));
    let stopping = all.iter().filter(|ticked| ticked.frame.state == SupervisorState::Stopping).count();
    assert!((990..=1_100).contains(&stopping), "{stopping} ms");
    let last = &all[all.len() - 1];
    assert_eq!((last.frame.state, last.command.pulses), (SupervisorState::Disarmed, None));
    let moving: Vec<&Ticked> = all.iter().filter(|ticked| ticked.command.pulses.is_some()).collect();
    for end in [moving[0], moving[moving.len() - 1]] {
        for (angle, park) in degrees(end).into_iter().zip([0.0, 0.0, 5.0, 5.0]) {
            assert!((angle - park).abs() < 0.01, "{angle} is not the park pose");
        }
    }
}

/// When the loop first leaves the walk, in ticks after the fault, and why.
fn leaves(condition: Degraded, at: u32) -> Option<(u32, Cause)> {
    let all = HostLoop::new(condition).arm_and_walk(12_000);
    assert_eq!(all[at as usize - 2].frame.state, SupervisorState::Walking);
    let left = all.iter().find(|ticked| ticked.frame.tick >= at && ticked.frame.state != SupervisorState::Walking)?;
    Some((left.frame.tick - at, left.frame.cause))
}

#[test]
fn a_broken_sensor_stops_the_walk_in_time() {
    let at = 6_000;
    for (condition, verdict) in [
        (Degraded::Open(at), Validity::Open),
        (Degraded::Short(at), Validity::Short),
        (Degraded::Stuck(at), Validity::Stuck),
    ] {
        let is = fault_response(verdict).expect("something follows");
        let within = u32::from(is.stops_ms());
        let (after, cause) = leaves(condition, at).unwrap_or_else(|| panic!("{condition:?}: the walk goes on"));
        assert!(after <= within, "{condition:?}: after {after} ms");
        assert_eq!(cause, is.cause, "{condition:?}");
    }
    // Off for 4 of 5 ms: bad more often than good.
    let often = HostLoop::new(Degraded::DropOuts { off: 4, every: 5 }).arm_and_walk(3_000);
    assert!(often.iter().all(|ticked| ticked.command.pulses.is_none()), "armed on a sensor that is mostly off");
}

#[test]
fn noise_and_short_drop_outs_do_not_stop_the_walk() {
    for condition in [Degraded::Spikes(97), Degraded::Spikes(13), Degraded::DropOuts { off: 5, every: 50 }] {
        let all = HostLoop::new(condition).arm_and_walk(12_000);
        let last = &all[all.len() - 1].frame;
        assert_eq!(last.state, SupervisorState::Walking, "{condition:?}: {}", last.cause.name());
        // And the spikes do not reach the angle: no more than the sound sensor's fastest motion and the gap that a spike leaves.
        let sound = HostLoop::new(Degraded::Sound).arm_and_walk(12_000);
        let off = all
            .iter()
            .zip(&sound)
            .skip(300)
            .map(|(a, b)| (a.frame.measured[0].degrees() - b.frame.measured[0].degrees()).abs());
        let worst = off.fold(0.0, f32::max);
        assert!(worst < 4.0, "{condition:?}: {worst} degrees");
    }
}

#[test]
fn missed_ticks_are_counted_and_not_made_up_for() {
    let mut walk = HostLoop::new(Degraded::Sound);
    walk.arm_and_walk(6_000);
    let before = walk.joints.frame();
    let after = walk.tick_after(4, false).frame;
    assert_eq!((after.tick - before.tick, after.missed, after.seq - before.seq), (4, 3, 1));
    assert_eq!(after.state, SupervisorState::Walking);
    // One step of the generator, not four: as far as one tick can go.
    let farthest = f64::from(LoopConfig::default_biped().gate.rate[0].0).to_degrees() * 1e-3;
    for (a, b) in before.setpoints.iter().zip(after.setpoints) {
        assert!(f64::from(b.0 - a.0).to_degrees().abs() <= farthest + 1e-4);
    }
    // A gap of more than 5 ms stops, one of more than 20 ms is a fault.
    for (gap, state) in [(10, SupervisorState::Stopping), (30, SupervisorState::Fault)] {
        let mut walk = HostLoop::new(Degraded::Sound);
        walk.arm_and_walk(6_000);
        let frame = walk.tick_after(gap, false).frame;
        assert_eq!((frame.state, frame.cause), (state, Cause::Gap), "{gap} ms");
    }
}

#[test]
fn no_sequence_of_codes_moves_a_disarmed_joint() {
    let mut walk = HostLoop::new(Degraded::Sound);
    let mut noise = 0x2545_f491_4f6c_dd1d_u64;
    for _ in 0..200_000 {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        let sample = joint_loop::Sample {
            elapsed: (noise >> 40) as u32 & 3,
            codes: [AdcCode(noise as u16); SENSORS],
            vrefint: AdcCode((noise >> 16) as u16),
            foot: noise & 0x100 != 0,
            ..joint_loop::Sample::default()
        };
        let command = walk.joints.tick(&sample);
        assert_eq!(command.pulses, None);
        assert!(walk.joints.frame().measured[0].0.is_finite());
    }
}
