//! Angles over the last seconds: curves on a scale that stays, with a line at zero and the time.

use crate::view::cut::cut;
use crate::view::state::{PAST_S, Point, SCALE_STEP_DEG, Scale};
use ratatui::Frame;
use ratatui::layout::{Alignment, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};
use std::collections::VecDeque;

/// One series for each colour over the last seconds, and a line at zero.
pub(super) fn chart(
    frame: &mut Frame<'_>,
    area: Rect,
    past: &VecDeque<Point>,
    title: String,
    colours: &[Color],
    scale: Scale,
    of: impl Fn(&Point) -> Vec<f32>,
) {
    let mut all: Vec<Vec<(f64, f64)>> = vec![Vec::with_capacity(past.len()); colours.len()];
    for point in past {
        for (series, y) in all.iter_mut().zip(of(point)) {
            series.push((point.t_s, f64::from(y)));
        }
    }
    let Scale([least, most]) = scale;
    let marks = marks(scale, area.height.saturating_sub(2));
    let end = past.back().map_or(PAST_S, |point| point.t_s.max(PAST_S));
    let zero = [(end - PAST_S, 0.0), (end, 0.0)];
    let line = |colour: Color| {
        Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(Style::new().fg(colour))
    };
    let mut curves = vec![line(Color::DarkGray).data(&zero)];
    curves.extend(all.iter().zip(colours).map(|(series, colour)| line(*colour).data(series)));
    let ago = |seconds: f64, alignment| Line::from(format!("{seconds:.0} s")).alignment(alignment);
    let block = Block::bordered()
        .title(cut(Line::from(title), area.width.saturating_sub(2)))
        .title_bottom(ago(-PAST_S, Alignment::Left))
        .title_bottom(ago(-PAST_S / 2.0, Alignment::Center))
        .title_bottom(ago(0.0, Alignment::Right));
    let chart = Chart::new(curves)
        .block(block)
        .legend_position(None)
        .x_axis(Axis::default().bounds([end - PAST_S, end]))
        .y_axis(Axis::default().bounds([f64::from(least), f64::from(most)]).labels(marks));
    frame.render_widget(chart, area);
}

/// The text beside each row of a chart, from the lowest: a mark of the axis stands in the row that a curve passes at it. Marks are multiples of a
/// step, so that the rows between them are equally many degrees; on a low chart the step is larger, and the upper end may have no mark.
fn marks(scale: Scale, rows: u16) -> Vec<String> {
    let Scale([least, most]) = scale;
    let mut texts = vec![String::new(); usize::from(rows)];
    // Four dots a row.
    let dots = f32::from(rows.max(1) * 4 - 1);
    let row = |mark: f32| ((most - mark) / (most - least) * dots) as usize / 4;
    // From the upper end down; the zero is always among them.
    let of_every = |every: i32| -> Vec<f32> {
        let multiples =
            scale.marks().into_iter().rev().filter(|mark| (mark / SCALE_STEP_DEG).round() as i32 % every == 0);
        let marks: Vec<f32> = multiples.collect();
        let is_hidden = marks.len() > 1 && row(marks[0]) == row(marks[1]);
        marks[usize::from(is_hidden)..].to_vec()
    };
    let stand_apart = |marks: &Vec<f32>| marks.windows(2).all(|pair| row(pair[0]) < row(pair[1]));
    for mark in (1..).map(of_every).find(stand_apart).unwrap_or_default() {
        if let Some(text) = texts.len().checked_sub(row(mark) + 1).and_then(|row| texts.get_mut(row)) {
            *text = format!("{mark:>3.0}");
        }
    }
    texts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The zero of the axis stands beside the line at zero, whatever the height, and the marks are equally many degrees apart.
    #[test]
    fn marks_stand_where_curves_pass() {
        for scale in [Scale::default(), Scale([-60.0, 120.0]), Scale([-30.0, 510.0])] {
            let Scale([least, most]) = scale;
            for rows in 1..40 {
                let texts = marks(scale, rows);
                assert_eq!(texts.len(), usize::from(rows));
                let zero_dot = most / (most - least) * (f32::from(rows) * 4.0 - 1.0);
                let zero_row = usize::from(rows) - 1 - zero_dot as usize / 4;
                assert_eq!(texts.iter().position(|text| text == "  0"), Some(zero_row), "{texts:?}");
                let shown: Vec<i32> = texts.iter().filter_map(|text| text.trim().parse().ok()).collect();
                let steps: Vec<i32> = shown.windows(2).map(|pair| pair[1] - pair[0]).collect();
                assert!(steps.iter().all(|step| *step == steps[0] && *step > 0), "{texts:?}");
                assert!(rows < 3 || shown.len() > 1, "{texts:?}");
            }
        }
        // The four rows of a terminal of 80 x 24.
        assert_eq!(marks(Scale::default(), 4), ["-30", "  0", " 30", " 60"]);
        assert_eq!(marks(Scale::default(), 5), ["-30", "  0", " 30", " 60", " 90"]);
    }
}
