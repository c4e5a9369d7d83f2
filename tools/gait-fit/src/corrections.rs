//! Learns the corrections of a follower from a recording: ridge regression of what its templates miss on what its sensor shows.
//!
//! ```text
//! minimise  sum_t ( a_j(t + d) - s_j(t + d) - sum_ib G_jib B_b(phi(t)) x_i(t) )^2 + N r sum_ib (sigma_ib G_jib)^2
//! ```
//! a_j is the recorded angle of joint j, s_j the setpoint of the follower without corrections, d the delay of a correction
//! ([`delay_ticks`]), x_i and B_b the inputs and terms of [`cpg_core::entrainment::correction`], sigma_ib the standard deviation of their product
//! (1 for the constant, at least `LEAST_DEVIATION`), N the number of rows: one each 10 ms while the follower is locked at full amplitude, without
//! the first 3 s of each lock. The rows are cut into [`SPANS`] spans of time. A ridge r of [`RIDGES`] is chosen for each joint by the error on spans
//! to which it was not fitted, among those whose gains are within [`MAX_GAIN`]; no correction at all is chosen where that error is not smaller
//! without. The error that is reported is the one that chose, so it is a little too small. The gains that are returned are fitted to all rows,
//! those for a span to the rows that are a stride or more from it; the usual innovation is that of all rows.
//!
//! Source: ridge regression, Hoerl and Kennard 1970 (Technometrics 12, 55-67); cross-validation in spans of time, Burman, Chow and Nolan 1994
//! (Biometrika 81, 351-358).

mod outcome;

use std::ops::Range;

use cpg_core::entrainment::correction::{Corrections, INPUTS, MAX_GAIN, TERMS, delay_ticks, terms};
use cpg_core::entrainment::{Follower, Lock};
use cpg_core::{Follow, Generator};
use gait_trace::{LowPass, RawJoints, Rules, condition};
use hgod_adc::{FilterConfig, FilterState};
use joint_loop::FollowConfig;
use joint_units::{Joint, Period, Radians};
use nalgebra::{Cholesky, DMatrix, DVector};

pub use outcome::{JointOutcome, LEAST_STRIDES, NotLearned};

/// Spans of the cross-validation.
pub const SPANS: usize = 10;
/// Ridges r that are tried.
pub const RIDGES: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
/// Ticks from one row to the next.
const STEP: usize = 10;
/// Time of a lock after which rows are used, ticks of 1 ms: the sensor's offset and gain are learned first.
const SETTLE_TICKS: u32 = 3_000;
/// Least standard deviation that a product is scaled by: an input that hardly varies teaches nothing, and gets no large gain.
const LEAST_DEVIATION: f64 = 1e-3;
/// Coefficients of a joint.
const COEFFICIENTS: usize = INPUTS * TERMS;

/// Corrections that were learned.
#[derive(Debug, Clone)]
pub struct Learned {
    /// From the whole recording.
    pub corrections: Corrections,
    /// For spans of ticks, in order and without gaps from the first tick to the last: corrections that were learned from the rest.
    pub held_out: Vec<(Range<usize>, Corrections)>,
    /// What was learned for each joint.
    pub joints: [JointOutcome; Joint::COUNT],
}

impl Learned {
    /// One sentence: the errors with and without, and which joints are not corrected.
    #[must_use]
    pub fn in_words(&self) -> String {
        let joints = Joint::ALL.iter().zip(&self.joints);
        let joints: Vec<String> =
            joints.filter_map(|(joint, outcome)| Some(format!("{} {}", joint.name(), outcome.in_words()?))).collect();
        format!(
            "corrections from the sensor: error in degrees on strides that their gains were not learned from (their ridge was chosen there): {}",
            joints.join(", ")
        )
    }
}

/// What a follower is fed with and what it should do, one value a tick of 1 ms, degrees.
#[derive(Debug, Clone, Copy)]
pub struct Recorded<'a> {
    /// Angle of the measured joint as the follower gets it; `None` where there is no sample.
    pub samples: &'a [Option<f64>],
    /// Angles of the joints; empty for a joint that was not recorded, not finite where it was not measured.
    pub joints: [&'a [f64]; Joint::COUNT],
}

