//! The steps: what the person is asked to do, and what is measured then.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use firmware::board::{BOARDS, Board as Table};
use firmware::timing::LATE_US;
use firmware_shared::liveness::WORST_BITE_US;
use hgod_adc::HealthConfig;
use hgod_adc::stm32f4::MAX_SUPPLY;
use joint_loop::control::watchdog_clock::{FASTEST_HZ, SLOWEST_HZ};
use joint_loop::tuning::{Action, Outcome};
use joint_loop::{BoardFaults, Cause, SupervisorState};
use joint_units::{Joint, PulseMicros};
use wire::{RecordId, Reset, VERSION};

use super::board::Board;
use super::evidence::{Found, Quantity, Versions};
use super::measured::{Pulse, edge_us, pulses, rails, rate, widths};
use crate::failure::Failure;

/// How long a person may take for what a step asks, s.
const PATIENCE_S: u64 = 120;
/// How long records may be under way from the board to this program, ms.
const SETTLE_MS: u64 = 300;
/// How long pulses of one width are collected, s: 75 servo frames.
const PULSES_S: f64 = 1.5;
/// How long codes are collected, s: 20 slots of the time code, in each of which both levels last 10 ms or more.
const CODES_S: f64 = 2.0;
/// How long the line is watched after pulses have ended, s: 50 servo frames.
const AFTER_S: f64 = 1.0;
/// How long the button is left alone after a refusal, s: presses that come too often arm for 5 s no more (docs/boards.md).
const BETWEEN_PRESSES_S: f64 = 5.5;
/// Ticks of two servo frames: a pulse that the board reports goes to the servo in the next frame, which has ended by then.
const TWO_FRAMES: u32 = 40;
/// Distances of the measured pulses from that of the park pose, us. The way between two of them takes half a second.
const WAYS_US: [u16; 3] = [0, 50, 100];
/// Middle of the travel of a hobby servo, us: the way from the park pose goes towards it, so that it stays inside of the servo's range.
const MIDDLE_US: u16 = 1_500;

const FIRST: &str = "Servos unplugged or their supply off. The emergency stop is connected, or a wire in its place. A jumper wire is at hand.";

const LEVEL: &str = "hazards.toml H27: the level that fits the board's supply, from its boot record";
const WIDTH: &str = "two time stamps in steps of 1 us (firmware/src/sync_input.rs); the timer of the pulses counts 1 us too (firmware/src/servo_pwm.rs)";
const DEAD_BAND: &str = "no servo of docs/safety.md turns by less than its dead band, 4 us; a stamp is late while the log masks the interrupts, so it judges the middle half of the pulses";
const PERIOD: &str = "hazards.toml H26: 50 Hz within 0.01 %";
const END: &str = "hazards.toml H07: the outputs go off at the end of a pulse, 2.5 ms later at most; and the tick that reports it, 1 ms";
const STOP: &str =
    "hazards.toml H56: 1 ms; and the latest start of the tick that reads the stop, firmware/src/timing.rs: 0.1 ms";
const SILENT: &str = "hazards.toml H56, H30: the line stays low";
const BITE: &str = "hazards.toml H08: 38 ms; 10 ms from frame to frame before the halt; 20 ms in which the board boots (first tick after 10 ms) and its first record goes through telemetry and port";
const FAULT: &str = "hazards.toml H04: registers that differ from what was written are a fault";
const CLOCK: &str = "firmware/src/board/mod.rs, duties of a board: the crystal is within 500 ppm";
const LOW_RAIL: &str = "hgod-adc/src/health.rs: a code below the end band shows a wire at ground";
const HIGH_RAIL: &str = "hgod-adc/src/health.rs: a code above the end band shows a wire at the supply";
const LSI: &str = "hazards.toml H32: 17 to 47 kHz, and the error of the measurement";
const SUPPLY: &str =
    "the board's minimum in its boot record, and the most that the chip may have (hgod-adc/src/stm32f4.rs)";
const DIE: &str = "firmware/src/crystal.rs: the range of temperature in which the chip's oscillators are specified";
const TICK: &str = "hazards.toml H19: less than a quarter of the period";
const START: &str = "firmware/src/timing.rs: a tick that starts later is late";
const LATE: &str = "hazards.toml H19: no tick is late";
const STACK: &str = "hazards.toml H51: less than the size of the stack";

/// Answer of a person to a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answer {
    Done,
    Skip,
}

