//! Tables of pins and addresses that are written by hand, compared with the board files of the firmware.

use std::path::Path;

use firmware::board::black_pill_f411::BOARD as BLACK_PILL;
use firmware::board::f4_discovery::BOARD as DISCOVERY;
use firmware::board::{BOARDS, Board, GENERATOR_SECTOR, Pin, ROBOT_SECTOR, SECTOR_BYTES, SENSORS_SECTOR};
use footfall::board::default_loop::SENSOR_PINS;

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The names of pins in a text, in order: `PE9 and PB12` gives both.
fn pins_in(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    let is_pin = |word: &&str| match word.as_bytes() {
        [b'P', b'A'..=b'K', number @ ..] => !number.is_empty() && number.iter().all(u8::is_ascii_digit),
        _ => false,
    };
    words.filter(is_pin).map(str::to_owned).collect()
}

/// What a row of the table of pins is about, by words in its first cell, and its pins on a board.
fn row_of(title: &str, board: &Board) -> Option<Vec<Pin>> {
    [
        ("servo left hip", board.servos.to_vec()),
        ("servo-rail enable", vec![board.servo_rail]),
        ("gait sensors 1 to 4", board.sensors.map(|sensor| sensor.pin).to_vec()),
        ("foot switch", vec![board.foot_switch]),
        ("synchronisation input", vec![board.sync_input]),
        ("synchronisation output", vec![board.sync_output]),
        ("serial port", vec![board.serial_out, board.serial_in]),
        ("user button", vec![board.button]),
        ("emergency stop", vec![board.emergency_stop]),
    ]
    .into_iter()
    .find_map(|(words, pins)| title.contains(words).then_some(pins))
}

/// The rows that name other pins than the board files.
fn differences(table: &str) -> (usize, Vec<String>) {
    let rows: Vec<Vec<&str>> = table
        .lines()
        .filter(|line| line.starts_with('|') && !pins_in(line).is_empty())
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    let mut wrong = Vec::new();
    for row in &rows {
        for (board, cell) in BOARDS.into_iter().zip(row.get(1..).unwrap_or_default()) {
            let expected = row_of(row[0], board);
            let expected: Option<Vec<String>> = expected.map(|pins| pins.iter().map(ToString::to_string).collect());
            if expected.as_ref() != Some(&pins_in(cell)) {
                wrong.push(format!("{} of {}: {cell}, in the board file {expected:?}", row[0], board.name));
            }
        }
    }
    (rows.len(), wrong)
}

/// The rows of the table with this heading, after its two lines.
fn rows_below<'t>(text: &'t str, prefix: &str, heading: &str) -> Vec<&'t str> {
    let lines = text.lines().filter_map(|line| line.strip_prefix(prefix)).skip_while(|line| *line != heading).skip(2);
    lines.take_while(|line| line.starts_with('|')).collect()
}

#[test]
fn the_page_has_the_lamps_of_the_firmware() {
    let heading = "| pattern | lamp | meaning |";
    let (page, module) = (read("docs/boards.md"), read("firmware-shared/src/lamp.rs"));
    let rows = rows_below(&page, "", heading);
    assert_eq!(rows, rows_below(&module, "//! ", heading));
    assert_eq!(rows.len(), 13);
    let lamps = DISCOVERY.led_pulses.into_iter().chain(DISCOVERY.led_fault);
    assert!(lamps.chain(BOARDS[1].led_pulses).chain(BOARDS[2].led_pulses).all(|pin| page.contains(pin.name)));
}

#[test]
fn the_table_of_pins_is_that_of_the_board_files() {
    let table = read("docs/boards.md");
    let (rows, wrong) = differences(&table);
    assert_eq!((rows, wrong), (9, vec![]));
    // A pin that is changed in the table is found.
    for (from, to) in [("PE13", "PE12"), ("PC13", "PC14"), ("PB5 (D4)", "PB6 (D4)")] {
        assert!(table.contains(from));
        assert_eq!(differences(&table.replace(from, to)).1.len(), 1, "{from}");
    }
}

