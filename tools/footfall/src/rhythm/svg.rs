//! Pictures of curves as one self-contained SVG: panels below one another.

use plotters::prelude::*;
use std::path::Path;

use crate::failure::Failure;

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

/// A pair of axes with its curves.
#[derive(Debug, Clone)]
pub struct Panel {
    /// What is drawn, with its unit.
    pub title: String,
    /// Name of the horizontal axis.
    pub x: String,
    /// The curves.
    pub curves: Vec<Curve>,
}

const WIDTH: u32 = 900;
const PANEL: u32 = 240;

/// Draws the panels and writes the file.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, title: &str, panels: &[Panel]) -> Result<(), Failure> {
    let text = draw(title, panels).map_err(Failure::run)?;
    std::fs::write(path, text).map_err(|error| Failure::run(format!("{}: cannot be written: {error}", path.display())))
}

/// The picture as text.
///
/// # Errors
/// The drawing library's own.
pub fn draw(title: &str, panels: &[Panel]) -> Result<String, String> {
    let mut text = String::new();
    {
        let size = (WIDTH, PANEL * panels.len() as u32 + 40);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| e.to_string())?;
        let root = root.titled(title, ("sans-serif", 22)).map_err(|e| e.to_string())?;
        for (area, panel) in root.split_evenly((panels.len(), 1)).iter().zip(panels) {
            one(area, panel)?;
        }
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

fn one(area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>, panel: &Panel) -> Result<(), String> {
    let all = || panel.curves.iter().flat_map(|curve| curve.points.iter().copied());
    let range = |of: fn((f64, f64)) -> f64| {
        let (low, high) = all().map(of).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let room = 0.05 * (high - low).max(1e-6);
        if low > high { 0.0..1.0 } else { low - room..high + room }
    };
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(28)
        .y_label_area_size(48)
        .build_cartesian_2d(range(|p| p.0), range(|p| p.1))
        .map_err(|e| e.to_string())?;
    chart.configure_mesh().x_desc(&panel.x).light_line_style(WHITE).draw().map_err(|e| e.to_string())?;
    for (index, curve) in panel.curves.iter().enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        let drawn =
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), &colour)).map_err(|e| e.to_string())?;
        if !curve.name.is_empty() {
            drawn.label(&curve.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour));
        }
    }
    if panel.curves.iter().any(|curve| !curve.name.is_empty()) {
        chart.configure_series_labels().background_style(WHITE.mix(0.8)).draw().map_err(|e| e.to_string())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_its_titles_names_and_curves() {
        let curve = Curve::new("left_hip", (0..50).map(|i| (f64::from(i), f64::from(i).sin())).collect());
        let panel = Panel { title: "angles".into(), x: "s".into(), curves: vec![curve] };
        let text = draw("a walk", &[panel.clone(), panel]).expect("drawn");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for wanted in ["a walk", "angles", "left_hip"] {
            assert!(text.contains(wanted), "{wanted}");
        }
        assert!(text.matches("<polyline").count() >= 2);
        assert!(draw("nothing", &[Panel { title: "x".into(), x: "s".into(), curves: vec![] }]).is_ok());
    }
}
