//! What an injection holds until it ends. Two that hold the same thing at the same time would end each other.

use std::fmt;

use anyhow::{Result, ensure};
use stm32f4_model::Pin;

use super::event::Span;
use super::values::Stream;
use super::{Inject, Script};
use crate::inject::InjectionKind;
use crate::modelled_board::Wiring;

/// What is held.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Target {
    /// Volts or level of a pin.
    Pin(Pin),
    /// The supply of the chip, or its analogue part.
    Supply,
    /// The frequency of the crystal.
    Crystal,
    /// The frequency of the watchdog's oscillator.
    LowSpeedOscillator,
    /// The frequency of the PLL.
    Pll,
    /// The cycles of an instruction.
    Core,
    /// The reset pin.
    ResetPin,
    /// The results of the converter.
    Results,
    /// The conversions.
    Conversions,
    /// The requests of a stream.
    Stream(Stream),
    /// The reader of the log.
    Log,
    /// The function at an address.
    Function(u32),
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pin(pin) => write!(f, "the pin {pin}"),
            Self::Supply => f.write_str("the supply"),
            Self::Crystal => f.write_str("the crystal"),
            Self::LowSpeedOscillator => f.write_str("the low speed oscillator"),
            Self::Pll => f.write_str("the PLL"),
            Self::Core => f.write_str("the speed of the core"),
            Self::ResetPin => f.write_str("the reset pin"),
            Self::Results => f.write_str("the results of the converter"),
            Self::Conversions => f.write_str("the conversions"),
            Self::Stream(Stream { controller, stream }) => write!(f, "stream {stream} of DMA{controller}"),
            Self::Log => f.write_str("the reader of the log"),
            Self::Function(address) => write!(f, "the function at {address:#010x}"),
        }
    }
}

impl InjectionKind {
    /// What it holds; `None` if it happens in an instant.
    pub(crate) const fn target(&self) -> Option<Target> {
        Some(match self {
            Self::Hang(address) => Target::Function(*address),
            Self::Supply(_) => Target::Supply,
            Self::Volts(pin, _) | Self::Level(pin, _) => Target::Pin(*pin),
            Self::Slow(_) | Self::Halt => Target::Core,
            Self::LowSpeedClock(_) | Self::Other(Inject::LsiDrift { .. }) => Target::LowSpeedOscillator,
            Self::Other(Inject::CrystalHz(_) | Inject::CrystalDrift { .. }) => Target::Crystal,
            Self::Other(Inject::Pll(_)) => Target::Pll,
            Self::Other(Inject::Vdd(_) | Inject::PowerCycle { .. }) => Target::Supply,
            Self::Other(Inject::ResetButton) => Target::ResetPin,
            Self::Other(Inject::TransferStall(stream)) => Target::Stream(*stream),
            Self::Other(Inject::ConversionStall) => Target::Conversions,
            Self::Other(Inject::StuckCode(_) | Inject::StuckBits { .. }) => Target::Results,
            Self::Other(Inject::Wave(wave)) => Target::Pin(wave.pin.0),
            Self::Other(Inject::Rtt(_)) => Target::Log,
            _ => return None,
        })
    }

    /// Checks that the pin, if it names one, takes what is injected.
    ///
    /// # Errors
    /// The pin is an output of the board, or no input of the converter: which pins are allowed.
    pub(crate) fn check_pin(&self, wiring: &Wiring) -> Result<()> {
        match self {
            Self::Volts(pin, _) => ensure!(
                is_converted(*pin),
                "{pin} is no input of the converter; allowed are PA0 to PA7, PB0, PB1 and PC0 to PC5; `level` sets a digital input"
            ),
            Self::Level(pin, _) => check_input(*pin, wiring)?,
            Self::Other(Inject::Wave(wave)) => check_input(wave.pin.0, wiring)?,
            _ => {}
        }
        Ok(())
    }
}

/// Whether ADC1 has the pin as a channel: the data sheets of both chips have the same 16.
fn is_converted(pin: Pin) -> bool {
    match pin.port() {
        'A' => pin.number() <= 7,
        'B' => pin.number() <= 1,
        'C' => pin.number() <= 5,
        _ => false,
    }
}

fn check_input(pin: Pin, wiring: &Wiring) -> Result<()> {
    let outputs: Vec<Pin> = wiring.servos.iter().chain([&wiring.rail]).chain(wiring.lamps).copied().collect();
    let names: Vec<String> = outputs.iter().map(ToString::to_string).collect();
    ensure!(
        !outputs.contains(&pin),
        "{pin} is an output of the board, which drives it; allowed are all pins but its outputs {}",
        names.join(", ")
    );
    Ok(())
}

