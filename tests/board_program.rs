//! The board proves its program and its chip before it arms, on the virtual board: a bit that changes in flash, another chip; an image without a seal arms
//! with a warning.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use firmware::seal::{Check, FLASH, SEAL, TEXT, WORDS};
use footfall_tests::board::{Board, Booted, Ran};
use footfall_tests::gestures::{hold, walk_options};
use footfall_tests::limits::assert_in_time;
use joint_loop::{Cause, GeneratorConfig, SupervisorState};
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader as _};
use object::{Endianness, Object as _, ObjectSection as _, ObjectSymbol as _};
use test_suite::{report, tests};
use wire::{Refused, Subject, Warnings};

fn main() -> ExitCode {
    test_suite::run(tests![
        an_image_is_sealed_with_the_check_sum_of_its_bytes(Image, BlackPillImage),
        a_sound_program_is_proven_before_a_hold_can_end(Image, BlackPillImage),
        a_program_with_a_changed_bit_does_not_arm(Image),
        an_image_without_a_seal_walks_and_warns(Image),
        a_build_that_demands_a_seal_does_not_arm_without_one(NoSensorImage),
        a_bit_that_changes_in_a_walk_stops_it_by_the_ramp(Image),
        another_chip_is_refused_in_words(Image, BlackPillImage),
        neither_the_librarys_timer_driver_nor_its_sine_is_linked(ImageFiles),
    ])
}

/// Rounds of telemetry, ms, and the bytes that each checks after the first pass: `firmware/src/program.rs` and `tasks/telemetry.rs`.
const ROUND_MS: f64 = 2.0;
const BYTES: f64 = 512.0;
/// A round takes longer than its wait: by its own work and that of the ticks.
const ROUND_FACTOR: f64 = 1.1;

/// An image as a file that can be changed.
#[derive(Clone)]
struct Elf(Vec<u8>);

impl Elf {
    fn read(variable: &str) -> Self {
        Self(std::fs::read(std::env::var_os(variable).expect(variable)).expect("the image"))
    }

    fn file(&self) -> object::File<'_> {
        object::File::parse(&*self.0).expect("an ELF")
    }

    /// The segments with content: where each is stored on the chip, and where in the file.
    fn segments(&self) -> Vec<(u32, Range<usize>)> {
        let (file, little) = (ElfFile32::<Endianness>::parse(&*self.0).expect("an ELF"), Endianness::Little);
        let stored = file.elf_program_headers().iter().map(|header| {
            let (offset, size) = (header.p_offset(little) as usize, header.p_filesz(little) as usize);
            (header.p_type(little), header.p_paddr(little), offset..offset + size)
        });
        stored.filter(|(kind, _, file)| *kind == PT_LOAD && !file.is_empty()).map(|(_, at, file)| (at, file)).collect()
    }

    /// Where the byte at this address of the flash is in the file.
    fn place(&self, address: u32) -> usize {
        let within = |(start, file): (u32, Range<usize>)| {
            let offset = address.checked_sub(start)? as usize;
            (offset < file.len()).then_some(file.start + offset)
        };
        self.segments().into_iter().find_map(within).unwrap_or_else(|| panic!("nothing at {address:#x}"))
    }

    fn flip(&mut self, address: u32, bit: u32) {
        let place = self.place(address);
        self.0[place] ^= 1 << bit;
    }

    /// The address after the last byte, by the seal.
    fn end(&self) -> u32 {
        let place = self.place(SEAL + 4);
        u32::from_le_bytes(self.0[place..place + 4].try_into().expect("four"))
    }

    fn symbol(&self, name: &str) -> u32 {
        let file = self.file();
        let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name)).unwrap_or_else(|| panic!("no {name}"));
        symbol.address() as u32
    }

    /// The middle of a section.
    fn middle(&self, section: &str) -> u32 {
        let file = self.file();
        let section = file.section_by_name(section).expect("a section");
        (section.address() + section.size() / 2) as u32
    }

    /// The flash after a download.
    fn flash(&self) -> Vec<u8> {
        let mut flash = vec![0xFF; FLASH.len()];
        for (address, file) in self.segments() {
            flash[(address - FLASH.start) as usize..][..file.len()].copy_from_slice(&self.0[file]);
        }
        flash
    }

    fn write(&self, folder: &Path) -> PathBuf {
        let path = folder.join("firmware.elf");
        std::fs::write(&path, &self.0).expect("written");
        path
    }

    fn run(&self, options: &[&str]) -> Ran {
        let folder = tempfile::tempdir().expect("a folder");
        Board::of(self.write(folder.path())).run(walk_options(2.0, options))
    }
}

