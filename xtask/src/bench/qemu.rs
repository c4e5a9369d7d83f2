//! QEMU as second witness: it must count the same instructions as the virtual board in each call of the program `witness` of tests/step-cost.

use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::qemu_log::Counter;
use super::{beside_c, counted};
use crate::emulated::{self, QEMU};
use crate::image;
use crate::shell;
use crate::workspace::{C_COMPILER, Workspace};

/// The functions that are counted begin so: whole ticks of the control loop, a step of a generator, a step with angles.
const COUNTED: [&str; 3] = ["loop_", "step_", "tick_"];
/// QEMU takes half a minute; a program that does not end writes for ever.
const DEADLINE: Duration = Duration::from_secs(600);
/// Messages of QEMU that an error shows.
const MESSAGES: usize = 20;

/// The counts, which are equal; an error names each function that differs. null where there is no QEMU.
pub(super) fn measure(workspace: &Workspace, virtual_board: &Path, board_cost: &Path, folder: &Path) -> Result<Value> {
    if shell::on_path(QEMU).is_none() {
        eprintln!(
            "bench: no {QEMU}, so it counts nothing beside the virtual board; Debian has it in a package of this name"
        );
        return Ok(Value::Null);
    }
    eprintln!("bench: the same instructions on QEMU");
    let program = workspace.witness()?;
    let elf = std::fs::read(&program).with_context(|| format!("reading {}", program.display()))?;
    let names = functions(&elf)?;
    let with_c = shell::on_path(C_COMPILER).is_some();
    let (_, on_board) = counted::functions(virtual_board, board_cost, &program, folder, &names, &["--calls"])?;
    let version = version(&shell::stdout_of(shell::command(QEMU).arg("--version"))?)?;
    let (on_qemu, instructions) = run(&program, Counter::new(elf, &names)?, version)?;
    let mut differences = Vec::new();
    let mut rows = Vec::new();
    for (name, calls) in names.iter().zip(&on_qemu) {
        let board: Vec<u64> = serde_json::from_value(on_board["calls"][name].clone())
            .with_context(|| format!("board-cost lists no calls of {name}"))?;
        differences.extend(difference(name, calls, &board));
        let row = counted::row(&on_board, name)?;
        let sum: u64 = calls.iter().sum();
        rows.push(json!({ "function": name, "calls": calls.len(), "instructions": row["instructions"], "sum": sum }));
    }
    ensure!(differences.is_empty(), "QEMU and the virtual board count differently:\n{}", differences.join("\n"));
    let [major, minor] = version;
    Ok(json!({
        "version": format!("{major}.{minor}"),
        "compiler": on_board["compiler"],
        "with_c": with_c,
        "program_instructions": instructions,
        "functions": rows,
    }))
}

/// Compares all calls, of the functions of docs/performance.json, whose content is `baseline`; what was compared.
pub(super) fn compare(workspace: &Workspace, virtual_board: &Path, baseline: &Value) -> Result<String> {
    let folder = workspace.target_dir.join("bench");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let measured = measure(workspace, virtual_board, &workspace.board_cost()?, &folder)?;
    same_calls(&measured, &baseline["qemu"])?;
    let (functions, calls, instructions) = totals(&measured)?;
    let without = if measured["with_c"] == true {
        String::new()
    } else {
        format!(", without the steps beside C: no {C_COMPILER}")
    };
    Ok(format!("{instructions} instructions in {calls} calls of {functions} functions{without}"))
}

/// An error if functions or their numbers of calls are others than those in docs/performance.json, so that nothing is left out unseen. Without C
/// the functions that it adds are not looked for, and those that it calls too are called less often.
fn same_calls(measured: &Value, baseline: &Value) -> Result<()> {
    let rows = |of: &Value| -> Result<Vec<(String, u64)>> {
        let rows = of["functions"].as_array().context("no counted function")?;
        let row = |row: &Value| Some((row["function"].as_str()?.to_owned(), row["calls"].as_u64()?));
        rows.iter().map(|of| row(of).context("a row without function or calls")).collect()
    };
    let with_c = measured["with_c"] == true;
    let is_compared = |name: &str| with_c || COUNTED.iter().any(|begin| name.starts_with(begin));
    let (measured, mut baseline) = (rows(measured)?, rows(baseline)?);
    baseline.retain(|(name, _)| is_compared(name));
    for (name, calls) in &baseline {
        let found = measured.iter().find(|(other, _)| other == name);
        let (_, now) =
            found.with_context(|| format!("{name} is in docs/performance.json and is not counted any more"))?;
        ensure!(
            now == calls || !with_c && !name.starts_with("loop_"),
            "{name} is called {now} times, {calls} times in docs/performance.json: `cargo xtask bench board --only-qemu --write` writes it again"
        );
    }
    let new = measured.iter().find(|(name, _)| !baseline.iter().any(|(other, _)| other == name));
    ensure!(
        new.is_none(),
        "{new:?} is not in docs/performance.json: `cargo xtask bench board --only-qemu --write` writes it again"
    );
    Ok(())
}

