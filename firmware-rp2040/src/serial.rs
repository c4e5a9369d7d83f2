//! This family has no serial port yet: records go to RTT only, and no request can come.

use heapless::spsc::Producer;
use joint_loop::tuning::Request;
use wire::Record;

/// Requests between telemetry and the loop, which takes one in a tick.
pub(crate) const REQUESTS_QUEUED: usize = 8;

/// The port that is not there. It counts nothing: nothing that could be sent is lost.
pub(crate) struct Port;

/// Keeps the queue of the requests empty.
pub(crate) fn start(_requests: Producer<'static, Request>) -> Port {
    Port
}

impl Port {
    /// Sends nothing.
    pub(crate) fn send(&mut self, _record: &Record) {}

    /// Counts nothing.
    pub(crate) fn drop_records(&mut self, _records: u32) {}

    /// All zero.
    pub(crate) fn counts(&self) -> wire::Port {
        wire::Port::default()
    }

    /// Does nothing.
    pub(crate) fn pump(&mut self) {}

    /// Does nothing.
    pub(crate) fn receive(&mut self) {}
}
