//! The thesis' network against a recorded stride of a person: with Table 1, and with every parameter free.

use gait_fit::search::{Evaluator, Network, Random, SearchSettings, fit_thesis};
use gait_fit::series::Series;
use gait_trace::Strides;
use gait_trace::root_mean_square;
use gait_trace::stride::cycle::{Cycle, POINTS};
use joint_units::Joint;
use picture::{Curve, Panel};

use super::claim::{Claim, Paper, Verdict};
use super::figure::Figure;
use super::problem::Problem;
use super::settings::Settings;
use crate::levenberg::levenberg_from_many;
use crate::{Genes, Grid, Objective, Parameter, Target, angles, reference_errors, set_s};

/// Strides of the target, one after the other.
const STRIDES: usize = 5;
/// Seconds between samples of the target.
const SAMPLE_S: f64 = 5e-3;

/// The figure and the claims.
pub(super) fn run(settings: &Settings, strides: &Strides, progress: &mut dyn FnMut(&str)) -> (Figure, Vec<Claim>) {
    let (stride, period_s) = (strides.cycles()[0].clone(), strides.period_s);
    progress("a person's stride, Table 1 fixed");
    let target = repeated(&stride, period_s);
    let (network, fixed) = with_table_1(settings, &target);
    progress("a person's stride, all parameters free");
    let search = SearchSettings {
        seed: settings.seed,
        evaluations: settings.evaluations_for_person(),
        ..SearchSettings::default()
    };
    let free = fit_thesis(&stride, period_s, &search, &mut |_| ());
    let sinusoid = root_mean_square(&stride.0.each_ref().map(|points| Series::through(points, 1).rmse(points)));
    let next = strides.cycles().get(1).map(|next| root_mean_square(&stride.rmse_deg(next)));
    (figure(settings, &target, &network, fixed), claims(fixed, sinusoid, &free.rmse_deg, next))
}

/// The stride again and again.
fn repeated(stride: &Cycle, period_s: f64) -> Target {
    let at = |time: f64, joint: usize| {
        let place = (time / period_s).rem_euclid(1.0) * POINTS as f64;
        let (first, part) = (place as usize % POINTS, place.fract());
        let points = &stride.0[joint];
        points[first] + part * (points[(first + 1) % POINTS] - points[first])
    };
    let count = (STRIDES as f64 * period_s / SAMPLE_S) as usize;
    let times = (1..=count).map(|k| k as f64 * SAMPLE_S);
    let angles = times.clone().map(|time| std::array::from_fn(|joint| at(time, joint))).collect();
    let rate = |time: f64, joint| (at(time + 1e-3, joint) - at(time - 1e-3, joint)) / 2e-3;
    let rates = times.map(|time| std::array::from_fn(|joint| rate(time, joint))).collect();
    Target { sample_s: SAMPLE_S, angles, rates }
}

/// The best network with alpha and k of Table 1, and its error, degrees.
fn with_table_1(settings: &Settings, target: &Target) -> (Network, f64) {
    let free = [Parameter::P, Parameter::Mu, Parameter::Offset, Parameter::Displacement, Parameter::Velocity];
    let genes = Genes::of(set_s(), &free);
    let problem = Problem { genes: &genes, target, objective: Objective::ANGLE };
    let mut costs = |points: &[Vec<f64>]| problem.costs(points);
    let mut residuals = |points: &[Vec<f64>]| problem.residuals(points);
    let mut quiet = |_| ();
    let budget = settings.evaluations_with_table_1();
    let mut evaluator = Evaluator::new(genes.count(), &mut costs, &mut quiet).with_budget(budget);
    levenberg_from_many(&mut evaluator, &mut residuals, &mut Random::new(settings.seed));
    let champion = genes.decode(evaluator.best().unwrap_or_default());
    (champion, reference_errors(&champion, target, Grid::FINE).rmse_deg())
}

fn figure(settings: &Settings, target: &Target, network: &Network, rmse: f64) -> Figure {
    let own = angles(std::slice::from_ref(network), target, Grid::FINE).swap_remove(0);
    let curve = |name, of: &[[f64; 4]], joint: usize| {
        let points = of.iter().enumerate().map(|(k, angles)| ((k + 1) as f64 * SAMPLE_S, angles[joint]));
        Curve::new(name, points.collect())
    };
    let panel = |joint: Joint| {
        let curves = vec![curve("person", &target.angles, joint as usize), curve("network", &own, joint as usize)];
        Panel::curves(&joint.name().replace('_', " "), "time, s", "angle, deg", curves)
    };
    Figure::new(
        "thesis-person",
        "The thesis' network with Table 1 against a person",
        "A recorded stride, repeated, and the nearest network with alpha and k of Table 1: sinusoids.",
        &format!(
            "eqs 13-16, alpha and k of Table 1; p, mu, a0 and start (20 numbers) by Levenberg-Marquardt from many starts, {} evaluations, seed {}: {rmse:.2} deg RMSE; recording: a \
             healthy adult, Fukuchi et al. 2018 (CC BY 4.0)",
            settings.evaluations_with_table_1(),
            settings.seed
        ),
        [Joint::LeftHip, Joint::LeftKnee].map(panel).to_vec(),
    )
}

fn claims(fixed: f64, sinusoid: f64, free: &[f64; 4], next: Option<f64>) -> Vec<Claim> {
    let claim = |id, place, statement, number| Claim::new(Paper::Thesis, id, place, statement, number).by_search();
    let [a, b, c, d] = free;
    let all = root_mean_square(free);
    // A fit that is as near as the next stride of the same person is as good as any can be.
    let level = next.unwrap_or(0.0);
    let strides = next.map_or_else(String::new, |next| format!("; the person's next stride differs by {next:.1} deg"));
    vec![
        claim("table-1-person", "Table 1, figure 5.1", "with Table 1 the network has the recorded angles of a person", "0.001, no unit").found(
            format!("{fixed:.2} deg with p, mu, a0 and start free; the best sinusoid {sinusoid:.2} deg{strides}"),
            Verdict::of(fixed <= level),
            "The gains of Table 1 give no second harmonic, which a knee needs. The thesis' recording is not at hand; this is another healthy adult.",
        ),
        claim("error-0.001-person", "text", "fitted to a person the error converges to 0.001", "0.001, no unit").found(
            format!("{all:.1} deg ({a:.1} {b:.1} {c:.1} {d:.1}) on a stable orbit, all parameters free{strides}"),
            Verdict::of(all <= level),
            "Two product terms deform the sinusoids too little for a knee, and consecutive strides of a person differ by more than 0.001.",
        ),
    ]
}
