//! One tick of the loop: calls every stage in order, from sample to command.

use crate::control::button::{Button, Press};
use crate::control::kept_status::KeptStatus;
use crate::control::monitor::{Monitor, MonitorState, Observation};
use crate::control::supervisor::{Actions, Cause, Demand, Inputs, Motion, SupervisorState, SupervisorStatus, next};
use crate::control::supply::{Supply, SupplyState};
use crate::control::trim::{Trim, Trimmer};
use crate::control::watchdog_clock::{WatchdogClockState, WatchdogHz};
use crate::io::board::{BoardFaults, Command, MAX_ELAPSED, Sample};
use crate::io::conditions::{Conditions, SensorCounts};
use crate::io::frame::{Frame, SetpointHash};
use crate::motion::blend::{Blend, Weight};
use crate::motion::feedback::{Feedback, FeedbackState};
use crate::motion::gate::{Gate, GateState, GateStatus};
use crate::motion::servo::ServoMap;
use crate::motion::start::{Start, StartState, Way, found};
use crate::tuning::{Action, Answer, Outcome, Robot, Settings, Source, Tuner};
use cpg_core::entrainment::Lock;
use cpg_core::{Follow, Generator};
use hgod_adc::{Sensor, SensorState, Validity};
use joint_units::{Joint, Period, PulseMicros, Radians};

/// The stages of the loop, checked for one period. No tick changes them.
#[derive(Debug, Clone)]
pub(crate) struct Stages<const S: usize> {
    pub(crate) gate: Gate,
    pub(crate) servos: [ServoMap; Joint::COUNT],
    pub(crate) blend: Blend,
    pub(crate) start: Start,
    pub(crate) trimmer: Trimmer,
    pub(crate) monitor: Monitor,
    /// `None` where the loop does not know the internal reference.
    pub(crate) supply: Option<Supply>,
    pub(crate) button: Button,
    /// `None` for a channel without a sensor.
    pub(crate) sensors: [Option<Sensor>; S],
    /// Channel whose angle the generator gets.
    pub(crate) gait_sensor: usize,
    /// `None` where no joint has feedback.
    pub(crate) feedback: Option<Feedback>,
}

/// The loop: configuration and state of all stages. Made by [`crate::LoopConfig::build`].
#[derive(Debug, Clone)]
pub struct JointLoop<G: Generator<{ Joint::COUNT }> + Follow, const S: usize> {
    stages: Stages<S>,
    generator: G,
    source: Source,
    tuner: Tuner,
    /// The generator's angles in the last tick in which it passed its check.
    wanted: [Radians; Joint::COUNT],
    /// The generator passes its check.
    sound: bool,
    /// Level of the foot switch in the last tick.
    foot: bool,
    sensor_states: [SensorState; S],
    sensor_counts: [SensorCounts; S],
    press: Press,
    monitor_state: MonitorState,
    supply_state: SupplyState,
    watchdog_clock: WatchdogClockState,
    status: KeptStatus,
    weight: Weight,
    feedback: FeedbackState,
    /// State of the gate: at the last pulses while they are known, also at rest, or at the allowed pose next to them; else at the park pose.
    gating: GateState,
    started: StartState,
    /// From the last pulses to `gating`, if they are known and the gate does not allow their pose.
    way: Option<Way>,
    parked: GateState,
    /// The servo that a hold of the button trims, or that is trimmed; the last one after a trim.
    trim: Option<Trim>,
    /// Of the last tick, without the status of a follower, which [`JointLoop::frame`] adds.
    frame: Frame<S>,
}

/// Request of a host to the supervisor in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    Nothing,
    Stop,
    Trim,
}

