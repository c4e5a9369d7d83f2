//! Order of two numbers by one compare: `f32::min` and `f32::max` cost ten instructions where the processor has none of its own for them, since they
//! treat NaN alike on both sides.

/// The lesser of the two; `b` where `a` is NaN, as of `f32::min`. Not for a `b` that is NaN.
#[must_use]
pub fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of the two; `b` where `a` is NaN, as of `f32::max`. Not for a `b` that is NaN.
#[must_use]
pub fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The value, or what is nearest to it between two numbers in any order; the lesser of them for NaN.
#[must_use]
pub fn between(value: f32, one: f32, other: f32) -> f32 {
    let (low, high) = if one < other { (one, other) } else { (other, one) };
    lesser(greater(value, low), high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Random numbers, those of interest, and neighbours of one another.
    fn numbers() -> impl Strategy<Value = f32> {
        let specials =
            [0.0, -0.0, f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE, 1e-45, -1e-45];
        prop_oneof![prop::num::f32::ANY, prop::sample::select(specials.to_vec()), -2.0_f32..2.0]
    }

    /// 100,000 cases, or as many as the variable `FOOTFALL_CASES` says.
    fn cases() -> u32 {
        std::env::var("FOOTFALL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(100_000)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(cases()))]

        /// As the library's; which of two zeros it returns is open there.
        #[test]
        fn they_are_the_librarys(a in numbers(), b in numbers(), c in numbers()) {
            let same = |one: f32, other: f32| one == other || (one.is_nan() && other.is_nan());
            if !b.is_nan() {
                prop_assert!(same(lesser(a, b), a.min(b)), "{} {}", a, b);
                prop_assert!(same(greater(a, b), a.max(b)), "{} {}", a, b);
                if !c.is_nan() {
                    prop_assert!(same(between(a, b, c), a.max(b.min(c)).min(b.max(c))), "{} {} {}", a, b, c);
                }
            }
        }
    }
}
