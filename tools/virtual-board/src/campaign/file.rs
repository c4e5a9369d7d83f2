//! The file of a campaign: limits of the pulses, the states in which faults are injected, the faults and what each must lead to.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use super::fault::{Expected, Fault, Reaction};
use super::groups::{Core, Interrupts};
use crate::judge::Limits;
use crate::random::Random;
use crate::script::Inject;

/// A campaign.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Campaign {
    /// Moments of the pulse frame at which each fault is injected.
    pub(crate) phases: u32,
    /// What the servos may get.
    pub(crate) limits: Limits,
    /// Presses of the button, which lead from state to state.
    #[serde(rename = "press", default)]
    pub(crate) presses: Vec<Press>,
    /// Presses of the emergency stop: its test.
    #[serde(rename = "emergency_stop", default)]
    pub(crate) emergency_stops: Vec<Press>,
    /// States of the run.
    #[serde(rename = "state")]
    pub(crate) states: Vec<State>,
    /// Single faults.
    #[serde(rename = "fault", default)]
    pub(crate) faults: Vec<Fault>,
    /// Registers, of which every bit is a fault.
    #[serde(rename = "register", default)]
    pub(crate) registers: Vec<Register>,
    /// Parts of the memory, of which bits are drawn at random.
    #[serde(rename = "memory", default)]
    pub(crate) memory: Vec<Memory>,
    /// Registers of the core, of which bits are faults.
    #[serde(rename = "core", default)]
    pub(crate) core: Vec<Core>,
    /// Interrupts, of which each is a fault.
    #[serde(rename = "interrupts", default)]
    pub(crate) interrupts: Vec<Interrupts>,
}

/// A state of the run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct State {
    /// Name.
    pub(crate) name: String,
    /// When the run is in it, s.
    pub(crate) at_s: f64,
    /// Whether the outputs are on in it; a run in which they are not as stated is an error.
    pub(crate) outputs: bool,
}

/// A press of a button.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Press {
    /// When it begins, s.
    pub(crate) at_s: f64,
    /// How long it lasts, s.
    pub(crate) hold_s: f64,
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

