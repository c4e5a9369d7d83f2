//! Recognises columns that a program put between 0 and 1, or -1 and 1, by their smallest and largest value: they are angles no more.

use crate::format::angle_columns::AngleColumn;

/// Whether each column has exactly these limits, which angles in radians have by no chance.
pub(crate) fn is(columns: &[AngleColumn]) -> bool {
    [(0.0, 1.0), (-1.0, 1.0)].into_iter().any(|limits| {
        columns.iter().all(|column| {
            let known = column.values.iter().copied().filter(|value| !value.is_nan());
            let found = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (x.min(least), x.max(most)));
            found == limits
        })
    })
}
