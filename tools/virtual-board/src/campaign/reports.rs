//! What the board says of itself on the serial port: state and cause of its supervisor, its counters, the faults that it saw. A frame that is damaged,
//! or of another version, says nothing.

use joint_loop::{BoardFaults, Cause, Debugger, SupervisorState};
use wire::{Change, Frame, Inputs, Record, Reset, Unframer, decode_framed};

/// State and cause of the supervisor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Status {
    /// State.
    pub(crate) state: SupervisorState,
    /// Cause.
    pub(crate) cause: Cause,
}

/// The program's own record of how the run before ended, as it names them in its log.
pub(crate) const CRASHES: [&str; 8] = [
    "panic",
    "hard_fault",
    "clock_failure",
    "non_maskable",
    "unexpected_interrupt",
    "stalled",
    "racing",
    "stack_overflow",
];

/// What the next boot can give as the end of the run before, as in the log: the program's own record of it, or else the cause of the reset, or nothing.
pub(crate) fn ends() -> Vec<&'static str> {
    CRASHES.into_iter().chain(Reset::ALL.map(Reset::name)).chain(["nothing"]).collect()
}

/// The causes that calls carry as faults of the board.
const CARRIED: [(Cause, BoardFaults); 5] = [
    (Cause::AdcOverrun, BoardFaults::ADC_OVERRUN),
    (Cause::BreakInput, BoardFaults::BREAK_INPUT),
    (Cause::Clock, BoardFaults::CLOCK),
    (Cause::Watchdog, BoardFaults::WATCHDOG),
    (Cause::Outputs, BoardFaults::OUTPUTS),
];

/// What grows when the board has noticed something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Counter {
    /// Ticks with an overrun of the converter.
    Overruns,
    /// Control periods without a tick.
    Missed,
    /// Ticks that began too late.
    Late,
    /// Edges at the synchronisation input.
    Edges,
    /// Calls with a debugger attached.
    Debugger,
    /// Refusals, with their reasons.
    Refusals,
}

/// Counts of the loop since the boot, as the newest frame has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub(crate) struct Totals {
    /// Number of the frame's tick.
    pub(crate) tick: u32,
    /// Ticks that began too late.
    pub(crate) late: u32,
    /// Control periods without a tick.
    pub(crate) missed: u32,
    /// Ticks with an overrun of the converter.
    pub(crate) overruns: u32,
}

/// What came so far.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    /// The newest state and cause; `None`: none since the boot.
    pub(crate) status: Option<Status>,
    /// Frames so far.
    pub(crate) frames: u32,
    /// Faults in the calls since they were last taken.
    faults: BoardFaults,
    counts: [u32; 6],
    /// Those of the newest frame; `None`: none since the boot.
    pub(crate) totals: Option<Totals>,
    unframer: Unframer,
}

