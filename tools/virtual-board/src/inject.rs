//! Faults put into the unchanged image at a virtual time, and the measure of what they lead to.
//!
//! - hang: the first instruction of a function becomes `b .` (0xE7FE) in the emulated flash. The task that enters it next never leaves.
//! - fault: the first instruction becomes `udf #0` (0xDE00), so that the next entry takes a UsageFault, or a HardFault.
//! - panic: as soon as the core is in thread mode it is made to call the image's own panic function, with a message and a location that
//!   are built below the stack pointer: the image's panic handler then runs as for any panic of its own. Registers hold the arguments as
//!   the function expects them: for `core::panicking::panic` R0 and R1 the message, R2 the `&Location`. A build whose optimiser has removed
//!   unused arguments sees other text; the way to the handler is the same.
//! - hse: the crystal stops.
//! - overrun: a result of ADC1 is lost because the one before was not taken in time.
//! - dma: a transfer of ADC1's stream, the first of DMA2, meets a bus error.
//!
//! Changes to flash are undone when the chip resets: a task that hung once runs again after the watchdog.

use std::str::FromStr;

use crate::cpu::{Cpu, Reg, XPSR_IT};
use crate::pulses::Change;
use crate::report::{self, Reaction};

/// `b .`
pub(crate) const BRANCH_TO_SELF: u16 = 0xE7FE;
/// `udf #0`
pub(crate) const PERMANENTLY_UNDEFINED: u16 = 0xDE00;

/// Longer than between two servo pulses, s.
const STAYS_LOW_S: f64 = 0.05;

/// `SYMBOL@T`: a function and a time in seconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SymbolAt {
    /// The function, as the loader finds it.
    pub(crate) symbol: String,
    /// When, s.
    pub(crate) at: f64,
}

impl FromStr for SymbolAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || format!("`{text}` is not SYMBOL@SECONDS, as in control_tick@2.5");
        let (symbol, at) = text.rsplit_once('@').ok_or_else(wanted)?;
        let at: f64 = at.parse().map_err(|_| wanted())?;
        if symbol.is_empty() || !at.is_finite() || at < 0.0 {
            return Err(wanted());
        }
        Ok(SymbolAt { symbol: symbol.to_owned(), at })
    }
}

/// How a panic function of `core` takes its arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PanicArguments {
    /// Message pointer and length, location.
    MessageAndLocation,
    /// Location alone.
    Location,
}

/// The panic functions to look for, the best first.
pub(crate) const PANIC_FUNCTIONS: [(&str, PanicArguments); 4] = [
    ("core::panicking::panic", PanicArguments::MessageAndLocation),
    ("core::option::unwrap_failed", PanicArguments::Location),
    ("core::panicking::panic_const::panic_const_div_by_zero", PanicArguments::Location),
    ("core::panicking::panic_const::panic_const_add_overflow", PanicArguments::Location),
];

/// What is put in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The function at the address never returns.
    Hang(u32),
    /// The function at the address faults.
    Fault(u32),
    /// The panic function at the address is called.
    Panic(u32, PanicArguments),
    /// The crystal stops.
    Crystal,
    /// A result of ADC1 is lost.
    Overrun,
    /// A transfer of stream 0 of DMA2 fails.
    Transfer,
}

impl Kind {
    /// As the report names it.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Kind::Hang(_) => "hang",
            Kind::Fault(_) => "fault",
            Kind::Panic(..) => "panic",
            Kind::Crystal => "hse",
            Kind::Overrun => "overrun",
            Kind::Transfer => "dma",
        }
    }
}

/// A moment of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stamp {
    /// Virtual time, s.
    pub(crate) seconds: f64,
    /// Instructions executed since power-on.
    pub(crate) instructions: u64,
}

/// One fault to put in, and what became of it.
#[derive(Debug, Clone)]
pub(crate) struct Injection {
    /// What.
    pub(crate) kind: Kind,
    /// The symbol as the user named it, or the function that is called.
    pub(crate) symbol: String,
    /// When it is due, s.
    pub(crate) at: f64,
    /// The half-word of flash that it replaced.
    pub(crate) replaced: Option<u16>,
    injected: Option<Stamp>,
    effect: Option<Stamp>,
    disarmed: Option<Stamp>,
    low: Option<Stamp>,
    reset: Option<Stamp>,
    over: bool,
}

