//! Pins: port letter A to I and number 0 to 15.

use core::fmt;
use core::str::FromStr;

/// Number of GPIO ports of the F407 (A to I).
pub const PORTS: usize = 9;

/// One pin, for example `PA8`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pin {
    port: u8,
    number: u8,
}

impl Pin {
    /// Returns the pin of a port `'A'..='I'` with a number 0 to 15; `None` outside of these ranges.
    ///
    /// ```
    /// use stm32f4_model::Pin;
    /// let pin = Pin::new('A', 8).unwrap();
    /// assert_eq!(pin.to_string(), "PA8");
    /// assert_eq!("pd12".parse(), Ok(Pin::new('D', 12).unwrap()));
    /// assert!(Pin::new('K', 0).is_none() && Pin::new('A', 16).is_none());
    /// ```
    #[must_use]
    pub const fn new(port: char, number: u8) -> Option<Self> {
        let letter = port.to_ascii_uppercase();
        if letter >= 'A' && letter <= 'I' && number < 16 {
            Some(Pin { port: letter as u8 - b'A', number })
        } else {
            None
        }
    }

    /// Port as an index: A is 0, I is 8.
    #[must_use]
    pub const fn port_index(self) -> usize {
        self.port as usize
    }

    /// Port as a letter, `'A'` to `'I'`.
    #[must_use]
    pub const fn port(self) -> char {
        (b'A' + self.port) as char
    }

    /// Number of the pin in its port, 0 to 15.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.number
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "P{}{}", self.port(), self.number)
    }
}

/// Error: the text is not the name of a pin; allowed is `PA0` to `PI15`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownPin(
    /// The rejected text.
    pub String,
);

impl fmt::Display for UnknownPin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` is not the name of a pin; expected P, a port letter A to I and a number 0 to 15, for example PA1",
            self.0
        )
    }
}

impl std::error::Error for UnknownPin {}

impl FromStr for Pin {
    type Err = UnknownPin;

    fn from_str(text: &str) -> Result<Self, UnknownPin> {
        let unknown = || UnknownPin(text.to_owned());
        let mut letters = text.chars();
        if !matches!(letters.next(), Some('P' | 'p')) {
            return Err(unknown());
        }
        let port = letters.next().ok_or_else(unknown)?;
        let digits = letters.as_str();
        // `u8::from_str` alone would accept `+8` and `08`.
        if digits.is_empty() || digits.len() > 2 || !digits.bytes().all(|b| b.is_ascii_digit()) {
            return Err(unknown());
        }
        if digits.len() == 2 && digits.starts_with('0') {
            return Err(unknown());
        }
        digits.parse().ok().and_then(|number| Pin::new(port, number)).ok_or_else(unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pin_names_are_accepted() {
        for name in ["PA0", "pb9", "PI15", "Pc10"] {
            assert_eq!(name.parse::<Pin>().map(|pin| pin.to_string()), Ok(name.to_ascii_uppercase()));
        }
        for text in ["", "P", "PA", "A1", "PJ1", "PA16", "PA01", "PA+1", "PA1x", "PA001", "PA 1", "PÄ1", "P1"] {
            let error = text.parse::<Pin>();
            assert_eq!(error, Err(UnknownPin(text.to_owned())));
            assert!(error.is_err_and(|error| error.to_string().contains("A to I")));
        }
    }
}
