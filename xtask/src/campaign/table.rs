//! What came of a campaign: a row for the faults of each register, each group, each other fault; and how much processor time it took.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter, Write as _};

use serde_json::Value;

/// The states of most faults; the table has their number in their place.
const USUAL: &str = "disarmed, arming, walking, stopping, fault, trim ready, trimming, following";

/// What came of the faults: those of one register or one part of the memory together.
#[derive(Debug, Default)]
pub(super) struct Table {
    rows: Vec<Row>,
    pub(super) wrong: u64,
    pub(super) cases: u64,
    /// Faults with a case.
    names: std::collections::BTreeSet<String>,
    /// Cases that only the pulses judged.
    pulses_alone: u64,
    pub(super) seconds: f64,
    /// Processor time, s: of the cases; of the boots and the copies of the process; of the boots, if each case had its own.
    cases_cpu_s: f64,
    parents_cpu_s: f64,
    alone_cpu_s: f64,
    pub(super) is_complete: bool,
}

#[derive(Debug, Default)]
struct Row {
    name: String,
    states: Vec<String>,
    cases: u64,
    wrong: u64,
    /// How often each reaction came, by its word.
    reactions: BTreeMap<String, u64>,
    pulses_alone: u64,
    /// The latest end of the pulses where there were some, and the latest reset, us.
    off_us: Option<f64>,
    reset_us: Option<f64>,
    why: Vec<String>,
}

impl Table {
    pub(super) fn add(&mut self, case: &Value) {
        let number = |key: &str| case[key].as_f64();
        if case["type"] == "end" {
            self.is_complete = true;
            self.seconds += number("seconds").unwrap_or_default();
            self.parents_cpu_s += number("parent_cpu_s").unwrap_or_default();
            self.alone_cpu_s += number("alone_cpu_s").unwrap_or_default();
            return;
        }
        let name = case["name"].as_str();
        let group = case["row"].as_str().or(name).unwrap_or("several faults");
        let place = self.rows.iter().position(|row| row.name == group).unwrap_or_else(|| {
            self.rows.push(Row { name: group.to_owned(), ..Row::default() });
            self.rows.len() - 1
        });
        self.names.extend(name.map(str::to_owned));
        self.cases_cpu_s += number("cpu_ms").unwrap_or_default() * 1e-3;
        let row = &mut self.rows[place];
        let state = case["state"].as_str().unwrap_or_default();
        if !row.states.iter().any(|known| known == state) {
            row.states.push(state.to_owned());
        }
        let latest = |so_far: Option<f64>, new: Option<f64>| match (so_far, new) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        // Outputs that were off before are off at once.
        row.off_us = latest(row.off_us, number("off_us").filter(|_| case["outputs"] == true));
        row.reset_us = latest(row.reset_us, number("reset_us"));
        row.cases += 1;
        self.cases += 1;
        if case["pulses_alone"] == true {
            row.pulses_alone += 1;
            self.pulses_alone += 1;
        }
        if name.is_some() {
            let reaction = case["reaction"].as_str().unwrap_or("another");
            *row.reactions.entry(reaction.to_owned()).or_default() += 1;
        }
        if case["good"] != true {
            row.wrong += 1;
            self.wrong += 1;
            let why = case["why"].as_str().unwrap_or("no reason");
            match (name, &case["seed"]) {
                // One of each row is enough, for many are alike.
                (Some(name), _) => {
                    if row.why.is_empty() {
                        row.why.push(format!("{name}, {state}, phase {}: {why}", case["phase"]));
                    }
                }
                (None, seed) => row.why.push(format!("{why}\n  again: cargo xtask campaign --several 1 --seed {seed}")),
            }
        }
    }

    /// Processor time of the cases as copies, of the same ones if each began with its own boot, and the ratio.
    pub(super) fn speed(&self) -> String {
        let (copies, alone) = (self.cases_cpu_s + self.parents_cpu_s, self.cases_cpu_s + self.alone_cpu_s);
        let each = |seconds: f64| seconds * 1e3 / self.cases.max(1) as f64;
        format!(
            "Processor time: {:.1} ms a case, boots and copies included. With a boot of its own {:.1} ms: {:.1} times as much",
            each(copies),
            each(alone),
            alone / copies.max(f64::MIN_POSITIVE)
        )
    }

    /// The same of runs of one case each, which began with their own boot.
    pub(super) fn alone(&self) -> String {
        let (own, copies) = (self.cases_cpu_s + self.parents_cpu_s, self.cases_cpu_s);
        let each = |seconds: f64| seconds * 1e3 / self.cases.max(1) as f64;
        format!(
            "{} cases, each a process from power-on: {:.1} ms of processor time a case, of which {:.1} ms after the state was reached: {:.1} times as much",
            self.cases,
            each(own),
            each(copies),
            own / copies.max(f64::MIN_POSITIVE)
        )
    }

