//! Finds initial contact and foot off in a mean stride, from the angles of hip and knee alone.
//!
//! With a thigh and a shank of equal length the ankle is `x = sin(hip) + sin(hip - knee)` thigh lengths in front of the hip. In walking,
//! initial contact is close to where the foot is furthest in front of the pelvis, and foot off to where it is furthest behind (Zeni, Richards and
//! Higginson 2008, Gait & Posture 27, 710-714, from markers on treadmill and ground). Thigh and shank are 0.245 and 0.246 of the stature (Drillis and Contini 1966). Each leg
//! has its own contact. A constant error of the hip's zero hardly moves the maximum.
//!
//! Contact itself comes a little later, when the foot has begun to move back: in the one recording at hand whose file has the events of a
//! laboratory, 3 to 5 % of the cycle; foot off is at most 2.3 % early there (`tests/contact.rs`).
//!
//! The estimate is for walking: a runner's foot moves back well before it lands. It is refused at the cadence of a run, and where the maximum
//! is not clear.

use gait_trace::stride::cycle::{Cycle, POINTS};
use joint_units::Joint;
use serde::Serialize;

/// Highest cadence of a walk, steps a minute. Of the recordings that the band and the gait family are from, the fastest walk has 131 and the
/// slowest run 155.
pub const FASTEST_WALK: f64 = 145.0;

/// Largest height of a second maximum of the ankle's path, as a fraction of its range.
const SECOND_MAXIMUM: f64 = 0.9;

/// Smallest and largest part of the left leg's cycle at which the right foot makes contact.
const OPPOSITE: [f64; 2] = [0.3, 0.7];

/// Where the cycle of each leg begins, and why there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CycleStart {
    /// Whether 0 % is initial contact; otherwise it is where the hip of the same leg is most flexed.
    pub initial_contact: bool,
    /// How it was found, or why it was not: one sentence.
    pub how: String,
    /// Index of the mean stride's point at which the cycle of the left and of the right leg begins.
    #[serde(skip)]
    pub points: [usize; 2],
    /// Estimated foot off of the left and of the right leg, percent of its cycle; `None` without initial contact.
    pub foot_off_percent: Option<[f64; 2]>,
}

impl CycleStart {
    /// Of a mean stride. `cadence` is in steps a minute; `None` if the recording has no seconds.
    ///
    /// ```
    /// use gait_fit::contact::CycleStart;
    /// use gait_trace::stride::cycle::{Cycle, POINTS};
    /// // The foot is furthest in front where a hip of 20 cos is, if the knee is stiff: at the hip's maximum, half a cycle later at the right.
    /// let hip = |lead: f64| std::array::from_fn(|k| 20.0 * (std::f64::consts::TAU * (k as f64 / POINTS as f64 - lead)).cos());
    /// let stiff = Cycle([hip(0.1), hip(0.6), [5.0; POINTS], [5.0; POINTS]]);
    /// let walk = CycleStart::of(&stiff, Some(110.0));
    /// assert!(walk.initial_contact && walk.points == [20, 120]);
    /// // It is furthest behind half a cycle after that.
    /// assert_eq!(walk.foot_off_percent, Some([50.0, 50.0]));
    /// assert!(!CycleStart::of(&stiff, Some(170.0)).initial_contact);
    /// ```
    #[must_use]
    pub fn of(mean: &Cycle, cadence: Option<f64>) -> Self {
        match estimated(mean, cadence) {
            Ok(points) => Self {
                initial_contact: true,
                how: "estimated from the joint angles: where the ankle of the leg is furthest in front of its hip (Zeni et al. 2008)".into(),
                points,
                foot_off_percent: Some([0, 1].map(|leg| {
                    let behind = ahead(&mean.0[leg], &mean.0[leg + 2]).map(|x| -x);
                    let after = (largest(&behind) + POINTS - points[leg]) % POINTS;
                    100.0 * after as f64 / POINTS as f64
                })),
            },
            Err(why) => Self {
                initial_contact: false,
                how: why,
                points: [Joint::LeftHip, Joint::RightHip].map(|hip| largest(&mean.0[hip as usize])),
                foot_off_percent: None,
            },
        }
    }

    /// A sentence that says what 0 % is.
    #[must_use]
    pub fn words(&self) -> String {
        if self.initial_contact {
            format!(
                "0 % is the initial contact of the same leg, {}. In a recording with the events of a laboratory, the estimate was 3 to 5 % of the cycle early.",
                self.how
            )
        } else {
            format!(
                "Initial contact was not found: {}. 0 % is where the hip of the same leg is most flexed in the mean stride.",
                self.how
            )
        }
    }

    /// The point of the mean stride at which the cycle of this joint's leg begins.
    #[must_use]
    pub const fn of_joint(&self, joint: Joint) -> usize {
        let [left, right] = self.points;
        match joint {
            Joint::LeftHip | Joint::LeftKnee => left,
            Joint::RightHip | Joint::RightKnee => right,
        }
    }

