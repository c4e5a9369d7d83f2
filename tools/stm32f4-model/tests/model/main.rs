//! The chip as a program sees it: each test stands for a statement of the reference manual RM0090, named by its section.

mod adc;
mod bench;
mod break_input;
mod bus;
mod clocks;
mod dma;
mod exti;
mod naive;
mod oracle;
mod properties;
mod pwm;
mod registers;
mod timers;
mod watchdog;
