//! Fits of real recordings: how near phase and shape comes, on what it saw and on what it did not; and that the board runs a fit.

use firmware::board::GENERATOR_SECTOR;
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::ARM;
use footfall_tests::recordings::{self, default_volts_file};
use gait_fit::fit::{Fit, Settings, Source, fit};
use gait_fit::judge::HeldOut;
use gait_trace::ReadOptions;
use gait_trace::format::open;
use gait_trace::{LowPass, Rules};
use joint_loop::store::generator_record::record_of;
use joint_loop::{Cause, GeneratorConfig, RecordName, SupervisorState};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use test_suite::{report, tests, traces_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        six_harmonics_fit_every_recording_within_half_a_degree(Traces),
        only_crouch_gait_is_called_asymmetric(Traces),
        every_recording_walks_or_is_fitted_into_the_limits(Traces),
        the_board_runs_a_fit_to_the_bit(Image),
        a_fit_walks_on_the_board_where_it_says_so(Image, Traces),
    ])
}

/// Errors against the mean stride that 6 harmonics must reach, hip and knee, degrees.
const GOAL_DEG: [f64; 2] = [0.4, 0.5];

/// How much worse than the mean of the person's strides the generator may be on strides that it did not fit.
const LOSS: f64 = 1.15;

fn fitted(path: &Path, settings: &Settings) -> Fit {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let raw = open::read(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let source = Source { name, sha256: String::new() };
    fit(&source, &raw, settings, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}

/// Certificates are their own tests' business.
fn settings() -> Settings {
    Settings { harmonics: Some(6), starts: 10, ..Settings::default() }
}

/// Every bilateral recording in the folder of traces, and the two cycles of the OpenSim tutorial.
fn bilateral(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    all.extend(
        ["osim_crouch_gait_cp_normalised.csv", "osim_normal_gait_mean_normalised.csv"]
            .map(|name| folder.join("normalised").join(name)),
    );
    all.retain(|path| path.extension().is_some_and(|ending| ending == "csv"));
    all.sort();
    assert!(all.len() >= 23, "{} recordings", all.len());
    all
}

fn six_harmonics_fit_every_recording_within_half_a_degree() {
    let folder = traces_folder();
    report!("| recording | strides | hip | knee | hip, unfiltered | knee, unfiltered | loss on held-out strides |");
    for path in bilateral(&folder) {
        let fit = fitted(&path, &settings());
        let raw = Settings { rules: Rules { low_pass: LowPass::Off, ..Rules::default() }, ..settings() };
        let unfiltered = fitted(&path, &raw);
        // Left and right together, as models are compared in the literature.
        let both = |fit: &Fit, joints: [usize; 2]| {
            (joints.map(|j| fit.joints[j].rmse_mean_stride_deg.powi(2)).iter().sum::<f64>() / 2.0).sqrt()
        };
        let errors = [both(&fit, [0, 1]), both(&fit, [2, 3])];
        let losses: Vec<f64> =
            fit.joints.iter().filter_map(|joint| Some(joint.rmse_heldout_deg? / joint.heldout_floor_deg?)).collect();
        let loss = losses.iter().copied().fold(0.0, f64::max);
        report!(
            "| {} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {} |",
            fit.source.name,
            fit.strides.cycles().len(),
            errors[0],
            errors[1],
            both(&unfiltered, [0, 1]),
            both(&unfiltered, [2, 3]),
            if losses.is_empty() { "-".into() } else { format!("{loss:.3}") }
        );
        assert!(errors[0] <= GOAL_DEG[0] && errors[1] <= GOAL_DEG[1], "{}: {errors:?}", fit.source.name);
        assert!(loss <= LOSS, "{}: {losses:?}", fit.source.name);
        assert_eq!(fit.held_out, HeldOut::of(fit.strides.cycles().len()));
        // A shape comes back; what is left are the limits of the robot.
        assert!(fit.certificate.status.comes_back(), "{}", fit.source.name);
        assert!(
            (fit.period_s - if fit.conditioned.normalised_cycle { 1.0 } else { fit.strides.period_s }).abs() < 1e-3
        );
    }
}

fn only_crouch_gait_is_called_asymmetric() {
    let folder = traces_folder();
    for path in bilateral(&folder) {
        let fit = fitted(&path, &settings());
        let crouch = fit.source.name.contains("crouch");
        assert_eq!(fit.asymmetric, crouch, "{}: {:?}", fit.source.name, fit.strides.asymmetry_deg());
        assert_eq!(fit.notes.iter().any(|note| note.starts_with("asymmetric")), crouch);
    }
}

/// Which fits walk on the default robot; those that do not walk once they are fitted into its limits.
fn every_recording_walks_or_is_fitted_into_the_limits() {
    report!("| recording | walks | RMSE as driven | change by --fit-limits |");
    for path in bilateral(&traces_folder()) {
        let fit = fitted(&path, &settings());
        let drive = &fit.certificate.drive;
        let driven = fit.joints.each_ref().map(|joint| joint.rmse_driven_deg);
        assert_eq!(driven.iter().all(Option::is_some), drive.walks);
        if drive.walks && drive.limited_ticks == 0 {
            // The limits change nothing: the error as driven is that of the generator.
            let same = |joint: &gait_fit::judge::JointFit| {
                joint.rmse_driven_deg.is_some_and(|driven| (driven - joint.rmse_mean_stride_deg).abs() < 0.02)
            };
            assert!(fit.joints.iter().all(same), "{}", fit.source.name);
        }
        let inside = fitted(&path, &Settings { fit_limits: true, ..settings() });
        let cost = inside.limits_cost_deg.expect("it was asked");
        assert!(inside.certificate.drive.walks && inside.certificate.drive.limited_ticks == 0, "{}", fit.source.name);
        assert!(inside.certificate.accepted, "{:?}", inside.certificate.refused_because);
        report!("| {} | {} | {driven:.2?} | {cost:.2?} |", fit.source.name, drive.in_words());
    }
}

/// A run of the flashed image with this generator in its parameter sector, armed at 0.3 s.
fn on_the_board(board: &Board, config: &GeneratorConfig, secs: f64) -> Ran {
    let sector = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(sector.path(), record_of(config, &RecordName::BUILT_IN).bytes()).unwrap();
    let mut options: Vec<OsString> = vec!["--secs".into(), secs.to_string().into(), "--volts".into()];
    options.extend([default_volts_file().into(), "--loop".into(), "--press".into(), ARM.into(), "--flash".into()]);
    options.push(format!("{GENERATOR_SECTOR:#010x}={}", sector.path().display()).into());
    board.run_with(config, options)
}

/// Ten seconds after the ramp of 2 s.
fn a_fit_walks_on_the_board_where_it_says_so() {
    let board = Board::find();
    let all = bilateral(&traces_folder());
    let judged = |path: &PathBuf| {
        let fit = fitted(path, &settings());
        let config = fit.file.set.config();
        let ran = on_the_board(&board, &config, 12.5);
        assert_eq!((ran.code, ran.boots.len()), (Some(0), 1), "{}", fit.source.name);
        let frames = ran.boots[0].replay(&config);
        let last = &frames[frames.len() - 1];
        (fit, last.state, last.cause)
    };
    // Two at a time, since a board takes one processor.
    let (first, second) = all.split_at(all.len() / 2);
    let both: Vec<_> = std::thread::scope(|scope| {
        let other = scope.spawn(|| second.iter().map(judged).collect::<Vec<_>>());
        let mut both: Vec<_> = first.iter().map(judged).collect();
        both.extend(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        both
    });
    report!("| recording | walks | state of the board after 12.5 s | cause |");
    for (fit, state, cause) in &both {
        let (name, drive) = (&fit.source.name, &fit.certificate.drive);
        report!("| {name} | {} | {} | {} |", drive.in_words(), state.name(), cause.name());
        assert_eq!(drive.walks, *state == SupervisorState::Walking, "{name}: {}, {cause:?}", drive.in_words());
        // None of these loses so much to the limits that it counts as not walking: each has stopped at a pose.
        assert_eq!(*cause, if drive.walks { Cause::None } else { Cause::Pose }, "{name}");
    }
    assert!(both.iter().any(|(fit, ..)| !fit.certificate.drive.walks), "the runners' knees are beyond the pose limit");
}

/// A generator fitted to the default recording, packed, in the parameter sector of the flashed image: its setpoints are the host's.
fn the_board_runs_a_fit_to_the_bit() {
    let board = Board::find();
    let fit = fitted(&recordings::default_traces_folder().join("gaitkit_fukuchi_healthy.csv"), &Settings::default());
    let config = fit.file.set.config();
    let ran = on_the_board(&board, &config, 8.0);
    assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (Some(0), 0, 0, 1));
    assert_eq!((ran.books.different, ran.books.not_compared), (0, 0), "{:?}", ran.books.differences);
    assert!(ran.books.compared > 750, "{}", ran.books.compared);
    let frames = ran.boots[0].replay(&config);
    assert_eq!(frames[frames.len() - 1].state, SupervisorState::Walking);
    let last = ran.boots[0].ticks.last().unwrap();
    let same = frames.iter().find(|frame| frame.tick == last.tick).unwrap();
    assert_eq!(same.setpoint_hash, last.setpoint_hash);
    // It is the fitted gait that was walked: over the last strides each joint's range is the mean stride's, within two degrees.
    let mean = fit.strides.mean();
    for joint in 0..4 {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)))
        };
        let walked = range(&mut frames[5_000..].iter().map(|frame| f64::from(frame.setpoints[joint].degrees())));
        let wanted = range(&mut mean.0[joint].iter().copied());
        assert!(
            (walked.0 - wanted.0).abs() < 2.0 && (walked.1 - wanted.1).abs() < 2.0,
            "{joint}: {walked:?}, {wanted:?}"
        );
    }
}
