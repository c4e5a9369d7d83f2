//! The emergency stop: a contact that opens to stop, pulled down by the chip, so that a cut cable stops too.
//!
//! The chip has no break input that switches its timers off. The non-maskable interrupt stands in for it: the falling edge of the contact's line
//! raises it, and its handler runs whatever the program does, also with interrupts masked. If the processor hangs for good, the watchdog resets the
//! chip, which lets go of all pins. The ticks read the contact too.

use cortex_m::peripheral::NVIC;
use embassy_rp::interrupt;
use embassy_rp::pac::{IO_BANK0, SYSCFG};
use firmware_rp2040::board::BOARD;
use firmware_shared::post_mortem::{Cause, Record};

use crate::faults::die;
use crate::pins::{PinRegisters, Pull};
use crate::servo_pwm;

const PIN: usize = BOARD.emergency_stop.0 as usize;

/// Connects the contact's edge with the non-maskable interrupt (RP2040 datasheet, 2.3.3).
pub(crate) fn start() {
    BOARD.emergency_stop.make_input(Pull::Down);
    // The HAL enables its own handler of the pins' interrupt.
    NVIC::mask(interrupt::IO_IRQ_BANK0);
    acknowledge();
    // An edge, not the level: an open contact must not keep the processor in the handler.
    IO_BANK0.int_proc(0).inte(PIN / 8).write(|w| w.set_edge_low(PIN % 8, true));
    SYSCFG.proc0_nmi_mask().write_value(1 << interrupt::IO_IRQ_BANK0 as u32);
}

fn acknowledge() {
    IO_BANK0.intr(PIN / 8).write(|w| w.set_edge_low(PIN % 8, true));
}

#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if !IO_BANK0.int_proc(0).ints(PIN / 8).read().edge_low(PIN % 8) {
        die(Record::new(Cause::NonMaskable, [0; 2], ""));
    }
    acknowledge();
    servo_pwm::cut();
}
