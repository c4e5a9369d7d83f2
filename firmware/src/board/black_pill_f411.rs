//! Black Pill F411 (WeAct Studio, STM32F411CEU6, 48 pins). All pins here are on its two rows of 20.
//!
//! TIM1 has its channels at PA8 to PA11 only in this package, and three of its complementary outputs repeat the widths of the channels. So the fourth
//! servo is at PA11, which is D- of the USB socket as well: the socket must have no data line while that servo is connected
//! (docs/boards.md). A timer of its own for the fourth servo would not have the break input.
//!
//! Free of the crystals (PH0, PH1, PC14, PC15), of the debug probe (PA13, PA14), of the pins that are pulled up in reset (PA15, PB3, PB4), of BOOT1
//! (PB2), and of what the flash chip that can be fitted below the board drives or pulls up (PA4, PA6).

use joint_units::Volts;

use super::clock_tree::{ClockTree, Hse, Pll};
use super::definition::{AnalogInput, Board, BrownOutLevel, Pin};

/// The board.
pub const BOARD: Board = Board {
    name: "black-pill-f411",
    chip: "STM32F411CEUx",
    // RM0383 23.6.1.
    device_ids: &[0x431],
    // 100 MHz, the most that the chip allows, by scale 1 of the regulator (RM0383 5.1.3), which the HAL sets; three wait states from 2.7 V on (3.4.1).
    clocks: ClockTree { hse: Hse::Crystal, hse_mhz: 25, pll: Pll { m: 25, n: 200, p: 2, q: 5 }, apb: [2, 1] },
    // RM0383 11.9.
    temperature_channel: 18,
    // 3.3 V.
    min_supply: Volts(3.0),
    // The flash is read from 2.7 V; 3.3 V is above all thresholds.
    brown_out: BrownOutLevel::Three,
    servos: [Pin::new("PA8"), Pin::new("PA9"), Pin::new("PA10"), Pin::new("PA11")],
    // Not driven by the boot loader of the chip (AN2606).
    servo_rail: Pin::new("PB8"),
    sensors: [
        AnalogInput { pin: Pin::new("PA1"), channel: 1 },
        // An input of the flash chip that can be fitted: its clock.
        AnalogInput { pin: Pin::new("PA5"), channel: 5 },
        AnalogInput { pin: Pin::new("PB0"), channel: 8 },
        AnalogInput { pin: Pin::new("PB1"), channel: 9 },
    ],
    foot_switch: Pin::new("PB7"),
    emergency_stop: Pin::new("PB12"),
    // KEY, to ground, without a resistor.
    button: Pin::new("PA0"),
    button_pressed: false,
    button_is_held: false,
    sync_input: Pin::new("PB9"),
    sync_output: Pin::new("PB5"),
    serial_out: Pin::new("PA2"),
    serial_in: Pin::new("PA3"),
    // C13, blue: the only one, between the supply and the pin.
    lamps_lit: false,
    led_pulses: Some(Pin::new("PC13")),
    led_fault: None,
};
