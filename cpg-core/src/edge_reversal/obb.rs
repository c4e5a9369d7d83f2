//! The oscillatory building block (OBB): two neurons, flexor and extensor, that exchange charge; a half-centre in integers.
//!
//! Yang et al. 2014 (IOP Conf. Ser. Mater. Sci. Eng. 65 012008), eqs 1-2, with reversibilities r_F and r_E, r' the next power of ten
//! above the larger, thresholds theta_F = 0 and theta_E = 1:
//! ```text
//! M_F[k+1] = M_F[k] - v_F r_F/r' + v_E r_E/r',   M_E = 1 - M_F,   v_i = 1 if M_i > theta_i, else 0
//! ```
//! This is edge reversal on a single edge ([`crate::edge_reversal::smer`]): with x tokens at the flexor, `M_F = (x - r_F + g/2) / r'`, g the greatest
//! common divisor. The half token keeps M off the threshold, where the paper's sgn(0) stops both neurons. Here x is
//! the state and M is derived for display. The word is the Christoffel word of slope r_F/r_E: period (r_F+r_E)/g steps, in which the
//! flexor fires r_E/g times and the extensor r_F/g times.
//!
//! Only whole multiples of g move, so x is a multiple of g in every state, and M_F lies on a lattice of step g/r' whose points nearest to the
//! threshold are `-g/(2r')` and `+g/(2r')`. A start or a change is rounded to the lattice:
//! - [`Obb::from_potential`] takes `x = r_F + g floor((r' M - 1/2) / g)`, the step of the lattice in which `r' M - 1/2` lies. In units of 1/r' the
//!   potential is moved by less than (g + 1)/2. A potential that is half a unit or more above the threshold stays above it, one at the threshold or
//!   below it is below it.
//! - [`Obb::set`] takes the largest multiple of the new g up to x, so the neuron that x makes active is active.
//!
//! Corrected errors of the paper: by eq 1 neuron i is active for r_j/(r_i+r_j) of the time, so that the neuron that is on for
//! 15 of 18 s is the one with reversibility 1, which the paper's Table 1 calls the flexor and its text the extensor (for a slow gait
//! give the extensor 1: [`Obb::for_extensor_duty`]); the text's W_ij is transposed against eq 1; its "new" threshold rule deadlocks;
//! its floating-point states drift.

use crate::edge_reversal::smer::{MAX_REVERSIBILITY, gcd};

/// The initial potential of the flexor in the paper's Table 1.
pub const PAPER_POTENTIAL: f32 = 0.35;

/// Which neuron fires in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neuron {
    /// The flexor.
    Flexor,
    /// The extensor.
    Extensor,
}

impl Neuron {
    /// `F` or `E`, as in a firing word.
    #[must_use]
    pub const fn letter(self) -> char {
        match self {
            Neuron::Flexor => 'F',
            Neuron::Extensor => 'E',
        }
    }
}

/// Why a pair was refused: the field and its allowed range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ObbError {
    /// `flexor` or `extensor`: 1 to [`MAX_REVERSIBILITY`].
    Reversibility {
        /// Name of the field.
        field: &'static str,
    },
    /// `potential`: finite, -10 to 10.
    Potential,
}

impl core::fmt::Display for ObbError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            ObbError::Reversibility { field } => {
                write!(f, "reversibility of the {field}: 1 to {MAX_REVERSIBILITY} is allowed")
            }
            ObbError::Potential => write!(f, "potential: a finite number from -10 to 10 is allowed"),
        }
    }
}

impl core::error::Error for ObbError {}

/// The reversibilities of the two neurons.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reversibilities {
    flexor: u32,
    extensor: u32,
}

impl Reversibilities {
    /// Each 1 to [`MAX_REVERSIBILITY`].
    ///
    /// # Errors
    /// The neuron whose reversibility is out of range.
    pub const fn new(flexor: u32, extensor: u32) -> Result<Self, ObbError> {
        if flexor == 0 || flexor > MAX_REVERSIBILITY {
            return Err(ObbError::Reversibility { field: "flexor" });
        }
        if extensor == 0 || extensor > MAX_REVERSIBILITY {
            return Err(ObbError::Reversibility { field: "extensor" });
        }
        Ok(Self { flexor, extensor })
    }

