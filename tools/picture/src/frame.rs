//! What every kind of chart shares: title and margins, colours, numbers at the axes.

use plotters::coord::Shift;
use plotters::prelude::*;

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Width of the labels at the left of a chart, px.
pub(crate) const LABELS: u32 = 62;

/// Colours that are distinct on white, also for colour-blind readers (Okabe and Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];

pub(crate) const fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// Formats a number of an axis without superfluous digits.
pub(crate) fn format_number(value: &f64) -> String {
    // Steps of an axis are 1, 2 or 5 times a power of ten: rounding removes the error of their sum.
    let rounded = (value * 1e6).round() / 1e6;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}

/// Title and margins of a panel.
pub(crate) fn builder<'a, 'b>(area: &'a Area<'b>, title: &str) -> ChartBuilder<'a, 'b, SVGBackend<'b>> {
    let mut builder = ChartBuilder::on(area);
    builder.caption(title, ("sans-serif", 15)).margin(8).margin_right(20);
    builder.x_label_area_size(38).y_label_area_size(LABELS);
    builder
}
