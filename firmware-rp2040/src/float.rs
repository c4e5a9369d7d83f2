//! Single-precision sums, differences and products for a core without a floating-point unit, in place of those of Rust's library, whose results they
//! have to the bit: IEEE 754-2019, rounded to nearest, ties to even, with subnormal numbers.
//!
//! Written for the Cortex-M0+ with its multiplier of one cycle. They compute what a walk consists of: normal numbers, results within the range, and
//! a sum with zero. Everything else goes to [`firmware_rp2040::float_special`]. The linker takes them because those of the library are weak. The
//! ROM of the chip has such routines too, which are not used: they take subnormal numbers for zero.
//!
//! `firmware-rp2040/emulator/float.mjs` calls each on the emulator with millions of operands and compares with the computer's results.

use core::arch::naked_asm;

use firmware_rp2040::float_special;

extern "C" fn add_special(a: u32, b: u32) -> u32 {
    float_special::add(a, b)
}

extern "C" fn multiply_special(a: u32, b: u32) -> u32 {
    float_special::multiply(a, b)
}

/// a - b: flips the sign of b and falls into the sum.
///
/// # Method of the sum
/// The larger number keeps its place, its fraction in the word's upper 24 bits. The other is shifted right by the difference of the exponents; what is
/// lost beyond eight bits sets the lowest one. The result's exponent, less 1, and its fraction are added, so the leading one completes the exponent; the
/// carry of the last shift, half a unit of the last place, rounds, also into the exponent where it has to.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn __aeabi_fsub(a: u32, b: u32) -> u32 {
    naked_asm!(
        "movs r2, #1",
        "lsls r2, r2, #31",
        "eors r1, r2",
        // The same address in the table of symbols: the sum.
        ".global __aeabi_fadd",
        ".type __aeabi_fadd, %function",
        ".thumb_func",
        "__aeabi_fadd:",
        "lsls r2, r0, #1",
        "lsls r3, r1, #1",
        "cmp r2, r3",
        "blo 20f",
        "10:", // |a| >= |b|
        "lsrs r2, r2, #24",
        "lsrs r3, r3, #24",
        "beq 30f",
        "cmp r2, #255",
        "beq 40f",
        "subs r3, r2, r3",
        "mov r12, r4",
        "movs r4, r0",
        "eors r4, r1",
        "bmi 50f",
        // One sign. r0: a; r1: b; r3: difference of the exponents; r4: the leading one.
        "movs r4, #1",
        "lsls r4, r4, #31",
        "lsls r1, r1, #8",
        "orrs r1, r4",
        "cmp r3, #8",
        "bhi 15f",
        "lsrs r1, r3",
        "12:",
        "lsls r3, r0, #8",
        "orrs r3, r4",
        "lsrs r0, r0, #23",
        "adds r1, r1, r3",
        "bcs 16f",
        "subs r0, #1",
        "13:", // The leading one in bit 31
        "lsls r0, r0, #23",
        "lsls r3, r1, #25",
        "beq 17f",
        "lsrs r1, r1, #8",
        "adcs r0, r1",
        "mov r4, r12",
        "bx lr",
        // More than eight places: the lowest bit says whether anything was lost. Beyond 25 places nothing is left to add.
        "15:",
        "cmp r3, #25",
        "bhi 19f",
        "movs r4, r1",
        "lsrs r1, r3",
        "rsbs r3, r3, #0",
        "adds r3, #32",
        "lsls r4, r3",
        "beq 151f",
        "movs r4, #1",
        "orrs r1, r4",
        "151:",
        "movs r4, #1",
        "lsls r4, r4, #31",
        "b 12b",
        // The leading one was carried out of the word.
        "16:",
        "adds r0, #1",
        "uxtb r3, r0",
        "cmp r3, #255",
        "beq 161f",
        "lsls r0, r0, #23",
        "lsls r3, r1, #24",
        "beq 18f",
        "lsrs r1, r1, #9",
        "adcs r0, r1",
        "mov r4, r12",
        "bx lr",
        "161:", // Infinity
        "lsls r0, r0, #23",
        "mov r4, r12",
        "bx lr",
        // Exact, or half a unit of the last place: to the even neighbour.
        "17:",
        "lsrs r1, r1, #8",
        "bcs 171f",
        "adds r0, r0, r1",
        "19:",
        "mov r4, r12",
        "bx lr",
        "18:",
        "lsrs r1, r1, #9",
        "bcs 171f",
        "adds r0, r0, r1",
        "mov r4, r12",
        "bx lr",
        "171:",
        "adcs r0, r1",
        "lsrs r0, r0, #1",
        "lsls r0, r0, #1",
        "mov r4, r12",
        "bx lr",
        "20:", // Change places
        "mov r12, r0",
        "movs r0, r1",
        "mov r1, r12",
        "mov r12, r2",
        "movs r2, r3",
        "mov r3, r12",
        "b 10b",
        "30:", // b is zero or subnormal
        "cmp r2, #255",
        "beq 40f",
        "lsls r3, r1, #1",
        "bne 40f",
        "lsls r3, r0, #1",
        "beq 31f",
        "bx lr",
        "31:", // Two zeros: negative if both are
        "ands r0, r1",
        "bx lr",
        "40:",
        "push {{r4, lr}}",
        "bl {special}",
        "pop {{r4, pc}}",
        // Two signs.
        "50:",
        "movs r4, #1",
        "lsls r4, r4, #31",
        "lsls r1, r1, #8",
        "orrs r1, r4",
        "cmp r3, #8",
        "bhi 55f",
        "lsrs r1, r3",
        "52:",
        "lsls r3, r0, #8",
        "orrs r3, r4",
        "lsrs r0, r0, #23",
        "subs r1, r3, r1",
        "bpl 56f",
        "subs r0, #1",
        "lsls r0, r0, #23",
        "lsls r3, r1, #25",
        "beq 17b",
        "lsrs r1, r1, #8",
        "adcs r0, r1",
        "mov r4, r12",
        "bx lr",
        "55:",
        "cmp r3, #25",
        "bhi 19b",
        "movs r4, r1",
        "lsrs r1, r3",
        "rsbs r3, r3, #0",
        "adds r3, #32",
        "lsls r4, r3",
        "beq 551f",
        "movs r4, #1",
        "orrs r1, r4",
        "551:",
        "movs r4, #1",
        "lsls r4, r4, #31",
        "b 52b",
        "56:", // The leading one is below bit 31, or there is none
        "beq 58f",
        "cmp r2, #1",
        "beq 59f",
        "subs r0, #2",
        "lsls r1, r1, #1",
        "bpl 57f",
        "lsls r0, r0, #23",
        "lsls r3, r1, #25",
        "beq 17b",
        "lsrs r1, r1, #8",
        "adcs r0, r1",
        "mov r4, r12",
        "bx lr",
        // More places: then the exponents differed by at most one, and the result is exact. r2: places until it is subnormal.
        "57:",
        "uxtb r2, r0",
        "subs r0, r0, r2",
        "571:",
        "lsrs r3, r1, #24",
        "bne 572f",
        "cmp r2, #8",
        "blo 572f",
        "subs r2, #8",
        "lsls r1, r1, #8",
        "bpl 571b",
        "b 573f",
        "572:",
        "subs r2, #1",
        "bmi 574f",
        "lsls r1, r1, #1",
        "bpl 572b",
        "573:",
        "adds r0, r0, r2",
        "lsls r0, r0, #23",
        "lsrs r1, r1, #8",
        "adds r0, r0, r1",
        "mov r4, r12",
        "bx lr",
        "574:",
        "movs r2, #0",
        "b 573b",
        "58:", // Zero
        "movs r0, #0",
        "mov r4, r12",
        "bx lr",
        "59:", // Subnormal, of numbers with the smallest exponent
        "lsrs r0, r0, #8",
        "lsls r0, r0, #31",
        "lsrs r1, r1, #8",
        "orrs r0, r1",
        "mov r4, r12",
        "bx lr",
        special = sym add_special,
    )
}

