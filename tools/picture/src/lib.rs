//! Draws charts of curves, bands and bars, maps of cells, and graphs, as one self-contained SVG: panels in rows, each with its legend at its right.
//!
//! ```
//! use picture::{Curve, Panel, draw};
//! let sine = Curve::new("hip", (0..100).map(|k| (f64::from(k) * 0.01, (f64::from(k) * 0.1).sin())).collect());
//! let svg = draw("Walking", &[Panel::curves("angles", "time, s", "angle, deg", vec![sine])], 1)?;
//! assert!(svg.starts_with("<svg") && svg.contains("angle, deg"));
//! # Ok::<(), String>(())
//! ```
#![forbid(unsafe_code)]

pub mod cells;
mod frame;
pub mod inline;
pub mod links;

use cells::Cells;
use frame::{Area, LABELS, builder, colour, format_number};
use links::Links;
use plotters::prelude::*;
use std::fmt::Write as _;
use std::ops::Range;

/// A named curve: points (x, y) in the units of the axes.
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

    /// Its name in the legend.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its points (x, y) in the units of the axes.
    #[must_use]
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }
}

/// A filled band behind the curves.
#[derive(Debug, Clone)]
pub struct Band {
    /// Name in the legend, below that of its curve; empty for none.
    pub name: String,
    /// For each point the x value, the lower and the upper y value.
    pub points: Vec<(f64, f64, f64)>,
}

/// A named row of horizontal bars.
#[derive(Debug, Clone)]
pub struct Bars {
    /// Label at the left of the row.
    pub name: String,
    /// First and last x value of each bar.
    pub spans: Vec<(f64, f64)>,
}

/// Content of a panel.
#[derive(Debug, Clone)]
pub enum Content {
    /// Curves in one coordinate system.
    Curves(Vec<Curve>),
    /// Rows of bars, the first on top.
    Bars(Vec<Bars>),
    /// Nodes and arrows, without axes.
    Links(Links),
    /// A map of cells.
    Cells(Cells),
}

/// A chart: a pair of axes and its content, or a graph.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Title above the chart.
    pub title: String,
    /// Name of the horizontal axis, with its unit.
    pub x: String,
    /// Name of the vertical axis, with its unit.
    pub y: String,
    /// Curves or bars.
    pub content: Content,
    /// Vertical lines: x value and label.
    pub marks: Vec<(f64, String)>,
    /// Bands behind the curves, each in the colour of the curve with the same index.
    pub bands: Vec<Band>,
    /// Grey intervals of the x axis: first and last x value.
    pub shades: Vec<(f64, f64)>,
}

impl Panel {
    /// A panel of curves without marks.
    #[must_use]
    pub fn curves(title: &str, x: &str, y: &str, curves: Vec<Curve>) -> Self {
        Self::new(title, x, y, Content::Curves(curves))
    }

    /// A panel of rows of bars without marks.
    #[must_use]
    pub fn bars(title: &str, x: &str, y: &str, rows: Vec<Bars>) -> Self {
        Self::new(title, x, y, Content::Bars(rows))
    }

    /// A panel with a graph.
    #[must_use]
    pub fn links(title: &str, links: Links) -> Self {
        Self::new(title, "", "", Content::Links(links))
    }

    /// A panel with a map of cells.
    #[must_use]
    pub fn cells(title: &str, x: &str, y: &str, cells: Cells) -> Self {
        Self::new(title, x, y, Content::Cells(cells))
    }

    fn new(title: &str, x: &str, y: &str, content: Content) -> Self {
        Self { title: title.into(), x: x.into(), y: y.into(), content, marks: vec![], bands: vec![], shades: vec![] }
    }

    /// Returns the panel with bands behind its curves.
    #[must_use]
    pub fn banded(mut self, bands: Vec<Band>) -> Self {
        self.bands = bands;
        self
    }

    /// Returns the panel with grey intervals of its x axis.
    #[must_use]
    pub fn shaded(mut self, shades: &[(f64, f64)]) -> Self {
        self.shades = shades.to_vec();
        self
    }

    /// Returns the panel with vertical lines at x values, each with a label.
    #[must_use]
    pub fn marked(mut self, marks: &[(f64, String)]) -> Self {
        self.marks = marks.to_vec();
        self
    }
}

