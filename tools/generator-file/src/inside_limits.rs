//! The nearest generator that a robot's limits leave as it is: each joint scaled about its middle and shifted.
//!
//! ```text
//! a_j(t) + o_j + (s_j - 1) (a_j(t) - mean a_j),   least sum over joints of the mean square change
//! ```
//! Range, pose, rate and acceleration at every time are linear in o and s, so the nearest generator is the projection onto a convex set
//! (Hildreth, Naval Res. Logist. Q. 4 (1957) 79). The result is run through the control loop; if a limit still acts, the limits are
//! drawn in a little further.

use cpg_core::Generator;
use joint_loop::{GateConfig, LoopConfig, PoseSense};
use joint_units::{Joint, Period};

use crate::drive::drive;
use crate::file::{Coefficients, GeneratorSet, ShapeSet};
use crate::limits::measure;
use crate::subject::Subject;

/// Points of a stride at which the limits are imposed.
const POINTS: usize = 400;
/// Strides before them.
const SETTLE_STRIDES: f64 = 60.0;
/// Margin of the first try: degrees of an angle, and part of a rate or acceleration.
const MARGIN: (f64, f64) = (0.02, 0.005);
/// Tries, each with twice the margin.
const TRIES: u32 = 7;
/// Most sweeps of a projection, and the change of a sweep that ends it, degrees.
const SWEEPS: (u32, f64) = (4_000, 1e-7);

/// A generator inside the limits.
#[derive(Debug, Clone, PartialEq)]
pub struct InsideLimits {
    /// Its parameters.
    pub set: GeneratorSet,
    /// What it costs: root mean square change of each joint, degrees; 0 if it was inside.
    pub cost_deg: [f64; Joint::COUNT],
}

/// The change of a joint: every angle gets `offset` and `(scale - 1) (angle - mean)`.
#[derive(Debug, Clone, Copy)]
struct Change {
    offset: f64,
    scale: f64,
    /// Mean angle, degrees.
    mean: f64,
}

impl Change {
    /// The middle of a joint about which its parameters are scaled.
    fn middle(&self, middle: f32) -> f32 {
        let middle = f64::from(middle);
        (middle + self.offset + (self.scale - 1.0) * (middle - self.mean)) as f32
    }

    fn amplitude(&self, amplitude: f32) -> f32 {
        (self.scale * f64::from(amplitude)) as f32
    }
}

/// The nearest generator of the same kind that a robot's limits leave as it is.
///
/// # Errors
/// A kind whose joints cannot be scaled one by one, or no such generator; the text says which.
pub fn inside_limits(set: &GeneratorSet, config: &LoopConfig) -> Result<InsideLimits, String> {
    let is_inside = |set: &GeneratorSet| -> Result<bool, String> {
        let subject = Subject::Set(set.clone());
        let measured = measure(&subject, &config.gate)?;
        let driven = drive(&subject, config, &measured.excesses)?;
        Ok(measured.excesses.is_empty() && driven.walks && driven.limited_ticks == 0)
    };
    if is_inside(set)? {
        return Ok(InsideLimits { set: set.clone(), cost_deg: [0.0; Joint::COUNT] });
    }
    let stride = stride(set)?;
    for attempt in 0..TRIES {
        let times = f64::from(1 << attempt);
        let changes = project(&stride, &config.gate, (times * MARGIN.0, times * MARGIN.1));
        let changed = changed(set, &changes)?;
        if is_inside(&changed)? {
            let cost = |joint: usize| {
                let Change { offset, scale, .. } = changes[joint];
                offset.hypot((scale - 1.0) * stride.deviation[joint])
            };
            return Ok(InsideLimits { set: changed, cost_deg: std::array::from_fn(cost) });
        }
    }
    Err("no scale and offset of its joints leaves it inside the limits".into())
}