/// a * b.
///
/// # Method
/// With the fractions A of 24 bits, in a part of 8 and one of 16, and B, the upper 32 of the product's 48 bits are exact as a sum of three products
/// that fit a word: `high(A) B + low(A) high(B) + low(A) low(B) / 2^16`; the lower 16 only tell an exact half from more.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn __aeabi_fmul(a: u32, b: u32) -> u32 {
    naked_asm!(
        "lsls r2, r0, #1",
        "lsrs r2, r2, #24",
        "subs r2, #1",
        "cmp r2, #253",
        "bhi 40f",
        "lsls r3, r1, #1",
        "lsrs r3, r3, #24",
        "subs r3, #1",
        "cmp r3, #253",
        "bhi 40f",
        "adds r2, r2, r3",
        // The result's exponent less 1, if the leading one is where it is in the smaller half of the products.
        "subs r2, #126",
        "cmp r2, #252",
        "bhi 40f",
        "movs r3, r0",
        "eors r3, r1",
        "lsrs r3, r3, #31",
        "lsls r3, r3, #8",
        "orrs r2, r3",
        "mov r12, r4",
        "movs r4, #128",
        "lsls r4, r4, #16",
        "lsls r1, r1, #9",
        "lsrs r1, r1, #9",
        "orrs r1, r4", // B
        "lsls r3, r0, #9",
        "lsrs r3, r3, #25",
        "adds r3, #128", // high(A)
        "uxth r0, r0",   // low(A)
        "muls r3, r1, r3",
        "lsrs r4, r1, #16",
        "muls r4, r0, r4",
        "adds r3, r3, r4",
        "uxth r1, r1",
        "muls r0, r1, r0",
        "lsrs r1, r0, #16",
        "lsls r0, r0, #16",
        "adds r3, r3, r1",
        "bpl 16f",
        "adds r2, #1",
        "lsls r4, r3, #25",
        "orrs r4, r0",
        "beq 17f",
        "lsls r0, r2, #23",
        "lsrs r3, r3, #8",
        "adcs r0, r3",
        "mov r4, r12",
        "bx lr",
        "16:", // The leading one in bit 30
        "lsls r4, r3, #26",
        "orrs r4, r0",
        "beq 18f",
        "lsls r0, r2, #23",
        "lsrs r3, r3, #7",
        "adcs r0, r3",
        "mov r4, r12",
        "bx lr",
        // Exact, or half a unit of the last place: to the even neighbour.
        "17:",
        "lsls r0, r2, #23",
        "lsrs r3, r3, #8",
        "b 19f",
        "18:",
        "lsls r0, r2, #23",
        "lsrs r3, r3, #7",
        "19:",
        "mov r4, r12",
        "bcs 20f",
        "adds r0, r0, r3",
        "bx lr",
        "20:",
        "adcs r0, r3",
        "lsrs r0, r0, #1",
        "lsls r0, r0, #1",
        "bx lr",
        "40:",
        "push {{r4, lr}}",
        "bl {special}",
        "pop {{r4, pc}}",
        special = sym multiply_special,
    )
}

