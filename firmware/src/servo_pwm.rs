//! Servo outputs: four pulses from TIM1, enabled by one bit; without main output enable (MOE) every line is driven low.
//!
//! - Frame: 20 ms, counted in microseconds; divider and period are written once and never again.
//! - A pulse starts at the start of a frame and its width is buffered until the next start (preload), so every pulse has
//!   either the old width or the new one. Frames start half a period away from the ticks, which write the widths: all four joints take the
//!   width of the same tick ([`start_frames`]).
//! - [`Outputs::drive`] with MOE off: the widths have been 0 for a whole frame, so MOE is set without a pulse, then the new widths are buffered
//!   for the next frame. The first pulse is complete. Before MOE the watchdog and TIM1 are set to run on while a debugger halts the core
//!   ([`watchdog`]), and after MOE is off to stand still with it.
//! - A pulse that is cut short is a valid command for another angle. So whatever ends the pulses while the processor runs waits for the end of
//!   a running one, at most 2.5 ms: [`Outputs::release`] over the ticks, [`outputs_off`] in a loop.
//! - The break input (low stops, pulled down, so that an open contact or a cut cable stops) clears MOE in hardware, independent of the processor,
//!   and so does the clock security system; AOE stays 0, so only a new arming sets it again. That does cut a pulse: the interrupt of the break
//!   switches the servos' supply off ([`servo_rail`]) and counts the pulses, also for the next boot ([`kept_outputs`]).
//!
//! Written by registers, because the HAL sets MOE as soon as it has the timer and asserts in the call that writes a width.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::timer::regs::{BdtrAdv, CcerAdv, CcmrOutputGp16, Cr1Gp16, SrAdv};
use embassy_stm32::pac::timer::vals::{Bkp, Lock, Ocm, Ossi};
use embassy_stm32::pac::{RCC, TIM1};
use firmware::board::{BOARD, Port};
use firmware_shared::frame_phase::{FRAME_US, FramePhase};
use firmware_shared::licence::Permit;
use firmware_shared::pacing::PERIOD_US;
use joint_units::PulseMicros;

use crate::clocks::{self, APB2_TIMER_MHZ};
use crate::pins::{FunctionPins, PinRegisters};
use crate::removed::{Protection, lacks};
use crate::{kept_outputs, servo_rail, stopwatch, watchdog};

/// The same in ticks, and one more: a frame has started in any span so long.
const FRAME_TICKS: u8 = (FRAME_US / PERIOD_US) as u8 + 1;

/// Longest pulse, us: a limit of the hardware layer; the gate in joint-loop limits the pulse first.
const LONGEST_US: u16 = 2_500;
/// A pulse has ended after this many ticks, unless the timer stands still.
const LONGEST_TICKS: u8 = 4;
const _: () = assert!((LONGEST_TICKS as u32 - 1) * PERIOD_US > LONGEST_US as u32, "longer than the longest pulse");

/// Time in a frame, modulo a period, at which the converter is triggered for a tick, us. The widths are written 0.1 to 0.3 ms later: in the
/// middle between two moments at which a frame can start.
pub(crate) const TRIGGER_PHASE_US: u32 = 340;

/// Rounds of the wait for the end of a pulse in [`outputs_off`]: at least five cycles of the processor each, so no less than 2.9 ms at 168 MHz. It ends
/// sooner by the timer; the rounds bound it if the timer stands still.
const END_ROUNDS: u32 = 100_000;

/// The last count of a frame.
const RELOAD: u16 = (FRAME_US - 1) as u16;

const TIM1_FUNCTION: u8 = 1;

/// Pull of the emergency stop, whose line a closed contact holds high.
const STOP_PULL: Pupdr = Pupdr::PULL_DOWN;

const NO_PULSES: [PulseMicros; 4] = [PulseMicros(0); 4];

/// Pulses that the break cut short.
static TRUNCATED: AtomicU32 = AtomicU32::new(0);

/// Servo pulses that were cut short since the boot.
pub(crate) fn truncated() -> u32 {
    TRUNCATED.load(Ordering::Relaxed)
}

/// Break and dead-time register with MOE off: idle pins are driven (low), not left floating; break input on, active low. Locked: after
/// the first write only MOE can be changed, here and in the modes of the channels, until the next reset.
fn dark() -> BdtrAdv {
    let mut w = BdtrAdv(0);
    w.set_lock(Lock::LEVEL3);
    w.set_ossi(Ossi::IDLE_LEVEL);
    w.set_bke(0, true);
    w.set_bkp(0, Bkp::ACTIVE_LOW);
    w
}

/// Drives the four lines and the servo-rail enable low as plain outputs: the first action of the program, before the timer starts.
pub(crate) fn drive_pins_low() {
    // The two ports that TIM1's channels can reach, and those of the servo-rail enable.
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
        w.set_gpiocen(true);
        w.set_gpioeen(true);
    });
    clocks::settle();
    servo_rail::start();
    pins_low();
}

