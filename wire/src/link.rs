//! Frames on a serial line: consistent overhead byte stuffing, a check sum, a zero at the end.
//!
//! ```text
//! board to host   COBS( version, record, CRC-32 of both ) 0
//! host to board   COBS( version, request, CRC-32 of both ) 0
//! ```
//! The check sum is that of the flash records, CRC-32/ISO-HDLC, lowest byte first. A zero ends a frame and occurs nowhere in it, so that a
//! reader that begins in the middle, or that loses bytes, is right again at the next zero (Cheshire and Baker, IEEE/ACM Trans. Networking 7
//! (1999) 159).
//!
//! ```
//! use joint_loop::tuning::{Action, Request};
//! use wire::{MAX_FRAME_BYTES, Unframer, decode_request, frame_request};
//! let mut buffer = [0; MAX_FRAME_BYTES];
//! let sent = frame_request(&Request { number: 7, action: Action::Stop }, &mut buffer).unwrap();
//! let mut unframer = Unframer::default();
//! let request = sent.iter().find_map(|byte| unframer.push(*byte).map(|payload| decode_request(payload.unwrap())));
//! assert_eq!(request.unwrap().unwrap(), Request { number: 7, action: Action::Stop });
//! ```

use core::fmt;

use cobs::{CobsEncoder, DecodeResult, DecoderState};
use crc::{CRC_32_ISO_HDLC, Crc};
use joint_loop::tuning::Request;
use serde::{Deserialize, Serialize};

use crate::{DecodeError, MAX_BYTES, Record, VERSION, decode, encode};

/// With a table of 1 KiB: without it, the check sums of the serial port took a tenth of what the board executes.
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const CRC_BYTES: usize = 4;

/// Bytes of the version, at most.
const VERSION_BYTES: usize = 3;
const MAX_PAYLOAD_BYTES: usize = VERSION_BYTES + MAX_BYTES;

/// Bytes of the longest frame: version, the longest record, their check sum, one byte for each 254 of them and one more, and a zero on either side.
pub const MAX_FRAME_BYTES: usize = MAX_PAYLOAD_BYTES + CRC_BYTES + (MAX_PAYLOAD_BYTES + CRC_BYTES) / 254 + 3;

/// What a host sends: the version first, as in every version.
#[derive(Serialize, Deserialize)]
struct Versioned(u16, #[serde(with = "crate::request")] Request);

/// Frames a record into a buffer and returns the written part. A buffer of [`MAX_FRAME_BYTES`] is enough for every record; `None` if a
/// shorter one is not.
///
/// A zero stands before a boot record too: it ends a frame that the reset has cut short, which would spoil the record.
pub fn frame_record<'b>(record: &Record, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let mut bytes = [0; MAX_PAYLOAD_BYTES];
    let version = postcard::to_slice(&VERSION, &mut bytes).ok()?.len();
    let written = encode(record, bytes.get_mut(version..)?)?.len();
    let zeros = usize::from(matches!(record, Record::Boot(_)));
    buffer.get_mut(..zeros)?.fill(0);
    let length = frame(bytes.get(..version.saturating_add(written))?, buffer.get_mut(zeros..)?)?.len();
    buffer.get(..zeros.saturating_add(length))
}

/// The same for a request.
pub fn frame_request<'b>(request: &Request, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let mut bytes = [0; MAX_PAYLOAD_BYTES];
    frame(postcard::to_slice(&Versioned(VERSION, *request), &mut bytes).ok()?, buffer)
}

fn frame<'b>(payload: &[u8], buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let mut encoder = CobsEncoder::new(buffer);
    encoder.push(payload).ok()?;
    encoder.push(&CRC.checksum(payload).to_le_bytes()).ok()?;
    let length = encoder.finalize();
    *buffer.get_mut(length)? = 0;
    buffer.get(..=length)
}

/// Why a frame of a host is not a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RequestError {
    /// The host was built with another version of this crate.
    Version {
        /// Version of the host.
        host: u16,
    },
    /// The bytes are no request.
    Malformed,
}

impl fmt::Display for RequestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version { host } => write!(
                f,
                "a request of version {host}; this board takes version {VERSION}: use the `footfall` of the checkout that its image was built from"
            ),
            Self::Malformed => f.write_str("the bytes are no request"),
        }
    }
}

impl core::error::Error for RequestError {}

/// Decodes a record from the payload of a frame.
///
/// # Errors
/// [`DecodeError`]; a record of another version gives [`DecodeError::Version`], whatever follows.
pub fn decode_framed(payload: &[u8]) -> Result<Record, DecodeError> {
    let (board, record) = postcard::take_from_bytes::<u16>(payload).map_err(|_| DecodeError::Empty)?;
    if board == VERSION { decode(record) } else { Err(DecodeError::Version { board }) }
}

/// Decodes a request from the payload of a frame.
///
/// # Errors
/// [`RequestError`]. A request of another version gives [`RequestError::Version`], whatever follows.
pub fn decode_request(payload: &[u8]) -> Result<Request, RequestError> {
    let (host, _) = postcard::take_from_bytes::<u16>(payload).map_err(|_| RequestError::Malformed)?;
    if host != VERSION {
        return Err(RequestError::Version { host });
    }
    match postcard::take_from_bytes::<Versioned>(payload) {
        Ok((Versioned(_, request), [])) => Ok(request),
        _ => Err(RequestError::Malformed),
    }
}

/// Why the bytes before a zero are no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// The zero came inside a group: bytes were lost or damaged.
    Stuffing,
    /// More bytes than the longest frame has.
    Long,
    /// Fewer bytes than a check sum has.
    Short,
    /// The check sum is another one.
    CheckSum,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stuffing => "frame ends inside a group of bytes",
            Self::Long => "frame is longer than the longest record",
            Self::Short => "frame is shorter than its check sum",
            Self::CheckSum => "frame has another check sum than its bytes",
        })
    }
}

impl core::error::Error for FrameError {}

/// Finds frames in a stream of bytes, with no byte kept from one frame to the next.
#[derive(Debug)]
pub struct Unframer {
    state: DecoderState,
    payload: [u8; MAX_PAYLOAD_BYTES + CRC_BYTES],
    length: usize,
    long: bool,
}

impl Default for Unframer {
    fn default() -> Self {
        Self { state: DecoderState::Idle, payload: [0; MAX_PAYLOAD_BYTES + CRC_BYTES], length: 0, long: false }
    }
}

impl Unframer {
    /// Takes the next byte; at the end of a frame, its payload without the check sum. Zeros between frames are nothing.
    ///
    /// # Errors
    /// [`FrameError`]: the bytes up to this zero are no frame. The next frame is not affected.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataContinue(byte)) => {
                match self.payload.get_mut(self.length) {
                    Some(place) => {
                        *place = byte;
                        self.length += 1;
                    }
                    None => self.long = true,
                }
                None
            }
            Ok(DecodeResult::DataComplete) => Some(self.end()),
            Err(_) => {
                (self.length, self.long) = (0, false);
                Some(Err(FrameError::Stuffing))
            }
        }
    }

    fn end(&mut self) -> Result<&[u8], FrameError> {
        let (length, long) = (core::mem::take(&mut self.length), core::mem::take(&mut self.long));
        if long {
            return Err(FrameError::Long);
        }
        let frame = self.payload.get(..length).unwrap_or(&[]);
        let (payload, sum) = frame.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::Short)?;
        if CRC.checksum(payload) == u32::from_le_bytes(*sum) { Ok(payload) } else { Err(FrameError::CheckSum) }
    }
}
