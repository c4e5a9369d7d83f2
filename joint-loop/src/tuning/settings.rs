//! A value for every parameter.

use crate::tuning::parameter::{GAITS, Parameter};
use crate::tuning::request::Outcome;
use cpg_core::gait::named::Gait;

/// A value for every parameter, each inside its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings([i32; Parameter::COUNT]);

impl Default for Settings {
    /// The default of every parameter: the loop as its records configure it.
    fn default() -> Self {
        Self(Parameter::ALL.map(|parameter| parameter.range()[2]))
    }
}

impl Settings {
    /// Value of a parameter, thousandths of its unit.
    #[must_use]
    pub fn thousandths(&self, parameter: Parameter) -> i32 {
        // Every place is in the array.
        self.0.get(parameter.place()).copied().unwrap_or(parameter.range()[2])
    }

    /// These settings with another value of one parameter.
    ///
    /// ```
    /// use joint_loop::tuning::{Outcome, Parameter, Settings};
    /// let set = |thousandths| Settings::default().with(Parameter::Speed, thousandths);
    /// assert_eq!(set(1_250).map(|settings| settings.value(Parameter::Speed)), Ok(1.25));
    /// assert_eq!(set(1_501), Err(Outcome::OutOfRange));
    /// ```
    ///
    /// # Errors
    /// [`Outcome::OutOfRange`]: the parameter does not allow the value.
    pub fn with(mut self, parameter: Parameter, thousandths: i32) -> Result<Self, Outcome> {
        match self.0.get_mut(parameter.place()).filter(|_| parameter.allows(thousandths)) {
            Some(place) => *place = thousandths,
            None => return Err(Outcome::OutOfRange),
        }
        Ok(self)
    }

    /// Value of a parameter in its unit.
    #[must_use]
    pub fn value(&self, parameter: Parameter) -> f32 {
        self.thousandths(parameter) as f32 / 1000.0
    }

    /// The gait; `None` is the board's own generator.
    #[must_use]
    pub fn gait(&self) -> Option<Gait> {
        let place = usize::try_from(self.thousandths(Parameter::Gait) / 1000).ok()?;
        GAITS.get(place.checked_sub(1)?).copied()
    }

    /// Whether a follower gets its sensor.
    #[must_use]
    pub fn follow(&self) -> bool {
        self.thousandths(Parameter::Follow) != 0
    }

    /// Ticks from one frame on the serial port to the next.
    #[must_use]
    pub fn ticks_a_record(&self) -> u32 {
        let rate = u32::try_from(self.thousandths(Parameter::RecordRate) / 1000).unwrap_or(1).max(1);
        1000_u32.div_ceil(rate)
    }
}
