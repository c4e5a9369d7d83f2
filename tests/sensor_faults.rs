//! Every verdict on the gait sensor, on the virtual board: the flashed image is fed with a recorded knee as volts, the fault begins at 24
//! phases all over the stride and between any two of the four conversions of a tick, with noise on the volts and without. Measured: when the
//! verdict has its name, when the supervisor stops and why, when the outputs are off; asserted: the constants of
//! [`hgod_adc::Validity::detection_ms`] and the table of [`joint_loop::fault_response`].
//!
//! The frames are those of a replay of the board's own inputs, which is equal to the board's log bit for bit: that is asserted too.
//! What this shows is shown on models of the chip's peripherals, not on hardware.

use cpg_core::Generator;
use cpg_core::entrainment::Lock;
use footfall::board::default_loop::typical_sensor;
use footfall::board::feed;
use footfall_tests::board::{Board, Ran};
use footfall_tests::degraded::Random;
use footfall_tests::faults::{Fault, Knee, LSB, Rig, SUPPLY, table};
use footfall_tests::gestures::ARMED_S;
use footfall_tests::limits::assert_in_time;
use footfall_tests::recordings::{default_trace, default_traces_folder, package};
use gait_fit::fit::{Settings, Source, fit};
use gait_trace::ReadOptions;
use gait_trace::format::csv_file;
use gait_trace::format::open;
use hgod_adc::{Sensor, Supply, Validity};
use joint_loop::{
    BoardGenerator, Cause, FREEWHEEL_MS, Frame, GeneratorConfig, PARK_MS, Response, SENSOR_TOLERANCE_MS, SENSORS,
    SupervisorState, fault_response,
};
use joint_units::{AdcCode, Joint, Radians, Volts};
use std::f64::consts::PI;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use test_suite::{report, tests, traces_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        every_fault_is_classified_and_acted_on_in_time(Image),
        a_follower_freewheels_at_once_and_then_stands(Image),
        a_follower_walks_through_spikes_and_short_interruptions(Image),
        two_minutes_of_recordings_with_noise_are_all_good(Image, Traces),
        two_minutes_of_the_default_recording_are_all_good(Image),
        the_document_has_the_constants(),
    ])
}

/// Phases of the stride at which a fault begins.
const PHASES: u32 = 24;
/// Names how many of them a fault that lasts is tried at: a divisor of all.
const TRIED: &str = "FOOTFALL_PHASES";
/// So many if the variable does not exist.
const FEW: u32 = 6;

/// Walking from here on: 2 s of ramp after the arming.
const WALKING_S: f64 = ARMED_S + 2.05;

/// What a run came to.
#[derive(Debug, Clone, Copy)]
struct Measured {
    noise: f64,
    /// From the fault to the verdict, ms.
    detected_ms: f64,
    /// From the fault to the tick in which the supervisor stops, ms.
    stopped_ms: Option<f64>,
    /// From the fault to the first tick with the outputs off, ms.
    off_ms: Option<f64>,
}

/// Index of a tick's frame.
fn index(tick: u32) -> usize {
    tick as usize - 1
}

/// The first tick from `from` on for which something holds.
fn first(frames: &[Frame<SENSORS>], from: u32, holds: impl Fn(&Frame<SENSORS>) -> bool) -> Option<u32> {
    frames[index(from)..].iter().find(|frame| holds(frame)).map(|frame| frame.tick)
}

/// The tick in which a sensor has been not good for 50 ms more than it was good, from a tick on: where the supervisor must stop.
fn used_up(frames: &[Frame<SENSORS>], from: u32) -> Option<u32> {
    let mut spell = 0_i32;
    let tolerance = i32::from(SENSOR_TOLERANCE_MS);
    first(frames, from, |_| true)?;
    frames[index(from)..].iter().find_map(|frame| {
        spell = if frame.validity[0] == Some(Validity::Good) { (spell - 1).max(0) } else { spell + 1 };
        (spell > tolerance).then_some(frame.tick)
    })
}

