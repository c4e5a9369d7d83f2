//! Whether a set walks: run as the board runs it, at 1 ms, but in f64, for ten times as many strides as the search had, and from
//! perturbed starts.

use cpg_core::network::graph::{HipKnee, LeftRight};
use cpg_core::network::thesis::Thesis;
use cpg_core::{Generator as _, OscillatorState};
use gait_trace::stride::cycle::{Cycle, POINTS};
use generator_file::file::{GeneratorSet, ThesisSet};
use joint_units::Period;
use rayon::prelude::*;

use super::random::Random;

/// Strides of the run from the set's own start.
pub const STRIDES: usize = 600;
/// Perturbed starts; each state is off by up to 8 percent of its amplitude, left and right differently.
pub const PERTURBED: usize = 16;
/// Strides that a perturbed start is given.
pub const RETURN_STRIDES: usize = 300;
/// The period that a control loop may have at most, of those that every walker is run with, in microseconds.
const COARSE_MICROS: u32 = 5000;
/// A start has come back when its state is this near to the orbit, as a root mean square in parts of the amplitudes. It begins about
/// 0.046 away; where nothing locks the joints, phases keep most of that, and no joint leaves. The points of the orbit are 0.004 apart.
const NEAR: f64 = 0.01;

/// By how much the orbit's period may differ from the stride's, as a part of it.
const SAME_PERIOD: f64 = 0.01;

/// What was found.
pub(crate) struct Check {
    pub(crate) rmse_deg: [f64; 4],
    pub(crate) cycle: Cycle,
    pub(crate) period_s: f64,
    pub(crate) perturbed: usize,
    pub(crate) perturbed_lost: usize,
    pub(crate) refused_because: Option<String>,
}

impl Check {
    pub(crate) fn accepted(&self) -> bool {
        self.refused_because.is_none()
    }

    pub(crate) fn rmse(&self) -> f64 {
        let rmse = (self.rmse_deg.iter().map(|r| r * r).sum::<f64>() / 4.0).sqrt();
        if rmse.is_finite() { rmse } else { f64::INFINITY }
    }

    pub(crate) fn refused(why: String) -> Self {
        let cycle = Cycle([[f64::NAN; POINTS]; 4]);
        Self {
            rmse_deg: [f64::INFINITY; 4],
            cycle,
            period_s: f64::NAN,
            perturbed: 0,
            perturbed_lost: 0,
            refused_because: Some(why),
        }
    }
}

type Net = Thesis<f64>;

/// Runs a set.
pub(crate) fn check(set: &ThesisSet, target: &Cycle, stride_s: f64) -> Check {
    for micros in [1000, COARSE_MICROS] {
        let Some(period) = Period::from_micros(micros) else { continue };
        if let Err(rule) = GeneratorSet::Thesis(*set).build(period) {
            return Check::refused(rule.to_string());
        }
    }
    let built = set.config_of::<f64>().build::<LeftRight, HipKnee, _>(Period::MILLISECOND);
    let mut net: Net = match built {
        Ok(net) => net,
        Err(rule) => return Check::refused(rule.to_string()),
    };
    let stride = (stride_s * 1e3).round() as usize;
    let offsets = set.joints.map(|joint| f64::from(joint.offset_deg));
    settle(&mut net, stride * STRIDES / 2);
    if !walk(&mut net, stride * STRIDES / 2) {
        return Check::refused(format!("it leaves its bounds within {STRIDES} strides"));
    }
    let Some(own) = Turn::of(&mut net, stride) else {
        return Check::refused(format!("it has no closed orbit after {STRIDES} strides"));
    };
    let period_s = own.period * 1e-3;
    let cycle = own.beginning_as(target, &offsets);
    let another = (period_s / stride_s - 1.0).abs() > SAME_PERIOD;
    let mut random = Random::new(8);
    let starts: Vec<OscillatorState<4, f64>> = (0..PERTURBED).map(|k| own.perturbed(k, &mut random)).collect();
    let lost: Vec<bool> = starts.par_iter().map(|start| own.loses(&net, start, stride)).collect();
    let perturbed_lost = lost.iter().filter(|lost| **lost).count();
    let why = if another {
        Some(format!("it settles on an orbit of {period_s:.4} s, the stride is {stride_s:.4} s"))
    } else {
        (perturbed_lost > 0).then(|| format!("{perturbed_lost} of {PERTURBED} perturbed starts do not come back"))
    };
    Check {
        rmse_deg: cycle.rmse_deg(target),
        cycle,
        period_s,
        perturbed: PERTURBED,
        perturbed_lost,
        refused_because: why,
    }
}

/// So many steps, in which the bounds may hold the states: a start need not be on the orbit.
fn settle(net: &mut Net, steps: usize) {
    for _ in 0..steps {
        net.step();
    }
}

/// So many steps; false if a state comes to its bound or is no number.
fn walk(net: &mut Net, steps: usize) -> bool {
    (0..steps).all(|_| {
        net.step();
        net.check().is_ok()
    })
}

