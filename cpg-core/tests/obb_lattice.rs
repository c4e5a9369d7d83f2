//! The building block on its lattice: at every step the neuron above its threshold fires, whatever the start and the changes.
use cpg_core::edge_reversal::obb::{Neuron, Obb, PAPER_POTENTIAL, Reversibilities};

/// Starts: the paper's, the threshold, both sides of it, whole and half steps of several lattices, and both ends of the range.
const POTENTIALS: [f32; 16] =
    [PAPER_POTENTIAL, -10.0, -2.77, -1.0, -0.65, -0.35, -0.05, 0.0, 0.003, 0.05, 0.15, 0.5, 0.65, 0.95, 1.0, 10.0];

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn pair(flexor: u32, extensor: u32) -> Reversibilities {
    Reversibilities::new(flexor, extensor).unwrap()
}

fn pairs() -> impl Iterator<Item = (u32, u32)> {
    (1..=60).flat_map(|flexor| (1..=60).map(move |extensor| (flexor, extensor)))
}

/// Eq 1 of the paper in whole numbers: potential in units of 1/(2 r').
#[derive(Debug, Clone, Copy, PartialEq)]
struct Equation {
    /// 2 r' M_F.
    m: i64,
    flexor: i64,
    extensor: i64,
    /// r'.
    scale: i64,
}

impl Equation {
    fn new((flexor, extensor): (u32, u32), m: i64) -> Self {
        let scale = if flexor.max(extensor) < 10 { 10 } else { 100 };
        Self { m, flexor: flexor.into(), extensor: extensor.into(), scale }
    }

    /// With the potential that a block displays, which must be on the lattice of its pair.
    fn displayed(pair: (u32, u32), block: &Obb) -> Self {
        let mut equation = Self::new(pair, 0);
        let exact = f64::from(block.potentials().0) * 2.0 * equation.scale as f64;
        equation.m = exact.round() as i64;
        assert!((exact - equation.m as f64).abs() < 1e-3, "{pair:?}: {exact}");
        let step = 2 * i64::from(gcd(pair.0, pair.1));
        assert_eq!(equation.m.rem_euclid(step), step / 2, "{pair:?}: {exact} is not half a step beside the threshold");
        equation
    }

    /// One step: the neuron above its threshold fires; at a threshold none would.
    fn step(&mut self) -> Neuron {
        assert_ne!(self.m, 0, "at the threshold");
        if self.m > 0 {
            self.m -= 2 * self.flexor;
            Neuron::Flexor
        } else {
            self.m += 2 * self.extensor;
            Neuron::Extensor
        }
    }

    fn is_on_the_cycle(&self) -> bool {
        -2 * self.flexor < self.m && self.m < 2 * self.extensor
    }
}

/// Steps both: same neuron, same potential afterwards, and the displayed potentials name the neuron.
fn step_both(pair: (u32, u32), block: &mut Obb, equation: &mut Equation) -> Neuron {
    let (flexor, extensor) = block.potentials();
    let fired = block.step();
    assert_eq!(
        (flexor > 0.0, extensor > 1.0),
        (fired == Neuron::Flexor, fired == Neuron::Extensor),
        "{pair:?}: {flexor}"
    );
    assert_eq!(fired, equation.step(), "{pair:?}");
    assert_eq!(*equation, Equation::displayed(pair, block), "{pair:?}");
    fired
}

/// After the transient: the stated period, not a shorter one, and the stated duty.
fn assert_cycle(pair: (u32, u32), block: &mut Obb, equation: &mut Equation) {
    while !equation.is_on_the_cycle() {
        step_both(pair, block, equation);
    }
    let (first, period) = (*block, block.reversibilities().period());
    assert_eq!(period, (pair.0 + pair.1) / gcd(pair.0, pair.1));
    let mut extensor = 0;
    for step in 1..=period {
        extensor += u32::from(step_both(pair, block, equation) == Neuron::Extensor);
        assert_eq!(*block == first, step == period, "{pair:?} step {step}");
    }
    assert_eq!(extensor * gcd(pair.0, pair.1), pair.0);
    let duty = extensor as f32 / period as f32;
    assert!((duty - block.reversibilities().extensor_duty()).abs() < 1e-6, "{pair:?}");
}

#[test]
fn every_start_of_every_pair_is_rounded_to_the_lattice() {
    for r in pairs() {
        for potential in POTENTIALS {
            let mut block = Obb::from_potential(pair(r.0, r.1), potential).unwrap();
            let mut equation = Equation::displayed(r, &block);
            // In units of 1/r': moved by less than (g + 1)/2, and kept on its side of the threshold.
            let given = f64::from(potential) * equation.scale as f64;
            let moved = equation.m as f64 / 2.0 - given;
            assert!(moved.abs() < f64::from(gcd(r.0, r.1) + 1) / 2.0 + 1e-3, "{r:?} from {potential}: by {moved}");
            assert!(given < 0.501 || equation.m > 0, "{r:?} from {potential}");
            assert!(given > 0.0 || equation.m < 0, "{r:?} from {potential}");
            assert_cycle(r, &mut block, &mut equation);
        }
    }
}

