//! `docs/formats.md` is the page that the readers describe. With `FOOTFALL_WRITE_DOCS=1` it is written instead.

use gait_trace::format::page;
use std::path::Path;

#[test]
fn the_page_of_formats_is_that_of_the_readers() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = page::markdown();
    if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &page).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let differs = found.lines().zip(page.lines()).position(|(found, page)| found != page);
    assert!(
        found == page,
        "docs/formats.md differs from the readers from line {} on: FOOTFALL_WRITE_DOCS=1 writes it",
        differs.map_or(found.lines().count().min(page.lines().count()) + 1, |line| line + 1)
    );
}
