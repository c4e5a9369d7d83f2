//! Recordings of people who walk, through the whole sensor path: angle, volts, code, volts, angle.
//!
//! Claims: the converter's code costs no more than half of itself; the filtered angle is that of the filter's equation in
//! double precision; no sample that a leg can make is rejected, in more than an hour with noise on top, and
//! no follower takes a sound sensor for a bad one; stride periods are those of the table beside the recordings; the default volts are
//! what the documented command makes.

use cpg_core::entrainment::{Follower, Lock};
use cpg_core::{Follow, Generator};
use footfall::board::default_loop::{SENSOR_JOINT, TYPICAL_VREFINT_CAL, typical_sensor, wired_sensor};
use footfall::board::feed;
use footfall::cli;
use footfall::command::entrain::default_generator;
use footfall_tests::degraded::Random;
use footfall_tests::recordings::{csv_files, default_trace, default_traces_folder, default_volts, default_volts_file};
use gait_fit::following::learn::learn;
use gait_fit::following::run;
use gait_trace::format::csv_file;
use gait_trace::stride::period;
use gait_trace::{Channel, Fault, Recording};
use hgod_adc::{
    Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig,
    SensorState, Supply, Validity,
};
use joint_units::{AdcCode, Joint, Period, Radians, Volts};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::process::ExitCode;
use test_suite::{report, tests, traces_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_default_recording_passes_the_default_sensor(),
        no_sample_of_a_recording_is_rejected_falsely(Traces),
        an_hour_of_recordings_with_noise_is_all_good(Traces),
        an_hour_of_the_default_recording_with_noise_is_all_good(),
        stride_periods_are_those_of_the_published_table(Traces),
        the_documented_command_makes_the_default_volts(),
        the_default_volts_are_the_left_knee_looped(),
        every_default_recording_is_described(),
    ])
}

/// The fastest that a leg in these recordings turns, in degrees a millisecond: the knees of sprinters reach 1060 degrees a second.
const FASTEST_LEG: f64 = 1.2;

/// A goniometer that reaches every angle of every recording: 100 degrees a volt, straight.
fn wide_sensor() -> Sensor {
    let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    let table = [point(0.3, -60.0), point(2.6, 170.0)];
    SensorConfig {
        reference: ReferenceConfig { min_supply: Volts(2.7), ..ReferenceConfig::stm32f4(TYPICAL_VREFINT_CAL) },
        calibration: Calibration::new(&table, Interpolation::Linear).unwrap(),
        filter: FilterConfig::default(),
        health: HealthConfig::default(),
    }
    .build(Period::MILLISECOND)
    .unwrap()
}

/// What came of a channel.
#[derive(Debug, Default)]
struct Passage {
    samples: usize,
    /// Largest error of the angle behind the converter, and of the filtered angle against the filter's equation, in degrees.
    conversion: f64,
    filter: f64,
    /// Samples rejected although a leg can make them.
    false_verdicts: Vec<(f64, Validity)>,
    /// Samples rejected on steps that are faster than any joint: artefacts of the recording.
    artefacts: usize,
}

/// The largest error that a conversion may make: half a code, at the steepest place of the table, and rounding.
fn conversion_bound(sensor: &Sensor, supply: Supply) -> f64 {
    let half_code = f64::from(sensor.reference().volts(AdcCode(1), supply).0) / 2.0;
    let (low, high) = sensor.calibration().volts_span();
    let angle = |volts: f64| {
        let volts = (volts as f32).clamp(low.0, high.0);
        f64::from(sensor.calibration().angle(Volts(volts)).unwrap().0).to_degrees()
    };
    let steps = 20_000;
    let step = f64::from(high.0 - low.0) / f64::from(steps);
    let slope = (0..steps)
        .map(|n| f64::from(low.0) + f64::from(n) * step)
        .map(|volts| (angle(volts + step) - angle(volts)).abs() / step)
        .fold(0.0, f64::max);
    // A microvolt from the rounding of the volts, and the noise of single precision in the slope itself.
    slope * 1.02 * (half_code + 1e-6) + 0.001
}

/// A supply of about 3.0 V that the internal reference reads without rounding, so that half a code is all that is lost.
fn supply(sensor: &Sensor) -> (Supply, AdcCode) {
    let vrefint = sensor.reference().vrefint(Supply::new(Volts(3.0)).unwrap());
    (sensor.reference().supply(vrefint).unwrap(), vrefint)
}

