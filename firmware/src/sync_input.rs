//! The synchronisation input: edges of another system's TTL line on the board's own clock.
//!
//! The edge interrupt has the highest priority. Its time stamp is in [`stopwatch`] microseconds, late by the entry into the handler. A line
//! that is not wired or that rings must not delay the ticks: after [`EDGES_A_TICK`] edges the interrupt stays off until the next tick,
//! which reports it.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::{EXTI, RCC, SYSCFG};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;

use firmware::board::{BOARD, Pin};

use crate::clocks;
use crate::pins::PinRegisters;
use crate::stopwatch;

/// Edges accepted between two ticks; a 1 kHz line has two.
pub(crate) const EDGES_A_TICK: usize = 8;

/// An edge.
#[derive(Clone, Copy)]
pub(crate) struct Edge {
    /// When, in [`stopwatch`] microseconds.
    pub(crate) at_us: u32,
    /// The level after it.
    pub(crate) high: bool,
}

/// From the interrupt to the tick.
static EDGES: Channel<CriticalSectionRawMutex, Edge, EDGES_A_TICK> = Channel::new();

/// The interrupt is off because too many edges came.
static FLOODED: AtomicBool = AtomicBool::new(false);

const INPUT: Pin = BOARD.sync_input;
const LINE: usize = INPUT.number as usize;
const _: () = assert!(5 <= LINE && LINE <= 9, "the lines of the interrupt EXTI9_5");

/// Starts the input. A line that is not wired is low.
pub(crate) fn start(priority: Priority) {
    RCC.apb2enr().modify(|w| w.set_syscfgen(true));
    clocks::settle();
    INPUT.set_pull(Pupdr::PULL_DOWN);
    INPUT.set_mode(Moder::INPUT);
    SYSCFG.exticr(LINE / 4).modify(|w| w.set_exti(LINE % 4, INPUT.port as u8));
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.ftsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    interrupt::EXTI9_5.set_priority(priority);
    // SAFETY: everything that the handler uses is ready, and nothing masks this interrupt by itself.
    unsafe { interrupt::EXTI9_5.enable() };
}

/// Passes the edges since the last call to `each`, oldest first; true if there were more than fit. Called once a tick.
pub(crate) fn take(mut each: impl FnMut(Edge)) -> bool {
    // No more than the channel holds: a line that rings fills it as fast as it is emptied.
    for edge in (0..EDGES_A_TICK).map_while(|_| EDGES.try_receive().ok()) {
        each(edge);
    }
    let flooded = FLOODED.swap(false, Ordering::Relaxed);
    if flooded {
        EXTI.pr(0).write(|w| w.set_line(LINE, true));
        EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    }
    flooded
}

/// Handler of the edge interrupt.
#[cfg(target_os = "none")]
#[embassy_stm32::interrupt]
fn EXTI9_5() {
    on_edge();
}

fn on_edge() {
    let at_us = stopwatch::now_us();
    EXTI.pr(0).write(|w| w.set_line(LINE, true));
    if EDGES.try_send(Edge { at_us, high: INPUT.is_high() }).is_err() {
        EXTI.imr(0).modify(|w| w.set_line(LINE, false));
        FLOODED.store(true, Ordering::Relaxed);
    }
}