/// Numbers of functions, calls, and instructions in them.
pub(super) fn totals(measured: &Value) -> Result<(usize, u64, u64)> {
    let rows = measured["functions"].as_array().context("QEMU counted no function")?;
    let sum = |key: &str| rows.iter().map(|row| row[key].as_u64()).sum::<Option<u64>>().context("a count is missing");
    Ok((rows.len(), sum("calls")?, sum("sum")?))
}

/// The functions that are counted. The compiler gives some that have the same code one address: they are one function, by the first of the names.
fn functions(elf: &[u8]) -> Result<Vec<String>> {
    let mut all = image::functions(elf)?;
    all.sort();
    let beside_c = if shell::on_path(C_COMPILER).is_some() { beside_c::functions() } else { Vec::new() };
    let (mut names, mut addresses) = (Vec::new(), Vec::new());
    for begin in COUNTED {
        let found = all.iter().filter(|(name, _)| name.starts_with(begin));
        ensure!(found.clone().count() > 0, "the program has no function {begin}...");
        names.extend(found);
    }
    for name in &beside_c {
        let found = all.iter().find(|(symbol, _)| symbol == name);
        names.push(found.with_context(|| format!("the program has no function {name}"))?);
    }
    names.retain(|(_, address)| {
        let is_new = !addresses.contains(address);
        addresses.push(*address);
        is_new
    });
    Ok(names.into_iter().map(|(name, _)| name.clone()).collect())
}

/// The first call that differs, in words.
fn difference(name: &str, qemu: &[u64], board: &[u64]) -> Option<String> {
    let first = qemu.iter().zip(board).position(|(qemu, board)| qemu != board);
    match first {
        Some(place) => Some(format!(
            "{name}, call {} of {}: {} instructions on QEMU, {} on the virtual board",
            place + 1,
            board.len(),
            qemu[place],
            board[place]
        )),
        None if qemu.len() != board.len() => {
            Some(format!("{name}: {} calls on QEMU, {} on the virtual board", qemu.len(), board.len()))
        }
        None => None,
    }
}

/// Major and minor number in what QEMU says of its version.
fn version(text: &str) -> Result<[u32; 2]> {
    let words = text.split_whitespace().skip_while(|word| *word != "version").nth(1);
    // A candidate has words behind its numbers: 10.0-rc1.
    let numbers = words.unwrap_or_default().split('.').map(|number| number.split('-').next().unwrap_or_default());
    let mut numbers = numbers.map_while(|number| number.parse().ok());
    let both = numbers.next().zip(numbers.next());
    let (major, minor) = both.with_context(|| format!("{QEMU} names no version: `{}`", text.trim()))?;
    Ok([major, minor])
}

/// What makes each translated block one instruction: an option of its own until 8.0.
const fn one_instruction_a_block([major, minor]: [u32; 2]) -> &'static [&'static str] {
    if major > 8 || major == 8 && minor > 0 { &["-accel", "tcg,one-insn-per-tb=on"] } else { &["-singlestep"] }
}

/// Runs the program on QEMU.
fn run(program: &Path, counter: Counter, version: [u32; 2]) -> Result<(Vec<Vec<u64>>, u64)> {
    // What the program prints would go between the lines of the log.
    let mut qemu = emulated::qemu(",chardev=printed");
    qemu.args(["-chardev", "null,id=printed"]).args(one_instruction_a_block(version));
    qemu.args(["-d", "exec,nochain", "-kernel"]).arg(program);
    counted(&mut qemu, counter, DEADLINE)
}

/// Runs QEMU and counts while it writes its log: as a file, that would have a gigabyte.
fn counted(qemu: &mut Command, counter: Counter, deadline: Duration) -> Result<(Vec<Vec<u64>>, u64)> {
    let mut child = qemu
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("starting {QEMU}"))?;
    let log = child.stderr.take().context("no standard error to read")?;
    let (sender, receiver) = channel();
    // Nobody waits for it after the deadline: where QEMU is started by another program, the log stays open when that one is killed.
    std::thread::spawn(move || drop(sender.send(count(log, counter))));
    let counted = receiver.recv_timeout(deadline);
    // It has closed its log, or it is to end.
    if !matches!(counted, Ok(Ok(_))) {
        let _ = child.kill();
    }
    let status = child.wait().with_context(|| format!("waiting for {QEMU}"))?;
    let (counter, messages) = counted.with_context(|| format!("{QEMU} still runs at its deadline"))??;
    ensure!(status.success(), "the program fails on QEMU ({status})\n{}", messages.join("\n"));
    counter.finish()
}

