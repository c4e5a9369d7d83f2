//! Steps that measure the images and the source with the program `audit`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::state::{CannotRun, State, passed, tests};
use crate::board::{Board, Variant};
use crate::shell;
use crate::workspace::WHEEL;

/// No reachable panic and no path of this computer, in every image. The analysis of panics also looks for one that is reachable on purpose.
pub(super) fn image_audit(state: &State) -> Result<String> {
    let audit = state.workspace.audit()?;
    let mut images = vec![state.image()?.to_owned(), state.shadow()?.to_owned()];
    for board in Board::ALL.into_iter().filter(|&board| board != Board::F4Discovery) {
        images.push(state.workspace.firmware(board, Variant::USUAL)?.elf);
    }
    for task in ["panics", "paths"] {
        shell::must_succeed(shell::command(&audit).arg(task).args(&images), &format!("audit {task}"))?;
    }
    Ok(format!("{} images", images.len()))
}

/// Builds a copy of the source in another folder, and compares the bytes that are loaded.
pub(super) fn same_bytes(state: &State) -> Result<String> {
    let audit = state.workspace.audit()?;
    let here = state.image()?.to_owned();
    let folder = std::env::temp_dir().join(format!("footfall-same-bytes-{}", std::process::id()));
    let copied = copy_source(&folder).and_then(|()| state.workspace.firmware_in(&folder, Board::F4Discovery));
    let compared = copied.and_then(|there| {
        shell::must_succeed(shell::command(&audit).arg("paths").arg(&there), "audit paths")?;
        shell::stdout_of(shell::command(&audit).arg("same").args([&here, &there]))
    });
    let _ = std::fs::remove_dir_all(&folder);
    Ok(compared?.trim().to_owned())
}

/// Copies the files that git knows, and those that it would add.
fn copy_source(to: &Path) -> Result<()> {
    let listed = shell::stdout_of(shell::command("git").args(["ls-files", "-z", "-co", "--exclude-standard"]));
    let listed = listed.map_err(|error| CannotRun(format!("git lists no files: {error:#}")))?;
    let files: Vec<PathBuf> = listed.split('\0').filter(|name| !name.is_empty()).map(PathBuf::from).collect();
    if files.is_empty() {
        bail!("git lists no files");
    }
    // One that was removed and not committed is listed too.
    for file in files.iter().filter(|file| file.is_file()) {
        let copy = to.join(file);
        let parent = copy.parent().context("a file without a folder")?;
        std::fs::create_dir_all(parent).with_context(|| format!("making {}", parent.display()))?;
        std::fs::copy(file, &copy).with_context(|| format!("copying to {}", copy.display()))?;
    }
    Ok(())
}

/// The cost of the parts of the image: the model's tables, and the firmware's own stopwatch on the virtual board. All tests of both programs that look at images run here.
pub(super) fn board_cost(state: &State) -> Result<String> {
    let footfall = state.workspace.footfall()?;
    let variables = [
        ("FOOTFALL_ELF", state.image()?),
        ("FOOTFALL_SHADOW_ELF", state.shadow()?),
        ("FOOTFALL_VIRTUAL_BOARD", state.virtual_board()?),
        ("FOOTFALL_BIN", &footfall),
    ];
    let variables = variables.map(|(name, path)| (name, path.as_os_str()));
    // The package of the wheel has no test: beside it the dependencies have the features that they have in the builds, and are compiled once.
    let packages = ["--profile", "host", "--package", "audit", "--package", "board-cost", "--package", WHEEL];
    passed(state, tests(state, &packages, &variables)?)
}

/// The run: arming, a walk of ten seconds, and a stop by the button.
const RUN: [&str; 5] = ["watch", "--json", "--secs", "12", "--disarm"];

/// What the image, a run of it and the source need is not more than `ratchets.toml` allows; each of these numbers can fail.
pub(super) fn ratchets(state: &State) -> Result<String> {
    let footfall = state.workspace.footfall()?;
    let elf = state.image()?;
    let mut run = shell::command(footfall);
    run.args(RUN).arg("--elf").arg(elf).arg("--virtual-board").arg(state.virtual_board()?);
    let lines = shell::stdout_of(&mut run).context("running the image on the virtual board")?;
    let file = state.workspace.target_dir.join("ratchet-run.jsonl");
    std::fs::write(&file, lines).with_context(|| format!("writing {}", file.display()))?;
    let mut audit = shell::command(state.workspace.audit()?);
    let table = shell::stdout_of(audit.args(["ratchet", "--elf"]).arg(elf).arg("--run").arg(&file))?;
    eprint!("{table}");
    Ok(format!("{} numbers", table.lines().filter(|line| line.ends_with("kept")).count()))
}