/// Bits of the memory, drawn at random: each is a fault that only the limits of the pulses judge.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Memory {
    /// Name.
    pub(crate) name: String,
    /// First address and the one after the last.
    pub(crate) addresses: [u32; 2],
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
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&text).with_context(|| format!("{} is no campaign", path.display()))
    }

    fn parse(text: &str) -> Result<Self> {
        let mut campaign: Campaign = toml::from_str(text)?;
        ensure!((1..=1000).contains(&campaign.phases), "phases is {}; allowed are 1 to 1000", campaign.phases);
        campaign.states.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        campaign.expand()?;
        let known: BTreeSet<&str> = campaign.states.iter().map(|state| state.name.as_str()).collect();
        let mut names = BTreeSet::new();
        for fault in &campaign.faults {
            let Fault { name, states, expect, .. } = fault;
            fault.check().with_context(|| format!("fault `{name}`"))?;
            ensure!(names.insert(name), "two faults have the name `{name}`; allowed is one");
            for state in states {
                ensure!(
                    known.contains(state.as_str()),
                    "fault `{name}`: there is no state `{state}`; the file has {}",
                    known.iter().copied().collect::<Vec<_>>().join(", ")
                );
            }
            ensure!(
                expect.within_ms > 0.0 && expect.within_ms.is_finite(),
                "fault `{name}`: within_ms is {}; allowed is more than 0",
                expect.within_ms
            );
        }
        Ok(campaign)
    }

    /// Makes a fault of each bit of the registers and of the drawn bits of the memory.
    fn expand(&mut self) -> Result<()> {
        for Register { name, address, bits, states, expect } in std::mem::take(&mut self.registers) {
            ensure!(bits.iter().all(|bit| *bit < 32), "register `{name}`: bits {bits:?}; allowed are 0 to 31");
            self.faults.extend(bits.into_iter().map(|bit| {
                let flip = Inject::Flip { address, mask: 1 << bit };
                Fault::lasting(format!("{name}, bit {bit}"), flip, states.clone(), expect)
            }));
        }
        self.faults.extend(std::mem::take(&mut self.core).into_iter().flat_map(Core::faults));
        self.faults.extend(std::mem::take(&mut self.interrupts).into_iter().flat_map(Interrupts::faults));
        for Memory { name, addresses: [first, end], count, states } in std::mem::take(&mut self.memory) {
            ensure!(first < end, "memory `{name}`: addresses {first:#x}..{end:#x}; allowed is the lower one first");
            let mut drawn = BTreeSet::new();
            let mut random = Random(u64::from(first) << 32 | u64::from(end));
            let bits = Range { start: 0, end: u64::from(end - first) * 8 };
            ensure!(u64::from(count) <= bits.end / 2, "memory `{name}`: {count} of {} bits; allowed is half", bits.end);
            while drawn.len() < count as usize {
                drawn.insert(random.number() % bits.end);
            }
            self.faults.extend(drawn.into_iter().map(|bit| {
                let byte = first + (bit / 8) as u32;
                let mask = 1 << (bit % 8) << (byte % 4 * 8);
                let expect = Expected { reaction: Reaction::Any, within_ms: WATCHED_MS };
                let flip = Inject::Flip { address: byte & !3, mask };
                Fault::lasting(format!("{name}, {byte:#010x} bit {}", bit % 8), flip, states.clone(), expect)
            }));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "phases = 2\n[limits]\nleast_us = [523, 523, 523, 523]\nmost_us = [2400, 2400, 2400, 2400]\nus_per_s = [1e3, 1e3, 1e3, 1e3]\n\
                        [[state]]\nname = \"walking\"\nat_s = 3\noutputs = true\n\
                        [[state]]\nname = \"disarmed\"\nat_s = 0.2\noutputs = false\n";

    #[test]
    fn each_bit_is_a_fault_with_a_name() {
        let text = format!(
            "{HEAD}[[register]]\nname = \"TIM1 ARR\"\naddress = 0x4001_002C\nbits = [3, 4, 5]\nstates = [\"walking\"]\n\
             expect = {{ reaction = \"off\", within_ms = 120 }}\n\
             [[memory]]\nname = \"RAM\"\naddresses = [0x2000_0000, 0x2000_0100]\ncount = 50\nstates = [\"walking\"]\n"
        );
        let campaign = Campaign::parse(&text).unwrap();
        let names: Vec<&str> = campaign.faults.iter().take(3).map(|fault| fault.name.as_str()).collect();
        assert_eq!(names, ["TIM1 ARR, bit 3", "TIM1 ARR, bit 4", "TIM1 ARR, bit 5"]);
        assert_eq!(campaign.faults[1].inject, Inject::Flip { address: 0x4001_002C, mask: 16 });
        assert_eq!(campaign.faults.len(), 53);
        for fault in &campaign.faults[3..] {
            let Inject::Flip { address, mask } = fault.inject else { panic!() };
            assert!((0x2000_0000..0x2000_0100).contains(&address) && address % 4 == 0 && mask.count_ones() == 1);
        }
        // The earlier state comes first.
        assert_eq!(campaign.states[0].name, "disarmed");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let fault = |inject: &str, state: &str, within: &str| {
            format!(
                "{HEAD}[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"{state}\"]\n\
                 expect = {{ reaction = \"reset\", within_ms = {within} }}\n"
            )
        };
        assert!(Campaign::parse(&fault("{ hang = \"control_step\" }", "walking", "40")).is_ok());
        assert!(Campaign::parse(&fault("{ volts = { pin = \"PA1\", volts = 3.3 } }", "walking", "40")).is_ok());
        for (text, words) in [
            (fault("\"crystal\"", "flying", "40"), "there is no state `flying`; the file has disarmed, walking"),
            (fault("\"crystal\"", "walking", "0"), "within_ms is 0; allowed is more than 0"),
            (fault("\"quake\"", "walking", "40"), "unknown variant `quake`"),
            (fault("{ level = { pin = \"PX1\", high = true } }", "walking", "40"), "is not the name of a pin"),
            (HEAD.replace("phases = 2", "phases = 0"), "phases is 0; allowed are 1 to 1000"),
        ] {
            let error = format!("{:#}", Campaign::parse(&text).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
