//! The boards that have an image: their names in cargo's features and their chips' names in probe-rs.

use clap::ValueEnum;
use clap::builder::PossibleValue;

/// Which of a board's images: the features of Cargo that it has, and the options that choose them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::Args)]
pub(crate) struct Variant {
    /// Shadow mode: the image that runs everything and drives nothing
    #[arg(long)]
    pub(crate) shadow: bool,
    /// The image that walks without a gait sensor: what a sensor reads is reported and stops nothing
    #[arg(long)]
    pub(crate) no_sensor: bool,
}

impl Variant {
    /// Drives the servos while the gait sensors are good.
    pub(crate) const USUAL: Self = Self { shadow: false, no_sensor: false };
    /// Drives nothing.
    pub(crate) const SHADOW: Self = Self { shadow: true, no_sensor: false };

    /// Its features.
    pub(crate) fn features(self) -> impl Iterator<Item = &'static str> {
        [(self.shadow, "shadow"), (self.no_sensor, "no-sensor")]
            .into_iter()
            .filter_map(|(has, name)| has.then_some(name))
    }
}

/// A board with a file of its own in `firmware/src/board`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum Board {
    /// STM32F4 Discovery.
    #[default]
    #[value(name = "f4-discovery")]
    F4Discovery,
    /// Nucleo-F446RE.
    #[value(name = "nucleo-f446re")]
    NucleoF446re,
    /// Black Pill with the STM32F411CE and 25 MHz.
    #[value(name = "black-pill-f411")]
    BlackPillF411,
}

impl Board {
    /// Every board, the default one last: a build leaves its image in the target folder, and that should be the usual one.
    pub(crate) const ALL: [Board; 3] = [Board::NucleoF446re, Board::BlackPillF411, Board::F4Discovery];

    /// The feature of the package `firmware`.
    pub(crate) fn feature(self) -> &'static str {
        match self {
            Board::F4Discovery => "f4-discovery",
            Board::NucleoF446re => "nucleo-f446re",
            Board::BlackPillF411 => "black-pill-f411",
        }
    }

    /// True if the virtual board can run the board's image.
    pub(crate) fn is_modelled(self) -> bool {
        match self {
            Board::F4Discovery | Board::BlackPillF411 => true,
            Board::NucleoF446re => false,
        }
    }

    /// True if the board has a socket at the chip's USB pins, so that its boot loader can be used. A Nucleo's only socket is that of the probe.
    pub(crate) fn has_usb(self) -> bool {
        match self {
            Board::F4Discovery | Board::BlackPillF411 => true,
            Board::NucleoF446re => false,
        }
    }

    /// The name that `probe-rs run --chip` wants.
    pub(crate) fn chip(self) -> &'static str {
        match self {
            Board::F4Discovery => "STM32F407VGTx",
            Board::NucleoF446re => "STM32F446RETx",
            Board::BlackPillF411 => "STM32F411CEUx",
        }
    }
}

/// A board of either family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AnyBoard {
    /// One of the STM32F4 family.
    Stm32(Board),
    /// The Raspberry Pi Pico.
    Pico,
}

impl Default for AnyBoard {
    fn default() -> Self {
        Self::Stm32(Board::default())
    }
}

impl ValueEnum for AnyBoard {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [AnyBoard; 4] = [
            AnyBoard::Stm32(Board::F4Discovery),
            AnyBoard::Stm32(Board::NucleoF446re),
            AnyBoard::Stm32(Board::BlackPillF411),
            AnyBoard::Pico,
        ];
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Stm32(board) => board.to_possible_value(),
            Self::Pico => Some(PossibleValue::new("pico").help("Raspberry Pi Pico")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_and_the_feature_have_one_name() {
        for board in Board::ALL {
            assert_eq!(board.to_possible_value().unwrap().get_name(), board.feature());
        }
        assert_eq!(Board::ALL.len(), Board::value_variants().len());
        let all = AnyBoard::value_variants();
        assert_eq!(all.len(), Board::ALL.len() + 1);
        assert!(Board::ALL.iter().all(|board| all.contains(&AnyBoard::Stm32(*board))));
    }
}
