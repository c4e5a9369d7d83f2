//! Models of the peripherals of two chips, STM32F407VG and STM32F411CE: registers, interrupt lines and pins, without the processor.
//!
//! [`Soc`] holds RCC, PWR, the supervision of the supply, the flash interface, GPIO, SYSCFG, EXTI, TIM1 to TIM14, ADC1 to ADC3, DMA1 and DMA2, USART2, IWDG, DBGMCU
//! and the factory data. The caller models the core and its own registers (NVIC, SysTick, SCB, DWT). A [`Plant`] supplies the signals at
//! the pins, a [`DmaMemory`] the memory that DMA accesses.
//!
//! Source: reference manual RM0090 and the data sheet; each test names the section that it checks. What differs in the STM32F411 is from RM0383, and
//! stands in [`Chip`], in the table of blocks, in RCC and in PWR. Not compared with silicon.
//!
//! Every access that the model cannot follow is recorded as a [`Lint`]: a register or mode that is not modelled, a block without clock, a
//! width that the manual forbids, or a use that the chip would ignore.
//!
//! Time is counted in HCLK cycles. Events (overflows, compare matches, conversions, watchdog timeout, announced input changes) are computed
//! in advance, not found by stepping each cycle: a timer whose signals are not used costs no time until it is read.
//!
//! Limits: oscillators and PLL are ready at once; DMA takes no time; the ADC has neither noise nor source impedance; timers only count up,
//! edge-aligned; mass erase and writes of option bytes are missing, and so are low power modes, WWDG, RTC and the other serial interfaces are missing.
#![forbid(unsafe_code)]

mod adc;
mod bus;
mod chip;
mod clock;
mod config;
mod dbgmcu;
mod dma;
mod exti;
mod flash;
mod gpio;
mod iwdg;
mod lint;
mod measured_clock;
mod memory_map;
mod oscillator;
mod pin;
mod plant;
mod pwr;
mod rcc;
mod reset;
mod soc;
mod supply;
mod tim;
mod usart;

pub use adc::{AdcChannel, Conversion};
pub use bus::Width;
pub use chip::Chip;
pub use config::SocConfig;
pub use flash::{FlashChange, FlashOperation, flash_sector_at};
pub use lint::{Lint, LintKind};
pub use pin::{PORTS, Pin, UnknownPin};
pub use plant::{DmaMemory, NoMemory, Plant};
pub use reset::ResetCause;
pub use soc::Soc;
pub use supply::BrownOutThreshold;
