//! Groups of faults of the core: bits of its registers, and interrupts that nothing asked for.

use serde::Deserialize;

use super::fault::{Expected, Fault};
use crate::script::{CoreRegister, Inject};

/// Bits of registers of the core: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Core {
    /// Name.
    name: String,
    /// The registers.
    registers: Vec<CoreRegister>,
    /// The bits of each.
    bits: Vec<u32>,
    /// States in which they apply.
    states: Vec<String>,
    /// What each must lead to.
    expect: Expected,
}

impl Core {
    pub(super) fn faults(self) -> impl Iterator<Item = Fault> {
        let Core { name, registers, bits, states, expect } = self;
        let pairs: Vec<_> =
            registers.into_iter().flat_map(|of| bits.iter().map(move |bit| (of, *bit)).collect::<Vec<_>>()).collect();
        pairs.into_iter().map(move |(register, bit)| {
            let flip = Inject::CoreFlip { register, bit };
            Fault::lasting(format!("{name}, {register} bit {bit}"), flip, states.clone(), expect)
        })
    }
}

/// Interrupts by their numbers: each is a fault.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Interrupts {
    /// Name.
    name: String,
    /// The numbers.
    numbers: Vec<u8>,
    /// They are enabled too.
    #[serde(default)]
    enable: bool,
    /// States in which they apply.
    states: Vec<String>,
    /// What each must lead to.
    expect: Expected,
}

impl Interrupts {
    pub(super) fn faults(self) -> impl Iterator<Item = Fault> {
        let Interrupts { name, numbers, enable, states, expect } = self;
        numbers.into_iter().map(move |number| {
            let inject = Inject::Interrupt { number, enable };
            Fault::lasting(format!("{name}, {number}"), inject, states.clone(), expect)
        })
    }
}
