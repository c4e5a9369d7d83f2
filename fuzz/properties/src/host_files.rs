//! Files, lines and words that the command-line program reads, apart from those of gait and of generators and robots.

use std::io::Write as _;
use std::path::Path;

use footfall::board::image::Image;
use footfall::board::lines::{self, BoardLine};
use footfall::board::requests::{setting, value_in_words};
use footfall::command::calibrate::rows::{self, Reading, Scale};
use footfall::command::sync::edges as edge_file;
use footfall::file::calibration_file;
use footfall::file::capture::{beside, recorded};
use footfall::file::graph_file;
use generator_file::toml_file::TomlFile;
use joint_loop::tuning::{Action, Request, Settings};
use joint_units::Joint;

/// Lines of the virtual board: a reset, bytes of the log, pulses and the end have what their types say.
pub fn board_line(bytes: &[u8]) {
    let Ok(line) = std::str::from_utf8(bytes) else { return };
    match lines::parse(line) {
        Ok(BoardLine::Rtt { bytes, .. }) => assert!(2 * bytes.len() <= line.len(), "more bytes than digits"),
        Ok(_) => {}
        Err(error) => assert!(error.to_string().starts_with("the virtual board wrote `"), "{error}"),
    }
}

/// Runs a reader that takes a path.
fn as_file(extension: &str, bytes: &[u8], read: impl FnOnce(&Path)) {
    let folder = tempfile::tempdir().expect("a folder for the file");
    let path = folder.path().join(format!("a.{extension}"));
    std::fs::write(&path, bytes).expect("the file is written");
    read(&path);
}

fn read_capture(path: &Path) {
    let mut ticks = 0_u64;
    let read = recorded::read(path, |recorded, tick| {
        ticks += 1;
        assert!(
            tick.boot >= 1 && u64::from(tick.boot) <= recorded.boots.len() as u64,
            "a tick of a boot that is not there"
        );
        if let Some(output) = tick.output {
            assert_eq!(output.setpoints_deg.len(), Joint::COUNT);
        }
    });
    if let Err(error) = read {
        assert!(error.to_string().contains("a."), "the error names the file: {error}");
    }
}

/// Captures of a board in MCAP.
pub fn capture_mcap(bytes: &[u8]) {
    as_file("mcap", bytes, read_capture);
}

/// Captures of a board in CSV: the table, a zero byte, and the JSON file beside it.
pub fn capture_csv(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let (table, about) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    as_file("csv", table, |path| {
        let mut file = std::fs::File::create(beside(path)).expect("a file beside it");
        file.write_all(about).expect("it is written");
        read_capture(path);
    });
}

/// Images of the firmware: an ELF file whose log can be decoded, or an error that names the file.
pub fn image(bytes: &[u8]) {
    as_file("elf", bytes, |path| match Image::read(path) {
        Ok(image) => {
            let mut decoder = image.decoder();
            decoder.push(&[0x01, 0x02, 0x00, 0x05, 0x00]);
            for _ in 0..8 {
                if decoder.message().is_none() {
                    break;
                }
            }
        }
        Err(error) => assert!(error.to_string().contains("a.elf"), "{error}"),
    });
}

/// Rows of angles with volts or codes, from which a sensor is calibrated.
pub fn calibration_rows(bytes: &[u8]) {
    for scale in [Scale::Unknown, Scale::Supply(3.3)] {
        let reading = Reading { scale, ..Reading::default() };
        match rows::parse("a.csv", bytes, &reading) {
            Ok(rows) => {
                assert!(rows.rows.iter().all(|row| row.volts.is_finite() && row.angle_deg.is_finite()));
            }
            Err(error) => assert!(error.to_string().starts_with("a.csv"), "{error}"),
        }
    }
}

/// Edges of a line: in the order of time, and pulses of no negative duration.
pub fn edges(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match edge_file::parse(text) {
        Ok(read) => {
            assert!(read.edges.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
            let pulses = edge_file::pulses(&read.edges);
            assert!(pulses.iter().all(|pulse| pulse.width_s.is_none_or(|width| width > 0.0)));
            let written: String =
                read.edges.iter().map(|edge| format!("{},{}\n", edge.time_s, u8::from(edge.rising))).collect();
            let again = edge_file::parse(&format!("time_s,level\n{written}")).expect("what was read is written");
            assert_eq!(again.edges, read.edges);
        }
        Err(error) => {
            let line = error.split(':').next().unwrap_or_default();
            assert!(line.parse::<usize>().is_ok(), "the error begins with a line: {error}");
        }
    }
}

/// Graphs for edge reversal: every node has a name, and the network has its reversibility.
pub fn graph(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match graph_file::parse("a.txt", text) {
        Ok(graph) => assert_eq!(graph.names.len(), graph.network.reversibility().len()),
        Err(error) => assert!(error.to_string().starts_with("a.txt"), "{error}"),
    }
}

/// `NAME VALUE` of `footfall set`, and requests as a capture has them: what is accepted is allowed by the board's table, and its words are read
/// as the same value.
pub fn setting_words(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(request) = text.parse::<Request>() {
        assert_eq!(request.to_string().parse::<Request>(), Ok(request));
    }
    let (name, value) = text.split_once(' ').unwrap_or((text, ""));
    match setting(name, value) {
        Ok((parameter, thousandths)) => {
            let [least, most, _] = parameter.range();
            assert!((least..=most).contains(&thousandths), "{name} = {value}: {thousandths}");
            let words = value_in_words(parameter, thousandths);
            assert_eq!(setting(parameter.name(), &words), Ok((parameter, thousandths)), "{words}");
            let settings = Settings::default()
                .with(parameter, thousandths)
                .expect("the command line allows it, so does the board");
            assert_eq!(settings.thousandths(parameter), thousandths);
            let request = Request { number: 7, action: Action::Set { parameter, thousandths } };
            assert_eq!(request.to_string().parse::<Request>(), Ok(request));
        }
        Err(error) => assert!(!error.is_empty()),
    }
}

/// Sensor files: what is written from an accepted one has its wiring, its volts and its angles, the latter within a rounding of the degrees.
pub fn sensor(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let parse = |text: &str| calibration_file::parse_whole(&TomlFile::of_text("a.toml", text.into()));
    match parse(text) {
        Ok(file) => {
            let written = calibration_file::to_text(&file.sensor, file.measured.as_ref());
            let again =
                parse(&written).unwrap_or_else(|error| panic!("what was written is refused: {error}\n{written}"));
            assert_eq!((again.sensor.divider, again.measured), (file.sensor.divider, file.measured));
            let (before, after) = (&file.sensor.calibration, &again.sensor.calibration);
            assert_eq!((before.interpolation(), before.points().len()), (after.interpolation(), after.points().len()));
            for (before, after) in before.points().iter().zip(after.points()) {
                assert_eq!(before.volts, after.volts);
                assert!(
                    (before.angle.0 - after.angle.0).abs() <= before.angle.0.abs() * f32::EPSILON,
                    "{before:?} {after:?}"
                );
            }
        }
        Err(error) => assert!(error.to_string().starts_with("a.toml"), "{error}"),
    }
}
