// Where the cycles of a tick go: walks with the image on rp2040js and prints the longest tick, and for each function what it executes itself in a tick.
//
//   node profile.mjs IMAGE.uf2 IMAGE.elf [SECONDS]
//
// The ticks of the last second count; a walk begins 3 s after the start. A tick is everything in the interrupt of the control task.

import { readFileSync } from 'node:fs';
import { ARMING, AT_REST, PINS, SUPPLY_V } from './board.mjs';
import { Chip, pages } from './chip.mjs';
import { functions } from './elf.mjs';

const [imageFile, elfFile, seconds = '4.2'] = process.argv.slice(2);
if (elfFile === undefined) {
  console.error('usage: node profile.mjs IMAGE.uf2 IMAGE.elf [SECONDS]');
  process.exit(2);
}

/** The names in a mangled one, as `module::function`: each has its length in front. */
function plain(name) {
  if (!name.startsWith('_R')) return name;
  const found = [];
  let rest = name.replaceAll(/Cs[0-9A-Za-z]+_/g, '');
  for (let match; (match = rest.match(/([1-9][0-9]*)/)); ) {
    const end = match.index + match[0].length;
    const [from, length] = [end + Number(rest[end] === '_'), Number(match[0])];
    const word = rest.slice(from, from + length);
    const isWord = word.length === length && /[a-z]{3}/.test(word);
    if (isWord) found.push(word);
    rest = rest.slice(isWord ? from + length : end);
  }
  return [...new Set(found)].join('::');
}

const RAM = 0x20000000;
const RAM_BYTES = 0x42000;
/** The exception of SWI_IRQ_0, which is interrupt 26. */
const TICK = 16 + 26;

const symbols = functions(readFileSync(elfFile));
const owner = new Uint16Array(RAM_BYTES / 2);
symbols.forEach(({ address, size }, n) => {
  for (let at = address; at < address + size; at += 2) if (at >= RAM && at < RAM + RAM_BYTES) owner[(at - RAM) / 2] = n + 1;
});
const starts = new Map(symbols.map(({ address }, n) => [address, n]));
const own = symbols.map(() => ({ cycles: 0, calls: 0 }));
const elsewhere = { cycles: 0, calls: 0 };

const chip = new Chip(pages(readFileSync(imageFile)), (mcu) => {
  for (const [name, level] of Object.entries(AT_REST)) mcu.gpio[PINS[name]].setInputValue(level);
  Object.defineProperty(mcu.adc.channelValues, 0, {
    get: () => Math.round(((1.5 + 0.3 * Math.sin(2e-9 * Math.PI * mcu.clock.nanos)) / SUPPLY_V) * 4095),
  });
});
for (const { s, pin, level } of ARMING) {
  chip.runTo(s * 1e9);
  chip.mcu.gpio[PINS[pin]].setInputValue(level);
}
const end = Number(seconds) * 1e9;
chip.runTo(end - 1e9);

/** Widths of the pulses of one servo in that second: a walk changes them. */
const widths = [];
let rose;
chip.mcu.gpio[PINS.servos[0]].addListener((state) => {
  // High is 1.
  if (state === 1) rose = chip.mcu.clock.nanos;
  else if (rose !== undefined) {
    widths.push(chip.mcu.clock.nanos - rose);
    rose = undefined;
  }
});

const { core } = chip.mcu;
const execute = core.executeInstruction;
let [inTick, ticks, tick, longest, total, inFlash] = [false, 0, 0, 0, 0, 0];
core.executeInstruction = function () {
  const [at, isTick] = [this.PC, this.IPSR === TICK];
  const cycles = execute.call(this);
  if (isTick) {
    if (!inTick) [ticks, tick] = [ticks + 1, 0];
    tick += cycles;
    longest = Math.max(longest, tick);
    total += cycles;
    if (at < RAM) inFlash += cycles;
    const n = owner[(at - RAM) / 2];
    const of = n > 0 ? own[n - 1] : elsewhere;
    of.cycles += cycles;
    const start = starts.get(at);
    if (start !== undefined) own[start].calls += 1;
    inTick = this.IPSR !== 0;
  } else if (this.IPSR === 0) inTick = false;
  return cycles;
};
chip.runTo(end);
// A frame takes 20 ms.
const [least, greatest] = [Math.min(...widths), Math.max(...widths)];
if (widths.length < 49 || greatest - least < 50e3) {
  console.error(`the image does not walk in the last second: ${widths.length} pulses of ${least} to ${greatest} ns`);
  process.exit(1);
}

console.log(`${ticks} ticks, ${(total / ticks).toFixed(0)} cycles on average, longest ${longest}; ${(inFlash / ticks).toFixed(0)} of them in flash`);
console.log('  cycles   share    calls  function');
symbols
  .map(({ name }, n) => ({ name, ...own[n] }))
  .concat({ name: '(elsewhere)', ...elsewhere })
  .filter(({ cycles }) => cycles > 0)
  .sort((a, b) => b.cycles - a.cycles)
  .slice(0, 20)
  .forEach(({ name, cycles, calls }) => {
    const row = [(cycles / ticks).toFixed(0).padStart(8), `${((100 * cycles) / total).toFixed(1)} %`.padStart(7), (calls / ticks).toFixed(1).padStart(8)];
    console.log(`${row.join(' ')}  ${plain(name)}`);
  });