/// Refuses events of which one certainly ends another: the same target at the same time, with moments that can be compared. Where they
/// cannot, the run refuses it as soon as it happens.
///
/// # Errors
/// Both events, and when they overlap.
pub(super) fn check_overlaps(script: &Script, kinds: &[InjectionKind]) -> Result<()> {
    for (n, (event, kind)) in script.events.iter().zip(kinds).enumerate() {
        let Some(target) = kind.target() else { continue };
        ensure!(
            event.times == 1 || event.for_s.is_none_or(|lasts| lasts <= event.every_s),
            "the event {event} overlaps itself on {target}: for_ms is longer than every_ms; make it shorter"
        );
        for (other, _) in
            script.events.iter().zip(kinds).skip(n + 1).filter(|(_, kind)| kind.target().as_ref() == Some(&target))
        {
            let is_comparable = event.moment.base() == other.moment.base() && event.phase_us == other.phase_us;
            if let Some(at) = first_overlap(event.spans(), other.spans()).filter(|_| is_comparable) {
                anyhow::bail!(
                    "the events {event} and {other} overlap on {target}, {at:.6} s after their moment: the end of one would end the other; \
                     move or shorten one of them"
                );
            }
        }
    }
    Ok(())
}

/// When a span of one event begins to overlap with one of the other. Those of an event follow each other and last equally long, so the earlier of two
/// that do not overlap meets none of the later ones.
fn first_overlap(ones: impl Iterator<Item = Span>, others: impl Iterator<Item = Span>) -> Option<f64> {
    let (mut ones, mut others) = (ones.peekable(), others.peekable());
    loop {
        let (one, other) = (*ones.peek()?, *others.peek()?);
        if let Some(at) = overlap(one, other) {
            return Some(at);
        }
        if one.0 <= other.0 {
            ones.next()
        } else {
            others.next()
        };
    }
}

/// When two spans begin to overlap; `None` if they do not, or if neither ends: then the later one holds.
fn overlap(one: Span, two: Span) -> Option<f64> {
    let has_end = one.1.is_some() || two.1.is_some();
    let begins = one.0.max(two.0);
    let goes_on = |span: Span| span.1.is_none_or(|end| end > begins + 1e-9);
    (has_end && goes_on(one) && goes_on(two)).then_some(begins)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pin(name: &str) -> Pin {
        name.parse().expect("a pin")
    }

    #[test]
    fn spans_overlap_where_one_of_them_ends_within_the_other() {
        assert_eq!(overlap((1.0, Some(2.0)), (1.5, Some(3.0))), Some(1.5));
        assert_eq!(overlap((1.0, None), (1.5, Some(3.0))), Some(1.5));
        assert_eq!(overlap((1.0, Some(2.0)), (2.0, Some(3.0))), None);
        assert_eq!(overlap((1.0, None), (2.0, None)), None, "the later one holds");
        assert_eq!(overlap((3.0, None), (1.0, Some(2.0))), None);
    }

    #[test]
    fn the_first_overlap_of_two_rows_of_spans_is_found() {
        let row = |from: f64, every: f64, lasts: f64, times: u32| {
            (0..times).map(move |n| from + f64::from(n) * every).map(move |at| (at, Some(at + lasts)))
        };
        // As found by comparing each with each.
        for shift in 0..40 {
            let (ones, others) = (|| row(0.0, 1.0, 0.2, 7), || row(f64::from(shift) * 0.11, 0.7, 0.1, 9));
            let each = ones().flat_map(|one| others().filter_map(move |other| overlap(one, other)));
            let first = each.fold(None, |least: Option<f64>, at| Some(least.map_or(at, |least| least.min(at))));
            assert_eq!(first_overlap(ones(), others()), first, "{shift}");
        }
        let many = 100_000;
        assert_eq!(first_overlap(row(0.0, 1.0, 0.2, many), row(0.5, 1.0, 0.2, many)), None);
    }

    #[test]
    fn a_pin_takes_only_what_it_can_have() {
        let wiring = Wiring::default();
        let error = |kind: InjectionKind| kind.check_pin(&wiring).err().map(|error| error.to_string());
        assert_eq!(error(InjectionKind::Volts(pin("PC5"), 1.0)), None);
        let digital = error(InjectionKind::Volts(pin("PB12"), 1.0)).expect("refused");
        assert!(digital.contains("PB12 is no input of the converter; allowed are PA0 to PA7"), "{digital}");
        assert_eq!(error(InjectionKind::Level(pin("PB12"), false)), None);
        for output in ["PE9", "PC8", "PD14"] {
            let output = error(InjectionKind::Level(pin(output), true)).expect("refused");
            assert!(output.contains("is an output of the board") && output.contains("PE11"), "{output}");
        }
    }
}