/// One fault that lasts.
fn measure(rig: &Rig<'_>, sensor: &Sensor, fault: Fault, phase: u32, noise: f64) -> Measured {
    let clock = &rig.clock;
    let is = fault.reaction();
    // A loose contact is good now and then, which gives back some of the tolerance.
    let slack = if fault == Fault::Loose { 100 } else { 10 };
    let longest = f64::from(is.stops_ms() + PARK_MS + slack) * 1e-3;
    let knee = Knee::new(noise, 5.5, phase + 100);
    let at = clock.moment(WALKING_S + f64::from(phase) / f64::from(PHASES) * knee.stride_s(), phase);
    let secs = ((at + longest) * 1e3).ceil() * 1e-3;
    let (ran, frames) = rig.run(&table(&knee, &[(fault, at)], secs), secs);
    let of = format!("{fault:?} at phase {phase} of {PHASES}, noise {noise}");

    // The first sample that is wrong: where the code sticks, the first that repeats.
    let codes: Vec<AdcCode> = ran.boots[0].calls.iter().map(|(_, call)| AdcCode(call.codes[0])).collect();
    let whole = clock.first_wrong(at);
    let repeats = fault == Fault::Stuck && codes[index(whole)] != codes[index(whole - 1)];
    let wrong = whole + u32::from(repeats);

    // Before it all is well, but for the one tick of which half is the fault's.
    let sound = &frames[..index(whole - 1)];
    assert!(
        sound.iter().all(|frame| frame.validity[0] == Some(Validity::Good)),
        "{of}: a sample rejected without a fault"
    );
    assert_eq!(sound[sound.len() - 1].state, SupervisorState::Walking, "{of}");

    // The verdict, in time; and until then no sample is taken for an angle, if it is one of those that are doubted at once.
    let found = first(&frames, whole - 1, |frame| frame.validity[0] == Some(fault.verdict()))
        .unwrap_or_else(|| panic!("{of}: not classified"));
    let detection = u32::from(is.classified_ms);
    assert!(found < wrong + detection, "{of}: found in tick {found}, wrong from {wrong}");
    let detected_ms = clock.ms(at, found);
    // The fault may begin after the second of a tick's conversions, and a code that sticks right after a change.
    let late = if fault == Fault::Stuck { 1.5 } else { 0.5 };
    assert!(detected_ms <= f64::from(is.classified_ms) + late, "{of}: {detected_ms} ms");
    if is.rejected_ms == 1 && fault != Fault::Loose {
        assert!(
            frames[index(wrong)..index(found)].iter().all(|frame| frame.validity[0] != Some(Validity::Good)),
            "{of}"
        );
    }

    // The reaction.
    let left = first(&frames, whole - 1, |frame| frame.state != SupervisorState::Walking);
    if is.independent != Response::Off {
        assert_eq!(left, used_up(&frames, whole - 1), "{of}: the tolerance");
    }
    let expected = match fault {
        // Accepted again as soon as a joint could be there: before the tolerance is used up, or not.
        Fault::Jump => {
            let supply = Supply::new(Volts(SUPPLY as f32)).unwrap();
            let angle = |code| sensor.calibration().angle(sensor.reference().volts(code, supply)).unwrap().degrees();
            let good = first(&frames[..index(whole + 1)], whole - 2, |frame| frame.validity[0] != Some(Validity::Good))
                .unwrap()
                - 1;
            let far = (angle(codes[index(wrong)]) - angle(codes[index(good)])).abs();
            let (doubted, limit) = ((far - 3.0) / 1.5, f32::from(SENSOR_TOLERANCE_MS) + 1.0);
            // A code of noise is a few hundredths of a degree: right at the limit either is right.
            let either = (doubted - limit).abs() < 0.5;
            if if either { left.is_some() } else { doubted > limit } { Response::Park } else { Response::CarryOn }
        }
        _ => is.independent,
    };
    let mut measured = Measured { noise, detected_ms, stopped_ms: None, off_ms: None };
    match expected {
        Response::Park => {
            let left = left.unwrap_or_else(|| panic!("{of}: the walk goes on"));
            let frame = &frames[index(left)];
            assert_eq!((frame.state, frame.cause), (SupervisorState::Stopping, is.cause), "{of}");
            if fault != Fault::Loose {
                assert!(left < wrong + u32::from(is.stops_ms()), "{of}: stops in tick {left}, wrong from {wrong}");
            }
            let off = first(&frames, left, |frame| !frame.state.moving()).unwrap_or_else(|| panic!("{of}: not off"));
            assert!(off <= left + u32::from(PARK_MS), "{of}: off in tick {off}, stopped in {left}");
            let rest = &frames[index(off)];
            assert_eq!(
                (rest.state, rest.cause, rest.pulses.map(|us| us.0)),
                (SupervisorState::Disarmed, is.cause, [0; 4]),
                "{of}"
            );
            // By the board's own words, and by the meter on its pins.
            assert_eq!(ran.books.cause, is.cause, "{of}");
            let last_pulse = ran.pulses.last().expect("it walked").0;
            assert!(last_pulse <= clock.conversion(off, 3) + 1e-3, "{of}: a pulse at {last_pulse} s");
            assert_eq!(ran.end.edges_after_disarming, 0, "{of}");
            measured.stopped_ms = Some(clock.ms(at, left));
            measured.off_ms = Some(clock.ms(at, off));
        }
        Response::Off => {
            let left = left.unwrap_or_else(|| panic!("{of}: the walk goes on"));
            let frame = &frames[index(left)];
            assert_eq!((frame.state, frame.cause), (SupervisorState::Fault, is.cause), "{of}");
            assert_eq!((frame.pulses.map(|us| us.0), ran.books.cause), ([0; 4], is.cause), "{of}");
            assert!(left < wrong + u32::from(is.stops_ms()), "{of}: a fault in tick {left}, wrong from {wrong}");
            let last_pulse = ran.pulses.last().expect("it walked").0;
            assert!(last_pulse <= clock.conversion(left, 3) + 1e-3, "{of}: a pulse at {last_pulse} s");
            (measured.stopped_ms, measured.off_ms) = (Some(clock.ms(at, left)), Some(clock.ms(at, left)));
        }
        Response::CarryOn => assert_eq!((left, ran.books.cause), (None, Cause::None), "{of}"),
        other => unreachable!("{of}: {} of a generator that follows nobody", other.name()),
    }
    measured
}

