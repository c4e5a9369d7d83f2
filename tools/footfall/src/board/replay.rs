//! The host's copy of the board's loop, fed with what the board was fed.
//!
//! The same core crates run here; the same inputs must give the same bits. The board's `inputs` lines hold every call since the
//! boot, so nothing else is needed. Once a line is lost the copy no longer knows the board's state and says so: from there on
//! nothing is compared, which is not the same as equal.

use crate::board::default_loop::BoardLoop;
use crate::board::telemetry::{Call, Follow, Inputs, Tick};
use joint_loop::{Frame, SENSORS};
use std::collections::VecDeque;

/// How many frames are kept to compare with: the board is never further behind than its queue of 64 calls.
const KEPT: usize = 256;

/// Inputs are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("inputs of ticks {} to {} were lost", .after.wrapping_add(1), .found.wrapping_sub(1))]
pub struct Gap {
    /// The last tick before it.
    pub after: u32,
    /// The next tick that there is.
    pub found: u32,
}

/// A field in which board and host differ.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("tick {tick}: {field} is {board} on the board and {host} on the host")]
pub struct Difference {
    /// The tick.
    pub tick: u32,
    /// The field.
    pub field: &'static str,
    /// The board's value.
    pub board: String,
    /// The host's value.
    pub host: String,
}

/// The host's loop and its last frames.
#[derive(Debug, Clone)]
pub struct Replay {
    joints: BoardLoop,
    frames: VecDeque<(Call, Frame<SENSORS>)>,
    gap: Option<Gap>,
    calls: u64,
}

impl Replay {
    /// Begins with a loop as it boots.
    #[must_use]
    pub fn new(joints: BoardLoop) -> Self {
        Self { joints, frames: VecDeque::new(), gap: None, calls: 0 }
    }

    /// Runs the calls of one line.
    ///
    /// # Errors
    /// The line does not follow on the one before; the copy is then of no more use.
    pub fn feed(&mut self, inputs: &Inputs) -> Result<(), Gap> {
        if let Some(gap) = self.gap {
            return Err(gap);
        }
        let before = self.joints.frame().tick;
        if let Some(first) = inputs.calls.first()
            && before.wrapping_add(u32::from(first.elapsed.max(1))) != inputs.first_tick
        {
            let gap = Gap { after: before, found: inputs.first_tick };
            self.gap = Some(gap);
            return Err(gap);
        }
        for call in &inputs.calls {
            self.joints.tick(&call.sample());
            self.calls += 1;
            if self.frames.len() == KEPT {
                self.frames.pop_front();
            }
            self.frames.push_back((*call, self.joints.frame()));
        }
        Ok(())
    }

    /// The tick that has been reached.
    #[must_use]
    pub fn tick(&self) -> u32 {
        self.joints.frame().tick
    }

    /// Calls of the loop so far.
    #[must_use]
    pub const fn calls(&self) -> u64 {
        self.calls
    }

    /// What was lost, if anything was.
    #[must_use]
    pub const fn gap(&self) -> Option<Gap> {
        self.gap
    }

    /// Input and frame of a tick, if it is one of the last.
    #[must_use]
    pub fn at(&self, tick: u32) -> Option<(Call, &Frame<SENSORS>)> {
        self.frames.iter().rev().find(|(_, frame)| frame.tick == tick).map(|(call, frame)| (*call, frame))
    }
}

/// The fields in which a line of the board differs from the host's frame of the same tick. Numbers are compared by their bits.
#[must_use]
pub fn differences(board: &Tick, host: &Frame<SENSORS>) -> Vec<Difference> {
    let mut found = Vec::new();
    let tick = host.tick;
    let mut compare = |field, same: bool, board: String, host: String| {
        if !same {
            found.push(Difference { tick, field, board, host });
        }
    };
    let degrees = host.measured.map(|angle| angle.degrees());
    let same = board.sensor_deg.map(f32::to_bits) == degrees.map(f32::to_bits);
    compare("sensor", same, format!("{:?}", board.sensor_deg), format!("{degrees:?}"));
    let verdicts =
        |of: [Option<hgod_adc::Validity>; SENSORS]| of.map(|verdict| verdict.map_or("none", |v| v.name())).join(", ");
    compare("verdict", board.verdict == host.validity, verdicts(board.verdict), verdicts(host.validity));
    compare("state", board.state == host.state, board.state.name().into(), host.state.name().into());
    let set = host.setpoints.map(|angle| angle.degrees());
    let same = board.set_deg.map(f32::to_bits) == set.map(f32::to_bits);
    compare("set", same, format!("{:?}", board.set_deg), format!("{set:?}"));
    let pulses = host.pulses.map(|pulse| pulse.0);
    compare("pulse", board.pulse_us == pulses, format!("{:?}", board.pulse_us), format!("{pulses:?}"));
    for (field, board, host) in [
        ("late", u64::from(board.late), u64::from(host.late)),
        ("missed", u64::from(board.missed), u64::from(host.missed)),
        ("limited", u64::from(board.limited), u64::from(host.limited.bits())),
        ("seq", u64::from(board.seq), u64::from(host.seq)),
    ] {
        compare(field, board == host, board.to_string(), host.to_string());
    }
    let (board, host) = (format!("{:016x}", board.hash), format!("{:016x}", host.setpoint_hash));
    compare("hash", board == host, board.clone(), host.clone());
    found
}

