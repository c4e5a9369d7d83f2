//! What of docs/performance.json a later build is compared with: instructions by the name of what was counted.
//!
//! Of the tick and of steps the same seconds of the same runs are compared, so the numbers of one image are equal, and one that differs by more than the
//! margin fails in both directions: where it is less, the page is not true any more. What the thread and the time driver's interrupt do depends on which
//! work coincides, so their maximum is compared with that of the whole run, and fails only if it grows.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::{Map, Value};

use super::page;
use crate::image;

/// By how much a number may differ from that in docs/performance.json, percent.
pub(super) const MARGIN_PERCENT: u64 = 5;
/// What writes docs/performance.json.
pub(super) const HOW_TO_WRITE: &str = "cargo xtask bench board --write --reason \"...\"";
/// Virtual seconds of walking that are compared: over two strides.
pub(super) const SECS: u64 = 3;
/// Numbers of the compared seconds.
const OF_THE_SECONDS: [&str; 3] = ["median", "p99", "max"];
/// The maximum of a whole run, which the compared seconds need not reach.
const MAX_OF_RUN: &str = "max_of_run";
/// The interrupt of the time driver, which serves whatever waits.
const TIME_DRIVER: &str = "interrupt: TIM4";
/// Names of the steps that only a machine with a compiler of C measures begin with it.
const BESIDE_C: &str = "beside C: ";

/// The numbers of docs/performance.json.
pub(super) fn baseline() -> Result<Value> {
    let text = std::fs::read_to_string(page::JSON).with_context(|| format!("reading {}", page::JSON))?;
    serde_json::from_str(&text).with_context(|| format!("reading {}", page::JSON))
}

/// Why the numbers of docs/performance.json say nothing about an image: another compiler.
pub(super) fn not_comparable(baseline: &Value, elf: &Path) -> Result<Option<String>> {
    let bytes = std::fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    let by = image::compiler(&bytes).with_context(|| format!("{} names no compiler", elf.display()))?;
    let before = baseline["compiler"].as_str().unwrap_or_default();
    Ok((by != before).then(|| format!("the image is by {by}, the numbers of {} by {before}", page::JSON)))
}

/// Whether two numbers differ by more than the margin.
pub(super) const fn differ(before: u64, now: u64) -> bool {
    is_grown(before, now) || now * 100 < before * (100 - MARGIN_PERCENT)
}

/// Whether a number grew by more than the margin.
const fn is_grown(before: u64, now: u64) -> bool {
    now * 100 > before * (100 + MARGIN_PERCENT)
}

/// Instructions by the name of what was counted: of each part in each set-up, of each rare interrupt and kind of generator, of a tick on the other board, and
/// of the steps beside C. The Pico's numbers are cycles of another emulator.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Counts(pub(super) Map<String, Value>);

impl Counts {
    /// Those of docs/performance.json.
    pub(super) fn of(baseline: &Value) -> Result<Self> {
        let compared = &baseline["compared"];
        let counts = compared["instructions"].as_object().filter(|_| compared["secs"] == SECS);
        counts.cloned().map(Self).with_context(|| format!("{} has no counts of {SECS} s: {HOW_TO_WRITE}", page::JSON))
    }

    /// A row of which the compared seconds are counted.
    pub(super) fn add(&mut self, name: &str, row: &Value) -> Result<()> {
        self.insert(name, &OF_THE_SECONDS.map(|number| (number, &row["instructions"][number])))
    }

    /// A row of a set-up: of the compared seconds, and of the whole run.
    pub(super) fn add_part(&mut self, set_up: &str, first: &Value, whole: &Value) -> Result<()> {
        let part = first["part"].as_str().context("a row has no part")?;
        let name = format!("{set_up}: {part}");
        let max_of_run = (MAX_OF_RUN, &whole["instructions"]["max"]);
        match part {
            TIME_DRIVER => self.insert(&name, &[("median", &first["instructions"]["median"]), max_of_run]),
            _ if part.starts_with("tick") || part.starts_with("interrupt") => self.add(&name, first),
            // A thread's round has other work each time, so its median jumps.
            _ => self.insert(&name, &[max_of_run]),
        }
    }

