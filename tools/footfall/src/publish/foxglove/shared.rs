//! What the run and the threads of a server share.

use super::guard::Guard;
use super::queue::{Message, Queue};
use crate::channel::Channel;
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A client that has a place.
pub(super) struct Connected {
    /// What waits for it.
    pub(super) queue: Arc<Queue>,
    /// Its connection, to end it.
    pub(super) stream: TcpStream,
}

/// Clients that were not let in.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    pub(super) count: u64,
    /// Why the last of them was not.
    pub(super) last: String,
}

/// What the run and the clients' threads share.
pub(super) struct Shared {
    pub(super) channels: Vec<Channel>,
    /// A number of this run, for clients that connect again.
    pub(super) session: u64,
    pub(super) closing: AtomicBool,
    /// Messages sent to clients.
    pub(super) sent: AtomicU64,
    /// Who may connect.
    pub(super) guard: Guard,
    pub(super) refusals: Mutex<Refusals>,
    /// The clients, the one that came first at the front.
    pub(super) clients: Mutex<Vec<Connected>>,
    /// The last message of each channel that new subscriptions begin with.
    pub(super) kept: Mutex<Vec<Option<Arc<Message>>>>,
}

impl Shared {
    /// The message that a subscription to a channel begins with.
    pub(super) fn kept(&self, channel: usize) -> Option<Arc<Message>> {
        lock(&self.kept).get(channel).cloned().flatten()
    }
}

/// The value, also where a thread has panicked with it: each change of it is complete in itself.
pub(super) fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
