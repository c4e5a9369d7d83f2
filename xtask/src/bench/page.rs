//! The page docs/performance.md, from docs/performance.json.

use std::fmt::Write as _;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::qemu;

/// The page.
pub(super) const PAGE: &str = "docs/performance.md";
/// The numbers.
pub(super) const JSON: &str = "docs/performance.json";

/// What stands before the tables.
const HEAD: &str = include_str!("performance_head.txt");

/// Medians of the first count, of the image of its commit: parts in each set-up by their names of today, generators, and memory.
const FIRST: &str = include_str!("first_count.json");

/// The page, as Markdown.
pub(super) fn page(result: &Value) -> Result<String> {
    let mut text = HEAD.to_owned();
    let first = result["set_ups"].get(0).context("no set-up was measured")?;
    let tick = part(first, "tick")?;
    let number = |value: &Value| value.as_u64().context("a number is missing");
    let other = number(&result["tick_if_prefetched_lines_are_cached"]["median"])?;
    let secs = number(&result["secs"])?;
    let compiler = result["compiler"].as_str().context("no compiler")?;
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "Measured over {secs} s of walking in each set-up, on the virtual board, with the image for the STM32F4 Discovery at {} MHz, built by\n{compiler}.\n",
        number(&result["hclk_hz"])? / 1_000_000
    );
    let _ = writeln!(
        text,
        "The manual of the flash does not say whether a prefetched line goes into the cache. The model says no; if it does, the median of the tick in the\nfirst set-up is not {} but {other} modelled cycles.\n",
        number(&tick["cycles"]["median"])?
    );
    let reason = name(&result["reason"]).context("the reason of the numbers")?;
    let _ = writeln!(text, "Reason of their last change:\n{reason}.\n");
    text += "## A tick in each set-up\n\n";
    text += "A tick is the interrupt at the end of the samples and the control task. The last column is all code, with the tasks below the tick and\n\
             the other interrupts, as a part of the processor's time, the mean over the run.\n\n";
    text += "| set-up | instructions: min, median, p99, max | modelled cycles: min, median, p99, max | of 1 ms, at most | all code |\n|---|---|---|---|---|\n";
    let period = number(&result["hclk_hz"])? / 1000;
    let set_ups = result["set_ups"].as_array().context("no set-ups")?;
    for set_up in set_ups {
        let tick = part(set_up, "tick")?;
        let most = number(&tick["cycles"]["max"])? as f64 / period as f64 * 100.0;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {most:.1} % | {} % |",
            name(&set_up["name"])?,
            spread(&tick["instructions"])?,
            spread(&tick["cycles"])?,
            set_up["load_percent"]
        );
    }
    text += "\n## Each kind of generator\n\nThe stage `generate` of a tick: observation of the person, a step, the check of the state, and four angles.\n\n";
    text += "| kind | instructions: min, median, p99, max | modelled cycles: min, median, p99, max |\n|---|---|---|\n";
    for one in result["generators"].as_array().context("no generators")? {
        let cost = &one["cost"];
        let _ = writeln!(
            text,
            "| {} | {} | {} |",
            name(&one["kind"])?,
            spread(&cost["instructions"])?,
            spread(&cost["cycles"])?
        );
    }
    text += &since_the_first(result)?;
    text += &other_boards(first, result)?;
    text += &beside_c(&result["beside_c"])?;
    text += &gate_in_a_walk(first, &result["beside_c"])?;
    text += &second_witness(&result["qemu"])?;
    text += "\n## Each part\n\nA row of the thread is a round of the telemetry task, 2 ms; one of an interrupt is a call of its handler; one of the control period is all\n\
             code in a millisecond. A maximum above the cycles of a millisecond would go on in the next one on a chip: the thread, which ticks interrupt. The virtual\n\
             board gives each instruction one cycle, so that more fits into its milliseconds.\n";
    for set_up in set_ups {
        let _ = write!(
            text,
            "\n### {}\n\n| part | runs | instructions: min, median, p99, max | modelled cycles: min, median, p99, max | of these waits for flash, median |\n|---|---|---|---|---|\n",
            heading(name(&set_up["name"])?)
        );
        for row in set_up["rows"].as_array().context("no parts")? {
            text += &row_of_a_part(row)?;
        }
    }
    text += "\n### Interrupts that do not occur in a walk\n\nThe last 5 s of a run of 9 s with a wave at the synchronisation input, an edge each millisecond, conversions that are lost, and at its end the\n\
             emergency stop. The handler of the stop switches itself off until the next arming, so it runs once.\n\n\
             | interrupt | runs | instructions: min, median, p99, max | modelled cycles: min, median, p99, max | of these waits for flash, median |\n|---|---|---|---|---|\n";
    for row in result["rare_interrupts"].as_array().context("no rare interrupts")? {
        text += &row_of_a_part(row)?;
    }
    text += "\n## Memory\n\nIn bytes. The stack has 92 KiB of the 128 of the RAM (`memory.x`), variables and buffers 36 at most. Its use is that of the first set-up, by a pattern that the start-up code writes; its bound is that\n\
             of [the audit](ratchets.md).\n\n| flash | variables and buffers | stack, bound | stack, used | stack, size |\n|---|---|---|---|---|\n";
    let image = &result["image"];
    let bytes = ["flash_bytes", "static_ram_bytes", "stack_bound_bytes", "stack_used_bytes", "stack_bytes"];
    let bytes = bytes.map(|key| image[key].to_string());
    let _ = writeln!(text, "| {} |", bytes.join(" | "));
    Ok(text)
}

