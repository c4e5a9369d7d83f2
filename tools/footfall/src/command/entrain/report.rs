//! The result of `footfall entrain`: as text, and as one JSON object.

use cpg_core::entrainment::SensorFault;
use gait_fit::corrections::{JointOutcome, NotLearned};
use gait_fit::following::corrected::Corrected;
use gait_fit::following::possible::{Comparison, Possible};
use gait_fit::following::run::Entrainment;
use gait_fit::following::tick::TICKS_PER_S;
use gait_trace::Finding;
use generator_file::file::{GeneratorFile, GeneratorSet};
use joint_units::Joint;
use serde_json::json;
use std::fmt::Write as _;

use super::trace::Trace;

/// Where the corrections of a run are from.
pub(super) struct CorrectionSource {
    /// `learned`, `file` or `none`.
    source: &'static str,
    /// Corrections were learned, or the file has some: the follower can be near the causal bound.
    pub(super) is_corrected: bool,
    /// The generator was fitted to this recording, so its errors are not on other strides; `None` without a generator, or without its source.
    fitted_to_this: Option<bool>,
    /// What the user should know of them, one sentence each.
    pub(super) notes: Vec<String>,
}

impl CorrectionSource {
    /// Those of a generator file, for a recording with this checksum.
    pub(super) fn of_file(file: &GeneratorFile, sensor: Joint, sha256: &str) -> Self {
        let source_sha256 = &file.provenance.source_sha256;
        let fitted_to_this = (!source_sha256.is_empty()).then(|| source_sha256 == sha256);
        let mut notes = vec![];
        if fitted_to_this == Some(true) {
            notes.push(
                "the generator was fitted to this recording: the errors are not those on other strides; without --generator, corrections are \
                 judged on strides that they were not learned from"
                    .to_owned(),
            );
        }
        let missing = match &file.set {
            GeneratorSet::Follow(set) if set.corrections.is_none() => Some("the generator file has none".to_owned()),
            GeneratorSet::Follow(set) if set.sensor != sensor => {
                Some(format!("those of the generator file are for a sensor on {}", set.sensor.name()))
            }
            GeneratorSet::Follow(_) => None,
            _ => Some("the generator file is of no follower".to_owned()),
        };
        notes.extend(missing.as_ref().map(no_corrections));
        let source = if missing.is_none() { "file" } else { "none" };
        Self { source, is_corrected: missing.is_none(), fitted_to_this, notes }
    }

    /// Those that were learned from other strides of the recording.
    pub(super) fn learned(corrected: &Corrected) -> Self {
        let joints = Joint::ALL.into_iter().zip(&corrected.joints);
        let not = joints.filter(|(_, outcome)| !matches!(outcome, JointOutcome::Corrected { .. }));
        let notes =
            not.filter_map(|(joint, outcome)| Some(format!("{}: error of {}", joint.name(), outcome.in_words()?)));
        Self { source: "learned", is_corrected: true, fitted_to_this: None, notes: notes.collect() }
    }

    /// None could be learned.
    pub(super) fn none(why: NotLearned) -> Self {
        Self { source: "none", is_corrected: false, fitted_to_this: None, notes: vec![no_corrections(why)] }
    }
}

fn no_corrections(why: impl std::fmt::Display) -> String {
    format!("no corrections, so the errors are those of the templates alone: {why}")
}

/// What is reported.
pub(super) struct Report<'a> {
    /// The recording.
    pub(super) name: &'a str,
    /// The run, with the templates alone or with the corrections of the generator file.
    pub(super) run: &'a Entrainment,
    /// The run with corrections that were learned.
    pub(super) corrected: Option<&'a Corrected>,
    /// Where corrections are from.
    pub(super) source: &'a CorrectionSource,
    /// What is possible.
    pub(super) possible: &'a Possible,
}

impl Report<'_> {
    /// One JSON object.
    pub(super) fn as_json(&self, trace: &Trace) -> serde_json::Value {
        let Self { name, run, corrected, source, possible } = *self;
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
            .map(|&(tick, fault)| json!({ "t_s": tick as f64 / TICKS_PER_S, "fault": fault.name() }))
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
            "notes": trace.notes.iter().chain(&source.notes).collect::<Vec<_>>(),
            "findings": trace.findings.iter().map(found).collect::<Vec<_>>(),
            "core": "host",
            "sensor": trace.sensor.name(),
            "template": run.source,
            "fitted_to_this": source.fitted_to_this,
            "corrections": source.source,
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

    /// A line for each key.
    pub(super) fn as_text(&self, sensor: Joint) -> String {
        let Self { name, run, corrected, source, possible } = *self;
        let following = &run.following;
        let judged = corrected.map_or(following, |corrected| &corrected.following);
        let number =
            |value: Option<f64>, places: usize| value.map_or("-".to_owned(), |value| format!("{value:.places$}"));
        let mut out = format!("trace {name}\nsensor {}\ntemplate {}\n", sensor.name(), run.source);
        if let Some(fitted_to_this) = source.fitted_to_this {
            let _ = writeln!(out, "fitted_to_this {fitted_to_this}");
        }
        let _ = writeln!(out, "corrections {}", source.source);
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
            let _ =
                write!(out, " {} {}", joint.name(), possible.verdicts[joint as usize].map_or("-", Comparison::name));
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
}

fn found(finding: &Finding) -> serde_json::Value {
    json!({ "level": finding.level().name(), "text": finding.to_string() })
}

fn rmse_of(corrected: &Corrected, joint: Joint) -> Option<f64> {
    corrected.following.steady_rmse_deg[joint as usize]
}
