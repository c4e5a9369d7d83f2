//! Tests of the peripheral models: each test checks a statement of the reference manual RM0090, or RM0383 for the
//! STM32F411, and names its section.

mod adc;
mod bench;
mod break_input;
mod bus;
mod clocks;
mod crystal;
mod dma;
mod exti;
mod f411;
mod faults;
mod lsi;
mod oracle;
mod properties;
mod pwm;
mod registers;
mod stepped_timer;
mod timers;
mod usart;
mod watchdog;
