//! Every code of the converter in every state of the supervisor, and changes between all validities: the declared reaction at its tick, no motion
//! without a hold, every setpoint inside the limits.
//!
//! What a code must lead to is computed here from the wiring: the ends of the converter's range, the table from 0.5 to 2.5 V at a supply of 3.3 V.

mod support;

use hgod_adc::{ReferenceConfig, Validity};
use joint_loop::{Cause, JointLoop, PARK_MS, Sample, SupervisorState};
use joint_units::{AdcCode, Period};
use support::motion_limits::MotionLimits;
use support::{GOOD, VREFINT, Walk, default_loop, good, reach};

type Loop = JointLoop<Walk, 1>;

const CODES: std::ops::RangeInclusive<u16> = 0..=4095;

/// The 51st tick with a sensor that is not good stops; the 41st with a supply that is too low switches off.
const TOLERATED: u32 = 48;
const SUPPLY_TOLERATED: u32 = 40;

/// What a constant code comes to; `None` at the ends of a range, where the converter's rounding decides.
fn wanted(code: u16) -> Option<Validity> {
    const NEAR: f64 = 2.0;
    let code = f64::from(code);
    let (low, high) = (0.02 * 4095.0, 0.98 * 4095.0);
    let [first, last] = [0.5, 2.5].map(|volts| volts / 3.3 * 4095.0);
    if [low, high, first, last].iter().any(|edge| (edge - code).abs() < NEAR) {
        None
    } else if code < low {
        Some(Validity::Open)
    } else if code > high {
        Some(Validity::Short)
    } else if code < first || code > last {
        Some(Validity::OutOfTable)
    } else {
        Some(Validity::Good)
    }
}

/// A loop, and the limits that its setpoints keep while the outputs are on.
struct Run {
    joints: Loop,
    limits: MotionLimits,
}

impl Run {
    fn of(joints: &Loop) -> Self {
        let gate = joint_loop::GateConfig::default_biped();
        Self { joints: joints.clone(), limits: MotionLimits::new(gate, Period::MILLISECOND) }
    }

    fn tick(&mut self, sample: &Sample<1>) -> SupervisorState {
        let before = self.joints.state();
        let command = self.joints.tick(sample);
        let frame = self.joints.frame();
        assert_eq!(command.pulses.is_some(), frame.state.moving(), "{before:?} to {:?}", frame.state);
        if frame.state.moving() {
            self.limits.check(&frame.setpoints);
        } else {
            self.limits.interrupt();
        }
        frame.state
    }
}

/// The supervisor's tick in which a state is left, counted from 1, and the state and cause that follow; `None` if it is not left.
fn leaves(run: &mut Run, ticks: u32, sample: impl Fn(u32) -> Sample<1>) -> Option<(u32, SupervisorState, Cause)> {
    let first = run.joints.state();
    (1..=ticks).find_map(|tick| {
        let state = run.tick(&sample(tick));
        // The ramp of arming ends in a walk.
        let is_same = state == first || (first, state) == (SupervisorState::Arming, SupervisorState::Walking);
        (!is_same).then(|| (tick, state, run.joints.frame().cause))
    })
}

#[test]
fn every_code_while_the_joints_move() {
    for state in [SupervisorState::Arming, SupervisorState::Walking] {
        let joints = reach(&default_loop(), state);
        let mut parked = 0;
        for code in CODES {
            let sample = |tick| Sample { codes: [AdcCode(code)], ..good(tick) };
            let mut run = Run::of(&joints);
            let left = leaves(&mut run, 400, sample);
            match wanted(code) {
                None => assert!(left.is_none_or(|left| left.1 == SupervisorState::Stopping), "{code}: {left:?}"),
                Some(Validity::Good) => assert_eq!(left, None, "{code}"),
                Some(validity) => {
                    let cause = Cause::of_sensor(validity);
                    assert_eq!(left, Some((TOLERATED + 1, SupervisorState::Stopping, cause)), "{code}");
                    let ended = leaves(&mut run, u32::from(PARK_MS), sample);
                    assert!(matches!(ended, Some((_, SupervisorState::Disarmed, _))), "{code}: {ended:?}");
                    parked += 1;
                }
            }
        }
        assert!((1_500..1_620).contains(&parked), "{parked} codes park in {state:?}");
    }
}

/// At rest nothing moves at any code; a hold arms with a good one alone, and the frame says why not.
#[test]
fn every_code_at_rest_and_a_hold() {
    use SupervisorState::{Boot, Disarmed, Fault, TrimReady};
    for state in [Boot, Disarmed, Fault, TrimReady] {
        let joints = reach(&default_loop(), state);
        for code in CODES {
            let sample = |tick: u32, button| Sample { codes: [AdcCode(code)], button, ..good(tick) };
            let mut run = Run::of(&joints);
            for tick in 0..60 {
                assert!(!run.tick(&sample(tick, false)).moving(), "{code} in {state:?}");
            }
            let rested = run.joints.state();
            assert_eq!(rested, if state == Boot { Disarmed } else { state });
            for tick in 0..400 {
                assert_eq!(run.tick(&sample(tick, true)), rested, "{code}: the button is held");
            }
            for tick in 0..30 {
                run.tick(&sample(tick, false));
            }
            let (after, cause) = (run.joints.state(), run.joints.frame().cause);
            let held = match (rested, wanted(code)) {
                (Disarmed, None) => continue,
                (Disarmed, Some(Validity::Good)) => (SupervisorState::Arming, Cause::None),
                (Disarmed, Some(validity)) => (Disarmed, Cause::of_sensor(validity)),
                // The hold acknowledges; the first cause stays.
                (Fault, _) => (Disarmed, Cause::Clock),
                // A trim needs no sensor.
                _ => (SupervisorState::Trimming, Cause::None),
            };
            assert_eq!((after, cause), held, "{code} in {state:?}");
        }
    }
}

