//! Charts inside an HTML page: SVG whose colours are those of the page, with a title and a description for screen readers.
//!
//! The library that draws pictures as files has fixed colours, whole pixels and no titles. Here every line and area has a class, and the
//! style sheet of the page gives colours, also for dark screens and paper: `axis`, `grid`, `zero`, `label`, and the classes of the layers.
//! [`Chart::svg`] is well-formed XML.
//!
//! ```
//! use picture::inline::{Chart, Layer};
//! let sine = (0..=100).map(|k| (f64::from(k), 20.0 * (f64::from(k) * 0.0628).sin())).collect();
//! let chart = Chart::new("Left hip", "The left hip over the cycle.", ["gait cycle, %", "angle, deg"], vec![Layer::Line("mean", sine)]);
//! let svg = chart.svg("left-hip");
//! assert!(svg.contains("<title id=\"left-hip-t\">Left hip</title>") && svg.contains("class=\"mean\""));
//! ```

use std::fmt::Write as _;
use std::ops::RangeInclusive;

/// Width of a chart, in units of its view box.
const WIDTH: f64 = 400.0;
/// Height of a chart.
const HEIGHT: f64 = 260.0;
/// Left, right, upper and lower edge of the axes.
const AXES: [f64; 4] = [58.0, 388.0, 10.0, 214.0];
/// Width of a small chart without axes.
const SMALL: [f64; 2] = [96.0, 32.0];
/// About as many steps has an axis.
const STEPS: f64 = 6.0;

