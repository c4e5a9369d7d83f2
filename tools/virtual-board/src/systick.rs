//! SysTick timer: a 24-bit down-counter on HCLK or HCLK/8, computed at each access instead of stepped every cycle.

/// CSR.ENABLE.
const ENABLE: u32 = 1;
/// CSR.TICKINT.
const TICKINT: u32 = 1 << 1;
/// CSR.CLKSOURCE: the core clock; otherwise HCLK/8 on the STM32F4.
const CLKSOURCE: u32 = 1 << 2;
/// CSR.COUNTFLAG.
const COUNTFLAG: u32 = 1 << 16;
const MASK: u32 = 0x00FF_FFFF;

/// SysTick with its three registers. The argument `cycle` is the HCLK cycle of the access.
#[derive(Debug, Clone, Default)]
pub(crate) struct SysTick {
    control: u32,
    reload: u32,
    /// Counter value at `base`.
    value: u32,
    /// HCLK cycle of the counter clock edge to which `value` belongs.
    base: u64,
    count_flag: bool,
}

impl SysTick {
    const fn divider(&self) -> u64 {
        if self.control & CLKSOURCE != 0 { 1 } else { 8 }
    }

    const fn running(&self) -> bool {
        self.control & ENABLE != 0
    }

    /// Counter clocks from `base` until the counter next becomes 0; `None`: it stays at 0.
    fn ticks_to_zero(&self) -> Option<u64> {
        match (self.value, self.reload) {
            (0, 0) => None,
            (0, reload) => Some(u64::from(reload) + 1),
            (value, _) => Some(u64::from(value)),
        }
    }

    /// Advances the counter to `cycle`; returns true if it reached 0 with TICKINT set, so that the exception becomes pending.
    pub(crate) fn advance(&mut self, cycle: u64) -> bool {
        if !self.running() || cycle <= self.base {
            return false;
        }
        let ticks = (cycle - self.base) / self.divider();
        if ticks == 0 {
            return false;
        }
        self.base += ticks * self.divider();
        let Some(first) = self.ticks_to_zero() else { return false };
        if ticks < first {
            // A counter at 0 reloads at its next clock.
            self.value = if self.value == 0 { self.reload + 1 } else { self.value } - ticks as u32;
            return false;
        }
        let beyond = (ticks - first) % (u64::from(self.reload) + 1);
        self.value = if beyond == 0 { 0 } else { self.reload + 1 - beyond as u32 };
        self.count_flag = true;
        self.control & TICKINT != 0
    }

    /// Cycle at which the exception next becomes pending; `None`: never.
    #[must_use]
    pub(crate) fn next_event(&self) -> Option<u64> {
        if !self.running() || self.control & TICKINT == 0 {
            return None;
        }
        self.ticks_to_zero().map(|ticks| self.base + ticks * self.divider())
    }

    /// Reads CSR; clears COUNTFLAG.
    pub(crate) fn read_control(&mut self, cycle: u64) -> u32 {
        let _ = self.advance(cycle);
        self.control | if std::mem::take(&mut self.count_flag) { COUNTFLAG } else { 0 }
    }

    /// Writes CSR.
    pub(crate) fn write_control(&mut self, cycle: u64, value: u32) {
        let _ = self.advance(cycle);
        if value & ENABLE != 0 && !self.running() {
            self.base = cycle;
        }
        self.control = value & (ENABLE | TICKINT | CLKSOURCE);
    }

    /// Reads RVR.
    #[must_use]
    pub(crate) const fn reload(&self) -> u32 {
        self.reload
    }

    /// Writes RVR: used when the counter next reloads.
    pub(crate) fn write_reload(&mut self, cycle: u64, value: u32) {
        let _ = self.advance(cycle);
        self.reload = value & MASK;
    }

    /// Reads CVR.
    pub(crate) fn read_value(&mut self, cycle: u64) -> u32 {
        let _ = self.advance(cycle);
        self.value
    }

    /// Writes CVR: any value clears the counter and COUNTFLAG, without an exception.
    pub(crate) fn write_value(&mut self, cycle: u64) {
        let _ = self.advance(cycle);
        self.value = 0;
        self.base = cycle;
        self.count_flag = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn started(reload: u32, control: u32) -> SysTick {
        let mut tick = SysTick::default();
        tick.write_reload(0, reload);
        tick.write_value(0);
        tick.write_control(0, control | ENABLE);
        tick
    }

    /// Compares the closed form with a counter that is stepped clock by clock as in the manual.
    #[test]
    fn equals_a_counter_stepped_clock_by_clock() {
        for (reload, divider) in [(1u32, 1u64), (2, 1), (9, 8), (100, 1)] {
            let control = TICKINT | if divider == 1 { CLKSOURCE } else { 0 };
            let mut tick = started(reload, control);
            let (mut value, mut fired_at) = (0u32, Vec::new());
            let mut fired = Vec::new();
            for cycle in 1..=2_000u64 {
                if cycle % divider == 0 {
                    let next = if value == 0 { reload } else { value - 1 };
                    if value == 1 {
                        fired_at.push(cycle);
                    }
                    value = next;
                }
                // Accessed at irregular times.
                if cycle % 7 == 3 {
                    let due = tick.next_event();
                    if tick.advance(cycle) {
                        fired.push(due.expect("next_event returned a cycle"));
                    }
                    assert_eq!(tick.value, value, "reload {reload} at {cycle}");
                }
            }
            assert!(!fired.is_empty());
            assert!(fired.iter().all(|at| fired_at.contains(at)), "reload {reload}: {fired:?} against {fired_at:?}");
        }
    }

    #[test]
    fn next_event_is_the_exact_cycle_of_every_event() {
        let mut tick = started(999, TICKINT | CLKSOURCE);
        for n in 1..=5 {
            let due = tick.next_event().unwrap();
            assert_eq!(due, n * 1_000, "a reload of 999 counts 1000 clocks");
            assert!(!tick.advance(due - 1));
            assert!(tick.advance(due));
        }
    }

    #[test]
    fn count_flag_is_read_once_and_cleared_by_a_write() {
        let mut tick = started(9, CLKSOURCE);
        assert_eq!(tick.next_event(), None, "no exception without TICKINT");
        assert_eq!(tick.read_control(9) & COUNTFLAG, 0);
        assert_ne!(tick.read_control(10) & COUNTFLAG, 0);
        assert_eq!(tick.read_control(11) & COUNTFLAG, 0);
        let _ = tick.read_value(25);
        tick.write_value(25);
        assert_eq!(tick.read_control(25) & COUNTFLAG, 0);
    }

    #[test]
    fn a_reload_of_zero_stops_it() {
        let mut tick = started(0, TICKINT | CLKSOURCE);
        assert_eq!(tick.next_event(), None);
        assert!(!tick.advance(1_000_000));
        assert_eq!(tick.read_value(1_000_000), 0);
    }
}
