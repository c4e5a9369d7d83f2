//! A run that is sent to other programs while it runs: by the WebSocket protocol of Foxglove, and as JSON in UDP datagrams.
//!
//! Sending never delays the run: what a receiver does not take in time is dropped and counted.

mod board_time;
#[cfg(feature = "analysis")]
mod foxglove;
mod udp;

use crate::board::run::Event;
use crate::failure::Failure;
use crate::messages;
use board_time::BoardTime;
use clap::Args;
use joint_loop::RobotConfig;
use joint_units::Joint;
use std::net::{SocketAddr, ToSocketAddrs};
use udp::Datagrams;
use wire::Frame;

#[cfg(feature = "analysis")]
pub use foxglove::{CHANNELS, FOXGLOVE_PORT};
pub use udp::{UDP_PORT, fields};

/// Where a run is sent while it runs.
#[derive(Debug, Clone, Default, Args)]
pub struct Receivers {
    /// Serve the run to Foxglove, in real time: open the connection `Foxglove WebSocket` there to the address that is printed. ADDRESS is an
    /// address of this machine, HOST or HOST:PORT; with one that other machines reach, what is printed has a token
    /// [default: 127.0.0.1:8765]
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8765", value_parser = address(FOXGLOVE_PORT))]
    pub foxglove: Option<SocketAddr>,
    /// Send every frame as a JSON object in a UDP datagram, in real time, for the UDP server of PlotJuggler: HOST or HOST:PORT
    /// [default port: 9870]
    #[arg(long, value_name = "ADDRESS", value_parser = address(UDP_PORT))]
    pub udp: Option<SocketAddr>,
}

impl Receivers {
    /// Whether there is one.
    #[must_use]
    pub fn any(&self) -> bool {
        #[cfg(feature = "analysis")]
        if self.foxglove.is_some() {
            return true;
        }
        self.udp.is_some()
    }
}

/// A parser of network addresses: a host with or without a port.
fn address(port: u16) -> impl Fn(&str) -> Result<SocketAddr, String> + Clone {
    move |text: &str| {
        let allowed = |why: &dyn ToString| {
            let why = why.to_string();
            format!("allowed is HOST or HOST:PORT, such as 127.0.0.1:{port} ({why})")
        };
        if let Ok(ip) = text.parse() {
            return Ok(SocketAddr::new(ip, port));
        }
        let found = match text.rsplit_once(':') {
            Some(_) => text.to_socket_addrs(),
            None => (text, port).to_socket_addrs(),
        };
        let mut found = found.map_err(|error| allowed(&error))?;
        found.next().ok_or_else(|| allowed(&"the host has no address"))
    }
}

/// A run that is being sent; by default, to nobody.
#[derive(Default)]
pub struct Publisher {
    /// The joints with a sensor, from channel 1 on.
    sensors: Vec<Joint>,
    time: BoardTime,
    boot: u32,
    datagrams: Option<Datagrams>,
    #[cfg(feature = "analysis")]
    foxglove: Option<foxglove::Server>,
}

impl Publisher {
    /// Opens the ports, for a board with sensors on these joints and this robot; says where they are.
    ///
    /// # Errors
    /// A port cannot be opened.
    pub fn open(receivers: &Receivers, sensors: Vec<Joint>, robot: &RobotConfig) -> Result<Self, Failure> {
        let cannot_send =
            |to| move |error| Failure::input(format!("--udp {to}: no datagram can be sent there: {error}"));
        let datagrams = receivers.udp.map(|to| Datagrams::open(to).map_err(cannot_send(to))).transpose()?;
        #[cfg(not(feature = "analysis"))]
        let _ = robot;
        #[cfg(feature = "analysis")]
        let foxglove = match receivers.foxglove {
            Some(at) => {
                let server = foxglove::Server::open(at, &sensors, robot).map_err(|error| {
                    Failure::input(format!(
                        "--foxglove {at}: cannot be opened: {error}; allowed is a free port of an address of this machine"
                    ))
                })?;
                messages::status(format_args!("foxglove: {}", server.address()));
                Some(server)
            }
            None => None,
        };
        if let Some(to) = receivers.udp {
            messages::status(format_args!("udp: datagrams to {to}"));
        }
        Ok(Self {
            sensors,
            time: BoardTime::default(),
            boot: 0,
            datagrams,
            #[cfg(feature = "analysis")]
            foxglove,
        })
    }

    /// Takes an event of the run.
    pub fn event(&mut self, event: &Event) {
        match event {
            Event::Booted { .. } => self.boot(),
            Event::Tick { tick, .. } => self.frame(tick),
            _ => {}
        }
    }

    /// The board left reset.
    fn boot(&mut self) {
        self.boot += 1;
        self.time.restart();
    }

    /// Sends a frame.
    fn frame(&mut self, frame: &Frame) {
        let time_ns = self.time.unix_ns(frame.tick);
        // A board that is listened to while it runs has booted once.
        let boot = self.boot.max(1);
        if let Some(datagrams) = &mut self.datagrams {
            datagrams.send(&fields(time_ns, boot, &self.sensors, frame));
        }
        #[cfg(feature = "analysis")]
        if let Some(server) = &mut self.foxglove {
            server.frame(time_ns, boot, &self.sensors, frame);
        }
    }

    /// Closes the ports and says what was sent.
    pub fn finish(&mut self) {
        if let Some(datagrams) = self.datagrams.take() {
            messages::status(datagrams.in_words());
        }
        #[cfg(feature = "analysis")]
        if let Some(server) = self.foxglove.take() {
            messages::status(server.finish());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_host_and_may_have_a_port() {
        let parse = address(9870);
        for (text, found) in [
            ("127.0.0.1", "127.0.0.1:9870"),
            ("127.0.0.1:1234", "127.0.0.1:1234"),
            ("::1", "[::1]:9870"),
            ("[::1]:1234", "[::1]:1234"),
        ] {
            assert_eq!(parse(text), Ok(found.parse().unwrap()), "{text}");
        }
        for bad in ["", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000", "999.1.2.3:x", ":"] {
            let error = parse(bad).unwrap_err();
            assert!(error.contains("allowed is HOST or HOST:PORT, such as 127.0.0.1:9870"), "{bad}: {error}");
        }
    }
}