/// Switches the servos off for good, from any context: first their supply, then TIM1 at the end of a running pulse, then also the pins. Masks
/// the interrupts, so that no tick writes a width. Only a reset reverses it.
///
/// Before TIM1 has a clock, its registers read 0 and the write to it has no effect, and the pins are low already.
pub(crate) fn outputs_off() {
    if !lacks(Protection::SupplyFirst) {
        servo_rail::off();
    }
    cortex_m::interrupt::disable();
    if TIM1.bdtr().read().moe() {
        set_widths(NO_PULSES);
        if !lacks(Protection::PulseEnd) {
            let _ = (0..END_ROUNDS).any(|_| TIM1.cnt().read().cnt() > LONGEST_US);
        }
        kept_outputs::off();
    } else if kept_outputs::are_on() {
        // The clock failed, or the break came this moment: its interrupt will not run any more.
        kept_outputs::cut_off(pulses_under_way());
    }
    TIM1.bdtr().write_value(dark());
    pins_low();
}

fn pins_low() {
    for pin in BOARD.servos {
        pin.set(false);
        pin.set_mode(Moder::OUTPUT);
    }
}

/// Starts the servo frames, at the moment at which the trigger of the ticks starts.
pub(crate) fn start_frames() {
    TIM1.cnt().write(|w| w.set_cnt(TRIGGER_PHASE_US as u16));
    TIM1.cr1().write_value(counting(true));
}

/// Time since the start of the servo frame, us.
pub(crate) fn frame_us() -> u32 {
    TIM1.cnt().read().cnt().into()
}

/// The break has switched the outputs off.
#[cfg(target_os = "none")]
#[embassy_stm32::interrupt]
fn TIM1_BRK_TIM9() {
    on_break();
}

fn on_break() {
    if !lacks(Protection::SupplyInBreak) {
        servo_rail::off();
    }
    // Off until the next arming: the flag comes back as long as the input is active.
    TIM1.dier().modify(|w| w.set_bie(false));
    let cut = pulses_under_way();
    TRUNCATED.store(truncated().wrapping_add(cut.into()), Ordering::Relaxed);
    kept_outputs::cut_off(cut);
}

/// Servos whose pulse has begun and not ended, by the widths that were last written.
fn pulses_under_way() -> u16 {
    let now = TIM1.cnt().read().cnt();
    (0..BOARD.servos.len()).filter(|&channel| TIM1.ccr(channel).read().ccr() > now).count() as u16
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
}

impl Outputs {
    /// Sets the timer up, once; every line stays low. [`start_frames`] starts it. `priority` is that of the break.
    pub(crate) fn new(priority: Priority) -> Self {
        RCC.apb2enr().modify(|w| w.set_tim1en(true));
        clocks::settle();
        TIM1.psc().write_value(APB2_TIMER_MHZ - 1);
        TIM1.arr().write(|w| w.set_arr(RELOAD));
        TIM1.cr1().write_value(counting(false));
        (0..2).for_each(|half| TIM1.ccmr_output(half).write_value(buffered_pwm()));
        set_widths(NO_PULSES);
        TIM1.ccer().write_value(outputs_enabled());
        TIM1.egr().write(|w| w.set_ug(true));

        // The break pin before the break is switched on, and both before the servo pins: an emergency stop that is pressed now acts from
        // the start.
        BOARD.emergency_stop.set_pull(STOP_PULL);
        BOARD.emergency_stop.set_function(TIM1_FUNCTION);
        TIM1.bdtr().write_value(dark());
        for pin in BOARD.servos {
            pin.set_function(TIM1_FUNCTION);
        }
        interrupt::TIM1_BRK_TIM9.set_priority(priority);
        // SAFETY: the handler uses nothing that is set up later, and nothing masks this interrupt by itself.
        unsafe { interrupt::TIM1_BRK_TIM9.enable() };
        Self { driving: false, released: FRAME_TICKS, widths: NO_PULSES, phase: FramePhase::default() }
    }

