//! Debounce: a raw button level to one press edge, after the level was stable for long enough.

/// The configuration: how many ticks in a row must agree before the level counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Button {
    stable_ticks: u32,
}

/// The state: the level that counts, and for how long the raw one has differed from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Press {
    held: bool,
    differs_for: u32,
}

impl Default for Press {
    /// As if held: a button that is down (or wired the wrong way) at boot gives no edge until it was once released.
    fn default() -> Self {
        Self { held: true, differs_for: 0 }
    }
}

impl Button {
    /// A level counts after it was read `stable_ticks` times in a row (0 is taken as 1).
    #[must_use]
    pub const fn new(stable_ticks: u32) -> Self {
        Self { stable_ticks: if stable_ticks == 0 { 1 } else { stable_ticks } }
    }

    /// Takes one raw level; true on the one tick in which a press becomes certain.
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
    fn held_at_boot_is_no_press() {
        let (button, mut press) = (Button::new(20), Press::default());
        assert_eq!(edges(button, &mut press, true, 10_000), 0);
        assert_eq!(edges(button, &mut press, false, 20), 0);
        assert_eq!(edges(button, &mut press, true, 20), 1);
    }

    proptest! {
        #[test]
        fn bounce_shorter_than_the_stable_time_gives_nothing(runs in prop::collection::vec(1_u32..20, 1..200)) {
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