/// Median of three, then one pole at the default 40 Hz: the equations of the sensor's filter in double precision.
struct Filter {
    last: Option<([f64; 2], f64)>,
}

impl Filter {
    fn step(&mut self, x: f64) -> f64 {
        let gain = 1.0 - (-TAU * 40.0 * 1e-3).exp();
        let ([a, b], y) = self.last.unwrap_or(([x, x], x));
        let median = a.max(b).min(a.min(b).max(x));
        let y = y + gain * (median - y);
        self.last = Some(([b, x], y));
        y
    }
}

fn pass(recording: &Recording, channel: &Channel, sensor: &Sensor) -> Passage {
    let (supply, vrefint) = supply(sensor);
    let volts = recording.semi_synthetic_volts(channel, sensor.calibration(), 1.0, "PA1").unwrap();
    let pin = &volts.channels()[0];
    let (mut state, mut filter, mut passage) = (SensorState::default(), Filter { last: None }, Passage::default());
    let (start, ticks) = (recording.time_s()[0], (recording.duration_s() * 1000.0) as u32);
    let (mut good_angle, mut since_good) = (None::<f64>, 0_u32);
    for tick in 0..=ticks {
        let time = start + f64::from(tick) * 1e-3;
        let code = sensor.reference().code(Volts(volts.at(pin, time) as f32), supply);
        let reading = sensor.sample(&mut state, code, vrefint);
        passage.samples += 1;
        since_good += 1;
        // What the sensor has seen, exactly: the angle of the volts between two rows of volts.
        let seen = f64::from(sensor.calibration().angle(Volts(volts.at(pin, time) as f32)).unwrap().0).to_degrees();
        let converted = f64::from(sensor.calibration().angle(reading.volts).unwrap().0).to_degrees();
        passage.conversion = passage.conversion.max((converted - seen).abs());
        if reading.validity == Validity::Good {
            let expected = filter.step(converted);
            passage.filter = passage.filter.max((f64::from(reading.angle.0).to_degrees() - expected).abs());
            (good_angle, since_good) = (Some(converted), 0);
        } else {
            let step = good_angle.map_or(0.0, |good| (converted - good).abs());
            if matches!(reading.validity, Validity::Spike | Validity::Rate)
                && step > FASTEST_LEG * f64::from(since_good)
            {
                passage.artefacts += 1;
            } else {
                passage.false_verdicts.push((time, reading.validity));
            }
        }
    }
    passage
}

fn fits(channel: &Channel, sensor: &Sensor) -> bool {
    let (low, high) = sensor.calibration().span();
    channel.radians().all(|angle| (low.0..=high.0).contains(&angle.0))
}

/// Every channel of a recording through a sensor; true if the recording has an artefact.
fn check(name: &str, recording: &Recording, sensor: &Sensor, channels: &[&Channel]) -> (usize, usize) {
    let bound = conversion_bound(sensor, supply(sensor).0);
    let (mut samples, mut artefacts) = (0, 0);
    for channel in channels {
        let passage = pass(recording, channel, sensor);
        let of = format!("{name}, {}", channel.name());
        assert!(passage.conversion <= bound, "{of}: {} degrees lost in conversion, bound {bound}", passage.conversion);
        // Single precision over many steps of a recursive filter.
        assert!(passage.filter < 1e-3 || passage.artefacts > 0, "{of}: filter off by {} degrees", passage.filter);
        assert!(passage.false_verdicts.is_empty(), "{of}: {:?}", passage.false_verdicts);
        samples += passage.samples;
        artefacts += passage.artefacts;
    }
    (samples, artefacts)
}

fn the_default_recording_passes_the_default_sensor() {
    let (recording, sensor) = (default_trace(), typical_sensor().unwrap());
    let channels: Vec<&Channel> = recording.channels().iter().collect();
    assert_eq!(channels.len(), 4);
    let (samples, artefacts) = check("default", &recording, &sensor, &channels);
    assert_eq!((samples > 9_000, artefacts), (true, 0));
}

