//! Input capture of LSI by channel 4 of TIM5 (RM0090 18.3.5, 18.4.20): the one capture that is modelled.

use super::Timer;

/// The channel, counted from 0.
const CHANNEL: usize = 3;
/// TI4_RMP in TIM5_OR: channel 4 is connected to LSI.
const LSI: u32 = 1 << 6;
/// CC4IF in SR; CC4OF is 8 bits above it.
const CC4IF: u32 = 1 << (CHANNEL + 1);
/// CC4E, CC4P and CC4NP in CCER: on, rising edges.
const POLARITY: u32 = 0xB000;
const ON: u32 = 0x1000;
/// CC4S in CCMR2: the channel is an input, and its input is its own.
const SELECTION: u32 = 0x0300;
const OWN_INPUT: u32 = 0x0100;
/// IC4F in CCMR2: the input filter.
const FILTER: u32 = 0xF000;

impl Timer {
    /// Rising edges of LSI from one capture to the next, 1 to 8 (IC4PSC); `None`: it does not capture LSI.
    pub(crate) fn captured_edges(&self) -> Option<u32> {
        let captures = self.features.captures_lsi()
            && self.counter.running()
            && self.option == LSI
            && self.ccmr[1] & SELECTION == OWN_INPUT
            && self.ccer & POLARITY == ON;
        captures.then(|| 1 << (self.ccmr[1] >> 10 & 3))
    }

    /// Captures the counter. A capture that has not been read is lost, which CC4OF shows.
    pub(crate) fn capture(&mut self) {
        if self.sr & CC4IF != 0 {
            self.sr |= CC4IF << 8;
        }
        self.sr |= CC4IF;
        self.counter.ccr[CHANNEL].written = self.counter.cnt;
    }

    /// Effect of a read: that of a captured count clears its flag (18.4.5). True if there was one.
    pub(crate) fn after_read(&mut self, offset: u32) -> bool {
        const CCR4: u32 = 0x40;
        let clears = offset == CCR4 && self.is_input(CHANNEL) && self.sr & CC4IF != 0;
        if clears {
            self.sr &= !CC4IF;
        }
        clears
    }

    /// Whether a value of CCMR selects an input capture that is modelled, or none.
    pub(super) fn capture_is_modelled(&self, which: usize, value: u32) -> bool {
        value & 0x0303 == 0
            || self.features.captures_lsi() && which == 1 && value & 0x0303 == OWN_INPUT && value & FILTER == 0
    }

    /// Whether a value of the option register is modelled.
    pub(super) fn option_is_modelled(&self, value: u32) -> bool {
        value == 0 || self.features.captures_lsi() && value == LSI
    }
}
