//! Checks that a fitted network has a stable orbit: simulated at 1 ms as on the board, but in f64, for ten times as many strides as in
//! the search; and that it comes back to it from kicks and random starts, by the measurements of its certificate.

use cpg_core::network::graph::{HipKnee, LeftRight};
use cpg_core::network::thesis::Thesis;
use cpg_core::{Generator as _, OscillatorState};
use gait_trace::stride::cycle::{Cycle, POINTS};
use generator_file::file::{GeneratorSet, ThesisSet};
use generator_file::returns::comes_back;
use joint_units::Period;
use rayon::prelude::*;

use super::side_by_side::{Built, States, side_by_side};

/// Strides of the simulation from the network's own start.
pub const STRIDES: usize = 600;
/// Random starts of the check; the certificate has more.
const STARTS: u32 = 100;
/// Longest control period for which a generator must be valid, microseconds.
const COARSE_MICROS: u32 = 5000;
/// Largest deviation of the orbit's period from the stride's, as a fraction.
const SAME_PERIOD: f64 = 0.01;

/// The result of a check.
pub(crate) struct Check {
    pub(crate) rmse_deg: [f64; 4],
    pub(crate) cycle: Cycle,
    pub(crate) period_s: f64,
    pub(crate) refused_because: Option<String>,
}

impl Check {
    pub(crate) fn accepted(&self) -> bool {
        self.refused_because.is_none()
    }

    pub(crate) fn rmse(&self) -> f64 {
        let rmse = gait_trace::root_mean_square(&self.rmse_deg);
        if rmse.is_finite() { rmse } else { f64::INFINITY }
    }

    pub(crate) fn refused(why: String) -> Self {
        let cycle = Cycle([[f64::NAN; POINTS]; 4]);
        Self { rmse_deg: [f64::INFINITY; 4], cycle, period_s: f64::NAN, refused_because: Some(why) }
    }
}

type Net = Thesis<f64>;

/// A network after the strides of the check: one turn of its orbit, or why it is refused.
pub(crate) type Simulated = Result<Turn, String>;

/// Simulates sets of parameters, side by side.
pub(crate) fn simulate(sets: &[ThesisSet], stride_s: f64) -> Vec<Simulated> {
    let stride = (stride_s * 1e3).round() as usize;
    let built: Vec<Result<Built, String>> = sets.iter().map(build).collect();
    let nets: Vec<Built> = built.iter().filter_map(|built| built.as_ref().ok().cloned()).collect();
    let mut states = side_by_side(&nets, 2 * (stride * STRIDES / 2), Turn::steps(stride)).into_iter();
    let with_states: Vec<Result<(Built, Option<States>), String>> =
        built.into_iter().map(|built| Ok((built?, states.next().flatten()))).collect();
    let one = |built: Result<(Built, Option<States>), String>| {
        let states = match built? {
            (_, Some(states)) => states,
            // At its bounds a network is the core's own.
            (built, None) => alone(built.net, stride)?,
        };
        Turn::of(states, stride).ok_or_else(no_orbit)
    };
    with_states.into_par_iter().map(one).collect()
}

fn build(set: &ThesisSet) -> Result<Built, String> {
    for micros in [1000, COARSE_MICROS] {
        let Some(period) = Period::from_micros(micros) else { continue };
        GeneratorSet::Thesis(*set).build(period).map_err(|rule| rule.to_string())?;
    }
    let config = set.config_of::<f64>();
    let net = config.build::<LeftRight, HipKnee, _>(Period::MILLISECOND).map_err(|rule| rule.to_string())?;
    Ok(Built { config, net })
}

/// The states of a network that may come to its bounds, which may limit it at first.
fn alone(mut net: Net, stride: usize) -> Result<States, String> {
    settle(&mut net, stride * STRIDES / 2);
    if !stays_inside(&mut net, stride * STRIDES / 2) {
        return Err(format!("its states reach their bounds within {STRIDES} strides"));
    }
    let mut states = vec![net.state()];
    for _ in 0..Turn::steps(stride) {
        net.step();
        net.check().map_err(|_| no_orbit())?;
        states.push(net.state());
    }
    Ok(states)
}

fn no_orbit() -> String {
    format!("it has no closed orbit after {STRIDES} strides")
}

/// Checks a set of parameters that was simulated.
pub(crate) fn check(set: &ThesisSet, simulated: Simulated, target: &Cycle, stride_s: f64) -> Check {
    let own = match simulated {
        Ok(own) => own,
        Err(why) => return Check::refused(why),
    };
    let offsets = set.joints.map(|joint| f64::from(joint.offset_deg));
    let period_s = own.period * 1e-3;
    let cycle = own.beginning_as(target, &offsets);
    let another = (period_s / stride_s - 1.0).abs() > SAME_PERIOD;
    let why = if another {
        Some(format!("it settles on an orbit of {period_s:.4} s, the stride is {stride_s:.4} s"))
    } else {
        comes_back(&GeneratorSet::Thesis(*set), STARTS).err()
    };
    Check { rmse_deg: cycle.rmse_deg(target), cycle, period_s, refused_because: why }
}

/// Advances by `steps`; the bounds may limit the states, since the start need not be on the orbit.
fn settle(net: &mut Net, steps: usize) {
    for _ in 0..steps {
        net.step();
    }
}

/// Advances by `steps`; false if a state reaches its bound or is NaN.
fn stays_inside(net: &mut Net, steps: usize) -> bool {
    (0..steps).all(|_| {
        net.step();
        net.check().is_ok()
    })
}

/// One period of an orbit.
pub(crate) struct Turn {
    /// States at each millisecond, for slightly more than one period.
    states: States,
    /// Period, milliseconds.
    period: f64,
}

impl Turn {
    /// Steps in which a period is sought.
    fn steps(stride: usize) -> usize {
        stride * 16 / 10
    }

    /// The period that begins with the states; `None` if they do not return to the first within 1.6 strides.
    fn of(states: States, stride: usize) -> Option<Self> {
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
        // Between milliseconds a parabola gives the time of the smallest distance.
        let [before, here, after] = [nearest - 1, nearest, nearest + 1].map(|k| far(&states[k]));
        let bend = before - 2.0 * here + after;
        let part = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        (here < 0.02 * 0.02).then_some(Self { states, period: nearest as f64 + part })
    }

    /// Displacements at a fraction of the period.
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

    /// The cycle from the start that fits a target best, to a tenth of a point.
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
}

/// Mean square distance relative to the amplitudes.
fn distance(a: &OscillatorState<4, f64>, b: &OscillatorState<4, f64>, amplitude: &OscillatorState<4, f64>) -> f64 {
    let term = |i: usize| {
        ((a.displacement[i] - b.displacement[i]) / amplitude.displacement[i]).powi(2)
            + ((a.velocity[i] - b.velocity[i]) / amplitude.velocity[i]).powi(2)
    };
    (0..4).map(term).sum::<f64>() / 8.0
}