    /// Cases, faults, wrong ones, and those that only the pulses judged.
    pub(super) fn counts(&self) -> String {
        format!(
            "{} cases of {} faults, {} wrong; {} of them are judged by the pulses alone",
            self.cases,
            self.names.len(),
            self.wrong,
            self.pulses_alone
        )
    }

    /// The rows.
    pub(super) fn rows(&self) -> String {
        let ms = |us: Option<f64>| us.map_or_else(|| "-".to_owned(), |us| format!("{:.1}", us * 1e-3));
        let mut text = format!("States `8`: {USUAL}.\n\n");
        text += "| fault | states | cases | wrong | reactions | outputs off, ms | reset, ms |\n|---|---|---|---|---|---|---|\n";
        for Row { name, states, cases, wrong, reactions, pulses_alone, off_us, reset_us, .. } in &self.rows {
            let mut reactions: Vec<String> = reactions.iter().map(|(word, count)| format!("{word} {count}")).collect();
            if *pulses_alone > 0 {
                reactions.insert(0, "none declared:".to_owned());
            }
            let (states, reactions) = (states.join(", "), reactions.join(" "));
            let states = if states == USUAL { "8" } else { &states };
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "| {name} | {states} | {cases} | {wrong} | {reactions} | {} | {} |",
                ms(*off_us),
                ms(*reset_us)
            );
        }
        text
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}\n{}, {:.0} s\n{}", self.rows(), self.counts(), self.seconds, self.speed())?;
        self.rows.iter().flat_map(|row| &row.why).try_for_each(|why| writeln!(f, "wrong: {why}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_a_register_are_one_row() {
        let mut table = Table::default();
        for line in [
            r#"{"type":"case","name":"a panic","row":"a panic","state":"walking","phase":0,"outputs":true,"reaction":"reset","good":true,"why":null,"off_us":180.5,"reset_us":1500.0,"cpu_ms":3.0}"#,
            r#"{"type":"case","name":"the core's sp, bit 3","row":"the core's sp","state":"walking","phase":0,"reaction":"reset","good":true,"why":null,"off_us":null,"reset_us":null,"cpu_ms":1.0}"#,
            r#"{"type":"case","name":"the core's lr, bit 3","row":"the core's lr","state":"walking","phase":0,"reaction":null,"pulses_alone":true,"good":true,"why":null,"off_us":null,"reset_us":null}"#,
            r#"{"type":"case","name":"TIM1 ARR, bit 0","row":"TIM1 ARR","state":"walking","phase":0,"outputs":true,"reaction":"off","good":true,"why":null,"off_us":60.0,"reset_us":null}"#,
            r#"{"type":"case","name":"TIM1 ARR, bit 0","row":"TIM1 ARR","state":"disarmed","phase":0,"outputs":false,"reaction":"fault","good":true,"why":null,"off_us":900.0,"reset_us":null}"#,
            r#"{"type":"case","name":"TIM1 ARR, bit 1","row":"TIM1 ARR","state":"walking","phase":7,"outputs":true,"reaction":"none","good":false,"why":"outputs off never","off_us":null,"reset_us":null}"#,
        ] {
            table.add(&serde_json::from_str(line).unwrap());
        }
        table.add(
            &serde_json::from_str(
                r#"{"type":"several","seed":17,"state":"arming","good":false,"why":"PE9 at 1 s: 90 us","faults":[]}"#,
            )
            .unwrap(),
        );
        assert!(!table.is_complete);
        table.add(
            &serde_json::from_str(
                r#"{"type":"end","cases":7,"wrong":2,"seconds":2.4,"boot_cpu_s":0.5,"parent_cpu_s":0.6,"alone_cpu_s":4.6}"#,
            )
            .unwrap(),
        );
        let text = table.to_string();
        for line in [
            "| a panic | walking | 1 | 0 | reset 1 | 0.2 | 1.5 |",
            "| the core's sp | walking | 1 | 0 | reset 1 | - | - |",
            "| the core's lr | walking | 1 | 0 | none declared: another 1 | - | - |",
            "| TIM1 ARR | walking, disarmed | 3 | 1 | fault 1 none 1 off 1 | 0.1 | - |",
            "7 cases of 5 faults, 2 wrong; 1 of them are judged by the pulses alone, 2 s",
            "wrong: TIM1 ARR, bit 1, walking, phase 7: outputs off never",
            "wrong: PE9 at 1 s: 90 us\n  again: cargo xtask campaign --several 1 --seed 17",
        ] {
            assert!(text.contains(line), "{text}");
        }
        assert!(table.is_complete && text.find("a panic") < text.find("TIM1 ARR"));
        // 0.6 s and 4 ms as copies, 4.6 s and 4 ms with a boot each.
        assert!(table.speed().ends_with(": 7.6 times as much"), "{}", table.speed());
        assert!(table.alone().ends_with(": 151.0 times as much"), "{}", table.alone());
    }
}
