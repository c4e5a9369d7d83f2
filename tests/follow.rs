//! The whole chain on the virtual board with a walker that follows: a recorded hip as volts, converted, measured, locked to, and four
//! joints that follow; and what happens when the wire breaks. The same core on the host gives the same bits.

use footfall::feed;
use footfall::shipped::wired_sensor;
use footfall_tests::board::{Board, Ran};
use footfall_tests::traces;
use gait_fit::fit::{Settings, Source, fit};
use gait_trace::open::{self, ReadOptions};
use gait_trace::{Channel, Looped, Quantity, Recording, csv_file};
use joint_loop::walker_record::{ADDRESS, record_of};
use joint_loop::{Frame, SENSORS, State, Walker, WalkerConfig};
use joint_units::{Joint, Radians};
use std::ffi::OsString;

/// The shipped walker, fitted, with the sensor on this joint.
fn follower(sensor: Joint) -> WalkerConfig {
    let raw = open::read(&traces::shipped_folder().join(feed::SHIPPED_NAME), &ReadOptions::default()).unwrap();
    let source = Source { name: feed::SHIPPED_NAME.into(), sha256: String::new() };
    let settings = Settings { follow: Some(sensor), starts: 10, ..Settings::default() };
    fit(&source, &raw, &settings, &mut |_| ()).unwrap().file.set.config()
}

/// The shipped recording as a loop at 1 kHz.
fn walk() -> Looped {
    traces::shipped().looped(1000.0).unwrap()
}

/// Volts of a joint's sensor for so many seconds of walking; between `lost` the wire is broken.
fn volts(walk: &Looped, sensor: Joint, secs: f64, lost: (f64, f64)) -> Recording {
    let period = walk.recording.duration_s();
    let channel = walk.recording.of_joint(sensor).unwrap();
    let times: Vec<f64> = (0..(secs * 1000.0) as u32).map(|ms| f64::from(ms) * 1e-3).collect();
    let angles = times.iter().map(|t| walk.recording.at(channel, t % period)).collect();
    let hip = Recording::build(times.clone(), vec![Channel::new("hip", Quantity::Angle, angles)]).unwrap();
    let calibration = wired_sensor().unwrap().calibration;
    let good = hip.semi_synthetic_volts(&hip.channels()[0], &calibration, 1.0, "PA1").unwrap();
    let broken = |(t, v): (&f64, &f64)| if (lost.0..lost.1).contains(t) { 0.0 } else { *v };
    let values = times.iter().zip(good.channels()[0].values()).map(broken).collect();
    Recording::build(times, vec![Channel::new("PA1", Quantity::PinVolts, values)]).unwrap()
}

fn run(board: &Board, config: &WalkerConfig, volts: &Recording, secs: f64) -> Ran {
    let folder = tempfile::tempdir().unwrap();
    let (feed, sector) = (folder.path().join("volts.csv"), folder.path().join("walker.bin"));
    csv_file::write(&feed, volts).unwrap();
    std::fs::write(&sector, record_of(config).bytes()).unwrap();
    let options: [OsString; 8] = [
        "--secs".into(),
        secs.to_string().into(),
        "--volts".into(),
        feed.into(),
        "--press".into(),
        "0.3".into(),
        "--flash".into(),
        format!("{ADDRESS:#010x}={}", sector.display()).into(),
    ];
    let ran = board.run_with(config, options);
    assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (Some(0), 0, 0, 1));
    assert_eq!((ran.books.different, ran.books.not_compared), (0, 0), "{:?}", ran.books.differences);
    ran
}

/// Root mean square difference of setpoints and the recorded leg, degrees, over some ticks.
fn rmse(frames: &[Frame<SENSORS>], walk: &Looped, joint: Joint) -> f64 {
    let (period, channel) = (walk.recording.duration_s(), walk.recording.of_joint(joint).unwrap());
    let squares = frames.iter().map(|frame| {
        let wanted = walk.recording.at(channel, f64::from(frame.tick) * 1e-3 % period);
        (f64::from(frame.setpoints[joint as usize].degrees()) - wanted).powi(2)
    });
    (squares.sum::<f64>() / frames.len() as f64).sqrt()
}

#[test]
fn four_joints_follow_one_recorded_hip_or_knee_from_volts_to_setpoints() {
    let Some(board) = Board::find("a follower on the virtual board") else { return };
    let walk = walk();
    println!("| sensor | locked at, s | left hip | right hip | left knee | right knee |");
    for sensor in [Joint::LeftHip, Joint::RightHip, Joint::LeftKnee] {
        let config = follower(sensor);
        let ran = run(&board, &config, &volts(&walk, sensor, 12.0, (0.0, 0.0)), 12.0);
        let following = ran.books.following.unwrap();
        let locked = following.locked_at_s.unwrap();
        assert!(locked < 4.0, "{sensor:?}: locked after {locked} s");
        assert_eq!(following.state, "locked");
        let frames = ran.boots[0].replay(&config);
        assert_eq!(frames[frames.len() - 1].state, State::Walking);
        let errors = Joint::ALL.map(|joint| rmse(&frames[6_000..], &walk, joint));
        println!("| {} | {locked:.2} | {} |", sensor.name(), errors.map(|e| format!("{e:.2}")).join(" | "));
        // The recording has two strides that differ; a template is their mean.
        assert!(errors.iter().all(|error| *error < 3.5), "{sensor:?}: {errors:?}");
    }
}

#[test]
fn a_broken_wire_is_walked_through_for_two_seconds_then_stands_and_walks_again_when_mended() {
    let Some(board) = Board::find("a follower that loses its sensor") else { return };
    let (walk, sensor) = (walk(), Joint::LeftHip);
    let config = follower(sensor);
    let (lost, mended) = (7.0, 12.0);
    let ran = run(&board, &config, &volts(&walk, sensor, 20.0, (lost, mended)), 20.0);
    let frames = ran.boots[0].replay(&config);
    // Never disarmed, never a fault: the supervisor leaves it to the follower.
    assert!(frames[2_500..].iter().all(|frame| frame.state == State::Walking));

    // The follower's own account, tick by tick.
    let mut again = joint_loop::shipped::walk_loop(
        &joint_loop::shipped::Parameters::or_default(Some(config), None).unwrap(),
        ran.boots[0].boot.as_ref().unwrap().vrefint_cal,
        ran.boots[0].boot.as_ref().unwrap().min_supply,
        true,
    )
    .unwrap();
    let mut amplitude = vec![];
    for (_, call) in &ran.boots[0].calls {
        again.tick(&call.sample());
        let Walker::Follow(follower) = again.generator() else { panic!("not a follower") };
        amplitude.push((
            f64::from(again.frame().tick) * 1e-3,
            cpg_core::Generator::amplitude(follower),
            follower.status().state.name(),
        ));
    }
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
