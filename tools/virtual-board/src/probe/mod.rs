//! The virtual board as a debug probe with its target: a TCP server that speaks the remote protocol of the Black Magic Probe.
//!
//! - `remote`: commands and answers.
//! - `swd`: the bits on the wire, by which a client finds the debug port.
//! - `adi`: debug port and access port.
//! - `core`: debug registers of the core, vector catches, break point unit, identification.
//!
//! [`mod@crate::run`] carries out what they ask of core and memory.

pub(crate) mod adi;
pub(crate) mod core;
pub(crate) mod remote;
mod swd;

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};

use adi::{DebugBus, DebugPort};
use remote::Frames;
use swd::Wire;

/// Longest time for which an answer waits for a client that does not read, and a client for the end of the one before it.
const PATIENCE: Duration = Duration::from_secs(1);

/// What the thread that reads from the clients says.
enum Message {
    /// A client has connected; answers go there.
    Connected(TcpStream),
    /// Bytes of the present client.
    Bytes(Vec<u8>),
    /// The present client is gone.
    Gone,
}

/// What [`ProbeServer::next`] found.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// A client has connected.
    Connected,
    /// A command came.
    Command(String),
    /// The client is gone.
    Gone,
}

/// The server, with what outlasts its clients: the state of the debug port.
pub(crate) struct ProbeServer {
    /// Address at which it listens.
    pub(crate) address: SocketAddr,
    messages: Receiver<Message>,
    client: Option<TcpStream>,
    frames: Frames,
    wire: Wire,
    port: DebugPort,
}

impl ProbeServer {
    /// Listens at an address. One client is served at a time; a further one is refused.
    ///
    /// # Errors
    /// The address cannot be used.
    pub(crate) fn listen(address: SocketAddr) -> Result<Self> {
        let listener = TcpListener::bind(address).with_context(|| format!("--probe: cannot listen at {address}"))?;
        let address = listener.local_addr().context("--probe: the socket has no address")?;
        let (send, messages) = channel();
        std::thread::spawn(move || serve(&listener, &send));
        Ok(ProbeServer {
            address,
            messages,
            client: None,
            frames: Frames::default(),
            wire: Wire::default(),
            port: DebugPort::default(),
        })
    }

    /// True while a client is connected.
    pub(crate) const fn is_connected(&self) -> bool {
        self.client.is_some()
    }

    /// The next event, for which it waits until a time at most.
    pub(crate) fn next(&mut self, until: Instant) -> Option<Event> {
        loop {
            if let Some(command) = self.frames.next() {
                return Some(Event::Command(command));
            }
            let message = match self.messages.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(message) => message,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return None,
            };
            match message {
                Message::Connected(client) => {
                    self.frames = Frames::default();
                    self.client = Some(client);
                    return Some(Event::Connected);
                }
                Message::Bytes(bytes) => self.frames.push(&bytes),
                Message::Gone => {
                    // A command that was cut is dropped.
                    self.frames = Frames::default();
                    self.client = None;
                    return Some(Event::Gone);
                }
            }
        }
    }

    /// Carries out a command and answers it.
    pub(crate) fn answer(&mut self, command: &str, bus: &mut dyn DebugBus) {
        let answer = remote::answer(command, &mut self.wire, &mut self.port, bus);
        if let Some(client) = &mut self.client
            && client.write_all(answer.as_bytes()).is_err()
        {
            // The thread that reads then sees the end.
            let _ = client.shutdown(std::net::Shutdown::Both);
        }
    }
}

/// Accepts clients, and passes on what the present one sends. A further one is refused by the end of its connection, unless the present one ends soon: a client
/// may connect before the end of the last one is seen.
fn serve(listener: &TcpListener, to: &Sender<Message>) {
    let mut present: Option<JoinHandle<()>> = None;
    for client in listener.incoming() {
        let Ok(client) = client else { continue };
        let accepted = Instant::now();
        let is_busy = || present.as_ref().is_some_and(|thread| !thread.is_finished());
        while is_busy() && accepted.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        if is_busy() {
            eprintln!("--probe: a client is connected, and a further one was refused: end the first one");
            continue;
        }
        let to = to.clone();
        present = Some(std::thread::spawn(move || pass_on(client, &to)));
    }
}

/// Passes on what a client sends, until it is gone or the board has ended.
fn pass_on(mut client: TcpStream, to: &Sender<Message>) {
    let prepared = client.set_nodelay(true).and_then(|()| client.set_write_timeout(Some(PATIENCE)));
    let Ok(answers) = prepared.and_then(|()| client.try_clone()) else { return };
    let mut is_heard = to.send(Message::Connected(answers)).is_ok();
    let mut piece = [0; 4096];
    while is_heard && let Ok(length @ 1..) = client.read(&mut piece) {
        is_heard = to.send(Message::Bytes(piece[..length].to_vec())).is_ok();
    }
    // Without a receiver the board has ended.
    let _ = to.send(Message::Gone);
}

#[cfg(test)]
mod tests {
    use super::adi::tests::Memory;
    use super::*;

    fn soon() -> Instant {
        Instant::now() + Duration::from_secs(20)
    }

    #[test]
    fn a_client_may_vanish_at_any_byte_and_the_next_one_is_served() {
        let mut server = ProbeServer::listen("127.0.0.1:0".parse().unwrap()).unwrap();
        let mut memory = Memory::new();
        for cut in ["", "+", "+#!G", "+#!GA#", "+#!GA#!H"] {
            let mut client = TcpStream::connect(server.address).unwrap();
            client.write_all(cut.as_bytes()).unwrap();
            drop(client);
            assert_eq!(server.next(soon()), Some(Event::Connected), "{cut}");
            loop {
                match server.next(soon()) {
                    Some(Event::Command(command)) => server.answer(&command, &mut memory),
                    Some(Event::Gone) => break,
                    other => panic!("{cut}: {other:?}"),
                }
            }
        }
        // Two at a time: the second one is refused.
        let mut first = TcpStream::connect(server.address).unwrap();
        first.write_all(b"!GA#").unwrap();
        assert_eq!(server.next(soon()), Some(Event::Connected));
        assert_eq!(server.next(soon()), Some(Event::Command("GA".into())));
        let mut second = TcpStream::connect(server.address).unwrap();
        assert!(matches!(second.read(&mut [0; 4]), Ok(0) | Err(_)));
        assert_eq!(server.next(Instant::now()), None);
        // One that connects as the first one goes is served.
        let mut third = TcpStream::connect(server.address).unwrap();
        third.write_all(b"!HC#").unwrap();
        drop(first);
        assert_eq!(server.next(soon()), Some(Event::Gone));
        assert_eq!(server.next(soon()), Some(Event::Connected));
        assert_eq!(server.next(soon()), Some(Event::Command("HC".into())));
        server.answer("HC", &mut memory);
        let mut answer = [0; 4];
        third.read_exact(&mut answer).unwrap();
        assert_eq!(&answer, b"&K3#");
        assert!(server.is_connected());
    }
}
