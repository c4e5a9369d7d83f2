//! Finds hips, knees and ankles among the names of points, in the usual marker sets.
//!
//! | set | hip | knee | ankle |
//! |---|---|---|---|
//! | joint centres | `LHJC`, `LFEP` | `LKJC`, `LFEO` | `LAJC`, `LTIO` |
//! | Plug-in Gait | `LASI`, `RASI`, and `LPSI`, `RPSI` or `SACR` | `LKNE` | `LANK` |
//! | Helen Hayes | `L.ASIS`, `R.ASIS`, `V.Sacral` | `L.Knee` | `L.Ankle` |
//! | CAST | `LIAS`, `RIAS`, `LIPS`, `RIPS`; `LFTC`, `LGT` | `LFLE`, `LFME`; `LLE`, `LME` | `LFAL`, `LTAM`; `LLM`, `LMM` |
//! | OpenSim, OpenCap | `L.ASIS`, `R.ASIS`, `V.Sacral`; `L.PSIS` | `L.Knee.Lat`, `L.Knee.Med`; `L_knee`, `L_mknee` | `L.Ankle.Lat`, `L.Ankle.Med`; `L_ankle`, `L_mankle` |
//!
//! A joint centre goes before a pair of markers, whose middle is taken, and a pair before a single marker. A hip without a point of its
//! own is computed from the pelvis.

use crate::format::segments::pelvis::Pelvis;
use crate::format::text_table::listed;