/// A row of a table of parts.
fn row_of_a_part(row: &Value) -> Result<String> {
    let (instructions, cycles) = (spread(&row["instructions"])?, spread(&row["cycles"])?);
    let (part, waits) = (name(&row["part"])?, &row["stalls"]["median"]);
    Ok(format!("| {part} | {} | {instructions} | {cycles} | {waits} |\n", row["count"]))
}

/// A tick on the other boards, beside that of the Discovery, and what their images take.
fn other_boards(first: &Value, result: &Value) -> Result<String> {
    let mut text = String::from(
        "\n## Other boards\n\nThe tick of each board's own image; `of 1 ms` is its longest. The Black Pill runs on the virtual board, with the model of cycles of the Discovery at\n\
         its own clock and wait states. The Pico runs on rp2040js, which counts one or two cycles an instruction, no wait for memory and none at the entry into an\n\
         interrupt ([Raspberry Pi Pico](pico.md)); its row is of one second, and without the interrupt at the end of the samples, which is a part of the other\n\
         ticks. Flash and RAM are in KiB, RAM without the stack; in the Pico's is the code of the tick.\n\n\
         | board | core, MHz | set-up | instructions: median, max | cycles: median, max | of 1 ms | flash, RAM |\n|---|---|---|---|---|---|---|\n",
    );
    let discovery =
        serde_json::json!({ "name": "Discovery, STM32F407", "hclk_hz": result["hclk_hz"], "image": result["image"] });
    text += &board_row(&discovery, "default", part(first, "tick")?)?;
    for board in result["boards"].as_array().context("no other boards")? {
        if let Some(ticks) = board["ticks"].as_array() {
            for tick in ticks {
                text += &board_row(board, name(&tick["set_up"])?, tick)?;
            }
        } else if board.is_null() {
            text += "\nThe Pico was not measured: there was no node.\n";
        } else {
            text += &board_row(board, "default", &board["emulated"])?;
        }
    }
    Ok(text)
}

/// A row of the table of boards; without a median of instructions the emulator counts cycles alone, and their mean.
fn board_row(board: &Value, set_up: &str, tick: &Value) -> Result<String> {
    let number = |value: &Value| value.as_u64().context("a number of a board is missing");
    let kib = |key: &str| Ok::<f64, anyhow::Error>(number(&board["image"][key])? as f64 / 1024.0);
    let (instructions, cycles, most) = if let Some(mean) = tick["mean_cycles"].as_u64() {
        let most = number(&tick["longest_cycles"])?;
        ("not counted".to_owned(), format!("{mean} (mean), {most}"), most)
    } else {
        let both = |what: &str| {
            Ok::<String, anyhow::Error>(format!("{}, {}", number(&tick[what]["median"])?, number(&tick[what]["max"])?))
        };
        (both("instructions")?, both("cycles")?, number(&tick["cycles"]["max"])?)
    };
    let hz = number(&board["hclk_hz"])?;
    Ok(format!(
        "| {} | {} | {set_up} | {instructions} | {cycles} | {:.1} % | {:.1}, {:.1} |\n",
        name(&board["name"])?,
        hz / 1_000_000,
        most as f64 / (hz as f64 / 1000.0) * 100.0,
        kib("flash_bytes")?,
        kib("static_ram_bytes")?,
    ))
}

