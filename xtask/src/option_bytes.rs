//! The brown-out reset in the option bytes of a board at a debug probe: `cargo xtask flash` says its level, `cargo xtask board brown-out` sets it.
//!
//! probe-rs has no command for option bytes, and separate writes to the flash interface would leave a running program, and its watchdog, between them. So this
//! gives probe-rs a flash loader ([`LOADER`]) and a description of a chip whose only flash is the word that holds the level. `probe-rs download` then resets and
//! halts the core, and runs the loader in RAM: one session, in which no other program runs from the check of the present option bytes to the check of the new
//! ones.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::board::Board;
use crate::probe;
use crate::shell;

/// FLASH_OPTCR (RM0090 3.9.6, RM0390 3.8.6, RM0383 3.8.6).
const FLASH_OPTCR: u32 = 0x4002_3C14;

/// The bits of FLASH_OPTCR in which a chip is changed only if they are as delivered: RDP 0xAA, which is no protection; the watchdog is started by software; OPTSTRT
/// and the reserved bits are 0. 0x0000_0000 and 0xFFFF_FFFF, which a bad connection reads, are no such word.
const FIXED: u32 = 0xF000_FF32;
/// What they are as delivered.
const AS_DELIVERED: u32 = 0x0000_0020 | NOT_PROTECTED << 8;
/// RDP without protection (RM0090 3.6.3).
const NOT_PROTECTED: u32 = 0xAA;

/// The lowest measured supply that level 3 is set at on a board whose own level is lower: 2.97 V, to which the threshold rises in the worst chip, and 30 mV for
/// the meter (data sheets, "Embedded reset and power control block characteristics").
const LEVEL_3_FROM_VOLTS: f32 = 3.0;

/// A level of the brown-out reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Level {
    /// No brown-out reset: the chip runs on down to 1.8 V
    Off,
    /// About 2.1 V
    #[value(name = "1")]
    One,
    /// About 2.4 V
    #[value(name = "2")]
    Two,
    /// About 2.8 V
    #[value(name = "3")]
    Three,
}

impl Level {
    /// The field BOR_LEV at its place in FLASH_OPTCR.
    fn bits(self) -> u32 {
        match self {
            Self::Off => 3 << 2,
            Self::One => 2 << 2,
            Self::Two => 1 << 2,
            Self::Three => 0,
        }
    }

    /// The value of the field, which other tools take.
    pub(crate) fn field(self) -> u32 {
        self.bits() >> 2
    }

    /// The level in a value of FLASH_OPTCR.
    fn of(optcr: u32) -> Self {
        match optcr >> 2 & 3 {
            0 => Self::Three,
            1 => Self::Two,
            2 => Self::One,
            _ => Self::Off,
        }
    }

    /// As the option is typed.
    fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::One => "1",
            Self::Two => "2",
            Self::Three => "3",
        }
    }
}

/// The level that a board should have.
pub(crate) fn wanted(board: Board) -> Level {
    match board {
        Board::F4Discovery => Level::Two,
        Board::NucleoF446re | Board::BlackPillF411 => Level::Three,
    }
}

