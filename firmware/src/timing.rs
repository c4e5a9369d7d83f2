//! Times of a control period: when scans are triggered, and what counts as late.

use firmware_shared::pacing::SCAN_PERIOD_US;

/// Time from one trigger of the converter to the next, us.
pub const TRIGGER_US: u32 = SCAN_PERIOD_US;

/// A tick that starts later than this after its trigger counts as late. The scan takes 77 us of it (64 us on a
/// Black Pill), with any number of sensors: it always converts six channels.
pub const LATE_US: u32 = 100;

/// A tick that ends later than this after its trigger counts as late too: half a period, and before the next servo frame can start.
pub const LATE_END_US: u32 = 500;

/// When the last scan of the block that has just been read was triggered.
///
/// `since_trigger_us` is the time since the newest trigger, `scans_since` the number of scans that have ended since the block did: none,
/// unless the interrupt was held off. A scan takes at least `scan_us`, so sooner than that after the newest trigger there is one more
/// trigger than there are scans.
///
/// ```
/// use firmware::timing::trigger_us;
/// assert_eq!(trigger_us(50_076, 76, 0, 76), 50_000);
/// // Held off until the next scan was under way, and until it had ended.
/// assert_eq!(trigger_us(50_255, 5, 0, 76), 50_000);
/// assert_eq!(trigger_us(50_355, 105, 1, 76), 50_000);
/// ```
#[must_use]
pub const fn trigger_us(now_us: u32, since_trigger_us: u32, scans_since: u32, scan_us: u32) -> u32 {
    let newest = now_us.wrapping_sub(since_trigger_us);
    let under_way = (since_trigger_us < scan_us) as u32;
    newest.wrapping_sub((scans_since + under_way).wrapping_mul(TRIGGER_US))
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware_shared::pacing::{PERIOD_US, Pacer};

    #[test]
    fn an_interrupt_held_off_is_stamped_with_its_own_trigger() {
        // Scans end 76 us after triggers at multiples of 250 us, blocks at multiples of 1 000 us; the counters wrap in between. Whenever
        // the block of 7 000 is read before the next one ends, its stamp is 7 000.
        const SCAN_US: u32 = 76;
        let base = u32::MAX - 7_500;
        for held_off in SCAN_US..PERIOD_US + SCAN_US {
            let since_trigger = held_off % TRIGGER_US;
            let ended = (held_off - SCAN_US) / TRIGGER_US;
            let stamp = trigger_us(base.wrapping_add(7_000 + held_off), since_trigger, ended, SCAN_US);
            assert_eq!(stamp, base.wrapping_add(7_000), "held off until {held_off} us after the trigger");
        }
        // Read at 8 010, ten microseconds after the next trigger, it is a tick, and so is the one that follows.
        let mut pacer = Pacer::default();
        assert_eq!(pacer.elapsed(trigger_us(6_076, 76, 0, SCAN_US)), 1);
        assert_eq!(pacer.elapsed(trigger_us(8_010, 10, 3, SCAN_US)), 1);
        assert_eq!(pacer.elapsed(trigger_us(8_076, 76, 0, SCAN_US)), 1);
    }
}
