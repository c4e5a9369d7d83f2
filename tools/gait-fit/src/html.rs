//! Parts of the HTML pages of reports: the page around them, tables with caption and heads, notes, links that hold a file.
//!
//! The pages are well-formed XML as well, need no other file and no script, and fit phones, dark screens, paper and screen readers.

use std::fmt::Write as _;

/// The style sheet of all pages.
const STYLE: &str = include_str!("page_style.css");

/// Begin of a page, up to its first heading.
#[must_use]
pub fn begin(title: &str, heading: &str) -> String {
    let (title, heading) = (escape(title), file_name(heading));
    format!(
        "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"/>\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><meta name=\"color-scheme\" content=\"light dark\"/>\
         <title>Footfall: {title}</title><style>{STYLE}</style></head><body><main><h1>{heading}</h1>"
    )
}

/// End of a page.
pub const END: &str = "</main></body></html>\n";

/// Escapes text for HTML.
#[must_use]
pub fn escape(text: &str) -> String {
    // Other control characters are in neither HTML nor XML, and a mark of the writing direction shows a name as another one.
    let direction =
        |c| matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let allowed = |c: char| (!c.is_control() || matches!(c, '\n' | '\t')) && !direction(c);
    let text: String = text.chars().map(|c| if allowed(c) { c } else { '\u{fffd}' }).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A paragraph of plain text.
pub fn paragraph(page: &mut String, text: &str) {
    // Writing to a String cannot fail.
    let _ = write!(page, "<p>{}</p>", escape(text));
}

/// A paragraph that stands out.
pub fn note(page: &mut String, text: &str) {
    let _ = write!(page, "<p class=\"note\">{}</p>", escape(text));
}

/// A list of sentences.
pub fn list(page: &mut String, sentences: impl IntoIterator<Item = String>) {
    *page += "<ul>";
    for sentence in sentences {
        let _ = write!(page, "<li>{}</li>", escape(&sentence));
    }
    *page += "</ul>";
}

/// A table with a caption. The first cell of each row is its head; `head` are the heads of the columns, the first one that of the rows.
/// Without them, the table is a list of names and values. Columns whose first cell with content is no number are aligned as text. A table
/// that is wider than the page scrolls inside of it.
pub fn table<R, C>(page: &mut String, caption: &str, head: &[&str], rows: R)
where
    R: IntoIterator<Item = C>,
    C: IntoIterator,
    C::Item: AsRef<str>,
{
    let cells = |row: C| row.into_iter().map(|cell| escape(cell.as_ref())).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = rows.into_iter().map(cells).collect();
    let is_text = |column: usize| {
        let first = rows.iter().find_map(|row| row.get(column)?.chars().next());
        head.is_empty() || column == 0 || first.is_some_and(|c| !(c.is_ascii_digit() || "+-−–.".contains(c)))
    };
    let class = |column: usize| if is_text(column) { " class=\"text\"" } else { "" };
    let caption = escape(caption);
    let _ = write!(
        page,
        "<div class=\"table\" role=\"region\" aria-label=\"{caption}\" tabindex=\"0\"><table><caption>{caption}</caption>"
    );
    if !head.is_empty() {
        *page += "<thead><tr>";
        for (n, cell) in head.iter().enumerate() {
            let _ = write!(page, "<th scope=\"col\"{}>{}</th>", class(n), escape(cell));
        }
        *page += "</tr></thead>";
    }
    *page += "<tbody>";
    for row in &rows {
        *page += "<tr>";
        for (n, cell) in row.iter().enumerate() {
            let _ = if n == 0 {
                write!(page, "<th scope=\"row\">{cell}</th>")
            } else {
                write!(page, "<td{}>{cell}</td>", class(n))
            };
        }
        *page += "</tr>";
    }
    *page += "</tbody></table></div>";
}

/// A legend: names of lines and areas, each with the class with which it is drawn.
pub fn legend(page: &mut String, entries: &[(&str, &str)]) {
    *page += "<ul class=\"key\">";
    for (name, class) in entries {
        let shape = if matches!(*class, "others" | "band") {
            format!("<rect class=\"{class}\" width=\"34\" height=\"14\"/>")
        } else {
            format!("<polyline class=\"{class}\" points=\"0,7 34,7\"/>")
        };
        let name = escape(name);
        // Writing to a String cannot fail.
        let _ = write!(
            page,
            "<li><svg viewBox=\"0 0 34 14\" aria-hidden=\"true\"><title>{name}</title>{shape}</svg>{name}</li>"
        );
    }
    *page += "</ul>";
}

/// The name of a file, which may break behind an underscore.
#[must_use]
pub fn file_name(name: &str) -> String {
    escape(name).replace('_', "_<wbr/>")
}

/// A link that holds a CSV file: it works without a network and without a second file.
#[must_use]
pub fn csv_link(name: &str, words: &str, csv: &str) -> String {
    format!(
        "<a download=\"{}\" href=\"data:text/csv;charset=utf-8,{}\">{}</a>",
        escape(name),
        percent_encoded(csv),
        escape(words)
    )
}

/// Text for an address: letters, digits and what has no meaning there as they are, every other byte as %XX.
///
/// ```
/// assert_eq!(gait_fit::html::percent_encoded("a/b 1,5%\n"), "a/b%201,5%25%0A");
/// ```
#[must_use]
pub fn percent_encoded(text: &str) -> String {
    let mut encoded = String::with_capacity(text.len());
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-_.~,/".contains(&byte) {
            encoded.push(byte.into());
        } else {
            let _ = write!(encoded, "%{byte:02X}");
        }
    }
    encoded
}

/// A value with so many decimals; a dash for none. A rounded zero has no sign.
#[must_use]
pub fn number(value: Option<f64>, digits: usize) -> String {
    let Some(value) = value.filter(|value| value.is_finite()) else { return "–".into() };
    let scale = 10_f64.powi(digits as i32);
    format!("{:.digits$}", (value * scale).round() / scale + 0.0).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_tables_have_heads() {
        let mut page = begin("x", "a <b> & \"c\"");
        table(&mut page, "x & y", &["joint", "deg"], [["left <hip>", "1"]]);
        page += END;
        assert!(
            page.contains("<h1>a &lt;b&gt; &amp; &quot;c&quot;</h1>") && page.contains("<caption>x &amp; y</caption>")
        );
        assert!(
            page.contains("<th scope=\"col\">deg</th>") && page.contains("<th scope=\"row\">left &lt;hip&gt;</th>")
        );
        let mut page = String::new();
        table(&mut page, "x", &["file", "why", "deg"], [["a", "", "−1"], ["b", "/tmp", "x"]]);
        assert!(page.contains("<th scope=\"col\" class=\"text\">why</th><th scope=\"col\">deg</th>"), "{page}");
        assert_eq!(escape("bell \u{7}\u{1b}[31m"), "bell \u{fffd}\u{fffd}[31m");
    }

    #[test]
    fn numbers_have_no_negative_zero() {
        assert_eq!(number(Some(-0.004), 2), "0.00");
        assert_eq!(number(Some(-1.006), 2), "−1.01");
        assert_eq!(number(None, 2), "–");
        assert_eq!(number(Some(f64::NAN), 2), "–");
    }
}
