//! The line of each row of a file, for errors: rows on consecutive lines take no memory of their own.

/// Lines of rows, in the order of the rows.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct RowLines {
    rows: usize,
    /// The line behind that of the last row.
    next: u64,
    /// First row and line of each run of rows on consecutive lines.
    runs: Vec<(usize, u64)>,
}

impl RowLines {
    /// Adds the next row.
    pub(crate) fn push(&mut self, line: u64) {
        if self.rows == 0 || line != self.next {
            self.runs.push((self.rows, line));
        }
        self.rows += 1;
        self.next = line + 1;
    }

    /// Number of rows.
    pub(crate) const fn len(&self) -> usize {
        self.rows
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// The line of a row, counted from 0.
    pub(crate) fn get(&self, row: usize) -> Option<u64> {
        let run = self.runs.partition_point(|(first, _)| *first <= row).checked_sub(1)?;
        let (first, line) = self.runs[run];
        (row < self.rows).then(|| line + (row - first) as u64)
    }

    /// The line of the last row.
    pub(crate) fn last(&self) -> Option<u64> {
        self.get(self.rows.checked_sub(1)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_row_has_its_line() {
        let lines: Vec<u64> = (3..50).chain([52, 54]).chain(60..70).chain([1, 1]).collect();
        let mut rows = RowLines::default();
        assert!(rows.is_empty() && rows.last().is_none() && rows.get(0).is_none());
        for (row, &line) in lines.iter().enumerate() {
            rows.push(line);
            assert_eq!((rows.len(), rows.last()), (row + 1, Some(line)));
        }
        assert!(lines.iter().enumerate().all(|(row, line)| rows.get(row) == Some(*line)));
        assert_eq!((rows.get(lines.len()), rows.runs.len()), (None, 6));
    }
}