/// The medians beside those of the first count.
fn since_the_first(result: &Value) -> Result<String> {
    let first: Value = serde_json::from_str(FIRST).context("reading the first count")?;
    let number = |value: &Value| value.as_u64().context("a number of the first count is missing");
    let beside = |then: &Value, now: &Value| -> Result<String> {
        let (then, now) = (number(then)?, number(now)?);
        let part = if then == 0 { "-".to_owned() } else { format!("{:.0} %", now as f64 / then as f64 * 100.0) };
        Ok(format!("{then}, {now}: {part}"))
    };
    let row = |what: &str, then: &Value, now: &Value| -> Result<String> {
        let instructions = beside(&then["instructions"], &now["instructions"]["median"])?;
        let cycles = beside(&then["cycles"], &now["cycles"]["median"])?;
        Ok(format!("| {what} | {instructions} | {cycles} |\n"))
    };
    let list = |of: &Value| of.as_array().cloned().context("a list of the first count is missing");
    let (before, now) = (list(&first["set_ups"])?, list(&result["set_ups"])?);
    let mut text = format!(
        "\n## Before and after\n\nMedians beside those of the first count (commit `{}`). The model of cycles of that day had two cycles for MLA and MLS, and one for a move between\n\
         the core and the floating-point unit. The control task was one of the executor then, in another interrupt.\n\n\
         | set-up | instructions then, now | modelled cycles then, now |\n|---|---|---|\n",
        name(&first["commit"])?
    );
    for (before, now) in before.iter().zip(&now) {
        ensure!(before["name"] == now["name"], "the set-ups are not those of the first count");
        text += &row(name(&now["name"])?, part(before, "tick")?, part(now, "tick")?)?;
    }
    for kind in list(&first["generators"])? {
        let kinds = list(&result["generators"])?;
        let now = kinds
            .iter()
            .find(|now| now["kind"] == kind["kind"])
            .context("a generator of the first count is missing")?;
        text += &row(&format!("generator: {}", name(&kind["kind"])?), &kind, &now["cost"])?;
    }
    for place in [0, before.len() - 1] {
        let (before, now) = (&before[place], &now[place]);
        let set_up = name(&now["name"])?;
        let _ =
            write!(text, "\n| part, {set_up} | instructions then, now | modelled cycles then, now |\n|---|---|---|\n");
        for then in list(&before["rows"])? {
            let what = name(&then["part"])?;
            text += &row(what, &then, part(now, what)?)?;
        }
    }
    text += "\n| memory, bytes | then, now |\n|---|---|\n";
    for (what, key) in [
        ("flash", "flash_bytes"),
        ("variables and buffers", "static_ram_bytes"),
        ("stack, bound", "stack_bound_bytes"),
        ("stack, used", "stack_used_bytes"),
    ] {
        let _ = writeln!(text, "| {what} | {} |", beside(&first["image"][key], &result["image"][key])?);
    }
    text += "\nSince then telemetry also checks the check sum of the program in flash, and the image has records, checks and generators that it had not.\n";
    Ok(text)
}

/// The networks beside C.
fn beside_c(of: &Value) -> Result<String> {
    let mut text = String::from("\n## Beside C\n\n");
    let Some(networks) = of["networks"].as_array() else {
        text += "There was no C compiler for the board (`arm-none-eabi-gcc`), so nothing is compared here.\n";
        return Ok(text);
    };
    let _ = writeln!(
        text,
        "A Runge-Kutta step of the thesis' network and of R1, and a step of the gate on a recorded walk, in Rust as in the image and in plain C of the same\n\
         equations (`tests/step-cost/c/networks.c`: constants folded, time in half steps; `tests/step-cost/c/gate.c`), by {}, `-O3`.\n\
         Without contraction C has the order of operations of the Rust code; with it, the compiler fuses multiplications and additions. The functions\n\
         take turns, so none finds its code in the cache of the flash; the table has instructions and modelled cycles, medians, and in brackets the cycles\n\
         without waits for flash.\n",
        name(&of["compiler"])?
    );
    text += "| what | Rust | C, `-ffp-contract=off` | C, contracted | steps in which C and Rust are equal bit for bit | largest difference of contracted C |\n|---|---|---|---|---|---|\n";
    let cell = |row: &Value| -> Result<String> {
        let median = |key: &str| row[key]["median"].as_u64().context("a median is missing");
        let cycles = median("cycles")?;
        Ok(format!("{}, {cycles} ({})", median("instructions")?, cycles - median("stalls")?))
    };
    for network in networks {
        let what = name(&network["name"])?;
        let difference = network["fused_difference_1e9"].as_f64().context("a difference is missing")?;
        let difference = match what {
            super::beside_c::GATE => format!("{difference} steps differ"),
            _ => format!("{} ppm of the amplitude", difference / 1e3),
        };
        let _ = writeln!(
            text,
            "| {what} | {} | {} | {} | {} of {} | {difference} |",
            cell(&network["rust"])?,
            cell(&network["c"])?,
            cell(&network["c_fused"])?,
            network["equal"],
            network["steps"],
        );
    }
    Ok(text)
}

