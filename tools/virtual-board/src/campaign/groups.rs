//! Groups of faults: bits of registers, of a word in RAM, bits of the registers of the core, exceptions, bits of the memory.

use std::collections::BTreeSet;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use super::fault::{Expected, Fault};
use crate::random::Random;
use crate::script::{CoreRegister, Inject};

/// Bits of a register of a peripheral: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Register {
    /// Name.
    name: String,
    /// Address.
    address: u32,
    /// The bits.
    bits: Vec<u32>,
    /// States in which they apply.
    states: Vec<String>,
    /// What each must lead to.
    expect: Expected,
    /// The same in the states whose outputs are off, if it is another.
    #[serde(default)]
    at_rest: Option<Expected>,
}

impl Register {
    pub(super) fn faults(self) -> Result<Vec<Fault>> {
        let Register { name, address, bits, states, expect, at_rest } = self;
        ensure!(bits.iter().all(|bit| *bit < 32), "register `{name}`: bits {bits:?}; allowed are 0 to 31");
        let fault = |bit: u32| {
            let flip = Inject::Flip { address, mask: 1 << bit };
            Fault::lasting([&name, &format!("{name}, bit {bit}")], flip, &states, &expect, at_rest.as_ref())
        };
        Ok(bits.into_iter().map(fault).collect())
    }
}

/// Bits of the word in RAM that has a value: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Word {
    /// Name.
    name: String,
    /// Its value in these states.
    value: u32,
    /// States in which they apply.
    states: Vec<String>,
    /// What each must lead to.
    expect: Expected,
}

impl Word {
    pub(super) fn faults(self) -> Vec<Fault> {
        let Word { name, value, states, expect } = self;
        let fault = |bit: u32| {
            let flip = Inject::FlipWord { value, mask: 1 << bit };
            Fault::lasting([&name, &format!("{name}, bit {bit}")], flip, &states, &expect, None)
        };
        (0..32).map(fault).collect()
    }
}

/// Bits of registers of the core: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Core {
    /// Name.
    name: String,
    /// The registers.
    registers: Vec<CoreRegister>,
    /// The bits of each.
    bits: Vec<u32>,
    /// States in which they apply.
    states: Vec<String>,
    /// What each must lead to; without it only the limits of the pulses judge.
    #[serde(default)]
    expect: Option<Expected>,
    /// The same in the states whose outputs are off, if it is another.
    #[serde(default)]
    at_rest: Option<Expected>,
}

impl Core {
    pub(super) fn faults(self) -> Vec<Fault> {
        let Core { name, registers, bits, states, expect, at_rest } = self;
        let expect = expect.unwrap_or(Expected::PULSES_ALONE);
        let mut faults = Vec::new();
        for register in registers {
            let group = format!("{name} {register}");
            faults.extend(bits.iter().map(|&bit| {
                let flip = Inject::CoreFlip { register, bit };
                Fault::lasting([&group, &format!("{group}, bit {bit}")], flip, &states, &expect, at_rest.as_ref())
            }));
        }
        faults
    }
}

/// Exceptions that nothing has requested: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Exceptions {
    /// Name.
    name: String,
    /// Their numbers: 2 to 15 those of the core, 16 and more the interrupts.
    numbers: Vec<u8>,
    /// They are enabled too.
    #[serde(default)]
    enable: bool,
    /// States in which they apply.
    states: Vec<String>,
    /// What each must lead to.
    expect: Expected,
    /// The same in the states whose outputs are off, if it is another.
    #[serde(default)]
    at_rest: Option<Expected>,
}

impl Exceptions {
    pub(super) fn faults(self) -> Vec<Fault> {
        let Exceptions { name, numbers, enable, states, expect, at_rest } = self;
        let fault = |number| {
            let inject = Inject::Exception { number, enable };
            Fault::lasting([&name, &format!("{name}, {number}")], inject, &states, &expect, at_rest.as_ref())
        };
        numbers.into_iter().map(fault).collect()
    }
}

/// Bits of the memory, drawn at random: each is a fault that only the limits of the pulses judge.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Memory {
    /// Name.
    name: String,
    /// Symbols of the image: at the first address, and after the last.
    symbols: [String; 2],
    /// How many bits.
    count: u32,
    /// States in which they apply.
    states: Vec<String>,
}

impl Memory {
    pub(super) fn faults(self, address_of: impl Fn(&str) -> Option<u32>) -> Result<Vec<Fault>> {
        let Memory { name, symbols, count, states } = self;
        let address = |symbol: &str| {
            address_of(symbol).with_context(|| format!("memory `{name}`: the image has no symbol `{symbol}`"))
        };
        let (first, end) = (address(&symbols[0])?, address(&symbols[1])?);
        ensure!(first < end, "memory `{name}`: addresses {first:#x}..{end:#x}; allowed is the lower one first");
        let bits = u64::from(end - first) * 8;
        ensure!(u64::from(count) <= bits / 2, "memory `{name}`: {count} of {bits} bits; allowed is half");
        let mut drawn = BTreeSet::new();
        let mut random = Random(u64::from(first) << 32 | u64::from(end));
        while drawn.len() < count as usize {
            drawn.insert(random.number() % bits);
        }
        let fault = |bit: u64| {
            let byte = first + (bit / 8) as u32;
            let flip = Inject::Flip { address: byte & !3, mask: 1 << (bit % 8) << (byte % 4 * 8) };
            Fault::lasting(
                [&name, &format!("{name}, {byte:#010x} bit {}", bit % 8)],
                flip,
                &states,
                &Expected::PULSES_ALONE,
                None,
            )
        };
        Ok(drawn.into_iter().map(fault).collect())
    }
}
