//! The inputs of every call of the control loop, with which a host can run the same loop and get the same bits.

use heapless::Vec;
use joint_loop::tuning::Request;
use joint_loop::{MAX_ELAPSED, SENSORS, Sample, WatchdogHz};
use joint_units::AdcCode;
use serde::{Deserialize, Serialize};

use crate::{Flags, request};

/// Most calls in one record, and the calls between two frames.
pub const CALLS: usize = 10;

/// The inputs of successive calls of the loop, in order, without a gap between them.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Inputs {
    /// Tick of the first call: control periods since the boot, missed ones included, wrapping.
    pub first_tick: u32,
    /// The calls; a board sends 1 to [`CALLS`].
    pub calls: Vec<Call, CALLS>,
}

/// The inputs of one call of the loop.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Call {
    /// Raw codes of the sensors that the board has, from channel 1 on, 12 bits each.
    pub codes: Vec<u16, SENSORS>,
    /// Raw code of the internal voltage reference, 12 bits.
    pub reference: u16,
    /// Control periods since the call before: 1, or more where periods were missed.
    pub elapsed: u8,
    /// Button, foot switch, lateness, faults, debugger and check of the program.
    pub flags: Flags,
    /// A new measurement of the clock of the watchdog, Hz; 0: it stands still.
    pub watchdog_hz: Option<u32>,
    /// What a host asked for in this call.
    #[serde(with = "request::option")]
    pub request: Option<Request>,
}

impl Inputs {
    /// Each call with its tick.
    ///
    /// ```
    /// use wire::{Call, Inputs};
    /// let calls = [1, 1, 3].map(|elapsed| Call { elapsed, ..Call::default() }).into_iter().collect();
    /// let inputs = Inputs { first_tick: 7, calls };
    /// assert_eq!(inputs.ticks().map(|(tick, _)| tick).collect::<Vec<_>>(), [7, 8, 11]);
    /// ```
    pub fn ticks(&self) -> impl Iterator<Item = (u32, &Call)> {
        let mut tick = self.first_tick;
        self.calls.iter().enumerate().map(move |(place, call)| {
            if place > 0 {
                tick = tick.wrapping_add(call.elapsed.into());
            }
            (tick, call)
        })
    }
}

impl Call {
    /// The inputs in a sample, whose first `sensors` codes are those of sensors (at most [`SENSORS`]).
    #[must_use]
    pub fn of(sample: &Sample<SENSORS>, sensors: usize) -> Self {
        let mut codes = Vec::new();
        for code in sample.codes.iter().take(sensors) {
            // One place for each channel.
            let _ = codes.push(code.0);
        }
        Self {
            codes,
            reference: sample.vrefint.0,
            elapsed: sample.elapsed.min(MAX_ELAPSED) as u8,
            flags: Flags::of(sample),
            watchdog_hz: sample.watchdog_clock.map(|WatchdogHz(hz)| hz),
            request: sample.request,
        }
    }

    /// The sample for [`joint_loop::JointLoop::tick`]. The code of a channel without a sensor is 0; the loop does not read it.
    #[must_use]
    pub fn sample(&self) -> Sample<SENSORS> {
        let mut codes = [AdcCode(0); SENSORS];
        for (code, sent) in codes.iter_mut().zip(&self.codes) {
            *code = AdcCode(*sent);
        }
        Sample {
            elapsed: self.elapsed.into(),
            codes,
            vrefint: AdcCode(self.reference),
            button: self.flags.button(),
            foot: self.flags.foot(),
            late: self.flags.late(),
            faults: self.flags.faults(),
            watchdog_clock: self.watchdog_hz.map(WatchdogHz),
            debugger: self.flags.debugger(),
            program_unproven: self.flags.program_unproven(),
            request: self.request,
        }
    }
}