impl<G: Generator<{ Joint::COUNT }> + Follow, const S: usize> JointLoop<G, S> {
    /// Takes the sample of one tick and returns its command.
    ///
    /// The order is: count, button, measure, monitor and supervise, generate, blend, feedback, gate, servo map, frame.
    pub fn tick(&mut self, sample: &Sample<S>) -> Command {
        // Count. Missed periods are counted and dropped.
        let elapsed = self.count(sample);
        // A word in memory that is no state is a fault, and switches the outputs off in this tick.
        let before = self.status.read();
        let button = self.stages.button.sample(&mut self.press, sample.button, elapsed);
        if sample.faults.contains(BoardFaults::BREAK_INPUT) {
            self.press.stop();
        }

        // Measure.
        let sensors = self.measure(sample, elapsed);

        // Supervise before any motion, so that a fault in this sample switches the outputs off in this tick.
        let seen = self.seen(sample, elapsed, sensors, before.state);
        let demand = self.stages.monitor.judge(&mut self.monitor_state, &seen);
        let asked = self.asked(sample, before.state);
        let demand = self.demand(demand, asked, before.state);
        let inputs = Inputs { button, settled: self.settled(before.state), demand, trim: asked == Asked::Trim };
        let (mut status, mut actions) = next(before, inputs);

        // Generate: one step per call in every state, so that each tick has the same cost. Missed steps are not made up.
        self.generate(sample, status.state);

        // Blend.
        let at_park = !self.weight.is_at_start() || self.is_parked();
        self.weight = self.stages.blend.advance_from(self.weight, actions.motion, at_park);

        // Feedback.
        let mut target = self.target();
        self.add_feedback(elapsed, &mut target);

        // Gate: every pulse comes from a limited angle. An angle that is not finite is a fault in this tick.
        let pulses = self.pass(target, actions, before.state != SupervisorState::Trimming);
        if actions.outputs && pulses.is_none() {
            (status, actions) = next(status, Inputs { demand: Demand::Fault(Cause::NonFinite), ..inputs });
        }

        // Command.
        let command = if actions.outputs { Command { pulses } } else { Command::OFF };

        // The button: a press acts on one state.
        if status.state != before.state {
            self.press.spend();
        }

        // Where the pulses are, or ended.
        self.stages.start.note(&mut self.started, command.pulses.is_some(), elapsed);

        // Frame.
        self.status = KeptStatus::of(status);
        self.record(status, command);
        command
    }

    /// Frame of the last tick.
    #[must_use]
    pub fn frame(&self) -> Frame<S> {
        Frame { following: self.generator.follow_status(), ..self.frame }
    }

    /// Number of the last control period: [`Frame::tick`].
    #[must_use]
    pub const fn tick_number(&self) -> u32 {
        self.frame.tick
    }

    /// Why the last motion ended or arming was refused: [`Frame::cause`].
    #[must_use]
    pub const fn cause(&self) -> Cause {
        self.frame.cause
    }

    /// Fault counters since the boot.
    #[must_use]
    pub fn conditions(&self) -> Conditions<S> {
        Conditions { tick: self.frame.tick, supply_dips: self.supply_state.dips, sensors: self.sensor_counts }
    }

    /// State of the supervisor after the last tick.
    #[must_use]
    pub fn state(&self) -> SupervisorState {
        self.status.read().state
    }

    /// Whether the emergency stop has to be pressed and released before the first arming.
    #[must_use]
    pub fn awaits_stop_test(&self) -> bool {
        self.stages.monitor.awaits_stop_test(&self.monitor_state)
    }

    /// The measured clock of the watchdog if it is not allowed: until another measurement the board does not arm.
    #[must_use]
    pub fn wrong_watchdog_clock(&self) -> Option<WatchdogHz> {
        self.watchdog_clock.wrong()
    }

    /// Takes the last pulses of the run before the reset, before the first tick: a motion within [`crate::motion::start::KNOWN_S`] starts from them.
    /// Returns false, and a motion starts at the park pose, if a pulse is outside its servo's range.
    pub fn start_from(&mut self, pulses: [PulseMicros; Joint::COUNT]) -> bool {
        let is_known = self.stand_at(pulses);
        if is_known {
            self.started = StartState::ENDED;
        }
        is_known
    }

    /// Whether the last pulses are known, so that an arming starts from them.
    #[must_use]
    pub fn knows_last_pulses(&self) -> bool {
        self.started.is_known()
    }