/// Width of the picture, px.
const WIDTH: u32 = 960;
/// Height of a panel, px.
const PANEL: u32 = 250;
/// Width of the legend of a panel, px.
const LEGEND: u32 = 120;
/// Height of the title of the picture, px.
const TITLE: u32 = 40;
/// Height of a row of the labels of marks, px.
const MARK_ROW: u32 = 13;
/// Width of a letter of these labels, px.
const MARK_LETTER: f64 = 6.4;
/// Height of the title and of the labels below the axes of a panel of curves, px.
const AROUND: u32 = 75;
/// Height of a line of the caption, px.
const CAPTION_LINE: u32 = 17;
const GREY: RGBColor = RGBColor(120, 120, 120);

/// Draws the panels row by row in `columns` columns (at least 1). Returns the text of the SVG.
///
/// # Errors
/// The message of the drawing library.
pub fn draw(title: &str, panels: &[Panel], columns: usize) -> Result<String, String> {
    draw_captioned(title, panels, columns, &[])
}

/// As [`draw`], with lines of small text below the panels.
///
/// # Errors
/// The message of the drawing library.
pub fn draw_captioned(title: &str, panels: &[Panel], columns: usize, caption: &[String]) -> Result<String, String> {
    let (mut text, mut lines) = (String::new(), String::new());
    {
        let columns = columns.max(1);
        let legend = panels.iter().any(|panel| !panel.named().is_empty());
        let mut ends = vec![];
        let mut height = 0;
        for row in panels.chunks(columns) {
            // In several columns the panels are narrower, so make them taller.
            let height_of = |panel: &Panel| {
                let axis = axis_width(WIDTH / columns as u32, legend);
                panel.height() + MARK_ROW * (rows_of(&panel.mark_rows(&common_x(panels, panel), axis)) - 1)
            };
            let tallest = row.iter().map(height_of).max().unwrap_or(PANEL);
            height += if columns > 1 { tallest.max(PANEL * 3 / 2) } else { tallest };
            ends.push(height);
        }
        let below = if caption.is_empty() { 0 } else { CAPTION_LINE * (caption.len() as u32 + 1) };
        let root = SVGBackend::with_string(&mut text, (WIDTH, height + TITLE + below)).into_drawing_area();
        root.fill(&WHITE).map_err(|e| e.to_string())?;
        let root = root.titled(title, ("sans-serif", 20)).map_err(|e| e.to_string())?;
        if caption.is_empty() {
            // The last end is the end of the picture, which is no break.
            ends.pop();
        }
        let rows = root.split_by_breakpoints::<i32, u32, _, _>([], &ends);
        for (row, members) in rows.iter().zip(panels.chunks(columns)) {
            for (area, panel) in row.split_evenly((1, columns)).iter().zip(members) {
                draw_panel(area, panel, &common_x(panels, panel), legend, &mut lines)?;
            }
        }
        if let Some(area) = rows.last().filter(|_| !caption.is_empty()) {
            for (place, line) in caption.iter().enumerate() {
                let style = ("sans-serif", 12).into_font().color(&GREY);
                let at = (LABELS as i32 / 2, (CAPTION_LINE * place as u32 + CAPTION_LINE / 2) as i32);
                area.draw(&Text::new(line.clone(), at, style)).map_err(|e| e.to_string())?;
            }
        }
        root.present().map_err(|e| e.to_string())?;
    }
    // The drawing library rounds to whole pixels, which shows in print: curves are written with the places between.
    let end = text.rfind("</svg>").ok_or("the picture has no end")?;
    text.insert_str(end, &lines);
    Ok(text)
}

/// Writes a curve into an area with these axes, to a hundredth of a pixel.
fn write_curve(
    lines: &mut String,
    curve: &Curve,
    colour: RGBColor,
    pixels: &(Range<i32>, Range<i32>),
    axes: [&Range<f64>; 2],
) {
    let place = |value: f64, axis: &Range<f64>, from: i32, to: i32| {
        f64::from(from) + (value - axis.start) / (axis.end - axis.start) * f64::from(to - from)
    };
    let RGBColor(red, green, blue) = colour;
    // Writing to a String cannot fail.
    let _ = write!(
        lines,
        "<polyline fill=\"none\" stroke=\"#{red:02X}{green:02X}{blue:02X}\" stroke-width=\"1\" stroke-linejoin=\"round\" points=\""
    );
    for (x, y) in curve.points.iter().filter(|point| point.0.is_finite() && point.1.is_finite()) {
        let x = place(*x, axes[0], pixels.0.start, pixels.0.end);
        let y = place(*y, axes[1], pixels.1.end, pixels.1.start);
        let _ = write!(lines, "{x:.2},{y:.2} ");
    }
    *lines += "\"/>\n";
}

