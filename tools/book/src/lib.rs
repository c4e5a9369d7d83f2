//! The pages of the repository as one book of HTML.
//!
//! The pages stand in `docs` and beside what they describe. mdBook reads one folder and would copy everything in it, so the pages that
//! `docs/SUMMARY.md` lists are copied to a folder of their own first, each at its place: links between them stay as they are.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, ensure};
use mdbook_driver::MDBook;
use mdbook_driver::config::Config;
use mdbook_summary::{Summary, SummaryItem, parse_summary};

/// The list of the pages, relative to the root of the repository.
pub const SUMMARY: &str = "docs/SUMMARY.md";

/// Files that pages link to and that are no pages, and the style sheet that `book.toml` names.
const ATTACHED: [&str; 4] = ["CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT", "tools/book/style.css"];

/// The pages of the book in their order, relative to the root of the repository.
///
/// # Errors
/// The summary cannot be read, or is not a summary.
pub fn pages(root: &Path) -> Result<Vec<PathBuf>> {
    let mut pages = Vec::new();
    for_each_item(&mut summary(root)?, &mut |location| pages.push(location.clone()));
    Ok(pages)
}

/// Builds the book of the repository at `root` in the folder `out`, whose old content goes.
///
/// # Errors
/// A page of the summary or the configuration `book.toml` cannot be read, or the folder cannot be written to.
pub fn build(root: &Path, out: &Path) -> Result<()> {
    let folder = tempfile::tempdir().context("making a temporary folder")?;
    let attached = ATTACHED.iter().map(PathBuf::from);
    for name in pages(root)?.into_iter().chain(pictures(root)?).chain(attached) {
        let to = folder.path().join(&name);
        std::fs::create_dir_all(to.parent().context("a page without a folder")?)?;
        std::fs::copy(root.join(&name), to).with_context(|| format!("copying {}", name.display()))?;
    }
    let mut config = Config::from_disk(root.join("book.toml")).context("reading book.toml")?;
    config.book.src = PathBuf::from(".");
    config.build.build_dir = out.to_owned();
    // They would rename each README, and leave the links to it as they are.
    config.build.use_default_preprocessors = false;
    MDBook::load_with_config_and_summary(folder.path(), config, summary(root)?)?.build()
}

/// The summary, with the places of the pages relative to the root.
fn summary(root: &Path) -> Result<Summary> {
    let text = std::fs::read_to_string(root.join(SUMMARY)).with_context(|| format!("reading {SUMMARY}"))?;
    let mut summary = parse_summary(&text).with_context(|| format!("reading {SUMMARY}"))?;
    let mut outside = None;
    for_each_item(&mut summary, &mut |location| match from_root(location) {
        Some(place) => *location = place,
        None => outside = Some(location.clone()),
    });
    ensure!(outside.is_none(), "{SUMMARY} has a page outside of the repository: {outside:?}");
    Ok(summary)
}

/// Calls `each` with the place of every page.
fn for_each_item(summary: &mut Summary, each: &mut impl FnMut(&mut PathBuf)) {
    let parts = [&mut summary.prefix_chapters, &mut summary.numbered_chapters, &mut summary.suffix_chapters];
    parts.into_iter().for_each(|items| for_each_place(items, each));
}

fn for_each_place(items: &mut [SummaryItem], each: &mut impl FnMut(&mut PathBuf)) {
    for item in items {
        if let SummaryItem::Link(link) = item {
            link.location.iter_mut().for_each(&mut *each);
            for_each_place(&mut link.nested_items, each);
        }
    }
}

/// A place that is relative to the folder of the summary, relative to the root; `None` outside of it.
fn from_root(place: &Path) -> Option<PathBuf> {
    let mut path = Path::new(SUMMARY).parent()?.to_owned();
    for part in place.components() {
        match part {
            Component::ParentDir => path.pop().then_some(())?,
            Component::Normal(name) => path.push(name),
            _ => {}
        }
    }
    Some(path)
}

/// The pictures of `docs`.
fn pictures(root: &Path) -> Result<Vec<PathBuf>> {
    let mut pictures = Vec::new();
    for file in std::fs::read_dir(root.join("docs")).context("reading docs")? {
        let name = Path::new("docs").join(file?.file_name());
        if name.extension().is_some_and(|extension| extension == "svg") {
            pictures.push(name);
        }
    }
    Ok(pictures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_relative_to_the_summary() {
        assert_eq!(from_root(Path::new("boards.md")), Some("docs/boards.md".into()));
        assert_eq!(from_root(Path::new("../wire/./README.md")), Some("wire/README.md".into()));
        assert_eq!(from_root(Path::new("../../other.md")), None);
    }
}