impl Injection {
    /// A fault that is due at `at` seconds.
    #[must_use]
    pub(crate) const fn new(kind: Kind, symbol: String, at: f64) -> Self {
        let nothing = None;
        Injection {
            kind,
            symbol,
            at,
            replaced: None,
            injected: nothing,
            effect: nothing,
            disarmed: nothing,
            low: nothing,
            reset: nothing,
            over: false,
        }
    }

    /// True until it is put in.
    #[must_use]
    pub(crate) const fn waits(&self) -> bool {
        self.injected.is_none()
    }

    /// True when it is in and has not yet shown.
    #[must_use]
    pub(crate) const fn expected(&self) -> bool {
        self.injected.is_some() && self.effect.is_none() && self.reset.is_none()
    }

    /// True once it has shown.
    #[must_use]
    pub(crate) const fn took_effect(&self) -> bool {
        self.effect.is_some()
    }

    /// It is in.
    pub(crate) const fn inject(&mut self, now: Stamp) {
        self.injected = Some(now);
    }

    /// It shows.
    pub(crate) const fn show(&mut self, now: Stamp, armed: bool, any_high: bool) {
        self.effect = Some(now);
        if !armed {
            self.disarmed = Some(now);
        }
        if !any_high {
            self.low = Some(now);
        }
    }

    /// The outputs have changed. True when that ends the observation: the program has recovered and armed them again.
    pub(crate) fn outputs(&mut self, change: Change, now: Stamp) -> bool {
        if self.over || self.effect.is_none_or(|effect| now.seconds < effect.seconds) {
            return false;
        }
        match change {
            Change::High(true) => self.low = None,
            Change::High(false) => self.low = Some(now),
            Change::Armed(true) => self.over = self.disarmed.is_some(),
            Change::Armed(false) => self.disarmed = self.disarmed.or(Some(now)),
        }
        self.over
    }

    /// The chip was reset.
    pub(crate) const fn note_reset(&mut self, now: Stamp) {
        if self.injected.is_some() && self.reset.is_none() && !self.over {
            self.reset = Some(now);
        }
    }

    /// What there is to tell at a time. Pins that have been low for less than two and a half periods while the outputs were never disabled
    /// are only between pulses.
    #[must_use]
    pub(crate) fn reaction(&self, seconds: f64) -> Reaction {
        let low = self.low.filter(|low| self.disarmed.is_some() || seconds - low.seconds > STAYS_LOW_S);
        let after = |stamp: Option<Stamp>| Some(report::micros((stamp?.seconds - self.effect?.seconds) * 1e6));
        let instructions = |stamp: Option<Stamp>| Some(stamp?.instructions - self.effect?.instructions);
        Reaction {
            kind: self.kind.name(),
            symbol: self.symbol.clone(),
            injected_s: self.injected.map(|stamp| report::seconds(stamp.seconds)),
            effect_s: self.effect.map(|stamp| report::seconds(stamp.seconds)),
            disarmed_us: after(self.disarmed),
            disarmed_instructions: instructions(self.disarmed),
            low_us: after(low),
            low_instructions: instructions(low),
            reset_us: after(self.reset),
        }
    }
}

/// Text of an injected panic.
const MESSAGE: &[u8] = b"injected by the virtual board";
/// File name of its location, with the NUL that `core` keeps behind it.
const FILE: &[u8] = b"virtual-board\0";

