//! Fault injection at a virtual time into the unchanged image, and measurement of the outcome.
//!
//! - hang: the first instruction of a function becomes `b .` (0xE7FE) in the emulated flash, so that the next call never returns.
//! - fault: the first instruction becomes `udf #0` (0xDE00), so that the next call takes a UsageFault or a HardFault.
//! - panic: in thread mode the core calls the image's own panic function, with a message and a location that are written below the stack
//!   pointer; the image's panic handler then runs as for any other panic. Registers hold the arguments of the function: for
//!   `core::panicking::panic` R0 and R1 the message, R2 the `&Location`. In a build whose optimiser has removed unused arguments the text
//!   differs; the path to the handler is the same.
//! - hse: the crystal stops.
//! - overrun: a result of ADC1 is lost, as if the one before had not been read in time.
//! - dma: a transfer of ADC1's stream, the first of DMA2, fails with a bus error.
//! - trigger: TIM2, which triggers the conversions, stops: no sample comes, and the processor runs on.
//! - halt: a debugger halts the core, which executes nothing until a reset, while timers and watchdog go on.
//! - lsi: the low speed oscillator, which clocks the watchdog, gets another frequency.
//! - register: a word is written to a register of a peripheral, as an electrical disturbance may change it.
//!
//! Changes to flash are undone when the chip resets: a task that hung runs again after the watchdog reset.

use std::str::FromStr;

use anyhow::{Context as _, Result};
use stm32f4_model::Pin;

use crate::cpu::{Cpu, Reg, XPSR_IT};
use crate::judge::{WITH_PULSE_S, WITHOUT_EFFECT_S};
use crate::loader::ProgramImage;
use crate::pulses::{OutputChange, OutputState};
use crate::report::{self, Reaction};
use crate::script::{HIGHEST_LSI_HZ, Inject};

/// `udf #0`
pub(crate) const PERMANENTLY_UNDEFINED: u16 = 0xDE00;

/// Time without a pulse after which the pins count as low, s; longer than the pause between two servo pulses.
const STAYS_LOW_S: f64 = 0.05;

/// `SYMBOL@T`: a function and a time in seconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SymbolAt {
    /// Name of the function.
    pub(crate) symbol: String,
    /// Time, s.
    pub(crate) at: f64,
}

impl FromStr for SymbolAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("`{text}` is not SYMBOL@SECONDS with 0 or more seconds, for example control_tick@2.5");
        let (symbol, at) = text.rsplit_once('@').ok_or_else(expected)?;
        let at: f64 = at.parse().map_err(|_| expected())?;
        if symbol.is_empty() || !at.is_finite() || at < 0.0 {
            return Err(expected());
        }
        Ok(SymbolAt { symbol: symbol.to_owned(), at })
    }
}

/// `ADDRESS=VALUE@T`: a register, a word and a time in seconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RegisterAt {
    /// Address.
    pub(crate) address: u32,
    /// The word.
    pub(crate) value: u32,
    /// Time, s.
    pub(crate) at: f64,
}

impl FromStr for RegisterAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("`{text}` is not ADDRESS=VALUE@SECONDS with a hexadecimal address, for example 0x40010020=0@3");
        let number = |text: &str| match text.strip_prefix("0x") {
            Some(digits) => u32::from_str_radix(digits, 16).map_err(|_| expected()),
            None => text.parse().map_err(|_| expected()),
        };
        let (word, at) = text.rsplit_once('@').ok_or_else(expected)?;
        let (address, value) = word.split_once('=').ok_or_else(expected)?;
        let at: f64 = at.parse().map_err(|_| expected())?;
        if !address.starts_with("0x") || !at.is_finite() || at < 0.0 {
            return Err(expected());
        }
        Ok(RegisterAt { address: number(address)?, value: number(value)?, at })
    }
}

/// `HZ@T`: a frequency of the low speed oscillator and a time in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrequencyAt {
    /// Hz; 0: it stops.
    pub(crate) hz: f64,
    /// Time, s.
    pub(crate) at: f64,
}

impl FromStr for FrequencyAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "`{text}` is not HZ@SECONDS with 0 to {HIGHEST_LSI_HZ} Hz and 0 or more seconds, for example 60000@2.5"
            )
        };
        let (hz, at) = text.split_once('@').ok_or_else(expected)?;
        let [hz, at]: [f64; 2] = [hz.parse().map_err(|_| expected())?, at.parse().map_err(|_| expected())?];
        if !(0.0..=HIGHEST_LSI_HZ).contains(&hz) || !at.is_finite() || at < 0.0 {
            return Err(expected());
        }
        Ok(FrequencyAt { hz, at })
    }
}

