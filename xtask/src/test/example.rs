//! The example firmwares are built, and the one for embassy runs on the virtual board: it walks while its sensor is good.

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::state::State;
use crate::shell;

/// The sensor's voltage: inside the example's table for a second, then the wire is off.
const VOLTS: &str = "time_s,PC0,VDDA\n0,1.5,3.3\n1,1.5,3.3\n1.001,0,3.3\n";
const SECONDS: &str = "2";

pub(super) fn firmwares(state: &State) -> Result<String> {
    // Each by itself: the first shows that the cores need no chip crate.
    state.workspace.example(&["bare-metal-example"], &[])?;
    let walks = state.workspace.example(&["embassy-example"], &["--features", "embassy"])?;
    let volts = state.log("example-volts").with_extension("csv");
    std::fs::create_dir_all(state.logs()).with_context(|| format!("making {}", state.logs().display()))?;
    std::fs::write(&volts, VOLTS).with_context(|| format!("writing {}", volts.display()))?;
    let mut run = shell::command(state.virtual_board()?);
    run.args(["--secs", SECONDS, "--volts"]).arg(&volts);
    run.arg(walks);
    let lines = shell::stdout_of(&mut run).context("running the example for embassy on the virtual board")?;
    let pulses = pulses(&lines)?;
    let span = |from_s: f64, until_s: f64| {
        let inside = pulses.iter().filter(|(t_s, _)| (from_s..until_s).contains(t_s)).map(|(_, us)| us[0]);
        let [least, most] = inside.fold([f64::MAX, f64::MIN], |[least, most], us| [least.min(us), most.max(us)]);
        most - least
    };
    let (walk_us, hold_us) = (span(0.1, 1.0), span(1.3, 2.0));
    ensure!(
        walk_us > 200.0 && (0.0..0.2).contains(&hold_us),
        "the pulses of the left hip change by {walk_us} us while the sensor is good, and by {hold_us} us while its wire is off"
    );
    Ok("2 programs built; under embassy the virtual board walks, and stands without the sensor".into())
}

/// Times and lengths of the pulses, s and us.
fn pulses(lines: &str) -> Result<Vec<(f64, [f64; 4])>> {
    let mut all = Vec::new();
    for line in lines.lines() {
        let line: Value = serde_json::from_str(line).with_context(|| format!("reading `{line}`"))?;
        if line["type"] == "pulses" {
            let us = serde_json::from_value(line["us"].clone()).context("four pulses")?;
            all.push((line["t_s"].as_f64().context("a time")?, us));
        }
    }
    Ok(all)
}