/// Runs the follower, which has no corrections, over the recording and learns what would have corrected it.
///
/// # Errors
/// [`NotLearned::FewStrides`].
pub fn learn(mut follower: Follower, recorded: &Recorded<'_>) -> Result<Learned, NotLearned> {
    let stride_s = std::f64::consts::TAU / f64::from(follower.phase_lock().nominal().0);
    let rows = Rows::of(&mut follower, recorded);
    let stride = stride_s / (STEP as f64 * Period::MILLISECOND.seconds() as f64);
    let strides = rows.at.len() as f64 / stride;
    if strides < LEAST_STRIDES {
        return Err(NotLearned::FewStrides { strides });
    }
    let spans = rows.spans(stride as usize);
    let mut all = Corrections { usual_innovation: rows.innovation, ..Corrections::NONE };
    let mut parts = vec![all; spans.len()];
    let grams = Grams::of(&rows, &spans);
    let joints = Joint::ALL.map(|joint| {
        if recorded.joints[joint as usize].is_empty() {
            return JointOutcome::NotRecorded;
        }
        let wanted = DVector::from_iterator(rows.at.len(), rows.missing.iter().map(|row| row[joint as usize]));
        let rms = |squares: f64| (squares / wanted.len() as f64).sqrt().to_degrees();
        let without_deg = rms(wanted.norm_squared());
        let Some(Gains { whole, of_spans, squares }) = grams.gains(&rows, &spans, &wanted) else {
            return JointOutcome::GainsTooLarge { without_deg };
        };
        let with_deg = rms(squares);
        if with_deg >= without_deg {
            return JointOutcome::NotCloser { without_deg, with_deg };
        }
        all.gains[joint as usize] = whole;
        for (part, gains) in parts.iter_mut().zip(of_spans) {
            part.gains[joint as usize] = gains;
        }
        JointOutcome::Corrected { without_deg, with_deg }
    });
    let inner = spans[1..].iter().map(|span| rows.at[span.tested.start]);
    let cuts: Vec<usize> = std::iter::once(0).chain(inner).chain([recorded.samples.len()]).collect();
    let held_out = cuts.windows(2).map(|pair| pair[0]..pair[1]).zip(parts).collect();
    Ok(Learned { corrections: all, held_out, joints })
}

/// The corrections of a follower on a board: its sensor's angle passes the filter of the board's sensors. The recording is not smoothed, because a
/// filter without lag shows the sensor what comes later.
///
/// # Errors
/// Why there are none.
pub fn on_the_board(config: &FollowConfig, raw: &RawJoints, rules: &Rules) -> Result<Learned, NotLearned> {
    let conditioned = condition(raw, &Rules { low_pass: LowPass::Off, ..*rules }).map_err(unusable)?;
    if conditioned.normalised_cycle {
        return Err(NotLearned::Cycle);
    }
    let period = Period::MILLISECOND;
    let recording = &conditioned.recording;
    let ticks = (recording.duration_s() / f64::from(period.seconds())) as usize;
    let time = |tick: usize| tick as f64 * f64::from(period.seconds());
    let is_lost = |tick: usize| conditioned.unusable.iter().any(|&(from, to)| (from..=to).contains(&time(tick)));
    let start = recording.time_s().first().copied().unwrap_or(0.0);
    let angles = Joint::ALL.map(|joint| {
        let channel = recording.channel(joint.name()).ok();
        channel.map_or(vec![], |channel| (0..ticks).map(|tick| recording.at(channel, start + time(tick))).collect())
    });
    let (filter, mut state) = (FilterConfig::default().build(period).map_err(unusable)?, FilterState::default());
    let sensor = angles[config.sensor as usize].iter().enumerate();
    let samples: Vec<Option<f64>> = sensor
        .map(|(tick, angle)| {
            let filtered = filter.step(&mut state, Radians::from_degrees(*angle as f32));
            (!is_lost(tick)).then_some(f64::from(filtered.degrees()))
        })
        .collect();
    let joints = angles.map(|angles: Vec<f64>| {
        angles.into_iter().enumerate().map(|(tick, angle)| if is_lost(tick) { f64::NAN } else { angle }).collect()
    });
    let templates = config.shape.shapes().map_err(unusable)?;
    let follower = config.entrained().build(templates, config.sensor, period).map_err(unusable)?;
    learn(follower, &Recorded { samples: &samples, joints: joints.each_ref().map(Vec::as_slice) })
}

fn unusable(why: impl std::fmt::Display) -> NotLearned {
    NotLearned::Unusable(why.to_string())
}

/// The rows of the regression.
struct Rows {
    /// Tick of each row.
    at: Vec<usize>,
    /// Products of inputs and terms, a row each, of variance 1 but for the constant.
    products: DMatrix<f64>,
    /// Standard deviations by which the products were divided.
    scale: Vec<f64>,
    /// What the templates miss, rad; 0 for joints that were not recorded.
    missing: Vec<[f64; Joint::COUNT]>,
    /// Root mean square of the innovation.
    innovation: Radians,
}

