//! TIM11 measures the crystal, before the clock is started from it: see [`firmware::crystal`].

use embassy_stm32::pac::timer::regs::Sr1ch;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;
use embassy_stm32::pac::{RCC, TIM11};
use firmware::crystal::{EDGES_A_CAPTURE, HSE_DIVIDER, INTERVALS, MeasuredHse, TIMEOUT_COUNTS};

/// TIM11 has one channel.
const CHANNEL: usize = 0;
/// TI1_RMP of TIM11_OR (RM0090 19.5.12): HSE after the prescaler RTCPRE.
const HSE_TO_CHANNEL_1: u32 = 2;
const PRESCALER: u8 = EDGES_A_CAPTURE.ilog2() as u8;

/// Measures HSE by HSI, which must be the clock of the system; 0 Hz if no edges come. It takes 0.25 ms at 8 MHz, 10 ms without edges. Afterwards timer
/// and prescaler are as after a reset.
pub(crate) fn measure() -> MeasuredHse {
    RCC.apb2enr().modify(|w| w.set_tim11en(true));
    // As [`crate::clocks::settle`], which starts the clocks by this measurement.
    cortex_m::asm::dsb();
    RCC.cfgr().modify(|w| w.set_rtcpre(HSE_DIVIDER));
    TIM11.or().write_value(HSE_TO_CHANNEL_1);
    TIM11.ccmr_input(0).write(|w| {
        w.set_ccs(CHANNEL, CcmrInputCcs::TI4);
        w.set_icpsc(CHANNEL, PRESCALER);
    });
    TIM11.ccer().write(|w| w.set_cce(CHANNEL, true));
    TIM11.cr1().write(|w| w.set_cen(true));
    let measured = MeasuredHse::of(counts_of_intervals().unwrap_or(0));

    RCC.apb2rstr().modify(|w| w.set_tim11rst(true));
    RCC.apb2rstr().modify(|w| w.set_tim11rst(false));
    RCC.apb2enr().modify(|w| w.set_tim11en(false));
    RCC.cfgr().modify(|w| w.set_rtcpre(0));
    measured
}

/// Counts of the timer over [`INTERVALS`]; `None` if they do not come in [`TIMEOUT_COUNTS`]. A lost capture begins them again.
fn counts_of_intervals() -> Option<u16> {
    let count = || TIM11.cnt().read().cnt();
    let (mut before, mut passed) = (count(), 0);
    let (mut first, mut intervals) = (None, 0);
    while passed < TIMEOUT_COUNTS {
        // The loop is much shorter than a wrap of the 16 bits.
        let now = count();
        passed += u32::from(now.wrapping_sub(before));
        before = now;
        let flags = TIM11.sr().read();
        if !flags.ccif(CHANNEL) {
            continue;
        }
        // The read clears the flag.
        let at = TIM11.ccr(CHANNEL).read().ccr();
        match first {
            Some(first) if !flags.ccof(CHANNEL) => {
                intervals += 1;
                if intervals == INTERVALS {
                    return Some(at.wrapping_sub(first));
                }
            }
            // The first, or one was lost.
            _ => {
                let mut clear = Sr1ch(u32::MAX);
                clear.set_ccof(CHANNEL, false);
                TIM11.sr().write_value(clear);
                (first, intervals) = (Some(at), 0);
            }
        }
    }
    None
}