/// Changes at any step between pairs of any common divisor: the active neuron is that of the tokens before they are rounded.
#[test]
fn every_change_is_rounded_to_the_lattice() {
    let mut random = 1u64;
    let mut below = |n: u32| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as u32 % n
    };
    let mut rounded = 0;
    for start in 0..1_500 {
        let mut draw = || {
            let times = 1 + below(12);
            (times * (1 + below(60 / times)), times * (1 + below(60 / times)))
        };
        let (mut r, next) = (draw(), [(); 5].map(|()| draw()));
        let mut block = Obb::from_potential(pair(r.0, r.1), POTENTIALS[start % POTENTIALS.len()]).unwrap();
        let mut equation = Equation::displayed(r, &block);
        for to in next {
            for _ in 0..below(80) {
                step_both(r, &mut block, &mut equation);
            }
            let tokens = (equation.m - i64::from(gcd(r.0, r.1))) / 2 + equation.flexor;
            block.set(pair(to.0, to.1));
            let changed = Equation::displayed(to, &block);
            let g = i64::from(gcd(to.0, to.1));
            assert_eq!(changed.m, 2 * (tokens.div_euclid(g) * g - changed.flexor) + g, "{r:?} to {to:?}");
            assert_eq!(block.active() == Neuron::Flexor, tokens >= changed.flexor, "{r:?} to {to:?}");
            rounded += u32::from(tokens % g != 0);
            (r, equation) = (to, changed);
        }
        assert_cycle(r, &mut block, &mut equation);
    }
    assert!(rounded > 1_000, "{rounded} of the changes had to be rounded");
}

/// A potential that eq 1 never takes to the threshold has the word of eq 1 itself, without any rounding.
#[test]
fn words_are_those_of_the_unrounded_equation() {
    let mut compared = 0;
    for r in pairs().filter(|r| gcd(r.0, r.1) > 1) {
        let step = 2 * i64::from(gcd(r.0, r.1));
        // At 0 the equation would stop; 1 is the edge of the step, where `f32` decides.
        for m in (-40..140).step_by(7).filter(|m: &i64| m.rem_euclid(step) > 1) {
            let mut equation = Equation::new(r, m);
            let potential = m as f32 / (2 * equation.scale) as f32;
            let mut block = Obb::from_potential(pair(r.0, r.1), potential).unwrap();
            for _ in 0..150 {
                assert_eq!(block.step(), equation.step(), "{r:?} from {potential}");
            }
            compared += 1;
        }
    }
    assert!(compared > 5_000, "{compared}");
}

/// Without a common divisor nothing is rounded but the start, which goes down to a whole token in `f32`.
#[test]
fn words_of_coprime_pairs_are_kept_bit_for_bit() {
    for r in pairs().filter(|r| gcd(r.0, r.1) == 1) {
        let other = if r.0 > r.1 { (1, 5) } else { (7, 3) };
        let scale = Equation::new(r, 0).scale as f32;
        for potential in (-30..=60).map(|n| 0.0137 * n as f32).chain(POTENTIALS) {
            let mut tokens = f64::from((potential * scale + r.0 as f32 - 0.5).floor()) as i64;
            let mut block = Obb::from_potential(pair(r.0, r.1), potential).unwrap();
            for step in 0..90 {
                let (flexor, extensor) = if (40..60).contains(&step) { other } else { r };
                if step == 40 || step == 60 {
                    block.set(pair(flexor, extensor));
                }
                let is_flexor = tokens >= i64::from(flexor);
                tokens += if is_flexor { -i64::from(flexor) } else { i64::from(extensor) };
                assert_eq!(block.step() == Neuron::Flexor, is_flexor, "{r:?} from {potential} step {step}");
            }
        }
    }
}

/// Closed form: letter k of the Christoffel word is E where the multiple (k + 1) r_F / (r_F + r_E) passes a whole number.
#[test]
fn full_starts_have_the_christoffel_word() {
    for (flexor, extensor) in pairs() {
        let mut block = Obb::new(pair(flexor, extensor));
        let sum = flexor + extensor;
        for k in 0..2 * sum {
            let is_extensor = (k + 1) * flexor / sum > k * flexor / sum;
            assert_eq!(block.step() == Neuron::Extensor, is_extensor, "({flexor}, {extensor}) letter {k}");
        }
    }
}
