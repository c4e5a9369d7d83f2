//! What a board warns of, in words.

use wire::Warnings;

/// In a line of the log.
#[must_use]
pub fn explained(warning: Warnings) -> &'static str {
    match warning {
        Warnings::UNSEALED => {
            "the image has no seal: its program is not checked; `cargo xtask flash` and the runner of `cargo run` write one"
        }
        Warnings::BROWN_OUT => {
            "the brown-out reset does not have the level of this board: its supply may fall below what the chip runs at; `cargo xtask board brown-out` sets it"
        }
        Warnings::BUILT_IN_ROBOT => {
            "the board has no robot record: it runs the built-in robot; `cargo xtask flash --robot` writes yours"
        }
        Warnings::CATCHES => {
            "a debugger halts the core in a fault or after a reset, and no handler runs: end its program, then switch the board off and on"
        }
        _ => "an unknown warning",
    }
}

/// In the line of the screen.
#[must_use]
pub fn short(warning: Warnings) -> &'static str {
    match warning {
        Warnings::UNSEALED => "no seal",
        Warnings::BROWN_OUT => "brown-out level",
        Warnings::BUILT_IN_ROBOT => "built-in robot",
        Warnings::CATCHES => "faults halt the core",
        _ => "?",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_warning_has_words() {
        let all = (0..8).filter_map(|bit| Warnings::from_bits(1 << bit));
        assert_eq!(all.clone().count(), 4);
        assert!(all.clone().all(|one| explained(one).len() > 30 && short(one) != "?"));
        assert!(!explained(Warnings::NONE.with(Warnings::UNSEALED)).contains("unknown"));
    }
}
