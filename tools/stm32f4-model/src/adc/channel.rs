//! ADC channels, their pins, and conversion results.

use core::fmt;

use crate::pin::Pin;

/// A channel of one of the three converters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AdcChannel {
    /// Converter, 1 to 3.
    pub adc: u8,
    /// Channel, 0 to 18. On ADC1 16 is the temperature sensor, 17 VREFINT, 18 a part of VBAT; on the F411 18 is the
    /// temperature sensor too.
    pub channel: u8,
}

impl AdcChannel {
    /// Pin of a channel (data sheet, table 7); `None`: an internal channel, or one without a pin.
    ///
    /// ```
    /// use stm32f4_model::AdcChannel;
    /// let pin = |adc, channel| AdcChannel { adc, channel }.pin().map(|pin| pin.to_string());
    /// assert_eq!(pin(1, 1).as_deref(), Some("PA1"));
    /// assert_eq!(pin(2, 8).as_deref(), Some("PB0"));
    /// assert_eq!(pin(3, 4).as_deref(), Some("PF6"));
    /// assert_eq!(pin(1, 17), None);
    /// ```
    #[must_use]
    pub fn pin(self) -> Option<Pin> {
        let channel = self.channel;
        match (self.adc, channel) {
            (1..=3, 0..=3) => Pin::new('A', channel),
            (1..=2, 4..=7) => Pin::new('A', channel),
            (1..=2, 8..=9) => Pin::new('B', channel - 8),
            (1..=3, 10..=13) => Pin::new('C', channel - 10),
            (1..=2, 14..=15) => Pin::new('C', channel - 10),
            (3, 4..=8) => Pin::new('F', channel + 2),
            (3, 9) => Pin::new('F', 3),
            (3, 14..=15) => Pin::new('F', channel - 10),
            _ => None,
        }
    }
}

/// For example `ADC1_IN1`.
impl fmt::Display for AdcChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ADC{}_IN{}", self.adc, self.channel)
    }
}

/// One conversion result. A result that is lost in an overrun is not recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conversion {
    /// HCLK cycle of the end of the conversion.
    pub cycle: u64,
    /// Converter and channel.
    pub channel: AdcChannel,
    /// True for the injected group, false for the regular one.
    pub injected: bool,
    /// The code before alignment and offset: 0 to 4095 at 12 bits.
    pub code: u16,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adc3_has_pins_on_port_f() {
        // Data sheet, table 7, for packages with port F.
        let pins = [(4, 6), (5, 7), (6, 8), (7, 9), (8, 10), (9, 3), (14, 4), (15, 5)];
        for (channel, number) in pins {
            assert_eq!(AdcChannel { adc: 3, channel }.pin(), Pin::new('F', number));
        }
        assert_eq!(AdcChannel { adc: 3, channel: 16 }.pin(), None);
    }
}
