//! A generator of four joints whose phase follows the phase of a person, measured by one joint sensor.

use core::f32::consts::TAU;

use joint_units::{Joint, Period, Phase, RadPerSec, RadPerSec2, Radians};

use super::bounded_phase::{BoundedNumber, BoundedPhase};
use super::config::{FollowStatus, FollowerConfig, Lock};
use super::correction::{self, Corrected, Corrections, Inputs};
use super::drift::{self, Drift};
use super::events::{Events, Role};
use super::history::History;
use super::plausibility::{Plausibility, PlausibilityCheck, SensorFault};
use super::stop_detector::{Activity, Innovation};
use crate::entrainment::phase_lock::{PhaseLock, TEMPLATE_HARMONICS, Template};
use crate::error::allow_period;
use crate::math::braking::Braking;
use crate::math::finite::all_finite;
use crate::waveform::shape::{Harmonics, Shape};
use crate::{BuildError, Field, Follow, Generator, StateFault};

/// Four joints that follow a person.
///
/// Built by [`FollowerConfig::build`]. In each tick call [`Follow::observe`] with the measured angle, then [`Generator::step`], then read
/// [`Generator::angles`]. The [module](crate::entrainment) has an example and the states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    config: FollowerConfig,
    templates: [Template; 4],
    corrections: Corrections,
    /// There are corrections.
    corrects: bool,
    /// The measured joint.
    sensor: Joint,
    lock: PhaseLock,
    period: Period,
    /// Largest rate of the driven phase, rad/s.
    fastest: f32,
    /// Measured angle for the next step; `None` if it is not valid or was not given.
    sensed: Option<Radians>,
    state: FollowerState,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct FollowerState {
    plausibility: PlausibilityCheck,
    activity: Activity,
    innovation: Innovation,
    history: History,
    lock: Lock,
    fault: Option<SensorFault>,
    /// Time since `lock` was entered, s.
    time: f32,
    /// Time for which the condition of the next state has held without interruption, s. The condition is: in `Seeking` a small phase error, in
    /// `Locked` a large one, in `Holding` good samples.
    waited: f32,
    /// Time for which the relative amplitude has been beyond its limits, s.
    beyond: f32,
    /// Target of the amplitude: 1 (walking) if true, 0 (standing) if false.
    walk: bool,
    /// The measured joint lags behind its prediction: the driven phase halts until the joint moves on.
    waits: bool,
    /// The state before `Stopped` was `Locked`.
    paused: bool,
    /// Phase that drives the joints.
    driven: BoundedPhase,
    /// Amplitude s of the joints, 0 to 1.
    amplitude: BoundedNumber,
    drift: Drift,
    inputs: Inputs,
    corrected: Corrected,
    events: Events,
}

impl FollowerConfig {
    /// Validates the configuration and builds a follower in the state [`Lock::Stopped`] with the amplitude 0: the joints are at
    /// [`FollowerConfig::stand`] until the person walks.
    ///
    /// `templates` are the waveforms of the person's joints in the order of [`Joint::ALL`]; all four have phase 0 at the same instant of the
    /// stride. `sensor` is the joint that is measured.
    ///
    /// # Errors
    /// - [`BuildError::OutOfRange`] and [`BuildError::NotFinite`] name the field; also `template.fundamental` if the measured joint hardly
    ///   moves, and `template.range` or `template.peaks` if `events` is [`EventSource::Peak`](super::EventSource::Peak) and the measured
    ///   joint's template does not have exactly one peak a stride.
    /// - [`BuildError::PeriodTooLong`] above 0.05 / `stiffness` seconds (4.1 ms by default), or above the limit of
    ///   [`PhaseLockConfig::build`](crate::entrainment::phase_lock::PhaseLockConfig::build).
    pub fn build(&self, templates: [Template; 4], sensor: Joint, period: Period) -> Result<Follower, BuildError> {
        self.validate()?;
        let [left_hip, right_hip, left_knee, right_knee] = templates;
        let measured = match sensor {
            Joint::LeftHip => left_hip,
            Joint::RightHip => right_hip,
            Joint::LeftKnee => left_knee,
            Joint::RightKnee => right_knee,
        };
        let lock = self.lock.build(measured, period)?;
        // Both poles of the bounded phase lie at 2k: their time constant 1/(2k) must be ten ticks or more.
        allow_period(period, (0.05 / self.stiffness * 1e6) as u32)?;
        let fastest = lock.nominal().0 * self.lock.frequency_range.1;
        let events = Events::new(self.events, &measured, &lock, period)?;
        let state = FollowerState::new(self, &lock, events, period);
        let (corrections, corrects) = (Corrections::NONE, false);
        let config = *self;
        Ok(Follower { config, templates, corrections, corrects, sensor, lock, period, fastest, sensed: None, state })
    }
}

