//! Counts control periods by a free-running hardware clock, not by the number of wake-ups of a task.
//!
//! The interrupt at the end of a period's last scan stamps its sample with a time of that scan: the STM32F4 with that of its
//! trigger, from the timer that triggers it; the RP2040 with that of its end, from the number of conversions since. Whatever delayed the processor in between (an interrupt mask, a flash stall, a long log), the difference of
//! two stamps is the number of periods that passed: missed ticks are counted, but not executed later.
//!
//! All times are microseconds of one 32 bit counter that wraps after 71 minutes, so only differences are meaningful.

/// The control period, 1 kHz.
pub const PERIOD_US: u32 = 1_000;

/// Time between two scans of a period, us.
pub const SCAN_PERIOD_US: u32 = PERIOD_US / hgod_adc::OVERSAMPLING as u32;
const _: () = assert!(PERIOD_US.is_multiple_of(SCAN_PERIOD_US), "a whole number of scans a period");

/// A sample older than this is not used.
pub const STALE_US: u32 = 5_000;

/// Time from `then_us` to `now_us`; 0 if `now_us` is before `then_us` (two counters read one after the other may differ by one).
///
/// ```
/// use firmware_shared::pacing::since;
/// assert_eq!((since(1_040, 1_000), since(4, u32::MAX), since(999, 1_000)), (40, 5, 0));
/// ```
#[must_use]
pub const fn since(now_us: u32, then_us: u32) -> u32 {
    let passed = now_us.wrapping_sub(then_us);
    if passed > u32::MAX / 2 { 0 } else { passed }
}

/// The count of periods is corrected when it differs from the clock by more than this. No multiple of [`SCAN_PERIOD_US`] is near, so a
/// converter that restarted at another quarter of the period does not cause repeated corrections.
const ASTRAY_US: i32 = 800;
const _: () = assert!(ASTRAY_US % SCAN_PERIOD_US as i32 > 10 && ASTRAY_US < PERIOD_US as i32, "between two quarters");

/// Turns the stamps of successive samples into whole periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pacer {
    last_us: Option<u32>,
    /// Time that passed but is not counted as periods, us; negative if periods were counted too early.
    uncounted_us: i32,
}

impl Pacer {
    /// Periods since the sample before: 1 normally, n when n - 1 ticks were missed, 0 for a sample that was seen already.
    ///
    /// The first sample counts as one period. Stamps may be off by a microsecond or two, so the quotient is rounded to the nearest. The
    /// remainders add up, so that after any number of samples the count differs from the clock by less than a period.
    ///
    /// ```
    /// use firmware_shared::pacing::Pacer;
    /// let mut pacer = Pacer::default();
    /// let periods = [10_000, 11_001, 14_000, 14_001].map(|stamp| pacer.elapsed(stamp));
    /// assert_eq!(periods, [1, 1, 3, 0]);
    /// ```
    #[must_use]
    pub fn elapsed(&mut self, triggered_us: u32) -> u32 {
        let passed = self.last_us.map_or(PERIOD_US, |last_us| since(triggered_us, last_us));
        let mut periods = (passed + PERIOD_US / 2) / PERIOD_US;
        if periods == 0 {
            return 0;
        }
        self.last_us = Some(triggered_us);
        // At most half a period, positive or negative.
        self.uncounted_us += passed.wrapping_sub(periods * PERIOD_US).cast_signed();
        if self.uncounted_us > ASTRAY_US {
            periods += 1;
            self.uncounted_us -= PERIOD_US as i32;
        } else if self.uncounted_us < -ASTRAY_US && periods > 1 {
            periods -= 1;
            self.uncounted_us += PERIOD_US as i32;
        }
        periods
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_period_counts_once_through_the_wrap_of_the_counter() {
        let start = u32::MAX - 10 * PERIOD_US - 17;
        let mut pacer = Pacer::default();
        for tick in 0..20 {
            let jitter = [0, 1, 2, 1][tick as usize % 4];
            assert_eq!(pacer.elapsed(start.wrapping_add(tick * PERIOD_US + jitter)), 1, "tick {tick}");
        }
    }

    #[test]
    fn the_sum_of_elapsed_periods_is_the_time_that_passed() {
        // Gaps as after a stall: no period may be lost or counted twice.
        let gaps = [1, 1, 7, 1, 300, 2, 1, 60_000, 1];
        let mut pacer = Pacer::default();
        let mut stamp = 4_000_000_000_u32;
        assert_eq!(pacer.elapsed(stamp), 1);
        for gap in gaps {
            stamp = stamp.wrapping_add(gap * PERIOD_US);
            assert_eq!(pacer.elapsed(stamp), gap);
        }
    }

    #[test]
    fn small_errors_of_the_stamps_do_not_add_up() {
        let mut pacer = Pacer::default();
        let mut total = 0;
        for tick in 0..10_000_u32 {
            let noise = (tick.wrapping_mul(2_654_435_761) >> 30) * 100;
            total += pacer.elapsed(tick * PERIOD_US + noise);
        }
        assert_eq!(total, 10_000);
    }

    #[test]
    fn the_count_follows_the_clock_through_changes_of_the_quarter() {
        // The converter restarts at every hundredth tick, after a random number of quarters; stamps are off by up to 2 us.
        let mut pacer = Pacer::default();
        let (mut quarters, mut total, mut seed) = (0_u32, 0_u32, 1_u32);
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed >> 16
        };
        for n in 0..20_000_u32 {
            let elapsed = pacer.elapsed((quarters * SCAN_PERIOD_US).wrapping_add(random() % 3));
            assert!((1..=3).contains(&elapsed), "{elapsed} periods at sample {n}");
            total += elapsed;
            let passed_us = quarters * SCAN_PERIOD_US + PERIOD_US;
            assert!((total * PERIOD_US).abs_diff(passed_us) < 1_100, "{total} periods after {passed_us} us");
            quarters += 4 + if n % 100 == 99 { random() % 5 } else { 0 };
        }
    }

    #[test]
    fn a_sample_seen_twice_or_out_of_order_is_no_period() {
        let mut pacer = Pacer::default();
        assert_eq!(pacer.elapsed(5_000), 1);
        assert_eq!(pacer.elapsed(5_000), 0);
        assert_eq!(pacer.elapsed(4_000), 0);
        assert_eq!(pacer.elapsed(6_000), 1);
    }
}