/// Why no pulses were collected.
enum Ended {
    /// A reason in words.
    Why(String),
    /// The board has ended the pulses.
    Board(SupervisorState, Cause),
}

/// A bring-up under way.
pub(super) struct Session<'a, W> {
    board: Board<'a>,
    table: Option<&'static Table>,
    clock_s: f64,
    lines: Receiver<io::Result<String>>,
    out: W,
    /// The person has asked for the end: the steps that are left are skipped.
    is_over: bool,
    step: usize,
    versions: Versions,
    /// The board's own minimum of its supply, V.
    min_supply_v: Option<f64>,
    /// The emergency stop was not tested since the boot, as far as is known.
    is_untested: bool,
    /// Tick of the last pulse that was asked for again.
    jogged: u32,
    found: Vec<Quantity>,
}

/// Reset, quiet, sensors, servos, emergency stop, watchdog, power.
const STEPS: usize = 5 + 4 + Joint::COUNT;

impl<'a, W: Write> Session<'a, W> {
    pub(super) fn new(
        board: Board<'a>,
        table: Option<&'static Table>,
        clock_s: f64,
        lines: Receiver<io::Result<String>>,
        out: W,
    ) -> Self {
        let versions = Versions { footfall: env!("CARGO_PKG_VERSION").into(), wire: VERSION, ..Versions::default() };
        Self {
            board,
            table,
            clock_s,
            lines,
            out,
            is_over: false,
            step: 0,
            versions,
            min_supply_v: None,
            is_untested: false,
            jogged: 0,
            found: Vec::new(),
        }
    }

    /// Goes through all steps. `check` refuses a board whose file may not be written.
    ///
    /// # Errors
    /// The answers end, the board is not known, the port fails or the board is silent, the command is asked to end, or `check` fails.
    pub(super) fn run(mut self, check: impl FnOnce(&str) -> Result<(), Failure>) -> Result<Found, Failure> {
        self.say(FIRST)?;
        self.say("Enter: do the step. s: skip it. q: skip all that are left.")?;
        self.reset_button()?;
        let Some(table) = self.table else {
            return Err(Failure::input(
                "the board is not known: do step 1, or name the board with --board; nothing is written",
            ));
        };
        check(table.name)?;
        self.quiet(table)?;
        self.sensors(table)?;
        for joint in Joint::ALL {
            self.servo(table, joint)?;
        }
        self.emergency_stop(table)?;
        self.watchdog()?;
        self.power()?;
        Ok(Found { board: table, versions: self.versions, quantities: self.found })
    }

    fn say(&mut self, what: impl Display) -> Result<(), Failure> {
        writeln!(self.out, "{what}").and_then(|()| self.out.flush()).map_err(Failure::run)
    }

    fn add(&mut self, quantity: Quantity) -> Result<(), Failure> {
        self.say(format_args!("  {quantity}"))?;
        self.found.push(quantity);
        Ok(())
    }

    /// Asks for a step, and listens to the board until the person answers.
    fn ask(&mut self, title: impl Display, to_do: impl Display) -> Result<Answer, Failure> {
        let step = self.step;
        self.say(format_args!("step {step} of {STEPS}: {title}"))?;
        if self.is_over {
            return Ok(Answer::Skip);
        }
        self.say(format_args!("  {to_do} [Enter, s, q]"))?;
        loop {
            self.board.listen_through_loss()?;
            self.is_untested |= self.board.boot().is_some();
            // What comes while a person thinks belongs to no step.
            self.board.forget();
            let line = match self.lines.try_recv() {
                Ok(line) => line.map_err(Failure::run)?,
                Err(TryRecvError::Empty) => continue,
                Err(TryRecvError::Disconnected) => {
                    return Err(Failure::input("the answers end; allowed is a line for each step; nothing is written"));
                }
            };
            match line.trim() {
                "" => {
                    self.settle()?;
                    return Ok(Answer::Done);
                }
                "s" => return Ok(Answer::Skip),
                "q" => {
                    self.is_over = true;
                    return Ok(Answer::Skip);
                }
                other => {
                    let line = format!("  `{other}` is not understood; allowed are Enter, s and q");
                    self.say(line)?;
                }
            }
        }
    }

    /// Takes what is still under way from the board, which belongs to no step either.
    fn settle(&mut self) -> Result<(), Failure> {
        let until = Instant::now() + Duration::from_millis(SETTLE_MS);
        while Instant::now() < until {
            self.board.listen_through_loss()?;
        }
        self.is_untested |= self.board.boot().is_some();
        self.board.forget();
        Ok(())
    }

