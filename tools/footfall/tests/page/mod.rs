//! Takes the pages of reports apart: elements, tables, and the files that their links hold.
#![allow(dead_code, reason = "each test file uses a part of it")]

use quick_xml::Reader;
use quick_xml::events::Event;

/// An element of a page: its name, attributes, and the text in it and below.
#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) text: String,
    /// Index of the element around it.
    pub(crate) parent: Option<usize>,
}

impl Element {
    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }
}

/// Every element of a page in order. The pages are well-formed XML too, so that a parser of XML is strict about nesting and quotes.
fn elements(page: &str) -> Vec<Element> {
    let mut reader = Reader::from_str(page);
    let (mut all, mut open): (Vec<Element>, Vec<usize>) = (vec![], vec![]);
    loop {
        let event = reader.read_event().unwrap_or_else(|error| panic!("{error} at byte {}", reader.error_position()));
        let begun = match &event {
            Event::Start(start) | Event::Empty(start) => Some(start),
            _ => None,
        };
        if let Some(start) = begun {
            let text = |text: &str| text.to_owned();
            let attributes = start.attributes().map(|attribute| {
                let attribute = attribute.unwrap();
                (text(attribute.key.as_ref()), unescaped(&text(&attribute.value)))
            });
            all.push(Element {
                name: text(start.name().as_ref()),
                attributes: attributes.collect(),
                text: String::new(),
                parent: open.last().copied(),
            });
        }
        match event {
            Event::Start(_) => open.push(all.len() - 1),
            Event::End(_) => drop(open.pop().expect("an element to end")),
            Event::Text(text) => open.iter().for_each(|&n| all[n].text += &*text),
            Event::GeneralRef(name) => {
                let name = format!("&{};", &*name);
                open.iter().for_each(|&n| all[n].text += &unescaped(&name));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert!(open.is_empty(), "{open:?}");
    all
}

fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

/// What every page must have, for everybody who reads it.
pub(crate) fn check_structure(page: &str) -> Vec<Element> {
    let all = elements(page);
    let named = |name: &'static str| all.iter().filter(move |element| element.name == name);
    let below = |n: usize, name: &str| all.iter().any(|element| element.parent == Some(n) && element.name == name);
    assert_eq!(named("html").next().and_then(|html| html.attribute("lang")), Some("en"));
    assert_eq!((named("h1").count(), named("main").count()), (1, 1));
    assert!(named("title").next().is_some_and(|title| title.text.starts_with("Footfall: ")));
    assert!(named("meta").any(|meta| meta.attribute("content") == Some("width=device-width, initial-scale=1")));
    // Headings go down by one level at a time.
    let levels: Vec<u32> = all.iter().filter_map(|e| e.name.strip_prefix('h').and_then(|n| n.parse().ok())).collect();
    assert!(levels[0] == 1 && levels.windows(2).all(|pair| pair[1] <= pair[0] + 1), "{levels:?}");
    for (n, element) in all.iter().enumerate() {
        match element.name.as_str() {
            "table" => assert!(below(n, "caption"), "a table without a caption"),
            "th" => {
                let scope = element.attribute("scope");
                assert!(matches!(scope, Some("col" | "row")) && !element.text.is_empty(), "{element:?}");
            }
            "img" => {
                assert!(element.attribute("alt").is_some_and(|alt| alt.len() > 20), "an image without a description")
            }
            "svg" => {
                assert!(below(n, "title"), "a picture without a title: {element:?}");
                let is_key = element.attribute("aria-hidden") == Some("true");
                assert!(is_key || (element.attribute("role") == Some("img") && below(n, "desc")), "{element:?}");
            }
            _ => {}
        }
        for (key, value) in &element.attributes {
            // An image may be inside of the page.
            let is_held = key != "src" || value.starts_with("data:image/svg+xml,");
            assert!(!value.contains("://") && is_held && !key.starts_with("on"), "{key}={value:.60}");
            for id in if key == "aria-labelledby" { value.split(' ').collect() } else { vec![] } {
                assert_eq!(all.iter().filter(|other| other.attribute("id") == Some(id)).count(), 1, "{id}");
            }
        }
    }
    let style = &named("style").next().expect("a style sheet").text;
    // Chromium leaves the words of a button out of a table's head that it repeats on the next sheet of paper.
    for needed in ["prefers-color-scheme:dark", "@media print", "break-inside:avoid", "button{display:contents}"] {
        assert!(style.contains(needed), "{needed}");
    }
    assert!(!style.contains("url(") && !style.contains("@import"));
    all
}

/// The rows of the table with this caption, as texts of their cells.
pub(crate) fn rows(all: &[Element], caption: &str) -> Vec<Vec<String>> {
    let within = |mut n: usize, table: usize| loop {
        match all[n].parent {
            Some(parent) if parent == table => return true,
            Some(parent) => n = parent,
            None => return false,
        }
    };
    let of = |caption: &str| {
        let found = all.iter().find(|element| element.name == "caption" && element.text.starts_with(caption));
        found.unwrap_or_else(|| panic!("no table {caption}")).parent.unwrap()
    };
    let table = of(caption);
    let rows = (0..all.len()).filter(|&n| all[n].name == "tr" && within(n, table));
    rows.map(|row| all.iter().filter(|cell| cell.parent == Some(row)).map(|cell| cell.text.clone()).collect()).collect()
}

/// The cells of the row that begins so, as numbers; a dash is none.
pub(crate) fn numbers(all: &[Element], caption: &str, head: &str) -> Vec<Option<f64>> {
    let rows = rows(all, caption);
    let row = rows.iter().find(|row| row[0] == head).unwrap_or_else(|| panic!("no row {head} in {rows:?}"));
    row[1..].iter().map(|cell| cell.replace('−', "-").parse().ok()).collect()
}

/// Files that links of the page hold: name and content.
pub(crate) fn held_files(all: &[Element]) -> Vec<(String, String)> {
    let decoded = |text: &str| {
        let mut bytes = vec![];
        let mut rest = text.bytes();
        while let Some(byte) = rest.next() {
            let mut digit = || rest.next().and_then(|digit| char::from(digit).to_digit(16)).expect("a digit") as u8;
            bytes.push(if byte == b'%' { 16 * digit() + digit() } else { byte });
        }
        String::from_utf8(bytes).unwrap()
    };
    let links = all.iter().filter(|element| element.name == "a");
    let held = |link: &Element| {
        let data = link.attribute("href")?.strip_prefix("data:text/csv;charset=utf-8,")?;
        Some((link.attribute("download")?.to_owned(), decoded(data)))
    };
    links.filter_map(held).collect()
}
