//! The command lines of a page in Markdown.

use std::path::Path;

/// A page and its command lines, from top to bottom.
pub(crate) struct Page {
    pub(crate) name: String,
    pub(crate) lines: Vec<String>,
}

/// The pages of the repository that have command lines for users.
pub(crate) fn pages(root: &Path) -> Vec<Page> {
    let mut names = vec!["README.md".to_owned(), "samples/README.md".to_owned()];
    for entry in std::fs::read_dir(root.join("docs")).expect("docs") {
        let name = entry.expect("an entry").file_name().into_string().expect("a name");
        if name.ends_with(".md") {
            names.push(format!("docs/{name}"));
        }
    }
    names.sort();
    let page = |name: String| {
        let text = std::fs::read_to_string(root.join(&name)).expect("a page");
        Page { lines: command_lines(&text), name }
    };
    names.into_iter().map(page).collect()
}

/// What is being read.
enum Place {
    Text,
    /// Every line is a command line.
    Shell,
    /// Lines that begin with a dollar sign are.
    Console,
    OtherBlock,
}

/// The command lines of a page: the lines of blocks marked `sh`, those behind `$` in blocks marked `console`, indented lines of `cargo` and
/// `footfall`, and code within text that has more than the name of a program or of a command.
pub(crate) fn command_lines(page: &str) -> Vec<String> {
    let mut place = Place::Text;
    let mut found = Found::default();
    for line in page.lines() {
        if let Some(kind) = line.strip_prefix("```") {
            found.end_of_paragraph();
            place = match (place, kind) {
                (Place::Text, "sh") => Place::Shell,
                (Place::Text, "console") => Place::Console,
                (Place::Text, _) => Place::OtherBlock,
                _ => Place::Text,
            };
            continue;
        }
        match place {
            Place::Text => found.text(line),
            Place::Shell => found.block_line(line),
            Place::Console => match line.strip_prefix("$ ") {
                Some(command) => found.block_line(command),
                None if found.is_open() => found.block_line(line),
                None => {}
            },
            Place::OtherBlock => {}
        }
    }
    found.end_of_paragraph();
    found.lines
}

#[derive(Default)]
struct Found {
    lines: Vec<String>,
    /// Of text: code may go on in the next line.
    paragraph: String,
    /// Of a block: the line so far, if it ends in a backslash.
    begun: String,
}

impl Found {
    fn text(&mut self, line: &str) {
        if let Some(indented) = line.strip_prefix("    ").map(str::trim_start) {
            self.end_of_paragraph();
            if ["cargo ", "footfall "].iter().any(|program| indented.starts_with(program)) {
                self.push(indented);
            }
        } else if line.trim().is_empty() {
            self.end_of_paragraph();
        } else {
            self.paragraph += line;
            self.paragraph.push(' ');
        }
    }

    fn end_of_paragraph(&mut self) {
        let paragraph = std::mem::take(&mut self.paragraph);
        for code in paragraph.split('`').skip(1).step_by(2) {
            let words = code.split_whitespace().count();
            if (code.starts_with("cargo ") || code.starts_with("footfall ")) && words > 2 {
                self.push(code);
            }
        }
    }

    fn is_open(&self) -> bool {
        !self.begun.is_empty()
    }

    fn block_line(&mut self, line: &str) {
        if let Some(begin) = line.trim().strip_suffix('\\') {
            self.begun += begin;
            return;
        }
        let line = std::mem::take(&mut self.begun) + line.trim();
        if !line.is_empty() && !line.starts_with('#') {
            self.push(&line);
        }
    }

    fn push(&mut self, line: &str) {
        // A comment begins with a number sign behind a blank, outside of quotes.
        let (mut quoted, mut before) = (false, ' ');
        let end = line.char_indices().find(|&(_, c)| {
            quoted ^= c == '"';
            let begins = c == '#' && before == ' ' && !quoted;
            before = c;
            begins
        });
        let line = line[..end.map_or(line.len(), |(at, _)| at)].split_whitespace().collect::<Vec<_>>().join(" ");
        self.lines.push(line);
    }
}
