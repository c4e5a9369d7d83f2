//! When the servos begin to be driven, seen at the pins: a pulse while their supply is on.

use crate::pulses::{OutputChange, PulsePeriod, TimedOutputChange};

/// The times at which the servos began to be driven.
#[derive(Debug, Clone, Default)]
pub(crate) struct Driving {
    is_driving: bool,
    began: Vec<f64>,
}

impl Driving {
    /// The servos are driven now, or not.
    pub(crate) const fn new(is_driving: bool) -> Self {
        Driving { is_driving, began: Vec::new() }
    }

    /// The times so far, s.
    pub(crate) fn began(&self) -> &[f64] {
        &self.began
    }

    /// Takes a change of the outputs.
    pub(crate) fn change(&mut self, change: &TimedOutputChange) {
        if matches!(change.change, OutputChange::Rail(false) | OutputChange::Armed(false)) {
            self.is_driving = false;
        }
    }

    /// Takes the pulses of a servo frame.
    pub(crate) fn take(&mut self, period: &PulsePeriod) {
        if period.rail && period.us.iter().any(Option::is_some) && !std::mem::replace(&mut self.is_driving, true) {
            self.began.push(period.seconds);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_beginning_counts_once() {
        let period = |seconds, rail| PulsePeriod {
            seconds,
            us: [Some(1500.0), None, None, None],
            programmed_us: [None; 4],
            rail,
        };
        let change = |seconds, change| TimedOutputChange { seconds, instructions: 0, change };
        let mut driving = Driving::new(true);
        driving.take(&period(0.0, true));
        assert!(driving.began().is_empty());
        driving.change(&change(0.01, OutputChange::Rail(false)));
        driving.take(&period(0.02, false));
        assert!(driving.began().is_empty(), "a servo without supply is not driven");
        for seconds in [0.04, 0.06] {
            driving.take(&period(seconds, true));
        }
        driving.change(&change(0.07, OutputChange::Armed(false)));
        driving.take(&period(0.08, true));
        assert_eq!(driving.began(), [0.04, 0.08]);
    }
}
