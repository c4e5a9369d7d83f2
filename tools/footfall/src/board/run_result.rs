//! The result of a run: the last object of the output, and whether the run was sound.

use crate::board::counters::{Counters, Following, MotionEnd};
use crate::board::explained::Injected;
use crate::board::lines::{End, Judged, Reset};
use joint_loop::Cause;
use serde::Serialize;
use serde_json::Value;
use wire::Cost;

/// The result of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunResult {
    /// `end`.
    pub r#type: &'static str,
    /// Virtual time, s.
    pub t_s: f64,
    /// Why it ended: `time` for the time limit, `killed` for a request.
    pub reason: String,
    /// Control periods since the last boot, from the last tick record.
    pub ticks: u32,
    /// Ticks that began late, of all boots.
    pub late_ticks: u64,
    /// Control periods without a tick, of all boots.
    pub missed_ticks: u64,
    /// Load and reserves, by the board: the longest tick and the latest start of all seconds, all else of the last one; null in the first
    /// second.
    pub cost: Option<Cost>,
    /// State of the supervisor; `unknown` if no frame has come for longer than frames are apart, or none since the last boot.
    pub state: &'static str,
    /// Since when no frame has come, in virtual seconds; null while they come.
    pub no_frame_since_s: Option<f64>,
    /// Cause of its last change.
    pub cause: &'static str,
    /// When the log gave this cause, in virtual seconds.
    pub cause_at_s: f64,
    /// How the motions before the last one ended.
    pub earlier_ends: Vec<MotionEnd>,
    /// The board was armed, or in a trim, at some time.
    pub has_armed: bool,
    /// Why the board refused to arm or to start, in its words; the last one.
    pub refused: Option<String>,
    /// Why the board refused to start in its last boot; null if it did not.
    pub not_started: Option<String>,
    /// When that boot was, in virtual seconds.
    pub boot_at_s: f64,
    /// Shortest and longest pulse at each servo's pin, in microseconds: left hip, right hip, left knee, right knee.
    pub pulse_us: [Option<[f64; 2]>; 4],
    /// Least and most angle of each modelled servo's joint, degrees; null without modelled servos.
    pub servo_deg: Value,
    /// Edges of servo pins before the first arming after a reset.
    pub edges_before_arming: u64,
    /// Edges of servo pins after disarming.
    pub edges_after_disarming: u64,
    /// What came of the pulses, judged by the virtual board.
    pub judged: Judged,
    /// Accesses that the models of the virtual board do not support.
    pub unmodelled: u64,
    /// Every kind of irregular access.
    pub lints: Vec<Value>,
    /// Faults that were not injected.
    pub unexpected_faults: u64,
    /// Boots, the first one included.
    pub boots: u32,
    /// Resets after power-on.
    pub resets: Vec<Reset>,
    /// Injected faults and their effects.
    pub injections: Vec<Value>,
    /// Hash of all setpoints of the last boot, by the board.
    pub setpoint_hash: Option<String>,
    /// The same of the host's copy of the loop at the same tick; null if not known.
    pub host_replay_hash: Option<String>,
    /// `equal`, `different`, or why the comparison is not possible.
    pub host_replay: String,
    /// Tick records that were compared with the host, field by field, bit for bit.
    pub compared_lines: u64,
    /// Of these, records with a difference.
    pub different_lines: u64,
    /// The first differences.
    pub differences: Vec<String>,
    /// Calls of the loop that the host repeated.
    pub replayed_calls: u64,
    /// The board's outputs are off (shadow mode).
    pub shadow: bool,
    /// State of a follower at the end.
    pub following: Option<Following>,
    /// Tick records that were lost.
    pub lost_lines: u64,
    /// Malformed frames of the log.
    pub malformed_frames: u64,
    /// SHA-256 of the ELF file.
    pub elf_sha256: String,
    /// The input of the sensors.
    pub trace: Value,
}

impl RunResult {
    /// From the board's last line and the counters; without a last line the board's part is empty and the reason names this.
    #[must_use]
    pub fn new(end: Option<&End>, counters: &Counters, elf_sha256: &str, trace: Value) -> Self {
        let last = counters.last;
        let hex = |hash: u64| format!("{hash:016x}");
        let host_replay = match (counters.different, counters.compared, &counters.why_not) {
            (1.., ..) => "different".into(),
            (0, _, Some(why)) => format!("not known: {why}"),
            (0, 0, None) => "not known: the log has no frames".into(),
            (0, 1.., None) => "equal".into(),
        };
        let t_s = end.map_or(0.0, |end| end.t_s);
        let no_frame_since_s = counters.heard.silent_since_s(t_s);
        let heard = last.filter(|_| no_frame_since_s.is_none());
        Self {
            r#type: "end",
            t_s,
            reason: end.map_or("the virtual board ended without its last line".into(), |end| end.reason.clone()),
            ticks: last.map_or(0, |tick| tick.tick),
            late_ticks: counters.late_ticks(),
            missed_ticks: counters.missed_ticks(),
            cost: counters.cost,
            state: heard.map_or("unknown", |tick| tick.state.name()),
            no_frame_since_s,
            cause: counters.cause.name(),
            cause_at_s: counters.cause_at_s,
            earlier_ends: counters.earlier_ends.clone(),
            has_armed: counters.has_armed,
            refused: counters.refused.clone(),
            not_started: counters.not_started.clone(),
            boot_at_s: counters.heard.boot_at_s,
            pulse_us: end.map_or([None; 4], |end| end.pulse_us),
            servo_deg: end.map_or(Value::Null, |end| end.servo_deg.clone()),
            edges_before_arming: end.map_or(0, |end| end.edges_before_arming),
            edges_after_disarming: end.map_or(0, |end| end.edges_after_disarming),
            judged: end.map_or(Judged::default(), |end| end.judged.clone()),
            unmodelled: end.map_or(0, |end| end.unmodelled),
            lints: end.map_or(vec![], |end| end.lints.clone()),
            unexpected_faults: end.map_or(0, |end| end.unexpected_faults),
            boots: counters.boots,
            resets: end.map_or(vec![], |end| end.resets.clone()),
            injections: end.map_or(vec![], |end| end.injections.clone()),
            setpoint_hash: counters.hashes.map(|(board, _)| board).or(last.map(|tick| tick.setpoint_hash)).map(hex),
            host_replay_hash: counters.hashes.filter(|_| counters.why_not.is_none()).map(|(_, host)| hex(host)),
            host_replay,
            compared_lines: counters.compared,
            different_lines: counters.different,
            differences: counters.differences.iter().map(ToString::to_string).collect(),
            replayed_calls: counters.calls,
            shadow: counters.shadow,
            following: counters.following,
            lost_lines: counters.lost_lines,
            malformed_frames: counters.malformed,
            elf_sha256: elf_sha256.into(),
            trace,
        }
    }