/// Rows that are estimated, and those that must not be fitted meanwhile.
struct Span {
    tested: Range<usize>,
    left_out: Range<usize>,
}

impl Rows {
    fn of(follower: &mut Follower, recorded: &Recorded<'_>) -> Self {
        let delay = delay_ticks(Period::MILLISECOND) as usize;
        let mut inputs = Vec::with_capacity(recorded.samples.len());
        let mut setpoints = Vec::with_capacity(recorded.samples.len());
        let (mut locked_for, mut innovations) = (0, 0.0);
        for sample in recorded.samples {
            follower.observe(sample.map(|degrees| Radians::from_degrees(degrees as f32)));
            follower.step();
            let walks = follower.status().state == Lock::Locked && follower.amplitude() == 1.0;
            locked_for = if walks { locked_for + 1 } else { 0 };
            let lock = follower.phase_lock();
            let shown = follower.correction_inputs().filter(|_| locked_for >= SETTLE_TICKS);
            inputs.push(shown.map(|inputs| (inputs, lock.phase(), f64::from(lock.innovation().0))));
            setpoints.push((follower.angles(), walks));
        }
        let (mut at, mut products, mut missing) = (vec![], vec![], vec![]);
        for (tick, shown) in inputs.iter().enumerate().step_by(STEP) {
            let Some(((inputs, phase, innovation), (angles, true))) = shown.zip(setpoints.get(tick + delay).copied())
            else {
                continue;
            };
            let missed = Joint::ALL.map(|joint| match recorded.joints[joint as usize] {
                [] => 0.0,
                angle => {
                    angle.get(tick + delay).map_or(f64::NAN, |angle| angle.to_radians())
                        - f64::from(angles[joint as usize].0)
                }
            });
            if missed.iter().all(|missed| missed.is_finite()) {
                let terms = terms(phase);
                at.push(tick);
                innovations += innovation * innovation;
                products.extend(inputs.iter().flat_map(|x| terms.map(|term| f64::from(x * term))));
                missing.push(missed);
            }
        }
        let mut products = DMatrix::from_row_iterator(at.len(), COEFFICIENTS, products);
        let mut scale = vec![1.0; COEFFICIENTS];
        for (column, (mut values, scale)) in products.column_iter_mut().zip(&mut scale).enumerate() {
            if column > 0 {
                *scale = values.variance().sqrt().max(LEAST_DEVIATION);
                values /= *scale;
            }
        }
        let innovation = Radians((innovations / at.len().max(1) as f64).sqrt() as f32);
        Self { at, products, scale, missing, innovation }
    }

    fn spans(&self, stride: usize) -> Vec<Span> {
        let rows = self.at.len();
        let span = |n: usize| {
            let tested = n * rows / SPANS..(n + 1) * rows / SPANS;
            let (first, last) = (self.at[tested.start], self.at[tested.end - 1]);
            let from = self.at.partition_point(|&tick| tick + stride * STEP < first);
            let to = self.at.partition_point(|&tick| tick <= last + stride * STEP);
            Span { tested, left_out: from..to }
        };
        (0..SPANS).map(span).collect()
    }

    /// Gains in the unit of the core; `None` if one is beyond its range.
    fn unscaled(&self, gains: &DVector<f64>) -> Option<[[f32; TERMS]; INPUTS]> {
        let gain = |input: usize, term: usize| {
            let place = input * TERMS + term;
            (gains[place] / self.scale[place]) as f32
        };
        let gains: [[f32; TERMS]; INPUTS] = std::array::from_fn(|input| std::array::from_fn(|term| gain(input, term)));
        gains.as_flattened().iter().all(|gain| gain.abs() <= MAX_GAIN).then_some(gains)
    }
}

/// Sums of the outer products of the rows: of all, and of those that are fitted for a span.
struct Grams {
    all: DMatrix<f64>,
    of_spans: Vec<DMatrix<f64>>,
}

impl Grams {
    fn of(rows: &Rows, spans: &[Span]) -> Self {
        let all = rows.products.tr_mul(&rows.products);
        let without = |span: &Span| {
            let part = rows.products.rows_range(span.left_out.clone());
            &all - part.tr_mul(&part)
        };
        let of_spans = spans.iter().map(without).collect();
        Self { all, of_spans }
    }

