//! A fault of a campaign, and what it must lead to.

use anyhow::{Result, ensure};
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::reports::{Counter, ends};
use crate::script::Inject;

/// What a fault must lead to.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Expected {
    /// The reactions that are allowed: one, or a list.
    #[serde(rename = "reaction", deserialize_with = "one_or_more")]
    pub(crate) reactions: Vec<Reaction>,
    /// Their time limit, from the effect of the fault, ms.
    pub(crate) within_ms: f64,
    /// Time limit of a reset, if it is shorter than that of the other reactions, ms.
    pub(crate) reset_within_ms: Option<f64>,
    /// Time limit for the first act: the supply of the servos or the main output is off, us.
    pub(crate) decided_within_us: Option<f64>,
    /// Time limit for the end of the pulses, ms.
    pub(crate) low_within_ms: Option<f64>,
    /// One pulse of each servo may last so long, ms: the fault stops or slows the timer in it.
    pub(crate) high_ms: Option<f64>,
    /// The cause that the board must give for `off`, `fault` and `cause`: one of them.
    #[serde(rename = "cause", default, deserialize_with = "one_or_more")]
    pub(crate) causes: Vec<Cause>,
    /// What the boot after a `reset` must give as the end of the run: one of these. Who reads its log judges it ([`crate::run::Plan::boot_log`]).
    #[serde(rename = "boot", default, deserialize_with = "one_or_more")]
    pub(crate) ends: Vec<End>,
    /// What the board must have counted by the end: without it nothing shows that the fault had an effect.
    pub(crate) counts: Option<Counter>,
}

impl Expected {
    /// Only the limits of the pulses, for 150 ms.
    pub(super) const PULSES_ALONE: Self = Expected {
        reactions: Vec::new(),
        within_ms: 150.0,
        reset_within_ms: None,
        decided_within_us: None,
        low_within_ms: None,
        high_ms: None,
        causes: Vec::new(),
        ends: Vec::new(),
        counts: None,
    };

    /// Whether only the limits of the pulses are judged.
    pub(crate) const fn is_of_the_pulses_alone(&self) -> bool {
        self.reactions.is_empty()
    }

    /// Whether a reaction is allowed.
    pub(crate) fn allows(&self, reaction: Reaction) -> bool {
        self.reactions.contains(&reaction)
    }

    /// Checks that each reaction can fail where the outputs are on, or off.
    pub(super) fn check_for(&self, state: &str, outputs: bool) -> Result<()> {
        let wrong = if outputs { Reaction::Fault } else { Reaction::Off };
        ensure!(
            !self.allows(wrong),
            "`{}` cannot be seen in the state `{state}`, whose outputs are {}; {}",
            wrong.name(),
            if outputs { "on" } else { "off" },
            if outputs {
                "allowed are off, reset, cause and none"
            } else {
                "add at_rest, which allows fault, reset, cause and none"
            }
        );
        Ok(())
    }

    fn check(&self) -> Result<()> {
        let limits = [
            ("within_ms", Some(self.within_ms)),
            ("reset_within_ms", self.reset_within_ms),
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
        ensure!(
            self.allows(Reaction::Reset) != self.ends.is_empty(),
            "{}; allowed is one with the other: `reset` among the reactions, and `boot`, what the boot after it must give",
            if self.ends.is_empty() { "`reset` without `boot`" } else { "`boot` without `reset`" }
        );
        ensure!(
            self.reset_within_ms.is_none() || self.allows(Reaction::Reset),
            "`reset_within_ms` without `reset`; allowed is with `reset` among the reactions"
        );
        ensure!(
            self.reset_within_ms.is_none_or(|ms| ms < self.within_ms),
            "`reset_within_ms` is not below `within_ms`; allowed is a limit that is shorter"
        );
        Ok(())
    }
}

/// A reaction that a fault must lead to. The limits of the pulses hold besides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Reaction {
    /// The servos get no pulse any more, or their supply is off; the chip does not reset.
    Off,
    /// The servos are not driven any more, and the chip resets.
    Reset,
    /// Outputs that were off stay off, and the supervisor goes to the state `fault`. Where it is in it already, a record has the fault.
    Fault,
    /// Outputs and state stay as they were; the supervisor gives another cause.
    Cause,
    /// Outputs, state and cause of the supervisor stay as they were, and its reports go on.
    None,
}

impl Reaction {
    /// Its word in the file.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Reset => "reset",
            Self::Fault => "fault",
            Self::Cause => "cause",
            Self::None => "none",
        }
    }
}

/// A cause that the supervisor gives, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cause(pub(crate) joint_loop::Cause);

