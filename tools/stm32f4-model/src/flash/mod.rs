//! Registers of the flash interface, the operation that runs, and the option bytes (RM0090 3.6, 3.7, 3.9). Of the option bytes the level of the
//! brown-out reset can be changed; read and write protection and the user bits are not modelled.

mod operation;

pub use operation::{FlashChange, FlashOperation, flash_sector_at};

use crate::bus::Width;
use crate::chip::Chip;
use crate::lint::LintKind;
use operation::{FLASH, RunningOperation};

const LOCK: u32 = 1 << 31;
const OPTLOCK: u32 = 1;
// OPTCR.
const OPTSTRT: u32 = 1 << 1;
const BOR_LEV: u32 = 3 << 2;
// CR.
const PG: u32 = 1;
const SER: u32 = 1 << 1;
const MER: u32 = 1 << 2;
const STRT: u32 = 1 << 16;
const EOPIE: u32 = 1 << 24;
const ERRIE: u32 = 1 << 25;
// SR.
const EOP: u32 = 1;
const OPERR: u32 = 1 << 1;
const PGAERR: u32 = 1 << 5;
const PGPERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const BSY: u32 = 1 << 16;

/// Flash interface registers.
#[derive(Debug, Clone)]
pub(crate) struct Flash {
    chip: Chip,
    acr: u32,
    cr: u32,
    /// EOP and the error flags.
    sr: u32,
    running: Option<RunningOperation>,
    /// OPTCR.
    optcr: u32,
    /// The option bytes, as OPTCR has them after a reset without its lock.
    options: u32,
    /// Number of correct keys written so far, for CR and OPTCR; 0xFF: a wrong key was written, locked until the next reset.
    keys: [u8; 2],
}

impl Flash {
    /// `bor_level` is BOR_LEV of the option bytes, 0 to 3 (3.9.6).
    pub(crate) fn new(chip: Chip, bor_level: u8) -> Self {
        let options = 0x0FFF_AAE0 | u32::from(bor_level & 3) << 2;
        Flash { chip, acr: 0, cr: LOCK, sr: 0, running: None, optcr: options | OPTLOCK, options, keys: [0; 2] }
    }

    /// Resets the registers; OPTCR has the option bytes then.
    pub(crate) fn reset(&mut self) {
        *self = Flash { options: self.options, optcr: self.options | OPTLOCK, ..Flash::new(self.chip, 0) };
    }