/// What the steps beside C say of cycles, and of the gate in a walk; nothing where there was no C compiler.
fn gate_in_a_walk(walk: &Value, of: &Value) -> Result<String> {
    let Some(networks) = of["networks"].as_array() else {
        return Ok(String::new());
    };
    let number = |row: &Value, what: &str, key: &str| row[what][key].as_u64().context("a number beside C is missing");
    let mut text = String::from("\nModelled cycles of Rust against those of the C that takes fewest: ");
    let mut gate = None;
    for network in networks {
        let what = name(&network["name"])?;
        if what == super::beside_c::GATE {
            gate = Some(network);
        }
        let over = |with_waits: bool| -> Result<f64> {
            let cycles = |row: &Value| -> Result<f64> {
                let waits = if with_waits { 0 } else { number(row, "stalls", "median")? };
                Ok((number(row, "cycles", "median")? - waits) as f64)
            };
            let least = cycles(&network["c"])?.min(cycles(&network["c_fused"])?);
            Ok((cycles(&network["rust"])? / least - 1.0) * 100.0)
        };
        let _ = write!(text, "{what} {:+.1} % with the waits and {:+.1} % without, ", over(true)?, over(false)?);
    }
    text += "by a\nmodel that is uncertain by 15 %.\n";
    let gate = gate.context("no gate beside C")?;
    let (stage, rust, c, any) = (part(walk, "tick: gate")?, &gate["rust"], &gate["c"], &of["gate_any"]["cost"]);
    let _ = writeln!(
        text,
        "\nThe recorded walk of the gate here has 150 angles a second, joined by straight lines, and a jump at its end. At the corners the limits of rate and\n\
         acceleration act, so most steps compute every bound. The shortest takes {} instructions and {} cycles (C {}\n\
         and {}), the longest {} and {} (C {} and {}). In the walk of the first set-up, where C was not run, no limit acts, and the gate takes the targets as they\n\
         are: {} instructions and {} cycles (medians).\n\n\
         **The worst case of the gate that is known**, by a random search: of {} steps of one robot with a pose envelope of all six edges, on finite targets of every\n\
         kind (jumps in each step and after some, also far out of range, ramps at up to twice the allowed rate, ends of ranges), in which each of the four limits acts,\n\
         the longest takes {} instructions and {} cycles (median {} and {}). No loop of the gate depends on the targets: a step has four joints and six edges at most.",
        number(rust, "instructions", "min")?,
        number(rust, "cycles", "min")?,
        number(c, "instructions", "min")?,
        number(c, "cycles", "min")?,
        number(rust, "instructions", "max")?,
        number(rust, "cycles", "max")?,
        number(c, "instructions", "max")?,
        number(c, "cycles", "max")?,
        number(stage, "instructions", "median")?,
        number(stage, "cycles", "median")?,
        of["gate_any"]["steps"],
        number(any, "instructions", "max")?,
        number(any, "cycles", "max")?,
        number(any, "instructions", "median")?,
        number(any, "cycles", "median")?,
    );
    Ok(text)
}

