//! STM32F4 Discovery (STM32F407VG, user manual UM1472): the default board.

use joint_units::Volts;

use super::clock_tree::{ClockTree, Hse, Pll};
use super::definition::{Board, BrownOutLevel, Pin, SENSORS};

/// The board.
pub const BOARD: Board = Board {
    name: "f4-discovery",
    chip: "STM32F407VGTx",
    // RM0090 38.6.1. The second is that of revision A (ES0182, "MCU device ID is incorrect"), which the STM32F2 has too: a Cortex-M3, on which no
    // program for a Cortex-M4F gets this far.
    device_ids: &[0x413, 0x411],
    // 168 MHz, the most that the chip allows; Q: 48 MHz.
    clocks: ClockTree { hse: Hse::Crystal, hse_mhz: 8, pll: Pll { m: 4, n: 168, p: 2, q: 7 }, apb: [4, 2] },
    // RM0090 13.10.
    temperature_channel: 16,
    // 3.3 V less the diode D3.
    min_supply: Volts(2.7),
    // People measured 2.89 to 3.07 V at this supply, and level 3 lets a chip start at up to 2.97 V: some boards would not. With the wait states for 2.4 V
    // the flash is read rightly down to the reset, and a supply below 2.7 V ends the pulses by the program, in order.
    brown_out: BrownOutLevel::Two,
    // Not PA8 to PA11, TIM1's other pins: PA9 is VBUS of the micro-USB connector, with 4.7 uF to ground.
    servos: [Pin::new("PE9"), Pin::new("PE11"), Pin::new("PE13"), Pin::new("PE14")],
    // On the header, wired to nothing on the board, and not driven by the boot loader of the chip (AN2606), unlike PB13.
    servo_rail: Pin::new("PC8"),
    sensors: SENSORS,
    foot_switch: Pin::new("PC5"),
    emergency_stop: Pin::new("PB12"),
    // B1, with a pull-down on the board.
    button: Pin::new("PA0"),
    button_pressed: true,
    button_is_held: true,
    sync_input: Pin::new("PC6"),
    sync_output: Pin::new("PB5"),
    serial_out: Pin::new("PA2"),
    serial_in: Pin::new("PA3"),
    lamps_lit: true,
    // LD4, green.
    led_pulses: Some(Pin::new("PD12")),
    // LD5, red.
    led_fault: Some(Pin::new("PD14")),
};