impl Follower {
    /// The same follower with these corrections of its joints, see [`correction`].
    ///
    /// # Errors
    /// - [`BuildError::NotFinite`] and [`BuildError::OutOfRange`] name the gain, as `left_hip.correction.innovation[5][10]`, or
    ///   `usual_innovation`.
    /// - [`BuildError::PeriodTooLong`] above 5 ms.
    pub fn with_corrections(mut self, corrections: &Corrections) -> Result<Self, BuildError> {
        corrections.validate()?;
        allow_period(self.period, correction::LONGEST_PERIOD_US)?;
        self.corrections = *corrections;
        self.corrects = !corrections.is_none();
        Ok(self)
    }

    /// The inputs of a correction after the last step; `None` without a near lock and a good sample. Gains are learned from them.
    #[must_use]
    pub fn correction_inputs(&self) -> Option<[f32; correction::INPUTS]> {
        self.state.inputs.values()
    }

    /// State of the tracking; the same as [`Follow::follow_status`], without the `Option`.
    #[must_use]
    pub fn status(&self) -> FollowStatus {
        let limit = self.config.plausibility.innovation * self.amplitude_expected();
        let doubt = self.state.innovation.root() / limit;
        let blind = self.state.fault.is_some() || self.state.lock == Lock::Stopped;
        FollowStatus {
            state: self.state.lock,
            fault: self.state.fault,
            phase_error: self.lock.far_error(),
            stride_s: TAU / self.lock.frequency().0,
            confidence: if blind { 0.0 } else { (1.0 - doubt).max(0.0) },
        }
    }

    /// The estimator of the person's phase and stride frequency.
    #[must_use]
    pub const fn phase_lock(&self) -> &PhaseLock {
        &self.lock
    }

    /// Phase of the stride events: of the peak in the template, or the learned phase of the heel strikes. `None` without a source of events,
    /// and for a foot switch until four strikes agree.
    #[must_use]
    pub fn event_phase(&self) -> Option<Phase> {
        self.state.events.phase()
    }

    /// Drift of the measured joint's mean that its angle has taken up, within [`FollowerConfig::drift_limit`].
    #[must_use]
    pub const fn drift(&self) -> Radians {
        Radians(self.state.drift.value)
    }

    /// Upper bound of this joint's acceleration, for any sequence of samples.
    ///
    /// The angle is `a = stand + s D(psi)` with D = S - stand, S the joint's template, s the amplitude and psi the driven phase. So
    /// `|a''| <= A_s |D| + 2 |s'| |D'| psi' + |D''| psi'^2 + |D'| A_psi`, with the largest value of each factor: A_s is
    /// [`FollowerConfig::amplitude_acceleration`], A_psi is twice [`FollowerConfig::phase_acceleration`], with which the driven phase halts, D' and
    /// D'' are derivatives by psi. For the measured joint D has the drift d in it, which adds `A_s limit + 2 |s'| R + 2 R / T` (R and T are rate and time constant of the drift).
    /// A correction c adds `A_s 2 C + 2 |s'| |c'| + A_c`, with its own largest rate and acceleration.
    #[must_use]
    pub fn acceleration_bound(&self, joint: Joint) -> RadPerSec2 {
        let (Some(template), Some(stand)) = (self.templates.get(joint as usize), self.config.stand.get(joint as usize))
        else {
            return RadPerSec2(0.0);
        };
        let (mut way, mut slope, mut bend) = (0.0f32, 0.0f32, 0.0f32);
        let step = TAU / 256.0;
        let mut before = template.at(Phase(255 << 24)).slope / TAU;
        for n in 0..256u32 {
            let point = template.at(Phase(n << 24));
            let now = point.slope / TAU;
            way = way.max((point.angle - stand.0).abs());
            slope = slope.max(now.abs());
            bend = bend.max((now - before).abs() / step);
            before = now;
        }
        let a = self.config.amplitude_acceleration;
        let drifting = if joint == self.sensor {
            way += self.config.drift_limit.0;
            2.0 * (libm::sqrtf(a) + 1.0 / drift::RATE_S) * drift::FASTEST
        } else {
            0.0
        };
        let corrected = if self.corrects {
            way += 2.0 * correction::LARGEST;
            2.0 * libm::sqrtf(a) * correction::fastest() + correction::ACCELERATION
        } else {
            0.0
        };
        // The amplitude moves by 1 at most, so its rate is at most sqrt(A).
        let turning =
            2.0 * libm::sqrtf(a) * slope * self.fastest + bend * self.fastest * self.fastest + drifting + corrected;
        RadPerSec2(a * way + turning + slope * HALT_FACTOR * self.config.phase_acceleration.0)
    }

