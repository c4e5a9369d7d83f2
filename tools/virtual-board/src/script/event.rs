//! The file of a script: events, each with its moment.

use std::fmt;
use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use serde::Deserialize;
use toml::Spanned;

use super::Inject;

/// The function whose calls are counted as ticks.
const TICK: &str = "control_step";

/// A script.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Script {
    /// Its events.
    pub(crate) events: Vec<Event>,
}

/// What happens, and when.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Event {
    /// Name in the output.
    pub(crate) name: String,
    /// Line of the file.
    pub(crate) line: usize,
    /// The moment.
    pub(crate) moment: Moment,
    /// So long after the moment, s.
    pub(crate) after_s: f64,
    /// Then, at this phase of the servo frame, us.
    pub(crate) phase_us: Option<f64>,
    /// Again after so long, s, and how often in all.
    pub(crate) every_s: f64,
    /// How often in all.
    pub(crate) times: u32,
    /// What happens.
    pub(crate) inject: Inject,
    /// How long, s; `None`: it does not end.
    pub(crate) for_s: Option<f64>,
}

/// A moment of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Moment {
    /// A virtual time, s.
    At(f64),
    /// The call of a function: its name, and which call since the power-on.
    Call(String, u32),
    /// Something that the run shows: what, and which time since the power-on.
    On(On, u32),
}

/// What a run shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(clippy::enum_variant_names, reason = "the words of the file; `rail-on` is no kind of `on`")]
pub(crate) enum On {
    /// The outputs are switched on: TIM1's main output enable.
    Armed,
    /// They are switched off.
    Disarmed,
    /// The servos' supply is switched on.
    RailOn,
    /// It is switched off.
    RailOff,
    /// The chip leaves reset; the first time is the power-on.
    Boot,
}

/// An event as it stands in the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EventText {
    name: Option<String>,
    at_s: Option<f64>,
    tick: Option<u32>,
    call: Option<String>,
    on: Option<On>,
    count: Option<u32>,
    after_ms: Option<f64>,
    phase_us: Option<f64>,
    every_ms: Option<f64>,
    times: Option<u32>,
    inject: Inject,
    for_ms: Option<f64>,
}

/// Beginning and end of an injection, s; without an end it lasts.
pub(super) type Span = (f64, Option<f64>);

