//! Messages in the Common Data Representation, little endian (OMG DDSI-RTPS 2.3, 10.5), as ROS 2 has them.

/// A message that is written from its beginning.
pub(super) struct Cdr(pub(super) Vec<u8>);

impl Cdr {
    pub(super) fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    /// A number lies at a multiple of its size, counted from behind the first four bytes.
    pub(super) fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        while !(self.0.len() - 4).is_multiple_of(N) {
            self.0.push(0);
        }
        self.0.extend(bytes);
    }

    pub(super) fn count(&mut self, count: usize) {
        self.number((count as u32).to_le_bytes());
    }

    pub(super) fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}
