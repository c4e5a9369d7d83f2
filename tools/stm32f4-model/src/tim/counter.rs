//! The counter of a timer: prescaler, auto-reload, repetition counter and their preload registers (RM0090 17.3.1 to 17.3.3).
//!
//! The counter is not stepped clock by clock: it keeps its state at a reference cycle and computes the next overflow or compare match.
//!
//! ```text
//! one count    (PSC + 1) timer clocks
//! one period   (ARR + 1) counts
//! one update   (RCR + 1) periods
//! ```

/// A preload register with its shadow register.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Preloaded {
    /// Value that the program wrote and reads back.
    pub(crate) written: u32,
    /// Value in the shadow register, which the counter uses.
    pub(crate) active: u32,
}

impl Preloaded {
    /// Loads the shadow register, as an update event does.
    pub(crate) fn transfer(&mut self) {
        self.active = self.written;
    }
}

/// The next overflow or compare match and the number of counts until then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CounterEvent {
    pub(crate) counts: u64,
    /// The counter wraps to 0 (it may match there too).
    pub(crate) overflow: bool,
    /// Channels whose compare value the counter reaches, one bit each; 0 if it wraps.
    pub(crate) matches: u8,
}

/// State of the counter at a reference cycle.
#[derive(Debug, Clone)]
pub(crate) struct Counter {
    /// Largest count the width allows.
    top: u32,
    pub(crate) cnt: u32,
    pub(crate) psc: Preloaded,
    pub(crate) arr: Preloaded,
    pub(crate) rcr: Preloaded,
    /// Overflows that remain before the one that makes an update.
    pub(crate) repetitions: u32,
    pub(crate) ccr: [Preloaded; 4],
    /// CEN.
    pub(crate) enabled: bool,
    /// HCLK cycles per timer clock; `None`: no clock.
    clock: Option<u64>,
    /// Reference cycle (HCLK) of `cnt` and `phase`.
    at: u64,
    /// Timer clocks since the last count.
    phase: u64,
}

impl Counter {
    pub(crate) fn new(top: u32, at: u64) -> Self {
        let top_only = Preloaded { written: top, active: top };
        Counter {
            top,
            cnt: 0,
            psc: Preloaded::default(),
            arr: top_only,
            rcr: Preloaded::default(),
            repetitions: 0,
            ccr: [Preloaded::default(); 4],
            enabled: false,
            clock: None,
            at,
            phase: 0,
        }
    }

    pub(crate) fn top(&self) -> u32 {
        self.top
    }

    /// True while the counter counts. An auto-reload value of 0 blocks it (17.4.12).
    pub(crate) fn running(&self) -> bool {
        self.enabled && self.clock.is_some() && self.arr.active != 0
    }

    /// Sets the timer clock from now on; the caller must first advance the counter to the present cycle.
    pub(crate) fn set_clock(&mut self, clock: Option<u64>) {
        self.clock = clock;
    }

    /// Sets the reference cycle without counting: while the counter is stopped, and when it starts.
    pub(crate) fn set_reference_cycle(&mut self, cycle: u64) {
        self.at = cycle;
    }

    /// Clears counter and prescaler, as UG does.
    pub(crate) fn restart(&mut self, cycle: u64) {
        self.cnt = 0;
        self.phase = 0;
        self.at = cycle;
    }

    fn clocks_per_count(&self) -> u64 {
        u64::from(self.psc.active) + 1
    }

    /// Counts in a whole period.
    pub(crate) fn period(&self) -> u64 {
        u64::from(self.arr.active) + 1
    }

    /// Whole counts from the reference cycle to a cycle. The counter must be running.
    pub(crate) fn counts_until(&self, cycle: u64) -> u64 {
        let clock = self.clock.unwrap_or(u64::MAX);
        (self.phase + cycle.saturating_sub(self.at) / clock) / self.clocks_per_count()
    }

    /// Cycle at which a number of counts, at least 1, is complete.
    pub(crate) fn cycle_after(&self, counts: u64) -> u64 {
        let clocks = u128::from(counts) * u128::from(self.clocks_per_count()) - u128::from(self.phase);
        let cycles = clocks * u128::from(self.clock.unwrap_or(u64::MAX));
        u64::try_from(u128::from(self.at) + cycles).unwrap_or(u64::MAX)
    }

