//! A map of cells: a grid of two axes whose cells have classes, each with a name and a colour; and lines over it.

use plotters::prelude::*;

use crate::frame::{Area, builder, colour, format_number};

/// Colour of a cell without a class.
const BLANK: RGBColor = RGBColor(235, 235, 235);

/// A grid of cells.
#[derive(Debug, Clone)]
pub struct Cells {
    /// First and last value of the horizontal axis, at the outer borders of the first and the last column.
    pub x: (f64, f64),
    /// First and last value of the vertical axis, at the outer borders of the first and the last row.
    pub y: (f64, f64),
    /// Number of columns.
    pub columns: usize,
    /// Index of the class of each cell, row by row from the lowest; none is drawn in light grey.
    pub classes: Vec<Option<usize>>,
    /// Name of each class, for the legend.
    pub names: Vec<String>,
    /// Lines over the map, each through points (x, y).
    pub lines: Vec<Vec<(f64, f64)>>,
}

impl Cells {
    /// The centre of a cell, x and y; cells are counted row by row from the lowest.
    #[must_use]
    pub fn centre(&self, place: usize) -> [f64; 2] {
        let columns = self.columns.max(1);
        let along = |(first, last): (f64, f64), at: usize, count: usize| {
            first + (last - first) * (at as f64 + 0.5) / count.max(1) as f64
        };
        [along(self.x, place % columns, columns), along(self.y, place / columns, self.classes.len() / columns)]
    }

    /// Draws the axes and one rectangle for each run of equal cells in a row.
    pub(crate) fn draw(&self, area: &Area<'_>, title: &str, axes: [&str; 2]) -> Result<(), String> {
        let rows = self.classes.len() / self.columns.max(1);
        let mut chart = builder(area, title)
            .build_cartesian_2d(self.x.0..self.x.1, self.y.0..self.y.1)
            .map_err(|error| error.to_string())?;
        chart
            .configure_mesh()
            .x_desc(axes[0])
            .y_desc(axes[1])
            .x_labels(9)
            .y_labels(9)
            .x_label_formatter(&format_number)
            .y_label_formatter(&format_number)
            .disable_mesh()
            .draw()
            .map_err(|error| error.to_string())?;
        let x = |column: usize| self.x.0 + (self.x.1 - self.x.0) * column as f64 / self.columns as f64;
        let y = |row: usize| self.y.0 + (self.y.1 - self.y.0) * row as f64 / rows as f64;
        for (row, cells) in self.classes.chunks_exact(self.columns.max(1)).enumerate() {
            let mut column = 0;
            for run in cells.chunk_by(|a, b| a == b) {
                let corners = [(x(column), y(row)), (x(column + run.len()), y(row + 1))];
                let fill = run[0].map_or(BLANK, colour);
                chart.draw_series([Rectangle::new(corners, fill.filled())]).map_err(|error| error.to_string())?;
                column += run.len();
            }
        }
        for line in &self.lines {
            let inside =
                |&&(x, y): &&(f64, f64)| (self.x.0..=self.x.1).contains(&x) && (self.y.0..=self.y.1).contains(&y);
            let points: Vec<(f64, f64)> = line.iter().filter(inside).copied().collect();
            let line = PathElement::new(points, BLACK.stroke_width(2));
            chart.draw_series([line]).map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Panel;
    use crate::draw;

    #[test]
    fn a_run_of_equal_cells_is_one_rectangle_in_the_colour_of_its_class() {
        let cells = Cells {
            x: (0.0, 3.0),
            y: (0.0, 2.0),
            columns: 3,
            classes: vec![Some(0), Some(0), Some(1), None, None, None],
            names: vec!["one".into(), "two".into()],
            lines: vec![vec![(0.0, 1.0), (3.0, 1.0)]],
        };
        let empty = Cells { classes: vec![], lines: vec![], ..cells.clone() };
        let text = |cells: Cells| draw("map", &[Panel::cells("cells", "x", "y", cells)], 1).expect("drawn");
        let (with, without) = (text(cells), text(empty));
        assert_eq!(with.matches("<rect").count() - without.matches("<rect").count(), 3);
        assert!(with.contains("one") && with.contains("two") && with.contains("#0072B2"), "{with}");
        assert_eq!(with.matches("<polyline").count() - without.matches("<polyline").count(), 1);
    }
}
