//! Data that interrupts and tasks of the firmware share: each is of a type that one side cannot read half written, and has one writer.
//!
//! Queues have one producer and one consumer by their type (`heapless::spsc`), which cannot be copied. Atomics are single words. `Signal` and
//! `Mutex` take a value as a whole, with interrupts off. What is left are few types with a cell of their own, each with its reason here.

use std::collections::BTreeSet;

use footfall_tests::workspace::{assert_none, files_ending, read};

/// Code that runs on a board.
const FIRMWARE: [&str; 3] = ["firmware/src/", "firmware-rp2040/src/", "firmware-shared/"];

/// Types of which no reader sees half a value, by their beginning.
const WHOLE: [&str; 16] = [
    "AtomicBool",
    "AtomicU8",
    "AtomicU32",
    "[AtomicU32;",
    "[[AtomicU32;",
    // One word; who may follow it is written where it is read.
    "AtomicPtr<Control>",
    // A value that is put in and taken out with interrupts off.
    "Mutex<CriticalSectionRawMutex, Cell<",
    "CriticalSectionMutex<Cell<",
    // Given away once, at the start.
    "StaticCell<",
    "ConstStaticCell<",
    // Its mutex is that of the thread: no interrupt uses it.
    "Pipe<ThreadModeRawMutex,",
    // Of the library, which starts the tasks.
    "Executor",
    // One atomic each, see below.
    "Rounds",
    // Constants, and channels whose offsets are one atomic each: `Channel` below.
    "ControlBlock",
    // Never written.
    "Crc<u32>",
    "u32;",
];

/// Types with a cell of their own: file, type, and why no half value is used.
const CELLS: [(&str, &str, &str); 7] = [
    ("firmware-shared/program/kept.rs", "Kept", "a record that was cut in two fails its check sum"),
    (
        "firmware/src/sampling.rs",
        "Blocks",
        "a block that was written while it was read is marked, and the marked set is not used",
    ),
    ("firmware/src/serial.rs", "Ring", "frames have a check sum; the counters of both ends keep the ends apart"),
    ("firmware-rp2040/src/sampling.rs", "Blocks", "as in the other family"),
    (
        "firmware-shared/program/rtt.rs",
        "Memory",
        "the offsets of writer and reader, an atomic each, keep the two apart",
    ),
    ("firmware-shared/program/rtt.rs", "Channel", "its name is never written; the rest is atomic"),
    ("firmware-shared/program/rtt.rs", "Message", "only the first message of those that interrupt each other has it"),
];

fn sources() -> impl Iterator<Item = &'static str> {
    files_ending(&[".rs"]).filter(|path| FIRMWARE.iter().any(|folder| path.starts_with(folder)))
}

/// The lines of a source that are code, without the tests at its end.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.lines().take_while(|line| *line != "#[cfg(test)]").map(str::trim).filter(|line| !line.starts_with("//"))
}

/// Name and type of each static in a source.
fn statics(text: &str) -> Vec<(&str, &str)> {
    let of_line = |line| {
        let (before, rest) = str::split_once(line, "static ")?;
        let is_item = ["", "pub", "pub(crate)", "pub(super)"].contains(&before.trim_end());
        rest.split_once(": ").filter(|_| is_item)
    };
    code(text).filter_map(of_line).collect()
}

/// What is wrong with the statics of a source.
fn wrong(path: &str, text: &str) -> Vec<String> {
    let cells: Vec<&str> = CELLS.iter().map(|(_, kind, _)| *kind).collect();
    statics(text)
        .into_iter()
        .filter(|(name, kind)| {
            let is_cell = cells.iter().any(|cell| kind.starts_with(cell));
            name.starts_with("mut ") || !(is_cell || WHOLE.iter().any(|whole| kind.starts_with(whole)))
        })
        .map(|(name, kind)| format!("{path}: {name}: {kind}"))
        .collect()
}

#[test]
fn what_is_shared_is_read_whole() {
    let mut found = 0;
    let mut all_wrong = Vec::new();
    for path in sources() {
        let text = read(path);
        found += statics(&text).len();
        all_wrong.extend(wrong(path, &text));
    }
    assert!(found > 35, "{found} statics");
    assert_none(&all_wrong, "data that could be read half written (add its type here only with a reason)");
    // What would be wrong is found.
    for line in [
        "static mut COUNT: u32 = 0;",
        "pub(crate) static BOTH: Cell<[u32; 2]> = X;",
        "static ONE: UnsafeCell<u32> = X;",
    ] {
        assert_eq!(wrong("a", line).len(), 1, "{line}");
    }
}

/// A new one has to be added here with its reason.
#[test]
fn each_cell_that_the_compiler_does_not_check_has_a_reason() {
    let mut found = BTreeSet::new();
    for path in sources() {
        let text = read(path);
        for line in code(&text).filter(|line| line.starts_with("unsafe impl") && line.contains(" Sync for ")) {
            let kind = line.split(" Sync for ").nth(1).expect("a type").trim_end_matches(" {}");
            found.insert(format!("{path}: {}", kind.split('<').next().expect("a name")));
        }
        assert!(!code(&text).any(|line| line.contains("unsafe impl") && line.contains(" Send for ")), "{path}");
    }
    let listed: BTreeSet<String> = CELLS.iter().map(|(path, kind, _)| format!("{path}: {kind}")).collect();
    assert_eq!(found, listed, "in the sources on the left, listed here on the right");
}

/// A counter is loaded and stored in two steps: it has one writer.
#[test]
fn each_counter_of_progress_has_one_writer() {
    let tasks = ["control", "sensor", "telemetry", "watchdog", "progress"];
    for (counter, writer) in [("CONTROL", "control"), ("SENSOR", "sensor"), ("TELEMETRY", "telemetry")] {
        let writers: Vec<&str> = tasks
            .into_iter()
            .flat_map(|task| {
                let calls = read(format!("firmware-shared/program/tasks/{task}.rs"))
                    .matches(&format!("{counter}.count()"))
                    .count();
                std::iter::repeat_n(task, calls)
            })
            .collect();
        assert_eq!(writers, [writer], "{counter}");
    }
}
