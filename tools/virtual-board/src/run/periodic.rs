//! Periodic jobs of a run: reports pulses, reads RTT and commands every virtual millisecond, and writes the summary at the end.

use std::io::Write;

use anyhow::Result;
use stm32f4_model::{Conversion, Lint};

use super::{BoardRun, IdleState, PERIODIC_JOB_S, ROUNDING_S};
use crate::console::ConsoleCommand;
use crate::inject::{InjectionKind, Moment};
use crate::plant::{ButtonPress, EMERGENCY_STOP};
use crate::pulses::TimedOutputChange;
use crate::report::{self, LintCount, ReportLine, RunSummary};
use crate::rtt_server;

/// Number of periodic jobs between two status lines: 100 ms.
const STATUS_EVERY: u64 = 100;
/// Number of periodic jobs between two lines of the servos: a servo frame.
const SERVOS_EVERY: u64 = 20;

fn hex_digit(four_bits: u8) -> char {
    char::from(b"0123456789abcdef"[usize::from(four_bits)])
}

impl<W: Write> BoardRun<'_, W> {
    /// Reports the new pulses, and updates the outcomes of injected faults from the outputs.
    pub(super) fn report_outputs(&mut self) {
        let now = self.moment();
        let mut board = self.cpu.machine();
        let button = board.plant.button_is_pressed(now.seconds);
        let stop = board.plant.level(EMERGENCY_STOP, now.seconds);
        let in_pulse = board.plant.pulses.any_high();
        let periods = board.plant.pulses.take_periods();
        let pulses = board.plant.pulses.take_pulses();
        let activity = board.plant.pulses.take_activity();
        let reached = board.reached.take();
        drop(board);
        self.judge.observe(now.seconds, button, stop);
        pulses.iter().for_each(|pulse| self.judge.take(pulse));
        activity.iter().for_each(|change| self.judge.change(change));
        if let Some(servos) = &mut self.servos {
            servos.take(&periods, &activity, now.seconds, in_pulse);
        }
        if let Some(driving) = &mut self.driving {
            periods.iter().for_each(|period| driving.take(period));
            activity.iter().for_each(|change| driving.change(change));
        }
        for period in periods {
            let us = period.us.map(|us| us.map(report::micros));
            self.report.line(&ReportLine::Pulses { t_s: report::seconds(period.seconds), us, rail: period.rail });
        }
        self.note_moments(&activity, reached);
        let outputs = self.output_state();
        for injection in &mut self.injections {
            if reached.is_some_and(|address| injection.kind == InjectionKind::Hang(address))
                && injection.awaits_effect()
            {
                injection.note_effect(now, outputs);
            }
            for &TimedOutputChange { seconds, instructions, change } in &activity {
                if injection.note_output(change, Moment { seconds, instructions }) {
                    self.report.line(&ReportLine::Reaction(injection.reaction(seconds)));
                }
            }
        }
    }

    /// Performs the job of each virtual millisecond. Returns a reason to end, if any.
    pub(super) fn run_periodic_job(&mut self) -> Result<Option<&'static str>> {
        let seconds = self.cpu.machine().seconds();
        if seconds + ROUNDING_S < (self.periods + 1) as f64 * PERIODIC_JOB_S {
            // Stopped for an injection.
            return Ok(None);
        }
        self.periods += 1;
        self.trace_millisecond();
        self.cpu.machine().check_outputs();
        self.drift(seconds);
        if self.periods.is_multiple_of(self.options.rtt_every) {
            self.drain_rtt();
        }
        self.exchange_rtt();
        self.exchange_serial()?;
        self.record_signals()?;
        self.report_lints();
        while let Some(command) = self.console.poll() {
            match command {
                ConsoleCommand::Press => self.cpu.machine().plant.hold_button(true),
                ConsoleCommand::Release => self.cpu.machine().plant.hold_button(false),
                ConsoleCommand::Hold => self.cpu.machine().plant.press_deliberately(seconds),
                ConsoleCommand::Stop => self.cpu.machine().plant.press_emergency_stop(ButtonPress::short(seconds)),
                ConsoleCommand::Power => self.cpu.machine().soc.cycle_power(),
                ConsoleCommand::Reset => {
                    let soc = &mut self.cpu.machine().soc;
                    soc.pull_reset_pin(true);
                    soc.pull_reset_pin(false);
                }
                ConsoleCommand::Wire(wires) => self.cpu.machine().plant.wire(wires),
                ConsoleCommand::Inject(event) => {
                    if let Err(error) = self.inject_now(&event, seconds) {
                        eprintln!("virtual-board: `inject {event}`: {error:#}");
                    }
                }
                ConsoleCommand::Quit => return Ok(Some("killed")),
                ConsoleCommand::Unknown(line) => {
                    eprintln!(
                        "virtual-board: `{line}` is not a command; allowed is press, release, hold, stop, reset, power, wire PIN=PIN, inject EVENT or quit"
                    )
                }
            }
        }
        if let Some(servos) = self.servos.as_ref().filter(|_| self.periods.is_multiple_of(SERVOS_EVERY)) {
            let (deg, torque) = (servos.degrees().map(report::degrees), servos.torque().map(report::degrees));
            self.report.line(&ReportLine::Servos { t_s: report::seconds(seconds), deg, torque });
        }
        if self.periods.is_multiple_of(STATUS_EVERY) {
            self.report_status();
        }
        self.report.flush();
        self.follow_real_time()?;
        if self.report.closed() {
            return Ok(Some("killed"));
        }
        if self.options.stop_on_lint && self.reported_lints != [0; 2] {
            return Ok(Some("lint"));
        }
        let stuck = self.idle != IdleState::No
            && !self.cpu.machine().can_wake()
            && !self.injections.iter().any(|injection| injection.due().is_some());
        let over = self.options.secs.is_some_and(|secs| seconds + 1e-9 >= secs);
        let has_no_user = self.options.secs.is_none() && !self.console.is_open() && self.lockstep.is_none();
        if over || stuck && has_no_user && self.probe.is_none() {
            let locked = self.idle == IdleState::LockedUp;
            return Ok(Some(if locked {
                "lockup"
            } else if stuck {
                "asleep"
            } else {
                "time"
            }));
        }
        Ok(None)
    }

    fn exchange_serial(&mut self) -> Result<()> {
        let mut board = self.cpu.machine();
        let sent = board.soc.take_serial();
        self.reports.take(&sent);
        if let Some(serial) = &mut self.serial {
            let came = serial.exchange(&sent)?;
            if !came.is_empty() {
                board.soc.put_serial(&came);
                self.judge.host_sent();
            }
        }
        Ok(())
    }

    pub(super) fn drain_rtt(&mut self) {
        let Some(rtt) = self.rtt else { return };
        for (channel, bytes) in rtt.poll(&mut self.cpu) {
            self.rtt_bytes += bytes.len() as u64;
            let hex: String = bytes.iter().flat_map(|byte| [byte >> 4, byte & 0xF]).map(hex_digit).collect();
            if let Some(log) = self.log.as_mut().and_then(|log| log.get_mut(usize::from(channel))) {
                log.push_str(&hex);
            }
            if let Some(server) = self.rtt_server.as_mut().filter(|_| channel == rtt_server::CHANNEL) {
                server.send(&bytes);
            }
            self.report.line(&ReportLine::Rtt { t_s: self.now_s(), channel, hex });
        }
    }

    /// Hands the program what a client of the server has sent.
    fn exchange_rtt(&mut self) {
        let (Some(server), Some(rtt)) = (&mut self.rtt_server, self.rtt) else { return };
        let waiting = server.receive();
        let taken = rtt.write(&mut self.cpu, rtt_server::CHANNEL.into(), waiting);
        if taken > 0 {
            waiting.drain(..taken);
            self.judge.host_sent();
        }
    }

    pub(super) fn record_signals(&mut self) -> Result<()> {
        let (rows, edges): (Vec<(f64, Conversion)>, _) = {
            let mut board = self.cpu.machine();
            let conversions: Vec<_> = board.soc.conversions().collect();
            let rows = conversions.into_iter().map(|one| (board.soc.seconds(one.cycle), one)).collect();
            (rows, board.plant.pulses.take_edges())
        };
        for (seconds, one) in rows {
            self.recorder.conversion(seconds, &one)?;
        }
        self.recorder.edges(&edges)
    }

    pub(super) fn report_lints(&mut self) {
        let mut lines = Vec::new();
        let board = self.cpu.machine();
        for (source, lints) in board.lints().into_iter().enumerate() {
            for (n, lint) in lints.iter().enumerate().skip(self.reported_lints[source]) {
                lines.push(ReportLine::Lint {
                    t_s: report::seconds(board.soc.seconds(lint.cycle)),
                    text: lint.to_string(),
                    function: self.image.function_at(board.lint_block(source, n)).map(str::to_owned),
                });
            }
            self.reported_lints[source] = lints.len();
        }
        drop(board);
        lines.iter().for_each(|line| self.report.line(line));
    }

    pub(super) fn report_status(&mut self) {
        let board = self.cpu.machine();
        let cycles = board.now() - self.last_status;
        let line = ReportLine::Status {
            t_s: report::seconds(board.seconds()),
            hclk_hz: board.soc.hclk_hz(),
            instructions: board.instructions,
            exceptions: self.exceptions,
            asleep: (self.slept_cycles as f64 / cycles.max(1) as f64 * 1e4).round() / 1e4,
            armed: board.plant.pulses.armed(),
        };
        self.last_status = board.now();
        drop(board);
        self.slept_cycles = 0;
        self.report.line(&line);
    }

    pub(super) fn end(mut self, reason: &'static str) -> Result<u8> {
        self.report_outputs();
        self.drain_rtt();
        self.record_signals()?;
        self.recorder.flush()?;
        self.write_sectors()?;
        self.finish_trace()?;
        self.report_lints();
        let now = self.moment().seconds;
        let unfinished: Vec<_> = self.cpu.machine().plant.pulses.unfinished(now).collect();
        unfinished.iter().for_each(|pulse| self.judge.end(pulse));
        let judged = self.judge.judged();
        self.judge_log.append(&judged)?;
        let as_expected = (judged.violations > 0) == self.options.violates.is_some();
        let injections: Vec<_> = self.injections.iter().map(|injection| injection.reaction(now)).collect();
        let end = {
            let board = self.cpu.machine();
            let all: Vec<&Lint> = board.lints().into_iter().flatten().collect();
            let count = |lint: &&Lint| LintCount {
                text: lint.to_string(),
                count: lint.count,
                unmodelled: lint.kind.is_unmodelled(),
            };
            let pulses = &board.plant.pulses;
            RunSummary {
                t_s: report::seconds(board.seconds()),
                reason,
                status: self.status,
                unmodelled: all.iter().filter(|lint| lint.kind.is_unmodelled()).map(|lint| lint.count).sum(),
                lints: all.iter().map(count).collect(),
                resets: std::mem::take(&mut self.resets),
                faults: self.faults,
                unexpected_faults: self.unexpected_faults,
                edges: pulses.edges().iter().map(|(pin, count)| (pin.to_string(), *count)).collect(),
                edges_before_arming: pulses.before_arming,
                edges_after_disarming: pulses.after_disarming,
                pulse_us: pulses.extremes.map(|both| both.map(|(min, max)| [report::micros(min), report::micros(max)])),
                high_at_end: pulses.servos().map(|pin| board.soc.output_level(pin)),
                frame_margin_us: pulses.frame_margin_us,
                judged,
                servo_deg: self.servos.as_ref().map(|servos| servos.extremes().map(|ends| ends.map(report::degrees))),
                instructions: board.instructions,
                exceptions: self.exceptions,
                interrupts: board.nvic.enabled_lines().collect(),
                rtt_bytes: self.rtt_bytes,
                reported: self.reports.totals,
                injections,
            }
        };
        let missed = self.missed_events();
        for words in &missed {
            eprintln!("virtual-board: the run did not show the event {words}");
        }
        let is_whole = missed.is_empty() && !self.lockstep.as_ref().is_some_and(|lockstep| lockstep.is_cut);
        let good = end.lints.is_empty() && !self.locked_up && as_expected && is_whole;
        let code = match self.status {
            Some(status) if status != 0 => status.min(255) as u8,
            Some(_) => u8::from(!good),
            // A self-test that did not end by itself did not pass.
            None if self.options.semihosting => 1,
            None => u8::from(!(good && end.unexpected_faults == 0 && matches!(reason, "time" | "killed"))),
        };
        self.report.line(&ReportLine::End(Box::new(end)));
        self.report.flush();
        Ok(code)
    }
}
