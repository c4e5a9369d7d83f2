//! Requests of a host, from the serial port or from the channel of a debug probe.

use heapless::spsc::Producer;
use joint_loop::tuning::Request;
use wire::{RequestError, Unframer, decode_request};

/// Requests between telemetry and the loop, which takes one in a tick.
pub(crate) const REQUESTS_QUEUED: usize = 8;

/// Hands requests to the loop, and counts them.
pub(crate) struct Requests {
    to_loop: Producer<'static, Request>,
    /// The counters of requests, and of records that were not sent.
    pub(crate) counts: wire::Port,
}

impl Requests {
    pub(crate) fn new(to_loop: Producer<'static, Request>) -> Self {
        Self { to_loop, counts: wire::Port::default() }
    }

    /// Takes a byte of a host, with the unframer of its line: at the end of a frame, its request.
    pub(crate) fn take(&mut self, unframer: &mut Unframer, byte: u8) {
        let Some(payload) = unframer.push(byte) else { return };
        let counts = &mut self.counts;
        let counter = match payload.map_or(Err(RequestError::Malformed), decode_request) {
            Ok(request) if self.to_loop.enqueue(request).is_ok() => &mut counts.requests,
            Ok(_) => &mut counts.too_many,
            Err(RequestError::Version { .. }) => &mut counts.other_version,
            Err(_) => &mut counts.malformed,
        };
        *counter = counter.wrapping_add(1);
    }
}