    /// Outputs these widths from the next frame on. Whoever has no permit of this tick has no way to make a pulse.
    pub(crate) fn drive(&mut self, _: Permit, widths: [PulseMicros; 4]) {
        if !self.driving {
            // Widths of 0 have not reached the outputs before a frame has started since.
            if self.released < FRAME_TICKS {
                self.release();
                return;
            }
            watchdog::run_while_halted();
            servo_rail::on();
            TIM1.bdtr().write(|w| {
                *w = dark();
                w.set_moe(true);
            });
            TIM1.dier().modify(|w| w.set_bie(true));
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
        // First the widths, then MOE if the pulses of this frame are over: a frame that starts between the two lines has no pulse.
        self.set_widths(NO_PULSES);
        let in_pulse = TIM1.bdtr().read().moe() && TIM1.cnt().read().cnt() <= LONGEST_US;
        if !self.driving || !in_pulse || self.released > LONGEST_TICKS {
            TIM1.bdtr().write_value(dark());
            servo_rail::off();
            if self.driving {
                kept_outputs::off();
                watchdog::stop_while_halted();
            }
            self.driving = false;
        }
    }

    /// Switches the servos' supply off at once, and stops the pulses like [`Outputs::release`]: for faults.
    pub(crate) fn release_without_supply(&mut self) {
        servo_rail::off();
        self.release();
    }

    /// Whether the break input or a clock failure has switched the outputs off since the last call. True in every call while the cause lasts.
    pub(crate) fn take_break(&mut self) -> bool {
        let seen = TIM1.sr().read().bif(0);
        if seen {
            // Flags are cleared by writing 0; ones leave the others alone. The flag comes back at once while the input is active.
            let mut clear = SrAdv(0xFFFF);
            clear.set_bif(0, false);
            TIM1.sr().write_value(clear);
        }
        seen
    }

    /// Whether everything that shapes a pulse is as written: the timer's registers, the widths, the functions of the pins, the pull of the emergency
    /// stop, and the servo-rail enable; the outputs are on exactly when they should be, and the servo frames keep their distance from the ticks.
    pub(crate) fn as_written(&mut self) -> bool {
        let bdtr = TIM1.bdtr().read();
        let mut off = bdtr;
        off.set_moe(false);
        let timer = TIM1.cr1().read() == counting(true)
            && TIM1.cr2().read().0 == 0
            && TIM1.smcr().read().0 == 0
            && TIM1.psc().read() == APB2_TIMER_MHZ - 1
            && TIM1.arr().read().arr() == RELOAD
            && TIM1.rcr().read().0 == 0
            && TIM1.ccer().read() == outputs_enabled()
            // One by one: in a loop over both the compiler keeps the range check of the index.
            && TIM1.ccmr_output(0).read() == buffered_pwm()
            && TIM1.ccmr_output(1).read() == buffered_pwm();
        let widths =
            self.widths.iter().enumerate().all(|(channel, width)| TIM1.ccr(channel).read().ccr() == limited(*width));
        let pins = const { function_pins(Port::A) }.are_set()
            && const { function_pins(Port::B) }.are_set()
            && const { function_pins(Port::C) }.are_set()
            && const { function_pins(Port::D) }.are_set()
            && const { function_pins(Port::E) }.are_set();
        timer
            && widths
            && pins
            // Without it an open contact or a cut cable of the emergency stop need not stop.
            && BOARD.emergency_stop.has_pull(STOP_PULL)
            && off == dark()
            && bdtr.moe() == self.driving
            && (!bdtr.moe() || TIM1.dier().read().bie())
            && servo_rail::is_as_set(self.driving, self.driving && self.released == 0)
            && self.frames_are_in_phase()
    }

    /// Compares the frames with the clock of the microseconds; again if an interrupt came between the two reads.
    fn frames_are_in_phase(&mut self) -> bool {
        const READS: u32 = 2;
        (0..READS).any(|_| self.phase.is_kept(stopwatch::now_us(), frame_us()))
    }

    fn set_widths(&mut self, widths: [PulseMicros; 4]) {
        self.widths = widths;
        set_widths(widths);
    }
}

/// The pins of TIM1 on a port: servos and break.
const fn function_pins(port: Port) -> FunctionPins {
    let [a, b, c, d] = BOARD.servos;
    FunctionPins::on(port, &[a, b, c, d, BOARD.emergency_stop], TIM1_FUNCTION)
}

/// Both channels of a half: PWM, with buffered widths.
fn buffered_pwm() -> CcmrOutputGp16 {
    let mut w = CcmrOutputGp16(0);
    for channel in 0..2 {
        w.set_ocm(channel, Ocm::PWM_MODE1);
        w.set_ocpe(channel, true);
    }
    w
}

/// All four channels on. Idle level (CR2.OIS) low and active level (CCER.CCP) high are the reset values.
fn outputs_enabled() -> CcerAdv {
    let mut w = CcerAdv(0);
    (0..4).for_each(|channel| w.set_cce(channel, true));
    w
}

/// Counts up, with a buffered period.
fn counting(on: bool) -> Cr1Gp16 {
    let mut w = Cr1Gp16(0);
    w.set_arpe(true);
    w.set_cen(on);
    w
}

fn limited(width: PulseMicros) -> u16 {
    width.0.min(LONGEST_US)
}

fn set_widths(widths: [PulseMicros; 4]) {
    for (channel, width) in widths.into_iter().enumerate() {
        TIM1.ccr(channel).write(|w| w.set_ccr(limited(width)));
    }
}
