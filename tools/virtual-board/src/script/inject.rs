//! What can happen to the board: the words of scripts and campaigns, and their allowed values.

use anyhow::{Result, ensure};
use serde::Deserialize;

use super::values::{Cause, CoreRegister, HIGHEST_LSI_HZ, Memory, RttReader, Stream};
use crate::nvic::{EXCEPTIONS, Nvic};
use crate::pin_name::PinName;
use crate::waveform::Wave;

/// What happens.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Inject {
    /// The function never returns.
    Hang(String),
    /// The function executes an undefined instruction.
    Undefined(String),
    /// The program panics.
    Panic,
    /// The crystal stops.
    Crystal,
    /// The converter loses a result.
    Overrun,
    /// A DMA transfer fails.
    Transfer,
    /// The timer that triggers the conversions stops.
    Trigger,
    /// Bits of a word change, of a register or in RAM.
    Flip {
        /// Address of the word.
        address: u32,
        /// The bits.
        mask: u32,
    },
    /// Bits of the word in RAM that has this value change: of each, if there are copies.
    FlipWord {
        /// The value.
        value: u32,
        /// The bits.
        mask: u32,
    },
    /// The analogue supply becomes this voltage.
    Supply(f64),
    /// A pin of the converter gets this voltage.
    Volts {
        /// The pin.
        pin: PinName,
        /// V.
        volts: f64,
    },
    /// An input gets this level.
    Level {
        /// The pin.
        pin: PinName,
        /// High or low.
        high: bool,
    },
    /// An instruction takes so many cycles.
    Slow(f64),
    /// A debugger halts the core.
    Halt,
    /// The oscillator of the watchdog gets this frequency, Hz; 0 stops it.
    Lsi(f64),
    /// The frequency of the oscillator of the watchdog changes evenly.
    LsiDrift {
        /// To this frequency, Hz.
        to_hz: f64,
        /// In this time, ms.
        over_ms: f64,
    },
    /// The crystal has this frequency, Hz.
    CrystalHz(f64),
    /// The frequency of the crystal changes evenly.
    CrystalDrift {
        /// To this frequency, Hz.
        to_hz: f64,
        /// In this time, ms.
        over_ms: f64,
    },
    /// The PLL loses its lock: its output has this part of its frequency; 0: it stops.
    Pll(f64),
    /// The supply of the chip, and with it the analogue supply, becomes this voltage.
    Vdd(f64),
    /// The power goes off, and comes back at the end.
    PowerCycle {
        /// What becomes of the RAM.
        ram: Memory,
        /// Draws its content.
        #[serde(default)]
        seed: u64,
    },
    /// The reset button is pressed, and released at the end.
    ResetButton,
    /// The chip is reset at once.
    Reset(Cause),
    /// A sector of the flash is erased, as by a debugger.
    FlashErase {
        /// Number of the sector.
        sector: u32,
        /// The power is lost so long after the start, ms.
        cut_ms: Option<f64>,
    },
    /// A word of the flash is programmed, as by a debugger.
    FlashProgram {
        /// Address of the word.
        address: u32,
        /// The word.
        value: u32,
        /// The power is lost so long after the start, us.
        cut_us: Option<f64>,
    },
    /// A half-word of the flash reads as this from now on, without an operation of the flash.
    Flash {
        /// Its address, even.
        address: u32,
        /// What it reads as.
        half: u16,
    },
    /// The requests of a DMA stream are not served.
    TransferStall(Stream),
    /// A DMA stream takes a request without a transfer.
    TransferLost(Stream),
    /// Conversions of ADC1 do not end.
    ConversionStall,
    /// Each result of ADC1 is this code.
    StuckCode(u16),
    /// Bits of each result of ADC1 are stuck.
    StuckBits {
        /// Always 0.
        #[serde(default)]
        low: u16,
        /// Always 1.
        #[serde(default)]
        high: u16,
    },
    /// A bit of a register of the core changes.
    CoreFlip {
        /// The register.
        register: CoreRegister,
        /// The bit.
        bit: u32,
    },
    /// A register of the core gets a value.
    CoreSet {
        /// The register.
        register: CoreRegister,
        /// The value.
        value: u32,
    },
    /// An exception becomes pending that nothing has requested.
    Exception {
        /// Its number: 2 to 15 those of the core, 16 and more the interrupts.
        number: u8,
        /// It is enabled too.
        #[serde(default)]
        enable: bool,
    },
    /// A word is written to a register of a peripheral or of the core, such as a counter.
    Write {
        /// Address of the register.
        address: u32,
        /// The word.
        value: u32,
    },
    /// An input gets a waveform.
    Wave(Wave),
    /// The debugger reads the log otherwise.
    Rtt(RttReader),
}

