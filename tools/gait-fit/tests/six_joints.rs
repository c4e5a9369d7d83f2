//! A recording that a known network of six joints made is fitted by that network.

use cpg_core::Generator;
use cpg_core::gait::six_and_eight_joints::{ankles_config, with_ankles};
use gait_fit::fit::Source;
use gait_fit::six_joints::{SixJointsError, SixJointsFit, fit_six_joints};
use gait_trace::ankles::Ankles;
use gait_trace::format::open::of_bytes;
use gait_trace::{LowPass, ReadOptions, Rules};
use joint_units::Period;

/// 12 s of the walk with ankles at 100 Hz; the knees of this walk reach 0 to 60 degrees.
fn recording() -> String {
    let mut walk = with_ankles(Period::MILLISECOND).unwrap();
    let names = ["left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"];
    let mut text = format!("time_s,{}\n", names.map(|name| format!("{name}_deg")).join(","));
    for row in 0..1200 {
        let angles = walk.angles().map(|angle| angle.degrees().to_string());
        text += &format!("{},{}\n", f64::from(row) * 0.01, angles.join(","));
        (0..10).for_each(|_| walk.step());
    }
    text
}

fn fit(text: &str) -> Result<SixJointsFit, SixJointsError> {
    let options = ReadOptions::default();
    let raw = of_bytes("walk.csv", text.as_bytes(), &options).unwrap();
    let ankles = Ankles::read("walk.csv", text.as_bytes(), &options, None).unwrap();
    let source = Source { name: "walk.csv".into(), sha256: String::new() };
    let rules = Rules { low_pass: LowPass::Off, ..Rules::default() };
    fit_six_joints(&source, &raw, &ankles, &rules, 20, &mut |_| ())
}

#[test]
fn a_known_network_is_recovered() {
    let found = fit(&recording()).unwrap();
    let (set, known) = (&found.file.set, ankles_config());
    assert!((set.natural_period_s / known.natural_period - 1.0).abs() < 2e-3, "{}", set.natural_period_s);
    for (index, joint) in set.joints.iter().enumerate() {
        let off = |found: f32, known: f32| (found - known).abs();
        assert!(off(joint.amplitude_deg, known.amplitudes[index].degrees()) < 0.1, "{joint:?}");
        assert!(off(joint.offset_deg, known.offsets[index].degrees()) < 0.1, "{joint:?}");
        let lead = known.phases[index].cycles() * 360.0;
        assert!(((joint.phase_deg - lead + 180.0).rem_euclid(360.0) - 180.0).abs() < 0.5, "{joint:?}, known {lead}");
    }
    for joint in &found.joints {
        assert!(joint.rmse_mean_stride_deg < 0.1 && joint.rmse_heldout_deg.unwrap() < 0.15, "{joint:?}");
    }
    assert!(found.certificate.returns.period_s > 1.09 && found.certificate.status.comes_back());
}

/// One ankle that has no value for half a stride.
#[test]
fn an_ankle_without_values_is_refused_in_words() {
    let text = recording();
    let gap: Vec<String> =
        text.lines()
            .enumerate()
            .map(|(row, line)| {
                if (500..560).contains(&row) { line.rsplit_once(',').unwrap().0.to_owned() + "," } else { line.into() }
            })
            .collect();
    let error = fit(&gap.join("\n")).unwrap_err().to_string();
    assert!(error.contains("`right_ankle_deg` has no value from 4.98") && error.contains("up to 0.1 s"), "{error}");
}