    /// The gains of a joint with the best ridge of those whose gains are all within their range.
    fn gains(&self, rows: &Rows, spans: &[Span], wanted: &DVector<f64>) -> Option<Gains> {
        let right = rows.products.tr_mul(wanted);
        let of_ridge = |ridge: f64| -> Option<Gains> {
            let mut squares = 0.0;
            let mut of_spans = Vec::with_capacity(spans.len());
            for (span, gram) in spans.iter().zip(&self.of_spans) {
                let part = rows.products.rows_range(span.left_out.clone());
                let right = &right - part.tr_mul(&wanted.rows_range(span.left_out.clone()));
                let fitted = wanted.len() - span.left_out.len();
                let gains = solved(gram, &right, ridge * fitted as f64)?;
                let tested = rows.products.rows_range(span.tested.clone());
                squares += (tested * &gains - wanted.rows_range(span.tested.clone())).norm_squared();
                of_spans.push(rows.unscaled(&gains)?);
            }
            let whole = rows.unscaled(&solved(&self.all, &right, ridge * wanted.len() as f64)?)?;
            Some(Gains { whole, of_spans, squares })
        };
        let tried = RIDGES.into_iter().filter_map(of_ridge);
        tried.min_by(|one, other| one.squares.total_cmp(&other.squares))
    }
}

/// The gains of a joint, in the unit of the core.
struct Gains {
    whole: [[f32; TERMS]; INPUTS],
    /// For each span, fitted to the other rows.
    of_spans: Vec<[[f32; TERMS]; INPUTS]>,
    /// Sum of the squares that these leave on their spans.
    squares: f64,
}

