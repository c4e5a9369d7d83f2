//! Servo outputs: four pulses from two slices of the PWM. A servo line is either driven low as a plain output, or it belongs to the PWM.
//!
//! - Frame: 20 ms, counted in microseconds; divider and top are written once. Both slices start at one moment and have one clock.
//! - A width is buffered until the next start of a frame (RP2040 datasheet, 4.5.2.3), so every pulse has either the old width or the new one.
//!   Frames start between the latest end of a tick and the next tick ([`start_frames`]): all four joints take the width of one tick.
//! - [`Outputs::drive`] with the lines off: the widths have been 0 for a whole frame, so the lines are given to the PWM without a pulse, then the new
//!   widths are buffered for the next frame. The first pulse is complete.
//! - Whatever ends the pulses while the processor runs waits for the end of a running one: [`Outputs::release`] over the ticks, [`outputs_off`]
//!   in a loop. The emergency stop does not wait, as the break of the other family.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::pac;
use embassy_rp::pac::pwm::Channel;
use embassy_rp::pac::pwm::regs::{ChCc, ChCsr};
use firmware_rp2040::board::BOARD;
use firmware_rp2040::timing::{CORE_MHZ, FRAME_STARTS_US};
use firmware_shared::frame_phase::{FRAME_US, FramePhase};
use firmware_shared::licence::Permit;
use firmware_shared::pacing::PERIOD_US;
use joint_units::PulseMicros;

use crate::pins::{self, PinRegisters};
use crate::{kept_outputs, servo_rail, stopwatch};

/// A frame in ticks, and one more: a frame has started in any span so long.
const FRAME_TICKS: u8 = (FRAME_US / PERIOD_US) as u8 + 1;

/// Longest pulse, us: a limit of the hardware layer; the gate in joint-loop limits the pulse first.
const LONGEST_US: u16 = 2_500;
/// A pulse has ended after this many ticks, unless the counter stands still.
const LONGEST_TICKS: u8 = 4;
const _: () = assert!((LONGEST_TICKS as u32 - 1) * PERIOD_US > LONGEST_US as u32, "longer than the longest pulse");

/// Rounds of the wait for the end of a pulse in [`outputs_off`]: at least ten cycles each, so no less than 2.9 ms at 200 MHz.
const END_ROUNDS: u32 = 60_000;

/// The last count of a frame.
const TOP: u16 = (FRAME_US - 1) as u16;

/// Slices of the first and the last two servos: GPIO n is output n % 2 of slice n / 2.
const SLICES: [usize; 2] = [BOARD.servos[0].0 as usize / 2 % 8, BOARD.servos[2].0 as usize / 2 % 8];
const _: () = assert!(CORE_MHZ < 256, "the divider has eight bits");

const NO_PULSES: [PulseMicros; 4] = [PulseMicros(0); 4];

/// Pulses that the emergency stop cut short.
static TRUNCATED: AtomicU32 = AtomicU32::new(0);
/// How often the emergency stop has opened. Written by its handler alone, which nothing masks: load and store need not be one.
static CUTS: AtomicU32 = AtomicU32::new(0);

/// Servo pulses that were cut short since the boot.
pub(crate) fn truncated() -> u32 {
    TRUNCATED.load(Ordering::Relaxed)
}

fn slice(half: usize) -> Channel {
    pac::PWM.ch(SLICES[half & 1])
}

/// Drives the four lines and the servo-rail enable low as plain outputs: the first action of the program, and again after the start of the clocks,
/// in which the HAL resets the pins.
pub(crate) fn drive_pins_low() {
    pins::out_of_reset();
    servo_rail::start();
    pins_low();
}

/// Switches the servos off for good, from any context: first their supply, then the lines at the end of a running pulse. Masks the interrupts.
/// Only a reset reverses it.
pub(crate) fn outputs_off() {
    servo_rail::off();
    cortex_m::interrupt::disable();
    if BOARD.servos[0].is_pwm() {
        set_widths(NO_PULSES);
        let _ = (0..END_ROUNDS).any(|_| slice(0).ctr().read().ctr() > LONGEST_US);
        kept_outputs::off();
    } else if kept_outputs::are_on() {
        // The emergency stop came this moment: no tick will record it any more.
        kept_outputs::cut_off(pulses_under_way());
    }
    pins_low();
}

