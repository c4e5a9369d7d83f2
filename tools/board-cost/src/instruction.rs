//! Instructions as their cost needs them: decoded by capstone, sorted into the classes of the tables in [`crate::timing`].

use anyhow::{Context, Result, ensure};
use capstone::arch::arm::ArmInsn::{self, *};
use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmOperandType, ArmReg};
use capstone::arch::{BuildsCapstone, BuildsCapstoneExtraMode, DetailsArchInsn};
use capstone::{Capstone, Insn, RegId};

/// A set of registers: bits 0 to 15 are R0 to PC, bits 16 to 47 are S0 to S31.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Registers(u64);

/// Bit of the program counter.
const PC: u64 = 1 << 15;
/// Bit of S0.
const S0: u32 = 16;

impl Registers {
    /// Whether the two have a register in common.
    #[must_use]
    pub const fn meet(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    fn of(ids: &[RegId]) -> Self {
        Self(ids.iter().fold(0, |all, &id| all | bits(id)))
    }
}

/// The bits of a register of capstone; 0 for one that costs nothing, such as the flags.
fn bits(id: RegId) -> u64 {
    let id = u32::from(id.0);
    let place = |first: u32, last: u32| (first..=last).contains(&id).then(|| id - first);
    if let Some(n) = place(ArmReg::ARM_REG_R0, ArmReg::ARM_REG_R12) {
        return 1 << n;
    }
    if let Some(n) = place(ArmReg::ARM_REG_S0, ArmReg::ARM_REG_S31) {
        return 1 << (S0 + n);
    }
    if let Some(n) = place(ArmReg::ARM_REG_D0, ArmReg::ARM_REG_D15) {
        return 0b11 << (S0 + 2 * n);
    }
    match id {
        ArmReg::ARM_REG_SP => 1 << 13,
        ArmReg::ARM_REG_LR => 1 << 14,
        ArmReg::ARM_REG_PC => PC,
        _ => 0,
    }
}

/// Class of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Data processing of the core.
    Data {
        /// Its cycles.
        cycles: u32,
    },
    /// SDIV or UDIV; its operands decide.
    Division,
    /// A load of one register.
    Load,
    /// A store of one register.
    Store {
        /// The address is the sum of two registers.
        indexed: bool,
    },
    /// A load or store of so many words.
    Multiple(u32),
    /// IT, which may be folded.
    It,
    /// MRS, MSR, CPS, a barrier, a hint.
    System {
        /// Its cycles.
        cycles: u32,
    },
    /// Arithmetic of the FPU, whose result is ready one cycle later.
    Float {
        /// Its cycles.
        cycles: u32,
        /// It adds to a register, which it needs a cycle later than the others.
        accumulates: bool,
    },
    /// Another instruction of the FPU.
    FloatMove {
        /// Its cycles.
        cycles: u32,
    },
}

/// How an instruction ends a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Jump {
    /// To an address in the instruction.
    Direct,
    /// To an address in a register.
    Register,
    /// To an address that it loads from memory.
    Loaded,
}

/// An instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// Its address.
    pub address: u32,
    /// Its length in bytes, 2 or 4.
    pub length: u32,
    /// What it costs.
    pub class: Class,
    /// Registers that it reads for an address.
    pub addresses: Registers,
    /// All registers that it reads.
    pub reads: Registers,
    /// Registers that it writes.
    pub writes: Registers,
    /// If it can jump.
    pub jump: Option<Jump>,
    /// It leaves a return address.
    pub is_call: bool,
    /// It is one of the FPU.
    pub floating: bool,
    /// Address of the word beside the code that it loads, if it does.
    pub literal: Option<u32>,
}

/// Decoder of Thumb code.
pub struct Decoder(Capstone);

impl Decoder {
    /// For a Cortex-M4F.
    ///
    /// # Errors
    ///
    /// When the library cannot be started.
    pub fn new() -> Result<Self> {
        let thumb = Capstone::new().arm().mode(ArchMode::Thumb).extra_mode([ArchExtraMode::MClass].into_iter());
        thumb.detail(true).build().map(Self).map_err(|error| anyhow::anyhow!("starting the disassembler: {error}"))
    }

    /// Decodes a piece of code that is nothing but instructions.
    ///
    /// # Errors
    ///
    /// For bytes that are no instruction, with their address.
    pub fn decode(&self, address: u32, code: &[u8]) -> Result<Vec<Instruction>> {
        let found = self.0.disasm_all(code, u64::from(address));
        let found = found.map_err(|error| anyhow::anyhow!("disassembling at {address:#010x}: {error}"))?;
        let read: usize = found.iter().map(|instruction| instruction.bytes().len()).sum();
        ensure!(read == code.len(), "no instruction at {:#010x}", address as usize + read);
        found.iter().map(|found| self.instruction(found).with_context(|| format!("{found}"))).collect()
    }

