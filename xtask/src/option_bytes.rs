//! The option bytes of a board at a debug probe: `cargo xtask flash` sets the brown-out reset to its highest level, without which the firmware does not arm.

use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::board::Board;
use crate::probe::{bytes_of, done};
use crate::shell;

/// Registers of the flash interface for the option bytes (RM0090 3.9.3, 3.9.6; RM0390 3.8.3, 3.8.6).
const FLASH_OPTKEYR: u32 = 0x4002_3C08;
const FLASH_OPTCR: u32 = 0x4002_3C14;

/// The writes that set the brown-out reset to its highest level, where `optcr` says that it is off or at another: the two keys, the new option bytes, the start
/// of their programming, the lock. Nothing else in the option bytes changes.
fn brown_out_writes(optcr: u32) -> Option<[(u32, u32); 5]> {
    /// BOR_LEV: 0 is level 3, the highest; 3 is off.
    const BOR_LEV: u32 = 3 << 2;
    const OPTSTRT: u32 = 2;
    const OPTLOCK: u32 = 1;
    let new = optcr & !(BOR_LEV | OPTSTRT | OPTLOCK);
    let [key, other_key] = [0x0819_2A3B, 0x4C5D_6E7F].map(|key| (FLASH_OPTKEYR, key));
    (optcr & BOR_LEV != 0).then_some([
        key,
        other_key,
        (FLASH_OPTCR, new),
        (FLASH_OPTCR, new | OPTSTRT),
        (FLASH_OPTCR, new | OPTLOCK),
    ])
}

/// Sets the brown-out reset in the option bytes to its highest level, if it is not there. probe-rs, the program at `probe_rs`, has no command for option bytes: this
/// writes the registers of the flash interface.
pub(crate) fn set_brown_out_reset(probe_rs: &Path, board: Board) -> Result<()> {
    let word = |address: u32| format!("0x{address:08x}");
    let optcr = || -> Result<u32> {
        let mut read = shell::command(probe_rs);
        let text = shell::stdout_of(read.args(["read", "--chip", board.chip(), "b32", &word(FLASH_OPTCR), "1"]))?;
        let bytes = bytes_of(&text).context("reading FLASH_OPTCR")?;
        let bytes = bytes.try_into().ok().context("reading FLASH_OPTCR: not one word")?;
        Ok(u32::from_le_bytes(bytes))
    };
    let Some(writes) = brown_out_writes(optcr()?) else { return Ok(()) };
    for (address, value) in writes {
        let mut write = shell::command(probe_rs);
        write.args(["write", "--chip", board.chip(), "b32", &word(address), &word(value)]);
        done(&mut write, "probe-rs write")?;
    }
    ensure!(
        brown_out_writes(optcr()?).is_none(),
        "the brown-out reset is still not at level 3 in the option bytes, and the board will not arm; set it with another tool, for example \
         `STM32_Programmer_CLI -c port=SWD -ob BOR_LEV=0`"
    );
    eprintln!("option bytes: the brown-out reset is at level 3 now, the highest");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_level_of_the_brown_out_reset_changes() {
        // As delivered: OPTLOCK, BOR off, watchdog by hardware off, no protection.
        let writes = brown_out_writes(0x0FFF_AAED).unwrap();
        assert_eq!(writes.map(|(_, value)| value), [0x0819_2A3B, 0x4C5D_6E7F, 0x0FFF_AAE0, 0x0FFF_AAE2, 0x0FFF_AAE1]);
        assert_eq!(writes.map(|(address, _)| address & 0xFF), [0x08, 0x08, 0x14, 0x14, 0x14]);
        // A lower level is raised; the highest one stays, and so does a protected chip's.
        assert!(brown_out_writes(0x0FFF_AAE1).is_none());
        for optcr in [0x0FFF_AAE5, 0x0FFF_AAE9] {
            assert_eq!(brown_out_writes(optcr).unwrap()[2].1, 0x0FFF_AAE0);
        }
        assert_eq!(brown_out_writes(0x0FFE_55ED).unwrap()[2].1, 0x0FFE_55E0);
    }
}