/// The counts that are the same on QEMU.
fn second_witness(measured: &Value) -> Result<String> {
    let mut text = String::from("\n## QEMU as second witness\n\n");
    if measured.is_null() {
        text += "There was no QEMU (`qemu-system-arm`), so only the virtual board has counted.\n";
        return Ok(text);
    }
    let (functions, calls, instructions) = qemu::totals(measured)?;
    let (beside_c, shared) = if measured["with_c"] == true {
        (
            ", and the steps beside C",
            "In this program R1 and the thesis' network beside C are also\n`step_robust` and `step_thesis`: the compiler gave both the same code, 4 instructions of which are the function around the step. ",
        )
    } else {
        ("", "")
    };
    let _ = write!(
        text,
        "QEMU {} counts **the same instructions in each of {calls} calls of {functions} functions**, {instructions} of the {} that the program executes: whole\n\
         ticks of the control loop on a recorded walk, from its first tick through the arming, with the default robot and one sensor (`loop_default_walk`) and with a\n\
         follower and four (`loop_follower`, too short for it to lock), steps of every generator alone (`step_`) and with their angles (`tick_`){beside_c}. The\n\
         program is `tests/step-cost/src/witness.rs`; a call counts from its first instruction to its return, with what it calls, on the virtual board by the trace of\n\
         blocks, on QEMU by a log of single instructions. The ticks have none of the firmware around the loop, and `loop_follower` has the frame of each\n\
         tick, so they are not those of the set-ups. {shared}The virtual board's core, Unicorn, is derived from QEMU: an error that both have does not show here. The step\n\
         `qemu-counts` compares the two emulators, and functions and calls with this table, but not the numbers of the table with those of the day.\n\n\
         | function | calls | instructions: min, median, p99, max | in all calls |\n|---|---|---|---|\n",
        name(&measured["version"])?,
        measured["program_instructions"]
    );
    for row in measured["functions"].as_array().context("QEMU counted no function")? {
        let (function, instructions) = (name(&row["function"])?, spread(&row["instructions"])?);
        let _ = writeln!(text, "| `{function}` | {} | {instructions} | {} |", row["calls"], row["sum"]);
    }
    Ok(text)
}

/// The row of a part of a set-up.
fn part<'a>(set_up: &'a Value, part: &str) -> Result<&'a Value> {
    let rows = set_up["rows"].as_array().context("a set-up without parts")?;
    rows.iter().find(|row| row["part"] == part).with_context(|| format!("no part `{part}`"))
}

fn name(value: &Value) -> Result<&str> {
    value.as_str().context("a name is missing")
}

fn heading(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// `1, 2, 3, 4`, or one number where all are equal.
fn spread(of: &Value) -> Result<String> {
    let numbers = ["min", "median", "p99", "max"].map(|key| of[key].as_u64());
    let numbers = numbers.into_iter().collect::<Option<Vec<u64>>>().context("a number of a part is missing")?;
    let all = numbers.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
    Ok(if numbers.iter().all(|number| *number == numbers[0]) { numbers[0].to_string() } else { all })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn read(file: &str) -> String {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        std::fs::read_to_string(root.join(file)).unwrap()
    }

    #[test]
    fn the_page_is_what_the_numbers_say() {
        let numbers: Value = serde_json::from_str(&read(JSON)).unwrap();
        let text = page(&numbers).unwrap();
        if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some_and(|value| value == "1") {
            std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name(PAGE), &text).unwrap();
        }
        assert!(text == read(PAGE), "FOOTFALL_WRITE_DOCS=1 writes {PAGE} from {JSON} again");
    }

    #[test]
    fn the_longest_tick_of_a_walk_takes_at_most_six_fifths_of_the_median() {
        let numbers: Value = serde_json::from_str(&read(JSON)).unwrap();
        for set_up in numbers["set_ups"].as_array().unwrap() {
            let tick = part(set_up, "tick").unwrap();
            for what in ["instructions", "cycles"] {
                let [median, max] = ["median", "max"].map(|key| tick[what][key].as_u64().unwrap());
                assert!(max * 5 <= median * 6, "{}: {max} {what}, median {median}", set_up["name"]);
            }
        }
    }

    #[test]
    fn a_page_without_qemu_says_so() {
        let mut numbers: Value = serde_json::from_str(&read(JSON)).unwrap();
        assert!(page(&numbers).unwrap().contains("counts **the same instructions in each of "));
        numbers["qemu"] = Value::Null;
        assert!(page(&numbers).unwrap().contains("There was no QEMU"));
    }

    #[test]
    fn a_number_that_is_missing_is_named() {
        let mut numbers: Value = serde_json::from_str(&read(JSON)).unwrap();
        numbers["set_ups"][0]["rows"][0]["cycles"]["p99"] = Value::Null;
        assert!(page(&numbers).unwrap_err().to_string().contains("a number of a part is missing"));
    }
}
