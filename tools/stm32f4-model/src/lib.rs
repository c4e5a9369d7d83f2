//! Peripheral models of the STM32F407VG, no CPU in it: what a program that runs on the chip finds behind the addresses of its registers.
//!
//! [`Soc`] holds RCC, PWR, the flash interface's registers, GPIO, SYSCFG, EXTI, TIM1 to TIM14, ADC1 to ADC3, DMA1 and DMA2, IWDG, DBGMCU
//! and the factory data. The core's own registers (NVIC, SysTick, SCB, DWT) belong to whoever runs the core. A [`Plant`] is the world at
//! the pins, a [`DmaMemory`] the SRAM.
//!
//! Written from the reference manual RM0090 and the data sheet; tests name the section they stand for. Not compared with silicon.
//!
//! What the model does not do it says: an access to a register or a mode that is not modelled is recorded as a [`Lint`], as is an access
//! to a block without clock, with a width that the manual forbids, or in a way that silicon would not honour.
//!
//! Time is counted in HCLK cycles. Events (overflows, compare matches, conversions, the watchdog's bite, announced input changes) are
//! computed, not stepped to: a timer that nobody waits for costs nothing until it is read.
//!
//! Known limits: oscillators and PLL are ready at once, DMA takes no time, the ADC has neither noise nor source impedance, timers count up
//! edge-aligned only, flash cannot be erased or programmed, no low power modes, no supply supervision, no WWDG, RTC, serial interfaces.
#![forbid(unsafe_code)]

mod adc;
mod bus;
mod clock;
mod config;
mod dbgmcu;
mod dma;
mod exti;
mod flash;
mod gpio;
mod iwdg;
mod lint;
mod memory_map;
mod pin;
mod plant;
mod pwr;
mod rcc;
mod reset;
mod soc;
mod tim;

pub use adc::{AdcChannel, Conversion};
pub use bus::Width;
pub use config::SocConfig;
pub use lint::{Lint, LintKind};
pub use pin::{PORTS, Pin, UnknownPin};
pub use plant::{DmaMemory, NoMemory, Plant};
pub use reset::ResetCause;
pub use soc::Soc;