/// The whole write with a stand-in for probe-rs.
#[cfg(all(test, unix))]
mod stand_in {
    use super::*;
    use std::os::unix::fs::PermissionsExt;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// A program that takes the commands of probe-rs, with the option bytes of a chip behind it (RM0090 3.6.2): FLASH_OPTCR can be written after
    /// both keys, in order; OPTSTRT programs what the register has; OPTLOCK locks it again.
    const PROBE_RS: &str = r#"
cd "$(dirname "$0")" || exit 1
echo "$*" >> calls
[ "$2 $3 $4" = "--chip STM32F407VGTx b32" ] || exit 2
case "$1 $5" in
"read 0x40023c14") [ "$6" = 1 ] && printf '%08x\n' $(($(cat programmed) | 1)) ;;
"write 0x40023c08") echo "$6" >> keys ;;
"write 0x40023c14")
    [ "$(tr '\n' ' ' < keys)" = "0x08192a3b 0x4c5d6e7f " ] || exit 0
    if [ $(($6 & 1)) -ne 0 ]; then : > keys; exit 0; fi
    if [ $(($6 & 2)) -ne 0 ]; then cat register > programmed; else echo $(($6)) > register; fi ;;
*) exit 2 ;;
esac
"#;

    /// Runs the write on a chip with these option bytes; the option bytes afterwards, and the commands.
    fn write_to(options: u32, script: &str) -> (Result<()>, u32, Vec<String>) {
        static RUNS: AtomicU32 = AtomicU32::new(0);
        let run = RUNS.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("xtask-option-bytes-{run}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = |name: &str| folder.join(name);
        std::fs::write(file("programmed"), options.to_string()).unwrap();
        std::fs::write(file("keys"), "").unwrap();
        std::fs::write(file("probe-rs"), format!("#!/bin/sh{script}")).unwrap();
        std::fs::set_permissions(file("probe-rs"), std::fs::Permissions::from_mode(0o755)).unwrap();
        let result = set_brown_out_reset(&file("probe-rs"), Board::F4Discovery);
        let after = std::fs::read_to_string(file("programmed")).unwrap().trim().parse().unwrap();
        let calls = std::fs::read_to_string(file("calls")).unwrap().lines().map(str::to_owned).collect();
        std::fs::remove_dir_all(&folder).unwrap();
        (result, after, calls)
    }

    #[test]
    fn a_chip_as_delivered_gets_the_highest_level_and_nothing_else() {
        // Off, off in a protected chip, level 2 and level 1.
        for (delivered, wanted) in [
            (0x0FFF_AAEC, 0x0FFF_AAE0),
            (0x0FFE_55EC, 0x0FFE_55E0),
            (0x0FFF_AAE4, 0x0FFF_AAE0),
            (0x0FFF_AAE8, 0x0FFF_AAE0),
        ] {
            let (result, after, calls) = write_to(delivered, PROBE_RS);
            result.unwrap();
            assert_eq!(after, wanted, "{after:#010x}");
            // One read, five writes, and a read that checks them.
            let kinds: Vec<_> = calls.iter().filter_map(|call| call.split(' ').next()).collect();
            assert_eq!(kinds, ["read", "write", "write", "write", "write", "write", "read"]);
        }
    }

    #[test]
    fn the_highest_level_stays() {
        let (result, after, calls) = write_to(0x0FFF_AAE0, PROBE_RS);
        result.unwrap();
        assert_eq!((after, calls.len()), (0x0FFF_AAE0, 1));
    }

    #[test]
    fn a_write_without_effect_and_a_probe_that_fails_are_errors() {
        // The keys do not unlock this chip.
        let (result, after, _) = write_to(0x0FFF_AAEC, &PROBE_RS.replace("0x4c5d6e7f", "0x00000000"));
        assert_eq!(after, 0x0FFF_AAEC);
        let error = result.unwrap_err().to_string();
        assert!(error.contains("still not at level 3 in the option bytes") && error.contains("BOR_LEV=0"), "{error}");
        let (result, _, _) =
            write_to(0x0FFF_AAEC, &PROBE_RS.replace("\"write 0x40023c08\")", "\"write 0x40023c08\") exit 1;"));
        assert!(result.unwrap_err().to_string().contains("probe-rs write ended with"));
        let (result, _, _) = write_to(0x0FFF_AAEC, "\necho \"$*\" >> $(dirname \"$0\")/calls; echo nothing\n");
        assert!(format!("{:#}", result.unwrap_err()).contains("reading FLASH_OPTCR"));
    }
}
