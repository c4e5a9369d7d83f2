//! Four servo pulses from TIM1, all behind one bit: without main output enable (MOE) every line is driven low.
//!
//! - Frame: 20 ms, counted in microseconds; divider and period are written once and never again.
//! - A pulse starts at the start of a frame and its width is buffered until the next start (preload), so a pulse is never cut short or
//!   stretched by a new width: each is the old one or the new one.
//! - [`Outputs::drive`] from dark: the widths in force are made 0 first, then MOE is set, then the new widths wait for the next frame. The
//!   first pulse is a full one.
//! - [`Outputs::release`] waits for the end of a pulse that is on its way, at most 2.5 ms: half a pulse is a wrong angle.
//!   [`outputs_off`] does not wait: that one is for faults.
//! - The break input (high stops, pulled down) clears MOE in hardware, whatever the processor does; AOE stays 0, so only a new arming
//!   sets it again. The clock security system breaks the same way.
//!
//! By registers and not by the HAL, which sets MOE as soon as it has the timer and asserts in the call that writes a width.

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

/// No pulse is longer than this, us; the gate in joint-loop is the one that chooses, this is what the hardware step will not exceed.
const LONGEST_US: u16 = 2_500;

const TIM1_FUNCTION: u8 = 1;

/// Break and dead-time register with MOE off: idle pins are driven (low), not left floating; break input on, active high. Locked, so that
/// after the first time this is written nothing but MOE can be changed, here and in the modes of the channels, before the next reset.
fn dark() -> BdtrAdv {
    let mut w = BdtrAdv(0);
    w.set_lock(Lock::LEVEL3);
    w.set_ossi(Ossi::IDLE_LEVEL);
    w.set_bke(0, true);
    w.set_bkp(0, Bkp::ACTIVE_HIGH);
    w
}

/// Drives the four lines low as plain outputs: the first thing that the program does, long before there is a timer.
pub(crate) fn drive_pins_low() {
    // The two ports that TIM1 can reach.
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioeen(true);
    });
    clocks::settle();
    pins_low();
}

/// Switches the servos off now, from anywhere: TIM1 first, then the pins for good measure. Only a reset undoes it.
///
/// While TIM1 has no clock yet its write does nothing, and the pins are low anyway.
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

/// The four servo lines. Whoever holds it is the only one that can make pulses.
pub(crate) struct Outputs {
    /// Set from the first width after darkness to the end of the last pulse.
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

        // The break pin before the break is switched on, and both before the servo pins: an emergency stop that is pressed now holds from
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

    /// These widths from the next frame on.
    pub(crate) fn drive(&mut self, widths: [PulseMicros; 4]) {
        if !self.driving {
            // The widths in force may be those of before the last release: 0 into the buffer, and an update to put it in force.
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

    /// No more pulses: dark at once, or at the end of the pulse that is on its way. To be called in every tick until it is.
    pub(crate) fn release(&mut self) {
        // First no next pulse. Then, if the frame is past its pulses, MOE: should a frame start between the two lines, it has no pulse.
        set_widths([PulseMicros(0); 4]);
        if !self.driving || TIM1.cnt().read().cnt() > LONGEST_US {
            TIM1.bdtr().write_value(dark());
            self.driving = false;
        }
    }

    /// Dark now, in the middle of a pulse if need be.
    pub(crate) fn cut(&mut self) {
        TIM1.bdtr().write_value(dark());
        set_widths([PulseMicros(0); 4]);
        self.driving = false;
    }

    /// Whether the break input or a clock failure has switched the outputs off since the last call. True in every call while it lasts.
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

    /// Whether the timer is still as it was set up, and its outputs are on exactly when they shall be.
    pub(crate) fn as_written(&self) -> bool {
        let bdtr = TIM1.bdtr().read();
        TIM1.psc().read() == APB2_TIMER_MHZ - 1
            && TIM1.arr().read().arr() == FRAME_US - 1
            && TIM1.cr1().read().cen()
            && bdtr.moe() == self.driving
            && bdtr.ossi() == Ossi::IDLE_LEVEL
            && bdtr.bke(0)
            && !bdtr.aoe()
    }
}

fn set_widths(widths: [PulseMicros; 4]) {
    for (channel, width) in widths.into_iter().enumerate() {
        TIM1.ccr(channel).write(|w| w.set_ccr(width.0.min(LONGEST_US)));
    }
}