impl Panel {
    /// Index and name of the curves with a name, for the legend.
    fn named(&self) -> Vec<(usize, &str)> {
        let names: Vec<&str> = match &self.content {
            Content::Curves(curves) => curves.iter().map(|curve| curve.name.as_str()).collect(),
            Content::Cells(cells) => cells.names.iter().map(String::as_str).collect(),
            Content::Bars(_) | Content::Links(_) => vec![],
        };
        names.into_iter().enumerate().filter(|(_, name)| !name.is_empty()).collect()
    }

    /// The row of each mark's label, 0 on top, so that no label overprints another one; `axis` is the width of the axis, px.
    fn mark_rows(&self, x: &Range<f64>, axis: u32) -> Vec<u32> {
        if !matches!(self.content, Content::Curves(_)) {
            return vec![0; self.marks.len()];
        }
        let place = |at: f64| (at - x.start) / (x.end - x.start) * f64::from(axis);
        let mut order: Vec<usize> = (0..self.marks.len()).collect();
        order.sort_by(|a, b| self.marks[*a].0.total_cmp(&self.marks[*b].0));
        // Where the last label of each row ends.
        let mut ends: Vec<f64> = vec![];
        let mut rows = vec![0; self.marks.len()];
        for mark in order {
            let (at, label) = &self.marks[mark];
            let free = ends.iter().position(|end| *end <= place(*at)).unwrap_or(ends.len());
            let end = place(*at) + MARK_LETTER * (label.chars().count() + 2) as f64;
            if free == ends.len() {
                ends.push(end);
            } else {
                ends[free] = end;
            }
            rows[mark] = free as u32;
        }
        rows
    }

    /// Height, px: a phase portrait is taller than a curve over time, and many rows or nodes need more than a few.
    fn height(&self) -> u32 {
        match &self.content {
            Content::Curves(curves) if !over_time(curves) => PANEL * 8 / 5,
            Content::Bars(rows) => PANEL.max(80 + 20 * rows.len() as u32),
            Content::Links(graph) if graph.nodes.len() > 3 => PANEL * 2,
            Content::Cells(_) => PANEL * 2,
            _ => PANEL,
        }
    }
}

/// Width of the horizontal axis of a panel of curves, px.
fn axis_width(panel: u32, legend: bool) -> u32 {
    panel.saturating_sub(LABELS + 12 + if legend { LEGEND } else { 0 }).max(1)
}

/// How many rows there are, 1 or more.
fn rows_of(rows: &[u32]) -> u32 {
    rows.iter().max().map_or(1, |last| last + 1)
}

/// Range of the x axis of a panel. Panels with the same x label share one range, so that they can be compared.
fn common_x(panels: &[Panel], panel: &Panel) -> Range<f64> {
    let along = |panel: &Panel| match &panel.content {
        Content::Curves(curves) if over_time(curves) => {
            Some(curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.0)).collect::<Vec<f64>>())
        }
        Content::Curves(_) | Content::Links(_) | Content::Cells(_) => None,
        Content::Bars(rows) => Some(rows.iter().flat_map(|row| row.spans.iter().flat_map(|&(a, b)| [a, b])).collect()),
    };
    match (&panel.content, along(panel)) {
        (Content::Curves(curves), None) => {
            range_with_margin(curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.0)))
        }
        _ => exact_range(panels.iter().filter(|other| other.x == panel.x).filter_map(along).flatten()),
    }
}

fn over_time(curves: &[Curve]) -> bool {
    curves.iter().all(|curve| curve.points.windows(2).all(|pair| pair[0].0 <= pair[1].0))
}

/// Draws one panel. If any panel has a legend, all reserve its width, so that all axes end at the same place.
fn draw_panel(area: &Area<'_>, panel: &Panel, x: &Range<f64>, legend: bool, lines: &mut String) -> Result<(), String> {
    let (width, _) = area.dim_in_pixel();
    let legend_width = if legend { LEGEND } else { 0 };
    let (chart, legend_area) = area.split_horizontally(width.saturating_sub(legend_width));
    match &panel.content {
        Content::Curves(curves) => draw_curves(&chart, panel, x, curves, lines)?,
        Content::Bars(rows) => draw_bars(&chart, panel, x, rows)?,
        Content::Links(graph) => graph.draw(&chart, &panel.title)?,
        Content::Cells(cells) => cells.draw(&chart, &panel.title, [&panel.x, &panel.y])?,
    }
    draw_legend(&legend_area, panel)
}

