//! Estimates phase and stride frequency of a person from the angle of one joint: a phase-locked loop of second order with two phase detectors.
//!
//! ```text
//! loop:  phi' = w + 2 wn r,   w' = wn^2 r
//! far:   r = arg[ (x + j q) conj(X(phi) + j Q(phi)) ]
//! near:  r = clip( e g S'(phi) / mean(S'^2), r_max ),   e = y - (o + a0 + g (S(phi) - a0))
//!        o' = eta_o e,   g' = eta_g e (S - a0) / mean((S - a0)^2)
//! ```
//! | symbol | quantity | unit |
//! |---|---|---|
//! | phi, w | estimated phase and its angular frequency; w is held within [`PhaseLockConfig::frequency_range`] | rad, rad/s |
//! | r | phase error: the detector's estimate of the person's phase minus phi | rad |
//! | wn | bandwidth of the loop, [`PhaseLockConfig::bandwidth`] | rad/s |
//! | y | measured angle | rad |
//! | S(phi), S', a0 | [`Template`] of the measured joint, its slope per radian of phase, its mean | rad |
//! | x, q | output of the quadrature filter ([`crate::entrainment::quadrature_filter`], a SOGI) for y | rad |
//! | X, Q | its settled output for the template at phase phi: a Fourier series, computed once by `build` | rad |
//! | e | innovation: measured minus predicted angle | rad |
//! | o, g | learned offset (rad) and gain of the sensor against the template | |
//! | eta_o, eta_g | their learning rates | 1/s |
//!
//! **Far mode** compares filtered signal and filtered template. Its error has a single zero in the cycle, so every start finds it, and no
//! ripple, because both sides contain the same harmonics. **Near mode** is gradient descent on e^2. It follows faster and uses the whole
//! waveform, but its error also has zeros at wrong phases and where the waveform is flat. So near mode begins when the far error has been small
//! for [`PhaseLockConfig::near_after_s`], and ends as soon as the far error exceeds [`PhaseLockConfig::near_within`].
//!
//! Both poles of the loop lie at wn (damping ratio 1), so wn is the only parameter to tune. At 2.5 rad/s a step of the stride frequency is followed in
//! about 1.3 s. After a search wn is doubled, and decays to its value with a time constant of 0.7 s. Offset and gain are first learned at the
//! rate 1 / (1 s + time in near mode), as a mean would be, and later at eta_o and eta_g.
//!
//! The equations above are complete; no paper is cited for the combination of the two detectors.
//!
//! A step costs one sine, seven divisions and two square roots, and unless the far error is small one arc tangent. The angle must be finite;
//! [`Follower`](crate::entrainment::Follower) checks that and every other fault of the sensor.
//!
//! ```
//! use cpg_core::entrainment::phase_lock::{PhaseLockConfig, Template};
//! use cpg_core::waveform::shape::Shape;
//! use joint_units::{Period, Phase, Radians};
//! let hip = Template::new(Radians(0.1), [0.35, -0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 8])?;
//! let mut lock = PhaseLockConfig::default().build(hip, Period::MILLISECOND)?;
//! let person = |tick: u32| Phase::from_cycles(0.4 + tick as f32 * 1e-3 / 1.2); // strides of 1.2 s, the nominal ones are of 1.1
//! for tick in 1..=8000 {
//!     lock.step(Radians(hip.at(person(tick)).angle));
//! }
//! assert!(lock.is_near());
//! assert!(lock.phase().cycles_after(person(8000)).abs() < 0.01);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use core::f32::consts::TAU;

use joint_units::order::{greater, lesser};
use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::entrainment::quadrature_filter::{MAX_TURN, Sogi, SogiConfig, settled_gain};
use crate::error::{allow_period, in_range};
use crate::math::finite::all_finite;
use crate::math::trig::{atan2, sin_cos};
use crate::waveform::shape::{FourierShape, Harmonics, Shape};
use crate::{BuildError, Field, StateFault};

/// Harmonics of a template: eight follow the mean stride of a person within a fifth of a degree.
pub const TEMPLATE_HARMONICS: usize = 8;

/// The waveform of a joint over the gait phase, in radians: mean, then cosine and sine coefficients of harmonics 1 to 8.
pub type Template = FourierShape<TEMPLATE_HARMONICS>;

/// Harmonics of the SOGI's response that are compared: the fourth is attenuated 20 times.
const FILTERED: usize = 3;

