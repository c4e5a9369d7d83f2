//! The boards that can be run: the chip of each with its configuration, and what is wired to it.
//!
//! A firmware image names its board by a symbol, `__board_...`. An ELF file without such a symbol, as of a self-test, runs on the default board
//! unless the command line names another one.

use anyhow::{Result, bail, ensure};
use clap::ValueEnum;
use stm32f4_model::{Pin, SocConfig};

/// Beginning of the symbol that names the board of an image; the rest is the name with `_` for `-`.
pub(crate) const SYMBOL: &str = "__board_";

/// A board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum ModelledBoard {
    /// STM32F4 Discovery, STM32F407VG
    #[default]
    F4Discovery,
    /// Black Pill, STM32F411CE with a crystal of 25 MHz
    BlackPillF411,
}

/// What is wired to the pins of the chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wiring {
    /// The servos in the order of joints: left hip, right hip, left knee, right knee.
    pub(crate) servos: [Pin; 4],
    /// The pin that switches the servos' supply on while it is high.
    pub(crate) rail: Pin,
    /// The user button.
    pub(crate) button: Pin,
    /// Level of the pressed button.
    pub(crate) pressed: bool,
    /// The released button leaves its pin open, to the pull of the chip; otherwise the board holds the other level.
    pub(crate) open: bool,
    /// The lamps.
    pub(crate) lamps: &'static [Pin],
}

const fn pin(port: char, number: u8) -> Pin {
    match Pin::new(port, number) {
        Some(pin) => pin,
        None => panic!("no such pin"),
    }
}

/// UM1472.
const DISCOVERY: Wiring = Wiring {
    servos: [pin('E', 9), pin('E', 11), pin('E', 13), pin('E', 14)],
    rail: pin('C', 8),
    button: pin('A', 0),
    pressed: true,
    open: false,
    // Green, orange, red, blue (UM1472, 6.3).
    lamps: &[pin('D', 12), pin('D', 13), pin('D', 14), pin('D', 15)],
};

/// The key connects PA0 with ground, without a resistor.
const BLACK_PILL: Wiring = Wiring {
    servos: [pin('A', 8), pin('A', 9), pin('A', 10), pin('A', 11)],
    rail: pin('B', 8),
    button: pin('A', 0),
    pressed: false,
    open: true,
    lamps: &[pin('C', 13)],
};

impl Default for Wiring {
    fn default() -> Self {
        DISCOVERY
    }
}

impl ModelledBoard {
    /// As in the Cargo features of the firmware, and in boot records.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::F4Discovery => "f4-discovery",
            Self::BlackPillF411 => "black-pill-f411",
        }
    }

    /// Chip, crystals and supply.
    pub(crate) fn config(self) -> SocConfig {
        match self {
            Self::F4Discovery => SocConfig::default(),
            Self::BlackPillF411 => SocConfig::black_pill(),
        }
    }

    /// Level of the brown-out reset that `cargo xtask board brown-out` sets.
    pub(crate) const fn brown_out_level(self) -> u8 {
        match self {
            Self::F4Discovery => 2,
            Self::BlackPillF411 => 3,
        }
    }

    /// What is wired to the chip.
    pub(crate) const fn wiring(self) -> Wiring {
        match self {
            Self::F4Discovery => DISCOVERY,
            Self::BlackPillF411 => BLACK_PILL,
        }
    }

    /// The board on which an ELF file with these symbols runs. `wanted`: what the command line names.
    ///
    /// # Errors
    /// The file is for a board that is not modelled, for several, or for another one than the command line names.
    pub(crate) fn of_image<'a>(symbols: impl Iterator<Item = &'a str>, wanted: Option<Self>) -> Result<Self> {
        let named: Vec<String> =
            symbols.filter_map(|name| Some(name.strip_prefix(SYMBOL)?.replace('_', "-"))).collect();
        let [name] = &named[..] else {
            ensure!(named.is_empty(), "the ELF names several boards: {}; allowed is one", named.join(", "));
            return Ok(wanted.unwrap_or_default());
        };
        let Some(board) = Self::value_variants().iter().copied().find(|board| board.name() == name) else {
            let modelled: Vec<&str> = Self::value_variants().iter().map(|board| board.name()).collect();
            bail!("the ELF is for the board {name}, which is not modelled; modelled are {}", modelled.join(", "));
        };
        if let Some(wanted) = wanted.filter(|wanted| *wanted != board) {
            bail!("the ELF is for the board {name}, and --board names {}; remove --board", wanted.name());
        }
        Ok(board)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(symbols: &[&str], wanted: Option<ModelledBoard>) -> Result<ModelledBoard, String> {
        ModelledBoard::of_image(symbols.iter().copied(), wanted).map_err(|error| error.to_string())
    }

    #[test]
    fn the_image_says_which_board_it_is_for() {
        use ModelledBoard::{BlackPillF411, F4Discovery};
        assert_eq!(of(&["__sbss", "__board_black_pill_f411"], None), Ok(BlackPillF411));
        assert_eq!(of(&["__board_f4_discovery"], Some(F4Discovery)), Ok(F4Discovery));
        assert_eq!(of(&["__sbss"], None), Ok(F4Discovery));
        assert_eq!(of(&["__sbss"], Some(BlackPillF411)), Ok(BlackPillF411));
    }

    #[test]
    fn no_image_runs_on_another_board() {
        let wrong = of(&["__board_black_pill_f411"], Some(ModelledBoard::F4Discovery)).unwrap_err();
        assert!(wrong.contains("for the board black-pill-f411, and --board names f4-discovery"), "{wrong}");
        let wrong = of(&["__board_nucleo_f446re"], None).unwrap_err();
        assert!(wrong.contains("not modelled; modelled are f4-discovery, black-pill-f411"), "{wrong}");
        let wrong = of(&["__board_nucleo_f446re", "__board_f4_discovery"], None).unwrap_err();
        assert!(wrong.contains("several boards"), "{wrong}");
    }

    #[test]
    fn the_option_has_the_names_of_the_boards() {
        for board in ModelledBoard::value_variants() {
            assert_eq!(
                board.to_possible_value().map(|value| value.get_name().to_owned()).as_deref(),
                Some(board.name())
            );
        }
    }
}
