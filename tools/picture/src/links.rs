//! Node-link diagrams: nodes as boxes, links as arrows. The places of the nodes are computed.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A graph to draw.
#[derive(Debug, Clone, Default)]
pub struct Links {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// The links between them.
    pub links: Vec<Link>,
}

/// A box with two lines of text.
#[derive(Debug, Clone)]
pub struct Node {
    /// First line.
    pub name: String,
    /// Second line, in grey.
    pub note: String,
}

/// An arrow from the first to the second of two different nodes; links that name no node are left out.
#[derive(Debug, Clone)]
pub struct Link {
    /// The nodes, by their place in [`Links::nodes`].
    pub ends: [usize; 2],
    /// A label beside each end.
    pub labels: [String; 2],
}

type Point = (f64, f64);

/// Width of a character, px.
const CHARACTER: f64 = 8.0;
/// Width of a character of a label, px.
const LABEL_CHARACTER: f64 = 6.5;
/// Height of a label, px.
const LABEL_HEIGHT: f64 = 12.0;
/// Height of a box, px.
const BOX: f64 = 36.0;
const LINE: RGBColor = RGBColor(90, 90, 90);
const LABEL: RGBColor = RGBColor(0, 114, 178);

impl Links {
    /// Draws the graph with a title into an area.
    pub(crate) fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, title: &str) -> Result<(), String> {
        let (width, height) = area.dim_in_pixel();
        let font = |size, colour: &'static RGBColor| {
            let style = ("sans-serif", size).into_font().into_text_style(area).color(colour);
            style.pos(Pos::new(HPos::Center, VPos::Center))
        };
        let text = |content: &str, (x, y): Point, size, colour| {
            area.draw(&Text::new(content.to_owned(), (x as i32, y as i32), font(size, colour)))
                .map_err(|e| e.to_string())
        };
        text(title, (f64::from(width) / 2.0, 16.0), 15, &BLACK)?;
        let widest = self.nodes.iter().map(Node::width).fold(0.0, f64::max);
        let places = fit(layout(self), f64::from(width) - widest - 40.0, f64::from(height) - BOX - 60.0)
            .into_iter()
            .map(|(x, y)| (x + widest / 2.0 + 20.0, y + BOX / 2.0 + 40.0))
            .collect::<Vec<_>>();
        let pixels = |points: &[Point]| points.iter().map(|&(x, y)| (x as i32, y as i32)).collect::<Vec<_>>();
        for link in &self.links {
            let [Some((a, from)), Some((b, to))] =
                link.ends.map(|end| self.nodes.get(end).zip(places.get(end).copied()))
            else {
                continue;
            };
            let direction = unit((to.0 - from.0, to.1 - from.1));
            let along = |start: Point, by: f64, aside: f64| {
                (start.0 + by * direction.0 - aside * direction.1, start.1 + by * direction.1 + aside * direction.0)
            };
            let (start, end) = (along(from, a.reach(direction), 0.0), along(to, -b.reach(direction), 0.0));
            let shaft = PathElement::new(pixels(&[start, end]), LINE);
            let head = [end, along(end, -10.0, 4.0), along(end, -10.0, -4.0)];
            area.draw(&shaft).map_err(|e| e.to_string())?;
            area.draw(&Polygon::new(pixels(&head), LINE.filled())).map_err(|e| e.to_string())?;
            // Beside the line and clear of the box, whatever the direction of the link.
            let (across, up) = (direction.0.abs(), direction.1.abs());
            let clear = |label: &str| {
                let half = (label.chars().count() as f64 * LABEL_CHARACTER / 2.0, LABEL_HEIGHT / 2.0);
                (6.0 + across * half.0 + up * half.1, 3.0 + up * half.0 + across * half.1)
            };
            for (label, end, side) in [(&link.labels[0], start, 1.0), (&link.labels[1], end, -1.0)] {
                let (by, aside) = clear(label);
                // An arrow's head is at the second end.
                let by = if side < 0.0 { by + 6.0 } else { by };
                text(label, along(end, side * by, aside), 12, &LABEL)?;
            }
        }
        for (node, (x, y)) in self.nodes.iter().zip(places) {
            let corners = [(x - node.width() / 2.0, y - BOX / 2.0), (x + node.width() / 2.0, y + BOX / 2.0)];
            let [low, high] = corners.map(|(x, y)| (x as i32, y as i32));
            for style in [WHITE.filled(), BLACK.stroke_width(1)] {
                area.draw(&Rectangle::new([low, high], style)).map_err(|e| e.to_string())?;
            }
            text(&node.name, (x, y - 7.0), 14, &BLACK)?;
            text(&node.note, (x, y + 9.0), 11, &LINE)?;
        }
        Ok(())
    }
}

impl Node {
    fn width(&self) -> f64 {
        self.name.chars().count().max(self.note.chars().count() * 3 / 4) as f64 * CHARACTER + 16.0
    }

    /// From the middle of the box to its border in a direction.
    fn reach(&self, (x, y): Point) -> f64 {
        (self.width() / 2.0 / x.abs().max(1e-9)).min(BOX / 2.0 / y.abs().max(1e-9))
    }
}

