//! Remote protocol of the Black Magic Probe, version 3: one command a frame, `!...#`, each answered by `&K...#`, `&E...#`, `&P...#` or `&N...#`.
//!
//! Numbers are hexadecimal. Words of AP and DP registers go with their bytes in reverse order, but for the raw access `AR`.

use stm32f4_model::Width;

use super::adi::{DebugBus, DebugPort};
use super::swd::Wire;

/// Name in the answer to the greeting.
const NAME: &str = "Virtual board, Black Magic Probe remote protocol";
/// Version of the protocol.
const VERSION: &str = "3";
/// Frequency of the wire, kHz; a number only.
const FREQUENCY_KHZ: u32 = 4000;
/// Longest memory access of one command, bytes. The probe's buffer has 1,024 characters.
const LONGEST_ACCESS: usize = 512;
/// Longest frame that is kept while its end has not come, bytes.
const LONGEST_FRAME: usize = 4096;
/// The access failed, and the target answered with FAULT.
const ERROR_FAULT: &str = "E401";

/// Frames in a stream of bytes.
#[derive(Debug, Default)]
pub(crate) struct Frames {
    received: Vec<u8>,
}

impl Frames {
    /// Adds bytes that came.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.received.extend_from_slice(bytes);
    }

    /// The next command, without `!` and `#`. What stands before a `!` is skipped.
    pub(crate) fn next(&mut self) -> Option<String> {
        loop {
            let Some(end) = self.received.iter().position(|byte| *byte == b'#') else {
                if self.received.len() > LONGEST_FRAME {
                    self.received.clear();
                }
                return None;
            };
            let frame: Vec<u8> = self.received.drain(..=end).collect();
            if let Some(start) = frame.iter().rposition(|byte| *byte == b'!') {
                return Some(String::from_utf8_lossy(&frame[start + 1..frame.len() - 1]).into_owned());
            }
        }
    }
}

/// Hexadecimal fields of a command, read from left to right.
struct Fields<'a>(&'a str);

impl<'a> Fields<'a> {
    fn take(&mut self, digits: usize) -> Option<u32> {
        let (field, rest) = self.0.split_at_checked(digits)?;
        self.0 = rest;
        u32::from_str_radix(field, 16).ok()
    }

    /// Skips a field whose value has no effect here: the number of the device.
    fn skip(&mut self, digits: usize) -> Option<()> {
        self.take(digits).map(drop)
    }

    /// All that is left as one number.
    fn rest(&mut self) -> Option<u32> {
        u32::from_str_radix(std::mem::take(&mut self.0), 16).ok()
    }

    /// All that is left as so many bytes.
    fn bytes(&mut self, length: usize) -> Option<Vec<u8>> {
        let text = std::mem::take(&mut self.0);
        let is_whole = text.is_ascii() && text.len() == 2 * length;
        is_whole.then(|| (0..length).map(|n| u8::from_str_radix(&text[2 * n..2 * n + 2], 16).ok()).collect())?
    }
}

fn reversed(value: u32) -> String {
    format!("K{:x}", value.swap_bytes())
}

/// Carries out a command; returns the answer as a frame.
pub(crate) fn answer(command: &str, wire: &mut Wire, port: &mut DebugPort, bus: &mut dyn DebugBus) -> String {
    let answer = carry_out(command, wire, port, bus).unwrap_or_else(|| "P0".into());
    format!("&{answer}#")
}

