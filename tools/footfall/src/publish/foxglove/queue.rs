//! The messages that wait for one client: so many at most, the oldest one is dropped for a new one.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Messages that wait: about two seconds of all channels.
const WAITING: usize = 1000;

/// A message on a channel.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) channel: usize,
    pub(super) time_ns: u64,
    pub(super) payload: Vec<u8>,
}

/// What a client has asked for, and what waits for it.
#[derive(Debug, Default)]
pub(super) struct Queue(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    /// The channel of each subscription.
    subscriptions: BTreeMap<u32, usize>,
    messages: VecDeque<(u32, Arc<Message>)>,
    dropped: u64,
}

impl Waiting {
    fn push(&mut self, subscription: u32, message: Arc<Message>) {
        if self.messages.len() == WAITING {
            self.messages.pop_front();
            self.dropped += 1;
        }
        self.messages.push_back((subscription, message));
    }
}

impl Queue {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a subscription, with the message that it begins with.
    pub(super) fn subscribe(&self, subscription: u32, channel: usize, first: Option<Arc<Message>>) {
        let mut waiting = self.waiting();
        waiting.subscriptions.insert(subscription, channel);
        if let Some(message) = first {
            waiting.push(subscription, message);
        }
    }

    pub(super) fn unsubscribe(&self, subscription: u32) {
        self.waiting().subscriptions.remove(&subscription);
    }

    /// Whether anybody would get a message of this channel.
    pub(super) fn wants(&self, channel: usize) -> bool {
        self.waiting().subscriptions.values().any(|of| *of == channel)
    }

    /// Whether its client has asked for nothing, or has taken nothing for as long as the queue holds.
    pub(super) fn is_idle(&self) -> bool {
        let waiting = self.waiting();
        waiting.subscriptions.is_empty() || waiting.messages.len() == WAITING
    }

    /// Adds a message once for each subscription to its channel.
    pub(super) fn push(&self, message: &Arc<Message>) {
        let mut waiting = self.waiting();
        let of = |(&id, &channel): (&u32, &usize)| (channel == message.channel).then_some(id);
        let subscriptions: Vec<u32> = waiting.subscriptions.iter().filter_map(of).collect();
        for subscription in subscriptions {
            waiting.push(subscription, message.clone());
        }
    }

    /// The oldest message and its subscription.
    pub(super) fn pop(&self) -> Option<(u32, Arc<Message>)> {
        self.waiting().messages.pop_front()
    }

    /// Messages dropped so far.
    pub(super) fn dropped(&self) -> u64 {
        self.waiting().dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(time_ns: u64) -> Arc<Message> {
        Arc::new(Message { channel: 3, time_ns, payload: vec![] })
    }

    #[test]
    fn the_oldest_messages_are_dropped_and_counted() {
        let queue = Queue::default();
        queue.push(&message(0));
        assert!(queue.pop().is_none() && !queue.wants(3) && queue.is_idle(), "nobody has asked for it");
        queue.subscribe(7, 3, None);
        assert!(!queue.is_idle());
        queue.subscribe(8, 4, None);
        assert!(queue.wants(3));
        for n in 0..WAITING as u64 + 5 {
            queue.push(&message(n));
        }
        assert!(queue.dropped() == 5 && queue.is_idle());
        assert_eq!(queue.pop().map(|(id, message)| (id, message.time_ns)), Some((7, 5)));
        queue.unsubscribe(7);
        assert!(!queue.wants(3));
    }
}
