//! Sectors of the flash that are written to files at the end of a run.

use std::fs::File;
use std::io::Write;

use anyhow::{Context as _, Result};
use stm32f4_model::flash_sector_at;

use super::BoardRun;
use super::saved_sector::{FlashDownload, SavedSector};
use crate::cpu::Cpu as _;

impl<W: Write> BoardRun<'_, W> {
    /// Creates the files of the sectors to save.
    ///
    /// # Errors
    /// An address is not in flash, or a file cannot be written.
    pub(crate) fn save_flash(&mut self, sectors: &[FlashDownload]) -> Result<()> {
        for to in sectors {
            let (address, bytes) = flash_sector_at(to.addr).with_context(|| {
                format!("--save-flash: 0x{:08X} is not in flash; allowed is 0x08000000 to 0x080FFFFF", to.addr)
            })?;
            let file = File::create(&to.file).with_context(|| format!("cannot write {}", to.file.display()))?;
            self.saved.push(SavedSector { address, bytes, to: to.clone(), file });
        }
        Ok(())
    }

    /// Writes the sectors.
    pub(super) fn write_sectors(&mut self) -> Result<()> {
        for SavedSector { address, bytes, to, mut file } in std::mem::take(&mut self.saved) {
            let mut content = vec![0; bytes as usize];
            self.cpu.read_memory(address, &mut content);
            file.write_all(&content).with_context(|| format!("cannot write {}", to.file.display()))?;
        }
        Ok(())
    }
}
