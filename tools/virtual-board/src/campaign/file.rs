//! The file of a campaign: limits of the pulses, the states in which faults are injected, the faults and what each must lead to.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use super::fault::Fault;
use super::groups::{Core, Exceptions, Memory, Register, Word};
use super::stage::{InjectAt, Run, Sequence, Serial};
use crate::judge::Limits;
use crate::loader::ProgramImage;

/// A campaign.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Campaign {
    /// Moments of the pulse frame at which each fault is injected.
    pub(crate) phases: u32,
    /// What the servos may get.
    pub(crate) limits: Limits,
    /// Runs with their states.
    #[serde(rename = "run")]
    pub(crate) runs: Vec<Run>,
    /// Single faults; after reading those of the groups too.
    #[serde(rename = "fault", default)]
    pub(crate) faults: Vec<Fault>,
    /// Registers, of which bits are faults.
    #[serde(rename = "register", default)]
    registers: Vec<Register>,
    /// Words in RAM by their value, of which each bit is a fault.
    #[serde(rename = "word", default)]
    words: Vec<Word>,
    /// Registers of the core, of which bits are faults.
    #[serde(default)]
    core: Vec<Core>,
    /// Exceptions, of which each is a fault.
    #[serde(default)]
    exceptions: Vec<Exceptions>,
    /// Parts of the memory, of which bits are drawn at random.
    #[serde(default)]
    memory: Vec<Memory>,
    /// Gestures and faults one after the other.
    #[serde(rename = "sequence", default)]
    pub(crate) sequences: Vec<Sequence>,
}

/// Bytes on the serial port are sent in the order of the file, and until `last_s`.
fn check_serial(what: &str, name: &str, serial: &[Serial], last_s: f64) -> Result<()> {
    let mut before_s = 0.0;
    for Serial { at_s, .. } in serial {
        ensure!(
            (before_s..=last_s).contains(at_s),
            "{what} `{name}`: serial bytes at {at_s} s; allowed are {before_s} s, the time of those before, to {last_s} s"
        );
        before_s = *at_s;
    }
    Ok(())
}

