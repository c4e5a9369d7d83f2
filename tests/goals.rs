//! The goals of docs/campaign.md whose numbers other files of the repository have.

use footfall_tests::workspace::read;

/// Bytes of the stack, as memory.x and the page on performance have it.
const STACK: f64 = 92.0 * 1024.0;

/// 48180 as `48,180`.
fn with_comma(bytes: i64) -> String {
    format!("{},{:03}", bytes / 1000, bytes % 1000)
}

#[test]
fn the_row_of_the_stack_has_the_numbers_of_the_ratchets_and_says_what_they_miss() {
    assert!(read("memory.x").contains("STACK : ORIGIN = 0x20000000, LENGTH = 92K"));
    let ratchets: toml::Table = read("ratchets.toml").parse().expect("TOML");
    let bytes = |name: &str| ratchets["ratchets"][name]["value"].as_integer().expect("a whole number");
    let percent = |bytes: i64| 100.0 * bytes as f64 / STACK;
    let page = read("docs/campaign.md");
    let row = page.lines().find(|line| line.starts_with("| stack: ")).expect("a row");
    let [bound, used, after_start] = ["stack-bound-bytes", "stack-used-bytes", "stack-after-start-bytes"].map(bytes);
    for text in [
        format!("a bound of at most 50 % of it, used at most 60 % | bound {}, ", with_comma(bound) + " bytes"),
        format!("used {} (`ratchets.toml`), of 94,208 ", with_comma(used)),
        format!(": {:.1} % and {:.1} %, ", percent(bound), percent(used)),
        format!(": {} of the thread ", with_comma(after_start)),
    ] {
        assert!(row.contains(&text), "no `{text}` in\n{row}");
    }
    let word = |is_met: bool| if is_met { "yes" } else { "no" };
    assert_eq!(row.contains("the bound no"), percent(bound) > 50.0, "{row}");
    assert!(row.contains(&format!("the use {}", word(percent(used) <= 60.0))), "{row}");
}
