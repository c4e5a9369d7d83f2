//! Whether a live screen can be shown: on a terminal with a keyboard, cursor control, and characters beyond ASCII.

use std::fs::File;
use std::io::{self, IsTerminal};

use crate::messages;

/// Where the keys come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keys {
    /// From standard input.
    Stdin,
    /// From the terminal itself, because standard input brings data.
    Terminal,
}

/// Whether a live screen can be shown. Where a terminal cannot show it, a note says why.
#[must_use]
pub fn shows_screens(keys: Keys) -> bool {
    let has_keys = match keys {
        Keys::Stdin => io::stdin().is_terminal(),
        Keys::Terminal => File::open("/dev/tty").is_ok(),
    };
    if !io::stdout().is_terminal() || !has_keys {
        return false;
    }
    match lacking(|name| std::env::var(name).ok()) {
        None => true,
        Some(why) => {
            messages::note(format_args!("{why}: plain lines instead of the live screen"));
            false
        }
    }
}

/// What a terminal with this environment lacks.
fn lacking(variable: impl Fn(&str) -> Option<String>) -> Option<String> {
    if variable("TERM").is_some_and(|kind| kind == "dumb") {
        return Some("TERM=dumb has no cursor control".into());
    }
    // The first that is set counts (POSIX, environment variables). With none of them the terminal decides, and most show UTF-8.
    let set = ["LC_ALL", "LC_CTYPE", "LANG"];
    let (name, locale) = set.iter().find_map(|name| Some((name, variable(name).filter(|value| !value.is_empty())?)))?;
    let is_utf8 = locale.to_ascii_lowercase().replace('-', "").contains("utf8");
    (!is_utf8).then(|| format!("{name}={locale} has no UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_without_cursor_or_utf_8_gets_plain_lines() {
        let lacks = |set: &[(&str, &str)]| {
            lacking(|name| set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
        };
        for fine in [
            &[][..],
            &[("TERM", "xterm"), ("LANG", "en_GB.UTF-8")],
            &[("LC_ALL", "C.utf8"), ("LANG", "C")],
            &[("LANG", "")],
        ] {
            assert_eq!(lacks(fine), None, "{fine:?}");
        }
        for (set, words) in [
            (&[("TERM", "dumb")][..], "TERM=dumb has no cursor control"),
            (&[("LANG", "C")], "LANG=C has no UTF-8"),
            (&[("LC_ALL", "POSIX"), ("LANG", "C.UTF-8")], "LC_ALL=POSIX"),
            (&[("LC_CTYPE", "de_DE.ISO-8859-1")], "LC_CTYPE"),
        ] {
            assert!(lacks(set).unwrap().contains(words), "{set:?}");
        }
    }
}
