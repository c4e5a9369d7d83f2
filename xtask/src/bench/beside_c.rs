//! Steps of two networks and of the gate in Rust beside plain C of the same equations: the program `beside-c` of tests/step-cost, on the virtual board.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use crate::shell;
use crate::workspace::C_COMPILER;

/// FLASH_ACR as the firmware sets it: the program sets no clock.
const FLASH_ACR: &str = "0x705";
/// Names in the output, and in the functions.
const NETWORKS: [(&str, &str); 3] = [("thesis", "thesis"), ("R1", "r1"), (GATE, "gate")];
/// The row of the gate, whose last number is another one.
pub(super) const GATE: &str = "gate";
/// The line of the gate's steps on targets of every kind, and their function.
const GATE_ANY: (&str, &str) = ("gate-any", "rust_gate_any");
const VARIANTS: [(&str, &str, &str); 3] = [("rust", "rust_", ""), ("c", "c_", "_exact"), ("c_fused", "c_", "_fused")];
/// The program takes some seconds.
const DEADLINE: Duration = Duration::from_secs(120);

/// The comparison; null where there is no C compiler.
pub(super) fn measure(virtual_board: &Path, board_cost: &Path, elf: &Path, folder: &Path) -> Result<Value> {
    let Some(compiler) = shell::on_path(C_COMPILER) else {
        eprintln!("bench: no {C_COMPILER}, so nothing is compared with C; Debian has it in gcc-arm-none-eabi");
        return Ok(Value::Null);
    };
    eprintln!("bench: beside C");
    let version = shell::stdout_of(shell::command(compiler).arg("--version"))?;
    let trace = folder.join("beside-c.bin");
    let mut run = shell::command(virtual_board);
    run.args(["--self-test-exit", "semihosting", "--secs", "60", "--trace-execution"]).arg(&trace).arg(elf);
    let finished = shell::with_deadline(&mut run, DEADLINE, &folder.join("beside-c.log"))?;
    ensure!(finished.success(), "beside-c fails on the virtual board ({})\n{}", finished.how(), finished.tail(20));
    let lines = finished.output.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let lines: Vec<Value> = lines.filter(|line| line["type"] == "semihosting").collect();
    let names: Vec<String> = NETWORKS
        .iter()
        .flat_map(|(_, network)| VARIANTS.iter().map(move |(_, begin, end)| format!("{begin}{network}{end}")))
        .chain([GATE_ANY.1.to_owned()])
        .collect();
    let mut count = shell::command(board_cost);
    count.arg("--elf").arg(elf).arg("--trace").arg(&trace).args(["--flash-acr", FLASH_ACR, "--function"]).args(&names);
    let counted: Value =
        serde_json::from_str(&shell::stdout_of(&mut count)?).context("reading the output of board-cost")?;
    std::fs::remove_file(&trace).with_context(|| format!("removing {}", trace.display()))?;
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
            network[key] = super::counted::row(&counted, &format!("{begin}{function}{end}"))?.clone();
        }
        networks.push(network);
    }
    let (name, function) = GATE_ANY;
    let &[steps, all_acted] = numbers(name).as_slice() else {
        anyhow::bail!("beside-c printed no line of two numbers for {name}: was it built without {C_COMPILER}?")
    };
    ensure!(all_acted == 1, "{name}: not every limit of the gate acted in its {steps} steps");
    let gate_any = json!({ "steps": steps, "cost": super::counted::row(&counted, function)? });
    let compiler = version.lines().next().unwrap_or_default();
    let rust_compiler = &counted["compiler"];
    Ok(json!({ "compiler": compiler, "rust_compiler": rust_compiler, "networks": networks, "gate_any": gate_any }))
}