/// Frequencies of a crystal that the model takes, Hz.
const CRYSTAL_HZ: std::ops::RangeInclusive<f64> = 1e6..=50e6;

/// Addresses of the flash.
const FLASH: std::ops::Range<u32> = 0x0800_0000..0x0810_0000;

impl Inject {
    /// Checks the values.
    ///
    /// # Errors
    /// One is not allowed: which, and what is.
    pub(crate) fn check(&self) -> Result<()> {
        let positive = |what: &str, value: f64| {
            ensure!(value > 0.0 && value.is_finite(), "{what} is {value}; allowed is more than 0");
            Ok(())
        };
        let in_volts = |what: &str, volts: f64| {
            ensure!((0.0..=4.0).contains(&volts), "{what} is {volts}; allowed are 0 to 4 V");
            Ok(())
        };
        match self {
            Inject::CrystalHz(hz) | Inject::CrystalDrift { to_hz: hz, .. } if !CRYSTAL_HZ.contains(hz) => {
                anyhow::bail!("the crystal has {hz} Hz; allowed are 1e6 to 50e6");
            }
            Inject::CrystalDrift { over_ms, .. } => positive("over_ms", *over_ms),
            Inject::Pll(factor) => {
                ensure!((0.0..=2.0).contains(factor), "pll is {factor}; allowed are 0 to 2");
                Ok(())
            }
            Inject::Supply(volts) => in_volts("supply", *volts),
            Inject::Vdd(volts) => in_volts("vdd", *volts),
            Inject::Volts { volts, .. } => in_volts("volts", *volts),
            Inject::Slow(cpi) => {
                ensure!((0.1..=100.0).contains(cpi), "slow is {cpi}; allowed are 0.1 to 100 cycles an instruction");
                Ok(())
            }
            Inject::LsiDrift { to_hz: hz, over_ms } => {
                Inject::Lsi(*hz).check()?;
                positive("over_ms", *over_ms)
            }
            Inject::Lsi(hz) => {
                ensure!((0.0..=HIGHEST_LSI_HZ).contains(hz), "lsi is {hz}; allowed are 0 to {HIGHEST_LSI_HZ} Hz");
                Ok(())
            }
            Inject::FlashErase { sector, cut_ms } => {
                ensure!(*sector <= 11, "sector is {sector}; allowed are 0 to 11");
                cut_ms.map_or(Ok(()), |ms| positive("cut_ms", ms))
            }
            Inject::FlashProgram { address, cut_us, .. } => {
                ensure!(
                    FLASH.contains(address) && address.is_multiple_of(4),
                    "address is {address:#010x}; allowed are multiples of 4 from 0x08000000 to 0x080ffffc"
                );
                cut_us.map_or(Ok(()), |us| positive("cut_us", us))
            }
            Inject::Flash { address, .. } => {
                ensure!(
                    FLASH.contains(address) && address.is_multiple_of(2),
                    "address is {address:#010x}; allowed are even ones from 0x08000000 to 0x080ffffe"
                );
                Ok(())
            }
            Inject::TransferStall(Stream { controller, stream })
            | Inject::TransferLost(Stream { controller, stream }) => {
                ensure!((1..=2).contains(controller), "controller is {controller}; allowed are 1 and 2");
                ensure!(*stream <= 7, "stream is {stream}; allowed are 0 to 7");
                Ok(())
            }
            Inject::StuckCode(code) => {
                ensure!(*code <= 0xFFF, "stuck-code is {code}; allowed are 0 to 4095");
                Ok(())
            }
            Inject::StuckBits { low, high } => {
                ensure!(
                    low | high != 0 && low | high <= 0xFFF && low & high == 0,
                    "stuck-bits has low {low:#x} and high {high:#x}; allowed are different bits of 0xfff, at least one"
                );
                Ok(())
            }
            Inject::CoreFlip { bit, .. } => {
                ensure!(*bit <= 31, "bit is {bit}; allowed are 0 to 31");
                Ok(())
            }
            Inject::Exception { number, .. } => {
                ensure!(
                    *number > 1 && Nvic::exists(*number),
                    "number is {number}; allowed are 2 to {}, of which those from 16 on are the interrupts",
                    EXCEPTIONS - 1
                );
                Ok(())
            }
            Inject::Write { address, .. } | Inject::Flip { address, .. } => {
                ensure!(address.is_multiple_of(4), "address is {address:#010x}; allowed are multiples of 4");
                Ok(())
            }
            Inject::Wave(wave) => wave.check(),
            _ => Ok(()),
        }
    }

