//! Records and requests of the wire: what is accepted is sent again with the same meaning.

use crc::{CRC_32_ISO_HDLC, Crc};
use joint_loop::tuning::Request;
use wire::{
    Edge, FrameError, MAX_BYTES, MAX_FRAME_BYTES, Record, Unframer, VERSION, decode, decode_framed, decode_request,
    encode, frame_record, frame_request,
};

/// Records: an accepted one is written in at most as many bytes, which are read as the same record. By their bytes and words, because a number
/// that is not one is not equal to itself.
pub fn record(bytes: &[u8]) {
    match decode(bytes) {
        Ok(record) => {
            let mut buffer = [0; MAX_BYTES];
            let written = encode(&record, &mut buffer).expect("any record fits");
            assert!(written.len() <= bytes.len(), "a longer form of the same numbers at most");
            let again = decode(written).expect("what was written is a record");
            assert_eq!(format!("{again:?}"), format!("{record:?}"));
            let mut frame = [0; MAX_FRAME_BYTES];
            let frame = frame_record(&record, &mut frame).expect("any record fits into a frame");
            let payload = only_payload(frame).expect("what was framed is a frame");
            assert_eq!(format!("{:?}", decode_framed(&payload)), format!("{:?}", Ok::<_, ()>(record)));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Frames of a serial line: no bytes hinder the next frame, and the bytes of a payload come back however it is stuffed.
pub fn frames(bytes: &[u8]) {
    let mut unframer = Unframer::default();
    for byte in bytes {
        if let Some(Ok(payload)) = unframer.push(*byte) {
            let _ = (decode_request(payload), decode_framed(payload));
        }
    }
    // A zero ends whatever was begun; the frame behind it is whole.
    let _ = unframer.push(0);
    let edge = Record::Edge(Edge { tick: 7, offset_us: -3, high: true, lost_before: false });
    let mut buffer = [0; MAX_FRAME_BYTES];
    let frame = frame_record(&edge, &mut buffer).expect("it fits");
    let found = frame.iter().find_map(|byte| unframer.push(*byte).map(|payload| payload.map(decode_framed)));
    assert_eq!(found, Some(Ok(Ok(edge))), "bytes before a frame hinder it");

    let sum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(bytes).to_le_bytes();
    match only_payload(&stuffed(&[bytes, &sum].concat())) {
        Ok(payload) => assert_eq!(payload, bytes),
        Err(error) => {
            assert_eq!(error, FrameError::Long);
            assert!(bytes.len() > MAX_BYTES, "a payload of {} bytes is refused as too long", bytes.len());
        }
    }
}

/// Consistent overhead byte stuffing as its paper defines it, with the zero at the end: independent of the crate that the wire uses.
fn stuffed(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    for group in bytes.split(|byte| *byte == 0) {
        let mut rest = group;
        while rest.len() >= 254 {
            out.push(255);
            out.extend(&rest[..254]);
            rest = &rest[254..];
        }
        out.push(u8::try_from(rest.len() + 1).expect("below 255"));
        out.extend(rest);
    }
    out.push(0);
    out
}

/// The payload of the one frame that these bytes are.
fn only_payload(frame: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut unframer = Unframer::default();
    let mut found = frame.iter().filter_map(|byte| unframer.push(*byte).map(|payload| payload.map(<[u8]>::to_vec)));
    let payload = found.next().expect("a zero ends a frame");
    assert!(found.next().is_none(), "one frame");
    payload
}

/// Requests: an accepted one is framed and read as the same request; its words, as in recordings, are read as the same request too.
pub fn request(bytes: &[u8]) {
    let versioned = [&[u8::try_from(VERSION).expect("one byte")], bytes].concat();
    for payload in [bytes, &versioned] {
        match decode_request(payload) {
            Ok(request) => {
                let mut buffer = [0; MAX_FRAME_BYTES];
                let frame = frame_request(&request, &mut buffer).expect("any request fits");
                let payload = only_payload(frame).expect("what was framed is a frame");
                assert_eq!(decode_request(&payload), Ok(request));
                assert_eq!(request.to_string().parse::<Request>(), Ok(request));
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}
