//! A generator of four joints whose phase follows the phase of a person, measured by one joint sensor.

use core::f32::consts::TAU;

use joint_units::{Joint, Period, Phase, RadPerSec, RadPerSec2, Radians};

use super::bounded_phase::{BoundedNumber, BoundedPhase};
use super::config::{FollowStatus, FollowerConfig, Lock};
use super::events::{Events, Role};
use super::history::History;
use super::plausibility::{Plausibility, PlausibilityCheck, SensorFault};
use super::stop_detector::{Activity, Innovation};
use crate::entrainment::phase_lock::{PhaseLock, Template};
use crate::error::allow_period;
use crate::math::braking::Braking;
use crate::waveform::shape::Shape;
use crate::{BuildError, Field, Follow, Generator, StateFault};

/// Four joints that follow a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    config: FollowerConfig,
    templates: [Template; 4],
    lock: PhaseLock,
    period: Period,
    /// Largest rate of the driven phase, rad/s.
    fastest: f32,
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
    /// How long it has been in this state, s.
    time: f32,
    /// How long samples have been good, or the phase error small, or the error large: what the state waits for, s.
    waited: f32,
    /// Whether the joints are to walk.
    walk: bool,
    /// Whether the joints wait for a leg that stays behind.
    waits: bool,
    /// Whether it stopped out of a lock.
    paused: bool,
    driven: BoundedPhase,
    amplitude: BoundedNumber,
    events: Events,
}

impl FollowerConfig {
    /// Validates the configuration and builds a follower that stands, with the amplitude 0, until its person walks. `sensor` is the joint that
    /// is measured; the templates are in the order of [`Joint::ALL`].
    ///
    /// # Errors
    /// Names the field that is out of range; `template.range` or `template.peaks` if peaks are configured as events and the template of
    /// the measured joint does not have exactly one peak a stride.
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
        // The bounded phase must be stable: its poles lie at 2k, ten ticks each.
        allow_period(period, (0.05 / self.stiffness * 1e6) as u32)?;
        let fastest = lock.nominal().0 * self.lock.frequency_range.1;
        let events = Events::new(self.events, &measured, &lock, period)?;
        let state = FollowerState::new(self, &lock, events, period);
        Ok(Follower { config: *self, templates, lock, period, fastest, sensed: None, state })
    }
}

impl Follower {
    /// State of the tracking.
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

    /// The estimator.
    #[must_use]
    pub const fn phase_lock(&self) -> &PhaseLock {
        &self.lock
    }

    /// Where in the stride the events are that it may use: where the peaks are, or where the heel strikes once that is learned.
    #[must_use]
    pub fn event_phase(&self) -> Option<Phase> {
        self.state.events.phase()
    }

