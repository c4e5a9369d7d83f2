//! Ten million steps of the integer generators: every letter follows the period, and the final state equals that of a new one.
use cpg_core::edge_reversal::hexapod::{Hexapod, Leg, Swings};
use cpg_core::edge_reversal::obb::{Neuron, Obb, PAPER_POTENTIAL, Reversibilities};
use cpg_core::edge_reversal::smer::{Edge, Smer};

const STEPS: u32 = 10_000_000;

/// Every letter of the word of (r_F, r_E), which is `transient` and then `cycle` for ever.
#[test]
fn obb_words() {
    let pairs = [
        ((1, 5), "FFFFE", "FFFFFE"),
        ((1, 3), "FFFFE", "FFFE"),
        ((1, 1), "FFFFE", "FE"),
        // The roles of the hexapod: the extensor, with 1, is on for five steps of six. M_F = 0.35 are 8 tokens, of which F takes 5.
        ((5, 1), "FEEF", "EEEEEF"),
    ];
    for ((flexor, extensor), transient, cycle) in pairs {
        let pair = Reversibilities::new(flexor, extensor).unwrap();
        let mut obb = Obb::from_potential(pair, PAPER_POTENTIAL).unwrap();
        let letter = |step: u32| {
            let (transient, cycle) = (transient.as_bytes(), cycle.as_bytes());
            let after = (step as usize).checked_sub(transient.len());
            char::from(after.map_or_else(|| transient[step as usize], |after| cycle[after % cycle.len()]))
        };
        let fresh = obb;
        for step in 0..STEPS {
            let sum = obb.potentials();
            assert!((sum.0 + sum.1 - 1.0).abs() < 1e-6 && sum.0.abs() <= 1.0, "{pair:?} step {step}: {sum:?}");
            assert_eq!(obb.step().letter(), letter(step), "{pair:?} step {step}");
        }
        let mut short = fresh;
        let (transient, cycle) = (transient.len() as u32, cycle.len() as u32);
        for _ in 0..transient + (STEPS - transient) % cycle {
            short.step();
        }
        assert_eq!(obb, short, "{pair:?}");
    }
}

/// A period of 540 steps, in which the flexor fires 463 times: the count and the state of ten million.
#[test]
fn a_long_obb_word() {
    let pair = Reversibilities::new(77, 463).unwrap();
    let mut obb = Obb::new(pair);
    let (fresh, mut flexor) = (obb, 0u32);
    for _ in 0..STEPS {
        flexor += u32::from(obb.step() == Neuron::Flexor);
    }
    let mut short = fresh;
    let rest = (0..STEPS % 540).filter(|_| short.step() == Neuron::Flexor).count() as u32;
    assert_eq!(flexor, STEPS / 540 * 463 + rest);
    assert_eq!(obb, short);
}

fn swings(legs: &str) -> Vec<&'static str> {
    Leg::ALL.into_iter().map(Leg::name).filter(|name| legs.split('+').any(|leg| leg == *name)).collect()
}

fn names(swings: Swings) -> Vec<&'static str> {
    swings.legs().map(Leg::name).collect()
}

/// The wave, the middle gait from step 54 and the tripod from step 100: every step of ten million, then every edge of the graph, and on
/// the way the tokens of each edge and the circulation of the ladder's cycles.
#[test]
fn hexapod_words() {
    const WAVE: [&str; 6] = ["BL", "ML", "TL", "BR", "MR", "TR"];
    const MIDDLE: [&str; 4] = ["BL", "ML+BR", "TL+MR", "TR"];
    const TRIPOD: [&str; 2] = ["TL+BL+MR", "ML+TR+BR"];
    let expand = |word: &[&str]| word.iter().map(|legs| swings(legs)).collect::<Vec<_>>();
    let words = [expand(&WAVE), expand(&MIDDLE), expand(&TRIPOD)];
    // Each gait for ten million steps; the second and third reached by the changes of the paper.
    for last in 0..3 {
        let mut hexapod = Hexapod::new(5).unwrap();
        let mut at = None;
        for step in 0..STEPS {
            match (step, last) {
                (54, 1 | 2) => hexapod.set_reversibility(3).unwrap(),
                (100, 2) => hexapod.set_reversibility(1).unwrap(),
                _ => (),
            }
            let (word, from) = match step {
                0..54 => (&words[0], 0),
                54..100 => (&words[last.min(1)], if last == 0 { 0 } else { 54 }),
                _ => (&words[last], [0, 54, 100][last]),
            };
            if step == 1000 {
                at = Some(hexapod.clone());
            }
            let fired = hexapod.step();
            // Two strings a step would take a minute: the bits, and the names now and then.
            let want = &word[(step - from) as usize % word.len()];
            assert!(fired.legs().count() == want.len() && want.iter().all(|name| has(fired, name)), "step {step}");
            if step % 999_983 == 0 {
                assert_eq!(names(fired), *want, "step {step}");
                conserved(&hexapod);
            }
        }
        conserved(&hexapod);
        let mut short = at.unwrap();
        let period = words[last].len() as u32;
        for _ in 0..(STEPS - 1000) % period {
            short.step();
        }
        assert_eq!(hexapod, short);
    }
}

fn has(fired: Swings, name: &str) -> bool {
    Leg::ALL.into_iter().any(|leg| leg.name() == name && fired.contains(leg))
}

fn conserved(hexapod: &Hexapod) {
    let graph = hexapod.graph();
    for (cycle, name) in [(&[0u8, 1, 2, 5, 4, 3][..], "ring"), (&[0, 1, 4, 3], "upper"), (&[1, 2, 5, 4], "lower")] {
        assert_eq!(graph.circulation(cycle), Some(0), "{name}");
    }
    for edge in graph.edges() {
        let [ra, rb] = [edge.a, edge.b].map(|node| graph.reversibility()[usize::from(node)]);
        let carries = ra + rb - gcd(ra, rb);
        assert!(edge.tokens_at_a <= carries, "{edge:?}");
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// A graph with a cycle and unequal reversibilities: the circulation is the same in every state.
#[test]
fn circulation_of_a_triangle() {
    // The first start that lives: 10 of the 18 do.
    let tokens = (0..18).map(|start| [start % 2, start / 2 % 3, start / 6]);
    let mut live = tokens.filter_map(|[ab, bc, ac]| {
        let edges = [(0, 1, ab), (1, 2, bc), (0, 2, ac)].map(|(a, b, tokens_at_a)| Edge { a, b, tokens_at_a });
        Smer::new([1, 1, 2], edges).ok()
    });
    let mut graph = live.next().unwrap();
    assert_eq!(live.count(), 9);
    let (first, period) = (graph.circulation(&[0, 1, 2]), graph.cycle().unwrap().period);
    assert!(first.is_some() && period == 5);
    let start = graph.clone();
    for step in 1..=STEPS {
        graph.step();
        if step % 9973 == 0 {
            assert_eq!(graph.circulation(&[0, 1, 2]), first, "step {step}");
        }
    }
    // Ten million is a multiple of the period, and a start on the cycle comes back to itself.
    let mut settled = start;
    for _ in 0..20 {
        settled.step();
    }
    assert_eq!(graph, settled);
}
