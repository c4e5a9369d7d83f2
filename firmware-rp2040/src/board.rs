//! Facts of the board: pins, supply, flash sectors. The Raspberry Pi Pico is the only board of this family.
//!
//! # Duties of a board
//! - Each servo line and the servo-rail enable have a pull-down of their own (10 kOhm to ground): in reset the chip drives nothing.
//! - A switch in the positive line of the servos' supply is off while the servo-rail enable is low.
//! - The emergency stop is a contact from the 3.3 V supply through 1 kOhm to its pin that opens to stop.
//! - The sensors have a supply of their own, or a divider: a pin gets at most 3.3 V.

use joint_units::Volts;

/// One pin of the chip: GPIO 0 to 29.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pin(pub u8);

/// The table that the board fills.
#[derive(Debug)]
pub struct Board {
    /// As in the boot record, and in the symbol of the ELF file.
    pub name: &'static str,
    /// As printed on the chip, and as probe-rs calls it.
    pub chip: &'static str,
    /// Supply with which the sensors' tables are checked. This chip cannot measure its supply.
    pub min_supply: Volts,
    /// Left hip, right hip, left knee, right knee: both outputs of two successive slices of the PWM.
    pub servos: [Pin; 4],
    /// Enable of the servos' supply: high only while the servo outputs are on, with a pull-down of its own.
    pub servo_rail: Pin,
    /// Emergency stop: high through its closed contact, pulled down by the chip.
    pub emergency_stop: Pin,
    /// Gait sensors 1 to 3: channels 0 to 2 of the converter.
    pub sensors: [Pin; 3],
    /// Foot switch: high while the foot is on the floor, pulled down by the chip.
    pub foot_switch: Pin,
    /// User button to ground, pulled up by the chip.
    pub button: Pin,
    /// Level of a pressed button.
    pub button_pressed: bool,
    /// Synchronisation output, see [`joint_loop::io::time_code`].
    pub sync_output: Pin,
    /// The lamp.
    pub led: Pin,
}

/// The Raspberry Pi Pico.
pub const BOARD: Board = Board {
    name: "pico",
    chip: "RP2040",
    min_supply: Volts(2.7),
    servos: [Pin(2), Pin(3), Pin(4), Pin(5)],
    servo_rail: Pin(6),
    emergency_stop: Pin(7),
    sensors: [Pin(26), Pin(27), Pin(28)],
    foot_switch: Pin(8),
    button: Pin(9),
    button_pressed: false,
    sync_output: Pin(10),
    led: Pin(25),
};

/// The kind of generator that the board refuses, with the reason and what is allowed: at most 160 bytes, as a record of a refusal has them. The tools
/// refuse it before it is on a board.
pub const NO_FOLLOWER: &str = "a follower: it is not shown that its ticks end in time on this chip, which has no floating-point unit; allowed are \
                               phase-coupled, shape, spline and thesis";
const _: () = assert!(NO_FOLLOWER.len() <= 160, "the record of the refusal would be cut");

/// First address of the generator record's flash sector. The program ends below it (rp2040.x).
pub const GENERATOR_SECTOR: u32 = 0x1010_0000;
/// First address of the sensor record's flash sector.
pub const SENSORS_SECTOR: u32 = 0x1010_4000;
/// First address of the robot record's flash sector.
pub const ROBOT_SECTOR: u32 = 0x1010_8000;
/// Bytes of each of these sectors: four of the flash chip's, which have 4 KiB. The tools write the same number for every family.
pub const SECTOR_BYTES: usize = 16 * 1024;

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_pin_is_used_twice() {
        let mut pins: Vec<Pin> = BOARD.servos.into();
        pins.extend(BOARD.sensors);
        pins.extend([BOARD.servo_rail, BOARD.emergency_stop, BOARD.foot_switch, BOARD.button, BOARD.sync_output]);
        pins.push(BOARD.led);
        assert_eq!(pins.iter().collect::<BTreeSet<_>>().len(), pins.len(), "{pins:?}");
        assert!(pins.iter().all(|pin| pin.0 < 30), "{pins:?}");
    }

    /// GPIO n is output n % 2 of slice n / 2 (RP2040 datasheet, 4.5.2); channel n of the converter is GPIO 26 + n (4.9).
    #[test]
    fn servos_and_sensors_are_where_the_chip_has_them() {
        let [a, b, c, d] = BOARD.servos.map(|pin| pin.0);
        assert!(a % 2 == 0 && (b, c, d) == (a + 1, a + 2, a + 3), "{:?}", BOARD.servos);
        assert_eq!(BOARD.sensors, [Pin(26), Pin(27), Pin(28)]);
    }

    #[test]
    fn the_linker_keeps_the_program_out_of_the_record_sectors() {
        let map = include_str!("../rp2040.x");
        assert!(map.contains("FLASH : ORIGIN = 0x10000100, LENGTH = 1M - 0x100"), "{map}");
        for (sector, next) in [(GENERATOR_SECTOR, SENSORS_SECTOR), (SENSORS_SECTOR, ROBOT_SECTOR)] {
            assert_eq!(sector + SECTOR_BYTES as u32, next);
        }
        const { assert!(GENERATOR_SECTOR >= 0x1000_0000 + (1 << 20)) };
        assert!(ROBOT_SECTOR + (SECTOR_BYTES as u32) <= 0x1000_0000 + (2 << 20));
    }
}
