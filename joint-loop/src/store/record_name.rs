//! The name of a record: what a person calls a generator, sensors or a robot. The board's boot line shows it.

use core::fmt;

/// Name of a record: 1 to 24 bytes of UTF-8 without control characters.
///
/// ```
/// use joint_loop::store::record_name::{RecordName, RecordNameError};
/// assert_eq!(RecordName::new("normal walk")?.as_str(), "normal walk");
/// assert_eq!(RecordName::new(""), Err(RecordNameError::Empty));
/// assert_eq!(RecordName::new("a name of more than 24 bytes"), Err(RecordNameError::Long { bytes: 28 }));
/// assert_eq!(RecordName::new("two\nlines"), Err(RecordNameError::Control));
/// # Ok::<(), RecordNameError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct RecordName {
    /// The text, then zeros.
    bytes: [u8; Self::MAX_BYTES],
}

/// Why a text is no name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecordNameError {
    /// It is empty.
    Empty,
    /// It has more than [`RecordName::MAX_BYTES`].
    Long {
        /// Bytes of the text.
        bytes: usize,
    },
    /// It has a control character, such as a line feed.
    Control,
}

impl fmt::Display for RecordNameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("the name is empty")?,
            Self::Long { bytes } => write!(f, "the name has {bytes} bytes")?,
            Self::Control => f.write_str("the name has a control character")?,
        }
        write!(f, "; allowed are 1 to {} bytes of text on one line", RecordName::MAX_BYTES)
    }
}

impl core::error::Error for RecordNameError {}

impl RecordName {
    /// Most bytes of a name.
    pub const MAX_BYTES: usize = 24;

    /// Name of what a board runs where a sector is erased.
    pub const BUILT_IN: Self = Self::literal("built-in");

    /// A name in the program. In a constant, a text that is too long stops the build.
    pub(crate) const fn literal(text: &str) -> Self {
        let (text, mut bytes, mut place) = (text.as_bytes(), [0; Self::MAX_BYTES], 0);
        while place < text.len() {
            bytes[place] = text[place];
            place += 1;
        }
        Self { bytes }
    }

    /// Checks a text.
    ///
    /// # Errors
    /// [`RecordNameError`] says what is wrong.
    pub fn new(text: &str) -> Result<Self, RecordNameError> {
        if text.is_empty() {
            return Err(RecordNameError::Empty);
        }
        if text.chars().any(char::is_control) {
            return Err(RecordNameError::Control);
        }
        let mut bytes = [0; Self::MAX_BYTES];
        let place = bytes.get_mut(..text.len()).ok_or(RecordNameError::Long { bytes: text.len() })?;
        for (byte, of_text) in place.iter_mut().zip(text.as_bytes()) {
            *byte = *of_text;
        }
        Ok(Self { bytes })
    }

    /// The name nearest to a text: control characters are left out, and what is beyond 24 bytes; `unnamed` if nothing remains.
    ///
    /// ```
    /// use joint_loop::store::record_name::RecordName;
    /// assert_eq!(RecordName::cut("a name of more than 24 bytes").as_str(), "a name of more than 24 b");
    /// assert_eq!(RecordName::cut("\t\n").as_str(), "unnamed");
    /// ```
    #[must_use]
    pub fn cut(text: &str) -> Self {
        let (mut bytes, mut length) = ([0; Self::MAX_BYTES], 0_usize);
        for character in text.chars().filter(|character| !character.is_control()) {
            let mut encoded = [0; 4];
            let encoded = character.encode_utf8(&mut encoded).as_bytes();
            let end = length.saturating_add(encoded.len());
            let Some(place) = bytes.get_mut(length..end) else { break };
            place.iter_mut().zip(encoded).for_each(|(byte, of_text)| *byte = *of_text);
            length = end;
        }
        if length == 0 { UNNAMED } else { Self { bytes } }
    }

    /// The text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        core::str::from_utf8(text_of(&self.bytes)).unwrap_or("")
    }

    /// The text and zeros, as in a record.
    pub(crate) const fn padded(&self) -> &[u8; Self::MAX_BYTES] {
        &self.bytes
    }

    /// From a record; `None` if it is no name.
    pub(crate) fn read(bytes: &[u8; Self::MAX_BYTES]) -> Option<Self> {
        let name = Self::new(core::str::from_utf8(text_of(bytes)).ok()?).ok()?;
        (name.bytes == *bytes).then_some(name)
    }
}

/// Name of a text without a usable character.
const UNNAMED: RecordName = RecordName::literal("unnamed");

/// The bytes before the first zero.
fn text_of(bytes: &[u8; RecordName::MAX_BYTES]) -> &[u8] {
    let length = bytes.iter().take_while(|byte| **byte != 0).count();
    bytes.get(..length).unwrap_or(&[])
}

impl fmt::Display for RecordName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Debug for RecordName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl core::str::FromStr for RecordName {
    type Err = RecordNameError;

    fn from_str(text: &str) -> Result<Self, RecordNameError> {
        Self::new(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_is_no_name_is_refused() {
        for bytes in [*b"\0name-after-a-zero......", *b"a\0b.....................", [0xFF; 24], [0; 24]] {
            assert_eq!(RecordName::read(&bytes), None, "{bytes:?}");
        }
        assert_eq!(RecordName::read(b"two\nlines\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"), None);
        assert_eq!(RecordName::new(&"é".repeat(13)), Err(RecordNameError::Long { bytes: 26 }));
        let words = RecordNameError::Long { bytes: 26 }.to_string();
        assert_eq!(words, "the name has 26 bytes; allowed are 1 to 24 bytes of text on one line");
    }

    proptest! {
        #[test]
        fn a_name_is_the_text_and_is_read_back(text in "\\PC{0,30}") {
            match RecordName::new(&text) {
                Ok(name) => {
                    prop_assert_eq!(name.as_str(), text.as_str());
                    prop_assert_eq!(RecordName::read(name.padded()), Some(name));
                    prop_assert_eq!(RecordName::cut(&text), name);
                }
                Err(_) => prop_assert!(text.is_empty() || text.len() > 24),
            }
        }

        #[test]
        fn a_cut_text_is_a_name(text in "\\PC{0,30}|[\\x00-\\x1f]{0,9}[a-zé]{0,30}") {
            let cut = RecordName::cut(&text);
            prop_assert_eq!(RecordName::new(cut.as_str()), Ok(cut));
        }
    }
}
