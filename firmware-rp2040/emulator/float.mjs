// Calls the image's routines for single-precision numbers on the emulator and compares each result with the computer's: all pairs of borders, and pairs
// at random, of which half have exponents near each other. A NaN has no payload that must be kept.
//
//   node float.mjs IMAGE.uf2 IMAGE.elf [RANDOM_PAIRS]

import { readFileSync } from 'node:fs';
import { Chip, pages } from './chip.mjs';
import { functions } from './elf.mjs';

const [imageFile, elfFile, pairs = '100000'] = process.argv.slice(2);
if (elfFile === undefined) {
  console.error('usage: node float.mjs IMAGE.uf2 IMAGE.elf [RANDOM_PAIRS]');
  process.exit(2);
}

// Until the start-up code has copied the program to RAM.
const COPIED_NS = 200e6;
const RETURN = 0x20000100;
const chip = new Chip(pages(readFileSync(imageFile)), () => {});
chip.runTo(COPIED_NS);
const { core } = chip.mcu;
core.PM = true;
core.waiting = false;
const symbols = functions(readFileSync(elfFile));

const words = new Uint32Array(1);
const single = new Float32Array(words.buffer);
const number = (bits) => ((words[0] = bits), single[0]);
const bitsOf = (value) => ((single[0] = value), words[0]);

// The result of each for two numbers, as the computer has it: a double has more than twice the digits, so that the second rounding changes nothing.
const OPERATIONS = {
  __aeabi_fadd: (a, b) => bitsOf(a + b),
  __aeabi_fsub: (a, b) => bitsOf(a - b),
  __aeabi_fmul: (a, b) => bitsOf(a * b),
  __aeabi_fcmplt: (a, b) => Number(a < b),
  __aeabi_fcmple: (a, b) => Number(a <= b),
  __aeabi_fcmpgt: (a, b) => Number(a > b),
  __aeabi_fcmpge: (a, b) => Number(a >= b),
};

const EXPONENTS = [0, 1, 2, 24, 25, 63, 64, 102, 103, 104, 126, 127, 128, 135, 136, 150, 151, 152, 153, 253, 254, 255];
const FRACTIONS = [0, 1, 2, 0x3fffff, 0x400000, 0x400001, 0x555555, 0x7ffffe, 0x7fffff];
const borders = EXPONENTS.flatMap((exponent) => FRACTIONS.map((fraction) => (exponent << 23) | fraction));
borders.push(...borders.map((bits) => (bits | 0x80000000) >>> 0));

let state = 0x9e3779b9;
/** Marsaglia's xorshift. */
function random() {
  state ^= state << 13;
  state ^= state >>> 17;
  state ^= state << 5;
  return state >>> 0;
}

function* operands() {
  for (const a of borders) for (const b of borders) yield [a, b];
  for (let n = 0; n < Number(pairs); n++) {
    const [a, b] = [random(), random()];
    if (n % 2) yield [a, b];
    else {
      const exponent = Math.max(0, Math.min(255, ((a >>> 23) & 0xff) + (random() % 53) - 26));
      yield [a, ((b & 0x807fffff) | (exponent << 23)) >>> 0];
    }
  }
}

let cycles;
function call(address, a, b) {
  const { registers } = core;
  [registers[0], registers[1], registers[14]] = [a, b, RETURN | 1];
  const kept = [4, 5, 6, 7, 13].map((n) => registers[n]);
  core.PC = address;
  cycles = 0;
  while (core.PC !== RETURN) {
    cycles += core.executeInstruction();
    if (cycles > 10_000) throw new Error('it does not return');
  }
  if ([4, 5, 6, 7, 13].some((n, place) => registers[n] !== kept[place])) throw new Error('a register of the caller is changed');
  return registers[0] >>> 0;
}

const isNaNBits = (bits) => (bits & 0x7fffffff) > 0x7f800000;
let wrong = 0;
for (const [name, operation] of Object.entries(OPERATIONS)) {
  const symbol = symbols.find((symbol) => symbol.name === name);
  if (symbol === undefined) throw new Error(`the image has no ${name}`);
  let [count, total] = [0, 0];
  for (const [a, b] of operands()) {
    const want = operation(number(a), number(b));
    const is = call(symbol.address, a, b);
    count += 1;
    total += cycles;
    if (is === want || (isNaNBits(is) && isNaNBits(want))) continue;
    wrong += 1;
    if (wrong <= 20) console.error(`${name} ${[a, b].map((bits) => bits.toString(16)).join(' ')}: ${is.toString(16)}, not ${want.toString(16)}`);
  }
  console.log(`${name}: ${count} pairs, ${(total / count).toFixed(1)} cycles on average`);
}
if (wrong > 0) {
  console.error(`${wrong} results differ`);
  process.exit(1);
}