impl Campaign {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read or is no campaign: the line, or the name of the fault, and what is allowed.
    pub(crate) fn read(path: &Path, image: &ProgramImage) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&text, |symbol| image.symbol(symbol)).with_context(|| format!("{} is no campaign", path.display()))
    }

    pub(super) fn parse(text: &str, address_of: impl Fn(&str) -> Option<u32>) -> Result<Self> {
        let mut campaign: Campaign = toml::from_str(text)?;
        ensure!((1..=1000).contains(&campaign.phases), "phases is {}; allowed are 1 to 1000", campaign.phases);
        campaign.expand(address_of)?;
        let mut known = BTreeSet::new();
        for run in &mut campaign.runs {
            run.states.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
            for state in &run.states {
                ensure!(known.insert(state.name.clone()), "two states have the name `{}`; allowed is one", state.name);
            }
        }
        let check_state = |what: &str, name: &str, state: &String| {
            let all = || known.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            ensure!(known.contains(state), "{what} `{name}`: there is no state `{state}`; the file has {}", all());
            Ok(())
        };
        let check = |what: &str, name: &str, injects: &[InjectAt]| {
            injects.iter().try_for_each(|one| one.what.check()).with_context(|| format!("{what} `{name}`"))
        };
        for run in &campaign.runs {
            check("run", &run.name, &run.injects)?;
            let last_s = run.states.last().map_or(0.0, |state| state.at_s);
            check_serial("run", &run.name, &run.serial, last_s)?;
        }
        for Sequence { name, state, lasts_s, injects, serial, .. } in &campaign.sequences {
            check("sequence", name, injects)?;
            check_state("sequence", name, state)?;
            ensure!(
                *lasts_s > 0.0 && *lasts_s <= 3600.0,
                "sequence `{name}`: lasts_s is {lasts_s}; allowed are more than 0, and 3600 at most"
            );
            check_serial("sequence", name, serial, *lasts_s)?;
        }
        let mut names = BTreeSet::new();
        for fault in &campaign.faults {
            let Fault { name, states, .. } = fault;
            fault.check().with_context(|| format!("fault `{name}`"))?;
            ensure!(names.insert(name), "two faults have the name `{name}`; allowed is one");
            states.iter().try_for_each(|state| check_state("fault", name, state))?;
            for state in campaign.runs.iter().flat_map(|run| &run.states).filter(|state| states.contains(&state.name)) {
                let expected = fault.expected(state.outputs);
                expected.check_for(&state.name, state.outputs).with_context(|| format!("fault `{name}`"))?;
            }
        }
        Ok(campaign)
    }

    /// The cases of a fault: each state in which it applies, in the order of the file, with each phase.
    pub(crate) fn cases_of(&self, fault: &Fault) -> Vec<(&str, u32)> {
        let states = self.runs.iter().flat_map(|run| &run.states).filter(|state| fault.applies_in(&state.name));
        states.flat_map(|state| (0..self.phases).map(|phase| (state.name.as_str(), phase))).collect()
    }

    /// The run of this name.
    ///
    /// # Errors
    /// There is none; the message has those that there are.
    pub(crate) fn run(&self, name: &str) -> Result<&Run> {
        self.runs.iter().find(|run| run.name == name).with_context(|| {
            let all: Vec<&str> = self.runs.iter().map(|run| run.name.as_str()).collect();
            format!("there is no run `{name}`; the file has {}", all.join(", "))
        })
    }

    /// Makes a fault of each member of the groups.
    fn expand(&mut self, address_of: impl Fn(&str) -> Option<u32>) -> Result<()> {
        for register in std::mem::take(&mut self.registers) {
            self.faults.extend(register.faults()?);
        }
        self.faults.extend(std::mem::take(&mut self.words).into_iter().flat_map(Word::faults));
        self.faults.extend(std::mem::take(&mut self.core).into_iter().flat_map(Core::faults));
        self.faults.extend(std::mem::take(&mut self.exceptions).into_iter().flat_map(Exceptions::faults));
        for memory in std::mem::take(&mut self.memory) {
            self.faults.extend(memory.faults(&address_of)?);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Reaction;
    use crate::script::Inject;

    const HEAD: &str = "phases = 2\n[limits]\nleast_us = [523, 523, 523, 523]\nmost_us = [2400, 2400, 2400, 2400]\nus_per_s = [1e3, 1e3, 1e3, 1e3]\npark_us = [1500, 1500, 1500, 1500]\n\
                        [[run]]\nname = \"walk\"\nstate = [{ name = \"walking\", at_s = 3, outputs = true, says = \"walking (none)\" }, \
                        { name = \"disarmed\", at_s = 0.2, outputs = false, says = \"disarmed (none)\" }]\nserial = [{ at_s = 0.1, bytes = \"0aff\" }]\n";

    fn parse(text: &str) -> Result<Campaign> {
        Campaign::parse(text, |symbol| match symbol {
            "first" => Some(0x2000_0000),
            "end" => Some(0x2000_0100),
            _ => None,
        })
    }

    #[test]
    fn each_bit_is_a_fault_with_a_name() {
        let text = format!(
            "{HEAD}[[register]]\nname = \"TIM1 ARR\"\naddress = 0x4001_002C\nbits = [3, 4, 5]\nstates = [\"walking\"]\n\
             expect = {{ reaction = \"off\", within_ms = 120 }}\n\
             [[memory]]\nname = \"RAM\"\nsymbols = [\"first\", \"end\"]\ncount = 50\nstates = [\"walking\"]\n"
        );
        let campaign = parse(&text).unwrap();
        let names: Vec<&str> = campaign.faults.iter().take(3).map(|fault| fault.name.as_str()).collect();
        assert_eq!(names, ["TIM1 ARR, bit 3", "TIM1 ARR, bit 4", "TIM1 ARR, bit 5"]);
        assert_eq!(campaign.faults[1].inject, Inject::Flip { address: 0x4001_002C, mask: 16 });
        assert_eq!(campaign.faults.len(), 53);
        for fault in &campaign.faults[3..] {
            let Inject::Flip { address, mask } = fault.inject else { panic!() };
            assert!((0x2000_0000..0x2000_0100).contains(&address) && address % 4 == 0 && mask.count_ones() == 1);
        }
        // The earlier state comes first.
        let run = campaign.run("walk").unwrap();
        assert_eq!((run.states[0].name.as_str(), run.serial[0].bytes.as_slice()), ("disarmed", &[0x0A, 0xFF][..]));
        assert_eq!(campaign.run("trim").unwrap_err().to_string(), "there is no run `trim`; the file has walk");
    }

    #[test]
    fn reactions_and_causes_are_words_or_lists() {
        let text = format!(
            "{HEAD}[[fault]]\nname = \"a\"\ninject = \"panic\"\nstates = [\"walking\", \"disarmed\"]\n\
             expect = {{ reaction = [\"off\", \"none\"], within_ms = 5, cause = [\"late\", \"outputs\"], counts = \"missed\" }}\n\
             at_rest = {{ reaction = \"fault\", within_ms = 20, cause = \"outputs\" }}\n"
        );
        let campaign = parse(&text).unwrap();
        let (on, off) = (campaign.faults[0].expected(true), campaign.faults[0].expected(false));
        assert_eq!(
            (on.reactions.as_slice(), off.reactions.as_slice()),
            (&[Reaction::Off, Reaction::None][..], &[Reaction::Fault][..])
        );
        let names: Vec<&str> = on.causes.iter().map(|cause| cause.name()).collect();
        assert_eq!((names, off.within_ms), (vec!["late", "outputs"], 20.0));
        let cases = campaign.cases_of(&campaign.faults[0]);
        assert_eq!(cases, [("disarmed", 0), ("disarmed", 1), ("walking", 0), ("walking", 1)]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let fault = |inject: &str, state: &str, within: &str| {
            format!(
                "{HEAD}[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"{state}\"]\n\
                 expect = {{ reaction = \"reset\", boot = \"iwdg\", within_ms = {within} }}\n"
            )
        };
        assert!(parse(&fault("{ hang = \"control_step\" }", "walking", "40")).is_ok());
        assert!(parse(&fault("{ volts = { pin = \"PA1\", volts = 3.3 } }", "walking", "40")).is_ok());
        for (text, words) in [
            (fault("\"crystal\"", "flying", "40"), "there is no state `flying`; the file has disarmed, walking"),
            (fault("\"crystal\"", "walking", "0"), "within_ms is 0; allowed is more than 0"),
            (fault("\"quake\"", "walking", "40"), "unknown variant `quake`"),
            (fault("{ level = { pin = \"PX1\", high = true } }", "walking", "40"), "is not the name of a pin"),
            (
                fault("\"crystal\"", "disarmed", "40").replace("\"reset\"", "[\"reset\", \"off\"]"),
                "`off` cannot be seen in the state `disarmed`, whose outputs are off; add at_rest",
            ),
            (
                fault("\"crystal\"", "walking", "40").replace("\"reset\", boot = \"iwdg\"", "\"fault\""),
                "whose outputs are on",
            ),
            (
                fault("\"crystal\"", "walking", "40").replace("boot = \"iwdg\", ", ""),
                "fault `a`: `reset` without `boot`",
            ),
            (
                fault("\"crystal\"", "walking", "40").replace("\"reset\"", "\"off\""),
                "fault `a`: `boot` without `reset`",
            ),
            (
                fault("\"crystal\"", "walking", "40").replace("iwdg", "dog"),
                "`dog` is no end of a run; allowed are panic, hard_fault",
            ),
            (fault("\"crystal\"", "walking", "40").replace("\"reset\"", "[]"), "an empty list"),
            (fault("\"crystal\"", "walking", "40").replace("\"reset\"", "\"any\""), "unknown variant `any`"),
            (
                fault("\"crystal\"", "walking", "40, cause = \"bad luck\""),
                "`bad luck` is no cause; allowed are none, button",
            ),
            (HEAD.replace("phases = 2", "phases = 0"), "phases is 0; allowed are 1 to 1000"),
            (HEAD.replace("0aff", "0af"), "`0af` is no list of bytes"),
            (HEAD.replace("disarmed", "walking"), "two states have the name `walking`"),
            (
                format!(
                    "{HEAD}[[sequence]]\nname = \"a\"\nstate = \"walking\"\nlasts_s = 1\n\
                     inject = [{{ at_s = 0.5, what = {{ stuck-code = 5000 }} }}]\n"
                ),
                "sequence `a`: stuck-code is 5000; allowed are 0 to 4095",
            ),
            (
                fault("\"crystal\"", "walking", "40, decided_within_us = -1"),
                "fault `a`: decided_within_us is -1; allowed is more than 0",
            ),
            (
                fault("\"crystal\"", "walking", "40, reset_within_ms = 0"),
                "fault `a`: reset_within_ms is 0; allowed is more than 0",
            ),
            (
                fault("\"crystal\"", "walking", "40, reset_within_ms = 40"),
                "fault `a`: `reset_within_ms` is not below `within_ms`",
            ),
            (
                fault("\"crystal\"", "walking", "40, reset_within_ms = 9")
                    .replace("\"reset\", boot = \"iwdg\"", "\"off\""),
                "fault `a`: `reset_within_ms` without `reset`",
            ),
            (
                format!(
                    "{HEAD}[[sequence]]\nname = \"a\"\nstate = \"walking\"\nlasts_s = 1\n\
                     serial = [{{ at_s = 0.5, bytes = \"00\" }}, {{ at_s = 0.4, bytes = \"00\" }}]\n"
                ),
                "sequence `a`: serial bytes at 0.4 s; allowed are 0.5 s, the time of those before, to 1 s",
            ),
            (
                HEAD.replace("at_s = 0.1, bytes", "at_s = 3.1, bytes"),
                "run `walk`: serial bytes at 3.1 s; allowed are 0 s",
            ),
            (
                format!("{HEAD}[[sequence]]\nname = \"a\"\nstate = \"flying\"\nlasts_s = 1\n"),
                "sequence `a`: there is no state `flying`",
            ),
            (
                format!("{HEAD}[[memory]]\nname = \"RAM\"\nsymbols = [\"first\", \"last\"]\ncount = 1\nstates = []\n"),
                "the image has no symbol `last`",
            ),
            (
                format!(
                    "{HEAD}[[exceptions]]\nname = \"e\"\nnumbers = [98]\nstates = []\n\
                     expect = {{ reaction = \"reset\", boot = \"iwdg\", within_ms = 1 }}\n"
                ),
                "fault `e, 98`: number is 98; allowed are 2 to 97",
            ),
        ] {
            let error = format!("{:#}", parse(&text).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