fn unit((x, y): Point) -> Point {
    let length = x.hypot(y).max(1e-9);
    (x / length, y / length)
}

/// Places at which the distances of the nodes are as near as possible to their distances along the links: stress majorisation (Gansner,
/// Koren and North 2004), begun on a circle.
fn layout(graph: &Links) -> Vec<Point> {
    let count = graph.nodes.len();
    let turn = |node: usize| (node as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
    let mut places: Vec<Point> =
        (0..count).map(turn).map(|(sin, cos)| (0.3 * count as f64 * sin, 0.3 * count as f64 * cos)).collect();
    let distances: Vec<Vec<f64>> = (0..count).map(|start| distances(graph, start)).collect();
    for _ in 0..300 {
        for node in 0..count {
            let (mut sum, mut weights) = ((0.0, 0.0), 0.0);
            for other in (0..count).filter(|&other| other != node) {
                let (to, wanted) = (places[other], distances[node][other]);
                let away = unit((places[node].0 - to.0, places[node].1 - to.1));
                let weight = wanted.powi(-2);
                sum = (sum.0 + weight * (to.0 + wanted * away.0), sum.1 + weight * (to.1 + wanted * away.1));
                weights += weight;
            }
            if weights > 0.0 {
                places[node] = (sum.0 / weights, sum.1 / weights);
            }
        }
    }
    places
}

/// Number of links from a node to each other one; for those without a path a little more than the longest.
fn distances(graph: &Links, start: usize) -> Vec<f64> {
    let mut found: Vec<Option<usize>> = vec![None; graph.nodes.len()];
    let (mut here, mut steps) = (vec![start], 0);
    while !here.is_empty() {
        here.retain(|&node| found.get_mut(node).is_some_and(|at| at.is_none() && at.replace(steps).is_none()));
        let next = |&node: &usize| {
            graph.links.iter().filter_map(move |link| {
                let end = link.ends.iter().position(|&end| end == node)?;
                Some(link.ends[1 - end])
            })
        };
        here = here.iter().flat_map(next).collect();
        steps += 1;
    }
    let longest = found.iter().flatten().max().map_or(1, |steps| steps + 1);
    found.into_iter().map(|steps| steps.unwrap_or(longest) as f64).collect()
}

/// Turns the longest extent to the horizontal and scales into a rectangle, with the middle at its middle.
fn fit(mut places: Vec<Point>, width: f64, height: f64) -> Vec<Point> {
    let count = places.len().max(1) as f64;
    let sum = places.iter().fold((0.0, 0.0), |sum, place| (sum.0 + place.0, sum.1 + place.1));
    let middle = (sum.0 / count, sum.1 / count);
    places.iter_mut().for_each(|place| *place = (place.0 - middle.0, place.1 - middle.1));
    let moment = |product: fn(&Point) -> f64| places.iter().map(product).sum::<f64>();
    let (xx, xy, yy) = (moment(|p| p.0 * p.0), moment(|p| p.0 * p.1), moment(|p| p.1 * p.1));
    let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    places.iter_mut().for_each(|p| *p = (cos * p.0 + sin * p.1, cos * p.1 - sin * p.0));
    let extent = |value: fn(&Point) -> f64| {
        places.iter().map(value).fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ((left, right), (top, bottom)) = (extent(|p| p.0), extent(|p| p.1));
    // A link has 160 px at most, so that two nodes are not at both ends of the picture.
    let scale = (width / (right - left).max(1e-9)).min(height / (bottom - top).max(1e-9)).min(160.0);
    let place = |(x, y): Point| {
        (width / 2.0 + scale * (x - (left + right) / 2.0), height / 2.0 + scale * (y - (top + bottom) / 2.0))
    };
    places.into_iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: usize) -> Links {
        let nodes = (0..count).map(|node| Node { name: format!("n{node}"), note: "r = 1".into() });
        let links = (0..count).map(|node| Link { ends: [node, (node + 1) % count], labels: ["0".into(), "1".into()] });
        Links { nodes: nodes.collect(), links: links.collect() }
    }

    /// A square of links of length 1, whose diagonals would have length 2.
    #[test]
    fn a_ring_of_four_is_a_square() {
        let places = layout(&ring(4));
        let distance = |a: usize, b: usize| (places[a].0 - places[b].0).hypot(places[a].1 - places[b].1);
        let sides: Vec<f64> = (0..4).map(|node| distance(node, (node + 1) % 4)).collect();
        assert!(sides.iter().all(|side| (side - sides[0]).abs() < 1e-3 && (0.9..1.3).contains(side)), "{sides:?}");
        assert!((distance(0, 2) - distance(1, 3)).abs() < 1e-3);
    }

    #[test]
    fn places_fill_the_rectangle_and_nothing_more() {
        for count in 1..20 {
            for (x, y) in fit(layout(&ring(count)), 400.0, 200.0) {
                assert!(
                    (-1e-6..=400.0 + 1e-6).contains(&x) && (-1e-6..=200.0 + 1e-6).contains(&y),
                    "{count}: {x}, {y}"
                );
            }
        }
        assert_eq!(fit(layout(&Links::default()), 400.0, 200.0), vec![]);
    }
}
