//! The page docs/performance.md, from docs/performance.json.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use serde_json::Value;

/// The page.
pub(super) const PAGE: &str = "docs/performance.md";
/// The numbers.
pub(super) const JSON: &str = "docs/performance.json";

/// What stands before the tables.
const HEAD: &str = include_str!("performance_head.txt");

/// The page, as Markdown.
pub(super) fn page(result: &Value) -> Result<String> {
    let mut text = HEAD.to_owned();
    let first = result["set_ups"].get(0).context("no set-up was measured")?;
    let number = |value: &Value| value.as_u64().context("a number is missing");
    let secs = number(&result["secs"])?;
    let compiler = result["compiler"].as_str().context("no compiler")?;
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "Measured over {secs} s of walking in each set-up, on the virtual board, with the image for the STM32F4 Discovery at {} MHz, built by\n{compiler}.\n",
        number(&result["hclk_hz"])? / 1_000_000
    );
    text += "## A tick in each set-up\n\n";
    text += "The last column is all code as a part of the processor's time, the mean over the run.\n\n";
    text += "| set-up | instructions: median, max | modelled cycles: median, max | of 1 ms, at most | all code |\n|---|---|---|---|---|\n";
    let period = number(&result["hclk_hz"])? / 1000;
    let set_ups = result["set_ups"].as_array().context("no set-ups")?;
    for set_up in set_ups {
        let tick = part(set_up, "tick")?;
        let most = number(&tick["cycles"]["max"])? as f64 / period as f64 * 100.0;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {most:.1} % | {} % |",
            name(&set_up["name"])?,
            both(&tick["instructions"])?,
            both(&tick["cycles"])?,
            set_up["load_percent"]
        );
    }
    text += "\n## Each kind of generator\n\nThe stage `generate` of a tick.\n\n";
    text += "| kind | instructions: median, max | modelled cycles: median, max |\n|---|---|---|\n";
    for one in result["generators"].as_array().context("no generators")? {
        let cost = &one["cost"];
        let _ = writeln!(
            text,
            "| {} | {} | {} |",
            name(&one["kind"])?,
            both(&cost["instructions"])?,
            both(&cost["cycles"])?
        );
    }
    text += &other_boards(first, result)?;
    text += "\n## Each stage of the tick, default set-up\n\n\
             | part | instructions: median, max | modelled cycles: median, max |\n|---|---|---|\n";
    let rows = first["rows"].as_array().context("no parts")?;
    for row in rows.iter().filter(|row| row["part"].as_str().is_some_and(|part| part.starts_with("tick"))) {
        let _ =
            writeln!(text, "| {} | {} | {} |", name(&row["part"])?, both(&row["instructions"])?, both(&row["cycles"])?);
    }
    text += "\n## Memory\n\nIn bytes; the bound of the stack by `audit stack`, its use in the default set-up.\n\n| flash | variables and buffers | stack, bound | stack, used | stack, size |\n|---|---|---|---|---|\n";
    let image = &result["image"];
    let bytes = ["flash_bytes", "static_ram_bytes", "stack_bound_bytes", "stack_used_bytes", "stack_bytes"];
    let bytes = bytes.map(|key| image[key].to_string());
    let _ = writeln!(text, "| {} |", bytes.join(" | "));
    Ok(text)
}

/// A tick on the other boards, beside that of the Discovery, and what their images take.
fn other_boards(first: &Value, result: &Value) -> Result<String> {
    let mut text = String::from(
        "\n## Other boards\n\nThe Pico runs on rp2040js ([Raspberry Pi Pico](pico.md)), without the interrupt at the end of the samples. Flash and RAM are in KiB, RAM without the\n\
         stack; `of 1 ms` is the longest tick.\n\n\
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

/// The row of a part of a set-up.
pub(super) fn part<'a>(set_up: &'a Value, part: &str) -> Result<&'a Value> {
    let rows = set_up["rows"].as_array().context("a set-up without parts")?;
    rows.iter().find(|row| row["part"] == part).with_context(|| format!("no part `{part}`"))
}

fn name(value: &Value) -> Result<&str> {
    value.as_str().context("a name is missing")
}

/// Median and maximum.
fn both(of: &Value) -> Result<String> {
    let number = |key: &str| of[key].as_u64().context("a number of a part is missing");
    Ok(format!("{}, {}", number("median")?, number("max")?))
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
    fn a_number_that_is_missing_is_named() {
        let mut numbers: Value = serde_json::from_str(&read(JSON)).unwrap();
        numbers["set_ups"][0]["rows"][0]["cycles"]["max"] = Value::Null;
        assert!(page(&numbers).unwrap_err().to_string().contains("a number is missing"));
    }
}
