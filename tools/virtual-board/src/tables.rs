//! Signals over time from CSV files: voltages of pins and supplies, levels of inputs.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use stm32f4_model::Pin;

/// Name of the column of the analogue supply.
const VDDA: &str = "VDDA";

/// Pin or supply of a column of voltages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum VoltageColumn {
    /// A pin of the converter.
    Pin(Pin),
    /// The analogue supply.
    Vdda,
}

impl VoltageColumn {
    /// The column of a name, as `PA1` or `VDDA`.
    ///
    /// # Errors
    /// The name is neither.
    pub(crate) fn parse(name: &str) -> Result<Self> {
        if name == VDDA { Ok(VoltageColumn::Vdda) } else { Ok(VoltageColumn::Pin(name.parse()?)) }
    }

    fn name(self) -> String {
        match self {
            VoltageColumn::Pin(pin) => pin.to_string(),
            VoltageColumn::Vdda => VDDA.into(),
        }
    }
}

/// Voltages of pins and of the analogue supply over time, V. Linear interpolation between rows; the first row holds before it.
#[derive(Debug, Clone, Default)]
pub(crate) struct VoltageTable {
    times: Vec<f64>,
    columns: BTreeMap<VoltageColumn, Vec<f64>>,
    repeat: bool,
}

impl VoltageTable {
    /// Reads a CSV file with the header `time_s,PA1,...`; a column `VDDA` is the analogue supply. With `repeat` the table is periodic: its
    /// last row is at the same phase as its first; otherwise the last row is held.
    ///
    /// # Errors
    /// The file cannot be read, or its header or a row is invalid; the message names the line.
    pub(crate) fn read(path: &Path, repeat: bool) -> Result<Self> {
        let file = std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(file, repeat).with_context(|| format!("{} is not a valid table of voltages", path.display()))
    }

    /// Parses the CSV text.
    ///
    /// # Errors
    /// As [`VoltageTable::read`].
    pub(crate) fn parse(text: impl Read, repeat: bool) -> Result<Self> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text);
        let header = reader.headers()?.clone();
        ensure!(header.get(0) == Some("time_s"), "line 1: the first column must be `time_s`, for example `time_s,PA1`");
        let nodes: Vec<VoltageColumn> =
            header.iter().skip(1).map(VoltageColumn::parse).collect::<Result<_>>().context("line 1")?;
        ensure!(!nodes.is_empty(), "line 1: no pin is named; expected is for example `time_s,PA1`");
        let mut volts = VoltageTable { repeat, ..VoltageTable::default() };
        for node in &nodes {
            if volts.columns.insert(*node, Vec::new()).is_some() {
                bail!("line 1: {} is named twice", node.name());
            }
        }
        for row in reader.records() {
            let row = row?;
            let line = row.position().map_or(0, csv::Position::line);
            let number = |field: &str| match field.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => bail!("line {line}: `{field}` is not a finite number"),
            };
            let time = number(&row[0])?;
            if let Some(last) = volts.times.last() {
                ensure!(time > *last, "line {line}: time {time} s does not come after {last} s; times must increase");
            }
            volts.times.push(time);
            for (node, field) in nodes.iter().zip(row.iter().skip(1)) {
                let value = number(field)?;
                ensure!(
                    *node != VoltageColumn::Vdda || value > 0.0,
                    "line {line}: {VDDA} of {value} V; the converter divides by it, so it must be greater than 0"
                );
                volts.columns.entry(*node).or_default().push(value);
            }
        }
        ensure!(!volts.times.is_empty(), "the table has no row; at least one is required");
        ensure!(!repeat || volts.times.len() > 1, "a single row cannot be repeated; --loop needs at least two");
        Ok(volts)
    }

    /// True if the table has the analogue supply.
    #[must_use]
    pub(crate) fn has_vdda(&self) -> bool {
        self.columns.contains_key(&VoltageColumn::Vdda)
    }

    /// Voltage at a pin, V; 0 V at a pin that is not in the table.
    #[must_use]
    pub(crate) fn at(&self, pin: Pin, seconds: f64) -> f64 {
        self.of(VoltageColumn::Pin(pin), seconds).unwrap_or(0.0)
    }

    /// Analogue supply, V; `None`: not in the table.
    #[must_use]
    pub(crate) fn vdda(&self, seconds: f64) -> Option<f64> {
        self.of(VoltageColumn::Vdda, seconds)
    }

    fn of(&self, node: VoltageColumn, seconds: f64) -> Option<f64> {
        let (column, &first, &last) = (self.columns.get(&node)?, self.times.first()?, self.times.last()?);
        let time = if self.repeat && seconds > first { first + (seconds - first) % (last - first) } else { seconds };
        let after = self.times.partition_point(|&row| row <= time);
        if after == 0 {
            return Some(column[0]);
        }
        let (Some(t1), Some(v1)) = (self.times.get(after), column.get(after)) else { return Some(column[after - 1]) };
        let (t0, v0) = (self.times[after - 1], column[after - 1]);
        Some(v0 + (v1 - v0) * (time - t0) / (t1 - t0))
    }
}

/// Level of a digital input over time; low before its first edge.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LevelTable {
    /// Times, s, and the level from each on.
    edges: Vec<(f64, bool)>,
}

impl LevelTable {
    /// Reads a CSV file with the header `time_s,level`, one edge per row, as logic analysers export and `footfall sync` reads.
    ///
    /// # Errors
    /// The file cannot be read, or its header or a row is invalid; the message names the line.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let file = std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(file).with_context(|| format!("{} is not a valid list of edges", path.display()))
    }

    /// Parses the CSV text.
    ///
    /// # Errors
    /// As [`LevelTable::read`].
    pub(crate) fn parse(text: impl Read) -> Result<Self> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text);
        ensure!(reader.headers()? == vec!["time_s", "level"], "line 1: the header must be `time_s,level`");
        let mut edges: Vec<(f64, bool)> = Vec::new();
        for row in reader.records() {
            let row = row?;
            let line = row.position().map_or(0, csv::Position::line);
            let time = match row[0].parse::<f64>() {
                Ok(time) if time.is_finite() => time,
                _ => bail!("line {line}: `{}` is not a finite number", &row[0]),
            };
            let level = match &row[1] {
                "0" => false,
                "1" => true,
                other => bail!("line {line}: the level is `{other}`; allowed is 0 or 1"),
            };
            if let Some((last, _)) = edges.last() {
                ensure!(time > *last, "line {line}: time {time} s does not come after {last} s; times must increase");
            }
            edges.push((time, level));
        }
        Ok(Self { edges })
    }

    /// A constant level.
    pub(crate) fn fixed(level: bool) -> Self {
        Self { edges: vec![(f64::NEG_INFINITY, level)] }
    }

    /// Adds a level from a time on, s, that comes after all others.
    pub(crate) fn push(&mut self, seconds: f64, high: bool) {
        self.edges.push((seconds, high));
    }

    /// Drops the edges before a time, s, but the last of them.
    pub(crate) fn forget_before(&mut self, seconds: f64) {
        let passed = self.edges.partition_point(|(time, _)| *time <= seconds);
        self.edges.drain(..passed.saturating_sub(1));
    }

    /// The level at a time, s.
    pub(crate) fn at(&self, seconds: f64) -> bool {
        let after = self.edges.partition_point(|(time, _)| *time <= seconds);
        after > 0 && self.edges[after - 1].1
    }

    /// The first edge after a time, s.
    pub(crate) fn next_edge(&self, seconds: f64) -> Option<f64> {
        self.edges.get(self.edges.partition_point(|(time, _)| *time <= seconds)).map(|(time, _)| *time)
    }
}
