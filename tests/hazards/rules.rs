//! What an entry of `hazards.toml` must have, and what it must not have, by its status.

use crate::entry::{Hazard, Hazards, Place, Status};
use crate::named::place_of;

/// Units of what was measured.
const UNITS: [&str; 6] = [" us", " ms", " s", " h", " ticks", " V"];

/// Every rule that the file does not keep to, a line each.
pub(crate) fn violations(hazards: &Hazards) -> Vec<String> {
    let mut found = numbers(hazards);
    for hazard in &hazards.list {
        found.extend(entry(hazard).into_iter().map(|fault| format!("{}: {fault}", hazard.id)));
    }
    found
}

/// The numbers count from 1 without a gap.
fn numbers(hazards: &Hazards) -> Vec<String> {
    let mut found = Vec::new();
    let mut last = 0;
    for hazard in &hazards.list {
        if hazard.id.0 != last + 1 {
            found
                .push(format!("{}: the number before it is H{last:02}; allowed is the next one, each once", hazard.id));
        }
        last = hazard.id.0;
    }
    found
}

/// Text for a cell of a table.
fn is_line(text: &str) -> bool {
    !text.trim().is_empty() && text.trim() == text && !text.contains(['\n', '|'])
}

fn entry(hazard: &Hazard) -> Vec<String> {
    let mut found = Vec::new();
    let mut texts = vec![("cause", &hazard.cause), ("effect", &hazard.effect)];
    let optional = [
        ("detection", &hazard.detection),
        ("reaction", &hazard.reaction),
        ("measured", &hazard.measured),
        ("missing", &hazard.missing),
        ("why", &hazard.why),
    ];
    texts.extend(optional.iter().filter_map(|(key, text)| text.as_ref().map(|text| (*key, text))));
    let broken = texts.iter().filter(|(_, text)| !is_line(text));
    found.extend(broken.map(|(key, _)| format!("`{key}` is no single line of text; a vertical bar is not allowed")));

    let present = [
        ("detection", hazard.detection.is_some()),
        ("reaction", hazard.reaction.is_some()),
        ("limit_ms", hazard.limit_ms.is_some()),
        ("longest_ms", hazard.longest_ms.is_some()),
        ("shown", !hazard.shown.is_empty()),
        ("tests", !hazard.tests.is_empty()),
        ("measured", hazard.measured.is_some()),
        ("missing", hazard.missing.is_some()),
        ("why", hazard.why.is_some()),
        ("bench", hazard.bench.is_some()),
    ];
    let (needed, refused): (&[&str], &[&str]) = match hazard.status {
        Status::Shown => (&["detection", "reaction", "shown", "tests"], &["missing", "why"]),
        Status::Partly => (&["reaction", "missing"], &["why"]),
        Status::Open => (&["missing"], &["limit_ms", "longest_ms", "shown", "tests", "measured", "why"]),
        Status::DoesNotApply => (
            &["why"],
            &["detection", "reaction", "limit_ms", "longest_ms", "shown", "tests", "measured", "missing", "bench"],
        ),
    };
    for (key, is_there) in present {
        let status = hazard.status.name();
        if needed.contains(&key) && !is_there {
            found.push(format!("with the status \"{status}\" it needs `{key}`"));
        }
        if refused.contains(&key) && is_there {
            found.push(format!("with the status \"{status}\" it has no `{key}`"));
        }
    }

    if hazard.status != Status::DoesNotApply && hazard.tests.is_empty() && hazard.bench.is_none() {
        found.push("it has neither `tests` nor a procedure `bench`".to_owned());
    }
    found.extend(places(hazard));
    if hazard.limit_ms.is_some_and(|limit| !limit.is_finite() || limit <= 0.0) {
        found.push("`limit_ms` is not above 0".to_owned());
    }
    match (hazard.limit_ms, hazard.longest_ms) {
        (Some(limit), Some(longest)) if !(0.0..=limit).contains(&longest) => {
            found.push(format!("`longest_ms` is {longest}; allowed are 0 to `limit_ms`, {limit}"));
        }
        (Some(_), None) => {
            found.push("it has `limit_ms` and needs `longest_ms`, the longest that was measured".to_owned())
        }
        (None, Some(_)) => found.push("`longest_ms` needs `limit_ms`".to_owned()),
        _ => {}
    }
    let has_unit =
        |text: &String| text.contains(|c: char| c.is_ascii_digit()) && UNITS.iter().any(|u| text.contains(u));
    if hazard.measured.as_ref().is_some_and(|text| hazard.tests.is_empty() || !has_unit(text)) {
        found.push(format!("`measured` needs a test, a number and a unit of {UNITS:?}"));
    }
    if hazard.bench.as_ref().is_some_and(|text| !text.contains("\nPassed if ")) {
        found.push("`bench` has no paragraph that begins with `Passed if`".to_owned());
    }
    found
}

/// Every named test exists, and `shown` has the places in which these tests run.
fn places(hazard: &Hazard) -> Vec<String> {
    let mut found = Vec::new();
    let is_known_before = |index: usize| hazard.tests[..index].contains(&hazard.tests[index]);
    if let Some(index) = (0..hazard.tests.len()).find(|index| is_known_before(*index)) {
        found.push(format!("`{}` is there twice", hazard.tests[index]));
    }
    let (known, unknown): (Vec<_>, Vec<_>) = hazard.tests.iter().map(|name| place_of(name)).partition(Result::is_ok);
    if !unknown.is_empty() {
        // Where these run is not known, so the places are not compared.
        found.extend(unknown.into_iter().filter_map(Result::err));
        return found;
    }
    let by_test: Vec<Place> = known.into_iter().flatten().collect();
    for (index, place) in hazard.shown.iter().enumerate() {
        if hazard.shown[..index].contains(place) {
            found.push(format!("`shown` has {place:?} twice"));
        }
        if *place == Place::Bench && hazard.bench.is_none() {
            found.push("shown on the bench without a procedure `bench`".to_owned());
        }
        if *place != Place::Bench && !by_test.contains(place) {
            found.push(format!("`shown` has {place:?}, where none of its tests runs"));
        }
    }
    for place in Place::ALL.into_iter().filter(|place| by_test.contains(place) && !hazard.shown.contains(place)) {
        found.push(format!("a test runs in {place:?}, which `shown` does not have"));
    }
    found
}
