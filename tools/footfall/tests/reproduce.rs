//! `footfall reproduce`: its files agree with one another and with docs/reproduction.md.

mod common;
mod page;

use common::{footfall, parts, said};
use page::{check_structure, rows};
use quick_xml::Reader;
use quick_xml::events::Event;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;

/// A folder that one quick run has written, for all tests.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("made/here");
        let (code, written, talk) = parts(footfall(["reproduce".as_ref(), out.as_os_str(), "--quick".as_ref()]));
        assert_eq!(code, 0, "{talk}");
        assert!(written.lines().all(|file| Path::new(file).is_file()), "{written}");
        assert_eq!(written.lines().count(), std::fs::read_dir(&out).unwrap().count());
        // Progress, and what to do next.
        assert!(
            talk.contains("single oscillators") && talk.contains("micro-GA, seed 2") && talk.contains("index.html"),
            "{talk}"
        );
        folder
    });
    static OUT: OnceLock<std::path::PathBuf> = OnceLock::new();
    OUT.get_or_init(|| folder.path().join("made/here"))
}

fn text(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The claims of `claims.json`, by name.
fn claims() -> BTreeMap<String, Value> {
    let value: Value = serde_json::from_str(&text("claims.json")).unwrap();
    let all = value["claims"].as_array().unwrap();
    all.iter().map(|claim| (claim["id"].as_str().unwrap().to_owned(), claim.clone())).collect()
}

fn in_words(verdict: &Value) -> &'static str {
    match verdict.as_str() {
        Some("reproduced") => "reproduced",
        Some("not_reproduced") => "not reproduced",
        Some("undecided") => "cannot be decided",
        other => panic!("no verdict: {other:?}"),
    }
}

#[test]
fn every_claim_has_its_verdict_reason_and_number_in_every_file() {
    let claims = claims();
    assert!(claims.len() >= 30, "{}", claims.len());
    let mut table = csv::Reader::from_reader(text("claims.csv").into_bytes().leak() as &[u8]);
    let heads: Vec<String> = table.headers().unwrap().iter().map(String::from).collect();
    let mut count = 0;
    for row in table.records().map(Result::unwrap) {
        let of: BTreeMap<&str, &str> = heads.iter().map(String::as_str).zip(&row).collect();
        let claim = &claims[of["id"]];
        for (key, value) in of {
            let wanted = claim[key].as_str().map_or_else(|| claim[key].to_string(), String::from);
            assert_eq!(value, wanted, "{key}");
            assert!(!value.is_empty(), "{claim}");
        }
        count += 1;
    }
    assert_eq!(count, claims.len());
    let page = check_structure(&text("index.html"));
    let shown = rows(&page, "Claims of the papers");
    for claim in claims.values() {
        let row = shown
            .iter()
            .find(|row| row[0] == claim["statement"].as_str().unwrap())
            .unwrap_or_else(|| panic!("{claim}"));
        assert_eq!(
            (row[4].as_str(), row[3].as_str()),
            (in_words(&claim["verdict"]), claim["our_number"].as_str().unwrap())
        );
    }
}

/// The rows of the table of claims in a page of Markdown: the cells without the reason, by the claim's name.
fn table_of(markdown: &str) -> BTreeMap<String, Vec<String>> {
    let rows = markdown.lines().filter(|line| line.starts_with("| `"));
    let cells =
        rows.map(|row| row.trim_matches('|').split(" | ").map(|cell| cell.trim().to_owned()).collect::<Vec<_>>());
    let of_claims = cells.filter(|cells| cells.len() == 6 || cells.len() == 7);
    of_claims.map(|cells| (cells[0].trim_matches('`').to_owned(), cells[..6].to_vec())).collect()
}

/// The page was written by a run with the whole budget. Its claims and verdicts are those of any run; where no search is behind a claim, its
/// numbers too.
#[test]
fn the_page_of_the_book_has_the_same_claims_and_verdicts() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reproduction.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (of_page, of_run, claims) = (table_of(&page), table_of(&text("claims.md")), claims());
    assert_eq!(of_page.keys().collect::<Vec<_>>(), of_run.keys().collect::<Vec<_>>());
    assert_eq!(of_run.keys().collect::<Vec<_>>(), claims.keys().collect::<Vec<_>>());
    for (id, claim) in &claims {
        assert_eq!(of_page[id][5], format!("**{}**", in_words(&claim["verdict"])), "{id}");
        assert_eq!(of_page[id][5], of_run[id][5], "{id}");
        if claim["depends_on_budget"] == false {
            assert_eq!(of_page[id], of_run[id]);
        }
    }
    let count = |verdict: &str| claims.values().filter(|claim| in_words(&claim["verdict"]) == verdict).count();
    let [found, other, open] = ["reproduced", "not reproduced", "cannot be decided"].map(count);
    let sum =
        format!("Of {} claims {found} are reproduced, {other} are not, and {open} cannot be decided", claims.len());
    assert!(page.replace('\n', " ").contains(&sum), "{sum}");
}

