//! The table that describes a board, and the types of its entries.

use core::fmt;

use joint_units::Volts;

use super::clock_tree::ClockTree;

/// A port of pins, by its letter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the letters of the ports")]
pub enum Port {
    A,
    B,
    C,
    D,
    E,
}

/// One pin of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Pin {
    /// As printed in data sheets and on boards: `PE9`.
    pub name: &'static str,
    /// The port.
    pub port: Port,
    /// 0 to 15.
    pub number: u8,
}

impl Pin {
    /// The pin of that name. In a constant, a wrong name stops the build.
    pub(super) const fn new(name: &'static str) -> Self {
        let (port, number) = match *name.as_bytes() {
            [b'P', port, units @ b'0'..=b'9'] => (port, units - b'0'),
            [b'P', port, b'1', units @ b'0'..=b'5'] => (port, 10 + units - b'0'),
            _ => panic!("a pin is P, a letter from A to E and a number from 0 to 15"),
        };
        let port = match port {
            b'A' => Port::A,
            b'B' => Port::B,
            b'C' => Port::C,
            b'D' => Port::D,
            b'E' => Port::E,
            _ => panic!("a port is a letter from A to E"),
        };
        Self { name, port, number }
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// An input of the converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnalogInput {
    /// The pin.
    pub pin: Pin,
    /// Its channel of ADC1.
    pub channel: u8,
}

/// Levels of the brown-out reset in the option bytes of the chip (RM0090 5.2.2 and 3.9.10; thresholds: data sheets, "embedded reset and power control
/// block characteristics").
///
/// | level | resets below, V | starts above, V | the flash is read from, V |
/// |---|---|---|---|
/// | 1 | 2.13 to 2.24 | 2.23 to 2.33 | 2.1 |
/// | 2 | 2.44 to 2.56 | 2.53 to 2.63 | 2.4 |
/// | 3 | 2.75 to 2.88 | 2.85 to 2.97 | 2.7 |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BrownOutLevel {
    /// Level 2: for a supply between 2.7 and 3.0 V.
    Two = 2,
    /// Level 3, the highest: for 3.3 V.
    Three = 3,
}

impl BrownOutLevel {
    /// Clock of the core for which one more wait state of the flash is needed, at the lowest supply that this level lets through, MHz (RM0090
    /// table 10, RM0383 table 5, RM0390 table 5).
    #[must_use]
    pub const fn wait_state_mhz(self) -> u16 {
        match self {
            Self::Two => 24,
            Self::Three => 30,
        }
    }
}

/// The table that each board fills.
#[derive(Debug)]
pub struct Board {
    /// As in the Cargo feature, and in the boot record.
    pub name: &'static str,
    /// As printed on the chip, and as probe-rs calls it.
    pub chip: &'static str,
    /// Device ids of the chip in DBGMCU_IDCODE: that of the reference manual first.
    pub device_ids: &'static [u16],
    /// Crystal, PLL and buses.
    pub clocks: ClockTree,
    /// Supply below which no sample is good: below what the board's own regulator delivers.
    pub min_supply: Volts,
    /// Level of the brown-out reset that fits the supply: high enough for the flash, and so low that the board starts.
    pub brown_out: BrownOutLevel,
    /// Channel of ADC1 that the temperature sensor of the chip is on: 16, or 18 on the chips where it shares that with VBAT.
    pub temperature_channel: u8,
    /// Pins of TIM1 channels 1 to 4, all by alternate function 1: PA8 to PA11, or PE9, PE11, PE13, PE14 where the package has them.
    pub servos: [Pin; 4],
    /// Enable of the servos' supply: high only while the servo outputs are on, with a pull-down of its own.
    pub servo_rail: Pin,
    /// Gait sensors 1 to 4. All are converted, whether a sensor is wired or not.
    pub sensors: [AnalogInput; 4],
    /// Foot switch: high while the foot is on the floor. A disconnected wire reports no heel strike.
    pub foot_switch: Pin,
    /// Emergency stop: the break input of TIM1, high through its closed contact; a low level stops the servo pulses.
    pub emergency_stop: Pin,
    /// User button.
    pub button: Pin,
    /// Level of a pressed button.
    pub button_pressed: bool,
    /// Whether the board holds the button's line at its level when released; otherwise the chip's pull does.
    pub button_is_held: bool,
    /// Synchronisation input: edges of another system's line.
    pub sync_input: Pin,
    /// Synchronisation output, see [`joint_loop::io::time_code`].
    pub sync_output: Pin,
    /// The serial port's output, USART2 by alternate function 7.
    pub serial_out: Pin,
    /// Its input.
    pub serial_in: Pin,
    /// Level at which the lamps are lit.
    pub lamps_lit: bool,
    /// Lamp of the pulses, see [`firmware_shared::lamp`].
    pub led_pulses: Option<Pin>,
    /// Lamp of faults; without it, the other one shows faults too.
    pub led_fault: Option<Pin>,
}

impl Board {
    /// Wait states of the flash for the clock of the core, at the lowest supply that the brown-out reset lets through.
    #[must_use]
    pub const fn wait_states(&self) -> u8 {
        // At most 179 / 24.
        ((self.clocks.core_mhz() - 1) / self.brown_out.wait_state_mhz()) as u8
    }

    /// Compares the device id of a chip with those of the board's; `boards` are all, of which one may have that chip.
    ///
    /// # Errors
    /// It is another chip.
    pub fn compare(&'static self, device_id: u16, boards: &[&'static Board]) -> Result<(), OtherChip> {
        if self.device_ids.contains(&device_id) {
            return Ok(());
        }
        let owner = boards.iter().find(|board| board.device_ids.contains(&device_id)).map(|board| board.name);
        Err(OtherChip { device_id, board: self, owner })
    }
}

/// The image runs on another chip than that of its board.
#[derive(Debug, Clone, Copy)]
pub struct OtherChip {
    /// What the chip says.
    pub device_id: u16,
    /// The board that the image is for.
    pub board: &'static Board,
    /// Name of a board that has this chip; `None` if no board of the project has it.
    pub owner: Option<&'static str>,
}

impl fmt::Display for OtherChip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Board { name, chip, device_ids, .. } = self.board;
        write!(f, "the chip has the device id {:#x}; {name} has {chip}", self.device_id)?;
        if let Some(own) = device_ids.first() {
            write!(f, ", {own:#x}")?;
        }
        f.write_str(": flash the image of this board with `cargo xtask flash --board")?;
        match self.owner {
            Some(owner) => write!(f, " {owner}`"),
            None => f.write_str("`"),
        }
    }
}

/// The sensors' inputs of the Discovery and of the Nucleo: pins that neither uses for anything else.
pub(super) const SENSORS: [AnalogInput; 4] = [
    AnalogInput { pin: Pin::new("PA1"), channel: 1 },
    AnalogInput { pin: Pin::new("PC1"), channel: 11 },
    AnalogInput { pin: Pin::new("PB0"), channel: 8 },
    AnalogInput { pin: Pin::new("PB1"), channel: 9 },
];
