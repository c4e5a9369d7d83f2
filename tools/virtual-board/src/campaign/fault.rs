//! A fault of a campaign, and what it must lead to.

use anyhow::{Result, ensure};
use serde::Deserialize;

use crate::script::Inject;

/// What a fault must lead to.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Expected {
    /// The reaction.
    pub(crate) reaction: Reaction,
    /// Its time limit, from the effect of the fault, ms.
    pub(crate) within_ms: f64,
    /// Time limit for the first act: the supply of the servos or the main output is off, us.
    pub(crate) decided_within_us: Option<f64>,
    /// Time limit for the end of the pulses, ms.
    pub(crate) low_within_ms: Option<f64>,
    /// One pulse of each servo may last so long, ms: the fault stops or slows the timer in it.
    pub(crate) high_ms: Option<f64>,
}

impl Expected {
    /// Only the limits of the pulses, for 150 ms.
    pub(super) const PULSES_ALONE: Self = Expected {
        reaction: Reaction::Any,
        within_ms: 150.0,
        decided_within_us: None,
        low_within_ms: None,
        high_ms: None,
    };

    fn check(&self) -> Result<()> {
        let limits = [
            ("within_ms", Some(self.within_ms)),
            ("decided_within_us", self.decided_within_us),
            ("low_within_ms", self.low_within_ms),
            ("high_ms", self.high_ms),
        ];
        for (what, limit) in limits {
            ensure!(
                limit.is_none_or(|limit| limit > 0.0 && limit.is_finite()),
                "{what} is {}; allowed is more than 0",
                limit.unwrap_or_default()
            );
        }
        Ok(())
    }
}

/// A reaction that a fault must lead to. The limits of the pulses hold besides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Reaction {
    /// The servos get no pulse any more, or their supply is off.
    Off,
    /// The same, and the chip resets.
    Reset,
    /// The outputs stay as they were: on or off.
    None,
    /// One of the two: the program may have overwritten the fault before it looks.
    OffOrNone,
    /// Any: only the limits of the pulses are judged.
    Any,
}

/// A fault by its name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Fault {
    /// Name.
    pub(crate) name: String,
    /// What happens.
    pub(crate) inject: Inject,
    /// How long, ms; without it, to the end.
    #[serde(default)]
    pub(crate) for_ms: Option<f64>,
    /// States in which it applies.
    pub(crate) states: Vec<String>,
    /// What it must lead to.
    pub(crate) expect: Expected,
}

impl Fault {
    /// A fault that does not end.
    pub(super) fn lasting(name: String, inject: Inject, states: &[String], expect: Expected) -> Self {
        Fault { name, inject, for_ms: None, states: states.to_vec(), expect }
    }

    /// Whether it applies in the state of this name.
    pub(crate) fn applies_in(&self, state: &str) -> bool {
        self.states.iter().any(|name| name == state)
    }

    /// Checks what is injected, and the time limits.
    pub(super) fn check(&self) -> Result<()> {
        self.inject.check()?;
        ensure!(
            self.for_ms.is_none_or(|ms| ms >= 0.0 && ms.is_finite()),
            "for_ms is {:?}; allowed is 0 or more",
            self.for_ms
        );
        self.expect.check()?;
        ensure!(self.for_ms.is_none() || self.inject.can_end(), "`{}` has no end; remove for_ms", self.inject.name());
        Ok(())
    }
}
