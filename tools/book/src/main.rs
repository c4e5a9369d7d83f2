//! Builds the book: `book ROOT OUT [--open]`, the folders of the repository and of the book. `cargo xtask book` calls it.

use std::path::Path;

use anyhow::{Context, Result, bail};

fn main() -> Result<()> {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let (root, out, is_opened) = match arguments.as_slice() {
        [root, out] => (root, out, false),
        [root, out, open] if open == "--open" => (root, out, true),
        _ => bail!("usage: book ROOT OUT [--open] (the folder of the repository, the folder for the book)"),
    };
    let out = std::path::absolute(out).context("reading the working directory")?;
    book::build(Path::new(root), &out)?;
    if is_opened {
        let page = out.join("index.html");
        opener::open(&page).with_context(|| format!("opening {}", page.display()))?;
    }
    Ok(())
}
