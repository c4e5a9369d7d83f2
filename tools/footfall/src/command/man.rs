//! `footfall man`: prints or writes the manual pages.

use clap::builder::Resettable;
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;

/// Options of `footfall man`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The command whose page is printed [default: the page of the program]
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    pub command: Option<String>,
    /// Write all pages to this folder, which is made if it is not there: footfall.1, footfall-fit.1, ...
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command; `program` is the whole command line.
///
/// # Errors
/// There is no such command, or a file that cannot be written.
pub fn run(options: &Options, mut program: Command) -> Result<(), Failure> {
    // Also the options of all commands are then those of each.
    program.build();
    let Some(folder) = &options.out else {
        let page = match &options.command {
            None => program,
            Some(name) => program.find_subcommand(name).cloned().ok_or_else(|| {
                let names: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
                Failure::input(format!("command `{name}`: allowed is one of {}", names.join(", ")))
            })?,
        };
        return output::print_bytes(&rendered(page)?.1);
    };
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::input(format!("{}: cannot be made: {error}", folder.display())))?;
    let commands = program.get_subcommands().filter(|command| command.get_name() != "help").cloned();
    let mut pages = commands.map(rendered).collect::<Result<Vec<_>, _>>()?;
    pages.push(rendered(program)?);
    pages.iter().try_for_each(|(name, _)| output::check(&folder.join(name), options.overwrite))?;
    for (name, page) in pages {
        let path = folder.join(name);
        output::write_bytes(&path, &page, options.overwrite)?;
        messages::written(&path);
    }
    messages::next("read one", format!("man -l {}", messages::shell_word(folder.join("footfall.1"))));
    Ok(())
}

/// Name and content of a page.
fn rendered(command: Command) -> Result<(String, Vec<u8>), Failure> {
    // Of a subcommand: `footfall-fit`.
    let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_owned();
    let help = command.get_after_help().map_or(String::new(), ToString::to_string);
    let mut page = Vec::new();
    Man::new(command.after_help(Resettable::Reset)).render(&mut page).map_err(Failure::run)?;
    let (notes, examples) = help.split_once("Examples:").unwrap_or((&help, ""));
    page.extend([section("NOTES", notes), section("EXAMPLES", examples)].concat().bytes());
    Ok((format!("{name}.1"), page))
}

/// A section whose lines stay as they are: `Man` would fill and hyphenate command lines.
fn section(title: &str, text: &str) -> String {
    let text = text.trim_matches('\n');
    if text.is_empty() {
        return String::new();
    }
    // `\&` is nothing: a line may not begin with a dot or a quote.
    let line = |line: &str| format!("\\&{}\n", line.replace('\\', "\\e").replace('-', "\\-"));
    format!(".SH {title}\n.nf\n{}.fi\n", text.lines().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_section_stay_as_they_are() {
        assert_eq!(section("A", "\n.b -c\n  \\d\n"), ".SH A\n.nf\n\\&.b \\-c\n\\&  \\ed\n.fi\n");
        assert_eq!(section("A", "\n"), "");
    }
}
