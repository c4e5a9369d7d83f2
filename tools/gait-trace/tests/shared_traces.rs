//! Conditioning and strides over many real recordings: walks, runs, a patient, swapped markers, standing and turns.
//!
//! The recordings are in `../shared/traces` beside the workspace, or where `FOOTFALL_TRACES` says; without them these tests are ignored.
//! Periods and counts are those of the folder's own README, which were computed by others.

use gait_trace::ReadOptions;
use gait_trace::condition;
use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::csv_file;
use gait_trace::format::open;
use gait_trace::stride::cycle::POINTS;
use gait_trace::stride::{cut, strides};
use gait_trace::{
    Conditioned, Cycle, Done, FindingKind, LowPass, RawJoint, RawJoints, Rules, Strides, UnitSource, WhyLeftOut,
};
use joint_units::Joint;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use test_suite::{report, tests, traces_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        every_recording_is_read_as_the_strict_reader_reads_it(Traces),
        bilateral_recordings_give_strides_that_6_harmonics_fit(Traces),
        variability_agrees_with_what_others_found(Traces),
        artefacts_are_found_where_they_are_and_nowhere_else(Traces),
        only_the_walking_of_a_whole_trial_is_kept(Traces),
        real_recordings_turned_and_exchanged_come_back(Traces),
        a_goniometer_on_one_knee_gives_strides(Traces),
        bridges_over_real_gaits_are_near(Traces),
        no_gait_is_near_what_is_refused_as_no_gait(Traces),
        no_recording_drifts(Traces),
        units_that_are_left_out_are_inferred(Traces),
        windows_of_two_to_three_strides_keep_the_period(Traces),
    ])
}

/// File, stride period in seconds, strides in the file.
const BILATERAL: [(&str, f64, f64); 23] = [
    ("gaitprint_young_overground", 1.12, 44.4),
    ("gaitprint_middle_overground", 0.89, 56.2),
    ("osim_subject01_walk", 1.22, 2.9),
    ("normalised/osim_crouch_gait_cp_normalised", 1.0, 1.0),
    ("normalised/osim_normal_gait_mean_normalised", 1.0, 1.0),
    ("camargo_levelground_ccw_fast_full_with_artefacts", 0.91, 8.3),
    ("camargo_levelground_ccw_fast_walk", 0.91, 8.3),
    ("opencap_subject4_walking1", 1.08, 1.2),
    ("opencap_subject4_walking2", 1.09, 1.2),
    ("opencap_subject4_walking4", 1.12, 1.2),
    ("opencap_subject4_walkingTS1", 1.18, 1.2),
    ("opencap_subject4_walkingTS2", 1.14, 1.2),
    ("hamner_run200", 0.77, 3.0),
    ("hamner_run300", 0.72, 3.0),
    ("dorn_sprinter_run0350cms", 0.76, 4.4),
    ("dorn_sprinter_run0500cms", 0.68, 3.3),
    ("welker_007_run_natural", 0.71, 85.2),
    ("welker_007_run_exotendon", 0.67, 89.4),
    ("biomechzoo_adult_level", 1.20, 1.8),
    ("osim_c3d_treadmill_walking2", 0.97, 1.7),
    ("osim_c3d_treadmill_walking5", 0.99, 1.8),
    ("osim_c3d_treadmill_test_walking", 0.98, 1.7),
    ("gaitkit_fukuchi_healthy", 1.09, 2.3),
];

/// Recordings whose own mean stride has more above its sixth harmonic than 0.4 (hip) or 0.5 degrees (knee): what it has.
/// Runners' knees bend sharply when the foot lands, and the markers of `osim_c3d_*` and `gaitkit_*` were not filtered.
const SHARP: [(&str, f64, f64); 8] = [
    ("hamner_run300", 0.32, 0.58),
    ("dorn_sprinter_run0500cms", 0.44, 0.47),
    ("welker_007_run_natural", 0.42, 0.66),
    ("welker_007_run_exotendon", 0.35, 0.70),
    ("osim_c3d_treadmill_walking2", 0.37, 0.92),
    ("osim_c3d_treadmill_walking5", 0.39, 1.03),
    ("osim_c3d_treadmill_test_walking", 0.39, 1.00),
    ("gaitkit_fukuchi_healthy", 0.26, 0.65),
];

