//! Registers of the flash interface (RM0090 chapter 3.9). Erasing and programming are not modelled.

use crate::lint::LintKind;

const LOCK: u32 = 1 << 31;
const OPTLOCK: u32 = 1;
/// PG, SER, MER, STRT: bits that erase or program.
const CHANGES: u32 = 0x1_0007;

/// Flash interface registers.
#[derive(Debug, Clone)]
pub(crate) struct Flash {
    acr: u32,
    cr: u32,
    optcr: u32,
    /// Number of correct keys written so far, for CR and OPTCR; 0xFF: a wrong key was written, locked until the next reset.
    keys: [u8; 2],
}

impl Flash {
    /// `bor_level` is BOR_LEV of the option bytes, 0 to 3 (3.9.6).
    pub(crate) fn new(bor_level: u8) -> Self {
        Flash { acr: 0, cr: LOCK, optcr: 0x0FFF_AAE1 | u32::from(bor_level & 3) << 2, keys: [0; 2] }
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.acr,
            // The keys read as 0. SR reads as 0 because no operation ends or fails here.
            0x04 | 0x08 | 0x0C => 0,
            0x10 => self.cr,
            0x14 => self.optcr,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        match offset {
            // 3.9.1: LATENCY, prefetch, caches; the cache resets read back as written.
            0x00 => self.acr = value & 0x1F07,
            0x04 => {
                if self.key(0, value, [0x4567_0123, 0xCDEF_89AB], lints) {
                    self.cr &= !LOCK;
                }
            }
            0x08 => {
                if self.key(1, value, [0x0819_2A3B, 0x4C5D_6E7F], lints) {
                    self.optcr &= !OPTLOCK;
                }
            }
            // 3.9.5: flags are cleared by writing 1; none is set here.
            0x0C => {}
            0x10 => {
                if self.cr & LOCK != 0 {
                    if value != self.cr {
                        lints.push(LintKind::Misuse("FLASH_CR is locked: write the two keys to FLASH_KEYR first"));
                    }
                    return;
                }
                if value & CHANGES != 0 {
                    lints.push(LintKind::Mode("erasing or programming the flash"));
                }
                if value & LOCK != 0 {
                    self.keys[0] = 0;
                }
                self.cr = value & 0x8100_037F & !CHANGES;
            }
            0x14 => {
                if self.optcr & OPTLOCK != 0 {
                    lints.push(LintKind::Misuse("FLASH_OPTCR is locked: write the two keys to FLASH_OPTKEYR first"));
                    return;
                }
                if value & OPTLOCK == 0 && value & !3 != self.optcr & !3 {
                    lints.push(LintKind::Mode("changing option bytes"));
                }
                if value & OPTLOCK != 0 {
                    self.keys[1] = 0;
                    self.optcr |= OPTLOCK;
                }
            }
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    /// Takes one key; returns true when the sequence is complete. 3.6.1: a wrong key locks until the next reset (and is a bus error).
    fn key(&mut self, which: usize, value: u32, sequence: [u32; 2], lints: &mut Vec<LintKind>) -> bool {
        let given = self.keys[which];
        if sequence.get(usize::from(given)) == Some(&value) {
            self.keys[which] = given + 1;
            return given == 1;
        }
        self.keys[which] = 0xFF;
        lints.push(LintKind::Misuse("wrong flash key: the register is locked until the next reset"));
        false
    }

    /// LATENCY: wait states of a flash read, 0 to 7.
    pub(crate) fn wait_states(&self) -> u32 {
        self.acr & 7
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(flash: &mut Flash, offset: u32, value: u32) -> Vec<LintKind> {
        let mut lints = Vec::new();
        flash.write(offset, value, &mut lints);
        lints
    }

    #[test]
    fn latency_and_caches_read_back() {
        let mut flash = Flash::new(3);
        write(&mut flash, 0, 0x705);
        assert_eq!((flash.peek(0), flash.wait_states()), (Some(0x705), 5));
    }

    #[test]
    fn two_keys_unlock_and_the_lock_bit_locks_again() {
        // RM0090 3.6.1.
        let mut flash = Flash::new(3);
        assert_eq!(flash.peek(0x10), Some(LOCK));
        assert_eq!(write(&mut flash, 0x10, 0x200).len(), 1);
        write(&mut flash, 4, 0x4567_0123);
        write(&mut flash, 4, 0xCDEF_89AB);
        assert_eq!(flash.peek(0x10), Some(0));
        assert_eq!(write(&mut flash, 0x10, 0x200), []);
        assert_eq!(flash.peek(0x10), Some(0x200));
        write(&mut flash, 0x10, LOCK);
        assert_eq!(flash.peek(0x10), Some(LOCK));
        assert_eq!(write(&mut flash, 0x10, 0x200).len(), 1);
        write(&mut flash, 4, 0x4567_0123);
        write(&mut flash, 4, 0xCDEF_89AB);
        assert_eq!(flash.peek(0x10), Some(0));
    }

    #[test]
    fn a_wrong_key_locks_until_reset() {
        let mut flash = Flash::new(3);
        assert_eq!(write(&mut flash, 4, 1).len(), 1);
        write(&mut flash, 4, 0x4567_0123);
        write(&mut flash, 4, 0xCDEF_89AB);
        assert_eq!(flash.peek(0x10), Some(LOCK));
    }

    #[test]
    fn option_bytes_have_keys_of_their_own() {
        // RM0090 3.6.1, 3.9.6: reset value, OPTKEYR, OPTLOCK.
        let mut flash = Flash::new(3);
        assert_eq!(flash.peek(0x14), Some(0x0FFF_AAED));
        assert_eq!(Flash::new(0).peek(0x14), Some(0x0FFF_AAE1));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAEC).len(), 1);
        write(&mut flash, 8, 0x0819_2A3B);
        write(&mut flash, 8, 0x4C5D_6E7F);
        assert_eq!(flash.peek(0x14), Some(0x0FFF_AAEC));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAEC), []);
        assert!(write(&mut flash, 0x14, 0x0FFF_AAE0)[0].is_unmodelled());
        write(&mut flash, 0x14, 0x0FFF_AAED);
        assert_eq!(flash.peek(0x14), Some(0x0FFF_AAED));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAEC).len(), 1);
    }

    #[test]
    fn erasing_gives_an_unmodelled_lint() {
        let mut flash = Flash::new(3);
        write(&mut flash, 4, 0x4567_0123);
        write(&mut flash, 4, 0xCDEF_89AB);
        let lints = write(&mut flash, 0x10, 0x1_000A);
        assert!(lints.len() == 1 && lints[0].is_unmodelled());
    }
}