    /// Steps of one period.
    #[must_use]
    pub const fn period(self) -> u32 {
        match (self.flexor + self.extensor).checked_div(self.lattice()) {
            Some(period) => period,
            None => 0,
        }
    }

    /// Share of the time that the extensor is active (the duty factor of the stance): `r_F / (r_F + r_E)`.
    #[must_use]
    pub const fn extensor_duty(self) -> f32 {
        self.flexor as f32 / (self.flexor + self.extensor) as f32
    }

    /// g, the step of the tokens.
    const fn lattice(self) -> u32 {
        gcd(self.flexor, self.extensor)
    }

    /// The largest multiple of g up to this many tokens.
    const fn on_lattice(self, tokens: i32) -> i32 {
        match tokens.checked_rem_euclid(self.lattice() as i32) {
            Some(rest) => tokens.saturating_sub(rest),
            None => tokens,
        }
    }

    /// The power of ten above both: the scale r' of eq 1.
    const fn scale(self) -> u32 {
        let largest = if self.flexor > self.extensor { self.flexor } else { self.extensor };
        let mut scale = 10;
        while scale <= largest {
            scale *= 10;
        }
        scale
    }
}

/// One building block: the reversibilities and the tokens at the flexor.
///
/// ```
/// use cpg_core::edge_reversal::obb::{Obb, Reversibilities};
/// let mut obb = Obb::from_potential(Reversibilities::new(1, 5)?, 0.35)?;
/// let word: String = (0..17).map(|_| obb.step().letter()).collect();
/// assert_eq!(word, "FFFFEFFFFFEFFFFFE");
/// # Ok::<(), cpg_core::edge_reversal::obb::ObbError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Obb {
    reversibilities: Reversibilities,
    /// Tokens at the flexor, a multiple of g: 0 to f, except during the transient after a start or a change.
    flexor_tokens: i32,
}

impl Obb {
    /// Starts with all f tokens at the flexor: the word is the Christoffel word from its first letter.
    #[must_use]
    pub const fn new(reversibilities: Reversibilities) -> Self {
        let Reversibilities { flexor, extensor } = reversibilities;
        Self { reversibilities, flexor_tokens: (flexor + extensor - reversibilities.lattice()) as i32 }
    }

    /// Starts at a membrane potential of the flexor, as the paper does, rounded to the lattice (see the module); a potential outside the
    /// cycle's range gives a transient.
    ///
    /// ```
    /// use cpg_core::edge_reversal::obb::{Obb, Reversibilities};
    /// // g = 9: the lattice has the step 0.9, and 0.35 becomes 0.45.
    /// let obb = Obb::from_potential(Reversibilities::new(9, 9)?, 0.35)?;
    /// assert_eq!(obb.potentials(), (0.45, 0.55));
    /// # Ok::<(), cpg_core::edge_reversal::obb::ObbError>(())
    /// ```
    ///
    /// # Errors
    /// [`ObbError::Potential`] if it is not finite or beyond ±10.
    pub fn from_potential(reversibilities: Reversibilities, flexor: f32) -> Result<Self, ObbError> {
        if !(-10.0..=10.0).contains(&flexor) {
            return Err(ObbError::Potential);
        }
        let tokens = flexor * reversibilities.scale() as f32 + reversibilities.flexor as f32 - 0.5;
        // Rounded down to a whole token: the cast rounds towards zero.
        let cut = tokens as i32;
        let whole = if (cut as f32) > tokens { cut.saturating_sub(1) } else { cut };
        Ok(Self { reversibilities, flexor_tokens: reversibilities.on_lattice(whole) })
    }

    /// Reversibilities for a wanted duty factor of the extensor (stance), `on / (on + off)`.
    ///
    /// # Errors
    /// As [`Reversibilities::new`].
    pub const fn for_extensor_duty(on: u32, off: u32) -> Result<Reversibilities, ObbError> {
        Reversibilities::new(on, off)
    }

