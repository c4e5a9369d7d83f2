//! Nucleo-F446RE (STM32F446RE, user manual UM1724). Servo and sensor pins are on the Arduino and morpho headers:
//! PA8 D7, PA9 D8, PA10 D2, PA11 CN10-14, PA1 A1, PC1 A4, PB0 A3, PB1 CN10-24, PB12 CN10-16.

use joint_units::Volts;

use super::clock_tree::{ClockTree, Hse, Pll};
use super::definition::{Board, BrownOutLevel, Pin, SENSORS};

/// The board.
pub const BOARD: Board = Board {
    name: "nucleo-f446re",
    chip: "STM32F446RETx",
    // RM0390, "MCU device ID code".
    device_ids: &[0x421],
    // MCO of the ST-LINK, 8 MHz (solder bridge SB50 on, as delivered). 168 MHz as on the Discovery, of 180 that the chip allows.
    clocks: ClockTree { hse: Hse::External, hse_mhz: 8, pll: Pll { m: 4, n: 168, p: 2, q: 7 }, apb: [4, 2] },
    // RM0390 13.10.
    temperature_channel: 18,
    // 3.3 V.
    min_supply: Volts(3.0),
    // The flash is read from 2.7 V; 3.3 V is above all thresholds.
    brown_out: BrownOutLevel::Three,
    servos: [Pin::new("PA8"), Pin::new("PA9"), Pin::new("PA10"), Pin::new("PA11")],
    // CN10-2; not driven by the boot loader of the chip (AN2606), unlike PB13.
    servo_rail: Pin::new("PC8"),
    sensors: SENSORS,
    foot_switch: Pin::new("PC5"),
    emergency_stop: Pin::new("PB12"),
    // B1, with a pull-up on the board.
    button: Pin::new("PC13"),
    button_pressed: false,
    button_is_held: true,
    sync_input: Pin::new("PC6"),
    sync_output: Pin::new("PB5"),
    // To the ST-LINK, which is a serial port of the computer (solder bridges SB13 and SB14 on, as delivered).
    serial_out: Pin::new("PA2"),
    serial_in: Pin::new("PA3"),
    lamps_lit: true,
    // LD2, green: the only one.
    led_pulses: Some(Pin::new("PA5")),
    led_fault: None,
};
