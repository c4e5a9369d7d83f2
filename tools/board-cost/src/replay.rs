//! Follows a trace: which code runs for whom, how many instructions, how many modelled cycles.
//!
//! Each exception, and the thread, is a level with its own calls. A level's code belongs to the stage that its functions name
//! ([`crate::stage`]), else to that of the caller.

use std::collections::{BTreeMap, HashMap};

use anyhow::{Context, Result, ensure};

use crate::block::Block;
use crate::flash::{Control, Flash, Prefetched};
use crate::instruction::Decoder;
use crate::program::Program;
use crate::stage::{Stage, Stages, TELEMETRY_STEP};
use crate::statistics::{Cost, Row};
use crate::timing;
use crate::trace::Event;

/// Exceptions before the first interrupt.
const CORE_EXCEPTIONS: u32 = 16;
/// Calls that are in each other, at most: more is an error of this program.
const DEEPEST: usize = 200;

/// Which interrupts a tick consists of, and the names of all.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Interrupts {
    /// Exception number of the interrupt that begins a tick.
    pub begins_tick: u32,
    /// Exception number of the one that runs the control task.
    pub runs_tick: u32,
    /// Names by exception number.
    pub names: Vec<(u32, String)>,
}

impl Interrupts {
    /// Those of the firmware.
    #[must_use]
    pub fn of_firmware() -> Self {
        use firmware::interrupts::{BLOCK_END, ENABLED, TICK};
        let number = |line: u8| CORE_EXCEPTIONS + u32::from(line);
        Self {
            begins_tick: number(BLOCK_END.line),
            runs_tick: number(TICK.line),
            names: ENABLED.iter().map(|one| (number(one.line), one.name.to_owned())).collect(),
        }
    }
}

/// What is counted.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options {
    /// Virtual milliseconds before the count begins.
    pub from_ms: u64,
    /// Virtual milliseconds that are counted; `None`: to the end.
    pub for_ms: Option<u64>,
    /// The flash interface, if not as the program sets it.
    pub flash: Option<Control>,
    /// What is assumed of a prefetched line.
    pub prefetched: Prefetched,
    /// Functions each of whose calls is a sample, by their symbols.
    pub functions: Vec<String>,
    /// Each instruction of the tick is counted too.
    pub listing: bool,
}

/// A function that was called and has not returned.
struct Frame {
    return_to: u32,
    /// Of the code that called it.
    stage: Stage,
    /// Its samples, if it is one of those that are asked for.
    counted: Option<usize>,
    /// What the level had cost when it was entered.
    entered: Cost,
}

/// The thread, or an exception.
struct Level {
    /// Exception number; 0: the thread.
    number: u32,
    calls: Vec<Frame>,
    /// Of code that no rule names and nobody called.
    base: Stage,
    /// The block that ran last.
    last: Option<usize>,
    /// The next block is the first one of a function that was called.
    entering: bool,
    /// The frame has room for floating-point registers that are not stored yet.
    unstored: bool,
    /// They were stored.
    stored: bool,
    cost: Cost,
}

/// Costs of one part: of the present period, and of those before.
#[derive(Default)]
struct Account {
    now: Cost,
    samples: Vec<Cost>,
}

/// The state of a run.
pub struct Replay<'a> {
    program: &'a Program<'a>,
    decoder: Decoder,
    stages: Stages,
    interrupts: Interrupts,
    options: Options,
    flash: Flash,
    blocks: Vec<Block>,
    known: HashMap<(u32, u32), usize>,
    levels: Vec<Level>,
    /// Of each stage.
    by_stage: Vec<Account>,
    tick: Account,
    /// Of everything in a control period.
    period: Account,
    /// Of everything in the thread, in a round of telemetry.
    round: Account,
    by_exception: HashMap<u32, Vec<Cost>>,
    /// Addresses of the functions that are asked for.
    functions: HashMap<u32, usize>,
    by_function: Vec<Vec<Cost>>,
    telemetry: Option<u32>,
    milliseconds: u64,
    cycle: u64,
    /// Divisions of the present block so far.
    divisions: usize,
    /// The count has begun: the present period is whole.
    counting: bool,
    /// Cycles that were counted.
    counted_cycles: u64,
    /// Of each instruction of the tick, by its address.
    by_address: BTreeMap<u32, Cost>,
}

