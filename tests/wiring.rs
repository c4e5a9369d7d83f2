//! Wiring pictures of the STM32F4 boards, drawn from the board files: `docs/wiring-*.svg`, which `FOOTFALL_WRITE_DOCS=1` writes again.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use firmware::board::{BOARDS, Board, Pin};

/// What is printed at the pins of a board, which its board file does not have.
struct Print {
    /// Name of the board.
    title: &'static str,
    /// Name of the picture.
    file: &'static str,
    /// What is printed at the supply of the sensor and of the emergency stop, and where; ground likewise, for servos and for the sensor.
    supply: [&'static str; 3],
    grounds: [&'static str; 2],
    /// Connector and number of a pin.
    place: fn(&str) -> &'static str,
    /// Last line of the picture.
    note: &'static str,
}

/// In the order of [`BOARDS`]. Discovery: UM1472, headers P1 and P2. Nucleo: UM1724, Arduino names and the connectors CN6, CN7 and CN10. A Black Pill
/// prints the names of its pins without the P.
const PRINTS: [Print; 3] = [
    Print {
        title: "STM32F4 Discovery",
        file: "wiring-discovery.svg",
        supply: ["3V", "P2-5", "P2-6"],
        grounds: ["P1-49", "P1-1"],
        place: |pin| match pin {
            "PE9" => "P1-27",
            "PE11" => "P1-29",
            "PE13" => "P1-31",
            "PE14" => "P1-32",
            "PC8" => "P2-45",
            "PA1" => "P1-11",
            "PC1" => "P1-7",
            "PB0" => "P1-22",
            "PB1" => "P1-21",
            "PC5" => "P1-19",
            "PB12" => "P1-36",
            "PC6" => "P2-47",
            "PB5" => "P2-26",
            "PA2" => "P1-14",
            "PA3" => "P1-13",
            "PA0" => "B1",
            "PD12" => "LD4",
            "PD14" => "LD5",
            _ => "",
        },
        note: "3 V only: 5 V at the sensor's input damages the chip.",
    },
    Print {
        title: "Nucleo-F446RE",
        file: "wiring-nucleo.svg",
        supply: ["3V3", "CN6-4", "CN7-16"],
        grounds: ["CN10-9", "CN6-6"],
        place: |pin| match pin {
            "PA8" => "D7, CN10-23",
            "PA9" => "D8, CN10-21",
            "PA10" => "D2, CN10-33",
            "PA11" => "CN10-14",
            "PC8" => "CN10-2",
            "PA1" => "A1, CN7-30",
            "PC1" => "A4, CN7-36",
            "PB0" => "A3, CN7-34",
            "PB1" => "CN10-24",
            "PC5" => "CN10-6",
            "PB12" => "CN10-16",
            "PC6" => "CN10-4",
            "PB5" => "D4, CN10-29",
            "PA2" | "PA3" => "ST-LINK",
            "PC13" => "B1",
            "PA5" => "LD2",
            _ => "",
        },
        note: "3.3 V only: 5 V at the sensor's input damages the chip. CN7 and CN10 are the morpho headers.",
    },
    Print {
        title: "Black Pill F411",
        file: "wiring-black-pill.svg",
        supply: ["3V3", "", ""],
        grounds: ["G", "G"],
        place: |pin| match pin {
            "PA8" => "A8",
            "PA9" => "A9",
            "PA10" => "A10",
            "PA11" => "A11",
            "PB8" => "B8",
            "PA1" => "A1",
            "PA5" => "A5",
            "PB0" => "B0",
            "PB1" => "B1",
            "PB7" => "B7",
            "PB12" => "B12",
            "PB9" => "B9",
            "PB5" => "B5",
            "PA2" => "A2",
            "PA3" => "A3",
            "PA0" => "KEY",
            "PC13" => "C13",
            _ => "",
        },
        note: "A11 is D- of the USB socket: with that servo, feed the board at its pin 5V, or by a cable without data lines.",
    },
];

const BLACK: &str = "#24292f";
const GREY: &str = "#57606a";
const RED: &str = "#cf222e";
const BLUE: &str = "#0969da";
const ORANGE: &str = "#9a6700";
/// Right edge of the board.
const EDGE: u32 = 250;
/// Height of the ground between board and servos, where all grounds meet.
const GROUND: u32 = 470;

/// An SVG picture, drawn in pixels.
struct Drawing(String);

impl Drawing {
    fn line(&mut self, points: &[(u32, u32)], colour: &str, width: u32) {
        let points: Vec<String> = points.iter().map(|(x, y)| format!("{x},{y}")).collect();
        let points = points.join(" ");
        let _ = writeln!(
            self.0,
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"/>"
        );
    }

    fn dot(&mut self, x: u32, y: u32, radius: u32, colour: &str) {
        let _ = writeln!(self.0, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\"/>");
    }

    fn frame(&mut self, [x, y, width, height]: [u32; 4], fill: &str, stroke: &str) {
        let _ = writeln!(
            self.0,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"4\" fill=\"{fill}\" stroke=\"{stroke}\"/>"
        );
    }

    /// `anchor`: `start`, `middle` or `end` of the text at `x`.
    fn text(&mut self, x: u32, y: u32, anchor: &str, colour: &str, text: &str) {
        let _ = writeln!(self.0, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" fill=\"{colour}\">{text}</text>");
    }

    fn bold(&mut self, x: u32, y: u32, anchor: &str, text: &str) {
        let text = format!("<tspan font-weight=\"bold\">{text}</tspan>");
        self.text(x, y, anchor, BLACK, &text);
    }

    /// A resistor in a line, from its left end.
    fn resistor_across(&mut self, x: u32, y: u32, ohms: &str) {
        self.frame([x, y - 5, 30, 10], "#fff", BLACK);
        self.text(x + 15, y - 10, "middle", BLACK, ohms);
    }

    /// A resistor in a vertical line, from its upper end.
    fn resistor_down(&mut self, x: u32, y: u32, ohms: &str) {
        self.frame([x - 5, y, 10, 26], "#fff", BLACK);
        self.text(x + 10, y + 18, "start", BLACK, ohms);
    }

    /// A capacitor in a vertical line: the plates.
    fn capacitor_down(&mut self, x: u32, y: u32, farads: &str) {
        self.frame([x - 3, y + 1, 6, 4], "#fff", "#fff");
        self.line(&[(x - 10, y), (x + 10, y)], BLACK, 2);
        self.line(&[(x - 10, y + 6), (x + 10, y + 6)], BLACK, 2);
        self.text(x + 15, y + 8, "start", BLACK, farads);
    }

    /// Ground of the board.
    fn ground(&mut self, x: u32, y: u32) {
        for (row, half) in [(0, 12), (4, 8), (8, 4)] {
            self.line(&[(x - half, y + row), (x + half, y + row)], BLACK, 2);
        }
    }

    /// A pin at the edge of the board: its name, and what is printed there.
    fn pin(&mut self, y: u32, name: &str, place: &str) {
        self.dot(EDGE, y, 4, BLACK);
        let text = format!("{place}<tspan dx=\"10\" font-weight=\"bold\" fill=\"{BLACK}\">{name}</tspan>");
        self.text(EDGE - 10, y + 5, "end", GREY, &text);
    }
}

fn servos(to: &mut Drawing, board: &Board, print: &Print) {
    let names = ["left hip", "right hip", "left knee", "right knee"];
    for (row, (pin, name)) in (0_u32..).zip(board.servos.into_iter().zip(names)) {
        let y = 290 + 40 * row;
        to.pin(y, pin.name, (print.place)(pin.name));
        to.line(&[(EDGE, y), (610, y)], ORANGE, 2);
        let x = 300 + 30 * row;
        to.dot(x, y, 3, ORANGE);
        to.line(&[(x, y), (x, GROUND)], GREY, 1);
        to.frame([x - 5, 432, 10, 26], "#fff", BLACK);
        to.frame([610, y - 16, 170, 34], "#f6f8fa", GREY);
        to.bold(620, y + 6, "start", &format!("servo {name}"));
        to.text(774, y - 2, "end", BLACK, "+");
        to.text(774, y + 14, "end", BLACK, "−");
        to.line(&[(780, y - 7), (830, y - 7)], RED, 2);
        to.line(&[(780, y + 9), (800, y + 9)], BLACK, 2);
        to.dot(800, y + 9, 4, BLACK);
        to.dot(830, y - 7, 4, RED);
    }
    to.text(405, 450, "start", BLACK, "4 × 10 kΩ");
    to.text(460, 283, "start", ORANGE, "pulses");
    to.line(&[(800, 299), (800, GROUND)], BLACK, 4);
    to.line(&[(830, 225), (830, 403)], RED, 4);
    to.text(838, 250, "start", RED, "servo rail");
}

/// Supply, fuse, switch by hand, and the switch of the board.
fn power(to: &mut Drawing, board: &Board, print: &Print) {
    let rail = board.servo_rail.name;
    // The positive line, against the current.
    to.line(&[(640, 120), (640, 80), (940, 80), (940, 560)], RED, 4);
    to.frame([880, 150, 120, 44], "#ffebe9", RED);
    to.text(940, 168, "middle", RED, "servo power");
    to.text(940, 185, "middle", RED, "switch, by hand");
    to.frame([932, 300, 16, 36], "#fff", RED);
    to.line(&[(940, 300), (940, 336)], RED, 1);
    to.text(956, 315, "start", RED, "fuse");
    to.text(956, 332, "start", RED, "5 or 15 A");
    to.frame([860, 560, 150, 56], "#f6f8fa", GREY);
    to.text(890, 577, "middle", BLACK, "−");
    to.text(940, 577, "middle", BLACK, "+");
    to.bold(935, 595, "middle", "servo supply");
    to.text(935, 611, "middle", BLACK, "5 to 6 V");
    // The negative line, and the capacitor across both.
    to.line(&[(890, 560), (890, GROUND), (EDGE, GROUND)], BLACK, 4);
    to.dot(800, GROUND, 7, BLACK);
    to.text(790, 491, "end", BLACK, "all grounds meet here, at one point");
    to.line(&[(890, 520), (911, 520)], BLACK, 2);
    to.line(&[(919, 520), (940, 520)], BLACK, 2);
    to.line(&[(911, 506), (911, 534)], BLACK, 2);
    to.line(&[(919, 506), (919, 534)], BLACK, 2);
    to.dot(890, 520, 4, BLACK);
    to.dot(940, 520, 4, RED);
    to.text(956, 516, "start", BLACK, "capacitor");
    to.text(956, 533, "start", BLACK, "1000 µF");
    // The switch of the board.
    let _ = writeln!(
        to.0,
        "<rect x=\"385\" y=\"48\" width=\"335\" height=\"200\" rx=\"6\" fill=\"none\" stroke=\"{GREY}\" stroke-dasharray=\"6 4\"/>"
    );
    to.text(393, 42, "start", BLACK, "rail switch: this circuit, or a part with a logic input");
    to.line(&[(520, 140), (520, 80), (640, 80)], RED, 2);
    to.dot(640, 80, 4, RED);
    to.resistor_down(520, 96, "1 kΩ");
    to.line(&[(520, 140), (600, 140)], BLACK, 2);
    to.dot(520, 140, 4, BLACK);
    to.resistor_across(546, 140, "100 Ω");
    to.frame([600, 120, 90, 40], "#f6f8fa", GREY);
    to.bold(645, 145, "middle", "P-channel");
    to.text(648, 114, "start", GREY, "source");
    to.text(648, 176, "start", GREY, "drain");
    to.line(&[(640, 160), (640, 225), (830, 225)], RED, 4);
    to.line(&[(520, 140), (520, 180)], BLACK, 2);
    to.frame([475, 180, 90, 34], "#f6f8fa", GREY);
    to.bold(520, 202, "middle", "N-channel");
    to.line(&[(520, 214), (520, 228)], BLACK, 2);
    to.ground(520, 228);
    to.pin(197, rail, (print.place)(rail));
    to.line(&[(EDGE, 197), (475, 197)], BLUE, 2);
    to.resistor_across(415, 197, "100 Ω");
    to.dot(300, 197, 4, BLUE);
    to.line(&[(300, 197), (300, 245)], BLACK, 1);
    to.resistor_down(300, 208, "10 kΩ");
    to.ground(300, 245);
    to.text(258, 172, "start", BLUE, "high while there");
    to.text(258, 187, "start", BLUE, "are pulses");
    to.pin(GROUND, "GND", print.grounds[0]);
}

fn goniometer(to: &mut Drawing, board: &Board, print: &Print) {
    let pin = board.sensors[0].pin.name;
    let [supply, place, _] = print.supply;
    to.pin(550, supply, place);
    to.pin(590, pin, (print.place)(pin));
    to.pin(645, "GND", print.grounds[1]);
    to.line(&[(EDGE, 550), (620, 550)], RED, 2);
    to.line(&[(EDGE, 590), (620, 590)], BLUE, 2);
    to.line(&[(EDGE, 645), (620, 645)], BLACK, 2);
    for (x, top) in [(310, BLUE), (500, BLUE)] {
        to.line(&[(x, 590), (x, 645)], BLACK, 1);
        to.dot(x, 590, 4, top);
        to.dot(x, 645, 4, BLACK);
    }
    to.capacitor_down(310, 614, "10 nF");
    to.resistor_across(400, 590, "1 kΩ");
    to.resistor_down(500, 604, "100 kΩ");
    to.frame([620, 530, 170, 130], "#f6f8fa", GREY);
    to.text(628, 555, "start", GREY, "end");
    to.text(628, 595, "start", GREY, "wiper");
    to.text(628, 650, "start", GREY, "end");
    to.bold(725, 600, "middle", "goniometer");
    to.text(725, 618, "middle", BLACK, "5 to 10 kΩ");
}

fn emergency_stop(to: &mut Drawing, board: &Board, print: &Print) {
    let pin = board.emergency_stop.name;
    let [supply, _, place] = print.supply;
    to.pin(700, pin, (print.place)(pin));
    to.pin(765, supply, place);
    to.line(&[(EDGE, 700), (560, 700), (560, 765), (EDGE, 765)], BLUE, 2);
    to.dot(310, 700, 4, BLUE);
    to.line(&[(310, 700), (310, 730)], BLACK, 1);
    to.capacitor_down(310, 712, "1 nF");
    to.ground(310, 730);
    to.resistor_across(340, 765, "1 kΩ");
    for x in [440, 510] {
        to.dot(x, 765, 5, BLUE);
    }
    to.line(&[(440, 760), (510, 760)], BLUE, 3);
    to.line(&[(475, 760), (475, 738)], BLUE, 2);
    to.line(&[(460, 738), (490, 738)], BLUE, 4);
    to.text(580, 728, "start", BLUE, "emergency stop: a normally closed contact;");
    to.text(580, 746, "start", BLUE, "open, or with a cut cable, it stops the pulses");
}

/// The other pins of the board, one line each.
fn others(board: &Board) -> Vec<(&'static str, Vec<Pin>)> {
    vec![
        ("sensors 2 to 4", board.sensors[1..].iter().map(|sensor| sensor.pin).collect()),
        ("foot switch", vec![board.foot_switch]),
        ("synchronisation input, output", vec![board.sync_input, board.sync_output]),
        ("serial port: output, input", vec![board.serial_out, board.serial_in]),
        ("user button on the board", vec![board.button]),
        ("lamps on the board (pulses, faults)", board.led_pulses.into_iter().chain(board.led_fault).collect()),
    ]
}

fn picture(board: &Board, print: &Print) -> String {
    let title = format!("Wiring of the {}", print.title);
    let mut to = Drawing(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1050 940\" width=\"1050\" height=\"940\" role=\"img\" aria-labelledby=\"t d\" \
         font-family=\"sans-serif\" font-size=\"14\">\n<title id=\"t\">{title}</title>\n<desc id=\"d\">Four servos get their pulses from the board, each \
         signal line with 10 kilohm to ground. Their supply goes through a fuse, a switch by hand and the rail switch, which the board switches on \
         while there are pulses. All grounds meet at one point. A goniometer is between the board's 3 volts and ground, its wiper with 100 kilohm to \
         ground and 1 kilohm in series. A normally closed contact from 3 volts through 1 kilohm is the emergency stop.</desc>\n\
         <rect width=\"1050\" height=\"940\" fill=\"#fff\"/>\n"
    ));
    to.bold(20, 28, "start", &title);
    to.frame([20, 130, EDGE - 20, 670], "#f6f8fa", GREY);
    to.bold(40, 156, "start", print.title);
    servos(&mut to, board, print);
    power(&mut to, board, print);
    goniometer(&mut to, board, print);
    emergency_stop(&mut to, board, print);
    to.ground(35, 819);
    to.text(55, 827, "start", BLACK, "GND of the board");
    to.text(200, 827, "start", RED, print.note);
    to.bold(20, 858, "start", "Not needed for the first walk:");
    for (row, (what, pins)) in (0_u32..).zip(others(board)) {
        let pins: Vec<String> = pins
            .iter()
            .map(|pin| format!("<tspan font-weight=\"bold\">{pin}</tspan> ({})", (print.place)(pin.name)))
            .collect();
        let (x, y) = (20 + 500 * (row / 3), 882 + 22 * (row % 3));
        to.text(x, y, "start", BLACK, &format!("{what}: {}", pins.join(", ")));
    }
    to.0 + "</svg>\n"
}

fn path(print: &Print) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(print.file)
}

