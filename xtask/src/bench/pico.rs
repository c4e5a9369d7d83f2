//! `cargo xtask bench pico`: the size of the Pico's image, and where the cycles of a tick go, on rp2040js.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::{board, page};
use crate::board::Variant;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;
use crate::{image, pico};

/// Clock of the core, which the emulator shows and `firmware-rp2040` sets.
const CORE_HZ: u64 = 200_000_000;
/// The board's name on the page.
const NAME: &str = "Raspberry Pi Pico, RP2040";

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
    let size = image::footprint(&bytes).map_err(|wrong| anyhow::anyhow!("{}: {wrong}", elf.display()))?;
    Ok(json!({
        "name": NAME,
        "hclk_hz": CORE_HZ,
        "emulated": { "ticks": ticks, "mean_cycles": mean, "longest_cycles": longest, "mean_cycles_in_flash": in_flash },
        "image": { "flash_bytes": size.flash, "static_ram_bytes": size.ram },
    }))
}

/// The image, and what `profile.mjs` writes of it.
fn profile(workspace: &mut Workspace) -> Result<(PathBuf, String)> {
    workspace.set_up(&[Need::BoardCompiler, Need::Node])?;
    pico::install_emulator()?;
    let elf = pico::build(workspace, Variant::USUAL)?;
    let uf2 = pico::with_default_robot(workspace, &elf)?;
    let text = walked(&uf2, &elf)?;
    Ok((elf, text))
}

/// What `profile.mjs` writes of an image.
fn walked(uf2: &Path, elf: &Path) -> Result<String> {
    let mut profile = shell::command("node");
    profile.arg("profile.mjs").args([uf2, elf]).current_dir(pico::EMULATOR);
    shell::stdout_of(&mut profile)
}

/// Compares the cycles of a tick, on average and the longest, with docs/performance.json: what was compared, or why nothing was. The emulator counts as
/// the core's manual does, so the cycles of one image are always the same.
pub(crate) fn compare(uf2: &Path, elf: &Path) -> Result<String> {
    let baseline = board::baseline()?;
    let compiler = baseline["compiler"].as_str().unwrap_or_default();
    let image = std::fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    if compiler.is_empty() || !image.windows(compiler.len()).any(|bytes| bytes == compiler.as_bytes()) {
        return Ok(format!("cycles not compared: the image is not by {compiler}, as the numbers of {}", page::JSON));
    }
    let [_, mean, longest, _] = head(&walked(uf2, elf)?)?;
    let boards = baseline["boards"].as_array().into_iter().flatten();
    let before = boards.map(|board| (&board["name"], &board["emulated"])).find(|(name, _)| *name == NAME);
    let (_, before) = before.with_context(|| format!("{} has no row of the {NAME}", page::JSON))?;
    for (what, key, now) in [("on average", "mean_cycles", mean), ("longest", "longest_cycles", longest)] {
        let before = before[key].as_u64().with_context(|| format!("{} has no {key}", page::JSON))?;
        ensure!(
            !board::is_grown(before, now),
            "a tick takes {now} cycles {what}, before {before}: more than {} % more. If that is meant: cargo xtask bench board --write --reason \"...\"",
            board::MARGIN_PERCENT
        );
    }
    Ok(format!("a tick: {mean} cycles on average, {longest} the longest"))
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
    fn the_first_line_of_the_profile_has_four_numbers() {
        let line = "1000 ticks, 30910 cycles on average, longest 32247; 0 of them in flash";
        assert_eq!(numbers(line), Some([1000, 30_910, 32_247, 0]));
        assert_eq!((numbers("1000 ticks"), numbers("")), (None, None));
    }
}