    /// Does a step again and again, until it has its result or the person skips it. `attempt` gives the reason why there is no result.
    fn attempt(
        &mut self,
        title: &str,
        to_do: &str,
        names: &[&str],
        mut attempt: impl FnMut(&mut Self) -> Result<Result<Vec<Quantity>, String>, Failure>,
    ) -> Result<bool, Failure> {
        self.step += 1;
        let mut why: Option<String> = None;
        loop {
            if self.ask(title, to_do)? == Answer::Skip {
                let why = why.unwrap_or_else(|| "skipped".into());
                names.iter().try_for_each(|name| self.add(Quantity::not_measured(*name, why.clone())))?;
                return Ok(false);
            }
            match attempt(self)? {
                Ok(quantities) => {
                    quantities.into_iter().try_for_each(|quantity| self.add(quantity))?;
                    return Ok(true);
                }
                Err(reason) => {
                    self.say(format_args!("  no result: {reason}"))?;
                    why = Some(reason);
                }
            }
        }
    }

    /// Waits for a boot record.
    fn wait_for_boot(&mut self) -> Result<Option<(Instant, wire::Boot)>, Failure> {
        let until = Instant::now() + Duration::from_secs(PATIENCE_S);
        while Instant::now() < until {
            self.board.listen_through_loss()?;
            if let Some((at, boot)) = self.board.boot() {
                let boot = boot.clone();
                self.is_untested = true;
                return Ok(Some((at, boot)));
            }
        }
        Ok(None)
    }

    fn reset_button(&mut self) -> Result<(), Failure> {
        const RESET: &str = "reset by the button";
        const SEAL: &str = "seal of the image";
        const BROWN_OUT: &str = "level of the brown-out reset";
        self.attempt(
            "reset and names",
            "After Enter press the board's reset button and release it.",
            &[RESET, SEAL, BROWN_OUT],
            |session| {
                session.say("  now: press the reset button and release it")?;
                let Some((_, boot)) = session.wait_for_boot()? else {
                    return Ok(Err(format!(
                        "no boot record came within {PATIENCE_S} s; a board that stays off sends nothing: look at its lamps (docs/first-walk.md)"
                    )));
                };
                let of_boot = BOARDS.into_iter().find(|board| board.name == boot.board.as_str());
                let Some(of_boot) = of_boot else {
                    let known: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
                    return Err(Failure::input(format!(
                        "the board is a {}; a bring-up is made for {}",
                        boot.board,
                        known.join(", ")
                    )));
                };
                if let Some(named) = session.table.filter(|named| named.name != of_boot.name) {
                    return Err(Failure::input(format!(
                        "the board is a {}, and --board names a {}",
                        of_boot.name, named.name
                    )));
                }
                session.table = Some(of_boot);
                let name = |record: &Option<RecordId>| record.as_ref().map(|id| format!("{} {:08x}", id.name, id.crc));
                session.versions.generator = name(&boot.generator);
                session.versions.sensors = name(&boot.sensors);
                session.versions.robot = name(&boot.robot);
                session.min_supply_v = Some(f64::from((boot.min_supply_v * 1e3).round()) / 1e3);
                session.say(format_args!("  {}, {}", of_boot.name, of_boot.chip))?;
                let reset = Quantity::word(RESET, boot.reset.name());
                let seal = match boot.sealed {
                    Some(true) => "sealed",
                    Some(false) => "unsealed",
                    None => "none is checked",
                };
                let [level, wanted] = [boot.brown_out.level, boot.brown_out.wanted].map(f64::from);
                Ok(Ok(vec![
                    reset.allowing(Reset::Pin.name(), "hazards.toml H28: a reset by hand"),
                    Quantity::word(SEAL, seal).noted("an image without a seal runs; its program is then not checked"),
                    Quantity::number(BROWN_OUT, level, "").within(Some(wanted), Some(wanted), LEVEL),
                ]))
            },
        )?;
        Ok(())
    }