/// A stop ends at rest at any code, and a trim does what it does with a good sensor, to the bit.
#[test]
fn every_code_in_a_stop_and_in_a_trim() {
    let stopping = reach(&default_loop(), SupervisorState::Stopping);
    let trimming = reach(&default_loop(), SupervisorState::Trimming);
    for code in CODES {
        let mut run = Run::of(&stopping);
        let ended = leaves(&mut run, 1_100, |tick| Sample { codes: [AdcCode(code)], ..good(tick) });
        assert!(matches!(ended, Some((_, SupervisorState::Disarmed, _))), "{code}: {ended:?}");

        let [mut with_code, mut with_good] = [Run::of(&trimming), Run::of(&trimming)];
        for tick in 0..100 {
            with_code.tick(&Sample { codes: [AdcCode(code)], ..good(tick) });
            with_good.tick(&good(tick));
            let [a, b] = [&with_code, &with_good].map(|run| run.joints.frame());
            assert_eq!((a.state, a.cause, a.pulses, a.setpoints), (b.state, b.cause, b.pulses, b.setpoints), "{code}");
        }
    }
}

/// Every code of the chip's reference: below the least supply, above 3.6 V or without a reading the outputs go off in the 41st tick.
#[test]
fn every_code_of_the_reference() {
    const NEAR_V: f64 = 0.004;
    let least = f64::from(ReferenceConfig::stm32f4(VREFINT).min_supply.0);
    let walking = reach(&default_loop(), SupervisorState::Walking);
    let (mut off, mut walk) = (0, 0);
    for code in CODES {
        let supply = 3.3 * f64::from(VREFINT.0) / f64::from(code);
        if (supply - least).abs() < NEAR_V || (supply - 3.6).abs() < NEAR_V {
            continue;
        }
        let mut run = Run::of(&walking);
        let left = leaves(&mut run, 60, |tick| Sample { vrefint: AdcCode(code), ..good(tick) });
        if (least..3.6).contains(&supply) {
            assert_eq!(left, None, "{code}: {supply} V");
            walk += 1;
        } else {
            assert_eq!(left, Some((SUPPLY_TOLERATED + 1, SupervisorState::Fault, Cause::Supply)), "{code}: {supply} V");
            off += 1;
        }
    }
    assert!(off > 3_000 && walk > 200, "{off} off, {walk} walk");
}

/// Inputs that lead to each validity, or to several of them one after the other.
const KINDS: [(&str, u16, u16); 8] = [
    ("good", 1_800, 1_501),
    ("open", 3, 1_501),
    ("short", 4_090, 1_501),
    ("out of table below", 400, 1_501),
    ("out of table above", 3_500, 1_501),
    ("a jump to full flexion", 640, 1_501),
    ("a jump to extension", 3_080, 1_501),
    ("low supply", 1_800, 2_000),
];

/// Changes between all of them, for so long each: the tick of the reaction is that of a count that rises with each sample that is not good and falls
/// with each good one.
#[test]
fn every_change_of_validity_is_counted() {
    let (mut stops, mut faults) = (0, 0);
    for state in [SupervisorState::Arming, SupervisorState::Walking] {
        let joints = reach(&default_loop(), state);
        for (first, second) in KINDS.iter().flat_map(|first| KINDS.iter().map(move |second| (first, second))) {
            for (long, longer) in
                [1, 5, 19, 20, 25, 41, 48].into_iter().flat_map(|a| [1, 20, 40, 50, 60].map(|b| (a, b)))
            {
                let mut run = Run::of(&joints);
                let (mut bad, mut low) = (0_u32, 0_u32);
                for tick in 0..long + longer + 40 {
                    let (_, code, reference) = if tick < long {
                        *first
                    } else if tick < long + longer {
                        *second
                    } else {
                        KINDS[0]
                    };
                    let code = code + (tick & 1) as u16;
                    let sample = Sample { codes: [AdcCode(code)], vrefint: AdcCode(reference), ..good(tick) };
                    let after = run.tick(&sample);
                    let validity = run.joints.frame().validity[0];
                    let step = |count: u32, is_bad: bool| if is_bad { count + 1 } else { count.saturating_sub(1) };
                    (bad, low) = (step(bad, validity != Some(Validity::Good)), step(low, reference == 2_000));
                    let given = format!("{first:?} for {long}, {second:?} for {longer}, tick {tick}: {validity:?}");
                    if low > SUPPLY_TOLERATED {
                        assert_eq!(
                            (after, run.joints.frame().cause),
                            (SupervisorState::Fault, Cause::Supply),
                            "{given}"
                        );
                        faults += 1;
                        break;
                    }
                    if bad > TOLERATED {
                        assert_eq!(after, SupervisorState::Stopping, "{given}");
                        stops += 1;
                        break;
                    }
                    assert!([SupervisorState::Arming, SupervisorState::Walking].contains(&after), "{given}: {after:?}");
                }
            }
        }
    }
    assert!(stops > 500 && faults > 100, "{stops} stops, {faults} faults");
    assert_eq!(GOOD[0], AdcCode(KINDS[0].1));
}
