//! Angles over the last seconds: curves on a scale that stays, with a line at zero and the time.

use crate::view::state::{PAST_S, Point, Scale};
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
        .title(title)
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

/// The text beside each row of a chart, from the lowest: a mark of the axis stands in the row that a curve passes at it. The ends come first,
/// then zero.
fn marks(scale: Scale, rows: u16) -> Vec<String> {
    let Scale([least, most]) = scale;
    let mut texts = vec![String::new(); usize::from(rows)];
    // Four dots a row.
    let dots = f32::from(rows.max(1) * 4 - 1);
    let mut wanted = scale.marks();
    wanted.sort_by_key(|mark| (*mark != least && *mark != most, *mark != 0.0));
    for mark in wanted {
        let from_top = ((most - mark) / (most - least) * dots) as usize / 4;
        let row = texts.len().checked_sub(from_top + 1).and_then(|row| texts.get_mut(row));
        if let Some(text) = row.filter(|text| text.is_empty()) {
            *text = format!("{mark:>3.0}");
        }
    }
    texts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The zero of the axis stands beside the line at zero, whatever the height.
    #[test]
    fn marks_stand_where_curves_pass() {
        for rows in 3..40 {
            let texts = marks(Scale::default(), rows);
            let [low, zero, high] = ["-30", "  0", " 90"].map(|mark| texts.iter().position(|text| text == mark));
            let zero_dot = 0.75 * (f32::from(rows) * 4.0 - 1.0);
            let zero_row = usize::from(rows) - 1 - zero_dot as usize / 4;
            assert_eq!((low, high), (Some(0), Some(usize::from(rows) - 1)), "{texts:?}");
            assert!(zero == Some(zero_row) || zero_row == 0, "{texts:?}");
        }
    }
}