fn pins_low() {
    for pin in BOARD.servos {
        pin.set(false);
        pin.make_output();
    }
}

/// Starts the servo frames, at the moment at which the converter starts. The last conversion of a block ends one period later.
pub(crate) fn start_frames() {
    let begun = (FRAME_US - FRAME_STARTS_US) as u16;
    for half in 0..2 {
        slice(half).ctr().write(|w| w.set_ctr(begun));
    }
    // Written whole, and both at once.
    pac::PWM.en().write_value(pac::pwm::regs::En(1 << SLICES[0] | 1 << SLICES[1]));
}

/// The clock of the microseconds and the counts of both slices, us, read one right after the other. Never inlined: the compiler would put the
/// divisions of the caller between the reads, and one takes 2 us.
#[inline(never)]
fn clock_and_counts() -> [u32; 3] {
    [stopwatch::now_us(), frame_us(0), frame_us(1)]
}

/// Time since the start of the servo frame by one slice, us.
fn frame_us(half: usize) -> u32 {
    slice(half).ctr().read().ctr().into()
}

/// The emergency stop: switches the servos' supply and the lines off at once. In a handler that nothing masks, so the ticks may be at any place.
pub(crate) fn cut() {
    servo_rail::off();
    if BOARD.servos[0].is_pwm() {
        TRUNCATED.store(truncated().wrapping_add(pulses_under_way().into()), Ordering::Relaxed);
    }
    pins_low();
    CUTS.store(cuts().wrapping_add(1), Ordering::Relaxed);
}

fn cuts() -> u32 {
    CUTS.load(Ordering::Relaxed)
}

/// Servos whose pulse has begun and not ended, by the widths that were last written.
fn pulses_under_way() -> u16 {
    let now = slice(0).ctr().read().ctr();
    let widths = |half| {
        let cc = slice(half).cc().read();
        [cc.a(), cc.b()]
    };
    [widths(0), widths(1)].as_flattened().iter().filter(|width| **width > now).count() as u16
}

/// The four servo lines. Only the owner of this value can make pulses.
pub(crate) struct Outputs {
    /// True from the first width to the end of the last pulse.
    driving: bool,
    /// Calls of [`Outputs::release`] since the last width.
    released: u8,
    /// The widths that were last written.
    widths: [PulseMicros; 4],
    phase: FramePhase,
    /// Openings of the emergency stop that were reported, and pulses that were cut short by them.
    seen: (u32, u32),
}

impl Outputs {
    /// Sets the slices up, once; every line stays low. [`start_frames`] starts them.
    pub(crate) fn new() -> Self {
        pac::RESETS.reset().modify(|w| w.set_pwm(false));
        while !pac::RESETS.reset_done().read().pwm() {}
        for half in 0..2 {
            let slice = slice(half);
            slice.csr().write_value(ChCsr(0));
            slice.div().write(|w| w.set_int(CORE_MHZ as u8));
            slice.top().write(|w| w.set_top(TOP));
        }
        set_widths(NO_PULSES);
        Self { driving: false, released: FRAME_TICKS, widths: NO_PULSES, phase: FramePhase::default(), seen: (0, 0) }
    }

    /// Outputs these widths from the next frame on. Whoever has no permit of this tick has no way to make a pulse.
    pub(crate) fn drive(&mut self, _: Permit, widths: [PulseMicros; 4]) {
        if !self.driving {
            // Widths of 0 have not reached the outputs before a frame has started since.
            if self.released < FRAME_TICKS {
                self.release();
                return;
            }
            servo_rail::on();
            BOARD.servos.iter().for_each(|pin| pin.connect_pwm());
            // It may have opened while the lines were given to the PWM.
            if self.is_cut() {
                cut();
            }
            self.driving = true;
        }
        self.released = 0;
        self.set_widths(widths);
        kept_outputs::on(widths);
    }

