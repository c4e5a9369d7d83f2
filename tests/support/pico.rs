//! The image of the Raspberry Pi Pico on rp2040js, an emulator that this project did not write.
//!
//! `FOOTFALL_PICO_ELF` and `FOOTFALL_PICO_UF2` name the image and the file that the boot loader takes, which the emulator reads; `cargo xtask test
//! --only pico` sets them and installs the emulator and the boot ROM. `FOOTFALL_PICO_FIRST_WALK` is the folder of the files that the commands of
//! docs/pico.md have written to the drive. A test that uses them names [`test_suite::Need::PicoImage`].

use std::path::{Path, PathBuf};
use std::process::Command;

use footfall::board::image::Image;
use footfall::board::transport::{Heard, Transport};
use serde_json::{Value, json};
use wire::Record;

use crate::board::Booted;

/// A run.
#[derive(Debug)]
pub struct PicoRan {
    /// Boots in order.
    pub boots: Vec<Booted>,
    /// Rising and falling edges of each servo line in turn, ns of emulated time.
    pub servos: [Vec<f64>; 4],
    /// The same of the servo-rail enable.
    pub rail: Vec<f64>,
    /// Resets by the watchdog: when, s, and `timer` or `force`.
    pub resets: Vec<(f64, String)>,
    /// Warnings of the emulator, each once.
    pub messages: Vec<String>,
    /// Frequency of the core at the end, Hz.
    pub core_hz: f64,
    /// Bytes that the host at the USB received from the serial port.
    pub serial: Vec<u8>,
    /// How often the host enumerated the board.
    pub usb_connections: u64,
    /// What the computer found at the drive of the boot ROM, and what the ROM made of the file.
    pub drive: Drive,
}

/// The drive of the boot ROM, in a run with `drive`.
#[derive(Debug)]
pub struct Drive {
    /// Names of its files, as the directory has them.
    pub files: Vec<String>,
    /// The text of `INFO_UF2.TXT`.
    pub info: String,
    /// Addresses of the pages that are in flash otherwise than in the file.
    pub flash_differs: Vec<u32>,
}

/// An image: the file for the boot ROM, and the ELF file for its log.
#[derive(Debug, Clone)]
pub struct PicoImage {
    /// UF2.
    pub uf2: PathBuf,
    /// ELF.
    pub elf: PathBuf,
}

impl PicoImage {
    /// The usual image with the default robot.
    ///
    /// # Panics
    /// The variables are not set.
    #[must_use]
    pub fn usual() -> Self {
        let path = |variable: &str| PathBuf::from(std::env::var_os(variable).expect(variable));
        Self { uf2: path("FOOTFALL_PICO_UF2"), elf: path("FOOTFALL_PICO_ELF") }
    }

    /// One of the files that the commands of docs/pico.md have written: `shadow` or `walk`.
    ///
    /// # Panics
    /// The variable is not set.
    #[must_use]
    pub fn of_the_first_walk(name: &str) -> Self {
        let folder = PathBuf::from(std::env::var_os("FOOTFALL_PICO_FIRST_WALK").expect("FOOTFALL_PICO_FIRST_WALK"));
        let file = |extension: &str| folder.join(name).with_extension(extension);
        Self { uf2: file("uf2"), elf: file("elf") }
    }
}

/// The folder of the emulator.
#[must_use]
pub fn emulator() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("firmware-rp2040").join("emulator")
}

/// Runs the usual image with a scenario, as `run.mjs` describes it, and these records in flash, each with its address.
///
/// # Panics
/// The emulator cannot be started, or the log cannot be read.
#[must_use]
pub fn run(scenario: &Value, flash: &[(u32, &[u8])]) -> PicoRan {
    run_image(&PicoImage::usual(), scenario, flash)
}

/// The same with another image.
///
/// # Panics
/// The emulator cannot be started, or the log cannot be read.
#[must_use]
pub fn run_image(image: &PicoImage, scenario: &Value, flash: &[(u32, &[u8])]) -> PicoRan {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let mut scenario = scenario.clone();
    for (address, bytes) in flash {
        let record = file(&format!("{address:#x}.bin"));
        std::fs::write(&record, bytes).expect("written");
        scenario["flash"].as_array_mut().expect("a list").push(json!({"address": address, "file": record}));
    }
    std::fs::write(file("scenario.json"), scenario.to_string()).expect("written");
    let mut node = Command::new("node");
    node.arg(emulator().join("run.mjs")).arg(&image.uf2).args(["scenario.json", "log", "records", "serial"].map(file));
    let output = node.output().expect("node starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let ran: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let image = Image::read(&image.elf).unwrap_or_else(|error| panic!("{error}"));
    let numbers =
        |value: &Value| value.as_array().expect("a list").iter().map(|n| n.as_f64().expect("a number")).collect();
    let servos = [0, 1, 2, 3].map(|servo| numbers(&ran["servos_ns"][servo]));
    let reset = |reset: &Value| (reset["s"].as_f64().expect("s"), reset["reason"].as_str().expect("reason").to_owned());
    let texts = |value: &Value| {
        value.as_array().expect("a list").iter().map(|text| text.as_str().expect("text").to_owned()).collect()
    };
    PicoRan {
        boots: boots(
            &image,
            &std::fs::read(file("log")).expect("a log"),
            &std::fs::read(file("records")).expect("records"),
        ),
        servos,
        rail: numbers(&ran["servo_rail_ns"]),
        resets: ran["resets"].as_array().expect("a list").iter().map(reset).collect(),
        messages: texts(&ran["messages"]),
        core_hz: ran["core_hz"].as_f64().expect("a frequency"),
        serial: std::fs::read(file("serial")).expect("bytes"),
        usb_connections: ran["usb_connections"].as_u64().expect("a number"),
        drive: drive(&ran["drive"]),
    }
}

/// The drive of a run; nothing in it where the run had none.
fn drive(ran: &Value) -> Drive {
    let list = |key: &str| ran[key].as_array().into_iter().flatten();
    Drive {
        files: list("files").filter_map(|name| name.as_str().map(str::to_owned)).collect(),
        info: ran["info"].as_str().unwrap_or_default().to_owned(),
        flash_differs: list("flash_differs").filter_map(|address| u32::try_from(address.as_u64()?).ok()).collect(),
    }
}

/// What was logged and reported, with a boot for each boot record. The first line of a boot names the reset.
fn boots(image: &Image, log: &[u8], records: &[u8]) -> Vec<Booted> {
    let mut boots: Vec<Booted> = Vec::new();
    let pushed = Transport::default().push(records, |heard| match heard {
        Heard::Record(record) => {
            if matches!(record, Record::Boot(_)) {
                boots.push(Booted::default());
            }
            boots.last_mut().expect("a boot record is the first").take(record);
        }
        Heard::Damaged => panic!("a damaged frame"),
    });
    pushed.unwrap_or_else(|error| panic!("{error}"));
    let mut decoder = image.decoder();
    decoder.push(log);
    let mut lines = 0;
    while let Some(message) = decoder.message() {
        let message = message.expect("whole frames");
        lines += usize::from(message.text.contains(": reset "));
        boots.get_mut(lines.saturating_sub(1)).expect("a boot for each line that names the reset").read(message);
    }
    boots
}
