//! The live screen of `footfall walk`: a gait in real time, with keys to change, stop and resume it.

use cpg_core::Generator;
use cpg_core::gait::named::Gait;
use joint_units::{Joint, Radians};
use ratatui::Frame;
use ratatui::crossterm::event::{self, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Wrap};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::failure::Failure;
use crate::gait_player::asked_speed::AskedSpeed;
use crate::gait_player::{Change, GaitPlayer, State};
use crate::view::cut::cut;

/// How much of the past is shown, seconds.
const PAST_S: f64 = 4.0;

/// Time between two frames.
const FRAME: Duration = Duration::from_millis(33);

/// Ticks between two points of the curves.
const POINT_TICKS: u32 = 10;

/// The longest time that the gait advances between two frames.
const LONGEST_FRAME: Duration = Duration::from_millis(250);

/// Smallest terminal that shows everything; on a smaller one there is text only.
const LEAST: (u16, u16) = (80, 24);

/// Keys from one whole speed to the next.
const SPEED_KEYS: f32 = 20.0;

const KEYS: &str = " left, right: gait   + -: speed   space: stop, start   q: end";

/// A point of the past: seconds, degrees, degrees per second.
type Point = (f64, [f64; 4], [f64; 4]);

/// The gait and what is shown of it.
struct Live {
    player: GaitPlayer,
    past: VecDeque<Point>,
    /// What the last key did that was not asked for, or why it had no effect.
    note: String,
}

/// Meaning of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Next,
    Previous,
    Faster,
    Slower,
    Stop,
    End,
}

impl Live {
    fn new(player: GaitPlayer) -> Self {
        let mut live = Self { player, past: VecDeque::new(), note: String::new() };
        live.remember();
        live
    }

    /// Plays the gait up to this time.
    fn advance(&mut self, until_s: f64) -> Result<(), Failure> {
        while self.player.t_s() < until_s {
            self.player.make_due_changes()?;
            self.player.step();
            if self.player.tick().is_multiple_of(POINT_TICKS) {
                self.remember();
            }
        }
        Ok(())
    }

    fn remember(&mut self) {
        let t = self.player.t_s();
        let angles = self.player.motion().angles().map(|angle| f64::from(angle.degrees()));
        let rates = self.player.motion().rates().map(|rate| f64::from(rate.0.to_degrees()));
        self.past.push_back((t, angles, rates));
        while self.past.front().is_some_and(|first| first.0 < t - PAST_S) {
            self.past.pop_front();
        }
    }

    /// Acts on a key; false if the run ends.
    fn press(&mut self, key: Key) -> bool {
        let place = Gait::ALL.iter().position(|gait| *gait == self.player.gait()).unwrap_or(0);
        let gait = |by: usize| Gait::ALL[(place + by) % Gait::ALL.len()];
        let speed = |keys: f32| {
            // In whole keys, so that up and down again gives the same speed.
            let wanted = ((self.player.speed() * SPEED_KEYS).round() + keys) / SPEED_KEYS;
            let (least, most) = AskedSpeed::Factor(wanted).allowed(self.player.gait());
            (Change::Speed(AskedSpeed::Factor(wanted.clamp(least, most))), least, most)
        };
        let change = match key {
            Key::End => return false,
            Key::Next => Change::To(gait(1)),
            Key::Previous => Change::To(gait(Gait::ALL.len() - 1)),
            Key::Faster | Key::Slower => {
                let (change, least, most) = speed(if key == Key::Faster { 1.0 } else { -1.0 });
                if change == Change::Speed(AskedSpeed::Factor(self.player.speed())) {
                    self.note = format!("{} allows speeds from {least} to {most}", self.player.gait().name());
                    return true;
                }
                change
            }
            Key::Stop if self.player.state() == State::Walking => Change::Stop,
            Key::Stop => Change::Start,
        };
        let note = self.player.change(change);
        self.note = note.unwrap_or_else(|failure| Some(failure.to_string())).unwrap_or_default();
        true
    }
}

/// Shows the gait until a key, a signal or `secs` ends it.
pub(crate) fn run(player: GaitPlayer, secs: Option<f32>, interrupt: &AtomicBool) -> Result<(), Failure> {
    let mut terminal =
        ratatui::try_init().map_err(|error| Failure::run(format!("the screen cannot be opened: {error}")))?;
    let mut live = Live::new(player);
    let end_s = secs.map_or(f64::INFINITY, f64::from);
    let (mut now_s, mut seen) = (0.0, Instant::now());
    let shown = loop {
        // After a suspended terminal the missed time is not made up.
        now_s += seen.elapsed().min(LONGEST_FRAME).as_secs_f64();
        seen = Instant::now();
        if interrupt.load(Ordering::Relaxed) || now_s >= end_s {
            break Ok(());
        }
        if let Err(failure) = live.advance(now_s) {
            break Err(failure);
        }
        match terminal.draw(|frame| draw(frame, &live)).and_then(|_| key()) {
            Ok(Some(key)) if !live.press(key) => break Ok(()),
            Ok(_) => {}
            Err(error) => break Err(Failure::run(error)),
        }
    };
    let restored = ratatui::try_restore().map_err(Failure::run);
    shown.and(restored)
}