/// Arguments of a panic function of `core`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PanicArguments {
    /// Message pointer and length, location.
    MessageAndLocation,
    /// Location only.
    Location,
}

/// Panic functions that can be called, in the order of preference.
const PANIC_FUNCTIONS: [(&str, PanicArguments); 4] = [
    ("core::panicking::panic", PanicArguments::MessageAndLocation),
    ("core::option::unwrap_failed", PanicArguments::Location),
    ("core::panicking::panic_const::panic_const_div_by_zero", PanicArguments::Location),
    ("core::panicking::panic_const::panic_const_add_overflow", PanicArguments::Location),
];

/// The panic function of an image that is called, by its name, and the injection.
///
/// # Errors
/// The image has none of those that can be called.
pub(crate) fn panic_in(image: &ProgramImage) -> Result<(&'static str, InjectionKind)> {
    let find = |(name, arguments)| {
        let (name, address) = image.find_first_function(&[name])?;
        Some((name, InjectionKind::Panic(address, arguments)))
    };
    PANIC_FUNCTIONS.into_iter().find_map(find).with_context(|| {
        format!("the ELF has none of the functions {}", PANIC_FUNCTIONS.map(|(name, _)| name).join(", "))
    })
}

/// Kind of an injected fault.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum InjectionKind {
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
    /// TIM2 stops.
    Trigger,
    /// A debugger halts the core.
    Halt,
    /// The low speed oscillator gets this frequency, Hz.
    LowSpeedClock(f64),
    /// The word is written to the register.
    Register { address: u32, value: u32 },
    /// Bits of a word change: of a register, or in RAM.
    Flip { address: u32, mask: u32 },
    /// The analogue supply becomes this voltage, V.
    Supply(f64),
    /// A pin of the converter gets this voltage, V.
    Volts(Pin, f64),
    /// An input gets this level.
    Level(Pin, bool),
    /// An instruction takes so many cycles.
    Slow(f64),
    /// Something else, by its word in a script.
    Other(Inject),
}

impl InjectionKind {
    /// The kind of what a script or a campaign injects.
    ///
    /// # Errors
    /// The image lacks a function that it names.
    pub(crate) fn of(inject: &Inject, image: &ProgramImage) -> Result<Self> {
        Ok(match inject {
            Inject::Hang(symbol) => InjectionKind::Hang(image.find_function(symbol)?),
            Inject::Undefined(symbol) => InjectionKind::Fault(image.find_function(symbol)?),
            Inject::Panic => panic_in(image)?.1,
            Inject::Crystal => InjectionKind::Crystal,
            Inject::Overrun => InjectionKind::Overrun,
            Inject::Transfer => InjectionKind::Transfer,
            Inject::Trigger => InjectionKind::Trigger,
            Inject::Flip { address, mask } => InjectionKind::Flip { address: *address, mask: *mask },
            Inject::Supply(volts) => InjectionKind::Supply(*volts),
            Inject::Volts { pin, volts } => InjectionKind::Volts(pin.0, *volts),
            Inject::Level { pin, high } => InjectionKind::Level(pin.0, *high),
            Inject::Slow(cpi) => InjectionKind::Slow(*cpi),
            Inject::Halt => InjectionKind::Halt,
            Inject::Lsi(hz) => InjectionKind::LowSpeedClock(*hz),
            other => InjectionKind::Other(other.clone()),
        })
    }

    /// For how long pulses may be wrong by it before the supply of the servos is off, s: only the supply can end those of a changed register or clock,
    /// which the next tick finds; what ends the pulses in hardware takes the supply with it. `None`: the program makes no wrong pulse of it. What it does
    /// by itself, it does at the end of a pulse.
    #[must_use]
    pub(crate) const fn wrong_pulses_s(&self) -> Option<f64> {
        /// The peripherals begin here; below are flash and RAM.
        const PERIPHERALS: u32 = 0x4000_0000;
        match self {
            Self::Flip { address, .. } | Self::Register { address, .. } if *address >= PERIPHERALS => {
                Some(WITHOUT_EFFECT_S)
            }
            // A wrong register of the core can become a wrong write to a peripheral.
            Self::Other(Inject::Pll(_) | Inject::CoreFlip { .. } | Inject::CoreSet { .. }) => Some(WITHOUT_EFFECT_S),
            Self::Crystal => Some(WITH_PULSE_S),
            Self::Other(inject) if inject.can_cut_a_pulse() => Some(WITH_PULSE_S),
            _ => None,
        }
    }

