//! Steps that measure the images and the source with the program `audit`.

use anyhow::Result;

use super::state::{State, passed, tests};
use crate::board::{Board, Drive};
use crate::ratchet;
use crate::shell;

/// No reachable panic and no path of this computer, in every image. The analysis of panics also looks for one that is reachable on purpose.
pub(super) fn image_audit(state: &State) -> Result<String> {
    let audit = state.workspace.audit()?;
    let mut images = vec![state.image()?.to_owned(), state.shadow()?.to_owned()];
    for board in Board::ALL.into_iter().filter(|&board| board != Board::F4Discovery) {
        images.push(state.workspace.firmware(board, Drive::Servos)?.elf);
    }
    for task in ["panics", "paths"] {
        shell::must_succeed(shell::command(&audit).arg(task).args(&images), &format!("audit {task}"))?;
    }
    passed(state, tests(state, &["--profile", "host", "--package", "audit"], &[])?)
}

/// What the image, a run of it and the source need is not more than `ratchets.toml` allows; each of these numbers can fail.
pub(super) fn ratchets(state: &State) -> Result<String> {
    let footfall = state.workspace.footfall()?;
    let table = ratchet::compare(&state.workspace, state.image()?, state.virtual_board()?, &footfall, None)?;
    eprint!("{table}");
    Ok(format!("{} numbers", table.lines().filter(|line| line.ends_with("kept")).count()))
}
