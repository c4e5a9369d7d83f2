//! Reads and checks everything that a run on the virtual board needs, before anything is started or written.

use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SENSORS_SECTOR};
use gait_trace::format::csv_file;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, robot_record, sensor_record};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;

use super::settings::{ARM_AT_S, DEFAULT_SECS, DISARM_BEFORE_END_S, PRESS_S, Press, STOP_TEST_S, Settings, Show};
use crate::board::feed;
use crate::board::feed::Feed;
use crate::board::image::Image;
use crate::failure::Failure;
use crate::file::capture;
use crate::options::record_name;

/// What was read and checked.
pub(super) struct Prepared {
    pub(super) image: Image,
    pub(super) feed: Feed,
    secs: Option<f64>,
    pub(super) presses: Vec<f64>,
    pub(super) notes: Vec<String>,
}

/// Reads and checks all inputs.
pub(super) fn prepare(settings: &Settings) -> Result<Prepared, Failure> {
    let image = Image::read(&settings.elf).map_err(Failure::input)?;
    let mut notes = Vec::new();
    let secs = settings.secs.or((settings.show != Show::Screen).then_some(DEFAULT_SECS));
    let (name, recording) = match &settings.trace {
        Some(path) => {
            let opened = feed::opened(path)?;
            notes.extend(opened.notes);
            (opened.name, opened.recording)
        }
        None => feed::default_trace().map_err(Failure::input)?,
    };
    let feed = feed::feed(&name, &recording, &settings.parameters.sensors, image.sensor_pins(), secs)?;
    let presses = presses(settings, secs)?;
    if let Some(path) = &settings.record {
        capture::check(path, settings.overwrite)?;
    }
    notes.extend(feed.notes.iter().cloned());
    Ok(Prepared { image, feed, secs, presses, notes })
}

fn presses(settings: &Settings, secs: Option<f64>) -> Result<Vec<f64>, Failure> {
    let mut presses = match &settings.press {
        Press::Auto => vec![ARM_AT_S],
        Press::At(times) => times.clone(),
    };
    if settings.disarm {
        if presses.is_empty() {
            return Err(Failure::input(
                "--disarm: its press would arm a board that nothing has armed; remove `--press none`",
            ));
        }
        let at = secs.unwrap_or(DEFAULT_SECS) - DISARM_BEFORE_END_S;
        let last = presses.iter().copied().fold(0.0, f64::max);
        if at < last + 2.0 * PRESS_S {
            let least = last + 2.0 * PRESS_S + DISARM_BEFORE_END_S;
            return Err(Failure::input(format!("--disarm: allowed with --secs of {least:.1} or more here")));
        }
        presses.push(at);
    }
    Ok(presses)
}

/// The arguments of the virtual board's program, and the temporary files that they name.
pub(super) struct Arguments {
    pub(super) all: Vec<OsString>,
    _files: Vec<tempfile::NamedTempFile>,
}

/// Writes the temporary files and makes the arguments.
pub(super) fn arguments(settings: &Settings, prepared: &Prepared) -> Result<Arguments, Failure> {
    let volts = temporary_file(".csv", |out| csv_file::write_to(out, &prepared.feed.volts))?;
    let mut all: Vec<OsString> = vec![settings.elf.clone().into(), "--volts".into(), volts.path().into()];
    let mut files = vec![volts];
    if prepared.feed.repeat {
        all.push("--loop".into());
    }
    // A sector without an option stays erased, but for that of the robot, without which a board gives no pulse.
    let Parameters { generator, sensors, robot } = &settings.parameters;
    let mut download = |address: u32, bytes: &[u8]| -> Result<(), Failure> {
        let file = temporary_file(".bin", |out| out.write_all(bytes))?;
        let mut download = OsString::from(format!("{address:#010x}="));
        download.push(file.path());
        all.extend(["--flash".into(), download]);
        files.push(file);
        Ok(())
    };
    download(ROBOT_SECTOR, robot_record::record_of(robot, &settings.robot_name).bytes())?;
    if let Some(path) = &settings.generator {
        download(GENERATOR_SECTOR, generator_record::record_of(generator, &record_name::of_file(path)).bytes())?;
    }
    if let Some(name) = &settings.sensors_name {
        download(SENSORS_SECTOR, sensor_record::record_of(sensors, name).bytes())?;
    }
    if let Some(secs) = prepared.secs {
        all.extend(["--secs".into(), secs.to_string().into()]);
    }
    if tests_stop(settings) {
        let [at_s, hold_s] = STOP_TEST_S;
        all.extend(["--emergency-stop".into(), format!("{at_s}:{hold_s}").into()]);
    }
    for press in &prepared.presses {
        all.extend(["--press".into(), format!("{press}:{PRESS_S}").into()]);
    }
    if settings.pace || settings.show == Show::Screen {
        all.push("--pace".into());
    }
    if settings.tune && !settings.board.iter().any(|option| option == "--serial") {
        all.push("--serial".into());
    }
    all.extend(settings.board.iter().cloned());
    Ok(Arguments { all, _files: files })
}

/// Whether the emergency stop is tested for the user: not where the virtual board's own options say what it does.
pub(super) fn tests_stop(settings: &Settings) -> bool {
    !settings.board.iter().any(|option| {
        let option = option.to_string_lossy();
        option.starts_with("--emergency-stop") || option.contains("PB12")
    })
}

fn temporary_file(
    suffix: &str,
    write: impl FnOnce(&mut io::BufWriter<&mut tempfile::NamedTempFile>) -> io::Result<()>,
) -> Result<tempfile::NamedTempFile, Failure> {
    let mut file = tempfile::Builder::new().prefix("footfall-").suffix(suffix).tempfile().map_err(Failure::run)?;
    let mut out = io::BufWriter::new(&mut file);
    write(&mut out).and_then(|()| out.flush()).map_err(Failure::run)?;
    drop(out);
    Ok(file)
}

/// What runs, for the file beside a capture.
pub(super) fn about(settings: &Settings, prepared: &Prepared) -> Value {
    let source = json!({
        "virtual_board": settings.virtual_board,
        "trace": prepared.feed.about,
        "secs": prepared.secs,
        "presses_s": prepared.presses,
    });
    let file: Option<&Path> = settings.generator.as_deref();
    capture::about(Some(&settings.elf), Some(&prepared.image), file, &settings.parameters, source)
}