    /// The generator.
    #[must_use]
    pub fn generator(&self) -> &G {
        &self.generator
    }

    /// The settings in effect after the last tick.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        self.tuner.settings()
    }

    /// Answers of the last tick to requests: at most one to the request of its sample, and then one to settings that took effect.
    pub fn answers(&self) -> impl Iterator<Item = Answer> + use<G, S> {
        self.tuner.answers()
    }

    pub(crate) fn new(stages: Stages<S>, generator: G, parked: GateState, period: Period) -> Self {
        let park = stages.blend.park();
        Self {
            wanted: generator.angles(),
            sound: true,
            // A foot on the floor at boot is no heel strike.
            foot: true,
            source: Source::new(&generator),
            tuner: Tuner::new(Robot { period, park }),
            generator,
            sensor_states: [SensorState::default(); S],
            sensor_counts: [SensorCounts::NONE; S],
            press: Press::default(),
            monitor_state: MonitorState::default(),
            supply_state: SupplyState::default(),
            watchdog_clock: WatchdogClockState::default(),
            status: KeptStatus::of(SupervisorStatus::default()),
            weight: Weight::default(),
            feedback: FeedbackState::NONE,
            gating: parked,
            started: StartState::UNKNOWN,
            way: None,
            parked,
            trim: None,
            frame: Frame {
                seq: 0,
                tick: 0,
                state: SupervisorState::Boot,
                cause: Cause::None,
                measured: [Radians(0.0); S],
                validity: [None; S],
                following: None,
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

    /// Updates the counters of the frame; returns the control periods since the last call.
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

    /// Converts codes to angles; returns the worst validity of all sensors.
    fn measure(&mut self, sample: &Sample<S>, elapsed: u32) -> Validity {
        let mut worst = Validity::Good;
        let frame = &mut self.frame;
        let kept = self.sensor_states.iter_mut().zip(&mut self.sensor_counts);
        let readings = frame.measured.iter_mut().zip(&mut frame.validity);
        let channels = self.stages.sensors.iter().zip(sample.codes).zip(kept.zip(readings));
        for ((sensor, code), ((state, counts), (angle, validity))) in channels {
            let Some(sensor) = sensor else { continue };
            state.missed(elapsed - 1);
            let reading = sensor.sample(state, code, sample.vrefint);
            counts.note(*validity, reading.validity, elapsed);
            (*angle, *validity) = (reading.angle, Some(reading.validity));
            worst = worst.worse(reading.validity);
        }
        worst
    }

    /// Takes and answers the request of a tick; returns its part for the supervisor.
    fn asked(&mut self, sample: &Sample<S>, state: SupervisorState) -> Asked {
        self.tuner.begin();
        let Some(request) = sample.request else { return Asked::Nothing };
        let outcome = match request.action {
            Action::Trim { .. } | Action::Jog { .. } => self.stages.trimmer.take(&mut self.trim, state, request.action),
            _ => self.tuner.take(request, self.generator.follow_status().is_some()),
        };
        self.tuner.answer(Answer { tick: self.frame.tick, number: request.number, outcome });
        match request.action {
            Action::Stop => Asked::Stop,
            Action::Trim { .. } if outcome == Outcome::Staged => Asked::Trim,
            _ => Asked::Nothing,
        }
    }

    /// Demand of the monitor and of the host on the supervisor.
    fn demand(&self, seen: Demand, asked: Asked, state: SupervisorState) -> Demand {
        let seen = if state.is_trim() { seen.in_trim() } else { seen };
        let is_silent = || self.trim.is_some_and(|trim| self.stages.trimmer.is_silent(&trim));
        match seen {
            Demand::Go if asked == Asked::Stop => Demand::Stop(Cause::Request),
            // It is the only way out of this state, whatever else the monitor demands.
            Demand::Stop(_) if asked == Asked::Stop && state == SupervisorState::TrimReady => {
                Demand::Stop(Cause::Request)
            }
            Demand::Go if state == SupervisorState::Trimming && is_silent() => Demand::Stop(Cause::HostSilent),
            seen => seen,
        }
    }

    /// Inputs of the monitor.
    fn seen(&mut self, sample: &Sample<S>, elapsed: u32, sensors: Validity, state: SupervisorState) -> Observation {
        let moving = state.moving();
        let supply = self
            .stages
            .supply
            .map_or(Demand::Go, |supply| supply.judge(&mut self.supply_state, sample.vrefint, elapsed, moving));
        let required = self.stages.monitor.requires_watchdog_clock();
        Observation {
            moving,
            elapsed,
            late: sample.late,
            supply,
            watchdog_clock: self.watchdog_clock.judge(sample.watchdog_clock, required),
            debugger: sample.debugger,
            program_unproven: sample.program_unproven,
            faults: sample.faults,
            sensors,
            generator_sound: self.sound,
            // On the way to the park pose the joints may meet the envelope, which the generator does not.
            pose_limited: self.frame.limited.contains(GateStatus::POSE) && !self.weight.is_at_start(),
            person_stands: self
                .generator
                .follow_status()
                .is_some_and(|status| matches!(status.state, Lock::Stopped | Lock::Seeking)),
        }
    }

    /// Whether the ramp of the present state has ended.
    fn settled(&self, state: SupervisorState) -> bool {
        let blend = &self.stages.blend;
        match state {
            SupervisorState::Arming => blend.risen(self.weight),
            // The gate may be a few ticks behind the target. If it does not reach the target, the stop ends when overdue.
            SupervisorState::Stopping => blend.overdue(self.weight) || (blend.stopped(self.weight) && self.is_parked()),
            _ => false,
        }
    }

    /// Steps the generator. Its angles are used only if it passes its check; otherwise a moving joint stops from the last
    /// checked angles. At rest a generator that fails its check is reset.
    fn generate(&mut self, sample: &Sample<S>, state: SupervisorState) {
        // A follower gets good samples only.
        let gait = self.stages.gait_sensor;
        let good = self.frame.validity.get(gait) == Some(&Some(Validity::Good));
        let measured =
            if good && self.tuner.settings().follow() { self.frame.measured.get(gait).copied() } else { None };
        self.generator.observe(measured);
        if sample.foot && !self.foot {
            self.generator.heel_strike();
        }
        self.foot = sample.foot;
        self.sound = if self.sound {
            let follows = self.generator.follow_status().is_some();
            self.tuner.step(&mut self.source, &mut self.generator, follows, self.frame.tick, state.moving())
        } else {
            if !state.moving() {
                self.source.reset(&mut self.generator);
            }
            self.source.check(&self.generator).is_ok()
        };
        if self.sound {
            self.wanted = self.tuner.angles(&self.source, &self.generator);
        }
    }

    /// Whether the pulses are in the park pose.
    fn is_parked(&self) -> bool {
        self.gating == self.parked && self.way.is_none()
    }

    /// The gate stands with these pulses; false, and nothing changes, if a pulse is outside its servo's range.
    fn stand_at(&mut self, pulses: [PulseMicros; Joint::COUNT]) -> bool {
        let found = found(&self.stages.gate, &self.stages.servos, &self.parked, pulses);
        if let Some((gating, way)) = found {
            (self.gating, self.way) = (gating, way);
        }
        found.is_some()
    }

    /// The pulses with which the gate stands; `None` only where its state is not finite, which it never is.
    fn standing(&self) -> Option<[PulseMicros; Joint::COUNT]> {
        match self.way {
            Some(way) => Some(way.at),
            None if self.gating == self.parked => Some(self.stages.trimmer.parked()),
            None => ServoMap::pulses(&self.stages.servos, self.stages.gate.pose(&self.gating)),
        }
    }

    /// The pose that this tick aims at: while the last pulses are held, theirs.
    fn target(&self) -> [Radians; Joint::COUNT] {
        let is_elsewhere = self.weight.is_at_start() && !self.is_parked();
        if is_elsewhere && !self.stages.start.has_begun(self.started) {
            self.stages.gate.pose(&self.gating)
        } else {
            self.stages.blend.target(self.weight, self.wanted)
        }
    }

    /// Adds the feedback of the joints' angles, by the weight of the ramps: nothing at the park pose, where they begin and end.
    fn add_feedback(&mut self, elapsed: u32, target: &mut [Radians; Joint::COUNT]) {
        let Some(feedback) = &self.stages.feedback else { return };
        let frame = &self.frame;
        let measured = |channel: usize| {
            let is_good = frame.validity.get(channel) == Some(&Some(Validity::Good));
            frame.measured.get(channel).copied().filter(|_| is_good)
        };
        let added = feedback.step(&mut self.feedback, frame.tick, elapsed, frame.setpoints, measured);
        let weight = self.stages.blend.weight(self.weight);
        for (angle, added) in target.iter_mut().zip(added) {
            // Also a zero keeps its sign.
            if added.0 != 0.0 {
                angle.0 += weight * added.0;
            }
        }
    }

    /// Computes setpoints and pulses for a target; `None` if the outputs stay off or an angle is not finite.
    fn pass(
        &mut self,
        target: [Radians; Joint::COUNT],
        actions: Actions,
        begins_trim: bool,
    ) -> Option<[PulseMicros; Joint::COUNT]> {
        self.frame.limited = GateStatus::NONE;
        match actions.motion {
            Motion::Freeze => return None,
            Motion::Trim => return self.trim(begins_trim),
            Motion::Rest => {
                (self.gating, self.way) =
                    if self.started.is_known() { (self.gating.at_rest(), self.way) } else { (self.parked, None) };
                self.frame.setpoints = self.stages.blend.park();
                return None;
            }
            Motion::Rise | Motion::Run | Motion::Stop | Motion::Hurry => {}
        }
        if let Some(way) = self.way {
            return self.go(way);
        }
        let (setpoints, limited) = self.stages.gate.limit(&mut self.gating, target).ok()?;
        let pulses = ServoMap::pulses(&self.stages.servos, setpoints)?;
        self.frame.setpoints = setpoints;
        self.frame.limited = limited;
        self.frame.limited_ticks = self.frame.limited_ticks.wrapping_add(u32::from(limited.any()));
        Some(pulses)
    }

    /// Pulses of a way: held for as long as the pulses of an allowed pose, then on to the pose of the gate.
    fn go(&mut self, mut way: Way) -> Option<[PulseMicros; Joint::COUNT]> {
        let start = self.stages.start;
        let goal = ServoMap::pulses(&self.stages.servos, self.stages.gate.pose(&self.gating))?;
        let is_there = start.has_begun(self.started) && way.step(start, goal);
        self.way = Some(way).filter(|_| !is_there);
        for ((setpoint, servo), pulse) in self.frame.setpoints.iter_mut().zip(&self.stages.servos).zip(way.at) {
            *setpoint = servo.angle(pulse);
        }
        Some(way.at)
    }

    /// Pulses of a trim: one servo as the trim has it, the others in the park pose, or on their way there.
    fn trim(&mut self, begins: bool) -> Option<[PulseMicros; Joint::COUNT]> {
        let mut trim = self.trim?;
        if begins {
            trim = self.stages.trimmer.begin(trim.joint(), self.standing()?);
        }
        let (pulses, joint, angle) = self.stages.trimmer.step(&mut trim);
        self.trim = Some(trim);
        // The map of a servo allows its pulses, so this does not fail.
        let _ = self.stand_at(pulses);
        self.frame.setpoints = self.stages.blend.park();
        if let Some(setpoint) = self.frame.setpoints.get_mut(joint as usize) {
            *setpoint = angle;
        }
        Some(pulses)
    }

    /// Completes the frame of this tick.
    fn record(&mut self, status: SupervisorStatus, command: Command) {
        let frame = &mut self.frame;
        (frame.state, frame.cause) = (status.state, status.cause);
        frame.pulses = command.pulses.unwrap_or_default();
        let hash = SetpointHash::resumed(frame.setpoint_hash);
        frame.setpoint_hash = hash.then(frame.tick, frame.state, &frame.setpoints).value();
    }
}

#[cfg(test)]
mod tests;
