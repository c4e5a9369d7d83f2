//! Words of command lines, for messages that say what to type.

use std::path::Path;

/// A path or a word as a shell reads it as one word.
#[must_use]
pub fn shell_word(word: impl AsRef<Path>) -> String {
    let word = word.as_ref().to_string_lossy().into_owned();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(shell_word("left_hip=3,time=1"), "left_hip=3,time=1");
        assert_eq!(shell_word("my walk.csv"), "'my walk.csv'");
        assert_eq!(shell_word("it's"), r"'it'\''s'");
        assert_eq!(shell_word(""), "''");
    }
}
