//! Gestures of the button: debounces its level and tells a deliberate hold from other presses.
//!
//! | event | when | for |
//! |---|---|---|
//! | press | the debounced edge | stops a motion, at once |
//! | hold | the release after a hold of `hold_least_s` to `hold_most_s` | arms, begins a trim, or acknowledges a fault |
//! | too short | the release after a shorter hold | refused |
//! | too long | the release after a longer press | refused |
//! | too many | the release of a press while presses are refused | refused |
//!
//! The hold is the longest time without one released reading: a contact that chatters is released again and again, so it makes no hold.
//! [`PRESSES`] presses within `within_s`, of any length, are no deliberate operation: that press and those of the next `refused_s` are refused,
//! and each of them that is again one of [`PRESSES`] within `within_s` begins that time again. They still stop a motion.
//!
//! [`Press::spend`] uses a press up: its release is then no event. The loop does so when its state changes, so that the press that stopped
//! a motion does not arm at its release, and no hold acts on a state that began after it.

use crate::error::{LoopError, inside, ticks};
use joint_units::Period;

/// So many presses within [`ButtonConfig::within_s`] are refused.
pub const PRESSES: usize = 3;

/// Times of the button.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ButtonConfig {
    /// Time for which the level must be stable to be accepted, s; 0.005 to 0.2, default 0.02.
    pub debounce_s: f32,
    /// Shortest hold that arms, s; 0.1 to 5, default 0.3.
    pub hold_least_s: f32,
    /// Longest hold that arms, s; `hold_least_s` to 10, default 1.5.
    pub hold_most_s: f32,
    /// Time within which [`PRESSES`] presses are too many, s; 0.1 to 60, default 5.
    pub within_s: f32,
    /// Time for which presses are then refused, s; 0.1 to 60, default 5.
    pub refused_s: f32,
}

impl ButtonConfig {
    /// 20 ms of debounce, longer than a tactile switch bounces; a hold of 0.3 s, longer than a touch by accident, to 1.5 s, shorter than that of
    /// a button that is jammed or leaned on; three presses in 5 s are refused for 5 s.
    pub const DEFAULT: Self =
        Self { debounce_s: 0.02, hold_least_s: 0.3, hold_most_s: 1.5, within_s: 5.0, refused_s: 5.0 };

    /// Checks the fields and converts times to ticks.
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed.
    pub fn build(&self, period: Period) -> Result<Button, LoopError> {
        let hold_least_s = inside("button.hold_least_s", None, self.hold_least_s, 0.1, 5.0, "s")?;
        Ok(Button {
            stable: ticks("button.debounce_s", self.debounce_s, 0.005, 0.2, period)?,
            hold_least: ticks("button.hold_least_s", hold_least_s, 0.1, 5.0, period)?,
            hold_most: ticks("button.hold_most_s", self.hold_most_s, hold_least_s, 10.0, period)?,
            within: ticks("button.within_s", self.within_s, 0.1, 60.0, period)?,
            refused: ticks("button.refused_s", self.refused_s, 0.1, 60.0, period)?,
        })
    }
}

/// A checked [`ButtonConfig`], in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Button {
    stable: u32,
    hold_least: u32,
    hold_most: u32,
    within: u32,
    refused: u32,
}

/// What the button did in one tick. Not `non_exhaustive`: the supervisor has to answer each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ButtonEvent {
    /// Nothing that acts.
    None,
    /// The button was pressed: a debounced edge.
    Press,
    /// It was released after a deliberate hold.
    Hold,
    /// It was released too soon.
    TooShort,
    /// It was released too late.
    TooLong,
    /// It was released, and was pressed too often before.
    TooMany,
    /// It was released, and the emergency stop was pressed meanwhile.
    Stopped,
}

/// State of the button: the accepted level, and the present press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Press {
    held: bool,
    /// Readings that differ from the accepted level, without one between that does not.
    differs_for: u32,
    /// Periods since the press.
    lasts: u32,
    /// Pressed readings without a released one: the present ones, and the most in this press.
    steady: u32,
    steadiest: u32,
    /// The release of this press is no event.
    spent: bool,
    /// This press is refused.
    refused: bool,
    /// The emergency stop was pressed during this press.
    stopped: bool,
    /// Periods since the last presses, the latest first.
    since: [u32; PRESSES - 1],
    /// Periods for which presses are still refused.
    refused_for: u32,
}

impl Default for Press {
    /// Held and spent, so that a button that is pressed (or wired inverted) at boot gives no event before it is pressed again.
    fn default() -> Self {
        Self {
            held: true,
            differs_for: 0,
            lasts: 0,
            steady: 0,
            steadiest: 0,
            spent: true,
            refused: false,
            stopped: false,
            since: [u32::MAX; PRESSES - 1],
            refused_for: 0,
        }
    }
}

