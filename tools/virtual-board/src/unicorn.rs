//! Processor emulation by Unicorn 2.1.5, with workarounds for the gaps of its Cortex-M model.
//!
//! Unicorn has no NVIC, no SCB and no exception entry, so it only executes instructions here. Workarounds:
//! - `Mode::THUMB` with the Cortex-M4 model, because `Mode::MCLASS` selects a Cortex-M33 without an error.
//! - After any write to xPSR or CONTROL the translator's cached flags are stale until `APSR_NZCV` is written; otherwise a handler that
//!   consists of `bx lr` jumps to 0xFFFFFFF8.
//! - The exclusive monitor has no register: a stub of two instructions clears it.
//! - WFE and YIELD stop the emulation as invalid, SEV does nothing: each address in flash that may hold one gets a hook.
//! - Instructions are counted from the flash image in the block hook: Unicorn's own counter is slow.
//! - RAM is not executable unless a debugger may put code there ([`UnicornCpu::allow_code_in_ram`]), because stores to executable memory are slow.
//! - A hook cannot stop inside an IT block: a break point there stops after it, and a step ends behind it.
//! - A load or store that looks up its page (`unicorn_fill_tlb`) leaves the state of its IT block in the processor, and the block of instructions that
//!   follows runs as a part of the IT block: the lookup clears that state.

use std::cell::{Cell, RefCell, RefMut};
use std::collections::HashSet;
use std::rc::Rc;

use anyhow::{Context as _, Result};
use stm32f4_model::{Chip, DmaMemory, Width};
use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, TlbEntry, TlbType, UcHookId, Unicorn,
};

use crate::addresses::{FLASH, FLASH_SIZE};
use crate::cpu::{BRANCH_TO_SELF, Cpu, Machine, Reg, Stop, Trap, XPSR_IT, XPSR_T, count_instructions, is_wide};
use crate::nvic::Masks;

mod tracing;

/// Start and size in bytes of the RAM regions: SRAM, and the core-coupled memory.
const RAMS: [(u32, u32); 2] = [(0x2000_0000, 0x2_0000), (0x1000_0000, 0x1_0000)];

/// Start and size in bytes of the RAM regions of a chip.
pub(crate) fn rams(chip: Chip) -> &'static [(u32, u32)] {
    if chip.has_core_coupled_memory() { &RAMS } else { &RAMS[..1] }
}

/// Start and size in bytes of the regions whose accesses go to the machine: system memory, APB and AHB1, AHB2, FSMC, private peripheral
/// bus.
const DEVICES: [(u32, u32); 5] = [
    (0x1FFF_7000, 0x1000),
    (0x4000_0000, 0x8_0000),
    (0x5000_0000, 0x6_1000),
    (0xA000_0000, 0x1000),
    (0xE000_0000, 0x10_0000),
];
/// True for an address whose accesses go to the machine.
pub(crate) fn is_device(addr: u32) -> bool {
    DEVICES.iter().any(|&(base, size)| addr.wrapping_sub(base) < size)
}

/// Address of the stub, in a page that the chip does not have, above all memory that holds code.
const STUB: u32 = 0x3FFF_F000;
/// The end of the memory that holds code: flash, or RAM too.
const CODE_END: u64 = (FLASH + FLASH_SIZE) as u64;
const CODE_END_WITH_RAM: u64 = 0x2002_0000;
/// `clrex; svc 0`
const STUB_CODE: [u8; 6] = [0xBF, 0xF3, 0x2F, 0x8F, 0x00, 0xDF];

const INTERRUPT_SVC: u32 = 2;
const INTERRUPT_PREFETCH_ABORT: u32 = 3;
const INTERRUPT_BREAKPOINT: u32 = 7;
const INTERRUPT_EXCEPTION_RETURN: u32 = 8;

type Uc<'a> = Unicorn<'a, ()>;

/// Results of the hooks for [`UnicornCpu::run`].
#[derive(Default)]
struct HookResults {
    stop: Cell<Option<Stop>>,
    /// Address of the wait instruction that stopped the run.
    wait_at: Cell<u32>,
    bad_access: Cell<Option<(MemType, u32)>>,
    /// Address of the instruction that is stepped, and whether its block has begun.
    stepped: Cell<Option<(u32, bool)>>,
}

impl HookResults {
    /// True if the instruction at an address comes after the one that is stepped.
    fn is_after_step(&self, addr: u32) -> bool {
        self.stepped.get().is_some_and(|(from, _)| from != addr)
    }
}

/// More bytes than a block has: it ends with the page of the translator, of 1 KiB, in which it begins, or one instruction later.
const LONGEST_BLOCK: usize = 4096;

/// Number of instructions of each block in flash, counted once.
struct BlockCounts {
    image: RefCell<Vec<u8>>,
    /// For each half-word of flash: size in bytes of the last block that began there, and its number of instructions.
    seen: Vec<Cell<(u16, u16)>>,
}

impl BlockCounts {
    fn new(image: Vec<u8>) -> Self {
        BlockCounts { image: RefCell::new(image), seen: vec![Cell::new((0, 0)); FLASH_SIZE as usize / 2] }
    }

    fn instructions(&self, addr: u32, size: u32) -> u32 {
        let (seen_size, count) = self.entry(addr).get();
        if u32::from(seen_size) == size { count.into() } else { self.count(addr, size) }
    }

    fn entry(&self, addr: u32) -> &Cell<(u16, u16)> {
        &self.seen[(addr & (FLASH_SIZE - 1)) as usize / 2]
    }

    #[cold]
    fn count(&self, addr: u32, size: u32) -> u32 {
        let offset = (addr & (FLASH_SIZE - 1)) as usize;
        let count = count_instructions(self.image.borrow().get(offset..offset + size as usize).unwrap_or(&[]));
        self.entry(addr).set((size as u16, count as u16));
        count
    }

