//! The result of `footfall entrain`: as text, and as one JSON object.

use cpg_core::entrainment::SensorFault;
use gait_trace::Finding;
use joint_units::Joint;
use serde_json::json;
use std::fmt::Write as _;

use super::corrected::Corrected;
use super::possible::{Comparison, Possible};
use super::run;
use super::run::Entrainment;
use super::trace::Trace;

/// One JSON object.
pub(super) fn as_json(
    name: &str,
    trace: &Trace,
    run: &Entrainment,
    corrected: Option<&Corrected>,
    possible: &Possible,
) -> serde_json::Value {
    let following = &run.following;
    let judged = corrected.map_or(following, |corrected| &corrected.following);
    let by_joint = |value: &dyn Fn(Joint) -> Option<f64>| {
        let pairs = Joint::ALL.into_iter().map(|joint| (joint.name().to_owned(), json!(value(joint))));
        serde_json::Value::Object(pairs.collect())
    };
    let verdicts = Joint::ALL.map(|joint| {
        let verdict = possible.verdicts[joint as usize].map(Comparison::name);
        (joint.name().to_owned(), json!(verdict))
    });
    let verdicts = serde_json::Value::Object(verdicts.into_iter().collect());
    let holds: Vec<_> = following
        .holds
        .iter()
        .map(|&(tick, fault)| json!({ "t_s": tick as f64 / run::TICKS_PER_S, "fault": fault.name() }))
        .collect();
    let stops: Vec<_> = following
        .false_stops
        .iter()
        .map(|stop| {
            let fault = stop.fault.map(SensorFault::name);
            json!({ "from_s": stop.from_s, "to_s": stop.to_s, "state": stop.state.name(), "fault": fault })
        })
        .collect();
    let slips: Vec<_> =
        following.slips.iter().map(|slip| json!({ "t_s": slip.at_s, "error_deg": slip.error_deg })).collect();
    json!({
        "file": name,
        "format": trace.format,
        "notes": trace.notes,
        "findings": trace.findings.iter().map(found).collect::<Vec<_>>(),
        "core": "host",
        "sensor": trace.sensor.name(),
        "template": run.source,
        "stride_s": run.learned.stride_s,
        "lock_s": following.lock_s,
        "steady_s": following.steady_s.map(|(from, to)| [from, to]),
        "steady_rmse_deg": by_joint(&|joint| following.steady_rmse_deg[joint as usize]),
        "corrected_rmse_deg": corrected.map(|corrected| by_joint(&|joint| rmse_of(corrected, joint))),
        "perfect_phase_rmse_deg": by_joint(&|joint| following.perfect_phase_rmse_deg[joint as usize]),
        "ratio": by_joint(&|joint| judged.ratio(joint)),
        "causal_bound_deg": by_joint(&|joint| possible.causal_bound_deg[joint as usize]),
        "verdict": verdicts,
        "false_locks": following.false_locks,
        "false_stops": stops.len(),
        "false_stop_events": stops,
        "slips": slips.len(),
        "slip_events": slips,
        "holds": following.holds.len(),
        "hold_events": holds,
        "cadence_steps_per_min": following.cadence_steps_per_min,
        "phase_sd_deg": following.phase_sd_deg,
    })
}

fn found(finding: &Finding) -> serde_json::Value {
    json!({ "level": finding.level().name(), "text": finding.to_string() })
}

fn rmse_of(corrected: &Corrected, joint: Joint) -> Option<f64> {
    corrected.following.steady_rmse_deg[joint as usize]
}

/// A line for each key.
pub(super) fn as_text(
    name: &str,
    sensor: Joint,
    run: &Entrainment,
    corrected: Option<&Corrected>,
    possible: &Possible,
) -> String {
    let following = &run.following;
    let judged = corrected.map_or(following, |corrected| &corrected.following);
    let number = |value: Option<f64>, places: usize| value.map_or("-".to_owned(), |value| format!("{value:.places$}"));
    let mut out = format!("trace {name}\nsensor {}\ntemplate {}\n", sensor.name(), run.source);
    let _ = writeln!(out, "stride_s {:.3}", run.learned.stride_s);
    let _ = writeln!(out, "lock_s {}", number(following.lock_s, 3));
    let mut by_joint = |key: &str, value: &dyn Fn(Joint) -> Option<f64>| {
        let _ = write!(out, "{key}");
        for joint in Joint::ALL {
            let _ = write!(out, " {} {}", joint.name(), number(value(joint), 2));
        }
        out.push('\n');
    };
    by_joint("steady_rmse_deg", &|joint| following.steady_rmse_deg[joint as usize]);
    if let Some(corrected) = corrected {
        by_joint("corrected_rmse_deg", &|joint| rmse_of(corrected, joint));
    }
    by_joint("perfect_phase_rmse_deg", &|joint| following.perfect_phase_rmse_deg[joint as usize]);
    by_joint("ratio", &|joint| judged.ratio(joint));
    by_joint("causal_bound_deg", &|joint| possible.causal_bound_deg[joint as usize]);
    let _ = write!(out, "verdict");
    for joint in Joint::ALL {
        let _ = write!(out, " {} {}", joint.name(), possible.verdicts[joint as usize].map_or("-", Comparison::name));
    }
    out.push('\n');
    let _ = writeln!(out, "false_locks {}", following.false_locks);
    let _ = write!(out, "false_stops {}", following.false_stops.len());
    for stop in &following.false_stops {
        let _ = write!(out, " {:.3}..{:.3}", stop.from_s, stop.to_s);
    }
    let _ = write!(out, "\nslips {}", following.slips.len());
    for slip in &following.slips {
        let _ = write!(out, " {:.3}", slip.at_s);
    }
    out.push('\n');
    let _ = writeln!(out, "holds {}", following.holds.len());
    let _ = writeln!(out, "cadence_steps_per_min {}", number(following.cadence_steps_per_min, 1));
    let _ = writeln!(out, "phase_sd_deg {}", number(following.phase_sd_deg, 2));
    out
}