/// Faults that are over before anything follows, all phases in one run: 5 of 24 of a stride apart.
fn measure_brief(rig: &Rig<'_>, fault: Fault, noise: f64) -> Vec<Measured> {
    let clock = &rig.clock;
    let is = fault.reaction();
    let knee = Knee::new(noise, 10.0, 7);
    let apart = knee.stride_s() * 5.0 / f64::from(PHASES);
    let faults: Vec<_> =
        (0..PHASES).map(|n| (fault, clock.moment(WALKING_S + 0.05 + f64::from(n) * apart, n))).collect();
    let secs = ((faults[faults.len() - 1].1 + 0.2) * 1e3).ceil() * 1e-3;
    let (ran, frames) = rig.run(&table(&knee, &faults, secs), secs);
    let walking = first(&frames, 1, |frame| frame.state == SupervisorState::Walking).expect("it walks");
    assert!(
        frames[index(walking)..].iter().all(|frame| frame.state == SupervisorState::Walking),
        "{fault:?} stops the walk"
    );
    assert_eq!(ran.books.cause, Cause::None);
    let mut bad = vec![false; frames.len()];
    let measured = faults.iter().map(|&(_, at)| {
        let wrong = clock.first_wrong(at);
        let over = clock.first_wrong(at + fault.lasts()) + 1;
        bad[index(wrong - 1)..=index(over)].fill(true);
        let of = format!("{fault:?} in tick {wrong}, noise {noise}");
        let found = first(&frames, wrong - 1, |frame| frame.validity[0] == Some(fault.verdict())).expect("classified");
        assert!(found < wrong + u32::from(is.classified_ms), "{of}: found in tick {found}");
        let during = &frames[index(wrong - 1)..=index(over)];
        let worst =
            during.iter().fold(Validity::Good, |worst, frame| worst.worse(frame.validity[0].unwrap_or_default()));
        assert_eq!(worst, fault.verdict(), "{of}: a worse validity");
        Measured { noise, detected_ms: clock.ms(at, found), stopped_ms: None, off_ms: None }
    });
    let measured = measured.collect();
    let other = frames.iter().zip(&bad).find(|(frame, bad)| !**bad && frame.validity[0] != Some(Validity::Good));
    assert!(other.is_none(), "{fault:?}: a sample rejected without a fault: {other:?}");
    measured
}