    fn half_at(&self, addr: u32) -> u16 {
        let offset = (addr & (FLASH_SIZE - 1)) as usize;
        let image = self.image.borrow();
        image.get(offset..offset + 2).map_or(u16::MAX, |half| u16::from_le_bytes([half[0], half[1]]))
    }

    /// The hint at an address in flash, 1 YIELD, 2 WFE, 3 WFI or 4 SEV, and its length in bytes; `None`: no such instruction begins there.
    fn hint_at(&self, addr: u32) -> Option<(u8, u32)> {
        let (hint, length) = match self.half_at(addr) {
            0xF3AF => {
                let second = self.half_at(addr + 2);
                ((second >> 4 == 0x800).then_some((second & 0xF) as u8)?, 4)
            }
            half @ (0xBF10 | 0xBF20 | 0xBF30 | 0xBF40) => ((half >> 4 & 0xF) as u8, 2),
            _ => return None,
        };
        (1..=4).contains(&hint).then_some((hint, length))
    }

    /// Replaces bytes of the image.
    fn replace(&self, at: usize, bytes: &[u8]) {
        self.image.borrow_mut()[at..at + bytes.len()].copy_from_slice(bytes);
        // Blocks that contain one of them may now end elsewhere.
        let first = at.saturating_sub(LONGEST_BLOCK) / 2;
        self.seen[first..(at + bytes.len()).div_ceil(2)].iter().for_each(|entry| entry.set((0, 0)));
    }
}

/// The emulated processor with the machine around it.
pub(crate) struct UnicornCpu<M> {
    uc: Uc<'static>,
    machine: Rc<RefCell<M>>,
    hook_results: Rc<HookResults>,
    counts: Rc<BlockCounts>,
    block_hook: Option<UcHookId>,
    /// The end of the memory that holds code.
    code_end: u64,
    /// Addresses of hardware break points, each with its hook.
    breakpoints: Vec<(u32, UcHookId)>,
    /// Half-words of flash that have a hook for a hint: their offsets.
    hinted: HashSet<u32>,
}

/// RAM and flash for DMA, usable inside a hook.
pub(crate) struct UcMemory<'a, 'b>(pub(crate) &'a mut Uc<'b>);

fn in_ram(addr: u32, size: usize) -> bool {
    RAMS.iter()
        .any(|&(base, length)| addr >= base && u64::from(addr) + size as u64 <= u64::from(base) + u64::from(length))
}

fn in_flash(addr: u32, size: usize) -> bool {
    [0, FLASH]
        .iter()
        .any(|&base| addr >= base && u64::from(addr) + size as u64 <= u64::from(base) + u64::from(FLASH_SIZE))
}

impl DmaMemory for UcMemory<'_, '_> {
    fn read(&mut self, addr: u32, width: Width) -> Option<u32> {
        let size = width.bytes() as usize;
        // The core-coupled memory is connected to the core only: DMA cannot access it.
        if addr & (width.bytes() - 1) != 0 || !(in_flash(addr, size) || in_ram(addr, size) && addr >= 0x2000_0000) {
            return None;
        }
        let mut bytes = [0; 4];
        self.0.mem_read(addr.into(), &mut bytes[..size]).ok()?;
        Some(u32::from_le_bytes(bytes))
    }

    fn write(&mut self, addr: u32, width: Width, value: u32) -> bool {
        let size = width.bytes() as usize;
        addr & (width.bytes() - 1) == 0
            && in_ram(addr, size)
            && addr >= 0x2000_0000
            && self.0.mem_write(addr.into(), &value.to_le_bytes()[..size]).is_ok()
    }
}

fn register(reg: Reg) -> i32 {
    let id = match reg {
        Reg::R(n) => return RegisterARM::R0 as i32 + i32::from(n),
        Reg::S(n) => return RegisterARM::S0 as i32 + i32::from(n),
        Reg::Sp => RegisterARM::SP,
        Reg::Lr => RegisterARM::LR,
        Reg::Pc => RegisterARM::PC,
        Reg::Xpsr => RegisterARM::XPSR,
        Reg::Psp => RegisterARM::PSP,
        Reg::Msp => RegisterARM::MSP,
        Reg::Control => RegisterARM::CONTROL,
        Reg::Primask => RegisterARM::PRIMASK,
        Reg::Faultmask => RegisterARM::FAULTMASK,
        Reg::Basepri => RegisterARM::BASEPRI,
        Reg::Fpscr => RegisterARM::FPSCR,
    };
    id as i32
}

fn get(uc: &Uc<'_>, reg: Reg) -> u32 {
    // Cannot fail: every identifier comes from `register`, and Unicorn supports them all.
    uc.reg_read(register(reg)).map_or(0, |value| value as u32)
}

#[cold]
fn read_masks(uc: &Uc<'_>) -> Masks {
    Masks {
        primask: get(uc, Reg::Primask) & 1 != 0,
        faultmask: get(uc, Reg::Faultmask) & 1 != 0,
        basepri: get(uc, Reg::Basepri) as u8,
    }
}

/// Number of instructions of a block in RAM.
#[cold]
fn count_in_ram(uc: &Uc<'_>, addr: u64, size: u32) -> u32 {
    let mut code = vec![0; size as usize];
    // Cannot fail: the block was translated from these bytes.
    let _ = uc.mem_read(addr, &mut code);
    count_instructions(&code)
}

/// Clears the state of an IT block. Within a block of instructions the state is a part of the translated code; the processor has it only between blocks.
fn leave_it_block(uc: &mut Uc<'_>) {
    let xpsr = get(uc, Reg::Xpsr);
    if xpsr & XPSR_IT != 0 {
        // Cannot fail: see `get`.
        let _ = uc.reg_write(RegisterARM::XPSR_NZCVQG, (xpsr & !XPSR_IT | XPSR_T).into());
    }
}

/// Converts an error of Unicorn, because `uc_error` does not implement `Error`.
fn convert_error<T>(result: Result<T, unicorn_engine::uc_error>, what: &'static str) -> Result<T> {
    result
        .map_err(|error| anyhow::anyhow!("unicorn: {error:?}"))
        .with_context(|| format!("the emulator failed while {what}"))
}