    /// The neuron that fires in the next step.
    #[must_use]
    pub const fn active(&self) -> Neuron {
        if self.flexor_tokens >= self.reversibilities.flexor as i32 { Neuron::Flexor } else { Neuron::Extensor }
    }

    /// One step: the active neuron fires and gives its tokens to the other.
    pub const fn step(&mut self) -> Neuron {
        let active = self.active();
        self.flexor_tokens = match active {
            Neuron::Flexor => self.flexor_tokens.saturating_sub(self.reversibilities.flexor as i32),
            Neuron::Extensor => self.flexor_tokens.saturating_add(self.reversibilities.extensor as i32),
        };
        active
    }

    /// Changes the gait at any step; the charge (the tokens) stays, rounded down to a multiple of the new g, so the next period already has
    /// the new length and [`Obb::potentials`] agree with it.
    pub const fn set(&mut self, reversibilities: Reversibilities) {
        self.flexor_tokens = reversibilities.on_lattice(self.flexor_tokens);
        self.reversibilities = reversibilities;
    }

    /// The current reversibilities.
    #[must_use]
    pub const fn reversibilities(&self) -> Reversibilities {
        self.reversibilities
    }

    /// Membrane potentials (M_F, M_E) of eq 1, for display; their sum is 1. The neuron that fires next is the one above its threshold: M_F
    /// above 0 or M_E above 1. With a reversibility of [`MAX_REVERSIBILITY`] itself, M_E can be so near to 1 that `f32` shows 1.
    #[must_use]
    pub const fn potentials(&self) -> (f32, f32) {
        let half_token = self.reversibilities.lattice() as f32 / 2.0;
        let above = self.flexor_tokens.saturating_sub(self.reversibilities.flexor as i32) as f32 + half_token;
        let m = above / self.reversibilities.scale() as f32;
        (m, 1.0 - m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge_reversal::smer::{Edge, Smer};

    fn pair(flexor: u32, extensor: u32) -> Reversibilities {
        Reversibilities::new(flexor, extensor).unwrap()
    }

    fn word(obb: &mut Obb, steps: usize) -> String {
        (0..steps).map(|_| obb.step().letter()).collect()
    }

    #[test]
    fn literal_sequences_of_the_paper() {
        for (r, start, cycle) in [((1, 5), "FFFFE", "FFFFFE"), ((1, 3), "FFFFE", "FFFE"), ((1, 1), "FFFFE", "FE")] {
            let mut obb = Obb::from_potential(pair(r.0, r.1), PAPER_POTENTIAL).unwrap();
            let want = start.to_string() + &cycle.repeat(20);
            assert_eq!(word(&mut obb, want.len()), want);
        }
    }

    /// (1,5) to (1,3) at step 54 to (1,1) at step 100: letter for letter, with the potentials at the changes.
    #[test]
    fn transitions_letter_for_letter() {
        let mut obb = Obb::from_potential(pair(1, 5), PAPER_POTENTIAL).unwrap();
        assert_eq!(word(&mut obb, 54), format!("FFFFE{}F", "FFFFFE".repeat(8)));
        obb.set(pair(1, 3));
        assert!((obb.potentials().0 - 0.35).abs() < 1e-6);
        assert_eq!(word(&mut obb, 46), format!("FFFFE{}F", "FFFE".repeat(10)));
        obb.set(pair(1, 1));
        assert!((obb.potentials().0 - 0.15).abs() < 1e-6);
        assert_eq!(word(&mut obb, 40), format!("FFE{}F", "FE".repeat(18)));
    }

    /// From every residue of the charge: steps until the sequence has the new period.
    #[test]
    fn worst_transients_of_a_change() {
        let transient = |from: (u32, u32), to: (u32, u32), tokens: i32| {
            let mut obb = Obb { reversibilities: pair(from.0, from.1), flexor_tokens: tokens };
            obb.set(pair(to.0, to.1));
            let period = obb.reversibilities().period() as usize;
            let letters = word(&mut obb, 60);
            let letters = letters.as_bytes();
            (0..40).find(|&k| (k..60 - period).all(|i| letters[i] == letters[i + period])).unwrap()
        };
        let worst = |from: (u32, u32), to| (0..(from.0 + from.1) as i32).map(|x| transient(from, to, x)).max().unwrap();
        assert_eq!(worst((1, 5), (1, 3)), 2);
        assert_eq!(worst((1, 3), (1, 1)), 2);
        assert_eq!(worst((1, 5), (1, 1)), 4);
        for (from, to) in [((1, 1), (1, 3)), ((1, 1), (1, 5)), ((1, 3), (1, 5))] {
            assert_eq!(worst(from, to), 0);
        }
    }

    #[test]
    fn christoffel_words_and_their_counts() {
        for (r, cycle) in [
            ((1, 3), "FFFE"),
            ((1, 5), "FFFFFE"),
            ((2, 3), "FFEFE"),
            ((3, 2), "FEFEE"),
            ((3, 5), "FFEFFEFE"),
            ((2, 4), "FFE"),
            ((4, 6), "FFEFE"),
        ] {
            let mut obb = Obb::new(pair(r.0, r.1));
            assert_eq!(word(&mut obb, 3 * cycle.len()), cycle.repeat(3), "{r:?}");
            assert_eq!(obb.reversibilities().period() as usize, cycle.len());
        }
        assert_eq!(pair(77, 463).period(), 540);
        assert!((Obb::for_extensor_duty(5, 1).unwrap().extensor_duty() - 5.0 / 6.0).abs() < 1e-7);
    }

    #[test]
    fn equals_edge_reversal_on_one_edge() {
        for (rf, re) in [(1, 5), (2, 3), (4, 6), (7, 3), (12, 30)] {
            let mut obb = Obb::new(pair(rf, re));
            let edge = Edge { a: 0, b: 1, tokens_at_a: obb.flexor_tokens as u32 };
            let mut smer = Smer::new([rf, re], [edge]).unwrap();
            for _ in 0..1000 {
                assert_eq!(obb.step() == Neuron::Flexor, smer.step().contains(0));
                assert_eq!(obb.flexor_tokens as u32, smer.edges()[0].tokens_at_a);
            }
        }
    }

    /// The derived potentials obey eq 1, and their signs say which neuron fires.
    #[test]
    fn potentials_obey_equation_one() {
        let mut obb = Obb::from_potential(pair(3, 5), PAPER_POTENTIAL).unwrap();
        for _ in 0..100 {
            let (m, m_e) = obb.potentials();
            let fired = obb.step();
            let change = if fired == Neuron::Flexor { -0.3 } else { 0.5 };
            assert!((obb.potentials().0 - (m + change)).abs() < 1e-6);
            assert_eq!(fired == Neuron::Flexor, m > 0.0);
            assert_eq!(fired == Neuron::Extensor, m_e > 1.0);
        }
    }

    #[test]
    fn ten_million_steps_do_not_drift() {
        let mut obb = Obb::from_potential(pair(1, 5), PAPER_POTENTIAL).unwrap();
        let mut flexor = 0u32;
        for _ in 0..10_000_000 {
            flexor += u32::from(obb.step() == Neuron::Flexor);
        }
        // 4 letters of the short first burst, then five of every six.
        assert_eq!(flexor, 4 + (10_000_000 - 5) / 6 * 5 + (10_000_000 - 5) % 6);
    }

    #[test]
    fn bad_fields_are_named() {
        assert_eq!(Reversibilities::new(0, 1), Err(ObbError::Reversibility { field: "flexor" }));
        assert_eq!(Reversibilities::new(1, 0), Err(ObbError::Reversibility { field: "extensor" }));
        assert_eq!(Reversibilities::new(1, u32::MAX), Err(ObbError::Reversibility { field: "extensor" }));
        for potential in [f32::NAN, f32::INFINITY, -10.5] {
            assert_eq!(Obb::from_potential(pair(1, 5), potential), Err(ObbError::Potential));
        }
    }
}