/// Two at a time.
fn two_at_a_time<T: Copy + Send + Sync, R: Send>(jobs: &[T], run: impl Fn(T) -> R + Sync) -> Vec<(T, R)> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(&job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let result = run(job);
                    done.lock().expect("no job panicked").push((job, result));
                }
            });
        }
    });
    done.into_inner().expect("no job panicked")
}

fn spread(values: impl Iterator<Item = f64>) -> String {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match values.as_slice() {
        [] => "-".into(),
        all => format!("{:.1} / {:.1} / {:.1}", all[0], all[all.len() / 2], all[all.len() - 1]),
    }
}

/// From one phase that is tried to the next.
fn step() -> usize {
    let number = std::env::var(TRIED).map_or(Ok(FEW), |text| text.parse().map_err(|_| text));
    let tried = number.ok().filter(|number| *number > 0 && PHASES.is_multiple_of(*number));
    let tried = tried.unwrap_or_else(|| panic!("{TRIED} is not a divisor of {PHASES}"));
    (PHASES / tried) as usize
}

fn every_fault_is_classified_and_acted_on_in_time() {
    let step = step();
    let board = Board::find();
    let (rig, sensor) = (Rig::new(&board, GeneratorConfig::default_walk(), true), typical_sensor().unwrap());
    let lasting = [Fault::Open, Fault::Short, Fault::Stuck, Fault::Jump, Fault::Loose, Fault::Outside, Fault::Supply];
    let brief = [Fault::Brief, Fault::Spike];
    let mut jobs: Vec<(Fault, u32, f64)> = vec![];
    for fault in lasting {
        jobs.extend((0..PHASES).step_by(step).map(|phase| (fault, phase, 0.0)));
        if fault != Fault::Stuck {
            // Noise of 1 or 2 codes, a new value each millisecond; a code that sticks has none.
            jobs.extend((1..PHASES).step_by(3 * step).map(|phase| (fault, phase, f64::from(1 + phase / 3 % 2))));
        }
    }
    jobs.extend(brief.iter().flat_map(|&fault| [0.0, 1.0, 2.0].map(|noise| (fault, 0, noise))));
    let done = two_at_a_time(&jobs, |(fault, phase, noise)| {
        if brief.contains(&fault) {
            measure_brief(&rig, fault, noise)
        } else {
            vec![measure(&rig, &sensor, fault, phase, noise)]
        }
    });
    assert_eq!(done.len(), jobs.len());

    report!(
        "| verdict | fault | n | constant, ms | detected, ms: min / median / max | reaction | stops, ms | outputs off, ms |"
    );
    report!("|---|---|---|---|---|---|---|---|");
    for fault in lasting.into_iter().chain(brief) {
        let all: Vec<Measured> =
            done.iter().filter(|((of, ..), _)| *of == fault).flat_map(|(_, measured)| measured.clone()).collect();
        let stops = all.iter().filter(|measured| measured.stopped_ms.is_some()).count();
        let is = fault.reaction();
        let answer = match stops {
            0 => "carries on".into(),
            n if n == all.len() => format!("{}, {}", is.independent.name(), is.cause.name()),
            n => format!("{n} park, {} carry on", all.len() - n),
        };
        report!(
            "| {} | {fault:?} | {} ({} with noise) | {} | {} | {answer} | {} | {} |",
            fault.verdict(),
            all.len(),
            all.iter().filter(|measured| measured.noise > 0.0).count(),
            is.classified_ms,
            spread(all.iter().map(|measured| measured.detected_ms)),
            spread(all.iter().filter_map(|measured| measured.stopped_ms)),
            spread(all.iter().filter_map(|measured| measured.off_ms)),
        );
        let ids: &[&str] = match fault {
            Fault::Open | Fault::Short => &["H45"],
            Fault::Stuck => &["H46"],
            Fault::Supply => &["H27", "H48"],
            _ => &[],
        };
        for (id, ms) in ids.iter().flat_map(|id| all.iter().filter_map(move |one| Some((id, one.stopped_ms?)))) {
            assert_in_time(id, ms, &format!("{fault:?}"));
        }
        assert!(all.len() >= PHASES as usize / step);
        if fault == Fault::Jump {
            let few = all.len() / 8;
            assert!(stops > few && all.len() - stops > few, "a jump of either kind: {stops} of {}", all.len());
        }
    }
}

