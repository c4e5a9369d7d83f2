//! Messages for the user on standard error: their kinds, their amount (`--quiet`, `--verbose`), their colour (`--color`, `NO_COLOR`).
//!
//! A message that cannot be written is lost without a failure: there is no other place for it.

use anstream::stderr;
use clap::ColorChoice;
use clap::builder::styling::{AnsiColor, Style};
use std::borrow::Cow;
use std::fmt::Display;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};

/// How much is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Amount {
    /// Warnings and errors.
    Quiet,
    /// Also notes, progress, the files that were written, and the next step.
    #[default]
    Usual,
    /// Also the files that are read, and times.
    Verbose,
}

static AMOUNT: AtomicU8 = AtomicU8::new(Amount::Usual as u8);

/// Sets the amount for the whole program.
pub fn set_amount(amount: Amount) {
    AMOUNT.store(amount as u8, Ordering::Relaxed);
}

/// So much is said, or more.
#[must_use]
pub fn says(amount: Amount) -> bool {
    AMOUNT.load(Ordering::Relaxed) >= amount as u8
}

/// Sets the colours of messages, help texts and live screens for the whole program. [`ColorChoice::Auto`]: on a terminal, unless `NO_COLOR`
/// is set.
pub fn set_colour(choice: ColorChoice) {
    let (everywhere, screens) = match choice {
        ColorChoice::Auto => (anstream::ColorChoice::Auto, None),
        ColorChoice::Always => (anstream::ColorChoice::Always, Some(true)),
        ColorChoice::Never => (anstream::ColorChoice::Never, Some(false)),
    };
    everywhere.write_global();
    if let Some(colour) = screens {
        ratatui::crossterm::style::force_color_output(colour);
    }
}

/// Whether a terminal obeys a character instead of showing it: control characters, and marks of the writing direction.
fn is_obeyed(c: char) -> bool {
    let direction =
        matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    direction || (c.is_control() && !matches!(c, '\n' | '\t'))
}

/// The text with every character that a terminal obeys escaped, as `\u001b`; line feeds and tabs stay. What is printed quotes files and boards,
/// which may contain anything. JSON and TOML stay what they are: there such a character can stand in a text only, and the escape means it.
#[must_use]
pub fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_obeyed(c) { out += &format!("\\u{:04x}", u32::from(c)) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// A text of a foreign file for a cell of a table that a spreadsheet may open: [`escaped`], and with an apostrophe in front where a spreadsheet
/// would take it for a formula.
#[must_use]
pub fn cell(text: &str) -> Cow<'_, str> {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}']);
    if is_formula { Cow::Owned(format!("'{}", escaped(text))) } else { escaped(text) }
}

/// Writes a line, in one call, so that messages of several threads do not mix. Texts quote files, which may contain anything: what a terminal
/// would obey is escaped.
fn line(label: &str, text: impl Display) {
    let line = format!("{label}{}\n", escaped(&text.to_string()));
    let _ = stderr().write_all(line.as_bytes());
}

fn labelled(label: &str, colour: AnsiColor, text: impl Display) {
    let style: Style = colour.on_default().bold();
    line(&format!("{style}{label}:{style:#} "), text);
}

/// Why the program failed, each line with the label.
pub fn error(text: impl Display) {
    for part in text.to_string().lines() {
        labelled("error", AnsiColor::Red, part);
    }
}

/// What is probably wrong with an input.
pub fn warning(text: impl Display) {
    labelled("warning", AnsiColor::Yellow, text);
}

/// What the user should know of an input or a decision of the program.
pub fn note(text: impl Display) {
    if says(Amount::Usual) {
        labelled("note", AnsiColor::Cyan, text);
    }
}

/// A line without a label: progress and results in words.
pub fn status(text: impl Display) {
    if says(Amount::Usual) {
        line("", text);
    }
}

/// A line that only `--verbose` shows.
pub fn detail(text: impl Display) {
    if says(Amount::Verbose) {
        line("", text);
    }
}

/// A file that was written.
pub fn written(path: &Path) {
    status(format_args!("written: {}", path.display()));
}

/// What the user can do next: what for, and the command line.
pub fn next(what_for: &str, command: impl Display) {
    status(format_args!("next: {what_for}: {command}"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_escaped() {
        let plain = "it's \"50\u{b0}\" \u{e9} \\d \u{2192}\n\tnext";
        assert!(matches!(escaped(plain), Cow::Borrowed(same) if same == plain));
        assert_eq!(escaped("a\u{1b}[2Jb\r\u{7}\0\u{9b}c\u{202e}d"), r"a\u001b[2Jb\u000d\u0007\u0000\u009bc\u202ed");
    }

    /// A program that reads JSON gets the same text.
    #[test]
    fn escaped_json_means_the_same() {
        let all: String = ('\0'..='\u{2100}').collect();
        let value = serde_json::json!([all]);
        let text = value.to_string();
        let safe = escaped(&text);
        assert!(safe.chars().all(|c| !c.is_control() && !is_obeyed(c)));
        assert_eq!(serde_json::from_str::<serde_json::Value>(&safe).unwrap(), value);
    }

    /// A page shows no character either that a terminal would obey.
    #[cfg(feature = "analysis")]
    #[test]
    fn pages_have_the_same_characters_replaced() {
        for c in ('\0'..='\u{2100}').filter(|c| is_obeyed(*c)) {
            assert_eq!(gait_fit::html::escape(&c.to_string()), "\u{fffd}", "{c:?}");
        }
    }

    #[test]
    fn a_cell_is_no_formula() {
        for formula in ["=1+1", "+1", "-1", "@a", "\t=1", "\r=1", "\u{ff1d}1"] {
            assert!(cell(formula).starts_with('\''), "{formula:?}");
        }
        for plain in ["walk.csv", "a=1", "a-b", "", "'"] {
            assert!(matches!(cell(plain), Cow::Borrowed(same) if same == plain), "{plain:?}");
        }
    }
}
