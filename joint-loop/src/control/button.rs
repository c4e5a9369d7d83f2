//! Debouncing of the button: turns raw levels into one edge for each press.

/// Configuration: number of equal consecutive levels that are accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Button {
    stable_ticks: u32,
}

/// State: the accepted level, and for how many ticks the raw level has differed from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Press {
    held: bool,
    differs_for: u32,
}

impl Default for Press {
    /// Held, so that a button that is pressed (or wired inverted) at boot gives no edge before it is released.
    fn default() -> Self {
        Self { held: true, differs_for: 0 }
    }
}

impl Button {
    /// Accepts a level after `stable_ticks` equal readings in a row (0 is taken as 1).
    #[must_use]
    pub const fn new(stable_ticks: u32) -> Self {
        Self { stable_ticks: if stable_ticks == 0 { 1 } else { stable_ticks } }
    }

    /// Takes one raw level; returns true in the tick in which a press is accepted.
    pub fn sample(&self, press: &mut Press, raw: bool) -> bool {
        if raw == press.held {
            press.differs_for = 0;
            return false;
        }
        press.differs_for = press.differs_for.saturating_add(1);
        if press.differs_for < self.stable_ticks {
            return false;
        }
        *press = Press { held: raw, differs_for: 0 };
        raw
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn edges(button: Button, press: &mut Press, level: bool, ticks: u32) -> u32 {
        (0..ticks).map(|_| u32::from(button.sample(press, level))).sum()
    }

    #[test]
    fn one_edge_after_exactly_the_stable_time() {
        let (button, mut press) = (Button::new(20), Press::default());
        assert_eq!(edges(button, &mut press, false, 20), 0);
        assert_eq!(edges(button, &mut press, true, 19), 0);
        assert_eq!(edges(button, &mut press, true, 1), 1);
        assert_eq!(edges(button, &mut press, true, 10_000), 0);
    }

    #[test]
    fn a_button_held_at_boot_is_no_press() {
        let (button, mut press) = (Button::new(20), Press::default());
        assert_eq!(edges(button, &mut press, true, 10_000), 0);
        assert_eq!(edges(button, &mut press, false, 20), 0);
        assert_eq!(edges(button, &mut press, true, 20), 1);
    }

    proptest! {
        #[test]
        fn bounce_shorter_than_the_stable_time_gives_no_edge(runs in prop::collection::vec(1_u32..20, 1..200)) {
            let (button, mut press) = (Button::new(20), Press::default());
            edges(button, &mut press, false, 20);
            let mut level = true;
            for run in runs {
                prop_assert_eq!(edges(button, &mut press, level, run), 0);
                level = !level;
            }
        }

        #[test]
        fn every_press_is_one_edge(runs in prop::collection::vec(20_u32..60, 1..100)) {
            let (button, mut press) = (Button::new(20), Press::default());
            edges(button, &mut press, false, 20);
            let mut level = true;
            for run in runs {
                prop_assert_eq!(edges(button, &mut press, level, run), u32::from(level));
                level = !level;
            }
        }
    }
}
