//! A server for RTT channel 1, as a debug probe's program has it (OpenOCD's `rtt server start PORT 1`): a client gets what the board writes to the up
//! channel, and what it sends goes to the down channel of the same number.
//!
//! The board's time is not the host's, so it waits for a client that is behind: [`PATIENCE`] at most, then the client is dropped.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use anyhow::{Context as _, Result};

/// The channel that is served.
pub(crate) const CHANNEL: u8 = 1;

/// Longest wait for a client that does not read.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longest piece that is read at once; bytes of a client that wait for the board, at most.
const PIECE: usize = 4096;

/// A server of one client at a time.
pub(crate) struct RttServer {
    listener: TcpListener,
    client: Option<TcpStream>,
    /// What the board has not taken yet.
    waiting: Vec<u8>,
    /// Where it is.
    pub(crate) address: SocketAddr,
}

impl RttServer {
    /// Listens at an address; port 0 is any free one.
    ///
    /// # Errors
    /// The address is not of this computer, or is taken.
    pub(crate) fn open(address: SocketAddr) -> Result<Self> {
        let listener = TcpListener::bind(address).with_context(|| format!("cannot listen at {address}"))?;
        listener.set_nonblocking(true).context("cannot set the RTT server non-blocking")?;
        let address = listener.local_addr().context("the RTT server has no address")?;
        Ok(RttServer { listener, client: None, waiting: Vec::new(), address })
    }

    /// Hands the client what the board has written.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        if let Some(client) = &mut self.client
            && client.write_all(bytes).is_err()
        {
            self.client = None;
        }
    }

    /// What the client has sent and the board has not taken.
    pub(crate) fn receive(&mut self) -> &mut Vec<u8> {
        if self.client.is_none() {
            self.client = self.listener.accept().ok().and_then(|(client, _)| prepared(client));
        }
        if let Some(client) = self.client.as_mut().filter(|_| self.waiting.len() < PIECE) {
            let mut piece = [0; PIECE];
            match peeked(client, &mut piece) {
                Ok(Some(length)) => self.waiting.extend(&piece[..length]),
                Ok(None) => {}
                Err(_) => self.client = None,
            }
        }
        &mut self.waiting
    }
}

fn prepared(client: TcpStream) -> Option<TcpStream> {
    client.set_nonblocking(false).ok()?;
    client.set_nodelay(true).ok()?;
    client.set_write_timeout(Some(PATIENCE)).ok()?;
    Some(client)
}

/// Bytes that are there, without waiting; an error at the end of the connection.
fn peeked(client: &mut TcpStream, piece: &mut [u8]) -> std::io::Result<Option<usize>> {
    client.set_nonblocking(true)?;
    let read = client.read(piece);
    client.set_nonblocking(false)?;
    match read {
        Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
        Ok(length) => Ok(Some(length)),
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_pass_in_both_directions_and_the_next_client_is_served() {
        let mut server = RttServer::open(([127, 0, 0, 1], 0).into()).unwrap();
        server.send(b"nobody");
        for _ in 0..2 {
            let mut client = TcpStream::connect(server.address).unwrap();
            client.write_all(b"ask").unwrap();
            while server.receive().len() < 3 {}
            assert_eq!(server.receive(), b"ask");
            server.receive().clear();
            server.send(b"answer");
            let mut read = [0; 6];
            client.read_exact(&mut read).unwrap();
            assert_eq!(&read, b"answer");
            drop(client);
            while server.client.is_some() {
                server.receive();
            }
        }
    }
}
