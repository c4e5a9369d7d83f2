//! The records of a board in what it sends: in the raw bytes of its log, in the lines that `probe-rs` prints of it, or in the frames of its
//! serial port.

use wire::{DecodeError, Record};

use crate::board::image::{Decoder, Image};
use crate::board::serial::{LinkError, Records};
use crate::board::telemetry::{RecordError, record_in};

/// Fewest damaged frames for the error that the log is of another image.
const ENOUGH_DAMAGED: u64 = 16;

/// Messages without any record for the same error: a board sends 200 records a second.
const ENOUGH_STRANGE: u64 = 40;

/// Longest line that is waited for: a record has three characters a byte, and a place is around it.
const LONGEST_LINE: usize = 8192;

/// What a board sent.
// It is passed on at once; nothing keeps many.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Heard {
    /// A record.
    Record(Record),
    /// A line of the log for people. Those without a level repeat a record.
    Text {
        /// `info`, `warn`, `error` ...; empty if the line has no level.
        level: String,
        /// The text.
        text: String,
    },
    /// A frame that cannot be read. The next one is not affected.
    Damaged,
}

/// What comes is not from the image or the program that it is read with.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TransportError {
    /// The log is not of this ELF file.
    #[error(
        "{damaged} malformed frames in the log, {strange} without a record, and {records} records: the board runs another image than this ELF file, \
         or the bytes are not of RTT channel 0; give the ELF file that was flashed"
    )]
    OtherImage {
        /// Frames that cannot be read.
        damaged: u64,
        /// Messages of the log that hold no record.
        strange: u64,
        /// Records.
        records: u64,
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

/// How the records come.
enum Coding<'t> {
    /// In the raw log of an image.
    Log(Box<Decoder<'t>>, &'t Image),
    /// In a log that was decoded already: the line that is not yet whole.
    Lines(Vec<u8>),
    /// In frames of the serial port.
    Serial(Box<Records>),
}

/// Finds the records in bytes of a board.
pub struct Transport<'t> {
    coding: Coding<'t>,
    records: u64,
    damaged: u64,
    strange: u64,
}

impl<'t> Transport<'t> {
    /// For the raw bytes of the log of this image.
    #[must_use]
    pub fn log(image: &'t Image) -> Self {
        Self::of(Coding::Log(Box::new(image.decoder()), image))
    }

    /// For the lines of a log that `probe-rs` has decoded.
    #[must_use]
    pub fn lines() -> Self {
        Self::of(Coding::Lines(Vec::new()))
    }

    /// For the serial port.
    #[must_use]
    pub fn serial() -> Self {
        Self::of(Coding::Serial(Box::default()))
    }

    fn of(coding: Coding<'t>) -> Self {
        Self { coding, records: 0, damaged: 0, strange: 0 }
    }

    /// Discards an unfinished frame, after a reset or a new connection.
    pub fn restart(&mut self) {
        match &mut self.coding {
            Coding::Log(decoder, _) => decoder.restart(),
            Coding::Lines(line) => line.clear(),
            Coding::Serial(records) => **records = Records::default(),
        }
    }

    /// Takes bytes, and passes on what they hold.
    ///
    /// # Errors
    /// [`TransportError`]; what came before has been passed on.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(Heard)) -> Result<(), TransportError> {
        let mut found = Vec::new();
        match &mut self.coding {
            Coding::Log(decoder, _) => {
                decoder.push(bytes);
                while let Some(message) = decoder.message() {
                    found.push(message.map_or(Ok(Heard::Damaged), |message| in_message(message.level, message.text)));
                }
            }
            Coding::Lines(line) => {
                for byte in bytes {
                    match byte {
                        b'\n' => found.push(in_line(&String::from_utf8_lossy(&std::mem::take(line)))),
                        _ if line.len() < LONGEST_LINE => line.push(*byte),
                        _ => {}
                    }
                }
            }
            Coding::Serial(records) => found.extend(records.push(bytes).into_iter().map(in_frame)),
        }
        for heard in found {
            let heard = heard?;
            match heard {
                Heard::Record(_) => self.records += 1,
                Heard::Text { .. } => self.strange += 1,
                Heard::Damaged => self.damaged += 1,
            }
            self.check_board(&heard)?;
            each(heard);
            self.judge()?;
        }
        Ok(())
    }

    fn check_board(&self, heard: &Heard) -> Result<(), TransportError> {
        match (&self.coding, heard) {
            (Coding::Log(_, image), Heard::Record(Record::Boot(boot))) if !image.is_of_board(&boot.board) => {
                Err(TransportError::OtherBoard { board: boot.board.as_str().into() })
            }
            _ => Ok(()),
        }
    }

    /// A serial port has a check sum in each frame, and needs no image.
    fn judge(&self) -> Result<(), TransportError> {
        let Self { ref coding, records, damaged, strange } = *self;
        let is_damaged = damaged >= ENOUGH_DAMAGED && damaged > records;
        let is_strange = records == 0 && damaged + strange >= ENOUGH_STRANGE;
        match coding {
            Coding::Log(..) | Coding::Lines(_) if is_damaged || is_strange => {
                Err(TransportError::OtherImage { damaged, strange, records })
            }
            _ => Ok(()),
        }
    }
}

