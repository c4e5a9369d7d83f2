//! The thesis' network: figures 5.1 to 5.6, its links, the phase of knee and hip, and what the thesis says about its motion.

use cpg_core::Generator;
use cpg_core::gait::named::Gait;
use gait_fit::search::{Network, NetworkState};
use generator_file::file::GeneratorFile;
use generator_file::returns::comes_back;
use joint_units::{Joint, Period};
use picture::links::{Link, Links, Node};
use picture::{Curve, Panel};

use super::claim::{Claim, Paper, Verdict};
use super::figure::Figure;
use crate::charts::motion::{self, Motion};
use crate::set_s;

/// Integration step, s.
const STEP_S: f64 = 1e-3;
/// What figures of the network are computed with.
const SET_S: &str = "eqs 13-16 with alpha and k of Table 1; p, mu and a0, which the thesis does not state, of set S (mu = 5.712 rad/s, amplitudes 20 and \
                     30 deg by harmonic balance, a0 = 5 and 30 deg)";
/// From where the phases of the joints are measured to where, s.
const PHASES_S: [f64; 2] = [300.0, 900.0];

/// The figures.
///
/// # Errors
/// The thesis' gait cannot be built.
pub(super) fn figures() -> Result<Vec<Figure>, String> {
    let motion = five_seconds().map_err(|error| error.to_string())?;
    let parameters =
        format!("{SET_S}; starts on the cycle of harmonic balance; Runge-Kutta, order 4, 1 ms, f32 as on a board");
    let figure = |name, number: &str, what: &str, shows: &str, panel| {
        Figure::new(name, &format!("Thesis, figure {number}: {what}"), shows, &parameters, vec![panel])
    };
    let portraits = [("thesis-5-2", "5.2"), ("thesis-5-3", "5.3"), ("thesis-5-4", "5.4"), ("thesis-5-5", "5.5")];
    let portraits = Joint::ALL.into_iter().zip(&motion).zip(portraits).map(|((joint, points), (name, number))| {
        let words = joint.name().replace('_', " ");
        let shows = "Velocity over angle in the first five seconds.";
        figure(name, number, &format!("phase portrait of the {words}"), shows, motion::portrait(&words, points))
    });
    let angles = "Left and right are half a cycle apart, at the hips and at the knees.";
    let mut figures = vec![links(), figure("thesis-5-1", "5.1", "joint angles", angles, motion::angles(&motion))];
    figures.extend(portraits);
    let rates = "The derivatives of the angles of figure 5.1.";
    figures.push(figure("thesis-5-6", "5.6", "angular velocities", rates, motion::velocities(&motion)));
    figures.push(phases());
    Ok(figures)
}

/// Five seconds of the core's network, a point every 5 ms.
fn five_seconds() -> Result<Motion, cpg_core::BuildError> {
    let mut gait = Gait::Thesis.build(1.0, Period::MILLISECOND)?;
    let mut motion: Motion = Default::default();
    for tick in 0..=5000_u32 {
        if tick % 5 == 0 {
            for (curve, (angle, rate)) in motion.iter_mut().zip(gait.angles().iter().zip(gait.rates())) {
                curve.push((f64::from(tick) * 1e-3, f64::from(angle.degrees()), f64::from(rate.0.to_degrees())));
            }
        }
        gait.step();
    }
    Ok(motion)
}

/// The oscillators and their links.
fn links() -> Figure {
    let network = set_s();
    let names = Joint::ALL.map(|joint| joint.name().replace('_', " "));
    let node = |(number, name): (usize, &String)| Node {
        name: format!("{} {name}", number + 1),
        note: format!("alpha = {:.4}", network.joints[number].alpha),
    };
    // In the order of the ring that the links make: this permutation is its own inverse.
    let ring = [0, 1, 3, 2];
    let nodes = ring.map(|joint| node((joint, &names[joint]))).to_vec();
    // Each link acts on the joint at its head.
    let link = |from: usize, to: usize, gain: f64| Link {
        ends: [ring[from], ring[to]],
        labels: [String::new(), format!("{gain:.4}")],
    };
    let pairs = [[0, 1], [1, 0], [2, 3], [3, 2]].map(|[from, to]| link(from, to, network.joints[to].difference));
    let legs = [[0, 2], [2, 0], [1, 3], [3, 1]].map(|[from, to]| link(from, to, network.joints[to].product));
    Figure::new(
        "thesis-links",
        "Thesis, eqs 13-16: four oscillators and their links",
        "Hips and knees are linked by the difference of their velocities, hip and knee of a leg by the product of velocity and displacement.",
        "Table 1: k12 = k21 = 0.2010, k34 = k43 = 0.3012 (difference links, 1/s), k13 = k31 = 0.0125, k24 = k42 = 0.0129 (product links), alpha in 1/s; a \
         gain is beside the joint on which the link acts",
        vec![Panel::links("links between the joints", Links { nodes, links: pairs.into_iter().chain(legs).collect() })],
    )
}

