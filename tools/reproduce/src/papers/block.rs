//! The oscillatory building block of Yang et al. 2014: figures 1, 3 and 4, the change at 40 s, Table 1, and what the paper says about it.

use cpg_core::edge_reversal::obb::{Obb, ObbError, PAPER_POTENTIAL, Reversibilities};
use picture::Panel;
use picture::links::{Link, Links, Node};

use super::claim::{Claim, Paper, Verdict};
use super::figure::Figure;
use super::literal::{Literal, ONE, period_and_duty};
use super::study::Table;
use crate::charts::block::BlockRun;

/// A step of the building block, seconds: the periods of 18, 12 and 6 s are 6, 4 and 2 steps.
pub(super) const STEP_S: f64 = 3.0;
/// The reversibilities of flexor and extensor in Table 1, in the order in which the paper changes them.
const TABLE_1: [[u32; 2]; 3] = [[1, 5], [1, 3], [1, 1]];
/// Steps at which the changes at 160 s and 300 s act: the next whole ones.
const CHANGES: [u64; 2] = [54, 100];

fn pair([flexor, extensor]: [u32; 2]) -> Result<Reversibilities, ObbError> {
    Reversibilities::new(flexor, extensor)
}

/// The figures.
///
/// # Errors
/// None: the reversibilities are in range.
pub(super) fn figures() -> Result<Vec<Figure>, ObbError> {
    let start = Obb::from_potential(pair(TABLE_1[0])?, PAPER_POTENTIAL)?;
    let switches = [(CHANGES[0], pair(TABLE_1[1])?), (CHANGES[1], pair(TABLE_1[2])?)];
    let course = BlockRun::of(start, &switches, 120, true);
    let marks = [(162.0, "(1,3) from 160 s".to_owned()), (300.0, "(1,1)".to_owned())];
    let parameters = "reversibilities of flexor and extensor (1,5), from 160 s (1,3), from 300 s (1,1); start M_F = 0.35, M_E = 0.65; thresholds 0 and 1; \
                      a step is 3 s; integers. Also: footfall obb --reversibility 1,5 --steps 120 --switch \"54:1,3 100:1,1\" --svg FILE";
    let [early, late] = [[1, 4], [1, 3]].map(pair);
    let forty = BlockRun::of(Obb::from_potential(early?, PAPER_POTENTIAL)?, &[(14, late?)], 40, true);
    let at_40 = [(42.0, "(1,3) from 40 s".to_owned())];
    Ok(vec![
        pair_of_neurons(),
        Figure::new(
            "yang-3",
            "Yang et al., figure 3: potentials and outputs through (1,5), (1,3), (1,1)",
            "The potentials are a staircase; the neuron whose potential is above its threshold is on. Each change acts at the next step.",
            parameters,
            vec![course.potentials(STEP_S, &marks), course.outputs(STEP_S, &marks)],
        ),
        Figure::new(
            "yang-4",
            "Yang et al., figure 4: outputs and duty through (1,5), (1,3), (1,1)",
            "The share of the last period in which each neuron was on: 5/6, 3/4, 1/2 for the flexor.",
            parameters,
            vec![course.outputs(STEP_S, &marks), course.duty(STEP_S, &marks)],
        ),
        Figure::new(
            "yang-change-40-s",
            "Yang et al.: a change at 40 s from a duty of 0.8",
            "A duty of 0.8 (on for 12 of 15 s) is that of the pair (1,4), which is in no table of the paper. The change acts at 42 s.",
            "reversibilities (1,4), from 40 s (1,3), which the paper does not state; start M_F = 0.35; a step is 3 s; integers",
            vec![forty.potentials(STEP_S, &at_40), forty.outputs(STEP_S, &at_40), forty.duty(STEP_S, &at_40)],
        ),
    ])
}

/// The block as a graph: two neurons that give each other their tokens.
fn pair_of_neurons() -> Figure {
    let node = |name: &str, r: u32| Node { name: name.into(), note: format!("r = {r}") };
    let link = |ends, label: &str| Link { ends, labels: [String::new(), label.into()] };
    let links = vec![link([0, 1], "0.1"), link([1, 0], "0.5")];
    let graph = Links { nodes: vec![node("flexor", 1), node("extensor", 5)], links };
    Figure::new(
        "yang-1",
        "Yang et al., figure 1: the oscillatory building block",
        "Two neurons joined by edge reversal: the one that is on gives r/r' of its potential to the other.",
        "reversibilities of Table 1's slow gait, r' = 10; beside each neuron is what it receives in a step in which the other is on: r/r' of the other",
        vec![Panel::links("flexor and extensor", graph)],
    )
}

