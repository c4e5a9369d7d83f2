//! STM32F4 Discovery (STM32F407VG, user manual UM1472): the default board, and the one that the virtual board models.

use embassy_stm32::pac;
use joint_units::Volts;

use super::{Board, Hse, Pin};

pub(crate) const BOARD: Board = Board {
    name: "f4-discovery",
    chip: "STM32F407VGTx",
    hse: Hse::Crystal,
    // RM0090 13.10.
    temperature_channel: 16,
    // 3.3 V less the diode D3.
    min_supply: Volts(2.7),
    // Not PA8 to PA11, TIM1's other pins: PA9 is VBUS of the micro-USB connector, with 4.7 uF to ground.
    servos: [Pin::new(pac::GPIOE, 9), Pin::new(pac::GPIOE, 11), Pin::new(pac::GPIOE, 13), Pin::new(pac::GPIOE, 14)],
    // B1, with a pull-down on the board.
    button: Pin::new(pac::GPIOA, 0),
    button_pressed: true,
    sync: Pin::new(pac::GPIOB, 5),
    // LD4, green.
    led_pulses: Some(Pin::new(pac::GPIOD, 12)),
    // LD5, red.
    led_fault: Some(Pin::new(pac::GPIOD, 14)),
};
