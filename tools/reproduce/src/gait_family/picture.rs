//! The picture of `docs/gaits.md`.

use gait_fit::contact::CycleStart;
use gait_fit::generator_cycle::aligned;
use gait_trace::stride::cycle::POINTS;
use joint_units::Joint;
use picture::{Band, Bars, Curve, Panel, draw_captioned};

use crate::gait_family::errors::{JointErrors, over_all};
use crate::gait_family::study::{Fitted, Study};

/// The picture: the family at both ends of its cadences before what was recorded, and the errors without the person.
///
/// The bands are the recordings below and above the middle of the cadences, from the lowest to the highest angle, each recording at the phase of
/// the family and at its mean angle.
///
/// # Errors
/// The message of the drawing library.
pub fn picture(study: &Study) -> Result<String, String> {
    let both = [("walk", &study.walk), ("run", &study.run)];
    let mut panels: Vec<Panel> =
        both.iter().flat_map(|(name, fitted)| [0, 2].map(|index| angles(name, fitted, index))).collect();
    for (name, fitted) in both {
        let [_, _, family, mean] = over_all(&fitted.recordings, &fitted.without_means);
        let bar = |name: &str, errors: JointErrors, left: usize| {
            let pooled = (0.5 * (errors[left].powi(2) + errors[left + 1].powi(2))).sqrt();
            Bars { name: name.into(), spans: vec![(0.0, pooled)] }
        };
        let rows = vec![
            bar("hip, family", family, 0),
            bar("hip, mean", mean, 0),
            bar("knee, family", family, 2),
            bar("knee, mean", mean, 2),
        ];
        panels.push(Panel::bars(&format!("{name}, a person who was not fitted"), "RMSE of the shape, deg", "", rows));
    }
    let caption = [
        "A line is the family at that number of steps a minute. A band is the persons below (blue) and above (orange) the middle of the cadences,",
        "from the lowest to the highest angle. 0 % of a walk is heel strike, estimated from hip and knee; 0 % of a run is the most flexed hip, as its",
        "heel strike is not estimated.",
    ];
    draw_captioned("Walks and runs of persons, and the family", &panels, 2, &caption.map(String::from))
}

/// One joint of the family at both ends, before the recordings.
fn angles(name: &str, fitted: &Fitted, index: usize) -> Panel {
    let percent = |k: usize| 100.0 * k as f64 / POINTS as f64;
    let start = |end: usize| CycleStart::of(&fitted.ends[end].cycle(), Some(fitted.cadences[end]));
    let joint = Joint::ALL[index];
    let curve = |end: usize| {
        let values = start(end).own_cycle(&fitted.ends[end].cycle(), joint);
        // The first point is drawn again at 100 %.
        let points = (0..=POINTS).map(|k| (percent(k), values[k % POINTS])).collect();
        Curve::new(&format!("{} /min", fitted.cadences[end]), points)
    };
    let middle = f64::midpoint(fitted.cadences[0], fitted.cadences[1]);
    let band = |end: usize| {
        let family = fitted.ends[end].cycle();
        let level = |values: &[f64; POINTS]| values.iter().sum::<f64>() / POINTS as f64;
        let of_end = fitted.recordings.iter().filter(|one| (one.cadence > middle) == (end == 1));
        let own: Vec<[f64; POINTS]> = of_end
            .map(|one| {
                let values = start(end).own_cycle(&aligned(&one.mean, &family).0, joint);
                let shift = level(&family.0[index]) - level(&values);
                values.map(|angle| angle + shift)
            })
            .collect();
        let edge = |k: usize| {
            let at = own.iter().map(|values| values[k % POINTS]);
            (percent(k), at.clone().fold(f64::MAX, f64::min), at.fold(f64::MIN, f64::max))
        };
        Band { name: "persons".into(), points: (0..=POINTS).map(edge).collect() }
    };
    let from = if start(0).initial_contact { "heel strike" } else { "the most flexed hip" };
    let x = format!("% of the stride, from {from}");
    Panel::curves(&format!("{name}, {}", joint.name().replace('_', " ")), &x, "deg", vec![curve(0), curve(1)])
        .banded(vec![band(0), band(1)])
}