/// Table 1 computed again.
///
/// # Errors
/// None: the reversibilities are in range.
pub(super) fn table() -> Result<Table, ObbError> {
    let row = |r: [u32; 2]| {
        let of = pair(r)?;
        let seconds = f64::from(of.period()) * STEP_S;
        let extensor = f64::from(of.extensor_duty());
        let mut obb = Obb::new(of);
        let word = (0..of.period()).map(|_| obb.step().letter()).collect();
        let on = [1.0 - extensor, extensor].map(|duty| format!("{:.0}", duty * seconds));
        let [f, e] = on;
        Ok(vec![
            format!("({}, {})", r[0], r[1]),
            word,
            of.period().to_string(),
            format!("{seconds:.0}"),
            f,
            e,
            format!("{:.3}", 1.0 - extensor),
        ])
    };
    let head =
        ["(r_F, r_E)", "word", "period, steps", "period, s", "flexor on, s", "extensor on, s", "duty of the flexor"];
    Ok(Table {
        name: "yang-table-1",
        title: "Yang et al., Table 1: the building block in the three gaits, and the pair of duty 0.8".into(),
        note: "A step is 3 s. Thresholds 0 (flexor) and 1 (extensor), r' = 10. The paper's text gives the extensor the long duty, which its own equation gives \
               the neuron with reversibility 1, the flexor of its table."
            .into(),
        head: head.map(String::from).to_vec(),
        rows: TABLE_1.into_iter().chain([[1, 4]]).map(row).collect::<Result<_, ObbError>>()?,
    })
}

/// Steps after a change until a block repeats the states of its new cycle, the most over every state in which it can be changed.
fn longest_transient(from: [u32; 2], to: [u32; 2]) -> Result<usize, ObbError> {
    let (old, new) = (pair(from)?, pair(to)?);
    let mut longest = 0;
    let mut obb = Obb::new(old);
    for _ in 0..old.period() {
        obb.step();
        let mut changed = obb;
        changed.set(new);
        let mut states = vec![];
        for _ in 0..40 {
            states.push(changed);
            changed.step();
        }
        let period = new.period() as usize;
        let settled = (0..20).find(|&from| states[from] == states[from + period]);
        longest = longest.max(settled.unwrap_or(20));
    }
    Ok(longest)
}