    /// BOR_LEV of the option bytes, 0 to 3.
    pub(crate) fn bor_level(&self) -> u8 {
        ((self.options & BOR_LEV) >> 2) as u8
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.acr,
            // The keys read as 0.
            0x04 | 0x08 => 0,
            0x0C => self.sr | if self.running.is_some() { BSY } else { 0 },
            0x10 => self.cr,
            0x14 => self.optcr,
            _ => return None,
        })
    }

    /// Writes a register at a time, s.
    pub(crate) fn write(&mut self, offset: u32, value: u32, seconds: f64, lints: &mut Vec<LintKind>) {
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
            // 3.9.5: flags are cleared by writing 1.
            0x0C => self.sr &= !value,
            // 3.6.1: a write to CR waits for the end of an operation. The core stands still then; another master's write is lost here.
            0x10 if self.running.is_some() => {
                lints.push(LintKind::Misuse("FLASH_CR is written while an operation runs: wait until BSY is 0"));
            }
            0x10 => {
                if self.cr & LOCK != 0 {
                    if value != self.cr {
                        lints.push(LintKind::Misuse("FLASH_CR is locked: write the two keys to FLASH_KEYR first"));
                    }
                    return;
                }
                if value & LOCK != 0 {
                    self.keys[0] = 0;
                }
                self.cr = value & 0x8301_037F;
                // 3.6.3: a mass erase with MER alone.
                if value & STRT != 0 && value & (MER | SER) == MER {
                    let psize = value >> 8 & 3;
                    self.running = Some(RunningOperation::mass_erase(self.chip.flash_bytes(), psize, seconds));
                } else if value & STRT != 0 && value & SER != 0 {
                    let end = FLASH + self.chip.flash_bytes();
                    self.running = RunningOperation::erase(value >> 3 & 0xF, value >> 8 & 3, seconds)
                        .filter(|erase| erase.address < end);
                    if self.running.is_none() {
                        lints.push(LintKind::Misuse(match self.chip {
                            Chip::F407 => "FLASH_CR.SNB names no sector: allowed are 0 to 11",
                            Chip::F411 => "FLASH_CR.SNB names no sector: allowed are 0 to 7",
                        }));
                    }
                }
                if self.running.is_none() {
                    self.cr &= !STRT;
                }
            }
            0x14 => {
                if self.optcr & OPTLOCK != 0 {
                    lints.push(LintKind::Misuse("FLASH_OPTCR is locked: write the two keys to FLASH_OPTKEYR first"));
                    return;
                }
                if self.running.is_some() {
                    lints.push(LintKind::Misuse("FLASH_OPTCR is written while an operation runs: wait until BSY is 0"));
                    return;
                }
                // 3.9.6: a write with OPTLOCK only locks.
                if value & OPTLOCK != 0 {
                    self.keys[1] = 0;
                    self.optcr |= OPTLOCK;
                    return;
                }
                let kept = !(BOR_LEV | OPTSTRT | OPTLOCK);
                if (value ^ self.optcr) & kept != 0 {
                    lints.push(LintKind::Mode("option bytes other than the level of the brown-out reset"));
                }
                self.optcr = self.optcr & kept | value & (BOR_LEV | OPTSTRT);
                if value & OPTSTRT != 0 {
                    self.running = Some(RunningOperation::option_bytes(seconds));
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

    /// A store to an address of the flash at a time, s (3.6.4). Without PG, or with another width than PSIZE, or not aligned, it has no effect but
    /// an error flag.
    pub(crate) fn store(&mut self, address: u32, width: Width, value: u32, seconds: f64) {
        let psize = [Width::Byte, Width::Half, Width::Word];
        let error = if self.cr & (LOCK | PG) != PG {
            PGSERR
        } else if psize.get((self.cr >> 8 & 3) as usize) != Some(&width) {
            PGPERR
        } else if !address.is_multiple_of(width.bytes()) {
            PGAERR
        } else {
            0
        };
        self.sr |= error;
        if error != 0 {
            // 3.9.5: OPERR is set only if error interrupts are enabled.
            self.sr |= if self.cr & ERRIE != 0 { OPERR } else { 0 };
        } else if self.running.is_none() {
            self.running = Some(RunningOperation::program(address, value, width.bytes(), seconds));
        }
    }

    /// Time of the end of the operation that runs, s; `None`: none runs.
    pub(crate) fn ends_at(&self) -> Option<f64> {
        self.running.map(|running| running.until)
    }

    /// Ends the operation that runs.
    pub(crate) fn finish(&mut self) -> Option<FlashOperation> {
        let running = self.running.take()?;
        // 3.9.5: EOP is set only if its interrupt is enabled.
        self.sr |= if self.cr & EOPIE != 0 { EOP } else { 0 };
        self.cr &= !STRT;
        if running.change == FlashChange::OptionBytes {
            self.optcr &= !OPTSTRT;
            self.options = self.optcr & !OPTLOCK;
        }
        Some(running.at(running.until))
    }

    /// True where a store to the flash programs it: CR is unlocked, and PG is set (3.6.4).
    pub(crate) fn accepts_stores(&self) -> bool {
        self.cr & (LOCK | PG) == PG
    }

    /// Cuts the operation that runs at a time, s: a reset or the loss of power.
    pub(crate) fn cut(&mut self, seconds: f64) -> Option<FlashOperation> {
        Some(self.running.take()?.at(seconds))
    }

    /// Level of the interrupt line (3.8).
    pub(crate) fn interrupt(&self) -> bool {
        self.sr & EOP != 0 && self.cr & EOPIE != 0 || self.sr & OPERR != 0 && self.cr & ERRIE != 0
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
        flash.write(offset, value, 0.0, &mut lints);
        lints
    }

    #[test]
    fn latency_and_caches_read_back() {
        let mut flash = Flash::new(Chip::F407, 3);
        write(&mut flash, 0, 0x705);
        assert_eq!((flash.peek(0), flash.wait_states()), (Some(0x705), 5));
    }

    #[test]
    fn two_keys_unlock_and_the_lock_bit_locks_again() {
        // RM0090 3.6.1.
        let mut flash = Flash::new(Chip::F407, 3);
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
        let mut flash = Flash::new(Chip::F407, 3);
        assert_eq!(write(&mut flash, 4, 1).len(), 1);
        write(&mut flash, 4, 0x4567_0123);
        write(&mut flash, 4, 0xCDEF_89AB);
        assert_eq!(flash.peek(0x10), Some(LOCK));
    }

    #[test]
    fn option_bytes_have_keys_of_their_own() {
        // RM0090 3.6.1, 3.9.6: reset value, OPTKEYR, OPTLOCK.
        let mut flash = Flash::new(Chip::F407, 3);
        assert_eq!(flash.peek(0x14), Some(0x0FFF_AAED));
        assert_eq!(Flash::new(Chip::F407, 0).peek(0x14), Some(0x0FFF_AAE1));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAEC).len(), 1);
        write(&mut flash, 8, 0x0819_2A3B);
        write(&mut flash, 8, 0x4C5D_6E7F);
        assert_eq!(flash.peek(0x14), Some(0x0FFF_AAEC));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAEC), []);
        assert!(write(&mut flash, 0x14, 0x0FFF_55EC)[0].is_unmodelled(), "read protection");
        write(&mut flash, 0x14, 0x0FFF_AAED);
        assert_eq!(flash.peek(0x14), Some(0x0FFF_AAED));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAEC).len(), 1);
    }

    fn unlocked() -> Flash {
        let mut flash = Flash::new(Chip::F407, 3);
        write(&mut flash, 4, 0x4567_0123);
        write(&mut flash, 4, 0xCDEF_89AB);
        flash
    }

    #[test]
    fn a_sector_erase_is_busy_for_its_time() {
        // 3.6.3: SER, SNB, then STRT; BSY until the end; EOP only with EOPIE (3.9.5).
        let mut flash = unlocked();
        assert_eq!(write(&mut flash, 0x10, SER | 1 << 3 | 2 << 8 | EOPIE | STRT), []);
        assert_eq!((flash.peek(0x0C), flash.ends_at()), (Some(BSY), Some(0.25)));
        assert_eq!(write(&mut flash, 0x10, LOCK).len(), 1, "CR is not written while it runs");
        let ended = flash.finish().unwrap();
        assert_eq!((ended.address, ended.bytes(), ended.done), (0x0800_4000, 0x4000, 1.0));
        assert_eq!((flash.peek(0x0C), flash.peek(0x10).map(|cr| cr & STRT)), (Some(EOP), Some(0)));
        assert!(flash.interrupt());
        write(&mut flash, 0x0C, EOP);
        assert_eq!((flash.peek(0x0C), flash.interrupt()), (Some(0), false));
    }

    #[test]
    fn a_store_programs_only_with_pg_and_the_width_of_psize() {
        // 3.6.4, "Programming errors".
        for (cr, width, address, flags) in [
            (0, Width::Word, 0x0800_4000, PGSERR),
            (PG, Width::Word, 0x0800_4000, PGPERR),
            (PG | 2 << 8, Width::Word, 0x0800_4002, PGAERR),
            (PG | 2 << 8 | ERRIE, Width::Byte, 0x0800_4000, PGPERR | OPERR),
            (PG | 2 << 8, Width::Word, 0x0800_4000, BSY),
            (PG, Width::Byte, 0x0800_4001, BSY),
        ] {
            let mut flash = unlocked();
            write(&mut flash, 0x10, cr);
            flash.store(address, width, 0x1234, 1.0);
            assert_eq!(flash.peek(0x0C), Some(flags), "{cr:#x}");
            assert_eq!(flash.ends_at().is_some(), flags == BSY);
        }
        let mut locked = Flash::new(Chip::F407, 3);
        locked.store(0x0800_4000, Width::Word, 0, 1.0);
        assert_eq!(locked.peek(0x0C), Some(PGSERR));
    }

    #[test]
    fn a_cut_operation_is_done_in_part() {
        let mut flash = unlocked();
        write(&mut flash, 0x10, SER | 3 << 3 | STRT);
        let cut = flash.cut(0.1).unwrap();
        assert!((cut.done - 0.25).abs() < 1e-9 && flash.ends_at().is_none(), "0.4 s by bytes");
    }

    #[test]
    fn a_mass_erase_takes_seconds() {
        // 3.6.3 and the data sheets: 8 s by words, half of it for 512 KiB.
        let erase = MER | STRT | 2 << 8;
        let mut flash = unlocked();
        assert_eq!(write(&mut flash, 0x10, erase), []);
        assert_eq!((flash.peek(0x0C), flash.ends_at()), (Some(BSY), Some(8.0)));
        let ended = flash.finish().unwrap();
        assert_eq!((ended.address, ended.bytes(), flash.peek(0x0C)), (FLASH, 0x10_0000, Some(0)));
        let mut small = Flash::new(Chip::F411, 3);
        [0x4567_0123, 0xCDEF_89AB].into_iter().for_each(|key| drop(write(&mut small, 4, key)));
        write(&mut small, 0x10, erase);
        assert_eq!((small.ends_at(), small.finish().unwrap().bytes()), (Some(4.0), 0x8_0000));
    }

    #[test]
    fn the_brown_out_level_changes_with_optstrt_and_outlasts_a_reset() {
        // 3.7.2: unlock, write OPTCR, set OPTSTRT, wait for BSY.
        let mut flash = Flash::new(Chip::F407, 3);
        [0x0819_2A3B, 0x4C5D_6E7F].into_iter().for_each(|key| drop(write(&mut flash, 8, key)));
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAE0), []);
        flash.reset();
        assert_eq!(
            (flash.peek(0x14), flash.bor_level()),
            (Some(0x0FFF_AAED), 3),
            "without OPTSTRT nothing is programmed"
        );
        [0x0819_2A3B, 0x4C5D_6E7F].into_iter().for_each(|key| drop(write(&mut flash, 8, key)));
        write(&mut flash, 0x14, 0x0FFF_AAE4);
        assert_eq!(write(&mut flash, 0x14, 0x0FFF_AAE4 | OPTSTRT), []);
        assert_eq!((flash.peek(0x0C), flash.ends_at(), flash.bor_level()), (Some(BSY), Some(0.4), 3));
        assert_eq!(flash.finish().unwrap().bytes(), 0);
        assert_eq!((flash.peek(0x0C), flash.peek(0x14), flash.bor_level()), (Some(0), Some(0x0FFF_AAE4), 1));
        flash.reset();
        assert_eq!((flash.peek(0x14), flash.bor_level()), (Some(0x0FFF_AAE5), 1));
        // One that a loss of power cuts changes nothing here.
        [0x0819_2A3B, 0x4C5D_6E7F].into_iter().for_each(|key| drop(write(&mut flash, 8, key)));
        write(&mut flash, 0x14, 0x0FFF_AAEC | OPTSTRT);
        flash.cut(0.1);
        flash.reset();
        assert_eq!(flash.bor_level(), 1);
    }
}
