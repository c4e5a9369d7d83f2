//! Reports what a recording is, column for column, and what `footfall fit` makes of it.

use crate::board::feed;
use crate::command::fit::job::{Input, Job, name_of};
use crate::failure::Failure;
use crate::file::recording;
use gait_fit::fit::Fit;
use gait_fit::judge::held_out_in_words;
use gait_trace::{Conditioned, Done, Finding, FindingKind, Level, SignBasis, condition};
use joint_units::Joint;
use std::fmt::Write as _;
use std::path::Path;

/// The report, and the line of a good recording or the error of another one.
pub(super) fn check(path: &Path, job: &Job) -> (String, Result<String, Failure>) {
    let mut report = Report(format!("{}:\n", path.display()));
    match judge(path, job, &mut report) {
        Ok(fitted) => {
            let drive = &fitted.certificate.drive;
            // The error has the reason.
            report.line("walks", if drive.why_not.is_some() { "no".into() } else { drive.in_words() });
            if let Some(why) = &drive.why_not {
                let words = "`fit` writes a generator of it with --fit-limits only, or with --force-write";
                return (report.0, Err(Failure::run(format!("{}: walks: no: {why}; {words}", path.display()))));
            }
            let (strides, period_s) = (fitted.strides.cycles().len(), fitted.period_s);
            let warnings = recording::and_warnings(recording::warnings(&fitted.conditioned.findings).len());
            let good =
                format!("{}: good: `fit` takes it, {strides} strides of {period_s:.3} s{warnings}", path.display());
            (report.0, Ok(good))
        }
        Err(why) => {
            // The error has the reason.
            report.line("fit", "refuses it");
            if let Ok(opened) = feed::opened(path) {
                let columns: Vec<String> = opened.recording.channels().iter().map(|channel| channel.column()).collect();
                let seconds = opened.recording.duration_s();
                report.line("sensors", format!("`watch` and `volts` can play {}, {seconds:.3} s", columns.join(" ")));
            }
            (report.0, Err(why))
        }
    }
}

/// Lines of a name and a value.
struct Report(String);

impl Report {
    fn line(&mut self, name: &str, value: impl std::fmt::Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "  {name:<10} {value}");
    }
}

fn judge(path: &Path, job: &Job, report: &mut Report) -> Result<Fit, Failure> {
    let recorded = recording::open(path)?.parse(&job.reading)?;
    if let Some(conversion) = &recorded.conversion {
        report.line("converted", format!("from {} by footfall {}", conversion.source, conversion.version));
    }
    let input = Input::of(recorded, &name_of(path), job.fit.rules.low_pass)?;
    let raw = &input.joints;
    report.line("format", &raw.format);
    let conditioned = condition(raw, &job.fit.rules).ok();
    for joint in Joint::ALL {
        let of_file = conditioned.as_ref().map_or(joint, |conditioned| conditioned.column_of(joint));
        let taken = raw.joints[of_file as usize].as_ref().map_or("not in the file".into(), |column| {
            let sign =
                conditioned.as_ref().map_or(String::new(), |conditioned| format!(", {}", sign(conditioned, joint)));
            format!("`{}`, {}{sign}", column.column, column.unit)
        });
        report.line(joint.name(), taken);
    }
    if let Some(conditioned) = &conditioned {
        let (rows, seconds) = (conditioned.recording.time_s().len(), conditioned.recording.duration_s());
        let (rate, start) = (conditioned.rate_hz, conditioned.start_s);
        report.line(
            "time",
            match conditioned.normalised_cycle {
                true => match job.reading.stride_s {
                    Some(seconds) => format!("one cycle, {rows} rows; it lasts {seconds} s, as requested"),
                    None => format!("one cycle, {rows} rows; {} s are assumed (--stride-time)", job.fit.stride_s),
                },
                false => format!("{rows} rows at {rate:.2} Hz, {seconds:.3} s from {start} s on"),
            },
        );
    }
    raw.notes.iter().for_each(|note| report.line(Level::Note.name(), note));
    for finding in conditioned.iter().flat_map(|conditioned| &conditioned.findings) {
        report.line(finding.level().name(), finding);
    }
    let fitted = job.fit(&input, &mut |_| ())?;
    let earlier = conditioned.as_ref().map_or(&[][..], |conditioned| &conditioned.findings);
    for finding in fitted.conditioned.findings.iter().filter(|finding| !earlier.contains(finding)) {
        report.line(finding.level().name(), finding);
    }
    for note in fitted.notes.iter().filter(|note| !raw.notes.contains(note)) {
        report.line(Level::Note.name(), note);
    }
    let strides = &fitted.strides;
    let (count, period_s, sd_s) = (strides.cycles().len(), strides.period_s, strides.period_sd_s());
    report.line("strides", format!("{count} of {period_s:.3} s, standard deviation {sd_s:.3} s"));
    strides.left_out.iter().for_each(|part| report.line("", part));
    report.line("fit", format!("{}, {}", fitted.file.set.name(), held_out_in_words(&fitted.joints)));
    Ok(fitted)
}

/// What was done about the sign of a joint, and what it rests on.
fn sign(conditioned: &Conditioned, joint: Joint) -> &'static str {
    let is_of_sign = |finding: &&Finding| {
        finding.joint == Some(joint) && matches!(finding.what, FindingKind::HipSign(_) | FindingKind::KneeSign(_))
    };
    let is_changed = conditioned.findings.iter().filter(is_of_sign).any(|finding| finding.done == Done::Flipped);
    match conditioned.signs[joint as usize] {
        Some(SignBasis::Turned) if is_changed => "sign changed by the shape of the strides: extension was positive",
        _ if is_changed => "sign changed: extension was positive",
        Some(SignBasis::Turned) => "flexion positive by the shape of the strides, which `footfall convert` changed",
        Some(SignBasis::Shape) => "flexion positive by the shape of the strides",
        Some(SignBasis::Named | SignBasis::Known) => "flexion positive",
        Some(SignBasis::Assumed) | None => "sign not known, flexion assumed",
    }
}
