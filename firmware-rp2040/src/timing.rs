//! Times of a control period: conversions, and what counts as late.

use firmware_shared::pacing::PERIOD_US;

/// Clock of the core, MHz. 133 MHz is the most of the chip's first data sheet; Raspberry Pi has released 200 MHz at a core voltage of 1.15 V since.
pub const CORE_MHZ: u32 = 200;

/// A tick that starts later than this after the last conversion of its block counts as late.
pub const LATE_US: u32 = 100;

/// A tick that ends later than this after the last conversion of its block counts as late too: before the next servo frame can start. The
/// chip computes floating-point numbers in software, so a tick takes longer than on the other family.
pub const LATE_END_US: u32 = 800;

/// Where in a period a servo frame can start, us after the last conversion of a block: after the latest end of a tick and before the next one.
pub const FRAME_STARTS_US: u32 = 900;
const _: () = assert!(
    LATE_END_US < FRAME_STARTS_US && FRAME_STARTS_US < PERIOD_US,
    "widths are written between two frames' starts"
);

/// Channels of a scan: three sensors and the temperature of the die.
pub const SCAN: usize = 4;

/// Conversions of a block, one period.
pub const BLOCK: usize = SCAN * hgod_adc::OVERSAMPLING;

/// Clock of the converter, MHz.
const CONVERTER_MHZ: u32 = 48;

/// Cycles of the converter from one conversion to the next. A conversion takes 96 (RP2040 datasheet, 4.9.2).
pub const CONVERSION_CYCLES: u32 = PERIOD_US * CONVERTER_MHZ / BLOCK as u32;
const _: () = assert!(
    CONVERSION_CYCLES * BLOCK as u32 == PERIOD_US * CONVERTER_MHZ && CONVERSION_CYCLES >= 96,
    "a period is a block"
);

/// When the last conversion of a block ended: `later` conversions of the next block have ended since, which last ended at most one conversion
/// before `now_us`.
///
/// ```
/// use firmware_rp2040::timing::converted_us;
/// assert_eq!(converted_us(50_003, 0), 50_003);
/// // The interrupt was held off until two more conversions had ended.
/// assert_eq!(converted_us(50_130, 2), 50_005);
/// ```
#[must_use]
pub const fn converted_us(now_us: u32, later: u32) -> u32 {
    now_us.wrapping_sub(later.wrapping_mul(CONVERSION_CYCLES) / CONVERTER_MHZ)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware_shared::pacing::Pacer;

    #[test]
    fn an_interrupt_held_off_is_stamped_within_one_conversion() {
        for held_off in 0..PERIOD_US {
            let later = held_off * CONVERTER_MHZ / CONVERSION_CYCLES;
            let late = converted_us(7_000 + held_off, later) - 7_000;
            assert!(late <= CONVERSION_CYCLES.div_ceil(CONVERTER_MHZ), "held off {held_off} us: {late}");
        }
    }

    #[test]
    fn stamps_of_held_off_interrupts_lose_no_period() {
        let mut pacer = Pacer::default();
        let total: u32 = (0..10_000).map(|tick| pacer.elapsed(tick * PERIOD_US + tick * 31 % 63)).sum();
        assert_eq!(total, 10_000);
    }
}
