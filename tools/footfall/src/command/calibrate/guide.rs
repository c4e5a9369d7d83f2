//! A guided calibration: asks the operator for one angle after the other, takes live codes at each, and reports their statistics at once, so
//! that a bad pose is repeated while the sensor is still in place.
//!
//! Live codes are those of a board's first sensor, or lines of `CODE` or `CODE VREFINT`; other lines of a log are skipped. An empty
//! answer takes samples at the requested angle, a number takes them at that angle instead, `skip` omits the angle, and `end` ends the
//! session with the rows so far. Nothing is written before the end, so an aborted session leaves no file.

use super::live::{self, Live};
use super::rows::{self, Reading, Rows};
use super::samples::{Sample, read_samples, samples_of_board, statistics, take};
use crate::answers::lines;
use crate::board::source::Origin;
use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;
use hgod_adc::ANATOMY;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufRead, BufReader, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};

/// The default angles: a knee, up and down.
pub const ANGLES_DEG: [f64; 17] =
    [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 70.0, 60.0, 50.0, 40.0, 30.0, 20.0, 10.0, 0.0];

/// The source of the codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Codes {
    /// A file: codes are taken one after the other.
    Kept,
    /// A live source: codes before an answer are discarded.
    Live,
    /// The same, with the codes shown until the answer: `out` is a terminal.
    LiveOnScreen,
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Angles in degrees, in the order in which they are asked for.
    pub angles_deg: Vec<f64>,
    /// Samples at each.
    pub samples: usize,
    /// Largest standard deviation in codes; a pose above is repeated.
    pub most_sd: f64,
}

/// The operator's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Answer {
    Take(f64),
    Skip,
    End,
    Unclear,
}

/// Where live codes come from.
#[derive(Debug, Clone, PartialEq)]
pub enum CodeSource {
    /// Lines of a file, a pipe, or `-` for standard input.
    Lines(PathBuf),
    /// A board.
    Board(Origin),
}

/// Settings of a guided calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Where the live codes come from.
    pub codes: CodeSource,
    /// Where the rows are kept.
    pub keep_rows: Option<PathBuf>,
    /// Whether that file may be replaced.
    pub overwrite: Overwrite,
    /// What is asked for.
    pub plan: Plan,
}

impl Settings {
    /// The name of the rows in error texts.
    #[must_use]
    pub fn name(&self) -> String {
        self.keep_rows.as_ref().map_or("guide".into(), |path| path.display().to_string())
    }
}

/// Takes rows from live codes, with an operator who sets the angles.
///
/// # Errors
/// A source that ends, sends nothing, or sends other text; answers that cannot be read; too few rows for a calibration.
pub fn rows(settings: &Settings, reading: &Reading) -> Result<Rows, Failure> {
    let cannot = |name: &Path, error: io::Error| Failure::input(format!("{}: cannot be read: {error}", name.display()));
    let (samples, from_stdin, kept) = match &settings.codes {
        CodeSource::Lines(stdin) if stdin.as_os_str() == "-" => {
            (read_samples(BufReader::new(io::stdin())), true, false)
        }
        CodeSource::Lines(path) => {
            let file = File::open(path).map_err(|error| cannot(path, error))?;
            let kept = file.metadata().is_ok_and(|file| file.is_file());
            (read_samples(BufReader::new(file)), false, kept)
        }
        CodeSource::Board(origin) => {
            let opened = origin.open(false);
            let board = opened.map_err(|error| Failure::input(format!("{origin}: cannot be opened: {error}")))?;
            (samples_of_board(board), origin.is_stdin(), false)
        }
    };
    // If codes come from standard input, answers come from the terminal.
    let terminal = Path::new("/dev/tty");
    let answers: Box<dyn BufRead + Send> = if from_stdin {
        Box::new(BufReader::new(File::open(terminal).map_err(|error| cannot(terminal, error))?))
    } else {
        Box::new(BufReader::new(io::stdin()))
    };
    let how = match (kept, io::stderr().is_terminal()) {
        (true, _) => Codes::Kept,
        (false, false) => Codes::Live,
        (false, true) => Codes::LiveOnScreen,
    };
    let text = ask_with(&settings.plan, &samples, how, answers, io::stderr())?;
    if let Some(path) = &settings.keep_rows {
        output::write_text(path, &text, settings.overwrite)?;
        messages::written(path);
    }
    rows::parse(&settings.name(), text.as_bytes(), reading).map_err(Failure::input)
}

