//! Facts of a board: pins, clock source, supply, and what its chip fixes. One board is one file here, and one Cargo feature.
//!
//! Plain data without a register, so that host tools (`default-features = false`) and tests read the same table as the program.
//!
//! The same on every board, because it is the chip's and not the board's (STM32F4):
//!
//! | what | where |
//! |---|---|
//! | servos, left hip, right hip, left knee, right knee | TIM1 channels 1 to 4, pins of the board's choice among those of TIM1 |
//! | servo-rail enable: high only while the servo outputs are on | with a pull-down of its own |
//! | emergency stop; a low level stops the servo pulses | TIM1 break input, with the chip's pull-down |
//! | sensors 1 to 4 | channels of ADC1 |
//! | synchronisation input, 3.3 V | an EXTI line from 5 to 9, with the chip's pull-down |
//! | foot switch, a contact to the 3 V supply that closes on the floor | with the chip's pull-down |
//! | serial port, 1 Mbaud | USART2, DMA1 streams 5 and 6 |
//! | conversions, four to a control period | TIM2, DMA2 stream 0 |
//! | clock of the tasks that wait | TIM4 |
//! | free-running microseconds | TIM5 |
//!
//! # Duties of a board
//! - Each servo line is free of anything else on the board, and has a pull-down of its own (10 kOhm to ground): in reset and in the
//!   bootloader the chip drives nothing.
//! - The servo-rail enable has a pull-down of its own (10 kOhm to ground), and a switch in the positive line of the servos' supply that is
//!   off while it is low.
//! - The emergency stop is a contact from the 3 V supply through 1 kOhm to its pin that opens to stop (normally closed). Open, absent, or with a cut
//!   cable, the chip's pull-down stops the pulses. A contact that does not open is noticed by its test before the first arming after a boot.
//! - The servos have a supply of their own. A servo without pulses may hold its torque; only a switch in its
//!   supply removes it.
//! - HSE has the frequency of the table within 500 ppm. A wrong crystal scales every pulse; the board measures it at boot, but finds only one that is
//!   far off ([`crate::crystal`]).

#[cfg(any(
    all(feature = "f4-discovery", any(feature = "nucleo-f446re", feature = "black-pill-f411")),
    all(feature = "nucleo-f446re", feature = "black-pill-f411")
))]
compile_error!(
    "choose one board: `--features f4-discovery`, `--features nucleo-f446re` or `--features black-pill-f411`"
);
#[cfg(all(
    feature = "image",
    not(any(
        feature = "default-board",
        feature = "f4-discovery",
        feature = "nucleo-f446re",
        feature = "black-pill-f411"
    ))
))]
compile_error!(
    "choose one board: `--features f4-discovery`, `--features nucleo-f446re` or `--features black-pill-f411`"
);

pub mod black_pill_f411;
mod clock_tree;
mod definition;
pub mod f4_discovery;
pub mod nucleo_f446re;

#[cfg(all(feature = "black-pill-f411", not(any(feature = "f4-discovery", feature = "nucleo-f446re"))))]
pub use black_pill_f411::BOARD;
pub use clock_tree::{ADC_DIVIDER, ClockTree, Hse, Pll};
pub use definition::{AnalogInput, Board, BrownOutLevel, OtherChip, Pin, Port};
#[cfg(any(
    feature = "f4-discovery",
    all(feature = "default-board", not(any(feature = "nucleo-f446re", feature = "black-pill-f411")))
))]
pub use f4_discovery::BOARD;
#[cfg(all(feature = "nucleo-f446re", not(feature = "f4-discovery")))]
pub use nucleo_f446re::BOARD;

/// Every board.
pub const BOARDS: [&Board; 3] = [&f4_discovery::BOARD, &nucleo_f446re::BOARD, &black_pill_f411::BOARD];

/// First address of the generator record's flash sector, the second one (RM0090 table 5, RM0383 3.3, RM0390 table 4).
pub const GENERATOR_SECTOR: u32 = 0x0800_4000;

