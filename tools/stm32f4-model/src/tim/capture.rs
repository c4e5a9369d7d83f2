//! Input capture of a clock that a timer measures: LSI by channel 4 of TIM5 (RM0090 18.3.5, 18.4.20), HSE_RTC by channel 1 of TIM11 (19.3.5,
//! 19.5.12). No other capture is modelled.

use super::Timer;

/// CC1IF in SR, and CC1OF; those of the other channels follow.
const CC1IF: u32 = 1 << 1;
const CC1OF: u32 = 1 << 9;
/// CCxE, CCxP and CCxNP in CCER, of channel 1; four bits a channel.
const POLARITY: u32 = 0xB;
const ON: u32 = 0x1;
/// CCxS in CCMR, of the first channel of a register; eight bits a channel. The channel is an input, and its input is its own.
const SELECTION: u32 = 0x03;
const OWN_INPUT: u32 = 0x01;
/// ICxF in CCMR: the input filter.
const FILTER: u32 = 0xF0;
/// CCS of both channels of a register.
const SELECTIONS: u32 = 0x0303;

impl Timer {
    /// Rising edges of the measured clock from one capture to the next, 1 to 8 (ICxPSC); `None`: it captures none.
    pub(crate) fn captured_edges(&self) -> Option<u32> {
        let measures = self.features.measures?;
        let mode = self.ccmr[measures.channel / 2] >> (measures.channel % 2 * 8);
        let captures = self.counter.running()
            && self.option == measures.option
            && mode & SELECTION == OWN_INPUT
            && self.ccer >> (measures.channel * 4) & POLARITY == ON;
        captures.then(|| 1 << (mode >> 2 & 3))
    }

    /// Captures the counter. A capture that has not been read is lost, which CCxOF shows.
    pub(crate) fn capture(&mut self) {
        let Some(measures) = self.features.measures else { return };
        let flag = CC1IF << measures.channel;
        if self.sr & flag != 0 {
            self.sr |= CC1OF << measures.channel;
        }
        self.sr |= flag;
        self.counter.ccr[measures.channel].written = self.counter.cnt;
    }

    /// Effect of a read: that of a captured count clears its flag (18.4.5). True if there was one.
    pub(crate) fn after_read(&mut self, offset: u32) -> bool {
        const CCR1: u32 = 0x34;
        let Some(measures) = self.features.measures else { return false };
        let flag = CC1IF << measures.channel;
        let is_count = offset == CCR1 + 4 * measures.channel as u32;
        let clears = is_count && self.is_input(measures.channel) && self.sr & flag != 0;
        if clears {
            self.sr &= !flag;
        }
        clears
    }

    /// Whether a value of CCMR selects an input capture that is modelled, or none.
    pub(super) fn capture_is_modelled(&self, which: usize, value: u32) -> bool {
        value & SELECTIONS == 0
            || self.features.measures.is_some_and(|measures| {
                let shift = measures.channel % 2 * 8;
                measures.channel / 2 == which
                    && value & SELECTIONS == OWN_INPUT << shift
                    && value & FILTER << shift == 0
            })
    }

    /// Whether a value of the option register is modelled.
    pub(super) fn option_is_modelled(&self, value: u32) -> bool {
        value == 0 || self.features.measures.is_some_and(|measures| value == measures.option)
    }
}
