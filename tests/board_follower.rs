//! The whole chain on the virtual board with a follower: a recorded hip as volts, converted, measured, locked to, and four
//! joints that follow; and what happens when the wire breaks. The same core on the host gives the same bits.

use cpg_core::entrainment::Lock;
use footfall::board::feed;
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{self, ARM};
use footfall_tests::people::{PEOPLE, people_of};
use footfall_tests::{chain, recordings};
use gait_fit::fit::{Settings, Source, fit};
use gait_trace::ReadOptions;
use gait_trace::format::open;
use gait_trace::{Channel, Looped, Quantity, Recording};
use joint_loop::setup::default_loop::{BoardLoop, Parameters};
use joint_loop::{BoardGenerator, Cause, FollowerRules, Frame, GeneratorConfig, RobotConfig, SENSORS, SupervisorState};
use joint_units::{Joint, Radians};
use std::process::ExitCode;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        four_joints_follow_one_recorded_hip_or_knee(Image),
        with_a_broken_wire_it_walks_two_seconds_then_stands(Image),
        a_sensor_that_was_lost_for_long_takes_a_hold_to_walk_again(Image),
        a_person_who_stands_disarms_it(Image),
        the_robot_record_says_when_it_disarms(Image),
        a_robot_that_may_walks_again_after_a_lost_sensor(Image),
        a_hand_that_waves_the_sensor_does_not_move_the_joints_for_ever(Image),
        corrections_bring_the_joints_closer(Image, Traces),
    ])
}

/// The default recording, fitted, with the sensor on this joint.
fn follower(sensor: Joint) -> GeneratorConfig {
    let raw = open::read(&recordings::default_traces_folder().join(feed::DEFAULT_TRACE_NAME), &ReadOptions::default())
        .unwrap();
    let source = Source { name: feed::DEFAULT_TRACE_NAME.into(), sha256: String::new() };
    let settings = Settings { follow: Some(sensor), starts: 10, ..Settings::default() };
    fit(&source, &raw, &settings, &mut |_| ()).unwrap().file.set.config()
}

/// The default recording as a loop at 1 kHz.
fn walk() -> Looped {
    recordings::default_trace().looped(1000.0).unwrap()
}

/// Volts of a joint's sensor for so many seconds of walking; between `lost` the wire is broken.
fn volts(walk: &Looped, sensor: Joint, secs: f64, lost: (f64, f64)) -> Recording {
    let period = walk.recording.duration_s();
    let channel = walk.recording.of_joint(sensor).unwrap();
    let at = |ms: u32| walk.recording.at(channel, f64::from(ms) * 1e-3 % period);
    let good = chain::volts(&(0..(secs * 1000.0) as u32).map(at).collect::<Vec<_>>());
    let times = good.time_s().to_vec();
    let broken = |(t, v): (&f64, &f64)| if (lost.0..lost.1).contains(t) { 0.0 } else { *v };
    let values = times.iter().zip(good.channels()[0].values()).map(broken).collect();
    Recording::build(times, vec![Channel::new("PA1", Quantity::PinVolts, values)]).unwrap()
}

/// Root mean square difference of setpoints and the recorded leg, degrees, over some ticks; the recording began that long before tick 0.
fn rmse(frames: &[Frame<SENSORS>], begun_ms: usize, walk: &Looped, joint: Joint) -> f64 {
    let (period, channel) = (walk.recording.duration_s(), walk.recording.of_joint(joint).unwrap());
    let squares = frames.iter().map(|frame| {
        let wanted = walk.recording.at(channel, (f64::from(frame.tick) + begun_ms as f64) * 1e-3 % period);
        (f64::from(frame.setpoints[joint as usize].degrees()) - wanted).powi(2)
    });
    (squares.sum::<f64>() / frames.len() as f64).sqrt()
}

fn four_joints_follow_one_recorded_hip_or_knee() {
    let board = Board::find();
    let walk = walk();
    report!("| sensor | locked at, s | left hip | right hip | left knee | right knee |");
    for sensor in [Joint::LeftHip, Joint::RightHip, Joint::LeftKnee] {
        let config = follower(sensor);
        let ran = chain::run(&board, &config, &volts(&walk, sensor, 12.0, (0.0, 0.0)), 12.0, &[ARM]);
        let following = ran.books.following.unwrap();
        let locked = following.locked_at_s.unwrap();
        assert!(locked < 4.0, "{sensor:?}: locked after {locked} s");
        assert_eq!(following.state, "locked");
        let frames = ran.boots[0].replay(&config);
        assert_eq!(frames[frames.len() - 1].state, SupervisorState::Walking);
        let begun_ms = chain::begun_ms(&ran.boots[0]);
        let errors = Joint::ALL.map(|joint| rmse(&frames[6_000..], begun_ms, &walk, joint));
        report!("| {} | {locked:.2} | {} |", sensor.name(), errors.map(|e| format!("{e:.2}")).join(" | "));
        // The recording has two strides that differ; a template is their mean.
        assert!(errors.iter().all(|error| *error < 3.5), "{sensor:?}: {errors:?}");
    }
}

