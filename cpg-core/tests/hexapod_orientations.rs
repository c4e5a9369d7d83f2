//! All 128 orientations of the hexapod's ladder, stepped by a second implementation: which are live, their classes, their gaits.
use cpg_core::edge_reversal::hexapod::{Hexapod, HexapodError};
use cpg_core::edge_reversal::ladder::{EDGES, Leg, Orientation, OrientationError};
use std::collections::{BTreeSet, HashMap};

/// Edges by the numbers of the legs, written out again.
const LADDER: [(usize, usize); 7] = [(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)];

/// Upper cycle, lower cycle, ring.
const CYCLES: [&[usize]; 3] = [&[0, 1, 4, 3], &[1, 2, 5, 4], &[0, 1, 2, 5, 4, 3]];

/// Flexors and extensors without the core: for each edge the leg to which it points, for each flexor its tokens against its extensor.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Reference {
    heads: [usize; 7],
    tokens: [u32; 6],
}

impl Reference {
    fn new(mask: u32, tokens: [u32; 6]) -> Self {
        let heads = std::array::from_fn(|edge| if mask >> edge & 1 == 1 { LADDER[edge].0 } else { LADDER[edge].1 });
        Self { heads, tokens }
    }

    /// A flexor swings if every edge points to it and all `r` tokens against its extensor are its own; it turns its edges round and gives the
    /// tokens away, of which the extensor returns one a step.
    fn step(&mut self, r: u32) -> Vec<usize> {
        let is_ready = |leg: usize| {
            let mut edges = LADDER.iter().zip(self.heads);
            self.tokens[leg] == r && edges.all(|(&(a, b), head)| (a != leg && b != leg) || head == leg)
        };
        let swings: Vec<usize> = (0..6).filter(|&leg| is_ready(leg)).collect();
        for (head, (a, b)) in self.heads.iter_mut().zip(LADDER) {
            if swings.contains(head) {
                *head = a + b - *head;
            }
        }
        for leg in 0..6 {
            self.tokens[leg] = if swings.contains(&leg) { 0 } else { (self.tokens[leg] + 1).min(r) };
        }
        swings
    }

    /// The steps of the cycle that is reached, and the transient before.
    fn cycle(mut self, r: u32) -> (usize, Vec<Vec<usize>>) {
        let (mut seen, mut word) = (HashMap::new(), vec![]);
        while !seen.contains_key(&self) {
            seen.insert(self.clone(), word.len());
            word.push(self.step(r));
        }
        let transient = seen[&self];
        (transient, word.split_off(transient))
    }

    fn circulations(&self) -> [i64; 3] {
        CYCLES.map(|cycle| {
            let nexts = cycle.iter().cycle().skip(1);
            let along = cycle.iter().zip(nexts).map(|(&from, &to)| {
                let edge = LADDER.iter().position(|&edge| edge == (from, to) || edge == (to, from)).unwrap();
                if self.heads[edge] == to { 1 } else { -1 }
            });
            along.sum()
        })
    }
}

fn orientation(mask: u32) -> Orientation {
    Orientation::from_first_ends(std::array::from_fn(|edge| mask >> edge & 1 == 1))
}

/// Tokens of the flexors against the extensors.
fn tokens(hexapod: &Hexapod) -> [u32; 6] {
    std::array::from_fn(|leg| hexapod.graph().edges()[7 + leg].tokens_at_a)
}

fn legs(hexapod: &mut Hexapod) -> Vec<usize> {
    hexapod.step().legs().map(|leg| leg as usize).collect()
}

