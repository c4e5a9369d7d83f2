//! Text that is wider than its place: it ends in an ellipsis, so that one sees that there is more.

use ratatui::text::{Line, Span};

/// The line in so many columns.
pub(super) fn cut(line: Line<'_>, columns: u16) -> Line<'_> {
    let columns = usize::from(columns);
    if line.width() <= columns {
        return line;
    }
    let mut left = columns.saturating_sub(1);
    let mut spans: Vec<Span<'_>> = Vec::new();
    for span in line.spans {
        let mut kept = String::new();
        let fits = span.content.chars().all(|c| {
            let width = Span::raw(c.to_string()).width();
            let is_inside = width <= left;
            if is_inside {
                left -= width;
                kept.push(c);
            }
            is_inside
        });
        if !fits {
            kept.push('\u{2026}');
        }
        spans.push(Span::styled(kept, span.style));
        if !fits {
            break;
        }
    }
    Line { spans, ..line }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::style::{Color, Style};

    #[test]
    fn what_is_cut_ends_in_an_ellipsis() {
        let line = || Line::from(vec![Span::raw("one "), Span::styled("two", Style::new().fg(Color::Red))]);
        assert_eq!(cut(line(), 7), line());
        let of = |columns| cut(line(), columns);
        assert_eq!(of(6).spans[1], Span::styled("t\u{2026}", Style::new().fg(Color::Red)));
        for (columns, text) in [(6, "one t\u{2026}"), (5, "one \u{2026}"), (4, "one\u{2026}"), (1, "\u{2026}")] {
            assert_eq!((of(columns).to_string().as_str(), of(columns).width()), (text, usize::from(columns)));
        }
        assert_eq!(cut(Line::from("\u{6b65}\u{884c}"), 3).to_string(), "\u{6b65}\u{2026}");
    }
}