    /// The text of the instruction at the start of a piece of code.
    ///
    /// # Errors
    ///
    /// For bytes that are no instruction, with their address.
    pub fn text(&self, address: u32, code: &[u8]) -> Result<String> {
        let found = self.0.disasm_count(code, u64::from(address), 1);
        let found = found.map_err(|error| anyhow::anyhow!("disassembling at {address:#010x}: {error}"))?;
        let first = found.iter().next().with_context(|| format!("no instruction at {address:#010x}"))?;
        Ok(format!("{} {}", first.mnemonic().unwrap_or_default(), first.op_str().unwrap_or_default()))
    }

    fn instruction(&self, found: &Insn<'_>) -> Result<Instruction> {
        let detail = self.0.insn_detail(found).map_err(|error| anyhow::anyhow!("reading an instruction: {error}"))?;
        let arch = detail.arch_detail();
        let operands: Vec<ArmOperandType> =
            arch.arm().context("not of this processor")?.operands().map(|operand| operand.op_type).collect();
        let (reads, writes) = (Registers::of(detail.regs_read()), Registers::of(detail.regs_write()));
        let mut addresses = Registers::default();
        let mut indexed = false;
        let mut literal = None;
        for operand in &operands {
            if let ArmOperandType::Mem(memory) = operand {
                addresses.0 |= bits(memory.base()) | bits(memory.index());
                indexed |= bits(memory.index()) != 0;
                if bits(memory.base()) == PC && bits(memory.index()) == 0 {
                    // The program counter reads as the address of the instruction plus 4, aligned (ARMv7-M ARM, A7.7.44).
                    let base = (found.address() as u32 + 4) & !3;
                    literal = Some(base.wrapping_add_signed(memory.disp()));
                }
            }
        }
        let registers: Vec<u64> = operands
            .iter()
            .filter_map(|operand| match operand {
                ArmOperandType::Reg(id) => Some(bits(*id)),
                _ => None,
            })
            .collect();
        let id = found.id().0;
        let writes_pc = writes.0 & PC != 0;
        let (class, jump, is_call) = classify(id, &registers, writes_pc, indexed);
        if matches!(class, Class::Multiple(_)) && addresses.0 == 0 {
            // LDM and STM name their base first; PUSH and POP have the stack pointer.
            addresses.0 = if is_one_of(id, STACK) { 1 << 13 } else { registers.first().copied().unwrap_or(0) };
        }
        let floating = (reads.0 | writes.0) >> S0 != 0 || is_one_of(id, &[ARM_INS_VMRS, ARM_INS_VMSR]);
        let length = found.bytes().len() as u32;
        Ok(Instruction {
            address: found.address() as u32,
            length,
            class,
            addresses,
            reads,
            writes,
            jump,
            is_call,
            floating,
            literal,
        })
    }
}

/// Whether an instruction of capstone is one of these.
fn is_one_of(id: u32, all: &[ArmInsn]) -> bool {
    all.iter().any(|one| *one as u32 == id)
}

/// Words of a list of registers.
fn words(registers: &[u64]) -> u32 {
    registers.iter().map(|bits| bits.count_ones()).sum()
}

/// PUSH, POP and those of the FPU.
const STACK: &[ArmInsn] = &[ARM_INS_PUSH, ARM_INS_POP, ARM_INS_VPUSH, ARM_INS_VPOP];
/// Loads of one register.
const LOADS: &[ArmInsn] = &[
    ARM_INS_LDR,
    ARM_INS_LDRB,
    ARM_INS_LDRH,
    ARM_INS_LDRSB,
    ARM_INS_LDRSH,
    ARM_INS_LDREX,
    ARM_INS_LDREXB,
    ARM_INS_LDREXH,
];
/// Loads and stores of several registers, which name the register of the address first.
const SEVERAL: &[ArmInsn] = &[
    ARM_INS_LDM,
    ARM_INS_LDMDB,
    ARM_INS_STM,
    ARM_INS_STMDB,
    ARM_INS_VLDMIA,
    ARM_INS_VLDMDB,
    ARM_INS_VSTMIA,
    ARM_INS_VSTMDB,
];
/// The FPU's multiplications that add to a register.
const ACCUMULATING: &[ArmInsn] = &[
    ARM_INS_VMLA,
    ARM_INS_VMLS,
    ARM_INS_VNMLA,
    ARM_INS_VNMLS,
    ARM_INS_VFMA,
    ARM_INS_VFMS,
    ARM_INS_VFNMA,
    ARM_INS_VFNMS,
];
/// Other arithmetic of the FPU of one cycle.
const ARITHMETIC: &[ArmInsn] = &[ARM_INS_VADD, ARM_INS_VSUB, ARM_INS_VMUL, ARM_INS_VNMUL, ARM_INS_VCVT, ARM_INS_VCVTR];
/// What else the FPU does in one cycle.
const FLOAT_OTHERS: &[ArmInsn] = &[ARM_INS_VABS, ARM_INS_VNEG, ARM_INS_VCMP, ARM_INS_VCMPE, ARM_INS_VMRS, ARM_INS_VMSR];