    /// Amplitude of the template, scaled by the learned gain of the sensor, rad: sqrt(2) times its root mean square.
    fn amplitude_expected(&self) -> f32 {
        self.lock.moments().amplitude * self.lock.sensor().1
    }

    /// One period of the estimator: checks the sample, advances the phase lock and decides on the state.
    fn estimate(&mut self) {
        let t = self.period.seconds();
        let sample = self.sensed.take();
        let (predicted, rates) = self.lock.prediction();
        let sample = self.state.plausibility.judge(sample, predicted.0);
        let usual = self.lock.moments().absolute_slope * self.lock.sensor().1 * self.lock.frequency().0;
        self.state.time += t;
        match sample {
            Plausibility::Good(y) => {
                self.state.activity.step(y, rates, usual, t);
                let [_, rate, _] = rates;
                let off = self.lock.innovation().0.abs();
                self.state.waits = off > LAG_AMPLITUDE_FRACTION * self.amplitude_expected()
                    && rate.abs() > usual
                    && self.state.activity.lags(rate);
                self.good(Radians(y), usual);
            }
            Plausibility::Bridged => {
                self.lock.coast();
                if self.state.lock == Lock::Locked {
                    self.state.history.keep(self.lock.phase(), self.lock.frequency().0);
                }
            }
            Plausibility::Fault(fault) => self.bad(fault),
        }
        let role = match self.state.lock {
            Lock::Locked if self.lock.is_near() => Role::Learns,
            Lock::Holding => Role::Keeps,
            Lock::Seeking if !self.state.walk => Role::Finds,
            Lock::Stopped | Lock::Seeking | Lock::Locked => Role::Ignored,
        };
        let good = if let Plausibility::Good(y) = sample { Some(y) } else { None };
        self.state.events.step(&mut self.lock, good, role);
        if !self.lock.is_finite() {
            // No sample leads here, as only finite ones are used. Otherwise the search begins again.
            self.lock.reset();
            self.enter(Lock::Stopped);
        }
        match sample {
            Plausibility::Good(_) if self.state.lock == Lock::Locked && self.lock.is_near() => {
                self.state.inputs.take(self.lock.innovation().0);
            }
            Plausibility::Bridged if self.state.lock == Lock::Locked => {}
            _ => self.state.inputs.forget(),
        }
        let offset = (self.state.lock == Lock::Locked).then(|| self.lock.sensor().0.0);
        self.state.drift.step(offset, self.config.drift_limit.0, t);
    }