    /// What a board reports that stands still.
    fn quiet(&mut self, table: &'static Table) -> Result<(), Failure> {
        const NAMES: [&str; 10] = [
            "board clock against the host",
            "watchdog oscillator",
            "supply",
            "die temperature",
            "longest tick",
            "latest start of a tick",
            "late or missed ticks",
            "crystal against HSI at boot",
            "stack used",
            "records dropped",
        ];
        let secs = self.clock_s;
        let to_do = format!("After Enter do not touch the board for {secs} s.");
        self.attempt("clocks, supply and times", &to_do, &NAMES, |session| {
            session.board.forget();
            let (mut left, part) = (secs, 10.0_f64);
            while left > 0.0 {
                session.say(format_args!("  {left:.0} s"))?;
                session.board.listen_for(part.min(left))?;
                left -= part;
            }
            Ok(session.of_quiet(table, NAMES))
        })?;
        Ok(())
    }

    fn of_quiet(&self, table: &Table, names: [&str; 10]) -> Result<Vec<Quantity>, String> {
        let board = &self.board;
        let mut frames = board.frames();
        let (Some((begun, first)), Some((_, last))) = (frames.next(), frames.next_back()) else {
            return Err("no frame came".into());
        };
        let reports: Vec<(f64, f64)> = board
            .frames()
            .map(|(at, frame)| (f64::from(frame.tick) * 1e-3, at.duration_since(begun).as_secs_f64()))
            .collect();
        let most = |values: &mut dyn Iterator<Item = u32>| values.max().map(f64::from);
        let costs = || board.costs();
        let mut all = Vec::new();
        let mut add = |name: &str, value: Option<f64>, of: &dyn Fn(f64) -> Quantity| {
            all.push(value.map_or_else(|| Quantity::not_measured(name, "the board reported none"), of));
        };
        let [clock, lsi, supply, die, tick, start, late, crystal, stack, dropped] = names;
        let compared = rate(&reports);
        add(clock, compared.map(|rate| rate.ppm), &|ppm| {
            let half = compared.map_or(0.0, |rate| rate.uncertainty_ppm);
            let seconds = last.tick.wrapping_sub(first.tick) / 1_000;
            Quantity::number(clock, (ppm * 10.0).round() / 10.0, "ppm")
                .within(Some(-500.0), Some(500.0), CLOCK)
                .uncertain((half * 10.0).ceil() / 10.0)
                .noted(format!(
                    "over {seconds} s, by the shortest delays of the port; the error of the clock of this computer, some 50 ppm where no time server \
                     corrects it, is not in the uncertainty"
                ))
        });
        let watchdog = board.environments().filter_map(|one| one.watchdog_hz).last().map(f64::from);
        let tolerance = |hz: u32, permille: f64| f64::from(hz) * permille / 1e3;
        add(lsi, watchdog, &|hz| {
            Quantity::number(lsi, hz, "Hz").within(
                Some(tolerance(SLOWEST_HZ, 997.0)),
                Some(tolerance(FASTEST_HZ, 1_003.0)),
                LSI,
            )
        });
        let volts: Vec<f64> = board.environments().filter_map(|one| one.supply_v).map(f64::from).collect();
        let lowest = volts.iter().copied().reduce(f64::min);
        add(supply, lowest, &|volts| {
            Quantity::number(supply, (volts * 1e3).round() / 1e3, "V")
                .within(
                    self.min_supply_v.or(Some(f64::from(table.min_supply.0))).map(|v| (v * 1e3).round() / 1e3),
                    Some((f64::from(MAX_SUPPLY.0) * 1e3).round() / 1e3),
                    SUPPLY,
                )
                .noted("the lowest mean of a second, by the internal reference of the chip")
        });
        let degrees = board.environments().filter_map(|one| one.die_c).last().map(f64::from);
        add(die, degrees, &|value| {
            Quantity::number(die, (value * 10.0).round() / 10.0, "degC").within(Some(-40.0), Some(105.0), DIE)
        });
        let period = f64::from(table.clocks.core_mhz()) * 1e3;
        add(tick, most(&mut costs().map(|cost| cost.longest_cycles)), &|cycles| {
            Quantity::number(tick, cycles, "cycles").within(None, Some(period / 4.0), TICK)
        });
        add(start, most(&mut costs().map(|cost| cost.latest_start_us)), &|us| {
            Quantity::number(start, us, "us").within(None, Some(f64::from(LATE_US)), START)
        });
        let counts = last.late.wrapping_sub(first.late).wrapping_add(last.missed.wrapping_sub(first.missed));
        add(late, Some(f64::from(counts)), &|count| Quantity::number(late, count, "").within(None, Some(0.0), LATE));
        all.push(
            Quantity::word(crystal, "accepted")
                .allowing("accepted", "hazards.toml H26: a board whose crystal is refused stays off")
                .noted("the board runs, so it took its crystal by its own oscillator, which may be off by -8 to 4.5 %"),
        );
        let mut add = |name: &str, value: Option<f64>, of: &dyn Fn(f64) -> Quantity| {
            all.push(value.map_or_else(|| Quantity::not_measured(name, "the board reported none"), of));
        };
        let size = most(&mut costs().map(|cost| cost.stack_size));
        add(stack, most(&mut costs().map(|cost| cost.stack_used)), &|bytes| {
            Quantity::number(stack, bytes, "bytes").within(None, size.map(|size| size - 1.0), STACK)
        });
        add(dropped, most(&mut costs().map(|cost| cost.dropped)), &|count| Quantity::number(dropped, count, ""));
        Ok(all)
    }

