//! `host-bench`: measures the programs for the host in one run; `cargo xtask bench host` builds and starts it.
//!
//! | part | what is measured |
//! |---|---|
//! | `search` | the thesis' genetic search, its kernel beside the processor's peak, and a plain loop |
//! | `peers` | one evaluation of the search in GNU Octave, SciPy and Numba, where they are installed |
//! | `fit` | `footfall fit` of a recording of 50 s, with certificate and report, in turn with SciPy |
//! | `readers` | each format: megabytes a second and peak memory, over the size of the file; the largest in turn with Python's packages |
//! | `folder` | `footfall fit FOLDER`: time and peak memory, over the number of recordings |
//!
//! Times are medians of five runs or more. What is compared takes turns, so that other work on the machine meets both. The result is one
//! JSON object; page and picture are made from it.

mod child;
mod extent;
mod fits;
mod machine;
mod page;
mod peers;
mod readers;
mod recordings;
mod search;
mod times;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand, ValueEnum};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

use extent::Extent;

/// Measures the programs for the host.
#[derive(Debug, Parser)]
struct Options {
    #[command(subcommand)]
    command: Option<Command>,
    /// The program `footfall` that is measured; without it, the parts `fit` and `folder` are left out
    #[arg(long, value_name = "FILE")]
    footfall: Option<PathBuf>,
    /// The folder for recordings and results
    #[arg(long, value_name = "FOLDER", default_value = "target/bench/host")]
    folder: PathBuf,
    /// Only these parts; the others are those of docs/host.json, which must be of this machine
    #[arg(long, value_name = "PART")]
    only: Vec<Part>,
    /// One JSON object instead of the page
    #[arg(long)]
    json: bool,
    /// Small files, few recordings, one run of each: whether everything works, no measurement
    #[arg(long, conflicts_with = "write")]
    quick: bool,
    /// Write docs/host.json, docs/host.md and docs/host-growth.svg
    #[arg(long)]
    write: bool,
}

/// What a child process of this program does.
#[derive(Debug, Subcommand)]
enum Command {
    /// Reads a recording once, and prints the seconds that it took
    #[command(hide = true)]
    Read(readers::Options),
    /// Writes a recording
    #[command(hide = true)]
    Write(readers::File),
}

/// A part of the measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    Search,
    Peers,
    Fit,
    Readers,
    Folder,
}

fn main() -> Result<()> {
    let options = Options::parse();
    match &options.command {
        Some(Command::Read(options)) => return readers::read(options),
        Some(Command::Write(file)) => return file.write(),
        None => {}
    }
    let extent = if options.quick { Extent::QUICK } else { Extent::WHOLE };
    let mut result = if options.only.is_empty() { json!({}) } else { read_result()? };
    measure(&options, extent, &mut result)?;
    let text = serde_json::to_string_pretty(&result).context("writing the result")? + "\n";
    if options.write {
        let files =
            [(page::JSON, text.clone()), (page::PAGE, page::page(&result)?), (page::PICTURE, page::picture(&result)?)];
        for (file, text) in files {
            std::fs::write(file, text).with_context(|| format!("writing {file}"))?;
            eprintln!("wrote {file}");
        }
    }
    print!("{}", if options.json { text } else { page::page(&result)? });
    Ok(())
}

fn read_result() -> Result<Value> {
    let text = std::fs::read_to_string(page::JSON).with_context(|| format!("reading {}", page::JSON))?;
    serde_json::from_str(&text).with_context(|| format!("reading {}", page::JSON))
}

fn measure(options: &Options, extent: Extent, result: &mut Value) -> Result<()> {
    let folder: &Path = &options.folder;
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    let is_asked = |part: Part| options.only.is_empty() || options.only.contains(&part);
    let machine = machine::describe();
    if options.only.is_empty() {
        result["machine"] = machine;
    } else {
        machine::must_be_same(&result["machine"], &machine)?;
        for part in &options.only {
            let name = part.to_possible_value().context("a part without a name")?;
            result["again"][name.get_name()] = machine.clone();
        }
    }
    if is_asked(Part::Search) {
        eprintln!("bench: the search");
        result["search"] = search::measure(extent);
    }
    if is_asked(Part::Peers) {
        eprintln!("bench: other programs");
        result["peers"] = peers::measure(extent);
    }
    if is_asked(Part::Readers) {
        eprintln!("bench: readers");
        result["readers"] = readers::measure(folder, extent)?;
    }
    let Some(footfall) = &options.footfall else { return Ok(()) };
    if is_asked(Part::Fit) {
        eprintln!("bench: a whole fit");
        result["fit"] = fits::one(footfall, folder, extent)?;
    }
    if is_asked(Part::Folder) {
        eprintln!("bench: folders of recordings");
        result["folder"] = fits::many(footfall, folder, extent)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every part runs with the smallest sizes, and the page has a row of each that was measured.
    #[test]
    fn every_part_runs() {
        let folder = tempfile::tempdir().unwrap();
        let mut result = json!({ "machine": machine::describe(), "search": search::measure(Extent::QUICK) });
        result["readers"] =
            readers::within(folder.path(), Extent::QUICK, &readers::File::write, &readers::once, &|_, _| {
                Err("left out".into())
            })
            .unwrap();
        result["peers"] = json!([]);
        result["again"]["search"] = machine::describe();
        let page = page::page(&result).unwrap();
        for row in [
            "The part `search` was measured alone",
            "not measured: left out",
            "kernel",
            "search, 1 ms",
            "search, 5 ms",
            "CSV",
            "OpenSim",
            "C3D",
            "TRC",
            "oscilloscope",
            "MCAP",
        ] {
            assert!(page.contains(row), "no `{row}` in\n{page}");
        }
        let ratio = result["search"]["kernel"][0]["to_floor"].as_f64().unwrap();
        assert!(ratio.is_finite() && ratio > 0.0, "{ratio}");
        assert!(page::picture(&result).unwrap().contains("<svg"));
    }

    #[test]
    fn the_page_is_what_the_numbers_say() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let read = |file: &str| std::fs::read_to_string(root.join(file)).unwrap();
        let result: Value = serde_json::from_str(&read(page::JSON)).unwrap();
        let again = "FOOTFALL_WRITE_DOCS=1 writes page and picture again";
        if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some_and(|value| value == "1") {
            std::fs::write(root.join(page::PAGE), page::page(&result).unwrap()).unwrap();
            std::fs::write(root.join(page::PICTURE), page::picture(&result).unwrap()).unwrap();
        }
        assert!(
            page::page(&result).unwrap() == read(page::PAGE),
            "{} differs from {}; {again}",
            page::PAGE,
            page::JSON
        );
        assert!(page::picture(&result).unwrap() == read(page::PICTURE), "{} differs; {again}", page::PICTURE);
    }
}