    /// One period with a plausible angle. `usual` is the measured joint's mean absolute rate at the estimated stride frequency, rad/s.
    fn good(&mut self, angle: Radians, usual: f32) {
        let t = self.period.seconds();
        match self.state.lock {
            Lock::Stopped => {
                self.lock.settle_filter(angle);
                self.state.fault = None;
                if self.state.activity.mean_rate() > START_RATE_FRACTION * usual {
                    if self.is_hesitation() {
                        self.enter(Lock::Locked);
                    } else {
                        self.enter(Lock::Seeking);
                        self.lock.refill();
                    }
                }
            }
            Lock::Seeking => {
                self.lock.step(angle);
                self.state.innovation.step(self.lock.innovation().0, t);
                let (least, most) = self.config.plausibility.amplitude;
                let amplitude = self.lock.relative_amplitude();
                let fits = self.lock.is_near() && amplitude > least && amplitude < most && self.is_explained();
                self.state.waited = if fits { self.state.waited + t } else { 0.0 };
                if self.state.activity.is_still() {
                    self.enter(Lock::Stopped);
                } else if self.state.waited > self.config.settle_s {
                    self.enter(Lock::Locked);
                } else if self.state.time > SEARCH_LIMIT_S {
                    // The person does not walk, or the search found no phase: begin it again, with the joints standing.
                    self.state.walk = false;
                    self.enter(Lock::Seeking);
                    self.lock.refill();
                }
            }
            Lock::Locked => {
                self.lock.step(angle);
                self.state.innovation.step(self.lock.innovation().0, t);
                self.locked(usual, t);
            }
            Lock::Holding => {
                self.lock.settle_filter(angle);
                self.state.waited += t;
                if self.state.activity.has_stopped() {
                    // The sensor is good and the leg stands.
                    self.enter(Lock::Stopped);
                } else if self.state.waited >= self.config.good_s {
                    self.state.fault = None;
                    self.lock.search();
                    self.state.innovation = Innovation::default();
                    self.enter(Lock::Seeking);
                } else {
                    self.freewheel();
                }
            }
        }
    }

    /// Decides whether a lock ends.
    fn locked(&mut self, usual: f32, t: f32) {
        let amplitude = self.lock.relative_amplitude();
        let (least, most) = self.config.plausibility.amplitude;
        let beyond = amplitude < least || amplitude > most;
        self.state.beyond = if beyond { self.state.beyond + t } else { 0.0 };
        let lasts = self.state.beyond * self.lock.frequency().0 > BEYOND_CYCLES * TAU;
        if self.state.activity.has_stopped() || (lasts && amplitude < least) {
            self.enter(Lock::Stopped);
        } else if lasts {
            self.hold(SensorFault::Amplitude);
        } else if !self.is_explained() {
            if self.state.activity.mean_rate() > FAULT_RATE_FACTOR * usual {
                self.hold(SensorFault::Innovation);
            } else {
                // The motion is no faster than a leg's, but not the template's: the person does not walk. The joints stand until they do.
                self.state.walk = false;
                self.enter(Lock::Seeking);
            }
        } else {
            self.state.waited = if self.lock.is_near() { 0.0 } else { self.state.waited + t };
            if self.state.waited > LOST_S {
                self.enter(Lock::Seeking);
            } else {
                self.state.history.keep(self.lock.phase(), self.lock.frequency().0);
            }
        }
    }

    /// One period with a fault of the sensor.
    fn bad(&mut self, fault: SensorFault) {
        match self.state.lock {
            Lock::Locked => {
                self.hold(fault);
                self.lock.coast();
            }
            Lock::Holding => {
                self.state.fault = Some(fault);
                self.state.waited = 0.0;
                self.lock.coast();
                self.freewheel();
            }
            Lock::Seeking if self.state.walk => {
                self.hold(fault);
                self.lock.coast();
            }
            Lock::Seeking | Lock::Stopped => {
                self.state.fault = Some(fault);
                self.enter(Lock::Stopped);
                self.lock.refill();
            }
        }
    }

    /// Begins a hold: stride frequency and phase are set to values from before the fault, the phase continued to now.
    fn hold(&mut self, fault: SensorFault) {
        let stride_frequency = self.state.history.stride_frequency().unwrap_or(self.lock.frequency().0);
        self.lock.set_frequency(stride_frequency);
        if let Some((phase, age)) = self.state.history.phase() {
            let on = Phase::from_cycles(age * self.lock.frequency().0 * (1.0 / TAU));
            self.lock.set_phase(phase + on);
        }
        self.enter(Lock::Holding);
        self.state.events.hold(self.lock.frequency().0);
        self.state.fault = Some(fault);
    }

    /// Stops when a hold has lasted for the configured time.
    fn freewheel(&mut self) {
        if self.state.time > self.config.freewheel_s {
            let fault = self.state.fault;
            self.enter(Lock::Stopped);
            self.state.fault = fault;
            self.lock.refill();
        }
    }