impl Cause {
    /// Its name.
    pub(crate) const fn name(self) -> &'static str {
        self.0.name()
    }
}

impl<'de> Deserialize<'de> for Cause {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let all = joint_loop::Cause::ALL;
        place_of(from, &all.map(joint_loop::Cause::name), "cause").map(|place| Self(all[place]))
    }
}

/// What a boot gives as the end of the run before, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct End(pub(crate) &'static str);

impl<'de> Deserialize<'de> for End {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let ends = ends();
        place_of(from, &ends, "end of a run").map(|place| Self(ends[place]))
    }
}

/// The place of a name in a list.
fn place_of<'de, D: Deserializer<'de>>(from: D, names: &[&str], what: &str) -> Result<usize, D::Error> {
    let name = String::deserialize(from)?;
    let place = names.iter().position(|known| *known == name);
    place.ok_or_else(|| serde::de::Error::custom(format!("`{name}` is no {what}; allowed are {}", names.join(", "))))
}

/// One word, or a list of them.
fn one_or_more<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<Vec<T>, D::Error> {
    // An untagged enum would hide the reason of an error in it.
    struct Words<T>(std::marker::PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for Words<T> {
        type Value = Vec<T>;
        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("a word, or a list of words")
        }
        fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Vec<T>, E> {
            Ok(vec![T::deserialize(serde::de::value::StrDeserializer::new(word))?])
        }
        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
            let mut all = Vec::new();
            while let Some(one) = list.next_element()? {
                all.push(one);
            }
            if all.is_empty() {
                return Err(serde::de::Error::custom("an empty list; allowed is one word or more"));
            }
            Ok(all)
        }
    }
    from.deserialize_any(Words(std::marker::PhantomData))
}

/// A fault by its name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Fault {
    /// Name.
    pub(crate) name: String,
    /// Name of the register or of the other group that it is one of; empty: it is alone.
    #[serde(skip)]
    pub(crate) group: String,
    /// What happens.
    pub(crate) inject: Inject,
    /// What happens right after it, such as the request of a handler that hangs.
    #[serde(default)]
    pub(crate) then: Option<Inject>,
    /// How long after it, ms.
    #[serde(default)]
    pub(crate) then_after_ms: f64,
    /// How long, ms; without it, to the end.
    #[serde(default)]
    pub(crate) for_ms: Option<f64>,
    /// States in which it applies.
    pub(crate) states: Vec<String>,
    /// What it must lead to.
    pub(crate) expect: Expected,
    /// The same in the states whose outputs are off, if it is another.
    #[serde(default)]
    pub(crate) at_rest: Option<Expected>,
}

impl Fault {
    /// A fault that does not end.
    pub(super) fn lasting(
        [group, name]: [&str; 2],
        inject: Inject,
        states: &[String],
        expect: &Expected,
        at_rest: Option<&Expected>,
    ) -> Self {
        let (expect, at_rest) = (expect.clone(), at_rest.cloned());
        let (group, name) = (group.to_owned(), name.to_owned());
        Fault {
            name,
            group,
            inject,
            then: None,
            then_after_ms: 0.0,
            for_ms: None,
            states: states.to_vec(),
            expect,
            at_rest,
        }
    }

    /// The name under which its cases are counted.
    pub(crate) fn row(&self) -> &str {
        if self.group.is_empty() { &self.name } else { &self.group }
    }

    /// What it must lead to where the outputs are on, or off.
    pub(crate) fn expected(&self, outputs: bool) -> &Expected {
        self.at_rest.as_ref().filter(|_| !outputs).unwrap_or(&self.expect)
    }

    /// Whether it applies in the state of this name.
    pub(crate) fn applies_in(&self, state: &str) -> bool {
        self.states.iter().any(|name| name == state)
    }

    /// Checks what is injected, and the time limits.
    pub(super) fn check(&self) -> Result<()> {
        self.inject.check()?;
        self.then.iter().try_for_each(Inject::check)?;
        if let Some(ms) = self.for_ms {
            ensure!(ms >= 0.0 && ms.is_finite(), "for_ms is {ms}; allowed is 0 or more");
        }
        let after = self.then_after_ms;
        ensure!(after >= 0.0 && after.is_finite(), "then_after_ms is {after}; allowed is 0 or more");
        self.expect.check()?;
        self.at_rest.iter().try_for_each(Expected::check)?;
        let can_end = self.inject.can_end() || self.then.as_ref().is_some_and(Inject::can_end);
        ensure!(self.for_ms.is_none() || can_end, "`{}` has no end; remove for_ms", self.inject.name());
        Ok(())
    }
}