/// The files that `cargo xtask` sealed, checked as the board does.
fn an_image_is_sealed_with_the_check_sum_of_its_bytes() {
    for image in ["FOOTFALL_ELF", "FOOTFALL_BLACK_PILL_ELF"] {
        let flash = Elf::read(image).flash();
        let bytes =
            |range: Range<u32>| &flash[(range.start - FLASH.start) as usize..(range.end - FLASH.start) as usize];
        let words: Vec<u32> = bytes(SEAL..SEAL + 4 * WORDS as u32)
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes(word.try_into().expect("four")))
            .collect();
        let mut check = Check::begin(words.try_into().expect("three")).expect("sealed");
        let result = std::iter::repeat_with(|| check.step(4_096, bytes)).flatten().next();
        assert_eq!(result, Some(Ok(())), "{image}");
    }
}

/// Tick of the first call whose program was proven; every later one is too.
fn proven_in(boot: &Booted) -> u32 {
    let unproven = boot.calls.iter().take_while(|(_, call)| call.flags.program_unproven()).count();
    let (tick, _) = boot.calls.get(unproven).expect("it is proven");
    assert!(boot.calls[unproven..].iter().all(|(_, call)| !call.flags.program_unproven()));
    *tick
}

fn a_sound_program_is_proven_before_a_hold_can_end() {
    for board in [Board::find(), Board::black_pill()] {
        let ran = board.run(walk_options(3.0, &[]));
        ran.assert_sound();
        let boot = &ran.boots[0];
        let tick = proven_in(boot);
        report!("{}: the program is proven in tick {tick}", boot.boot.as_ref().expect("a boot record").board);
        // The shortest hold that arms has 300 ms, and the test of the emergency stop comes before it.
        assert!((10..150).contains(&tick), "{tick}: at the first ticks nothing is proven yet");
        assert_eq!(boot.ticks.last().expect("frames").state, SupervisorState::Walking);
        assert!(boot.refused.is_empty(), "{:?}", boot.refused);
    }
}

/// One boot without a pulse or an edge, whose hold was refused with the cause, and what it says.
fn refusal(ran: &Ran) -> Refused {
    assert_eq!((ran.boots.len(), ran.end.resets.len()), (1, 0));
    assert!(ran.pulses.is_empty() && ran.end.edges_before_arming == 0, "{:?}", ran.pulses.first());
    let boot = &ran.boots[0];
    assert!(boot.ticks.iter().all(|tick| !tick.state.moving()));
    let last = boot.ticks.last().expect("frames");
    assert_eq!((last.state, last.cause), (SupervisorState::Disarmed, Cause::Program));
    let [refused] = boot.refused.as_slice() else { panic!("{:?}", boot.refused) };
    assert_eq!(refused.subject, Subject::Arming);
    assert!(boot.log.iter().any(|line| line.contains(refused.reason.as_str())), "{:?}", boot.log);
    refused.clone()
}

/// In the vector table, in code that no run reaches, in constants, in the first values of variables, in the check sum.
fn a_program_with_a_changed_bit_does_not_arm() {
    let image = Elf::read("FOOTFALL_ELF");
    for (what, address) in [
        ("the vector of an exception that the core does not have", FLASH.start + 0x1C),
        ("the handler of interrupts that nothing uses", image.symbol("DefaultHandler") & !1),
        ("a constant", image.middle(".rodata")),
        ("the last byte", image.end() - 1),
        ("the seal: the check sum", SEAL + 8),
    ] {
        let mut changed = image.clone();
        changed.flip(address, 6);
        let refused = refusal(&changed.run(&[]));
        report!("{what}: {}", refused.reason);
        assert!(refused.reason.contains("the program in flash was changed: check sum"), "{what}: {}", refused.reason);
    }
    for (address, words) in
        [(SEAL + 7, "it would end at 0x8"), (SEAL, "its seal begins with 0x"), (SEAL + 3, "its seal begins with 0x")]
    {
        let mut changed = image.clone();
        changed.flip(address, 7);
        let reason = refusal(&changed.run(&[])).reason;
        assert!(reason.contains(words), "{reason}");
    }
}

/// The image as `cargo build` leaves it.
fn unsealed(variable: &str) -> Elf {
    let mut image = Elf::read(variable);
    let place = image.place(SEAL);
    image.0[place..place + 4 * WORDS].fill(0xFF);
    image
}

