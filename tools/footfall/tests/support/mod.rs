//! A stand-in for image and virtual board: an ELF file with a log table of one format string, and a script that plays lines
//! which a host copy of the loop has made.
#![allow(dead_code, reason = "each test file uses a part of it")]

use footfall::board::default_loop::{BoardLoop, TYPICAL_MIN_SUPPLY, TYPICAL_VREFINT_CAL, typical_loop};
use footfall::board::image::sha256;
use footfall::board::lines::{self, BoardLine, RECORDS};
use footfall::board::transport::{Heard, Transport};
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::generator_record::record_of;
use joint_loop::store::{robot_record, sensor_record};
use joint_loop::{BoardFaults, RecordName, RobotConfig, SENSORS, Sample, WatchdogHz};
use joint_units::AdcCode;
use object::write::{Object, StandardSegment, Symbol, SymbolSection};
use object::{Architecture, BinaryFormat, Endianness, SectionKind, SymbolFlags, SymbolKind, SymbolScope};
use serde_json::json;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;
use wire::{Boot, BrownOut, Call, Frame, Inputs, MAX_FRAME_BYTES, Record, RecordId, Reset, frame_record};

/// What a board gives its loop in a tick.
type BoardSample = Sample<SENSORS>;

/// Where the one format string, `{=str}` at level info, lies in the log table.
const INDEX: u16 = 1;

/// An ELF file whose log holds any text.
pub(crate) fn elf() -> Vec<u8> {
    elf_of("f4-discovery")
}

/// The same of a board with this name.
pub(crate) fn elf_of(board: &str) -> Vec<u8> {
    let mut elf = Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
    let section =
        elf.add_section(elf.segment_name(StandardSegment::Data).to_vec(), b".defmt".to_vec(), SectionKind::Data);
    elf.append_section_data(section, &[0; 8], 1);
    let constants = elf.add_section(Vec::new(), b".rodata".to_vec(), SectionKind::ReadOnlyData);
    elf.append_section_data(constants, board.as_bytes(), 1);
    let format = r#"{"package":"t","disambiguator":"1","tag":"defmt_info","data":"{=str}","crate_name":"t"}"#;
    for (name, value, of) in [
        ("_defmt_version_ = 4", 0, SymbolSection::Absolute),
        ("_defmt_encoding_ = rzcobs", 0, SymbolSection::Absolute),
        (format, INDEX.into(), SymbolSection::Section(section)),
    ] {
        elf.add_symbol(Symbol {
            name: name.into(),
            value,
            size: 1,
            kind: SymbolKind::Data,
            scope: SymbolScope::Linkage,
            weak: false,
            section: of,
            flags: SymbolFlags::None,
        });
    }
    elf.write().unwrap()
}

/// A frame of the log with that text, as `defmt` encodes it.
pub(crate) fn frame(text: &str) -> Vec<u8> {
    let mut bytes = INDEX.to_le_bytes().to_vec();
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
    rzcobs(&bytes)
}

/// Reverse zero-compressing COBS, with the zero that ends a frame.
fn rzcobs(bytes: &[u8]) -> Vec<u8> {
    let (mut out, mut run, mut zeros) = (Vec::new(), 0_u8, 0_u8);
    for &byte in bytes {
        if run < 7 {
            if byte == 0 {
                zeros |= 1 << run;
            } else {
                out.push(byte);
            }
            run += 1;
            if run == 7 && zeros != 0 {
                out.push(zeros);
                (run, zeros) = (0, 0);
            }
        } else if byte == 0 {
            out.push((run - 7) | 0x80);
            (run, zeros) = (0, 0);
        } else {
            out.push(byte);
            run += 1;
            if run == 134 {
                out.push(0xff);
                (run, zeros) = (0, 0);
            }
        }
    }
    match run {
        0 => {}
        1..=6 => out.push((zeros | (0xff << run)) & 0x7f),
        _ => out.push((run - 7) | 0x80),
    }
    out.push(0);
    out
}