/// One turn of an orbit.
struct Turn {
    /// States at each millisecond, a little more than one period of them.
    states: Vec<OscillatorState<4, f64>>,
    /// Milliseconds.
    period: f64,
    /// Greatest displacement and velocity from the middle.
    amplitude: OscillatorState<4, f64>,
}

impl Turn {
    /// The turn that begins now; none if it does not come back to where it began within 1.6 strides.
    fn of(net: &mut Net, stride: usize) -> Option<Self> {
        let mut states = vec![net.state()];
        for _ in 0..stride * 16 / 10 {
            net.step();
            net.check().ok()?;
            states.push(net.state());
        }
        let spread = |of: &dyn Fn(&OscillatorState<4, f64>) -> f64| {
            let (low, high) = states.iter().map(of).fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            (0.5 * (high - low)).max(1e-9)
        };
        let amplitude = OscillatorState {
            displacement: std::array::from_fn(|i| spread(&|s| s.displacement[i])),
            velocity: std::array::from_fn(|i| spread(&|s| s.velocity[i])),
        };
        let far = |s: &OscillatorState<4, f64>| distance(s, &states[0], &amplitude);
        let nearest = (stride / 2..states.len() - 1).min_by(|&a, &b| far(&states[a]).total_cmp(&far(&states[b])))?;
        // Between milliseconds: where the distance, as a parabola of time, is least.
        let [before, here, after] = [nearest - 1, nearest, nearest + 1].map(|k| far(&states[k]));
        let bend = before - 2.0 * here + after;
        let part = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        (here < 0.02 * 0.02).then_some(Self { states, period: nearest as f64 + part, amplitude })
    }

    /// Displacements at a part of the turn.
    fn at(&self, part: f64) -> [f64; 4] {
        let time = part.rem_euclid(1.0) * self.period;
        let k = (time as usize).min(self.states.len() - 2);
        let t = time - k as f64;
        let (a, b) = (&self.states[k].displacement, &self.states[k + 1].displacement);
        std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
    }

    fn cycle(&self, begin: f64, offsets: &[f64; 4]) -> Cycle {
        let mut cycle = Cycle([[0.0; POINTS]; 4]);
        for k in 0..POINTS {
            for (joint, x) in self.at(begin + k as f64 / POINTS as f64).into_iter().enumerate() {
                cycle.0[joint][k] = x + offsets[joint];
            }
        }
        cycle
    }

    /// The turn from where it is nearest to a target, to a tenth of a point.
    fn beginning_as(&self, target: &Cycle, offsets: &[f64; 4]) -> Cycle {
        let error = |begin: f64| -> f64 { self.cycle(begin, offsets).rmse_deg(target).iter().map(|r| r * r).sum() };
        let least = |tries: &mut dyn Iterator<Item = f64>| {
            tries.map(|begin| (error(begin), begin)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, begin)| begin)
        };
        let point = 1.0 / POINTS as f64;
        let coarse = least(&mut (0..POINTS).map(|k| k as f64 * point));
        let begin = least(&mut (-10..=10).map(|k| coarse + 0.1 * f64::from(k) * point));
        self.cycle(begin, offsets)
    }

    /// A state of the turn, each coordinate off by up to 8 percent of its amplitude.
    fn perturbed(&self, k: usize, random: &mut Random) -> OscillatorState<4, f64> {
        let mut state = self.states[k * self.period as usize / PERTURBED];
        for i in 0..4 {
            state.displacement[i] += 0.08 * (2.0 * random.unit() - 1.0) * self.amplitude.displacement[i];
            state.velocity[i] += 0.08 * (2.0 * random.unit() - 1.0) * self.amplitude.velocity[i];
        }
        state
    }

    /// Whether a start is not on this orbit after its strides.
    fn loses(&self, net: &Net, start: &OscillatorState<4, f64>, stride: usize) -> bool {
        let mut net = *net;
        if net.set_state(start).is_err() {
            return true;
        }
        settle(&mut net, stride * RETURN_STRIDES / 2);
        if !walk(&mut net, stride * RETURN_STRIDES / 2) {
            return true;
        }
        let now = net.state();
        let nearest = self.states.iter().map(|s| distance(s, &now, &self.amplitude)).fold(f64::MAX, f64::min);
        nearest.sqrt() > NEAR
    }
}

/// Mean square distance in parts of the amplitudes.
fn distance(a: &OscillatorState<4, f64>, b: &OscillatorState<4, f64>, amplitude: &OscillatorState<4, f64>) -> f64 {
    let term = |i: usize| {
        ((a.displacement[i] - b.displacement[i]) / amplitude.displacement[i]).powi(2)
            + ((a.velocity[i] - b.velocity[i]) / amplitude.velocity[i]).powi(2)
    };
    (0..4).map(term).sum::<f64>() / 8.0
}
