//! The synchronisation input: edges of another system's TTL line on the board's own clock.
//!
//! The edge interrupt has the highest priority. Its time stamp is in [`stopwatch`] microseconds, late by the entry into the handler. A line
//! that is not wired or that rings must not delay the ticks: after [`EDGES_A_TICK`] edges the interrupt stays off until the next tick,
//! which reports it.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering, compiler_fence};

use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::{EXTI, RCC, SYSCFG};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use firmware::board::{BOARD, Pin};
use heapless::Vec;

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

/// From the interrupt to the tick, oldest first. Taken and put back as a whole: a cell has no panic.
static EDGES: CriticalSectionMutex<Cell<Vec<Edge, EDGES_A_TICK>>> = CriticalSectionMutex::new(Cell::new(Vec::new()));

/// There are edges: most ticks have none to copy.
static ARRIVED: AtomicBool = AtomicBool::new(false);

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
pub(crate) fn take(each: impl FnMut(Edge)) -> bool {
    // Cleared before the edges are taken: one that comes in between is taken now, and the next tick finds none.
    if ARRIVED.load(Ordering::Relaxed) {
        ARRIVED.store(false, Ordering::Relaxed);
        let edges = EDGES.lock(Cell::take);
        edges.iter().copied().for_each(each);
    }
    let flooded = FLOODED.load(Ordering::Relaxed);
    if flooded {
        // The line is masked, so nothing sets it meanwhile; cleared before the line is on again, or the next flood would be lost.
        FLOODED.store(false, Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
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
    let edge = Edge { at_us, high: INPUT.is_high() };
    let fits = EDGES.lock(|edges| {
        let mut all = edges.take();
        let fits = all.push(edge).is_ok();
        edges.set(all);
        fits
    });
    ARRIVED.store(true, Ordering::Relaxed);
    if !fits {
        EXTI.imr(0).modify(|w| w.set_line(LINE, false));
        FLOODED.store(true, Ordering::Relaxed);
    }
}
