//! Estimates phase and cadence of a person from the angle of one joint: a hybrid phase-locked loop of second order.
//!
//! ```text
//! far:   r = arg[ (x + j q) conj(X(phi) + j Q(phi)) ]                                  x, q from the SOGI, X, Q its response to S
//! near:  r = clip( e g S'(phi) / mean(S'^2), r_max ),   e = y - (o + a0 + g (S(phi) - a0))
//!        o' = eta_o e,   g' = eta_g e (S - a0) / mean((S - a0)^2)
//! phi' = w + 2 wn r,   w' = wn^2 r
//! ```
//! S(phi) is the template of the measured joint (a0 its mean, S' its slope per radian of phase), y the measured angle, o and g the
//! learned offset and gain of the sensor, r the phase error in radians; w is held within stated factors of the nominal frequency.
//!
//! *Far* compares the response of the SOGI (second-order generalised integrator, [`crate::entrainment::quadrature_filter`]) to the signal
//! with its response to the template at that phase (a Fourier series in phi, computed once). This error has one zero only, so that every
//! start finds it, and no ripple, because both sides contain the template's harmonics. *Near* is the gradient of the squared innovation: it
//! follows faster and uses the whole waveform, but has false zeros where the waveform is flat. Near therefore begins once the far error has
//! been small for a while, and ends as soon as it is not. The damping is 1, so the bandwidth wn (rad/s) is the only parameter to tune: 2.5
//! follows a step of cadence in about 1.3 s; it is wider for a second after a search. Offset and gain are learned as a mean at first, then
//! at fixed rates.
//!
//! The cost of a step is constant: one arc tangent, one sine, two divisions, one square root. Samples must be finite; [`crate::entrainment`]
//! checks that and every other sensor fault.

use core::f32::consts::{PI, TAU};

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::entrainment::quadrature_filter::{MAX_TURN, Sogi, SogiConfig, settled_gain};
use crate::error::{allow_period, in_range};
use crate::math::trig::atan2;
use crate::waveform::shape::{FourierShape, Shape};
use crate::{BuildError, Field, StateFault};

/// Harmonics of a template: eight follow the mean stride of a person within a fifth of a degree.
pub const TEMPLATE_HARMONICS: usize = 8;

/// The waveform of a joint over the gait phase.
pub type Template = FourierShape<TEMPLATE_HARMONICS>;

/// Harmonics of the SOGI's response that are compared: the fourth is attenuated 20 times.
const FILTERED: usize = 3;

/// Parameters of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseLockConfig {
    /// Stride time of the template's person, s: the first estimate of a search; 0.3 to 5.
    pub stride_s: f32,
    /// Bandwidth wn in rad/s; 0.5 to 5.
    pub bandwidth: RadPerSec,
    /// Least and largest frequency, as factors of the nominal one; 0.1 to 1 and 1 to 4.
    pub frequency_range: (f32, f32),
    /// Gains of the quadrature filter.
    pub sogi: SogiConfig,
    /// Largest far error in near; 0.1 to 1.5 rad.
    pub near_within: Radians,
    /// Time for which the far error has to be within half of that before near begins, s; 0.02 to 5.
    pub near_after_s: f32,
    /// Time for which the filter settles before its phase is used, s; nothing is driven meanwhile, so that phase may jump; 0 to 2.
    pub fill_s: f32,
    /// Largest phase error r_max of one sample in near; 0.05 to 1.5 rad.
    pub largest_error: Radians,
    /// Rate eta_o at which the offset is learned, 1/s; 0 to 5.
    pub offset_rate: f32,
    /// Rate eta_g at which the gain is learned, 1/s; 0 to 5.
    pub gain_rate: f32,
    /// Least and largest gain; 0.1 to 1 and 1 to 5.
    pub gain_range: (f32, f32),
}

impl Default for PhaseLockConfig {
    /// A stride of 1.1 s, wn = 2.5 rad/s, frequencies from 0.3 to 2.5 times the nominal, near within 34 degrees, gains from a half to double.
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
    /// Validates and folds for a template and a control period.
    ///
    /// # Errors
    /// Names the field that is out of range, `template.fundamental` (in radians) for a joint that hardly moves, `PeriodTooLong` for
    /// fewer than 13 ticks of the fastest stride.
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
        Ok(PhaseLock {
            config: *self,
            template,
            filtered: filtered(&template, &self.sogi)?,
            moments,
            period_s: period.seconds(),
            nominal,
            state: LockState::new(template.mean(), nominal, self.fill_s),
        })
    }
}

/// The settled response of the SOGI to the template: x and q over the phase.
type Filtered = [FourierShape<FILTERED>; 2];

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
    /// mean(S'^2).
    pub square_slope: f32,
    /// mean(|S'|): a quarter of it times 2 pi is the mean half range.
    pub absolute_slope: f32,
}