/// What is drawn, in the units of the axes. The first text is the class.
#[derive(Debug, Clone)]
pub enum Layer {
    /// A line through points (x, y).
    Line(&'static str, Vec<(f64, f64)>),
    /// An area between a lower and an upper line: x, lower y, upper y.
    Band(&'static str, Vec<(f64, f64, f64)>),
    /// Vertical strips from the first to the last x value.
    Strips(&'static str, Vec<(f64, f64)>),
}

/// A chart.
#[derive(Debug, Clone)]
pub struct Chart {
    title: String,
    description: String,
    labels: [String; 2],
    layers: Vec<Layer>,
    x: Option<RangeInclusive<f64>>,
    y: Option<RangeInclusive<f64>>,
}

impl Chart {
    /// A chart with its title, a description of what it shows, and the names of the axes with their units: horizontal, vertical. The first
    /// layer is below the others.
    #[must_use]
    pub fn new(title: &str, description: &str, labels: [&str; 2], layers: Vec<Layer>) -> Self {
        Self {
            title: title.into(),
            description: description.into(),
            labels: labels.map(String::from),
            layers,
            x: None,
            y: None,
        }
    }

    /// With a fixed range of the horizontal axis.
    #[must_use]
    pub fn along(mut self, x: RangeInclusive<f64>) -> Self {
        self.x = Some(x);
        self
    }

    /// With a fixed range of the vertical axis.
    #[must_use]
    pub fn between(mut self, y: RangeInclusive<f64>) -> Self {
        self.y = Some(y);
        self
    }

    /// Least and greatest y value of the layers, infinite without any.
    #[must_use]
    pub fn y_span(&self) -> (f64, f64) {
        span(self.layers.iter().flat_map(Layer::ys))
    }

    /// The chart with axes. `id` must be unique on the page: letters, digits and hyphens.
    #[must_use]
    pub fn svg(&self, id: &str) -> String {
        let x = self.x.clone().unwrap_or_else(|| whole(span(self.layers.iter().flat_map(Layer::xs)), 0.0));
        let y = self.y.clone().unwrap_or_else(|| whole(self.y_span(), 0.05));
        let [left, right, top, bottom] = AXES;
        let place = Place { x: x.clone(), y: y.clone(), edges: AXES };
        let mut svg = self.begin(id, [WIDTH, HEIGHT], "chart");
        self.draw(&mut svg, &place, true);
        for value in ticks(&x) {
            let at = place.x(value);
            let _ = write!(
                svg,
                "<text class=\"label\" x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 17.0,
                number(value)
            );
        }
        for value in ticks(&y) {
            let at = place.y(value);
            let class = if value.abs() < 1e-9 { "zero" } else { "grid" };
            let _ = write!(
                svg,
                "<path class=\"{class}\" d=\"M{left} {at:.1}H{right}\"/><text class=\"label\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 6.0,
                at + 4.5,
                number(value)
            );
        }
        self.draw(&mut svg, &place, false);
        let _ = write!(
            svg,
            "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>\
             <text class=\"label\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text class=\"label\" x=\"12\" y=\"{:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 12 {:.1})\">{}</text></svg>",
            f64::midpoint(left, right),
            HEIGHT - 8.0,
            escaped(&self.labels[0]),
            f64::midpoint(top, bottom),
            f64::midpoint(top, bottom),
            escaped(&self.labels[1])
        );
        svg
    }

    /// The chart as a small picture without axes, for a cell of a table.
    #[must_use]
    pub fn small_svg(&self, id: &str) -> String {
        let x = self.x.clone().unwrap_or_else(|| whole(span(self.layers.iter().flat_map(Layer::xs)), 0.0));
        let y = self.y.clone().unwrap_or_else(|| whole(self.y_span(), 0.02));
        let place = Place { x, y, edges: [1.0, SMALL[0] - 1.0, 2.0, SMALL[1] - 2.0] };
        let mut svg = self.begin(id, SMALL, "small");
        self.draw(&mut svg, &place, true);
        self.draw(&mut svg, &place, false);
        svg + "</svg>"
    }

    fn begin(&self, id: &str, [width, height]: [f64; 2], class: &str) -> String {
        format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-labelledby=\"{id}-t {id}-d\">\
             <title id=\"{id}-t\">{}</title><desc id=\"{id}-d\">{}</desc>",
            escaped(&self.title),
            escaped(&self.description)
        )
    }

    /// The areas, which are below the grid, or the lines.
    fn draw(&self, svg: &mut String, place: &Place, areas: bool) {
        let [_, _, top, bottom] = place.edges;
        for layer in &self.layers {
            let _ = match layer {
                Layer::Line(class, points) if !areas => {
                    write!(svg, "<polyline class=\"{class}\" points=\"{}\"/>", place.points(points.iter().copied()))
                }
                Layer::Band(class, points) if areas => {
                    let there = points.iter().map(|&(x, low, _)| (x, low));
                    let back = points.iter().rev().map(|&(x, _, high)| (x, high));
                    write!(svg, "<polygon class=\"{class}\" points=\"{}\"/>", place.points(there.chain(back)))
                }
                Layer::Strips(class, strips) if areas => strips.iter().try_for_each(|&(from, to)| {
                    let (from, to) = (place.x(from), place.x(to));
                    let (width, height) = ((to - from).max(0.5), bottom - top);
                    write!(
                        svg,
                        "<rect class=\"{class}\" x=\"{from:.1}\" y=\"{top}\" width=\"{width:.1}\" height=\"{height:.1}\"/>"
                    )
                }),
                _ => Ok(()),
            };
        }
    }
}

impl Layer {
    fn xs(&self) -> Vec<f64> {
        match self {
            Self::Line(_, points) => points.iter().map(|point| point.0).collect(),
            Self::Band(_, points) => points.iter().map(|point| point.0).collect(),
            Self::Strips(..) => vec![],
        }
    }

    fn ys(&self) -> Vec<f64> {
        match self {
            Self::Line(_, points) => points.iter().map(|point| point.1).collect(),
            Self::Band(_, points) => points.iter().flat_map(|point| [point.1, point.2]).collect(),
            Self::Strips(..) => vec![],
        }
    }
}

/// Where values are on the picture.
struct Place {
    x: RangeInclusive<f64>,
    y: RangeInclusive<f64>,
    /// Left, right, upper, lower.
    edges: [f64; 4],
}

impl Place {
    fn x(&self, value: f64) -> f64 {
        let [left, right, ..] = self.edges;
        left + (right - left) * part(&self.x, value)
    }

    fn y(&self, value: f64) -> f64 {
        let [_, _, top, bottom] = self.edges;
        bottom - (bottom - top) * part(&self.y, value)
    }

    fn points(&self, values: impl Iterator<Item = (f64, f64)>) -> String {
        let mut text = String::new();
        for (x, y) in values {
            // A value outside of a fixed range is drawn at its end.
            let _ = write!(text, "{:.1},{:.1} ", self.x(x), self.y(y));
        }
        text.truncate(text.trim_end().len());
        text
    }
}

/// Place of a value in a range, 0 to 1.
fn part(range: &RangeInclusive<f64>, value: f64) -> f64 {
    let (from, to) = (*range.start(), *range.end());
    if to > from { ((value - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 }
}

fn span(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// A range around a span, with a margin as a fraction of it; 0 to 1 without values.
#[must_use]
pub fn whole((low, high): (f64, f64), margin: f64) -> RangeInclusive<f64> {
    if low > high {
        return 0.0..=1.0;
    }
    let more = margin * (high - low).max(1e-6);
    low - more..=high + more
}

/// Round values inside a range: 1, 2 or 5 times a power of ten apart.
fn ticks(range: &RangeInclusive<f64>) -> Vec<f64> {
    let (from, to) = (*range.start(), *range.end());
    let rough = (to - from) / STEPS;
    if !(rough.is_finite() && rough > 0.0) {
        return vec![from];
    }
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().map(|times| times * power).find(|step| *step >= rough * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let first = (from / step - 1e-9).ceil() as i64;
    let last = (to / step + 1e-9).floor() as i64;
    (first..=last).map(|n| n as f64 * step).collect()
}

/// A number of an axis without superfluous digits.
fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6 + 0.0;
    rounded.to_string().replace('-', "\u{2212}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(&(0.0..=100.0)), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(&(-23.0..=41.0)), [-20.0, 0.0, 20.0, 40.0]);
        assert_eq!(ticks(&(-0.31..=0.29)), [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2].map(|t| (t * 10.0_f64).round() * 0.1));
        assert_eq!(ticks(&(2.0..=2.0)), [2.0]);
    }

    #[test]
    fn points_are_where_the_axes_say() {
        let line = Layer::Line("mean", vec![(0.0, -10.0), (100.0, 10.0)]);
        let svg = Chart::new("a & b", "c < d", ["x", "y"], vec![line]).between(-10.0..=10.0).svg("one");
        assert!(svg.contains("points=\"58.0,214.0 388.0,10.0\""), "{svg}");
        assert!(
            svg.contains("a &amp; b") && svg.contains("c &lt; d") && svg.contains("aria-labelledby=\"one-t one-d\"")
        );
    }

    #[test]
    fn nothing_is_drawn_without_a_panic() {
        let none =
            Chart::new("", "", ["", ""], vec![Layer::Line("mean", vec![]), Layer::Strips("out", vec![(0.0, 1.0)])]);
        assert!(none.svg("a").ends_with("</svg>") && none.small_svg("b").ends_with("</svg>"));
    }
}
