//! What is outside the program changes, and changes back: clocks, supply, peripherals, registers, flash, voltages, levels, the reader of the log.

use std::io::Write;

use anyhow::{Result, ensure};
use stm32f4_model::{DmaMemory, FlashOperation, ResetCause, Width};

use super::drift::{Drift, Oscillator};
use super::{BoardRun, IdleState};
use crate::board::BoardModel;
use crate::cpu::{Cpu, Machine as _, Reg};
use crate::inject::{Injection, InjectionKind};
use crate::random::Random;
use crate::rtt::RttReading;
use crate::script::{Inject, Memory, RttReader, Stream};
use crate::unicorn::rams;
use crate::waveform::{Wave, Waveform};

/// Control register 1 of TIM2.
const TIM2_CR1: u32 = 0x4000_0000;
/// Period, prescaler and counter of TIM1, which makes the servo frames.
const TIM1_CNT: u32 = 0x4001_0024;
const TIM1_ARR: u32 = 0x4001_002C;
const TIM1_CR1: u32 = 0x4001_0000;
/// Clocks of the peripherals of APB2, among them TIM1 (RM0090 7.3.14).
const RCC_APB2ENR: u32 = 0x4002_3844;
const TIM1_ENABLED: u32 = 1;
/// Registers of the flash interface.
const FLASH_KEYR: u32 = 0x4002_3C04;
const FLASH_CR: u32 = 0x4002_3C10;
const FLASH_KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