/// File, knee swings, stride period in seconds.
const GONIOMETER: [(&str, usize, f64); 13] = [
    ("uci_N01_walk_knee", 4, 1.26),
    ("uci_N02_walk_knee", 5, 1.29),
    ("uci_N03_walk_knee", 5, 1.39),
    ("uci_N04_walk_knee", 4, 1.46),
    ("uci_N05_walk_knee", 4, 1.32),
    ("uci_N06_walk_knee", 5, 1.34),
    ("uci_N07_walk_knee", 5, 1.44),
    ("uci_A01_walk_knee", 6, 1.45),
    ("uci_A02_walk_knee", 8, 1.14),
    ("uci_A03_walk_knee", 32, 1.30),
    ("uci_A05_walk_knee", 27, 1.26),
    ("uci_A07_walk_knee", 11, 1.25),
    ("uci_A10_walk_knee", 18, 1.29),
];

fn raw(path: &Path) -> RawJoints {
    let recording = csv_file::read(path).expect("a good file");
    let joints = Joint::ALL.map(|joint| {
        let channel = recording.channel(joint.name()).ok()?;
        Some(RawJoint::degrees(channel.column(), channel.values().to_vec()))
    });
    let file = path.file_stem().unwrap().to_string_lossy().into_owned();
    RawJoints {
        file,
        format: "CSV".into(),
        time_s: recording.time_s().to_vec(),
        received: false,
        joints,
        notes: vec![],
        doubts: vec![],
    }
}

fn of(folder: &Path, name: &str) -> (Conditioned, Strides) {
    let done = condition(&raw(&folder.join(format!("{name}.csv"))), &Rules::default())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let walk = strides::segment(&done).unwrap_or_else(|error| panic!("{name}: {error}"));
    (done, walk)
}

/// Root mean square of what the mean and six harmonics leave of a cycle, hips and knees pooled over the legs.
fn six_harmonics(cycle: &Cycle) -> [f64; 2] {
    let joint = |x: &[f64; POINTS]| {
        let n = POINTS as f64;
        let mean = x.iter().sum::<f64>() / n;
        let all = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let harmonic = |h: usize| {
            let part = |wave: fn(f64) -> f64| {
                2.0 / n * (0..POINTS).map(|k| x[k] * wave(TAU * (h * k) as f64 / n)).sum::<f64>()
            };
            0.5 * (part(f64::sin).powi(2) + part(f64::cos).powi(2))
        };
        (all - (1..=6).map(harmonic).sum::<f64>()).max(0.0)
    };
    let [lh, rh, lk, rk] = cycle.0.each_ref().map(joint);
    [(0.5 * (lh + rh)).sqrt(), (0.5 * (lk + rk)).sqrt()]
}

/// Kept strides and what is left out cover every moment once.
fn tiles(done: &Conditioned, walk: &Strides, name: &str) {
    let mut parts: Vec<(f64, f64)> = walk.spans.iter().map(|s| (s.start_s, s.end_s)).collect();
    parts.extend(walk.left_out.iter().map(|l| (l.from_s, l.to_s)));
    parts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let step = 1.01 / done.rate_hz;
    let mut at = 0.0;
    for (from, to) in parts {
        assert!((from - at).abs() <= step && to > from - step, "{name}: {at} to {from} is in no part, or in two");
        at = to;
    }
    assert!((at - done.recording.duration_s()).abs() <= step, "{name}: ends at {at}");
}

