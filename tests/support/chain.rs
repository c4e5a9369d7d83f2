//! The whole chain on the virtual board: a recorded angle becomes volts, the image's converter reads them, and its follower drives four
//! joints.
//!
//! The board logs what every call of its loop was given and, every tenth, what came of it. The same loop on the host, given the same,
//! gives the rest: phase, frequency and state of every tick. A run in which one logged bit differs from the host's, or one line could
//! not be compared, is refused: so these ticks are the board's.

use crate::board::{Board, Booted, Ran};
use crate::gestures;
use firmware::board::GENERATOR_SECTOR;
use footfall::board::default_loop::{SENSOR_PIN, wired_sensor};
use gait_fit::following::tick::Tick;
use gait_trace::format::csv_file;
use gait_trace::{Channel, Quantity, Recording};
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::generator_record::record_of;
use joint_loop::{BoardGenerator, GeneratorConfig, RecordName, RobotConfig, SupervisorState};
use std::ffi::OsString;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// From power-on until the joints of a run that is armed are driven by the follower alone: [`gestures::ARMED_S`] and a ramp of 2 s.
pub const FREE_S: f64 = 2.5;

/// What a board did with a feed.
#[derive(Debug)]
pub struct Chain {
    /// Every tick of the one boot. `angles` are the setpoints that the servos were given (the park pose while disarmed), `rates` their
    /// differences from tick to tick; the rest is the follower's.
    pub ticks: Vec<Tick>,
    /// Tick n was n + `first_ms` ms after power-on, when the feed began; to 1 ms.
    pub first_ms: usize,
    /// Whether the loop was walking at the end.
    pub walking: bool,
}

impl Chain {
    /// Ticks by milliseconds since power-on: those before the first are as the first.
    #[must_use]
    pub fn since_power_on(&self) -> Vec<Tick> {
        std::iter::repeat_n(self.ticks[0], self.first_ms).chain(self.ticks.iter().copied()).collect()
    }
}

/// Volts at the gait sensor's pin for angles in degrees, one a millisecond, through the default calibration.
///
/// # Panics
/// An angle is beyond the calibration.
#[must_use]
pub fn volts(degrees: &[f64]) -> Recording {
    let times = (0..degrees.len()).map(|ms| ms as f64 * 1e-3).collect();
    let angles =
        Recording::build(times, vec![Channel::new("joint", Quantity::Angle, degrees.to_vec())]).expect("a table");
    let wired = wired_sensor().expect("the default sensor");
    angles
        .semi_synthetic_volts(&angles.channels()[0], &wired.calibration, wired.divider, SENSOR_PIN)
        .expect("within the calibration")
}

/// Runs the image with a generator in its parameter sector and these volts for so many seconds, with these gestures of the button.
///
/// # Panics
/// Something was wrong with the run, or the host cannot follow it bit for bit.
#[must_use]
pub fn run(board: &Board, config: &GeneratorConfig, volts: &Recording, secs: f64, presses: &[&str]) -> Ran {
    let parameters =
        Parameters::with_defaults(Some(*config), None, RobotConfig::default_biped()).expect("the defaults");
    run_as(board, &parameters, volts, secs, presses)
}

/// The same of a robot with other numbers.
///
/// # Panics
/// As [`run`].
#[must_use]
pub fn run_as(board: &Board, parameters: &Parameters, volts: &Recording, secs: f64, presses: &[&str]) -> Ran {
    let folder = tempfile::tempdir().expect("a folder");
    let (feed, sector) = (folder.path().join("volts.csv"), folder.path().join("generator.bin"));
    csv_file::write(&feed, volts).expect("written");
    std::fs::write(&sector, record_of(&parameters.generator, &RecordName::BUILT_IN).bytes()).expect("written");
    let mut options: Vec<OsString> = vec![
        "--secs".into(),
        secs.to_string().into(),
        "--volts".into(),
        feed.into(),
        "--flash".into(),
        format!("{GENERATOR_SECTOR:#010x}={}", sector.display()).into(),
    ];
    options.extend(gestures::options(presses));
    let ran = board.run_as(parameters, options);
    assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (Some(0), 0, 0, 1));
    let books = &ran.books;
    assert_eq!((books.different, books.not_compared, books.lost_lines), (0, 0, 0), "{:?}", books.differences);
    assert!(books.compared as f64 >= (secs - 0.1) * 100.0, "{} lines were compared", books.compared);
    ran
}

/// Milliseconds from power-on until the tick of number 0 would have been, to 1 ms.
#[must_use]
pub fn begun_ms(boot: &Booted) -> usize {
    // The log is read each millisecond: the least delay of a line is what was left of the millisecond of its tick.
    let lines = boot.ticks.iter().zip(&boot.tick_times);
    let after = lines.map(|(tick, t_s)| ((t_s * 1e3).round() as usize).saturating_sub(tick.tick as usize));
    after.min().unwrap_or(0).saturating_sub(1)
}

/// Feeds a joint's angles in degrees, one a millisecond from power-on, to the sensor of a board that follows with it, to their end; with `arm` it
/// is armed.
///
/// # Panics
/// As [`run`], and where a control period was missed.
#[must_use]
pub fn follow(board: &Board, config: &GeneratorConfig, degrees: &[f64], arm: bool) -> Chain {
    let secs = degrees.len() as f64 * 1e-3;
    let ran = run(board, config, &volts(degrees), secs, if arm { &[gestures::ARM] } else { &[] });
    let boot = &ran.boots[0];
    let mut before = None;
    let ticks = boot.watch(config, |joints| {
        let (BoardGenerator::Follow(follower), frame) = (joints.generator(), joints.frame()) else {
            panic!("not a follower");
        };
        let angles = frame.setpoints.map(|angle| f64::from(angle.degrees()));
        let last = before.replace(angles).unwrap_or(angles);
        assert_eq!(frame.missed, 0, "a control period was missed");
        Tick::of(follower, angles, std::array::from_fn(|joint| (angles[joint] - last[joint]) * 1e3))
    });
    let first_ms = begun_ms(boot) + boot.calls.first().map_or(0, |call| call.0 as usize);
    let walking = boot.ticks.last().is_some_and(|tick| tick.state == SupervisorState::Walking);
    Chain { ticks, first_ms, walking }
}

/// Does all jobs, as many at a time as there are cores, and reports progress on standard error. Results are in the order of the jobs.
///
/// # Panics
/// A job does.
pub fn all<J: Sync, R: Send>(what: &str, jobs: &[J], work: impl Fn(&J) -> R + Sync) -> Vec<R> {
    let (next, done, began) = (AtomicUsize::new(0), Mutex::new(0), Instant::now());
    let worker = || {
        let mut results = vec![];
        loop {
            let n = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(n) else { return results };
            results.push((n, work(job)));
            let Ok(mut done) = done.lock() else { return results };
            *done += 1;
            if *done % jobs.len().div_ceil(10).max(1) == 0 || *done == jobs.len() {
                eprintln!("{what}: {done} of {} in {:.0} s", jobs.len(), began.elapsed().as_secs_f64());
            }
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
    let mut results: Vec<(usize, R)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        let joined =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        joined.flatten().collect()
    });
    results.sort_by_key(|result| result.0);
    results.into_iter().map(|(_, result)| result).collect()
}
