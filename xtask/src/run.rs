//! `cargo xtask run`: the image that would be flashed, on the virtual board, watched by `footfall`.

use std::process::ExitCode;

use anyhow::Result;

use crate::board::Board;
use crate::build::Workshop;
use crate::setup::Need;
use crate::shell;

/// Builds what is needed and becomes `footfall watch`: standard streams, Ctrl-C and exit code are footfall's own.
pub(crate) fn run(shop: &mut Workshop, options: &[String]) -> Result<ExitCode> {
    shop.set_up(&[Need::Thumb, Need::VirtualBoard])?;
    let virtual_board = shop.virtual_board()?;
    let footfall = shop.footfall()?;
    let image = shop.firmware(Board::F4Discovery)?;
    eprintln!("image: {}, {}", image.elf.display(), image.footprint);

    let mut watch = shell::command(footfall);
    // File names among the options are meant from where the person stands, not from the workspace's root.
    watch.current_dir(&shop.started_in);
    watch.arg("watch").arg("--elf").arg(image.elf).arg("--virtual-board").arg(virtual_board).args(options);
    shell::hand_over(&mut watch)
}
