//! The server: its port and its clients.

use super::client;
use super::queue::{Message, Queue};
use super::shared::{Shared, lock};
use crate::channel::Channel;
use crate::channel::clock::unix_ns;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Most clients at a time.
const CLIENTS: usize = 16;

/// How often the port is asked for a new client.
const ACCEPT: Duration = Duration::from_millis(20);

/// How long clients may take for what waits for them when the server is closed.
const LAST_MESSAGES: Duration = Duration::from_millis(500);

/// A port with clients.
pub(super) struct Port {
    shared: Arc<Shared>,
    address: SocketAddr,
    accepting: Option<JoinHandle<()>>,
    connected: Arc<AtomicU64>,
    dropped: Arc<AtomicU64>,
}

impl Port {
    /// Opens the port for clients of these channels.
    pub(super) fn open(at: SocketAddr, channels: Vec<Channel>) -> io::Result<Self> {
        let listener = TcpListener::bind(at)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let kept = Mutex::new(channels.iter().map(|_| None).collect());
        let shared = Arc::new(Shared {
            channels,
            session: unix_ns(),
            closing: AtomicBool::new(false),
            sent: AtomicU64::new(0),
            clients: Mutex::default(),
            kept,
        });
        let (connected, dropped) = (Arc::<AtomicU64>::default(), Arc::<AtomicU64>::default());
        let accepting = {
            let (shared, connected, dropped) = (shared.clone(), connected.clone(), dropped.clone());
            thread::spawn(move || accept(&listener, &shared, &connected, &dropped))
        };
        Ok(Self { shared, address, accepting: Some(accepting), connected, dropped })
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sends a message, which is made only if a client has asked for its channel.
    pub(super) fn send(&self, channel: usize, time_ns: u64, payload: impl FnOnce() -> Vec<u8>) {
        let clients = lock(&self.shared.clients);
        if !clients.iter().any(|queue| queue.wants(channel)) {
            return;
        }
        let message = Arc::new(Message { channel, time_ns, payload: payload() });
        clients.iter().for_each(|queue| queue.push(&message));
    }

    /// Sends a message, and keeps it for clients that come later.
    pub(super) fn send_and_keep(&self, channel: usize, time_ns: u64, payload: Vec<u8>) {
        let message = Arc::new(Message { channel, time_ns, payload });
        if let Some(kept) = lock(&self.shared.kept).get_mut(channel) {
            *kept = Some(message.clone());
        }
        lock(&self.shared.clients).iter().for_each(|queue| queue.push(&message));
    }

    /// Closes the port, after what clients take in half a second; says what was sent.
    pub(super) fn close(mut self) -> String {
        self.shared.closing.store(true, Ordering::Relaxed);
        if let Some(accepting) = self.accepting.take() {
            // It returns within a few milliseconds, and cannot panic.
            let _ = accepting.join();
        }
        let until = Instant::now() + LAST_MESSAGES;
        while !lock(&self.shared.clients).is_empty() && Instant::now() < until {
            thread::sleep(Duration::from_millis(5));
        }
        let waiting: u64 = lock(&self.shared.clients).iter().map(|queue| queue.dropped()).sum();
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
        let (clients, sent) = (count(&self.connected), count(&self.shared.sent));
        format!("foxglove: {clients} clients, {sent} messages sent, {} dropped", count(&self.dropped) + waiting)
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>, connected: &Arc<AtomicU64>, dropped: &Arc<AtomicU64>) {
    while !shared.closing.load(Ordering::Relaxed) {
        // A client that is gone before it is accepted is an error of `accept`, not of the port.
        let Ok((stream, _)) = listener.accept() else {
            thread::sleep(ACCEPT);
            continue;
        };
        let queue = Arc::new(Queue::default());
        {
            let mut clients = lock(&shared.clients);
            if clients.len() == CLIENTS {
                continue;
            }
            clients.push(queue.clone());
        }
        connected.fetch_add(1, Ordering::Relaxed);
        let (shared, dropped) = (shared.clone(), dropped.clone());
        thread::spawn(move || {
            client::serve(stream, &shared, &queue);
            lock(&shared.clients).retain(|of| !Arc::ptr_eq(of, &queue));
            dropped.fetch_add(queue.dropped(), Ordering::Relaxed);
        });
    }
}
