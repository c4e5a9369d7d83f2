//! Names of markers with the name of their subject in front: `Anna:LKNE`.

use crate::format::segments;

/// The names of the subjects whose points give a leg.
pub(crate) fn with_legs<'a>(labels: &[&'a str]) -> Vec<&'a str> {
    let subject = |label: &str| label.rsplit_once(':').map(|(subject, _)| subject.len());
    let mut subjects: Vec<&str> = labels.iter().filter_map(|label| label.get(..subject(label)?)).collect();
    subjects.sort_unstable();
    subjects.dedup();
    let has_leg = |wanted: &&str| {
        let own = |label: &str| label.get(..wanted.len()) == Some(wanted) && subject(label) == Some(wanted.len());
        let names: Vec<&str> = labels.iter().map(|label| if own(label) { bare(label) } else { "" }).collect();
        segments::find(&names).iter().any(Option::is_some)
    };
    subjects.retain(has_leg);
    subjects
}

/// A label without the subject's name: `Anna:LKNE` gives `LKNE`.
pub(crate) fn bare(label: &str) -> &str {
    label.rsplit(':').next().unwrap_or(label)
}