impl<'a> Replay<'a> {
    /// A run that has not begun.
    ///
    /// # Errors
    ///
    /// When a function is not in the image, or the disassembler cannot be started.
    pub fn new(program: &'a Program<'a>, interrupts: Interrupts, options: Options) -> Result<Self> {
        let mut functions = HashMap::new();
        for (place, name) in options.functions.iter().enumerate() {
            functions.insert(program.image.functions[program.image.only(name)?].address, place);
        }
        let telemetry = program.image.only(TELEMETRY_STEP).ok();
        Ok(Self {
            decoder: Decoder::new()?,
            stages: Stages::default(),
            flash: Flash::new(options.flash.unwrap_or_default(), options.prefetched),
            blocks: Vec::new(),
            known: HashMap::new(),
            levels: vec![Level::new(0, Stage::Thread)],
            by_stage: Stage::ALL.iter().map(|_| Account::default()).collect(),
            tick: Account::default(),
            period: Account::default(),
            round: Account::default(),
            by_exception: HashMap::new(),
            by_function: options.functions.iter().map(|_| Vec::new()).collect(),
            functions,
            telemetry: telemetry.map(|place| program.image.functions[place].address),
            milliseconds: 0,
            cycle: 0,
            divisions: 0,
            counting: false,
            counted_cycles: 0,
            by_address: BTreeMap::new(),
            program,
            interrupts,
            options,
        })
    }

    /// Takes the next event.
    ///
    /// # Errors
    ///
    /// When the trace does not fit the image.
    pub fn take(&mut self, event: Event) -> Result<()> {
        match event {
            Event::Block { address, length } => self.block(address, length)?,
            Event::Exception { number, floating, chained } => self.exception(number, floating, chained)?,
            Event::Return => self.exception_return()?,
            Event::Division(dividend, divisor) => {
                let block = self.levels.last().and_then(|level| level.last);
                let own = block.and_then(|block| self.blocks[block].divisions.get(self.divisions).copied().flatten());
                self.divisions += 1;
                self.wait(own, u64::from(timing::division(dividend, divisor)));
            }
            Event::FlashControl(control) => {
                if self.options.flash.is_none() {
                    self.flash.set(control);
                }
            }
            Event::Millisecond => self.milliseconds += 1,
            Event::Boot => {
                self.levels = vec![Level::new(0, Stage::Thread)];
                self.counting = false;
            }
        }
        Ok(())
    }