/// The flash loader, position-independent Thumb code that probe-rs runs in RAM on the halted core (CMSIS-Pack, "Flash Programming"). Entries: 0 prepares, where probe-rs
/// sets the stack, and erases a sector (nothing to do: the hardware erases the option bytes when it programs them); 4 programs: r2 points to the word with the new BOR_LEV at its place. It returns 0, or
/// 1 where the option bytes are not as delivered, or 2 where they read back otherwise than written. RM0090 3.6.2 has the order of the accesses.
#[rustfmt::skip]
const LOADER: [u16; 52] = [
    0x2000,         // 00  erase:   movs r0, #0
    0x4770,         // 02           bx   lr
    0xB510,         // 04  program: push {r4, lr}
    0x6812,         // 06           ldr  r2, [r2]            new level
    0x4B12,         // 08           ldr  r3, [pc, #72]       flash interface
    0x68D8,         // 0A           ldr  r0, [r3, #0x0C]     SR
    0x03C0,         // 0C           lsls r0, r0, #15         BSY
    0xD4FC,         // 0E           bmi  0A
    0x6958,         // 10           ldr  r0, [r3, #0x14]     OPTCR
    0x4911,         // 12           ldr  r1, [pc, #68]       FIXED
    0x4001,         // 14           ands r1, r0
    0x4C11,         // 16           ldr  r4, [pc, #68]       AS_DELIVERED
    0x42A1,         // 18           cmp  r1, r4
    0xD119,         // 1A           bne  50
    0xF020, 0x000F, // 1C           bic  r0, r0, #0x0F       BOR_LEV, OPTSTRT, OPTLOCK
    0xF002, 0x020C, // 20           and  r2, r2, #0x0C
    0x4302,         // 24           orrs r2, r0
    0x490E,         // 26           ldr  r1, [pc, #56]       first key
    0x6099,         // 28           str  r1, [r3, #0x08]     OPTKEYR
    0x490E,         // 2A           ldr  r1, [pc, #56]       second key
    0x6099,         // 2C           str  r1, [r3, #0x08]
    0x615A,         // 2E           str  r2, [r3, #0x14]
    0xF042, 0x0102, // 30           orr  r1, r2, #2          OPTSTRT
    0x6159,         // 34           str  r1, [r3, #0x14]
    0x68D9,         // 36           ldr  r1, [r3, #0x0C]
    0x03C9,         // 38           lsls r1, r1, #15         BSY
    0xD4FC,         // 3A           bmi  36
    0xF042, 0x0101, // 3C           orr  r1, r2, #1          OPTLOCK
    0x6159,         // 40           str  r1, [r3, #0x14]
    0x6958,         // 42           ldr  r0, [r3, #0x14]
    0x4288,         // 44           cmp  r0, r1
    0xD101,         // 46           bne  4C
    0x2000,         // 48           movs r0, #0
    0xBD10,         // 4A           pop  {r4, pc}
    0x2002,         // 4C           movs r0, #2
    0xBD10,         // 4E           pop  {r4, pc}
    0x2001,         // 50           movs r0, #1
    0xBD10,         // 52           pop  {r4, pc}
    0x3C00, 0x4002, // 54           flash interface
    FIXED as u16, (FIXED >> 16) as u16,
    AS_DELIVERED as u16, (AS_DELIVERED >> 16) as u16,
    0x2A3B, 0x0819, // 60           first key
    0x6E7F, 0x4C5D, // 64           second key
];

/// Name of the chip in [`description`]. probe-rs chooses the treatment of an STM32F4 by its beginning.
const CHIP: &str = "STM32F4 option bytes";

/// A place in the option bytes' sector of the system memory (RM0090 table 5). The loader takes no notice of it.
const PLACE: u32 = 0x1FFF_C000;