/// Defines a comparison: 1 for yes, 0 for no and for a NaN. Two numbers of which none is negative are in the order of their bits; with a negative one among
/// them they are in the opposite order, if they are not both zero. Each case has the instructions that make the answer of a borrow, or of none.
macro_rules! comparison {
    ($name:ident, [$($not_negative:literal),*], [$($negative:literal),*], $zeros:literal) => {
        #[unsafe(naked)]
        #[unsafe(no_mangle)]
        extern "C" fn $name(a: u32, b: u32) -> u32 {
            naked_asm!(
                "lsls r2, r0, #1",
                "lsls r3, r1, #1",
                "cmp r2, r3",
                "bhs 20f",
                "movs r2, r3",
                "20:", // The larger one is a NaN if any is
                "movs r3, #255",
                "lsls r3, r3, #24",
                "cmp r2, r3",
                "bhi 40f",
                "movs r2, r0",
                "orrs r2, r1",
                "bmi 30f",
                $($not_negative,)*
                "bx lr",
                "30:",
                "lsls r2, r2, #1",
                "beq 50f",
                $($negative,)*
                "bx lr",
                "40:",
                "movs r0, #0",
                "bx lr",
                "50:", // Two zeros
                $zeros,
                "bx lr",
            )
        }
    };
}

comparison!(
    __aeabi_fcmplt,
    ["cmp r0, r1", "sbcs r0, r0", "rsbs r0, r0, #0"],
    ["cmp r1, r0", "sbcs r0, r0", "rsbs r0, r0, #0"],
    "movs r0, #0"
);
comparison!(
    __aeabi_fcmpgt,
    ["cmp r1, r0", "sbcs r0, r0", "rsbs r0, r0, #0"],
    ["cmp r0, r1", "sbcs r0, r0", "rsbs r0, r0, #0"],
    "movs r0, #0"
);
comparison!(
    __aeabi_fcmple,
    ["cmp r1, r0", "sbcs r0, r0", "adds r0, #1"],
    ["cmp r0, r1", "sbcs r0, r0", "adds r0, #1"],
    "movs r0, #1"
);
comparison!(
    __aeabi_fcmpge,
    ["cmp r0, r1", "sbcs r0, r0", "adds r0, #1"],
    ["cmp r1, r0", "sbcs r0, r0", "adds r0, #1"],
    "movs r0, #1"
);
