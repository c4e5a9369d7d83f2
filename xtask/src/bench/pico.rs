//! `cargo xtask bench pico`: the size of the Pico's image, and where the cycles of a tick go, on rp2040js.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::page;
use crate::board::Variant;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;
use crate::{image, pico};

/// Clock of the core, which the emulator shows and `firmware-rp2040` sets.
const CORE_HZ: u64 = 200_000_000;
/// The board's name on the page.
const NAME: &str = "Raspberry Pi Pico, RP2040";

/// By how much a number may differ from that in docs/performance.json, percent.
const MARGIN_PERCENT: u64 = 5;
/// The command that writes docs/performance.json.
const HOW_TO_WRITE: &str = "cargo xtask bench board --write";

/// Builds the image, walks with it on the emulator and prints what the script `profile.mjs` counts. The build prints the size.
pub(super) fn bench() -> Result<()> {
    print!("{}", profile(&mut Workspace::open()?)?.1);
    Ok(())
}

/// The tick and the size of the image, for the page of the boards; null without node.
pub(super) fn measure(workspace: &mut Workspace) -> Result<Value> {
    if shell::on_path("node").is_none() {
        eprintln!("bench: no node, so the Pico is not measured; Debian has it in nodejs and npm");
        return Ok(Value::Null);
    }
    eprintln!("bench: Raspberry Pi Pico");
    let (elf, text) = profile(workspace)?;
    let [ticks, mean, longest, in_flash] = head(&text)?;
    let bytes = std::fs::read(&elf).with_context(|| format!("reading {}", elf.display()))?;
    let size = image::footprint(&bytes).with_context(|| format!("in {}", elf.display()))?;
    Ok(json!({
        "name": NAME,
        "hclk_hz": CORE_HZ,
        "emulated": { "ticks": ticks, "mean_cycles": mean, "longest_cycles": longest, "mean_cycles_in_flash": in_flash },
        "image": { "flash_bytes": size.flash, "static_ram_bytes": size.ram },
    }))
}

/// The image, and what `profile.mjs` writes of it.
fn profile(workspace: &mut Workspace) -> Result<(PathBuf, String)> {
    workspace.set_up(&[Need::BoardCompiler, Need::Node, Need::Python])?;
    pico::install_emulator(workspace)?;
    let elf = pico::build(workspace, Variant::USUAL)?;
    let uf2 = pico::with_default_robot(workspace, &elf)?;
    let text = profile_of(&uf2, &elf)?;
    Ok((elf, text))
}

/// What `profile.mjs` writes of an image.
fn profile_of(uf2: &Path, elf: &Path) -> Result<String> {
    let mut profile = shell::command("node");
    profile.arg("profile.mjs").args([uf2, elf]).current_dir(pico::EMULATOR);
    shell::stdout_of(&mut profile)
}

/// Compares the cycles of a tick, on average and the longest, with docs/performance.json: what was compared, or why nothing was. The emulator has no input
/// but the script's, so an image has the same cycles in every run.
pub(crate) fn compare(uf2: &Path, elf: &Path) -> Result<String> {
    let text = std::fs::read_to_string(page::JSON).with_context(|| format!("reading {}", page::JSON))?;
    let baseline: Value = serde_json::from_str(&text).with_context(|| format!("reading {}", page::JSON))?;
    let bytes = std::fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    let by = image::compiler(&bytes).with_context(|| format!("{} names no compiler", elf.display()))?;
    let before = baseline["compiler"].as_str().unwrap_or_default();
    if by == before {
        judged(&baseline, head(&profile_of(uf2, elf)?)?)
    } else {
        Ok(format!("cycles not compared: the image is by {by}, the numbers of {} by {before}", page::JSON))
    }
}

/// What is said of a run's numbers.
fn judged(baseline: &Value, [ticks, mean, longest, in_flash]: [u64; 4]) -> Result<String> {
    let mut boards = baseline["boards"].as_array().into_iter().flatten();
    let before = boards.find(|board| board["name"] == NAME).with_context(|| {
        format!("{} has no row of the {NAME}; on a machine with node: {}", page::JSON, HOW_TO_WRITE)
    })?;
    let before = |key: &str| {
        before["emulated"][key].as_u64().with_context(|| format!("{} has no {key} of the {NAME}", page::JSON))
    };
    ensure!(ticks.abs_diff(before("ticks")?) <= 1, "{ticks} ticks were counted, before {}", before("ticks")?);
    let numbers = [
        ("a tick takes on average", "mean_cycles", mean),
        ("the longest tick takes", "longest_cycles", longest),
        ("a tick takes in flash", "mean_cycles_in_flash", in_flash),
    ];
    for (what, key, now) in numbers {
        let before = before(key)?;
        ensure!(
            now.abs_diff(before) * 100 <= before * MARGIN_PERCENT,
            "{what} {now} cycles, before {before}, from which it may differ by {} %. If that is meant: {}",
            MARGIN_PERCENT,
            HOW_TO_WRITE
        );
    }
    Ok(format!("a tick: {mean} cycles on average, the longest {longest}"))
}

/// Ticks, their cycles on average, the longest, and those in flash: the first line that `profile.mjs` writes.
fn head(text: &str) -> Result<[u64; 4]> {
    let first = text.lines().next().unwrap_or_default();
    numbers(first)
        .with_context(|| format!("profile.mjs wrote `{first}`; expected ticks, cycles on average, longest, in flash"))
}

/// The whole numbers of a line.
fn numbers(line: &str) -> Option<[u64; 4]> {
    let words = line.split(|letter: char| !letter.is_ascii_digit()).filter(|word| !word.is_empty());
    words.map(str::parse).collect::<Result<Vec<u64>, _>>().ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_with_other_cycles_is_named() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let text = std::fs::read_to_string(root.join(page::JSON)).unwrap();
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["boards"][1]["name"], NAME);
        let emulated =
            json!({ "ticks": 1000, "mean_cycles": 30_000, "longest_cycles": 32_000, "mean_cycles_in_flash": 0 });
        let baseline = json!({ "boards": [{ "name": "another" }, { "name": NAME, "emulated": emulated }] });
        let wrong = |numbers| judged(&baseline, numbers).unwrap_err().to_string();
        assert!(judged(&baseline, [1000, 31_500, 33_600, 0]).unwrap().contains("31500"));
        assert!(wrong([1000, 31_501, 32_000, 0]).contains("on average 31501 cycles, before 30000"));
        assert!(wrong([1000, 30_000, 33_601, 0]).contains("longest"));
        assert!(wrong([1000, 30_000, 32_000, 1]).contains("in flash"));
        assert!(wrong([1000, 28_499, 32_000, 0]).contains("28499"));
        assert!(wrong([998, 30_000, 32_000, 0]).contains("998 ticks"));
        assert!(judged(&json!({}), [1000, 1, 1, 0]).unwrap_err().to_string().contains("no row"));
    }

    #[test]
    fn the_first_line_of_the_profile_has_four_numbers() {
        let line = "1000 ticks, 30910 cycles on average, longest 32247; 0 of them in flash";
        assert_eq!(numbers(line), Some([1000, 30_910, 32_247, 0]));
        assert_eq!((numbers("1000 ticks"), numbers("")), (None, None));
    }
}