    /// Stops the pulses at the end of a running one, and then switches the servos' supply off. Must be called in every tick until the next
    /// [`Outputs::drive`].
    pub(crate) fn release(&mut self) {
        self.released = self.released.saturating_add(1);
        // First the widths, then the lines if the pulses of this frame are over: a frame that starts between the two has no pulse.
        self.set_widths(NO_PULSES);
        let in_pulse = BOARD.servos[0].is_pwm() && slice(0).ctr().read().ctr() <= LONGEST_US;
        if !self.driving || !in_pulse || self.released > LONGEST_TICKS {
            pins_low();
            servo_rail::off();
            if self.driving {
                kept_outputs::off();
            }
            self.driving = false;
        }
    }

    /// Switches the servos' supply off at once, and stops the pulses like [`Outputs::release`]: for faults.
    pub(crate) fn release_without_supply(&mut self) {
        servo_rail::off();
        self.release();
    }

    /// Whether the emergency stop is open, or has been since the last call.
    pub(crate) fn take_break(&mut self) -> bool {
        let is_cut = self.is_cut();
        let now = (cuts(), truncated());
        if self.driving && is_cut {
            kept_outputs::cut_off(now.1.wrapping_sub(self.seen.1) as u16);
        }
        self.seen = now;
        is_cut
    }

    /// Whether the emergency stop is open, or has been since [`Outputs::take_break`].
    fn is_cut(&self) -> bool {
        cuts() != self.seen.0 || !BOARD.emergency_stop.is_high()
    }

    /// Whether everything that shapes a pulse is as written: slices, widths, functions of the pins, and the servo-rail enable; the lines belong to
    /// the PWM exactly when they should, and the servo frames keep their distance from the clock.
    pub(crate) fn as_written(&mut self) -> bool {
        let cut = self.is_cut();
        let [a, b, c, d] = self.widths;
        let slices = is_as_written(slice(0), [a, b]) && is_as_written(slice(1), [c, d]);
        let lines =
            BOARD.servos.iter().all(|pin| if self.driving && !cut { pin.is_pwm() } else { cut || pin.is_output() });
        let is_on = self.driving && !cut;
        slices
            && lines
            && servo_rail::is_as_set(self.driving, is_on && self.released == 0)
            && self.frames_are_in_phase()
    }

    /// Compares the frames with the clock of the microseconds, and the slices with each other; again if an interrupt came between the reads.
    fn frames_are_in_phase(&mut self) -> bool {
        const READS: u32 = 2;
        /// From one read to the next, us.
        const APART_US: u32 = 2;
        (0..READS).any(|_| {
            let [now, first, second] = clock_and_counts();
            let apart = (second + FRAME_US - first) % FRAME_US;
            self.phase.is_kept(now, first) && apart <= APART_US
        })
    }

    fn set_widths(&mut self, widths: [PulseMicros; 4]) {
        self.widths = widths;
        set_widths(widths);
    }
}

fn is_as_written(slice: Channel, widths: [PulseMicros; 2]) -> bool {
    let mut running = ChCsr(0);
    running.set_en(true);
    let divider = slice.div().read();
    slice.csr().read() == running
        && u32::from(divider.int()) == CORE_MHZ
        && divider.frac() == 0
        && slice.top().read().top() == TOP
        && slice.cc().read() == compare(widths)
}

/// Both widths of a slice.
fn compare([a, b]: [PulseMicros; 2]) -> ChCc {
    let mut w = ChCc(0);
    w.set_a(a.0.min(LONGEST_US));
    w.set_b(b.0.min(LONGEST_US));
    w
}

fn set_widths([a, b, c, d]: [PulseMicros; 4]) {
    slice(0).cc().write_value(compare([a, b]));
    slice(1).cc().write_value(compare([c, d]));
}