/// The points of the curves of a picture, which is well-formed.
fn points(svg: &str) -> Vec<usize> {
    let mut reader = Reader::from_str(svg);
    let mut found = vec![];
    loop {
        match reader.read_event().unwrap_or_else(|error| panic!("{error} at byte {}", reader.error_position())) {
            Event::Eof => return found,
            Event::Empty(element) | Event::Start(element) if element.name().as_ref() == "polyline" => {
                let of =
                    |key: &str| element.attributes().map(Result::unwrap).find(|a| a.key.as_ref() == key).unwrap().value;
                // Axes are black, arrows grey lines of two points; curves are written with fractions of a pixel.
                if of("points").contains('.') {
                    found.push(of("points").split_whitespace().count());
                }
            }
            _ => {}
        }
    }
}

#[test]
fn every_picture_has_its_numbers_its_units_and_its_command() {
    let names: Vec<String> =
        std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    let pictures: Vec<&str> = names.iter().filter_map(|name| name.strip_suffix(".svg")).collect();
    assert!(pictures.len() >= 24, "{pictures:?}");
    let page = text("index.html");
    for name in pictures {
        let svg = text(&format!("{name}.svg"));
        assert!(
            svg.contains("Parameters: ") && svg.contains("Command: footfall reproduce OUT --seed 1 --quick"),
            "{name}"
        );
        assert!(page.contains(&format!("<figure id=\"{name}\">")), "{name}");
        let mut rows = csv::Reader::from_reader(text(&format!("{name}.csv")).into_bytes().leak() as &[u8]);
        assert_eq!(rows.headers().unwrap(), vec!["panel", "kind", "series", "x_axis", "x", "y_axis", "y"]);
        let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
        let of = |kind: &str| rows.iter().filter(|row| &row[1] == kind).count();
        assert_eq!(of("curve"), points(&svg).iter().sum::<usize>(), "{name}");
        let bars = svg.matches("<rect").count() - svg.matches("fill=\"#FFFFFF\"").count();
        assert!(of("bar") == 0 || of("bar") <= bars, "{name}: {} and {bars}", of("bar"));
        for row in rows.iter().filter(|row| ["curve", "bar"].contains(&&row[1])) {
            assert!(svg.contains(&row[3]) && row[4].parse::<f64>().is_ok() && row[6].parse::<f64>().is_ok(), "{row:?}");
            // An axis says its unit; what is a number has none, and says what of.
            let has_unit = row[3].contains(", ") || ["step", "s", "a", "b", "factor on Tr and Ta"].contains(&&row[3]);
            assert!(has_unit, "{name}: {row:?}");
        }
    }
}

/// The oracle is the scaling of Rayleigh's oscillator: with ten times p the curve of figure 2.6 is that of 2.4, smaller by the root of ten.
#[test]
fn the_numbers_of_two_figures_obey_the_exact_scaling() {
    let angles = |name: &str| -> Vec<f64> {
        let rows = text(&format!("{name}.csv"));
        let mut rows = csv::Reader::from_reader(rows.as_bytes());
        let rows = rows.records().map(Result::unwrap).filter(|row| &row[0] == "angle" && &row[2] == "from outside");
        rows.map(|row| row[6].parse().unwrap()).collect()
    };
    let (wide, small) = (angles("thesis-2-4"), angles("thesis-2-6"));
    assert!(wide.len() > 1000 && wide.len() == small.len());
    for (a, b) in wide.iter().zip(&small) {
        assert!((a / 10_f64.sqrt() - b).abs() < 1e-6, "{a}, {b}");
    }
}

#[test]
fn a_folder_with_files_is_kept_without_force_and_a_seed_gives_the_same_bytes() {
    let other = tempfile::tempdir().unwrap();
    std::fs::write(other.path().join("mine.txt"), "mine").unwrap();
    let run =
        |more: &[&str]| parts(footfall([&["reproduce", other.path().to_str().unwrap(), "--quick"], more].concat()));
    let (code, out, talk) = run(&[]);
    assert!(code == 2 && out.is_empty() && talk.contains("has files in it") && talk.contains("--force"), "{talk}");
    assert_eq!(std::fs::read_dir(other.path()).unwrap().count(), 1);
    let file = other.path().join("mine.txt");
    let onto = footfall(["reproduce", file.to_str().unwrap()]);
    assert!(onto.status.code() == Some(2) && said(&onto).contains("is a file"), "{}", said(&onto));
    let (code, out, talk) = run(&["--force", "--json", "--quiet"]);
    assert!(code == 0 && talk.is_empty(), "{talk}");
    assert_eq!(out, text("claims.json"));
    assert_eq!(std::fs::read_to_string(other.path().join("claims.json")).unwrap(), out);
    assert_eq!(std::fs::read_to_string(file).unwrap(), "mine");
    for name in ["searches.csv", "thesis-searches.csv", "thesis-person.svg"] {
        assert_eq!(std::fs::read_to_string(other.path().join(name)).unwrap(), text(name), "{name}");
    }
}
