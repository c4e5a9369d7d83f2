//! Run of a program: executes to the next deadline, takes exceptions, sleeps, resets, injects faults, and reports events.

mod campaign;
mod case;
mod conversation;
mod debugger;
mod disturb;
mod drift;
mod exceptions;
mod flash_files;
mod lockstep;
mod moments;
mod pace;
mod periodic;
mod saved_sector;
mod tracing;

use std::cell::RefCell;
use std::io::Write;
use std::net::SocketAddr;
use std::rc::Rc;

use anyhow::Result;
use stm32f4_model::{ResetCause, Soc, SocConfig};

use crate::addresses::{FLASH, FLASH_SIZE};
use crate::board::BoardModel;
use crate::campaign::{Driving, Reports};
use crate::console::Console;
use crate::cpu::{BRANCH_TO_SELF, Cpu, Reg, Stop, XPSR_EXCEPTION};
use crate::execution_trace::{Event, ExecutionTrace};
use crate::fault::FaultCause;
use crate::inject::{self, Injection, InjectionKind, Moment, PERMANENTLY_UNDEFINED};
use crate::judge::{Judge, JudgeLog, Limits, PARAMETERS_END};
use crate::loader::ProgramImage;
use crate::nvic::Masks;
use crate::plant::{BoardPlant, EMERGENCY_STOP};
use crate::probe::ProbeServer;
use crate::probe::core::{HaltReason, vector_catch};
use crate::recorder::SignalRecorder;
use crate::report::{self, ReportLine, ReportWriter, ResetRecord};
use crate::rtt::{Rtt, RttReading};
use crate::rtt_server::RttServer;
use crate::script::Watcher;
use crate::serial::SerialPort;
use crate::servos::Servos;
use crate::unicorn::UnicornCpu;

pub(crate) use campaign::Plan;
use conversation::Lockstep;
use drift::Drift;
use pace::Pace;
pub(crate) use saved_sector::FlashDownload;
use saved_sector::SavedSector;

/// Virtual time between two periodic jobs (RTT, commands, end of the run), s.
const PERIODIC_JOB_S: f64 = 1e-3;

/// By how much the time of a stop may be too early, s: less than a cycle.
const ROUNDING_S: f64 = 1e-9;

/// Options of a run.
#[derive(Debug, Clone)]
pub(crate) struct RunOptions {
    /// Virtual seconds to run; `None`: until `quit`, a signal, or no event is left.
    pub(crate) secs: Option<f64>,
    /// Cycles per instruction.
    pub(crate) cpi: f64,
    /// Run no faster than real time.
    pub(crate) pace: bool,
    /// End at the first lint.
    pub(crate) stop_on_lint: bool,
    /// Serve semihosting calls, and exit with the program's status.
    pub(crate) semihosting: bool,
    /// RTT mode that the attached debugger sets; `None`: unchanged.
    pub(crate) rtt_mode: Option<u32>,
    /// Read the bytes of RTT.
    pub(crate) drain: bool,
    /// Milliseconds from one read to the next.
    pub(crate) rtt_every: u64,
    /// Where RTT channel 1 is served.
    pub(crate) rtt_server: Option<SocketAddr>,
    /// A debugger is attached.
    pub(crate) debugger: bool,
    /// Address at which clients find the board as a debug probe.
    pub(crate) probe: Option<SocketAddr>,
    /// Why pulses that no servo may get are expected; `None`: they are not.
    pub(crate) violates: Option<String>,
}

/// State of the core while it does not execute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum IdleState {
    /// It executes.
    No,
    /// It sleeps after WFI, or after a return with SLEEPONEXIT.
    ForInterrupt,
    /// It sleeps after WFE.
    ForEvent,
    /// A debugger has halted it.
    Halted,
    /// It is locked up until a reset.
    LockedUp,
}

