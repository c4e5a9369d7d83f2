//! The clocks: started by the HAL, checked in every tick.

use embassy_rp::clocks::{ClockConfig, CoreVoltage, PllConfig};
use embassy_rp::pac::clocks::vals::ClkSysCtrlSrc;
use embassy_rp::peripherals::USB;
use embassy_rp::{Peri, pac};
use firmware_rp2040::timing::CORE_MHZ;
use wire::BrownOut;

/// The crystal of the Pico, MHz.
const CRYSTAL_MHZ: u32 = 12;
/// Multiplier of the crystal, and the two dividers behind it. The HAL's own search for them takes 95 ms of the clock with which the chip starts.
const PLL: PllConfig = PllConfig { refdiv: 1, fbdiv: 100, post_div1: 3, post_div2: 2 };
const _: () = assert!(CRYSTAL_MHZ * PLL.fbdiv as u32 == CORE_MHZ * PLL.post_div1 as u32 * PLL.post_div2 as u32);

/// Starts the crystal, both PLLs and the microseconds of TIMER. It waits for the crystal: without one the board stays here, dark, its outputs off.
/// The HAL resets all blocks but PLLs, USB, SYSCFG and the flash's pins on the way: no pin is an output afterwards.
///
/// Returns the one peripheral that the HAL drives; the program drives the others by registers.
pub(crate) fn start() -> Peri<'static, USB> {
    let clocks = ClockConfig::manual_pll(CRYSTAL_MHZ * 1_000_000, PLL, CoreVoltage::V1_15);
    embassy_rp::init(embassy_rp::config::Config::new(clocks)).USB
}

/// Whether the core still runs from its PLL, and the PLL from the crystal is in lock.
pub(crate) fn is_as_started() -> bool {
    pac::CLOCKS.clk_sys_ctrl().read().src() == ClkSysCtrlSrc::CLKSRC_CLK_SYS_AUX && pac::PLL_SYS.cs().read().lock()
}

/// What switches the detector below on again.
pub(crate) const BROWN_OUT_HELP: &str = "a reset switches it on";

/// The detector that resets the chip when the core's voltage falls: 1 is on. It does not watch the 3.3 V.
pub(crate) fn brown_out() -> BrownOut {
    BrownOut { level: pac::VREG_AND_CHIP_RESET.bod().read().en().into(), wanted: 1 }
}