/// Asks for the angles, and gives the rows as the text of a file.
///
/// # Errors
/// As [`rows()`].
pub fn ask(
    plan: &Plan,
    codes: impl BufRead + Send + 'static,
    how: Codes,
    answers: impl BufRead + Send + 'static,
    out: impl Write,
) -> Result<String, Failure> {
    ask_with(plan, &read_samples(codes), how, answers, out)
}

fn ask_with(
    plan: &Plan,
    samples: &Receiver<Result<Sample, String>>,
    how: Codes,
    answers: impl BufRead + Send + 'static,
    mut out: impl Write,
) -> Result<String, Failure> {
    let answers = lines(answers);
    let mut text = String::new();
    let mut with_vrefint = None;
    'angles: for &asked in &plan.angles_deg {
        loop {
            let asks = format!("{asked} degrees: hold, then Enter (or another angle, skip, end)");
            writeln!(out, "{asks}").and_then(|()| out.flush()).map_err(Failure::run)?;
            let Some(answer) = answer(&answers, samples, how, &mut out).map_err(Failure::run)? else {
                return Err(Failure::input(format!(
                    "the answers end at {asked} degrees; allowed is `end` to end early"
                )));
            };
            let mut tell = |line: String| writeln!(out, "{line}").and_then(|()| out.flush()).map_err(Failure::run);
            let angle = match understand(&answer, asked) {
                Answer::Take(angle) => angle,
                Answer::Skip => continue 'angles,
                Answer::End => break 'angles,
                Answer::Unclear => {
                    tell("allowed are Enter, an angle from -60 to 170 degrees, skip, end".into())?;
                    continue;
                }
            };
            if how != Codes::Kept {
                samples.try_iter().for_each(drop);
            }
            let taken = take(samples, plan.samples, &mut with_vrefint)?;
            let (mean, sd, drift) = statistics(&taken);
            tell(format!("{angle} degrees: mean {mean:.1}, standard deviation {sd:.2}, drift {drift:+.1} codes"))?;
            if sd > plan.most_sd {
                tell(format!(
                    "unsteady: allowed is a standard deviation of {} codes; hold the angle again",
                    plan.most_sd
                ))?;
                continue;
            }
            for (code, vrefint) in taken {
                // Writing to a string cannot fail.
                let _ = match vrefint {
                    Some(vrefint) => writeln!(text, "{angle},{code},{vrefint}"),
                    None => writeln!(text, "{angle},{code}"),
                };
            }
            continue 'angles;
        }
    }
    let header = if with_vrefint == Some(true) { "angle_deg,code,vrefint\n" } else { "angle_deg,code\n" };
    Ok(format!("{header}{text}"))
}

/// The next answer, with the codes on the screen until then; `None` at the end of the answers.
fn answer(
    answers: &Receiver<io::Result<String>>,
    samples: &Receiver<Result<Sample, String>>,
    how: Codes,
    out: &mut impl Write,
) -> io::Result<Option<String>> {
    if how != Codes::LiveOnScreen {
        return answers.recv().ok().transpose();
    }
    let mut live = Live::begin(out)?;
    loop {
        match answers.recv_timeout(live::EVERY) {
            Ok(line) => return line.map(Some),
            Err(RecvTimeoutError::Timeout) => live.refresh(samples, out)?,
            Err(RecvTimeoutError::Disconnected) => {
                writeln!(out)?;
                return Ok(None);
            }
        }
    }
}