/// The default recording, fitted, led by the knee that the volts are of.
fn follower() -> GeneratorConfig {
    let raw = open::read(&default_traces_folder().join(feed::DEFAULT_TRACE_NAME), &ReadOptions::default()).unwrap();
    let source = Source { name: feed::DEFAULT_TRACE_NAME.into(), sha256: String::new() };
    let settings = Settings { follow: Some(Joint::LeftKnee), starts: 10, ..Settings::default() };
    fit(&source, &raw, &settings, &mut |_| ()).unwrap().file.set.config()
}

/// How the follower stands in each tick, and its amplitude.
fn following(ran: &Ran, generator: &GeneratorConfig) -> Vec<(Lock, f32)> {
    ran.boots[0].watch(generator, |joints| {
        let BoardGenerator::Follow(follower) = joints.generator() else { panic!("not a follower") };
        (follower.status().state, follower.amplitude())
    })
}

/// A follower that has locked, and a fault that lasts: from the fault to the hold, to the first fading, to the stand, ms.
fn loses(rig: &Rig<'_>, fault: Fault, phase: u32) -> [f64; 3] {
    let (clock, is) = (&rig.clock, fault.reaction());
    let knee = Knee::new(if fault == Fault::Stuck { 0.0 } else { 1.0 }, 13.0, phase + 300);
    let at = clock.moment(6.0 + f64::from(phase) / f64::from(PHASES) * knee.stride_s(), phase);
    let secs = ((at + f64::from(is.freewheels_ms()) * 1e-3 + 2.5) * 1e3).ceil() * 1e-3;
    let (ran, frames) = rig.run(&table(&knee, &[(fault, at)], secs), secs);
    let ticks = following(&ran, &rig.generator);
    let of = format!("{fault:?} at phase {phase} of {PHASES}");
    let wrong = clock.first_wrong(at);
    assert!(frames[..index(wrong - 1)].iter().all(|frame| frame.validity[0] == Some(Validity::Good)), "{of}");
    assert_eq!((ticks[index(wrong - 1)].0, ticks[index(wrong - 1)].1), (Lock::Locked, 1.0), "{of}: before the fault");

    // It holds at once: no good sample for 20 ms, or sooner by what a moving leg does not do.
    let after = |from: u32, holds: &dyn Fn(&(Lock, f32)) -> bool| {
        let found = ticks[index(from)..].iter().position(holds);
        found.map(|n| from + n as u32).unwrap_or_else(|| panic!("{of}: never"))
    };
    let held = after(wrong - 1, &|tick| tick.0 != Lock::Locked);
    // A sensor that sticks where the leg hardly moves looks like a leg that stands.
    let stood = fault == Fault::Stuck && ticks[index(held)].0 == Lock::Stopped;
    assert!(stood || ticks[index(held)].0 == Lock::Holding, "{of}: {:?}", ticks[index(held)]);
    assert!(held < wrong + u32::from(is.freewheels_ms()), "{of}: holds in tick {held}, wrong from {wrong}");
    // It walks on, for 2 s and no longer, and stands 0.4 s later; the outputs stay on and the supervisor keeps out of it.
    let fades = after(held, &|tick| tick.1 < 1.0);
    assert!(fades - held <= u32::from(FREEWHEEL_MS) + 1, "{of}: fades after {} ms", fades - held);
    let stands = after(fades, &|tick| tick.1 < 0.02);
    assert!(stands - fades <= 400, "{of}: stands after {} ms", stands - fades);
    let walking = first(&frames, 1, |frame| frame.state == SupervisorState::Walking).expect("it walks");
    assert!(frames[index(walking)..].iter().all(|frame| frame.state == SupervisorState::Walking), "{of}");
    assert_eq!(ran.books.cause, Cause::None, "{of}");
    let last = &frames[frames.len() - 1];
    let stand = last.setpoints.iter().zip([0.0, 0.0, 5.0, 5.0]);
    assert!(stand.clone().all(|(angle, stand)| (angle.degrees() - stand).abs() < 1.0), "{of}: {last:?}");
    [held, fades, stands].map(|tick| clock.ms(at, tick))
}

