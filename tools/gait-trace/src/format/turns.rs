//! Takes whole turns out of angles that a file counts from 0 to 360 degrees, or from -180 to 180: -5 degrees are 355 there.

/// Smallest step, as a share of a turn, that is one.
const STEP_SHARE: f64 = 5.0 / 6.0;
/// Where all values are near a whole turn, the largest is beyond this share of one.
const NEAR_SHARE: f64 = 330.0 / 360.0;
/// Largest range of a joint, as a share of a turn.
const RANGE_SHARE: f64 = 200.0 / 360.0;

/// Takes whole turns out of a column, in the unit of which a turn is `turn`; what was done, in words, if anything. Where the unit is only
/// supposed (`is_known` is false), steps of a turn confirm it.
pub(crate) fn take_out(heading: &str, values: &mut [f64], turn: f64, is_known: bool) -> Option<String> {
    let known = || values.iter().copied().filter(|value| value.is_finite());
    let (least, most) = extent(values);
    let slack = 1e-3 * turn;
    let is_from_0 = least >= -slack && most <= turn + slack;
    let is_around_0 = least >= -0.5 * turn - slack && most <= 0.5 * turn + slack;
    if !is_from_0 && !is_around_0 {
        return None;
    }
    if is_from_0 && is_known && least > RANGE_SHARE * turn && most > NEAR_SHARE * turn {
        values.iter_mut().for_each(|value| *value -= turn);
        return Some(format!(
            "`{heading}`: all values are from {least:.1} to {most:.1}, near a whole turn of 360 degrees, which is taken out."
        ));
    }
    // Where all values are that close, none is a step.
    if most - least <= STEP_SHARE * turn {
        return None;
    }
    let is_step = |step: f64| step.abs() > STEP_SHARE * turn;
    let mut before = None;
    if !known().any(|value| before.replace(value).is_some_and(|before| is_step(value - before))) {
        return None;
    }
    let (mut turns, mut steps, mut before) = (0.0, 0, None);
    let unwrapped: Vec<f64> = values
        .iter()
        .map(|&value| {
            if value.is_finite() {
                let step = before.replace(value).map_or(0.0, |before| value - before);
                if is_step(step) {
                    turns -= step.signum();
                    steps += 1;
                }
            }
            value + turns * turn
        })
        .collect();
    let (low, high) = extent(&unwrapped);
    if high - low > RANGE_SHARE * turn {
        return None;
    }
    let middle = (crate::series::median(unwrapped.iter().copied().filter(|value| value.is_finite())) / turn).round();
    values.iter_mut().zip(unwrapped).for_each(|(value, unwrapped)| *value = unwrapped - middle * turn);
    let from = if is_around_0 { "-180 to 180" } else { "0 to 360" };
    Some(format!(
        "`{heading}`: {steps} steps of a whole turn are taken out: the file counts the angle from {from} degrees."
    ))
}

/// The least and the most of the finite values. Eight take turns, so that none waits for the one before.
fn extent(values: &[f64]) -> (f64, f64) {
    const LANES: usize = 8;
    let (mut least, mut most) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let mut take = |block: &[f64]| {
        for ((value, least), most) in block.iter().zip(&mut least).zip(&mut most) {
            let is_known = value.is_finite();
            *least = if is_known && value < least { *value } else { *least };
            *most = if is_known && value > most { *value } else { *most };
        }
    };
    let (blocks, rest) = values.as_chunks::<LANES>();
    blocks.iter().for_each(|block| take(block));
    take(rest);
    (least.into_iter().fold(f64::INFINITY, f64::min), most.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A hip around 0 that is counted from 0 to 360 degrees, or to 2 pi, comes back.
        #[test]
        fn a_turn_is_taken_out(mean in -10.0_f64..10.0, phase in 0.0_f64..6.3, missing in 0_usize..300) {
            let hip = |n: usize| mean + 25.0 * (n as f64 * 0.06 + phase).sin();
            for turn in [360.0, std::f64::consts::TAU] {
                let scale = turn / 360.0;
                let mut values: Vec<f64> = (0..300).map(|n| scale * hip(n).rem_euclid(360.0)).collect();
                values[missing] = f64::NAN;
                let said = take_out("hip", &mut values, turn, false).unwrap();
                prop_assert!(said.contains("from 0 to 360 degrees"), "{said}");
                for (n, value) in values.iter().enumerate().filter(|(n, _)| *n != missing) {
                    prop_assert!((value - scale * hip(n)).abs() < 1e-9, "{n}: {value}");
                }
            }
        }
    }

    #[test]
    fn other_columns_stay() {
        let knee = |n: usize| 30.0 + 28.0 * (n as f64 * 0.06).sin();
        let mut bent: Vec<f64> = (0..300).map(|n| 360.0 - knee(n)).collect();
        assert!(take_out("knee", &mut bent, 360.0, true).unwrap().contains("near a whole turn"));
        assert!((bent[7] + knee(7)).abs() < 1e-9);
        for change in [0.0, 150.0, 190.0, 210.0] {
            let mut values: Vec<f64> = (0..300).map(|n| knee(n) + change).collect();
            let before = values.clone();
            assert_eq!(take_out("knee", &mut values, 360.0, true), None);
            assert_eq!(values, before);
        }
        // A number that stands for a missing value is no turn.
        let mut values: Vec<f64> = (0..300).map(|n| if n == 50 { 999.0 } else { knee(n) }).collect();
        assert_eq!(take_out("knee", &mut values, 360.0, true), None);
    }
}