    /// The codes of each sensor input while the synchronisation output, which has both levels ten times a second, is wired to it.
    fn sensors(&mut self, table: &'static Table) -> Result<(), Failure> {
        for (channel, input) in table.sensors.iter().enumerate() {
            let pin = input.pin.name;
            let [low, high] = ["low", "high"].map(|rail| format!("code of {pin} at the {rail} rail"));
            let to_do = format!("Connect {} with {pin}.", table.sync_output);
            self.attempt(&format!("sensor input {pin}"), &to_do, &[&low, &high], |session| {
                session.board.forget();
                session.board.listen_for(CODES_S)?;
                let mut calls = session.board.calls().peekable();
                if let Some((_, call)) = calls.peek().filter(|(_, call)| call.codes.len() <= channel) {
                    let sensors = call.codes.len();
                    return Ok(Err(format!(
                        "the board sends the codes of the {sensors} inputs that its sensor record has; skip this one, or flash a record with more"
                    )));
                }
                let codes: Vec<u16> = calls.filter_map(|(_, call)| call.codes.get(channel).copied()).collect();
                let Some([at_low, at_high]) = rails(&codes) else {
                    return Ok(Err(format!("{pin} does not follow {}: is the wire there?", table.sync_output)));
                };
                let health = HealthConfig::default();
                Ok(Ok(vec![
                    Quantity::number(&*low, at_low, "").within(None, Some(f64::from(health.low.0)), LOW_RAIL),
                    Quantity::number(&*high, at_high, "").within(Some(f64::from(health.high.0)), None, HIGH_RAIL),
                ]))
            })?;
        }
        Ok(())
    }

    /// Brings the board into a trim of this joint, in which the pulses stand still; the reason if it does not come to that.
    fn arm(&mut self, joint: Joint) -> Result<Result<(), String>, Failure> {
        // A board that has just started takes no request.
        self.board.forget();
        while self.board.state().is_none() {
            self.board.listen()?;
        }
        match self.board.ask(Action::Trim { joint })? {
            Outcome::Staged => {}
            Outcome::NotAtRest => {
                let said =
                    "it is not at rest: hold its button for half a second to acknowledge a fault or to end a motion";
                return Ok(Err(said.into()));
            }
            other => return Ok(Err(format!("it refuses a trim: {}", other.name()))),
        }
        let until = Instant::now() + Duration::from_secs(PATIENCE_S);
        let mut refused: Option<(SupervisorState, Cause)> = None;
        loop {
            self.say(if self.is_untested {
                "  now: press the emergency stop and release it; then hold the button for half a second"
            } else {
                "  now: hold the button for half a second"
            })?;
            self.board.forget();
            loop {
                self.board.listen()?;
                if self.board.state() == Some(SupervisorState::Trimming) {
                    self.is_untested = false;
                    return Ok(Ok(()));
                }
                if let Some(change) = self.board.changes().next_back().filter(|change| change.cause != Cause::None) {
                    refused = Some((change.state, change.cause));
                    break;
                }
                if Instant::now() >= until {
                    let why: Vec<&str> = self.board.refused().collect();
                    let cause = refused.map_or("none", |(_, cause)| cause.name());
                    return Ok(Err(format!("it gives no pulses; cause {cause} {}", why.join("; "))));
                }
            }
            let Some((state, cause)) = refused else { continue };
            if state == SupervisorState::Fault {
                return Ok(Err(format!("fault, cause {}: a hold of the button acknowledges it", cause.name())));
            }
            self.is_untested |= cause == Cause::StopUntested;
            self.say(format_args!("  refused, cause {}: wait", cause.name()))?;
            self.board.listen_for(BETWEEN_PRESSES_S)?;
        }
    }