fn a_follower_freewheels_at_once_and_then_stands() {
    let board = Board::find();
    let rig = Rig::new(&board, follower(), false);
    // The supply is a condition of the board: no follower walks on without it.
    let lasting = [Fault::Open, Fault::Short, Fault::Stuck, Fault::Jump, Fault::Outside];
    let jobs: Vec<(Fault, u32)> =
        lasting.into_iter().flat_map(|fault| (0..4).map(move |n| (fault, n * PHASES / 4 + n))).collect();
    let done = two_at_a_time(&jobs, |(fault, phase)| loses(&rig, fault, phase));
    assert_eq!(done.len(), jobs.len());
    report!("| verdict | fault | n | at most, ms | holds, ms: min / median / max | fades, ms | stands, ms |");
    report!("|---|---|---|---|---|---|---|");
    for fault in lasting {
        let of = |which: usize| spread(done.iter().filter(|((of, _), _)| *of == fault).map(|(_, ms)| ms[which]));
        let (verdict, most) = (fault.verdict(), fault.reaction().freewheels_ms());
        report!("| {verdict} | {fault:?} | 4 | {most} | {} | {} | {} |", of(0), of(1), of(2));
    }
}

/// What ends by itself is bridged: the follower stays locked.
fn a_follower_walks_through_spikes_and_short_interruptions() {
    let board = Board::find();
    let rig = Rig::new(&board, follower(), false);
    for fault in [Fault::Spike, Fault::Brief] {
        assert_eq!(fault.reaction().follower, Response::CarryOn);
        let knee = Knee::new(1.0, 13.0, 11);
        let apart = knee.stride_s() * 5.0 / f64::from(PHASES);
        let faults: Vec<_> = (0..PHASES).map(|n| (fault, rig.clock.moment(6.0 + f64::from(n) * apart, n))).collect();
        let (ran, _) = rig.run(&table(&knee, &faults, 12.0), 12.0);
        let ticks = following(&ran, &rig.generator);
        assert!(ticks[5_900..].iter().all(|tick| *tick == (Lock::Locked, 1.0)), "{fault:?}");
    }
}