/// First address of the sensor record's flash sector, the third one.
pub const SENSORS_SECTOR: u32 = 0x0800_8000;

/// First address of the robot record's flash sector, the fourth one: the last of 16 KiB, on parts of 512 KiB and of 1 MiB alike.
pub const ROBOT_SECTOR: u32 = 0x0800_C000;

/// Bytes of each of these sectors. `memory.x` keeps the program out of all three.
pub const SECTOR_BYTES: usize = 16 * 1024;

/// Address of the factory's code of the internal reference, a half-word in system memory (data sheets, "Embedded internal reference
/// voltage calibration values").
pub const REFERENCE_CAL: u32 = 0x1FFF_7A2A;

/// Addresses of the factory's codes of the temperature sensor at 30 and at 110 degrees (data sheets, "Temperature sensor calibration
/// values").
pub const TEMPERATURE_CAL: [u32; 2] = [0x1FFF_7A2C, 0x1FFF_7A2E];

/// Channel of ADC1 that the internal reference is on.
pub const REFERENCE_CHANNEL: u8 = 17;

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_pin_is_used_twice() {
        for board in BOARDS {
            let mut pins: Vec<Pin> = board.servos.into();
            pins.extend(board.sensors.map(|sensor| sensor.pin));
            pins.push(board.servo_rail);
            pins.extend([board.foot_switch, board.emergency_stop, board.button, board.sync_input, board.sync_output]);
            pins.extend([board.serial_out, board.serial_in]);
            pins.extend(board.led_pulses.into_iter().chain(board.led_fault));
            let names: BTreeSet<&str> = pins.iter().map(|pin| pin.name).collect();
            assert_eq!(names.len(), pins.len(), "{}: {pins:?}", board.name);
        }
    }

    /// The wait states of each board, and the lowest voltage at which the flash may be read with them (RM0090 table 10, RM0390 table 5, RM0383 table 5).
    #[test]
    fn the_flash_waits_as_long_as_the_supply_of_the_level_needs() {
        let of = |board: &Board| (board.name, board.brown_out as u8, board.wait_states());
        assert_eq!(BOARDS.map(of), [("f4-discovery", 2, 6), ("nucleo-f446re", 3, 5), ("black-pill-f411", 3, 3)]);
        for board in BOARDS {
            // Below this supply no sample is good: it acts before the reset where the supply leaves room for both.
            let resets_below_v = [2.56, 2.88][board.brown_out as usize - 2];
            assert!(board.min_supply.0 > resets_below_v, "{}", board.name);
        }
    }

    /// Each board's own ids pass, those of every other board do not, and the words name the board of the chip and fit into a record.
    #[test]
    fn another_chip_is_refused_in_words() {
        for board in BOARDS {
            assert!(board.device_ids.iter().all(|id| board.compare(*id, &BOARDS).is_ok()), "{}", board.name);
            for other in BOARDS.iter().filter(|other| other.name != board.name) {
                for id in other.device_ids {
                    let words = board.compare(*id, &BOARDS).expect_err("another chip").to_string();
                    let named = words.contains(&format!("{id:#x}")) && words.contains(board.chip);
                    assert!(named && words.ends_with(&format!("--board {}`", other.name)), "{words}");
                    assert!(words.len() <= 160, "{words}");
                }
            }
            for id in [0, 0xFFF, 0x419] {
                assert!(
                    board
                        .compare(id, &BOARDS)
                        .expect_err("none of ours")
                        .to_string()
                        .ends_with("`cargo xtask flash --board`")
                );
            }
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
        for sector in [GENERATOR_SECTOR, SENSORS_SECTOR, ROBOT_SECTOR] {
            let end = sector + SECTOR_BYTES as u32;
            assert!(sector >= 0x0800_0000 + SECTOR_BYTES as u32 && end <= 0x0801_0000, "{sector:#x}");
        }
    }
}