/// Phase of a joint in its plane of angle and velocity, in cycles.
fn phase(network: &Network, state: &NetworkState, joint: usize) -> f64 {
    let turn = std::f64::consts::TAU;
    f64::atan2(-state.velocity[joint] / network.joints[joint].mu, state.displacement[joint]) / turn
}

/// Time in seconds and how far joint `a` is ahead of joint `b`, in cycles without jumps, once a tenth of a second.
fn lead(network: &Network, a: usize, b: usize, seconds: f64) -> Vec<(f64, f64)> {
    let (mut tick, mut ahead, mut points) = (0_u32, 0.0, vec![]);
    network.each_state(STEP_S, (seconds / STEP_S) as usize, |state| {
        tick += 1;
        if tick % 100 == 0 {
            let now: f64 = phase(network, state, a) - phase(network, state, b);
            ahead =
                if points.is_empty() { now.rem_euclid(1.0) } else { ahead + (now - ahead + 0.5).rem_euclid(1.0) - 0.5 };
            points.push((f64::from(tick) * STEP_S, ahead));
        }
    });
    points
}

/// Mean and slope over the second part of a lead: cycles, cycles per second.
fn mean_and_slope(points: &[(f64, f64)]) -> (f64, f64) {
    let late: Vec<_> = points.iter().filter(|point| point.0 >= PHASES_S[0]).collect();
    let count = late.len() as f64;
    let (t, y) = late.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / count, sum.1 + point.1 / count));
    let moment = |of: fn(f64, f64) -> f64| late.iter().map(|point| of(point.0 - t, point.1 - y)).sum::<f64>();
    (y, moment(|t, y| t * y) / moment(|t, _| t * t))
}

/// Set S with the mu of both knees times a factor.
fn detuned(factor: f64) -> Network {
    let mut network = set_s();
    network.joints[2..].iter_mut().for_each(|knee| knee.mu *= factor);
    network
}

fn phases() -> Figure {
    let curve = |name: &str, factor: f64| {
        let points = lead(&detuned(factor), 2, 0, PHASES_S[1]).into_iter().step_by(20);
        Curve::new(name, points.map(|(t, cycles)| (t, 360.0 * cycles)).collect())
    };
    let curves = vec![curve("equal mu", 1.0), curve("0.5 % more", 1.005), curve("1 % more", 1.01)];
    Figure::new(
        "thesis-hip-knee",
        "The thesis' network: lead of the left knee over the left hip",
        "With the gains of Table 1 nothing holds the phase between hip and knee: it slips, and faster if their frequencies differ.",
        &format!(
            "{SET_S}; mu of the knees as in the legend; start at (25, -15, 45, 15) deg and (0, 0, 100, -100) deg/s; Runge-Kutta, order 4, 1 ms, f64"
        ),
        vec![Panel::curves("phase of the knee less that of the hip", "time, s", "lead, deg", curves)],
    )
}

/// Size of the swing of each joint after some time, from angle and velocity, deg.
fn envelope(network: &Network, seconds: f64) -> [f64; 4] {
    let state = network.run(STEP_S, (seconds / STEP_S) as usize);
    std::array::from_fn(|i| state.displacement[i].hypot(state.velocity[i] / network.joints[i].mu))
}

