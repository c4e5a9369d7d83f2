//! Any bytes: a record that can be sent again, or an error in words; frames of a serial line with any bytes; any text: a printed record, or none.
//!
//! ```text
//! cargo +nightly fuzz run decode -- -max_len=256 -max_total_time=60
//! ```
//! Run it in this folder's parent.
#![no_main]

use wire::{MAX_BYTES, Unframer, bytes_in, decode, decode_framed, decode_request, encode};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    match decode(bytes) {
        Ok(record) => {
            let mut buffer = [0; MAX_BYTES];
            let written = encode(&record, &mut buffer).expect("any record fits");
            assert!(written.len() <= bytes.len(), "a longer form of the same numbers at most");
            let again = decode(written).expect("what was written is a record");
            assert_eq!(format!("{again:?}"), format!("{record:?}"));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    let mut unframer = Unframer::default();
    for byte in bytes {
        if let Some(Ok(payload)) = unframer.push(*byte) {
            let _ = (decode_request(payload), decode_framed(payload));
        }
    }
    let _ = (decode_request(bytes), decode_framed(bytes));
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = bytes_in(text);
    }
});
