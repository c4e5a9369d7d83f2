//! Pictures of curves, bands and bars as one self-contained SVG: panels in rows, each with its legend beside it, never over a curve.
//!
//! ```
//! use picture::{Curve, Panel, draw};
//! let sine = Curve::new("hip", (0..100).map(|k| (f64::from(k) * 0.01, (f64::from(k) * 0.1).sin())).collect());
//! let svg = draw("A walk", &[Panel::curves("angles", "time, s", "angle, deg", vec![sine])], 1)?;
//! assert!(svg.starts_with("<svg") && svg.contains("angle, deg"));
//! # Ok::<(), String>(())
//! ```
#![forbid(unsafe_code)]

use plotters::coord::Shift;
use plotters::prelude::*;
use std::ops::Range;

/// A named curve.
#[derive(Debug, Clone)]
pub struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// A curve; an empty name leaves it out of the legend.
    #[must_use]
    pub fn new(name: &str, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points }
    }
}

/// A strip behind the curves: places of the horizontal axis, each with the strip's lower and upper edge.
#[derive(Debug, Clone)]
pub struct Band(pub Vec<(f64, f64, f64)>);

/// A named row of bars, each from one place of the horizontal axis to another.
#[derive(Debug, Clone)]
pub struct Bars {
    /// What stands in front of the row.
    pub name: String,
    /// Begin and end of each bar.
    pub spans: Vec<(f64, f64)>,
}

/// What is drawn between a pair of axes.
#[derive(Debug, Clone)]
pub enum Content {
    /// Curves over a common range.
    Curves(Vec<Curve>),
    /// Rows of bars, the first on top.
    Bars(Vec<Bars>),
}

/// A pair of axes with what is drawn between them.
#[derive(Debug, Clone)]
pub struct Panel {
    /// What is drawn.
    pub title: String,
    /// Name of the horizontal axis, with its unit.
    pub x: String,
    /// Name of the vertical axis, with its unit.
    pub y: String,
    /// What is drawn.
    pub content: Content,
    /// Places of the horizontal axis where something changes, and what.
    pub marks: Vec<(f64, String)>,
    /// Strips behind the curves, each in the colour of the curve of the same place.
    pub bands: Vec<Band>,
    /// Parts of the horizontal axis that are greyed.
    pub shades: Vec<(f64, f64)>,
}

impl Panel {
    /// Curves without marks.
    #[must_use]
    pub fn curves(title: &str, x: &str, y: &str, curves: Vec<Curve>) -> Self {
        Self::new(title, x, y, Content::Curves(curves))
    }

    /// Rows of bars without marks.
    #[must_use]
    pub fn bars(title: &str, x: &str, y: &str, rows: Vec<Bars>) -> Self {
        Self::new(title, x, y, Content::Bars(rows))
    }

    fn new(title: &str, x: &str, y: &str, content: Content) -> Self {
        Self { title: title.into(), x: x.into(), y: y.into(), content, marks: vec![], bands: vec![], shades: vec![] }
    }

    /// The same panel with strips behind its curves.
    #[must_use]
    pub fn banded(mut self, bands: Vec<Band>) -> Self {
        self.bands = bands;
        self
    }

    /// The same panel with parts of its horizontal axis greyed.
    #[must_use]
    pub fn shaded(mut self, shades: &[(f64, f64)]) -> Self {
        self.shades = shades.to_vec();
        self
    }

    /// The same panel with marks.
    #[must_use]
    pub fn marked(mut self, marks: &[(f64, String)]) -> Self {
        self.marks = marks.to_vec();
        self
    }
}

const WIDTH: u32 = 960;
const PANEL: u32 = 250;
const LEGEND: u32 = 120;
const TITLE: u32 = 40;
const GREY: RGBColor = RGBColor(120, 120, 120);

/// Colours that can be told apart on white, also by the colour-blind (Okabe and Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];

const fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// A number of an axis in as few digits as it has.
fn number(value: &f64) -> String {
    // Steps of an axis are 1, 2 or 5 times a power of ten: rounding takes the error of their sum off.
    let rounded = (value * 1e6).round() / 1e6;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}