    fn enter(&mut self, lock: Lock) {
        let before = self.state.lock;
        self.state.lock = lock;
        self.state.time = 0.0;
        self.state.waited = 0.0;
        self.state.beyond = 0.0;
        match lock {
            Lock::Stopped => {
                self.state.walk = false;
                self.state.activity.rest();
                self.state.paused = before == Lock::Locked;
                if before != Lock::Stopped {
                    self.lock.set_frequency(self.state.history.stride_frequency().unwrap_or(self.lock.frequency().0));
                }
            }
            Lock::Locked => {
                self.state.fault = None;
                self.state.walk = true;
                if before == Lock::Seeking {
                    self.state.history.clear(self.lock.frequency().0);
                }
            }
            Lock::Seeking | Lock::Holding => {}
        }
    }

    /// Whether the stop was a short hesitation within a stride: soon after it the joint moves on at the phase that the estimator continued to.
    fn is_hesitation(&self) -> bool {
        self.state.paused
            && self.state.time < HESITATION_S
            && !self.state.activity.is_idle()
            && self.lock.relative_amplitude() > self.config.plausibility.amplitude.0
            && self.lock.far_error().0.abs() < self.config.lock.near_within.0
    }

    /// Whether the difference between measured and predicted angle is small against the template's amplitude.
    fn is_explained(&self) -> bool {
        self.state.innovation.root() < self.config.plausibility.innovation * self.amplitude_expected()
    }

    /// One period of the driven phase and the amplitude.
    fn drive(&mut self) {
        let (t, config) = (self.period.seconds(), &self.config);
        let law = Braking { stiffness: config.stiffness, acceleration: config.phase_acceleration.0, period_s: t };
        let halt = Braking { acceleration: HALT_FACTOR * law.acceleration, ..law };
        let amplitude_law =
            Braking { stiffness: AMPLITUDE_STIFFNESS, acceleration: config.amplitude_acceleration, period_s: t };
        let state = &mut self.state;
        let mut target = if state.walk { 1.0 } else { 0.0 };
        if state.walk {
            // The estimated phase is that of the sample, which is `delay_s` old.
            let rate = self.lock.frequency().0;
            let now = self.lock.phase() + Phase::from_cycles(config.delay_s * rate * (1.0 / TAU));
            if state.amplitude == BoundedNumber::default() {
                // At amplitude 0 the joints do not move, so the phase may jump.
                state.driven = BoundedPhase { phase: now, rate: rate.min(self.fastest) };
            } else if state.amplitude.value < STAND_BELOW_AMPLITUDE
                && now.radians_after(state.driven.phase).0.abs() > FAR_PHASE_RAD
            {
                // Catching up would need a much faster stride: stand until the phases are close.
                target = 0.0;
                state.driven.halt(&halt);
            } else if state.waits && state.lock == Lock::Locked {
                state.driven.halt(&halt);
            } else {
                state.driven.follow(now, self.lock.rate().0, self.fastest, &law);
            }
        } else {
            state.driven.halt(&halt);
        }
        state.amplitude.approach(target, &amplitude_law);
        if self.corrects {
            let innovation = state.innovation.root();
            state.corrected.step(&self.corrections, &state.inputs, innovation, self.lock.phase(), self.period);
        }
    }

    /// What `of` makes of angle and rate of each joint. Inlined, so that rates that nobody takes are not computed: they are half of the work.
    #[inline(always)]
    fn points<T: Copy + Default>(&self, of: impl Fn(f32, f32) -> T) -> [T; Joint::COUNT] {
        let FollowerState { driven, amplitude, drift, corrected, .. } = &self.state;
        let rate = driven.rate * (1.0 / TAU);
        let harmonics = Harmonics::<TEMPLATE_HARMONICS>::of(driven.phase);
        let mut points = [T::default(); Joint::COUNT];
        let of_templates = Template::points_at(self.templates.each_ref(), &harmonics);
        let joints = Joint::ALL.iter().zip(of_templates).zip(&self.config.stand).zip(&corrected.joints);
        for (place, (((joint, point), stand), correction)) in points.iter_mut().zip(joints) {
            let (drifted, drifts) = if *joint == self.sensor { (drift.value, drift.rate) } else { (0.0, 0.0) };
            let off = point.angle + drifted + correction.value - stand.0;
            let off_rate = point.slope * rate + drifts + correction.rate;
            *place = of(stand.0 + amplitude.value * off, amplitude.rate * off + amplitude.value * off_rate);
        }
        points
    }
}

