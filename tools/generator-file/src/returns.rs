//! Whether a generator comes back to its orbit: from kicks of at least half an amplitude, and from random states.
//!
//! A kick changes one state by half its amplitude up or down, at each of [`KICK_PHASES`] phases; or every state at random, the largest
//! change between half an amplitude and a whole one. It is back when its distance from the orbit is a tenth of the
//! first, and stays so for two periods.

use rayon::prelude::*;
use serde::Serialize;

use crate::file::GeneratorSet;
use crate::model::Model;
use crate::orbit::{Motion, Orbit};
use crate::random::Random;
use crate::status::{CertificateStatus, Verdict};
use crate::subject::{Settled, Subject};

/// Largest size of a non-trivial Floquet multiplier of an accepted generator, a stride.
pub const LARGEST_MULTIPLIER: f64 = 0.95;
/// Smallest share of the random starts that arrive.
pub const ARRIVING_SHARE: f64 = 0.95;

/// Phases at which every state is kicked.
pub const KICK_PHASES: u32 = 16;
/// Size of a kick of one state, in its amplitudes.
pub const KICK: f64 = 0.5;
/// Kicks of all states at random.
pub const RANDOM_KICKS: u32 = 48;
/// Strides within which a kick has to be back.
pub const RETURN_STRIDES: u32 = 100;
/// Part of the first distance that is left of a kick when it is back.
pub const LEFT: f64 = 0.1;
/// Strides within which a random start has to arrive: the slowest orbit that is accepted needs 45 for a tenth, and from near rest it
/// gains its amplitude at half that rate.
pub const START_STRIDES: u32 = 200;
/// Distance from the orbit at which a random start has arrived, in amplitudes.
pub const ARRIVED: f64 = 0.05;
/// Largest size of a random start, in amplitudes.
pub const START_BOX: f64 = 1.5;
/// Periods for which it has to stay there.
const STAYS: u32 = 2;
/// Checks of the distance in a period, after a kick.
const CHECKS: f64 = 40.0;
/// Lost kicks after which no more are counted.
const ENOUGH_LOST: usize = 20;
/// Kicks that are tried side by side.
const KICKS_AT_A_TIME: usize = 8;

/// The orbit of a generator, and whether it comes back to it.
#[derive(Debug, Clone, Serialize)]
pub struct Return {
    /// Whether it settles on an oscillation.
    pub oscillates: bool,
    /// Whether that is quasi-periodic: it may run, but it does not repeat.
    pub quasi_periodic: bool,
    /// Period on the orbit, seconds; null without one.
    pub period_s: f64,
    /// Sizes of the Floquet multipliers without the trivial one, largest first.
    pub multipliers: Vec<f64>,
    /// Kicks that were tried; 0 if the only state is a phase, because every state is then on the orbit, and if a multiplier is too large.
    pub kicks: u32,
    /// Those that do not come back; no more than 20 are sought.
    pub kicks_lost: Vec<Lost>,
    /// Settling time, seconds: the worst of all kicks; none if one is lost.
    pub settling_s: Option<f64>,
    /// Random starts that were tried; 0 as for the kicks.
    pub starts: u32,
    /// Those that arrive at the orbit.
    pub converged: u32,
    /// Those of which a state reaches its bound.
    pub diverged: u32,
    /// The first condition that is not met, and why.
    #[serde(skip)]
    verdict: Option<Verdict>,
}

impl Default for Return {
    fn default() -> Self {
        Self {
            oscillates: false,
            quasi_periodic: false,
            period_s: f64::NAN,
            multipliers: vec![],
            kicks: 0,
            kicks_lost: vec![],
            settling_s: None,
            starts: 0,
            converged: 0,
            diverged: 0,
            verdict: None,
        }
    }
}

/// Measures whether the set of a generator file comes back to its orbit, without motion and limits.
///
/// # Errors
/// It does not, or cannot be built; the text says why.
pub fn comes_back(set: &GeneratorSet, starts: u32) -> Result<Return, String> {
    let Some(settled) = Subject::Set(set.clone()).motion()? else { return Ok(Return::default()) };
    let found = Return::until_refused(&settled, starts);
    match &found.verdict {
        Some(verdict) => Err(in_words(verdict)),
        None => Ok(found),
    }
}

/// A verdict in one sentence.
pub(crate) fn in_words((status, why): &Verdict) -> String {
    match why {
        Some(why) => format!("{}: {why}", status.words()),
        None => status.words().into(),
    }
}

impl Return {
    /// All measurements.
    pub(crate) fn of(settled: &Settled, starts: u32, progress: &mut dyn FnMut(&str)) -> Self {
        Self::measured(settled, starts, true, progress)
    }

    /// Without the random starts if kicks are lost: the verdict is that of all measurements.
    fn until_refused(settled: &Settled, starts: u32) -> Self {
        Self::measured(settled, starts, false, &mut |_| ())
    }

