//! Cycles of instructions on a Cortex-M4F without wait states, after ARM's Cortex-M4 Technical Reference Manual (DDI 0439).
//!
//! | what | cycles | where |
//! |---|---|---|
//! | data processing, MUL, MLA, MLS, long multiplications | 1 | table 3-1 |
//! | SDIV, UDIV | 2 to 12, here 2 and 10/32 of a cycle for each bit of the quotient | table 3-1; the manual gives only the range |
//! | load of a register | 2; 1 after another load of a register, unless that one gives the address | table 3-1, 3.3.2 |
//! | store of a register | 1; 2 where the address is the sum of two registers | 3.3.2 |
//! | load or store of N words: LDM, STM, PUSH, POP, LDRD, STRD | 1 + N | table 3-1 |
//! | an address from a result of the instruction before | 1 more | 3.3.2 |
//! | jump that is not taken | 1 | table 3-1 |
//! | jump that is taken, to an address in the instruction | 1 + 1 | table 3-1: a refill takes 1 to 3 |
//! | jump to an address in a register | 1 + 2 | the same: known a cycle later |
//! | load of the program counter, TBB, TBH | 3 for the refill | 3.3.2 |
//! | jump to a 32-bit instruction that is not aligned | 1 more, at most 3 in all | table 3-1: "alignment and width of the target" |
//! | IT | 0 after a 16-bit instruction, else 1 | table 3-1, note c |
//! | MRS, MSR, CPS | 2 | table 3-1: 1 or 2 |
//! | ISB | 1 + 3 | table 3-1: a barrier waits; it refills the pipeline |
//! | addition, multiplication, conversion, comparison of the FPU; move in it | 1 | table 7-1 |
//! | VMOV between the core and the FPU, of one register or of two | 2 | table 7-1 |
//! | VMLA, VMLS, VFMA, VFMS and their negated forms | 3 | table 7-1 |
//! | VDIV, VSQRT | 14 | table 7-1 |
//! | VLDR, VSTR of 32 and of 64 bits | 2 and 3 | table 7-1 |
//! | VLDM, VSTM, VPUSH, VPOP of N words | 1 + N | table 7-1 |
//! | a result of FPU arithmetic that the next instruction uses, but not as what it adds to | 1 more | 7.2.3 |
//!
//! An instruction whose condition does not hold is counted as if it held. Between two blocks nothing is pipelined. Not modelled: waits for the
//! buses of the peripherals and for RAM that the DMA uses at the same time, and the two words that the fetch unit holds ahead.

use crate::instruction::{Class, Instruction, Jump};

/// Cycles of the shortest division.
pub const SHORTEST_DIVISION: u32 = 2;
/// Cycles from an exception to the first instruction of its handler, without wait states (3.9.1).
pub const EXCEPTION_ENTRY: u64 = 12;
/// Cycles of a return to what was interrupted.
pub const EXCEPTION_RETURN: u64 = 10;
/// Cycles from a handler to the next one without stacking.
pub const TAIL_CHAIN: u64 = 6;
/// Words of the floating-point registers in a frame: stored when the handler first uses the FPU, and loaded at the return then.
pub const FLOATING_WORDS: u64 = 17;

/// Cycles of a division beyond the shortest one, by the bits of the magnitudes of dividend and divisor.
#[must_use]
pub const fn division(dividend_bits: u32, divisor_bits: u32) -> u32 {
    if divisor_bits == 0 || dividend_bits < divisor_bits {
        return 0;
    }
    let quotient_bits = dividend_bits - divisor_bits + 1;
    (10 * quotient_bits).div_ceil(32)
}

/// Cycles to refill the pipeline after a jump that is taken.
#[must_use]
pub const fn refill(jump: Jump, target_is_wide_and_unaligned: bool) -> u32 {
    let refill = match jump {
        Jump::Direct => 1,
        Jump::Register => 2,
        Jump::Loaded => 3,
    };
    if target_is_wide_and_unaligned && refill < 3 { refill + 1 } else { refill }
}

/// Cycles of an instruction after the one before it in its block, without wait states, and without the refill after a jump.
#[must_use]
pub fn cycles(before: Option<&Instruction>, this: &Instruction) -> u32 {
    let single = match this.class {
        Class::Data { cycles }
        | Class::System { cycles }
        | Class::Float { cycles, .. }
        | Class::FloatMove { cycles } => cycles,
        Class::Division => SHORTEST_DIVISION,
        Class::Load => 2,
        Class::Store { indexed } => 1 + u32::from(indexed),
        Class::Multiple(words) => 1 + words,
        Class::It => 1,
    };
    let Some(before) = before else { return single };
    let waits = matches!(before.class, Class::Data { .. }) && before.writes.meet(this.addresses);
    let pipelined = before.class == Class::Load && !before.writes.meet(this.addresses);
    let cycles = match this.class {
        Class::It if before.length == 2 => 0,
        Class::Load if pipelined => single - 1,
        Class::Store { indexed: true } if pipelined => single - 1,
        _ => single + u32::from(waits),
    };
    cycles + u32::from(is_late(before, this))
}

