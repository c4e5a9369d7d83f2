//! IWDG: the independent watchdog (RM0090 chapter 21). It runs on LSI, and only a reset stops it.
//!
//! ```text
//! timeout = (RLR + 1) * 4 * 2^PR / LSI      PR 0..=6 (7 is 6 again), RLR 0..=4095
//! ```
//! Its times are kept in periods of LSI, so that a change of the core clock does not affect them, and one of LSI does.

use crate::lint::LintKind;

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;

/// LSI periods that an update of PR or RLR takes (21.4.4).
const UPDATE_PERIODS: f64 = 5.0;

/// IWDG registers and timeout.
#[derive(Debug, Clone)]
pub(crate) struct Iwdg {
    unlocked: bool,
    /// Registers change without the key: a disturbance.
    is_unprotected: bool,
    pr: u32,
    rlr: u32,
    /// LSI periods until which PVU and RVU are set.
    updating: [f64; 2],
    /// LSI periods at which it was frozen; `None`: it is not.
    frozen: Option<f64>,
    /// LSI periods at the timeout; `None`: not started.
    pub(crate) deadline: Option<f64>,
}

impl Iwdg {
    pub(crate) fn new() -> Self {
        Iwdg {
            unlocked: false,
            is_unprotected: false,
            pr: 0,
            rlr: 0xFFF,
            updating: [0.0; 2],
            frozen: None,
            deadline: None,
        }
    }

    /// Freezes the counter from these LSI periods on, or lets it count on at `periods` from where it stood (38.16.2).
    pub(crate) fn freeze(&mut self, from: Option<f64>, periods: f64) {
        if let Some(frozen) = std::mem::replace(&mut self.frozen, from) {
            self.deadline = self.deadline.map(|deadline| deadline + periods - frozen);
        }
    }

    /// Takes the write protection away, or restores it; returns how it was.
    pub(crate) fn unprotect(&mut self, unprotected: bool) -> bool {
        std::mem::replace(&mut self.is_unprotected, unprotected)
    }

    /// LSI periods from a reload to the timeout.
    fn timeout(&self) -> f64 {
        f64::from((self.rlr + 1) * (4 << self.pr.min(6)))
    }

    /// True from the start to the next reset: LSI is then on, whatever RCC says (7.2.5).
    pub(crate) fn started(&self) -> bool {
        self.deadline.is_some()
    }

    pub(crate) fn peek(&self, offset: u32, periods: f64) -> Option<u32> {
        Some(match offset {
            KR => 0,
            PR => self.pr,
            RLR => self.rlr,
            SR => u32::from(periods < self.updating[0]) | u32::from(periods < self.updating[1]) << 1,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, periods: f64, lints: &mut Vec<LintKind>) {
        match offset {
            KR => {
                self.unlocked = false;
                match value & 0xFFFF {
                    0x5555 => self.unlocked = true,
                    // 21.3: start; LSI is switched on by hardware. Both keys load the counter with RLR.
                    0xCCCC => self.deadline = Some(periods + self.timeout()),
                    0xAAAA => self.deadline = self.deadline.map(|_| periods + self.timeout()),
                    _ => {}
                }
            }
            PR | RLR => {
                let which = usize::from(offset == RLR);
                if !self.unlocked && !self.is_unprotected {
                    lints.push(LintKind::Misuse(
                        "IWDG_PR and IWDG_RLR are write-protected: write 0x5555 to IWDG_KR first",
                    ));
                } else if periods < self.updating[which] && !self.is_unprotected {
                    lints.push(LintKind::Misuse(
                        "the last update of IWDG_PR or IWDG_RLR is not complete: wait until its flag in IWDG_SR is 0",
                    ));
                } else {
                    if offset == PR {
                        self.pr = value & 7;
                    } else {
                        self.rlr = value & 0xFFF;
                    }
                    self.updating[which] = periods + UPDATE_PERIODS;
                }
            }
            SR => lints.push(LintKind::Misuse("IWDG_SR is read only")),
            _ => lints.push(LintKind::Unmodelled),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nominal frequency of LSI, Hz.
    const LSI: f64 = 32_000.0;

    fn write(iwdg: &mut Iwdg, offset: u32, value: u32, periods: f64) -> usize {
        let mut lints = Vec::new();
        iwdg.write(offset, value, periods, &mut lints);
        lints.len()
    }

    #[test]
    fn timeout_by_prescaler_and_reload() {
        // RM0090 table 107 (LSI 32 kHz): /4 with RLR 0 is 0.125 ms, with RLR 0xFFF 512 ms; /256 gives 8 ms and 32768 ms.
        for (pr, rlr, milliseconds) in
            [(0, 0, 0.125), (0, 0xFFF, 512.0), (6, 0, 8.0), (6, 0xFFF, 32_768.0), (7, 0, 8.0)]
        {
            let mut iwdg = Iwdg::new();
            write(&mut iwdg, KR, 0x5555, 0.0);
            write(&mut iwdg, PR, pr, 0.0);
            write(&mut iwdg, RLR, rlr, 0.0);
            assert!(!iwdg.started());
            write(&mut iwdg, KR, 0xCCCC, LSI);
            assert_eq!(iwdg.deadline, Some(LSI + milliseconds / 1000.0 * LSI), "PR {pr}, RLR {rlr}");
            assert!(iwdg.started());
        }
    }

    #[test]
    fn a_reload_moves_the_deadline_but_does_not_start() {
        let mut iwdg = Iwdg::new();
        write(&mut iwdg, KR, 0xAAAA, 0.0);
        assert_eq!(iwdg.deadline, None);
        write(&mut iwdg, KR, 0xCCCC, 0.0);
        write(&mut iwdg, KR, 0xAAAA, 8_000.0);
        assert_eq!(iwdg.deadline, Some(8_000.0 + 16_384.0));
        // Any other key neither reloads nor stops it.
        write(&mut iwdg, KR, 0x1234, 16_000.0);
        assert_eq!(iwdg.deadline, Some(8_000.0 + 16_384.0));
    }

    #[test]
    fn registers_are_protected_by_the_key() {
        // RM0090 21.3.2: any other key protects again.
        let mut iwdg = Iwdg::new();
        assert_eq!(write(&mut iwdg, PR, 3, 0.0), 1);
        write(&mut iwdg, KR, 0x5555, 0.0);
        assert_eq!(write(&mut iwdg, PR, 3, 0.0), 0);
        write(&mut iwdg, KR, 0xAAAA, 0.0);
        assert_eq!(write(&mut iwdg, RLR, 3, 0.0), 1);
        assert_eq!((iwdg.peek(PR, LSI), iwdg.peek(RLR, LSI)), (Some(3), Some(0xFFF)));
    }

    #[test]
    fn an_update_takes_five_lsi_periods() {
        // RM0090 21.4.4: PVU, RVU; a register can only be written again when its flag is 0.
        let mut iwdg = Iwdg::new();
        write(&mut iwdg, KR, 0x5555, 0.0);
        write(&mut iwdg, PR, 3, 0.0);
        assert_eq!(iwdg.peek(SR, 0.0), Some(1));
        assert_eq!(write(&mut iwdg, PR, 4, 3.2), 1);
        assert_eq!(iwdg.peek(PR, 0.0), Some(3));
        assert_eq!(iwdg.peek(SR, 5.0), Some(0));
        assert_eq!(write(&mut iwdg, PR, 4, 5.0), 0);
    }
}