#[test]
fn all_128_orientations_agree_with_brute_force() {
    let (mut live, mut dead, mut periods) = (0, 0, HashMap::<(u32, u32), u32>::new());
    let mut worst = 0;
    for mask in 0..128 {
        let orientation = orientation(mask);
        for r in 1..=7 {
            let built = Hexapod::with_orientation(r, orientation);
            let start = built.as_ref().map_or([0; 6], tokens);
            for tokens in [start, [0; 6], [r; 6]] {
                let (transient, cycle) = Reference::new(mask, tokens).cycle(r);
                let swings: Vec<usize> =
                    (0..6).map(|leg| cycle.iter().filter(|step| step.contains(&leg)).count()).collect();
                match &built {
                    Ok(hexapod) => {
                        assert_eq!(swings, [1; 6], "{orientation} at {r}");
                        assert_eq!(cycle.len() as u32, hexapod.period(), "{orientation} at {r}");
                        worst = worst.max(if tokens == start { transient } else { 0 });
                    }
                    // On a directed cycle nobody swings, and everybody else must wait in the end.
                    Err(_) => assert_eq!(swings, [0; 6], "{orientation} at {r}"),
                }
            }
            match built {
                Ok(mut hexapod) => {
                    *periods.entry((r, hexapod.period())).or_default() += 1;
                    let mut reference = Reference::new(mask, start);
                    for step in 0..40 {
                        assert_eq!(legs(&mut hexapod), reference.step(r), "{orientation} at {r}, step {step}");
                    }
                }
                Err(error) => {
                    let Some(cycle) = orientation.directed_cycle() else { panic!("{orientation}: {error}") };
                    assert_eq!(error, HexapodError::Dead { orientation, cycle });
                }
            }
        }
        match Hexapod::with_orientation(1, orientation) {
            Ok(_) => live += 1,
            Err(error) => {
                dead += 1;
                assert!(error.to_string().contains("is directed: each of its legs waits for the next"), "{error}");
            }
        }
    }
    assert_eq!((live, dead), (98, 30));
    assert_eq!([2, 4, 6].map(|period| periods[&(1, period)]), [18, 68, 12]);
    assert_eq!(worst, 7, "steps of the longest transient from the start tokens");
}

/// Each edge of the cycle that an error names points to the next leg.
#[test]
fn the_cycle_of_a_dead_orientation_is_directed() {
    for orientation in Orientation::all() {
        let Some(cycle) = orientation.directed_cycle() else { continue };
        let heads = orientation.first_ends().map(usize::from);
        for (from, to) in cycle.legs().into_iter().zip(cycle.legs().into_iter().cycle().skip(1)) {
            let edge = EDGES.iter().position(|&edge| edge == (from, to) || edge == (to, from)).unwrap();
            assert_eq!([EDGES[edge].1, EDGES[edge].0][heads[edge]], to, "{orientation}: {cycle}");
        }
        assert!(cycle.to_string().contains(&format!("cycle {} > ", cycle.legs()[0].name())));
    }
}

#[test]
fn classes_are_those_of_the_tokens_and_are_conserved() {
    let mut classes = HashMap::<[i64; 3], u32>::new();
    for mask in 0..128 {
        let orientation = orientation(mask);
        let class = orientation.circulation();
        let counted = Reference::new(mask, [0; 6]).circulations();
        assert_eq!([class.upper, class.lower, class.ring()].map(i64::from), counted, "{orientation}");
        let Ok(mut hexapod) = Hexapod::with_orientation(5, orientation) else { continue };
        *classes.entry(counted).or_default() += 1;
        for r in [5, 3, 1, 2, 5] {
            hexapod.set_reversibility(r).unwrap();
            for _ in 0..9 {
                hexapod.step();
                assert_eq!(hexapod.circulation(), class, "{orientation}");
                for (cycle, counted) in CYCLES.iter().zip(counted) {
                    let cycle: Vec<u8> = cycle.iter().map(|&leg| leg as u8).collect();
                    assert_eq!(hexapod.graph().circulation(&cycle), Some(counted * i64::from(r)), "{orientation}");
                }
            }
        }
    }
    // Upper and lower of -2, 0, 2 in every combination; by the symmetry of the ladder opposite classes are as large.
    assert_eq!(classes.len(), 9);
    assert!(classes.iter().all(|(class, count)| classes[&class.map(|c| -c)] == *count), "{classes:?}");
    assert_eq!((classes[&[0, 0, 0]], classes[&[2, 2, 4]]), (18, 6));
}