/// A recorded person, fitted with and without corrections: the same phase, and each joint closer to the person's.
fn corrections_bring_the_joints_closer() {
    let board = Board::find();
    let (name, sensor, secs) = (PEOPLE[1], Joint::LeftHip, 16.0);
    let path = test_suite::traces_folder().join(format!("{name}.csv"));
    let raw = open::read(&path, &ReadOptions::default()).unwrap();
    let [person] = &people_of(&[name], sensor)[..] else { panic!("one person") };
    let feed = chain::volts(&person.samples(sensor)[..(secs * 1000.0) as usize]);
    let errors = [true, false].map(|corrections| {
        let source = Source { name: name.into(), sha256: String::new() };
        let settings = Settings { follow: Some(sensor), starts: 10, corrections, ..Settings::default() };
        let config = fit(&source, &raw, &settings, &mut |_| ()).unwrap().file.set.config();
        let GeneratorConfig::Follow(follow) = &config else { panic!("not a follower") };
        assert_eq!(follow.corrections.is_none(), !corrections);
        // Refuses a run in which one bit differs from the host's.
        let ran = chain::run(&board, &config, &feed, secs, &[ARM]);
        let frames = ran.boots[0].replay(&config);
        let begun_ms = chain::begun_ms(&ran.boots[0]);
        Joint::ALL.map(|joint| {
            let recorded = person.samples(joint);
            let squares = frames[6_000..].iter().map(|frame| {
                let wanted = recorded[frame.tick as usize + begun_ms];
                (f64::from(frame.setpoints[joint as usize].degrees()) - wanted).powi(2)
            });
            (squares.sum::<f64>() / (frames.len() - 6_000) as f64).sqrt()
        })
    });
    let [with, without] = errors;
    report!("{name}, {}: {with:.2?} with corrections, {without:.2?} without", sensor.name());
    assert!(with.iter().zip(without).all(|(with, without)| *with < without), "{with:?} {without:?}");
    assert!(with[sensor as usize] < 0.5, "{with:?}");
}

/// The state and its cause from a tick on.
fn at(frames: &[Frame<SENSORS>], t_s: f64) -> (SupervisorState, Cause) {
    let frame = frames.iter().find(|frame| f64::from(frame.tick) * 1e-3 >= t_s).expect("a frame");
    (frame.state, frame.cause)
}

/// No pulse between these times, and some before and after.
fn assert_pause(ran: &Ran, from_s: f64, to_s: f64) {
    let pulses = |least: f64, most: f64| {
        ran.pulses.iter().filter(|(t_s, us)| (least..most).contains(t_s) && us.iter().any(Option::is_some)).count()
    };
    assert_eq!(pulses(from_s, to_s), 0);
    assert!(pulses(0.0, from_s) > 100 && pulses(to_s, f64::INFINITY) > 20);
}

fn a_sensor_that_was_lost_for_long_takes_a_hold_to_walk_again() {
    let board = Board::find();
    let (walk, sensor) = (walk(), Joint::LeftHip);
    let config = follower(sensor);
    let feed = volts(&walk, sensor, 21.0, (6.0, 13.0));
    let ran = chain::run(&board, &config, &feed, 21.0, &[ARM, &gestures::hold(18.0)]);
    let frames = ran.boots[0].replay(&config);
    // A good sample in the last tick before, and the count of 5 s from the first one that is not good.
    assert_eq!(at(&frames, 10.95), (SupervisorState::Walking, Cause::None));
    assert_eq!(at(&frames, 11.06), (SupervisorState::Stopping, Cause::SensorOpen));
    assert_eq!(at(&frames, 11.5), (SupervisorState::Disarmed, Cause::SensorOpen));
    // It is good from 13 s on: nothing moves until the release at 18.4 s.
    assert_eq!(at(&frames, 18.3), (SupervisorState::Disarmed, Cause::SensorOpen));
    assert_pause(&ran, 11.5, 18.4);
    assert_eq!(at(&frames, 20.9), (SupervisorState::Walking, Cause::None));
}

