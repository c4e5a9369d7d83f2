//! What lies outside of the chip: voltages and levels at its pins ([`Plant`]), and the memory that DMA reaches ([`DmaMemory`]).
//!
//! Times are seconds since power-on, as `f64`, through all clock changes and resets.

use crate::adc::AdcChannel;
use crate::bus::Width;
use crate::pin::Pin;

/// The world at the pins.
pub trait Plant {
    /// Voltage at the pin of an ADC channel at a time, V. Asked at the end of the channel's sampling time.
    ///
    /// Only asked for channels that have a pin; the internal ones come from [`crate::SocConfig`].
    fn volts(&mut self, channel: AdcChannel, seconds: f64) -> f64;

    /// Level of a pin that the chip does not drive, at a time. Asked for every pin of the package, so answer quickly.
    fn pin(&mut self, pin: Pin, seconds: f64) -> bool;

    /// A pin that the chip drives (general purpose output or timer output) has changed its level at a time.
    ///
    /// Calls come in the order of time. A pin that the chip lets go of counts as low, unless its pull-up is on.
    fn edge(&mut self, pin: Pin, level: bool, seconds: f64);

    /// The first time, later than `seconds`, at which [`Plant::pin`] may answer otherwise than at `seconds`, which is the time of the
    /// last look at the pins.
    ///
    /// - `None`: not known. Levels are then asked for at the end of every advance, which is slower, and a change is seen no more
    ///   exactly than the advances are apart.
    /// - `Some(f64::INFINITY)`: no change is scheduled.
    /// - A time that is not later than `seconds`: something has changed since, look now. So a live input can be announced.
    fn next_pin_change(&self, seconds: f64) -> Option<f64> {
        let _ = seconds;
        None
    }

    /// Analogue supply VDDA (here the ADC's reference VREF+ too) at a time, V; `None`: the constant of [`crate::SocConfig`].
    fn vdda(&mut self, seconds: f64) -> Option<f64> {
        let _ = seconds;
        None
    }
}

/// The memory on the other end of a DMA transfer: SRAM, and flash to read.
pub trait DmaMemory {
    /// The value at an address; `None` where there is no memory: the stream then stops with a transfer error.
    fn read(&mut self, addr: u32, width: Width) -> Option<u32>;

    /// Stores a value at an address; `false` where there is no memory that can be written.
    fn write(&mut self, addr: u32, width: Width, value: u32) -> bool;
}

/// No memory at all: every transfer is a transfer error.
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
