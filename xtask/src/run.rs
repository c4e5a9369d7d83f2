//! `cargo xtask run`: the image that would be flashed, on the virtual board, watched by `footfall`.

use std::process::ExitCode;

use anyhow::Result;

use crate::board::{Board, Drive};
use crate::build::Workshop;
use crate::setup::Need;
use crate::shell;

/// Builds what is needed and becomes `footfall watch`: standard streams, Ctrl-C and exit code are footfall's own. `--shadow` is the
/// image's and stays here.
pub(crate) fn run(shop: &mut Workshop, options: &[String]) -> Result<ExitCode> {
    shop.set_up(&[Need::Thumb, Need::VirtualBoard])?;
    let virtual_board = shop.virtual_board()?;
    let footfall = shop.footfall()?;
    let (shadow, options) = without_shadow(options);
    let image = shop.firmware(Board::F4Discovery, Drive::unless(shadow))?;
    eprintln!("image: {}, {}", image.elf.display(), image.footprint);

    let mut watch = shell::command(footfall);
    // File names among the options are meant from where the person stands, not from the workspace's root.
    watch.current_dir(&shop.started_in);
    watch.arg("watch").arg("--elf").arg(image.elf).arg("--virtual-board").arg(virtual_board).args(options);
    shell::hand_over(&mut watch)
}

/// Whether `--shadow` is among the options of footfall (those of the board come after `--`), and the others.
fn without_shadow(options: &[String]) -> (bool, Vec<&String>) {
    let of_board = options.iter().position(|option| option == "--").unwrap_or(options.len());
    let is_shadow = |(place, option): &(usize, &String)| *place < of_board && *option == "--shadow";
    let others = options.iter().enumerate().filter(|option| !is_shadow(option)).map(|(_, option)| option).collect();
    (options.iter().enumerate().any(|option| is_shadow(&option)), others)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadow_is_taken_out_wherever_it_stands_before_the_boards_options() {
        let split = |words: &str| {
            let words: Vec<String> = words.split_whitespace().map(str::to_owned).collect();
            let (shadow, others) = without_shadow(&words);
            (shadow, others.into_iter().map(String::as_str).collect::<Vec<_>>().join(" "))
        };
        assert_eq!(split("--secs 3 --shadow --json"), (true, "--secs 3 --json".into()));
        assert_eq!(split("--secs 3 --json"), (false, "--secs 3 --json".into()));
        assert_eq!(split("--json -- --shadow"), (false, "--json -- --shadow".into()));
    }
}
