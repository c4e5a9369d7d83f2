//! IWDG: the independent watchdog (RM0090 chapter 21). It runs on LSI, and only a reset stops it.
//!
//! ```text
//! timeout = (RLR + 1) * 4 * 2^PR / LSI      PR 0..=6 (7 is 6 again), RLR 0..=4095
//! ```
//! Its times are kept in seconds, so that a change of the core clock does not affect them.

use crate::lint::LintKind;

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;

/// LSI cycles that an update of PR or RLR takes (21.4.4).
const UPDATE_CYCLES: f64 = 5.0;

/// IWDG registers and timeout.
#[derive(Debug, Clone)]
pub(crate) struct Iwdg {
    lsi_hz: f64,
    unlocked: bool,
    pr: u32,
    rlr: u32,
    /// Times, s, until which PVU and RVU are set.
    updating: [f64; 2],
    /// Time of the timeout, s; `None`: not started.
    pub(crate) deadline: Option<f64>,
}

impl Iwdg {
    pub(crate) fn new(lsi_hz: f64) -> Self {
        // At least 1 Hz, so that the timeout stays finite; the data sheet's range is 17 to 47 kHz.
        let lsi_hz = if lsi_hz.is_finite() && lsi_hz > 0.0 { lsi_hz } else { 32_000.0 };
        Iwdg { lsi_hz, unlocked: false, pr: 0, rlr: 0xFFF, updating: [0.0; 2], deadline: None }
    }

    fn timeout(&self) -> f64 {
        f64::from((self.rlr + 1) * (4 << self.pr.min(6))) / self.lsi_hz
    }

    pub(crate) fn peek(&self, offset: u32, seconds: f64) -> Option<u32> {
        Some(match offset {
            KR => 0,
            PR => self.pr,
            RLR => self.rlr,
            SR => u32::from(seconds < self.updating[0]) | u32::from(seconds < self.updating[1]) << 1,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, seconds: f64, lints: &mut Vec<LintKind>) {
        match offset {
            KR => {
                self.unlocked = false;
                match value & 0xFFFF {
                    0x5555 => self.unlocked = true,
                    // 21.3: start; LSI is switched on by hardware. Both keys load the counter with RLR.
                    0xCCCC => self.deadline = Some(seconds + self.timeout()),
                    0xAAAA => self.deadline = self.deadline.map(|_| seconds + self.timeout()),
                    _ => {}
                }
            }
            PR | RLR => {
                let which = usize::from(offset == RLR);
                if !self.unlocked {
                    lints.push(LintKind::Misuse(
                        "IWDG_PR and IWDG_RLR are write-protected: write 0x5555 to IWDG_KR first",
                    ));
                } else if seconds < self.updating[which] {
                    lints.push(LintKind::Misuse(
                        "the last update of IWDG_PR or IWDG_RLR is not complete: wait until its flag in IWDG_SR is 0",
                    ));
                } else {
                    if offset == PR {
                        self.pr = value & 7;
                    } else {
                        self.rlr = value & 0xFFF;
                    }
                    self.updating[which] = seconds + UPDATE_CYCLES / self.lsi_hz;
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

    fn write(iwdg: &mut Iwdg, offset: u32, value: u32, seconds: f64) -> usize {
        let mut lints = Vec::new();
        iwdg.write(offset, value, seconds, &mut lints);
        lints.len()
    }

    #[test]
    fn timeout_by_prescaler_and_reload() {
        // RM0090 table 107 (LSI 32 kHz): /4 with RLR 0 is 0.125 ms, with RLR 0xFFF 512 ms; /256 gives 8 ms and 32768 ms.
        for (pr, rlr, milliseconds) in
            [(0, 0, 0.125), (0, 0xFFF, 512.0), (6, 0, 8.0), (6, 0xFFF, 32_768.0), (7, 0, 8.0)]
        {
            let mut iwdg = Iwdg::new(32_000.0);
            write(&mut iwdg, KR, 0x5555, 0.0);
            write(&mut iwdg, PR, pr, 0.0);
            write(&mut iwdg, RLR, rlr, 0.0);
            write(&mut iwdg, KR, 0xCCCC, 1.0);
            assert_eq!(iwdg.deadline, Some(1.0 + milliseconds / 1000.0), "PR {pr}, RLR {rlr}");
        }
    }

    #[test]
    fn slow_and_fast_lsi() {
        let timeout = |lsi| {
            let mut iwdg = Iwdg::new(lsi);
            write(&mut iwdg, KR, 0xCCCC, 0.0);
            iwdg.deadline
        };
        assert_eq!(timeout(17_000.0), Some(4096.0 * 4.0 / 17_000.0));
        assert_eq!(timeout(47_000.0), Some(4096.0 * 4.0 / 47_000.0));
    }

    #[test]
    fn a_reload_moves_the_deadline_but_does_not_start() {
        let mut iwdg = Iwdg::new(32_000.0);
        write(&mut iwdg, KR, 0xAAAA, 0.0);
        assert_eq!(iwdg.deadline, None);
        write(&mut iwdg, KR, 0xCCCC, 0.0);
        write(&mut iwdg, KR, 0xAAAA, 0.25);
        assert_eq!(iwdg.deadline, Some(0.25 + 0.512));
        // Any other key neither reloads nor stops it.
        write(&mut iwdg, KR, 0x1234, 0.5);
        assert_eq!(iwdg.deadline, Some(0.25 + 0.512));
    }

    #[test]
    fn registers_are_protected_by_the_key() {
        // RM0090 21.3.2: any other key protects again.
        let mut iwdg = Iwdg::new(32_000.0);
        assert_eq!(write(&mut iwdg, PR, 3, 0.0), 1);
        write(&mut iwdg, KR, 0x5555, 0.0);
        assert_eq!(write(&mut iwdg, PR, 3, 0.0), 0);
        write(&mut iwdg, KR, 0xAAAA, 0.0);
        assert_eq!(write(&mut iwdg, RLR, 3, 0.0), 1);
        assert_eq!((iwdg.peek(PR, 1.0), iwdg.peek(RLR, 1.0)), (Some(3), Some(0xFFF)));
    }

    #[test]
    fn an_update_takes_five_lsi_cycles() {
        // RM0090 21.4.4: PVU, RVU; a register can only be written again when its flag is 0.
        let mut iwdg = Iwdg::new(32_000.0);
        write(&mut iwdg, KR, 0x5555, 0.0);
        write(&mut iwdg, PR, 3, 0.0);
        assert_eq!(iwdg.peek(SR, 0.0), Some(1));
        assert_eq!(write(&mut iwdg, PR, 4, 0.0001), 1);
        assert_eq!(iwdg.peek(PR, 0.0), Some(3));
        assert_eq!(iwdg.peek(SR, 5.0 / 32_000.0), Some(0));
        assert_eq!(write(&mut iwdg, PR, 4, 5.0 / 32_000.0), 0);
    }
}