impl<M: Machine + 'static> UnicornCpu<M> {
    /// A processor with `image` in flash (padded with 0xFF) and `machine` around it.
    ///
    /// # Errors
    /// Unicorn refuses a mapping or a hook.
    pub(crate) fn new(chip: Chip, image: &[u8], machine: M) -> Result<Self> {
        let mut uc = convert_error(Unicorn::new(Arch::ARM, Mode::THUMB), "starting")?;
        convert_error(uc.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32), "choosing the Cortex-M4")?;
        let mut flash = image.to_vec();
        flash.resize(chip.flash_bytes() as usize, 0xFF);
        for base in [0, FLASH] {
            convert_error(
                uc.mem_map(base.into(), chip.flash_bytes().into(), Prot::READ | Prot::EXEC),
                "mapping flash",
            )?;
            convert_error(uc.mem_write(base.into(), &flash), "filling flash")?;
        }
        for &(base, size) in rams(chip) {
            convert_error(uc.mem_map(base.into(), size.into(), Prot::READ | Prot::WRITE), "mapping RAM")?;
        }
        convert_error(uc.mem_map(STUB.into(), 0x1000, Prot::READ | Prot::EXEC), "mapping the stub")?;
        convert_error(uc.mem_write(STUB.into(), &STUB_CODE), "filling the stub")?;

        let mut cpu = UnicornCpu {
            uc,
            machine: Rc::new(RefCell::new(machine)),
            hook_results: Rc::default(),
            counts: Rc::new(BlockCounts::new(flash)),
            block_hook: None,
            code_end: CODE_END,
            breakpoints: Vec::new(),
            hinted: HashSet::new(),
        };
        cpu.hook_translation()?;
        cpu.map_devices()?;
        cpu.hook_blocks(true, |_, _| ())?;
        cpu.hook_traps()?;
        cpu.hook_hints(0, image.len())?;
        Ok(cpu)
    }

    /// Makes RAM executable.
    ///
    /// # Errors
    /// Unicorn refuses.
    pub(crate) fn allow_code_in_ram(&mut self, chip: Chip) -> Result<()> {
        for &(base, size) in rams(chip) {
            convert_error(self.uc.mem_protect(base.into(), size.into(), Prot::ALL), "making RAM executable")?;
        }
        self.code_end = CODE_END_WITH_RAM;
        self.hook_blocks(true, |_, _| ())
    }

    /// Replaces the address translation of the Cortex-M4's default map, in which RAM may hold code: every store to RAM would be slow, as it
    /// might change code.
    fn hook_translation(&mut self) -> Result<()> {
        convert_error(self.uc.ctl_set_tlb_type(TlbType::VIRTUAL), "choosing the translation")?;
        let translate = |uc: &mut Uc<'_>, addr: u64, kind: MemType| {
            let fetch = kind == MemType::FETCH;
            if !fetch {
                leave_it_block(uc);
            }
            let data = in_ram(addr as u32, 1) && !fetch;
            Some(TlbEntry { paddr: addr, perms: if data { Prot::READ | Prot::WRITE } else { Prot::ALL } })
        };
        convert_error(self.uc.add_tlb_hook(0, u64::from(u32::MAX), translate), "hooking the translation")?;
        Ok(())
    }

    fn map_devices(&mut self) -> Result<()> {
        for (base, size) in DEVICES {
            let (reader, writer) = (Rc::clone(&self.machine), Rc::clone(&self.machine));
            let load = move |uc: &mut Uc<'_>, offset: u64, size: usize| {
                let Some(width) = Width::from_bytes(size) else { return 0 };
                u64::from(reader.borrow_mut().load(base + offset as u32, width, &mut UcMemory(uc)))
            };
            let store = move |uc: &mut Uc<'_>, offset: u64, size: usize, value: u64| {
                let Some(width) = Width::from_bytes(size) else { return };
                writer.borrow_mut().store(base + offset as u32, width, value as u32, &mut UcMemory(uc));
            };
            convert_error(
                self.uc.mmio_map(base.into(), size.into(), Some(load), Some(store)),
                "mapping the peripherals",
            )?;
        }
        Ok(())
    }

    /// Hooks the blocks, in place of the hook before; `executed` takes the address and the size of each that is executed. With `skips` not each pass of a
    /// branch to itself is executed: a task that hangs would take as long as all the rest of a case. One hook from address 0 to
    /// the end of the code: Unicorn calls a single hook directly, two or more through a search. The stub lies above.
    fn hook_blocks(&mut self, skips: bool, mut executed: impl FnMut(u32, u32) + 'static) -> Result<()> {
        let (machine, counts, hook_results) =
            (Rc::clone(&self.machine), Rc::clone(&self.counts), Rc::clone(&self.hook_results));
        let hook = move |uc: &mut Uc<'_>, addr: u64, size: u32| {
            let mut machine = machine.borrow_mut();
            if let Some((from, has_begun)) = hook_results.stepped.get() {
                if has_begun {
                    hook_results.stop.set(Some(Stop::Requested));
                    let _ = uc.emu_stop();
                } else {
                    hook_results.stepped.set(Some((from, true)));
                    machine.charge(addr as u32, 1);
                }
                return;
            }
            let is_flash = addr < CODE_END;
            let instructions =
                if is_flash { counts.instructions(addr as u32, size) } else { count_in_ram(uc, addr, size) };
            // Decide before charging: a block that was stopped runs again.
            if machine.before_block(instructions, || read_masks(uc)) {
                hook_results.stop.set(Some(Stop::Requested));
                let _ = uc.emu_stop();
            } else {
                machine.charge(addr as u32, instructions);
                executed(addr as u32, size);
                if skips && size == 2 && is_flash && counts.half_at(addr as u32) == BRANCH_TO_SELF {
                    machine.stay();
                }
            }
        };
        if let Some(before) = self.block_hook.take() {
            convert_error(self.uc.remove_hook(before), "removing the hook of blocks")?;
        }
        let hooked = self.uc.add_block_hook(0, self.code_end - 1, hook);
        self.block_hook = Some(convert_error(hooked, "hooking blocks")?);
        Ok(())
    }

    fn hook_traps(&mut self) -> Result<()> {
        let hook_results = Rc::clone(&self.hook_results);
        let interrupts = move |uc: &mut Uc<'_>, number: u32| {
            let pc = get(uc, Reg::Pc);
            let stop = match number {
                INTERRUPT_SVC => Stop::Supervisor,
                INTERRUPT_EXCEPTION_RETURN => Stop::ExceptionReturn(pc | 1),
                INTERRUPT_BREAKPOINT => {
                    let mut code = [0; 2];
                    let _ = uc.mem_read(pc.into(), &mut code);
                    Stop::Breakpoint(code[0])
                }
                INTERRUPT_PREFETCH_ABORT => Stop::Trap(Trap::FetchNever),
                _ => Stop::Trap(Trap::Other),
            };
            hook_results.stop.set(Some(stop));
            let _ = uc.emu_stop();
        };
        convert_error(self.uc.add_intr_hook(interrupts), "hooking exceptions")?;
        // Not for RAM, because stores are slow in regions with such a hook.
        for (begin, end) in [(0, 0x0FFF_FFFF), (0x1001_0000, 0x1FFF_FFFF), (0x2002_0000, 0xFFFF_FFFF)] {
            self.hook_bad_accesses(begin, end)?;
        }
        Ok(())
    }

    fn hook_bad_accesses(&mut self, begin: u64, end: u64) -> Result<()> {
        let (machine, hook_results) = (Rc::clone(&self.machine), Rc::clone(&self.hook_results));
        let access = move |uc: &mut Uc<'_>, kind: MemType, addr: u64, size: usize, value: i64| {
            if kind == MemType::WRITE_PROT
                && let Some(width) = Width::from_bytes(size)
                && machine.borrow_mut().store_to_flash(addr as u32, width, value as u32, &mut UcMemory(uc))
            {
                return true;
            }
            hook_results.bad_access.set(Some((kind, addr as u32)));
            false
        };
        let kinds = HookType::MEM_UNMAPPED | HookType::MEM_PROT;
        convert_error(self.uc.add_mem_hook(kinds, begin, end, access), "hooking bad accesses")?;
        Ok(())
    }

    /// Hooks each half-word of a range of the image that decodes as a hint. A hook on data, or on half of a wide instruction, is never called.
    fn hook_hints(&mut self, begin: u32, length: usize) -> Result<()> {
        // A wide instruction may begin before the range.
        let halves = (begin & !1).saturating_sub(2)..begin + length as u32;
        for offset in halves.step_by(2) {
            if self.counts.hint_at(FLASH + offset).is_some() && self.hinted.insert(offset) {
                for base in [0, FLASH] {
                    self.hook_hint(base + offset)?;
                }
            }
        }
        Ok(())
    }

    fn hook_hint(&mut self, addr: u32) -> Result<()> {
        let (machine, hook_results, counts) =
            (Rc::clone(&self.machine), Rc::clone(&self.hook_results), Rc::clone(&self.counts));
        let hook = move |uc: &mut Uc<'_>, _: u64, _: u32| {
            // The flash may have another content since.
            let Some((hint, length)) = counts.hint_at(addr) else { return };
            if hook_results.is_after_step(addr) {
                return;
            }
            let stop = match hint {
                // YIELD: there is no other thread to run.
                1 => {
                    let _ = uc.set_pc(u64::from(addr + length) | 1);
                    return;
                }
                2 => Stop::WaitForEvent,
                3 => Stop::WaitForInterrupt,
                // SEV: Unicorn executes it as a NOP.
                _ => return machine.borrow_mut().send_event(),
            };
            hook_results.wait_at.set(addr + length);
            hook_results.stop.set(Some(stop));
            let _ = uc.emu_stop();
        };
        convert_error(self.uc.add_code_hook(addr.into(), addr.into(), hook), "hooking a hint instruction")?;
        Ok(())
    }

    /// Sets the addresses of the hardware break points, in place of those before.
    ///
    /// # Errors
    /// Unicorn refuses a hook.
    pub(crate) fn set_breakpoints(&mut self, addresses: &[u32]) -> Result<()> {
        for (addr, hook) in std::mem::take(&mut self.breakpoints) {
            if addresses.contains(&addr) {
                self.breakpoints.push((addr, hook));
            } else {
                convert_error(self.uc.remove_hook(hook), "removing a break point")?;
                self.drop_code(addr, 2)?;
            }
        }
        for &addr in addresses {
            if self.breakpoints.iter().any(|(known, _)| *known == addr) {
                continue;
            }
            let hook_results = Rc::clone(&self.hook_results);
            let hook = move |uc: &mut Uc<'_>, _: u64, _: u32| {
                if !hook_results.is_after_step(addr) {
                    hook_results.stop.set(Some(Stop::HardwareBreakpoint));
                    let _ = uc.emu_stop();
                }
            };
            let hook = convert_error(self.uc.add_code_hook(addr.into(), addr.into(), hook), "setting a break point")?;
            self.breakpoints.push((addr, hook));
            self.drop_code(addr, 2)?;
        }
        Ok(())
    }

    /// Executes one instruction, or an IT block as a whole.
    ///
    /// # Errors
    /// Unicorn refuses a hook.
    pub(crate) fn step(&mut self) -> Result<Stop> {
        let pc = get(&self.uc, Reg::Pc);
        let next = self.after_instruction(pc);
        let hook_results = Rc::clone(&self.hook_results);
        let stops = move |uc: &mut Uc<'_>, _: u64, _: u32| {
            hook_results.stop.set(Some(Stop::Requested));
            let _ = uc.emu_stop();
        };
        let hook = convert_error(self.uc.add_code_hook(next.into(), next.into(), stops), "hooking a step")?;
        self.drop_code(pc, (next - pc) as usize + 2)?;
        self.hook_results.stepped.set(Some((pc, false)));
        let stop = self.run();
        self.hook_results.stepped.set(None);
        convert_error(self.uc.remove_hook(hook), "removing the hook of a step")?;
        self.drop_code(next, 2)?;
        Ok(stop)
    }

    /// Address after the instruction at an address, or after the IT block that it begins or is in.
    fn after_instruction(&self, pc: u32) -> u32 {
        let half = |addr: u32| {
            let mut bytes = [0; 2];
            // Without memory there is no instruction either.
            let _ = self.uc.mem_read(addr.into(), &mut bytes);
            u16::from_le_bytes(bytes)
        };
        let length = |addr: u32| if is_wide(half(addr)) { 4 } else { 2 };
        let mut after = pc.wrapping_add(length(pc));
        let first = half(pc);
        let xpsr = get(&self.uc, Reg::Xpsr);
        // IT[7:0] is xPSR bits 15 to 10 and 26 to 25; the lowest 1 of its lower half ends the block.
        let running = (xpsr >> 10 & 3) << 2 | xpsr >> 25 & 3;
        let (mask, already) = if first & 0xFF00 == 0xBF00 { (u32::from(first & 0xF), 0) } else { (running, 1) };
        if mask != 0 {
            for _ in already..4 - mask.trailing_zeros() {
                after = after.wrapping_add(length(after));
            }
        }
        after
    }

    /// Drops the translation of the code at an address: it has changed, or its hooks have.
    ///
    /// # Errors
    /// Unicorn refuses.
    pub(crate) fn drop_code(&mut self, addr: u32, length: usize) -> Result<()> {
        let begin = u64::from(addr);
        convert_error(self.uc.ctl_remove_cache(begin, begin + length as u64), "dropping translated code")
    }

    /// The machine around the processor.
    pub(crate) fn machine(&self) -> RefMut<'_, M> {
        self.machine.borrow_mut()
    }

    /// The machine, and the memory for its DMA.
    pub(crate) fn machine_and_memory(&mut self) -> (RefMut<'_, M>, UcMemory<'_, 'static>) {
        (self.machine.borrow_mut(), UcMemory(&mut self.uc))
    }

    /// Replaces one half-word of flash, for fault injection. Returns the old one.
    ///
    /// # Errors
    /// The address is odd or not in flash, or Unicorn refuses.
    pub(crate) fn patch_flash(&mut self, addr: u32, half: u16) -> Result<u16> {
        let offset = addr.wrapping_sub(FLASH);
        anyhow::ensure!(
            offset < FLASH_SIZE && offset.is_multiple_of(2),
            "0x{addr:08X} is not an even address in flash"
        );
        let old = self.counts.half_at(addr);
        self.write_flash(addr, &half.to_le_bytes())?;
        Ok(old)
    }

    /// Replaces bytes of flash, which must be in it.
    ///
    /// # Errors
    /// They are not in it, or Unicorn refuses.
    pub(crate) fn write_flash(&mut self, addr: u32, bytes: &[u8]) -> Result<()> {
        let offset = addr.wrapping_sub(FLASH);
        anyhow::ensure!(
            u64::from(offset) + bytes.len() as u64 <= u64::from(FLASH_SIZE),
            "{} bytes from 0x{addr:08X} on are not in flash",
            bytes.len()
        );
        self.counts.replace(offset as usize, bytes);
        self.hook_hints(offset, bytes.len())?;
        for begin in [0, FLASH].map(|base| u64::from(base + offset)) {
            convert_error(self.uc.mem_write(begin, bytes), "writing flash")?;
            // Of these bytes only: to translate all code again takes longer than most cases of a campaign.
            self.drop_code(begin as u32, bytes.len())?;
        }
        Ok(())
    }

    fn write(&mut self, reg: RegisterARM, value: u32) {
        // Cannot fail: Unicorn supports every identifier that is used here.
        let _ = self.uc.reg_write(reg, value.into());
    }

    /// Sets the registers to their values after a reset: only T set in xPSR; CONTROL, masks, floating-point and general registers 0.
    pub(crate) fn reset(&mut self, sp: u32, pc: u32) {
        self.set_mode(XPSR_T, 0);
        for reg in [Reg::Primask, Reg::Faultmask, Reg::Basepri, Reg::Fpscr, Reg::Psp] {
            self.set_reg(reg, 0);
        }
        (0..13).for_each(|n| self.set_reg(Reg::R(n), 0));
        (0..32).for_each(|n| self.set_reg(Reg::S(n), 0));
        self.set_reg(Reg::Sp, sp & !3);
        self.set_reg(Reg::Lr, 0xFFFF_FFFF);
        self.clear_exclusive();
        self.set_reg(Reg::Pc, pc & !1);
    }

    fn stopped(&mut self, result: Result<(), unicorn_engine::uc_error>) -> Stop {
        use unicorn_engine::uc_error;
        let bad = self.hook_results.bad_access.take();
        match (self.hook_results.stop.take(), result) {
            (Some(stop @ (Stop::WaitForEvent | Stop::WaitForInterrupt)), _) => {
                self.set_reg(Reg::Pc, self.hook_results.wait_at.get());
                stop
            }
            (Some(stop), _) => stop,
            // Without the T bit, the code was decoded in another instruction set.
            (None, Err(uc_error::INSN_INVALID)) if get(&self.uc, Reg::Xpsr) & XPSR_T == 0 => {
                Stop::Trap(Trap::InvalidState)
            }
            (None, Err(uc_error::INSN_INVALID)) => Stop::Trap(Trap::Undefined),
            (None, Err(uc_error::EXCEPTION)) if bad.is_none() => Stop::Trap(Trap::InvalidState),
            (None, Err(uc_error::FETCH_PROT)) => Stop::Trap(Trap::FetchNever),
            (None, Err(_)) => Stop::Trap(match bad {
                // Devices and the private peripheral bus never hold code.
                Some((MemType::FETCH_UNMAPPED, 0x4000_0000..0x6000_0000 | 0xA000_0000..)) => Trap::FetchNever,
                Some((MemType::FETCH_UNMAPPED, _)) => Trap::FetchUnmapped,
                Some((MemType::FETCH_PROT, _)) => Trap::FetchNever,
                Some((MemType::READ_UNMAPPED | MemType::READ_PROT, addr)) => Trap::ReadUnmapped(addr),
                Some((MemType::WRITE_UNMAPPED, addr)) => Trap::WriteUnmapped(addr),
                Some((MemType::WRITE_PROT, addr)) => Trap::WriteFlash(addr),
                _ => Trap::Other,
            }),
            (None, Ok(())) => Stop::Trap(Trap::Other),
        }
    }
}

