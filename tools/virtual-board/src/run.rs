//! Run of a program: executes to the next deadline, takes exceptions, sleeps, resets, injects faults, and reports events.

mod campaign;
mod case;
mod exceptions;
mod periodic;

use std::io::Write;
use std::time::Instant;

use anyhow::Result;
use stm32f4_model::{ResetCause, Soc, SocConfig, Width};

use crate::board::BoardModel;
use crate::campaign::Driving;
use crate::console::Console;
use crate::cpu::{Cpu, Reg, Stop, XPSR_EXCEPTION};
use crate::exception::OmittedParts;
use crate::fault::FaultCause;
use crate::inject::{self, BRANCH_TO_SELF, Injection, InjectionKind, Moment, PERMANENTLY_UNDEFINED};
use crate::judge::{Judge, JudgeLog, Limits};
use crate::loader::ProgramImage;
use crate::nvic::Masks;
use crate::plant::{BUTTON, BoardPlant, EMERGENCY_STOP};
use crate::recorder::SignalRecorder;
use crate::report::{self, ReportLine, ReportWriter, ResetRecord};
use crate::rtt::Rtt;
use crate::serial::SerialPort;
use crate::servos::Servos;
use crate::unicorn::UnicornCpu;

pub(crate) use campaign::Plan;

/// Virtual time between two periodic jobs (RTT, commands, end of the run), s.
const PERIODIC_JOB_S: f64 = 1e-3;

