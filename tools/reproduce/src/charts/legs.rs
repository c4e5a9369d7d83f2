//! The hexapod stepped through changes of its reversibility, and its step diagram.

use cpg_core::edge_reversal::hexapod::{Hexapod, Leg, Swings};
use cpg_core::edge_reversal::smer::SmerError;
use picture::{Bars, Panel};

/// The legs of a hexapod that swing at each step.
///
/// # Errors
/// A reversibility is out of range.
pub fn swings(hexapod: &mut Hexapod, switches: &[(u64, u32)], steps: u64) -> Result<Vec<Swings>, SmerError> {
    let mut switches = switches.iter().peekable();
    let mut all = vec![];
    for step in 0..steps {
        while let Some((_, to)) = switches.next_if(|(at, _)| *at == step) {
            hexapod.set_reversibility(*to)?;
        }
        all.push(hexapod.step());
    }
    Ok(all)
}

/// The step diagram of a hexapod: a bar where a leg swings, a mark at each change of the reversibility.
#[must_use]
pub fn step_diagram(steps: &[Swings], switches: &[(u64, u32)]) -> Panel {
    let row = |leg: Leg| {
        let swings = steps.iter().enumerate().filter(|(_, swings)| swings.contains(leg));
        Bars { name: leg.name().into(), spans: swings.map(|(step, _)| (step as f64, step as f64 + 1.0)).collect() }
    };
    let inside = switches.iter().filter(|(at, _)| *at < steps.len() as u64);
    let marks: Vec<(f64, String)> = inside.map(|(at, to)| (*at as f64, format!("R = {to}"))).collect();
    let title = "a bar where the leg swings; between them it stands";
    Panel::bars(title, "step", "leg", Leg::ALL.map(row).to_vec()).marked(&marks)
}
