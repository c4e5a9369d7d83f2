//! What the board says of itself on the serial port: state and cause of its supervisor, its counters, the faults that it saw.
//!
//! A reader of its own, which shares no code with the image: a frame is COBS (version, record, CRC-32) and a zero; numbers are varints, little endian.
//! Tests of the project compare the names below with those of the image, and what is read with what happened. A frame whose check sum is wrong is
//! dropped, and so is what follows a field that this reader does not know.

use crc::{CRC_32_ISO_HDLC, Crc};

/// State and cause of the supervisor, as numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Status {
    /// State.
    pub(crate) state: u8,
    /// Cause.
    pub(crate) cause: u8,
}

/// The number of the state `fault`.
pub(crate) const FAULT: u8 = 5;

/// Names of the causes, in the order of their numbers.
pub(crate) const CAUSES: [&str; 32] = [
    "none",
    "button",
    "sensor_open",
    "sensor_short",
    "sensor_saturated",
    "sensor_stuck",
    "sensor_spike",
    "sensor_rate",
    "sensor_out_of_table",
    "sensor_supply_low",
    "adc_overrun",
    "pose",
    "generator",
    "gap",
    "non_finite",
    "break_input",
    "clock",
    "watchdog",
    "outputs",
    "board",
    "request",
    "host_silent",
    "supply",
    "late",
    "hold_short",
    "hold_long",
    "presses",
    "person_stands",
    "stop_untested",
    "watchdog_clock",
    "debugger",
    "program",
];
/// Names of the states, in the order of their numbers.
pub(crate) const STATES: [&str; 8] =
    ["boot", "disarmed", "arming", "walking", "stopping", "fault", "trim_ready", "trimming"];

/// What the next boot can give as the end of the run before, as in the log: the program's own record of it, or else the cause of the reset, or nothing.
pub(crate) const ENDS: [&str; 16] = [
    "panic",
    "hard_fault",
    "clock_failure",
    "non_maskable",
    "unexpected_interrupt",
    "stalled",
    "racing",
    "stack_overflow",
    "power_on",
    "brown_out",
    "iwdg",
    "wwdg",
    "software",
    "low_power",
    "pin",
    "nothing",
];

/// Bits of the flags of a call: the tick was late, and a debugger is attached.
const LATE: u16 = 1 << 1;
const DEBUGGER: u16 = 1 << 9;
/// The faults of the board in the flags: the converter's overrun, the break, the clock, the watchdog, the outputs.
const FAULT_BITS: [(&str, u16); 5] =
    [("adc_overrun", 1 << 2), ("break_input", 1 << 3), ("clock", 1 << 4), ("watchdog", 1 << 5), ("outputs", 1 << 6)];

static CHECK_SUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Longest frame that is looked at, bytes.
const LONGEST: usize = 600;
/// Sensors in a frame.
const SENSORS: usize = 4;

// Kinds of records.
const REFUSED: u8 = 1;
const CHANGE: u8 = 2;
const INPUTS: u8 = 3;
const FRAME: u8 = 4;
const EDGE: u8 = 5;

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
#[derive(Debug, Clone, Default)]
pub(crate) struct Reports {
    /// The newest state and cause; `None`: none since the boot.
    pub(crate) status: Option<Status>,
    /// Frames so far.
    pub(crate) frames: u32,
    /// Flags of the calls since they were last taken.
    flags: u16,
    counts: [u32; 6],
    /// Those of the newest frame; `None`: none since the boot.
    pub(crate) totals: Option<Totals>,
    frame: Vec<u8>,
}

impl Reports {
    /// Takes bytes of the serial port.
    pub(crate) fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if byte != 0 {
                // One that is longer is no frame of the board.
                if self.frame.len() < LONGEST {
                    self.frame.push(byte);
                }
                continue;
            }
            if let Some(payload) = unstuffed(&std::mem::take(&mut self.frame)) {
                // What cannot be read to its end says nothing after that place.
                let _ = self.record(&payload);
            }
        }
    }

    /// The board boots: what it said before is over.
    pub(crate) fn boot(&mut self) {
        (self.status, self.totals) = (None, None);
        self.frame.clear();
    }

    /// Forgets what was noticed so far.
    pub(crate) fn begin(&mut self) {
        (self.flags, self.counts, self.frames) = (0, [0; 6], 0);
    }

    /// How often it happened since [`Reports::begin`].
    pub(crate) fn count(&self, counter: Counter) -> u32 {
        self.counts[counter as usize]
    }

    /// Whether a call since [`Reports::begin`] had the fault of this name, of those that calls carry.
    pub(crate) fn saw_fault(&self, cause: &str) -> bool {
        FAULT_BITS.iter().any(|(name, bit)| *name == cause && self.flags & bit != 0)
    }

    fn record(&mut self, payload: &[u8]) -> Option<()> {
        let mut bytes = Bytes(payload);
        let _version = bytes.number()?;
        match bytes.byte()? {
            REFUSED => self.counts[Counter::Refusals as usize] += 1,
            EDGE => self.counts[Counter::Edges as usize] += 1,
            CHANGE => {
                let _tick = bytes.number()?;
                self.status = Some(bytes.status()?);
            }
            INPUTS => self.inputs(&mut bytes)?,
            FRAME => self.frame(&mut bytes)?,
            _ => {}
        }
        Some(())
    }

    fn inputs(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let _first_tick = bytes.number()?;
        for _ in 0..bytes.number()? {
            // Codes, the reference, the periods since the call before.
            for _ in 0..bytes.number()? {
                bytes.number()?;
            }
            bytes.number()?;
            bytes.byte()?;
            let flags = bytes.number()? as u16;
            self.flags |= flags;
            self.counts[Counter::Debugger as usize] += u32::from(flags & DEBUGGER != 0);
            self.counts[Counter::Late as usize] += u32::from(flags & LATE != 0);
            if bytes.byte()? != 0 {
                bytes.number()?;
            }
            // What a host asks for: its number, the action, a value.
            if bytes.byte()? != 0 {
                bytes.number()?;
                bytes.byte()?;
                bytes.number()?;
            }
        }
        Some(())
    }

    fn frame(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let (tick, _calls) = (bytes.number()?, bytes.number()?);
        self.status = Some(bytes.status()?);
        self.frames += 1;
        for _ in 0..SENSORS {
            if bytes.byte()? != 0 {
                bytes.skip(5)?;
            }
        }
        if bytes.byte()? != 0 {
            bytes.byte()?;
            if bytes.byte()? != 0 {
                bytes.byte()?;
            }
            bytes.skip(12)?;
        }
        bytes.skip(16)?;
        for _ in 0..4 {
            bytes.number()?;
        }
        let now = Totals { tick, late: bytes.number()?, missed: bytes.number()?, overruns: bytes.number()? };
        if let Some(before) = self.totals.replace(now) {
            self.counts[Counter::Missed as usize] += now.missed.wrapping_sub(before.missed);
            self.counts[Counter::Overruns as usize] += now.overruns.wrapping_sub(before.overruns);
        }
        Some(())
    }
}