impl<W: Write> BoardRun<'_, W> {
    /// Changes what is outside the program.
    pub(super) fn disturb(&mut self, kind: &InjectionKind) -> Result<()> {
        if let InjectionKind::Flip { address, mask } = *kind
            && let Some(word) = self.cpu.read_word(address)
        {
            ensure!(
                self.cpu.write_ram(address, &(word ^ mask).to_le_bytes()),
                "{address:#010x} is neither a register nor in RAM"
            );
            return Ok(());
        }
        if let InjectionKind::Other(Inject::FlipWord { value, mask }) = *kind {
            return self.flip_word(value, mask);
        }
        if let InjectionKind::Other(Inject::Flash { address, half }) = *kind {
            self.cpu.patch_flash(address, half)?;
            return Ok(());
        }
        if let InjectionKind::Other(inject) = kind {
            self.disturb_core(inject);
            self.disturb_run(inject);
        }
        let may_have_no_clock = self.has_several_faults;
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        match *kind {
            InjectionKind::Flip { address, mask } => ensure!(
                board.soc.flip_bits(address, mask) || may_have_no_clock,
                "the bits {mask:#x} at {address:#010x} are as before: the model has no such bits there, they are read only, or they have no clock"
            ),
            InjectionKind::Crystal => board.soc.fail_hse(),
            InjectionKind::Trigger => board.soc.write(TIM2_CR1, Width::Word, 0),
            InjectionKind::Register { address, value } => board.soc.write(address, Width::Word, value),
            InjectionKind::Overrun => board.soc.force_overrun(0),
            InjectionKind::Transfer => board.soc.fail_next_transfer(1, 0),
            InjectionKind::Halt => {
                board.scs.debug.enable(true);
                board.soc.halt();
            }
            InjectionKind::LowSpeedClock(hz) => board.soc.set_lsi(hz),
            InjectionKind::Supply(volts) => board.plant.hold_supply(Some(volts)),
            InjectionKind::Volts(pin, volts) => board.plant.hold_volts(pin, volts),
            InjectionKind::Level(pin, high) => {
                let now = board.seconds();
                board.plant.drive(pin, Waveform::from(Wave::level(pin, high), now));
            }
            InjectionKind::Slow(cpi) => board.set_cpi(cpi),
            InjectionKind::Other(ref inject) => disturb_board(&mut board, inject, &mut memory),
            // These change the program, which `inject_due` does.
            InjectionKind::Hang(_) | InjectionKind::Fault(_) | InjectionKind::Panic(..) => {}
        }
        // The clock, and with it the deadline, may have changed.
        board.sync(&mut memory);
        Ok(())
    }

    /// Changes bits of each word in RAM that has this value.
    fn flip_word(&mut self, value: u32, mask: u32) -> Result<()> {
        let chip = self.image.board.config().chip;
        let mut flipped = 0;
        for &(base, size) in rams(chip) {
            let mut ram = vec![0; size as usize];
            ensure!(self.cpu.read_memory(base, &mut ram), "the RAM at {base:#010x} cannot be read");
            for (address, word) in (base..).step_by(4).zip(ram.chunks_exact(4)) {
                if word == value.to_le_bytes() {
                    ensure!(
                        self.cpu.write_ram(address, &(value ^ mask).to_le_bytes()),
                        "{address:#010x} is not in RAM"
                    );
                    flipped += 1;
                }
            }
        }
        ensure!(flipped > 0 || self.has_several_faults, "no word in RAM is {value:#010x}");
        Ok(())
    }

    /// Changes a register of the core.
    fn disturb_core(&mut self, inject: &Inject) {
        let (register, value) = match *inject {
            Inject::CoreFlip { register, bit } => (register, self.cpu.reg(register.0) ^ 1 << bit),
            Inject::CoreSet { register, value } => (register, value),
            _ => return,
        };
        // The two low bits of the stack pointer are always 0 (PM0214 2.1.3), bit 0 of the program counter too.
        let value = match register.0 {
            Reg::Sp => value & !3,
            Reg::Pc => value & !1,
            _ => value,
        };
        self.cpu.set_reg(register.0, value);
    }

    /// Changes what the run itself does: the reader of the log, a drift, what follows later.
    fn disturb_run(&mut self, inject: &Inject) {
        let now = self.cpu.machine().seconds();
        match *inject {
            Inject::Rtt(reader) => self.read_log(match reader {
                RttReader::Stopped => RttReading::Nothing,
                RttReader::Byte => RttReading::Byte,
            }),
            Inject::CrystalDrift { to_hz, over_ms } => {
                let from_hz = self.cpu.machine().soc.hse_hz();
                let until_s = now + over_ms * 1e-3;
                self.drift = Some(Drift { of: Oscillator::Crystal, from_s: now, until_s, from_hz, to_hz });
            }
            Inject::LsiDrift { to_hz, over_ms } => {
                let from_hz = self.cpu.machine().soc.lsi_hz();
                let until_s = now + over_ms * 1e-3;
                self.drift = Some(Drift { of: Oscillator::LowSpeed, from_s: now, until_s, from_hz, to_hz });
            }
            Inject::PowerCycle { ram: Memory::Scrambled, seed } => self.scramble = Some(seed),
            Inject::FlashErase { cut_ms: Some(ms), .. } => self.cut_power(now + ms * 1e-3),
            Inject::FlashProgram { cut_us: Some(us), .. } => self.cut_power(now + us * 1e-6),
            _ => {}
        }
    }

    fn read_log(&mut self, reading: RttReading) {
        if let Some(rtt) = &mut self.rtt {
            rtt.reading = reading;
        }
    }

    fn cut_power(&mut self, at: f64) {
        let cycle = Inject::PowerCycle { ram: Memory::Kept, seed: 0 };
        self.injections
            .push(Injection::new(InjectionKind::Other(cycle), "the power is lost".into(), at).lasting(Some(0.0)));
    }

    /// Ends an injection: what it changed is as before.
    pub(super) fn end_injection(&mut self, n: usize, kind: &InjectionKind) -> Result<()> {
        let now = self.now_s();
        self.injections[n].note_end(now);
        if let (InjectionKind::Hang(address), Some(half)) = (kind, self.injections[n].replaced.take()) {
            self.cpu.patch_flash(*address, half)?;
        }
        if let InjectionKind::Other(Inject::Rtt(_)) = kind {
            self.read_log(RttReading::new(self.options.drain));
        }
        if let InjectionKind::Other(Inject::CrystalDrift { .. } | Inject::LsiDrift { .. }) = kind {
            self.drift = None;
        }
        if *kind == InjectionKind::Halt && self.idle == IdleState::Halted {
            self.idle = IdleState::No;
        }
        let (cpi, debugger) = (self.options.cpi, self.options.debugger);
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        match *kind {
            InjectionKind::Supply(_) => board.plant.hold_supply(None),
            InjectionKind::Volts(pin, _) => board.plant.release_volts(pin),
            InjectionKind::Level(pin, _) => board.plant.release(pin),
            InjectionKind::Slow(_) => board.set_cpi(cpi),
            InjectionKind::Halt => {
                board.scs.debug.enable(debugger);
                board.soc.resume();
            }
            InjectionKind::LowSpeedClock(_) => {
                let hz = lsi_hz(&board);
                board.soc.set_lsi(hz);
            }
            InjectionKind::Other(ref inject) => end_on_board(&mut board, inject),
            _ => {}
        }
        board.sync(&mut memory);
        drop(board);
        self.schedule_stop();
        Ok(())
    }

    /// Follows a drift of an oscillator, once a virtual millisecond.
    pub(super) fn drift(&mut self, seconds: f64) {
        let Some(drift) = self.drift else { return };
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        match drift.of {
            Oscillator::Crystal => board.soc.set_hse_hz(drift.hz_at(seconds)),
            Oscillator::LowSpeed => board.soc.set_lsi(drift.hz_at(seconds)),
        }
        board.sync(&mut memory);
        drop(board);
        if seconds >= drift.until_s {
            self.drift = None;
        }
    }

    /// Applies operations of the flash to the memory. The bits that a cut one has changed are drawn by its address and its part.
    pub(super) fn change_flash(&mut self, operations: &[FlashOperation]) -> Result<()> {
        // The option bytes are not in the memory of the program.
        for operation in operations.iter().filter(|operation| operation.bytes() > 0) {
            let mut bytes = vec![0; operation.bytes() as usize];
            ensure!(
                self.cpu.read_memory(operation.address, &mut bytes),
                "the flash has no {} bytes from {:#010x} on",
                bytes.len(),
                operation.address
            );
            let mut random = Random(u64::from(operation.address) << 32 ^ operation.done.to_bits());
            operation.apply(&mut bytes, || random.part());
            self.cpu.write_flash(operation.address, &bytes)?;
        }
        Ok(())
    }

    /// What a reset does to flash and RAM.
    pub(super) fn change_memory(&mut self, cause: ResetCause) -> Result<()> {
        let cut = self.cpu.machine().soc.take_flash_operations();
        self.change_flash(&cut)?;
        if cause != ResetCause::PowerOn {
            return Ok(());
        }
        let Some(mut random) = self.scramble.take().map(Random) else { return Ok(()) };
        for &(base, size) in rams(self.image.board.config().chip) {
            let words = (0..size / 8).flat_map(|_| random.number().to_le_bytes());
            let bytes: Vec<u8> = words.collect();
            ensure!(self.cpu.write_ram(base, &bytes), "the RAM from {base:#010x} on cannot be written");
        }
        Ok(())
    }

    /// Time until the servo timer has counted to a phase of its frame, s; `None` while it does not count, or has no clock. TIM1 counts
    /// microseconds.
    pub(super) fn until_phase(&mut self, phase_us: f64) -> Option<f64> {
        let mut board = self.cpu.machine();
        // A timer without a clock is not read: that would be an irregular access of the program's.
        if board.soc.read(RCC_APB2ENR, Width::Word) & TIM1_ENABLED == 0 {
            return None;
        }
        let [control, count, last] = [TIM1_CR1, TIM1_CNT, TIM1_ARR].map(|at| board.soc.read(at, Width::Word));
        let counts = control & 1 != 0;
        counts.then(|| (phase_us - f64::from(count)).rem_euclid(f64::from(last) + 1.0) * 1e-6)
    }
}

