//! Steps of two networks and of the gate in Rust beside plain C of the same equations: the program `beside-c` of tests/step-cost, on the virtual board.

use std::path::Path;

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use super::counted;
use crate::shell;
use crate::workspace::C_COMPILER;

/// Names in the output, and in the functions.
const NETWORKS: [(&str, &str); 3] = [("thesis", "thesis"), ("R1", "r1"), (GATE, "gate")];
/// The row of the gate, whose last number is another one.
pub(super) const GATE: &str = "gate";
/// The line of the gate's steps on targets of every kind, and their function.
const GATE_ANY: (&str, &str) = ("gate-any", "rust_gate_any");
const VARIANTS: [(&str, &str, &str); 3] = [("rust", "rust_", ""), ("c", "c_", "_exact"), ("c_fused", "c_", "_fused")];

/// The functions of the steps.
pub(super) fn functions() -> Vec<String> {
    let of = |network: &str| VARIANTS.map(|(_, begin, end)| format!("{begin}{network}{end}"));
    NETWORKS.iter().flat_map(|(_, network)| of(network)).chain([GATE_ANY.1.to_owned()]).collect()
}

/// The comparison; null where there is no C compiler.
pub(super) fn measure(virtual_board: &Path, board_cost: &Path, elf: &Path, folder: &Path) -> Result<Value> {
    let Some(compiler) = shell::on_path(C_COMPILER) else {
        eprintln!("bench: no {C_COMPILER}, so nothing is compared with C; Debian has it in gcc-arm-none-eabi");
        return Ok(Value::Null);
    };
    eprintln!("bench: beside C");
    let version = shell::stdout_of(shell::command(compiler).arg("--version"))?;
    let (lines, counted) = counted::functions(virtual_board, board_cost, elf, folder, &functions(), &[])?;
    let numbers = |name: &str| -> Vec<u64> {
        let texts = lines.iter().filter_map(|line| line["text"].as_str());
        let mut lines = texts.map(|text| text.split_whitespace().collect::<Vec<_>>());
        let line = lines.find(|words| words.first() == Some(&name));
        line.iter().flatten().filter_map(|word| word.parse().ok()).collect()
    };
    let mut networks = Vec::new();
    for (name, function) in NETWORKS {
        let &[steps, equal, difference] = numbers(name).as_slice() else {
            anyhow::bail!("beside-c printed no line of three numbers for {name}: was it built without {C_COMPILER}?")
        };
        let mut network = json!({ "name": name, "steps": steps, "equal": equal, "fused_difference_1e9": difference });
        for (key, begin, end) in VARIANTS {
            network[key] = counted::row(&counted, &format!("{begin}{function}{end}"))?.clone();
        }
        networks.push(network);
    }
    let (name, function) = GATE_ANY;
    let &[steps, all_acted] = numbers(name).as_slice() else {
        anyhow::bail!("beside-c printed no line of two numbers for {name}: was it built without {C_COMPILER}?")
    };
    ensure!(all_acted == 1, "{name}: not every limit of the gate acted in its {steps} steps");
    let gate_any = json!({ "steps": steps, "cost": counted::row(&counted, function)? });
    let compiler = version.lines().next().unwrap_or_default();
    let rust_compiler = &counted["compiler"];
    Ok(json!({ "compiler": compiler, "rust_compiler": rust_compiler, "networks": networks, "gate_any": gate_any }))
}