/// Names of the points of a joint in order of preference, without side, blanks and signs; several in one entry are averaged.
type Names = &'static [&'static [&'static str]];

/// What is known of a joint by its points.
struct Points {
    /// Joint centres, and pairs of markers on both sides of the joint.
    centres: Names,
    /// Single markers on the skin, and names that are used for centres and for markers.
    markers: Names,
}

const HIP: Points = Points {
    centres: &[&["hjc"], &["hipjc"], &["hipjointcenter"], &["hipjointcentre"], &["hipcenter"], &["fep"]],
    markers: &[&["gtr"], &["gtro"], &["gt"], &["ftc"], &["troch"], &["trochanter"], &["hip"]],
};
const KNEE: Points = Points {
    centres: &[
        &["kjc"],
        &["kneejc"],
        &["kneejointcenter"],
        &["kneejointcentre"],
        &["kneecenter"],
        &["feo"],
        &["kne", "knm"],
        &["kne", "mkne"],
        &["lfc", "mfc"],
        &["lek", "mek"],
        &["fle", "fme"],
        &["le", "me"],
        &["kneelat", "kneemed"],
        &["knee", "mknee"],
    ],
    markers: &[&["knee"], &["kne"], &["lfc"], &["fle"], &["lek"], &["le"], &["kneelat"]],
};
const ANKLE: Points = Points {
    centres: &[
        &["ajc"],
        &["anklejc"],
        &["anklejointcenter"],
        &["anklejointcentre"],
        &["anklecenter"],
        &["tio"],
        &["ank", "med"],
        &["ank", "mank"],
        &["lmal", "mmal"],
        &["fal", "tam"],
        &["lm", "mm"],
        &["anklelat", "anklemed"],
        &["ankle", "mankle"],
    ],
    markers: &[&["ankle"], &["ank"], &["lmal"], &["fal"], &["lm"], &["anklelat"]],
};
const ANTERIOR: Names = &[&["asi"], &["asis"], &["ias"]];
const POSTERIOR: Names = &[&["psi"], &["psis"], &["ips"]];
const SACRUM: [&str; 6] = ["sacr", "sacrum", "sacral", "vsacral", "vsacrum", "sac"];

/// Where a joint is, by indices of points.
pub(crate) enum Place {
    /// In the middle of points.
    Mean(Vec<usize>),
    /// In the pelvis, to its left or to its right.
    InPelvis(Pelvis),
}

/// Hip, knee and ankle of a leg, as places or as trajectories.
pub(crate) struct Leg<P> {
    pub(super) places: [P; 3],
    /// The names of the points.
    pub(super) name: String,
    /// The names of single markers that stand for joint centres.
    pub(super) markers: Vec<String>,
}

/// The left and right leg, with places that points give; `None` where a hip, knee or ankle is missing.
pub(crate) type FoundLegs = [Option<Leg<Place>>; 2];

/// The sides of a body, short and long.
const SIDES: [(&str, &str); 2] = [("l", "left"), ("r", "right")];

/// A name without blanks, signs and case. OpenCap marks the joint centres that it computes with `_study`.
fn plain(label: &str) -> String {
    let plain: String = label.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    plain.strip_suffix("study").map_or(plain.clone(), str::to_owned)
}

/// What a file with the points of only one leg lacks, as a note.
pub(crate) fn one_leg(legs: &FoundLegs, labels: &[&str]) -> Option<String> {
    let (leg, of) = match legs {
        [Some(left), None] => (left, 0),
        [None, Some(right)] => (right, 1),
        _ => return None,
    };
    let ((short, long), (other_short, other_long)) = (SIDES[of], SIDES[1 - of]);
    let all: Vec<String> = labels.iter().map(|label| plain(label)).collect();
    let has_counterpart = |name: &str| {
        let names = [
            name.strip_prefix(short).map(|rest| format!("{other_short}{rest}")),
            name.strip_suffix(short).map(|rest| format!("{rest}{other_short}")),
            name.strip_prefix(long).map(|rest| format!("{other_long}{rest}")),
            name.strip_suffix(long).map(|rest| format!("{rest}{other_long}")),
        ];
        names.iter().flatten().any(|name| all.contains(name))
    };
    let means = leg.places.iter().filter(|place| matches!(place, Place::Mean(_)));
    let alone: Vec<&str> = means
        .flat_map(Place::points)
        .filter(|&point| !has_counterpart(&all[point]))
        .map(|point| labels[point])
        .collect();
    Some(format!(
        "The {other_long} leg is not found: on its side the counterparts of these points are missing: {}. The points of the file are {}.",
        listed(&alone),
        listed(labels)
    ))
}

/// Finds the legs.
pub(crate) fn find(labels: &[&str]) -> FoundLegs {
    let plain: Vec<String> = labels.iter().map(|label| plain(label)).collect();
    let point = |side: (&str, &str), name: &str| {
        let names = called(side, name);
        plain.iter().position(|label| names.contains(label))
    };
    let among = |side: (&str, &str), names: Names| {
        names.iter().find_map(|points| points.iter().map(|name| point(side, name)).collect::<Option<Vec<_>>>())
    };
    let both = |names: Names| {
        let [left, right] = SIDES.map(|side| among(side, names));
        Some([*left?.first()?, *right?.first()?])
    };
    let back = || {
        let sacrum = || plain.iter().position(|label| SACRUM.contains(&label.as_str()));
        both(POSTERIOR).map(Vec::from).or_else(|| sacrum().map(|sacrum| vec![sacrum]))
    };
    SIDES.map(|side| {
        let mut markers = Vec::new();
        let mut place = |joint: &Points| {
            among(side, joint.centres).or_else(|| {
                let marker = among(side, joint.markers)?;
                markers.extend(marker.iter().map(|&index| labels[index].to_owned()));
                Some(marker)
            })
        };
        let hip = match place(&HIP) {
            Some(points) => Place::Mean(points),
            None => Place::InPelvis(Pelvis { anterior: both(ANTERIOR)?, posterior: back()?, is_left: side.0 == "l" }),
        };
        let places = [hip, Place::Mean(place(&KNEE)?), Place::Mean(place(&ANKLE)?)];
        let points = places.iter().flat_map(Place::points);
        let name = points.map(|index| labels[index]).collect::<Vec<_>>().join(", ");
        Some(Leg { places, name, markers })
    })
}

/// Finds the legs among points of which some have no value at all, such as joint centres that a model did not compute; their labels are
/// emptied, with a note.
pub(crate) fn find_seen(labels: &mut [&str], is_empty: impl Fn(usize) -> bool, notes: &mut Vec<String>) -> FoundLegs {
    let mut empty: Vec<&str> = Vec::new();
    loop {
        let legs = find(labels);
        let mut points: Vec<usize> =
            legs.iter().flatten().flat_map(Leg::points).filter(|&point| is_empty(point)).collect();
        points.sort_unstable();
        points.dedup();
        if points.is_empty() {
            if !empty.is_empty() {
                notes.push(format!("{} have no value in any frame and are left out.", listed(&empty)));
            }
            return legs;
        }
        // Each round empties a label, so that there is a last one.
        empty.extend(points.into_iter().map(|point| std::mem::take(&mut labels[point])));
    }
}

/// The points that may belong to a leg, by their names.
pub(crate) fn candidates(labels: &[&str]) -> Vec<usize> {
    let of_joints = [&HIP, &KNEE, &ANKLE].into_iter().flat_map(|joint| [joint.centres, joint.markers]);
    let names: Vec<&str> = of_joints.chain([ANTERIOR, POSTERIOR]).flatten().copied().flatten().copied().collect();
    let is_of_leg = |label: &&str| {
        let plain = plain(label);
        let of_side =
            |&(side, word): &(&str, &str)| names.iter().any(|name| called((side, word), name).contains(&plain));
        SIDES.iter().any(of_side) || SACRUM.contains(&plain.as_str())
    };
    (0..labels.len()).filter(|&point| is_of_leg(&labels[point])).collect()
}

/// The ways to write the name of a point of a side.
fn called((side, word): (&str, &str), name: &str) -> [String; 4] {
    [format!("{side}{name}"), format!("{name}{side}"), format!("{word}{name}"), format!("{name}{word}")]
}

impl Place {
    fn points(&self) -> Vec<usize> {
        match self {
            Self::Mean(points) => points.clone(),
            Self::InPelvis(pelvis) => pelvis.points(),
        }
    }
}

impl Leg<Place> {
    /// The points that are used.
    pub(crate) fn points(&self) -> impl Iterator<Item = usize> {
        self.places.iter().flat_map(Place::points)
    }
}
