//! The book that is built: every page is in it, every link leads to a place that exists, and pictures can be read on any ground.

mod html;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use html::Page;

/// Pages that are none of the book: the list of its pages.
const NOT_IN_THE_BOOK: [&str; 1] = [book::SUMMARY];

/// Addresses that lead out of the book: nothing is fetched, so they are not followed.
const ELSEWHERE: [&str; 3] = ["https://", "http://", "mailto:"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The files of the repository that git does not ignore, relative to its root.
fn files() -> BTreeSet<PathBuf> {
    let mut git = Command::new("git");
    git.args(["-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]);
    let output = git.current_dir(root()).output().expect("git starts");
    assert!(output.status.success(), "git ls-files: {}", String::from_utf8_lossy(&output.stderr));
    let list = String::from_utf8(output.stdout).expect("file names are text");
    // A file that was removed but not from the index is not there.
    list.split('\0').map(PathBuf::from).filter(|name| root().join(name).is_file()).collect()
}

/// The pages of a book that was built, by their paths in it.
fn built(folder: &Path) -> BTreeMap<PathBuf, Page> {
    book::build(&root(), folder).expect("the book is built");
    let mut pages = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(inner) = folders.pop() {
        for entry in std::fs::read_dir(&inner).expect("a folder of the book") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "html") {
                let text = std::fs::read_to_string(&path).expect("a page");
                pages.insert(path.strip_prefix(folder).expect("below the folder").to_owned(), Page::read(&text));
            }
        }
    }
    pages
}

/// Where an address in a page leads, relative to the book; `None` outside of it.
fn target(page: &Path, address: &str) -> Option<PathBuf> {
    if address.is_empty() {
        return Some(page.to_owned());
    }
    let mut path = page.parent().expect("a page is in a folder").to_owned();
    for part in Path::new(address).components() {
        match part {
            Component::ParentDir => path.pop().then_some(())?,
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            _ => return None,
        }
    }
    Some(path)
}

/// The addresses of a book that lead nowhere, each with its page.
fn dead_links(folder: &Path, pages: &BTreeMap<PathBuf, Page>) -> Vec<String> {
    let mut dead = Vec::new();
    for (name, page) in pages {
        for link in page.links.iter().filter(|link| !ELSEWHERE.iter().any(|start| link.starts_with(start))) {
            let (address, id) = link.split_once('#').unwrap_or((link, ""));
            let path = target(name, address);
            let is_there = path.as_ref().is_some_and(|path| folder.join(path).is_file());
            let has_id = |path: PathBuf| pages.get(&path).is_some_and(|page| page.ids.contains(id));
            if !is_there || !(id.is_empty() || path.is_some_and(has_id)) {
                dead.push(format!("{}: `{link}`", name.display()));
            }
        }
    }
    dead
}

#[test]
fn every_link_of_the_book_leads_to_a_place_that_exists() {
    let folder = tempfile::tempdir().unwrap();
    let pages = built(folder.path());
    let links: usize = pages.values().map(|page| page.links.len()).sum();
    assert!(pages.len() > 15 && links > 300, "{} pages, {links} links", pages.len());
    let dead = dead_links(folder.path(), &pages);
    assert!(dead.is_empty(), "links that lead nowhere:\n{}", dead.join("\n"));
}

/// The check finds a missing page, a missing place in a page, and an address outside of the book.
#[test]
fn a_link_that_leads_nowhere_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let text = "<h1 id=\"a\">A</h1><a href=\"#a\"></a><a href=\"#b\"></a><img src=\"none.svg\"><a href=\"../out.html\"></a>\
                <a href=\"https://example.org/none\"></a><script>let x = '<a href=\"script.html\">';</script>";
    std::fs::write(folder.path().join("page.html"), text).unwrap();
    let pages = BTreeMap::from([(PathBuf::from("page.html"), Page::read(text))]);
    assert_eq!(
        dead_links(folder.path(), &pages),
        ["page.html: `#b`", "page.html: `none.svg`", "page.html: `../out.html`"]
    );
}

#[test]
fn every_page_of_the_repository_is_in_the_summary_once() {
    let listed = book::pages(&root()).unwrap();
    let in_summary: BTreeSet<PathBuf> = listed.iter().cloned().collect();
    assert_eq!(in_summary.len(), listed.len(), "a page stands twice in {}", book::SUMMARY);
    let is_page = |name: &PathBuf| {
        name.extension().is_some_and(|extension| extension == "md")
            && !NOT_IN_THE_BOOK.iter().any(|not| name == Path::new(not))
    };
    let pages: BTreeSet<PathBuf> = files().into_iter().filter(is_page).collect();
    let forgotten: Vec<_> = pages.difference(&in_summary).collect();
    assert!(forgotten.is_empty(), "{} does not list {forgotten:?}", book::SUMMARY);
}

/// The first rows of code and manifests name pages; so do messages. Each such page exists.
#[test]
fn pages_that_the_code_names_exist() {
    let files = files();
    let mut wrong = Vec::new();
    let is_code = |name: &&PathBuf| name.extension().is_some_and(|extension| extension == "rs" || extension == "toml");
    for name in files.iter().filter(is_code) {
        let text = std::fs::read_to_string(root().join(name)).expect("a file of code");
        for (start, _) in text.match_indices("docs/") {
            let place = &text[start..];
            let end = place.find(|c: char| !(c.is_ascii_alphanumeric() || "/._-".contains(c))).unwrap_or(place.len());
            let page = place[..end].trim_end_matches('.');
            if page.ends_with(".md") && !files.contains(Path::new(page)) {
                wrong.push(format!("{}: {page}", name.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "pages that do not exist:\n{}", wrong.join("\n"));
}

/// A picture without a ground of its own would be black on a dark page.
#[test]
fn every_picture_of_the_pages_brings_its_ground() {
    let pictures: Vec<PathBuf> = files()
        .into_iter()
        .filter(|name| name.starts_with("docs") && name.extension().is_some_and(|e| e == "svg"))
        .collect();
    assert!(pictures.len() > 3, "{pictures:?}");
    for name in pictures {
        let text = std::fs::read_to_string(root().join(&name)).unwrap();
        let picture = Page::read(&text);
        let view = picture.first("svg", "viewBox").unwrap_or_else(|| panic!("{}: no viewBox", name.display()));
        let [_, _, width, height]: [&str; 4] = view.split(' ').collect::<Vec<_>>().try_into().expect("four numbers");
        let covers = |rect: &html::Tag| {
            let is = |name: &str, value: &str| rect.value(name).is_some_and(|v| v == value || v == "100%");
            let fill = rect
                .value("fill")
                .or_else(|| text.split_once(&format!(".{} {{fill: ", rect.value("class")?)).map(|(_, fill)| fill));
            is("width", width) && is("height", height) && fill.is_some_and(|fill| fill.starts_with('#'))
        };
        let has_ground = picture.tags.iter().filter(|tag| tag.name == "rect").any(covers);
        assert!(has_ground, "{}: no rectangle of {width} x {height} with a colour", name.display());
    }
}