impl Reports {
    /// Takes bytes of the serial port.
    pub(crate) fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(Ok(Ok(record))) = self.unframer.push(byte).map(|payload| payload.map(decode_framed)) {
                self.record(&record);
            }
        }
    }

    /// The board boots: what it said before is over.
    pub(crate) fn boot(&mut self) {
        (self.status, self.totals) = (None, None);
        self.unframer = Unframer::default();
    }

    /// Forgets what was noticed so far.
    pub(crate) fn begin(&mut self) {
        (self.faults, self.counts, self.frames) = (BoardFaults::NONE, [0; 6], 0);
    }

    /// How often it happened since [`Reports::begin`].
    pub(crate) fn count(&self, counter: Counter) -> u32 {
        self.counts[counter as usize]
    }

    /// Whether a call since [`Reports::begin`] had the fault with this cause, of those that calls carry.
    pub(crate) fn saw_fault(&self, cause: Cause) -> bool {
        CARRIED.iter().any(|(of, fault)| *of == cause && self.faults.contains(*fault))
    }

    fn add(&mut self, counter: Counter, more: u32) {
        self.counts[counter as usize] += more;
    }

    fn record(&mut self, record: &Record) {
        match record {
            Record::Refused(_) => self.add(Counter::Refusals, 1),
            Record::Edge(_) => self.add(Counter::Edges, 1),
            Record::Change(Change { state, cause, .. }) => {
                self.status = Some(Status { state: *state, cause: *cause });
            }
            Record::Inputs(inputs) => self.inputs(inputs),
            Record::Frame(frame) => self.frame(frame),
            _ => {}
        }
    }

    fn inputs(&mut self, inputs: &Inputs) {
        for call in &inputs.calls {
            self.faults = self.faults.with(call.flags.faults());
            self.add(Counter::Debugger, u32::from(call.flags.debugger() != Debugger::Absent));
            self.add(Counter::Late, u32::from(call.flags.late()));
        }
    }

    fn frame(&mut self, frame: &Frame) {
        let Frame { tick, state, cause, late, missed, overruns, .. } = *frame;
        self.status = Some(Status { state, cause });
        self.frames += 1;
        if let Some(before) = self.totals.replace(Totals { tick, late, missed, overruns }) {
            self.add(Counter::Missed, missed.wrapping_sub(before.missed));
            self.add(Counter::Overruns, overruns.wrapping_sub(before.overruns));
        }
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.state.name(), self.cause.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::{Call, Flags, MAX_FRAME_BYTES, frame_record};

    fn framed(record: &Record) -> Vec<u8> {
        frame_record(record, &mut [0; MAX_FRAME_BYTES]).expect("it fits").to_vec()
    }

    fn change(state: SupervisorState) -> Vec<u8> {
        framed(&Record::Change(Change { tick: 1000, state, cause: Cause::None }))
    }

    #[test]
    fn states_counters_and_faults_are_read() {
        let mut reports = Reports::default();
        reports.take(&change(SupervisorState::Walking));
        assert_eq!(reports.status.map(|status| status.to_string()), Some("walking (none)".into()));
        for (missed, overruns) in [(1, 200), (3, 201)] {
            reports.take(&framed(&Record::Frame(Frame {
                tick: 9,
                seq: 9,
                state: SupervisorState::Fault,
                cause: Cause::Outputs,
                sensors: [None; 4],
                following: None,
                setpoints_rad: [0.0; 4],
                pulses_us: [0; 4],
                late: 0,
                missed,
                overruns,
                limited: 0,
                limited_ticks: 0,
                setpoint_hash: 0,
            })));
        }
        assert_eq!((reports.count(Counter::Missed), reports.count(Counter::Overruns)), (2, 1));
        assert_eq!(
            (reports.status, reports.frames),
            (Some(Status { state: SupervisorState::Fault, cause: Cause::Outputs }), 2)
        );
        assert_eq!(reports.totals, Some(Totals { tick: 9, late: 0, missed: 3, overruns: 201 }));
        // A call with the fault `outputs`, and one with an attached debugger and a late start.
        let call = |bits| Call { flags: Flags::from_bits(bits).expect("known bits"), elapsed: 1, ..Call::default() };
        let calls = [call(1 << 6), call(1 << 1 | 1 << 9)].into_iter().collect();
        reports.take(&framed(&Record::Inputs(Inputs { first_tick: 7, calls })));
        assert!(reports.saw_fault(Cause::Outputs) && !reports.saw_fault(Cause::BreakInput));
        assert_eq!((reports.count(Counter::Debugger), reports.count(Counter::Late)), (1, 1));
        assert!(!reports.saw_fault(Cause::Supply));
        reports.begin();
        assert!(!reports.saw_fault(Cause::Outputs) && reports.frames == 0);
    }

    #[test]
    fn a_damaged_frame_says_nothing() {
        let mut bytes = change(SupervisorState::Walking);
        bytes[3] ^= 4;
        let mut reports = Reports::default();
        reports.take(&bytes);
        reports.take(&[9, 9, 0, 0, 0]);
        assert_eq!(reports.status, None);
        reports.take(&change(SupervisorState::Disarmed));
        assert_eq!(reports.status.map(|status| status.state), Some(SupervisorState::Disarmed));
    }
}