fn disturb_board(board: &mut BoardModel, inject: &Inject, memory: &mut dyn DmaMemory) {
    let now = board.seconds();
    match *inject {
        Inject::CrystalHz(hz) => board.soc.set_hse_hz(hz),
        Inject::Pll(factor) => board.soc.set_pll_factor(factor),
        Inject::Vdd(volts) => {
            board.soc.set_supply(volts);
            // The analogue supply is connected to it. Without one nothing converts; the converter divides by it.
            board.plant.hold_supply(Some(volts.max(0.1)));
        }
        Inject::PowerCycle { .. } => board.soc.set_supply(0.0),
        Inject::ResetButton => board.soc.pull_reset_pin(true),
        Inject::FlashErase { sector, .. } => {
            let (erase, by_words, start) = (1 << 1, 2 << 8, 1 << 16);
            unlock_flash(board);
            board.soc.write(FLASH_CR, Width::Word, erase | sector << 3 | by_words | start);
        }
        Inject::FlashProgram { address, value, .. } => {
            let (program, by_words) = (1, 2 << 8);
            unlock_flash(board);
            board.soc.write(FLASH_CR, Width::Word, program | by_words);
            board.soc.store_to_flash(address, Width::Word, value);
        }
        Inject::TransferStall(Stream { controller, stream }) => {
            board.soc.stall_stream(usize::from(controller) - 1, stream.into(), true);
        }
        Inject::TransferLost(Stream { controller, stream }) => {
            board.soc.lose_next_request(usize::from(controller) - 1, stream.into());
        }
        Inject::ConversionStall => board.soc.hold_conversions(0, true),
        Inject::StuckCode(code) => board.soc.set_stuck_bits(0, !code, code),
        Inject::StuckBits { low, high } => board.soc.set_stuck_bits(0, low, high),
        Inject::Exception { number, enable } => {
            if enable {
                board.nvic.enable(number);
            }
            board.nvic.pend(number);
        }
        Inject::Reset(cause) => board.reset = Some(cause.into()),
        Inject::Write { address, value } => board.store(address, Width::Word, value, memory),
        Inject::Wave(ref wave) => board.plant.drive(wave.pin.0, Waveform::from(wave.clone(), now)),
        _ => {}
    }
}