fn no_sample_of_a_recording_is_rejected_falsely() {
    let folder = traces_folder();
    let (default, wide) = (typical_sensor().unwrap(), wide_sensor());
    let (mut samples, mut files, mut by_default) = (0, 0, 0);
    let mut with_artefacts = BTreeMap::new();
    for path in csv_files(&folder) {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if name == "fda_gait_boys" || name == "erc_rk09k_potentiometer_calibration" {
            let error = csv_file::read(&path).unwrap_err();
            assert!(matches!(*error.fault, Fault::MissingColumn { wanted: "time_s", .. }), "{error}");
            continue;
        }
        // Thigh angles beside the phase of a device: no angle of a joint.
        if path.parent().is_some_and(|folder| folder.ends_with("tum_thigh")) {
            assert!(csv_file::read(&path).unwrap_err().to_string().contains("`device_phase_rad`"));
            continue;
        }
        let recording = csv_file::read(&path).unwrap_or_else(|error| panic!("{error}"));
        files += 1;
        let channels: Vec<&Channel> = recording.channels().iter().collect();
        let (n, artefacts) = check(&name, &recording, &wide, &channels);
        samples += n;
        if artefacts > 0 {
            with_artefacts.insert(name.clone(), artefacts);
        }
        let near: Vec<&Channel> = channels.into_iter().filter(|channel| fits(channel, &default)).collect();
        by_default += near.len();
        check(&name, &recording, &default, &near);
    }
    assert!(files > 20 && by_default > 60, "{files} files, {by_default} channels through the default sensor");
    report!("{files} files, {samples} samples (1 ms), {by_default} channels also through the default sensor");
    report!("samples refused as faster than any joint: {with_artefacts:?}");
    // Dropped markers that the description of the recordings lists; what a leg did is never refused.
    let known = ["camargo_levelground_ccw_fast_full_with_artefacts"];
    let other: Vec<_> = with_artefacts.keys().filter(|name| !known.contains(&name.as_str())).collect();
    assert!(other.is_empty(), "{other:?}");
}

/// Noise on top of a recording: standard deviations in codes, of sensor and reference, and in degrees; a new value each millisecond.
const NOISES: [(f64, f64); 8] =
    [(1.0, 0.0), (2.0, 0.0), (4.0, 0.0), (1.0, 0.1), (4.0, 0.1), (1.0, 0.3), (2.0, 0.3), (4.0, 0.3)];

/// One sample as the loop gets it.
struct Measured {
    verdict: Validity,
    /// As it left the filter.
    angle: Radians,
    /// The unfiltered angle, in degrees.
    raw: f64,
}

/// A channel with noise through the sensor path, at 1 kHz.
fn measure(recording: &Recording, channel: &Channel, sensor: &Sensor, noise: (f64, f64), seed: u32) -> Vec<Measured> {
    let (supply, vrefint) = supply(sensor);
    let mut random = Random(seed);
    let (mut state, start) = (SensorState::default(), recording.time_s()[0]);
    let ticks = (recording.duration_s() * 1000.0) as u32;
    let code = |code: AdcCode, by: f64| AdcCode((f64::from(code.0) + by).round().clamp(0.0, 4095.0) as u16);
    let measured = (0..=ticks).map(|tick| {
        let degrees = recording.at(channel, start + f64::from(tick) * 1e-3) + noise.1 * random.normal();
        let volts = sensor.calibration().volts(Radians::from_degrees(degrees as f32)).expect("chosen to fit");
        let sound = sensor.reference().code(volts, supply);
        let (by, reference) = (noise.0 * random.normal(), noise.0 * random.normal());
        let reading = sensor.sample(&mut state, code(sound, by), code(vrefint, reference));
        Measured { verdict: reading.validity, angle: reading.angle, raw: degrees }
    });
    measured.collect()
}

/// The table has a margin for the channel and 3 degrees of noise.
fn fits_with_noise(channel: &Channel, sensor: &Sensor) -> bool {
    let (low, high) = sensor.calibration().span();
    let margin = Radians::from_degrees(3.0).0;
    channel.radians().all(|angle| (low.0 + margin..=high.0 - margin).contains(&angle.0))
}

/// A recording with artefacts that the sensor must reject: dropped markers, which the description of the recordings lists.
const WITH_ARTEFACTS: &str = "camargo_levelground_ccw_fast_full_with_artefacts";

fn an_hour_of_recordings_with_noise_is_all_good() {
    let mut recordings = vec![("default".to_string(), default_trace())];
    for path in csv_files(&traces_folder()) {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        match csv_file::read(&path) {
            // One cycle on a time axis of its own is no recording.
            Ok(recording) if !name.ends_with("_normalised") => recordings.push((name, recording)),
            Ok(_) | Err(_) => {}
        }
    }
    assert!(recordings.len() > 30, "{} recordings", recordings.len());
    check_with_noise(&recordings);
}