/// A description of a chip for probe-rs (`--chip-description-path`), with the loader. Every board has RAM at the beginning of SRAM1.
fn description() -> String {
    let loader: Vec<u8> = LOADER.iter().flat_map(|half_word| half_word.to_le_bytes()).collect();
    format!(
        "name: {CHIP}
variants:
- name: {CHIP}
  cores:
  - name: main
    type: armv7em
    core_access_options: !Arm
      ap: !v1 0
  memory_map:
  - !Nvm
    name: option bytes
    range:
      start: {PLACE:#x}
      end: {:#x}
    cores:
    - main
  - !Ram
    name: SRAM1
    range:
      start: 0x20000000
      end: 0x20004000
    cores:
    - main
  flash_algorithms:
  - brown-out level
flash_algorithms:
- name: brown-out level
  description: sets BOR_LEV
  default: true
  instructions: {}
  pc_init: 0x1
  pc_program_page: 0x5
  pc_erase_sector: 0x1
  data_section_offset: {:#x}
  flash_properties:
    address_range:
      start: {PLACE:#x}
      end: {:#x}
    page_size: 0x4
    erased_byte_value: 0xff
    program_page_timeout: 3000
    erase_sector_timeout: 1000
    sectors:
    - size: 0x4
      address: 0x0
",
        PLACE + 4,
        base64(&loader),
        loader.len(),
        PLACE + 4,
    )
}

/// Bytes as base64 (RFC 4648 section 4).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word = three.iter().chain(&[0, 0]).take(3).fold(0, |word, byte| word << 8 | usize::from(*byte));
        let digits = [18, 12, 6, 0].map(|shift| char::from(DIGITS[word >> shift & 0x3F]));
        text.extend(&digits[..=three.len()]);
        text.extend(std::iter::repeat_n('=', 3 - three.len()));
    }
    text
}

/// Refuses a chip whose flash is protected, before anything is written, and says the level of the brown-out reset in one line, with the command that sets another
/// where it is not the board's.
pub(crate) fn check(board: Board, folder: &Path) -> Result<()> {
    let optcr = read(board, folder)?;
    require_unprotected(optcr)?;
    let (level, wanted) = (Level::of(optcr), wanted(board));
    if level == wanted {
        eprintln!("brown-out reset: level {}, as this board should have", level.name());
    } else {
        eprintln!(
            "brown-out reset: level {}; this board should have level {}: `cargo xtask board brown-out --board {}` sets it",
            level.name(),
            wanted.name(),
            board.feature()
        );
    }
    Ok(())
}

/// Only RDP 0xAA is no protection. To lift a protection erases the whole flash, so that no command of ours does it.
fn require_unprotected(optcr: u32) -> Result<()> {
    let protection = optcr >> 8 & 0xFF;
    ensure!(
        protection == NOT_PROTECTED,
        "the chip's flash is protected against reading: RDP is {protection:#04x} in FLASH_OPTCR {optcr:#010x}; allowed is {NOT_PROTECTED:#04x}. Nothing was \
         written. Where the chip may lose all that its flash holds, `STM32_Programmer_CLI -c port=SWD -rdu` lifts the protection (not from level 2, 0xcc)"
    );
    Ok(())
}

/// The value of FLASH_OPTCR.
///
/// # Errors
/// Something that no chip has: a connection that reads only zeros or ones.
fn read(board: Board, folder: &Path) -> Result<u32> {
    let optcr = probe::read_word(board, FLASH_OPTCR, folder).context("reading the option bytes")?;
    ensure!(
        optcr != 0 && optcr != u32::MAX,
        "FLASH_OPTCR reads {optcr:#010x}, which no chip has: check the connection"
    );
    Ok(optcr)
}

/// Options of `cargo xtask board brown-out`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The level [default: the board's: 2 for f4-discovery, 3 for the others]
    #[arg(long, value_enum)]
    level: Option<Level>,
    /// The supply of the chip in volts, measured at the board's 3V pin while its program runs; level 3 on the Discovery asks for it
    #[arg(long, value_name = "VOLTS")]
    measured_vdd: Option<f32>,
}

impl Options {
    /// The level for a board.
    ///
    /// # Errors
    /// With it some boards would not start.
    fn level(&self, board: Board) -> Result<Level> {
        let level = self.level.unwrap_or(wanted(board));
        if level != Level::Three || wanted(board) == Level::Three {
            return Ok(level);
        }
        match self.measured_vdd {
            Some(volts) if volts >= LEVEL_3_FROM_VOLTS => Ok(level),
            Some(volts) => bail!(
                "level 3 needs a supply of at least {LEVEL_3_FROM_VOLTS:.1} V; at {volts:.2} V some chips would not start: level 2 is this board's"
            ),
            None => bail!(
                "level 3 resets some chips at 2.97 V, and a {} has 2.9 to 3.0 V: measure its 3V pin while the program runs, then add `--measured-vdd VOLTS` \
                 (at least {LEVEL_3_FROM_VOLTS:.1}); level 2 is this board's",
                board.feature()
            ),
        }
    }
}

/// Sets the level of a connected board, whose chip is reset.
pub(crate) fn set(board: Board, options: &Options, folder: &Path) -> Result<()> {
    let level = options.level(board)?;
    let optcr = read(board, folder)?;
    if Level::of(optcr) == level {
        eprintln!("option bytes: the brown-out reset is at level {} already", level.name());
        return Ok(());
    }
    require_unprotected(optcr)?;
    ensure!(
        optcr & FIXED == AS_DELIVERED,
        "FLASH_OPTCR reads {optcr:#010x}: the option bytes are not as delivered, and they are left as they are; \
         use another tool, for example `STM32_Programmer_CLI -c port=SWD -ob BOR_LEV={}`",
        level.field()
    );
    let [chip, word] = ["option-bytes.yaml", "option-bytes.bin"].map(|name| folder.join(name));
    std::fs::write(&chip, description()).with_context(|| format!("writing {}", chip.display()))?;
    std::fs::write(&word, level.bits().to_le_bytes()).with_context(|| format!("writing {}", word.display()))?;
    let mut download = probe::probe_rs()?;
    download.args(["download", "--chip", CHIP, "--chip-description-path"]).arg(&chip).arg("--disable-progressbars");
    download.args(["--binary-format", "bin", "--base-address", &format!("{PLACE:#x}")]).arg(&word);
    shell::stdout_of(&mut download).context("setting the brown-out reset")?;
    let new = read(board, folder)?;
    probe::reset(board)?;
    ensure!(
        new & !1 == (optcr & !0xF) | level.bits(),
        "FLASH_OPTCR reads {new:#010x} now, was {optcr:#010x}; expected is level {} and nothing else changed",
        level.name()
    );
    eprintln!("option bytes: the brown-out reset is at level {} now; it counts from the next power-on", level.name());
    if level != Level::Off {
        eprintln!(
            "if the board does not start then: feed 3.3 V to its 3V pin and run `cargo xtask board brown-out --board {} --level off`",
            board.feature()
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_and_its_bits_are_one_to_one() {
        for (level, optcr) in [
            (Level::Off, 0x0FFF_AAED),
            (Level::One, 0x0FFF_AAE9),
            (Level::Two, 0x0FFF_AAE5),
            (Level::Three, 0x0FFF_AAE1),
        ] {
            assert_eq!(Level::of(optcr), level);
            assert_eq!(level.bits(), optcr & 0xC);
        }
    }

    /// As delivered, with any level, locked or not, and with sectors that are protected from writing; not with any protection from reading, nor what a bad connection
    /// reads.
    #[test]
    fn only_option_bytes_as_delivered_are_changed() {
        for changed in [0x0FFF_AAED, 0x0FFF_AAE1, 0x0FFF_AAEC, 0x0FF0_AAED, 0x0FFF_AA2D] {
            assert_eq!(changed & FIXED, AS_DELIVERED, "{changed:#010x}");
        }
        for refused in [0, u32::MAX, 0x0FFF_55ED, 0x0FFF_CCED, 0x0FFF_FFED, 0x8FFF_AAED, 0x0FFF_AAEF, 0x0FFF_AACD] {
            assert_ne!(refused & FIXED, AS_DELIVERED, "{refused:#010x}");
        }
    }

    #[test]
    fn a_protected_chip_is_refused() {
        assert!(require_unprotected(0x0FFF_AAE1).is_ok());
        for protected in [0x0FFF_55E1, 0x0FFF_CCE1, 0x0FFF_00E1, 0x0FFF_FFE1] {
            let error = require_unprotected(protected).unwrap_err().to_string();
            assert!(error.contains("Nothing was written") && error.contains(&format!("{protected:#010x}")), "{error}");
        }
    }

    #[test]
    fn level_3_of_a_discovery_asks_for_its_supply() {
        let options = |level, measured_vdd| Options { level, measured_vdd };
        let discovery = |options: Options| options.level(Board::F4Discovery);
        assert_eq!(discovery(options(None, None)).unwrap(), Level::Two);
        assert_eq!(options(None, None).level(Board::BlackPillF411).unwrap(), Level::Three);
        assert_eq!(discovery(options(Some(Level::Three), Some(3.0))).unwrap(), Level::Three);
        for (volts, word) in
            [(None, "--measured-vdd"), (Some(2.99), "some chips would not start"), (Some(f32::NAN), "not start")]
        {
            let error = discovery(options(Some(Level::Three), volts)).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        assert_eq!(discovery(options(Some(Level::Off), None)).unwrap(), Level::Off);
    }

    /// The test vectors of RFC 4648 section 10.
    #[test]
    fn bytes_are_written_as_base64() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
