//! Pictures of a calibration: the table with its poses, and the residuals; as a file, and within the page.

use super::knots::Extended;
use super::poses::Pose;
use super::result::Calibrated;
use gait_fit::html;
use joint_units::Volts;
use picture::inline::{Chart, Layer, whole};
use picture::{Curve, Panel, draw};
use std::fmt::Write as _;

/// Points of the drawn curve.
const CURVE: usize = 400;

type Points = Vec<(f64, f64)>;

/// What is drawn.
struct Lines {
    /// Volts and angles of the table.
    table: Points,
    /// Mean volts and angle of each pose.
    poses: Points,
    /// Volts between which poses are outside of the table.
    outside: Points,
    /// Known angle and error: of the visits upwards and downwards, and the least and the greatest of the rows.
    up: Points,
    down: Points,
    least: Points,
    greatest: Points,
}

impl Lines {
    fn of(calibrated: &Calibrated) -> Self {
        let fit = &calibrated.fit;
        let table = Extended::new(&fit.calibration);
        let (low, high) = fit.calibration.volts_span();
        let curve = |k: usize| {
            let volts = low.0 + (high.0 - low.0) * (k as f32 / CURVE as f32);
            fit.calibration.angle(Volts(volts)).ok().map(|angle| (f64::from(volts), f64::from(angle.degrees())))
        };
        let mut poses: Points = fit.poses.iter().map(|pose| (pose.volts, pose.angle_deg)).collect();
        poses.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, last) = (poses.first().map_or(0.0, |p| p.0), poses.last().map_or(0.0, |p| p.0));
        let outside = [(first, f64::from(low.0)), (f64::from(high.0), last)];
        let kept = || fit.poses.iter().zip(&fit.left_out).filter(|(_, why)| why.is_none()).map(|(pose, _)| pose);
        let errors = |volts: fn(&Pose) -> Option<f64>| {
            kept().filter_map(|pose| Some((pose.angle_deg, table.degrees(volts(pose)?) - pose.angle_deg))).collect()
        };
        let mut rows: Points = fit.residuals.iter().filter_map(|row| Some((row.angle_deg, row.error_deg?))).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let extreme = |which: fn(f64, f64) -> f64| {
            let of_angle = |rows: &[(f64, f64)]| Some((rows.first()?.0, rows.iter().map(|row| row.1).reduce(which)?));
            rows.chunk_by(|a, b| a.0 == b.0).filter_map(of_angle).collect()
        };
        Self {
            table: (0..=CURVE).filter_map(curve).collect(),
            poses,
            outside: outside.into_iter().filter(|(from, to)| from < to).collect(),
            up: errors(|pose| pose.up_v),
            down: errors(|pose| pose.down_v),
            least: extreme(f64::min),
            greatest: extreme(f64::max),
        }
    }
}

/// Titles of the two pictures, and what their axes show.
const SENSOR: (&str, [&str; 2]) = ("The sensor; grey is outside of the table", ["at the sensor, V", "angle, deg"]);
const RESIDUALS: (&str, [&str; 2]) = ("Table minus known angle", ["known angle, deg", "residual, deg"]);

/// Both pictures as a file of SVG.
///
/// # Errors
/// The error of the drawing library.
pub fn svg(calibrated: &Calibrated) -> Result<String, String> {
    let title = format!("{}, {}", calibrated.measured.sensor, calibrated.measured.date);
    let lines = Lines::of(calibrated);
    let panel = |(title, [x, y]): (&str, [&str; 2]), curves| Panel::curves(title, x, y, curves);
    let sensor = panel(SENSOR, vec![Curve::new("table", lines.table), Curve::new("poses", lines.poses)]);
    let residuals = vec![
        Curve::new("up", lines.up),
        Curve::new("down", lines.down),
        Curve::new("least row", lines.least),
        Curve::new("greatest row", lines.greatest),
    ];
    draw(&title, &[sensor.shaded(&lines.outside), panel(RESIDUALS, residuals)], 1)
}

/// Both pictures within a page, in its colours.
pub(super) fn charts(page: &mut String, calibrated: &Calibrated) {
    let lines = Lines::of(calibrated);
    let sensor =
        vec![Layer::Strips("out", lines.outside), Layer::Line("mean", lines.table), Layer::Line("fit", lines.poses)];
    let residuals = vec![
        Layer::Line("stride", lines.least),
        Layer::Line("stride", lines.greatest),
        Layer::Line("left", lines.up),
        Layer::Line("right", lines.down),
    ];
    let mut chart = |id: &str, (title, labels): (&str, [&str; 2]), words, legend: &[(&str, &str)], layers| {
        let chart = Chart::new(title, words, labels, layers);
        let y = chart.y_span();
        let _ = write!(page, "<figure><figcaption>{title}</figcaption>");
        html::legend(page, legend);
        let _ = write!(page, "{}</figure>", chart.between(whole(y, 0.05)).svg(id));
    };
    let words = "Angle over volts: the table as a solid line, the means of the poses dashed.";
    chart("sensor", SENSOR, words, &[("table", "mean"), ("poses", "fit")], sensor);
    let words = "Error of the table over the known angle: means of the visits upwards and downwards, and the least and the greatest row.";
    let legend = [("up", "left"), ("down", "right"), ("least and greatest row", "stride")];
    chart("residuals", RESIDUALS, words, &legend, residuals);
}