/// The claims about the network's motion.
///
/// # Errors
/// The thesis' default set is missing.
pub(super) fn claims() -> Result<Vec<Claim>, String> {
    let claim = |id, place, statement, number| Claim::new(Paper::Thesis, id, place, statement, number);
    let network = set_s();
    let antiphase = |a, b| mean_and_slope(&lead(&network, a, b, PHASES_S[1]));
    let (hips, knees, leg) = (antiphase(1, 0), antiphase(3, 2), antiphase(2, 0));
    let mistuned = mean_and_slope(&lead(&detuned(1.01), 2, 0, PHASES_S[1])).1 * 360.0;
    let apart = |(cycles, slope): (f64, f64)| {
        let held = ((cycles.rem_euclid(1.0) - 0.5).abs() < 0.01) && slope.abs() < 1e-5;
        (
            format!("{:.1} deg apart, slip {:.4} deg/s", 360.0 * cycles.rem_euclid(1.0), 360.0 * slope + 0.0),
            Verdict::of(held),
        )
    };
    let set = GeneratorFile::default_of("thesis").ok_or("the default set of the thesis is missing")?.set;
    let orbit = comes_back(&set, 0);
    let (both_hips, both_knees) = (apart(hips), apart(knees));
    let ways = starts(&network);
    Ok(vec![
        claim("hips-antiphase", "figure 5.1", "left and right hip swing half a cycle apart", "180 deg").found(
            both_hips.0,
            both_hips.1,
            "The difference links make the antiphase attract and the motion in phase repel.",
        ),
        claim("knees-antiphase", "figure 5.1", "left and right knee swing half a cycle apart", "180 deg").found(
            both_knees.0,
            both_knees.1,
            "As at the hips.",
        ),
        claim("hip-knee-synchronised", "text", "hip and knee are synchronised", "not stated").found(
            format!("the knee slips by {:.2} deg/s, by {mistuned:.1} deg/s if its mu is 1 % larger", leg.1 * 360.0),
            Verdict::of(leg.1.abs() < 1e-5),
            "The product links act in second order only; with the gains of Table 1 nothing holds that phase.",
        ),
        claim("table-1-limit-cycles", "figures 5.2 to 5.5", "the joints of the network run on limit cycles", "not stated").found(
            orbit.as_ref().map_or_else(|why| why.clone(), |found| format!("period {:.4} s", found.period_s)),
            Verdict::of(orbit.is_ok()),
            "With set S the network keeps its amplitudes and never repeats, because the phase between hip and knee drifts.",
        ),
        claim("figure-5-1-range", "figure 5.1", "Table 1 gives the four angles of the figure, inside of 100 deg", "100 deg").found(
            ways,
            Verdict::Undecided,
            "p, mu, a0 and the start are not stated. Amplitudes grow in tens of seconds, so five seconds show the start, and any start within the axes \
             agrees with the figure.",
        ),
    ])
}

/// What different starts and choices of p give with Table 1.
fn starts(network: &Network) -> String {
    let mut small = *network;
    small.start = NetworkState { displacement: [1.0, -1.0, 1.0, -1.0], velocity: [0.0; 4] };
    let [hip, _, knee, _] = envelope(&small, 5.0);
    let mut isolated = *network;
    for (joint, amplitude) in isolated.joints.iter_mut().zip([20.0, 20.0, 30.0, 30.0]) {
        joint.p = 4.0 / (3.0 * joint.mu * joint.mu * amplitude * amplitude);
    }
    let [left, right, left_knee, right_knee] = envelope(&isolated, 600.0);
    format!(
        "from 1 deg, {hip:.1} deg (hips) and {knee:.1} deg (knees) after 5 s; with p of an isolated oscillator of 20 and 30 deg, {left:.0}, {right:.0}, \
         {left_knee:.0}, {right_knee:.0} deg after 600 s"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States that an eighth-order method gives elsewhere.
    #[test]
    fn the_network_is_that_of_the_oracle() {
        let state = set_s().run(STEP_S, 10_000);
        let angles: Vec<f64> = (0..4).map(|i| state.displacement[i] + set_s().joints[i].offset).collect();
        for (found, wanted) in angles.iter().zip([21.823_675, -12.209_343, 58.293_201, 1.974_953]) {
            assert!((found - wanted).abs() < 1e-4, "{found}, not {wanted}");
        }
    }

    #[test]
    fn phases_are_measured_as_elsewhere() {
        let network = set_s();
        let hips = mean_and_slope(&lead(&network, 1, 0, PHASES_S[1]));
        assert!((hips.0.rem_euclid(1.0) - 0.5).abs() < 1e-3 && hips.1.abs() < 1e-7, "{hips:?}");
        let slip = 360.0 * mean_and_slope(&lead(&network, 2, 0, PHASES_S[1])).1;
        assert!((slip + 0.15).abs() < 0.03, "{slip}");
        for (factor, wanted) in [(1.005, 1.5), (1.01, 3.1)] {
            let slip = 360.0 * mean_and_slope(&lead(&detuned(factor), 2, 0, PHASES_S[1])).1;
            assert!((slip.abs() - wanted).abs() < 0.3, "{factor}: {slip}");
        }
        let mut small = network;
        small.start = NetworkState { displacement: [1.0, -1.0, 1.0, -1.0], velocity: [0.0; 4] };
        let [hip, _, knee, _] = envelope(&small, 5.0);
        assert!((hip - 2.7).abs() < 0.1 && (knee - 4.5).abs() < 0.1, "{hip}, {knee}");
    }
}