    /// Moves the pulse of the joint, and collects pulses at the line for a while; pulses and the commanded width.
    fn pulses_at(&mut self, joint: Joint, goal: Option<u16>) -> Result<Result<(Vec<Pulse>, u16), Ended>, Failure> {
        if let Some(goal) = goal {
            let outcome = self.board.ask(Action::Jog { pulse: PulseMicros(goal) })?;
            // Out of a trim that has ended it is refused too; the state shows that below.
            if !matches!(outcome, Outcome::InEffect | Outcome::NotTrimming) {
                return Ok(Err(Ended::Why(format!("the board refuses a pulse of {goal} us: {}", outcome.name()))));
            }
        }
        self.board.forget();
        let mut since: Option<(u32, u16)> = None;
        let until = Instant::now() + Duration::from_secs(10);
        let commanded = loop {
            self.board.listen()?;
            let Some((_, frame)) = self.board.frames().next_back() else { continue };
            if frame.state != SupervisorState::Trimming {
                return Ok(Err(Ended::Board(frame.state, frame.cause)));
            }
            let pulse = frame.pulses_us[joint as usize];
            if goal.is_none_or(|goal| goal == pulse) {
                let (from, of) = *since.get_or_insert((frame.tick, pulse));
                if of == pulse && frame.tick.wrapping_sub(from) >= TWO_FRAMES {
                    break pulse;
                }
            }
            if Instant::now() >= until {
                return Ok(Err(Ended::Why("the board does not come to the pulse that was asked for".into())));
            }
        };
        self.board.forget();
        self.board.listen_for(PULSES_S)?;
        if let Some((_, frame)) = self.board.frames().find(|(_, frame)| frame.state != SupervisorState::Trimming) {
            return Ok(Err(Ended::Board(frame.state, frame.cause)));
        }
        Ok(Ok((pulses(self.board.edges()), commanded)))
    }

    fn servo(&mut self, table: &'static Table, joint: Joint) -> Result<(), Failure> {
        let (pin, name) = (table.servos[joint as usize].name, joint.name());
        let names = ["width error, median", "width error, middle half", "period", "pulses end after a stop"];
        let names = names.map(|what| format!("{what}, {name} ({pin})"));
        let to_do = format!("Connect {pin} with {}.", table.sync_input);
        self.attempt(&format!("pulses of {name}"), &to_do, &names.each_ref().map(String::as_str), |session| {
            if let Err(why) = session.arm(joint)? {
                return Ok(Err(why));
            }
            let result = session.of_servo(table, joint, &names);
            session.disarm()?;
            result
        })?;
        Ok(())
    }

    /// Two stop requests: from a trim to its readiness, from there to rest. A board that is there already refuses them.
    fn disarm(&mut self) -> Result<(), Failure> {
        for _ in 0..2 {
            self.board.ask(Action::Stop)?;
        }
        Ok(())
    }

