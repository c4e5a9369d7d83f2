//! One tick of the loop, from sample to command, in order.

use crate::control::button::{Button, Press};
use crate::control::monitor::{Monitor, MonitorState, Observation};
use crate::control::supervisor::{Actions, Cause, Demand, Inputs, Motion, SupervisorState, SupervisorStatus, next};
use crate::motion::blend::{Blend, Weight};
use crate::{BoardFaults, Command, Frame, Gate, GateState, GateStatus, MAX_ELAPSED, Sample, ServoMap, SetpointHash};
use cpg_core::{Follow, Generator};
use hgod_adc::{Sensor, SensorState, Validity};
use joint_units::{Joint, PulseMicros, Radians};

/// The stages of the loop, each checked for one period: the configuration, which no tick changes.
#[derive(Debug, Clone)]
pub(crate) struct Stages<const S: usize> {
    pub(crate) gate: Gate,
    pub(crate) servos: [ServoMap; Joint::COUNT],
    pub(crate) blend: Blend,
    pub(crate) monitor: Monitor,
    pub(crate) button: Button,
    /// `None` where no sensor is worn.
    pub(crate) sensors: [Option<Sensor>; S],
    /// Channel that the generator listens to.
    pub(crate) gait_sensor: usize,
}

/// The loop: configuration and state of everything between the sample and the command. [`crate::LoopConfig::build`] makes it.
#[derive(Debug, Clone)]
pub struct JointLoop<G: Generator<{ Joint::COUNT }> + Follow, const S: usize> {
    stages: Stages<S>,
    generator: G,
    /// The generator's angles when it last passed its check.
    wanted: [Radians; Joint::COUNT],
    /// The generator passes its check.
    sound: bool,
    /// The foot was on the floor.
    foot: bool,
    listening: [SensorState; S],
    press: Press,
    monitor_state: MonitorState,
    status: SupervisorStatus,
    weight: Weight,
    gating: GateState,
    parked: GateState,
    frame: Frame<S>,
}

impl<G: Generator<{ Joint::COUNT }> + Follow, const S: usize> JointLoop<G, S> {
    /// One tick: takes one sample set, gives one command. See the module for what comes in which order, and why.
    pub fn tick(&mut self, sample: &Sample<S>) -> Command {
        // Sample. The tick is numbered; periods that were missed are counted and dropped.
        let elapsed = self.count(sample);
        let press = self.stages.button.sample(&mut self.press, sample.button);

        // Measure.
        let sensors = self.measure(sample, elapsed);

        // Supervise, before anything moves: a fault of this sample switches off in this tick.
        let seen = self.seen(sample, elapsed, sensors);
        let demand = self.stages.monitor.judge(&mut self.monitor_state, &seen);
        let inputs = Inputs { press, settled: self.settled(), demand };
        let (mut status, mut actions) = next(self.status, inputs);

        // Generate: one step a call, in every state, so that each tick costs the same and missed ones are not run after.
        self.generate(sample, status.state);

        // Blend.
        self.weight = self.stages.blend.advance(self.weight, actions.motion);
        let target = self.stages.blend.target(self.weight, self.wanted);

        // Gate: the only way from an angle to a pulse. What is not finite is a fault in this tick.
        let pulses = self.pass(target, actions);
        if actions.outputs && pulses.is_none() {
            (status, actions) = next(status, Inputs { demand: Demand::Fault(Cause::NonFinite), ..inputs });
        }

        // Command.
        let command = if actions.outputs { Command { pulses } } else { Command::OFF };

        // Frame.
        self.status = status;
        self.record(command);
        command
    }

    /// What the last tick saw and did.
    #[must_use]
    pub fn frame(&self) -> Frame<S> {
        self.frame
    }

    /// SupervisorState of the supervisor after the last tick.
    #[must_use]
    pub fn state(&self) -> SupervisorState {
        self.status.state
    }

    /// The generator, to look at.
    #[must_use]
    pub fn generator(&self) -> &G {
        &self.generator
    }

    pub(crate) fn new(stages: Stages<S>, generator: G, parked: GateState) -> Self {
        let park = stages.blend.park();
        let following = generator.follow_status();
        Self {
            wanted: generator.angles(),
            sound: true,
            // Standing on it while the board boots is no strike.
            foot: true,
            generator,
            listening: [SensorState::default(); S],
            press: Press::default(),
            monitor_state: MonitorState::default(),
            status: SupervisorStatus::default(),
            weight: Weight::default(),
            gating: parked,
            parked,
            frame: Frame {
                seq: 0,
                tick: 0,
                state: SupervisorState::Boot,
                cause: Cause::None,
                measured: [Radians(0.0); S],
                validity: [None; S],
                following,
                setpoints: park,
                pulses: [PulseMicros(0); Joint::COUNT],
                late: 0,
                missed: 0,
                overruns: 0,
                limited: GateStatus::NONE,
                limited_ticks: 0,
                setpoint_hash: SetpointHash::EMPTY.value(),
            },
            stages,
        }
    }

