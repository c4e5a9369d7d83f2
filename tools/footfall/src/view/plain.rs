//! A run as lines of text for terminals and logs, and as JSON for programs.

use crate::board::run::Event;
use crate::board::run_result::RunResult;
use crate::view::state::{View, Watched};
use serde_json::{Value, json};
use wire::{Frame, Reading};

/// The present state in one line.
#[must_use]
pub fn line(view: &View) -> String {
    let t_s = view.t_s;
    if let Some(since) = view.silent_since_s() {
        return format!("{t_s:8.3} s  no frame since {since:.3} s, state unknown");
    }
    let Some(tick) = &view.last else { return format!("{t_s:8.3} s  no frame yet") };
    let Frame { tick: n, state, late, missed, .. } = tick;
    let [s0, s1, s2, s3] = tick.setpoints_deg();
    // A board that runs by itself has no clock beside its own to compare with.
    let rate = match view.watched {
        Watched::Virtual => view.tick_rate_hz().map_or("     - Hz".into(), |rate| format!("  {rate:4.0} Hz")),
        Watched::Board => String::new(),
    };
    let pulse = |us: Option<f64>| us.map_or("   -".into(), |us| format!("{us:4.0}"));
    let pulses = match view.watched {
        Watched::Virtual => view.pins_us,
        Watched::Board => [0, 1, 2, 3].map(|servo| view.pulse_us(servo)),
    };
    let [p0, p1, p2, p3] = pulses.map(pulse);
    let reading = |sensor: &Reading| format!("sensor {:6.1} deg {}  ", sensor.angle_deg(), sensor.validity);
    let sensors: String = tick.sensors.iter().flatten().map(reading).collect();
    let shadow = if view.counters.shadow { "  shadow" } else { "" };
    let following = view.following().map_or(String::new(), |words| format!("  following {words}"));
    format!(
        "{t_s:8.3} s  {:<8}  tick {n:>6}{rate}  late {late}  missed {missed}  {sensors}\
         set {s0:6.1} {s1:6.1} {s2:6.1} {s3:6.1} deg  pulse {p0} {p1} {p2} {p3} us{shadow}{following}",
        state.name()
    )
}

/// The present state as an object.
#[must_use]
pub fn object(view: &View) -> Value {
    let silent = view.silent_since_s();
    let Some(tick) = view.last.as_ref().filter(|_| silent.is_none()) else {
        return json!({ "type": "tick", "t_s": view.t_s, "state": null, "no_frame_since_s": silent });
    };
    json!({
        "type": "tick",
        "t_s": view.t_s,
        "tick": tick.tick,
        "state": tick.state.name(),
        "tick_rate_hz": view.tick_rate_hz(),
        "late_ticks": tick.late,
        "missed_ticks": tick.missed,
        "measured_deg": tick.sensors[0].map_or(0.0, |sensor| sensor.angle_deg()),
        "validity": tick.sensors[0].map(|sensor| sensor.validity.name()),
        "sensors": sensors(view, tick),
        "shadow": view.counters.shadow,
        "watchdog_hz": view.environment.and_then(|chip| chip.watchdog_hz),
        "debugger": view.environment.map(|chip| chip.debugger),
        "warnings": view.environment.map(|chip| chip.warnings.names().collect::<Vec<_>>()),
        "supply_dips": view.conditions.map(|conditions| conditions.supply_dips),
        "following": view.counters.following,
        "setpoint_deg": tick.setpoints_deg(),
        "pulse_us": view.pins_us,
        "commanded_us": tick.pulses_us,
        "limited": tick.limited,
        "seq": tick.seq,
        "setpoint_hash": format!("{:016x}", tick.setpoint_hash),
    })
}

/// All sensors; those of a joint that is not known have its channel alone.
fn sensors(view: &View, tick: &Frame) -> Vec<Value> {
    let count = if view.sensors.is_empty() { tick.sensors.iter().flatten().count() } else { view.sensors.len() };
    let readings = tick.sensors.iter().take(count).enumerate();
    readings
        .map(|(channel, sensor)| {
            let joint = view.sensors.get(channel).map(|joint| joint.name());
            let deg = sensor.map_or(0.0, |sensor| sensor.angle_deg());
            let validity = sensor.map(|sensor| sensor.validity.name());
            // Counts since the boot: a fault between two lines is in them.
            let counts = view.conditions.and_then(|conditions| conditions.sensors[channel]);
            let changes = counts.map(|counts| counts.changes);
            let not_good_ms = counts.map(|counts| counts.counts().not_good().0);
            json!({
                "channel": channel + 1,
                "joint": joint,
                "deg": deg,
                "validity": validity,
                "validity_changes": changes,
                "not_good_ms": not_good_ms,
            })
        })
        .collect()
}

/// An event that is printed at once, as a line.
#[must_use]
pub fn event_line(event: &Event) -> Option<String> {
    match event {
        Event::Booted { t_s, cause } => Some(format!("{t_s:8.3} s  boot: {cause}")),
        Event::Log { t_s, level, text } => Some(format!("{t_s:8.3} s  log: {level} {text}")),
        Event::Remark { kind, text } => Some(format!("board: {kind} {text}")),
        _ => None,
    }
}

/// The same as an object.
#[must_use]
pub fn event_object(event: &Event) -> Option<Value> {
    match event {
        Event::Booted { t_s, cause } => Some(json!({ "type": "boot", "t_s": t_s, "cause": cause })),
        Event::Log { t_s, level, text } => Some(json!({ "type": "log", "t_s": t_s, "level": level, "text": text })),
        Event::Edge(edge) => Some(json!({ "type": "edge", "board_s": edge.time_s(), "level": u8::from(edge.high) })),
        Event::Remark { kind, text } => Some(json!({ "type": "board", "kind": kind, "text": text })),
        _ => None,
    }
}

/// The result of a run in a few lines.
#[must_use]
pub fn result(result: &RunResult) -> String {
    let servo =
        |range: &Option<[f64; 2]>| range.map_or("none".into(), |[least, most]| format!("{least:.0}..{most:.0}"));
    let pulses: Vec<String> = result.pulse_us.iter().map(servo).collect();
    let none = || "-".to_owned();
    let dark = result.never_on().map_or(String::new(), |why| format!("{why}\n"));
    let silence = result.silence().map_or(String::new(), |words| format!("{words}\n"));
    let shadow = if result.shadow { "shadow mode, outputs off; " } else { "" };
    let following = result.following.as_ref().map_or(String::new(), |following| {
        let first = following.locked_at_s.map_or("never locked".into(), |at| format!("first locked at {at:.2} s"));
        format!("following: {first}; at the end {}, stride {:.2} s\n", following.state, following.stride_s)
    });
    format!(
        "ran {:.3} virtual seconds ({}), {} boot(s), state {}\n\
         ticks {}, late {}, missed {}; unmodelled accesses {}\n\
         {shadow}pulses {} us (left hip, right hip, left knee, right knee); edges before arming {}, after disarming {}\n\
         setpoint hash: board {}, host {}: {}; {} lines and {} calls replayed, {} lines lost\n{dark}{silence}{following}",
        result.t_s,
        result.reason,
        result.boots,
        result.state,
        result.ticks,
        result.late_ticks,
        result.missed_ticks,
        result.unmodelled,
        pulses.join(" "),
        result.edges_before_arming,
        result.edges_after_disarming,
        result.setpoint_hash.clone().unwrap_or_else(none),
        result.host_replay_hash.clone().unwrap_or_else(none),
        result.host_replay,
        result.compared_lines,
        result.replayed_calls,
        result.lost_lines,
    )
}