fn understand(answer: &str, asked: f64) -> Answer {
    match answer.trim() {
        "" => Answer::Take(asked),
        "skip" => Answer::Skip,
        "end" => Answer::End,
        other => match other.parse::<f64>() {
            Ok(angle) if (ANATOMY.0.degrees().round()..=ANATOMY.1.degrees().round()).contains(&(angle as f32)) => {
                Answer::Take(angle)
            }
            _ => Answer::Unclear,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use wire::{Call, Environment, Inputs, MAX_FRAME_BYTES, Record, frame_record};

    fn plan(angles_deg: &[f64]) -> Plan {
        Plan { angles_deg: angles_deg.into(), samples: 4, most_sd: 3.0 }
    }

    fn guided(angles: &[f64], codes: &str, answers: &str) -> (Result<String, String>, String) {
        let mut said = Vec::new();
        let text =
            ask(&plan(angles), Cursor::new(codes.to_owned()), Codes::Kept, Cursor::new(answers.to_owned()), &mut said);
        (text.map_err(|failure| failure.to_string()), String::from_utf8(said).unwrap())
    }

    #[test]
    fn each_angle_gets_its_codes() {
        let (text, said) = guided(&[0.0, 10.0], "1\n2\n3\n4\n8\n8\n8\n8\n", "\n12.5\n");
        assert_eq!(text.unwrap(), "angle_deg,code\n0,1\n0,2\n0,3\n0,4\n12.5,8\n12.5,8\n12.5,8\n12.5,8\n");
        // Deviations -1.5 to 1.5: variance 5/3, and a line of slope 1 over 3 steps.
        assert!(said.contains("0 degrees: mean 2.5, standard deviation 1.29, drift +3.0 codes"), "{said}");
    }

    #[test]
    fn an_unsteady_pose_is_repeated_and_an_unclear_answer_asked_again() {
        let (text, said) = guided(&[0.0], "0\n9\n0\n9\n5\n5\n5\n5\n", "\n200\n\n");
        assert_eq!(text.unwrap(), "angle_deg,code\n0,5\n0,5\n0,5\n0,5\n");
        assert!(said.contains("unsteady: allowed is a standard deviation of 3 codes; hold the angle again"), "{said}");
        assert!(said.contains("an angle from -60 to 170 degrees"), "{said}");
    }

    #[test]
    fn the_records_of_a_board_are_taken_as_they_are() {
        let framed = |record: &Record| frame_record(record, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec();
        let inputs = |first_tick, codes: [u16; 2]| {
            let call =
                |code| Call { codes: [code].into_iter().collect(), reference: 1502, elapsed: 1, ..Call::default() };
            framed(&Record::Inputs(Inputs { first_tick, calls: codes.map(call).into_iter().collect() }))
        };
        let other = framed(&Record::Environment(Environment {
            die_c: None,
            supply_v: None,
            watchdog_hz: None,
            debugger: false,
        }));
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [inputs(7, [2048, 2049]), other, inputs(9, [2047, 2046])].concat()).unwrap();
        let origin = Origin::Rtt(crate::file::capture::rtt::Source::File(file.path().into()));
        let (samples, answers) = (samples_of_board(origin.open(false).unwrap()), Cursor::new("skip\n\nend\n"));
        let text = ask_with(&plan(&[30.0, 40.0, 50.0]), &samples, Codes::Kept, answers, io::sink()).unwrap();
        assert_eq!(text, "angle_deg,code,vrefint\n40,2048,1502\n40,2049,1502\n40,2047,1502\n40,2046,1502\n");
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        for (codes, answers, words) in [
            ("1\n2\n", "\n", "the codes end, 2 of 4 were taken"),
            ("1\n5000\n", "\n", "codes, line 2: `5000`: allowed are"),
            ("1\n1 2 3\n", "\n", "codes, line 2: `1 2 3`"),
            ("1\n1 2\n", "\n", "with and without VREFINT"),
            ("1\n", "", "the answers end at 0 degrees; allowed is `end`"),
        ] {
            let error = guided(&[0.0], codes, answers).0.unwrap_err();
            assert!(error.contains(words), "{error} does not say {words}");
        }
    }
}
