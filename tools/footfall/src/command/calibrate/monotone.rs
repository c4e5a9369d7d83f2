//! Monotone regression: the rising sequence that is nearest to a noisy one in the weighted sum of squares, by pooling adjacent
//! violators (Ayer, Brunk, Ewing, Reid and Silverman 1955): what falls is joined to what is before it until nothing falls.

/// Neighbours that were joined, and their mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// The members' places.
    pub members: std::ops::Range<usize>,
    /// Their weighted mean.
    pub mean: f64,
    /// The sum of their weights.
    pub weight: f64,
}

/// The blocks of the nearest rising sequence; means rise strictly from block to block.
///
/// ```
/// use footfall::command::calibrate::monotone::pool;
/// let blocks = pool(&[(1.0, 1.0), (3.0, 1.0), (2.0, 3.0), (4.0, 1.0)]);
/// assert_eq!(blocks.iter().map(|block| block.mean).collect::<Vec<_>>(), [1.0, 2.25, 4.0]);
/// assert_eq!(blocks[1].members, 1..3);
/// ```
#[must_use]
pub fn pool(values: &[(f64, f64)]) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::with_capacity(values.len());
    for (index, &(value, weight)) in values.iter().enumerate() {
        let mut block = Block { members: index..index + 1, mean: value, weight };
        while let Some(before) = blocks.pop_if(|before| before.mean >= block.mean) {
            let sum = before.weight + block.weight;
            block = Block {
                members: before.members.start..block.members.end,
                mean: (before.weight * before.mean + block.weight * block.mean) / sum,
                weight: sum,
            };
        }
        blocks.push(block);
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sequence() -> impl Strategy<Value = Vec<(f64, f64)>> {
        prop::collection::vec((-10.0_f64..10.0, 0.5_f64..5.0), 1..30)
    }

    proptest! {
        /// The solution of the least squares problem is known in closed form: g_i = max over a <= i of min over b >= i of the
        /// weighted mean of a to b (Robertson, Wright and Dykstra 1988, theorem 1.4.4).
        #[test]
        fn pooling_is_the_max_min_formula(values in sequence()) {
            let mean = |a: usize, b: usize| {
                let (sum, weight) = values[a..=b].iter().fold((0.0, 0.0), |(s, w), &(x, v)| (s + x * v, w + v));
                sum / weight
            };
            for block in pool(&values) {
                for i in block.members {
                    let g = (0..=i)
                        .map(|a| (i..values.len()).map(|b| mean(a, b)).fold(f64::MAX, f64::min))
                        .fold(f64::MIN, f64::max);
                    prop_assert!((g - block.mean).abs() < 1e-9, "{} for {}", block.mean, g);
                }
            }
        }

        #[test]
        fn blocks_rise_and_cover_everything(values in sequence()) {
            let blocks = pool(&values);
            prop_assert!(blocks.windows(2).all(|pair| pair[0].mean < pair[1].mean));
            prop_assert!(blocks.windows(2).all(|pair| pair[0].members.end == pair[1].members.start));
            prop_assert_eq!((blocks[0].members.start, blocks[blocks.len() - 1].members.end), (0, values.len()));
        }
    }
}
