//! Names and words in parts, to look for those that nothing has.

/// Words of two parts each, which the file that lists them does not contain, in one.
#[must_use]
pub fn joined(words: &[(&str, &str)]) -> Vec<String> {
    words.iter().map(|(first, second)| format!("{first}{second}")).collect()
}

/// A word, or a name in snake_case, CamelCase or kebab-case, as lower-case parts.
#[must_use]
pub fn parts(text: &str) -> Vec<String> {
    let mut parts = Vec::new();
    for run in text.split(|c: char| !c.is_alphabetic()) {
        let letters: Vec<char> = run.chars().collect();
        let mut part = String::new();
        for (n, &letter) in letters.iter().enumerate() {
            let after_lower = n > 0 && letters[n - 1].is_lowercase();
            let before_lower = letters.get(n + 1).is_some_and(|next| next.is_lowercase());
            if letter.is_uppercase() && (after_lower || before_lower) && !part.is_empty() {
                parts.push(std::mem::take(&mut part));
            }
            part.extend(letter.to_lowercase());
        }
        if !part.is_empty() {
            parts.push(part);
        }
    }
    parts
}