// The usual rate below is the measured joint's mean absolute rate over a stride at the estimated stride frequency, from the template.

/// Time after which a search begins again, s.
const SEARCH_LIMIT_S: f32 = 5.0;
/// Lead of the prediction over a joint that lags, as a fraction of the amplitude, from which on the driven phase waits for the joint.
const LAG_AMPLITUDE_FRACTION: f32 = 0.35;
/// Fraction of the usual rate from which on a joint that stood counts as moving.
const START_RATE_FRACTION: f32 = 0.5;
/// Multiple of the usual rate from which on an unexplained motion counts as a fault of the sensor, not as another motion of the leg.
const FAULT_RATE_FACTOR: f32 = 3.0;
/// Longest stop that counts as a hesitation, s.
const HESITATION_S: f32 = 0.25;
/// Time without near mode after which a lock is lost, s (see [`crate::entrainment::phase_lock`]).
const LOST_S: f32 = 1.0;
/// Part of a stride for which the amplitude may be beyond its limits, cycles. The filtered signal of a knee has strong harmonics, so that the
/// ratio to a template of another pace of the same person ripples twice a stride.
const BEYOND_CYCLES: f32 = 0.4;
/// Stiffness k of the amplitude, 1/s.
const AMPLITUDE_STIFFNESS: f32 = 16.0;
/// Acceleration with which the driven phase halts, divided by that with which it follows.
const HALT_FACTOR: f32 = 2.0;
/// Amplitude below which joints that are far from the person's phase stand before they move.
const STAND_BELOW_AMPLITUDE: f32 = 0.5;
/// Distance of the driven phase from the person's that counts as far, rad: an eighth of a stride.
const FAR_PHASE_RAD: f32 = 0.125 * TAU;

impl FollowerState {
    fn new(config: &FollowerConfig, lock: &PhaseLock, events: Events, period: Period) -> Self {
        Self {
            plausibility: PlausibilityCheck::new(config.plausibility, period),
            activity: Activity::new(),
            innovation: Innovation::new(),
            history: History::new(lock.nominal().0, period),
            lock: Lock::Stopped,
            fault: None,
            time: 0.0,
            waited: 0.0,
            beyond: 0.0,
            walk: false,
            paused: false,
            waits: false,
            driven: BoundedPhase { phase: Phase(0), rate: 0.0 },
            amplitude: BoundedNumber { value: 0.0, rate: 0.0 },
            drift: Drift::new(),
            inputs: Inputs::new(lock.nominal().0, period),
            corrected: Corrected::default(),
            events,
        }
    }
}

impl Generator<4> for Follower {
    fn step(&mut self) {
        self.estimate();
        self.drive();
    }

    // Not inlined: a choice among generators would save and restore the registers that this needs for each of them.
    #[inline(never)]
    fn angles(&self) -> [Radians; 4] {
        self.points(|angle, _| Radians(angle))
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.points(|_, rate| RadPerSec(rate))
    }

    /// The driven phase psi, which the joints have: 0 at the templates' phase 0. The person's estimated phase is that of
    /// [`Follower::phase_lock`].
    fn phase(&self) -> Phase {
        self.state.driven.phase
    }

    fn amplitude(&self) -> f32 {
        self.state.amplitude.value
    }

    fn check(&self) -> Result<(), StateFault> {
        let FollowerState { driven, amplitude, drift, corrected, .. } = &self.state;
        let own = [driven.rate, amplitude.value, amplitude.rate, drift.value, drift.rate];
        if all_finite(own) && all_finite(corrected.joints.map(|c| c.value + c.rate)) && self.lock.is_finite() {
            return Ok(());
        }
        let states = [
            ("driven.rate", driven.rate),
            ("amplitude", amplitude.value),
            ("amplitude.rate", amplitude.rate),
            ("drift", drift.value),
            ("drift.rate", drift.rate),
        ];
        if let Some((name, _)) = states.into_iter().find(|(_, value)| !value.is_finite()) {
            return Err(StateFault::NotFinite { state: Field::of(name) });
        }
        let correction = corrected.joints.iter().position(|c| !(c.value + c.rate).is_finite());
        match correction {
            Some(joint) => Err(StateFault::NotFinite { state: Field::at("correction", joint) }),
            None => self.lock.check(),
        }
    }