/// The set with its joints changed.
fn changed(set: &GeneratorSet, changes: &[Change; Joint::COUNT]) -> Result<GeneratorSet, String> {
    let shape = |shape: &ShapeSet| -> ShapeSet {
        let mut shape = shape.clone();
        for (joint, change) in shape.joints.iter_mut().zip(changes) {
            joint.mean_deg = change.middle(joint.mean_deg);
            for list in [&mut joint.cos_deg, &mut joint.sin_deg] {
                let scaled: Vec<f32> = list.iter().map(|&x| change.amplitude(x)).collect();
                // As many as before.
                *list = Coefficients::new(&scaled).unwrap_or(*list);
            }
        }
        shape
    };
    let mut set = set.clone();
    match &mut set {
        GeneratorSet::Shape(inner) => *inner = shape(inner),
        GeneratorSet::Follow(follow) => follow.shape = shape(&follow.shape),
        GeneratorSet::Spline(spline) => {
            let joints = [&mut spline.left_hip, &mut spline.right_hip, &mut spline.left_knee, &mut spline.right_knee];
            for (joint, change) in joints.into_iter().zip(changes) {
                joint.knots_deg = joint.knots_deg.map(|knot| change.middle(knot));
            }
        }
        GeneratorSet::PhaseCoupled(network) => {
            for (joint, change) in network.joints.iter_mut().zip(changes) {
                joint.offset_deg = change.middle(joint.offset_deg);
                joint.amplitude_deg = change.amplitude(joint.amplitude_deg);
            }
        }
        other => {
            return Err(format!(
                "the joints of a {} cannot be scaled one by one; allowed are shape, follow, spline and phase-coupled",
                other.name()
            ));
        }
    }
    Ok(set)
}

/// A stride of a generator, degrees.
struct Stride {
    angles: Vec<[f64; Joint::COUNT]>,
    peak_rate: [f64; Joint::COUNT],
    peak_acceleration: [f64; Joint::COUNT],
    mean: [f64; Joint::COUNT],
    deviation: [f64; Joint::COUNT],
}

fn stride(set: &GeneratorSet) -> Result<Stride, String> {
    let subject = Subject::Set(set.clone());
    let mut led = subject.led(Period::MILLISECOND)?;
    let ticks = (subject.stride_guess_s() * 1.1e3).ceil() as usize;
    for _ in 0..(SETTLE_STRIDES * ticks as f64) as usize {
        led.step();
    }
    let every = (ticks / POINTS).max(1);
    let (mut peak_rate, mut peak_acceleration) = ([0.0f64; Joint::COUNT], [0.0f64; Joint::COUNT]);
    let mut angles = vec![];
    let mut before = led.rates();
    for tick in 0..ticks {
        led.step();
        let rates = led.rates();
        for j in 0..Joint::COUNT {
            peak_rate[j] = peak_rate[j].max(f64::from(rates[j].0.abs()).to_degrees());
            peak_acceleration[j] =
                peak_acceleration[j].max(f64::from((rates[j].0 - before[j].0).abs()).to_degrees() * 1e3);
        }
        before = rates;
        if tick % every == 0 {
            angles.push(led.angles().map(|angle| f64::from(angle.0).to_degrees()));
        }
    }
    let count = angles.len() as f64;
    let mean: [f64; Joint::COUNT] = std::array::from_fn(|j| angles.iter().map(|a| a[j]).sum::<f64>() / count);
    let deviation = std::array::from_fn(|j| {
        (angles.iter().map(|a| (a[j] - mean[j]).powi(2)).sum::<f64>() / count).sqrt().max(1e-9)
    });
    Ok(Stride { angles, peak_rate, peak_acceleration, mean, deviation })
}

/// A bound on the unknowns: offset of each joint, then (scale - 1) times its deviation.
struct Bound {
    normal: [f64; 2 * Joint::COUNT],
    most: f64,
    /// Multiplier of the projection.
    pull: f64,
}