impl<M: Machine + 'static> Cpu for UnicornCpu<M> {
    fn reg(&self, reg: Reg) -> u32 {
        get(&self.uc, reg)
    }

    fn set_reg(&mut self, reg: Reg, value: u32) {
        // A program counter with bit 0 clear would select the ARM instruction set.
        let value = if reg == Reg::Pc { value | 1 } else { value };
        // Cannot fail: see `get`.
        let _ = self.uc.reg_write(register(reg), value.into());
    }

    fn set_mode(&mut self, xpsr: u32, control: u32) {
        // Unicorn applies the rules of MSR: CONTROL needs privilege, SPSEL needs thread mode. So go to handler mode, which is privileged,
        // then to privileged thread mode, where both can be written, then to the requested mode.
        self.write(RegisterARM::XPSR_NZCVQG, XPSR_T | 3);
        self.write(RegisterARM::CONTROL, 0);
        self.write(RegisterARM::XPSR_NZCVQG, XPSR_T);
        self.write(RegisterARM::CONTROL, control);
        self.write(RegisterARM::XPSR_NZCVQG, xpsr | XPSR_T);
        // Writing the flags with their own value makes Unicorn recompute its cached mode flags.
        self.write(RegisterARM::APSR_NZCV, xpsr & 0xF000_0000);
    }

    fn clear_exclusive(&mut self) {
        let (pc, xpsr) = (get(&self.uc, Reg::Pc), get(&self.uc, Reg::Xpsr));
        // The stub must not run as part of an IT block.
        let in_it = xpsr & XPSR_IT != 0;
        if in_it {
            self.write(RegisterARM::XPSR_NZCVQG, xpsr & !XPSR_IT | XPSR_T);
        }
        let _ = self.uc.emu_start(u64::from(STUB | 1), 0, 0, 0);
        self.hook_results.stop.set(None);
        if in_it {
            self.write(RegisterARM::XPSR_NZCVQG, xpsr | XPSR_T);
        }
        self.set_reg(Reg::Pc, pc);
    }

    fn read_memory(&self, addr: u32, into: &mut [u8]) -> bool {
        (in_ram(addr, into.len()) || in_flash(addr, into.len())) && self.uc.mem_read(addr.into(), into).is_ok()
    }

    fn write_ram(&mut self, addr: u32, bytes: &[u8]) -> bool {
        in_ram(addr, bytes.len()) && self.uc.mem_write(addr.into(), bytes).is_ok()
    }

    fn run(&mut self) -> Stop {
        self.hook_results.stop.set(None);
        self.hook_results.bad_access.set(None);
        let pc = get(&self.uc, Reg::Pc);
        let result = self.uc.emu_start(u64::from(pc | 1), 0, 0, 0);
        self.stopped(result)
    }
}

