//! The pictures of `walk`, `obb`, `hexapod` and `smer`, read back: every bar and every point is where the data of the same run say.

mod common;

use common::{footfall, said};
use serde_json::Value;
use std::collections::BTreeSet;

/// Standard output and the picture of a command.
fn drawn(arguments: &[&str]) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.svg");
    let output = footfall(arguments.iter().copied().chain(["--svg", path.to_str().unwrap()]));
    assert!(output.status.success(), "{arguments:?}: {}", said(&output));
    (String::from_utf8(output.stdout).unwrap(), std::fs::read_to_string(&path).unwrap())
}

fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    let from = element.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("no {name}: {element}")) + name.len() + 3;
    element[from..].split('"').next().unwrap()
}

/// The curves: coloured lines of more than two points, in the order of the file.
fn curves(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let lines =
        svg.split('<').filter(|element| element.starts_with("polyline") && attribute(element, "stroke") != "#000000");
    let points = lines.map(|line| {
        let pairs = attribute(line, "points").split_whitespace().map(|pair| pair.split_once(',').unwrap());
        pairs.map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).collect::<Vec<_>>()
    });
    points.filter(|points| points.len() > 2).collect()
}

/// The bars of all rows as (row, step): rows and steps are numbered by their places, which needs a bar in each row and in each step.
fn bars(svg: &str) -> BTreeSet<(usize, usize)> {
    let is_bar =
        |element: &&str| element.starts_with("rect") && !["#FFFFFF", "none"].contains(&attribute(element, "fill"));
    let rectangles = svg.split('<').filter(is_bar);
    let places: Vec<[u32; 2]> =
        rectangles.map(|bar| ["y", "x"].map(|name| attribute(bar, name).parse().unwrap())).collect();
    let [rows, steps] = [0, 1].map(|axis| places.iter().map(|place| place[axis]).collect::<BTreeSet<u32>>());
    let number = |all: &BTreeSet<u32>, of: u32| all.iter().position(|place| *place == of).unwrap();
    let found: BTreeSet<_> = places.iter().map(|&[row, step]| (number(&rows, row), number(&steps, step))).collect();
    assert_eq!(found.len(), places.len(), "a bar twice");
    found
}

/// Whether pixels are a straight line over the values, rising or falling, to within rounding.
fn assert_linear(pixels: &[f64], values: &[f64], rising: bool, what: &str) {
    assert_eq!(pixels.len(), values.len(), "{what}");
    let place = |of: fn(f64, f64) -> bool| {
        (1..values.len()).fold(0, |best, n| if of(values[n], values[best]) { n } else { best })
    };
    let (least, most) = (place(|a, b| a < b), place(|a, b| a > b));
    let slope = (pixels[most] - pixels[least]) / (values[most] - values[least]);
    assert!(
        if rising { slope > 0.0 } else { slope < 0.0 } && (pixels[most] - pixels[least]).abs() > 40.0,
        "{what}: {slope}"
    );
    for (pixel, value) in pixels.iter().zip(values) {
        let wanted = pixels[least] + slope * (value - values[least]);
        assert!((pixel - wanted).abs() <= 2.0, "{what}: {pixel}, not {wanted}");
    }
}

/// Four angles over time, four velocities over time, four portraits, each of the joint and the quantity that its panel names.
#[test]
fn a_walk_is_drawn_as_it_is() {
    let run =
        ["walk", "--gait", "natural-walk", "--secs", "3", "--json", "--switch", "t=1 run", "--switch", "t=2 stop"];
    let (out, svg) = drawn(&run);
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let column = |key: &str, joint: usize| -> Vec<f64> {
        lines.iter().map(|line| if key == "t_s" { &line[key] } else { &line[key][joint] }.as_f64().unwrap()).collect()
    };
    let curves = curves(&svg);
    assert_eq!(curves.len(), 12);
    for (n, curve) in curves.iter().enumerate() {
        let joint = n % 4;
        let (x, y) = match n / 4 {
            0 => ("t_s", "angles_deg"),
            1 => ("t_s", "rates_deg_s"),
            _ => ("angles_deg", "rates_deg_s"),
        };
        let (pixels_x, pixels_y): (Vec<f64>, Vec<f64>) = curve.iter().copied().unzip();
        assert_linear(&pixels_x, &column(x, joint), true, &format!("curve {n}, {x}"));
        // Up in the picture is a smaller number of pixels.
        assert_linear(&pixels_y, &column(y, joint), false, &format!("curve {n}, {y}"));
    }
    let titles = [
        "joint angles",
        "angular velocities",
        "left_hip: phase",
        "right_hip: phase",
        "left_knee: phase",
        "right_knee: phase",
    ];
    let places: Vec<usize> = titles.iter().map(|title| svg.find(title).unwrap_or_else(|| panic!("{title}"))).collect();
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn the_swings_of_the_hexapod_are_its_bars() {
    for more in
        [&[][..], &["--orientation", "dd-du-lrr", "--reversibility", "1"], &["--switch", "7:3 15:1", "--steps", "24"]]
    {
        let (out, svg) = drawn(&[&["hexapod", "--json"], more].concat());
        let object: Value = serde_json::from_str(&out).unwrap();
        let mut wanted = BTreeSet::new();
        for (step, legs) in object["steps"].as_array().unwrap().iter().enumerate() {
            for leg in legs.as_array().unwrap() {
                let names = ["TL", "ML", "BL", "TR", "MR", "BR"];
                wanted.insert((names.iter().position(|name| leg == name).unwrap(), step));
            }
        }
        assert_eq!(bars(&svg), wanted, "{more:?}");
    }
}

#[test]
fn the_word_of_the_building_block_is_its_bars() {
    let (out, svg) = drawn(&["obb", "--reversibility", "1,5", "--steps", "40", "--switch", "20:3,2"]);
    let word = out.trim().chars().enumerate().map(|(step, letter)| (usize::from(letter == 'E'), step));
    assert_eq!(bars(&svg), word.collect());
}

#[test]
fn the_operations_of_a_graph_are_its_bars() {
    let folder = tempfile::tempdir().unwrap();
    let graph = folder.path().join("graph.txt");
    std::fs::write(&graph, "b = 2\nc = 3\na b 2 0\nb c 2 2\na c 3 0\n").unwrap();
    let (out, svg) = drawn(&["smer", graph.to_str().unwrap(), "--steps", "30", "--json"]);
    let object: Value = serde_json::from_str(&out).unwrap();
    let nodes: Vec<&str> = object["nodes"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let mut wanted = BTreeSet::new();
    for (step, operating) in object["steps"].as_array().unwrap().iter().enumerate() {
        for node in operating.as_array().unwrap() {
            wanted.insert((nodes.iter().position(|name| node == name).unwrap(), step));
        }
    }
    assert_eq!(bars(&svg), wanted);
    // The picture of the graph: the start has all tokens of both edges of a at a, to which they point, and two at each end of the third.
    assert_eq!(svg.matches("<polygon").count(), 3);
    for note in ["r = 1", "r = 2", "r = 3"] {
        assert!(svg.contains(note), "{note}");
    }
}