    fn of_servo(
        &mut self,
        table: &Table,
        joint: Joint,
        [median, middle, period, end]: &[String; 4],
    ) -> Result<Result<Vec<Quantity>, String>, Failure> {
        let pin = table.servos[joint as usize].name;
        let (mut all, mut parked) = (Vec::new(), None);
        for way in WAYS_US {
            let goal = parked.filter(|_| way > 0).map(
                |parked: u16| {
                    if parked < MIDDLE_US { parked + way } else { parked - way }
                },
            );
            let (pulses, commanded) = match self.pulses_at(joint, goal)? {
                Ok(found) => found,
                Err(Ended::Why(why)) => return Ok(Err(why)),
                // The board found it itself: this is a result.
                Err(Ended::Board(SupervisorState::Fault, cause)) if cause != Cause::BreakInput => {
                    let missing = [median, middle, period, end]
                        .map(|name| Quantity::not_measured(&**name, "the board ended the pulses"));
                    let fault = Quantity::word(format!("fault of the board, {}", joint.name()), cause.name())
                        .allowing("none", FAULT);
                    return Ok(Ok([vec![fault], missing.into()].concat()));
                }
                Err(Ended::Board(state, cause)) => {
                    return Ok(Err(format!("the board ended the trim: {}, cause {}", state.name(), cause.name())));
                }
            };
            parked.get_or_insert(commanded);
            let Some(found) = widths(&pulses, commanded) else {
                return Ok(Err(format!("no pulses came from {pin} to {}: is the wire there?", table.sync_input)));
            };
            self.say(format_args!(
                "  {} pulses of {commanded} us: median error {} us, worst {} us",
                found.count, found.median_us, found.worst_us
            ))?;
            all.push(found);
        }
        let farthest = |value: fn(&super::measured::Widths) -> f64| {
            all.iter().map(value).max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(f64::NAN)
        };
        let worst = farthest(|found| found.worst_us);
        let count: usize = all.iter().map(|found| found.count).sum();
        let far = all.iter().map(|found| found.period_us).max_by(|a, b| (a - 20e3).abs().total_cmp(&(b - 20e3).abs()));
        // The line after a stop.
        self.board.forget();
        self.board.ask(Action::Stop)?;
        self.board.listen_for(AFTER_S)?;
        let stopped =
            self.board.changes().find(|change| change.state == SupervisorState::TrimReady).map(|change| change.tick);
        let after = stopped.map(|tick| {
            let last = self.board.edges().map(edge_us).max();
            // Before the tick of the stop: no pulse was running.
            last.map_or(0.0, |last| ((last - i64::from(tick) * 1_000) as f64 * 1e-3).max(0.0))
        });
        let ended = after.map_or_else(
            || Quantity::not_measured(&**end, "the change of state did not come"),
            |ms| {
                Quantity::number(&**end, ms, "ms")
                    .within(None, Some(3.5), END)
                    .noted("last edge after the tick of the change of state")
            },
        );
        Ok(Ok(vec![
            Quantity::number(&**median, farthest(|found| found.median_us), "us")
                .within(Some(-2.0), Some(2.0), WIDTH)
                .noted(format!("{count} pulses of {} widths", all.len())),
            Quantity::number(&**middle, farthest(|found| found.middle_us), "us")
                .within(Some(-4.0), Some(4.0), DEAD_BAND)
                .noted(format!("the worst of all pulses is {worst} us off")),
            Quantity::number(&**period, far.unwrap_or(f64::NAN), "us").within(Some(19_998.0), Some(20_002.0), PERIOD),
            ended,
        ]))
    }

    fn emergency_stop(&mut self, table: &'static Table) -> Result<(), Failure> {
        const JOINT: Joint = Joint::RightKnee;
        const NAMES: [&str; 2] = ["emergency stop to the end of the pulses", "edges after the emergency stop"];
        let (pin, input) = (table.servos[JOINT as usize].name, table.sync_input);
        let to_do = format!("Leave {pin} connected with {input}, or connect it.");
        self.attempt("emergency stop", &to_do, &NAMES, |session| {
            if let Err(why) = session.arm(JOINT)? {
                return Ok(Err(why));
            }
            session.board.forget();
            session.board.listen_for(AFTER_S)?;
            if session.board.edges().next().is_none() {
                session.disarm()?;
                return Ok(Err(format!("no pulses came from {pin} to {input}: is the wire there?")));
            }
            session.say("  now: press the emergency stop, and hold it for a second")?;
            let until = Instant::now() + Duration::from_secs(PATIENCE_S);
            while session.board.state() == Some(SupervisorState::Trimming) && Instant::now() < until {
                session.board.listen()?;
                // The board ends a trim whose host is silent.
                session.keep_trimming(JOINT)?;
            }
            // The inputs of the tick come after the frame that shows what followed, and the edges after both.
            session.board.listen_for(AFTER_S)?;
            let pressed = session.board.calls().find(|(_, call)| call.flags.faults().contains(BoardFaults::BREAK_INPUT));
            let pressed = pressed.map(|(tick, _)| tick);
            let Some(tick) = pressed else {
                session.disarm()?;
                return Ok(Err("the board did not see the emergency stop".into()));
            };
            let tick_us = i64::from(tick) * 1_000;
            let last = session.board.edges().map(edge_us).filter(|us| *us <= tick_us + i64::from(LATE_US)).max();
            let later: Vec<i64> = session.board.edges().map(edge_us).filter(|us| *us > tick_us + i64::from(LATE_US)).collect();
            let silent = Quantity::number(NAMES[1], later.len() as f64, "").within(None, Some(0.0), SILENT);
            let silent = match later.first() {
                Some(first) => silent.noted(format!("the first {} us after the tick that saw the stop", first - tick_us)),
                None => silent,
            };
            // The press came after the tick before had read the stop.
            let bound = last.map_or(0.0, |last| (last - (tick_us - 1_000)) as f64 * 1e-3).max(0.0);
            let note = format!(
                "an upper bound: the stop is read once a tick, the press came after tick {} and was seen in tick {tick}",
                tick.wrapping_sub(1)
            );
            session.say("  now: release the emergency stop, and hold the button for half a second, which acknowledges the fault")?;
            let until = Instant::now() + Duration::from_secs(PATIENCE_S);
            while session.board.state() == Some(SupervisorState::Fault) && Instant::now() < until {
                session.board.listen()?;
            }
            Ok(Ok(vec![
                Quantity::number(NAMES[0], bound, "ms").within(None, Some(1.1), STOP).noted(note),
                silent,
            ]))
        })?;
        Ok(())
    }

