//! The results of the exercises, from the files that their lines have made.

use crate::shell::Shell;
use serde_json::Value;

/// Seconds at the beginning of a gait that are not looked at.
const START_S: f64 = 4.0;

/// Exercise, result, value: in the order of the page.
pub(crate) fn measured(shell: &Shell) -> Vec<(usize, &'static str, f64)> {
    let json = |name: &str| -> Value {
        let text = std::fs::read_to_string(shell.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}: {text:.200}"))
    };
    let at = |name: &str, place: &str| -> f64 {
        let file = json(name);
        let value = file.pointer(place).unwrap_or_else(|| panic!("{name} has no {place}"));
        value.as_f64().or_else(|| value.as_bool().map(f64::from)).unwrap_or_else(|| panic!("{name}{place}: {value}"))
    };
    let lost = json("walk.json")["kicks_lost"].as_array().expect("a list").len() as f64;
    let width = |row: usize| {
        let edge = |key: &str| at("walk.json", &format!("/entrainment/{row}/{key}"));
        edge("high_hz") - edge("low_hz")
    };
    let (weak, strong) = (width(0), width(2));
    assert_eq!((at("walk.json", "/entrainment/0/strength"), at("walk.json", "/entrainment/2/strength")), (0.1, 0.5));
    let lag = |name: &str| lag(&std::fs::read_to_string(shell.path(name)).unwrap());
    let circle = json("circle.json");
    let operations = circle["parts"][0]["operations"].as_object().map_or(0, |all| all.len()) as f64;
    vec![
        (1, "kicks", at("walk.json", "/kicks")),
        (1, "kicks that do not come back", lost),
        (1, "settling time, s", at("walk.json", "/settling_s")),
        (1, "largest Floquet multiplier", at("walk.json", "/multipliers/0")),
        (1, "width at strength 0.1, Hz", weak),
        (1, "width at strength 0.5, Hz", strong),
        (1, "ratio of both widths", strong / weak),
        (2, "lag of the walk", lag("natural.csv")),
        (2, "lag of the gallop", lag("gallop.csv")),
        (2, "lag of the hop", lag("hop.csv")),
        (3, "time until locked, s", at("follow.json", "/lock_s")),
        (3, "phase error, degrees of the cycle", at("follow.json", "/phase_sd_deg")),
        (3, "error of the right knee, degrees", at("follow.json", "/steady_rmse_deg/right_knee")),
        (3, "the same with a perfect phase, degrees", at("follow.json", "/perfect_phase_rmse_deg/right_knee")),
        (3, "error of the left hip, 3.5 s, degrees", at("long-gap.json", "/steady_rmse_deg/left_hip")),
        (4, "error at an unknown pose, 18 poses, degrees", at("many.json", "/unknown_pose_deg")),
        (4, "error at an unknown pose, 4 poses, degrees", at("few.json", "/unknown_pose_deg")),
        (4, "largest hysteresis, 18 poses, degrees", at("many.json", "/hysteresis/largest_deg")),
        (5, "error with 1 harmonic, degrees", at("one.json", "/rmse_heldout_deg")),
        (5, "error with 2 harmonics, degrees", at("two.json", "/rmse_heldout_deg")),
        (5, "error with 3 harmonics, degrees", at("three.json", "/rmse_heldout_deg")),
        (5, "error with 6 harmonics, degrees", at("six.json", "/rmse_heldout_deg")),
        (5, "floor of the left knee, degrees", at("six.json", "/joints/2/heldout_floor_deg")),
        (6, "concurrency of the triangle", at("triangle.json", "/parts/0/concurrency")),
        (6, "concurrency of the ring", at("ring.json", "/parts/0/concurrency")),
        (6, "period of the ring, steps", at("ring.json", "/parts/0/period_steps")),
        (6, "concurrency of the sample's ring", at("legs.json", "/parts/0/concurrency")),
        (6, "nodes of the circle that operate", operations),
        (6, "duty of the extensor", at("block.json", "/extensor_duty")),
    ]
}

/// How much later than the left hip the right hip is most flexed, as a part of the stride; the mean over the strides of a gait as CSV.
fn lag(csv: &str) -> f64 {
    let row = |line: &str| -> Option<[f64; 3]> {
        let mut cells = line.split(',').map(|cell| cell.parse().ok());
        Some([cells.next()??, cells.next()??, cells.next()??])
    };
    let rows: Vec<[f64; 3]> = csv.lines().filter_map(row).filter(|row| row[0] > START_S).collect();
    let peaks = |joint: usize| -> Vec<f64> {
        let top = rows.iter().map(|row| row[joint]).fold(f64::MIN, f64::max);
        let is_peak =
            |w: &&[[f64; 3]]| w[1][joint] > w[0][joint] && w[1][joint] >= w[2][joint] && w[1][joint] > 0.9 * top;
        rows.windows(3).filter(is_peak).map(|w| w[1][0]).collect()
    };
    let (left, right) = (peaks(1), peaks(2));
    let stride = (left[left.len() - 1] - left[0]) / (left.len() - 1) as f64;
    let later = |from: &f64| right.iter().find(|peak| *peak >= from).map(|peak| (peak - from) / stride);
    let lags: Vec<f64> = left.iter().filter_map(later).collect();
    lags.iter().sum::<f64>() / lags.len() as f64
}