const _: () = assert!(is_wide(0xF3BF), "the stub's CLREX is a wide instruction");

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine that stops after a number of blocks and records all calls.
    #[derive(Default)]
    struct RecordingMachine {
        blocks_left: u32,
        charged: Vec<(u32, u32)>,
        stores: Vec<(u32, Width, u32)>,
        events: u32,
        stays: u32,
        flash_is_open: bool,
    }

    impl Machine for RecordingMachine {
        fn before_block(&mut self, _: u32, _: impl FnOnce() -> Masks) -> bool {
            let stop = self.blocks_left == 0;
            self.blocks_left = self.blocks_left.saturating_sub(1);
            stop
        }
        fn charge(&mut self, pc: u32, instructions: u32) {
            self.charged.push((pc, instructions));
        }
        fn stay(&mut self) {
            self.stays += 1;
        }
        fn send_event(&mut self) {
            self.events += 1;
        }
        fn load(&mut self, addr: u32, _: Width, _: &mut dyn DmaMemory) -> u32 {
            addr ^ 0xFFFF_FFFF
        }
        fn store(&mut self, addr: u32, width: Width, value: u32, _: &mut dyn DmaMemory) {
            self.stores.push((addr, width, value));
        }
        fn store_to_flash(&mut self, addr: u32, width: Width, value: u32, _: &mut dyn DmaMemory) -> bool {
            if self.flash_is_open {
                self.stores.push((addr, width, value));
            }
            self.flash_is_open
        }
    }

    fn cpu(code: &[u16], blocks: u32) -> UnicornCpu<RecordingMachine> {
        let image: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        let mut cpu = UnicornCpu::new(
            Chip::F407,
            &image,
            RecordingMachine { blocks_left: blocks, ..RecordingMachine::default() },
        )
        .unwrap();
        cpu.reset(0x2000_1000, FLASH);
        cpu
    }

    #[test]
    fn blocks_are_counted_once_and_stop_before_they_run() {
        // movs r0, #0; adds r0, #1; b .-2
        let mut cpu = cpu(&[0x2000, 0x3001, 0xE7FD], 3);
        assert_eq!(cpu.run(), Stop::Requested);
        assert_eq!(cpu.machine().charged, [(FLASH, 3), (FLASH + 2, 2), (FLASH + 2, 2)]);
        assert_eq!((cpu.reg(Reg::R(0)), cpu.reg(Reg::Pc)), (3, FLASH + 2));
        cpu.machine().blocks_left = 1;
        assert_eq!(cpu.run(), Stop::Requested);
        assert_eq!(cpu.reg(Reg::R(0)), 4);
    }

    const RAM: u32 = 0x2000_0000;

    #[test]
    fn a_step_executes_one_instruction() {
        // movs r0, #0; adds r0, #1; b .-2; the same wide: movw r1, #0x1234
        let mut cpu = cpu(&[0x2000, 0x3001, 0xE7FD, 0xF241, 0x2134], 100);
        for (pc, r0) in [(2, 0), (4, 1), (2, 1), (4, 2)] {
            assert_eq!(cpu.step().unwrap(), Stop::Requested);
            assert_eq!((cpu.reg(Reg::Pc) - FLASH, cpu.reg(Reg::R(0))), (pc, r0));
        }
        assert!(cpu.machine().charged.iter().all(|(_, instructions)| *instructions == 1));
        cpu.set_reg(Reg::Pc, FLASH + 6);
        assert_eq!((cpu.step().unwrap(), cpu.reg(Reg::Pc) - FLASH), (Stop::Requested, 10));
        assert_eq!(cpu.reg(Reg::R(1)), 0x1234);
        // The hooks of the steps are gone.
        cpu.set_reg(Reg::Pc, FLASH);
        cpu.machine().blocks_left = 3;
        assert_eq!((cpu.run(), cpu.reg(Reg::R(0))), (Stop::Requested, 3));
    }

    #[test]
    fn a_step_passes_an_it_block_as_a_whole() {
        // cmp r0, #0; ite eq; moveq r1, #1; movne r1, #2; movs r2, #3
        let mut cpu = cpu(&[0x2800, 0xBF0C, 0x2101, 0x2102, 0x2203], 100);
        cpu.step().unwrap();
        cpu.step().unwrap();
        assert_eq!((cpu.reg(Reg::Pc) - FLASH, cpu.reg(Reg::R(1)), cpu.reg(Reg::R(2))), (8, 1, 0));
    }

    #[test]
    fn a_step_stops_at_what_stops_a_run() {
        // bkpt #3; wfi; movs r0, #0; wfi
        let mut cpu = cpu(&[0xBE03, 0xBF30, 0x2000, 0xBF30], 100);
        assert_eq!((cpu.step().unwrap(), cpu.reg(Reg::Pc) - FLASH), (Stop::Breakpoint(3), 0));
        cpu.set_reg(Reg::Pc, FLASH + 2);
        assert_eq!((cpu.step().unwrap(), cpu.reg(Reg::Pc) - FLASH), (Stop::WaitForInterrupt, 4));
        assert_eq!((cpu.step().unwrap(), cpu.reg(Reg::Pc) - FLASH), (Stop::Requested, 6), "not at the next one's hook");
    }

    #[test]
    fn a_hardware_break_point_stops_before_its_instruction() {
        // movs r0, #0; adds r0, #1; adds r0, #1; b .-4
        let mut cpu = cpu(&[0x2000, 0x3001, 0x3001, 0xE7FC], 100);
        assert_eq!(cpu.step().unwrap(), Stop::Requested);
        cpu.set_breakpoints(&[FLASH + 4]).unwrap();
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc) - FLASH, cpu.reg(Reg::R(0))), (Stop::HardwareBreakpoint, 4, 1));
        assert_eq!(cpu.run(), Stop::HardwareBreakpoint, "it stops there again");
        cpu.set_breakpoints(&[]).unwrap();
        assert_eq!((cpu.step().unwrap(), cpu.reg(Reg::Pc) - FLASH), (Stop::Requested, 6));
        cpu.set_breakpoints(&[FLASH + 2, FLASH + 4]).unwrap();
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc) - FLASH), (Stop::HardwareBreakpoint, 2));
        cpu.set_breakpoints(&[FLASH + 4]).unwrap();
        assert_eq!((cpu.run(), cpu.reg(Reg::R(0))), (Stop::HardwareBreakpoint, 3));
    }

    #[test]
    fn code_in_ram_runs_where_a_debugger_may_put_it() {
        // movs r0, #7; bkpt #0; another number
        let write = |cpu: &mut UnicornCpu<RecordingMachine>, number: u16| {
            let code: Vec<u8> = [0x2000 | number, 0xBE00].iter().flat_map(|half| half.to_le_bytes()).collect();
            assert!(cpu.write_ram(RAM, &code));
            cpu.drop_code(RAM, code.len()).unwrap();
            cpu.set_reg(Reg::Pc, RAM);
        };
        let mut cpu = cpu(&[0xBF00], 100);
        write(&mut cpu, 7);
        assert_eq!(cpu.run(), Stop::Trap(Trap::FetchNever));
        cpu.allow_code_in_ram(Chip::F407).unwrap();
        for number in [7, 9] {
            write(&mut cpu, number);
            assert_eq!((cpu.run(), cpu.reg(Reg::R(0))), (Stop::Breakpoint(0), number.into()));
            assert_eq!(cpu.machine().charged.last(), Some(&(RAM, 2)));
        }
    }

    #[test]
    fn a_store_to_open_flash_goes_to_the_machine() {
        // str r1, [r0]; movs r2, #1; bkpt #0
        let mut cpu = cpu(&[0x6001, 0x2201, 0xBE00], 100);
        cpu.set_reg(Reg::R(0), FLASH + 0x4000);
        cpu.set_reg(Reg::R(1), 0x1234_5678);
        assert_eq!(cpu.run(), Stop::Trap(Trap::WriteFlash(FLASH + 0x4000)));
        cpu.machine().flash_is_open = true;
        cpu.set_reg(Reg::Pc, FLASH);
        assert_eq!((cpu.run(), cpu.reg(Reg::R(2))), (Stop::Breakpoint(0), 1));
        assert_eq!(cpu.machine().stores, [(FLASH + 0x4000, Width::Word, 0x1234_5678)]);
        assert_eq!(cpu.read_word(FLASH + 0x4000), Some(u32::MAX), "the machine programs it");
    }

    #[test]
    fn hints_of_a_new_program_are_found() {
        // nop; nop: then wfi; bkpt #0
        let mut cpu = cpu(&[0xBF00, 0xBE00, 0xBE00], 100);
        assert_eq!(cpu.run(), Stop::Breakpoint(0));
        cpu.write_flash(FLASH, &[0x30, 0xBF]).unwrap();
        cpu.set_reg(Reg::Pc, FLASH);
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc)), (Stop::WaitForInterrupt, FLASH + 2));
        // The hook stays, and does nothing for another instruction: movs r0, #5.
        cpu.write_flash(FLASH, &[0x05, 0x20]).unwrap();
        cpu.set_reg(Reg::Pc, FLASH);
        assert_eq!((cpu.run(), cpu.reg(Reg::R(0))), (Stop::Breakpoint(0), 5));
    }

    #[test]
    fn passes_of_a_branch_to_itself_are_counted_by_the_machine() {
        // movs r0, #0; b .
        let mut hangs = cpu(&[0x2000, 0xE7FE], 3);
        assert_eq!((hangs.run(), hangs.machine().stays), (Stop::Requested, 2));
        // movs r0, #0; b .+2; b .-2
        let mut walks = cpu(&[0x2000, 0xE7FF, 0xE7FD], 3);
        assert_eq!((walks.run(), walks.machine().stays), (Stop::Requested, 0));
    }

    #[test]
    fn hints_stop_the_run_after_themselves() {
        // sev; yield; wfe; wfi; udf #0
        let mut cpu = cpu(&[0xBF40, 0xBF10, 0xBF20, 0xBF30, 0xDE00], 100);
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc)), (Stop::WaitForEvent, FLASH + 6));
        assert_eq!(cpu.machine().events, 1);
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc)), (Stop::WaitForInterrupt, FLASH + 8));
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc)), (Stop::Trap(Trap::Undefined), FLASH + 8));
    }

    #[test]
    fn an_access_in_an_it_block_ends_with_it() {
        // cmp r1, #0; it ne; strne or ldrne r0, [r1]; movs r3, #0; b .+2; adds r2, #1; b .
        for access in [0x6008, 0x6808] {
            let mut cpu = cpu(&[0x2900, 0xBF18, access, 0x2300, 0xE7FF, 0x3201, 0xE7FE], 2);
            // A page that nothing has used: Unicorn looks it up in the IT block.
            cpu.set_reg(Reg::R(1), 0x2000_4000);
            assert_eq!((cpu.run(), cpu.reg(Reg::R(2)), cpu.reg(Reg::Pc)), (Stop::Requested, 1, FLASH + 12));
        }
    }

    #[test]
    fn device_accesses_go_to_the_machine_others_trap() {
        // ldr r0, [r1]; str r0, [r1]; strb r0, [r1]; ldr r0, [r2]
        let mut cpu = cpu(&[0x6808, 0x6008, 0x7008, 0x6810], 100);
        cpu.set_reg(Reg::R(1), 0x4001_0044);
        cpu.set_reg(Reg::R(2), 0x3000_0000);
        assert_eq!((cpu.run(), cpu.reg(Reg::Pc)), (Stop::Trap(Trap::ReadUnmapped(0x3000_0000)), FLASH + 6));
        let stores = [(0x4001_0044, Width::Word, 0xBFFE_FFBB), (0x4001_0044, Width::Byte, 0xBB)];
        assert_eq!(cpu.machine().stores, stores);
    }

    #[test]
    fn flash_and_code_in_ram_are_refused() {
        // str r0, [r1]
        let mut writes = cpu(&[0x6008], 100);
        writes.set_reg(Reg::R(1), FLASH + 0x100);
        assert_eq!(writes.run(), Stop::Trap(Trap::WriteFlash(FLASH + 0x100)));
        // bx r1, to RAM, to an even address
        for (to, trap) in [(0x2000_0001, Trap::FetchNever), (FLASH + 0x100, Trap::InvalidState)] {
            let mut jumps = cpu(&[0x4708], 100);
            jumps.set_reg(Reg::R(1), to);
            assert_eq!(jumps.run(), Stop::Trap(trap));
        }
    }

    #[test]
    fn a_patch_applies_at_both_addresses_of_flash() {
        // nop; nop; adds r0, #1; b .-2
        let mut cpu = cpu(&[0xBF00, 0xBF00, 0x3001, 0xE7FD], 4);
        assert_eq!(cpu.run(), Stop::Requested);
        assert_eq!(cpu.patch_flash(FLASH + 4, 0xE7FE).unwrap(), 0x3001);
        for start in [FLASH + 4, 4] {
            cpu.machine().blocks_left = 5;
            cpu.set_reg(Reg::Pc, start);
            assert_eq!((cpu.run(), cpu.reg(Reg::R(0)), cpu.reg(Reg::Pc)), (Stop::Requested, 4, start));
        }
        assert_eq!(cpu.machine().charged.last(), Some(&(4, 1)));
        assert!(cpu.patch_flash(FLASH + 1, 0).is_err() && cpu.patch_flash(0x2000_0000, 0).is_err());
    }

    #[test]
    fn dma_accesses_sram_and_flash_but_not_coupled_memory() {
        let mut cpu = cpu(&[0x1234, 0x5678], 0);
        let (_, mut memory) = cpu.machine_and_memory();
        assert!(memory.write(0x2001_FFFC, Width::Word, 0xCAFE_F00D));
        assert_eq!(memory.read(0x2001_FFFE, Width::Half), Some(0xCAFE));
        assert_eq!(memory.read(FLASH, Width::Word), Some(0x5678_1234));
        assert!(!memory.write(FLASH, Width::Word, 0) && !memory.write(0x1000_0000, Width::Word, 0));
        assert!(!memory.write(0x2002_0000, Width::Byte, 0) && !memory.write(0x2000_0002, Width::Word, 0));
        assert_eq!(memory.read(0x1000_0000, Width::Word), None);
    }
}