    /// Repeats the pulse of the joint, so that the board does not end the trim. A board whose core is halted does not answer.
    fn keep_trimming(&mut self, joint: Joint) -> Result<(), Failure> {
        const EVERY_TICKS: u32 = 1_000;
        let Some((_, frame)) = self.board.frames().next_back() else { return Ok(()) };
        let (tick, pulse) = (frame.tick, frame.pulses_us[joint as usize]);
        if tick.wrapping_sub(self.jogged) >= EVERY_TICKS && frame.state == SupervisorState::Trimming {
            self.jogged = tick;
            self.board.send(Action::Jog { pulse: PulseMicros(pulse) })?;
        }
        Ok(())
    }

    fn watchdog(&mut self) -> Result<(), Failure> {
        const JOINT: Joint = Joint::RightKnee;
        const NAMES: [&str; 3] = ["halt to the next boot", "reset by the watchdog", "edges after the watchdog's reset"];
        let to_do =
            "Needs a debug probe; without one skip this step. Make ready to halt the core with it (OpenOCD: `halt`).";
        self.attempt("watchdog", to_do, &NAMES, |session| {
            if let Err(why) = session.arm(JOINT)? {
                return Ok(Err(why));
            }
            session.say("  now: halt the core with the debug probe")?;
            session.board.forget();
            let until = Instant::now() + Duration::from_secs(PATIENCE_S);
            let booted = loop {
                let before = session.board.last();
                session.board.listen()?;
                if let Some((at, boot)) = session.board.boot() {
                    break Some((before, at, boot.reset));
                }
                let state = session.board.state();
                if state.is_some_and(|state| state != SupervisorState::Trimming) || Instant::now() >= until {
                    break None;
                }
                if session.board.last().is_some_and(|last| last.elapsed() < Duration::from_millis(50)) {
                    session.keep_trimming(JOINT)?;
                }
            };
            let Some((Some(before), at, reset)) = booted else {
                session.disarm()?;
                return Ok(Err(format!("the board was not reset within {PATIENCE_S} s")));
            };
            session.is_untested = true;
            session.board.forget();
            session.board.listen_for(AFTER_S)?;
            let later = session.board.edges().count();
            let ms = at.duration_since(before).as_secs_f64() * 1e3;
            let most = f64::from(WORST_BITE_US) * 1e-3 + 30.0;
            Ok(Ok(vec![
                Quantity::number(NAMES[0], (ms * 10.0).round() / 10.0, "ms")
                    .within(None, Some(most), BITE)
                    .noted("an upper bound, by the clock of this computer: from the last record before the halt to the boot record"),
                Quantity::word(NAMES[1], reset.name()).allowing(Reset::IndependentWatchdog.name(), "hazards.toml H34"),
                Quantity::number(NAMES[2], later as f64, "").within(None, Some(0.0), SILENT),
            ]))
        })?;
        Ok(())
    }

    fn power(&mut self) -> Result<(), Failure> {
        const NAME: &str = "reset by power-on";
        let to_do = "After Enter switch the board's supply off and on again: for most boards, pull its USB cable and plug it in.";
        self.attempt("power-on", to_do, &[NAME], |session| {
            session.say("  now: switch the board's supply off and on again")?;
            let Some((_, boot)) = session.wait_for_boot()? else {
                let said = "no boot record came: where the supply feeds the serial port too, the record comes before the port is back";
                return Ok(Err(said.into()));
            };
            Ok(Ok(vec![
                Quantity::word(NAME, boot.reset.name()).allowing(Reset::PowerOn.name(), "hazards.toml H28"),
            ]))
        })?;
        Ok(())
    }
}
