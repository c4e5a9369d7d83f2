//! The live screen: measured angles, four setpoints, four pulses, the state of the loop, the log, and the keys that change the board.

use crate::view::angle_chart::chart;
use crate::view::cut::cut;
use crate::view::state::{View, Watched};
use crate::view::warnings::short;
use joint_loop::{SENSORS, SupervisorState};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders, Gauge, Paragraph, Wrap};
use wire::Warnings;

/// Smallest terminal with charts; on a smaller one there is text only.
pub const LEAST: (u16, u16) = (80, 24);

const SERVOS: [&str; 4] = ["left hip", "right hip", "left knee", "right knee"];

/// Range of the pulses of a hobby servo, in microseconds.
const PULSE_RANGE_US: [u16; 2] = [500, 2500];

const SENSOR_COLOURS: [Color; SENSORS] = [Color::Cyan, Color::Yellow, Color::Green, Color::Red];

const SHADOW: &str = " SHADOW MODE: outputs off, pulses as they would be ";

/// Draws the view.
pub fn draw(frame: &mut Frame<'_>, view: &View) {
    let area = frame.area();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        let text = format!("{}\n{}", crate::view::plain::line(view), keys(view));
        frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), area);
        return;
    }
    let tuning = if view.tuning.is_some() { 2 } else { 0 };
    // Charts come first on a small terminal, and a tall one shows more of the log.
    let log_rows = match area.height {
        ..30 => 4 - tuning,
        30..=40 => 4,
        _ => 8,
    };
    let [head, measured, setpoints, pulses, tune, log, help] = Layout::vertical([
        Constraint::Length(if view.counters.following.is_some() { 4 } else { 3 }),
        Constraint::Fill(2),
        Constraint::Fill(2),
        Constraint::Length(4),
        Constraint::Length(tuning),
        Constraint::Length(log_rows),
        Constraint::Length(1),
    ])
    .areas(area);
    header(frame, head, view);
    measured_angle(frame, measured, view);
    for (joint, area) in Layout::horizontal([Constraint::Fill(1); 4]).split(setpoints).iter().enumerate() {
        setpoint(frame, *area, view, joint);
    }
    for (servo, area) in Layout::vertical([Constraint::Length(1); 4]).split(pulses).iter().enumerate() {
        pulse(frame, *area, view, servo);
    }
    if let Some(tuning) = &view.tuning {
        let [value, last] = tuning.lines();
        let name = Span::styled(" change ", Style::new().add_modifier(Modifier::REVERSED));
        let lines =
            vec![Line::from(vec![name, Span::raw(format!(" {value}"))]), Line::from(format!("         {last}"))];
        frame.render_widget(cut_all(lines, tune), tune);
    }
    let shown = usize::from(log.height.saturating_sub(1));
    let lines: Vec<Line<'_>> =
        view.log.iter().skip(view.log.len().saturating_sub(shown)).map(|line| Line::from(line.as_str())).collect();
    let block = Block::new().borders(Borders::TOP).title(" log ");
    frame.render_widget(cut_all(lines, log).block(block), log);
    frame.render_widget(cut(Line::from(keys(view)), help.width).style(Style::new().add_modifier(Modifier::DIM)), help);
}

/// The keys that have an effect.
fn keys(view: &View) -> &'static str {
    match (view.watched, view.tuning.is_some()) {
        (Watched::Virtual, false) => " space: hold the button 0.5 s (after a boot: test the emergency stop)   q: end",
        (Watched::Virtual, true) => " space: hold button 0.5 s  up/down, left/right: change  u: undo  s: stop  q: end",
        (Watched::Board, true) => " up/down: parameter  left/right: change  u: undo  s: stop  q: end; no key arms",
        (Watched::Board, false) => " q: end   (nothing can be changed here: that takes the serial port)",
    }
}

