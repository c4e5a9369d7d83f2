//! The file of a campaign: limits of the pulses, the states in which faults are injected, the faults and what each must lead to.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use super::kinds::Inject;
use super::stage::{Run, Sequence};
use crate::judge::Limits;
use crate::loader::ProgramImage;
use crate::nvic::{EXCEPTIONS, Nvic};

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
    /// Single faults.
    #[serde(rename = "fault", default)]
    pub(crate) faults: Vec<Fault>,
    /// Registers, of which every bit is a fault.
    #[serde(rename = "register", default)]
    pub(crate) registers: Vec<Register>,
    /// Exceptions, of which every one is a fault.
    #[serde(rename = "exceptions", default)]
    pub(crate) exceptions: Vec<Exceptions>,
    /// Parts of the memory, of which bits are drawn at random.
    #[serde(rename = "memory", default)]
    pub(crate) memory: Vec<Memory>,
    /// Gestures and faults one after the other.
    #[serde(rename = "sequence", default)]
    pub(crate) sequences: Vec<Sequence>,
}

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
    /// States in which it applies.
    pub(crate) states: Vec<String>,
    /// What it must lead to.
    pub(crate) expect: Expected,
}

impl Fault {
    /// Whether it applies in the state of this name.
    pub(crate) fn applies_in(&self, state: &str) -> bool {
        self.states.iter().any(|name| name == state)
    }
}

/// Bits of a register: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Register {
    /// Name.
    pub(crate) name: String,
    /// Address.
    pub(crate) address: u32,
    /// The bits.
    pub(crate) bits: Vec<u32>,
    /// States in which they apply.
    pub(crate) states: Vec<String>,
    /// What each must lead to.
    pub(crate) expect: Expected,
}

/// Exceptions that nothing has requested: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Exceptions {
    /// Name.
    pub(crate) name: String,
    /// Their numbers.
    pub(crate) numbers: Vec<u8>,
    /// States in which they apply.
    pub(crate) states: Vec<String>,
    /// What each must lead to.
    pub(crate) expect: Expected,
}

/// Bits of the memory, drawn at random: each is a fault that only the limits of the pulses judge.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Memory {
    /// Name.
    pub(crate) name: String,
    /// Symbols of the image: at the first address, and after the last.
    pub(crate) symbols: [String; 2],
    /// How many bits.
    pub(crate) count: u32,
    /// States in which they apply.
    pub(crate) states: Vec<String>,
}