/// The reader of anybody's files gives the same bits. It assigns a knee without a side to a leg.
fn every_recording_is_read_as_the_strict_reader_reads_it() {
    let folder = traces_folder();
    let bilateral = BILATERAL.map(|(name, ..)| format!("{name}.csv"));
    let goniometer = GONIOMETER.map(|(name, ..)| format!("knee_goniometer/{name}.csv"));
    for name in bilateral.iter().chain(&goniometer) {
        let strict = csv_file::read(&folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
        let open = open::read(&folder.join(name), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(open.time_s, strict.time_s(), "{name}");
        assert_eq!(open.joints.iter().flatten().count(), strict.channels().len(), "{name}");
        for joint in Joint::ALL {
            let Some(found) = &open.joints[joint as usize] else { continue };
            let channel = strict.channel(joint.name()).unwrap_or_else(|_| &strict.channels()[0]);
            assert_eq!(found.angle_deg, channel.values(), "{name}: {}", joint.name());
        }
    }
}

fn bilateral_recordings_give_strides_that_6_harmonics_fit() {
    let folder = traces_folder();
    let mut table = String::from(
        "\nfile: strides, period s (sd %), stride sd deg, closure deg, asymmetry deg, six harmonics hip/knee deg\n",
    );
    let mut faults = String::new();
    for (name, period, strides) in BILATERAL {
        let (done, walk) = of(&folder, name);
        tiles(&done, &walk, name);
        let [hip, knee] = six_harmonics(&walk.mean());
        let two = |x: &[f64]| x.iter().map(|x| format!("{x:.2}")).collect::<Vec<_>>().join(" ");
        let (n, mean, sd) = (walk.spans.len(), walk.period_s, 100.0 * walk.period_sd_s() / walk.period_s);
        writeln!(
            table,
            "{name}: {n}, {mean:.3} ({sd:.2}), {}, {}, {}, {hip:.2}/{knee:.2}",
            two(&walk.sd_deg()),
            two(&walk.closure_deg),
            two(&walk.asymmetry_deg())
        )
        .unwrap();
        for finding in &done.findings {
            writeln!(table, "    {finding}").unwrap();
        }
        for part in &walk.left_out {
            writeln!(table, "    {part}").unwrap();
        }
        let fewest = (strides - 2.0).floor().max(1.0);
        if (n as f64) < fewest || n as f64 > strides.ceil() {
            writeln!(faults, "{name}: {n} strides of {strides}").unwrap();
        }
        if (mean / period - 1.0).abs() > 0.02 {
            writeln!(faults, "{name}: period {mean}, not {period}").unwrap();
        }
        let (_, most_hip, most_knee) = SHARP.into_iter().find(|sharp| sharp.0 == name).unwrap_or((name, 0.4, 0.5));
        if hip > most_hip || knee > most_knee {
            writeln!(faults, "{name}: six harmonics leave {hip}, {knee}").unwrap();
        }
        // With the customary low-pass every recording has what six harmonics hold.
        let rules = Rules { low_pass: LowPass::Customary, ..Rules::default() };
        let smooth = condition(&raw(&folder.join(format!("{name}.csv"))), &rules).unwrap();
        let smooth = strides::segment(&smooth).unwrap();
        let [hip, knee] = six_harmonics(&smooth.mean());
        writeln!(table, "    with the customary low-pass: {hip:.2}/{knee:.2}").unwrap();
        if hip > 0.4 || knee > 0.5 {
            writeln!(faults, "{name}: with a low-pass six harmonics leave {hip}, {knee}").unwrap();
        }
    }
    report!("{table}");
    assert!(faults.is_empty(), "{faults}{table}");
}

/// Stride-to-stride variability as others computed it, with another way of finding strides: joints within a quarter, all joints
/// together within a tenth, stride times within a sixth.
fn variability_agrees_with_what_others_found() {
    let folder = traces_folder();
    let known: [(&str, [f64; 4], Option<f64>); 3] = [
        ("gaitprint_young_overground", [1.08, 1.13, 0.89, 1.24], Some(1.26)),
        ("gaitprint_middle_overground", [0.76, 0.94, 0.86, 1.21], Some(1.13)),
        ("welker_007_run_natural", [1.27, 1.29, 1.54, 1.74], None),
    ];
    for (name, sds, time_percent) in known {
        let (_, walk) = of(&folder, name);
        let found = walk.sd_deg();
        for (found, known) in found.iter().zip(sds) {
            assert!((found / known - 1.0).abs() < 0.25, "{name}: {found}, not {known}");
        }
        let all = |sd: &[f64; 4]| sd.iter().map(|sd| sd * sd).sum::<f64>().sqrt();
        assert!((all(&found) / all(&sds) - 1.0).abs() < 0.1, "{name}: {found:?}, not {sds:?}");
        if let Some(known) = time_percent {
            let found = 100.0 * walk.period_sd_s() / walk.period_s;
            assert!((found / known - 1.0).abs() < 1.0 / 6.0, "{name}: {found} %, not {known} %");
        }
    }
}

/// Sound recordings, sprints among them, give no finding; swapped markers and dropouts are found where they are.
fn artefacts_are_found_where_they_are_and_nowhere_else() {
    let folder = traces_folder();
    for (name, ..) in BILATERAL {
        let (done, _) = of(&folder, name);
        let jumps: Vec<(f64, Joint)> = done
            .findings
            .iter()
            .filter(|finding| matches!(finding.what, FindingKind::Jump { .. } | FindingKind::Step { .. }))
            .map(|finding| (0.5 * (finding.from_s + finding.to_s), finding.joint.expect("a joint")))
            .collect();
        let has = |at: f64, joint: Joint| jumps.iter().any(|jump| (jump.0 - at).abs() < 0.06 && jump.1 == joint);
        match name {
            "osim_c3d_treadmill_walking2" => {
                assert!(has(0.77, Joint::LeftKnee) && has(0.77, Joint::LeftHip), "{jumps:?}")
            }
            "osim_c3d_treadmill_walking5" => {
                assert!(has(0.26, Joint::LeftKnee) && has(0.26, Joint::LeftHip), "{jumps:?}")
            }
            "osim_c3d_treadmill_test_walking" => assert!(has(0.22, Joint::LeftKnee), "{jumps:?}"),
            "camargo_levelground_ccw_fast_full_with_artefacts" => {
                for (at, joint) in [(1.21, Joint::LeftHip), (1.21, Joint::RightHip), (1.49, Joint::RightKnee)] {
                    assert!(has(at, joint), "{jumps:?}");
                }
                assert!(jumps.iter().all(|jump| jump.0 < 4.6), "the steady part is sound: {jumps:?}");
            }
            _ if name.starts_with("normalised") => {
                assert!(jumps.is_empty() && done.normalised_cycle, "{name}: {:?}", done.findings);
            }
            _ => assert!(done.findings.is_empty(), "{name}: {:?}", done.findings),
        }
        assert!(done.findings.iter().all(|finding| finding.done != Done::Flipped), "{name}: {:?}", done.findings);
    }
}

/// A trial with standing, starting, stopping and dropouts: the steady walking between 4.6 and 12.2 s is what is kept.
fn only_the_walking_of_a_whole_trial_is_kept() {
    let folder = traces_folder();
    let (_, walk) = of(&folder, "camargo_levelground_ccw_fast_full_with_artefacts");
    assert!(walk.spans.iter().all(|span| span.start_s > 4.4 && span.end_s < 12.4), "{:?}", walk.spans);
    let kept: f64 = walk.spans.iter().map(|span| span.end_s - span.start_s).sum();
    assert!(kept > 0.8 * 7.6, "{kept} s of 7.6 s");
    let is = |at: f64| walk.left_out.iter().find(|part| part.from_s <= at && at < part.to_s).map(|part| part.why);
    assert_eq!(is(1.2), Some(WhyLeftOut::Glitch));
    assert!(is(1.5).is_some());
    assert_eq!((is(2.5), is(14.0)), (Some(WhyLeftOut::Standing), Some(WhyLeftOut::Standing)));
    assert_eq!(is(12.6), Some(WhyLeftOut::Stop));
}

/// Signs turned and columns exchanged are set right on every walk and run, and the strides are the same as before.
fn real_recordings_turned_and_exchanged_come_back() {
    let folder = traces_folder();
    // A patient's crouch has no usual lead of the knee over the hip; a trial that is half standing is judged by its walking part.
    for (name, ..) in BILATERAL.into_iter().filter(|file| !file.0.contains("crouch")) {
        let sound = raw(&folder.join(format!("{name}.csv")));
        let wanted = condition(&sound, &Rules::default()).unwrap().recording;
        for case in ["knees", "hips", "all", "left knee", "exchanged", "exchanged and turned"] {
            let mut raw = sound.clone();
            let turned: &[usize] = match case {
                "knees" => &[2, 3],
                "hips" => &[0, 1],
                "left knee" => &[2],
                "exchanged" => &[],
                _ => &[0, 1, 2, 3],
            };
            for &joint in turned {
                raw.joints[joint].as_mut().unwrap().angle_deg.iter_mut().for_each(|x| *x = -*x);
            }
            if case.starts_with("exchanged") {
                raw.joints.swap(0, 2);
                raw.joints.swap(1, 3);
            }
            let done = condition(&raw, &Rules::default()).unwrap();
            assert_eq!(done.recording, wanted, "{name}, {case}: {:?}", done.findings);
            let flipped = done.findings.iter().filter(|finding| finding.done == Done::Flipped).count();
            assert_eq!(flipped, turned.len(), "{name}, {case}: {:?}", done.findings);
        }
    }
}

/// A knee alone, with turns and pauses: swings and period as others counted them, and a sensor mounted the other way round is
/// turned.
fn a_goniometer_on_one_knee_gives_strides() {
    let folder = traces_folder();
    let mut table = String::from("\n");
    for (name, swings, period) in GONIOMETER {
        let recording = csv_file::read(&folder.join(format!("knee_goniometer/{name}.csv"))).expect("a good file");
        for sign in [1.0, -1.0] {
            let angle_deg = recording.channels()[0].values().iter().map(|x| sign * x).collect();
            let joints = [None, None, Some(RawJoint::degrees("knee", angle_deg)), None];
            let time_s = recording.time_s().to_vec();
            let raw = RawJoints {
                file: name.into(),
                format: "CSV".into(),
                time_s,
                received: false,
                joints,
                notes: vec![],
                doubts: vec![],
            };
            let done = condition(&raw, &Rules::default()).unwrap();
            let flipped = done.findings.iter().filter(|finding| finding.done == Done::Flipped).count();
            assert_eq!(flipped, usize::from(sign < 0.0), "{name}: {:?}", done.findings);
            assert_eq!(done.findings.len(), flipped, "{name}: {:?}", done.findings);
            let found = cut::cut(&done).unwrap();
            let mean = found.spans.iter().map(|span| span.end_s - span.start_s).sum::<f64>() / found.spans.len() as f64;
            writeln!(table, "{name}: {} of {swings} swings, {mean:.3} s of {period} s", found.spans.len()).unwrap();
            assert!(found.spans.len().abs_diff(swings) <= 2, "{table}");
            assert!((mean / period - 1.0).abs() < 0.04, "{table}");
        }
    }
    report!("{table}");
}

/// Holes of 0.1 s put into real walking and running come back: how near, in degrees.
fn bridges_over_real_gaits_are_near() {
    let folder = traces_folder();
    let mut table = String::from("\nfile: root mean square and largest error of bridges over 0.1 s, knees, deg\n");
    for (name, most_rms, most) in [
        ("gaitprint_young_overground", 0.4, 1.5),
        ("gaitprint_middle_overground", 0.4, 2.0),
        ("camargo_levelground_ccw_fast_walk", 0.6, 3.0),
        ("welker_007_run_natural", 3.5, 12.0),
    ] {
        let sound = raw(&folder.join(format!("{name}.csv")));
        let (mut squares, mut n, mut worst) = (0.0, 0_usize, 0_f64);
        let rate = (sound.time_s.len() - 1) as f64 / (sound.time_s[sound.time_s.len() - 1] - sound.time_s[0]);
        let length = (0.1 * rate).round() as usize - 1;
        let mut holed = sound.clone();
        let every = (0.37 * rate) as usize;
        let starts: Vec<usize> = (every..sound.time_s.len() - every).step_by(every).collect();
        for joint in 2..4 {
            let x = &mut holed.joints[joint].as_mut().unwrap().angle_deg;
            starts.iter().for_each(|&from| x[from..from + length].fill(f64::NAN));
        }
        let done = condition(&holed, &Rules::default()).unwrap();
        assert!(done.unusable.is_empty(), "{name}");
        for joint in [Joint::LeftKnee, Joint::RightKnee] {
            let truth = &sound.joints[joint as usize].as_ref().unwrap().angle_deg;
            let found = done.joint(joint).unwrap();
            for from in &starts {
                for k in *from..from + length {
                    squares += (found[k] - truth[k]).powi(2);
                    worst = worst.max((found[k] - truth[k]).abs());
                    n += 1;
                }
            }
        }
        let rms = (squares / n as f64).sqrt();
        writeln!(table, "{name}: {rms:.2}, {worst:.2}").unwrap();
        assert!(rms < most_rms && worst < most, "{table}");
    }
    report!("{table}");
}

/// The legs run against each other at the hips, and hip and knee of a leg are nearly uncorrelated: far from squats and jumps.
fn no_gait_is_near_what_is_refused_as_no_gait() {
    let folder = traces_folder();
    let correlation = |a: &[f64], b: &[f64]| {
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(p, q)| (p - mean(x)) * (q - mean(y))).sum::<f64>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    };
    let mut table = String::from("\nfile: hips, knees, left hip and knee, right hip and knee\n");
    let mut most = [f64::NEG_INFINITY; 3];
    for (name, ..) in BILATERAL {
        let (_, walk) = of(&folder, name);
        let Cycle(mean) = walk.mean();
        let of = |a: usize, b: usize| correlation(&mean[a], &mean[b]);
        let (hips, knees, left, right) = (of(0, 1), of(2, 3), of(0, 2), of(1, 3));
        writeln!(table, "{name}: {hips:.2} {knees:.2} {left:.2} {right:.2}").unwrap();
        for (most, value) in most.iter_mut().zip([hips, knees, left.abs().min(right.abs())]) {
            *most = most.max(value);
        }
    }
    report!("{table}at most {most:?}");
    assert!(most[0] < -0.5, "{table}");
    assert!(most[1] < 0.6 && most[2] < 0.6, "{table}");
}

/// People who walk or run on do not drift: the means of their strides move by less than is reported.
fn no_recording_drifts() {
    let folder = traces_folder();
    for (name, ..) in BILATERAL {
        let (_, walk) = of(&folder, name);
        assert_eq!(walk.drift(), [], "{name}");
    }
}

/// Windows of 2.05 to 2.9 strides anywhere in a recording, of both legs, of one, and of one knee, have its period and not two of them.
fn windows_of_two_to_three_strides_keep_the_period() {
    let folder = traces_folder();
    let mut windows = 0;
    for (name, period, strides) in BILATERAL.into_iter().filter(|file| file.2 > 2.05) {
        let whole = raw(&folder.join(format!("{name}.csv")));
        let rate = (whole.time_s.len() - 1) as f64 / (whole.time_s[whole.time_s.len() - 1] - whole.time_s[0]);
        for n in 0..12 {
            let length = (rate * period * (2.05 + 0.077 * f64::from(n))) as usize;
            let from = (n as usize * 37 % 12) * whole.time_s.len().saturating_sub(length) / 12;
            let part = from..(from + length).min(whole.time_s.len());
            for joints in [&[0, 1, 2, 3][..], &[0, 2], &[2]] {
                let mut raw = whole.clone();
                raw.time_s = whole.time_s[part.clone()].to_vec();
                for (joint, column) in raw.joints.iter_mut().enumerate() {
                    *column = column.take().filter(|_| joints.contains(&joint));
                    column.iter_mut().for_each(|column| column.angle_deg = column.angle_deg[part.clone()].to_vec());
                }
                // A window of a trial with standing and dropouts may have no stride.
                let Ok(done) = condition(&raw, &Rules::default()) else { continue };
                let Ok(found) = cut::cut(&done) else { continue };
                let mean =
                    found.spans.iter().map(|span| span.end_s - span.start_s).sum::<f64>() / found.spans.len() as f64;
                assert!(
                    (mean / period - 1.0).abs() < 0.25,
                    "{name} of {strides} strides, {part:?}, {joints:?}: {mean} for {period}"
                );
                windows += 1;
            }
        }
    }
    report!("{windows} windows");
    assert!(windows > 300, "{windows}");
}

/// Without a unit in the headings, degrees and radians are inferred rightly, and no recording is taken for volts.
fn units_that_are_left_out_are_inferred() {
    let folder = traces_folder();
    let bilateral = BILATERAL.map(|(name, ..)| name.to_owned());
    let goniometer = GONIOMETER.map(|(name, ..)| format!("knee_goniometer/{name}"));
    let mut table = String::from(
        "\nfile: range of the knee that moves more, its largest angle, range of the hip that moves more, deg\n",
    );
    for name in bilateral.iter().chain(&goniometer) {
        let recording = csv_file::read(&folder.join(format!("{name}.csv"))).unwrap_or_else(|error| panic!("{error}"));
        let measure = |part: &str| {
            let of = |x: &[f64]| {
                let (least, most) = x.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
                (most - least, least.abs().max(most))
            };
            let all =
                recording.channels().iter().filter(|channel| channel.name().contains(part)).map(|c| of(c.values()));
            all.fold((0.0_f64, 0.0_f64), |(range, largest), (a, b)| (range.max(a), largest.max(b)))
        };
        let ((knee, bend), (hip, _)) = (measure("knee"), measure("hip"));
        writeln!(table, "{name}: {knee:.1} {bend:.1} {hip:.1}").unwrap();
        for (unit, scale) in [(AngleUnit::Degrees, 1.0), (AngleUnit::Radians, 1_f64.to_radians())] {
            let names: Vec<&str> = recording.channels().iter().map(|channel| channel.name()).collect();
            let mut text = format!("time_s,{}\n", names.join(","));
            for (row, time) in recording.time_s().iter().enumerate() {
                let fields = recording.channels().iter().map(|channel| (scale * channel.values()[row]).to_string());
                writeln!(text, "{time},{}", fields.collect::<Vec<_>>().join(",")).unwrap();
            }
            let read = open::of_bytes(name, text.as_bytes(), &ReadOptions::default());
            // The mean of these knees, 1.1 radians and more, may be volts as well: the unit is asked for.
            let is_bent = name.contains("crouch") || name == "dorn_sprinter_run0500cms";
            if is_bent && unit == AngleUnit::Radians {
                assert!(read.unwrap_err().to_string().contains("may be radians or volts"));
                continue;
            }
            let raw = read.unwrap_or_else(|error| panic!("{error}"));
            assert!(raw.joints.iter().flatten().all(|joint| joint.unit == UnitSource::Inferred(unit)), "{name}");
            condition(&raw, &Rules::default()).unwrap_or_else(|error| panic!("{error}"));
        }
    }
    report!("{table}");
}