fn solved(gram: &DMatrix<f64>, right: &DVector<f64>, penalty: f64) -> Option<DVector<f64>> {
    let mut normal = gram.clone();
    (0..normal.nrows()).for_each(|i| normal[(i, i)] += penalty);
    Some(Cholesky::new(normal)?.solve(right))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::entrainment::FollowerConfig;
    use cpg_core::entrainment::phase_lock::Template;
    use cpg_core::waveform::shape::Shape;
    use joint_units::Phase;

    fn template(mean: f32, size: f32, lead: f32) -> Template {
        let (mut cos, mut sin) = ([0.0; 8], [0.0; 8]);
        for (n, part) in [1.0, 0.3].into_iter().enumerate() {
            let turn = std::f32::consts::TAU * lead * (n + 1) as f32;
            (cos[n], sin[n]) = (size * part * turn.cos(), -size * part * turn.sin());
        }
        Template::new(Radians(mean), cos, sin).unwrap()
    }

    fn templates() -> [Template; 4] {
        [template(0.1, 0.35, 0.0), template(0.1, 0.35, 0.5), template(0.4, 0.3, 0.25), template(0.4, 0.3, 0.75)]
    }

    /// Differences from the template in degrees: a random number each 0.3 s, and lines between them.
    fn wander(time_s: f64, seed: u64) -> f64 {
        let at = |place: f64| {
            let mixed = (place as u64 + 1000 * seed).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            4.0 * ((mixed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let place = (time_s / 0.3).max(0.0);
        at(place.floor()) + (at(place.floor() + 1.0) - at(place.floor())) * place.fract()
    }

    /// A person whose left knee differs from its template by twice what the left hip did 0.1 s before, and whose right knee differs by chance.
    fn person(secs: f64) -> [Vec<f64>; 4] {
        let ticks = (secs * 1e3) as usize;
        let joint = |joint: usize, off: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let angle = |time: f64| f64::from(templates()[joint].at(Phase::from_cycles((time / 1.1) as f32)).angle);
            (0..ticks).map(|tick| tick as f64 * 1e-3).map(|time| angle(time).to_degrees() + off(time)).collect()
        };
        [
            joint(0, &|time| wander(time, 1)),
            joint(1, &|_| 0.0),
            joint(2, &|time| 2.0 * wander(time - 0.1, 1)),
            joint(3, &|time| wander(time, 2)),
        ]
    }

    fn learned(angles: &[Vec<f64>; 4]) -> Result<Learned, NotLearned> {
        let follower = FollowerConfig::default().build(templates(), Joint::LeftHip, Period::MILLISECOND).unwrap();
        let samples: Vec<_> = angles[0].iter().copied().map(Some).collect();
        learn(follower, &Recorded { samples: &samples, joints: angles.each_ref().map(Vec::as_slice) })
    }

    #[test]
    fn what_follows_from_the_sensor_is_learned_and_chance_is_not() {
        let learned = learned(&person(90.0)).unwrap();
        let [hip, _, knee, chance] = learned.joints;
        let [hip, knee] = [hip, knee].map(|joint| {
            let JointOutcome::Corrected { without_deg, with_deg } = joint else { panic!("{joint:?}") };
            [without_deg, with_deg]
        });
        assert!(hip[1] < 0.2 * hip[0], "{hip:?}");
        assert!(knee[0] > 2.0 && knee[1] < 0.5 * knee[0], "{knee:?}");
        // The sensor shows a part of it, the phase error.
        let (JointOutcome::Corrected { without_deg, with_deg } | JointOutcome::NotCloser { without_deg, with_deg }) =
            chance
        else {
            panic!("{chance:?}")
        };
        assert!((0.85..1.1).contains(&(with_deg / without_deg)), "{chance:?}");
    }

    /// What the sensor does not show at all is not corrected, and it is said.
    #[test]
    fn a_joint_that_would_be_no_closer_is_not_corrected() {
        let mut angles = person(60.0);
        angles[3].iter_mut().enumerate().for_each(|(tick, angle)| *angle += 10.0 * wander(tick as f64 * 1e-3, 3));
        let learned = learned(&angles).unwrap();
        let JointOutcome::NotCloser { without_deg, with_deg } = learned.joints[3] else {
            panic!("{:?}", learned.joints)
        };
        assert!(with_deg >= without_deg && with_deg < 1.5 * without_deg, "{with_deg} {without_deg}");
        let is_none = |corrections: &Corrections| corrections.gains[3].as_flattened().iter().all(|gain| *gain == 0.0);
        assert!(is_none(&learned.corrections) && learned.held_out.iter().all(|(_, corrections)| is_none(corrections)));
        let words = learned.in_words();
        assert!(
            words.contains("right_knee") && words.contains("not corrected: with a correction it would be"),
            "{words}"
        );
    }

    /// A joint whose gains would be too large is the only one without a correction.
    #[test]
    fn one_joint_with_large_gains_leaves_the_others_theirs() {
        let mut angles = person(60.0);
        // Thirty times what the hip did 0.05 s before.
        angles[3]
            .iter_mut()
            .enumerate()
            .for_each(|(tick, angle)| *angle += 300.0 * wander(tick as f64 * 1e-3 - 0.05, 1));
        let learned = learned(&angles).unwrap();
        assert!(matches!(learned.joints[3], JointOutcome::GainsTooLarge { .. }), "{:?}", learned.joints);
        assert!([0, 2].iter().all(|&joint| matches!(learned.joints[joint], JointOutcome::Corrected { .. })));
        assert!(learned.in_words().contains("not corrected: gains would be beyond 50"), "{}", learned.in_words());
    }

    /// The gains for a span do not depend on what happens in it.
    #[test]
    fn a_span_teaches_nothing_about_itself() {
        let angles = person(60.0);
        let first = learned(&angles).unwrap();
        let (span, gains) = &first.held_out[4];
        let mut other = angles.clone();
        other[2][span.clone()].iter_mut().for_each(|angle| *angle += 0.2);
        let second = learned(&other).unwrap();
        let (_, after) = &second.held_out[4];
        let knee = |of: &Corrections| of.gains[2].as_flattened().to_vec();
        let off = |one: &Corrections, other: &Corrections| {
            knee(one).iter().zip(knee(other)).map(|(one, other)| (one - other).abs()).fold(0.0, f32::max)
        };
        assert!(off(gains, after) < 1e-4, "{}", off(gains, after));
        assert!(off(&first.corrections, &second.corrections) > 1e-3);
        let ends: Vec<usize> = first.held_out.iter().map(|(span, _)| span.end).collect();
        let begins: Vec<usize> = first.held_out.iter().map(|(span, _)| span.start).collect();
        assert_eq!((begins[0], ends[SPANS - 1], &begins[1..]), (0, 60_000, &ends[..SPANS - 1]));
    }

    #[test]
    fn a_short_recording_has_none_and_a_missing_joint_is_not_corrected() {
        // 20 s less the time to lock and 3 s, in strides of 1.1 s.
        let Err(NotLearned::FewStrides { strides }) = learned(&person(20.0)) else { panic!("learned") };
        assert!((12.0..16.0).contains(&strides), "{strides}");
        let why = NotLearned::FewStrides { strides }.to_string();
        assert!(why.contains("not counting the first 3 s of a lock; allowed is 20 or more"), "{why}");
        let mut angles = person(40.0);
        angles[2].clear();
        let learned = learned(&angles).unwrap();
        assert_eq!(learned.joints[2], JointOutcome::NotRecorded);
        assert!(learned.corrections.gains[2].as_flattened().iter().all(|gain| *gain == 0.0));
        assert!(!learned.corrections.is_none());
    }
}
