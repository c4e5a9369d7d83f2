//! The two networks in Rust and in C, from the same configuration and state.

use core::fmt::Write as _;
use core::hint::black_box;

use cpg_core::gait::default_walk::{Walk, default_config, default_walk};
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::{Generator, OscillatorState};
use joint_units::Period;

use crate::semihosting::TextLine;

/// Time unit of the integrator: half a control period, s.
const UNIT_S: f32 = 1000.0 / 2_000_000.0;
const JOINTS: usize = 4;
type Joints = [f32; JOINTS];

/// `struct state` of c/networks.c.
#[repr(C)]
#[derive(Clone, Copy)]
struct State {
    x: Joints,
    v: Joints,
    limit_x: Joints,
    limit_v: Joints,
}

/// `struct thesis`.
#[repr(C)]
#[derive(Clone, Copy)]
struct ThesisInC {
    state: State,
    damping: Joints,
    cubic: Joints,
    spring: Joints,
    difference: Joints,
    product: Joints,
}

/// `struct r1`.
#[repr(C)]
#[derive(Clone, Copy)]
struct R1InC {
    state: State,
    damping: Joints,
    cubic: f32,
    spring: f32,
    link_v: Joints,
    link_x: Joints,
}

unsafe extern "C" {
    fn c_thesis_exact(network: &mut ThesisInC);
    fn c_thesis_fused(network: &mut ThesisInC);
    fn c_r1_exact(network: &mut R1InC);
    fn c_r1_fused(network: &mut R1InC);
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn rust_thesis(network: &mut Thesis) {
    network.step();
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn rust_r1(network: &mut Walk) {
    network.step();
}

/// A step of a network in C.
type Step<C> = unsafe extern "C" fn(&mut C);

/// Compares both networks in so many steps; the status of the program: 0, or 1 if one cannot be built.
pub(crate) fn run(steps: u32) -> u32 {
    let thesis = || -> Option<()> {
        let config = black_box(ThesisConfig::set_s());
        let mut rust: Thesis = config.build(Period::MILLISECOND).ok()?;
        // The model's velocity is in degrees a second.
        let unit = 1.0 / UNIT_S;
        let state = begin(&rust.state(), &rust.limit(), unit);
        rust.set_state(&as_rust(&state, unit)).ok()?;
        let c = thesis_in_c(&config, state);
        compare(
            ("thesis", steps),
            &mut rust,
            rust_thesis,
            |rust| rust.state(),
            (c, |c| c.state),
            [c_thesis_exact, c_thesis_fused],
            unit,
        );
        Some(())
    };
    let r1 = || -> Option<()> {
        let mut rust: Walk = black_box(default_walk(Period::MILLISECOND).ok()?);
        let c = core::f32::consts::TAU / default_config().natural_period * UNIT_S;
        let limit = OscillatorState { displacement: [3.0; JOINTS], velocity: [3.0; JOINTS] };
        let state = begin(&rust.state(), &limit, 1.0 / c);
        rust.set_state(&as_rust(&state, 1.0 / c)).ok()?;
        compare(
            ("R1", steps),
            &mut rust,
            rust_r1,
            |rust| rust.state(),
            (r1_in_c(c, state), |c| c.state),
            [c_r1_exact, c_r1_fused],
            1.0 / c,
        );
        Some(())
    };
    u32::from(thesis().is_none() || r1().is_none())
}

/// The state in the units of the integrator.
fn begin(state: &OscillatorState<JOINTS>, limit: &OscillatorState<JOINTS>, velocity: f32) -> State {
    let per = 1.0 / velocity;
    let inside = |v: Joints| v.map(|v| v * per);
    State {
        x: state.displacement,
        v: inside(state.velocity),
        limit_x: limit.displacement,
        limit_v: inside(limit.velocity),
    }
}

/// The state in the units of the model.
fn as_rust(state: &State, velocity: f32) -> OscillatorState<JOINTS> {
    OscillatorState { displacement: state.x, velocity: state.v.map(|v| v * velocity) }
}

/// The constants as `ThesisConfig::build` folds them.
fn thesis_in_c(config: &ThesisConfig, state: State) -> ThesisInC {
    let c = UNIT_S;
    let mut damping = config.joints.map(|joint| c * joint.alpha);
    let gains = |links: [[f32; 2]; 2]| links.map(|gains| gains.map(|k| c * k));
    let ([[a, b], [d, e]], [[f, g], [h, i]]) = (gains(config.difference), gains(config.product));
    for (damping, k) in damping.iter_mut().zip([a, b, d, e]) {
        *damping += k;
    }
    ThesisInC {
        state,
        damping,
        cubic: config.joints.map(|joint| joint.alpha * joint.p / c),
        spring: config.joints.map(|joint| c * joint.mu * (c * joint.mu)),
        difference: [a, b, d, e],
        // Left hip and knee, right hip and knee; here by joint.
        product: [f, h, g, i],
    }
}

/// The constants as `RobustConfig::build` folds them, with the sines and cosines of the phases between the joints.
fn r1_in_c(c: f32, state: State) -> R1InC {
    use cpg_core::Scalar;
    let config = default_config();
    let mut damping = [c * config.nonlinearity; JOINTS];
    let (mut link_v, mut link_x) = ([0.0; JOINTS], [0.0; JOINTS]);
    for (link, (i, j)) in [(0, 1), (2, 3), (0, 2), (1, 3)].into_iter().enumerate() {
        let kap: f32 = config.coupling[link];
        let lead = config.phases[i].0.wrapping_sub(config.phases[j].0);
        let (sin, cos) = <f32 as Scalar>::sin_cos(joint_units::Phase(lead));
        (link_v[link], link_x[link]) = (c * kap * cos, c * c * kap * sin);
        damping[i] -= c * kap;
        damping[j] -= c * kap;
    }
    R1InC { state, damping, cubic: 4.0 / 3.0 * config.nonlinearity / c, spring: c * c, link_v, link_x }
}

/// Steps a network in Rust and twice in C, and prints a line.
fn compare<R, C: Copy>(
    (name, steps): (&str, u32),
    rust: &mut R,
    step: extern "C" fn(&mut R),
    state: impl Fn(&R) -> OscillatorState<JOINTS>,
    (begin, of_c): (C, fn(&C) -> State),
    [exact, fused]: [Step<C>; 2],
    velocity: f32,
) {
    let (mut without, mut with) = (begin, begin);
    let (mut equal, mut difference) = (0_u32, 0.0_f32);
    for _ in 0..steps {
        black_box(step)(rust);
        // SAFETY: the C functions read and write the struct that they get, whose layout is the same.
        unsafe {
            black_box(exact)(&mut without);
            black_box(fused)(&mut with);
        }
        let (rust, c) = (state(rust), as_rust(&of_c(&without), velocity));
        let bits =
            |state: &OscillatorState<JOINTS>| (state.displacement.map(f32::to_bits), state.velocity.map(f32::to_bits));
        equal += u32::from(bits(&rust) == bits(&c));
        let limits = of_c(&with);
        for ((a, b), limit) in rust.displacement.iter().zip(limits.x).zip(limits.limit_x) {
            // The bound is three times the amplitude, or a little more.
            difference = difference.max((a - b).abs() / (limit / 3.0));
        }
    }
    let mut line = TextLine::new();
    // A line is short.
    let _ = write!(line, "{name} {steps} {equal} {}", (difference * 1e9) as u32);
    line.print();
}