/// The same of the default recording alone, looped for as long.
fn an_hour_of_the_default_recording_with_noise_is_all_good() {
    check_with_noise(&[("default".to_string(), looped(&default_trace(), 460.0))]);
}

fn check_with_noise(recordings: &[(String, Recording)]) {
    let (near, wide) = (typical_sensor().unwrap(), wide_sensor());
    let (mut sampled, mut by_near, mut followed, mut locked) = (0, 0, 0, 0);
    let (mut artefacts, mut too_short) = (0, vec![]);
    for (r, (name, recording)) in recordings.iter().enumerate() {
        // Another joint's sensor from recording to recording.
        let channel = &recording.channels()[(r + 2) % recording.channels().len()];
        let sensor = if fits_with_noise(channel, &near) { &near } else { &wide };
        let mut legs = legs(recording, channel);
        if legs.is_none() {
            too_short.push(name.as_str());
        }
        for (noise, seed) in NOISES.into_iter().zip(1..) {
            let of = format!("{name}, {}, noise of {} codes and {} degrees", channel.name(), noise.0, noise.1);
            let measured = measure(recording, channel, sensor, noise, seed);
            sampled += measured.len();
            by_near += if std::ptr::eq(sensor, &near) { measured.len() } else { 0 };
            let (mut good, mut since) = (measured[0].raw, 0);
            for (tick, sample) in measured.iter().enumerate() {
                since += 1;
                if sample.verdict == Validity::Good {
                    (good, since) = (sample.raw, 0);
                    continue;
                }
                let jump = (sample.raw - good).abs() > FASTEST_LEG * f64::from(since) + 10.0 * noise.1;
                let of_jump = matches!(sample.verdict, Validity::Spike | Validity::Rate);
                assert!(name == WITH_ARTEFACTS && jump && of_jump, "{of}: {} in ms {tick}", sample.verdict);
                artefacts += 1;
            }

            let Some(legs) = &mut legs else { continue };
            legs.reset();
            for (tick, sample) in measured.iter().enumerate() {
                legs.observe((sample.verdict == Validity::Good).then_some(sample.angle));
                legs.step();
                let status = legs.status();
                assert!(status.state != Lock::Holding, "{of}: holds in ms {tick}, {:?}", status.fault);
                locked += usize::from(status.state == Lock::Locked);
            }
            followed += measured.len();
        }
    }
    let [sampled, by_near, followed, locked] = [sampled, by_near, followed, locked].map(|ms| ms / 1000);
    report!(
        "{} recordings with noise, {sampled} s in all, {by_near} s by the default sensor: 0 false verdicts",
        recordings.len()
    );
    report!("apart from that, in {WITH_ARTEFACTS}: {artefacts} samples of dropped markers refused");
    report!(
        "followed for {followed} s, locked for {locked} s of them: 0 holds; too short to learn from: {too_short:?}"
    );
    assert!(sampled > 3_600 && followed > 3_500 && locked > 2_500);
}

/// A recording cut to whole strides, over and over.
fn looped(recording: &Recording, secs: f64) -> Recording {
    let round = recording.looped(1000.0).unwrap().recording;
    let rows = (secs * 1000.0) as usize;
    let channels = round.channels().iter().map(|channel| {
        let period = channel.values().len() - 1;
        Channel::new(channel.name(), channel.quantity(), (0..rows).map(|n| channel.values()[n % period]).collect())
    });
    Recording::build((0..rows).map(|n| n as f64 * 1e-3).collect(), channels.collect()).unwrap()
}

/// Legs that follow a channel's sensor of this person, as `footfall entrain` makes them; `None` where it cannot be learned.
fn legs(recording: &Recording, channel: &Channel) -> Option<Follower> {
    let joint = Joint::ALL.into_iter().find(|joint| joint.name() == channel.name()).unwrap_or(Joint::LeftKnee);
    let rows = recording.time_s().iter().take_while(|time| **time < recording.time_s()[0] + 15.0).count();
    let channels = recording.channels().iter();
    let channels = channels.map(|c| Channel::new(c.name(), c.quantity(), c.values()[..rows].to_vec())).collect();
    let beginning = Recording::build(recording.time_s()[..rows].to_vec(), channels).ok()?;
    let learned = learn(&beginning, joint, 12.0).ok()?;
    let learned = learned.completed(&default_generator(joint).ok()?, joint).ok()?;
    let [Some(a), Some(b), Some(c), Some(d)] = learned.templates else { return None };
    run::follower([a, b, c, d], joint, learned.stride_s).ok()
}