/// Far less than a cycle, and more than a rounding of the time, s.
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
    /// A debugger is attached.
    pub(crate) debugger: bool,
    /// Parts of the exception model to leave out.
    pub(crate) omitted: OmittedParts,
    /// Do not refresh the translator's cached flags.
    pub(crate) stale_flags: bool,
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
    /// A debugger has halted it. Only a reset ends that here.
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
    rtt: Option<Rtt>,
    recorder: SignalRecorder,
    injections: Vec<Injection>,
    /// Judges every pulse.
    judge: Judge,
    judge_log: JudgeLog,
    /// Modelled servos at the servo pins.
    pub(crate) servos: Option<Servos>,
    /// When the servos were driven, in a campaign.
    driving: Option<Driving>,
    /// The log since the last boot, as hex; `None`: not kept.
    log: Option<String>,
    idle: IdleState,
    periods: u64,
    started: Instant,
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
    /// The emulator cannot be set up.
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
        board.scs.debugger = options.debugger;
        let rtt =
            image.symbol("_SEGGER_RTT").map(|address| Rtt { address, mode: options.rtt_mode, drain: options.drain });
        let judge_log = JudgeLog::of_environment(options.violates.clone());
        Ok(BoardRun {
            cpu: UnicornCpu::new(&image.flash, board, options.stale_flags)?,
            image,
            options,
            report,
            console,
            serial,
            rtt,
            recorder,
            injections,
            judge: Judge::new(Limits::of_flash(&image.flash)),
            judge_log,
            servos: None,
            driving: None,
            log: None,
            idle: IdleState::No,
            periods: 0,
            started: Instant::now(),
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
        self.begin();
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
        self.report.line(&ReportLine::Start { elf_sha256, hclk_hz, cpi });
        if let Some(SerialPort { name, .. }) = &self.serial {
            self.report.line(&ReportLine::Serial { port: name.clone() });
            self.report.flush();
        }
        self.boot(ResetCause::PowerOn);
        self.schedule_stop();
    }

    /// Advances the peripherals to the present, then executes or sleeps to the next deadline. Returns a reason to end, if any.
    fn step(&mut self) -> Result<Option<&'static str>> {
        let (reset, due) = {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.sync(&mut memory);
            if self.idle != IdleState::No {
                let pending = self.injections.iter().filter(|injection| injection.is_pending());
                let injection_s = pending.map(|injection| injection.at).fold(f64::INFINITY, f64::min);
                while board.is_quiet(injection_s) {
                    let seconds = board.seconds();
                    let [button, stop] = [BUTTON, EMERGENCY_STOP].map(|pin| board.plant.level(pin, seconds));
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
            (board.reset, board.stop_is_due())
        };
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
        if self.idle != IdleState::No && !self.wake_if_due() || self.cpu.machine().soc.clock_stopped() {
            self.slept_cycles += self.cpu.machine().sleep();
            return Ok(None);
        }
        if let Some(number) = self.deliverable() {
            let pc = self.cpu.reg(Reg::Pc);
            self.take_exception(number, pc);
            return Ok(None);
        }
        match self.cpu.run() {
            Stop::Requested => {}
            Stop::Supervisor => {
                let pc = self.cpu.reg(Reg::Pc);
                self.handle_fault(FaultCause::Supervisor, pc);
            }
            Stop::Breakpoint(0xAB) if self.options.semihosting => return Ok(self.serve_semihosting()),
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
        Ok(None)
    }

    fn deliverable(&self) -> Option<u8> {
        let possible = self.cpu.machine().nvic.has_candidate();
        if !possible {
            return None;
        }
        let masks = self.cpu.masks();
        self.cpu.machine().nvic.deliverable(masks)
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
        let seconds = self.cpu.machine().seconds();
        for n in 0..self.injections.len() {
            let injection = &self.injections[n];
            // The time of the cycle at which it is due may be less by a rounding.
            if !injection.is_pending() || injection.at > seconds + ROUNDING_S {
                continue;
            }
            let kind = injection.kind;
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
                    self.disturb(kind)?;
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
                | InjectionKind::Exception(_)
                | InjectionKind::Reset(_)
                | InjectionKind::Flash { .. } => {
                    self.disturb(kind)?;
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
            if kind.can_cut_a_pulse() {
                self.judge.injected(now.seconds);
            }
            self.schedule_stop();
        }
        Ok(())
    }

    /// Changes what is outside the program: the crystal, peripherals, bits, voltages, levels, the speed.
    fn disturb(&mut self, kind: InjectionKind) -> Result<()> {
        /// Control register 1 of TIM2.
        const TIM2_CR1: u32 = 0x4000_0000;
        if let InjectionKind::Flip { address, mask } = kind
            && let Some(word) = self.cpu.read_word(address)
        {
            anyhow::ensure!(
                self.cpu.write_ram(address, &(word ^ mask).to_le_bytes()),
                "{address:#010x} is neither a register nor in RAM"
            );
            return Ok(());
        }
        if let InjectionKind::Flash { address, half } = kind {
            self.cpu.patch_flash(address, half)?;
            return Ok(());
        }
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        match kind {
            InjectionKind::Flip { address, mask } => {
                let word = board.soc.read(address, Width::Word);
                board.soc.write(address, Width::Word, word ^ mask);
            }
            InjectionKind::Crystal => board.soc.fail_hse(),
            InjectionKind::Trigger => board.soc.write(TIM2_CR1, Width::Word, 0),
            InjectionKind::Register { address, value } => board.soc.write(address, Width::Word, value),
            InjectionKind::Overrun => board.soc.force_overrun(0),
            InjectionKind::Transfer => board.soc.fail_next_transfer(1, 0),
            InjectionKind::Halt => {
                board.scs.debugger = true;
                board.soc.halt();
            }
            InjectionKind::LowSpeedClock(hz) => board.soc.set_lsi(hz),
            InjectionKind::Supply(volts) => board.plant.hold_supply(volts),
            InjectionKind::Volts(pin, volts) => board.plant.hold_volts(pin, volts),
            InjectionKind::Level(pin, high) => board.plant.hold_level(pin, high),
            InjectionKind::Slow(cpi) => board.set_cpi(cpi),
            InjectionKind::Exception(number) => {
                board.nvic.enable(number);
                board.nvic.pend(number);
            }
            InjectionKind::Reset(cause) => board.reset = Some(cause),
            // Done above, or by `inject_due`.
            InjectionKind::Flash { .. }
            | InjectionKind::Hang(_)
            | InjectionKind::Fault(_)
            | InjectionKind::Panic(..) => {}
        }
        // The clock, and with it the deadline, may have changed.
        board.sync(&mut memory);
        Ok(())
    }

    /// Schedules a stop at the next periodic job or injection.
    fn schedule_stop(&mut self) {
        let periodic = (self.periods + 1) as f64 * PERIODIC_JOB_S;
        let now = self.cpu.machine().seconds();
        let injections = self.injections.iter().filter(|injection| injection.is_pending() && injection.at > now);
        let next = injections.map(|injection| injection.at).fold(periodic, f64::min);
        self.cpu.machine().stop_at(next);
    }

    fn carry_out_reset(&mut self, cause: ResetCause) -> Result<()> {
        // A debugger can read RAM during a reset: the last output of the program is not lost.
        self.drain_rtt();
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
                (self.injections[n].replaced.take(), self.injections[n].kind)
            {
                self.cpu.patch_flash(address, half)?;
            }
        }
        self.judge.reset(now.seconds);
        self.resets.push(ResetRecord { t_s: report::seconds(now.seconds), cause: cause.to_string() });
        self.boot(cause);
        self.schedule_stop();
        Ok(())
    }

    fn boot(&mut self, cause: ResetCause) {
        self.idle = IdleState::No;
        // The loader has verified both words.
        let sp = self.cpu.read_word(0).unwrap_or(0);
        let pc = self.cpu.read_word(4).unwrap_or(0);
        self.cpu.reset(sp, pc);
        self.log.iter_mut().for_each(String::clear);
        self.report.line(&ReportLine::Boot { t_s: self.now_s(), cause: cause.to_string() });
    }
}