/// The picture as text: panels from left to right in so many columns, row by row.
///
/// # Errors
/// The drawing library's own.
pub fn draw(title: &str, panels: &[Panel], columns: usize) -> Result<String, String> {
    let mut text = String::new();
    {
        let columns = columns.max(1);
        let mut ends = vec![];
        let mut height = 0;
        for row in panels.chunks(columns) {
            // Side by side they are half as wide, and a little taller for it.
            let tallest = row.iter().map(Panel::height).max().unwrap_or(PANEL);
            height += if columns > 1 { tallest.max(PANEL * 3 / 2) } else { tallest };
            ends.push(height);
        }
        let legend = panels.iter().any(|panel| !panel.named().is_empty());
        let root = SVGBackend::with_string(&mut text, (WIDTH, height + TITLE)).into_drawing_area();
        root.fill(&WHITE).map_err(|e| e.to_string())?;
        let root = root.titled(title, ("sans-serif", 20)).map_err(|e| e.to_string())?;
        // The last end is that of the picture.
        ends.pop();
        let rows = root.split_by_breakpoints::<i32, u32, _, _>([], &ends);
        for (row, members) in rows.iter().zip(panels.chunks(columns)) {
            for (area, panel) in row.split_evenly((1, columns)).iter().zip(members) {
                one(area, panel, &common_x(panels, panel), legend)?;
            }
        }
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Panel {
    /// Curves with names, and their colours.
    fn named(&self) -> Vec<(usize, &str)> {
        let Content::Curves(curves) = &self.content else { return vec![] };
        curves.iter().map(|curve| curve.name.as_str()).enumerate().filter(|(_, name)| !name.is_empty()).collect()
    }

    /// A phase portrait is taller than a curve over time.
    fn height(&self) -> u32 {
        match &self.content {
            Content::Curves(curves) if !over_time(curves) => PANEL * 8 / 5,
            _ => PANEL,
        }
    }
}

/// The horizontal range of a panel: panels over the same quantity share theirs, so that they can be read from one to the next.
fn common_x(panels: &[Panel], panel: &Panel) -> Range<f64> {
    let along = |panel: &Panel| match &panel.content {
        Content::Curves(curves) if over_time(curves) => {
            Some(curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.0)).collect::<Vec<f64>>())
        }
        Content::Curves(_) => None,
        Content::Bars(rows) => Some(rows.iter().flat_map(|row| row.spans.iter().flat_map(|&(a, b)| [a, b])).collect()),
    };
    match (&panel.content, along(panel)) {
        (Content::Curves(curves), None) => range(curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.0))),
        _ => span(panels.iter().filter(|other| other.x == panel.x).filter_map(along).flatten()),
    }
}

fn over_time(curves: &[Curve]) -> bool {
    curves.iter().all(|curve| curve.points.windows(2).all(|pair| pair[0].0 <= pair[1].0))
}

/// With a legend in the picture every panel leaves it its place, so that all axes end alike.
fn one(area: &Area<'_>, panel: &Panel, x: &Range<f64>, legend: bool) -> Result<(), String> {
    let (width, _) = area.dim_in_pixel();
    let beside = if legend { LEGEND } else { 0 };
    let (chart, beside) = area.split_horizontally(width.saturating_sub(beside));
    match &panel.content {
        Content::Curves(curves) => curves_in(&chart, panel, x, curves)?,
        Content::Bars(rows) => bars_in(&chart, panel, x, rows)?,
    }
    names(&beside, &panel.named())
}

