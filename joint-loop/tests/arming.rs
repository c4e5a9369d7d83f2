//! What a board must have shown before its first arming: an emergency stop that works, and the clock of its watchdog.

mod support;

use joint_loop::control::watchdog_clock::WatchdogHz;
use joint_loop::{BoardFaults, Cause, LoopConfig, MonitorConfig, Sample, SupervisorState};
use support::{default_loop_with, hold, idle, run};

fn requiring(change: impl Fn(&mut MonitorConfig)) -> LoopConfig {
    let mut config = LoopConfig::default_biped();
    change(&mut config.monitor);
    config
}

#[test]
fn a_board_arms_after_its_emergency_stop_was_pressed_and_released() {
    let mut joints = default_loop_with(&requiring(|monitor| monitor.stop_test_required = true));
    let end = |joints: &support::Loop| (joints.state(), joints.frame().cause, joints.awaits_stop_test());
    idle(&mut joints, 100);
    hold(&mut joints);
    assert_eq!(end(&joints), (SupervisorState::Disarmed, Cause::StopUntested, true));
    // A press that is not released yet is no test.
    run(&mut joints, 100, |sample| Sample { faults: BoardFaults::BREAK_INPUT, ..sample });
    assert!(joints.awaits_stop_test());
    idle(&mut joints, 100);
    assert!(!joints.awaits_stop_test());
    hold(&mut joints);
    assert_eq!(end(&joints), (SupervisorState::Arming, Cause::None, false));
    // Without the requirement there is nothing to await.
    let mut joints = default_loop_with(&LoopConfig::default_biped());
    assert!(!joints.awaits_stop_test());
    idle(&mut joints, 100);
    hold(&mut joints);
    assert_eq!(end(&joints), (SupervisorState::Arming, Cause::None, false));
}

#[test]
fn a_board_arms_after_a_good_measurement_of_its_watchdog_clock() {
    let mut joints = default_loop_with(&requiring(|monitor| monitor.watchdog_clock_required = true));
    let measured = |joints: &mut support::Loop, hz| {
        let clock = Some(WatchdogHz(hz));
        run(joints, 1, |sample| Sample { watchdog_clock: clock, ..sample });
        idle(joints, 40);
        hold(joints);
        (joints.state(), joints.frame().cause, joints.wrong_watchdog_clock())
    };
    idle(&mut joints, 100);
    hold(&mut joints);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::WatchdogClock));
    assert_eq!(joints.wrong_watchdog_clock(), None, "there is none yet");
    let too_fast = (SupervisorState::Disarmed, Cause::WatchdogClock, Some(WatchdogHz(60_000)));
    assert_eq!(measured(&mut joints, 60_000), too_fast);
    // Three presses in 5 s: the next one would be refused for another reason.
    idle(&mut joints, 10_000);
    assert_eq!(measured(&mut joints, 32_000), (SupervisorState::Arming, Cause::None, None));
    // Without the requirement a board needs no measurement.
    let mut joints = default_loop_with(&LoopConfig::default_biped());
    idle(&mut joints, 100);
    hold(&mut joints);
    assert_eq!(joints.state(), SupervisorState::Arming);
}