    /// An upper bound of what any joint can be accelerated by, whatever the sensor does.
    ///
    /// From `a = stand + s D(psi)`, D = S - stand: `|a''| <= A_s |D| + 2 s' |D'| psi' + |D''| psi'^2 + |D'| A_psi`, each at its largest.
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
        // The amplitude runs over 1 at most; its rate is at most sqrt(A).
        let turning = 2.0 * libm::sqrtf(a) * slope * self.fastest + bend * self.fastest * self.fastest;
        RadPerSec2(a * way + turning + slope * self.config.phase_acceleration.0)
    }

    fn amplitude_expected(&self) -> f32 {
        libm::sqrtf(2.0 * self.lock.moments().variance) * self.lock.sensor().1
    }

    /// Judges the sample, moves the estimator, and decides on the state.
    fn estimate(&mut self) {
        let t = self.period.seconds();
        let sample = self.sensed.take();
        let predicted = self.lock.predicted();
        let sample = self.state.plausibility.judge(sample, predicted.0);
        let rates = self.lock.predicted_rates(PREDICTION_CYCLES);
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
        if self.lock.check().is_err() {
            // No finite sample can bring it here; if something else ever does, it begins again.
            self.lock.reset();
            self.enter(Lock::Stopped);
        }
    }

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
                    // Not one that walks, or one whom the search has lost: begin the search again, standing.
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
                    // A sound sensor on a leg that stands.
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

    fn locked(&mut self, usual: f32, t: f32) {
        let amplitude = self.lock.relative_amplitude();
        let (least, most) = self.config.plausibility.amplitude;
        if self.state.activity.has_stopped() || amplitude < least {
            self.enter(Lock::Stopped);
        } else if amplitude > most {
            self.hold(SensorFault::Amplitude);
        } else if !self.is_explained() {
            if self.state.activity.mean_rate() > FAULT_RATE_FACTOR * usual {
                self.hold(SensorFault::Innovation);
            } else {
                // It moves no more than a leg does: the person does something else. The joints stand until there is a stride again.
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

    /// Back to before the fault, and on from there.
    fn hold(&mut self, fault: SensorFault) {
        let cadence = self.state.history.cadence().unwrap_or(self.lock.frequency().0);
        self.lock.set_frequency(cadence);
        if let Some((phase, age)) = self.state.history.phase() {
            let on = Phase::from_cycles(age * self.lock.frequency().0 * (1.0 / TAU));
            self.lock.set_phase(phase + on);
        }
        self.enter(Lock::Holding);
        self.state.events.hold(self.lock.frequency().0);
        self.state.fault = Some(fault);
    }

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
        match lock {
            Lock::Stopped => {
                self.state.walk = false;
                self.state.activity.rest();
                self.state.paused = before == Lock::Locked;
                if before != Lock::Stopped {
                    self.lock.set_frequency(self.state.history.cadence().unwrap_or(self.lock.frequency().0));
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

    /// Whether a stop was none: the joint moves on where the walk would be by now.
    fn is_hesitation(&self) -> bool {
        self.state.paused
            && self.state.time < HESITATION_S
            && !self.state.activity.is_idle()
            && self.lock.relative_amplitude() > self.config.plausibility.amplitude.0
            && self.lock.far_error().0.abs() < self.config.lock.near_within.0
    }

    fn is_explained(&self) -> bool {
        self.state.innovation.root() < self.config.plausibility.innovation * self.amplitude_expected()
    }

    /// Moves what drives the joints.
    fn drive(&mut self) {
        let (t, config) = (self.period.seconds(), &self.config);
        let law = Braking { stiffness: config.stiffness, acceleration: config.phase_acceleration.0, period_s: t };
        let halt = Braking { acceleration: 2.0 * law.acceleration, ..law };
        let amplitude_law =
            Braking { stiffness: AMPLITUDE_STIFFNESS, acceleration: config.amplitude_acceleration, period_s: t };
        let state = &mut self.state;
        let mut target = if state.walk { 1.0 } else { 0.0 };
        if state.walk {
            // The estimate belongs to the sample, which is older by the delay.
            let rate = self.lock.frequency().0;
            let now = self.lock.phase() + Phase::from_cycles(config.delay_s * rate * (1.0 / TAU));
            if state.amplitude == BoundedNumber::default() {
                // Nothing moves: the phase may be taken as it is.
                state.driven = BoundedPhase { phase: now, rate: rate.min(self.fastest) };
            } else if state.amplitude.value < STAND_BELOW_AMPLITUDE
                && now.radians_after(state.driven.phase).0.abs() > FAR_PHASE_RAD
            {
                // Catching up would need an unnatural stride: stand until the phases meet.
                target = 0.0;
                state.driven.halt(&halt);
            } else if state.waits && state.lock == Lock::Locked {
                state.driven.halt(&halt);
            } else {
                state.driven.follow(now, rate, self.fastest, &law);
            }
        } else {
            state.driven.halt(&halt);
        }
        state.amplitude.approach(target, &amplitude_law);
    }

    /// Angle and rate of each joint.
    fn points(&self) -> impl Iterator<Item = (f32, f32)> + '_ {
        let FollowerState { driven, amplitude, .. } = &self.state;
        let rate = driven.rate * (1.0 / TAU);
        self.templates.iter().zip(&self.config.stand).map(move |(template, stand)| {
            let point = template.at(driven.phase);
            let off = point.angle - stand.0;
            (stand.0 + amplitude.value * off, amplitude.rate * off + amplitude.value * point.slope * rate)
        })
    }
}

/// How long a search goes on before it starts again, s.
const SEARCH_LIMIT_S: f32 = 5.0;
/// By how much of a stride the person may be early or late before not moving is a stop.
const PREDICTION_CYCLES: f32 = 0.04;
/// How far, in amplitudes, the template may be ahead of a leg that does not move before the joints wait for it.
const LAG_AMPLITUDE_FRACTION: f32 = 0.35;
/// Part of the usual rate from which on a joint that stood is one that moves.
const START_RATE_FRACTION: f32 = 0.5;
/// Multiple of the usual rate beyond which it is not a leg that moves.
const FAULT_RATE_FACTOR: f32 = 3.0;
/// How short a stop may be to have been none, s.
const HESITATION_S: f32 = 0.25;
/// How long a lock may be far before it is lost, s.
const LOST_S: f32 = 1.0;
/// k of the amplitude, 1/s.
const AMPLITUDE_STIFFNESS: f32 = 16.0;
/// Amplitude below which joints that are far from the person's phase stand before they move.
const STAND_BELOW_AMPLITUDE: f32 = 0.5;
/// How far that is, rad: an eighth of a stride.
const FAR_PHASE_RAD: f32 = 0.125 * TAU;

impl FollowerState {
    const fn new(config: &FollowerConfig, lock: &PhaseLock, events: Events, period: Period) -> Self {
        Self {
            plausibility: PlausibilityCheck::new(config.plausibility, period),
            activity: Activity::new(),
            innovation: Innovation::new(),
            history: History::new(lock.nominal().0, period),
            lock: Lock::Stopped,
            fault: None,
            time: 0.0,
            waited: 0.0,
            walk: false,
            paused: false,
            waits: false,
            driven: BoundedPhase { phase: Phase(0), rate: 0.0 },
            amplitude: BoundedNumber { value: 0.0, rate: 0.0 },
            events,
        }
    }
}

impl Generator<4> for Follower {
    fn step(&mut self) {
        self.estimate();
        self.drive();
    }

    fn angles(&self) -> [Radians; 4] {
        let mut angles = [Radians(0.0); 4];
        for (angle, (value, _)) in angles.iter_mut().zip(self.points()) {
            angle.0 = value;
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; 4] {
        let mut rates = [RadPerSec(0.0); 4];
        for (rate, (_, value)) in rates.iter_mut().zip(self.points()) {
            rate.0 = value;
        }
        rates
    }

    /// The driven phase: 0 where the templates have it.
    fn phase(&self) -> Phase {
        self.state.driven.phase
    }

    fn amplitude(&self) -> f32 {
        self.state.amplitude.value
    }

    fn check(&self) -> Result<(), StateFault> {
        let FollowerState { driven, amplitude, .. } = &self.state;
        let states = [("driven.rate", driven.rate), ("amplitude", amplitude.value), ("amplitude.rate", amplitude.rate)];
        match states.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, _)) => Err(StateFault::NotFinite { state: Field::of(name) }),
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

    /// Legs that walk again with this amplitude left over from before, the driven phase this part of a cycle behind the estimate: the
    /// largest rate of the driven phase, and the phase that is left, once the amplitude is that of walking.
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

    /// With little amplitude left and far behind, they stand first, or wait for the person: they never catch up at a run.
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
