//! Angles in degrees that read back to the same bits in radians.

use joint_units::Radians;

/// The shortest decimal number of degrees that is this angle.
///
/// ```
/// use generator_file::degrees;
/// use joint_units::Radians;
/// assert_eq!(degrees::shortest(Radians::from_degrees(-30.0)).to_string(), "-30");
/// ```
#[must_use]
pub fn shortest(angle: Radians) -> f32 {
    let exact = f64::from(angle.0).to_degrees();
    let rounded = (0..9).map(|decimals| {
        let scale = 10_f64.powi(decimals);
        ((exact * scale).round() / scale) as f32
    });
    // Two roundings are between degrees and radians, so the number may be a neighbour of the nearest one. A few angles have no
    // exact number of degrees.
    let nearest = exact as f32;
    let neighbours =
        [nearest.next_up(), nearest.next_down(), nearest.next_up().next_up(), nearest.next_down().next_down()];
    rounded.chain(neighbours).find(|&degrees| Radians::from_degrees(degrees) == angle).unwrap_or(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_was_degrees_comes_back_bit_for_bit(degrees in -200.0_f32..200.0) {
            let angle = Radians::from_degrees(degrees);
            prop_assert_eq!(Radians::from_degrees(shortest(angle)), angle);
        }

        #[test]
        fn short_numbers_stay_short(tenths in -1800_i32..1800) {
            let degrees = tenths as f32 / 10.0;
            prop_assert_eq!(shortest(Radians::from_degrees(degrees)), degrees);
        }
    }
}