    fn reset(&mut self) {
        self.lock.reset();
        self.sensed = None;
        let mut events = self.state.events;
        events.reset();
        self.state = FollowerState::new(&self.config, &self.lock, events, self.period);
    }
}

impl Follow for Follower {
    fn observe(&mut self, angle: Option<Radians>) {
        self.sensed = angle;
    }

    fn heel_strike(&mut self) {
        self.state.events.strike();
    }

    fn follow_status(&self) -> Option<FollowStatus> {
        Some(self.status())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walks again from this amplitude, the driven phase behind the estimate by this fraction of a cycle. Returns the largest rate of the
    /// driven phase as a multiple of the person's, and the phase difference at the end, rad.
    fn walks_again(amplitude: f32, behind: f32) -> (f32, f32) {
        let hip = Template::new(Radians(0.1), [0.35, -0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 8]).unwrap();
        let config = FollowerConfig::default();
        let mut legs = config.build([hip; 4], Joint::LeftHip, Period::MILLISECOND).unwrap();
        legs.enter(Lock::Locked);
        legs.state.amplitude = BoundedNumber { value: amplitude, rate: -1.0 };
        legs.state.driven = BoundedPhase { phase: Phase::from_cycles(-behind), rate: 0.0 };
        let mut fastest = 0.0f32;
        for tick in 0..4000u32 {
            legs.lock.set_phase(Phase::from_cycles(tick as f32 * 1e-3 * legs.lock.frequency().0 / TAU));
            legs.drive();
            fastest = fastest.max(legs.state.driven.rate / legs.lock.frequency().0);
        }
        assert_eq!(legs.state.amplitude.value, 1.0);
        (fastest, legs.lock.phase().radians_after(legs.state.driven.phase).0.abs())
    }

    /// A person whose phase wanders within the stride, by 3 degrees at most: root mean square of the estimated less the driven phase, degrees.
    fn lags_behind_the_estimate() -> f32 {
        let knee = Template::new(
            Radians(0.5),
            [-0.3, -0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        );
        let knee = knee.unwrap();
        let mut legs = FollowerConfig::default().build([knee; 4], Joint::LeftKnee, Period::MILLISECOND).unwrap();
        let (mut sum, mut count) = (0.0, 0.0);
        for tick in 0..20_000u32 {
            let time = tick as f32 * 1e-3;
            let wander = 3.0 / 360.0 * (TAU * 1.4 * time).sin();
            let person = Phase::from_cycles((time / 1.1).fract() + wander);
            legs.observe(Some(Radians(knee.at(person).angle)));
            legs.step();
            if tick >= 10_000 {
                assert_eq!(legs.status().state, Lock::Locked, "tick {tick}");
                let lag = legs.lock.phase().radians_after(legs.state.driven.phase).0.to_degrees();
                (sum, count) = (sum + lag * lag, count + 1.0);
            }
        }
        (sum / count).sqrt()
    }

    /// The driven phase moves at the rate of the estimate, not at the mean frequency.
    #[test]
    fn the_driven_phase_keeps_up_with_the_estimate() {
        let lag = lags_behind_the_estimate();
        assert!(lag < 0.25, "{lag} degrees");
    }

    /// At a small amplitude and far behind, the joints stand first or wait for the person; they do not catch up at a high rate.
    #[test]
    fn joints_that_almost_stopped_do_not_catch_up_at_a_run() {
        for tenth in 1..10 {
            let (fastest, left) = walks_again(0.3, 0.1 * tenth as f32);
            assert!(left < 0.01, "{tenth}: {left} rad");
            assert!(fastest < 1.6, "{tenth}: {fastest} of the person's rate");
        }
        // Joints that walk do catch up.
        let (fastest, left) = walks_again(0.9, 0.4);
        assert!(left < 0.01 && fastest > 1.6, "{left} rad, {fastest}");
    }
}