/// Counts a log to its end; the last messages are beside it.
fn count(log: impl Read, mut counter: Counter) -> Result<(Counter, Vec<String>)> {
    let mut log = BufReader::with_capacity(1 << 20, log);
    let (mut line, mut messages) = (Vec::new(), Vec::new());
    while log.read_until(b'\n', &mut line).context("reading QEMU's log")? > 0 {
        if !counter.line(&line)? {
            if messages.len() == MESSAGES {
                messages.remove(0);
            }
            messages.push(String::from_utf8_lossy(&line).trim_end().to_owned());
        }
        line.clear();
    }
    Ok((counter, messages))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_names_function_call_and_both_counts() {
        assert_eq!(difference("step", &[3, 4], &[3, 4]), None);
        let text = difference("step", &[3, 4, 5], &[3, 5, 6]).unwrap();
        assert_eq!(text, "step, call 2 of 3: 4 instructions on QEMU, 5 on the virtual board");
        assert_eq!(difference("step", &[3], &[3, 3]).unwrap(), "step: 1 calls on QEMU, 2 on the virtual board");
        assert_eq!(difference("step", &[4], &[3, 3]).unwrap().split(':').next(), Some("step, call 1 of 2"));
    }

    #[test]
    fn each_version_of_qemu_has_its_option() {
        let of = |text: &str| one_instruction_a_block(version(text).unwrap())[0];
        assert_eq!(of("QEMU emulator version 7.2.22 (Debian 1:7.2+dfsg-7)\nCopyright"), "-singlestep");
        assert_eq!(of("QEMU emulator version 8.0.4"), "-singlestep");
        assert_eq!(of("QEMU emulator version 8.1.0"), "-accel");
        assert_eq!(of("QEMU emulator version 10.0.2"), "-accel");
        assert_eq!(of("QEMU emulator version 8.1-rc2"), "-accel");
        assert!(version("another program").is_err());
    }

    #[test]
    fn a_function_that_is_left_out_new_or_called_less_often_is_named() {
        let of = |with_c: bool, rows: &[(&str, u64)]| {
            let row = |(name, calls): &(&str, u64)| json!({ "function": name, "calls": calls });
            json!({ "with_c": with_c, "functions": rows.iter().map(row).collect::<Vec<_>>() })
        };
        let all = of(true, &[("loop_walk", 9), ("step_a", 7), ("c_a", 6)]);
        assert!(same_calls(&all, &all).is_ok());
        assert!(same_calls(&of(false, &[("loop_walk", 9), ("step_a", 1)]), &all).is_ok());
        for (now, named) in [
            (of(true, &[("loop_walk", 9), ("step_a", 7)]), "c_a"),
            (of(true, &[("loop_walk", 9), ("step_a", 1), ("c_a", 6)]), "step_a"),
            (of(false, &[("loop_walk", 8), ("step_a", 1)]), "loop_walk"),
            (of(false, &[("loop_walk", 9)]), "step_a"),
            (of(true, &[("loop_walk", 9), ("step_a", 7), ("c_a", 6), ("step_b", 7)]), "step_b"),
        ] {
            let why = same_calls(&now, &all).unwrap_err().to_string();
            assert!(why.contains(named), "{why}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn the_deadline_holds_also_where_another_program_starts_qemu() {
        let counter = || Counter::new(image::tests::with_functions(0, &[], &[]), &[]).unwrap();
        let counted = |script: &str| {
            let begun = std::time::Instant::now();
            let result = counted(shell::command("sh").args(["-c", script]), counter(), Duration::from_millis(300));
            assert!(begun.elapsed() < Duration::from_secs(20), "{script}");
            result
        };
        for hangs in ["exec sleep 40", "sleep 40; true"] {
            let why = counted(hangs).unwrap_err().to_string();
            assert!(why.contains("still runs at its deadline"), "{why}");
        }
        let why = counted("echo a message >&2; exit 3").unwrap_err().to_string();
        assert!(why.contains("exit status: 3") && why.ends_with("a message"), "{why}");
        assert_eq!(counted("true").unwrap(), (vec![], 0));
    }

    #[test]
    fn the_totals_are_those_of_all_rows() {
        let row = |calls: u64, sum: u64| json!({ "calls": calls, "sum": sum });
        assert_eq!(totals(&json!({ "functions": [row(2, 10), row(3, 5)] })).unwrap(), (2, 5, 15));
        assert!(totals(&json!({ "functions": [{ "calls": 1 }] })).is_err());
    }
}
