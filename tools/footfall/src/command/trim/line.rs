//! The lines that a user types in a trim.

/// What a line may be.
pub(super) const HELP: &str =
    "  +N, -N     make the pulse N us longer or shorter; + and - are 1 us, Enter repeats the last of these
  =N         move to a pulse of N us
  angle DEG  the joint has this angle now, flexion positive, -180 to 180
  undo       forget the last angle
  done       write the map of the angles so far
  quit       end without it";

/// A line of the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Line {
    Move(i32),
    To(u16),
    Angle(f64),
    Repeat,
    Undo,
    Done,
    Quit,
    Help,
}

impl Line {
    /// What the user means; `None` for what is none of these.
    pub(super) fn read(text: &str) -> Option<Self> {
        let text = text.trim();
        let number = |digits: &str| match digits.trim() {
            "" => Some(1),
            digits if digits.starts_with(['+', '-']) => None,
            digits => digits.parse::<u16>().ok().map(i32::from),
        };
        Some(match text {
            "" => Self::Repeat,
            "undo" => Self::Undo,
            "done" => Self::Done,
            "quit" => Self::Quit,
            "help" => Self::Help,
            _ => {
                if let Some(digits) = text.strip_prefix('+') {
                    Self::Move(number(digits)?)
                } else if let Some(digits) = text.strip_prefix('-') {
                    Self::Move(-number(digits)?)
                } else if let Some(digits) = text.strip_prefix('=') {
                    Self::To(digits.trim().parse().ok()?)
                } else {
                    let angle: f64 = text.strip_prefix("angle ")?.trim().parse().ok()?;
                    (-180.0..=180.0).contains(&angle).then_some(Self::Angle(angle))?
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_the_help_says() {
        for (text, line) in [
            ("+", Some(Line::Move(1))),
            ("-", Some(Line::Move(-1))),
            (" + 25 ", Some(Line::Move(25))),
            ("-3", Some(Line::Move(-3))),
            ("=1500", Some(Line::To(1_500))),
            ("angle -12.5", Some(Line::Angle(-12.5))),
            ("", Some(Line::Repeat)),
            ("done", Some(Line::Done)),
            ("angle", None),
            ("angle 181", None),
            ("angle nan", None),
            ("1500", None),
            ("+-3", None),
            ("=70000", None),
            ("Done", None),
        ] {
            assert_eq!(Line::read(text), line, "{text}");
        }
    }
}