    /// Name in the output.
    #[must_use]
    pub(crate) const fn name(&self) -> &'static str {
        match self {
            InjectionKind::Hang(_) => "hang",
            InjectionKind::Fault(_) => "fault",
            InjectionKind::Panic(..) => "panic",
            InjectionKind::Crystal => "hse",
            InjectionKind::Overrun => "overrun",
            InjectionKind::Transfer => "dma",
            InjectionKind::Trigger => "trigger",
            InjectionKind::Halt => "halt",
            InjectionKind::LowSpeedClock(_) => "lsi",
            InjectionKind::Register { .. } => "register",
            InjectionKind::Flip { .. } => "flip",
            InjectionKind::Supply(_) => "supply",
            InjectionKind::Volts(..) => "volts",
            InjectionKind::Level(..) => "level",
            InjectionKind::Slow(_) => "slow",
            InjectionKind::Other(inject) => inject.name(),
        }
    }
}

/// A point in the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Virtual time, s.
    pub(crate) seconds: f64,
    /// Instructions executed since power-on.
    pub(crate) instructions: u64,
}

/// A fault to inject, and its outcome.
#[derive(Debug, Clone)]
pub(crate) struct Injection {
    /// Kind.
    pub(crate) kind: InjectionKind,
    /// Function as the user gave it, or the panic function, or the peripheral.
    pub(crate) symbol: String,
    /// Time of the injection, s.
    pub(crate) at: f64,
    /// The half-word of flash that the injection replaced.
    pub(crate) replaced: Option<u16>,
    /// Phase of the servo frame at which it is injected, us.
    pub(crate) phase_us: Option<f64>,
    /// How long it lasts, s; `None`: it does not end.
    lasts: Option<f64>,
    injected: Option<Moment>,
    effect: Option<Moment>,
    disarmed: Option<Moment>,
    low: Option<Moment>,
    rail_off: Option<Moment>,
    reset: Option<Moment>,
    closed: bool,
    /// Its end, if it has one that has come, s.
    ended: Option<f64>,
    /// Line of the script that it comes from.
    pub(crate) line: Option<usize>,
    /// Option of the command line that it comes from.
    pub(crate) option: Option<&'static str>,
}

impl Injection {
    /// A fault to inject at `at` seconds.
    #[must_use]
    pub(crate) const fn new(kind: InjectionKind, symbol: String, at: f64) -> Self {
        let nothing = None;
        Injection {
            kind,
            symbol,
            at,
            replaced: None,
            phase_us: None,
            lasts: None,
            injected: nothing,
            effect: nothing,
            disarmed: nothing,
            low: nothing,
            rail_off: nothing,
            reset: nothing,
            closed: false,
            ended: None,
            line: None,
            option: None,
        }
    }

    /// The same, from an option of the command line.
    #[must_use]
    pub(crate) fn of_option(self, option: &'static str) -> Self {
        Injection { option: Some(option), ..self }
    }

    /// The same, from a line of a script.
    #[must_use]
    pub(crate) fn in_line(self, line: usize) -> Self {
        Injection { line: Some(line), ..self }
    }

    /// Whether it holds its target now.
    #[must_use]
    pub(crate) const fn holds(&self) -> bool {
        self.injected.is_some() && self.ended.is_none()
    }

    /// Whether it has an end that has not come.
    #[must_use]
    pub(crate) const fn will_end(&self) -> bool {
        self.lasts.is_some()
    }

    /// The same, which ends after so long, s.
    #[must_use]
    pub(crate) fn lasting(self, seconds: Option<f64>) -> Self {
        Injection { lasts: seconds, ..self }
    }

    /// The same, at a phase of the servo frame, us.
    #[must_use]
    pub(crate) fn in_phase(self, phase_us: Option<f64>) -> Self {
        Injection { phase_us, ..self }
    }

    /// The same, later by so much, s.
    #[must_use]
    pub(crate) fn later(self, seconds: f64) -> Self {
        let at = self.at + seconds;
        Injection { at, ..self }
    }

    /// Time at which something has to be done for it: the injection, or its end, s; `None`: nothing is left to do.
    #[must_use]
    pub(crate) const fn due(&self) -> Option<f64> {
        match (self.injected, self.lasts) {
            (None, _) => Some(self.at),
            (Some(injected), Some(lasts)) => Some(injected.seconds + lasts),
            (Some(_), None) => None,
        }
    }

    /// Records its end.
    pub(crate) const fn note_end(&mut self, seconds: f64) {
        self.lasts = None;
        self.ended = Some(seconds);
    }

