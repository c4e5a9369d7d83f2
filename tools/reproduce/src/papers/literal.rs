//! The building block of Yang et al. 2014 as its equations are printed, in integers: two potentials, weights and thresholds.
//!
//! All numbers are multiples of 1/60, which holds the paper's 0.35, the steps of 0.1, and thirds. A neuron is on if its potential is above
//! its threshold; at the threshold the paper's sgn(0) leaves it off.

/// Units of 1/60 in 1.
pub(super) const ONE: i64 = 60;
/// r' of the paper for reversibilities below 10.
const SCALE: i64 = 10;

/// Potentials, thresholds and weights; index 0 is the flexor.
#[derive(Debug, Clone)]
pub(super) struct Literal {
    /// Potentials M.
    pub(super) potential: [i64; 2],
    /// Thresholds theta.
    pub(super) threshold: [i64; 2],
    /// Change of potential `i` while neuron `j` is on: `weight[i][j]`.
    pub(super) weight: [[i64; 2]; 2],
}

impl Literal {
    /// Equation 1 and the thresholds of Table 1, started at the potentials of Table 1.
    pub(super) fn equation_1(r: [i64; 2]) -> Self {
        let [f, e] = r.map(|r| r * ONE / SCALE);
        Self { potential: [21, 39], threshold: [0, ONE], weight: [[-f, e], [f, -e]] }
    }

    /// The weights of the text, W_ij = r_i/r' and W_ii = -W_ij, row by row.
    pub(super) fn weights_of_the_text(r: [i64; 2]) -> Self {
        let [f, e] = r.map(|r| r * ONE / SCALE);
        Self { weight: [[-f, f], [e, -e]], ..Self::equation_1(r) }
    }

    /// The "new" thresholds theta_i = r_i/f and theta_j = r_j/f, f = r_i + r_j - gcd.
    pub(super) fn new_thresholds(r: [i64; 2]) -> Self {
        let f = r[0] + r[1] - i64::from(cpg_core::edge_reversal::smer::gcd(r[0] as u32, r[1] as u32));
        Self { threshold: r.map(|r| r * ONE / f), ..Self::equation_1(r) }
    }

    /// The weights after a change as the text prints them: W_new = (r + r^d)/r, the new over the old reversibility.
    pub(super) fn new_weights(old: [i64; 2], new: [i64; 2]) -> Self {
        let [f, e] = [0, 1].map(|i| new[i] * ONE / old[i]);
        Self { weight: [[-f, e], [f, -e]], ..Self::equation_1(new) }
    }

    /// Which neurons are on in each of the next steps.
    pub(super) fn run(&mut self, steps: usize) -> Vec<[bool; 2]> {
        (0..steps)
            .map(|_| {
                let on = [0, 1].map(|i| self.potential[i] > self.threshold[i]);
                for (potential, weight) in self.potential.iter_mut().zip(self.weight) {
                    *potential += weight.iter().zip(on).filter(|(_, on)| *on).map(|(weight, _)| weight).sum::<i64>();
                }
                on
            })
            .collect()
    }

    /// Whether both neurons are on, or both off, in each of the last of many steps.
    pub(super) fn ends_with_both(&mut self, on: bool) -> bool {
        self.run(200).iter().skip(100).all(|both| *both == [on; 2])
    }
}

/// Length of the shortest word that repeats from the middle of the steps on, and the share of it in which the flexor is on.
pub(super) fn period_and_duty(steps: &[[bool; 2]]) -> Option<(usize, f64)> {
    let late = &steps[steps.len() / 2..];
    let period =
        (1..late.len() / 2).find(|&period| late.windows(period + 1).all(|window| window[0] == window[period]))?;
    let on = late[..period].iter().filter(|on| on[0]).count();
    Some((period, on as f64 / period as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::edge_reversal::obb::{Obb, PAPER_POTENTIAL, Reversibilities};

    /// The steps as a word: F flexor, E extensor, B both, - none.
    fn word(steps: &[[bool; 2]]) -> String {
        let letter = |on: &[bool; 2]| match on {
            [true, false] => 'F',
            [false, true] => 'E',
            [true, true] => 'B',
            [false, false] => '-',
        };
        steps.iter().map(letter).collect()
    }

    /// The paper's equation gives the core's words; the core counts tokens.
    #[test]
    fn equation_1_is_the_core() {
        for [f, e] in [[1, 5], [1, 3], [1, 1], [3, 5], [5, 3], [2, 3]] {
            let pair = Reversibilities::new(f as u32, e as u32).unwrap();
            let mut obb = Obb::from_potential(pair, PAPER_POTENTIAL).unwrap();
            let core: String = (0..100).map(|_| obb.step().letter()).collect();
            assert_eq!(word(&Literal::equation_1([f, e]).run(100)), core, "{f}, {e}");
        }
        assert_eq!(word(&Literal::equation_1([1, 5]).run(11)), "FFFFEFFFFFE");
    }

    #[test]
    fn the_printed_variants_stall() {
        assert!(Literal::weights_of_the_text([3, 5]).ends_with_both(true));
        for r in [[1, 5], [1, 3], [1, 1]] {
            assert!(Literal::new_thresholds(r).ends_with_both(false), "{r:?}");
            assert!(!Literal::equation_1(r).ends_with_both(false) && !Literal::equation_1(r).ends_with_both(true));
        }
        // At the threshold itself sgn(0) stops both neurons.
        let mut tenth = Literal { potential: [ONE / 10, 9 * ONE / 10], ..Literal::equation_1([1, 5]) };
        assert!(tenth.ends_with_both(false));
        assert_eq!(period_and_duty(&Literal::new_weights([1, 5], [1, 3]).run(200)), Some((8, 0.375)));
        assert_eq!(period_and_duty(&Literal::equation_1([1, 3]).run(200)), Some((4, 0.75)));
    }
}