    /// Counts what the sample says about time; gives the control periods since the last call.
    fn count(&mut self, sample: &Sample<S>) -> u32 {
        let elapsed = sample.elapsed.clamp(1, MAX_ELAPSED);
        let frame = &mut self.frame;
        frame.seq = frame.seq.wrapping_add(1);
        frame.tick = frame.tick.wrapping_add(elapsed);
        frame.missed = frame.missed.wrapping_add(elapsed - 1);
        frame.late = frame.late.wrapping_add(u32::from(sample.late));
        let overrun = sample.faults.contains(BoardFaults::ADC_OVERRUN);
        frame.overruns = frame.overruns.wrapping_add(u32::from(overrun));
        elapsed
    }

    /// Codes to angles; the gravest verdict of the worn sensors.
    fn measure(&mut self, sample: &Sample<S>, elapsed: u32) -> Validity {
        let mut gravest = Validity::Good;
        let channels = self.stages.sensors.iter().zip(&mut self.listening).zip(sample.codes);
        let seen = self.frame.measured.iter_mut().zip(&mut self.frame.validity);
        for (((sensor, state), code), (angle, verdict)) in channels.zip(seen) {
            let Some(sensor) = sensor else { continue };
            state.missed(elapsed - 1);
            let reading = sensor.sample(state, code, sample.vrefint);
            (*angle, *verdict) = (reading.angle, Some(reading.validity));
            gravest = gravest.worse(reading.validity);
        }
        gravest
    }

    fn seen(&self, sample: &Sample<S>, elapsed: u32, sensors: Validity) -> Observation {
        Observation {
            moving: self.status.state.moving(),
            elapsed,
            faults: sample.faults,
            sensors,
            generator_sound: self.sound,
            pose_limited: self.frame.limited.contains(GateStatus::POSE),
        }
    }

    /// Whether the ramp that belongs to the state has ended.
    fn settled(&self) -> bool {
        let blend = &self.stages.blend;
        match self.status.state {
            SupervisorState::Arming => blend.risen(self.weight),
            // The gate may be a few ticks behind the target; when it does not get there at all, the stop ends anyhow.
            SupervisorState::Stopping => {
                blend.overdue(self.weight) || (blend.stopped(self.weight) && self.gating == self.parked)
            }
            _ => false,
        }
    }

    /// One step of the generator. Angles that do not pass its check are never used: a moving joint ramps down from the last
    /// ones that did. At rest a generator that does not pass starts afresh.
    fn generate(&mut self, sample: &Sample<S>, state: SupervisorState) {
        // Only a good sample pulls.
        let gait = self.stages.gait_sensor;
        let good = self.frame.validity.get(gait) == Some(&Some(Validity::Good));
        self.generator.observe(self.frame.measured.get(gait).copied().filter(|_| good));
        if sample.foot && !self.foot {
            self.generator.heel_strike();
        }
        self.foot = sample.foot;
        if self.sound {
            self.generator.step();
        } else if !state.moving() {
            self.generator.reset();
        }
        self.sound = self.generator.check().is_ok();
        if self.sound {
            self.wanted = self.generator.angles();
        }
    }

    /// Setpoints and pulses for a target; `None` where there is nothing to command.
    fn pass(&mut self, target: [Radians; Joint::COUNT], actions: Actions) -> Option<[PulseMicros; Joint::COUNT]> {
        self.frame.limited = GateStatus::NONE;
        match actions.motion {
            Motion::Freeze => return None,
            Motion::Rest => {
                self.gating = self.parked;
                self.frame.setpoints = self.stages.blend.park();
                return None;
            }
            Motion::Rise | Motion::Run | Motion::Stop | Motion::Hurry => {}
        }
        let (setpoints, limited) = self.stages.gate.limit(&mut self.gating, target).ok()?;
        let mut pulses = [PulseMicros(0); Joint::COUNT];
        for ((pulse, servo), angle) in pulses.iter_mut().zip(&self.stages.servos).zip(setpoints) {
            *pulse = servo.pulse(angle)?;
        }
        self.frame.setpoints = setpoints;
        self.frame.limited = limited;
        self.frame.limited_ticks = self.frame.limited_ticks.wrapping_add(u32::from(limited.any()));
        Some(pulses)
    }

    /// Completes the frame of this tick.
    fn record(&mut self, command: Command) {
        let frame = &mut self.frame;
        (frame.state, frame.cause) = (self.status.state, self.status.cause);
        frame.following = self.generator.follow_status();
        frame.pulses = command.pulses.unwrap_or_default();
        let hash = SetpointHash::resumed(frame.setpoint_hash);
        frame.setpoint_hash = hash.then(frame.tick, frame.state, &frame.setpoints).value();
    }
}

#[cfg(test)]
mod tests;