/// A line and a name for each curve, and below it the band of its colour.
fn draw_legend(area: &Area<'_>, panel: &Panel) -> Result<(), String> {
    let mut y = 50;
    let name_at = |name: &str, y: i32| {
        area.draw(&Text::new(name.to_owned(), (30, y - 7), ("sans-serif", 14))).map_err(|e| e.to_string())
    };
    for (index, name) in panel.named() {
        let style = colour(index).stroke_width(2);
        area.draw(&PathElement::new([(4, y), (24, y)], style)).map_err(|e| e.to_string())?;
        name_at(name, y)?;
        y += 20;
        if let Some(band) = panel.bands.get(index).filter(|band| !band.name.is_empty()) {
            let strip = Rectangle::new([(4, y - 6), (24, y + 6)], colour(index).mix(0.25).filled());
            area.draw(&strip).map_err(|e| e.to_string())?;
            name_at(&band.name, y)?;
            y += 20;
        }
    }
    Ok(())
}

/// Range of values with a margin of 5 % at both ends.
fn range_with_margin(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let margin = 0.05 * (high - low).max(1e-6);
    if low > high { 0.0..1.0 } else { low - margin..high + margin }
}

/// Range of values without a margin.
fn exact_range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    if low >= high { 0.0..1.0 } else { low..high }
}

fn draw_curves(
    area: &Area<'_>,
    panel: &Panel,
    x: &Range<f64>,
    curves: &[Curve],
    lines: &mut String,
) -> Result<(), String> {
    let all = || curves.iter().flat_map(|curve| curve.points.iter().copied());
    let edges = panel.bands.iter().flat_map(|band| band.points.iter().flat_map(|&(_, low, high)| [low, high]));
    let mut y_range = range_with_margin(all().map(|p| p.1).chain(edges));
    let (width, height) = area.dim_in_pixel();
    let rows = panel.mark_rows(x, axis_width(width, false));
    if !panel.marks.is_empty() {
        // Space for the labels above the curves.
        let more = f64::from(MARK_ROW * (rows_of(&rows) - 1)) / f64::from(height.saturating_sub(AROUND).max(1));
        y_range.end += (0.12 + more) / (1.0 - more).max(0.1) * (y_range.end - y_range.start);
    }
    let top = y_range.end;
    let bottom = y_range.start;
    let mut chart =
        builder(area, &panel.title).build_cartesian_2d(x.clone(), y_range.clone()).map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .x_desc(&panel.x)
        .y_desc(&panel.y)
        .x_labels(9)
        .y_labels(7)
        .x_label_formatter(&format_number)
        .y_label_formatter(&format_number)
        .light_line_style(WHITE)
        .draw()
        .map_err(|e| e.to_string())?;
    for &(from, to) in &panel.shades {
        let strip = Rectangle::new([(from, bottom), (to, top)], GREY.mix(0.18).filled());
        chart.draw_series([strip]).map_err(|e| e.to_string())?;
    }
    for (index, Band { points: band, .. }) in panel.bands.iter().enumerate() {
        let there = band.iter().map(|&(x, low, _)| (x, low));
        let back = band.iter().rev().map(|&(x, _, high)| (x, high));
        let strip = Polygon::new(there.chain(back).collect::<Vec<_>>(), colour(index).mix(0.25).filled());
        chart.draw_series([strip]).map_err(|e| e.to_string())?;
    }
    let row_height = (top - bottom) / f64::from(chart.plotting_area().dim_in_pixel().1.max(1)) * f64::from(MARK_ROW);
    for ((at, label), row) in panel.marks.iter().zip(rows) {
        let line = PathElement::new([(*at, bottom), (*at, top)], GREY);
        chart.draw_series([line]).map_err(|e| e.to_string())?;
        let label = Text::new(
            format!(" {label}"),
            (*at, top - f64::from(row) * row_height),
            ("sans-serif", 12).into_font().color(&GREY),
        );
        chart.draw_series([label]).map_err(|e| e.to_string())?;
    }
    let mut pixels = chart.plotting_area().get_pixel_range();
    // The axes begin at the first pixel and end at the last.
    pixels.0.end -= 1;
    pixels.1.end -= 1;
    for (index, curve) in curves.iter().enumerate() {
        write_curve(lines, curve, colour(index), &pixels, [x, &y_range]);
    }
    Ok(())
}