    /// True until the injection.
    #[must_use]
    pub(crate) const fn is_pending(&self) -> bool {
        self.injected.is_none()
    }

    /// True if it is injected, but without effect so far.
    #[must_use]
    pub(crate) const fn awaits_effect(&self) -> bool {
        self.injected.is_some() && self.effect.is_none() && self.reset.is_none()
    }

    /// True if it is or was injected, and never had an effect.
    #[must_use]
    pub(crate) const fn was_without_effect(&self) -> bool {
        self.injected.is_some() && self.effect.is_none()
    }

    /// True after it has taken effect.
    #[must_use]
    pub(crate) const fn took_effect(&self) -> bool {
        self.effect.is_some()
    }

    /// Records the injection.
    pub(crate) const fn note_injection(&mut self, now: Moment) {
        self.injected = Some(now);
    }

    /// Records the effect, with the state of the outputs.
    pub(crate) const fn note_effect(&mut self, now: Moment, outputs: OutputState) {
        self.effect = Some(now);
        if !outputs.armed {
            self.disarmed = Some(now);
        }
        if !outputs.high {
            self.low = Some(now);
        }
        if !outputs.rail {
            self.rail_off = Some(now);
        }
    }

    /// Records a change of the outputs. Returns true if it ends the measurement: the program has recovered and armed the outputs again.
    pub(crate) fn note_output(&mut self, change: OutputChange, now: Moment) -> bool {
        if self.closed || self.effect.is_none_or(|effect| now.seconds < effect.seconds) {
            return false;
        }
        match change {
            OutputChange::High(true) => self.low = None,
            OutputChange::High(false) => self.low = Some(now),
            OutputChange::Armed(true) => self.closed = self.disarmed.is_some(),
            OutputChange::Rail(true) => self.rail_off = None,
            OutputChange::Rail(false) => self.rail_off = self.rail_off.or(Some(now)),
            OutputChange::Armed(false) => self.disarmed = self.disarmed.or(Some(now)),
        }
        self.closed
    }

    /// Records a reset of the chip.
    pub(crate) const fn note_reset(&mut self, now: Moment) {
        if self.injected.is_some() && self.reset.is_none() && !self.closed {
            self.reset = Some(now);
        }
    }

    /// Outcome at a time. Pins that are low for less than two and a half periods, with the outputs enabled, count as between pulses.
    #[must_use]
    pub(crate) fn reaction(&self, seconds: f64) -> Reaction {
        let low = self.low.filter(|low| self.disarmed.is_some() || seconds - low.seconds > STAYS_LOW_S);
        let after = |moment: Option<Moment>| Some(report::micros((moment?.seconds - self.effect?.seconds) * 1e6));
        let instructions = |moment: Option<Moment>| Some(moment?.instructions - self.effect?.instructions);
        Reaction {
            kind: self.kind.name(),
            symbol: self.symbol.clone(),
            injected_s: self.injected.map(|moment| report::seconds(moment.seconds)),
            effect_s: self.effect.map(|moment| report::seconds(moment.seconds)),
            ended_s: self.ended.map(report::seconds),
            disarmed_us: after(self.disarmed),
            disarmed_instructions: instructions(self.disarmed),
            low_us: after(low),
            low_instructions: instructions(low),
            rail_us: after(self.rail_off),
            reset_us: after(self.reset),
        }
    }
}

/// Message of an injected panic.
const MESSAGE: &[u8] = b"injected by the virtual board";
/// File name of its location, with the NUL that `core` expects after it.
const FILE: &[u8] = b"virtual-board\0";

