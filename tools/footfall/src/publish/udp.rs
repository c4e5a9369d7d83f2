//! Frames as JSON objects in UDP datagrams, as the UDP server of PlotJuggler reads them: one flat object each, with `timestamp`.

use crate::channel::objects::{joints, readings, state};
use joint_units::Joint;
use serde_json::{Map, Value};
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use wire::Frame;

/// The port of PlotJuggler's UDP server.
pub const UDP_PORT: u16 = 9870;

/// The fields of a datagram: `timestamp` in seconds of the Unix epoch, readings of the sensors, setpoints, pulses, and the state of the
/// supervisor. A reading that is not good has no angle.
#[must_use]
pub fn fields(time_ns: u64, boot: u32, sensors: &[Joint], frame: &Frame) -> Map<String, Value> {
    let mut fields = readings(boot, sensors, frame);
    fields.append(&mut joints(boot, frame));
    if let Value::Object(mut state) = state(boot, frame) {
        fields.append(&mut state);
    }
    fields.insert("timestamp".into(), (time_ns as f64 / 1e9).into());
    // PlotJuggler plots numbers alone, and null is none.
    fields.insert("state_number".into(), (frame.state as u8).into());
    fields.retain(|_, value| !value.is_null());
    fields
}

/// Datagrams to one receiver, which need not exist.
pub(super) struct Datagrams {
    socket: UdpSocket,
    to: SocketAddr,
    sent: u64,
    dropped: u64,
}

impl Datagrams {
    pub(super) fn open(to: SocketAddr) -> io::Result<Self> {
        if to.port() == 0 {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "port 0; allowed is 1 to 65535"));
        }
        let any = if to.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
        let socket = UdpSocket::bind(SocketAddr::new(any, 0))?;
        // A full queue of the system drops a datagram instead of delaying the run.
        socket.set_nonblocking(true)?;
        Ok(Self { socket, to, sent: 0, dropped: 0 })
    }

    pub(super) fn send(&mut self, fields: &Map<String, Value>) {
        let text = serde_json::to_vec(fields).unwrap_or_default();
        match self.socket.send_to(&text, self.to) {
            Ok(_) => self.sent += 1,
            Err(_) => self.dropped += 1,
        }
    }

    pub(super) fn in_words(&self) -> String {
        format!("udp: {} datagrams sent to {}, {} dropped", self.sent, self.to, self.dropped)
    }
}
