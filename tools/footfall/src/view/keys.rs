//! Keys of the live screens of boards.

use ratatui::crossterm::event::{self, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use std::io;
use std::time::Duration;

/// Meaning of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// The user button of the virtual board.
    Button,
    /// The end of the program.
    End,
    /// A change of the running board.
    Tune(TuneKey),
}

/// A change of the running board. None of them arms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TuneKey {
    /// The parameter above.
    Previous,
    /// The parameter below.
    Next,
    /// A smaller value.
    Less,
    /// A larger value.
    More,
    /// Back to the settings before the last change.
    Undo,
    /// The short ramp to the park pose, at once.
    Stop,
}

/// The meaning of the next key in the queue.
///
/// # Errors
/// The terminal cannot be read.
pub fn key() -> io::Result<Option<Key>> {
    while event::poll(Duration::ZERO)? {
        if let event::Event::Key(key) = event::read()?
            && let Some(meaning) = meaning(&key)
        {
            return Ok(Some(meaning));
        }
    }
    Ok(None)
}

fn meaning(key: &KeyEvent) -> Option<Key> {
    if key.kind != KeyEventKind::Press {
        return None;
    }
    match key.code {
        KeyCode::Char(' ') => Some(Key::Button),
        KeyCode::Char('q') | KeyCode::Esc => Some(Key::End),
        // In raw mode the terminal sends no signal.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::End),
        KeyCode::Up => Some(Key::Tune(TuneKey::Previous)),
        KeyCode::Down => Some(Key::Tune(TuneKey::Next)),
        KeyCode::Left => Some(Key::Tune(TuneKey::Less)),
        KeyCode::Right => Some(Key::Tune(TuneKey::More)),
        KeyCode::Char('u') => Some(Key::Tune(TuneKey::Undo)),
        KeyCode::Char('s') => Some(Key::Tune(TuneKey::Stop)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_mean_what_the_last_line_of_the_screen_says() {
        let pressed = |code, modifiers| meaning(&KeyEvent::new(code, modifiers));
        for (code, wanted) in [
            (KeyCode::Char(' '), Some(Key::Button)),
            (KeyCode::Char('q'), Some(Key::End)),
            (KeyCode::Up, Some(Key::Tune(TuneKey::Previous))),
            (KeyCode::Down, Some(Key::Tune(TuneKey::Next))),
            (KeyCode::Left, Some(Key::Tune(TuneKey::Less))),
            (KeyCode::Right, Some(Key::Tune(TuneKey::More))),
            (KeyCode::Char('u'), Some(Key::Tune(TuneKey::Undo))),
            (KeyCode::Char('s'), Some(Key::Tune(TuneKey::Stop))),
            (KeyCode::Char('c'), None),
            (KeyCode::Enter, None),
        ] {
            assert_eq!(pressed(code, KeyModifiers::NONE), wanted, "{code:?}");
        }
        assert_eq!(pressed(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Key::End));
        let released = KeyEvent::new_with_kind(KeyCode::Char('q'), KeyModifiers::NONE, KeyEventKind::Release);
        assert_eq!(meaning(&released), None);
    }
}
