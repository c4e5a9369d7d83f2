//! `footfall bifurcation`: follows the motion of an oscillator or generator along one parameter, up and down.

use clap::Args;
use dynamics::bifurcation::{Onset, Point, Sweep, sweep};
use serde_json::json;
use std::fmt::Write as _;

use crate::failure::Failure;
use crate::file::svg::{self, Curve, Panel};
use crate::options::system::{ResultFiles, Span, SystemArgument, even, progress};

/// Options of `footfall bifurcation`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Each value begins where the motion of the one before ended: a rest is moved by a thousandth of the amplitudes, an oscillation goes on as it is. Where it\n\
    begins or ends to oscillate, the value is found from two values before and with two degrees of care; `within` is how far they are apart. Sweeps that\n\
    differ show two motions that both attract.\n\n\
    CSV: sweep (up or down), value, motion (rest, cycle, irregular, leaves or undecided), smallest and largest value of the state, period."
)]
pub struct Options {
    /// What is analysed
    #[command(flatten)]
    pub system: SystemArgument,
    /// The parameter and its range, as current=0.2..0.5, or nonlinearity=0.01..1 of a generator file
    #[arg(long, value_name = "NAME=FROM..TO", required_unless_present = "list")]
    pub parameter: Option<Span>,
    /// The state whose extrema are shown [default: the first]
    #[arg(long, value_name = "STATE")]
    pub variable: Option<String>,
    /// Number of values
    #[arg(long, value_name = "N", default_value_t = 41, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    pub points: u32,
    /// Where the result goes
    #[command(flatten)]
    pub files: ResultFiles,
}

/// Width of a label, in parts of the picture.
const LABEL: f64 = 0.06;
const WAYS: [&str; 2] = ["up", "down"];

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let (Some(system), Some(span)) = (options.system.read()?, &options.parameter) else { return Ok(()) };
    options.files.check(&options.system)?;
    let values = even(span.from, span.to, options.points as usize);
    let outside = |why| Failure::input(format!("--parameter {}={}..{}: {why}", span.name, span.from, span.to));
    values.iter().try_for_each(|&value| system.with(&span.name, value).map(drop)).map_err(outside)?;
    let names = system.model().map_err(Failure::input)?.0.names();
    let variable = options.variable.as_deref().map_or(Ok(0), |name| system.variable(name));
    let variable = variable.map_err(|why| Failure::input(format!("--variable {why}")))?;
    let bar = progress(2 * values.len());
    let sweeps = sweep(&system, &span.name, &values, &|| bar.inc(1)).map_err(outside)?;
    bar.finish_and_clear();
    let mut rows = vec![
        ("system".to_owned(), options.system.in_words()),
        (
            "parameter".into(),
            format!("{} from {} to {} and back, {} values", span.name, span.from, span.to, values.len()),
        ),
    ];
    for (way, sweep) in WAYS.iter().zip(&sweeps) {
        rows.extend(sweep.onsets.iter().map(|onset| (format!("sweep {way}"), in_words(onset, &span.name))));
        if sweep.onsets.is_empty() {
            let motion = sweep.points.first().map_or("no value", |point| point.motion.word());
            rows.push((format!("sweep {way}"), format!("no onset; it begins with `{motion}`")));
        }
    }
    if let Some(path) = &options.files.svg {
        let title = format!("{} along {}", options.system.in_words(), span.name);
        let panels = panels(&sweeps, span, &names[variable], variable, system.time_unit());
        svg::write(path, &title, &panels, options.files.overwrite)?;
    }
    let object = json!({
        "system": options.system.in_words(),
        "time_unit": system.time_unit(),
        "parameter": span.name,
        "variable": names[variable],
        "sweeps": WAYS.iter().zip(&sweeps).map(|(way, sweep)| json!({
            "way": way,
            "onsets": sweep.onsets.iter().map(|o| json!({ "value": o.value, "within": o.within, "begins": o.begins })).collect::<Vec<_>>(),
            "points": sweep.points.iter().map(|point| json!({
                "value": point.value,
                "motion": point.motion.word(),
                "extrema": point.extrema(variable),
                "period": point.period(),
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    });
    options.files.write(|| csv(&sweeps, variable), &object, &rows)
}

fn in_words(onset: &Onset, parameter: &str) -> String {
    let what = if onset.begins { "begins" } else { "ends" };
    format!("oscillation {what} at {parameter} = {:.6}, within {:.1e}", onset.value, onset.within)
}

fn csv(sweeps: &[Sweep; 2], variable: usize) -> String {
    let mut text = String::from("sweep,value,motion,least,most,period\n");
    let shown = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.6}"));
    for (way, sweep) in WAYS.iter().zip(sweeps) {
        for point in &sweep.points {
            let [least, most] = [0, 1].map(|end| shown(point.extrema(variable).map(|extrema| extrema[end])));
            let (word, period) = (point.motion.word(), shown(point.period()));
            // A String takes everything.
            let _ = writeln!(text, "{way},{:.6},{word},{least},{most},{period}", point.value);
        }
    }
    text
}

/// Extrema and period over the parameter.
fn panels(sweeps: &[Sweep; 2], span: &Span, name: &str, variable: usize, unit: &str) -> [Panel; 2] {
    let line = |sweep: &Sweep, of: &dyn Fn(&Point) -> Option<f64>| {
        let mut points: Vec<(f64, f64)> =
            sweep.points.iter().filter_map(|point| Some((point.value, of(point)?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let (mut extrema, mut periods) = (vec![], vec![]);
    for (way, sweep) in WAYS.iter().zip(sweeps) {
        for (end, what) in ["smallest", "largest"].into_iter().enumerate() {
            let points = line(sweep, &|point| Some(point.extrema(variable)?[end]));
            extrema.push(Curve::new(&format!("{what}, {way}"), points));
        }
        periods.push(Curve::new(&format!("sweep {way}"), line(sweep, &Point::period)));
    }
    let marks = marks(sweeps, LABEL * (span.to - span.from));
    [
        Panel::curves(&format!("extrema of {name}; grey: onsets of the two sweeps"), &span.name, name, extrema)
            .marked(&marks),
        Panel::curves("period", &span.name, &format!("period, {unit}"), periods),
    ]
}

/// A line at each onset. Onsets nearer than a label is wide have one label together.
fn marks(sweeps: &[Sweep; 2], width: f64) -> Vec<(f64, String)> {
    let of =
        |(way, sweep): (&&str, &Sweep)| sweep.onsets.iter().map(|o| (o.value, (*way).to_owned())).collect::<Vec<_>>();
    let mut marks: Vec<(f64, String)> = WAYS.iter().zip(sweeps).flat_map(of).collect();
    marks.sort_by(|a, b| a.0.total_cmp(&b.0));
    for index in (1..marks.len()).rev() {
        if marks[index].0 - marks[index - 1].0 < width {
            let label = std::mem::take(&mut marks[index].1);
            marks[index - 1].1 += &format!(", {label}");
        }
    }
    // The one label is at the last of its lines.
    for index in 1..marks.len() {
        if marks[index].1.is_empty() {
            marks[index].1 = std::mem::take(&mut marks[index - 1].1);
        }
    }
    marks
}
