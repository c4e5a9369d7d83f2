//! Names of chips, of their peripherals, pins, manuals and addresses: in the cores they are in one module alone.

use std::collections::BTreeSet;
use std::path::Path;

use footfall_tests::workspace::{CORES, assert_none, files_ending, read};

/// The one module of the cores that is about a chip, as a file or a folder.
const CHIP_MODULE: &str = "hgod-adc/src/stm32f4";

/// Peripherals, which have a number in the chip's manual.
const PERIPHERALS: [&str; 4] = ["tim", "adc", "dma", "exti"];

/// Kinds of the manufacturer's documents, which have four digits.
const DOCUMENTS: [&str; 3] = ["rm", "um", "es"];

fn digits(text: &str) -> Option<usize> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then_some(text.len())
}

/// Whether a word names a chip, a part of one, its manual, an address in it or a pin.
fn is_of_a_chip(word: &str) -> bool {
    let lower = word.to_lowercase();
    let number_after = |name: &str| lower.strip_prefix(name).and_then(digits);
    let is_pin =
        ('a'..='k').any(|port| number_after(&format!("p{port}")).is_some_and(|digits| (1..=2).contains(&digits)));
    let is_peripheral = PERIPHERALS.iter().any(|name| number_after(name).is_some_and(|digits| digits > 0));
    let is_document = DOCUMENTS.iter().any(|kind| number_after(kind) == Some(4));
    let is_chip = ["stm32", "rp2040", "cortex", "0x1fff"].iter().any(|begin| lower.starts_with(begin));
    // `vrefint` in small letters is the loop's name for the code of the internal reference.
    is_chip || is_pin || is_peripheral || is_document || ["dma", "exti"].contains(&lower.as_str()) || word == "VREFINT"
}

/// The words of a text that name a chip, with their lines. `VDDA` is any chip's analogue supply, `VDDA_...` a constant of one.
fn chip_words(text: &str) -> Vec<(usize, &str)> {
    text.lines()
        .enumerate()
        .flat_map(|(index, line)| {
            let words = line.split(|c: char| !c.is_alphanumeric()).filter(|word| is_of_a_chip(word));
            words.chain(line.contains("VDDA_").then_some("VDDA_")).map(move |word| (index + 1, word))
        })
        .collect()
}

#[test]
fn words_of_a_chip_are_recognised() {
    for word in [
        "STM32F407",
        "RP2040",
        "Cortex",
        "PA1",
        "PC13",
        "DMA",
        "DMA2",
        "EXTI0",
        "RM0090",
        "UM1472",
        "ES0182",
        "TIM1",
        "tim5",
        "ADC1",
        "VREFINT",
        "0x1FFF7A2A",
    ] {
        assert!(is_of_a_chip(word), "{word}");
    }
    for word in
        ["park", "pad", "page", "p", "phase", "vrefint", "adc", "P1", "PA123", "time", "tim", "es", "rm12", "um"]
    {
        assert!(!is_of_a_chip(word), "{word}");
    }
}

/// Outside of the one module for it. A path that leads into that module may have its name.
#[test]
fn the_cores_name_no_chip() {
    let mut found = Vec::new();
    for core in CORES {
        let sources: Vec<&str> =
            files_ending(&[".rs"]).filter(|file| file.starts_with(&format!("{core}/src/"))).collect();
        assert!(!sources.is_empty(), "{core} has no sources");
        for file in sources.into_iter().filter(|file| !file.starts_with(CHIP_MODULE)) {
            let text = read(file).replace("::stm32f4", "").replace("stm32f4::", "").replace("mod stm32f4;", "");
            found.extend(chip_words(&text).into_iter().map(|(line, word)| format!("{file}:{line}: `{word}`")));
        }
    }
    assert_none(&found, &format!("names of chips in the cores (they belong into {CHIP_MODULE})"));
}

