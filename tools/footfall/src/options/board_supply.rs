//! The board that is to take a sensor file, by its lowest supply, and whether it takes it: the control loop of the board is asked.

use clap::Args;
use firmware::board::BOARDS;
use firmware::board::f4_discovery::BOARD as DEFAULT;
use generator_file::toml_file::Problem;
use hgod_adc::SensorError;
use hgod_adc::stm32f4::{MAX_SUPPLY, MIN_SUPPLY};
use joint_loop::{JointSensor, SENSOR_JOINT};
use joint_units::Volts;
use std::path::Path;

use crate::board::default_loop::TYPICAL_VREFINT_CAL;
use crate::failure::Failure;
use crate::file::calibration_file::{self, WiredSensor};
use crate::options::value::{number, one_of};

/// The board.
#[derive(Debug, Clone, Args)]
pub struct BoardSupply {
    /// Board that is to take the sensor files: its lowest supply limits the highest voltage of a table [default: f4-discovery]
    #[arg(long, value_name = "NAME", value_parser = one_of([0, 1, 2], |n| BOARDS[n].name))]
    board: Option<usize>,
    /// Lowest supply of the chip if that of the robot file, `min_supply`, is higher than that of the board
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

    /// Refuses a sensor file that the board refuses.
    ///
    /// # Errors
    /// The file is wrong, or an end of its table reads as a broken wire: line, field, and what is allowed.
    pub fn check(&self, path: &Path) -> Result<(), Failure> {
        let WiredSensor { calibration, divider } = calibration_file::read(path).map_err(Failure::input)?;
        let board = self.board.map_or(&DEFAULT, |board| BOARDS[board]);
        let least = self.min_supply.unwrap_or(0.0).max(board.min_supply.0);
        let sensor = JointSensor { joint: SENSOR_JOINT, divider, calibration };
        let Err(error) = sensor.build(TYPICAL_VREFINT_CAL, Volts(least)) else { return Ok(()) };
        let SensorError::TableInEndBand { index, code, min, max } = error else {
            return Err(Failure::input(format!("{}: {error}", path.display())));
        };
        let supply = if index == 0 { MAX_SUPPLY.0 } else { least };
        let words = format!(
            "at a supply of {supply} V it reads code {} on the board {}, which refuses it; allowed are {} to {}, others are a broken wire; \
             shorten the table or change the divider, or name the board with --board and a higher supply of the robot file with --min-supply",
            code.0, board.name, min.0, max.0
        );
        let field = format!("points[{index}].sensor_v");
        Err(Failure::input(calibration_file::error_at(path, &field, Problem::Rule(words))))
    }
}
