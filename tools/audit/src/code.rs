//! The instructions of a function: which addresses it branches to, whether through a pointer, and how many bytes of the stack it takes.
//!
//! The frame of a function is the sum of all its instructions that lower the stack pointer. A function lowers it once at its beginning, so
//! the sum is its frame; where it does so in several branches, the sum is more than it ever takes at once, never less.

use anyhow::{Context, Result, ensure};
use capstone::arch::BuildsCapstone;
use capstone::arch::BuildsCapstoneExtraMode;
use capstone::arch::arm::{ArchExtraMode, ArchMode};
use capstone::{Capstone, Insn};

use crate::image::Function;

/// What a function does that others have to know.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Effects {
    /// Addresses outside of the function that it calls or branches to.
    pub targets: Vec<u32>,
    /// Addresses of its calls and branches through a register.
    pub indirect: Vec<u32>,
    /// Bytes of the stack that it takes for itself.
    pub frame: u32,
}

/// A disassembler of Thumb code.
pub struct Disassembler(Capstone);

impl Disassembler {
    /// For a Cortex-M.
    ///
    /// # Errors
    ///
    /// When the library cannot be started.
    pub fn new() -> Result<Self> {
        let thumb = Capstone::new().arm().mode(ArchMode::Thumb).extra_mode([ArchExtraMode::MClass].into_iter());
        thumb.build().map(Self).map_err(|error| anyhow::anyhow!("starting the disassembler: {error}"))
    }

    /// Reads the code of a function.
    ///
    /// # Errors
    ///
    /// For bytes that are no instruction, and for an instruction that changes the stack pointer in a way that is not known here.
    pub fn effects(&self, function: &Function) -> Result<Effects> {
        let mut effects = Effects::default();
        for (address, bytes) in &function.code {
            let instructions = self.0.disasm_all(bytes, u64::from(*address));
            let instructions = instructions.map_err(|error| anyhow::anyhow!("disassembling: {error}"))?;
            let read: usize = instructions.iter().map(|instruction| instruction.bytes().len()).sum();
            ensure!(read == bytes.len(), "{}: no instruction at {:#010x}", function.name(), address + read as u32);
            for instruction in instructions.iter() {
                let at = instruction.address() as u32;
                let text = || format!("{}: {at:#010x}: {instruction}", function.name());
                match flow(instruction).with_context(text)? {
                    Flow::To(target) if !(function.address..function.end).contains(&target) => {
                        effects.targets.push(target)
                    }
                    Flow::Pointer => effects.indirect.push(at),
                    Flow::To(_) | Flow::Next => {}
                }
                effects.frame += lowered(instruction).with_context(text)?;
            }
        }
        Ok(effects)
    }
}

/// Where an instruction leads to, beside the next one.
enum Flow {
    Next,
    To(u32),
    Pointer,
}

/// Mnemonic without condition and width, and the operands.
fn parts<'a>(instruction: &'a Insn<'_>) -> (&'a str, &'a str) {
    let mnemonic = instruction.mnemonic().unwrap_or_default();
    (mnemonic.split('.').next().unwrap_or_default(), instruction.op_str().unwrap_or_default())
}

fn immediate(text: &str) -> Option<u32> {
    let digits = text.trim().strip_prefix('#')?;
    match digits.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).ok(),
        None => digits.parse().ok(),
    }
}

fn flow(instruction: &Insn<'_>) -> Result<Flow> {
    /// Those of a branch, after `b`.
    const CONDITIONS: [&str; 14] = ["eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];
    let (mnemonic, operands) = parts(instruction);
    let last = operands.rsplit(", ").next().unwrap_or_default();
    let is = |stem: &str| mnemonic.strip_prefix(stem).is_some_and(|rest| rest.is_empty() || CONDITIONS.contains(&rest));
    if is("b") || is("bl") || is("cbz") || is("cbnz") {
        return Ok(Flow::To(immediate(last).context("a branch without a target")?));
    }
    if is("bx") && operands == "lr" {
        return Ok(Flow::Next);
    }
    if is("blx") || is("bx") {
        return Ok(Flow::Pointer);
    }
    // A table of branches inside of the function.
    if is("tbb") || is("tbh") {
        return Ok(Flow::Next);
    }
    // A return: the address comes from the stack.
    if is("pop") || (mnemonic.starts_with("ldm") && operands.starts_with("sp!")) || operands.contains("[sp], #") {
        return Ok(Flow::Next);
    }
    let first = operands.split(", ").next().unwrap_or_default();
    let loads_several = mnemonic.starts_with("ldm") && operands.contains("pc}");
    let writes_first = !mnemonic.starts_with("st") && !mnemonic.starts_with("cmp") && !mnemonic.starts_with("push");
    Ok(if loads_several || (first == "pc" && writes_first) { Flow::Pointer } else { Flow::Next })
}

/// Bytes by which an instruction lowers the stack pointer.
fn lowered(instruction: &Insn<'_>) -> Result<u32> {
    let (mnemonic, operands) = parts(instruction);
    let listed = || registers(operands).context("a list of registers");
    if mnemonic.starts_with("vpush") || mnemonic.starts_with("push") {
        return listed();
    }
    if (mnemonic.starts_with("stmdb") || mnemonic.starts_with("vstmdb")) && operands.starts_with("sp!") {
        return listed();
    }
    if mnemonic.starts_with("st") && operands.contains("[sp, #-") && operands.ends_with("]!") {
        let (_, offset) = operands.rsplit_once("#-").context("an offset")?;
        return immediate(&format!("#{}", offset.trim_end_matches("]!"))).context("an offset");
    }
    let mut operand = operands.split(", ");
    if operand.next() != Some("sp") {
        return Ok(0);
    }
    let rest: Vec<&str> = operand.collect();
    let stem = |names: &[&str]| names.iter().any(|name| mnemonic.starts_with(name));
    match rest.as_slice() {
        // `sub sp, #8`, `sub.w sp, sp, #8`.
        [amount] | ["sp", amount] if stem(&["sub"]) => immediate(amount).context("the frame is not a constant"),
        // Back from a frame pointer, or up.
        ["r7" | "r11", _] if stem(&["sub"]) => Ok(0),
        [amount] | ["sp" | "r7" | "r11", amount] if stem(&["add"]) => {
            immediate(amount).map(|_| 0).context("what is added is not a constant")
        }
        ["r7" | "r11"] if stem(&["mov"]) => Ok(0),
        // Reads it: a comparison, or a transfer of several registers without `sp!`.
        _ if stem(&["cmp", "tst", "cmn", "ldm", "stm", "vldm", "vstm"]) => Ok(0),
        _ => anyhow::bail!("changes the stack pointer in an unknown way"),
    }
}

/// Bytes of a list such as `{r4, r5, lr}`, `{d8, d9}`, `{s16}`.
fn registers(operands: &str) -> Option<u32> {
    let list = operands.split_once('{')?.1.strip_suffix('}')?;
    let bytes = |register: &str| if register.starts_with('d') { 8 } else { 4 };
    let mut sum = 0;
    for item in list.split(", ") {
        sum += match item.split_once('-') {
            Some((first, last)) => {
                let number = |name: &str| name[1..].parse::<u32>().ok();
                (number(last)? - number(first)? + 1) * bytes(first)
            }
            None => bytes(item),
        };
    }
    Some(sum)
}
