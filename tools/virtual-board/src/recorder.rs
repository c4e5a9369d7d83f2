//! CSV files of a run: ADC results and edges of pins.
//!
//! Columns of a file of edges: `time_s`, virtual seconds since power-on; `level`, 1 after a rising edge, 0 after a falling one. Columns of
//! the file of ADC results: `time_s`, `group` (`injected` or `regular`), `channel`, `code`.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use stm32f4_model::{Conversion, Pin};

use crate::pulses::PinEdge;
use crate::report;

/// The open files of a run.
#[derive(Default)]
pub(crate) struct SignalRecorder {
    conversions: Option<csv::Writer<File>>,
    edges: Vec<(Pin, csv::Writer<File>)>,
}

impl SignalRecorder {
    /// Creates the files.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn create(conversions: Option<&Path>, edges: &[(Pin, PathBuf)]) -> Result<Self> {
        let open = |path: &Path, header: &[&str]| -> Result<_> {
            let create = || -> Result<_, csv::Error> {
                let mut writer = csv::Writer::from_path(path)?;
                writer.write_record(header)?;
                Ok(writer)
            };
            create().with_context(|| format!("cannot write {}", path.display()))
        };
        Ok(SignalRecorder {
            conversions: conversions.map(|path| open(path, &["time_s", "group", "channel", "code"])).transpose()?,
            edges: edges
                .iter()
                .map(|(pin, path)| Ok((*pin, open(path, &["time_s", "level"])?)))
                .collect::<Result<_>>()?,
        })
    }

    /// Writes an ADC result.
    pub(crate) fn conversion(&mut self, seconds: f64, one: &Conversion) -> Result<()> {
        let Some(file) = &mut self.conversions else { return Ok(()) };
        let group = if one.injected { "injected" } else { "regular" };
        let time = report::seconds(seconds).to_string();
        file.write_record([&time, group, &one.channel.to_string(), &one.code.to_string()])?;
        Ok(())
    }

    /// Writes edges to the files of their pins.
    pub(crate) fn edges(&mut self, edges: &[PinEdge]) -> Result<()> {
        for edge in edges {
            for (_, file) in self.edges.iter_mut().filter(|(pin, _)| *pin == edge.pin) {
                let time = report::seconds(edge.seconds).to_string();
                file.write_record([time.as_str(), if edge.level { "1" } else { "0" }])?;
            }
        }
        Ok(())
    }

    /// Flushes all files.
    pub(crate) fn flush(&mut self) -> Result<()> {
        for file in self.conversions.iter_mut().chain(self.edges.iter_mut().map(|(_, file)| file)) {
            file.flush()?;
        }
        Ok(())
    }
}