impl Press {
    /// Uses the present press up: its release is no event.
    pub fn spend(&mut self) {
        self.spent = true;
    }

    /// The emergency stop is pressed: a hold that goes on meanwhile is none that arms.
    pub fn stop(&mut self) {
        self.stopped = true;
    }

    /// Takes the periods since the last tick.
    fn pass(&mut self, elapsed: u32) {
        for periods in &mut self.since {
            *periods = periods.saturating_add(elapsed);
        }
        self.lasts = self.lasts.saturating_add(elapsed);
        self.refused_for = self.refused_for.saturating_sub(elapsed);
    }
}

impl Button {
    /// Takes the raw level of one tick, `elapsed` periods after the last one; returns what it comes to.
    pub fn sample(&self, press: &mut Press, raw: bool, elapsed: u32) -> ButtonEvent {
        press.pass(elapsed);
        // A missed period has no reading: it is no part of a hold.
        press.steady = if raw { press.steady.saturating_add(1) } else { 0 };
        press.steadiest = press.steadiest.max(press.steady);
        if raw == press.held {
            press.differs_for = 0;
            return ButtonEvent::None;
        }
        press.differs_for = press.differs_for.saturating_add(1);
        if press.differs_for < self.stable {
            return ButtonEvent::None;
        }
        (press.held, press.differs_for) = (raw, 0);
        if raw { self.pressed(press) } else { self.released(press) }
    }

    fn pressed(&self, press: &mut Press) -> ButtonEvent {
        if press.since.iter().all(|&periods| periods <= self.within) {
            press.refused_for = self.refused;
        }
        press.since.rotate_right(1);
        if let Some(latest) = press.since.first_mut() {
            *latest = 0;
        }
        press.refused = press.refused_for > 0;
        (press.lasts, press.steadiest, press.spent, press.stopped) = (0, press.steady, false, false);
        ButtonEvent::Press
    }

    fn released(&self, press: &mut Press) -> ButtonEvent {
        match press {
            Press { spent: true, .. } => ButtonEvent::None,
            Press { refused: true, .. } => ButtonEvent::TooMany,
            Press { stopped: true, .. } => ButtonEvent::Stopped,
            Press { lasts, .. } if *lasts > self.hold_most => ButtonEvent::TooLong,
            Press { steadiest, .. } if *steadiest < self.hold_least => ButtonEvent::TooShort,
            _ => ButtonEvent::Hold,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn button() -> Button {
        ButtonConfig::DEFAULT.build(Period::MILLISECOND).expect("valid")
    }

    /// The events of so many ticks, each with its tick, counted from 1.
    fn events(press: &mut Press, level: bool, ticks: u32) -> Vec<(u32, ButtonEvent)> {
        let all = (1..=ticks).map(|tick| (tick, button().sample(press, level, 1)));
        all.filter(|(_, event)| *event != ButtonEvent::None).collect()
    }

    /// A button that was released for long.
    fn released() -> Press {
        let mut press = Press::default();
        assert_eq!(events(&mut press, false, 10_000), []);
        press
    }

    /// The event at the release after a hold of so many ticks.
    fn after_hold(press: &mut Press, ticks: u32) -> ButtonEvent {
        assert_eq!(events(press, true, ticks), [(20, ButtonEvent::Press)]);
        let all = events(press, false, 20);
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].0, 20);
        all[0].1
    }

    #[test]
    fn a_press_is_one_edge_after_exactly_the_stable_time() {
        let mut press = released();
        assert_eq!(events(&mut press, true, 19), []);
        assert_eq!(events(&mut press, true, 1), [(1, ButtonEvent::Press)]);
        assert_eq!(events(&mut press, true, 100_000), []);
    }

    #[test]
    fn the_length_of_a_hold_decides() {
        for (ticks, want) in [
            (20, ButtonEvent::TooShort),
            (299, ButtonEvent::TooShort),
            (300, ButtonEvent::Hold),
            (1_500, ButtonEvent::Hold),
            (1_501, ButtonEvent::TooLong),
            (100_000, ButtonEvent::TooLong),
        ] {
            let mut press = released();
            assert_eq!(after_hold(&mut press, ticks), want, "{ticks}");
            assert_eq!(events(&mut press, false, 100_000), [], "nothing follows the release");
        }
    }

