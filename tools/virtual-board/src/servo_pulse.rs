//! One pulse at a servo pin, and for how long of it the servo had its supply.

/// Two edges within this time are one event, such as a reset, s.
const AT_ONCE_S: f64 = 1e-7;

/// A pulse at a servo pin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ServoPulse {
    /// Place of the pin among the servo pins.
    pub(crate) servo: usize,
    /// Rising edge, s.
    pub(crate) from: f64,
    /// Falling edge, or the present time for a pulse that has not ended, s.
    pub(crate) to: f64,
    /// Compare value of the timer at its start, us; `None`: the timer did not start it.
    pub(crate) programmed_us: Option<f64>,
    /// The servos' supply in it.
    pub(crate) supply: PulseSupply,
    /// For how long the servo had a supply that came, or came back, while the line was high, s.
    pub(crate) returned_s: f64,
}

/// A supply that comes while a line is high.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Returned {
    since: Option<f64>,
    before_s: f64,
}

impl Returned {
    /// Takes the beginning of the supply.
    pub(crate) const fn begin(&mut self, seconds: f64) {
        self.since = Some(seconds);
    }

    /// Takes the end of the supply.
    pub(crate) fn end(&mut self, seconds: f64) {
        self.before_s = self.until(seconds);
        self.since = None;
    }

    /// For how long it was there up to this time, s.
    pub(crate) fn until(&self, seconds: f64) -> f64 {
        self.before_s + self.since.map_or(0.0, |since| seconds - since)
    }
}

/// The servos' supply in a pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PulseSupply {
    /// On from the rising to the falling edge.
    Whole,
    /// On at the rising edge, and switched off at this time, s.
    Until(f64),
    /// Off at the rising edge: a servo takes nothing from such a pulse.
    Absent,
}

impl PulseSupply {
    /// At the rising edge of a pulse.
    pub(crate) const fn begin(is_on: bool) -> Self {
        if is_on { PulseSupply::Whole } else { PulseSupply::Absent }
    }

    /// Takes the end of the supply.
    pub(crate) const fn end(&mut self, seconds: f64) {
        if let PulseSupply::Whole = self {
            *self = PulseSupply::Until(seconds);
        }
    }
}

impl ServoPulse {
    /// Width, us.
    pub(crate) fn us(&self) -> f64 {
        (self.to - self.from) * 1e6
    }

    /// For how long the line was high while the servo had its supply, s.
    pub(crate) fn supplied_s(&self) -> f64 {
        let first = match self.supply {
            PulseSupply::Absent => 0.0,
            PulseSupply::Whole | PulseSupply::Until(_) => self.lost_supply().unwrap_or(self.to) - self.from,
        };
        first + self.returned_s
    }

    /// The time at which the supply went while the pulse lasted, s. `None`: it lasted to the falling edge, or the pulse began without it.
    pub(crate) fn lost_supply(&self) -> Option<f64> {
        match self.supply {
            PulseSupply::Until(end) if self.to - end > AT_ONCE_S => Some(end),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_supply_of_a_pulse_is_lost_once_and_before_its_end() {
        let pulse = |is_on, ends: &[f64]| {
            let mut supply = PulseSupply::begin(is_on);
            ends.iter().for_each(|end| supply.end(*end));
            ServoPulse { servo: 0, from: 1.0, to: 1.0015, programmed_us: None, supply, returned_s: 0.0 }
        };
        assert!((pulse(true, &[]).us() - 1500.0).abs() < 1e-6);
        assert_eq!(pulse(true, &[]).lost_supply(), None);
        assert_eq!(pulse(true, &[1.001, 1.0012]).lost_supply(), Some(1.001));
        assert_eq!(pulse(true, &[1.0015]).lost_supply(), None, "with the pulse");
        assert_eq!(pulse(false, &[1.001]).lost_supply(), None);
        assert_eq!(pulse(false, &[1.001]).supply, PulseSupply::Absent);
        let supplied_us = |pulse: ServoPulse| (pulse.supplied_s() * 1e6).round();
        assert_eq!(supplied_us(pulse(true, &[])), 1500.0);
        assert_eq!(supplied_us(pulse(true, &[1.001])), 1000.0);
        assert_eq!(supplied_us(pulse(false, &[])), 0.0);
        assert_eq!(supplied_us(ServoPulse { returned_s: 3e-4, ..pulse(true, &[1.001]) }), 1300.0);
        assert_eq!(supplied_us(ServoPulse { returned_s: 3e-4, ..pulse(false, &[]) }), 300.0);
    }
}
