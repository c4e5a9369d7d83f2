//! The server: its port and its clients.

use super::client;
use super::guard::Guard;
use super::queue::{Message, Queue};
use super::shared::{Connected, Shared, lock};
use crate::channel::Channel;
use crate::channel::clock::unix_ns;
use std::io;
use std::net::{Shutdown, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Most clients at a time; one more takes the place of an idle one.
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
            guard: Guard::at(address)?,
            refusals: Mutex::default(),
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

    /// What a client opens.
    pub(super) fn address(&self) -> String {
        format!("ws://{}{}", self.address, self.shared.guard.query())
    }

    /// Sends a message, which is made only if a client has asked for its channel.
    pub(super) fn send(&self, channel: usize, time_ns: u64, payload: impl FnOnce() -> Vec<u8>) {
        let clients = lock(&self.shared.clients);
        if !clients.iter().any(|client| client.queue.wants(channel)) {
            return;
        }
        let message = Arc::new(Message { channel, time_ns, payload: payload() });
        clients.iter().for_each(|client| client.queue.push(&message));
    }

    /// Sends a message, and keeps it for clients that come later.
    pub(super) fn send_and_keep(&self, channel: usize, time_ns: u64, payload: Vec<u8>) {
        let message = Arc::new(Message { channel, time_ns, payload });
        if let Some(kept) = lock(&self.shared.kept).get_mut(channel) {
            *kept = Some(message.clone());
        }
        lock(&self.shared.clients).iter().for_each(|client| client.queue.push(&message));
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
        let waiting: u64 = lock(&self.shared.clients).iter().map(|client| client.queue.dropped()).sum();
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
        let (clients, sent) = (count(&self.connected), count(&self.shared.sent));
        let refusals = lock(&self.shared.refusals);
        let refused = match refusals.count {
            0 => String::new(),
            refused => format!("; {refused} refused, the last of them {}", refusals.last),
        };
        format!(
            "foxglove: {clients} clients, {sent} messages sent, {} dropped{refused}",
            count(&self.dropped) + waiting
        )
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>, connected: &Arc<AtomicU64>, dropped: &Arc<AtomicU64>) {
    while !shared.closing.load(Ordering::Relaxed) {
        // A client that is gone before it is accepted is an error of `accept`, not of the port.
        let Ok((stream, _)) = listener.accept() else {
            thread::sleep(ACCEPT);
            continue;
        };
        let Ok(connection) = stream.try_clone() else { continue };
        let queue = Arc::new(Queue::default());
        {
            let mut clients = lock(&shared.clients);
            if clients.len() == CLIENTS {
                // Who takes nothing makes place, first the one that came first.
                let Some(idle) = clients.iter().position(|client| client.queue.is_idle()) else { continue };
                // One that has left already has nothing to end.
                let _ = clients.remove(idle).stream.shutdown(Shutdown::Both);
            }
            clients.push(Connected { queue: queue.clone(), stream: connection });
        }
        connected.fetch_add(1, Ordering::Relaxed);
        let (shared, dropped) = (shared.clone(), dropped.clone());
        thread::spawn(move || {
            client::serve(stream, &shared, &queue);
            lock(&shared.clients).retain(|client| !Arc::ptr_eq(&client.queue, &queue));
            dropped.fetch_add(queue.dropped(), Ordering::Relaxed);
        });
    }
}