/// The payload of a frame without its zero; `None`: it is none.
fn unstuffed(frame: &[u8]) -> Option<Vec<u8>> {
    let (mut bytes, mut rest) = (Vec::with_capacity(frame.len()), frame);
    while let Some((&code, more)) = rest.split_first() {
        let group = more.get(..usize::from(code) - 1)?;
        bytes.extend(group);
        rest = &more[group.len()..];
        if code != 0xFF && !rest.is_empty() {
            bytes.push(0);
        }
    }
    let (payload, sum) = bytes.split_last_chunk::<4>()?;
    (CHECK_SUM.checksum(payload) == u32::from_le_bytes(*sum)).then(|| payload.to_vec())
}

/// What is left of a record.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(first)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.0 = self.0.get(count..)?;
        Some(())
    }

    /// A varint: seven bits a byte, the lowest first.
    fn number(&mut self) -> Option<u32> {
        let mut value = 0;
        for place in 0..5 {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7F) << (place * 7);
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    fn status(&mut self) -> Option<Status> {
        Some(Status { state: self.byte()?, cause: self.byte()? })
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = |names: &[&'static str], number: u8| names.get(usize::from(number)).copied().unwrap_or("unknown");
        write!(f, "{} ({})", name(&STATES, self.state), name(&CAUSES, self.cause))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame with the version 1 and a record.
    fn framed(record: &[u8]) -> Vec<u8> {
        let mut payload = vec![1];
        payload.extend(record);
        payload.extend(CHECK_SUM.checksum(&payload).to_le_bytes());
        let mut bytes: Vec<u8> = Vec::new();
        for group in payload.split(|byte| *byte == 0) {
            bytes.push(group.len() as u8 + 1);
            bytes.extend(group);
        }
        bytes.push(0);
        bytes
    }

    #[test]
    fn states_counters_and_flags_are_read() {
        let mut reports = Reports::default();
        reports.take(&framed(&[CHANGE, 0xE8, 0x07, 3, 0]));
        assert_eq!(reports.status, Some(Status { state: 3, cause: 0 }));
        assert_eq!(reports.status.map(|status| status.to_string()), Some("walking (none)".into()));
        // Two frames, with a sensor and without a follower: late 0, missed 1 and 3, overruns 200 and 201.
        for (missed, overruns) in [(1, [200, 1]), (3, [201, 1])] {
            let mut frame = vec![FRAME, 9, 9, 5, 18, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
            frame.extend([0; 16]);
            frame.extend([0, 0, 0, 0, 0, missed]);
            frame.extend(overruns);
            reports.take(&framed(&frame));
        }
        assert_eq!((reports.count(Counter::Missed), reports.count(Counter::Overruns)), (2, 1));
        assert_eq!((reports.status, reports.frames), (Some(Status { state: FAULT, cause: 18 }), 2));
        assert_eq!(reports.totals, Some(Totals { tick: 9, late: 0, missed: 3, overruns: 201 }));
        // A call with the fault `outputs`, and one with an attached debugger and a late start.
        let call = |flags: [u8; 2]| [1, 0x80, 0x10, 0xDC, 0x0B, 1, flags[0] | 0x80, flags[1], 0, 0];
        let calls = [&[INPUTS, 7, 2][..], &call([1 << 6, 0]), &call([2, 1 << 2])].concat();
        reports.take(&framed(&calls));
        assert!(reports.saw_fault("outputs") && !reports.saw_fault("break_input"));
        assert_eq!((reports.count(Counter::Debugger), reports.count(Counter::Late)), (1, 1));
        assert!(!reports.saw_fault("supply"));
        reports.begin();
        assert!(!reports.saw_fault("outputs") && reports.frames == 0);
    }

    #[test]
    fn a_damaged_frame_says_nothing() {
        let mut bytes = framed(&[CHANGE, 5, 3, 0]);
        bytes[3] ^= 4;
        let mut reports = Reports::default();
        reports.take(&bytes);
        reports.take(&[9, 9, 0, 0, 0]);
        assert_eq!(reports.status, None);
        reports.take(&framed(&[CHANGE, 5, 1, 0]));
        assert_eq!(reports.status.map(|status| status.state), Some(1));
    }
}