    fn measured(settled: &Settled, starts: u32, all: bool, progress: &mut dyn FnMut(&str)) -> Self {
        let mut found = Self {
            quasi_periodic: matches!(settled.motion, Motion::QuasiPeriodic),
            oscillates: matches!(settled.motion, Motion::QuasiPeriodic | Motion::Periodic(_)),
            ..Self::default()
        };
        let (model, orbit) = match &settled.motion {
            Motion::Periodic(orbit) => (settled.model.as_ref(), orbit),
            other => {
                let status = match other {
                    Motion::Still => CertificateStatus::DoesNotOscillate,
                    Motion::QuasiPeriodic => CertificateStatus::QuasiPeriodic,
                    _ => CertificateStatus::Irregular,
                };
                found.verdict = Some((status, None));
                return found;
            }
        };
        found.period_s = orbit.period_s;
        found.multipliers.clone_from(&orbit.multipliers);
        found.verdict = found.does_not_contract();
        if found.verdict.is_some() {
            // What does not come back from a small difference does not come back from a kick.
            return found;
        }
        progress("kicks");
        let kicked = kicks(model, orbit);
        found.kicks = kicked.tried;
        found.settling_s = kicked.lost.is_empty().then_some(kicked.settling / orbit.steps * orbit.period_s);
        found.kicks_lost = kicked.lost;
        found.verdict = found.loses_kicks();
        if found.verdict.is_some() && !all {
            return found;
        }
        progress("random starts");
        let scattered = scatter(model, orbit, starts);
        (found.starts, found.converged, found.diverged) = (starts, scattered.arrived, scattered.at_bound);
        if found.verdict.is_none() {
            found.verdict = found.loses_starts();
        }
        found
    }

    /// The first condition that is not met.
    pub(crate) fn verdict(&self) -> Option<Verdict> {
        self.verdict.clone()
    }

    fn does_not_contract(&self) -> Option<Verdict> {
        let largest = self.multipliers.first().copied().unwrap_or(0.0);
        (largest.is_nan() || largest >= LARGEST_MULTIPLIER).then(|| {
            let why = format!(
                "the largest Floquet multiplier without the trivial one is {largest:.4} a stride; allowed is less than {LARGEST_MULTIPLIER}"
            );
            (CertificateStatus::DoesNotContract, Some(why))
        })
    }

    fn loses_kicks(&self) -> Option<Verdict> {
        let Lost { kick, first: from, last, at_bound, .. } = self.kicks_lost.first()?;
        let end = match at_bound {
            true => "a state reaches its bound".to_string(),
            false => format!("{last:.2} after {RETURN_STRIDES} strides"),
        };
        let why = format!(
            "{} of {}, the first is {kick}: {from:.2} amplitudes from the orbit, {end}",
            self.kicks_lost.len(),
            self.kicks
        );
        Some((CertificateStatus::KicksDoNotReturn, Some(why)))
    }

    fn loses_starts(&self) -> Option<Verdict> {
        let needed = (ARRIVING_SHARE * f64::from(self.starts)).ceil();
        (f64::from(self.converged) < needed).then(|| {
            let why = format!(
                "{} of {} within {START_STRIDES} strides; allowed is {needed:.0} or more",
                self.converged, self.starts
            );
            (CertificateStatus::FewStartsArrive, Some(why))
        })
    }
}

/// A kick that does not come back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lost {
    /// The kick in words: the state, and the phase.
    pub kick: String,
    /// Its initial state, in amplitudes of the orbit.
    pub state: Vec<f64>,
    /// Its distance from the orbit at the beginning.
    pub first: f64,
    /// Its distance in the end.
    pub last: f64,
    /// A state reaches its bound, which is a fault on a board.
    pub at_bound: bool,
}

/// What became of the kicks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kicked {
    /// Kicks that were tried.
    pub(crate) tried: u32,
    /// Those that do not come back.
    pub(crate) lost: Vec<Lost>,
    /// Longest time to come back, in steps.
    pub(crate) settling: f64,
}