/// Class of an instruction of capstone, by the registers among its operands; how it jumps, and whether it is a call.
fn classify(id: u32, registers: &[u64], writes_pc: bool, indexed: bool) -> (Class, Option<Jump>, bool) {
    let is = |all: &[ArmInsn]| is_one_of(id, all);
    let one = Class::Data { cycles: 1 };
    let loaded = writes_pc.then_some(Jump::Loaded);
    let (class, jump) = if is(&[ARM_INS_B, ARM_INS_CBZ, ARM_INS_CBNZ, ARM_INS_BL]) {
        (one, Some(Jump::Direct))
    } else if is(&[ARM_INS_BX, ARM_INS_BLX]) {
        (one, Some(Jump::Register))
    } else if is(&[ARM_INS_TBB, ARM_INS_TBH]) {
        // Two cycles for the load, one for the sum.
        (Class::Data { cycles: 3 }, Some(Jump::Loaded))
    } else if is(&[ARM_INS_SDIV, ARM_INS_UDIV]) {
        (Class::Division, None)
    } else if is(LOADS) {
        // Nothing is pipelined with a load of the program counter.
        (if writes_pc { Class::Multiple(1) } else { Class::Load }, loaded)
    } else if is(&[ARM_INS_STR, ARM_INS_STRB, ARM_INS_STRH]) {
        (Class::Store { indexed }, None)
    } else if is(&[ARM_INS_STREX, ARM_INS_STREXB, ARM_INS_STREXH]) {
        // Two cycles: it writes its status too.
        (Class::Store { indexed: true }, None)
    } else if is(&[ARM_INS_LDRD, ARM_INS_STRD]) {
        (Class::Multiple(2), None)
    } else if is(STACK) {
        (Class::Multiple(words(registers)), loaded)
    } else if is(SEVERAL) {
        (Class::Multiple(words(registers.get(1..).unwrap_or(&[]))), loaded)
    } else if is(&[ARM_INS_IT]) {
        (Class::It, None)
    } else if is(&[ARM_INS_MRS, ARM_INS_MSR, ARM_INS_CPS]) {
        (Class::System { cycles: 2 }, None)
    } else if is(&[ARM_INS_ISB]) {
        (Class::System { cycles: 4 }, None)
    } else if is(&[ARM_INS_VLDR, ARM_INS_VSTR]) {
        (Class::FloatMove { cycles: 1 + words(registers) }, None)
    } else if is(&[ARM_INS_VMOV]) {
        // Two cycles between the core and the FPU, for one register or for two.
        let with_core = registers.iter().any(|bits| bits >> S0 == 0);
        (Class::FloatMove { cycles: if with_core { 2 } else { 1 } }, None)
    } else if is(ACCUMULATING) {
        (Class::Float { cycles: 3, accumulates: true }, None)
    } else if is(ARITHMETIC) {
        (Class::Float { cycles: 1, accumulates: false }, None)
    } else if is(&[ARM_INS_VDIV, ARM_INS_VSQRT]) {
        (Class::Float { cycles: 14, accumulates: false }, None)
    } else if is(FLOAT_OTHERS) {
        (Class::FloatMove { cycles: 1 }, None)
    } else {
        // `mov pc, lr` and the like.
        (one, writes_pc.then_some(Jump::Register))
    };
    (class, jump, is(&[ARM_INS_BL, ARM_INS_BLX]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(halves: &[u16]) -> Vec<Instruction> {
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        Decoder::new().unwrap().decode(0x0800_0000, &code).unwrap()
    }

    #[test]
    fn instructions_are_sorted_into_their_classes() {
        for (halves, class) in [
            (&[0x4348][..], Class::Data { cycles: 1 }),          // muls r0, r1, r0
            (&[0xFB00, 0x3102], Class::Data { cycles: 1 }),      // mla r1, r0, r2, r3
            (&[0xFBB1, 0xF0F2], Class::Division),                // udiv r0, r1, r2
            (&[0xFB94, 0xF3F5], Class::Division),                // sdiv r3, r4, r5
            (&[0x6808], Class::Load),                            // ldr r0, [r1]
            (&[0x6008], Class::Store { indexed: false }),        // str r0, [r1]
            (&[0x5088], Class::Store { indexed: true }),         // str r0, [r1, r2]
            (&[0xE9D0, 0x1200], Class::Multiple(2)),             // ldrd r1, r2, [r0]
            (&[0xB570], Class::Multiple(4)),                     // push {r4, r5, r6, lr}
            (&[0xBD70], Class::Multiple(4)),                     // pop {r4, r5, r6, pc}
            (&[0xE890, 0x000E], Class::Multiple(3)),             // ldm r0, {r1, r2, r3}
            (&[0xED2D, 0x8B04], Class::Multiple(4)),             // vpush {d8, d9}
            (&[0xEC90, 0x0A03], Class::Multiple(3)),             // vldmia r0, {s0, s1, s2}
            (&[0xED90, 0x0A01], Class::FloatMove { cycles: 2 }), // vldr s0, [r0, #4]
            (&[0xED90, 0x0B02], Class::FloatMove { cycles: 3 }), // vldr d0, [r0, #8]
            (&[0xEC51, 0x0B10], Class::FloatMove { cycles: 2 }), // vmov r0, r1, d0
            (&[0xEE10, 0x0A10], Class::FloatMove { cycles: 2 }), // vmov r0, s0
            (&[0xEEB0, 0x0A60], Class::FloatMove { cycles: 1 }), // vmov.f32 s0, s1
            (&[0xEEB7, 0x0A00], Class::Data { cycles: 1 }),      // vmov.f32 s0, #1.0, which the decoder calls FCONSTS
            (&[0xEE30, 0x0A20], Class::Float { cycles: 1, accumulates: false }), // vadd.f32 s0, s0, s1
            (&[0xEE00, 0x0A81], Class::Float { cycles: 3, accumulates: true }), // vmla.f32 s0, s1, s2
            (&[0xEEA0, 0x0A81], Class::Float { cycles: 3, accumulates: true }), // vfma.f32 s0, s1, s2
            (&[0xEE80, 0x0A81], Class::Float { cycles: 14, accumulates: false }), // vdiv.f32 s0, s1, s2
            (&[0xEEB1, 0x0AC0], Class::Float { cycles: 14, accumulates: false }), // vsqrt.f32 s0, s0
            (&[0xB672], Class::System { cycles: 2 }),            // cpsid i
        ] {
            assert_eq!(decode(halves)[0].class, class, "{halves:04x?}");
        }
    }

    #[test]
    fn jumps_and_calls_are_known() {
        for (halves, jump, is_call) in [
            (&[0xE7FE][..], Some(Jump::Direct), false),     // b .
            (&[0xD0FE], Some(Jump::Direct), false),         // beq .
            (&[0xB108], Some(Jump::Direct), false),         // cbz r0, .+6
            (&[0xF000, 0xF800], Some(Jump::Direct), true),  // bl .+4
            (&[0x4770], Some(Jump::Register), false),       // bx lr
            (&[0x4780], Some(Jump::Register), true),        // blx r0
            (&[0xBD10], Some(Jump::Loaded), false),         // pop {r4, pc}
            (&[0xF85D, 0xFB04], Some(Jump::Loaded), false), // ldr pc, [sp], #4
            (&[0xE8DF, 0xF000], Some(Jump::Loaded), false), // tbb [pc, r0]
            (&[0xBF00], None, false),                       // nop
        ] {
            let found = decode(halves)[0];
            assert_eq!((found.jump, found.is_call), (jump, is_call), "{halves:04x?}");
        }
    }

    #[test]
    fn registers_of_addresses_and_of_data_are_separate() {
        // ldr r0, [r1, r2]; vldr s1, [r3]
        let [load, float] = decode(&[0x5888, 0xEDD3, 0x0A00])[..] else { panic!("two instructions") };
        assert_eq!((load.addresses, load.writes), (Registers(0b110), Registers(1)));
        assert_eq!((float.addresses, float.writes, float.floating), (Registers(0b1000), Registers(1 << 17), true));
    }

    #[test]
    fn a_word_beside_the_code_has_its_address() {
        // nop; ldr r0, [pc, #8]; vldr s0, [pc, #8]; ldr r0, [r1]
        let found = decode(&[0xBF00, 0x4802, 0xED9F, 0x0A02, 0x6808]);
        let literals: Vec<Option<u32>> = found.iter().map(|one| one.literal).collect();
        assert_eq!(literals, [None, Some(0x0800_000C), Some(0x0800_0010), None]);
    }

    #[test]
    fn what_is_no_instruction_is_an_error() {
        let error = Decoder::new().unwrap().decode(0x0800_0000, &[0x00, 0xBF, 0xFF, 0xFF]).unwrap_err();
        assert!(error.to_string().contains("0x08000002"), "{error}");
    }
}