    /// A joint of a cycle, from the beginning of its leg's cycle on.
    #[must_use]
    pub fn own_cycle(&self, cycle: &Cycle, joint: Joint) -> [f64; POINTS] {
        let from = self.of_joint(joint);
        std::array::from_fn(|k| cycle.0[joint as usize][(k + from) % POINTS])
    }
}

fn estimated(mean: &Cycle, cadence: Option<f64>) -> Result<[usize; 2], String> {
    if let Some(cadence) = cadence
        && cadence > FASTEST_WALK
    {
        return Err(format!(
            "{cadence:.0} steps a minute are a run (above {FASTEST_WALK:.0}), and the estimate from joint angles is for walking"
        ));
    }
    let [left, right] = [(0, 2, "left"), (1, 3, "right")]
        .map(|(hip, knee, leg)| foremost(&ahead(&mean.0[hip], &mean.0[knee])).ok_or(leg));
    let not_clear =
        |leg| format!("the ankle of the {leg} leg is furthest in front of the hip at more than one place of the cycle");
    let points = [left.map_err(not_clear)?, right.map_err(not_clear)?];
    let after = ((points[1] + POINTS - points[0]) % POINTS) as f64 / POINTS as f64;
    if (OPPOSITE[0]..=OPPOSITE[1]).contains(&after) {
        Ok(points)
    } else {
        Err(format!(
            "the estimates of the legs are {:.0} % of the cycle apart; allowed are {:.0} to {:.0}",
            100.0 * after,
            100.0 * OPPOSITE[0],
            100.0 * OPPOSITE[1]
        ))
    }
}

/// How far the ankle is in front of the hip, in lengths of the thigh.
fn ahead(hip: &[f64; POINTS], knee: &[f64; POINTS]) -> [f64; POINTS] {
    std::array::from_fn(|k| hip[k].to_radians().sin() + (hip[k] - knee[k]).to_radians().sin())
}

fn largest(values: &[f64; POINTS]) -> usize {
    (0..POINTS).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0)
}

/// The place of the only high maximum.
fn foremost(x: &[f64; POINTS]) -> Option<usize> {
    let top = largest(x);
    let least = x.iter().copied().fold(f64::MAX, f64::min);
    let high = least + SECOND_MAXIMUM * (x[top] - least);
    let at = |k: usize| x[k % POINTS];
    // From the top on, the path goes below the limit once, and stays there until it comes back to the top.
    let below = (0..POINTS).map(|k| at(top + k) < high);
    let changes = below.clone().zip(below.cycle().skip(1)).filter(|(now, next)| now != next).count();
    (x[top] > least && changes == 2).then_some(top)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn wave(of: impl Fn(f64) -> f64) -> [f64; POINTS] {
        std::array::from_fn(|k| of(k as f64 / POINTS as f64))
    }

    #[test]
    fn two_places_in_front_are_not_clear() {
        let twice = |lead: f64| wave(|p| 20.0 * (2.0 * TAU * (p - lead)).cos());
        let found = CycleStart::of(&Cycle([twice(0.0), twice(0.25), [5.0; POINTS], [5.0; POINTS]]), None);
        assert!(!found.initial_contact && found.how.contains("left leg"), "{found:?}");
        assert!(found.words().starts_with("Initial contact was not found: the ankle"), "{}", found.words());
    }

    #[test]
    fn legs_that_move_together_have_no_contacts() {
        let hip = wave(|p| 20.0 * (TAU * p).cos());
        let found = CycleStart::of(&Cycle([hip, hip, [5.0; POINTS], [5.0; POINTS]]), None);
        assert!(!found.initial_contact && found.how.contains("allowed are 30 to 70"), "{found:?}");
        assert_eq!(found.points, [0, 0]);
    }

    /// The zero of the hip differs by 20 degrees between laboratories.
    #[test]
    fn the_zero_of_the_hip_hardly_matters() {
        let place = |zero: f64| {
            let hip = |lead: f64| wave(|p| zero + 8.0 + 21.0 * (TAU * (p + lead)).cos());
            let knee = |lead: f64| {
                wave(|p| {
                    let turn = TAU * (p + lead);
                    24.0 + 20.0 * (turn + 1.3).cos() + 15.0 * (2.0 * turn + 1.5).cos()
                })
            };
            CycleStart::of(&Cycle([hip(0.0), hip(0.5), knee(0.0), knee(0.5)]), Some(110.0)).points[0] as f64
        };
        let apart = (place(0.0) - place(20.0) + 100.0).rem_euclid(POINTS as f64) - 100.0;
        assert!(apart.abs() <= 4.0, "{apart}");
    }
}