/// The column `T` of the tables in the folder's own description.
fn stride_periods_are_those_of_the_published_table() {
    let folder = traces_folder();
    let table = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let mut checked = 0;
    for line in table.lines() {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        // Bilateral: name, subject, task, fs, dur, T ...; goniometer: name, source, fs, dur, deg, swings, T (sd) ...
        let period = match cells.len() {
            16 => cells[5].parse::<f64>().ok(),
            9 => cells[6].split_whitespace().next().and_then(|text| text.parse().ok()),
            _ => None,
        };
        let file = csv_files(&folder).into_iter().find(|path| path.file_stem().is_some_and(|stem| stem == cells[0]));
        let (Some(period), Some(file)) = (period, file) else { continue };
        let recording = csv_file::read(&file).unwrap();
        if cells[0] == "camargo_levelground_ccw_fast_full_with_artefacts" {
            // Mostly standing, starting and stopping: as a whole it repeats nothing.
            assert_eq!(period::find(&recording), None);
            continue;
        }
        let Some(found) = period::find(&recording) else { panic!("{}: no stride, {period} s in the table", cells[0]) };
        let off = (found.period_s / period - 1.0).abs();
        assert!(off < 0.06, "{}: {found:?}, {period} s in the table", cells[0]);
        checked += 1;
    }
    assert!(checked > 25, "only {checked} rows of the table were understood");
}

fn the_documented_command_makes_the_default_volts() {
    let readme = std::fs::read_to_string(default_traces_folder().join("README.md")).unwrap();
    let name = default_volts_file();
    let name = name.file_name().unwrap().to_str().unwrap();
    let command = format!("cargo footfall volts --out tests/traces/{name} --force");
    assert!(readme.contains(&command), "the README beside the recordings does not say `{command}`");

    let folder = tempfile::tempdir().unwrap();
    let again = folder.path().join(name);
    let arguments = ["footfall".into(), "volts".into(), "--out".into(), again.clone().into()];
    cli::call(arguments.into_iter()).unwrap();
    let (made, present) =
        (std::fs::read_to_string(again).unwrap(), std::fs::read_to_string(default_volts_file()).unwrap());
    assert!(made == present, "the default volts are stale: run `{command}`");
}

/// Backwards: the volts lead to the left knee of the recording, and round and round without a jump.
fn the_default_volts_are_the_left_knee_looped() {
    let (volts, angles, sensor) = (default_volts(), default_trace(), wired_sensor().unwrap());
    let looped = angles.looped(feed::RATE_HZ).unwrap();
    let (knee, pin) = (angles.channel(SENSOR_JOINT.name()).unwrap(), volts.channel("PA1").unwrap());
    let index = angles.channels().iter().position(|channel| channel.name() == knee.name()).unwrap();
    let spread = looped.mismatch[index].abs();
    assert!(spread < 3.0, "the two ends of the cut differ by {spread} degrees");
    for (time, value) in volts.time_s().iter().zip(pin.values()) {
        let angle = sensor.calibration.angle(Volts(*value as f32)).unwrap().degrees();
        let recorded = angles.at(knee, time + looped.start_s);
        assert!((f64::from(angle) - recorded).abs() <= spread / 2.0 + 0.001, "{angle} for {recorded} at {time}");
    }
    let values = pin.values();
    assert_eq!(values.first(), values.last());
    assert!(period::find(&volts).is_some_and(|stride| (stride.period_s - volts.duration_s() / 2.0).abs() < 0.03));
}

/// Each recording has its source and licence in the description.
fn every_default_recording_is_described() {
    let readme = std::fs::read_to_string(default_traces_folder().join("README.md")).unwrap();
    let files: BTreeSet<String> = std::fs::read_dir(default_traces_folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name != "README.md")
        .collect();
    assert_eq!(files.len(), 2);
    for file in files {
        assert!(readme.contains(&format!("`{file}`")), "{file}");
    }
    for word in ["CC BY 4.0", "Fukuchi", "gaitkit 1.5.0", "semi-synthetic"] {
        assert!(readme.contains(word), "{word}");
    }
}
