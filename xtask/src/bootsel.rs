//! The drive of an RP2040's boot loader: finds it among the mounted drives, and writes a UF2 file to it.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::missing_requirement::MissingRequirement;

/// What the drive of a UF2 boot loader has, and no other drive (<https://github.com/microsoft/uf2>).
const INFO_FILE: &str = "INFO_UF2.TXT";
/// Its line that names the board.
const BOARD_FIELD: &str = "Board-ID:";
/// That of the RP2040's ROM (RP2040 datasheet, 2.8.4).
const BOARD_ID: &str = "RPI-RP2";

/// How to get there.
const HOW: &str = "hold BOOTSEL while you plug the Pico in; where the system does not mount its drive by itself, mount it \
                   (on Linux `udisksctl mount -b /dev/sda1`), or name its folder with --drive";

/// The folders of all mounted drives.
pub(crate) fn mounted() -> Vec<PathBuf> {
    if cfg!(windows) {
        return ('D'..='Z').map(|letter| PathBuf::from(format!("{letter}:\\"))).collect();
    }
    if let Ok(table) = std::fs::read_to_string("/proc/self/mounts") {
        return mount_points(&table);
    }
    // macOS.
    let volumes = std::fs::read_dir("/Volumes").into_iter().flatten();
    volumes.filter_map(|entry| Some(entry.ok()?.path())).collect()
}

/// Second column of Linux's table of mounts, in which a blank is `\040`.
fn mount_points(table: &str) -> Vec<PathBuf> {
    let point = |line: &str| line.split(' ').nth(1).map(|point| PathBuf::from(point.replace("\\040", " ")));
    table.lines().filter_map(point).collect()
}

/// What the boot loader in a folder calls its board; `None` if the folder is no drive of a boot loader.
fn board_in(folder: &Path) -> Option<String> {
    let info = std::fs::read_to_string(folder.join(INFO_FILE)).ok()?;
    let id = info.lines().find_map(|line| line.strip_prefix(BOARD_FIELD));
    Some(id.unwrap_or("(without a Board-ID)").trim().to_owned())
}

/// The folder that the user names.
pub(crate) fn named(folder: &Path) -> Result<PathBuf> {
    match board_in(folder) {
        Some(board) if board == BOARD_ID => Ok(folder.to_owned()),
        Some(board) => Err(missing(other_board(folder, &board))),
        None => Err(missing(format!(
            "{} is not the drive of a Pico's boot loader: it has no {INFO_FILE}. Hold BOOTSEL while you plug the Pico in, and name the folder of \
             the drive RPI-RP2",
            folder.display()
        ))),
    }
}

/// The only drive of a Pico among these folders.
pub(crate) fn only(folders: &[PathBuf]) -> Result<PathBuf> {
    let found = folders.iter().filter_map(|folder| Some((folder, board_in(folder)?)));
    let (picos, others): (Vec<_>, Vec<_>) = found.partition(|(_, board)| board == BOARD_ID);
    match (&picos[..], &others[..]) {
        ([(folder, _)], _) => Ok((*folder).clone()),
        ([], []) => Err(missing(format!("no drive of a Pico's boot loader is mounted: {HOW}"))),
        ([], [(folder, board), ..]) => Err(missing(other_board(folder, board))),
        _ => {
            let names: Vec<String> = picos.iter().map(|(folder, _)| folder.display().to_string()).collect();
            Err(missing(format!(
                "{} drives of a Pico's boot loader are mounted: {}. Unplug all but one, or name one with --drive",
                names.len(),
                names.join(", ")
            )))
        }
    }
}

fn other_board(folder: &Path, board: &str) -> String {
    format!(
        "{} is the drive of a board {board}; the image is for an RP2040, whose drive says {BOARD_ID}: plug a Raspberry Pi Pico in, not a Pico 2, \
         with BOOTSEL held",
        folder.display()
    )
}

fn missing(words: String) -> anyhow::Error {
    MissingRequirement(words).into()
}

/// Writes the file to the drive.
pub(crate) fn write(uf2: &[u8], drive: &Path) -> Result<()> {
    let to = drive.join("footfall.uf2");
    let mut file = std::fs::File::create(&to).with_context(|| format!("making {}", to.display()))?;
    file.write_all(uf2).with_context(|| format!("writing {}", to.display()))?;
    // With the last block the board restarts, and the drive is gone: then it has all of it.
    match file.sync_all() {
        Err(error) if board_in(drive).is_some() => Err(error).with_context(|| format!("writing {}", to.display())),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Folders of drives whose information files have these texts.
    fn drives(name: &str, infos: &[Option<&str>]) -> Vec<PathBuf> {
        let base = std::env::temp_dir().join(format!("footfall-bootsel-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&base);
        let folders: Vec<PathBuf> = (0..infos.len()).map(|n| base.join(format!("drive {n}"))).collect();
        for (folder, info) in folders.iter().zip(infos) {
            std::fs::create_dir_all(folder).unwrap();
            if let Some(info) = info {
                std::fs::write(folder.join(INFO_FILE), info).unwrap();
            }
        }
        folders
    }

    const PICO: &str = "UF2 Bootloader v3.0\r\nModel: Raspberry Pi RP2\r\nBoard-ID: RPI-RP2\r\n";
    const PICO_2: &str = "UF2 Bootloader v1.0\r\nModel: Raspberry Pi RP2350\r\nBoard-ID: RP2350\r\n";

    #[test]
    fn the_one_pico_among_other_drives_is_found_and_written() {
        let folders = drives("one", &[None, Some(PICO_2), Some(PICO), None]);
        let drive = only(&folders).unwrap();
        assert_eq!(drive, folders[2]);
        assert_eq!(named(&folders[2]).unwrap(), folders[2]);
        write(&[1, 2, 3], &drive).unwrap();
        assert_eq!(std::fs::read(drive.join("footfall.uf2")).unwrap(), [1, 2, 3]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let said = |folders: &[PathBuf]| only(folders).unwrap_err().to_string();
        assert!(said(&drives("none", &[None])).contains("no drive of a Pico's boot loader is mounted: hold BOOTSEL"));
        let two = drives("two", &[Some(PICO), Some(PICO)]);
        let words = said(&two);
        assert!(words.starts_with("2 drives") && words.contains("drive 0, ") && words.contains("--drive"), "{words}");
        let other = drives("other", &[Some(PICO_2), Some("")]);
        assert!(said(&other).contains("is the drive of a board RP2350; the image is for an RP2040"));
        assert!(named(&other[1]).unwrap_err().to_string().contains("a board (without a Board-ID)"));
        assert!(named(&other[0].join("nowhere")).unwrap_err().to_string().contains("it has no INFO_UF2.TXT"));
    }

    #[test]
    fn mount_points_are_read_with_blanks() {
        let table = "/dev/sda1 / ext4 rw 0 0\n/dev/sdb1 /media/a\\040b/RPI-RP2 vfat rw 0 0\n";
        assert_eq!(mount_points(table), [PathBuf::from("/"), PathBuf::from("/media/a b/RPI-RP2")]);
    }
}
