//! The loop of a board with any inputs: outputs only in the moving states, every pulse inside its servo's, every setpoint of a walk inside the
//! robot's limits, a trim slow, and the same inputs give the same bits.
//!
//! The bytes are read as commands: gestures that a person needs many ticks for, and single ticks with any codes, faults and requests. So a
//! fuzzer reaches the walk, which random ticks do not.

use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
use joint_loop::tuning::{Action, Parameter, Request};
use joint_loop::{BoardFaults, RobotConfig, SENSORS, Sample, SupervisorState};
use joint_units::{AdcCode, Joint, Period, PulseMicros, Volts};
use wire::{Call, Inputs};

use crate::motion_limits::MotionLimits;

/// Most ticks of a run.
const MOST_TICKS: u32 = 6_000;
/// The codes of the chip's reference and of a sensor in the middle of its table, at a supply of 3.0 V.
const REFERENCE: AdcCode = AdcCode(1651);
const MIDDLE: u16 = 2048;

/// The loop, and what it is compared with.
struct Run {
    joints: BoardLoop,
    /// The same loop, given what the wire carries of each sample.
    replay: BoardLoop,
    limits: MotionLimits,
    robot: RobotConfig,
    ticks: u32,
    /// The pulses of the last tick, if that was one of a trim.
    trimmed: Option<[PulseMicros; Joint::COUNT]>,
}

impl Run {
    fn new() -> Self {
        let robot = RobotConfig::default_biped();
        let parameters = Parameters::with_defaults(None, None, robot).expect("the defaults");
        let joints = board_loop(&parameters, AdcCode(1501), Volts(2.7), true).expect("the default loop");
        Self {
            replay: joints.clone(),
            joints,
            limits: MotionLimits::new(robot.gate, Period::MILLISECOND),
            robot,
            ticks: 0,
            trimmed: None,
        }
    }

    /// A sample without anything special; its code changes with each tick, because a constant one is a fault.
    fn good(&self) -> Sample<SENSORS> {
        let code = AdcCode(MIDDLE + (self.ticks & 1) as u16);
        Sample { codes: [code; SENSORS], vrefint: REFERENCE, ..Sample::default() }
    }

    fn tick(&mut self, sample: &Sample<SENSORS>) {
        if self.ticks >= MOST_TICKS {
            return;
        }
        self.ticks += 1;
        let command = self.joints.tick(sample);
        let frame = self.joints.frame();
        assert_eq!(command.pulses.is_some(), frame.state.moving(), "{:?}", frame.state);
        if let Some(pulses) = command.pulses {
            for (pulse, servo) in pulses.iter().zip(&self.robot.servos) {
                assert!(*pulse >= servo.shortest && *pulse <= servo.longest, "{pulse:?} of {servo:?}");
            }
        }
        // A trim finds the map of a servo: it goes beyond the range of the joint, slowly.
        let is_trim = frame.state == SupervisorState::Trimming;
        let trimmed = command.pulses.filter(|_| is_trim);
        for (now, before) in trimmed.iter().flatten().zip(self.trimmed.iter().flatten()) {
            assert!(now.0.abs_diff(before.0) <= 1, "a trim moves a servo from {before:?} to {now:?} in a tick");
        }
        self.trimmed = trimmed;
        if command.pulses.is_some() && !is_trim {
            self.limits.check(&frame.setpoints);
        } else {
            self.limits.interrupt();
        }
        // What a host replays is what the wire carries.
        let inputs = Inputs { first_tick: 0, calls: [Call::of(sample, SENSORS)].into_iter().collect() };
        for (_, call) in inputs.ticks() {
            self.replay.tick(&call.sample());
        }
        let replayed = self.replay.frame();
        assert_eq!((replayed.state, replayed.cause, replayed.seq), (frame.state, frame.cause, frame.seq));
        assert_eq!(replayed.setpoint_hash, frame.setpoint_hash, "the replay has other setpoints");
    }

    /// Ticks with the button or the emergency stop pressed.
    fn pressed(&mut self, ticks: u32, button: bool, stop: bool) {
        for _ in 0..ticks {
            let faults = if stop { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE };
            let sample = Sample { button, faults, ..self.good() };
            self.tick(&sample);
        }
    }

    /// One command: its first byte says which.
    fn command(&mut self, bytes: &[u8; 6]) {
        let [what, a, b, c, d, e] = *bytes;
        let wide = u16::from_le_bytes([a, b]);
        match what % 8 {
            // Time passes.
            0 => self.pressed(u32::from(wide % 1_000), false, false),
            // A press or a hold of the button, and its release.
            1 => {
                self.pressed(u32::from(wide % 1_800), true, false);
                self.pressed(30, false, false);
            }
            // The test of the emergency stop, or a press of it.
            2 => {
                self.pressed(30, false, false);
                self.pressed(u32::from(a), false, true);
                self.pressed(30, false, false);
            }
            // A tick with any codes, as often as the last byte says.
            3 => {
                for _ in 0..=u32::from(e) {
                    let codes = [AdcCode(wide); SENSORS];
                    let sample = Sample { codes, vrefint: AdcCode(u16::from_le_bytes([c, d])), ..self.good() };
                    self.tick(&sample);
                }
            }
            // A tick with any faults and levels.
            4 => {
                let levels = Sample { button: b & 1 != 0, foot: b & 2 != 0, late: b & 4 != 0, ..self.good() };
                self.tick(&Sample { faults: BoardFaults::from_bits(a), elapsed: u32::from(c), ..levels });
            }
            // A request.
            _ => {
                let request = Some(Request { number: u16::from(what), action: action(what, a, [b, c, d, e]) });
                let sample = Sample { request, ..self.good() };
                self.tick(&sample);
            }
        }
    }
}

fn action(what: u8, choice: u8, value: [u8; 4]) -> Action {
    let joint = Joint::ALL[usize::from(choice) % Joint::COUNT];
    match what / 8 % 6 {
        0 => Action::Stop,
        1 => Action::Undo,
        2 => Action::Trim { joint },
        3 => Action::Jog { pulse: PulseMicros(u16::from_le_bytes([value[0], value[1]])) },
        _ => {
            let parameter = Parameter::ALL[usize::from(choice) % Parameter::COUNT];
            // Half of the values are allowed ones.
            let [least, most, _] = parameter.range();
            let thousandths = i32::from_le_bytes(value);
            let span = most - least + 1;
            let thousandths = if what & 0x80 == 0 { least + thousandths.rem_euclid(span) } else { thousandths };
            Action::Set { parameter, thousandths }
        }
    }
}

/// Runs the commands in the bytes.
pub fn check(bytes: &[u8]) {
    let mut run = Run::new();
    for command in bytes.as_chunks::<6>().0 {
        run.command(command);
    }
    assert_ne!((run.ticks > 0, run.joints.state()), (true, SupervisorState::Boot));
}
