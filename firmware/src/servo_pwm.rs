//! Servo outputs: four pulses from TIM1, enabled by one bit; without main output enable (MOE) every line is driven low.
//!
//! - Frame: 20 ms, counted in microseconds; divider and period are written once and never again.
//! - A pulse starts at the start of a frame and its width is buffered until the next start (preload), so every pulse has
//!   either the old width or the new one.
//! - [`Outputs::drive`] with MOE off: the active widths are set to 0, then MOE is set, then the new widths are buffered for the next frame.
//!   The first pulse is complete.
//! - [`Outputs::release`] waits for the end of a running pulse, at most 2.5 ms: a shortened pulse is a wrong angle. [`outputs_off`], for
//!   faults, does not wait.
//! - The break input (low stops, pulled down, so that an open contact or a cut cable stops) clears MOE in hardware, independent of the processor; AOE
//!   stays 0, so only a new arming sets it again. The clock security system has the same effect.
//!
//! Written by registers, because the HAL sets MOE as soon as it has the timer and asserts in the call that writes a width.

use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::timer::regs::{BdtrAdv, SrAdv};
use embassy_stm32::pac::timer::vals::{Bkp, Lock, Ocm, Ossi};
use embassy_stm32::pac::{RCC, TIM1};
use firmware::board::BOARD;
use joint_units::PulseMicros;

use crate::clocks::{self, APB2_TIMER_MHZ};
use crate::pins::PinRegisters;

/// Servo frame, us: 50 Hz.
const FRAME_US: u16 = 20_000;

/// Longest pulse, us: a limit of the hardware layer; the gate in joint-loop limits the pulse first.
const LONGEST_US: u16 = 2_500;

const TIM1_FUNCTION: u8 = 1;

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

/// Drives the four lines low as plain outputs: the first action of the program, before the timer starts.
pub(crate) fn drive_pins_low() {
    // The two ports that TIM1 can reach.
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioeen(true);
    });
    clocks::settle();
    pins_low();
}

/// Switches the servos off at once, from any context: first TIM1, then also the pins. Only a reset reverses it.
///
/// Before TIM1 has a clock, the write to it has no effect, and the pins are low already.
pub(crate) fn outputs_off() {
    TIM1.bdtr().write_value(dark());
    pins_low();
}

fn pins_low() {
    for pin in BOARD.servos {
        pin.set(false);
        pin.set_mode(Moder::OUTPUT);
    }
}

/// The four servo lines. Only the owner of this value can make pulses.
pub(crate) struct Outputs {
    /// True from the first width to the end of the last pulse.
    driving: bool,
}

impl Outputs {
    /// Starts the timer, once; every line stays low.
    pub(crate) fn new() -> Self {
        RCC.apb2enr().modify(|w| w.set_tim1en(true));
        clocks::settle();
        TIM1.psc().write_value(APB2_TIMER_MHZ - 1);
        TIM1.arr().write(|w| w.set_arr(FRAME_US - 1));
        TIM1.cr1().write(|w| w.set_arpe(true));
        for half in 0..2 {
            TIM1.ccmr_output(half).write(|w| {
                for channel in 0..2 {
                    w.set_ocm(channel, Ocm::PWM_MODE1);
                    w.set_ocpe(channel, true);
                }
            });
        }
        set_widths([PulseMicros(0); 4]);
        // Idle level (CR2.OIS) low and active level (CCER.CCP) high are the reset values.
        TIM1.ccer().write(|w| (0..4).for_each(|channel| w.set_cce(channel, true)));
        TIM1.egr().write(|w| w.set_ug(true));

        // The break pin before the break is switched on, and both before the servo pins: an emergency stop that is pressed now acts from
        // the start.
        BOARD.emergency_stop.set_pull(Pupdr::PULL_DOWN);
        BOARD.emergency_stop.set_function(TIM1_FUNCTION);
        TIM1.bdtr().write_value(dark());
        for pin in BOARD.servos {
            pin.set_function(TIM1_FUNCTION);
        }

        TIM1.cr1().modify(|w| w.set_cen(true));
        Self { driving: false }
    }

    /// Outputs these widths from the next frame on.
    pub(crate) fn drive(&mut self, widths: [PulseMicros; 4]) {
        if !self.driving {
            // The active widths may be those before the last release: write 0 to the buffer, and update.
            set_widths([PulseMicros(0); 4]);
            TIM1.egr().write(|w| w.set_ug(true));
            TIM1.bdtr().write(|w| {
                *w = dark();
                w.set_moe(true);
            });
            self.driving = true;
        }
        set_widths(widths);
    }

    /// Stops the pulses: at once, or at the end of the running pulse. Must be called in every tick until then.
    pub(crate) fn release(&mut self) {
        // First the widths, then MOE if the pulses of this frame are over: a frame that starts between the two lines has no pulse.
        set_widths([PulseMicros(0); 4]);
        if !self.driving || TIM1.cnt().read().cnt() > LONGEST_US {
            TIM1.bdtr().write_value(dark());
            self.driving = false;
        }
    }

    /// Stops the pulses at once, even in the middle of a pulse.
    pub(crate) fn cut(&mut self) {
        TIM1.bdtr().write_value(dark());
        set_widths([PulseMicros(0); 4]);
        self.driving = false;
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

    /// Whether the timer's registers are as written, and the outputs are on exactly when they should be.
    pub(crate) fn as_written(&self) -> bool {
        let bdtr = TIM1.bdtr().read();
        TIM1.psc().read() == APB2_TIMER_MHZ - 1
            && TIM1.arr().read().arr() == FRAME_US - 1
            && TIM1.cr1().read().cen()
            && bdtr.moe() == self.driving
            && bdtr.ossi() == Ossi::IDLE_LEVEL
            && bdtr.bke(0)
            && bdtr.bkp(0) == Bkp::ACTIVE_LOW
            && !bdtr.aoe()
    }
}

fn set_widths(widths: [PulseMicros; 4]) {
    for (channel, width) in widths.into_iter().enumerate() {
        TIM1.ccr(channel).write(|w| w.set_ccr(width.0.min(LONGEST_US)));
    }
}