fn draw_bars(area: &Area<'_>, panel: &Panel, x: &Range<f64>, rows: &[Bars]) -> Result<(), String> {
    let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
    let count = rows.len();
    let longest = names.iter().map(|name| name.chars().count() as u32).max().unwrap_or(0);
    let mut builder = builder(area, &panel.title);
    builder.y_label_area_size(LABELS.max(30 + 7 * longest));
    // The label of a row is at its middle, a whole number; the labels of marks are above the first row.
    let mut chart = builder.build_cartesian_2d(x.clone(), -0.5..count as f64 + 0.3).map_err(|e| e.to_string())?;
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
        .x_label_formatter(&format_number)
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
    for (at, label) in &panel.marks {
        let top = count as f64 + 0.3;
        chart.draw_series([PathElement::new([(*at, -0.5), (*at, top)], GREY)]).map_err(|e| e.to_string())?;
        let label = Text::new(format!(" {label}"), (*at, top - 0.05), ("sans-serif", 12).into_font().color(&GREY));
        chart.draw_series([label]).map_err(|e| e.to_string())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_titles_names_axes_and_curves() {
        let curve = Curve::new("left_hip", (0..50).map(|i| (f64::from(i), f64::from(i).sin())).collect());
        let panel = Panel::curves("angles", "time, s", "angle, deg", vec![curve]);
        let text = draw("walking", &[panel.clone(), panel.marked(&[(10.0, "here".into())])], 1).expect("drawn");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for wanted in ["walking", "angles", "left_hip", "time, s", "angle, deg", "here"] {
            assert!(text.contains(wanted), "{wanted}");
        }
        assert!(text.matches("<polyline").count() >= 2);
        // The last point of a panel's curve is at the right end of its axes, between two pixels in height.
        let last = text
            .lines()
            .rfind(|line| line.starts_with("<polyline"))
            .and_then(|line| line.split_whitespace().rev().nth(1));
        let (x, y) = last.and_then(|point| point.split_once(',')).expect("a point");
        assert!(x.ends_with(".00") && !y.ends_with(".00"), "{x}, {y}");
        let captioned = draw_captioned("walking", &[], 1, &["first line".into(), "second line".into()]).unwrap();
        assert!(captioned.contains("first line") && captioned.contains("second line"));
        let banded = Panel::curves("x", "s", "deg", vec![])
            .banded(vec![Band { name: String::new(), points: vec![(0.0, 1.0, 2.0), (1.0, 1.0, 3.0)] }]);
        assert!(draw("band", &[banded.shaded(&[(0.2, 0.4)])], 2).unwrap().contains("<polygon"));
        assert!(draw("nothing", &[Panel::curves("x", "s", "deg", vec![])], 2).is_ok());
    }

    /// Labels of marks that are near to each other are in rows, and a band is named below its curve.
    #[test]
    fn labels_do_not_overprint_each_other() {
        let curve = Curve::new("one", (0..=10).map(|i| (f64::from(i), f64::from(i))).collect());
        let marks = [(5.0, "second"), (4.9, "first"), (5.05, "third"), (0.0, "far"), (9.0, "last")];
        let marks = marks.map(|(at, label)| (at, label.to_owned()));
        let band = Band { name: "persons".into(), points: vec![(0.0, -1.0, 1.0), (10.0, 9.0, 11.0)] };
        let panel = Panel::curves("a", "s", "deg", vec![curve]).marked(&marks).banded(vec![band]);
        assert_eq!(panel.mark_rows(&(0.0..10.0), 700), [1, 0, 2, 0, 0]);
        let text = draw("marks", &[panel], 1).unwrap();
        assert!(text.contains("persons"), "{text}");
        // The place of each text, in the order in which they are drawn.
        let place = |label: &str| {
            let lines: Vec<&str> = text.lines().collect();
            let at = lines.iter().position(|line| line.trim() == label).unwrap_or_else(|| panic!("{label}: {text}"));
            let of = |key: &str| -> f64 {
                let tag = lines[at - 1];
                tag.split(key).nth(1).and_then(|rest| rest.split('"').next()).unwrap().parse().unwrap()
            };
            (of(" x=\""), of(" y=\""))
        };
        let boxes = ["first", "second", "third", "far", "last"].map(place);
        for (n, a) in boxes.iter().enumerate() {
            for b in &boxes[n + 1..] {
                assert!((a.1 - b.1).abs() >= 11.0 || (a.0 - b.0).abs() > 45.0, "{boxes:?}");
            }
        }
    }

    #[test]
    fn rows_of_bars_have_names_and_one_rectangle_per_bar() {
        let rows = ["TL", "ML"].map(|name| Bars { name: name.into(), spans: vec![(0.0, 1.0), (3.0, 4.0)] });
        let panel = Panel::bars("steps", "step", "leg", rows.to_vec());
        let with = draw("a hexapod", std::slice::from_ref(&panel), 1).unwrap();
        let without = draw("a hexapod", &[Panel { content: Content::Bars(vec![]), ..panel }], 1).unwrap();
        assert!(with.contains("TL") && with.contains("ML"), "{with}");
        assert_eq!(with.matches("<rect").count() - without.matches("<rect").count(), 4);
    }
}