/// Makes the core call a panic function of the image. Returns false if the arguments do not fit below the stack pointer.
pub(crate) fn call_panic(cpu: &mut impl Cpu, function: u32, arguments: PanicArguments) -> bool {
    // Below the stack pointer, in ascending order: location, message, file name.
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

    const RUNNING: OutputState = OutputState { armed: true, high: true, rail: true };

    fn moment(seconds: f64, instructions: u64) -> Moment {
        Moment { seconds, instructions }
    }

    #[test]
    fn a_symbol_and_a_time_are_parsed() {
        assert_eq!("a::b@1.5".parse(), Ok(SymbolAt { symbol: "a::b".into(), at: 1.5 }));
        for wrong in ["a", "@1", "a@", "a@x", "a@-1", "a@inf"] {
            let message = wrong.parse::<SymbolAt>().unwrap_err();
            assert!(message.contains(wrong), "{message}");
        }
    }

    #[test]
    fn a_register_a_word_and_a_time_are_parsed() {
        let write = RegisterAt { address: 0x4001_0020, value: 17, at: 2.5 };
        assert_eq!("0x40010020=0x11@2.5".parse(), Ok(write.clone()));
        assert_eq!("0x40010020=17@2.5".parse(), Ok(write));
        for wrong in ["0x40010020=1", "40010020=1@2", "0x40010020@2", "0x1=x@2", "0x1=1@x", "0x1=1@-1"] {
            let message = wrong.parse::<RegisterAt>().unwrap_err();
            assert!(message.contains(wrong), "{message}");
        }
    }

    #[test]
    fn a_frequency_and_a_time_are_parsed() {
        assert_eq!("60000@2.5".parse(), Ok(FrequencyAt { hz: 60_000.0, at: 2.5 }));
        assert_eq!("0@0".parse(), Ok(FrequencyAt { hz: 0.0, at: 0.0 }));
        for wrong in ["60000", "@1", "-1@1", "100001@1", "nan@1", "1@-1", "1@inf"] {
            let message = wrong.parse::<FrequencyAt>().unwrap_err();
            assert!(message.contains(wrong) && message.contains("0 to 100000 Hz"), "{message}");
        }
    }

    #[test]
    fn measures_from_the_effect_to_low_pins_that_stay_low() {
        let mut hang = Injection::new(InjectionKind::Hang(0x0801_0000), "tick".into(), 1.0);
        hang.note_output(OutputChange::High(true), moment(0.9, 1));
        hang.note_injection(moment(1.0, 1_000));
        hang.note_effect(moment(1.001, 2_000), RUNNING);
        hang.note_output(OutputChange::Rail(false), moment(1.002, 2_100));
        hang.note_output(OutputChange::High(false), moment(1.0005, 1_500));
        for (seconds, instructions) in [(1.0, 2_000), (1.02, 3_000)] {
            hang.note_output(OutputChange::High(true), moment(seconds, instructions));
            hang.note_output(OutputChange::High(false), moment(seconds + 0.0015, instructions + 100));
        }
        assert!(!hang.note_output(OutputChange::Armed(false), moment(1.04, 5_000)));
        hang.note_reset(moment(1.04, 5_000));
        // The user has armed again: later pulses are intended.
        assert!(hang.note_output(OutputChange::Armed(true), moment(2.0, 9_000)));
        hang.note_output(OutputChange::High(true), moment(2.0, 9_000));
        let reaction = hang.reaction(2.5);
        assert_eq!(reaction.rail_us, Some(1_000.0));
        assert_eq!(reaction.low_us, Some(20_500.0));
        assert_eq!(reaction.low_instructions, Some(1_100));
        assert_eq!((reaction.disarmed_us, reaction.reset_us), (Some(39_000.0), Some(39_000.0)));
        assert_eq!(reaction.effect_s, Some(1.001));
    }

    #[test]
    fn pins_that_are_low_already_count_from_the_effect() {
        let mut panic = Injection::new(InjectionKind::Panic(0, PanicArguments::Location), "panic".into(), 1.0);
        assert!(panic.is_pending() && !panic.awaits_effect());
        panic.note_injection(moment(1.0, 10));
        assert!(panic.awaits_effect());
        panic.note_effect(moment(1.0, 10), OutputState { high: false, ..RUNNING });
        panic.note_output(OutputChange::Armed(false), moment(1.000_002, 60));
        let reaction = panic.reaction(1.001);
        assert_eq!(
            (reaction.low_us, reaction.disarmed_us, reaction.disarmed_instructions),
            (Some(0.0), Some(2.0), Some(50))
        );
    }

    #[test]
    fn a_pause_between_pulses_is_not_low() {
        let mut hang = Injection::new(InjectionKind::Hang(0), "f".into(), 1.0);
        hang.note_injection(moment(1.0, 0));
        hang.note_effect(moment(1.0, 0), RUNNING);
        hang.note_output(OutputChange::High(false), moment(1.001, 10));
        assert_eq!(hang.reaction(1.02).low_us, None, "armed, and the next pulse may still come");
        assert_eq!(hang.reaction(1.06).low_us, Some(1_000.0));
    }

    #[test]
    fn a_fault_without_effect_has_no_times() {
        let mut fault = Injection::new(InjectionKind::Fault(0), "f".into(), 1.0);
        fault.note_output(OutputChange::High(false), moment(0.5, 5));
        let reaction = fault.reaction(9.0);
        assert_eq!((reaction.injected_s, reaction.effect_s, reaction.low_us), (None, None, None));
    }
}