    /// The results: every part that ran.
    ///
    /// # Errors
    ///
    /// When a rule of a stage named no code that ran, unless functions were asked for.
    pub fn finish(self) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        if self.options.functions.is_empty() {
            self.stages.check()?;
            rows.extend(Row::of("tick", &self.tick.samples));
            for (stage, account) in Stage::ALL.iter().zip(&self.by_stage) {
                rows.extend(Row::of(stage.name(), &account.samples));
            }
            rows.extend(Row::of("thread", &self.round.samples));
            for (number, name) in &self.interrupts.names {
                let samples = self.by_exception.get(number);
                rows.extend(samples.and_then(|samples| Row::of(&format!("interrupt: {name}"), samples)));
            }
            rows.extend(Row::of("control period", &self.period.samples));
        }
        for (name, samples) in self.options.functions.iter().zip(&self.by_function) {
            let row = Row::of(name, samples);
            rows.push(row.with_context(|| format!("`{name}` was not called while it was counted"))?);
        }
        Ok(rows)
    }

    /// The functions that are asked for, with the instructions of each of their calls, in order.
    pub fn calls(&self) -> impl Iterator<Item = (&str, Vec<u64>)> {
        let counts = |calls: &Vec<Cost>| calls.iter().map(|cost| cost.instructions).collect();
        self.options.functions.iter().map(String::as_str).zip(self.by_function.iter().map(counts))
    }

    /// Cycles that the core executed, out of those that passed while they were counted.
    #[must_use]
    pub const fn counted_cycles(&self) -> u64 {
        self.counted_cycles
    }

    fn in_window(&self) -> bool {
        let from = self.options.from_ms;
        self.milliseconds >= from && self.options.for_ms.is_none_or(|length| self.milliseconds < from + length)
    }

    fn block(&mut self, address: u32, length: u32) -> Result<()> {
        let index = self.index(address, length)?;
        let level = self.levels.last().context("no level")?;
        // The refill belongs to the code that jumped, and to its function.
        if let Some(last) = level.last.filter(|&last| self.blocks[last].end != address || self.blocks[last].is_call) {
            let before = &self.blocks[last];
            if let Some(jump) = before.jump {
                let cycles = timing::refill(jump, self.blocks[index].begins_unaligned);
                let last = before.instructions.last().map(|one| one.address);
                self.wait(before.parts.last().and_then(|part| part.stage), cycles.into());
                self.list(last, Cost { cycles: cycles.into(), ..Cost::NONE });
            }
        }
        self.follow_calls(address, index)?;
        if self.levels.len() == 1 && Some(address) == self.telemetry {
            self.end_round();
        }
        let level = self.levels.last_mut().context("no level")?;
        level.last = Some(index);
        level.entering = self.blocks[index].is_call;
        self.divisions = 0;
        if self.blocks[index].floating && std::mem::take(&mut level.unstored) {
            level.stored = true;
            self.wait(None, timing::FLOATING_WORDS);
        }
        let mut literals = 0;
        for place in 0..self.blocks[index].parts.len() {
            let part = self.blocks[index].parts[place];
            let stall = self.flash.fetch(part.line, self.cycle);
            let (instructions, cycles) = (part.instructions.into(), part.cycles.into());
            self.charge(part.stage, Cost { instructions, cycles, stalls: stall });
            self.list_part(index, place, stall);
            while let Some(&(_, line)) = self.blocks[index].literals.get(literals).filter(|(at, _)| *at == place) {
                literals += 1;
                let stall = self.flash.read_data(line, self.cycle);
                self.charge(part.stage, Cost { stalls: stall, ..Cost::NONE });
                let last = self.blocks[index].instructions.iter().rev().find(|one| one.part == place);
                self.list(last.map(|one| one.address), Cost { stalls: stall, ..Cost::NONE });
            }
        }
        Ok(())
    }

    /// Counts the instructions of a part of a block for the listing; the first one waits for the flash.
    fn list_part(&mut self, block: usize, part: usize, mut stalls: u64) {
        if !self.options.listing {
            return;
        }
        for place in 0..self.blocks[block].instructions.len() {
            let one = self.blocks[block].instructions[place];
            if one.part == part {
                let stalls = std::mem::take(&mut stalls);
                self.list(Some(one.address), Cost { instructions: 1, cycles: one.cycles.into(), stalls });
            }
        }
    }

    /// Adds a cost to an instruction of the tick.
    fn list(&mut self, address: Option<u32>, cost: Cost) {
        let tick = [self.interrupts.begins_tick, self.interrupts.runs_tick];
        let is_in_tick = self.levels.last().is_some_and(|level| tick.contains(&level.number));
        if let Some(address) = address.filter(|_| self.options.listing && self.counting && is_in_tick) {
            self.by_address.entry(address).or_default().add(cost);
        }
    }

    /// Each instruction of the tick with its cost in all ticks, by its address; and how many ticks there were.
    #[must_use]
    pub fn listing(&self) -> (&BTreeMap<u32, Cost>, usize) {
        (&self.by_address, self.tick.samples.len())
    }

    /// The place of a block in the list of those that are known.
    fn index(&mut self, address: u32, length: u32) -> Result<usize> {
        if let Some(&index) = self.known.get(&(address, length)) {
            return Ok(index);
        }
        let block = Block::read(self.program, &self.decoder, &mut self.stages, address, length);
        self.blocks.push(block.context("the trace is of another image")?);
        let index = self.blocks.len() - 1;
        self.known.insert((address, length), index);
        Ok(index)
    }

    /// Notes a call, a return or a jump to another function, which the block at this address follows.
    fn follow_calls(&mut self, address: u32, index: usize) -> Result<()> {
        let level = self.levels.last_mut().context("no level")?;
        let Some(last) = level.last else { return Ok(()) };
        let before = &self.blocks[last];
        let inherited = level.calls.last().map_or(level.base, |frame| frame.stage);
        let stage = before.parts.last().and_then(|part| part.stage).unwrap_or(inherited);
        if level.entering && address != before.end {
            ensure!(level.calls.len() < DEEPEST, "more than {DEEPEST} calls in each other at {address:#010x}");
            let counted = self.functions.get(&address).copied();
            level.calls.push(Frame { return_to: before.end, stage, counted, entered: level.cost });
            return Ok(());
        }
        if let Some(place) = level.calls.iter().rposition(|frame| frame.return_to == address) {
            let total = level.cost;
            let returned: Vec<Frame> = level.calls.drain(place..).collect();
            if self.in_window() {
                for frame in returned {
                    if let Some(counted) = frame.counted {
                        self.by_function[counted].push(total.since(frame.entered));
                    }
                }
            }
        } else if before.function != self.blocks[index].function {
            // A jump to another function, which returns to the caller of this one.
            match level.calls.last_mut() {
                Some(frame) => frame.stage = stage,
                None => level.base = stage,
            }
        }
        Ok(())
    }

    fn exception(&mut self, number: u32, floating: bool, chained: bool) -> Result<()> {
        let mut unstored = floating;
        let mut stored = false;
        if chained {
            let ended = self.end_level()?;
            (unstored, stored) = (ended.unstored, ended.stored);
        }
        if number == self.interrupts.begins_tick {
            self.begin_tick();
        }
        let base = if number == self.interrupts.begins_tick { Stage::Sample } else { Stage::Interrupt };
        self.levels.push(Level { unstored, stored, ..Level::new(number, base) });
        self.wait(None, if chained { timing::TAIL_CHAIN } else { timing::EXCEPTION_ENTRY });
        Ok(())
    }

    fn exception_return(&mut self) -> Result<()> {
        let stored = self.levels.last().is_some_and(|level| level.stored);
        self.wait(None, timing::EXCEPTION_RETURN + if stored { timing::FLOATING_WORDS } else { 0 });
        self.end_level().map(drop)
    }

    fn end_level(&mut self) -> Result<Level> {
        ensure!(self.levels.len() > 1, "the trace has a return from an exception that was not taken");
        let level = self.levels.pop().context("no level")?;
        if self.in_window() && self.counting {
            self.by_exception.entry(level.number).or_default().push(level.cost);
        }
        Ok(level)
    }

    /// Ends a control period, and begins the next one.
    fn begin_tick(&mut self) {
        let keep = self.counting && self.in_window();
        self.counting = self.in_window();
        self.tick.close(keep);
        self.period.close(keep);
        for (stage, account) in Stage::ALL.iter().zip(&mut self.by_stage) {
            if stage.is_in_tick() {
                account.close(keep);
            }
        }
    }

    fn end_round(&mut self) {
        let keep = self.counting && self.in_window();
        self.round.close(keep);
        for (stage, account) in Stage::ALL.iter().zip(&mut self.by_stage) {
            if !stage.is_in_tick() {
                account.close(keep);
            }
        }
    }

    /// Cycles without an instruction.
    fn wait(&mut self, stage: Option<Stage>, cycles: u64) {
        self.charge(stage, Cost { cycles, ..Cost::NONE });
    }

    fn charge(&mut self, own: Option<Stage>, cost: Cost) {
        self.cycle += cost.all_cycles();
        let Some(level) = self.levels.last_mut() else { return };
        level.cost.add(cost);
        self.period.now.add(cost);
        if self.counting {
            self.counted_cycles += cost.all_cycles();
        }
        let stage = own.unwrap_or_else(|| level.calls.last().map_or(level.base, |frame| frame.stage));
        if level.number == 0 {
            self.round.now.add(cost);
            self.by_stage[stage as usize].now.add(cost);
        } else if level.number == self.interrupts.begins_tick {
            self.tick.now.add(cost);
            self.by_stage[Stage::Sample as usize].now.add(cost);
        } else if level.number == self.interrupts.runs_tick {
            self.tick.now.add(cost);
            self.by_stage[stage as usize].now.add(cost);
        }
    }
}

impl Level {
    const fn new(number: u32, base: Stage) -> Self {
        Self {
            number,
            calls: Vec::new(),
            base,
            last: None,
            entering: false,
            unstored: false,
            stored: false,
            cost: Cost::NONE,
        }
    }
}

impl Account {
    fn close(&mut self, keep: bool) {
        let cost = std::mem::take(&mut self.now);
        if keep {
            self.samples.push(cost);
        }
    }
}