/// The fields in which a `follow` line of the board differs from the host's frame of the same tick, by their bits.
#[must_use]
pub fn follow_differences(board: &Follow, host: &Frame<SENSORS>) -> Vec<Difference> {
    let bits = |line: &Follow| {
        let Follow { tick, state, fault, stride_s, phase_error_deg, confidence } = *line;
        (tick, state, fault, [stride_s, phase_error_deg, confidence].map(f32::to_bits))
    };
    let here = follow_line_of(host);
    if here.as_ref().map(bits) == Some(bits(board)) {
        return vec![];
    }
    let host_words = here.map_or("nothing".into(), |line| line.to_string());
    vec![Difference { tick: host.tick, field: "follow", board: board.to_string(), host: host_words }]
}

/// The `follow` line as a board with this frame would print it.
#[must_use]
pub fn follow_line_of(frame: &Frame<SENSORS>) -> Option<Follow> {
    frame.following.map(|status| Follow {
        tick: frame.tick,
        state: status.state,
        fault: status.fault,
        stride_s: status.stride_s,
        phase_error_deg: status.phase_error.degrees(),
        confidence: status.confidence,
    })
}

/// A line as a board with this frame would print it.
#[must_use]
pub fn line_of(frame: &Frame<SENSORS>) -> Tick {
    Tick {
        tick: frame.tick,
        state: frame.state,
        sensor_deg: frame.measured.map(|angle| angle.degrees()),
        verdict: frame.validity,
        set_deg: frame.setpoints.map(|angle| angle.degrees()),
        pulse_us: frame.pulses.map(|pulse| pulse.0),
        late: frame.late,
        missed: frame.missed,
        limited: frame.limited.bits(),
        seq: frame.seq,
        hash: frame.setpoint_hash,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::default_loop::typical_loop;
    use hgod_adc::Validity;
    use joint_loop::SupervisorState;
    use joint_units::AdcCode;

    fn call(code: u16) -> Call {
        Call { sensors: [AdcCode(code); SENSORS], vrefint: AdcCode(1652), elapsed: 1, flags: 0 }
    }

    fn replay() -> Replay {
        let mut replay = Replay::new(typical_loop().unwrap());
        let calls = (0..50).map(|n| call(2100 + n)).collect();
        assert_eq!(replay.feed(&Inputs { first_tick: 1, sensors: 1, calls }), Ok(()));
        replay
    }

    #[test]
    fn each_field_that_differs_is_named() {
        let replay = replay();
        let (_, frame) = replay.at(50).unwrap();
        let same = line_of(frame);
        assert_eq!(differences(&same, frame), []);
        let flip = |x: f32| f32::from_bits(x.to_bits() ^ 1);
        type Change = fn(&mut Tick, fn(f32) -> f32);
        let changes: [(&str, Change); 10] = [
            ("sensor", |tick, flip| tick.sensor_deg[0] = flip(tick.sensor_deg[0])),
            ("verdict", |tick, _| tick.verdict[0] = Some(Validity::Rate)),
            ("state", |tick, _| tick.state = SupervisorState::Walking),
            ("set", |tick, flip| tick.set_deg[3] = flip(tick.set_deg[3])),
            ("pulse", |tick, _| tick.pulse_us[0] ^= 1),
            ("late", |tick, _| tick.late ^= 1),
            ("missed", |tick, _| tick.missed ^= 1),
            ("limited", |tick, _| tick.limited ^= 1),
            ("seq", |tick, _| tick.seq ^= 1),
            ("hash", |tick, _| tick.hash ^= 1),
        ];
        for (field, change) in changes {
            let mut other = same;
            change(&mut other, flip);
            let found = differences(&other, frame);
            assert_eq!(found.iter().map(|d| (d.tick, d.field)).collect::<Vec<_>>(), [(50, field)]);
        }
    }

    #[test]
    fn a_line_that_does_not_follow_ends_the_replay_for_good() {
        let mut replay = replay();
        let line = |first_tick| Inputs { first_tick, sensors: 1, calls: vec![call(2200)] };
        let gap = Gap { after: 50, found: 61 };
        assert_eq!(replay.feed(&line(61)), Err(gap));
        assert_eq!((replay.tick(), replay.gap()), (50, Some(gap)));
        assert_eq!(replay.feed(&line(51)), Err(gap), "what comes later does not mend it");
        assert_eq!(gap.to_string(), "inputs of ticks 51 to 60 were lost");
    }

    #[test]
    fn a_missed_period_is_no_gap() {
        let mut replay = replay();
        let late = Call { elapsed: 3, ..call(2200) };
        assert_eq!(replay.feed(&Inputs { first_tick: 53, sensors: 1, calls: vec![late] }), Ok(()));
        assert_eq!((replay.tick(), replay.calls(), replay.at(51).is_none()), (53, 51, true));
    }
}