/// One run of a program.
pub(crate) struct BoardRun<'a, W: Write> {
    cpu: UnicornCpu<BoardModel>,
    image: &'a ProgramImage,
    options: RunOptions,
    report: ReportWriter<W>,
    console: Console,
    serial: Option<SerialPort>,
    /// The board as a debug probe with its target.
    probe: Option<ProbeServer>,
    /// The core was locked up with the program counter there when a debugger halted it.
    locked_at: Option<u32>,
    /// The emulator failed during an access of the debugger.
    failure: Option<anyhow::Error>,
    /// Virtual time beside real time.
    pace: Pace,
    rtt: Option<Rtt>,
    rtt_server: Option<RttServer>,
    recorder: SignalRecorder,
    /// The conversation with a program that steps the board.
    lockstep: Option<Lockstep>,
    /// Sectors to write to files at the end.
    saved: Vec<SavedSector>,
    /// What the core executes goes there.
    trace: Option<Rc<RefCell<ExecutionTrace>>>,
    injections: Vec<Injection>,
    /// Waits for the moments of a script.
    watcher: Watcher,
    /// Frequencies of the crystal that change.
    drift: Option<Drift>,
    /// Draws the content of the RAM at the next power-on.
    scramble: Option<u64>,
    /// Judges every pulse.
    judge: Judge,
    judge_log: JudgeLog,
    /// Modelled servos at the servo pins.
    pub(crate) servos: Option<Servos>,
    /// When the servos were driven, in a campaign.
    driving: Option<Driving>,
    /// The case has several faults: one before may have switched off the clock of a register that another one changes.
    has_several_faults: bool,
    /// What the board says of itself, which the cases of a campaign compare.
    reports: Reports,
    /// The log for people and the records since the last boot, as hex; `None`: not kept.
    log: Option<[String; 2]>,
    idle: IdleState,
    periods: u64,
    reported_lints: [usize; 2],
    resets: Vec<ResetRecord>,
    faults: u64,
    unexpected_faults: u64,
    locked_up: bool,
    exceptions: u64,
    rtt_bytes: u64,
    slept_cycles: u64,
    /// The caller of [`BoardRun::step`] looks at the state from this time on, s: a sleep does not pass it.
    pause_s: f64,
    last_status: u64,
    status: Option<u32>,
}

impl<'a, W: Write> BoardRun<'a, W> {
    /// A run of `image` at power-on.
    ///
    /// # Errors
    /// The emulator cannot be set up, or the server of RTT.
    #[expect(clippy::too_many_arguments, reason = "the parts of a run, each used once")]
    pub(crate) fn new(
        image: &'a ProgramImage,
        config: SocConfig,
        plant: BoardPlant,
        injections: Vec<Injection>,
        recorder: SignalRecorder,
        console: Console,
        serial: Option<SerialPort>,
        report: ReportWriter<W>,
        options: RunOptions,
    ) -> Result<Self> {
        let mut board = BoardModel::new(Soc::new(config), plant, options.cpi);
        board.scs.debug.enable(options.debugger);
        // With a probe, its client is the debugger that reads the log.
        let symbol = if options.probe.is_some() { None } else { image.symbol("_SEGGER_RTT") };
        let rtt =
            symbol.map(|address| Rtt { address, mode: options.rtt_mode, reading: RttReading::new(options.drain) });
        let rtt_server = options.rtt_server.map(RttServer::open).transpose()?;
        let judge_log = JudgeLog::of_environment(options.violates.clone());
        let chip = image.board.config().chip;
        let mut cpu = UnicornCpu::new(chip, &image.flash, board)?;
        let probe = options.probe.map(ProbeServer::listen).transpose()?;
        if probe.is_some() {
            cpu.allow_code_in_ram(chip)?;
        }
        Ok(BoardRun {
            cpu,
            probe,
            locked_at: None,
            failure: None,
            pace: Pace::start(),
            image,
            options,
            report,
            console,
            serial,
            rtt,
            rtt_server,
            recorder,
            lockstep: None,
            saved: Vec::new(),
            trace: None,
            injections,
            watcher: Watcher::default(),
            drift: None,
            scramble: None,
            judge: Judge::new(Limits::of_flash(&image.flash), image.board.wiring().servos),
            judge_log,
            servos: None,
            driving: None,
            has_several_faults: false,
            reports: Reports::default(),
            log: None,
            idle: IdleState::No,
            periods: 0,
            reported_lints: [0; 2],
            resets: Vec::new(),
            faults: 0,
            unexpected_faults: 0,
            locked_up: false,
            exceptions: 0,
            rtt_bytes: 0,
            slept_cycles: 0,
            pause_s: f64::INFINITY,
            last_status: 0,
            status: None,
        })
    }

    /// Runs to the end. Returns the exit status: the program's own if it passed one, else 1 after any error, else 0.
    ///
    /// # Errors
    /// A file cannot be written, or the emulator fails.
    pub(crate) fn run(mut self) -> Result<u8> {
        self.greet();
        self.begin();
        self.exchange()?;
        let reason = loop {
            if let Some(reason) = self.step()? {
                break reason;
            }
        };
        self.end(reason)
    }