    /// Counts until the overflow. Above ARR the counter continues to its full width, because only equality ends a period.
    pub(crate) fn counts_to_overflow(&self) -> u64 {
        let last = if self.cnt <= self.arr.active { self.arr.active } else { self.top };
        u64::from(last - self.cnt) + 1
    }

    /// The next overflow or compare match of one of the `channels`.
    pub(crate) fn next(&self, channels: u8) -> CounterEvent {
        let mut next = CounterEvent { counts: self.counts_to_overflow(), overflow: true, matches: 0 };
        for (channel, ccr) in self.ccr.iter().enumerate() {
            if channels >> channel & 1 == 0 || ccr.active <= self.cnt {
                continue;
            }
            let counts = u64::from(ccr.active - self.cnt);
            if counts < next.counts {
                next = CounterEvent { counts, overflow: false, matches: 1 << channel };
            } else if counts == next.counts && !next.overflow {
                next.matches |= 1 << channel;
            }
        }
        next
    }

    /// Advances by `counts`, which must not pass the next overflow. The reference cycle is then that of the last count.
    pub(crate) fn step(&mut self, counts: u64) {
        self.at = self.cycle_after(counts);
        self.phase = 0;
        self.cnt = if counts >= self.counts_to_overflow() { 0 } else { self.cnt + counts as u32 };
    }

    /// Advances the reference cycle by `counts`, which must be a whole number of periods.
    pub(crate) fn skip(&mut self, counts: u64) {
        self.at = self.cycle_after(counts);
        self.phase = 0;
    }

    /// Advances to a cycle before the next event.
    pub(crate) fn step_to(&mut self, cycle: u64) {
        let counts = self.counts_until(cycle);
        if counts > 0 {
            self.step(counts);
        }
        if let Some(clock) = self.clock {
            let clocks = cycle.saturating_sub(self.at) / clock;
            self.phase += clocks;
            self.at += clocks * clock;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counter(psc: u32, arr: u32) -> Counter {
        let mut counter = Counter::new(0xFFFF, 1000);
        counter.psc = Preloaded { written: psc, active: psc };
        counter.arr = Preloaded { written: arr, active: arr };
        counter.set_clock(Some(2));
        counter.enabled = true;
        counter
    }

    #[test]
    fn a_period_is_psc_plus_one_times_arr_plus_one_clocks() {
        // RM0090 17.3.2 and figure 94: the counter counts from 0 to ARR and starts again.
        let counter = counter(83, 999);
        let next = counter.next(0);
        assert_eq!((next.counts, next.overflow), (1000, true));
        assert_eq!(counter.cycle_after(next.counts), 1000 + 84 * 1000 * 2);
    }

    #[test]
    fn steps_to_any_cycle_lose_nothing() {
        for steps in [1, 3, 7, 100, 333] {
            let mut counter = counter(4, 60_000);
            let mut cycle = 1000;
            while cycle < 500_000 {
                cycle += steps;
                counter.step_to(cycle);
                assert_eq!(u64::from(counter.cnt), (cycle - 1000) / 10);
            }
        }
    }

    #[test]
    fn matches_come_in_order_and_together() {
        let mut counter = counter(0, 99);
        for (channel, value) in [10, 40, 40, 100].into_iter().enumerate() {
            counter.ccr[channel].active = value;
        }
        assert_eq!(counter.next(0xF), CounterEvent { counts: 10, overflow: false, matches: 1 });
        counter.step(10);
        assert_eq!(counter.next(0xF), CounterEvent { counts: 30, overflow: false, matches: 6 });
        assert_eq!(counter.next(0b0010), CounterEvent { counts: 30, overflow: false, matches: 2 });
        counter.step(30);
        assert_eq!(counter.next(0xF), CounterEvent { counts: 60, overflow: true, matches: 0 });
        counter.step(60);
        assert_eq!(counter.cnt, 0);
    }

    #[test]
    fn above_the_auto_reload_value_the_counter_runs_to_its_width() {
        // RM0090 17.3.2: without preload a smaller ARR acts at once; only equality ends a period.
        let mut counter = counter(0, 99);
        counter.step_to(1000 + 2 * 80);
        counter.arr.active = 50;
        assert_eq!(counter.counts_to_overflow(), 0x1_0000 - 80);
    }

    #[test]
    fn an_auto_reload_value_of_zero_blocks() {
        assert!(!counter(0, 0).running());
    }
}
