//! An oscillatory building block stepped through changes of its reversibilities, and its charts.

use cpg_core::edge_reversal::obb::{Obb, Reversibilities};
use picture::{Bars, Curve, Panel};

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