    /// Switches the power on.
    fn begin(&mut self) {
        let hclk_hz = self.cpu.machine().soc.hclk_hz();
        let (elf_sha256, cpi) = (self.image.sha256.clone(), self.options.cpi);
        let board = self.image.board.name();
        self.report.line(&ReportLine::Start { elf_sha256, board, hclk_hz, cpi });
        if let Some(SerialPort { name, .. }) = &self.serial {
            self.report.line(&ReportLine::Serial { port: name.clone() });
            self.report.flush();
        }
        if let Some(probe) = &self.probe {
            self.report.line(&ReportLine::Probe { address: probe.address.to_string() });
            self.report.flush();
        }
        if let Some(RttServer { address, .. }) = &self.rtt_server {
            self.report.line(&ReportLine::RttServer { address: address.to_string() });
            self.report.flush();
        }
        self.boot(ResetCause::PowerOn);
        self.schedule_stop();
    }

    /// Advances the peripherals to the present, then executes or sleeps to the next deadline. Returns a reason to end, if any.
    fn step(&mut self) -> Result<Option<&'static str>> {
        while self.cpu.machine().is_past_horizon() {
            self.exchange()?;
        }
        let (reset, due, changes) = {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.sync(&mut memory);
            if self.idle != IdleState::No {
                let supply_s = self.lockstep.as_ref().and_then(Lockstep::supply_due);
                let injections = self.injections.iter().filter_map(Injection::due);
                let injection_s = injections.chain(supply_s).fold(f64::INFINITY, f64::min);
                while board.is_quiet(injection_s) && !board.sleeps_past_horizon() {
                    let seconds = board.seconds();
                    let button = board.plant.button_is_pressed(seconds);
                    let stop = board.plant.level(EMERGENCY_STOP, seconds);
                    self.judge.observe(seconds, button, stop);
                    if let Some(servos) = &mut self.servos {
                        servos.take(&[], &[], seconds, board.plant.pulses.any_high());
                    }
                    self.slept_cycles += board.sleep();
                    if board.seconds() >= self.pause_s {
                        return Ok(None);
                    }
                    board.sync(&mut memory);
                }
            }
            (board.reset, board.stop_is_due(), board.soc.take_flash_operations())
        };
        self.change_flash(&changes)?;
        self.report_outputs();
        if let Some(cause) = reset {
            self.carry_out_reset(cause)?;
            return Ok(None);
        }
        if due {
            if let Some(reason) = self.run_periodic_job()? {
                return Ok(Some(reason));
            }
            self.schedule_stop();
        }
        self.inject_due()?;
        self.apply_given_supply();
        if self.idle != IdleState::No && !self.wake_if_due() || self.core_stands_still() {
            if self.exchange_before_sleep()? {
                self.slept_cycles += self.cpu.machine().sleep();
            }
            return Ok(None);
        }
        if let Some(number) = self.deliverable() {
            let pc = self.cpu.reg(Reg::Pc);
            self.take_exception(number, pc);
            return Ok(None);
        }
        let stop = self.execute()?;
        Ok(self.handle_stop(stop))
    }

    /// Does what the core stopped for. Returns a reason to end, if any.
    fn handle_stop(&mut self, stop: Stop) -> Option<&'static str> {
        match stop {
            Stop::Requested => {}
            Stop::Supervisor => {
                let pc = self.cpu.reg(Reg::Pc);
                self.handle_fault(FaultCause::Supervisor, pc);
            }
            Stop::Breakpoint(0xAB) if self.options.semihosting => return self.serve_semihosting(),
            Stop::HardwareBreakpoint => self.halt_core(HaltReason::Breakpoint),
            // With a debugger BKPT halts (ARMv7-M ARM, C1.4.1).
            Stop::Breakpoint(_) if self.cpu.machine().scs.debug.is_enabled() => {
                self.halt_core(HaltReason::Breakpoint);
            }
            Stop::Breakpoint(_) => {
                let pc = self.cpu.reg(Reg::Pc);
                self.handle_fault(FaultCause::Breakpoint, pc);
            }
            Stop::ExceptionReturn(value) => self.exception_return(value),
            Stop::WaitForInterrupt => self.idle = IdleState::ForInterrupt,
            Stop::WaitForEvent => {
                let mut board = self.cpu.machine();
                self.idle = if std::mem::take(&mut board.event) { IdleState::No } else { IdleState::ForEvent };
            }
            Stop::Trap(trap) => {
                let pc = self.cpu.reg(Reg::Pc);
                self.handle_fault(FaultCause::Trap(trap), pc);
            }
        }
        None
    }

    /// Executes until something other than the end of a step of the lockstep stops it.
    fn execute(&mut self) -> Result<Stop> {
        loop {
            let stop = self.cpu.run();
            if stop != Stop::Requested || !self.cpu.machine().has_met_horizon() {
                return Ok(stop);
            }
            self.exchange()?;
        }
    }

    fn core_stands_still(&self) -> bool {
        let soc = &self.cpu.machine().soc;
        // A program in RAM goes on while the flash is erased or programmed.
        soc.clock_stopped() || soc.is_held_in_reset() || soc.core_waits() && is_in_flash(self.cpu.reg(Reg::Pc))
    }

    fn deliverable(&self) -> Option<u8> {
        let possible = self.cpu.machine().nvic.has_candidate();
        if !possible {
            return None;
        }
        let masks = self.cpu.masks();
        self.cpu.machine().deliverable(masks)
    }

    /// Ends the idle state if its wake-up condition is met; returns true if the core executes.
    fn wake_if_due(&mut self) -> bool {
        let masks = self.cpu.masks();
        let mut board = self.cpu.machine();
        let awake = match self.idle {
            IdleState::No => true,
            IdleState::LockedUp | IdleState::Halted => false,
            // An exception that PRIMASK masks still ends WFI (ARMv7-M ARM, B1.5.19).
            IdleState::ForInterrupt => board.nvic.deliverable(Masks { primask: false, ..masks }).is_some(),
            IdleState::ForEvent => board.nvic.deliverable(masks).is_some() || std::mem::take(&mut board.event),
        };
        drop(board);
        if awake {
            self.idle = IdleState::No;
        }
        awake
    }

    fn moment(&self) -> Moment {
        let board = self.cpu.machine();
        Moment { seconds: board.seconds(), instructions: board.instructions }
    }

    fn now_s(&self) -> f64 {
        report::seconds(self.cpu.machine().seconds())
    }

    /// Injects the faults that are due.
    fn inject_due(&mut self) -> Result<()> {
        let seconds = self.cpu.machine().seconds() + ROUNDING_S;
        for n in 0..self.injections.len() {
            if self.injections[n].due().is_none_or(|due| due > seconds) {
                continue;
            }
            let kind = self.injections[n].kind.clone();
            if !self.injections[n].is_pending() {
                self.end_injection(n, &kind)?;
                continue;
            }
            if let Some(phase_us) = self.injections[n].phase_us.take() {
                let wait = self.until_phase(phase_us);
                self.injections[n].at = seconds + wait.unwrap_or(0.0);
                if let (None, Some(line)) = (wait, self.injections[n].line) {
                    let (name, at) = (&self.injections[n].symbol, report::seconds(seconds));
                    eprintln!(
                        "virtual-board: the event `{name}` (line {line}) does not wait for its phase_us: the servo timer stands at {at} s"
                    );
                }
                self.schedule_stop();
                continue;
            }
            self.check_overlap(n)?;
            let outputs = self.output_state();
            let now = self.moment();
            match kind {
                InjectionKind::Hang(address) => {
                    self.injections[n].replaced = Some(self.cpu.patch_flash(address, BRANCH_TO_SELF)?);
                    self.cpu.machine().watched.push(address);
                    self.injections[n].note_injection(now);
                }
                InjectionKind::Fault(address) => {
                    self.injections[n].replaced = Some(self.cpu.patch_flash(address, PERMANENTLY_UNDEFINED)?);
                    self.injections[n].note_injection(now);
                }
                InjectionKind::Panic(function, arguments) => {
                    // Not inside a handler: this code runs again at the next return to thread mode.
                    if self.cpu.reg(Reg::Xpsr) & XPSR_EXCEPTION != 0
                        || matches!(self.idle, IdleState::LockedUp | IdleState::Halted)
                    {
                        continue;
                    }
                    anyhow::ensure!(
                        inject::call_panic(&mut self.cpu, function, arguments),
                        "the panic function cannot be called: the stack pointer leaves no space in RAM"
                    );
                    self.idle = IdleState::No;
                    self.injections[n].note_injection(now);
                    self.injections[n].note_effect(now, outputs);
                }
                InjectionKind::Halt => {
                    self.disturb(&kind)?;
                    self.idle = IdleState::Halted;
                    self.injections[n].note_injection(now);
                    self.injections[n].note_effect(now, outputs);
                }
                InjectionKind::Crystal
                | InjectionKind::Trigger
                | InjectionKind::Register { .. }
                | InjectionKind::Overrun
                | InjectionKind::Transfer
                | InjectionKind::Flip { .. }
                | InjectionKind::LowSpeedClock(_)
                | InjectionKind::Supply(_)
                | InjectionKind::Volts(..)
                | InjectionKind::Level(..)
                | InjectionKind::Slow(_)
                | InjectionKind::Other(_) => {
                    self.disturb(&kind)?;
                    self.injections[n].note_injection(now);
                    self.injections[n].note_effect(now, outputs);
                }
            }
            let line = ReportLine::Injected {
                t_s: report::seconds(now.seconds),
                kind: kind.name(),
                symbol: self.injections[n].symbol.clone(),
            };
            self.report.line(&line);
            if let Some(longest_s) = kind.wrong_pulses_s() {
                self.judge.injected(now.seconds, longest_s);
            }
            self.schedule_stop();
        }
        Ok(())
    }

    /// Schedules a stop at the next periodic job or injection.
    fn schedule_stop(&mut self) {
        let periodic = (self.periods + 1) as f64 * PERIODIC_JOB_S;
        let now = self.cpu.machine().seconds() + ROUNDING_S;
        let supply = self.lockstep.as_ref().and_then(Lockstep::supply_due);
        let due = self.injections.iter().filter_map(Injection::due).chain(supply).filter(|due| *due > now);
        let next = due.fold(periodic, f64::min);
        self.cpu.machine().stop_at(next);
    }

    fn carry_out_reset(&mut self, cause: ResetCause) -> Result<()> {
        // A debugger can read RAM during a reset: the last output of the program is not lost.
        self.drain_rtt();
        if let Some(rtt) = self.rtt {
            rtt.forget(&mut self.cpu);
        }
        self.record_signals()?;
        let now = {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.restart(cause, &mut memory);
            board.watched.clear();
            Moment { seconds: board.seconds(), instructions: board.instructions }
        };
        for n in 0..self.injections.len() {
            self.injections[n].note_reset(now);
            if let (Some(half), InjectionKind::Hang(address) | InjectionKind::Fault(address)) =
                (self.injections[n].replaced.take(), self.injections[n].kind.clone())
            {
                self.cpu.patch_flash(address, half)?;
            }
        }
        if self.options.debugger {
            self.cpu.machine().scs.debug.enable(true);
        }
        self.locked_at = None;
        self.set_breakpoints()?;
        self.change_memory(cause)?;
        let cpu = &self.cpu;
        // As the boot does: after these the supply was away for an unknown time.
        let keeps = !matches!(cause, ResetCause::PowerOn | ResetCause::BrownOut);
        let by_program = cause == ResetCause::Software;
        self.judge.reset(now.seconds, keeps, by_program, || {
            let mut flash = vec![0; PARAMETERS_END];
            cpu.read_memory(FLASH, &mut flash).then(|| Limits::of_flash(&flash))?
        });
        self.resets.push(ResetRecord { t_s: report::seconds(now.seconds), cause: cause.to_string() });
        self.boot(cause);
        self.schedule_stop();
        Ok(())
    }

    fn boot(&mut self, cause: ResetCause) {
        self.idle = IdleState::No;
        let sp = self.cpu.read_word(0).unwrap_or(0);
        let pc = self.cpu.read_word(4).unwrap_or(0);
        if [sp, pc] == [u32::MAX; 2] {
            // Without a program the first fetch and the vector of its fault fail (ARMv7-M ARM, B1.5.15). A new chip is no failure of a run.
            self.idle = IdleState::LockedUp;
        }
        self.cpu.reset(sp, pc);
        self.trace(Event::Boot);
        self.log.iter_mut().flatten().for_each(String::clear);
        self.reports.boot();
        self.report.line(&ReportLine::Boot { t_s: self.now_s(), cause: cause.to_string() });
        self.note_boot();
        if self.cpu.machine().scs.debug.catches(vector_catch::RESET) {
            self.halt_core(HaltReason::VectorCatch);
        }
    }
}

/// True for an address in flash, or in its copy at 0.
fn is_in_flash(address: u32) -> bool {
    address & !FLASH < FLASH_SIZE
}
