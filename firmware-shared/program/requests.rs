//! Requests of a host, from the serial port or from the channel of a debug probe.
//!
//! A stop has a place of its own, so that it is taken by the next tick however many other requests wait.

use heapless::spsc::{Consumer, Producer};
use joint_loop::tuning::{Action, Request};
use portable_atomic::{AtomicU32, Ordering};
use wire::{RequestError, Unframer, decode_request};

use crate::queue;

/// Requests between telemetry and the loop, which takes one in a tick.
pub(crate) const REQUESTS_QUEUED: usize = 8;

/// The number of a stop that waits, and [`WAITS`]; 0: there is no stop.
static STOP: AtomicU32 = AtomicU32::new(0);
const WAITS: u32 = 1 << 16;

/// The request of a tick: a stop before all others.
pub(crate) fn take(requests: &mut Consumer<'_, Request>) -> Option<Request> {
    if STOP.load(Ordering::Relaxed) != 0 {
        let number = STOP.swap(0, Ordering::Relaxed) as u16;
        return Some(Request { number, action: Action::Stop });
    }
    queue::take(requests)
}

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
        let request = payload.map_or(Err(RequestError::Malformed), decode_request);
        let is_handed = request.as_ref().is_ok_and(|request| self.hand(request));
        let counts = &mut self.counts;
        let counter = match request {
            Ok(_) if is_handed => &mut counts.requests,
            Ok(_) => &mut counts.too_many,
            Err(RequestError::Version { .. }) => &mut counts.other_version,
            Err(_) => &mut counts.malformed,
        };
        *counter = counter.wrapping_add(1);
    }

    /// Hands a request to the loop; false if there is no place. A stop while another one waits is answered in its turn, or not at all: the motion stops.
    fn hand(&mut self, request: &Request) -> bool {
        if matches!(request.action, Action::Stop) && STOP.load(Ordering::Relaxed) == 0 {
            STOP.store(WAITS | u32::from(request.number), Ordering::Relaxed);
            return true;
        }
        self.to_loop.enqueue(*request).is_ok()
    }
}