/// Parameters of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseLockConfig {
    /// Nominal stride time, s: that of the template's person, with which a search begins; 0.3 to 5, default 1.1.
    pub stride_s: f32,
    /// Bandwidth wn; 0.5 to 5 rad/s, default 2.5.
    pub bandwidth: RadPerSec,
    /// Least and largest frequency w relative to the nominal 2 pi / `stride_s`; 0.1 to 1 and 1 to 4, default 0.3 and 2.5.
    pub frequency_range: (f32, f32),
    /// Gains of the quadrature filter.
    pub sogi: SogiConfig,
    /// Largest far error in near mode; 0.1 to 1.5 rad, default 34 degrees.
    pub near_within: Radians,
    /// Time for which the far error must be within half of `near_within` before near mode begins, s; 0.02 to 5, default 0.25.
    pub near_after_s: f32,
    /// Time for which the filter settles before a search, s; 0 to 2, default 0.6. The phase jumps to that of the filter at its end, so it must
    /// not drive anything until then.
    pub fill_s: f32,
    /// Largest phase error r_max from one sample in near mode; 0.05 to 1.5 rad, default 0.5.
    pub largest_error: Radians,
    /// Rate eta_o at which the sensor's offset is learned in near mode, 1/s; 0 to 5, default 0.3.
    pub offset_rate: f32,
    /// Rate eta_g at which the sensor's gain is learned in near mode, 1/s; 0 to 5, default 0.1.
    pub gain_rate: f32,
    /// Least and largest gain of the sensor; 0.1 to 1 and 1 to 5, default 0.5 and 2.
    pub gain_range: (f32, f32),
}

impl Default for PhaseLockConfig {
    /// The default of each field.
    fn default() -> Self {
        Self {
            stride_s: 1.1,
            bandwidth: RadPerSec(2.5),
            frequency_range: (0.3, 2.5),
            sogi: SogiConfig::default(),
            near_within: Radians::from_degrees(34.0),
            near_after_s: 0.25,
            fill_s: 0.6,
            largest_error: Radians(0.5),
            offset_rate: 0.3,
            gain_rate: 0.1,
            gain_range: (0.5, 2.0),
        }
    }
}

impl PhaseLockConfig {
    /// Validates the configuration and builds the loop for the measured joint's template and a control period. It begins at phase 0 with the
    /// nominal frequency, and searches first.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range; `template.fundamental` if the amplitude of the template's first harmonic is
    /// outside 0.01 to 3 rad. [`BuildError::PeriodTooLong`] if the fastest stride has fewer than 13 ticks (above 35 ms by default).
    pub fn build(&self, template: Template, period: Period) -> Result<PhaseLock, BuildError> {
        in_range(self.stride_s, Field::of("stride_s"), 0.3, 5.0)?;
        in_range(self.bandwidth.0, Field::of("bandwidth"), 0.5, 5.0)?;
        in_range(self.frequency_range.0, Field::at("frequency_range", 0), 0.1, 1.0)?;
        in_range(self.frequency_range.1, Field::at("frequency_range", 1), 1.0, 4.0)?;
        self.sogi.validate()?;
        in_range(self.near_within.0, Field::of("near_within"), 0.1, 1.5)?;
        in_range(self.near_after_s, Field::of("near_after_s"), 0.02, 5.0)?;
        in_range(self.fill_s, Field::of("fill_s"), 0.0, 2.0)?;
        in_range(self.largest_error.0, Field::of("largest_error"), 0.05, 1.5)?;
        in_range(self.offset_rate, Field::of("offset_rate"), 0.0, 5.0)?;
        in_range(self.gain_rate, Field::of("gain_rate"), 0.0, 5.0)?;
        in_range(self.gain_range.0, Field::at("gain_range", 0), 0.1, 1.0)?;
        in_range(self.gain_range.1, Field::at("gain_range", 1), 1.0, 5.0)?;
        let moments = Moments::of(&template);
        in_range(moments.fundamental, Field::of("template.fundamental"), 0.01, 3.0)?;
        let nominal = TAU / self.stride_s;
        let fastest = nominal * self.frequency_range.1;
        let max_micros = (MAX_TURN / fastest * 1e6) as u32;
        allow_period(period, max_micros)?;
        let by = Phase::from_cycles(PREDICTION_CYCLES);
        let (sin, cos) = sin_cos(Phase::from_cycles(0.5 * self.near_within.0 / TAU));
        Ok(PhaseLock {
            config: *self,
            template,
            early_and_late: [template.ahead(Phase(0) - by), template.ahead(by)],
            filtered: filtered(&template, &self.sogi)?,
            moments,
            period_s: period.seconds(),
            nominal,
            close: CLEARLY * sin / cos,
            state: LockState::new(template.mean(), nominal, self.fill_s),
        })
    }
}

