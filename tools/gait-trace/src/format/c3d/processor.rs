//! The three number formats of C3D files.

/// The number format of a file, given by the fourth byte of the parameter section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Processor {
    /// 84: little-endian, IEEE 754.
    Intel,
    /// 85: little-endian integers, floats of the VAX (F format: 16-bit words swapped, exponent two more).
    Dec,
    /// 86: big-endian, IEEE 754.
    Mips,
}

impl Processor {
    pub(crate) const fn of_byte(byte: u8) -> Option<Self> {
        match byte {
            84 => Some(Self::Intel),
            85 => Some(Self::Dec),
            86 => Some(Self::Mips),
            _ => None,
        }
    }

    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Intel => "Intel",
            Self::Dec => "DEC",
            Self::Mips => "MIPS",
        }
    }

    pub(crate) const fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Intel | Self::Dec => u16::from_le_bytes(bytes),
            Self::Mips => u16::from_be_bytes(bytes),
        }
    }

    pub(crate) fn f32(self, bytes: [u8; 4]) -> f32 {
        let [a, b, c, d] = bytes;
        match self {
            Self::Intel => f32::from_le_bytes(bytes),
            Self::Mips => f32::from_be_bytes(bytes),
            // The VAX's mantissa is 0.1xxx and its bias 128, IEEE's 1.xxx and 127: a factor of 4.
            Self::Dec => f32::from_le_bytes([c, d, a, b]) / 4.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_bit_patterns_give_known_numbers() {
        assert_eq!(Processor::Intel.f32([0x00, 0x00, 0x80, 0x3f]), 1.0);
        assert_eq!(Processor::Mips.f32([0x3f, 0x80, 0x00, 0x00]), 1.0);
        // VAX F_floating: 1.0 is 0x00004080, its low word first.
        assert_eq!(Processor::Dec.f32([0x80, 0x40, 0x00, 0x00]), 1.0);
        assert_eq!(Processor::Dec.f32([0x80, 0xc0, 0x00, 0x00]), -1.0);
        assert_eq!(Processor::Dec.f32([0; 4]), 0.0);
        assert_eq!(Processor::Mips.u16([1, 2]), 258);
        assert_eq!(Processor::Dec.u16([1, 2]), 513);
    }
}
