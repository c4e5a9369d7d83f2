//! The run: executes to the next deadline, takes exceptions, sleeps, resets, injects faults, and tells what happens.

mod exceptions;
mod housekeeping;

use std::io::Write;
use std::time::Instant;

use anyhow::Result;
use stm32f4_model::{ResetCause, Soc, SocConfig};

use crate::board::Board;
use crate::console::Console;
use crate::cpu::{Cpu, Reg, Stop, XPSR_EXCEPTION};
use crate::exception::Broken;
use crate::fault::Cause;
use crate::inject::{self, BRANCH_TO_SELF, Injection, Kind, PERMANENTLY_UNDEFINED, Stamp};
use crate::loader::Image;
use crate::nvic::Masks;
use crate::plant::BoardPlant;
use crate::recorder::Recorder;
use crate::report::{self, Line, Report, Reset};
use crate::rtt::Rtt;
use crate::unicorn::UnicornCpu;

/// Housekeeping in virtual time: RTT, commands, the end.
const HOUSEKEEPING_S: f64 = 1e-3;
/// How to run.
#[derive(Debug, Clone)]
pub(crate) struct Options {
    /// Virtual seconds; `None`: until `quit`, a signal, or nothing can happen any more.
    pub(crate) secs: Option<f64>,
    /// Cycles charged for an instruction.
    pub(crate) cpi: f64,
    /// Hold real time.
    pub(crate) pace: bool,
    /// End at the first lint.
    pub(crate) stop_on_lint: bool,
    /// Answer semihosting calls, and end with the program's status.
    pub(crate) semihosting: bool,
    /// Mode that the attached debugger sets in RTT.
    pub(crate) rtt_mode: Option<u32>,
    /// Take the bytes of RTT.
    pub(crate) drain: bool,
    /// Parts of the exception model to leave out.
    pub(crate) broken: Broken,
    /// Leave the translator's flags stale.
    pub(crate) stale_flags: bool,
}

/// Where the core stands when it does not execute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Idle {
    No,
    ForInterrupt,
    ForEvent,
    LockedUp,
}

/// One run of an image.
pub(crate) struct Run<'a, W: Write> {
    cpu: UnicornCpu<Board>,
    image: &'a Image,
    options: Options,
    report: Report<W>,
    console: Console,
    rtt: Option<Rtt>,
    recorder: Recorder,
    injections: Vec<Injection>,
    idle: Idle,
    periods: u64,
    started: Instant,
    told_lints: [usize; 2],
    resets: Vec<Reset>,
    faults: u64,
    unexpected_faults: u64,
    locked_up: bool,
    exceptions: u64,
    rtt_bytes: u64,
    slept_cycles: u64,
    last_status: u64,
    status: Option<u32>,
}

impl<'a, W: Write> Run<'a, W> {
    /// Prepares a run of `image`.
    ///
    /// # Errors
    /// The emulator cannot be set up.
    #[expect(clippy::too_many_arguments, reason = "the parts of a run, each used once")]
    pub(crate) fn new(
        image: &'a Image,
        config: SocConfig,
        plant: BoardPlant,
        injections: Vec<Injection>,
        recorder: Recorder,
        console: Console,
        report: Report<W>,
        options: Options,
    ) -> Result<Self> {
        let board = Board::new(Soc::new(config), plant, options.cpi);
        let rtt =
            image.symbol("_SEGGER_RTT").map(|address| Rtt { address, mode: options.rtt_mode, drain: options.drain });
        Ok(Run {
            cpu: UnicornCpu::new(&image.flash, board, options.stale_flags)?,
            image,
            options,
            report,
            console,
            rtt,
            recorder,
            injections,
            idle: Idle::No,
            periods: 0,
            started: Instant::now(),
            told_lints: [0; 2],
            resets: Vec::new(),
            faults: 0,
            unexpected_faults: 0,
            locked_up: false,
            exceptions: 0,
            rtt_bytes: 0,
            slept_cycles: 0,
            last_status: 0,
            status: None,
        })
    }

