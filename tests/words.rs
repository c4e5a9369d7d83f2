//! Words that occur nowhere: not in code, not in comments, not in the documentation.

use footfall_tests::name_parts::{joined, parts};
use footfall_tests::workspace::{assert_none, files_ending, read};

/// Words that occur nowhere, each in two parts, so that this file does not contain them.
const WORDS: [(&str, &str); 8] = [
    ("to", "ld"),
    ("foreto", "ld"),
    ("belie", "ved"),
    ("an", "ew"),
    ("gra", "ver"),
    ("gra", "vest"),
    ("le", "st"),
    ("ea", "rs"),
];

#[test]
fn some_words_occur_nowhere() {
    let words = joined(&WORDS);
    let mut found = Vec::new();
    for name in files_ending(&[".rs", ".md", ".toml", ".html"]) {
        for (number, line) in read(name).lines().enumerate() {
            for word in parts(line).into_iter().filter(|part| words.contains(part)) {
                found.push(format!("{name}:{}: `{word}`", number + 1));
            }
        }
    }
    assert_none(&found, "places with words that occur nowhere (say it in plain English)");
}
