//! The test of the emergency stop: before the first arming after a boot the loop must have seen the break input come and go.
//!
//! The contact of an emergency stop is closed while it is released, so a cut cable stops. What a cut cable does not show is a contact that is bridged
//! or stuck: a stop that does not work. So the operator presses it once and releases it. Released, pressed and released again each count after
//! [`STABLE_S`] without a change, so that neither a bounce nor a disturbance passes for a test.

use crate::error::{LoopError, ticks};
use joint_units::Period;

/// Time for which the input must be stable, s.
pub const STABLE_S: f32 = 0.02;

/// The test, in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StopTest {
    stable: u32,
}

/// How far the test is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Step {
    /// Not seen released yet.
    #[default]
    Boot,
    /// Seen released.
    Released,
    /// Seen pressed after that.
    Pressed,
    /// Seen released again.
    Done,
}

/// State of the test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StopTestState {
    step: Step,
    /// Ticks of the level that the next step needs, without another between.
    stable_for: u32,
}

impl StopTest {
    pub(crate) fn build(period: Period) -> Result<Self, LoopError> {
        Ok(Self { stable: ticks("stop_test.stable_s", STABLE_S, STABLE_S, STABLE_S, period)? })
    }

    /// Takes the break input of one tick.
    pub(crate) fn observe(self, state: &mut StopTestState, is_pressed: bool) {
        let (wanted, next) = match state.step {
            Step::Boot => (false, Step::Released),
            Step::Released => (true, Step::Pressed),
            Step::Pressed => (false, Step::Done),
            Step::Done => return,
        };
        state.stable_for = if is_pressed == wanted { state.stable_for.saturating_add(1) } else { 0 };
        if state.stable_for >= self.stable {
            *state = StopTestState { step: next, stable_for: 0 };
        }
    }
}

impl StopTestState {
    /// Whether the emergency stop was tested since the boot.
    pub(crate) fn is_done(self) -> bool {
        self.step == Step::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn after(runs: &[(bool, u32)]) -> bool {
        let test = StopTest::build(Period::MILLISECOND).expect("valid");
        let mut state = StopTestState::default();
        for &(is_pressed, ticks) in runs {
            (0..ticks).for_each(|_| test.observe(&mut state, is_pressed));
        }
        state.is_done()
    }

    #[test]
    fn it_is_done_when_the_stop_was_pressed_and_released() {
        assert!(after(&[(false, 20), (true, 20), (false, 20)]));
        assert!(after(&[(false, 1_000), (true, 5_000), (false, 20), (true, 1_000)]), "once is enough");
        for runs in [
            &[(false, 60_000)][..],
            &[(false, 20), (true, 60_000)],
            &[(false, 20), (true, 20), (false, 19)],
            &[(false, 20), (true, 19), (false, 1_000)],
            // Pressed, or cut, at the boot: it was not seen to come.
            &[(true, 1_000), (false, 1_000)],
            &[(false, 19), (true, 1_000), (false, 1_000)],
        ] {
            assert!(!after(runs), "{runs:?}");
        }
    }

    proptest! {
        #[test]
        fn disturbances_are_no_test(runs in prop::collection::vec((1_u32..20, 1_u32..500), 1..200)) {
            let runs: Vec<_> = runs.into_iter().flat_map(|(on, off)| [(true, on), (false, off)]).collect();
            prop_assert!(!after(&runs));
        }
    }
}