    /// Runs to the end, and gives back the status to exit with: the program's own where it gave one, else 1 when anything was wrong.
    ///
    /// # Errors
    /// A file cannot be written, or the emulator refuses what it should not.
    pub(crate) fn run(mut self) -> Result<u8> {
        let hclk_hz = self.cpu.machine().soc.hclk_hz();
        let (elf_sha256, cpi) = (self.image.sha256.clone(), self.options.cpi);
        self.report.line(&Line::Start { elf_sha256, hclk_hz, cpi });
        self.boot(ResetCause::PowerOn);
        self.plan_stop();
        let reason = loop {
            if let Some(reason) = self.step()? {
                break reason;
            }
        };
        self.end(reason)
    }

    /// One round: brings everything to the present, then executes or sleeps to the next deadline.
    fn step(&mut self) -> Result<Option<&'static str>> {
        let (reset, due) = {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.sync(&mut memory);
            (board.reset, board.stop_is_due())
        };
        self.observe();
        if let Some(cause) = reset {
            self.follow_reset(cause)?;
            return Ok(None);
        }
        if due {
            if let Some(reason) = self.housekeeping()? {
                return Ok(Some(reason));
            }
            self.plan_stop();
        }
        self.inject()?;
        if self.idle != Idle::No && !self.wakes() || self.cpu.machine().soc.clock_stopped() {
            let mut board = self.cpu.machine();
            let before = board.now();
            board.sleep();
            self.slept_cycles += board.now() - before;
            return Ok(None);
        }
        if let Some(number) = self.deliverable() {
            let pc = self.cpu.reg(Reg::Pc);
            self.take(number, pc);
            return Ok(None);
        }
        match self.cpu.run() {
            Stop::Requested => {}
            Stop::Supervisor => {
                let pc = self.cpu.reg(Reg::Pc);
                self.fault(Cause::Supervisor, pc);
            }
            Stop::Breakpoint(0xAB) if self.options.semihosting => return Ok(self.semihosting()),
            Stop::Breakpoint(_) => {
                let pc = self.cpu.reg(Reg::Pc);
                self.fault(Cause::Breakpoint, pc);
            }
            Stop::ExceptionReturn(value) => self.exception_return(value),
            Stop::WaitForInterrupt => self.idle = Idle::ForInterrupt,
            Stop::WaitForEvent => {
                let mut board = self.cpu.machine();
                self.idle = if std::mem::take(&mut board.event) { Idle::No } else { Idle::ForEvent };
            }
            Stop::Trap(trap) => {
                let pc = self.cpu.reg(Reg::Pc);
                self.fault(Cause::Trap(trap), pc);
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

    /// True, and no longer idle, when what the core waits for has come.
    fn wakes(&mut self) -> bool {
        let masks = self.cpu.masks();
        let mut board = self.cpu.machine();
        let awake = match self.idle {
            Idle::No => true,
            Idle::LockedUp => false,
            // PRIMASK does not keep WFI asleep (ARMv7-M ARM, B1.5.19).
            Idle::ForInterrupt => board.nvic.deliverable(Masks { primask: false, ..masks }).is_some(),
            Idle::ForEvent => board.nvic.deliverable(masks).is_some() || std::mem::take(&mut board.event),
        };
        drop(board);
        if awake {
            self.idle = Idle::No;
        }
        awake
    }

    fn stamp(&self) -> Stamp {
        let board = self.cpu.machine();
        Stamp { seconds: board.seconds(), instructions: board.instructions }
    }

    fn now_s(&self) -> f64 {
        report::seconds(self.cpu.machine().seconds())
    }

    /// Puts in the faults that are due.
    fn inject(&mut self) -> Result<()> {
        let seconds = self.cpu.machine().seconds();
        for n in 0..self.injections.len() {
            let injection = &self.injections[n];
            if !injection.waits() || injection.at > seconds {
                continue;
            }
            let kind = injection.kind;
            let (armed, high) = self.outputs();
            let now = self.stamp();
            match kind {
                Kind::Hang(address) => {
                    self.injections[n].replaced = Some(self.cpu.patch_flash(address, BRANCH_TO_SELF)?);
                    self.cpu.machine().watch.push(address);
                    self.injections[n].inject(now);
                }
                Kind::Fault(address) => {
                    self.injections[n].replaced = Some(self.cpu.patch_flash(address, PERMANENTLY_UNDEFINED)?);
                    self.injections[n].inject(now);
                }
                Kind::Panic(function, arguments) => {
                    // A handler is left alone; the next return to thread mode comes by here again.
                    if self.cpu.reg(Reg::Xpsr) & XPSR_EXCEPTION != 0 || self.idle == Idle::LockedUp {
                        continue;
                    }
                    anyhow::ensure!(
                        inject::call_panic(&mut self.cpu, function, arguments),
                        "no room on the stack to call the panic function"
                    );
                    self.idle = Idle::No;
                    self.injections[n].inject(now);
                    self.injections[n].show(now, armed, high);
                }
                Kind::Crystal => {
                    let (mut board, mut memory) = self.cpu.machine_and_memory();
                    board.soc.fail_hse();
                    // The clock, and with it the deadline, is another one from here on.
                    board.sync(&mut memory);
                    drop(board);
                    self.injections[n].inject(now);
                    self.injections[n].show(now, armed, high);
                }
                Kind::Overrun | Kind::Transfer => {
                    let mut board = self.cpu.machine();
                    match kind {
                        Kind::Overrun => board.soc.hold_up_converter(0),
                        _ => board.soc.cut_transfer(1, 0),
                    }
                    drop(board);
                    self.injections[n].inject(now);
                    self.injections[n].show(now, armed, high);
                }
            }
            let line = Line::Injected {
                t_s: report::seconds(now.seconds),
                kind: kind.name(),
                symbol: self.injections[n].symbol.clone(),
            };
            self.report.line(&line);
            self.plan_stop();
        }
        Ok(())
    }

    /// Asks the board to stop at the next housekeeping or injection.
    fn plan_stop(&mut self) {
        let housekeeping = (self.periods + 1) as f64 * HOUSEKEEPING_S;
        let now = self.cpu.machine().seconds();
        let injections = self.injections.iter().filter(|injection| injection.waits() && injection.at > now);
        let next = injections.map(|injection| injection.at).fold(housekeeping, f64::min);
        self.cpu.machine().stop_at(next);
    }

    fn follow_reset(&mut self, cause: ResetCause) -> Result<()> {
        // A debugger reads RAM through a reset: what the program said last is not lost.
        self.drain_rtt();
        self.record()?;
        let now = {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.restart(cause, &mut memory);
            board.watch.clear();
            Stamp { seconds: board.seconds(), instructions: board.instructions }
        };
        for n in 0..self.injections.len() {
            self.injections[n].note_reset(now);
            if let (Some(half), Kind::Hang(address) | Kind::Fault(address)) =
                (self.injections[n].replaced.take(), self.injections[n].kind)
            {
                self.cpu.patch_flash(address, half)?;
            }
        }
        self.resets.push(Reset { t_s: report::seconds(now.seconds), cause: cause.to_string() });
        self.boot(cause);
        self.plan_stop();
        Ok(())
    }

    fn boot(&mut self, cause: ResetCause) {
        self.idle = Idle::No;
        // The loader has checked both words.
        let sp = self.cpu.read_word(0).unwrap_or(0);
        let pc = self.cpu.read_word(4).unwrap_or(0);
        self.cpu.reset(sp, pc);
        self.report.line(&Line::Boot { t_s: self.now_s(), cause: cause.to_string() });
    }
}