/// Kicks every state at every phase, and all at random.
pub(crate) fn kicks(built: &dyn Model, orbit: &Orbit) -> Kicked {
    let n = orbit.dimensions();
    let mut random = Random(8);
    let mut all = Kicked::default();
    // One phase after the other, so that each state has had its turn before too many are lost.
    let single = (0..KICK_PHASES).flat_map(|phase| (0..2 * n).map(move |which| (phase, Some(which))));
    let kicks: Vec<Kick> = single
        .chain((0..RANDOM_KICKS).map(|phase| (phase, None)))
        .map(|(phase, which)| {
            let part = f64::from(phase) / f64::from(if which.is_some() { KICK_PHASES } else { RANDOM_KICKS });
            let mut state = orbit.at(part);
            let mut name = match which {
                Some(which) => {
                    let (index, up) = (which / 2, which % 2 == 0);
                    state[index] += if up { KICK } else { -KICK } * orbit.amplitude[index];
                    format!("{} {}", if up { "+0.5" } else { "-0.5" }, state_name(built, index))
                }
                None => {
                    let by: Vec<f64> = (0..n).map(|_| random.within(1.0)).collect();
                    let most = by.iter().fold(0.0, |most: f64, x| most.max(x.abs())).max(1e-9);
                    let size = (0.75 + random.within(0.25)) / most;
                    state.iter_mut().zip(&by).zip(&orbit.amplitude).for_each(|((x, by), a)| *x += size * by * a);
                    "at random".into()
                }
            };
            name += &format!(" at {:.0} % of the period", 100.0 * part);
            Kick { name, state }
        })
        .collect();
    // A block is tried at a time, so that few kicks are tried after enough are lost.
    for block in kicks.chunks(KICKS_AT_A_TIME) {
        let tried: Vec<Result<f64, Lost>> = block.par_iter().map(|kick| kick.tried(built, orbit)).collect();
        for one in tried {
            all.tried += 1;
            match one {
                Ok(steps) => all.settling = all.settling.max(steps),
                Err(lost) => all.lost.push(lost),
            }
            if all.lost.len() >= ENOUGH_LOST {
                return all;
            }
        }
    }
    all
}

/// A kick, and the state that it leads to.
struct Kick {
    name: String,
    state: Vec<f64>,
}

impl Kick {
    /// Steps until it is back, or why it is lost.
    fn tried(&self, built: &dyn Model, orbit: &Orbit) -> Result<f64, Lost> {
        let mut model = built.copy();
        model.set_state(&self.state);
        let state = model.state();
        let first = orbit.distance(&state);
        // Where a model of the catalogue leaps within a step, its orbit is known no better than that.
        let near = if model.is_double() { LEFT * first } else { (LEFT * first).max(ARRIVED) };
        back(model.as_mut(), orbit, near).map_err(|at_bound| {
            let last = orbit.distance(&model.state());
            let state = state.iter().zip(&orbit.amplitude).map(|(x, a)| x / a).collect();
            Lost { kick: self.name.clone(), state, first, last, at_bound }
        })
    }
}

/// Steps until the distance is below `near` and stays so; an error if that takes more than [`RETURN_STRIDES`], or a state reaches its
/// bound (`true`).
fn back(model: &mut dyn Model, orbit: &Orbit, near: f64) -> Result<f64, bool> {
    let every = ((orbit.steps / CHECKS) as usize).max(1);
    let (all, stays) = (f64::from(RETURN_STRIDES) * orbit.steps, f64::from(STAYS) * orbit.steps);
    let (mut step, mut last_outside) = (0.0, 0.0);
    while step < all + stays {
        if orbit.is_beyond(&model.state(), near) {
            last_outside = step + every as f64;
        } else if step - last_outside > stays {
            return if last_outside <= all { Ok(last_outside) } else { Err(false) };
        }
        if !model.advance(every) {
            return Err(true);
        }
        step += every as f64;
    }
    Err(false)
}

fn state_name(model: &dyn Model, index: usize) -> String {
    // A state of a joint is named `left_hip.velocity`.
    match model.names()[index].split_once('.') {
        Some((joint, state)) => format!("{state} of {joint}"),
        None => format!("state {}", index + 1),
    }
}

/// What became of random starts.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Scattered {
    /// Starts that are on the orbit after [`START_STRIDES`] strides.
    pub(crate) arrived: u32,
    /// Starts of which a state reaches its bound.
    pub(crate) at_bound: u32,
}

/// Starts at random states within [`START_BOX`].
pub(crate) fn scatter(built: &dyn Model, orbit: &Orbit, starts: u32) -> Scattered {
    let mut random = Random(1);
    let mut drawn = || -> Vec<f64> {
        let places = orbit.middle.iter().zip(&orbit.amplitude);
        places.map(|(middle, size)| middle + random.within(START_BOX) * size).collect()
    };
    let states: Vec<Vec<f64>> = (0..starts).map(|_| drawn()).collect();
    let one = |state: &Vec<f64>| {
        let mut model = built.copy();
        model.set_state(state);
        // Checked once a period; on the orbit if it stays for three checks.
        let (mut near, mut sound) = (0, true);
        for _ in 0..START_STRIDES {
            sound = model.advance(orbit.steps.ceil() as usize);
            if !sound {
                break;
            }
            near = if orbit.is_beyond(&model.state(), ARRIVED) { 0 } else { near + 1 };
            if near > STAYS {
                break;
            }
        }
        Scattered { arrived: u32::from(near > STAYS), at_bound: u32::from(!sound) }
    };
    let sum =
        |a: Scattered, b: Scattered| Scattered { arrived: a.arrived + b.arrived, at_bound: a.at_bound + b.at_bound };
    states.par_iter().map(one).reduce(Scattered::default, sum)
}