    #[test]
    fn a_hold_in_which_the_emergency_stop_was_pressed_is_none() {
        let mut press = released();
        for stopped_after in [20, 200, 399] {
            events(&mut press, false, 10_000);
            events(&mut press, true, stopped_after);
            press.stop();
            events(&mut press, true, 400 - stopped_after);
            assert_eq!(events(&mut press, false, 20), [(20, ButtonEvent::Stopped)]);
        }
        // Also while the release is not accepted yet; not before the press.
        events(&mut press, false, 10_000);
        events(&mut press, true, 400);
        events(&mut press, false, 19);
        press.stop();
        assert_eq!(events(&mut press, false, 1), [(1, ButtonEvent::Stopped)]);
        events(&mut press, false, 10_000);
        press.stop();
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::Hold);
    }

    #[test]
    fn a_button_held_at_boot_is_no_press() {
        let mut press = Press::default();
        assert_eq!(events(&mut press, true, 500), []);
        assert_eq!(events(&mut press, false, 5_000), []);
        assert_eq!(after_hold(&mut press, 500), ButtonEvent::Hold);
    }

    #[test]
    fn the_release_of_a_spent_press_is_no_event_and_the_next_press_is_one() {
        let mut press = released();
        events(&mut press, true, 400);
        press.spend();
        assert_eq!(events(&mut press, false, 1_000), []);
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::Hold);
    }

    #[test]
    fn the_third_press_within_5_s_and_those_of_the_next_5_s_are_refused() {
        let mut press = released();
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::Hold);
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::Hold);
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::TooMany);
        // The last press was 420 ticks ago. One that comes 4.9 s after it is refused, and does not begin the time again: the press before the
        // last is more than 5 s ago.
        events(&mut press, false, 4_900 - 420);
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::TooMany);
        assert_eq!(after_hold(&mut press, 400), ButtonEvent::Hold);
        // Presses 2.6 s apart are not too many.
        events(&mut press, false, 5_000);
        for _ in 0..20 {
            assert_eq!(after_hold(&mut press, 400), ButtonEvent::Hold);
            events(&mut press, false, 2_600 - 420);
        }
    }

    /// The hold starts again at each released reading; time that was missed counts for the length of the press only.
    #[test]
    fn a_hold_is_without_interruption() {
        for (first, second, want) in [
            (299, 299, ButtonEvent::TooShort),
            (300, 20, ButtonEvent::Hold),
            (20, 300, ButtonEvent::Hold),
            (1_000, 499, ButtonEvent::Hold),
            (1_000, 500, ButtonEvent::TooLong),
        ] {
            let mut press = released();
            events(&mut press, true, first);
            assert_eq!(events(&mut press, false, 1), []);
            events(&mut press, true, second);
            assert_eq!(events(&mut press, false, 20), [(20, want)], "{first} and {second}");
        }
        let mut press = released();
        events(&mut press, true, 200);
        button().sample(&mut press, true, 150);
        assert_eq!(events(&mut press, false, 20), [(20, ButtonEvent::TooShort)]);
    }

    #[test]
    fn an_error_names_the_field() {
        let refused = |config: ButtonConfig| config.build(Period::MILLISECOND).expect_err("refused").to_string();
        let default = ButtonConfig::DEFAULT;
        for (config, words) in [
            (ButtonConfig { debounce_s: 0.0, ..default }, "button.debounce_s is 0 s; allowed are 0.005 to 0.2 s"),
            (ButtonConfig { hold_least_s: 0.05, ..default }, "button.hold_least_s is 0.05 s; allowed are 0.1 to 5 s"),
            (ButtonConfig { hold_most_s: 0.2, ..default }, "button.hold_most_s is 0.2 s; allowed are 0.3 to 10 s"),
            (ButtonConfig { within_s: 0.0, ..default }, "button.within_s is 0 s; allowed are 0.1 to 60 s"),
            (ButtonConfig { refused_s: f32::NAN, ..default }, "button.refused_s is not a finite number"),
        ] {
            assert_eq!(refused(config), words);
        }
    }

    proptest! {
        #[test]
        fn bounce_shorter_than_the_stable_time_gives_no_event(runs in prop::collection::vec(1_u32..20, 1..200)) {
            let mut press = released();
            let mut level = true;
            for run in runs {
                prop_assert_eq!(events(&mut press, level, run), []);
                level = !level;
            }
        }

        #[test]
        fn every_press_is_one_edge(runs in prop::collection::vec(20_u32..60, 1..100)) {
            let mut press = released();
            let mut level = true;
            for run in runs {
                let presses = events(&mut press, level, run).iter().filter(|(_, event)| *event == ButtonEvent::Press).count();
                prop_assert_eq!(presses, usize::from(level));
                level = !level;
            }
        }

        /// A contact that is never closed for 0.3 s makes no hold, whatever it does.
        #[test]
        fn chatter_makes_no_hold(runs in prop::collection::vec((1_u32..300, 1_u32..300), 1..200)) {
            let mut press = released();
            for (closed, open) in runs {
                let all = [events(&mut press, true, closed), events(&mut press, false, open)].concat();
                prop_assert!(all.iter().all(|(_, event)| *event != ButtonEvent::Hold), "{:?}", all);
            }
        }
    }
}