/// The meaning of the next key that is pressed before the next frame.
fn key() -> std::io::Result<Option<Key>> {
    let until = Instant::now() + FRAME;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if !event::poll(left)? {
            return Ok(None);
        }
        if let event::Event::Key(key) = event::read()?
            && let Some(meaning) = meaning(&key)
        {
            return Ok(Some(meaning));
        }
    }
}

fn meaning(key: &KeyEvent) -> Option<Key> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    match key.code {
        KeyCode::Right => Some(Key::Next),
        KeyCode::Left => Some(Key::Previous),
        KeyCode::Char('+' | '=') | KeyCode::Up => Some(Key::Faster),
        KeyCode::Char('-' | '_') | KeyCode::Down => Some(Key::Slower),
        KeyCode::Char(' ') => Some(Key::Stop),
        KeyCode::Char('q') | KeyCode::Esc => Some(Key::End),
        // In raw mode the terminal sends no signal.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::End),
        _ => None,
    }
}

fn draw(frame: &mut Frame<'_>, live: &Live) {
    let area = frame.area();
    let player = &live.player;
    let state = match player.state() {
        State::Walking if player.motion().is_changing() => String::from(" changing "),
        state => format!(" {} ", state.name()),
    };
    let numbers = format!(
        " {}   speed {:.2}   stride {:.2} s   t {:.2} s   phase {:.2}",
        player.gait().name(),
        player.speed(),
        player.gait().stride_s() / player.speed(),
        player.t_s(),
        player.motion().phase().cycles(),
    );
    if area.width < LEAST.0 || area.height < LEAST.1 {
        let angles = player.motion().angles().map(Radians::degrees);
        let joints: Vec<String> =
            Joint::ALL.iter().zip(angles).map(|(joint, angle)| format!("{} {angle:.1} deg", joint.name())).collect();
        let text = format!("{state}{numbers}\n{}\n{KEYS}", joints.join("\n"));
        frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), area);
        return;
    }
    let [head, hips, knees, keys] =
        Layout::vertical([Constraint::Length(2), Constraint::Fill(1), Constraint::Fill(1), Constraint::Length(1)])
            .areas(area);
    let colour = if player.state() == State::Walking { Color::Green } else { Color::Yellow };
    let style = Style::new().fg(Color::Black).bg(colour).add_modifier(Modifier::BOLD);
    let first = Line::from(vec![Span::raw(" "), Span::styled(state, style), Span::raw(numbers)]);
    let lines = [first, Line::from(format!(" {}", live.note))].map(|line| cut(line, head.width));
    frame.render_widget(Paragraph::new(lines.to_vec()), head);
    for (row, joints) in [(hips, [0, 1]), (knees, [2, 3])] {
        let columns = [Constraint::Fill(3), Constraint::Fill(3), Constraint::Fill(2), Constraint::Fill(2)];
        let [a, b, c, d] = Layout::horizontal(columns).areas(row);
        over_time(frame, a, live, joints[0]);
        over_time(frame, b, live, joints[1]);
        portrait(frame, c, live, joints[0]);
        portrait(frame, d, live, joints[1]);
    }
    frame.render_widget(cut(Line::from(KEYS), keys.width).style(Style::new().add_modifier(Modifier::DIM)), keys);
}

/// Whole tens around the values, so that the axis changes seldom.
fn tens(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (least, most) = values.fold((0.0, 10.0), |(l, m): (f64, f64), y| (l.min(y), m.max(y)));
    [(least / 10.0).floor() * 10.0, (most / 10.0).ceil() * 10.0]
}

fn over_time(frame: &mut Frame<'_>, area: Rect, live: &Live, joint: usize) {
    let points: Vec<(f64, f64)> = live.past.iter().map(|(t, angles, _)| (*t, angles[joint])).collect();
    let now = points.last().map_or(0.0, |point| point.1);
    let end = live.player.t_s().max(PAST_S);
    let title = format!(" {} {now:.1} deg ", Joint::ALL[joint].name());
    chart(frame, area, title, Color::Magenta, &points, [end - PAST_S, end], tens(points.iter().map(|p| p.1)));
}

fn portrait(frame: &mut Frame<'_>, area: Rect, live: &Live, joint: usize) {
    let points: Vec<(f64, f64)> = live.past.iter().map(|(_, angles, rates)| (angles[joint], rates[joint])).collect();
    let (x, y) = (tens(points.iter().map(|p| p.0)), tens(points.iter().map(|p| p.1)));
    chart(frame, area, " deg/s over deg ".into(), Color::Cyan, &points, x, y);
}