/// Whether the result of FPU arithmetic comes a cycle too late for the next instruction.
fn is_late(before: &Instruction, this: &Instruction) -> bool {
    if !matches!(before.class, Class::Float { .. }) || !before.writes.meet(this.reads) {
        return false;
    }
    // What is added to is read and written; it comes early enough, unless it is also a factor, which is rare and counts the same.
    let only_added = matches!(this.class, Class::Float { accumulates: true, .. }) && before.writes == this.writes;
    !only_added
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction::Decoder;

    /// Cycles of each instruction.
    fn of(halves: &[u16]) -> Vec<u32> {
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let decoded = Decoder::new().unwrap().decode(0x0800_0000, &code).unwrap();
        let before = std::iter::once(None).chain(decoded.iter().map(Some));
        before.zip(&decoded).map(|(before, this)| cycles(before, this)).collect()
    }

    #[test]
    fn loads_are_pipelined_as_in_the_manual() {
        // ldr r0, [r1]; ldr r2, [r3]; ldr r4, [r5]: 2 + 1 + 1
        assert_eq!(of(&[0x6808, 0x681A, 0x682C]), [2, 1, 1]);
        // ldr r0, [r1]; ldr r2, [r0]: the address is the first one's result
        assert_eq!(of(&[0x6808, 0x6802]), [2, 2]);
        // ldr r0, [r1, r2]; str r0, [r3, #20]: 3.3.2 names 3
        assert_eq!(of(&[0x5888, 0x6158]), [2, 1]);
        // str r0, [r1, r2]; ldr r3, [r4]: nothing is pipelined after a store with a sum
        assert_eq!(of(&[0x5088, 0x6823]), [2, 2]);
        // ldrd, ldm of 3, push of 4
        assert_eq!(of(&[0xE9D0, 0x1200, 0xE890, 0x000E, 0xB570]), [3, 4, 5]);
    }

    #[test]
    fn an_address_that_was_just_computed_costs_a_cycle() {
        // adds r1, #4; ldr r0, [r1]; then with another instruction between
        assert_eq!(of(&[0x3104, 0x6808]), [1, 3]);
        assert_eq!(of(&[0x3104, 0xBF00, 0x6808]), [1, 1, 2]);
    }

    #[test]
    fn results_of_the_fpu_come_a_cycle_later() {
        // vadd.f32 s0, s0, s1; vmul.f32 s2, s0, s0
        assert_eq!(of(&[0xEE30, 0x0A20, 0xEE20, 0x1A00]), [1, 2]);
        // vadd.f32 s0, s0, s1; vmul.f32 s2, s1, s1
        assert_eq!(of(&[0xEE30, 0x0A20, 0xEE20, 0x1AA0]), [1, 1]);
        // vmul.f32 s0, s1, s1; vmla.f32 s0, s1, s2: what is added to may come late
        assert_eq!(of(&[0xEE20, 0x0AA0, 0xEE00, 0x0A81]), [1, 3]);
        // vdiv.f32 s0, s1, s2; vmov r0, s0
        assert_eq!(of(&[0xEE80, 0x0A81, 0xEE10, 0x0A10]), [14, 3]);
    }

    #[test]
    fn it_is_folded_into_a_narrow_instruction() {
        // nop; it eq; moveq r0, #0, and the same after a wide one
        assert_eq!(of(&[0xBF00, 0xBF08, 0x2000]), [1, 0, 1]);
        assert_eq!(of(&[0xF3AF, 0x8000, 0xBF08, 0x2000]), [1, 1, 1]);
    }

    #[test]
    fn a_division_takes_2_to_12_cycles() {
        let total = |dividend, divisor| SHORTEST_DIVISION + division(dividend, divisor);
        assert_eq!((total(3, 4), total(32, 0), total(0, 1)), (2, 2, 2));
        assert_eq!((total(4, 4), total(32, 17), total(32, 1)), (3, 7, 12));
    }

    #[test]
    fn a_refill_takes_1_to_3_cycles() {
        assert_eq!([Jump::Direct, Jump::Register, Jump::Loaded].map(|jump| refill(jump, false)), [1, 2, 3]);
        assert_eq!([Jump::Direct, Jump::Register, Jump::Loaded].map(|jump| refill(jump, true)), [2, 3, 3]);
    }
}
