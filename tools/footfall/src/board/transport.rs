//! The records of a board in what it sends: frames, the same ones at its serial port and in RTT channel 1.

use wire::{DecodeError, Record};

use crate::board::serial::{LinkError, Records};

/// Bytes without a record that are not of a board: 6 s of what one sends. Noise ends here, whether it has zeros or not.
const MOST_BYTES_WITHOUT_RECORD: usize = 1 << 16;

/// Frames, each of them damaged, that are not of a board whose first bytes were lost.
const MOST_DAMAGED_AT_FIRST: u64 = 16;

/// What a board sent.
// It is passed on at once; nothing keeps many.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Heard {
    /// A record.
    Record(Record),
    /// A frame that cannot be read. The next one is not affected.
    Damaged,
}

/// What comes is not of a board, or not of this program's version.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TransportError {
    /// No records.
    #[error(
        "{bytes} bytes and no record: these are not the records of a board. They come from its serial port at the right rate, and from RTT channel 1 \
         (with OpenOCD `rtt server start PORT 1`); channel 0 is its log for people, which `probe-rs attach` prints"
    )]
    NoRecords {
        /// Bytes since the last record.
        bytes: usize,
    },
    /// The ELF file is of another board.
    #[error(
        "the board is a {board}, and this ELF file is the image of another board; give the ELF file that was flashed"
    )]
    OtherBoard {
        /// Name of the board, from its boot record.
        board: String,
    },
    /// The board's image was built with another version of the records.
    #[error(transparent)]
    OtherVersion(DecodeError),
}

/// Finds the records in bytes of a board. It keeps one frame at most, and looks at each byte once.
#[derive(Debug, Default)]
pub struct Transport {
    frames: Records,
    /// Bytes since the last record.
    bytes: usize,
    damaged: u64,
    /// A record has come.
    has_record: bool,
}

impl Transport {
    /// Discards an unfinished frame, after a reset or a new connection.
    pub fn restart(&mut self) {
        *self = Self::default();
    }

    /// Takes bytes, and passes on what they hold.
    ///
    /// # Errors
    /// [`TransportError`]; what came before has been passed on.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(Heard)) -> Result<(), TransportError> {
        for byte in bytes {
            self.bytes += 1;
            if let Some(frame) = self.frames.push(*byte) {
                match frame {
                    Ok(record) => {
                        (self.bytes, self.has_record) = (0, true);
                        each(Heard::Record(record));
                    }
                    Err(LinkError::Record(error @ DecodeError::Version { .. })) => {
                        return Err(TransportError::OtherVersion(error));
                    }
                    Err(_) => {
                        self.damaged += 1;
                        each(Heard::Damaged);
                    }
                }
            }
            if self.bytes >= MOST_BYTES_WITHOUT_RECORD || !self.has_record && self.damaged >= MOST_DAMAGED_AT_FIRST {
                return Err(TransportError::NoRecords { bytes: self.bytes });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::{Edge, MAX_FRAME_BYTES, frame_record};

    fn edge(tick: u32) -> Record {
        Record::Edge(Edge { tick, offset_us: 0, high: true, lost_before: false })
    }

    fn framed(record: &Record) -> Vec<u8> {
        frame_record(record, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
    }

    fn heard(transport: &mut Transport, bytes: &[u8]) -> (Vec<Heard>, Result<(), TransportError>) {
        let mut all = Vec::new();
        let result = transport.push(bytes, |heard| all.push(heard));
        (all, result)
    }

    #[test]
    fn a_damaged_frame_is_passed_on_as_that() {
        let frame = framed(&edge(3));
        let mut bytes = [frame.clone(), frame.clone()].concat();
        bytes[frame.len() + 3] ^= 1;
        let (all, result) = heard(&mut Transport::default(), &bytes);
        assert_eq!((all, result), (vec![Heard::Record(edge(3)), Heard::Damaged], Ok(())));
    }

    #[test]
    fn another_version_is_refused() {
        // Version 99, and the CRC-32 of that byte.
        let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&[99]).to_le_bytes();
        let bytes = [&[6, 99][..], &sum, &[0]].concat();
        let (_, result) = heard(&mut Transport::default(), &bytes);
        assert_eq!(result, Err(TransportError::OtherVersion(DecodeError::Version { board: 99 })));
    }

    /// The frames of the log for people have zeros between them; noise may have none.
    #[test]
    fn bytes_without_records_end_soon_and_are_named() {
        let lines: Vec<u8> = (0..40_u8).flat_map(|n| [&[n | 1; 20][..], &[0]].concat()).collect();
        let (all, result) = heard(&mut Transport::default(), &lines);
        assert_eq!(all.len() as u64, MOST_DAMAGED_AT_FIRST);
        assert!(result.unwrap_err().to_string().contains("RTT channel 1"));
        for noise in [0xFF, 0] {
            let mut transport = Transport::default();
            // After records too.
            assert_eq!(heard(&mut transport, &framed(&edge(1))).1, Ok(()));
            let (all, result) = heard(&mut transport, &vec![noise; 1 << 20]);
            assert!(all.is_empty());
            assert_eq!(result, Err(TransportError::NoRecords { bytes: MOST_BYTES_WITHOUT_RECORD }));
        }
    }

    #[test]
    fn records_are_found_again_after_a_restart_and_after_damage() {
        let mut transport = Transport::default();
        let frame = framed(&edge(7));
        assert_eq!(heard(&mut transport, &frame[..4]).0, []);
        transport.restart();
        assert_eq!(heard(&mut transport, &frame).0, [Heard::Record(edge(7))]);
        for _ in 0..100 {
            // Damaged frames between records are no reason to end.
            assert_eq!(heard(&mut transport, &[9, 9, 0]).1, Ok(()));
            assert_eq!(heard(&mut transport, &frame).0, [Heard::Record(edge(7))]);
        }
    }
}
