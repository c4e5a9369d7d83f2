//! What the run and the threads of a server share.

use super::queue::{Message, Queue};
use crate::channel::Channel;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the run and the clients' threads share.
pub(super) struct Shared {
    pub(super) channels: Vec<Channel>,
    /// A number of this run, for clients that connect again.
    pub(super) session: u64,
    pub(super) closing: AtomicBool,
    /// Messages sent to clients.
    pub(super) sent: AtomicU64,
    /// What waits for each client.
    pub(super) clients: Mutex<Vec<Arc<Queue>>>,
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