/// With its warning at the boot, in the boot record, at the arming, and once a second. The sealed one has none.
fn an_image_without_a_seal_walks_and_warns() {
    for (image, is_sealed) in [(unsealed("FOOTFALL_ELF"), false), (Elf::read("FOOTFALL_ELF"), true)] {
        let ran = image.run(&[]);
        ran.assert_sound();
        let boot = &ran.boots[0];
        assert_eq!(boot.boot.as_ref().expect("a boot record").sealed, Some(is_sealed));
        assert!(boot.ticks.last().expect("frames").state.moving());
        assert!(!ran.pulses.is_empty() && boot.refused.is_empty(), "{:?}", boot.refused);
        let lines = boot.log.iter().filter(|line| line.starts_with("the image has no seal"));
        assert_eq!(lines.count(), if is_sealed { 0 } else { 2 }, "{:?}", boot.log);
        let warnings = Warnings::UNSEALED.when(!is_sealed);
        assert!(!boot.environment.is_empty() && boot.environment.iter().all(|chip| chip.warnings == warnings));
    }
}

/// The feature `require-seal`: the same image with a seal walks.
fn a_build_that_demands_a_seal_does_not_arm_without_one() {
    let ran = unsealed("FOOTFALL_NO_SENSOR_ELF").run(&[]);
    let refused = refusal(&ran);
    assert!(refused.reason.contains("this build demands one"), "{}", refused.reason);
    assert!(ran.boots[0].environment.iter().all(|chip| chip.warnings == Warnings::NONE), "a refusal is no warning");
    let ran = Elf::read("FOOTFALL_NO_SENSOR_ELF").run(&[]);
    assert!(ran.boots[0].ticks.last().expect("frames").state.moving());
}

/// A half-word of the flash reads otherwise from a moment of the walk on, in the first and in the last bytes of the program: found within two passes.
/// The walk ends by the short ramp, and no later hold arms.
fn a_bit_that_changes_in_a_walk_stops_it_by_the_ramp() {
    let image = Elf::read("FOOTFALL_ELF");
    let bytes = f64::from(SEAL - FLASH.start + image.end() - TEXT);
    let pass_s = bytes / BYTES * ROUND_MS * ROUND_FACTOR * 1e-3;
    let board = Board::find();
    let mut latest = 0.0_f64;
    // A change at a place that the pass has read already is found at the end of the next pass. So the first bytes have the longest times, where they
    // change soon after they were read, which one of so many moments is.
    for (address, moments) in [(FLASH.start + 0x1C, 16), (image.middle(".rodata") & !1, 3)] {
        for moment in 0..moments {
            let at = 1.5 + pass_s * (f64::from(moment) + 0.5) / f64::from(moments);
            let place = image.place(address);
            let half = u16::from_le_bytes([image.0[place], image.0[place + 1]]) ^ 0x0100;
            let script =
                format!("[[event]]\nat_s = {at}\ninject = {{ flash = {{ address = {address:#x}, half = {half} }} }}\n");
            let file = tempfile::NamedTempFile::new().expect("a file");
            std::fs::write(file.path(), script).expect("written");
            let secs = at + 2.0 * pass_s + 1.5;
            let again = hold(at + 2.0 * pass_s + 0.8);
            let script = file.path().to_str().expect("text");
            let ran = board.run(walk_options(secs, &["--script", script, "--press", &again]));
            let boot = &ran.boots[0];
            assert_eq!(
                (ran.books.different, ran.books.lost_lines, ran.boots.len()),
                (0, 0, 1),
                "{:?}",
                ran.books.differences
            );
            let frames = boot.replay(&GeneratorConfig::default_walk());
            let stops =
                frames.windows(2).find(|two| two[0].state.moving() && two[1].cause == Cause::Program).expect("a stop");
            assert_eq!(stops[1].state, SupervisorState::Stopping);
            let stopped = boot.tick_times[boot.ticks.partition_point(|tick| tick.tick < stops[1].tick)];
            assert!(
                (at..at + 2.0 * pass_s).contains(&stopped),
                "changed at {at} s, stopped at {stopped} s; a pass is {pass_s} s"
            );
            latest = latest.max(stopped - at);
            // The ramp of 0.3 s, and the pulse of the frame in which it ends.
            let last = ran.pulses.last().expect("pulses").0;
            assert!((stopped..stopped + 0.35).contains(&last), "stop at {stopped} s, last pulse at {last} s");
            let end = boot.ticks.last().expect("frames");
            assert_eq!(
                (end.state, end.cause),
                (SupervisorState::Disarmed, Cause::Program),
                "the hold at the end is refused"
            );
            let [refused] = boot.refused.as_slice() else { panic!("{:?}", boot.refused) };
            assert!(refused.reason.contains("the program in flash was changed"), "{}", refused.reason);
        }
    }
    assert_in_time("H42", latest * 1e3, "a changed bit");
    report!(
        "a changed bit is found after {latest:.2} s at most; two passes of {bytes} bytes take {:.2} s",
        2.0 * pass_s
    );
}