/// A line of `probe-rs`, in its format `{L} {s}` or its own: the level may be its first word.
fn in_line(line: &str) -> Result<Heard, TransportError> {
    let line = line.trim_end();
    let (first, rest) = line.split_once(' ').unwrap_or((line, ""));
    match first {
        "TRACE" | "DEBUG" | "INFO" | "WARN" | "ERROR" => in_message(first.to_lowercase(), rest.trim_start().into()),
        _ => in_message(String::new(), line.into()),
    }
}

fn in_message(level: String, text: String) -> Result<Heard, TransportError> {
    match record_in(&text) {
        None => Ok(Heard::Text { level, text }),
        Some(Ok(record)) => Ok(Heard::Record(record)),
        Some(Err(RecordError::Bytes(error @ DecodeError::Version { .. }))) => Err(TransportError::OtherVersion(error)),
        Some(Err(_)) => Ok(Heard::Damaged),
    }
}

fn in_frame(frame: Result<Record, LinkError>) -> Result<Heard, TransportError> {
    match frame {
        Ok(record) => Ok(Heard::Record(record)),
        Err(LinkError::Record(error @ DecodeError::Version { .. })) => Err(TransportError::OtherVersion(error)),
        Err(_) => Ok(Heard::Damaged),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::telemetry::printed;
    use wire::{Edge, MAX_FRAME_BYTES, frame_record};

    fn edge(tick: u32) -> Record {
        Record::Edge(Edge { tick, offset_us: 0, high: true, lost_before: false })
    }

    fn heard(transport: &mut Transport<'_>, bytes: &[u8]) -> (Vec<Heard>, Result<(), TransportError>) {
        let mut all = Vec::new();
        let result = transport.push(bytes, |heard| all.push(heard));
        (all, result)
    }

    #[test]
    fn lines_of_probe_rs_are_read_in_pieces_of_any_size() {
        let text = format!(
            "INFO  ready\n<lvl> {}\n0.5 [INFO ] {} (main.rs:1)\n wire [05\n",
            printed(&edge(1)),
            printed(&edge(2))
        );
        let info = Heard::Text { level: "info".into(), text: "ready".into() };
        let wanted = [info, Heard::Record(edge(1)), Heard::Record(edge(2)), Heard::Damaged];
        for piece in 1..text.len() {
            let mut transport = Transport::lines();
            let all: Vec<Heard> =
                text.as_bytes().chunks(piece).flat_map(|bytes| heard(&mut transport, bytes).0).collect();
            assert_eq!(all, wanted, "{piece}");
        }
    }

    /// Of another image a decoder makes lines, but no records.
    #[test]
    fn lines_without_records_are_of_another_image() {
        let mut transport = Transport::lines();
        let (_, result) = heard(&mut transport, "INFO something\n".repeat(39).as_bytes());
        assert_eq!(result, Ok(()));
        let (_, result) = heard(&mut transport, b"INFO something\n");
        assert!(result.unwrap_err().to_string().contains("another image than this ELF file"));
        let (_, result) = heard(&mut Transport::lines(), format!("{}\n", printed(&edge(1))).repeat(200).as_bytes());
        assert_eq!(result, Ok(()));
    }

    #[test]
    fn another_version_is_refused_and_a_damaged_frame_is_not() {
        let (_, result) = heard(&mut Transport::lines(), b"wire [00, 63, 01]\n");
        assert_eq!(result, Err(TransportError::OtherVersion(DecodeError::Version { board: 99 })));
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = frame_record(&edge(3), &mut buffer).unwrap();
        let mut bytes = [frame, frame].concat();
        bytes[frame.len() + 3] ^= 1;
        let (all, result) = heard(&mut Transport::serial(), &bytes);
        assert_eq!((all[0].clone(), all[1].clone(), result), (Heard::Record(edge(3)), Heard::Damaged, Ok(())));
    }
}