fn a_person_who_stands_disarms_it() {
    let board = Board::find();
    let (walk, sensor) = (walk(), Joint::LeftHip);
    let config = follower(sensor);
    // Walks for 6 s, stands, from 20 s on walks again. A code that never changes would be that of a sensor that sticks.
    let (period, channel) = (walk.recording.duration_s(), walk.recording.of_joint(sensor).expect("the hip"));
    let angle = |ms: u32| {
        let sway = if ms.is_multiple_of(2) { 0.1 } else { 0.0 };
        let moved_ms = if ms < 6_000 { ms } else { 6_000 + ms.saturating_sub(20_000) };
        walk.recording.at(channel, f64::from(moved_ms) * 1e-3 % period) + sway
    };
    let feed = chain::volts(&(0..27_000).map(angle).collect::<Vec<_>>());
    let ran = chain::run(&board, &config, &feed, 27.0, &[ARM, &gestures::hold(24.0)]);
    let frames = ran.boots[0].replay(&config);
    let disarmed = frames.iter().find(|frame| frame.state == SupervisorState::Stopping).expect("it stops");
    let t_s = f64::from(disarmed.tick) * 1e-3;
    report!("stands from 6 s on, disarmed at {t_s:.2} s");
    assert!((16.0..18.5).contains(&t_s) && disarmed.cause == Cause::PersonStands, "{t_s} s, {:?}", disarmed.cause);
    // The person walks again, and nothing moves until the release at 24.4 s.
    assert_eq!(at(&frames, 24.3), (SupervisorState::Disarmed, Cause::PersonStands));
    assert_pause(&ran, t_s + 0.4, 24.4);
    assert_eq!(at(&frames, 26.9), (SupervisorState::Walking, Cause::None));
}

/// The angles of a person who walks for so many seconds and then stands. A code that never changes would be that of a sensor that sticks.
fn walks_then_stands(walk: &Looped, sensor: Joint, walks_s: f64, secs: f64) -> Recording {
    let (period, channel) = (walk.recording.duration_s(), walk.recording.of_joint(sensor).expect("the hip"));
    let angle = |ms: u32| {
        let sway = if ms.is_multiple_of(2) { 0.1 } else { 0.0 };
        walk.recording.at(channel, (f64::from(ms) * 1e-3).min(walks_s) % period) + sway
    };
    chain::volts(&(0..(secs * 1e3) as u32).map(angle).collect::<Vec<_>>())
}

/// The follower on a robot with these rules.
fn ruled(sensor: Joint, follower: FollowerRules) -> Parameters {
    let robot = RobotConfig { follower, ..RobotConfig::default_biped() };
    Parameters::with_defaults(Some(self::follower(sensor)), None, robot).expect("the defaults")
}

/// 3 s in place of 10.
fn the_robot_record_says_when_it_disarms() {
    let (board, walk, sensor) = (Board::find(), walk(), Joint::LeftHip);
    let parameters = ruled(sensor, FollowerRules { disarm_after_stand_s: 3.0, ..FollowerRules::DEFAULT });
    let ran = chain::run_as(&board, &parameters, &walks_then_stands(&walk, sensor, 6.0, 12.0), 12.0, &[ARM]);
    let frames = ran.boots[0].watch_as(&parameters, BoardLoop::frame);
    let disarmed = frames.iter().find(|frame| frame.state == SupervisorState::Stopping).expect("it stops");
    let t_s = f64::from(disarmed.tick) * 1e-3;
    report!("stands from 6 s on, disarmed at {t_s:.2} s");
    assert!((9.0..11.5).contains(&t_s) && disarmed.cause == Cause::PersonStands, "{t_s} s, {:?}", disarmed.cause);
}

/// The wire is broken for 7 s, and the record says that this is no end: it stands with the outputs on, and walks again by itself. Lost for good it is
/// disarmed by the time of the stand.
fn a_robot_that_may_walks_again_after_a_lost_sensor() {
    let (board, walk, sensor) = (Board::find(), walk(), Joint::LeftHip);
    let parameters = ruled(sensor, FollowerRules { walks_again_after_lost_sensor: true, ..FollowerRules::DEFAULT });
    let ran = chain::run_as(&board, &parameters, &volts(&walk, sensor, 19.0, (6.0, 13.0)), 19.0, &[ARM]);
    let frames = ran.boots[0].watch_as(&parameters, BoardLoop::frame);
    assert!(frames[2_500..].iter().all(|frame| frame.state == SupervisorState::Walking));
    let last = frames.last().and_then(|frame| frame.following).expect("a follower");
    assert_eq!(last.state, Lock::Locked);
    let ran = chain::run_as(&board, &parameters, &volts(&walk, sensor, 20.0, (6.0, 20.0)), 20.0, &[ARM]);
    let frames = ran.boots[0].watch_as(&parameters, BoardLoop::frame);
    let disarmed = frames.iter().find(|frame| frame.state == SupervisorState::Stopping).expect("it stops");
    let t_s = f64::from(disarmed.tick) * 1e-3;
    report!("a sensor that is lost for good from 6 s on: disarmed at {t_s:.2} s");
    assert!((18.0..18.6).contains(&t_s) && disarmed.cause == Cause::PersonStands, "{t_s} s, {:?}", disarmed.cause);
}

