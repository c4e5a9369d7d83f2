//! Interfaces to the surroundings of the modelled peripherals: signals at the pins ([`Plant`]) and memory for DMA ([`DmaMemory`]).
//!
//! Times are seconds since power-on; clock changes and resets do not set them back.

use crate::adc::AdcChannel;
use crate::bus::Width;
use crate::pin::Pin;

/// Signals at the pins: supplies the inputs, receives the outputs.
pub trait Plant {
    /// Returns the voltage at the pin of an ADC channel, V. Called for the end of the channel's sampling time.
    ///
    /// Called only for channels that have a pin; the internal ones come from [`crate::SocConfig`].
    fn volts(&mut self, channel: AdcChannel, seconds: f64) -> f64;

    /// Returns the level that the surroundings drive on a pin. Called for all 144 pins at each input sample, so keep it fast.
    fn input_level(&mut self, pin: Pin, seconds: f64) -> bool;

    /// Returns true while nothing drives a pin, as at an open contact: its level is then that of the chip's pull-up, low without one. Called with
    /// [`Plant::input_level`].
    fn input_floats(&mut self, pin: Pin, seconds: f64) -> bool {
        let _ = (pin, seconds);
        false
    }

    /// Receives a level change of a pin that the chip drives (general purpose output or timer output).
    ///
    /// Calls come in the order of time. A pin that the chip stops driving counts as low, unless its pull-up is on.
    fn record_edge(&mut self, pin: Pin, level: bool, seconds: f64);

    /// Returns the first time, later than `seconds`, at which [`Plant::input_level`] may change. `seconds` is the time of the last input
    /// sample.
    ///
    /// - `None`: not known. Inputs are then sampled at the end of every advance, which is slower, and the time of a change is only known
    ///   to within one advance.
    /// - `Some(f64::INFINITY)`: no change is scheduled.
    /// - A time that is not later than `seconds`: an input has changed since then; the chip samples at once. For inputs of a live user.
    fn next_pin_change(&self, seconds: f64) -> Option<f64> {
        let _ = seconds;
        None
    }

    /// Returns the analogue supply VDDA, which is also the ADC's reference VREF+, V; `None`: use the constant of [`crate::SocConfig`].
    fn vdda(&mut self, seconds: f64) -> Option<f64> {
        let _ = seconds;
        None
    }
}

/// Memory that DMA accesses: SRAM, and flash for reading.
pub trait DmaMemory {
    /// Reads an address; `None` where there is no memory: the stream then stops with a transfer error.
    fn read(&mut self, addr: u32, width: Width) -> Option<u32>;

    /// Writes an address; `false` where there is no writable memory: the stream then stops with a transfer error.
    fn write(&mut self, addr: u32, width: Width, value: u32) -> bool;
}

/// A [`DmaMemory`] without memory: every transfer fails.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NoMemory;

impl DmaMemory for NoMemory {
    fn read(&mut self, _addr: u32, _width: Width) -> Option<u32> {
        None
    }

    fn write(&mut self, _addr: u32, _width: Width, _value: u32) -> bool {
        false
    }
}
