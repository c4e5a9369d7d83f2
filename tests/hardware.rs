//! `docs/hardware.md` is made from the files in `hardware/`; with `FOOTFALL_WRITE_DOCS=1` it is written instead.

use footfall::command::bringup::evidence::{Evidence, Port, Quantity, Status, Value};
use footfall_tests::workspace::{assert_none, read, root};
use std::collections::BTreeMap;
use std::fmt::Write;

const PAGE: &str = "docs/hardware.md";
const MARKS: [&str; 2] = ["<!-- made from hardware/ -->", "<!-- end of what is made from hardware/ -->"];

/// The files of a folder by their names, each read, or why it does not count.
fn files() -> BTreeMap<String, Result<Evidence, String>> {
    let entries = std::fs::read_dir(root().join("hardware")).expect("the folder hardware");
    let names = entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"));
    names
        .filter(|name| name != ".gitkeep")
        .map(|name| {
            let of = read(format!("hardware/{name}"));
            let evidence = counted(&name, &of);
            (name, evidence)
        })
        .collect()
}

/// Reads a file that counts as evidence about hardware.
fn counted(name: &str, text: &str) -> Result<Evidence, String> {
    let evidence = Evidence::parse(text)?;
    if evidence.port == Port::PseudoTerminal {
        return Err("it came through a pseudo-terminal, as that of a virtual board: no evidence about hardware".into());
    }
    let own = format!("bringup-{}-{}.toml", evidence.board, evidence.chip_id);
    if own == name { Ok(evidence) } else { Err(format!("its name is {name}, and by its content {own}")) }
}

/// Tables of boards and of quantities.
fn tables(all: &[Evidence]) -> String {
    if all.is_empty() {
        return "The folder is empty: no quantity has been measured on hardware so far.\n".into();
    }
    let mut text =
        String::from("| board | chip id | date | verdict | refused | not measured |\n|---|---|---|---|---|---|\n");
    for one in all {
        let names = |status| {
            let of: Vec<&str> =
                one.quantities.iter().filter(|one| one.status == status).map(|one| one.name.as_str()).collect();
            if of.is_empty() { "-".to_owned() } else { of.join(", ") }
        };
        let (refused, missing) = (names(Status::Refused), names(Status::NotMeasured));
        let Evidence { board, chip_id, date, verdict, .. } = one;
        writeln!(text, "| {board} | {chip_id} | {date} | {} | {refused} | {missing} |", verdict.name()).expect("text");
    }
    text += "\n| board | quantity | least | greatest | unit | allowed | boards |\n|---|---|---|---|---|---|---|\n";
    let mut rows: BTreeMap<(&str, &str), Vec<&Quantity>> = BTreeMap::new();
    for one in all {
        for quantity in &one.quantities {
            rows.entry((&one.board, &quantity.name)).or_default().push(quantity);
        }
    }
    for ((board, name), of) in rows {
        let mut numbers: Vec<f64> = of
            .iter()
            .filter_map(|one| match one.value {
                Some(Value::Number(n)) => Some(n),
                _ => None,
            })
            .collect();
        let words = of.iter().filter_map(|one| match &one.value {
            Some(Value::Word(word)) => Some(word.clone()),
            _ => None,
        });
        numbers.sort_by(f64::total_cmp);
        let measured = numbers.len();
        let words: Vec<String> = words.collect();
        let [least, greatest] = match (numbers.first(), numbers.last()) {
            (Some(least), Some(greatest)) => [least.to_string(), greatest.to_string()],
            _ => [words.join(", "), String::new()],
        };
        let (unit, allowed) = (&of[0].unit, of[0].limits().unwrap_or_else(|| "-".into()));
        writeln!(text, "| {board} | {name} | {least} | {greatest} | {unit} | {allowed} | {} |", measured + words.len())
            .expect("text");
    }
    text
}

#[test]
fn the_page_is_that_of_the_folder() {
    let files = files();
    let wrong = files.iter().filter_map(|(name, one)| Some(format!("{name}: {}", one.as_ref().err()?)));
    assert_none(&wrong.collect::<Vec<_>>(), "files in hardware/ that do not count");
    let all: Vec<Evidence> = files.into_values().filter_map(Result::ok).collect();
    let page = read(PAGE);
    let [begin, end] = MARKS;
    let (before, rest) = page.split_once(begin).expect("the first mark");
    let (_, after) = rest.split_once(end).expect("the second mark");
    let wanted = format!("{before}{begin}\n\n{}\n{end}{after}", tables(&all));
    if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(root().join(PAGE), &wanted).expect("written");
    } else {
        assert!(page == wanted, "{PAGE} differs from hardware/: FOOTFALL_WRITE_DOCS=1 writes it");
    }
}

const FILE: &str = r#"
format = 1
board = "f4-discovery"
chip = "STM32F407VGTx"
chip_id = "a1"
date = "2026-11-29"
port = "serial"
verdict = "refused"

[versions]
footfall = "0.1.0"
wire = 9

[[quantity]]
name = "period"
status = "measured"
value = 20000.0
unit = "us"
least = 19998.0
most = 20002.0

[[quantity]]
name = "width error"
status = "refused"
value = 20.0
unit = "us"
most = 2.0
"#;

#[test]
fn a_file_becomes_rows() {
    let counted = |name: &str, text: &str| counted(name, text);
    let one = counted("bringup-f4-discovery-a1.toml", FILE).expect("a file that counts");
    let other = Evidence { chip_id: "a2".into(), ..one.clone() };
    let text = tables(&[one, other]);
    for row in [
        "| f4-discovery | a1 | 2026-11-29 | refused | width error | - |",
        "| f4-discovery | period | 20000 | 20000 | us | 19998 to 20002 | 2 |",
        "| f4-discovery | width error | 20 | 20 | us | 2 or less | 2 |",
    ] {
        assert!(text.contains(row), "{row}:\n{text}");
    }
    for (from, to, words) in [
        ("port = \"serial\"", "port = \"pseudo-terminal\"", "no evidence about hardware"),
        ("chip_id = \"a1\"", "chip_id = \"a2\"", "by its content bringup-f4-discovery-a2.toml"),
        ("value = 20.0", "value = 1.0", "by its value it is measured"),
    ] {
        let error = counted("bringup-f4-discovery-a1.toml", &FILE.replacen(from, to, 1)).expect_err(from);
        assert!(error.contains(words), "{from}: {error}");
    }
}