fn names(area: &Area<'_>, named: &[(usize, &str)]) -> Result<(), String> {
    for (row, (index, name)) in named.iter().enumerate() {
        let y = 50 + 20 * row as i32;
        let style = colour(*index).stroke_width(2);
        area.draw(&PathElement::new([(4, y), (24, y)], style)).map_err(|e| e.to_string())?;
        area.draw(&Text::new((*name).to_owned(), (30, y - 7), ("sans-serif", 14))).map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// The range of a coordinate with a little room on either side.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let room = 0.05 * (high - low).max(1e-6);
    if low > high { 0.0..1.0 } else { low - room..high + room }
}

/// Exactly what is there: time has no room beyond its ends.
fn span(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    if low >= high { 0.0..1.0 } else { low..high }
}

fn curves_in(area: &Area<'_>, panel: &Panel, x: &Range<f64>, curves: &[Curve]) -> Result<(), String> {
    let all = || curves.iter().flat_map(|curve| curve.points.iter().copied());
    let edges = panel.bands.iter().flat_map(|band| band.0.iter().flat_map(|&(_, low, high)| [low, high]));
    let mut y_range = range(all().map(|p| p.1).chain(edges));
    if !panel.marks.is_empty() {
        // Room for the words above the curves.
        y_range.end += 0.12 * (y_range.end - y_range.start);
    }
    let top = y_range.end;
    let bottom = y_range.start;
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15))
        .margin(8)
        .margin_right(20)
        .x_label_area_size(38)
        .y_label_area_size(62)
        .build_cartesian_2d(x.clone(), y_range)
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .x_desc(&panel.x)
        .y_desc(&panel.y)
        .x_labels(9)
        .y_labels(7)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .light_line_style(WHITE)
        .draw()
        .map_err(|e| e.to_string())?;
    for &(from, to) in &panel.shades {
        let strip = Rectangle::new([(from, bottom), (to, top)], GREY.mix(0.18).filled());
        chart.draw_series([strip]).map_err(|e| e.to_string())?;
    }
    for (index, Band(band)) in panel.bands.iter().enumerate() {
        let there = band.iter().map(|&(x, low, _)| (x, low));
        let back = band.iter().rev().map(|&(x, _, high)| (x, high));
        let strip = Polygon::new(there.chain(back).collect::<Vec<_>>(), colour(index).mix(0.25).filled());
        chart.draw_series([strip]).map_err(|e| e.to_string())?;
    }
    for (at, what) in &panel.marks {
        let line = PathElement::new([(*at, bottom), (*at, top)], GREY);
        chart.draw_series([line]).map_err(|e| e.to_string())?;
        let label = Text::new(format!(" {what}"), (*at, top), ("sans-serif", 12).into_font().color(&GREY));
        chart.draw_series([label]).map_err(|e| e.to_string())?;
    }
    for (index, curve) in curves.iter().enumerate() {
        let line = LineSeries::new(curve.points.iter().copied(), colour(index).stroke_width(1));
        chart.draw_series(line).map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn bars_in(area: &Area<'_>, panel: &Panel, x: &Range<f64>, rows: &[Bars]) -> Result<(), String> {
    let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
    let count = rows.len();
    // The label of a row stands at its middle, which is a whole number; a row of marks stands above the first.
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15))
        .margin(8)
        .margin_right(20)
        .x_label_area_size(38)
        .y_label_area_size(62)
        .build_cartesian_2d(x.clone(), -0.5..count as f64 + 0.3)
        .map_err(|e| e.to_string())?;
    let name = |y: &f64| {
        let row = count as f64 - 1.0 - y;
        let whole = (row - row.round()).abs() < 1e-9 && row >= 0.0;
        let name = if whole { names.get(row.round() as usize) } else { None };
        name.map_or(String::new(), |name| (*name).to_owned())
    };
    chart
        .configure_mesh()
        .x_desc(&panel.x)
        .y_desc(&panel.y)
        .x_labels(13)
        .y_labels(count + 1)
        .x_label_formatter(&number)
        .y_label_formatter(&name)
        .light_line_style(WHITE)
        .disable_y_mesh()
        .draw()
        .map_err(|e| e.to_string())?;
    for (index, row) in rows.iter().enumerate() {
        let y = (count - 1 - index) as f64;
        let bars =
            row.spans.iter().map(|&(a, b)| Rectangle::new([(a, y - 0.35), (b, y + 0.35)], colour(index).filled()));
        chart.draw_series(bars).map_err(|e| e.to_string())?;
    }
    for (at, what) in &panel.marks {
        let top = count as f64 + 0.3;
        chart.draw_series([PathElement::new([(*at, -0.5), (*at, top)], GREY)]).map_err(|e| e.to_string())?;
        let label = Text::new(format!(" {what}"), (*at, top - 0.05), ("sans-serif", 12).into_font().color(&GREY));
        chart.draw_series([label]).map_err(|e| e.to_string())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_its_titles_names_axes_and_curves() {
        let curve = Curve::new("left_hip", (0..50).map(|i| (f64::from(i), f64::from(i).sin())).collect());
        let panel = Panel::curves("angles", "time, s", "angle, deg", vec![curve]);
        let text = draw("a walk", &[panel.clone(), panel.marked(&[(10.0, "here".into())])], 1).expect("drawn");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for wanted in ["a walk", "angles", "left_hip", "time, s", "angle, deg", "here"] {
            assert!(text.contains(wanted), "{wanted}");
        }
        assert!(text.matches("<polyline").count() >= 2);
        let banded = Panel::curves("x", "s", "deg", vec![]).banded(vec![Band(vec![(0.0, 1.0, 2.0), (1.0, 1.0, 3.0)])]);
        assert!(draw("band", &[banded.shaded(&[(0.2, 0.4)])], 2).unwrap().contains("<polygon"));
        assert!(draw("nothing", &[Panel::curves("x", "s", "deg", vec![])], 2).is_ok());
    }

    #[test]
    fn rows_of_bars_have_their_names_and_one_rectangle_a_bar() {
        let rows = ["TL", "ML"].map(|name| Bars { name: name.into(), spans: vec![(0.0, 1.0), (3.0, 4.0)] });
        let panel = Panel::bars("steps", "step", "leg", rows.to_vec());
        let with = draw("a hexapod", std::slice::from_ref(&panel), 1).unwrap();
        let without = draw("a hexapod", &[Panel { content: Content::Bars(vec![]), ..panel }], 1).unwrap();
        assert!(with.contains("TL") && with.contains("ML"), "{with}");
        assert_eq!(with.matches("<rect").count() - without.matches("<rect").count(), 4);
    }
}