/// From every live orientation, phase and gait to every other gait: nothing stops, and the period is the new one after at most so many steps.
#[test]
fn every_change_of_gait_settles() {
    let mut worst = HashMap::new();
    for orientation in Orientation::live() {
        for (from, to) in [(5, 3), (3, 1), (5, 1), (1, 3), (3, 5), (1, 5)] {
            let mut running = Hexapod::with_orientation(from, orientation).unwrap();
            for _ in 0..24 {
                running.step();
            }
            for phase in 0..running.period() {
                let mut hexapod = running.clone();
                hexapod.set_reversibility(to).unwrap();
                let period = hexapod.period() as usize;
                let word: Vec<Vec<usize>> = (0..60).map(|_| legs(&mut hexapod)).collect();
                let settled = (0..40).find(|&k| (k..60 - period).all(|i| word[i] == word[i + period]));
                let settled = settled.unwrap_or_else(|| panic!("{orientation} from {from} to {to} at phase {phase}"));
                let swings =
                    |leg: usize| word[settled..settled + period].iter().filter(|step| step.contains(&leg)).count();
                assert!((0..6).all(|leg| swings(leg) == 1), "{orientation} from {from} to {to} at phase {phase}");
                let most = worst.entry((from, to)).or_insert(0);
                *most = settled.max(*most);
                running.step();
            }
        }
    }
    let bounds = [(5, 3), (3, 1), (5, 1), (1, 3), (3, 5), (1, 5)].map(|change| worst[&change]);
    assert_eq!(bounds, [2, 2, 2, 2, 2, 4]);
}

/// The tokens of the wave: each rung held by the left, each side edge by the lower leg, the extensors staggered.
#[test]
fn the_wave_is_one_of_them() {
    for r in 1..20 {
        assert_eq!(Hexapod::with_orientation(r, Orientation::WAVE).unwrap(), Hexapod::new(r).unwrap());
    }
    let wave = Hexapod::new(5).unwrap();
    assert_eq!(wave.graph().edges().map(|edge| edge.tokens_at_a), [0, 0, 0, 0, 5, 5, 5, 3, 4, 5, 0, 1, 2]);
    assert_eq!(Orientation::WAVE.to_string(), "dd-dd-lll");
    // Top and bottom of either side wait for nobody on it: the lower one is first, and the left side.
    let open: Orientation = "ud-ud-lll".parse().unwrap();
    assert_eq!(open.start_order().unwrap().map(Leg::name), ["BL", "TL", "ML", "BR", "TR", "MR"]);
    // At R = 5 every orientation has its legs swing one by one in its start order, without a transient.
    for orientation in Orientation::live() {
        let mut hexapod = Hexapod::with_orientation(5, orientation).unwrap();
        let order = orientation.start_order().unwrap().map(|leg| leg as usize);
        for leg in order.iter().chain(&order) {
            assert_eq!(legs(&mut hexapod), [*leg], "{orientation}");
        }
    }
}

#[test]
fn orientations_are_written_and_read() {
    let written: BTreeSet<String> = Orientation::all().map(|orientation| orientation.to_string()).collect();
    assert_eq!((written.len(), Orientation::live().count()), (128, 98));
    for text in &written {
        assert_eq!(text.parse::<Orientation>().unwrap().to_string(), *text);
    }
    // Letter by letter: what points up or to the left points to the first end.
    let one_up: Orientation = "ud-dd-lll".parse().unwrap();
    assert_eq!(one_up.first_ends(), [true, false, false, false, true, true, true]);
    assert_eq!(EDGES[0], (Leg::TopLeft, Leg::MiddleLeft));
    let refused = |text: &str| text.parse::<Orientation>().unwrap_err();
    for (text, found) in [("", 0), ("dd-dd-ll", 8), ("dd-dd-lllé", 10)] {
        assert_eq!(refused(text), OrientationError::Length { found });
    }
    for (text, place, allowed) in [("xd-dd-lll", 1, "u or d"), ("dddd--lll", 3, "-"), ("dd-dd-llé", 9, "l or r")] {
        assert_eq!(refused(text), OrientationError::Character { place, allowed }, "{text}");
    }
    assert!(refused("DD-DD-LLL").to_string().starts_with("character 1: allowed is u or d, as in dd-dd-lll:"));
    assert_eq!(Hexapod::with_orientation(0, Orientation::WAVE), Err(HexapodError::Reversibility));
}