#[test]
fn the_virtual_board_has_the_pins_of_the_boards() {
    let modelled = read("tools/virtual-board/src/modelled_board.rs");
    let pin = |pin: Pin| format!("pin('{:?}', {})", pin.port, pin.number);
    for (name, board) in [("DISCOVERY", &DISCOVERY), ("BLACK_PILL", &BLACK_PILL)] {
        let [servos, rail, button] = [board.servos.map(pin).join(", "), pin(board.servo_rail), pin(board.button)];
        let (pressed, open) = (board.button_pressed, !board.button_is_held);
        let wiring = format!(
            "const {name}: Wiring = Wiring {{\n    servos: [{servos}],\n    rail: {rail},\n    button: {button},\n    pressed: {pressed},\n    \
             open: {open},\n"
        );
        assert!(modelled.contains(&wiring), "tools/virtual-board/src/modelled_board.rs lacks\n{wiring}");
        assert!(modelled.contains(&format!("\"{}\"", board.name)), "{}", board.name);
        assert_eq!(board.emergency_stop, DISCOVERY.emergency_stop, "one pin for every board");
    }
    let plant = read("tools/virtual-board/src/plant.rs");
    let stop = DISCOVERY.emergency_stop;
    let stop = format!("EMERGENCY_STOP: Pin = match Pin::new('{:?}', {})", stop.port, stop.number);
    assert!(plant.contains(&stop), "tools/virtual-board/src/plant.rs lacks `{stop}`");
}

/// The build names the board in the ELF file, from this list.
#[test]
fn the_build_knows_every_board() {
    let build = read("firmware/build.rs");
    let names = BOARDS.map(|board| format!("{:?}", board.name.to_uppercase().replace('-', "_")));
    let list = format!("const BOARDS: [&str; {}] = [{}];", names.len(), names.join(", "));
    assert!(build.contains(&list), "firmware/build.rs lacks `{list}`");
}

#[test]
fn help_texts_and_flash_have_the_board_files_numbers() {
    let help = read("tools/footfall/src/options/played.rs");
    assert!(help.contains(&format!("({})", SENSOR_PINS.join(", "))), "the pins in the help of `footfall watch`");
    let probe = read("xtask/src/probe.rs");
    for (name, address) in [("Generator", GENERATOR_SECTOR), ("Sensors", SENSORS_SECTOR), ("Robot", ROBOT_SECTOR)] {
        let line = format!("Self::{name} => 0x{:04X}_{:04X},", address >> 16, address & 0xFFFF);
        assert!(probe.contains(&line), "xtask/src/probe.rs lacks `{line}`");
    }
    assert_eq!(SECTOR_BYTES, firmware_rp2040::board::SECTOR_BYTES, "the tools have one number for all families");
    let line = format!("const SECTOR_BYTES: usize = {} * 1024;", SECTOR_BYTES / 1024);
    assert!(probe.contains(&line), "xtask/src/probe.rs lacks `{line}`");
    // The level of the brown-out reset, as `cargo xtask board brown-out` sets it without an option.
    let option_bytes = read("xtask/src/option_bytes.rs");
    let level = |board: &firmware::board::Board| match board.brown_out {
        firmware::board::BrownOutLevel::Two => "Level::Two",
        firmware::board::BrownOutLevel::Three => "Level::Three",
    };
    let [discovery, nucleo, black_pill] = firmware::board::BOARDS.map(level);
    assert_eq!(nucleo, black_pill, "xtask has one line for both");
    for line in [
        format!("Board::F4Discovery => {discovery},"),
        format!("Board::NucleoF446re | Board::BlackPillF411 => {nucleo},"),
    ] {
        assert!(option_bytes.contains(&line), "xtask/src/option_bytes.rs lacks `{line}`");
    }
}
