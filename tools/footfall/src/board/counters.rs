//! Counters of a run: what a board has sent since its power-on and since its last boot.

use crate::board::replay::Difference;
use cpg_core::entrainment::{Lock, SensorFault};
use joint_loop::{Cause, SupervisorState};
use serde::Serialize;
use wire::{Change, Cost, Frame};

/// Without a frame for longer than this, in virtual seconds, the state of the board is unknown. Frames are 10 ms apart.
const SILENT_S: f64 = 0.15;

/// State of a follower.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Following {
    /// `stopped`, `seeking`, `locked` or `holding`.
    pub state: &'static str,
    /// Fault of the sensor.
    pub fault: Option<&'static str>,
    /// Agreement of sensor and template: 1 complete, 0 none.
    pub confidence: f32,
    /// The person's estimated stride time, seconds.
    pub stride_s: f32,
    /// Phase of the person minus the estimated one, degrees of the cycle.
    pub phase_error_deg: f32,
    /// Time of the first lock, in seconds since the boot.
    pub locked_at_s: Option<f64>,
}

/// How a motion ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionEnd {
    /// When the log said so, in virtual seconds.
    pub t_s: f64,
    /// `stopping` or `fault`.
    pub state: &'static str,
    /// Why.
    pub cause: &'static str,
}

/// When a board was last heard, in virtual seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Heard {
    /// The last frame; `None`: none has come.
    pub frame_at_s: Option<f64>,
    /// The last boot.
    pub boot_at_s: f64,
}

impl Heard {
    /// Since when no frame has come, in virtual seconds, if that is longer ago than frames are apart; 0 if none has come at all.
    #[must_use]
    pub fn silent_since_s(self, t_s: f64) -> Option<f64> {
        let frame_at_s = self.frame_at_s.unwrap_or(0.0);
        (t_s - frame_at_s.max(self.boot_at_s) > SILENT_S).then_some(frame_at_s)
    }
}

/// Counters of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counters {
    /// Boots so far.
    pub boots: u32,
    /// Frames that were lost, by their sequence numbers.
    pub lost_lines: u64,
    /// Malformed frames of the log.
    pub malformed: u64,
    /// Rows that were compared with the host.
    pub compared: u64,
    /// Rows that were not compared.
    pub not_compared: u64,
    /// Why the first of them was not compared.
    pub why_not: Option<String>,
    /// Rows with a difference.
    pub different: u64,
    /// The first differences.
    pub differences: Vec<Difference>,
    /// Calls that the host's copy ran, over all boots.
    pub calls: u64,
    /// The last frame since the last boot.
    pub last: Option<Frame>,
    /// Ticks that began late before the last boot.
    pub late_before: u64,
    /// Control periods without a tick before the last boot.
    pub missed_before: u64,
    /// When the board was last heard.
    pub heard: Heard,
    /// Why the supervisor last changed its state.
    pub cause: Cause,
    /// When the log gave this cause, in virtual seconds.
    pub cause_at_s: f64,
    /// How the last motion ended, until the next one.
    pub last_end: Option<MotionEnd>,
    /// How the motions before ended, those of earlier boots too.
    pub earlier_ends: Vec<MotionEnd>,
    /// The supervisor was in a state in which the outputs are on.
    pub has_armed: bool,
    /// Why the board refused to arm or to start, in its words; the last one.
    pub refused: Option<String>,
    /// Why the board refused to start since the last boot, in its words: its outputs stay off.
    pub not_started: Option<String>,
    /// The board's outputs are off (shadow mode).
    pub shadow: bool,
    /// State of a follower; `None` for other generators.
    pub following: Option<Following>,
    /// Setpoint hashes of board and host at the last compared row.
    pub hashes: Option<(u64, u64)>,
    /// Load and reserves: the longest tick and the latest start of all seconds, all else of the last one.
    pub cost: Option<Cost>,
}

impl Counters {
    /// Takes a boot: what is known of the one before is no longer the state of the board.
    pub(super) fn restart(&mut self, t_s: f64) {
        self.late_before = self.late_ticks();
        self.missed_before = self.missed_ticks();
        self.boots += 1;
        self.heard.boot_at_s = t_s;
        (self.last, self.hashes, self.not_started) = (None, None, None);
        self.earlier_ends.extend(self.last_end.take());
    }

    /// Takes a change of the supervisor's state.
    pub(super) fn change(&mut self, change: &Change, t_s: f64) {
        (self.cause, self.cause_at_s) = (change.cause, t_s);
        self.has_armed |= change.state.moving();
        match change.state {
            SupervisorState::Arming => self.earlier_ends.extend(self.last_end.take()),
            SupervisorState::Stopping | SupervisorState::Fault => {
                let (state, cause) = (change.state.name(), change.cause.name());
                self.earlier_ends.extend(self.last_end.replace(MotionEnd { t_s, state, cause }));
            }
            _ => {}
        }
    }

    /// Ticks that began late, of all boots.
    #[must_use]
    pub fn late_ticks(&self) -> u64 {
        self.late_before + self.last.map_or(0, |frame| frame.late.into())
    }

    /// Control periods without a tick, of all boots.
    #[must_use]
    pub fn missed_ticks(&self) -> u64 {
        self.missed_before + self.last.map_or(0, |frame| frame.missed.into())
    }

    /// Takes load and reserves of a second.
    pub(super) fn add(&mut self, cost: Cost) {
        let worst = self.cost.unwrap_or(cost);
        self.cost = Some(Cost {
            longest_cycles: cost.longest_cycles.max(worst.longest_cycles),
            latest_start_us: cost.latest_start_us.max(worst.latest_start_us),
            ..cost
        });
    }

    /// Takes the state of a follower from a frame.
    pub fn follow(&mut self, tick: &Frame) {
        let Some(follow) = &tick.following else { return };
        let locked = (follow.state == Lock::Locked).then(|| f64::from(tick.tick) / 1000.0);
        self.following = Some(Following {
            state: follow.state.name(),
            fault: follow.fault.map(SensorFault::name),
            confidence: follow.confidence,
            stride_s: follow.stride_s,
            phase_error_deg: follow.phase_error_deg(),
            locked_at_s: self.following.and_then(|known| known.locked_at_s).or(locked),
        });
    }
}
