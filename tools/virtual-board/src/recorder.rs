//! Files that a run writes beside its report: what the ADC gave the program, and the edges of pins.
//!
//! A file of edges is CSV with the header `time_s,level`: virtual seconds since power-on, and 1 after a rising edge, 0 after a falling one.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use stm32f4_model::{Conversion, Pin};

use crate::pulses::Edge;
use crate::report;

/// The files of a run.
#[derive(Default)]
pub(crate) struct Recorder {
    conversions: Option<csv::Writer<File>>,
    edges: Vec<(Pin, csv::Writer<File>)>,
}

impl Recorder {
    /// Creates the files.
    ///
    /// # Errors
    /// One that cannot be written.
    pub(crate) fn create(conversions: Option<&Path>, edges: &[(Pin, PathBuf)]) -> Result<Self> {
        let open = |path: &Path, header: &[&str]| -> Result<_> {
            let create = || -> Result<_, csv::Error> {
                let mut writer = csv::Writer::from_path(path)?;
                writer.write_record(header)?;
                Ok(writer)
            };
            create().with_context(|| format!("cannot write {}", path.display()))
        };
        Ok(Recorder {
            conversions: conversions.map(|path| open(path, &["time_s", "group", "channel", "code"])).transpose()?,
            edges: edges
                .iter()
                .map(|(pin, path)| Ok((*pin, open(path, &["time_s", "level"])?)))
                .collect::<Result<_>>()?,
        })
    }

    /// Writes a result that the program was given.
    pub(crate) fn conversion(&mut self, seconds: f64, one: &Conversion) -> Result<()> {
        let Some(file) = &mut self.conversions else { return Ok(()) };
        let group = if one.injected { "injected" } else { "regular" };
        let time = report::seconds(seconds).to_string();
        file.write_record([&time, group, &one.channel.to_string(), &one.code.to_string()])?;
        Ok(())
    }

    /// Writes edges to the files of their pins.
    pub(crate) fn edges(&mut self, edges: &[Edge]) -> Result<()> {
        for edge in edges {
            for (_, file) in self.edges.iter_mut().filter(|(pin, _)| *pin == edge.pin) {
                let time = report::seconds(edge.seconds).to_string();
                file.write_record([time.as_str(), if edge.level { "1" } else { "0" }])?;
            }
        }
        Ok(())
    }

    /// Brings everything to disk.
    pub(crate) fn flush(&mut self) -> Result<()> {
        for file in self.conversions.iter_mut().chain(self.edges.iter_mut().map(|(_, file)| file)) {
            file.flush()?;
        }
        Ok(())
    }
}
