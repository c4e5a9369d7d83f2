//! The board that is to take a file, and whether it takes it. A sensor file: by the board's lowest supply; the control loop of the board is asked. A
//! generator file: by its kind.

use clap::Args;
use firmware::board::BOARDS;
use firmware_rp2040::board::{BOARD as PICO, NO_FOLLOWER};
use generator_file::toml_file::Problem;
use hgod_adc::SensorError;
use hgod_adc::stm32f4::{MAX_SUPPLY, MIN_SUPPLY};
use joint_loop::{GeneratorConfig, JointSensor, SENSOR_JOINT};
use joint_units::Volts;
use std::path::Path;

use crate::board::default_loop::TYPICAL_VREFINT_CAL;
use crate::failure::Failure;
use crate::file::calibration_file::{self, WiredSensor};
use crate::options::value::{number, one_of};

/// Names and lowest supplies of all boards, the default first.
const ALL: [(&str, Volts); 4] = [
    (BOARDS[0].name, BOARDS[0].min_supply),
    (BOARDS[1].name, BOARDS[1].min_supply),
    (BOARDS[2].name, BOARDS[2].min_supply),
    (PICO.name, PICO.min_supply),
];

/// The board.
#[derive(Debug, Clone, Args)]
pub struct BoardSupply {
    /// Board that is to take the files: its lowest supply limits the highest voltage of a sensor's table, and a Pico takes no follower [default:
    /// f4-discovery]
    #[arg(long, value_name = "NAME", value_parser = one_of([0, 1, 2, 3], |n| ALL[n].0))]
    board: Option<usize>,
    /// Lowest supply of the chip if that of the robot file, `min_supply_v`, is higher than that of the board
    #[arg(long, value_name = "V", value_parser = number(MIN_SUPPLY.0..=MAX_SUPPLY.0, " V"))]
    min_supply: Option<f32>,
}

impl BoardSupply {
    /// Refuses these options where there is no sensor file.
    ///
    /// # Errors
    /// One of them is given.
    pub fn check_unused(&self) -> Result<(), Failure> {
        if self.board.is_none() && self.min_supply.is_none() {
            return Ok(());
        }
        Err(Failure::input(
            "--board and --min-supply say which board takes a sensor file; there is none here: remove them",
        ))
    }

    /// Refuses a generator that the board refuses.
    ///
    /// # Errors
    /// It is a follower, and the board is a Pico.
    pub fn check_generator(&self, path: &Path, generator: &GeneratorConfig) -> Result<(), Failure> {
        if self.min_supply.is_some() {
            return Err(Failure::input("--min-supply is for a sensor file; there is none here: remove it"));
        }
        let name = self.board.map_or(ALL[0].0, |board| ALL[board].0);
        if name == PICO.name && generator.follows().is_some() {
            return Err(Failure::input(format!("{}: the board {name} refuses {NO_FOLLOWER}", path.display())));
        }
        Ok(())
    }

    /// Refuses a sensor file that the board refuses.
    ///
    /// # Errors
    /// The file is wrong, or an end of its table reads as a broken wire: line, field, and what is allowed.
    pub fn check(&self, path: &Path) -> Result<(), Failure> {
        let WiredSensor { calibration, divider } = calibration_file::read(path).map_err(Failure::input)?;
        let (board, supply) = ALL[self.board.unwrap_or(0)];
        let least = self.min_supply.unwrap_or(0.0).max(supply.0);
        let sensor = JointSensor { joint: SENSOR_JOINT, divider, calibration };
        let Err(error) = sensor.build(TYPICAL_VREFINT_CAL, Volts(least)) else { return Ok(()) };
        let SensorError::TableInEndBand { index, code, min, max } = error else {
            return Err(Failure::input(format!("{}: {error}", path.display())));
        };
        let supply = if index == 0 { MAX_SUPPLY.0 } else { least };
        let words = format!(
            "at a supply of {supply} V it reads code {} on the board {}, which refuses it; allowed are {} to {}, others are a broken wire; \
             shorten the table or change the divider, or name the board with --board and a higher supply of the robot file with --min-supply",
            code.0, board, min.0, max.0
        );
        let field = format!("points[{index}].sensor_v");
        Err(Failure::input(calibration_file::error_at(path, &field, Problem::Rule(words))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use generator_file::file::GeneratorFile;

    #[test]
    fn a_pico_takes_no_follower() {
        let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples");
        let checked = |name: &str, board: usize| {
            let path = samples.join(name);
            let config = GeneratorFile::read(&path).expect("a generator file").set.config();
            BoardSupply { board: Some(board), min_supply: None }.check_generator(&path, &config)
        };
        let pico = ALL.len() - 1;
        let words = checked("follower.toml", pico).expect_err("a follower").to_string();
        assert!(
            words.contains("follower.toml: the board pico refuses a follower") && words.contains("spline"),
            "{words}"
        );
        assert!(checked("generator.toml", pico).is_ok());
        assert!((0..pico).all(|board| checked("follower.toml", board).is_ok()));
    }
}
