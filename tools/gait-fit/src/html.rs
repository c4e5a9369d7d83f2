//! Parts of the HTML pages of reports: head, escaped text, rows of tables.

/// Begin of a page, up to its title.
pub const HEAD: &str = "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><style>\
body{font:15px/1.5 sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #ccc;padding:.25em .7em;text-align:right}\
th:first-child,td:first-child{text-align:left}th{background:#f3f3f3}svg{max-width:100%;height:auto}\
.note{background:#fff6df;padding:.4em .8em;margin:.4em 0}code,pre{background:#f3f3f3;padding:.1em .3em}pre{overflow-x:auto}\
</style>";

/// Escapes text for HTML.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Adds a row to a table, of cells `td` or `th`.
pub fn row<'a>(page: &mut String, cell: &str, cells: impl IntoIterator<Item = &'a str>) {
    *page += "<tr>";
    for text in cells {
        *page += &format!("<{cell}>{}</{cell}>", escape(text));
    }
    *page += "</tr>";
}