fn chart(
    frame: &mut Frame<'_>,
    area: Rect,
    title: String,
    colour: Color,
    points: &[(f64, f64)],
    x: [f64; 2],
    y: [f64; 2],
) {
    let data = Dataset::default()
        .marker(Marker::Braille)
        .graph_type(GraphType::Line)
        .style(Style::new().fg(colour))
        .data(points);
    let chart = Chart::new(vec![data])
        .block(Block::bordered().title(cut(Line::from(title), area.width.saturating_sub(2))))
        .x_axis(Axis::default().bounds(x))
        .y_axis(Axis::default().bounds(y).labels(y.map(|end| format!("{end:.0}"))));
    frame.render_widget(chart, area);
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn live(gait: Gait, changes: Vec<(f32, Change)>) -> Live {
        Live::new(GaitPlayer::build(gait, AskedSpeed::Factor(1.0), changes).unwrap())
    }

    fn shown(live: &Live, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, live)).unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn the_screen_shows_the_gait_its_numbers_and_curves() {
        let mut live = live(Gait::NaturalWalk, vec![]);
        live.advance(4.5).unwrap();
        let screen = shown(&live, 100, 30);
        let hip = format!("left_hip {:.1} deg", live.player.motion().angles()[0].degrees());
        for words in
            ["walking", "natural-walk", "speed 1.00", "stride 1.08 s", "t 4.50 s", &hip, "right_knee", "q: end"]
        {
            assert!(screen.contains(words), "no `{words}` in\n{screen}");
        }
        assert!(screen.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count() > 200, "{screen}");
        for (width, height) in [(80, 24), (79, 24), (40, 10), (1, 1)] {
            shown(&live, width, height);
        }
        assert!(shown(&live, 60, 12).contains("left_knee"));
    }

    #[test]
    fn keys_change_gait_and_speed_stop_and_go_on() {
        let mut live = live(Gait::Walk, vec![]);
        live.advance(1.0).unwrap();
        assert!(live.press(Key::Next));
        assert_eq!(live.player.gait(), Gait::NaturalWalk);
        assert!(live.press(Key::Previous) && live.press(Key::Previous));
        assert_eq!(live.player.gait(), Gait::ALL[Gait::ALL.len() - 1]);
        assert!(live.press(Key::Next));
        for _ in 0..30 {
            assert!(live.press(Key::Faster));
        }
        assert_eq!((live.player.gait(), live.player.speed()), (Gait::Walk, 1.5));
        // The natural walk is fast at the knees.
        let said = "natural-walk at speed 1.078, the nearest to 1.5 that it allows";
        assert!(live.press(Key::Next) && live.note == said, "{}", live.note);
        assert_eq!((live.player.gait(), live.player.speed()), (Gait::NaturalWalk, 1.078));
        assert!(
            live.press(Key::Faster) && live.note == "natural-walk allows speeds from 0.5 to 1.078",
            "{}",
            live.note
        );
        assert_eq!(live.player.speed(), 1.078);
        // The speed that was asked for is not forgotten.
        assert!(
            live.press(Key::Previous) && live.note == "walk at speed 1.5 again, as asked for before",
            "{}",
            live.note
        );
        assert!(live.press(Key::Next));
        for _ in 0..40 {
            assert!(live.press(Key::Slower));
        }
        assert_eq!(live.player.speed(), 0.5);
        assert!(live.press(Key::Stop));
        assert!(shown(&live, 100, 30).contains("stopping"));
        live.advance(4.0).unwrap();
        assert!(shown(&live, 100, 30).contains("standing"));
        assert_eq!(live.player.motion().rates().map(|rate| rate.0), [0.0; 4]);
        // A speed does not start it.
        assert!(live.press(Key::Faster) && live.note == "speed 0.55 is kept for the next start", "{}", live.note);
        live.advance(4.5).unwrap();
        assert_eq!(live.player.motion().rates().map(|rate| rate.0), [0.0; 4]);
        assert!(live.press(Key::Stop));
        live.advance(5.0).unwrap();
        assert!(live.player.motion().rates().iter().any(|rate| rate.0 != 0.0));
        assert!(live.note.is_empty() && !live.press(Key::End));
    }

    #[test]
    fn planned_changes_happen() {
        let mut live = live(Gait::Walk, vec![(1.0, Change::To(Gait::from_name("run").unwrap())), (2.0, Change::Stop)]);
        live.advance(1.5).unwrap();
        assert_eq!((live.player.gait().name(), live.player.state()), ("run", State::Walking));
        live.advance(2.5).unwrap();
        assert_eq!(live.player.state(), State::Stopping);
    }

    #[test]
    fn keys_mean_what_the_last_line_says() {
        let pressed = |code| meaning(&KeyEvent::new(code, KeyModifiers::NONE));
        assert_eq!(pressed(KeyCode::Right), Some(Key::Next));
        assert_eq!(pressed(KeyCode::Char('+')), Some(Key::Faster));
        assert_eq!(pressed(KeyCode::Char('-')), Some(Key::Slower));
        assert_eq!(pressed(KeyCode::Char(' ')), Some(Key::Stop));
        assert_eq!(pressed(KeyCode::Char('q')), Some(Key::End));
        assert_eq!(pressed(KeyCode::Char('c')), None);
        assert_eq!(meaning(&KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL)), Some(Key::End));
    }
}
