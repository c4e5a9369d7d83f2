//! The default loop, fed with the default recording, tick by tick on the host.

use crate::degraded::{Degraded, Stream};
use crate::recordings::default_volts;
use footfall::board::default_loop::{BoardLoop, typical_loop, typical_sensor};
use gait_trace::Recording;
use hgod_adc::{Reference, Supply};
use joint_loop::{BoardFaults, Command, Frame, SENSORS, Sample, WatchdogHz};
use joint_units::{AdcCode, Volts};

/// A leg with a sensor, a converter and the loop.
pub struct HostLoop {
    volts: Recording,
    reference: Reference,
    supply: Supply,
    stream: Stream,
    tick: u32,
    /// The loop.
    pub joints: BoardLoop,
}

/// What one tick was given and gave.
#[derive(Debug, Clone, Copy)]
pub struct Ticked {
    /// What it was given.
    pub sample: Sample<SENSORS>,
    /// The command to the servos.
    pub command: Command,
    /// Inputs and outputs of the tick.
    pub frame: Frame<SENSORS>,
}

impl HostLoop {
    /// A leg that walks as the default recording, without end, with a sensor in that condition.
    ///
    /// # Panics
    /// The default loop cannot be built.
    #[must_use]
    pub fn new(condition: Degraded) -> Self {
        let sensor = typical_sensor().expect("the default sensor");
        Self {
            volts: default_volts(),
            reference: *sensor.reference(),
            supply: Supply::new(Volts(3.0)).expect("3 V"),
            stream: Stream::new(condition),
            tick: 0,
            joints: typical_loop().expect("the default loop"),
        }
    }

    /// The code that a sound sensor gives at a tick.
    ///
    /// # Panics
    /// Never, as the volts have a channel.
    #[must_use]
    pub fn code(&self, tick: u32) -> AdcCode {
        let channel = &self.volts.channels()[0];
        let time = (f64::from(tick) * 1e-3) % self.volts.duration_s();
        self.reference.code(Volts(self.volts.at(channel, time) as f32), self.supply)
    }

    /// One tick.
    pub fn tick(&mut self, button: bool) -> Ticked {
        self.tick_after(1, button)
    }

    /// One call after so many periods.
    pub fn tick_after(&mut self, elapsed: u32, button: bool) -> Ticked {
        self.tick += elapsed;
        let code = self.stream.code(self.code(self.tick));
        let vrefint = self.reference.vrefint(self.supply);
        // After the boot the emergency stop is tested.
        let is_test = (25..50).contains(&self.tick);
        let faults = if is_test { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE };
        let watchdog_clock = Some(WatchdogHz(32_000));
        let sample =
            Sample { elapsed, codes: [code; SENSORS], vrefint, button, faults, watchdog_clock, ..Sample::default() };
        let command = self.joints.tick(&sample);
        Ticked { sample, command, frame: self.joints.frame() }
    }

    /// So many ticks with the button held or not.
    pub fn ticks(&mut self, ticks: u32, button: bool) -> Vec<Ticked> {
        (0..ticks).map(|_| self.tick(button)).collect()
    }

    /// Boots, holds the button so long that it arms, and walks for so many ticks more.
    pub fn arm_and_walk(&mut self, ticks: u32) -> Vec<Ticked> {
        let mut all = self.ticks(50, false);
        all.extend(self.ticks(350, true));
        all.extend(self.ticks(ticks, false));
        all
    }
}
