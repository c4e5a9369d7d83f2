//! Table of the 14 timers: width, channels, interrupts (RM0090 chapters 17 to 20, 12.1.3) and pins (data sheet table 9).

use crate::chip::Chip;

/// Interrupt numbers of a timer. Timers other than TIM1 and TIM8 use one number for all.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Irqs {
    pub(crate) update: u8,
    pub(crate) compare: u8,
    pub(crate) trigger: u8,
    pub(crate) brk: u8,
}

/// A clock that a channel can capture instead of its pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Measures {
    /// The channel, counted from 0.
    pub(crate) channel: usize,
    /// Value of the option register that connects the clock.
    pub(crate) option: u32,
}

/// Features of one timer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimerFeatures {
    /// 1 to 14.
    pub(crate) number: u8,
    /// Largest count: 0xFFFF or 0xFFFF_FFFF.
    pub(crate) top: u32,
    pub(crate) channels: u8,
    /// TIM1 and TIM8: complementary outputs, break, repetition counter.
    pub(crate) advanced: bool,
    /// Has a slave mode register.
    pub(crate) slave: bool,
    /// 0: APB1, 1: APB2.
    pub(crate) apb: usize,
    pub(crate) irqs: Irqs,
    pub(crate) measures: Option<Measures>,
}

const fn basic(number: u8, top: u32, channels: u8, slave: bool, apb: usize, irq: u8) -> TimerFeatures {
    let irqs = Irqs { update: irq, compare: irq, trigger: irq, brk: irq };
    TimerFeatures { number, top, channels, advanced: false, slave, apb, irqs, measures: None }
}

const fn advanced(number: u8, irqs: Irqs) -> TimerFeatures {
    TimerFeatures { number, top: 0xFFFF, channels: 4, advanced: true, slave: true, apb: 1, irqs, measures: None }
}

const fn measuring(timer: TimerFeatures, channel: usize, option: u32) -> TimerFeatures {
    TimerFeatures { measures: Some(Measures { channel, option }), ..timer }
}

/// The timers by number, 1 to 14; index 0 stays unused.
pub(crate) static TIMERS: [TimerFeatures; 15] = [
    basic(0, 0, 0, false, 0, 0),
    advanced(1, Irqs { update: 25, compare: 27, trigger: 26, brk: 24 }),
    basic(2, u32::MAX, 4, true, 0, 28),
    basic(3, 0xFFFF, 4, true, 0, 29),
    basic(4, 0xFFFF, 4, true, 0, 30),
    // TI4_RMP (18.4.20): LSI.
    measuring(basic(5, u32::MAX, 4, true, 0, 50), 3, 1 << 6),
    basic(6, 0xFFFF, 0, false, 0, 54),
    basic(7, 0xFFFF, 0, false, 0, 55),
    advanced(8, Irqs { update: 44, compare: 46, trigger: 45, brk: 43 }),
    basic(9, 0xFFFF, 2, true, 1, 24),
    basic(10, 0xFFFF, 1, false, 1, 25),
    // TI1_RMP (19.5.12): HSE_RTC.
    measuring(basic(11, 0xFFFF, 1, false, 1, 26), 0, 2),
    basic(12, 0xFFFF, 2, true, 0, 43),
    basic(13, 0xFFFF, 1, false, 0, 44),
    basic(14, 0xFFFF, 1, false, 0, 45),
];

impl TimerFeatures {
    /// True where the register at an offset exists in this timer.
    pub(crate) fn has(&self, offset: u32) -> bool {
        match offset {
            0x00 | 0x0C | 0x10 | 0x14 | 0x24 | 0x28 | 0x2C => true,
            0x04 => self.channels != 1,
            0x08 => self.slave,
            0x18 | 0x20 | 0x34 => self.channels >= 1,
            0x38 => self.channels >= 2,
            0x1C | 0x3C | 0x40 => self.channels == 4,
            0x30 | 0x44 => self.advanced,
            0x50 => matches!(self.number, 2 | 5 | 11),
            _ => false,
        }
    }
}

/// Signal of a timer at a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PinSignal {
    /// OCx, channel 0 to 3.
    Main(u8),
    /// OCxN, channel 0 to 2.
    Complementary(u8),
    /// BKIN.
    Break,
}

/// Port letter, pin number, alternate function, timer, signal.
type Route = (char, u8, u8, u8, PinSignal);

const CH1: PinSignal = PinSignal::Main(0);
const CH2: PinSignal = PinSignal::Main(1);
const CH3: PinSignal = PinSignal::Main(2);
const CH4: PinSignal = PinSignal::Main(3);
const CH1N: PinSignal = PinSignal::Complementary(0);
const CH2N: PinSignal = PinSignal::Complementary(1);
const CH3N: PinSignal = PinSignal::Complementary(2);
const BKIN: PinSignal = PinSignal::Break;

