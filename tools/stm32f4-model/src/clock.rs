//! Clock tree frequencies (RM0090 7.2 "Clocks"), and conversion between HCLK cycles and seconds across clock changes.
//!
//! ```text
//! HSI 16 MHz --+----------------------------------+
//! HSE ---------+-> / M -> VCO x N -> / P -> PLL --+-> SYSCLK -> / HPRE -> HCLK -> / PPREx -> PCLKx
//!                  1..2 MHz  100..432 MHz                                          timers: PCLKx if PPREx = 1, else 2 PCLKx
//! ```

/// Frequency of the internal high speed oscillator, Hz.
pub(crate) const HSI_HZ: u32 = 16_000_000;

/// HCLK frequency and bus dividers that result from the RCC registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClockTree {
    /// AHB clock, Hz; not always a whole number with the PLL.
    pub(crate) hclk: f64,
    /// HCLK cycles per PCLK cycle, APB1 and APB2.
    pub(crate) apb: [u64; 2],
}

impl ClockTree {
    /// HCLK cycles per timer clock on a bus: the timers run at PCLK where the APB prescaler is 1, at twice PCLK otherwise (7.2, figure 16).
    pub(crate) fn timer(&self, bus: usize) -> u64 {
        match self.apb[bus] {
            1 => 1,
            divider => divider / 2,
        }
    }
}

/// AHB prescaler by the HPRE field of RCC_CFGR.
pub(crate) fn ahb_divider(hpre: u32) -> u64 {
    match hpre & 0xF {
        8 => 2,
        9 => 4,
        10 => 8,
        11 => 16,
        12 => 64,
        13 => 128,
        14 => 256,
        15 => 512,
        _ => 1,
    }
}

/// APB prescaler by a PPRE field of RCC_CFGR.
pub(crate) fn apb_divider(ppre: u32) -> u64 {
    match ppre & 7 {
        4 => 2,
        5 => 4,
        6 => 8,
        7 => 16,
        _ => 1,
    }
}

/// An interval of constant HCLK frequency: its first cycle, start time and frequency.
#[derive(Debug, Clone, Copy)]
struct ClockInterval {
    cycle: u64,
    seconds: f64,
    hz: f64,
}

/// Maps HCLK cycles since power-on to seconds and back.
#[derive(Debug)]
pub(crate) struct Timebase {
    /// In the order of time; the first begins at cycle 0.
    intervals: Vec<ClockInterval>,
}

impl Timebase {
    pub(crate) fn new(hz: f64) -> Self {
        Timebase { intervals: vec![ClockInterval { cycle: 0, seconds: 0.0, hz }] }
    }

    /// Sets the HCLK frequency from `cycle` on. `cycle` must not lie before the last change.
    pub(crate) fn change(&mut self, cycle: u64, hz: f64) {
        let last = self.last();
        if last.hz == hz {
            return;
        }
        let seconds = self.seconds(cycle);
        if last.cycle == cycle {
            self.intervals.pop();
        }
        self.intervals.push(ClockInterval { cycle, seconds, hz });
    }

    fn last(&self) -> ClockInterval {
        self.intervals[self.intervals.len() - 1]
    }

    /// Seconds since power-on at a cycle.
    pub(crate) fn seconds(&self, cycle: u64) -> f64 {
        let interval =
            self.intervals.iter().rev().find(|interval| interval.cycle <= cycle).unwrap_or(&self.intervals[0]);
        interval.seconds + (cycle - interval.cycle) as f64 / interval.hz
    }

    /// The first cycle of the present interval that is not before a time.
    pub(crate) fn cycle_at(&self, seconds: f64) -> u64 {
        let last = self.last();
        // 1e-3 cycles of tolerance: rounding in `seconds` must not move a whole number of cycles up by one.
        let cycles = ((seconds - last.seconds) * last.hz - 1e-3).ceil();
        // `as` saturates: infinity becomes `u64::MAX`.
        if cycles > 0.0 { last.cycle.saturating_add(cycles as u64) } else { last.cycle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timer_clock_is_twice_the_apb_clock_unless_undivided() {
        // RM0090 7.2: the Discovery's usual 168 MHz with APB1 / 4 and APB2 / 2 gives timers 84 and 168 MHz.
        let clocks = ClockTree { hclk: 168e6, apb: [4, 2] };
        assert_eq!((clocks.timer(0), clocks.timer(1)), (2, 1));
        assert_eq!(ClockTree { hclk: 16e6, apb: [1, 16] }.timer(0), 1);
        assert_eq!(ClockTree { hclk: 16e6, apb: [1, 16] }.timer(1), 8);
    }

    #[test]
    fn prescaler_fields() {
        // RM0090 7.3.3: HPRE skips 32.
        let ahb: Vec<u64> = (0..16).map(ahb_divider).collect();
        assert_eq!(ahb, [1, 1, 1, 1, 1, 1, 1, 1, 2, 4, 8, 16, 64, 128, 256, 512]);
        let apb: Vec<u64> = (0..8).map(apb_divider).collect();
        assert_eq!(apb, [1, 1, 1, 1, 2, 4, 8, 16]);
    }

    #[test]
    fn seconds_continue_across_a_clock_change() {
        let mut time = Timebase::new(16e6);
        time.change(16_000, 168e6);
        assert_eq!(time.seconds(8_000), 0.0005);
        assert_eq!(time.seconds(16_000), 0.001);
        assert!((time.seconds(16_000 + 168_000) - 0.002).abs() < 1e-15);
        assert_eq!(time.cycle_at(0.002), 16_000 + 168_000);
        assert_eq!(time.cycle_at(0.0), 16_000);
        assert_eq!(time.cycle_at(f64::INFINITY), u64::MAX);
    }

    #[test]
    fn cycle_to_seconds_and_back_is_exact() {
        let mut time = Timebase::new(16e6);
        time.change(12_345, 168e6);
        for cycle in (12_345..1 << 44).step_by((1 << 44) / 1009) {
            assert_eq!(time.cycle_at(time.seconds(cycle)), cycle);
        }
    }
}