/// The settled response of the SOGI to the template: x and q over the phase.
type Filtered = [FourierShape<FILTERED>; 2];

/// The response of the settled SOGI to each harmonic of the template.
fn filtered(template: &Template, sogi: &SogiConfig) -> Result<Filtered, BuildError> {
    let (_, cos, sin) = template.coefficients();
    // Each harmonic is Re[(a - j b) e^(j n phi)].
    let (mut x, mut q) = (([0.0; FILTERED], [0.0; FILTERED]), ([0.0; FILTERED], [0.0; FILTERED]));
    for (n, (&a, &b)) in (1u8..).zip(cos.iter().zip(sin)).take(FILTERED) {
        let (gain_x, gain_q) = settled_gain(sogi, n);
        let place = usize::from(n - 1);
        for ((cos, sin), (re, im)) in [(&mut x, gain_x), (&mut q, gain_q)] {
            if let (Some(c), Some(s)) = (cos.get_mut(place), sin.get_mut(place)) {
                (*c, *s) = (a * re + b * im, b * re - a * im);
            }
        }
    }
    Ok([FourierShape::new(Radians(0.0), x.0, x.1)?, FourierShape::new(Radians(0.0), q.0, q.1)?])
}

/// Means over the cycle of a template, in radians and per radian of phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    /// Amplitude of the first harmonic.
    pub fundamental: f32,
    /// mean((S - a0)^2).
    pub variance: f32,
    /// sqrt(2) times the root mean square of S - a0.
    pub amplitude: f32,
    /// mean(S'^2).
    pub square_slope: f32,
    /// mean(|S'|). For a waveform with one rise and one fall it is the range divided by pi.
    pub absolute_slope: f32,
}

impl Moments {
    /// The means of a template. Sums over 256 points are exact for eight harmonics, except for the mean of |S'|.
    #[must_use]
    pub(crate) fn of(template: &Template) -> Self {
        let (_, cos, sin) = template.coefficients();
        let first = |list: &[f32; TEMPLATE_HARMONICS]| list.first().copied().unwrap_or(0.0);
        let fundamental = libm::sqrtf(first(cos) * first(cos) + first(sin) * first(sin));
        let mut moments = Self { fundamental, variance: 0.0, amplitude: 0.0, square_slope: 0.0, absolute_slope: 0.0 };
        for step in 0..256u32 {
            let point = template.at(Phase(step << 24));
            let (off, slope) = (point.angle - template.mean(), point.slope / TAU);
            moments.variance += off * off / 256.0;
            moments.square_slope += slope * slope / 256.0;
            moments.absolute_slope += slope.abs() / 256.0;
        }
        moments.amplitude = libm::sqrtf(2.0 * moments.variance);
        moments
    }
}

/// Offset and gain are first learned at the rate 1 / (this time + time in near mode), s.
const FIRST_LEARNING_S: f32 = 1.0;

/// Additional bandwidth after a search, relative to the configured one: with it an error of 40 % in frequency is corrected a second sooner.
const WIDENING: f32 = 1.0;
/// Time constant with which the additional bandwidth decays, s.
const WIDENING_S: f32 = 0.7;

/// Half of the span of phases of [`PhaseLock::prediction`], cycles: in the detection of a stop, a person who is early or late by less is not taken to have
/// stopped.
pub const PREDICTION_CYCLES: f32 = 0.04;

/// A tangent that is less by this factor is that of a smaller angle, whatever the rounding.
const CLEARLY: f32 = 0.999;