/// `None`: a field is missing or is no number.
fn carry_out(command: &str, wire: &mut Wire, port: &mut DebugPort, bus: &mut dyn DebugBus) -> Option<String> {
    let done = || Some("K0".into());
    let (name, fields) = command.split_at_checked(2)?;
    let mut fields = Fields(fields);
    match name {
        "GA" => Some(format!("K{NAME}")),
        "HC" => Some(format!("K{VERSION}")),
        // Accelerators: ADIv5.
        "HA" => Some("K1".into()),
        // The voltage is a text, V.
        "GV" => Some("K3.0".into()),
        "Gf" => Some(format!("K{FREQUENCY_KHZ:x}")),
        "GZ" => {
            bus.pull_reset_pin(fields.rest()? != 0);
            done()
        }
        "GF" | "GP" | "GE" | "SS" | "SR" => done(),
        "So" => {
            let count = fields.take(2)?;
            let bits = fields.rest()?;
            wire.drive(bits, count, port, bus);
            done()
        }
        "Si" => Some(format!("K{:x}", wire.read(fields.take(2)?))),
        "Ad" => {
            fields.skip(4)?;
            Some(reversed(port.read_dp(fields.take(4)? as u8)))
        }
        "AR" => {
            fields.skip(2)?;
            let (is_read, address, value) = (fields.take(2)? != 0, fields.take(4)?, fields.take(8)?);
            let register = address as u8;
            // Bit 8 of the address: an access port, the one that SELECT names.
            if address & 0x100 != 0 {
                let (number, register) = port.selected(register);
                return Some(if is_read {
                    port.read_ap(number, register, bus).map_or_else(|_| ERROR_FAULT.into(), reversed)
                } else {
                    port.write_ap(number, register, value, bus).map_or(ERROR_FAULT, |()| "K0").into()
                });
            }
            if is_read {
                return Some(reversed(port.read_dp(register)));
            }
            port.write_dp(register, value);
            done()
        }
        "Aa" => {
            fields.skip(2)?;
            let (number, register) = (fields.take(2)? as u8, fields.take(4)? as u8);
            Some(port.read_ap(number, register, bus).map_or_else(|_| ERROR_FAULT.into(), reversed))
        }
        "AA" => {
            fields.skip(2)?;
            let (number, register, value) = (fields.take(2)? as u8, fields.take(4)? as u8, fields.take(8)?);
            Some(port.write_ap(number, register, value.swap_bytes(), bus).map_or(ERROR_FAULT, |()| "K0").into())
        }
        "Am" => {
            // Device, access port and CSW: this chip has one access port, and the width follows from address and length.
            fields.skip(2)?;
            fields.skip(2)?;
            fields.skip(8)?;
            let (address, length) = (fields.take(8)?, fields.take(8)? as usize);
            if length > LONGEST_ACCESS {
                return None;
            }
            let hex = |bytes: Vec<u8>| bytes.iter().fold(String::from("K"), |text, byte| format!("{text}{byte:02x}"));
            Some(port.read_memory(address, length, bus).map_or_else(|_| ERROR_FAULT.into(), hex))
        }
        "AM" => {
            fields.skip(2)?;
            fields.skip(2)?;
            fields.skip(8)?;
            let width = match fields.take(2)? {
                0 => Width::Byte,
                1 => Width::Half,
                2 => Width::Word,
                _ => return None,
            };
            let (address, length) = (fields.take(8)?, fields.take(8)? as usize);
            let bytes = fields.bytes(length)?;
            if length > LONGEST_ACCESS || !length.is_multiple_of(width.bytes() as usize) {
                return None;
            }
            Some(port.write_memory(address, width, &bytes, bus).map_or(ERROR_FAULT, |()| "K0").into())
        }
        // JTAG and all others.
        _ => Some("N0".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::adi::tests::{Memory, powered};
    use super::*;

    fn answers(commands: &[&str]) -> Vec<String> {
        let (mut wire, mut port, mut memory) = (Wire::default(), powered(), Memory::new());
        commands.iter().map(|command| answer(command, &mut wire, &mut port, &mut memory)).collect()
    }

    #[test]
    fn frames_are_found_in_any_pieces() {
        let mut frames = Frames::default();
        let stream = b"+#!GA# !HC#!So08a5#";
        let mut commands = Vec::new();
        for byte in stream {
            frames.push(&[*byte]);
            commands.extend(frames.next());
        }
        assert_eq!(commands, ["GA", "HC", "So08a5"]);
        frames.push(&[b'x'; 5000]);
        assert_eq!(frames.next(), None);
        frames.push(b"!HC#!H");
        assert_eq!((frames.next(), frames.next()), (Some("HC".into()), None));
    }

    #[test]
    fn the_greeting_says_version_3() {
        assert_eq!(
            answers(&["HC", "HA", "GV", "Gf", "JS", "xx", ""])[..],
            ["&K3#", "&K1#", "&K3.0#", "&Kfa0#", "&N0#", "&N0#", "&P0#"]
        );
        assert!(answers(&["GA"])[0].starts_with("&KVirtual board"));
    }

    #[test]
    fn registers_go_with_their_bytes_reversed() {
        let got = answers(&["Ad00ff0000", "Aa000001fc", "AA0000010400000020", "Aa00000104", "AR0000000801000000"]);
        assert_eq!(got, ["&K7714a02b#", "&K11007724#", "&K0#", "&K20#", "&K0#"]);
    }

    #[test]
    fn memory_is_read_and_written() {
        let got = answers(&[
            "Am0000a30000522000000400000004",
            "AM0000a30000520020000004000000040a0b0c0d",
            "AM0000a3000052022000000400000004aabbccdd",
            "Am0000a30000522000000400000004",
            "Am0000a30000520000000000000004",
            "Am0000a30000522000000000000002",
        ]);
        assert_eq!(got, ["&K04050607#", "&K0#", "&K0#", "&Kaabbccdd#", "&E401#", "&K0001#"]);
    }

    #[test]
    fn the_reset_pin_follows() {
        let (mut wire, mut port, mut memory) = (Wire::default(), powered(), Memory::new());
        for command in ["GZ1", "GZ0"] {
            assert_eq!(answer(command, &mut wire, &mut port, &mut memory), "&K0#");
        }
        assert_eq!(memory.reset_pin, [true, false]);
    }

    #[test]
    fn fields_that_are_no_numbers_are_refused() {
        for command in ["Si", "Sizz", "AR00", "Am00", "AM0000a3000052022000000400000004zzzzzzzz", "Amé"] {
            assert_eq!(answers(&[command]), ["&P0#"], "{command}");
        }
        assert_eq!(answers(&["Am0000a30000522000000000000201"]), ["&P0#"], "longer than the probe's buffer");
    }
}
