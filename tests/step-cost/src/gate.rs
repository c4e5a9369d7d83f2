//! The gate in Rust and in C, from the same configuration and state, on a recorded walk: from the park pose to its first pose, through it at 1 kHz,
//! and again from its end to its beginning, which is a jump.

use core::fmt::Write as _;
use core::hint::black_box;

use joint_loop::{DEFAULT_PARK, Gate, GateConfig, GateState, GateStatus, POSE_LIMITS, PoseSense};
use joint_units::{Joint, Period, Radians};

use crate::semihosting::TextLine;

/// The recorded walk, degrees, at 150 Hz.
static RECORDED: &[[f32; Joint::COUNT]] = &include!(concat!(env!("OUT_DIR"), "/recorded.rs"));
/// Ticks from one pose of it to the next: 20 in three.
const TICKS: [u32; 3] = [7, 7, 6];
/// How often it is played.
const TIMES: u32 = 2;
/// Steps of the gate in a radian, 2^28.
const STEPS: f32 = 268_435_456.0;

/// `struct limits` of c/gate.c.
#[repr(C)]
#[derive(Clone, Copy)]
struct LimitsInC {
    least: i32,
    most: i32,
    rate: i32,
    acceleration: u32,
    ends: [f32; 2],
    clearance: i32,
}

/// `struct edge`.
#[repr(C)]
#[derive(Clone, Copy)]
struct EdgeInC {
    joints: [u32; 2],
    sign: i32,
    most: i32,
    far: i32,
}

/// `struct gate`.
#[repr(C)]
struct GateInC {
    joints: [LimitsInC; Joint::COUNT],
    edges: [EdgeInC; POSE_LIMITS],
    edge_count: u32,
}

/// `struct gate_state`.
#[repr(C)]
#[derive(Clone, Copy)]
struct StateInC {
    position: [i32; Joint::COUNT],
    step: [i32; Joint::COUNT],
    goal: [i32; Joint::COUNT],
}

type InC = unsafe extern "C" fn(&GateInC, &mut StateInC, &mut [f32; Joint::COUNT]) -> i32;

unsafe extern "C" {
    fn c_gate_exact(gate: &GateInC, state: &mut StateInC, target: &mut [f32; Joint::COUNT]) -> i32;
    fn c_gate_fused(gate: &GateInC, state: &mut StateInC, target: &mut [f32; Joint::COUNT]) -> i32;
}

/// As in C: in place, and the limits that acted, or -1.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn rust_gate(gate: &Gate, state: &mut GateState, target: &mut [Radians; Joint::COUNT]) -> i32 {
    match gate.limit(state, *target) {
        Ok((setpoints, status)) => {
            *target = setpoints;
            status.bits().into()
        }
        Err(_) => -1,
    }
}

/// Compares the gates; the status of the program: 0, or 1 if there is none.
pub(crate) fn run() -> u32 {
    u32::from(compare().is_none())
}

fn compare() -> Option<()> {
    let config = black_box(GateConfig::default_biped());
    let rust = Gate::build(&config, Period::MILLISECOND).ok()?;
    let c = in_c(&config);
    let mut state = rust.rest(DEFAULT_PARK)?;
    let position = DEFAULT_PARK.map(|angle| (angle.0 * STEPS) as i32);
    let begin = StateInC { position, step: [0; Joint::COUNT], goal: position };
    let mut in_c = [(c_gate_exact as InC, begin, 0_u32), (c_gate_fused as InC, begin, 0)];
    let mut steps = 0_u32;
    let mut acted = GateStatus::NONE.bits();
    for _ in 0..TIMES {
        for (pair, ticks) in RECORDED.windows(2).zip(TICKS.into_iter().cycle()) {
            let &[from, to] = pair else { continue };
            for tick in 0..ticks {
                let part = tick as f32 / ticks as f32;
                let mut target = from.map(Radians::from_degrees);
                for (angle, to) in target.iter_mut().zip(to) {
                    angle.0 += (Radians::from_degrees(to).0 - angle.0) * part;
                }
                let mut setpoints = target;
                let status = black_box(rust_gate as extern "C" fn(&Gate, &mut GateState, &mut [Radians; 4]) -> i32)(
                    &rust,
                    &mut state,
                    &mut setpoints,
                );
                let bits = setpoints.map(|angle| angle.0.to_bits());
                acted |= status as u8;
                for (step, state, equal) in &mut in_c {
                    let mut setpoints = target.map(|angle| angle.0);
                    // SAFETY: the function reads and writes what it gets, whose layout is the same.
                    let same = unsafe { black_box(*step)(&c, state, &mut setpoints) } == status;
                    *equal += u32::from(same && setpoints.map(f32::to_bits) == bits);
                }
                steps += 1;
            }
        }
    }
    let [(.., exact), (.., fused)] = in_c;
    let mut line = TextLine::new();
    // A line is short. Without a limit that acted, only the gate's shortcuts would be compared.
    let _ = write!(line, "gate {steps} {exact} {}", if acted == 0 { u32::MAX } else { steps - fused });
    line.print();
    Some(())
}

/// The limits as `Gate::build` folds them.
fn in_c(config: &GateConfig) -> GateInC {
    let dt = Period::MILLISECOND.seconds();
    let joints = Joint::ALL.map(|joint| {
        let at = joint as usize & 3;
        let (low, high) = (config.range[at].least.0 * STEPS, config.range[at].most.0 * STEPS);
        let (least, most) = (low as i32, high as i32);
        let (least, most) = (least + i32::from((least as f32) < low), most - i32::from(most as f32 > high));
        let rate = (config.rate[at].0 * dt * STEPS) as u32;
        let acceleration = ((config.acceleration[at].0 * dt * dt * STEPS) as u32).min(2 * rate).max(1);
        let n = rate / acceleration;
        let brake = n * rate - acceleration * (n * (n + 1) / 2);
        let clearance = (rate + brake) as i32;
        LimitsInC {
            least,
            most,
            rate: rate as i32,
            acceleration,
            ends: [least, most].map(|end| end as f32 / STEPS),
            clearance,
        }
    });
    let mut gate = GateInC {
        joints,
        edges: [EdgeInC { joints: [0, 1], sign: 1, most: i32::MAX, far: i32::MAX }; POSE_LIMITS],
        edge_count: 0,
    };
    for (edge, limit) in gate.edges.iter_mut().zip(config.pose.iter().flatten()) {
        let most = limit.most.0 * STEPS;
        let whole = most as i32;
        let most = whole - i32::from(whole as f32 > most);
        let pair = [limit.first, limit.second].map(|joint| joint as usize & 3);
        let [first, second] = pair.map(|joint| joints[joint].clearance);
        *edge = EdgeInC {
            joints: pair.map(|joint| joint as u32),
            sign: if limit.sense == PoseSense::Sum { 1 } else { -1 },
            most,
            far: most - first - second,
        };
        gate.edge_count += 1;
    }
    gate
}