/// The nearest changes within the limits drawn in by a margin.
fn project(stride: &Stride, gate: &GateConfig, margin: (f64, f64)) -> [Change; Joint::COUNT] {
    const N: usize = Joint::COUNT;
    let degrees = |x: f32| f64::from(x).to_degrees();
    let mut bounds: Vec<Bound> = vec![];
    let mut add = |parts: &[(usize, f64, f64)], most: f64| {
        // Each part: joint, factor of its offset, factor of its scaled deviation.
        let mut normal = [0.0; 2 * N];
        for &(joint, of_offset, of_scale) in parts {
            normal[joint] += of_offset;
            normal[N + joint] += of_scale;
        }
        bounds.push(Bound { normal, most, pull: 0.0 });
    };
    for angles in &stride.angles {
        let part = |j: usize, sign: f64| (j, sign, sign * (angles[j] - stride.mean[j]) / stride.deviation[j]);
        for (j, (range, angle)) in gate.range.iter().zip(angles).enumerate() {
            add(&[part(j, 1.0)], degrees(range.most.0) - margin.0 - angle);
            add(&[part(j, -1.0)], angle - degrees(range.least.0) - margin.0);
        }
        for limit in gate.pose.iter().flatten() {
            let (a, b) = (limit.first as usize, limit.second as usize);
            let sign = if limit.sense == PoseSense::Sum { 1.0 } else { -1.0 };
            add(&[part(a, 1.0), part(b, sign)], degrees(limit.most.0) - margin.0 - angles[a] - sign * angles[b]);
        }
    }
    for j in 0..N {
        for (peak, most) in [
            (stride.peak_rate[j], degrees(gate.rate[j].0)),
            (stride.peak_acceleration[j], degrees(gate.acceleration[j].0)),
        ] {
            if peak > 0.0 {
                add(&[(j, 0.0, 1.0 / stride.deviation[j])], (1.0 - margin.1) * most / peak - 1.0);
            }
        }
        add(&[(j, 0.0, -1.0 / stride.deviation[j])], 1.0);
    }
    let mut x = [0.0; 2 * N];
    for _ in 0..SWEEPS.0 {
        let mut moved = 0.0f64;
        for Bound { normal, most, pull } in &mut bounds {
            let length: f64 = normal.iter().map(|n| n * n).sum();
            let over = normal.iter().zip(&x).map(|(n, x)| n * x).sum::<f64>() - *most;
            let next = (*pull + over / length).max(0.0);
            let change = next - *pull;
            if change != 0.0 {
                x.iter_mut().zip(normal.iter()).for_each(|(x, n)| *x -= change * n);
                *pull = next;
                moved = moved.max(change.abs() * length.sqrt());
            }
        }
        if moved < SWEEPS.1 {
            break;
        }
    }
    std::array::from_fn(|j| Change { offset: x[j], scale: 1.0 + x[N + j] / stride.deviation[j], mean: stride.mean[j] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{GeneratorFile, PhaseCoupledSet};

    fn walk() -> PhaseCoupledSet {
        let GeneratorSet::PhaseCoupled(set) = GeneratorFile::default_of("phase-coupled").unwrap().set else {
            panic!("R1")
        };
        set
    }

    fn inside(set: PhaseCoupledSet) -> (PhaseCoupledSet, [f64; 4]) {
        let got = inside_limits(&GeneratorSet::PhaseCoupled(set), &LoopConfig::default_biped()).unwrap();
        let GeneratorSet::PhaseCoupled(set) = got.set else { panic!("R1") };
        (set, got.cost_deg)
    }

    #[test]
    fn what_is_inside_is_not_changed() {
        assert_eq!(inside(walk()), (walk(), [0.0; 4]));
    }

    /// A knee that is 3 degrees too low. For a sinusoid of amplitude A the least mean square of o + (s - 1) A cos with
    /// o - (s - 1) A = d at the lowest point is at o = d/3, (1 - s) A = 2 d/3, and the cost is d/sqrt(3).
    #[test]
    fn a_knee_that_is_too_low_is_raised_and_scaled_as_the_closed_form_says() {
        let mut low = walk();
        let gate = LoopConfig::default_biped().gate;
        let before = measure(&Subject::Set(GeneratorSet::PhaseCoupled(low)), &gate).unwrap().joints[2].least_deg;
        low.joints[2].offset_deg += -2.0 - before as f32 - 3.0;
        let (got, cost) = inside(low);
        for joint in [0, 1, 3] {
            assert_eq!((got.joints[joint], cost[joint]), (low.joints[joint], 0.0));
        }
        assert!((cost[2] - 3.0 / 3f64.sqrt()).abs() < 0.1, "{cost:?}");
        assert!((got.joints[2].offset_deg - low.joints[2].offset_deg - 1.0).abs() < 0.1);
        assert!((low.joints[2].amplitude_deg - got.joints[2].amplitude_deg - 2.0).abs() < 0.15);
    }

    /// Hips that are 90 degrees apart: both give the same.
    #[test]
    fn hips_too_far_apart_are_brought_nearer_alike() {
        let mut wide = walk();
        for hip in &mut wide.joints[..2] {
            (hip.amplitude_deg, hip.offset_deg) = (42.0, 14.0);
        }
        let (got, cost) = inside(wide);
        assert!(cost[0] > 1.0 && (cost[0] - cost[1]).abs() < 0.1, "{cost:?}");
        assert!((got.joints[0].amplitude_deg - got.joints[1].amplitude_deg).abs() < 0.1);
        assert!((35.0..36.6).contains(&got.joints[0].amplitude_deg), "{got:?}");
    }

    #[test]
    fn the_thesis_network_is_refused_with_what_is_allowed() {
        let GeneratorSet::Thesis(mut set) = GeneratorFile::default_of("thesis").unwrap().set else { panic!("it") };
        set.joints[0].offset_deg = 60.0;
        let error = inside_limits(&GeneratorSet::Thesis(set), &LoopConfig::default_biped()).unwrap_err();
        assert!(error.contains("allowed are shape, follow, spline and phase-coupled"), "{error}");
    }
}