    fn insert(&mut self, name: &str, numbers: &[(&str, &Value)]) -> Result<()> {
        let mut of = Map::new();
        for (number, count) in numbers {
            let count = count.as_u64().with_context(|| format!("{name} has no {number}"))?;
            of.insert((*number).to_owned(), count.into());
        }
        let before = self.0.insert(name.to_owned(), of.into());
        ensure!(before.is_none(), "two counts of the name `{name}`");
        Ok(())
    }

    /// Puts the steps in Rust beside C in the place of those before; null has none.
    pub(super) fn beside_c(&mut self, measured: &Value) -> Result<()> {
        self.forget_beside_c();
        if measured.is_null() {
            return Ok(());
        }
        for network in measured["networks"].as_array().context("no steps beside C")? {
            self.add(&format!("{BESIDE_C}{}", network["name"].as_str().unwrap_or_default()), &network["rust"])?;
        }
        self.add(&format!("{BESIDE_C}gate, targets of every kind"), &measured["gate_any"]["cost"])
    }

    /// Leaves the steps beside C out.
    pub(super) fn forget_beside_c(&mut self) {
        self.0.retain(|name, _| !name.starts_with(BESIDE_C));
    }

    /// A line for each number that differs by too much, and for each part or number that one of both lacks.
    pub(super) fn differences(&self, now: &Self) -> Vec<String> {
        let mut lines = Vec::new();
        for (part, before) in &self.0 {
            let Some(now) = now.0.get(part) else {
                lines.push(format!("{part}: was not measured"));
                continue;
            };
            for number in OF_THE_SECONDS.into_iter().chain([MAX_OF_RUN]) {
                let is_wrong = if number == MAX_OF_RUN { is_grown } else { differ };
                match (before[number].as_u64(), now[number].as_u64()) {
                    (Some(before), Some(now)) if is_wrong(before, now) => {
                        lines.push(format!("{part}, {number}: {now}, before {before}"));
                    }
                    (Some(_), Some(_)) | (None, None) => {}
                    (before, _) => lines.push(format!(
                        "{part}, {number}: {}",
                        if before.is_some() { "was not measured" } else { "is new" }
                    )),
                }
            }
        }
        lines.extend(now.0.keys().filter(|part| !self.0.contains_key(*part)).map(|part| format!("{part}: is new")));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn of(median: u64, max: u64) -> Value {
        json!({ "part": "tick: gate", "instructions": { "median": median, "p99": max, "max": max } })
    }

    #[test]
    fn a_part_that_differs_by_more_than_the_margin_is_named() {
        let counts = |gate: u64, spline: u64| {
            let mut counts = Counts::default();
            counts.add("default: tick: gate", &of(gate, 300)).unwrap();
            counts.add("generator spline", &of(500, spline)).unwrap();
            counts
        };
        let before = counts(200, 1000);
        let lines = |gate, spline| before.differences(&counts(gate, spline));
        assert_eq!(lines(210, 1050), [""; 0]);
        assert_eq!(lines(190, 950), [""; 0]);
        assert_eq!(lines(211, 1000), ["default: tick: gate, median: 211, before 200"]);
        assert_eq!(lines(189, 1000), ["default: tick: gate, median: 189, before 200"]);
        assert_eq!(
            lines(200, 1051),
            ["p99", "max"].map(|number| format!("generator spline, {number}: 1051, before 1000"))
        );
        let mut fewer = before.clone();
        fewer.0.remove("generator spline");
        assert_eq!(before.differences(&fewer), ["generator spline: was not measured"]);
        assert_eq!(fewer.differences(&before), ["generator spline: is new"]);
        fewer.0.insert("generator spline".to_owned(), json!({ "median": 500, "max": 1000 }));
        assert_eq!(before.differences(&fewer), ["generator spline, p99: was not measured"]);
        assert_eq!(fewer.differences(&before), ["generator spline, p99: is new"]);
    }

    /// In the compared seconds the thread may do less than in the whole run.
    #[test]
    fn of_the_thread_the_greatest_of_the_whole_run_counts() {
        let row =
            |part: &str, max: u64| json!({ "part": part, "instructions": { "median": 8, "p99": max, "max": max } });
        for part in ["thread", "thread: log", "control period"] {
            let counts = |first: u64, whole: u64| {
                let mut counts = Counts::default();
                counts.add_part("default", &row(part, first), &row(part, whole)).unwrap();
                counts
            };
            let before = counts(50, 100);
            assert_eq!(before.0[&format!("default: {part}")], json!({ "max_of_run": 100 }));
            assert_eq!(before.differences(&counts(60, 60)), [""; 0]);
            assert_eq!(
                before.differences(&counts(106, 106)),
                [format!("default: {part}, max_of_run: 106, before 100")]
            );
        }
        let time_driver = |median: u64| {
            let row = json!({ "part": TIME_DRIVER, "instructions": { "median": median, "p99": 50, "max": 90 } });
            let mut counts = Counts::default();
            counts.add_part("default", &row, &row).unwrap();
            counts
        };
        let lines = time_driver(40).differences(&time_driver(43));
        assert_eq!(lines, ["default: interrupt: TIM4, median: 43, before 40"]);
        let mut counts = Counts::default();
        counts.add_part("default", &row("tick: gate", 50), &row("tick: gate", 100)).unwrap();
        assert_eq!(counts.0["default: tick: gate"]["max"], 50);
    }

    #[test]
    fn no_name_counts_twice_and_no_number_lacks() {
        let mut counts = Counts::default();
        counts.add("tick", &of(1, 2)).unwrap();
        assert!(counts.add("tick", &of(1, 1)).unwrap_err().to_string().contains("two counts"));
        assert!(counts.add("gate", &json!({})).unwrap_err().to_string().contains("gate has no median"));
        let other = json!({ "compared": { "secs": SECS + 1, "instructions": {} } });
        assert!(Counts::of(&other).unwrap_err().to_string().contains("no counts of 3 s"));
    }

    #[test]
    fn the_steps_beside_c_are_replaced() {
        let step = |rust: u64| json!({ "networks": [{ "name": "R1", "rust": of(rust, rust) }], "gate_any": { "cost": of(5, 6) } });
        let mut counts = Counts::default();
        counts.add("tick", &of(1, 2)).unwrap();
        counts.beside_c(&step(7)).unwrap();
        counts.beside_c(&step(8)).unwrap();
        assert_eq!((counts.0.len(), &counts.0["beside C: R1"]["max"]), (3, &json!(8)));
        counts.beside_c(&Value::Null).unwrap();
        assert_eq!(counts.0.len(), 1);
    }

    /// The page has these parts, and every part of it but the steps in C is compared.
    #[test]
    fn every_count_of_the_page_is_compared_but_those_of_c() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let result: Value = serde_json::from_str(&std::fs::read_to_string(root.join(page::JSON)).unwrap()).unwrap();
        let list = |of: &Value| of.as_array().unwrap().clone();
        let word = |of: &Value| of.as_str().unwrap().to_owned();
        let mut names = Vec::new();
        for set_up in list(&result["set_ups"]) {
            names.extend(
                list(&set_up["rows"]).iter().map(|row| format!("{}: {}", word(&set_up["name"]), word(&row["part"]))),
            );
        }
        names.extend(list(&result["rare_interrupts"]).iter().map(|row| word(&row["part"])));
        names.extend(list(&result["generators"]).iter().map(|kind| format!("generator {}", word(&kind["kind"]))));
        for tick in list(&result["boards"][0]["ticks"]) {
            names.push(format!("{}: {}: tick", word(&result["boards"][0]["name"]), word(&tick["set_up"])));
        }
        names.extend(
            list(&result["beside_c"]["networks"]).iter().map(|step| format!("{BESIDE_C}{}", word(&step["name"]))),
        );
        names.push(format!("{BESIDE_C}gate, targets of every kind"));
        names.sort();
        assert!(names.len() > 100, "{names:?}");
        assert!(Counts::of(&result).unwrap().0.keys().eq(&names), "{names:?}");
        // Each interrupt that the firmware enables is among them.
        let list = std::fs::read_to_string(root.join("firmware/src/interrupts.rs")).unwrap();
        let enabled: Vec<&str> =
            list.lines().filter_map(|line| line.trim().split_once("name: \"")?.1.split('"').next()).collect();
        assert_eq!(enabled.len(), 6, "{enabled:?}");
        for name in enabled {
            assert!(names.iter().any(|part| part.ends_with(&format!("interrupt: {name}"))), "{name}");
        }
    }
}