impl Moments {
    /// Of a template; sums over 256 points are exact for eight harmonics, except for the mean of |S'|.
    #[must_use]
    pub(crate) fn of(template: &Template) -> Self {
        let (_, cos, sin) = template.coefficients();
        let first = |list: &[f32; TEMPLATE_HARMONICS]| list.first().copied().unwrap_or(0.0);
        let fundamental = libm::sqrtf(first(cos) * first(cos) + first(sin) * first(sin));
        let mut moments = Self { fundamental, variance: 0.0, square_slope: 0.0, absolute_slope: 0.0 };
        for step in 0..256u32 {
            let point = template.at(Phase(step << 24));
            let (off, slope) = (point.angle - template.mean(), point.slope / TAU);
            moments.variance += off * off / 256.0;
            moments.square_slope += slope * slope / 256.0;
            moments.absolute_slope += slope.abs() / 256.0;
        }
        moments
    }
}

/// Offset and gain are first learned at the rate 1 / (this + time), in s.
const FIRST_LEARNING_S: f32 = 1.0;

/// Additional bandwidth right after a search, and its rate of decay: an error of 40 % in frequency is corrected a second sooner.
const WIDENING: f32 = 1.0;
/// See [`WIDENING`].
const WIDENING_S: f32 = 0.7;

/// The phase-locked loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseLock {
    config: PhaseLockConfig,
    template: Template,
    filtered: Filtered,
    moments: Moments,
    period_s: f32,
    nominal: f32,
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
    /// Additional bandwidth; decays after a search.
    widening: f32,
    far_error: f32,
    /// The error r of the last step.
    error: f32,
    innovation: f32,
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
            far_error: PI,
            error: 0.0,
            innovation: 0.0,
        }
    }
}

impl PhaseLock {
    /// One period with the measured angle at its end, which must be finite.
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
        let bandwidth = config.bandwidth.0 * (1.0 + self.state.widening);
        self.state.widening -= self.state.widening * t / WIDENING_S;
        self.advance(2.0 * bandwidth * self.state.error);
        let turn = self.state.frequency * t;
        self.state.sogi.step(&config.sogi, y, turn);

        let far = self.compare();
        self.state.far_error = far;
        let limit = config.near_within.0;
        let large_enough = self.relative_amplitude() > 0.4;
        self.state.small_for = if far.abs() < 0.5 * limit && large_enough { self.state.small_for + t } else { 0.0 };
        if self.state.near && (far.abs() > limit || !large_enough) {
            self.state.near = false;
        } else if !self.state.near && self.state.small_for >= config.near_after_s {
            self.state.near = true;
            self.take_over();
        }

