//! Reads values of the Common Data Representation, in which ROS 2 writes its messages.
//!
//! A message begins with four bytes: 0, the byte order, and two bytes of options. Behind them each number is at a multiple of its own
//! size, counted from the end of these four bytes (OMG CORBA 3.3, part 2, 9.3; OMG DDSI-RTPS 2.3, 10.5).

/// A message that is read from its beginning.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

/// A sequence of texts, and the bytes that it was read from.
#[derive(Debug, Default)]
pub(super) struct Texts {
    pub(super) texts: Vec<String>,
    bytes: Vec<u8>,
    is_big_endian: bool,
}

impl<'a> Cdr<'a> {
    pub(super) fn new(message: &'a [u8]) -> Result<Self, String> {
        let is_big_endian = match message {
            [0, 0, _, _, ..] => true,
            [0, 1, _, _, ..] => false,
            [a, b, _, _, ..] => {
                return Err(format!(
                    "its encapsulation is {a:02x} {b:02x}; allowed are 00 00 (CDR, big endian) and 00 01 (CDR, little endian)"
                ));
            }
            _ => return Err(format!("has {} bytes; allowed are 4 or more", message.len())),
        };
        Ok(Self { bytes: &message[4..], at: 0, is_big_endian })
    }

    #[inline]
    fn take(&mut self, bytes: usize, what: &str) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(bytes);
        let taken = end.and_then(|end| self.bytes.get(self.at..end)).ok_or_else(|| {
            let have = self.bytes.len();
            format!("{what} needs {bytes} bytes at {}, and the message has {have}; allowed is a whole message", self.at)
        })?;
        self.at += bytes;
        Ok(taken)
    }

    #[inline]
    fn number<const N: usize>(&mut self, what: &str) -> Result<[u8; N], String> {
        self.at = self.at.next_multiple_of(N);
        let mut number = [0; N];
        number.copy_from_slice(self.take(N, what)?);
        if self.is_big_endian {
            number.reverse();
        }
        Ok(number)
    }

    pub(super) fn u32(&mut self, what: &str) -> Result<u32, String> {
        self.number(what).map(u32::from_le_bytes)
    }

    pub(super) fn i32(&mut self, what: &str) -> Result<i32, String> {
        self.number(what).map(i32::from_le_bytes)
    }

    /// A text with its length in front and a zero byte at its end.
    #[inline]
    pub(super) fn text(&mut self, what: &str) -> Result<&'a str, String> {
        let length = self.u32(what)? as usize;
        let bytes = self.take(length, what)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map_err(|_| format!("{what} is no text; allowed is UTF-8"))
    }

    /// The number of elements of a sequence, each of which takes `least` bytes or more.
    fn count(&mut self, least: usize, what: &str) -> Result<usize, String> {
        let count = self.u32(what)? as usize;
        let most = (self.bytes.len() - self.at) / least;
        if count > most {
            return Err(format!("{what} has {count} elements; allowed are up to {most} in the rest of the message"));
        }
        Ok(count)
    }

    /// A sequence of texts; `None` if it is that of `before`, which most messages have in common: comparing is faster than reading.
    pub(super) fn new_texts(&mut self, before: &Texts, what: &str) -> Result<Option<Texts>, String> {
        // From a multiple of 4 the places of the numbers in the sequence are those of any other message.
        let begin = self.at.next_multiple_of(4);
        let is_before = |rest: &[u8]| !before.bytes.is_empty() && rest.starts_with(&before.bytes);
        if self.is_big_endian == before.is_big_endian && self.bytes.get(begin..).is_some_and(is_before) {
            self.at = begin + before.bytes.len();
            return Ok(None);
        }
        let count = self.count(4, what)?;
        let texts = (0..count).map(|_| self.text(what).map(str::to_owned)).collect::<Result<_, _>>()?;
        let bytes = self.bytes[begin..self.at].to_vec();
        Ok(Some(Texts { texts, bytes, is_big_endian: self.is_big_endian }))
    }

    pub(super) fn f64s(&mut self, what: &str) -> Result<Vec<f64>, String> {
        (0..self.count(8, what)?).map(|_| self.number(what).map(f64::from_le_bytes)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two bytes of text push the double to the next multiple of 8 behind the encapsulation, not behind the beginning.
    #[test]
    fn numbers_are_aligned_behind_the_encapsulation() {
        let little =
            [&[0, 1, 0, 0, 2, 0, 0, 0, b'a', 0, 0xee, 0xee, 1, 0, 0, 0][..], &[0xee; 4], &2.5_f64.to_le_bytes()];
        let big = [&[0, 0, 0, 0, 0, 0, 0, 2, b'a', 0, 0xee, 0xee, 0, 0, 0, 1][..], &[0xee; 4], &2.5_f64.to_be_bytes()];
        for message in [little.concat(), big.concat()] {
            let mut cdr = Cdr::new(&message).unwrap();
            assert_eq!((cdr.text("name").unwrap(), cdr.f64s("position").unwrap()), ("a", vec![2.5]));
            for end in 0..message.len() {
                let read =
                    Cdr::new(&message[..end]).and_then(|mut cdr| cdr.text("name").and_then(|_| cdr.f64s("position")));
                assert!(read.unwrap_err().contains("allowed"), "{end} bytes");
            }
        }
        assert!(Cdr::new(&[0, 3, 0, 0]).err().unwrap().contains("its encapsulation is 00 03"));
    }

    #[test]
    fn a_count_is_compared_with_the_rest_of_the_message() {
        let error = Cdr::new(&[0, 1, 0, 0, 255, 255, 255, 255]).unwrap().f64s("position").unwrap_err();
        assert_eq!(error, "position has 4294967295 elements; allowed are up to 0 in the rest of the message");
    }
}