fn header(frame: &mut Frame<'_>, area: Rect, view: &View) {
    let silent = view.silent_since_s();
    let tick = view.last.as_ref().filter(|_| silent.is_none());
    let state = tick.map(|tick| tick.state);
    let none = silent.map_or("no frame yet".into(), |since| format!("no frame since {since:.2} s"));
    let colour = match state {
        Some(SupervisorState::Walking) => Color::Green,
        Some(SupervisorState::Arming | SupervisorState::Stopping) => Color::Yellow,
        Some(SupervisorState::Fault) => Color::Red,
        _ => Color::Gray,
    };
    let counted = |of: fn(&wire::Frame) -> u32| tick.map_or("-".into(), |tick| of(tick).to_string());
    let rate = match view.watched {
        Watched::Virtual => format!("   {} Hz", view.tick_rate_hz().map_or("-".into(), |rate| format!("{rate:.0}"))),
        Watched::Board => String::new(),
    };
    let boots = match (view.watched, view.boots) {
        (Watched::Board, 0) => "no boot seen".into(),
        (Watched::Board, boots) => format!("boots seen {boots} ({})", view.boot_cause),
        (Watched::Virtual, boots) => format!("boots {boots} ({})", view.boot_cause),
    };
    let first = Line::from(vec![
        Span::raw(" "),
        Span::styled(
            format!(" {} ", state.map_or(none, |state| state.name().to_owned())),
            Style::new().fg(Color::Black).bg(colour).add_modifier(Modifier::BOLD),
        ),
        Span::raw(format!(
            "  t {:.2} s   tick {}{rate}   late {}   missed {}   {boots}",
            view.t_s,
            counted(|tick| tick.tick),
            counted(|tick| tick.late),
            counted(|tick| tick.missed),
        )),
    ]);
    let shadow = if view.counters.shadow { SHADOW } else { "" };
    let title = Line::from(vec![
        Span::styled(shadow, Style::new().fg(Color::Black).bg(Color::Cyan)),
        Span::raw(format!(" {}", view.title)),
    ]);
    let third = view.following().map(|words| Line::from(format!(" following: {words}")));
    let lines = [Some(title.style(Style::new().add_modifier(Modifier::BOLD))), Some(first), Some(second(view)), third];
    frame.render_widget(cut_all(lines.into_iter().flatten(), area), area);
}

/// The lines, each as wide as its place allows.
fn cut_all<'l>(lines: impl IntoIterator<Item = Line<'l>>, area: Rect) -> Paragraph<'l> {
    Paragraph::new(lines.into_iter().map(|line| cut(line, area.width)).collect::<Vec<_>>())
}

/// What is wrong with the connection, or the comparison with the host, the load and the environment.
fn second(view: &View) -> Line<'_> {
    if let Some(alarm) = &view.alarm {
        return Line::styled(format!(" {alarm}"), Style::new().fg(Color::Black).bg(Color::Yellow));
    }
    let books = match view.watched {
        Watched::Virtual => format!("host replay: {}  frames lost {}", view.replay(), view.counters.lost_lines),
        Watched::Board => format!("damaged frames {}", view.counters.malformed),
    };
    let unit = view.cost_unit.word();
    let cost = view.cost.map_or(String::new(), |cost| {
        format!("  longest tick {} {unit}  stack {} B", cost.longest_cycles, cost.stack_used)
    });
    let die =
        view.environment.and_then(|means| means.die_c).map_or(String::new(), |die| format!("  die {die:.0} \u{b0}C"));
    let supply =
        view.environment.and_then(|means| means.supply_v).map_or(String::new(), |supply| format!("  {supply:.2} V"));
    let dips = view.conditions.map_or(0, |conditions| conditions.supply_dips);
    let dips = if dips == 0 { String::new() } else { format!("  {dips} dips of the supply") };
    let debugger = if view.environment.is_some_and(|chip| chip.debugger) { "  debugger attached" } else { "" };
    let warnings = view.environment.map_or(Warnings::NONE, |chip| chip.warnings);
    let warnings: String = warnings.each().map(|one| format!(" ! {}", short(one))).collect();
    let watchdog = view.environment.and_then(|chip| chip.watchdog_hz);
    let watchdog = watchdog.map_or(String::new(), |hz| format!("  watchdog {:.1} kHz", f64::from(hz) / 1000.0));
    let rest = format!(" {books}{debugger}{supply}{dips}{die}{watchdog}{cost}");
    Line::from(vec![
        Span::styled(warnings, Style::new().fg(Color::Yellow).add_modifier(Modifier::BOLD)),
        Span::raw(rest),
    ])
}

fn measured_angle(frame: &mut Frame<'_>, area: Rect, view: &View) {
    let present = view.last.map_or(1, |tick| tick.sensors.iter().flatten().count());
    let count = if view.sensors.is_empty() { present } else { view.sensors.len() };
    let now = view.last.as_ref().map_or(" measured joint angle ".into(), |tick| {
        let words = tick.sensors.iter().enumerate().filter_map(|(channel, sensor)| {
            sensor.map(|sensor| {
                format!("{} {:.1} deg ({})", view.sensor_name(channel), sensor.angle_deg(), sensor.validity)
            })
        });
        format!(" measured {} ", words.collect::<Vec<_>>().join(", "))
    });
    chart(frame, area, &view.past, now, &SENSOR_COLOURS[..count], view.scales.0, |point| {
        point.measured[..count].to_vec()
    });
}