/// Each image on the chip of the other board: the board is not named in the file any more, so that the virtual board takes the one of its option.
fn another_chip_is_refused_in_words() {
    for (image, symbol, other, words) in [
        (
            "FOOTFALL_ELF",
            "__board_f4_discovery",
            "black-pill-f411",
            "the chip has the device id 0x431; f4-discovery has STM32F407VGTx, 0x413: flash the image of this board with `cargo xtask flash --board \
             black-pill-f411`",
        ),
        (
            "FOOTFALL_BLACK_PILL_ELF",
            "__board_black_pill_f411",
            "f4-discovery",
            "the chip has the device id 0x413; black-pill-f411 has STM32F411CEUx, 0x431: flash the image of this board with `cargo xtask flash --board \
             f4-discovery`",
        ),
    ] {
        let mut image = Elf::read(image);
        let at =
            image.0.windows(symbol.len()).position(|bytes| bytes == symbol.as_bytes()).expect("the name of the board");
        image.0[at..at + 7].copy_from_slice(b"__other");
        let ran = image.run(&["--board", other]);
        assert!(ran.pulses.is_empty() && ran.boots.len() == 1);
        assert_eq!(ran.end.edges_before_arming, 0);
        let [refused] = &ran.boots[0].refused[..] else { panic!("{:?}", ran.boots[0].refused) };
        assert_eq!((refused.subject, refused.reason.as_str()), (Subject::Configuration, words));
        assert!(ran.boots[0].ticks.is_empty(), "no tick");
    }
}

/// Whether a symbol is of the HAL's timer drivers, whose check of a duty cycle panics.
fn is_timer_driver(symbol: &str) -> bool {
    symbol.contains("13embassy_stm32") && symbol.contains("5timer")
}

/// Whether a symbol is of a library's sine, cosine or tangent, which reduce a large argument in a loop.
fn is_library_sine(symbol: &str) -> bool {
    let names = ["sin", "cos", "tan", "sincos"].map(|name| [name.to_owned(), format!("{name}f")]);
    let mut names = names.as_flattened().iter();
    let of_libm = |name: &str| symbol.contains("4libm") && symbol.contains(&format!("{}{name}", name.len()));
    symbol.contains("rem_pio2") || names.any(|name| symbol == name || of_libm(name))
}

/// The names in the machine code that is flashed; with the same search in what the libraries have, and in symbols that must be there.
fn neither_the_librarys_timer_driver_nor_its_sine_is_linked() {
    for image in ["FOOTFALL_ELF", "FOOTFALL_BLACK_PILL_ELF"] {
        let elf = Elf::read(image);
        let file = elf.file();
        let symbols: Vec<&str> = file.symbols().filter_map(|symbol| symbol.name().ok()).collect();
        assert!(symbols.len() > 300, "{}", symbols.len());
        // Other code of the same libraries is there under such names.
        for library in ["13embassy_stm32", "4libm"] {
            assert!(symbols.iter().any(|symbol| symbol.contains(library)), "{image}: no symbol of {library}");
        }
        let found: Vec<&&str> =
            symbols.iter().filter(|symbol| is_timer_driver(symbol) || is_library_sine(symbol)).collect();
        assert!(found.is_empty(), "{image}: {found:?}");
    }
    assert!(is_timer_driver("_RNvMs_NtNtCsabc_13embassy_stm325timer10simple_pwmNtB4_9SimplePwm8set_duty"));
    assert!(!is_timer_driver("_RNvNtCsabc_13embassy_stm3211time_driver5start"));
    for sine in ["sinf", "_ZN4libm4math4sinf4sinf17h0123456789abcdefE", "_RNvNtNtCsabc_4libm4math8rem_pio2", "cos"] {
        assert!(is_library_sine(sine), "{sine}");
    }
    assert!(!is_library_sine("_ZN8cpg_core4math4trig7sin_cos17h0123456789abcdefE"));
}