/// Name and line.
impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` (line {})", self.name, self.line)
    }
}

impl Event {
    /// Beginning and end of each of its injections from its moment on, s.
    pub(super) fn spans(&self) -> impl Iterator<Item = Span> {
        let at_s = if let Moment::At(seconds) = self.moment { seconds } else { 0.0 };
        (0..self.times).map(move |n| {
            let begins = at_s + self.after_s + f64::from(n) * self.every_s;
            (begins, self.for_s.map(|lasts| begins + lasts))
        })
    }
}

impl Moment {
    /// What its times count from: two events can be compared where it is the same.
    pub(super) fn base(&self) -> Option<&Self> {
        (!matches!(self, Self::At(_))).then_some(self)
    }
}

/// In the words of the file.
impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::At(seconds) => write!(f, "at_s = {seconds}"),
            Self::Call(function, count) => write!(f, "call = \"{function}\", count = {count}"),
            Self::On(on, count) => write!(f, "on = \"{}\", count = {count}", on.name()),
        }
    }
}

impl On {
    /// The word of the file.
    const fn name(self) -> &'static str {
        match self {
            Self::Armed => "armed",
            Self::Disarmed => "disarmed",
            Self::RailOn => "rail-on",
            Self::RailOff => "rail-off",
            Self::Boot => "boot",
        }
    }
}

impl Script {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read or is no script: the line, and what is allowed.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&text).with_context(|| format!("{} is no script of faults", path.display()))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// It is no script: the line, and what is allowed.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            #[serde(default)]
            event: Vec<Spanned<EventText>>,
        }
        let File { event: events } = toml::from_str(text)?;
        let line = |at: usize| text[..at].lines().count().max(1);
        let events = events.into_iter().map(|event| {
            let line = line(event.span().start + 1);
            let event = Event::try_from(event.into_inner()).with_context(|| format!("the event in line {line}"))?;
            Ok(Event { line, ..event })
        });
        Ok(Script { events: events.collect::<Result<_>>()? })
    }
}

/// A time of the file that may be 0, in seconds.
fn from_ms(what: &str, ms: Option<f64>) -> Result<Option<f64>> {
    if let Some(ms) = ms {
        ensure!(ms >= 0.0 && ms.is_finite(), "{what} is {ms}; allowed is 0 or more");
    }
    Ok(ms.map(|ms| ms * 1e-3))
}

impl TryFrom<EventText> for Event {
    type Error = anyhow::Error;

    fn try_from(text: EventText) -> Result<Self> {
        let count = text.count.unwrap_or(1);
        ensure!(count > 0, "count is 0; allowed is 1 or more");
        ensure!(
            text.count.is_none() || text.call.is_some() || text.on.is_some(),
            "count needs call or on: it says which time; remove it, or give one of them"
        );
        let moment = match (text.at_s, text.tick, text.call, text.on) {
            (Some(at), None, None, None) => {
                ensure!(at >= 0.0 && at.is_finite(), "at_s is {at}; allowed is 0 or more");
                Moment::At(at)
            }
            (None, Some(tick), None, None) => {
                ensure!(tick > 0, "tick is 0; allowed is 1 or more");
                Moment::Call(TICK.into(), tick)
            }
            (None, None, Some(function), None) => Moment::Call(function, count),
            (None, None, None, Some(on)) => Moment::On(on, count),
            _ => bail!("an event has one moment: at_s, tick, call or on; give one of them"),
        };
        if let Some(us) = text.phase_us {
            let is_in_frame = (0.0..20_000.0).contains(&us);
            ensure!(is_in_frame, "phase_us is {us}; allowed is 0 to less than 20000, the servo frame");
        }
        ensure!(
            text.every_ms.is_some() == text.times.is_some(),
            "every_ms and times belong together; give both or none"
        );
        if let Some(ms) = text.every_ms {
            ensure!(ms > 0.0 && ms.is_finite(), "every_ms is {ms}; allowed is more than 0");
        }
        let times = text.times.unwrap_or(1);
        ensure!((1..=100_000).contains(&times), "times is {times}; allowed are 1 to 100000");
        text.inject.check()?;
        let for_s = from_ms("for_ms", text.for_ms)?;
        ensure!(for_s.is_none() || text.inject.can_end(), "`{}` has no end; remove for_ms", text.inject.name());
        Ok(Event {
            name: text.name.unwrap_or_else(|| text.inject.name().into()),
            line: 0,
            moment,
            after_s: from_ms("after_ms", text.after_ms)?.unwrap_or(0.0),
            phase_us: text.phase_us,
            every_s: text.every_ms.unwrap_or(0.0) * 1e-3,
            times,
            inject: text.inject,
            for_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_read() {
        let script = Script::parse(
            "[[event]]\nat_s = 1.5\ninject = { supply = 2.6 }\nfor_ms = 30\n\
             [[event]]\nname = \"dip\"\non = \"armed\"\ncount = 2\nafter_ms = 100\nphase_us = 500\ninject = { vdd = 2.7 }\n\
             [[event]]\ntick = 100\nevery_ms = 510\ntimes = 3\ninject = \"overrun\"\n\
             [[event]]\ncall = \"telemetry_step\"\ninject = \"panic\"\n",
        )
        .unwrap();
        let moments: Vec<&Moment> = script.events.iter().map(|event| &event.moment).collect();
        assert_eq!(
            moments,
            [
                &Moment::At(1.5),
                &Moment::On(On::Armed, 2),
                &Moment::Call(TICK.into(), 100),
                &Moment::Call("telemetry_step".into(), 1)
            ]
        );
        assert_eq!((script.events[0].name.as_str(), script.events[1].name.as_str()), ("supply", "dip"));
        assert_eq!((script.events[0].for_s, script.events[1].phase_us), (Some(0.03), Some(500.0)));
        assert_eq!((script.events[2].times, script.events[2].every_s), (3, 0.51));
    }

    #[test]
    fn an_error_names_its_line_and_what_is_allowed() {
        let event =
            |text: &str| format!("# a script\n\n[[event]]\nat_s = 1\ninject = \"crystal\"\n[[event]]\n{text}\n");
        for (text, words) in [
            ("at_s = 1\ninject = \"crystal\"\nwhen = 2", &["line 9", "unknown field `when`", "`phase_us`"][..]),
            ("at_s = 1\ninject = \"quake\"", &["line 8", "unknown variant `quake`", "`crystal-hz`"]),
            ("at_s = 1\ntick = 2\ninject = \"crystal\"", &["line 6", "one moment: at_s, tick, call or on"]),
            ("inject = \"crystal\"", &["line 6", "one moment"]),
            ("at_s = -1\ninject = \"crystal\"", &["line 6", "at_s is -1; allowed is 0 or more"]),
            ("at_s = 1\ninject = \"panic\"\nfor_ms = 5", &["line 6", "`panic` has no end"]),
            ("at_s = 1\ncount = 2\ninject = \"panic\"", &["line 6", "count needs call or on"]),
            ("on = \"armed\"\ncount = 0\ninject = \"panic\"", &["line 6", "count is 0"]),
            ("on = \"walking\"\ninject = \"panic\"", &["line 7", "unknown variant `walking`", "`armed`"]),
            ("at_s = 1\nphase_us = 20000\ninject = \"panic\"", &["line 6", "less than 20000"]),
            ("at_s = 1\nevery_ms = 5\ninject = \"panic\"", &["line 6", "belong together"]),
            ("at_s = 1\nevery_ms = 0\ntimes = 2\ninject = \"panic\"", &["line 6", "every_ms"]),
            ("at_s = 1\ninject = { stuck-code = 5000 }", &["line 6", "allowed are 0 to 4095"]),
        ] {
            let error = format!("{:#}", Script::parse(&event(text)).unwrap_err());
            assert!(words.iter().all(|words| error.contains(words)), "{text}: {error}");
        }
        assert!(format!("{:#}", Script::parse("[[events]]\nat_s = 1\n").unwrap_err()).contains("expected `event`"));
    }
}
