//! EXTI, interrupts from edges at pins (RM0090 chapter 12), and SYSCFG, which selects the port of each line (chapter 9.2).

use crate::lint::LintKind;

/// Lines of the F407: 16 pins, PVD, RTC, USB, Ethernet (12.2.5).
const LINES: u32 = 0x007F_FFFF;

/// EXTI registers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Exti {
    imr: u32,
    emr: u32,
    rtsr: u32,
    ftsr: u32,
    swier: u32,
    pr: u32,
}

impl Exti {
    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.imr,
            0x04 => self.emr,
            0x08 => self.rtsr,
            0x0C => self.ftsr,
            0x10 => self.swier,
            0x14 => self.pr,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        let value = value & LINES;
        match offset {
            0x00 => self.imr = value,
            0x04 => {
                if value != 0 {
                    lints.push(LintKind::Mode("EXTI event lines"));
                }
                self.emr = value;
            }
            0x08 => self.rtsr = value,
            0x0C => self.ftsr = value,
            0x10 => {
                // 12.3.5: an unmasked line becomes pending when its bit changes from 0 to 1.
                self.pr |= value & !self.swier & self.imr;
                self.swier |= value;
            }
            0x14 => {
                // 12.3.6: cleared by writing 1, which clears the bit in SWIER too.
                self.pr &= !value;
                self.swier &= !value;
            }
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    /// Takes the lines with a rising and with a falling edge, one bit a line. Returns the lines whose edge is selected.
    ///
    /// Only unmasked lines become pending (12.2.4, 12.2.5: a line must be enabled to raise a request).
    pub(crate) fn edges(&mut self, rising: u32, falling: u32) -> u32 {
        let selected = (rising & self.rtsr) | (falling & self.ftsr);
        self.pr |= selected & self.imr;
        selected
    }

    /// Lines that are pending and unmasked.
    pub(crate) fn pending(&self) -> u32 {
        self.pr & self.imr
    }
}

/// SYSCFG registers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Syscfg {
    memrmp: u32,
    pmc: u32,
    exticr: [u32; 4],
    cmpcr: u32,
}

impl Syscfg {
    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.memrmp,
            0x04 => self.pmc,
            0x08..=0x14 => self.exticr[(offset as usize - 8) / 4],
            0x20 => self.cmpcr,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        match offset {
            0x00 => {
                if value & 3 != 0 {
                    lints.push(LintKind::Mode("memory remap: only the main flash lies at address 0"));
                }
                self.memrmp = value & 3;
            }
            0x04 => self.pmc = value & 1 << 23,
            0x08..=0x14 => self.exticr[(offset as usize - 8) / 4] = value & 0xFFFF,
            // 9.2.8: the compensation cell is ready as soon as it is on.
            0x20 => self.cmpcr = (value & 1) << 8 | value & 1,
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    /// Port index (0 is A) that is connected to an EXTI line, 0 to 15.
    pub(crate) fn port_of_line(&self, line: u8) -> usize {
        (self.exticr[usize::from(line / 4)] >> (line % 4 * 4) & 0xF) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exti(writes: &[(u32, u32)]) -> Exti {
        let mut exti = Exti::default();
        for &(offset, value) in writes {
            exti.write(offset, value, &mut Vec::new());
        }
        exti
    }

    #[test]
    fn selected_edges_of_unmasked_lines_become_pending() {
        let mut exti = exti(&[(0, 0b0101), (8, 0b0011), (12, 0b0100)]);
        assert_eq!(exti.edges(0b1111, 0), 0b0011);
        assert_eq!(exti.pending(), 0b0001, "line 1 is masked, line 2 selects the falling edge");
        exti.edges(0, 0b0100);
        assert_eq!(exti.pending(), 0b0101);
    }

    #[test]
    fn pending_is_cleared_by_writing_one() {
        // RM0090 12.3.6.
        let mut exti = exti(&[(0, 3), (8, 3)]);
        exti.edges(3, 0);
        exti.write(0x14, 1, &mut Vec::new());
        assert_eq!(exti.pending(), 2);
    }

    #[test]
    fn software_interrupt() {
        // RM0090 12.3.5: set by software, cleared through PR.
        let mut exti = exti(&[(0, 1 << 5), (0x10, 1 << 5 | 1 << 6)]);
        assert_eq!((exti.pending(), exti.peek(0x10)), (1 << 5, Some(1 << 5 | 1 << 6)));
        exti.write(0x14, 1 << 5, &mut Vec::new());
        assert_eq!((exti.pending(), exti.peek(0x10)), (0, Some(1 << 6)));
    }

    #[test]
    fn compensation_cell_and_ethernet_interface() {
        // RM0090 9.2.2, 9.2.7: MII_RMII_SEL is bit 23; the cell is ready (bit 8) once it is on.
        let mut syscfg = Syscfg::default();
        for (offset, value, read) in [(4, u32::MAX, 1 << 23), (0x20, 1, 0x101), (0x20, 0, 0), (0x0C, u32::MAX, 0xFFFF)]
        {
            syscfg.write(offset, value, &mut Vec::new());
            assert_eq!(syscfg.peek(offset), Some(read));
        }
    }

    #[test]
    fn memory_remap_gives_an_unmodelled_lint() {
        let mut syscfg = Syscfg::default();
        let mut lints = Vec::new();
        syscfg.write(0, 0, &mut lints);
        assert_eq!(lints, []);
        syscfg.write(0, 3, &mut lints);
        assert!(lints.len() == 1 && lints[0].is_unmodelled());
    }

    #[test]
    fn line_takes_its_port_from_exticr() {
        // RM0090 9.2.3: EXTICR1 holds lines 0 to 3, four bits each.
        let mut syscfg = Syscfg::default();
        assert_eq!(syscfg.port_of_line(0), 0);
        syscfg.write(0x14, 3 << 8, &mut Vec::new());
        assert_eq!((syscfg.port_of_line(14), syscfg.port_of_line(13)), (3, 0));
    }
}