/// A hand waves the knee's sensor once a second: the follower locks to it for a stride or two, over and over, and the joints move in bursts. Within half a
/// minute the board disarms.
fn a_hand_that_waves_the_sensor_does_not_move_the_joints_for_ever() {
    let (board, sensor) = (Board::find(), Joint::LeftKnee);
    let config = follower(sensor);
    for size_deg in [20.0, 30.0] {
        let wave = |ms: u32| 25.0 + size_deg * (f64::from(ms) * 1e-3 * std::f64::consts::TAU).sin();
        let feed = chain::volts(&(0..40_000).map(wave).collect::<Vec<_>>());
        let ran = chain::run(&board, &config, &feed, 40.0, &[ARM]);
        let frames = ran.boots[0].replay(&config);
        let locks = frames.windows(2).filter(|two| {
            let [before, now] = [0, 1].map(|n| two[n].following.map(|status| status.state));
            before != now && now == Some(Lock::Locked)
        });
        let locks = locks.count();
        let disarmed = frames.iter().find(|frame| frame.state == SupervisorState::Stopping).expect("it stops");
        let t_s = f64::from(disarmed.tick) * 1e-3;
        report!("a wave of {size_deg} degrees once a second: {locks} locks in 40 s, disarmed at {t_s:.1} s");
        assert!(locks > 3, "it was meant to lock now and then");
        assert!(t_s < 30.0 && disarmed.cause == Cause::PersonStands, "{t_s} s, {:?}", disarmed.cause);
        assert_eq!(frames.last().expect("frames").state, SupervisorState::Disarmed);
    }
}

fn with_a_broken_wire_it_walks_two_seconds_then_stands() {
    let board = Board::find();
    let (walk, sensor) = (walk(), Joint::LeftHip);
    let config = follower(sensor);
    // Less than the 5 s after which it would not walk again.
    let (lost, mended) = (7.0, 11.8);
    let ran = chain::run(&board, &config, &volts(&walk, sensor, 20.0, (lost, mended)), 20.0, &[ARM]);
    let frames = ran.boots[0].replay(&config);
    // Never disarmed, never a fault: for this time the supervisor leaves it to the follower.
    assert!(frames[2_500..].iter().all(|frame| frame.state == SupervisorState::Walking));

    // The follower's own account, tick by tick.
    let amplitude = ran.boots[0].watch(&config, |joints| {
        let BoardGenerator::Follow(follower) = joints.generator() else { panic!("not a follower") };
        let time = f64::from(joints.frame().tick) * 1e-3;
        (time, cpg_core::Generator::amplitude(follower), follower.status().state.name())
    });
    let at = |t: f64| *amplitude.iter().find(|(time, ..)| *time >= t).unwrap();
    assert_eq!(at(6.9).2, "locked");
    assert_eq!(at(7.5).2, "holding");
    assert!(at(8.9).1 > 0.9, "walks on for two seconds: {:?}", at(8.9));
    let stands = at(11.5);
    assert!(stands.1 < 0.02 && stands.2 == "stopped", "{stands:?}");
    let standing = &frames[frames.iter().position(|frame| frame.tick == 11_500).unwrap()];
    assert!(
        standing.setpoints.iter().zip([0.0, 0.0, 5.0, 5.0]).all(|(set, stand)| (set.degrees() - stand).abs() < 1.0)
    );
    assert_eq!(at(18.0).2, "locked");
    assert!(at(18.0).1 > 0.95);

    // Nowhere a jump: not when it breaks, not when it stands, not when it comes back.
    let mut largest = 0.0f32;
    for two in frames[2_500..].windows(3) {
        for joint in 0..4 {
            let [a, b, c] = [0, 1, 2].map(|k| two[k].setpoints[joint]);
            let bend = Radians(a.0 - 2.0 * b.0 + c.0).degrees().abs();
            largest = largest.max(bend);
        }
    }
    // 20000 deg/s^2 is what the gate itself lets pass: 0.02 degrees a tick squared.
    assert!(largest <= 0.0201, "{largest} degrees a tick squared");
    assert!(frames[2_500..].iter().all(|frame| !frame.limited.any()), "the gate had to hold it back");
}
