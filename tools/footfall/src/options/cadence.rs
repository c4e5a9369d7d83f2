//! A cadence on the command line: steps a minute, or a sweep from one cadence to another.

use cpg_core::gait::named::Gait;
use std::str::FromStr;

use crate::failure::Failure;
use crate::gait_player::Change;
use crate::gait_player::asked_speed::AskedSpeed;

/// Seconds from one change of a sweep to the next.
const STEP_S: f32 = 0.01;

/// `110`, or `100..130`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cadence {
    /// At the beginning, steps a minute.
    pub first: f32,
    /// At the end, steps a minute.
    pub last: f32,
}

impl FromStr for Cadence {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f32>().ok().filter(|steps| steps.is_finite() && *steps > 0.0);
        let (first, last) = text.split_once("..").unwrap_or((text, text));
        match (number(first), number(last)) {
            (Some(first), Some(last)) => Ok(Self { first, last }),
            _ => Err("allowed are steps a minute above 0, as `110`, or two for a sweep, as `100..130`".into()),
        }
    }
}

impl Cadence {
    /// The changes of a sweep over a run of so many seconds; none if it is one cadence.
    ///
    /// # Errors
    /// The gait does not allow the last cadence, or cannot change it in every tick; or there are other changes (`switch`).
    pub fn sweep(self, gait: Gait, secs: f32, switch: &[String]) -> Result<Vec<(f32, Change)>, Failure> {
        let Self { first, last } = self;
        AskedSpeed::Cadence(last).allow(gait)?;
        if first == last {
            return Ok(vec![]);
        }
        let text = format!("--cadence {first}..{last}");
        if !matches!(gait, Gait::Human(_) | Gait::NaturalWalk) {
            let sweeps = Gait::ALL.into_iter().filter(|gait| matches!(gait, Gait::Human(_) | Gait::NaturalWalk));
            let sweeps: Vec<&str> = sweeps.map(Gait::name).collect();
            let name = gait.name();
            return Err(Failure::input(format!(
                "{text} with --gait {name}: allowed is one cadence, or a sweep with one of {}",
                sweeps.join(", ")
            )));
        }
        if let Some(other) = switch.first() {
            return Err(Failure::input(format!(
                "{text} with --switch `{other}`: allowed is one cadence with --switch, or a sweep without"
            )));
        }
        let count = (secs / STEP_S) as u32;
        let change = |n: u32| {
            let part = n as f32 / count.max(1) as f32;
            (n as f32 * STEP_S, Change::Speed(AskedSpeed::Cadence(first + part * (last - first))))
        };
        Ok((1..=count).map(change).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cadence_is_one_number_or_two() {
        assert_eq!("110".parse(), Ok(Cadence { first: 110.0, last: 110.0 }));
        assert_eq!("130..100.5".parse(), Ok(Cadence { first: 130.0, last: 100.5 }));
        for bad in ["", "..", "90..", "..130", "0", "-5", "nan", "inf", "90-130", "90..100..130", "fast"] {
            let error = bad.parse::<Cadence>().unwrap_err();
            assert!(error.contains("allowed"), "{bad}: {error}");
        }
    }

    #[test]
    fn a_sweep_ends_at_its_last_cadence() {
        let walk = Gait::from_name("human-walk").unwrap();
        let changes = Cadence { first: 100.0, last: 130.0 }.sweep(walk, 3.0, &[]).unwrap();
        assert_eq!(changes.last(), Some(&(3.0, Change::Speed(AskedSpeed::Cadence(130.0)))));
        assert_eq!(changes.len(), 300);
        assert_eq!(Cadence { first: 110.0, last: 110.0 }.sweep(Gait::Walk, 3.0, &[]).unwrap(), []);
    }

    #[test]
    fn a_sweep_is_refused_where_it_is_not_possible() {
        let sweep = |gait, first, last, switch: &[String]| {
            Cadence { first, last }.sweep(gait, 3.0, switch).unwrap_err().to_string()
        };
        let walk = Gait::from_name("human-walk").unwrap();
        assert!(sweep(walk, 100.0, 150.0, &[]).contains("cadence = 150: must be from 98.4 to 131"));
        assert!(sweep(Gait::Walk, 100.0, 120.0, &[]).contains("allowed is one cadence"));
        // The message is about the cadence that was written, not about one on the way to it.
        assert!(
            sweep(Gait::NaturalWalk, 100.0, 130.0, &[]).starts_with("cadence = 130: left_knee of natural-walk would")
        );
        assert!(sweep(walk, 100.0, 120.0, &["t=1 stop".into()]).contains("allowed is one cadence with --switch"));
    }
}