/// Recordings of different people, one after the other with half a second in between to get from one angle to the next, through the default
/// sensor with 2 codes of noise: angles in degrees, one a millisecond.
fn in_a_row(people: &[(&str, &str)]) -> (Vec<String>, Vec<f64>) {
    let folder = traces_folder();
    let read = |name: &str| csv_file::read(&folder.join(format!("{name}.csv"))).expect("a good recording");
    let mut chosen = Vec::new();
    for (name, joint) in people {
        chosen.push((name.to_string(), *joint, read(name), 1.0));
    }
    // The default recording comes last; alone, it is played for as long as all.
    let times = if chosen.is_empty() { 60.0 } else { 1.0 };
    chosen.push((
        feed::DEFAULT_TRACE_NAME.into(),
        "left_knee",
        default_trace().looped(1000.0).unwrap().recording,
        times,
    ));
    let mut angles: Vec<f64> = vec![];
    for (_, joint, recording, times) in &chosen {
        let channel = recording.channel(joint).expect("it has that joint");
        let (start, round) = (recording.time_s()[0], recording.duration_s());
        let at = |ms: u32| recording.at(channel, start + (f64::from(ms) * 1e-3) % round);
        if let Some(&last) = angles.last() {
            angles.extend((1..500).map(|ms| last + (at(0) - last) * 0.5 * (1.0 - (f64::from(ms) * PI / 500.0).cos())));
        }
        angles.extend((0..(round * times * 1e3) as u32).map(at));
    }
    (chosen.into_iter().map(|(name, ..)| name).collect(), angles)
}

fn two_minutes_of_recordings_with_noise_are_all_good() {
    check_in_a_row(&[
        ("gaitprint_young_overground", "left_knee"),
        ("gaitprint_middle_overground", "right_hip"),
        ("knee_goniometer/uci_A05_walk_knee", "knee"),
        ("knee_goniometer/uci_A07_walk_knee", "knee"),
        ("biomechzoo_adult_level", "right_knee"),
    ]);
}

fn two_minutes_of_the_default_recording_are_all_good() {
    check_in_a_row(&[]);
}

fn check_in_a_row(people: &[(&str, &str)]) {
    let board = Board::find();
    let (rig, sensor) = (Rig::new(&board, GeneratorConfig::default_walk(), true), typical_sensor().unwrap());
    let (names, angles) = in_a_row(people);
    let mut random = Random(2);
    let mut text = String::from("time_s,PA1\n");
    for (degrees, ms) in angles.iter().zip(0..) {
        let volts = sensor.calibration().volts(Radians::from_degrees(*degrees as f32)).expect("inside of the table");
        let noise = 2.0 * LSB * random.normal();
        text += &format!("{:.3},{:.6}\n", f64::from(ms) * 1e-3, f64::from(volts.0) + noise);
    }
    let secs = angles.len() as f64 * 1e-3;
    let (ran, frames) = rig.run(&text, secs);
    let bad: Vec<_> = frames.iter().filter(|frame| frame.validity[0] != Some(Validity::Good)).collect();
    report!("{} frames of {names:?}: {} rejected", frames.len(), bad.len());
    assert!(bad.is_empty(), "{:?}", bad[0]);
    let walking = frames.iter().filter(|frame| frame.state == SupervisorState::Walking).count();
    assert!(frames.len() > 120_000 && walking + 2_400 > frames.len(), "{walking} of {}", frames.len());
    assert_eq!(ran.books.cause, Cause::None);
}

/// The tables of the document are those of the crates.
fn the_document_has_the_constants() {
    let text = std::fs::read_to_string(package().join("../docs/safety.md")).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("| `"));
    let rows: Vec<Vec<&str>> =
        rows.map(|row| row.split('|').map(|cell| cell.trim().trim_matches('`')).collect()).collect();
    for verdict in Validity::ALL {
        let Some(is) = fault_response(verdict) else { continue };
        let row = rows.iter().find(|row| row[0] == verdict.name()).unwrap_or_else(|| panic!("{verdict}: no row"));
        let [stops, freewheels] = [is.stops_ms(), is.freewheels_ms()].map(|ms| ms.to_string());
        let expected = [
            is.classified_ms.to_string(),
            is.cause.name().into(),
            is.independent.name().into(),
            stops,
            is.follower.name().into(),
            freewheels,
        ];
        assert_eq!(row[2..8], expected, "{verdict}");
    }
}