/// The phase-locked loop. In each tick call one of [`PhaseLock::step`], [`PhaseLock::settle_filter`] and [`PhaseLock::coast`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseLock {
    config: PhaseLockConfig,
    template: Template,
    /// The template [`PREDICTION_CYCLES`] ago, and that much later.
    early_and_late: [Template; 2],
    filtered: Filtered,
    moments: Moments,
    period_s: f32,
    nominal: f32,
    /// Tangent of an angle a little below half of [`PhaseLockConfig::near_within`].
    close: f32,
    state: LockState,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct LockState {
    sogi: Sogi,
    /// Whether the SOGI has been set to the level of the first sample.
    begun: bool,
    /// Remaining settling time of the filter, s.
    fill: f32,
    phase: Phase,
    frequency: f32,
    offset: f32,
    gain: f32,
    near: bool,
    /// Time in near since the last search, s.
    near_for: f32,
    /// Time for which the far error has been small, s.
    small_for: f32,
    /// Additional bandwidth, relative; decays after a search.
    widening: f32,
    /// The far error, as the direction of a point.
    far: Direction,
    /// The error r of the last step, rad.
    error: f32,
    /// The innovation e of the last step, rad.
    innovation: f32,
    /// `None` until it is computed for the present phase and signal.
    kept: Option<Kept>,
}

/// What a step computes and later questions need too.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kept {
    /// Amplitude of the filtered signal relative to that of the filtered template.
    relative: f32,
    /// The template's angle at the phase, rad.
    angle: f32,
    /// Its slopes, see [`PhaseLock::prediction`], radians per cycle.
    slopes: [f32; 3],
}

/// An angle that is computed when it is asked for: that of a point from the axis `along`, anticlockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Direction {
    across: f32,
    along: f32,
}

impl Direction {
    /// rad, -pi to pi.
    fn angle(self) -> f32 {
        atan2(self.across, self.along)
    }
}

impl LockState {
    const fn new(mean: f32, frequency: f32, fill: f32) -> Self {
        Self {
            sogi: Sogi::at_rest(mean),
            begun: false,
            fill,
            phase: Phase(0),
            frequency,
            offset: 0.0,
            gain: 1.0,
            near: false,
            near_for: 0.0,
            small_for: 0.0,
            widening: 0.0,
            far: Direction { across: 0.0, along: -1.0 },
            error: 0.0,
            innovation: 0.0,
            kept: None,
        }
    }
}

impl PhaseLock {
    /// Advances by one control period, with the measured angle at its end, and corrects phase and frequency. The angle must be finite, or the
    /// state becomes invalid (see [`PhaseLock::check`]).
    pub fn step(&mut self, angle: Radians) {
        let (y, t, config) = (angle.0, self.period_s, self.config);
        if self.state.fill > 0.0 {
            self.settle_filter(angle);
            self.state.fill -= t;
            if self.state.fill <= 0.0 {
                self.search();
            }
            return;
        }
        let bandwidth = self.bandwidth();
        self.state.widening -= self.state.widening * t / WIDENING_S;
        self.advance(2.0 * bandwidth * self.state.error);
        let turn = self.state.frequency * t;
        self.state.sogi.step(&config.sogi, y, turn);

        let harmonics = Harmonics::<TEMPLATE_HARMONICS>::of(self.state.phase);
        let filtered = self.filtered_at(&harmonics);
        let direction = self.compare(filtered);
        self.state.far = direction;
        // None: less than half of the limit. The angle itself costs a division and a polynomial, and a walk that is followed does not need it.
        let is_close = direction.across.abs() < self.close * direction.along;
        let far = (!is_close).then(|| direction.angle());
        let limit = config.near_within.0;
        let relative = self.relative_to(filtered);
        let (angle, slopes) = self.angle_and_slopes_at(&harmonics);
        self.state.kept = Some(Kept { relative, angle, slopes });
        let large_enough = relative > 0.4;
        let close = far.is_none_or(|far| far.abs() < 0.5 * limit);
        self.state.small_for = if close && large_enough { self.state.small_for + t } else { 0.0 };
        if self.state.near && (far.is_some_and(|far| far.abs() > limit) || !large_enough) {
            self.state.near = false;
        } else if !self.state.near && self.state.small_for >= config.near_after_s {
            self.state.near = true;
            self.take_over();
        }

        let [_, slope, _] = slopes;
        let (off, slope) = (angle - self.template.mean(), slope * (1.0 / TAU));
        let e = y - self.measured(angle);
        self.state.innovation = e;
        let error = if self.state.near {
            let limit = config.largest_error.0;
            // The first values, from the filter, may be far off: learn at the rate of a running mean at first.
            self.state.near_for += t;
            let first_rate = 1.0 / (FIRST_LEARNING_S + self.state.near_for);
            self.state.offset += greater(first_rate, config.offset_rate) * e * t;
            let gain = self.state.gain + greater(first_rate, config.gain_rate) * e * off / self.moments.variance * t;
            self.state.gain = lesser(greater(gain, config.gain_range.0), config.gain_range.1);
            lesser(greater(e * self.state.gain * slope / self.moments.square_slope, -limit), limit)
        } else {
            far.unwrap_or_else(|| direction.angle())
        };
        self.state.error = error;
        self.set_frequency(self.state.frequency + bandwidth * bandwidth * error * t);
    }

