//! A figure of a paper, computed again: its panels, what it shows, its parameters; as SVG and as CSV.

use picture::links::{Link, Node};
use picture::{Bars, Content, Curve, Panel, draw_captioned};

/// Characters of a line of the caption.
const LINE: usize = 160;

/// The heads of the columns of [`Figure::csv`].
pub const COLUMNS: [&str; 7] = ["panel", "kind", "series", "x_axis", "x", "y_axis", "y"];

/// A figure.
#[derive(Debug, Clone)]
pub struct Figure {
    /// The name of its files, without extension: the paper and the number there, with hyphens.
    pub name: &'static str,
    /// Its title.
    pub title: String,
    /// What is to be seen, in a sentence or two.
    pub shows: String,
    /// Model, parameters, starts and integrator.
    pub parameters: String,
    /// Its charts.
    pub panels: Vec<Panel>,
    /// Charts beside one another.
    pub columns: usize,
}

impl Figure {
    /// A figure with its charts below one another.
    #[must_use]
    pub fn new(name: &'static str, title: &str, shows: &str, parameters: &str, panels: Vec<Panel>) -> Self {
        let [title, shows, parameters] = [title, shows, parameters].map(String::from);
        Self { name, title, shows, parameters, panels, columns: 1 }
    }

    /// The picture, with the parameters and the command line that draws it below the charts.
    ///
    /// # Errors
    /// The message of the drawing library.
    pub fn svg(&self, command: &str) -> Result<String, String> {
        let parameters = wrapped(&format!("Parameters: {}", self.parameters));
        let caption: Vec<String> = parameters.into_iter().chain(wrapped(&format!("Command: {command}"))).collect();
        draw_captioned(&self.title, &self.panels, self.columns, &caption)
    }

    /// What is drawn, as CSV with the columns [`COLUMNS`]: a `curve` has a row a point; a `bar` a row with its first x and, as y, its last x;
    /// a `mark` its x; a `node` its note, and a `link` its two labels; a `cell` its class and its centre.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut rows = csv::Writer::from_writer(vec![]);
        let mut row = |fields: [&str; 7]| {
            // Writing to a vector cannot fail.
            let _ = rows.write_record(fields);
        };
        row(COLUMNS);
        for panel in &self.panels {
            let title = panel.title.as_str();
            match &panel.content {
                Content::Curves(curves) => {
                    for (x, y, name) in curves.iter().flat_map(points) {
                        row([title, "curve", name, &panel.x, &number(x), &panel.y, &number(y)]);
                    }
                }
                Content::Bars(bars) => {
                    for Bars { name, spans } in bars {
                        for (from, to) in spans {
                            row([title, "bar", name, &panel.x, &number(*from), &panel.x, &number(*to)]);
                        }
                    }
                }
                Content::Links(graph) => {
                    for Node { name, note } in &graph.nodes {
                        row([title, "node", name, "", "", "", note]);
                    }
                    for Link { ends: [a, b], labels: [from, to] } in &graph.links {
                        let name = format!("{} -> {}", graph.nodes[*a].name, graph.nodes[*b].name);
                        row([title, "link", &name, "", from, "", to]);
                    }
                }
                Content::Cells(cells) => {
                    for (place, class) in cells.classes.iter().enumerate() {
                        let [x, y] = cells.centre(place).map(number);
                        let class = class.and_then(|class| cells.names.get(class)).map_or("", String::as_str);
                        row([title, "cell", class, &panel.x, &x, &panel.y, &y]);
                    }
                }
            }
            for (at, label) in &panel.marks {
                row([title, "mark", label, &panel.x, &number(*at), "", ""]);
            }
        }
        rows.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
    }
}

fn points(curve: &Curve) -> impl Iterator<Item = (f64, f64, &str)> {
    curve.points().iter().map(|&(x, y)| (x, y, curve.name()))
}

/// Eight decimals, without superfluous zeros.
fn number(value: f64) -> String {
    ((value * 1e8).round() / 1e8 + 0.0).to_string()
}

/// The text in lines of at most [`LINE`] characters, broken at spaces.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("a line");
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > LINE {
            lines.push(word.into());
        } else {
            line.extend((!line.is_empty()).then_some(' '));
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_a_picture_and_its_numbers() {
        let curve = Curve::new("knee", vec![(0.0, 1.25), (0.5, -2.0)]);
        let panel = Panel::curves("angles", "time, s", "angle, deg", vec![curve]).marked(&[(0.25, "here".into())]);
        let figure = Figure::new("a-1", "Title", "Shows.", "p = 1", vec![panel]);
        let svg = figure.svg("footfall reproduce out").expect("drawn");
        assert!(svg.contains("Parameters: p = 1") && svg.contains("Command: footfall reproduce out"));
        let rows = "panel,kind,series,x_axis,x,y_axis,y\nangles,curve,knee,\"time, s\",0,\"angle, deg\",1.25\n\
                    angles,curve,knee,\"time, s\",0.5,\"angle, deg\",-2\nangles,mark,here,\"time, s\",0.25,,\n";
        assert_eq!(figure.csv(), rows);
    }

    #[test]
    fn a_caption_is_broken_at_spaces() {
        let lines = wrapped(&"word ".repeat(80));
        assert!(lines.len() == 3 && lines.iter().all(|line| line.chars().count() <= LINE), "{lines:?}");
        assert_eq!(wrapped("one"), ["one"]);
    }
}
