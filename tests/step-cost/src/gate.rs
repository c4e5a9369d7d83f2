//! The gate in Rust and in C, from the same configuration and state, on a recorded walk: from the park pose to its first pose, through it at 1 kHz,
//! and again from its end to its beginning, which is a jump. Then in Rust alone on targets of every kind, whose longest step is the worst that is known.

use core::fmt::Write as _;
use core::hint::black_box;

use joint_loop::{DEFAULT_PARK, Gate, GateConfig, GateState, GateStatus, POSE_LIMITS, PoseLimit, PoseSense};
use joint_units::{Joint, Period, Radians};

use crate::recorded;
use crate::semihosting::TextLine;

/// How often the recorded walk is played.
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

/// A step for any targets, apart from those of the walk, so that its calls are counted apart: the limits that acted.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn rust_gate_any(
    gate: &Gate,
    state: &mut GateState,
    target: &[Radians; Joint::COUNT],
    setpoints: &mut [Radians; Joint::COUNT],
) -> u32 {
    let Ok((limited, status)) = gate.limit(state, *target) else { return u32::MAX };
    *setpoints = limited;
    status.bits().into()
}

/// Compares the gates in at most so many steps, and tries so many targets of every kind; the status of the program: 0, or 1 if there is no gate.
pub(crate) fn run(most_steps: usize, any_steps: u32) -> u32 {
    u32::from(compare(most_steps).is_none() || try_any(any_steps).is_none())
}

/// Targets of [`try_any`] lie in this range to both sides, rad: far beyond the joints' ranges.
const FAR: f32 = 2.5;

/// Random numbers of 32 bits (G. Marsaglia, "Xorshift RNGs", 2003).
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// From -1 to 1.
    fn signed(&mut self) -> f32 {
        self.next() as i32 as f32 * (1.0 / 2_147_483_648.0)
    }
}

/// Steps of the gate on finite targets of every kind, with a pose envelope of all edges that it may have: jumps in each step and after some, ramps at up to twice
/// the allowed rate, ends of ranges.
fn try_any(steps: u32) -> Option<()> {
    let mut config = black_box(GateConfig::default_biped());
    let sum_of_hips = PoseLimit {
        first: Joint::LeftHip,
        second: Joint::RightHip,
        sense: PoseSense::Sum,
        most: Radians::from_degrees(90.0),
    };
    *config.pose.iter_mut().find(|place| place.is_none())? = Some(sum_of_hips);
    let gate = Gate::build(&config, Period::MILLISECOND).ok()?;
    let mut state = gate.rest(DEFAULT_PARK)?;
    let mut random = Random(0x2545_F491);
    let (mut target, mut ramp) = (DEFAULT_PARK, [0.0; Joint::COUNT]);
    let mut left = 0;
    let mut kind = 0;
    let mut acted = 0;
    for _ in 0..steps {
        if left == 0 {
            kind = random.next() % 4;
            left = 1 + random.next() % 200;
            // Up to twice the rate.
            ramp = [0; Joint::COUNT].map(|_| random.signed() * 2.0 * config.rate[0].0 * Period::MILLISECOND.seconds());
            if kind == 3 {
                target = config.range.map(|range| if random.next() % 2 == 0 { range.least } else { range.most });
            }
        }
        left -= 1;
        match kind {
            // A jump in each step, and one that stays.
            0 => target = target.map(|_| Radians(random.signed() * FAR)),
            1 if left % 50 == 0 => target = target.map(|_| Radians(random.signed() * FAR)),
            2 => target.iter_mut().zip(ramp).for_each(|(angle, by)| angle.0 += by),
            _ => {}
        }
        let mut setpoints = target;
        let step =
            black_box(rust_gate_any as extern "C" fn(&Gate, &mut GateState, &[Radians; 4], &mut [Radians; 4]) -> u32);
        acted |= step(&gate, &mut state, &target, &mut setpoints);
    }
    let all = [GateStatus::RANGE, GateStatus::POSE, GateStatus::RATE, GateStatus::ACCELERATION];
    let each = all.iter().all(|limit| acted & u32::from(limit.bits()) != 0) && acted != u32::MAX;
    let mut line = TextLine::new();
    // A line is short.
    let _ = write!(line, "gate-any {steps} {}", u32::from(each));
    line.print();
    Some(())
}

fn compare(most_steps: usize) -> Option<()> {
    let config = black_box(GateConfig::default_biped());
    let rust = Gate::build(&config, Period::MILLISECOND).ok()?;
    let c = in_c(&config);
    let mut state = rust.rest(DEFAULT_PARK)?;
    let position = DEFAULT_PARK.map(|angle| (angle.0 * STEPS) as i32);
    let begin = StateInC { position, step: [0; Joint::COUNT], goal: position };
    let mut in_c = [(c_gate_exact as InC, begin, 0_u32), (c_gate_fused as InC, begin, 0)];
    let mut steps = 0_u32;
    let mut acted = GateStatus::NONE.bits();
    for target in (0..TIMES).flat_map(|_| recorded::poses()).take(most_steps) {
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