fn end_on_board(board: &mut BoardModel, inject: &Inject) {
    let crystal_hz = f64::from(board.soc.config().hse_hz);
    let supply_v = board.plant.feed().chip_supply.unwrap_or(board.soc.config().vdd);
    match *inject {
        Inject::CrystalHz(_) | Inject::CrystalDrift { .. } => board.soc.set_hse_hz(crystal_hz),
        Inject::LsiDrift { .. } => {
            let hz = lsi_hz(board);
            board.soc.set_lsi(hz);
        }
        Inject::Pll(_) => board.soc.set_pll_factor(1.0),
        Inject::Vdd(_) => {
            board.plant.hold_supply(None);
            board.soc.set_supply(supply_v);
        }
        Inject::PowerCycle { .. } => board.soc.set_supply(supply_v),
        Inject::ResetButton => board.soc.pull_reset_pin(false),
        Inject::TransferStall(Stream { controller, stream }) => {
            board.soc.stall_stream(usize::from(controller) - 1, stream.into(), false);
        }
        Inject::ConversionStall => board.soc.hold_conversions(0, false),
        Inject::StuckCode(_) | Inject::StuckBits { .. } => board.soc.set_stuck_bits(0, 0, 0),
        Inject::Wave(ref wave) => board.plant.release(wave.pin.0),
        _ => {}
    }
}

/// Frequency of the low speed oscillator while nothing is wrong, Hz.
fn lsi_hz(board: &BoardModel) -> f64 {
    board.soc.config().lsi_hz
}

/// Writes the keys where the interface is locked, as a debugger does.
fn unlock_flash(board: &mut BoardModel) {
    const LOCK: u32 = 1 << 31;
    if board.soc.read(FLASH_CR, Width::Word) & LOCK != 0 {
        FLASH_KEYS.into_iter().for_each(|key| board.soc.write(FLASH_KEYR, Width::Word, key));
    }
}