/// The claims about the block.
///
/// # Errors
/// None: the reversibilities are in range.
pub(super) fn claims() -> Result<Vec<Claim>, ObbError> {
    let claim = |id, place, statement, number| Claim::new(Paper::Yang, id, place, statement, number);
    let slow = pair([1, 5])?;
    let extensor_s = f64::from(slow.extensor_duty()) * 18.0;
    let periods: Vec<String> = TABLE_1
        .iter()
        .map(|&r| Ok(format!("{}", f64::from(pair(r)?.period()) * STEP_S)))
        .collect::<Result<_, ObbError>>()?;
    let transients =
        [longest_transient([1, 5], [1, 3])?, longest_transient([1, 3], [1, 1])?, longest_transient([1, 5], [1, 1])?];
    let signed = |r: [u32; 2]| r.map(i64::from);
    let stalls = |variant: fn([i64; 2]) -> Literal, of: &[[u32; 2]], on: bool| {
        let all = of.iter().filter(|&&r| variant(signed(r)).ends_with_both(on));
        all.map(|r| format!("({}, {})", r[0], r[1])).collect::<Vec<_>>()
    };
    let both_on = stalls(Literal::weights_of_the_text, &[[1, 5], [1, 3], [1, 1], [3, 5]], true);
    let both_off = stalls(Literal::new_thresholds, &TABLE_1, false);
    let (changed, wanted) = (
        period_and_duty(&Literal::new_weights([1, 5], [1, 3]).run(200)),
        period_and_duty(&Literal::equation_1([1, 3]).run(200)),
    );
    let in_words = |found: Option<(usize, f64)>| {
        found.map_or("none".into(), |(period, duty)| format!("{period} steps, duty {duty:.3}"))
    };
    let stopped = (0..=10).filter(|tenths| {
        let potential = [tenths * ONE / 10, ONE - tenths * ONE / 10];
        Literal { potential, ..Literal::equation_1([1, 5]) }.ends_with_both(false)
    });
    let stopped = stopped.count();
    let four = f64::from(pair([4, 1])?.extensor_duty());
    let five = f64::from(pair([5, 1])?.extensor_duty());
    Ok(vec![
        claim("block-periods", "figure 3, Table 1", "the gaits (1,5), (1,3), (1,1) have periods of 18, 12 and 6 s", "18, 12, 6 s").found(
            format!("{} s, of steps of 3 s", periods.join(", ")),
            Verdict::of(periods == ["18", "12", "6"]),
            "A period is (r_F + r_E)/gcd steps, and 18 s of 6 steps make a step of 3 s.",
        ),
        claim("block-extensor-on", "text, Table 1", "in (1,5) the extensor, which has 5, is on for 15 of 18 s", "15 s").found(
            format!("extensor {extensor_s:.0} s, flexor {:.0} s", 18.0 - extensor_s),
            Verdict::of((extensor_s - 15.0).abs() < 1e-6),
            "By eq. 1 a neuron is on for r_j/(r_i + r_j) of the time: the one with the smaller reversibility. With the roles exchanged it is 15 s.",
        ),
        claim("block-frequency", "text", "the neuron with the smaller reversibility operates more often", "not stated").found(
            "in (1,5) the neuron with 1 operates 5 times a period, the one with 5 once".into(),
            Verdict::of((f64::from(slow.extensor_duty()) * 6.0 - 1.0).abs() < 1e-6),
            "It is the rule of edge reversal: operations in a period are the common multiple over the reversibility.",
        ),
        claim("block-changes", "figure 3", "the block changes between the gaits without stopping", "not stated").found(
            format!("settles within {}, {} and {} steps: (1,5) to (1,3), (1,3) to (1,1), (1,5) to (1,1)", transients[0], transients[1], transients[2]),
            Verdict::of(transients.iter().all(|steps| *steps <= 4)),
            "From every state of the old gait; the tokens stay, so no step is lost.",
        ),
        claim("block-change-times", "figures 3, 4", "changes act at 40 s and 160 s", "40, 160 s").found(
            format!("{:.0} and {:.0} s", 14.0 * STEP_S, CHANGES[0] as f64 * STEP_S),
            Verdict::NotReproduced,
            "40 and 160 are no multiples of the step of 3 s, so a change acts at the next step; 300 s is one.",
        ),
        claim("block-duty-0.8", "figure 4", "the duty is 0.8, with the neuron on from 39 to 51 s", "0.8; 12 of 15 s").found(
            format!("{five:.3} for (1,5); {four:.1} (12 of 15 s) for (1,4)"),
            Verdict::of((five - 0.8).abs() < 1e-3),
            "These numbers are those of the pair (1,4), which is in no table.",
        ),
        claim("block-weights-text", "text", "W_ij = r_i/r' and W_ii = -W_ij, as in eq. 1", "not stated").found(
            format!("both neurons stay on for {}", listed(&both_on)),
            Verdict::of(both_on.is_empty()),
            "The text's matrix is the transpose of eq. 1's; with eq. 1 every pair alternates.",
        ),
        claim("block-new-thresholds", "text", "theta_i = r_i/f and theta_j = r_j/f keep the block going after a change", "not stated").found(
            format!("both neurons stay off for {}", listed(&both_off)),
            Verdict::of(both_off.is_empty()),
            "The formula contradicts theta_j = 1 - theta_i of the same paper, with which the block goes on.",
        ),
        claim("block-threshold-roles", "Table 1", "theta_i = r_i/f, theta_j = 1 - theta_i give the thresholds 0 (flexor) and 1 (extensor)", "0; 1").found(
            "flexor 0, extensor 1 if i is the extensor; 1/5 and 4/5 if i is the flexor of (1,5)".into(),
            Verdict::Undecided,
            "The paper does not say which neuron is i. Both give the same duty, at another phase.",
        ),
        claim("block-new-weights", "eq. 3 and its text", "W_new = (r + r^d)/r gives the new gait", &in_words(wanted)).found(
            in_words(changed),
            Verdict::of(changed == wanted),
            "It has to be over r', as in eq. 3; over r the change from (1,5) to (1,3) gives another gait.",
        ),
        claim("block-random-start", "text", "the block runs from any start in [0, 1]", "11 of 11 tenths").found(
            format!("{} of 11", 11 - stopped),
            Verdict::of(stopped == 0),
            "A start that is a whole number of tenths comes to the threshold, where sgn(0) stops both neurons; integers avoid it.",
        ),
        claim("block-inhibition", "text", "the neurons inhibit each other", "not stated").found(
            "the mutual weights of eq. 1 are positive, 0.1 and 0.5 for (1,5); M_F + M_E stays 1".into(),
            Verdict::NotReproduced,
            "Eq. 1 moves charge from one neuron to the other, and takes none away.",
        ),
    ])
}

fn listed(pairs: &[String]) -> String {
    if pairs.is_empty() { "no pair".into() } else { pairs.join(", ") }
}
