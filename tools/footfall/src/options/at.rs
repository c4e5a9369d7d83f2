//! Where a board that takes requests is.

use clap::Args;
use std::path::PathBuf;

use crate::board::source::Origin;
use crate::failure::Failure;
use crate::file::capture::rtt::Source;

/// A board that takes requests.
#[derive(Debug, Clone, Args)]
pub struct At {
    /// The board's serial port: a device file
    #[arg(long, value_name = "PORT", conflicts_with = "rtt")]
    pub serial: Option<PathBuf>,
    /// A server that passes on the board's RTT channel 1 in both directions: tcp:HOST:PORT (OpenOCD) or jlink:HOST:PORT
    #[arg(long, value_name = "SOURCE")]
    pub rtt: Option<Source>,
}

impl At {
    /// The one that is given, if any.
    #[must_use]
    pub fn given(&self) -> Option<Origin> {
        self.serial.clone().map(Origin::Serial).or_else(|| self.rtt.clone().map(Origin::Rtt))
    }

    /// The same, where one is needed.
    ///
    /// # Errors
    /// None is given.
    pub fn origin(&self) -> Result<Origin, Failure> {
        self.given().ok_or_else(|| Failure::input("no board; allowed is --serial PORT or --rtt tcp:HOST:PORT"))
    }
}