    /// Name in the output, as in the file.
    pub(crate) const fn name(&self) -> &'static str {
        match self {
            Inject::Hang(_) => "hang",
            Inject::Undefined(_) => "undefined",
            Inject::Panic => "panic",
            Inject::Crystal => "crystal",
            Inject::Overrun => "overrun",
            Inject::Transfer => "transfer",
            Inject::Trigger => "trigger",
            Inject::Flip { .. } => "flip",
            Inject::FlipWord { .. } => "flip-word",
            Inject::Supply(_) => "supply",
            Inject::Volts { .. } => "volts",
            Inject::Level { .. } => "level",
            Inject::Slow(_) => "slow",
            Inject::Halt => "halt",
            Inject::Lsi(_) => "lsi",
            Inject::LsiDrift { .. } => "lsi-drift",
            Inject::CrystalHz(_) => "crystal-hz",
            Inject::CrystalDrift { .. } => "crystal-drift",
            Inject::Pll(_) => "pll",
            Inject::Vdd(_) => "vdd",
            Inject::PowerCycle { .. } => "power-cycle",
            Inject::ResetButton => "reset-button",
            Inject::Reset(_) => "reset",
            Inject::FlashErase { .. } => "flash-erase",
            Inject::FlashProgram { .. } => "flash-program",
            Inject::Flash { .. } => "flash",
            Inject::TransferStall(_) => "transfer-stall",
            Inject::TransferLost(_) => "transfer-lost",
            Inject::ConversionStall => "conversion-stall",
            Inject::StuckCode(_) => "stuck-code",
            Inject::StuckBits { .. } => "stuck-bits",
            Inject::CoreFlip { .. } => "core-flip",
            Inject::CoreSet { .. } => "core-set",
            Inject::Exception { .. } => "exception",
            Inject::Write { .. } => "write",
            Inject::Wave(_) => "wave",
            Inject::Rtt(_) => "rtt",
        }
    }

    /// Whether it may end a pulse early by itself.
    pub(crate) const fn can_cut_a_pulse(&self) -> bool {
        matches!(
            self,
            Inject::Vdd(_)
                | Inject::Pll(_)
                | Inject::PowerCycle { .. }
                | Inject::ResetButton
                | Inject::Reset(_)
                | Inject::Write { .. }
                | Inject::Wave(_)
        )
    }

    /// Whether it can end before the run does.
    pub(crate) const fn can_end(&self) -> bool {
        matches!(
            self,
            Inject::Hang(_)
                | Inject::Supply(_)
                | Inject::Volts { .. }
                | Inject::Level { .. }
                | Inject::Slow(_)
                | Inject::Halt
                | Inject::Lsi(_)
                | Inject::LsiDrift { .. }
                | Inject::CrystalHz(_)
                | Inject::CrystalDrift { .. }
                | Inject::Pll(_)
                | Inject::Vdd(_)
                | Inject::PowerCycle { .. }
                | Inject::ResetButton
                | Inject::TransferStall(_)
                | Inject::ConversionStall
                | Inject::StuckCode(_)
                | Inject::StuckBits { .. }
                | Inject::Wave(_)
                | Inject::Rtt(_)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Inject> {
        #[derive(Deserialize)]
        struct One {
            inject: Inject,
        }
        let inject = toml::from_str::<One>(&format!("inject = {text}"))?.inject;
        inject.check()?;
        Ok(inject)
    }

    #[test]
    fn each_kind_is_read() {
        for (text, name) in [
            ("{ crystal-hz = 8.08e6 }", "crystal-hz"),
            ("{ crystal-drift = { to_hz = 8.4e6, over_ms = 500 } }", "crystal-drift"),
            ("{ pll = 0.5 }", "pll"),
            ("{ lsi-drift = { to_hz = 25e3, over_ms = 500 } }", "lsi-drift"),
            ("{ vdd = 2.7 }", "vdd"),
            ("{ power-cycle = { ram = \"scrambled\", seed = 7 } }", "power-cycle"),
            ("\"reset-button\"", "reset-button"),
            ("{ flash-erase = { sector = 1, cut_ms = 20 } }", "flash-erase"),
            ("{ flash-program = { address = 0x0800_4000, value = 0 } }", "flash-program"),
            ("{ transfer-stall = { controller = 2, stream = 0 } }", "transfer-stall"),
            ("{ transfer-lost = { controller = 2, stream = 0 } }", "transfer-lost"),
            ("\"conversion-stall\"", "conversion-stall"),
            ("{ stuck-code = 4095 }", "stuck-code"),
            ("{ stuck-bits = { high = 1 } }", "stuck-bits"),
            ("{ core-flip = { register = \"r12\", bit = 31 } }", "core-flip"),
            ("{ core-set = { register = \"sp\", value = 0x1000 } }", "core-set"),
            ("{ exception = { number = 97, enable = true } }", "exception"),
            ("{ exception = { number = 2 } }", "exception"),
            ("{ reset = \"window-watchdog\" }", "reset"),
            ("{ flash = { address = 0x080F_FFFE, half = 0 } }", "flash"),
            ("{ write = { address = 0xE000_1004, value = 0xFFFF_FF00 } }", "write"),
            ("{ wave = { pin = \"PA0\", hz = 40.0 } }", "wave"),
            ("{ wave = { pin = \"PA0\", edges_ms = [0, 5.5, 9] } }", "wave"),
            ("{ rtt = \"byte\" }", "rtt"),
        ] {
            assert_eq!(parse(text).map(|inject| inject.name()).map_err(|error| format!("{text}: {error}")), Ok(name));
        }
    }

    #[test]
    fn what_is_not_allowed_is_named_with_what_is() {
        for (text, words) in [
            ("{ crystal-hz = 0.0 }", "allowed are 1e6 to 50e6"),
            ("{ crystal-drift = { to_hz = 8e6, over_ms = 0.0 } }", "over_ms is 0"),
            ("{ pll = -1.0 }", "allowed are 0 to 2"),
            ("{ lsi-drift = { to_hz = 2e5, over_ms = 500.0 } }", "lsi is 200000"),
            ("{ vdd = nan }", "allowed are 0 to 4 V"),
            ("{ supply = 3300.0 }", "supply is 3300; allowed are 0 to 4 V"),
            ("{ volts = { pin = \"PA1\", volts = 1500.0 } }", "volts is 1500; allowed are 0 to 4 V"),
            ("{ power-cycle = { ram = \"half\" } }", "expected `kept` or `scrambled`"),
            ("{ flash-erase = { sector = 12 } }", "allowed are 0 to 11"),
            ("{ flash-program = { address = 0x2000_0000, value = 0 } }", "from 0x08000000"),
            ("{ transfer-stall = { controller = 0, stream = 0 } }", "allowed are 1 and 2"),
            ("{ transfer-lost = { controller = 1, stream = 8 } }", "allowed are 0 to 7"),
            ("{ stuck-code = 4096 }", "allowed are 0 to 4095"),
            ("{ stuck-bits = { low = 1, high = 1 } }", "different bits"),
            ("{ core-flip = { register = \"r13\", bit = 0 } }", "r0 to r12, sp, lr and pc"),
            ("{ core-flip = { register = \"r01\", bit = 0 } }", "r0 to r12, sp, lr and pc"),
            ("{ core-flip = { register = \"r1\", bit = 32 } }", "allowed are 0 to 31"),
            ("{ exception = { number = 98 } }", "allowed are 2 to 97"),
            ("{ exception = { number = 1 } }", "allowed are 2 to 97"),
            ("{ reset = \"fire\" }", "`window-watchdog`"),
            ("{ flash = { address = 0x0810_0000, half = 0 } }", "to 0x080ffffe"),
            ("{ flash = { address = 0x0800_0001, half = 0 } }", "allowed are even ones"),
            ("{ write = { address = 1, value = 0 } }", "multiples of 4"),
            ("{ wave = { pin = \"PA0\" } }", "edges_ms or hz"),
            ("{ wave = { pin = \"PA0\", khz = 1 } }", "unknown field `khz`"),
            ("{ rtt = \"slowly\" }", "expected `stopped` or `byte`"),
            (
                "{ flash-erase = { sector = 1, cut = 20 } }",
                "unexpected keys in table: cut, available keys: sector, cut_ms",
            ),
        ] {
            let error = format!("{:#}", parse(text).unwrap_err());
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
