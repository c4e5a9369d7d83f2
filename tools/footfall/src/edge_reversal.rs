//! Steps the edge-reversal networks of Yang et al. 2014 through changes of their reversibilities, and charts the result; judges networks on
//! any graph.

pub mod liveness;
pub mod network;

use cpg_core::edge_reversal::hexapod::{Hexapod, Leg, Orientation, Swings};
use cpg_core::edge_reversal::ladder::Circulation;
use cpg_core::edge_reversal::obb::{Obb, Reversibilities};

use crate::failure::Failure;
use crate::file::svg::{Bars, Curve, Panel};

/// An oscillatory building block stepped through changes.
pub struct BlockRun {
    /// One letter a step: F flexor, E extensor.
    pub word: String,
    /// Potentials of flexor and extensor at the beginning of each step; empty unless `drawn`.
    potentials: Vec<[f64; 2]>,
    /// Period at each step, in steps; empty unless `drawn`.
    periods: Vec<u32>,
    /// Potential of the flexor at the start and after each change, before the step.
    pub starts: Vec<f32>,
    /// The block after the last step.
    pub obb: Obb,
}

impl BlockRun {
    /// Steps a block; `switches` are steps and the reversibilities from then on, `drawn` keeps what charts need.
    #[must_use]
    pub fn of(mut obb: Obb, switches: &[(u64, Reversibilities)], steps: u64, drawn: bool) -> Self {
        let starts = vec![obb.potentials().0];
        let mut run = Self { word: String::new(), potentials: vec![], periods: vec![], starts, obb };
        let mut switches = switches.iter().copied().peekable();
        for step in 0..steps {
            while let Some((_, to)) = switches.next_if(|(at, _)| *at == step) {
                obb.set(to);
                run.starts.push(obb.potentials().0);
            }
            let (flexor, extensor) = obb.potentials();
            if drawn {
                run.potentials.push([f64::from(flexor), f64::from(extensor)]);
                run.periods.push(obb.reversibilities().period());
            }
            run.word.push(obb.step().letter());
        }
        run.obb = obb;
        run
    }

    /// Chart of the membrane potentials, as a staircase.
    #[must_use]
    pub fn potentials(&self, step_s: f64, marks: &[(f64, String)]) -> Panel {
        let curve = |name, neuron: usize| {
            let held = self.potentials.iter().enumerate();
            let points = held.flat_map(|(step, m)| [step, step + 1].map(|at| (at as f64 * step_s, m[neuron])));
            Curve::new(name, points.collect())
        };
        let curves = vec![curve("flexor", 0), curve("extensor", 1)];
        Panel::curves("membrane potentials", "time, s", "potential M", curves).marked(marks)
    }

    /// Chart of the steps at which each neuron fires.
    #[must_use]
    pub fn outputs(&self, step_s: f64, marks: &[(f64, String)]) -> Panel {
        let row = |name: &str, letter: char| {
            let on = self.word.chars().enumerate().filter(|(_, fired)| *fired == letter);
            let spans = on.map(|(step, _)| (step as f64 * step_s, (step + 1) as f64 * step_s));
            Bars { name: name.into(), spans: spans.collect() }
        };
        let rows = vec![row("flexor", 'F'), row("extensor", 'E')];
        Panel::bars("outputs: on where a bar is", "time, s", "", rows).marked(marks)
    }

    /// Chart of the duty factor: the share of the last period in which each neuron fired.
    #[must_use]
    pub fn duty(&self, step_s: f64, marks: &[(f64, String)]) -> Panel {
        let letters: Vec<char> = self.word.chars().collect();
        let curve = |name, letter: char| {
            let ends = (1..=letters.len()).filter(|&end| end >= self.periods[end - 1] as usize);
            let points = ends.map(|end| {
                let last = &letters[end - self.periods[end - 1] as usize..end];
                let on = last.iter().filter(|fired| **fired == letter).count();
                (end as f64 * step_s, on as f64 / last.len() as f64)
            });
            Curve::new(name, points.collect())
        };
        let curves = vec![curve("flexor", 'F'), curve("extensor", 'E')];
        Panel::curves("duty over the last period", "time, s", "duty factor", curves).marked(marks)
    }
}

/// The legs of a hexapod that swing at each step.
///
/// # Errors
/// A reversibility is out of range.
pub fn swings(hexapod: &mut Hexapod, switches: &[(u64, u32)], steps: u64) -> Result<Vec<Swings>, Failure> {
    let mut switches = switches.iter().peekable();
    let mut all = vec![];
    for step in 0..steps {
        while let Some((_, to)) = switches.next_if(|(at, _)| *at == step) {
            hexapod.set_reversibility(*to).map_err(Failure::run)?;
        }
        all.push(hexapod.step());
    }
    Ok(all)
}

/// A live orientation of the hexapod and the gait into which it leads.
pub struct LadderGait {
    /// The start.
    pub orientation: Orientation,
    /// Its class.
    pub circulation: Circulation,
    /// Steps before the gait repeats.
    pub transient: u32,
    /// The steps of a period, beginning with that in which the top left leg swings.
    pub period: Vec<Swings>,
}

impl LadderGait {
    /// All 98, found by running each to its repeated state.
    ///
    /// # Errors
    /// The reversibility is out of range, or a state is not repeated within the steps that the core looks at.
    pub fn all(reversibility: u32) -> Result<Vec<Self>, Failure> {
        Orientation::live().map(|orientation| Self::of(reversibility, orientation)).collect()
    }

    fn of(reversibility: u32, orientation: Orientation) -> Result<Self, Failure> {
        let mut hexapod = Hexapod::with_orientation(reversibility, orientation).map_err(Failure::input)?;
        let cycle = hexapod.graph().cycle().map_err(Failure::run)?;
        for _ in 0..cycle.transient {
            hexapod.step();
        }
        let mut period: Vec<Swings> = (0..cycle.period).map(|_| hexapod.step()).collect();
        let first = period.iter().position(|swings| swings.contains(Leg::TopLeft)).unwrap_or(0);
        period.rotate_left(first);
        Ok(Self { orientation, circulation: orientation.circulation(), transient: cycle.transient, period })
    }
}

/// The step diagram of a hexapod: a bar where a leg swings, a mark at each change of the reversibility.
#[must_use]
pub fn step_diagram(steps: &[Swings], switches: &[(u64, u32)]) -> Panel {
    let row = |leg: Leg| {
        let swings = steps.iter().enumerate().filter(|(_, swings)| swings.contains(leg));
        Bars { name: leg.name().into(), spans: swings.map(|(step, _)| (step as f64, step as f64 + 1.0)).collect() }
    };
    let inside = switches.iter().filter(|(at, _)| *at < steps.len() as u64);
    let marks: Vec<(f64, String)> = inside.map(|(at, to)| (*at as f64, format!("R = {to}"))).collect();
    let title = "a bar where the leg swings; between them it stands";
    Panel::bars(title, "step", "leg", Leg::ALL.map(row).to_vec()).marked(&marks)
}