    /// Why no servo got a pulse, in words; `None` if one did, or if the outputs are off in shadow mode.
    #[must_use]
    pub fn never_on(&self) -> Option<String> {
        if self.shadow || self.pulse_us.iter().any(Option::is_some) {
            return None;
        }
        let why = if let Some(reason) = &self.refused {
            reason.clone()
        } else if self.has_armed {
            "the board was armed, and the outputs went off before the first pulse".into()
        } else if self.cause == Cause::None.name() {
            "no hold of the button counted: nobody held it, it was held from the boot on, or the run ended before its release".into()
        } else {
            format!("the last hold of the button was refused, cause {}", self.cause)
        };
        Some(format!("outputs never on: {}{why}", if self.has_armed { "" } else { "the board was never armed; " }))
    }

    /// Since when no frame has come, in words; `None` if they came to the end.
    #[must_use]
    pub fn silence(&self) -> Option<String> {
        self.no_frame_since_s
            .map(|since| format!("no frame came since {since:.3} s, the state of the board is unknown"))
    }

    /// The faults of the run in words; empty if it was sound.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut when = |wrong: bool, words: String| {
            if wrong {
                faults.push(words);
            }
        };
        let ended = matches!(self.reason.as_str(), "time" | "killed");
        when(!ended, format!("the board ended early: {}", self.reason));
        when(self.unmodelled > 0, format!("{} accesses that the models do not support", self.unmodelled));
        when(!self.lints.is_empty(), format!("irregular accesses: {}", Value::from(self.lints.clone())));
        when(self.unexpected_faults > 0, format!("{} faults that were not injected", self.unexpected_faults));
        let edges = self.edges_before_arming + self.edges_after_disarming;
        when(edges > 0, format!("{edges} edges of servo pins while disarmed"));
        let Judged { violations, first, .. } = &self.judged;
        when(*violations > 0, format!("{violations} pulses that no servo may get: {}", first.join("; ")));
        let injected = Injected(&self.injections);
        for reset in &self.resets {
            let Reset { t_s, cause } = reset;
            when(!injected.explain_reset(*t_s), format!("the board was reset at {t_s:.3} s, cause {cause}"));
        }
        let moves = matches!(self.state, "arming" | "walking");
        let asked = |cause: &str, t_s| matches!(cause, "none" | "button") || injected.explain_cause(cause, t_s);
        for MotionEnd { t_s, state, cause } in &self.earlier_ends {
            // A person presses the emergency stop, as the button.
            let is_pressed = *cause == Cause::BreakInput.name();
            when(!is_pressed && !asked(cause, *t_s), format!("the motion ended at {t_s:.3} s: {state}, cause {cause}"));
        }
        let asked = asked(self.cause, self.cause_at_s);
        when(!moves && !asked, format!("the motion ended: {}, cause {}", self.state, self.cause));
        if let Some(reason) = &self.not_started {
            when(!injected.explain_refusal(self.boot_at_s), format!("the board refused to start: {reason}"));
        } else if let Some(words) = self.silence() {
            when(!injected.explain_silence(self.t_s), words);
        }
        when(self.different_lines > 0, format!("board and host differ: {}", self.differences.join("; ")));
        when(self.malformed_frames > 0, format!("{} malformed frames in the log", self.malformed_frames));
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn never_on(counters: &Counters) -> Option<String> {
        RunResult::new(None, counters, "", Value::Null).never_on()
    }

    #[test]
    fn a_dark_board_says_why() {
        let dark = Counters::default();
        let says = |counters: &Counters, words: &str| {
            let text = never_on(counters).expect("it is dark");
            assert!(text.starts_with("outputs never on: ") && text.contains(words), "{text}");
        };
        says(&dark, "the board was never armed; no hold of the button counted");
        let cause = Cause::StopUntested;
        says(&Counters { cause, ..dark.clone() }, "the last hold of the button was refused, cause stop_untested");
        let refused = Some("no robot record".into());
        says(&Counters { refused, cause, ..dark.clone() }, "the board was never armed; no robot record");
        let armed = Counters { has_armed: true, cause: Cause::BreakInput, ..dark.clone() };
        says(&armed, "the board was armed, and the outputs went off before the first pulse");
        assert!(!never_on(&armed).expect("dark").contains("never armed"));
        // In shadow mode that is as it should be, and with pulses there is nothing to say.
        assert_eq!(never_on(&Counters { shadow: true, ..dark.clone() }), None);
        let mut result = RunResult::new(None, &dark, "", Value::Null);
        result.pulse_us[2] = Some([1_000.0, 2_000.0]);
        assert_eq!(result.never_on(), None);
    }
}