fn setpoint(frame: &mut Frame<'_>, area: Rect, view: &View, joint: usize) {
    let name = SERVOS[joint];
    let now = view
        .last
        .as_ref()
        .map_or(format!(" {name} "), |tick| format!(" {name} {:.1}\u{b0} ", tick.setpoints_deg()[joint]));
    chart(frame, area, &view.past, now, &[Color::Magenta], view.scales.1[joint], |point| vec![point.set[joint]]);
}

/// A bar between the limits of the servo, which stand at its ends.
fn pulse(frame: &mut Frame<'_>, area: Rect, view: &View, servo: usize) {
    let [least, most] = view.pulse_limits_us.map_or(PULSE_RANGE_US, |limits| limits[servo]);
    let widths = [Constraint::Length(12), Constraint::Length(5), Constraint::Fill(1), Constraint::Length(8)];
    let [name, low, bar, high] = Layout::horizontal(widths).areas(area);
    frame.render_widget(Line::from(format!(" {}", SERVOS[servo])), name);
    frame.render_widget(Line::from(format!("{least:>4} ")), low);
    frame.render_widget(Line::from(format!(" {most:>4} us")), high);
    let us = view.pulse_us(servo);
    let (least, most) = (f64::from(least), f64::from(most));
    let ratio = us.map_or(0.0, |us| ((us - least) / (most - least)).clamp(0.0, 1.0));
    let label = us.map_or("no pulse".into(), |us| format!("{us:.0} us"));
    frame.render_widget(Gauge::default().ratio(ratio).label(label).gauge_style(Style::new().fg(Color::Blue)), bar);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::counters::{Counters, Following};
    use crate::board::default_loop::typical_loop;
    use crate::board::run::Event;
    use hgod_adc::Validity;
    use joint_units::{Joint, Radians};
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn sensor(deg: f32, validity: Validity) -> wire::Reading {
        wire::Reading { angle_rad: Radians::from_degrees(deg).0, validity }
    }

    fn tick(n: u32) -> wire::Frame {
        wire::Frame {
            tick: n,
            seq: n,
            state: SupervisorState::Walking,
            setpoints_rad: [11.5, -12.5, 33.5, 44.5].map(|deg| Radians::from_degrees(deg).0),
            pulses_us: [1500, 1600, 1700, 1800],
            late: 3,
            missed: 7,
            ..wire::Frame::from(&typical_loop().unwrap().frame())
        }
    }

    fn view(ticks: u32) -> View {
        let mut view = View::titled("footfall watch".into(), vec![Joint::LeftKnee]);
        let counters = Counters { compared: u64::from(ticks), ..Counters::default() };
        view.take(&Event::Booted { t_s: 0.0, cause: "power_on".into() }, &counters);
        for n in 1..=ticks {
            let mut tick = tick(n * 10);
            tick.sensors[0] = Some(sensor((n % 60) as f32 + 0.5, Validity::Good));
            let t_s = f64::from(n) * 0.01;
            view.take(&Event::Tick { t_s, tick }, &counters);
            view.take(&Event::Pulses { t_s, us: [Some(1501.0), Some(1602.0), Some(1703.0), Some(1804.0)] }, &counters);
        }
        view.take(&Event::Log { t_s: view.t_s, level: "info".into(), text: "hello from the board".into() }, &counters);
        view
    }

    fn shown(view: &View, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, view)).unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn everything_that_is_promised_is_on_the_screen() {
        let screen = shown(&view(200), 100, 30);
        for words in [
            "measured left knee 20.5 deg (good)",
            "left hip 11.5\u{b0}",
            "right hip -12.5\u{b0}",
            "left knee 33.5\u{b0}",
            "right knee 44.5\u{b0}",
            "1501 us",
            "1602 us",
            "1703 us",
            "1804 us",
            "1000 Hz",
            "tick 2000",
            "late 3",
            "missed 7",
            "walking",
            "boots 1 (power_on)",
            "host replay: equal in 200 lines",
            "hello from the board",
            "q: end",
            // The ends of the axes of angle and time, and the limits of the pulses.
            " 90│",
            "-30│",
            "-4 s",
            "500 ",
            "2500 us",
        ] {
            assert!(screen.contains(words), "no `{words}` in\n{screen}");
        }
        // The curve of the measured angle is drawn in dots of Braille.
        assert!(screen.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count() > 100, "{screen}");
    }

    #[test]
    fn a_virtual_board_counts_instructions_and_a_board_cycles() {
        let cost = wire::Cost {
            longest_cycles: 6058,
            latest_start_us: 80,
            dropped: 0,
            stack_used: 4000,
            stack_size: 9000,
            truncated: 0,
        };
        use crate::view::state::CostUnit::{Cycles, Either, Instructions};
        let screen = |cost_unit| shown(&View { cost_unit, cost: Some(cost), ..view(200) }, 140, 30);
        for (unit, right, wrong) in
            [(Instructions, "6058 instructions", "cycles"), (Cycles, "6058 cycles", "instructions")]
        {
            assert!(screen(unit).contains(right) && !screen(unit).contains(wrong), "{}", screen(unit));
        }
        assert!(screen(Either).contains("6058 cycles (on a virtual board instructions)"), "{}", screen(Either));
    }

    #[test]
    fn the_smallest_full_screen_and_smaller_ones_hold() {
        let (width, height) = LEAST;
        let screen = shown(&view(50), width, height);
        assert!(screen.contains("measured left knee") && screen.contains("right knee 44.5\u{b0}"), "{screen}");
        // The charts of the setpoints have four rows here.
        let scales = [" 60", " 30", "  0", "-30"].map(|mark| screen.matches(&format!("{mark}\u{2502}")).count());
        assert!(scales.iter().all(|count| *count >= 4), "{scales:?}\n{screen}");
        let long = View { title: "a walk ".repeat(20), ..view(50) };
        let first = shown(&long, width, height);
        let first = first.lines().next().expect("a line").trim_matches('"').to_owned();
        assert!(first.ends_with('\u{2026}') && first.chars().count() == usize::from(width), "{first}");
        for (width, height) in [(79, 24), (40, 10), (10, 3), (1, 1)] {
            shown(&view(50), width, height);
        }
        assert!(shown(&view(50), 79, 23).contains("walking"));
    }

    #[test]
    fn a_line_at_zero_is_beside_its_mark() {
        let screen = shown(&view(200), 120, 40);
        let row = screen.lines().find(|line| line.contains("  0\u{2502}")).expect("a zero");
        assert!(row.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count() > 80, "{row}");
    }

    #[test]
    fn a_board_that_says_nothing_yet_is_shown_as_such() {
        let screen = shown(&View::default(), 100, 30);
        assert!(screen.contains("no frame yet") && screen.contains("no pulse"), "{screen}");
    }

    #[test]
    fn in_shadow_the_would_be_pulses_and_the_phase_error_are_shown() {
        let mut view = view(200);
        let following = Following {
            state: "locked",
            fault: None,
            confidence: 0.875,
            stride_s: 1.125,
            phase_error_deg: -3.25,
            locked_at_s: Some(1.5),
        };
        view.counters.shadow = true;
        view.counters.following = Some(following);
        view.pins_us = [None; 4];
        let screen = shown(&view, 100, 30);
        for words in
            ["SHADOW MODE: outputs off", "following: locked", "phase error -3.2 deg", "1600 us", "footfall watch"]
        {
            assert!(screen.contains(words), "no `{words}` in\n{screen}");
        }
        assert!(!screen.contains("no pulse"), "{screen}");
    }

    /// On the smallest screen too: they stand before what may be cut off.
    #[test]
    fn what_the_board_warns_of_is_on_the_screen() {
        let mut view = view(50);
        let warnings = Warnings::UNSEALED.with(Warnings::BROWN_OUT).with(Warnings::BUILT_IN_ROBOT);
        let chip = wire::Environment { die_c: None, supply_v: None, watchdog_hz: None, debugger: true, warnings };
        view.take(&Event::Environment(chip), &Counters::default());
        let screen = shown(&view, LEAST.0, LEAST.1);
        assert!(screen.contains("! no seal ! brown-out level ! built-in robot"), "{screen}");
        assert!(!screen.contains("faults halt"), "{screen}");
    }

    #[test]
    fn four_sensors_are_four_curves_with_their_names() {
        let mut view = View::titled("four".into(), Joint::ALL.to_vec());
        for n in 1..=100 {
            let good = Validity::Good;
            let sensors = [(11.0, good), (22.0, good), (33.0, Validity::Open), (44.0, good)];
            let tick = wire::Frame { sensors: sensors.map(|(deg, validity)| Some(sensor(deg, validity))), ..tick(n) };
            view.take(&Event::Tick { t_s: f64::from(n) * 0.01, tick }, &Counters::default());
        }
        let screen = shown(&view, 140, 40);
        for words in
            ["left hip 11.0 deg (good)", "left knee 33.0 deg (open)", "right knee 44.0 deg (good)", " 90│", "  0│"]
        {
            assert!(screen.contains(words), "no `{words}` in\n{screen}");
        }
    }

    #[test]
    fn pulses_that_stop_are_not_shown_any_longer() {
        let mut view = view(200);
        view.take(&Event::Status { t_s: view.t_s + 0.1 }, &Counters::default());
        let screen = shown(&view, 100, 30);
        assert!(screen.contains("no pulse") && !screen.contains("1501 us"), "{screen}");
    }
}