/// The frame of a record.
pub(crate) fn framed(record: &Record) -> Vec<u8> {
    frame_record(record, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

/// Bytes with the check sum of a frame, as one.
pub(crate) fn framed_bytes(payload: &[u8]) -> Vec<u8> {
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(payload).to_le_bytes();
    let mut frame = Vec::new();
    for group in [payload, &sum].concat().split(|byte| *byte == 0) {
        frame.push(group.len() as u8 + 1);
        frame.extend(group);
    }
    frame.push(0);
    frame
}

/// The records in the lines of a board, each with the place of its line.
pub(crate) fn records(lines: &[String]) -> Vec<(usize, Record)> {
    let mut transport = Transport::default();
    let mut all = Vec::new();
    for (place, line) in lines.iter().enumerate() {
        if let Ok(BoardLine::Rtt { channel: RECORDS, bytes, .. }) = lines::parse(line) {
            let pushed = transport.push(&bytes, |heard| {
                if let Heard::Record(record) = heard {
                    all.push((place, record));
                }
            });
            pushed.unwrap();
        }
    }
    all
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A simulated board: the default loop on the host.
pub(crate) struct SimulatedBoard {
    joints: BoardLoop,
    calls: Vec<Call>,
    pub(crate) lines: Vec<String>,
    t_ms: u32,
}

impl SimulatedBoard {
    pub(crate) fn new() -> Self {
        let start = json!({ "type": "start", "elf_sha256": sha256(&elf()), "hclk_hz": 16_000_000 });
        let mut simulated =
            Self { joints: typical_loop().unwrap(), calls: vec![], lines: vec![start.to_string()], t_ms: 0 };
        simulated.boot("power_on");
        simulated
    }

    fn boot(&mut self, cause: &str) {
        self.line(json!({ "type": "boot", "t_s": self.t_s(), "cause": cause }));
        let default = Parameters::with_defaults(None, None, RobotConfig::default_biped()).unwrap();
        let name = RecordName::BUILT_IN;
        let id = |crc| Some(RecordId::new(name.as_str(), crc));
        let generator = record_of(&default.generator, &name).crc();
        let sensors = sensor_record::record_of(&default.sensors, &name).crc();
        let reset = Reset::ALL.into_iter().find(|reset| reset.name() == cause).unwrap();
        self.record(&Record::Boot(Boot {
            version: wire::VERSION,
            board: "f4-discovery".try_into().unwrap(),
            chip: "STM32F407VGTx".try_into().unwrap(),
            reset,
            streak: 0,
            reference_cal: TYPICAL_VREFINT_CAL.0,
            min_supply_v: TYPICAL_MIN_SUPPLY.0,
            sensor_required: true,
            generator: id(generator),
            sensors: id(sensors),
            robot: id(robot_record::record_of(&default.robot, &name).crc()),
            shadow: false,
            last_outputs: None,
            sealed: Some(true),
            brown_out: BrownOut { level: 3, wanted: 3 },
        }));
    }

    /// A reset: the loop starts again, records that were not sent are lost.
    pub(crate) fn reset(&mut self) {
        self.joints = typical_loop().unwrap();
        self.calls.clear();
        self.t_ms += 5;
        self.boot("iwdg");
    }

    pub(crate) fn t_s(&self) -> f64 {
        f64::from(self.t_ms) / 1000.0
    }

    pub(crate) fn line(&mut self, line: serde_json::Value) {
        self.lines.push(line.to_string());
    }

    pub(crate) fn log(&mut self, text: &str) {
        self.line(json!({ "type": "rtt", "t_s": self.t_s(), "channel": 0, "hex": hex(&frame(text)) }));
    }

    pub(crate) fn record(&mut self, record: &Record) {
        self.line(json!({ "type": "rtt", "t_s": self.t_s(), "channel": 1, "hex": hex(&framed(record)) }));
    }

    /// Ticks, with the button held or not; each as the board would tell it.
    pub(crate) fn tick(&mut self, ticks: u32, button: bool) {
        self.tick_with(ticks, button, |_| {});
    }

    /// No frame comes for so long; the virtual board goes on.
    pub(crate) fn silent(&mut self, ms: u32) {
        for _ in 0..ms {
            self.t_ms += 1;
            if self.t_ms.is_multiple_of(100) {
                self.line(json!({ "type": "status", "t_s": self.t_s(), "armed": false }));
            }
        }
    }

    /// Late ticks that the board has counted since its boot.
    pub(crate) fn late(&self) -> u32 {
        Frame::from(&self.joints.frame()).late
    }

    /// The same, with changed samples.
    pub(crate) fn tick_with(&mut self, ticks: u32, button: bool, changed: impl Fn(&mut BoardSample)) {
        for _ in 0..ticks {
            let knee = 2200.0 + 500.0 * (f64::from(self.t_ms) * 0.0057).sin();
            let vrefint = AdcCode(1652);
            let codes = [AdcCode(knee as u16), AdcCode(0), AdcCode(0), AdcCode(0)];
            // After each boot the emergency stop is tested.
            let is_test = (25..50).contains(&self.joints.frame().tick);
            let faults = if is_test { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE };
            // At its first tick a board has measured the clock of its watchdog.
            let watchdog_clock = (self.joints.frame().tick == 0).then_some(WatchdogHz(32_000));
            let mut sample = Sample { codes, vrefint, button, faults, watchdog_clock, ..Sample::default() };
            changed(&mut sample);
            let command = self.joints.tick(&sample);
            self.calls.push(Call::of(&sample, 1));
            self.t_ms += 1;
            if self.calls.len() == 10 {
                let frame = self.joints.frame();
                let calls = std::mem::take(&mut self.calls).into_iter().collect();
                self.record(&Record::Inputs(Inputs { first_tick: frame.tick - 9, calls }));
                self.record(&Record::Frame(Frame::from(&frame)));
            }
            if self.t_ms.is_multiple_of(20) && command.pulses.is_some() {
                let us = command.pulses.map(|pulses| pulses.map(|pulse| f64::from(pulse.0)));
                self.line(json!({ "type": "pulses", "t_s": self.t_s(), "us": us }));
            }
            if self.t_ms.is_multiple_of(100) {
                self.line(json!({ "type": "status", "t_s": self.t_s(), "armed": command.pulses.is_some() }));
            }
        }
    }

    /// Arms after 0.4 s and walks to the end of that many seconds.
    pub(crate) fn walk(&mut self, secs: u32) {
        self.tick(50, false);
        self.tick(350, true);
        self.tick(secs * 1000 - 400, false);
    }

    pub(crate) fn end(&mut self) {
        self.end_as("time", json!({}));
    }

    pub(crate) fn end_as(&mut self, reason: &str, other: serde_json::Value) {
        let mut end = json!({
            "type": "end", "t_s": self.t_s(), "reason": reason, "unmodelled": 0, "lints": [], "resets": [], "edges": { "PE9": 4 },
            "edges_before_arming": 0, "edges_after_disarming": 0,
            "pulse_us": [[1300.5, 1800.0], [1200.0, 1700.0], [900.0, 1600.0], null], "instructions": 5,
        });
        for (key, value) in other.as_object().unwrap() {
            end[key] = value.clone();
        }
        self.line(end);
    }
}

/// A folder with the image and a board that plays lines.
pub(crate) struct Bench {
    pub(crate) folder: tempfile::TempDir,
}

impl Bench {
    /// The board writes these lines and ends.
    pub(crate) fn plays(lines: &[String]) -> Self {
        Self::with(lines, "exit 0\n")
    }

    /// The board writes these lines, waits until it is asked to end, and writes the last one.
    pub(crate) fn waits(lines: &[String]) -> Self {
        let (last, first) = lines.split_last().unwrap();
        let quit = format!(
            "trap '' INT TERM\nwhile read word; do\n  if [ \"$word\" = quit ]; then\n    cat <<'END'\n{last}\nEND\n    exit 0\n  fi\ndone\n"
        );
        Self::with(first, &quit)
    }

    /// The board waits for the file `go`, then writes these lines as slowly as one that runs in real time, about, and ends.
    pub(crate) fn paced(lines: &[String]) -> Self {
        let bench = Self::with(&[String::new()], "");
        std::fs::write(bench.path("paced"), lines.join("\n") + "\n").unwrap();
        let folder = bench.folder.path().display();
        let script = format!(
            "#!/bin/sh\necho \"$@\" > {folder}/arguments\nwhile [ ! -e {folder}/go ]; do sleep 0.02; done\nn=0\n\
             while IFS= read -r line; do\n  printf '%s\\n' \"$line\"\n  n=$((n + 1))\n  \
             if [ $((n % 26)) = 0 ]; then sleep 0.1; fi\ndone < {folder}/paced\n"
        );
        std::fs::write(bench.path("board"), script).unwrap();
        bench
    }

    fn with(lines: &[String], then: &str) -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::write(bench.path("fw.elf"), elf()).unwrap();
        std::fs::write(bench.path("lines"), lines.join("\n") + "\n").unwrap();
        let board = bench.path("board");
        let folder = bench.folder.path().display();
        let script = format!(
            "#!/bin/sh\necho \"$@\" > {folder}/arguments\ncp \"$3\" {folder}/volts.csv\ncat {folder}/lines\n{then}"
        );
        std::fs::write(&board, script).unwrap();
        std::fs::set_permissions(&board, std::fs::Permissions::from_mode(0o755)).unwrap();
        bench
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// `footfall watch` on this bench.
    pub(crate) fn watch(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
        command.arg("watch").arg("--elf").arg(self.path("fw.elf")).arg("--virtual-board").arg(self.path("board"));
        command
    }
}