    /// Advances by one control period without a measured angle: the phase continues at the estimated frequency.
    pub fn coast(&mut self) {
        self.state.error = 0.0;
        self.advance(0.0);
        self.state.sogi.coast(&self.config.sogi, self.state.frequency * self.period_s);
    }

    /// Advances by one control period with a measured angle that settles the filter and corrects nothing: the phase continues at the estimated
    /// frequency. The angle must be finite.
    pub fn settle_filter(&mut self, angle: Radians) {
        self.begin(angle.0);
        self.state.error = 0.0;
        self.advance(0.0);
        self.state.sogi.step(&self.config.sogi, angle.0, self.state.frequency * self.period_s);
        let harmonics = Harmonics::<TEMPLATE_HARMONICS>::of(self.state.phase);
        self.state.far = self.compare(self.filtered_at(&harmonics));
        self.state.innovation = angle.0 - self.measured(self.template.at_harmonics(&harmonics).angle);
    }

    /// Sets the estimated phase, for example at a stride event.
    pub const fn set_phase(&mut self, phase: Phase) {
        self.state.phase = phase;
        self.state.kept = None;
        self.state.error = 0.0;
    }

    /// Sets the estimated frequency in rad/s, limited to the configured range.
    pub fn set_frequency(&mut self, frequency: f32) {
        let (least, most) = self.config.frequency_range;
        self.state.frequency = lesser(greater(frequency, self.nominal * least), self.nominal * most);
    }

    /// Begins far mode at the phase of the filter, which must have settled. [`PhaseLock::refill`] settles it first.
    pub fn search(&mut self) {
        self.state.near = false;
        self.state.near_for = 0.0;
        self.state.small_for = 0.0;
        self.state.widening = WIDENING;
        self.state.kept = None;
        // The far error is the distance to the phase at which the filtered template has the angle of the filtered signal. The response
        // does not rotate uniformly, so a second iteration is needed.
        for _ in 0..3 {
            let far = self.compare(self.filtered_at(&Harmonics::<FILTERED>::of(self.state.phase)));
            self.state.phase += Phase::from_cycles(far.angle() * (1.0 / TAU));
        }
        self.state.error = 0.0;
    }

    /// Begins a search: the filter settles for [`PhaseLockConfig::fill_s`] of further steps, then far mode begins at its phase.
    pub const fn refill(&mut self) {
        self.state.near = false;
        self.state.small_for = 0.0;
        self.state.fill = self.config.fill_s;
    }

    /// Returns to the built state.
    pub fn reset(&mut self) {
        self.state = LockState::new(self.template.mean(), self.nominal, self.config.fill_s);
    }