/// Time after which a fault that only the limits of the pulses judge is no longer watched, ms.
const WATCHED_MS: f64 = 150.0;

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
        for Sequence { name, state, lasts_s, .. } in &campaign.sequences {
            check_state("sequence", name, state)?;
            ensure!(
                *lasts_s > 0.0 && *lasts_s <= 3600.0,
                "sequence `{name}`: lasts_s is {lasts_s}; allowed are more than 0, and 3600 at most"
            );
        }
        let mut names = BTreeSet::new();
        for Fault { name, states, expect, .. } in &campaign.faults {
            ensure!(names.insert(name), "two faults have the name `{name}`; allowed is one");
            states.iter().try_for_each(|state| check_state("fault", name, state))?;
            ensure!(
                expect.within_ms > 0.0 && expect.within_ms.is_finite(),
                "fault `{name}`: within_ms is {}; allowed is more than 0",
                expect.within_ms
            );
        }
        Ok(campaign)
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

    /// Makes a fault of each bit of the registers, of each exception, and of the drawn bits of the memory.
    fn expand(&mut self, address_of: impl Fn(&str) -> Option<u32>) -> Result<()> {
        for Register { name, address, bits, states, expect } in std::mem::take(&mut self.registers) {
            ensure!(bits.iter().all(|bit| *bit < 32), "register `{name}`: bits {bits:?}; allowed are 0 to 31");
            self.faults.extend(bits.into_iter().map(|bit| Fault {
                name: format!("{name}, bit {bit}"),
                inject: Inject::Flip { address, mask: 1 << bit },
                states: states.clone(),
                expect,
            }));
        }
        for Exceptions { name, numbers, states, expect } in std::mem::take(&mut self.exceptions) {
            for number in numbers {
                ensure!(
                    Nvic::exists(number) && number > 1,
                    "exceptions `{name}`: {number}; allowed are 2 to {}",
                    EXCEPTIONS - 1
                );
                self.faults.push(Fault {
                    name: format!("{name}, {number}"),
                    inject: Inject::Exception(number),
                    states: states.clone(),
                    expect,
                });
            }
        }
        for Memory { name, symbols, count, states } in std::mem::take(&mut self.memory) {
            let address = |symbol: &str| {
                address_of(symbol).with_context(|| format!("memory `{name}`: the image has no symbol `{symbol}`"))
            };
            let (first, end) = (address(&symbols[0])?, address(&symbols[1])?);
            ensure!(first < end, "memory `{name}`: addresses {first:#x}..{end:#x}; allowed is the lower one first");
            let mut drawn = BTreeSet::new();
            let mut random = u64::from(first) << 32 | u64::from(end);
            let bits = Range { start: 0, end: u64::from(end - first) * 8 };
            ensure!(u64::from(count) <= bits.end / 2, "memory `{name}`: {count} of {} bits; allowed is half", bits.end);
            while drawn.len() < count as usize {
                drawn.insert(splitmix(&mut random) % bits.end);
            }
            self.faults.extend(drawn.into_iter().map(|bit| {
                let byte = first + (bit / 8) as u32;
                let mask = 1 << (bit % 8) << (byte % 4 * 8);
                Fault {
                    name: format!("{name}, {byte:#010x} bit {}", bit % 8),
                    inject: Inject::Flip { address: byte & !3, mask },
                    states: states.clone(),
                    expect: Expected {
                        reaction: Reaction::Any,
                        within_ms: WATCHED_MS,
                        decided_within_us: None,
                        low_within_ms: None,
                    },
                }
            }));
        }
        Ok(())
    }
}

/// The next number of the generator SplitMix64 (Steele, Lea, Flood 2014).
pub(super) fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "phases = 2\n[limits]\nleast_us = [523, 523, 523, 523]\nmost_us = [2400, 2400, 2400, 2400]\nus_per_s = [1e3, 1e3, 1e3, 1e3]\n\
                        [[run]]\nname = \"walk\"\nstate = [{ name = \"walking\", at_s = 3, outputs = true }, \
                        { name = \"disarmed\", at_s = 0.2, outputs = false }]\nserial = [{ at_s = 0.1, bytes = \"0aff\" }]\n";

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
    fn what_is_wrong_is_named() {
        let fault = |inject: &str, state: &str, within: &str| {
            format!(
                "{HEAD}[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"{state}\"]\n\
                 expect = {{ reaction = \"reset\", within_ms = {within} }}\n"
            )
        };
        assert!(parse(&fault("{ hang = \"control_step\" }", "walking", "40")).is_ok());
        assert!(parse(&fault("{ volts = { pin = \"PA1\", volts = 3.3 } }", "walking", "40")).is_ok());
        for (text, words) in [
            (fault("\"crystal\"", "flying", "40"), "there is no state `flying`; the file has disarmed, walking"),
            (fault("\"crystal\"", "walking", "0"), "within_ms is 0; allowed is more than 0"),
            (fault("\"quake\"", "walking", "40"), "unknown variant `quake`"),
            (fault("{ level = { pin = \"PX1\", high = true } }", "walking", "40"), "is not the name of a pin"),
            (HEAD.replace("phases = 2", "phases = 0"), "phases is 0; allowed are 1 to 1000"),
            (HEAD.replace("0aff", "0af"), "`0af` is no list of bytes"),
            (HEAD.replace("disarmed", "walking"), "two states have the name `walking`"),
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
                     expect = {{ reaction = \"reset\", within_ms = 1 }}\n"
                ),
                "exceptions `e`: 98; allowed are 2 to 97",
            ),
        ] {
            let error = format!("{:#}", parse(&text).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