#[test]
fn the_module_of_the_chip_names_it() {
    let is_of_it = |file: &&str| file.starts_with(CHIP_MODULE);
    assert!(files_ending(&[".rs"]).filter(is_of_it).any(|file| !chip_words(&read(file)).is_empty()));
}

/// The registers that several modules of the firmware share, see the head of its `main.rs`.
const SHARED: [&str; 2] = ["RCC", "DBGMCU"];

/// The peripherals that a text takes from the access crate: `pac::TIM1`, `pac::{RCC, TIM5}`.
fn peripherals(text: &str) -> BTreeSet<&str> {
    let is_name = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
    let lists = text.split("pac::").skip(1).map(|rest| match rest.strip_prefix('{') {
        Some(list) => list.split('}').next().unwrap_or_default(),
        None => rest.split(|c| !is_name(c)).next().unwrap_or_default(),
    });
    lists
        .flat_map(|list| list.split(','))
        .map(str::trim)
        .filter(|name| !name.is_empty() && name.chars().all(is_name))
        .collect()
}

/// A file of the program for the STM32F4, or one that it shares with other families.
fn is_of_the_family(path: &str) -> bool {
    path.starts_with("firmware/src/") || path.starts_with("firmware-shared/")
}

/// The table of the firmware's `main.rs` names each peripheral once, with the one module that uses it.
#[test]
fn each_peripheral_belongs_to_one_module() {
    let mut used = BTreeSet::new();
    for path in files_ending(&[".rs"]).filter(|path| is_of_the_family(path)) {
        let module = Path::new(path).file_stem().and_then(|stem| stem.to_str()).expect("a name");
        let text = read(path);
        let own = peripherals(&text).into_iter().filter(|name| !SHARED.contains(name));
        used.extend(own.map(|name| format!("{name} in {module}")));
    }
    assert!(used.len() > 10, "{used:?}");
    let main = read("firmware/src/main.rs");
    let rows = main.lines().filter_map(|line| line.strip_prefix("//! | ")?.strip_suffix("`] |")?.split_once(" | [`"));
    let stated: BTreeSet<_> = rows
        .flat_map(|(names, module)| peripherals_of_row(names).map(move |name| format!("{name} in {module}")))
        .collect();
    assert_eq!(used, stated, "used by the modules on the left, stated in firmware/src/main.rs on the right");
}

/// What the firmware may do with the interface of the flash: set wait states and caches, and read the option bytes.
const FLASH_ACCESS: [&str; 3] = ["FLASH.acr().read(", "FLASH.acr().modify(", "FLASH.optcr().read("];

/// Keys, control register and status of the interface are never touched, so nothing is erased or programmed (hazards H33 to H43 and H59).
#[test]
fn the_firmware_writes_no_flash() {
    let mut allowed = 0;
    let mut other = Vec::new();
    for path in files_ending(&[".rs"]).filter(|path| is_of_the_family(path)) {
        let text = read(path);
        let takes_it = peripherals(&text).contains("FLASH");
        for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//")) {
            let accesses = if takes_it { line.matches("FLASH.").count() } else { 0 };
            let known: usize = FLASH_ACCESS.iter().map(|access| line.matches(access).count()).sum();
            allowed += known;
            // The base address of the interface (RM0090 2.3), and the HAL's driver.
            if accesses > known
                || line.to_lowercase().replace('_', "").contains("0x40023c")
                || line.contains("embassy_stm32::flash")
            {
                other.push(format!("{path}:{}: {}", index + 1, line.trim()));
            }
        }
    }
    assert!(allowed > 0, "no access to the interface of the flash was found: the test looks at the wrong text");
    assert_none(&other, "accesses to the interface of the flash that may change it");
}

/// The names in the first column, without the parts of the processor itself.
fn peripherals_of_row(names: &str) -> impl Iterator<Item = &str> {
    names.split(", ").filter(|name| !name.contains(" of the core"))
}