#[rustfmt::skip]
static ROUTES: [Route; 68] = [
    ('A', 8, 1, 1, CH1), ('A', 9, 1, 1, CH2), ('A', 10, 1, 1, CH3), ('A', 11, 1, 1, CH4),
    ('E', 9, 1, 1, CH1), ('E', 11, 1, 1, CH2), ('E', 13, 1, 1, CH3), ('E', 14, 1, 1, CH4),
    ('A', 7, 1, 1, CH1N), ('B', 0, 1, 1, CH2N), ('B', 1, 1, 1, CH3N),
    ('B', 13, 1, 1, CH1N), ('B', 14, 1, 1, CH2N), ('B', 15, 1, 1, CH3N),
    ('E', 8, 1, 1, CH1N), ('E', 10, 1, 1, CH2N), ('E', 12, 1, 1, CH3N),
    ('A', 6, 1, 1, BKIN), ('B', 12, 1, 1, BKIN), ('E', 15, 1, 1, BKIN),
    ('A', 0, 1, 2, CH1), ('A', 5, 1, 2, CH1), ('A', 15, 1, 2, CH1), ('A', 1, 1, 2, CH2), ('B', 3, 1, 2, CH2),
    ('A', 2, 1, 2, CH3), ('B', 10, 1, 2, CH3), ('A', 3, 1, 2, CH4), ('B', 11, 1, 2, CH4),
    ('A', 6, 2, 3, CH1), ('B', 4, 2, 3, CH1), ('C', 6, 2, 3, CH1), ('A', 7, 2, 3, CH2), ('B', 5, 2, 3, CH2),
    ('C', 7, 2, 3, CH2), ('B', 0, 2, 3, CH3), ('C', 8, 2, 3, CH3), ('B', 1, 2, 3, CH4), ('C', 9, 2, 3, CH4),
    ('B', 6, 2, 4, CH1), ('D', 12, 2, 4, CH1), ('B', 7, 2, 4, CH2), ('D', 13, 2, 4, CH2),
    ('B', 8, 2, 4, CH3), ('D', 14, 2, 4, CH3), ('B', 9, 2, 4, CH4), ('D', 15, 2, 4, CH4),
    ('A', 0, 2, 5, CH1), ('A', 1, 2, 5, CH2), ('A', 2, 2, 5, CH3), ('A', 3, 2, 5, CH4),
    ('C', 6, 3, 8, CH1), ('C', 7, 3, 8, CH2), ('C', 8, 3, 8, CH3), ('C', 9, 3, 8, CH4),
    ('A', 5, 3, 8, CH1N), ('A', 7, 3, 8, CH1N), ('B', 0, 3, 8, CH2N), ('B', 14, 3, 8, CH2N),
    ('B', 1, 3, 8, CH3N), ('B', 15, 3, 8, CH3N), ('A', 6, 3, 8, BKIN),
    ('A', 2, 3, 9, CH1), ('E', 5, 3, 9, CH1), ('A', 3, 3, 9, CH2), ('E', 6, 3, 9, CH2),
    ('B', 8, 3, 10, CH1), ('B', 9, 3, 11, CH1),
];

/// TIM12 to TIM14 share alternate function 9.
static ROUTES_AF9: [Route; 4] =
    [('B', 14, 9, 12, CH1), ('B', 15, 9, 12, CH2), ('A', 6, 9, 13, CH1), ('A', 7, 9, 14, CH1)];

/// Timer number and signal of an alternate function of a pin; `None`: the function belongs to no timer of the chip. The F411 has the timers 1 to 5 and 9
/// to 11 (RM0383 chapters 12 to 14), at the same pins and functions (its data sheet, "Alternate function mapping").
pub(crate) fn route(chip: Chip, port: char, number: u8, af: u8) -> Option<(usize, PinSignal)> {
    ROUTES
        .iter()
        .chain(&ROUTES_AF9)
        .find(|&&(p, n, a, timer, _)| (p, n, a) == (port, number, af) && exists(chip, timer))
        .map(|&(_, _, _, timer, signal)| (usize::from(timer), signal))
}

fn exists(chip: Chip, timer: u8) -> bool {
    chip == Chip::F407 || matches!(timer, 1..=5 | 9..=11)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn servo_and_break_pins() {
        // Data sheet of the F407, table 9: TIM1 on AF1.
        for (number, channel) in [(8, CH1), (9, CH2), (10, CH3), (11, CH4)] {
            assert_eq!(route(Chip::F407, 'A', number, 1), Some((1, channel)));
        }
        assert_eq!(route(Chip::F407, 'B', 12, 1), Some((1, BKIN)));
        assert_eq!(route(Chip::F407, 'A', 6, 1), Some((1, BKIN)));
        assert_eq!(route(Chip::F407, 'A', 8, 2), None);
    }

    #[test]
    fn no_pin_function_is_listed_twice() {
        let mut seen: Vec<_> = ROUTES.iter().chain(&ROUTES_AF9).map(|&(p, n, a, ..)| (p, n, a)).collect();
        seen.sort_unstable();
        let count = seen.len();
        seen.dedup();
        assert_eq!(seen.len(), count);
    }

    #[test]
    fn registers_by_timer() {
        // RM0090 17.4.21, 18.4.21, 19.4.13, 20.4.9, 19.5.12: register maps.
        assert!(TIMERS[1].has(0x44) && TIMERS[1].has(0x30) && !TIMERS[1].has(0x50));
        assert!(!TIMERS[2].has(0x44) && TIMERS[2].has(0x50) && TIMERS[2].has(0x40));
        assert!(!TIMERS[6].has(0x18) && TIMERS[6].has(0x04) && !TIMERS[6].has(0x08));
        assert!(TIMERS[9].has(0x38) && !TIMERS[9].has(0x3C) && TIMERS[9].has(0x08));
        assert!(!TIMERS[14].has(0x38) && TIMERS[14].has(0x34) && !TIMERS[14].has(0x04));
    }
}