/// Makes the core call a panic function of the image. False when the stack has no room.
pub(crate) fn call_panic(cpu: &mut impl Cpu, function: u32, arguments: PanicArguments) -> bool {
    // Below the stack pointer, upwards: location, message, file name.
    let sp = cpu.reg(Reg::Sp);
    let location = sp.wrapping_sub(80) & !7;
    let (message, file) = (location + 16, location + 16 + MESSAGE.len() as u32);
    let line_and_column = (1u32, 1u32);
    let words = [file, FILE.len() as u32 - 1, line_and_column.0, line_and_column.1];
    let bytes: Vec<u8> =
        words.iter().flat_map(|word| word.to_le_bytes()).chain(MESSAGE.iter().chain(FILE).copied()).collect();
    if !cpu.write_ram(location, &bytes) {
        return false;
    }
    let return_to = cpu.reg(Reg::Pc) | 1;
    match arguments {
        PanicArguments::MessageAndLocation => {
            cpu.set_reg(Reg::R(0), message);
            cpu.set_reg(Reg::R(1), MESSAGE.len() as u32);
            cpu.set_reg(Reg::R(2), location);
        }
        PanicArguments::Location => cpu.set_reg(Reg::R(0), location),
    }
    let (xpsr, control) = (cpu.reg(Reg::Xpsr), cpu.reg(Reg::Control));
    cpu.set_mode(xpsr & !XPSR_IT, control);
    cpu.set_reg(Reg::Sp, location);
    cpu.set_reg(Reg::Lr, return_to);
    cpu.set_reg(Reg::Pc, function);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(seconds: f64, instructions: u64) -> Stamp {
        Stamp { seconds, instructions }
    }

    #[test]
    fn a_symbol_and_a_time() {
        assert_eq!("a::b@1.5".parse(), Ok(SymbolAt { symbol: "a::b".into(), at: 1.5 }));
        for wrong in ["a", "@1", "a@", "a@x", "a@-1", "a@inf"] {
            let message = wrong.parse::<SymbolAt>().unwrap_err();
            assert!(message.contains(wrong), "{message}");
        }
    }

    #[test]
    fn measures_from_the_effect_to_low_pins_that_stay_low() {
        let mut hang = Injection::new(Kind::Hang(0x0801_0000), "tick".into(), 1.0);
        hang.outputs(Change::High(true), stamp(0.9, 1));
        hang.inject(stamp(1.0, 1_000));
        hang.show(stamp(1.001, 2_000), true, true);
        hang.outputs(Change::High(false), stamp(1.0005, 1_500));
        for (seconds, instructions) in [(1.0, 2_000), (1.02, 3_000)] {
            hang.outputs(Change::High(true), stamp(seconds, instructions));
            hang.outputs(Change::High(false), stamp(seconds + 0.0015, instructions + 100));
        }
        assert!(!hang.outputs(Change::Armed(false), stamp(1.04, 5_000)));
        hang.note_reset(stamp(1.04, 5_000));
        // Armed anew by the user: the pulses from here on are wanted.
        assert!(hang.outputs(Change::Armed(true), stamp(2.0, 9_000)));
        hang.outputs(Change::High(true), stamp(2.0, 9_000));
        let reaction = hang.reaction(2.5);
        assert_eq!(reaction.low_us, Some(20_500.0));
        assert_eq!(reaction.low_instructions, Some(1_100));
        assert_eq!((reaction.disarmed_us, reaction.reset_us), (Some(39_000.0), Some(39_000.0)));
        assert_eq!(reaction.effect_s, Some(1.001));
    }

    #[test]
    fn pins_that_are_low_already_count_from_the_effect() {
        let mut panic = Injection::new(Kind::Panic(0, PanicArguments::Location), "panic".into(), 1.0);
        assert!(panic.waits() && !panic.expected());
        panic.inject(stamp(1.0, 10));
        assert!(panic.expected());
        panic.show(stamp(1.0, 10), true, false);
        panic.outputs(Change::Armed(false), stamp(1.000_002, 60));
        let reaction = panic.reaction(1.001);
        assert_eq!(
            (reaction.low_us, reaction.disarmed_us, reaction.disarmed_instructions),
            (Some(0.0), Some(2.0), Some(50))
        );
    }

    #[test]
    fn a_pause_between_pulses_is_not_low() {
        let mut hang = Injection::new(Kind::Hang(0), "f".into(), 1.0);
        hang.inject(stamp(1.0, 0));
        hang.show(stamp(1.0, 0), true, true);
        hang.outputs(Change::High(false), stamp(1.001, 10));
        assert_eq!(hang.reaction(1.02).low_us, None, "armed, and the next pulse may still come");
        assert_eq!(hang.reaction(1.06).low_us, Some(1_000.0));
    }

    #[test]
    fn what_never_showed_has_no_figures() {
        let mut fault = Injection::new(Kind::Fault(0), "f".into(), 1.0);
        fault.outputs(Change::High(false), stamp(0.5, 5));
        let reaction = fault.reaction(9.0);
        assert_eq!((reaction.injected_s, reaction.effect_s, reaction.low_us), (None, None, None));
    }
}