        let point = self.template.at(self.state.phase);
        let (off, slope) = (point.angle - self.template.mean(), point.slope * (1.0 / TAU));
        let e = y - (self.state.offset + self.template.mean() + self.state.gain * off);
        self.state.innovation = e;
        let error = if self.state.near {
            let limit = config.largest_error.0;
            // At first like a mean over all samples so far: the values from the filter may be wrong by much.
            self.state.near_for += t;
            let first_rate = 1.0 / (FIRST_LEARNING_S + self.state.near_for);
            self.state.offset += config.offset_rate.max(first_rate) * e * t;
            let gain = self.state.gain + config.gain_rate.max(first_rate) * e * off / self.moments.variance * t;
            self.state.gain = gain.max(config.gain_range.0).min(config.gain_range.1);
            (e * self.state.gain * slope / self.moments.square_slope).max(-limit).min(limit)
        } else {
            far
        };
        self.state.error = error;
        self.set_frequency(self.state.frequency + bandwidth * bandwidth * error * t);
    }

    /// One period without a measured angle: the phase advances at the estimated frequency.
    pub fn coast(&mut self) {
        self.state.error = 0.0;
        self.advance(0.0);
        self.state.sogi.coast(&self.config.sogi, self.state.frequency * self.period_s);
    }

    /// One period in which the measured angle only settles the filter, and the phase advances by itself.
    pub fn settle_filter(&mut self, angle: Radians) {
        self.begin(angle.0);
        self.state.error = 0.0;
        self.advance(0.0);
        self.state.sogi.step(&self.config.sogi, angle.0, self.state.frequency * self.period_s);
        self.state.far_error = self.compare();
        let point = self.template.at(self.state.phase);
        self.state.innovation = angle.0
            - (self.state.offset + self.template.mean() + self.state.gain * (point.angle - self.template.mean()));
    }

    /// Sets the phase, as an event does.
    pub const fn set_phase(&mut self, phase: Phase) {
        self.state.phase = phase;
        self.state.error = 0.0;
    }

    /// Sets the frequency, held within the configured range.
    pub fn set_frequency(&mut self, frequency: f32) {
        let (least, most) = self.config.frequency_range;
        self.state.frequency = frequency.max(self.nominal * least).min(self.nominal * most);
    }

    /// Starts again in far, at the phase of the filter.
    pub fn search(&mut self) {
        self.state.near = false;
        self.state.near_for = 0.0;
        self.state.small_for = 0.0;
        self.state.widening = WIDENING;
        // The far error is the distance to the phase at which the filtered template has the angle of the filtered signal. The response
        // does not rotate uniformly, so a second iteration is needed.
        for _ in 0..3 {
            self.state.phase += Phase::from_cycles(self.compare() * (1.0 / TAU));
        }
        self.state.error = 0.0;
    }

    /// Begins a search: the filter settles first.
    pub const fn refill(&mut self) {
        self.state.near = false;
        self.state.small_for = 0.0;
        self.state.fill = self.config.fill_s;
    }

    /// Returns to the built state.
    pub fn reset(&mut self) {
        self.state = LockState::new(self.template.mean(), self.nominal, self.config.fill_s);
    }

    /// Gait phase of the person.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.state.phase
    }

    /// Angular frequency w of the stride.
    #[must_use]
    pub const fn frequency(&self) -> RadPerSec {
        RadPerSec(self.state.frequency)
    }

    /// Nominal angular frequency.
    #[must_use]
    pub const fn nominal(&self) -> RadPerSec {
        RadPerSec(self.nominal)
    }

    /// Whether it is near: locked on the waveform.
    #[must_use]
    pub const fn is_near(&self) -> bool {
        self.state.near
    }

    /// The far error, -pi to pi.
    #[must_use]
    pub const fn far_error(&self) -> Radians {
        Radians(self.state.far_error)
    }

    /// The phase error r of the last step.
    #[must_use]
    pub const fn error(&self) -> Radians {
        Radians(self.state.error)
    }

    /// The measured angle less the predicted one.
    #[must_use]
    pub const fn innovation(&self) -> Radians {
        Radians(self.state.innovation)
    }

    /// The predicted angle, with the learned offset and gain.
    #[must_use]
    pub fn predicted(&self) -> Radians {
        let (mean, point) = (self.template.mean(), self.template.at(self.state.phase));
        Radians(self.state.offset + mean + self.state.gain * (point.angle - mean))
    }

    /// Predicted rates at the phase less `part`, at the phase, and at the phase plus `part`, rad/s.
    #[must_use]
    pub fn predicted_rates(&self, cycles: f32) -> [f32; 3] {
        let scale = self.state.gain * self.state.frequency * (1.0 / TAU);
        [-cycles, 0.0, cycles].map(|by| scale * self.template.at(self.state.phase + Phase::from_cycles(by)).slope)
    }

    /// Learned offset and gain of the sensor.
    #[must_use]
    pub const fn sensor(&self) -> (Radians, f32) {
        (Radians(self.state.offset), self.state.gain)
    }

    /// Amplitude of the fundamental, relative to that of the template at this phase.
    #[must_use]
    pub fn relative_amplitude(&self) -> f32 {
        let [x, q] = self.filtered.map(|shape| shape.at(self.state.phase).angle);
        let expected = libm::sqrtf(x * x + q * q).max(0.25 * self.moments.fundamental);
        self.state.sogi.amplitude() / expected
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

    /// Starts the filter at the more likely level: the template's mean, or the sample if it is far from the mean.
    fn begin(&mut self, y: f32) {
        if !self.state.begun {
            let mean = self.template.mean();
            let level = if (y - mean).abs() > 2.2 * self.moments.fundamental { y } else { mean };
            self.state.sogi = Sogi::at_rest(level);
            self.state.begun = true;
        }
    }

    fn advance(&mut self, correction: f32) {
        let rate = (self.state.frequency + correction).max(-self.nominal).min(4.0 * self.nominal);
        self.state.phase += Phase::from_cycles(rate * self.period_s * (1.0 / TAU));
    }

    /// The offset according to the filter. The filter's amplitude is not used: its frequency was set just before.
    fn take_over(&mut self) {
        self.state.offset = self.state.sogi.mean - self.template.mean();
    }

    fn compare(&self) -> f32 {
        let [x, q] = self.filtered.map(|shape| shape.at(self.state.phase).angle);
        let Sogi { fundamental, quadrature, .. } = self.state.sogi;
        atan2(quadrature * x - fundamental * q, fundamental * x + quadrature * q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// In far, at lock, the error has no ripple although the template has harmonics: both sides are filtered alike.
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