#[test]
fn the_pictures_are_drawn_from_the_board_files() {
    for (board, print) in BOARDS.into_iter().zip(&PRINTS) {
        let drawn = picture(board, print);
        if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some() {
            std::fs::write(path(print), &drawn).expect("written");
        }
        let stored = std::fs::read_to_string(path(print)).unwrap_or_default();
        assert!(stored == drawn, "docs/{} is not up to date; FOOTFALL_WRITE_DOCS=1 writes it", print.file);
    }
}

/// Each pin of a board is named once, with a place of its own, and no picture names a pin that its board does not use.
#[test]
fn each_picture_names_each_pin_of_its_board_once() {
    for (board, print) in BOARDS.into_iter().zip(&PRINTS) {
        let fixed = [board.servo_rail, board.sensors[0].pin, board.emergency_stop];
        let all: Vec<Pin> =
            board.servos.into_iter().chain(fixed).chain(others(board).into_iter().flat_map(|(_, pins)| pins)).collect();
        let drawn = picture(board, print);
        for pin in &all {
            assert_eq!(drawn.matches(&format!(">{pin}<")).count(), 1, "{pin} in {}", print.file);
            assert_ne!((print.place)(pin.name), "", "{}: where is {pin}?", print.title);
            let here: Vec<&Pin> =
                all.iter().filter(|other| (print.place)(other.name) == (print.place)(pin.name)).collect();
            assert!(here.len() == 1 || (print.place)(pin.name) == "ST-LINK", "{}: {here:?} at one place", print.title);
        }
        let named = drawn.split('>').filter(|text| text.starts_with('P') && text.contains("</tspan"));
        let named: Vec<&str> = named
            .filter_map(|text| text.split_once('<'))
            .map(|(name, _)| name)
            .filter(|name| name.len() <= 4)
            .collect();
        assert_eq!(named.len(), all.len(), "{}: {named:?}", print.file);
    }
}