    /// Estimated gait phase of the person, phi.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.state.phase
    }

    /// Estimated angular frequency w of the stride.
    #[must_use]
    pub const fn frequency(&self) -> RadPerSec {
        RadPerSec(self.state.frequency)
    }

    /// Rate at which the estimated phase advances: the frequency w and, in near mode, the correction 2 wn r. What follows the estimate with this
    /// rate lags less behind it than with the frequency alone. The correction of far mode is left out: it moves the estimate to a phase that
    /// was just found, which is no motion of the person.
    #[must_use]
    pub fn rate(&self) -> RadPerSec {
        let correction = if self.state.near { 2.0 * self.bandwidth() * self.state.error } else { 0.0 };
        RadPerSec(self.state.frequency + correction)
    }

    /// Nominal angular frequency, 2 pi / [`PhaseLockConfig::stride_s`].
    #[must_use]
    pub const fn nominal(&self) -> RadPerSec {
        RadPerSec(self.nominal)
    }

    /// Whether the loop is in near mode: locked on the waveform.
    #[must_use]
    pub const fn is_near(&self) -> bool {
        self.state.near
    }

    /// The far error of the last step, -pi to pi, in both modes.
    #[must_use]
    pub fn far_error(&self) -> Radians {
        Radians(self.state.far.angle())
    }

    /// The phase error r that corrected the last step; 0 after a step without correction.
    #[must_use]
    pub const fn error(&self) -> Radians {
        Radians(self.state.error)
    }

    /// The innovation e of the last step: measured minus predicted angle.
    #[must_use]
    pub const fn innovation(&self) -> Radians {
        Radians(self.state.innovation)
    }

    /// The angle predicted at the estimated phase, with the learned offset and gain of the sensor.
    #[must_use]
    pub fn predicted(&self) -> Radians {
        Radians(self.measured(self.angle_and_slopes().0))
    }

    /// Prediction for the measured joint: its angle, and its rates (rad/s) at the estimated phase minus [`PREDICTION_CYCLES`], at it, and at it plus
    /// that.
    #[must_use]
    pub fn prediction(&self) -> (Radians, [f32; 3]) {
        let scale = self.state.gain * self.state.frequency * (1.0 / TAU);
        let (angle, slopes) = self.angle_and_slopes();
        (Radians(self.measured(angle)), slopes.map(|slope| scale * slope))
    }

    /// What the sensor measures at an angle of the template, rad.
    fn measured(&self, angle: f32) -> f32 {
        let mean = self.template.mean();
        self.state.offset + mean + self.state.gain * (angle - mean)
    }

    /// The template's angle at the estimated phase, and its slopes a little before, at it, and a little after.
    fn angle_and_slopes(&self) -> (f32, [f32; 3]) {
        match self.state.kept {
            Some(Kept { angle, slopes, .. }) => (angle, slopes),
            None => self.angle_and_slopes_at(&Harmonics::of(self.state.phase)),
        }
    }

    /// The same at the phase of these harmonics.
    #[inline(always)]
    fn angle_and_slopes_at(&self, harmonics: &Harmonics<TEMPLATE_HARMONICS>) -> (f32, [f32; 3]) {
        let [early, late] = &self.early_and_late;
        let points = Template::points_at([early, &self.template, late], harmonics);
        let [_, now, _] = points;
        (now.angle, points.map(|point| point.slope))
    }

    /// Learned offset and gain of the sensor: measured = offset + mean + gain (template - mean).
    #[must_use]
    pub const fn sensor(&self) -> (Radians, f32) {
        (Radians(self.state.offset), self.state.gain)
    }

    /// Amplitude of the filtered signal relative to that of the filtered template at the estimated phase: 1 for the template's person.
    #[must_use]
    pub fn relative_amplitude(&self) -> f32 {
        let compute = || self.relative_to(self.filtered_at(&Harmonics::<FILTERED>::of(self.state.phase)));
        self.state.kept.map_or_else(compute, |kept| kept.relative)
    }

    /// Means of the template.
    pub(crate) const fn moments(&self) -> &Moments {
        &self.moments
    }

    /// Whether every state is finite.
    ///
    /// # Errors
    /// [`StateFault::NotFinite`] with the first state that is not.
    pub fn check(&self) -> Result<(), StateFault> {
        if self.is_finite() {
            return Ok(());
        }
        let LockState { sogi, frequency, offset, gain, innovation, .. } = &self.state;
        if !sogi.is_finite() {
            return Err(StateFault::NotFinite { state: Field::of("lock.filter") });
        }
        let states = [
            ("lock.frequency", frequency),
            ("lock.offset", offset),
            ("lock.gain", gain),
            ("lock.innovation", innovation),
        ];
        match states.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, _)) => Err(StateFault::NotFinite { state: Field::of(name) }),
            None => Ok(()),
        }
    }

    /// Whether every state is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let LockState { sogi, frequency, offset, gain, innovation, .. } = &self.state;
        sogi.is_finite() && all_finite([*frequency, *offset, *gain, *innovation])
    }

    /// Starts the filter at the more likely level: the template's mean, or the sample if it is far from the mean.
    fn begin(&mut self, y: f32) {
        if !self.state.begun {
            let mean = self.template.mean();
            let level = if (y - mean).abs() > 2.2 * self.moments.fundamental { y } else { mean };
            self.state.sogi = Sogi::at_rest(level);
            self.state.begun = true;
        }
    }

    /// wn with the addition after a search, rad/s.
    fn bandwidth(&self) -> f32 {
        self.config.bandwidth.0 * (1.0 + self.state.widening)
    }

    /// Advances the phase by one period at the frequency plus a correction in rad/s.
    fn advance(&mut self, correction: f32) {
        self.state.kept = None;
        let rate = lesser(greater(self.state.frequency + correction, -self.nominal), 4.0 * self.nominal);
        self.state.phase += Phase::from_cycles(rate * self.period_s * (1.0 / TAU));
    }

    /// Takes the offset from the filter's mean when near mode begins. The filter's amplitude has not settled at the new frequency yet, so the
    /// gain is not taken from it.
    fn take_over(&mut self) {
        self.state.offset = self.state.sogi.mean - self.template.mean();
    }

    /// The filtered template, x and q.
    fn filtered_at<const K: usize>(&self, harmonics: &Harmonics<K>) -> [f32; 2] {
        let [x, q] = &self.filtered;
        [x.at_harmonics(harmonics).angle, q.at_harmonics(harmonics).angle]
    }

    /// Amplitude of the filtered signal relative to that of the filtered template, x and q.
    fn relative_to(&self, [x, q]: [f32; 2]) -> f32 {
        let expected = greater(libm::sqrtf(x * x + q * q), 0.25 * self.moments.fundamental);
        self.state.sogi.amplitude() / expected
    }

    /// The far error at the filtered template, x and q.
    fn compare(&self, [x, q]: [f32; 2]) -> Direction {
        let Sogi { fundamental, quadrature, .. } = self.state.sogi;
        Direction { across: quadrature * x - fundamental * q, along: fundamental * x + quadrature * q }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What the lock keeps of its last step is what it would compute, whatever is called between.
    #[test]
    fn what_is_kept_is_that_of_the_state() {
        let mut lock = PhaseLockConfig::default().build(hip(), Period::MILLISECOND).expect("in range");
        let mut kept = 0;
        for tick in 0..30_000_u32 {
            let angle = Radians(hip().at(Phase::from_cycles(tick as f32 * 9e-4)).angle + 0.02);
            match tick.wrapping_mul(2_654_435_761) >> 22 {
                0 => lock.coast(),
                1 => lock.settle_filter(angle),
                2 => lock.set_phase(Phase(tick << 17)),
                3 => lock.search(),
                4 => lock.set_frequency(6.0),
                5 if tick > 20_000 => lock.reset(),
                _ => lock.step(angle),
            }
            kept += u32::from(lock.state.kept.is_some());
            let computed = lock.relative_to(lock.filtered_at(&Harmonics::<FILTERED>::of(lock.state.phase)));
            assert_eq!(lock.relative_amplitude().to_bits(), computed.to_bits(), "tick {tick}");
            assert_eq!(
                lock.angle_and_slopes(),
                lock.angle_and_slopes_at(&Harmonics::of(lock.state.phase)),
                "tick {tick}"
            );
        }
        assert!(kept > 20_000, "{kept}");
    }

    /// The prediction is the template's, at the phase and beside it.
    #[test]
    fn the_prediction_is_that_of_the_template_before_at_and_after_the_phase() {
        let mut lock = lock();
        for tick in 0..2000_u32 {
            lock.set_phase(Phase(tick.wrapping_mul(4_321_987)));
            let (angle, rates) = lock.prediction();
            assert_eq!(angle.0.to_bits(), lock.measured(hip().at(lock.phase()).angle).to_bits());
            let by = Phase::from_cycles(PREDICTION_CYCLES);
            for (rate, phase) in rates.into_iter().zip([lock.phase() - by, lock.phase(), lock.phase() + by]) {
                let wanted = lock.nominal().0 / TAU * hip().at(phase).slope;
                assert!((rate - wanted).abs() < 2e-5, "tick {tick}: {rate} for {wanted}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100_000))]

        /// The tangent says that the far error is within half of its limit only where its angle does, and where the angle is well within, it says so.
        #[test]
        fn a_tangent_decides_as_the_angle(
            near_within in 0.1_f32..=1.5,
            part in prop_oneof![-2.2_f32..2.2, prop::sample::select(vec![-1.0, 1.0, 0.0])],
            size in prop::sample::select(vec![0.0_f32, 1e-42, 1e-20, 1e-3, 1.0, 1e15]),
            turned in any::<bool>(),
        ) {
            let config = PhaseLockConfig { near_within: Radians(near_within), ..PhaseLockConfig::default() };
            let lock = config.build(hip(), Period::MILLISECOND).expect("in range");
            let half = 0.5 * near_within;
            let angle = f64::from(half * part) + if turned { core::f64::consts::PI } else { 0.0 };
            let along = (f64::from(size) * angle.cos()) as f32;
            let direction = Direction { across: (f64::from(size) * angle.sin()) as f32, along };
            let is_close = direction.across.abs() < lock.close * direction.along;
            let exact = direction.angle().abs();
            prop_assert!(!is_close || exact < half, "{direction:?}: {exact} of {half}");
            prop_assert!(is_close || exact > 0.99 * half || size < 1e-30, "{direction:?}: {exact} of {half}");
        }
    }

    fn hip() -> Template {
        Template::new(
            Radians(0.1),
            [0.35, -0.06, 0.01, 0.004, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.03, -0.02, 0.0, 0.003, 0.0, 0.0, 0.0],
        )
        .unwrap()
    }

    fn lock() -> PhaseLock {
        PhaseLockConfig::default().build(hip(), Period::MILLISECOND).unwrap()
    }

    /// In far mode at lock the error has no ripple, although the template has harmonics: both sides are filtered in the same way.
    #[test]
    fn the_far_error_has_no_ripple() {
        let mut lock = lock();
        let turn = TAU / 1.1 * 1e-3;
        let mut worst = 0.0f32;
        for tick in 0..30_000u32 {
            let phase = Phase::from_cycles(tick as f32 * (turn / TAU));
            lock.set_phase(phase);
            lock.settle_filter(Radians(hip().at(lock.state.phase).angle));
            // The phase is that of the sample, not the next one, to which `settle_filter` advances.
            if tick > 15_000 {
                worst = worst.max(lock.far_error().0.abs());
            }
        }
        assert!(worst < 0.03, "{worst} rad");
    }

    #[test]
    fn a_sensor_with_offset_and_gain_is_learned() {
        let mut lock = lock();
        let (offset, gain) = (0.14, 0.7);
        let mut phase = Phase(0);
        for _ in 0..30_000 {
            phase += Phase::from_cycles(1e-3 / 1.05);
            lock.step(Radians(offset + 0.1 + gain * (hip().at(phase).angle - 0.1)));
        }
        let (o, g) = lock.sensor();
        assert!((o.0 - offset).abs() < 2e-3 && (g - gain).abs() < 0.01, "{o:?} {g}");
        assert!((lock.frequency().0 - TAU / 1.05).abs() < 0.01);
        let off = phase.cycles_after(lock.phase());
        assert!(off.abs() < 0.002, "{off} cycles");
    }

    #[test]
    fn bad_fields_are_named() {
        type Break = fn(&mut PhaseLockConfig);
        let broken: [(Break, &str); 11] = [
            (|c| c.stride_s = 0.0, "stride_s"),
            (|c| c.bandwidth = RadPerSec(f32::NAN), "bandwidth"),
            (|c| c.frequency_range.0 = 1.1, "frequency_range[0]"),
            (|c| c.frequency_range.1 = 0.9, "frequency_range[1]"),
            (|c| c.sogi.gain = 0.0, "sogi.gain"),
            (|c| c.near_within = Radians(3.0), "near_within"),
            (|c| c.near_after_s = -1.0, "near_after_s"),
            (|c| c.largest_error = Radians(0.0), "largest_error"),
            (|c| c.offset_rate = 6.0, "offset_rate"),
            (|c| c.gain_rate = -0.1, "gain_rate"),
            (|c| c.gain_range.1 = 0.9, "gain_range[1]"),
        ];
        for (broken, name) in broken {
            let mut config = PhaseLockConfig::default();
            broken(&mut config);
            let error = config.build(hip(), Period::MILLISECOND).unwrap_err().to_string();
            assert!(error.contains(name), "{error} does not name {name}");
        }
        let flat = Template::new(Radians(0.1), [0.0; 8], [0.0; 8]).unwrap();
        let error = PhaseLockConfig::default().build(flat, Period::MILLISECOND).unwrap_err().to_string();
        assert!(error.contains("template.fundamental"), "{error}");
        let slow = Period::from_micros(100_000).unwrap();
        assert!(matches!(
            PhaseLockConfig::default().build(hip(), slow),
            Err(BuildError::PeriodTooLong { max_micros: 35_000..36_000, .. })
        ));
    }
}
