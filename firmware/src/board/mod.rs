//! Facts of a board: pins, clock source, supply, and what its chip fixes. One board is one file here, and one Cargo feature.
//!
//! Plain data without a register, so that host tools (`default-features = false`) and tests read the same table as the program.
//!
//! The same on every board, because it is the chip's and not the board's (STM32F4 with a 168 MHz clock):
//!
//! | what | where |
//! |---|---|
//! | servos, left hip, right hip, left knee, right knee | TIM1 channels 1 to 4, pins of the board's choice among those of TIM1 |
//! | emergency stop, high stops | TIM1 break input |
//! | sensors 1 to 4 | channels of ADC1 |
//! | synchronisation input, 3.3 V | an EXTI line from 5 to 9, with the chip's pull-down |
//! | foot switch, a contact to the 3 V supply that closes on the floor | with the chip's pull-down |
//! | conversions, four to a control period | TIM2, DMA2 stream 0 |
//! | clock of the tasks that wait | TIM4 |
//! | free-running microseconds | TIM5 |
//!
//! # Duties of a board
//! - Each servo line is free of anything else on the board, and has a pull-down of its own (10 kOhm to ground): in reset and in the
//!   bootloader the chip drives nothing.
//! - The emergency stop is a contact from the 3 V supply through 1 kOhm to its pin that closes to stop; open or absent, the chip's
//!   pull-down keeps it released. A broken wire is therefore not noticed: press it to test it.
//! - The servos have a supply of their own. No pulse is not no torque: what must go limp needs its supply switched.
//! - HSE is 8 MHz within 500 ppm. A wrong crystal scales every pulse and is not detected.

use core::fmt;

use joint_units::Volts;

#[cfg(all(feature = "f4-discovery", feature = "nucleo-f446re"))]
compile_error!(
    "choose one board: `f4-discovery` is the default, so the Nucleo needs `--no-default-features --features nucleo-f446re`"
);
#[cfg(all(feature = "image", not(any(feature = "f4-discovery", feature = "nucleo-f446re"))))]
compile_error!("choose one board: `--features f4-discovery` or `--features nucleo-f446re`");

pub mod f4_discovery;
pub mod nucleo_f446re;

#[cfg(feature = "f4-discovery")]
pub use f4_discovery::BOARD;
#[cfg(all(feature = "nucleo-f446re", not(feature = "f4-discovery")))]
pub use nucleo_f446re::BOARD;

/// Every board.
pub const BOARDS: [&Board; 2] = [&f4_discovery::BOARD, &nucleo_f446re::BOARD];

/// First address of the generator record's flash sector, the second one (RM0090 table 5, RM0390 table 4).
pub const GENERATOR_SECTOR: u32 = 0x0800_4000;

/// First address of the sensor record's flash sector, the third one.
pub const SENSORS_SECTOR: u32 = 0x0800_8000;

/// Bytes of either sector. `memory.x` keeps the program out of both.
pub const SECTOR_BYTES: usize = 16 * 1024;

/// Address of the factory's code of the internal reference, a half-word in system memory (data sheets, "Embedded internal reference
/// voltage calibration values").
pub const REFERENCE_CAL: u32 = 0x1FFF_7A2A;

/// Addresses of the factory's codes of the temperature sensor at 30 and at 110 degrees (data sheets, "Temperature sensor calibration
/// values").
pub const TEMPERATURE_CAL: [u32; 2] = [0x1FFF_7A2C, 0x1FFF_7A2E];

/// Channel of ADC1 that the internal reference is on.
pub const REFERENCE_CHANNEL: u8 = 17;

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
    /// The pin of that name. A name that is none does not compile.
    const fn new(name: &'static str) -> Self {
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

/// Source of the 8 MHz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hse {
    /// A crystal at the chip.
    Crystal,
    /// A clock signal, as from the debug probe of a Nucleo.
    External,
}

/// The table that each board fills.
#[derive(Debug)]
pub struct Board {
    /// As in the Cargo feature, and in the boot record.
    pub name: &'static str,
    /// As printed on the chip, and as probe-rs calls it.
    pub chip: &'static str,
    /// Source of HSE.
    pub hse: Hse,
    /// Supply below which no sample is good: below what the board's own regulator delivers.
    pub min_supply: Volts,
    /// Channel of ADC1 that the temperature sensor of the chip is on: 16, or 18 on the chips where it shares that with VBAT.
    pub temperature_channel: u8,
    /// Pins of TIM1 channels 1 to 4, all by alternate function 1: PA8 to PA11, or PE9, PE11, PE13, PE14 where the package has them.
    pub servos: [Pin; 4],
    /// Gait sensors 1 to 4. All are converted, whether a sensor is wired or not.
    pub sensors: [AnalogInput; 4],
    /// Foot switch: high while the foot is on the floor. A wire that is off never strikes.
    pub foot_switch: Pin,
    /// Emergency stop: the break input of TIM1, high stops.
    pub emergency_stop: Pin,
    /// User button; the board holds the line at its level when released.
    pub button: Pin,
    /// Level of a pressed button.
    pub button_pressed: bool,
    /// Synchronisation input: edges of another system's line.
    pub sync_input: Pin,
    /// Synchronisation output, see [`joint_loop::io::time_code`].
    pub sync_output: Pin,
    /// Lit while the servos get pulses; lit when the level is high.
    pub led_pulses: Option<Pin>,
    /// Lit in a fault; lit when the level is high.
    pub led_fault: Option<Pin>,
}

/// The sensors' inputs of both boards: pins that neither uses for anything else.
const SENSORS: [AnalogInput; 4] = [
    AnalogInput { pin: Pin::new("PA1"), channel: 1 },
    AnalogInput { pin: Pin::new("PC1"), channel: 11 },
    AnalogInput { pin: Pin::new("PB0"), channel: 8 },
    AnalogInput { pin: Pin::new("PB1"), channel: 9 },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_pin_is_used_twice() {
        for board in BOARDS {
            let mut pins: Vec<Pin> = board.servos.into();
            pins.extend(board.sensors.map(|sensor| sensor.pin));
            pins.extend([board.foot_switch, board.emergency_stop, board.button, board.sync_input, board.sync_output]);
            pins.extend(board.led_pulses.into_iter().chain(board.led_fault));
            let names: BTreeSet<&str> = pins.iter().map(|pin| pin.name).collect();
            assert_eq!(names.len(), pins.len(), "{}: {pins:?}", board.name);
        }
    }

    #[test]
    fn a_name_is_its_port_and_number() {
        for board in BOARDS {
            for pin in board.servos {
                assert_eq!(pin.name, format!("P{:?}{}", pin.port, pin.number));
            }
        }
    }

    #[test]
    fn the_linker_keeps_the_program_out_of_the_record_sectors() {
        let map = include_str!("../../../memory.x");
        assert!(map.contains("FLASH : ORIGIN = 0x08000000"), "{map}");
        assert!(map.contains("_stext = ORIGIN(FLASH) + 0x10000;"), "{map}");
        // The vector table is in the sector before them.
        for sector in [GENERATOR_SECTOR, SENSORS_SECTOR] {
            let end = sector + SECTOR_BYTES as u32;
            assert!(sector >= 0x0800_0000 + SECTOR_BYTES as u32 && end <= 0x0801_0000, "{sector:#x}");
        }
    }
}
