// Checks of the patches: each shows the error of the emulator without its patch, and its absence with it. A check that fails without the patch says
// that the emulator was mended: then the patch goes.
//
//   node --test

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { RP2040 } from 'rp2040js';
import { PATCHES } from './patches.mjs';

const ADC = 0x4004c000;
const SYSCFG = 0x40004000;
const RAM = 0x20000000;

/** A chip, with the named patch or with none. */
function chip(patch) {
  const mcu = new RP2040();
  const quiet = () => {};
  mcu.logger = { debug: quiet, info: quiet, warn: quiet, error: quiet };
  if (patch) PATCHES[patch].apply(mcu);
  return mcu;
}

/** The channels that a free-running round robin over 0, 1, 2 and 4 converts. */
function roundRobin(mcu) {
  const read = [];
  for (let channel = 0; channel < 5; channel++) {
    Object.defineProperty(mcu.adc.channelValues, channel, { get: () => (read.push(channel), 0) });
  }
  mcu.writeUint32(ADC + 0x10, 2999 << 8);
  mcu.writeUint32(ADC, (0b10111 << 16) | 1);
  mcu.writeUint32(ADC, (0b10111 << 16) | (1 << 3) | 1);
  // Nine conversions, 62.5 us each.
  for (let i = 0; i < 9; i++) mcu.clock.tick(62_500);
  return read.slice(0, 8);
}

/** Whether an interrupt that is routed to the non-maskable one is pending as that. */
function nonMaskable(mcu) {
  mcu.writeUint32(SYSCFG, 1 << 13);
  mcu.core.setInterrupt(13, true);
  return mcu.core.pendingNMI;
}

/** Whether WFE returns at once after SEV. */
function sendEvent(mcu) {
  mcu.writeUint16(RAM, 0xbf40);
  mcu.writeUint16(RAM + 2, 0xbf20);
  mcu.core.PC = RAM;
  mcu.core.eventRegistered = false;
  mcu.core.executeInstruction();
  mcu.core.executeInstruction();
  return !mcu.core.waiting;
}

/** Whether a buffer for the host is available until the host has had the time to take it, and then not; and whether two buffers take turns. */
function usbBuffers(mcu) {
  const [CONTROL, SECOND_ENDPOINT_IN, SECOND_ENDPOINT_CONTROL] = [0x50100080, 0x50100010, 0x50100090];
  const [STATUS, SHOULD_HANDLE] = [0x50110058, 0x5011005c];
  const [AVAILABLE, DOUBLE, BIT] = [1 << 10, 1 << 30, 1 << 4];
  mcu.writeUint32(CONTROL, AVAILABLE | (1 << 15) | 5);
  const before = mcu.readUint32(CONTROL) & AVAILABLE;
  mcu.clock.tick(60_000);
  if (before === 0 || mcu.readUint32(CONTROL) & AVAILABLE) return false;
  // The second buffer waits until the program has seen the status of the first one.
  mcu.writeUint32(SECOND_ENDPOINT_IN, DOUBLE | 0x180);
  mcu.writeUint32(SECOND_ENDPOINT_CONTROL, ((AVAILABLE | (1 << 15) | 5) * 0x10001) >>> 0);
  const seen = [];
  for (let n = 0; n < 2; n++) {
    mcu.clock.tick(200_000);
    seen.push(mcu.readUint32(STATUS) & BIT, mcu.readUint32(SHOULD_HANDLE) & BIT);
    mcu.writeUint32(STATUS, BIT);
  }
  return seen.join() === [BIT, 0, BIT, BIT].join();
}

const RESETS = 0x4000c000;
const ALL_BLOCKS = 0x1ffffff;
/** A register of each block that a program can change, a value for it, and its value after a reset; by the block's bit in RESETS. */
const BLOCKS = {
  0: [ADC + 0x10, 2999 << 8, 0],
  2: [0x50000000, 0x20000000, 0],
  5: [0x40014000 + 8 * 6 + 4, 5, 0x1f],
  8: [0x4001c000 + 4 + 4 * 6, 0x52, 0x56],
  12: [0x40028008, 125, 0],
  14: [0x40050000 + 0xc, 0x12345, 0],
  18: [SYSCFG, 1 << 13, 0],
  21: [0x40054038, 1, 0],
  22: [0x40034024, 7, 0],
  24: [0x50110090, 1, 0],
};

/** Whether blocks begin in reset, keep nothing through one, and are held in it until its bit is cleared; the microseconds begin again. */
function resets(mcu) {
  const done = () => mcu.readUint32(RESETS + 8);
  const set = (word) => mcu.writeUint32(RESETS, word);
  if (mcu.readUint32(RESETS) !== ALL_BLOCKS || done() !== 0) return false;
  set(0);
  if (done() !== ALL_BLOCKS) return false;
  return Object.entries(BLOCKS).every(([bit, [register, value, atReset]]) => {
    mcu.clock.tick(5_000);
    mcu.writeUint32(register, value);
    const written = mcu.readUint32(register);
    set(1 << bit);
    mcu.writeUint32(register, value);
    const held = mcu.readUint32(register);
    const doneMeanwhile = done();
    set(0);
    const microseconds = bit === '21' ? mcu.readUint32(0x40054028) : 0;
    const found = mcu.readUint32(register);
    const ok = [written, held, doneMeanwhile, found, microseconds].join() === [value, 0, ALL_BLOCKS & ~(1 << bit), atReset, 0].join();
    if (!ok) console.log(`block ${bit}:`, written, held, doneMeanwhile, found, microseconds);
    return ok;
  });
}

/** Whether pads are as after a reset: input on, pull-down, 4 mA; those of the flash as their register's description says. */
function pads(mcu) {
  const read = (base, n) => mcu.readUint32(base + 4 + 4 * n);
  const qspi = [0, 1, 2, 3, 4, 5].map((n) => read(0x40020000, n));
  return Array.from({ length: 30 }, (_, n) => read(0x4001c000, n)).every((pad) => pad === 0x56) && qspi.join() === [0x56, 0x5a, 0x52, 0x52, 0x52, 0x52].join();
}

/** Whether a boot reads a power-on, and a detector that is on. */
const chipReset = (mcu) => mcu.readUint32(0x40064008) === 1 << 8 && (mcu.readUint32(0x40064004) & 1) === 1;

/** Whether the flash chip answers: a page that was erased and programmed, read over the serial bus. */
function serialFlash(mcu) {
  const SSI = 0x18000000;
  const [CTRLR0, SSIENR, RXFLR, SR, DR0] = [0x00, 0x08, 0x24, 0x28, 0x60];
  mcu.writeUint32(SSI + CTRLR0, 7 << 16);
  mcu.writeUint32(SSI + SSIENR, 1);
  const send = (...bytes) => {
    bytes.forEach((byte) => mcu.writeUint32(SSI + DR0, byte));
    mcu.readUint32(SSI + SR);
    const received = [];
    for (let left = mcu.readUint32(SSI + RXFLR); left > 0; left--) received.push(mcu.readUint32(SSI + DR0));
    return received;
  };
  mcu.flash.fill(0, 0, 8192);
  // Without the permission to write nothing changes.
  send(0x20, 0, 0x10, 0);
  const untouched = send(0x03, 0, 0x10, 1, 0)[4];
  send(0x06);
  send(0x20, 0, 0x10, 0);
  send(0x06);
  send(0x02, 0, 0x10, 0, 0x5a, 0xa5);
  return [untouched, ...send(0x03, 0, 0x10, 0, 0, 0, 0).slice(4), mcu.flash[4095]].join() === [0, 0x5a, 0xa5, 0xff, 0].join();
}

/** Whether the pins of the flash have functions, and BOOTSEL is not pressed. */
function flashPins(mcu) {
  const CONTROL = 0x4001800c;
  mcu.writeUint32(CONTROL, 2 << 8);
  mcu.qspi[1].padValue = 0x5a;
  return mcu.readUint32(CONTROL) === 2 << 8 && (mcu.readUint32(0xd0000008) & 0b10) !== 0;
}

/** Whether a flush of the cache ends, and its memory keeps bytes. */
function windowControl(mcu) {
  mcu.writeUint32(0x14000004, 1);
  mcu.writeUint32(0x15001004, 0x11223344);
  mcu.writeUint8(0x15001005, 0xaa);
  return (mcu.readUint32(0x14000008) & 0b10) !== 0 && mcu.readUint32(0x15001004) === 0x1122aa44;
}

const CHECKS = {
  adcRoundRobin: (mcu) => roundRobin(mcu).join() === '0,1,2,4,0,1,2,4',
  nonMaskableInterrupt: nonMaskable,
  usbBuffers,
  sendEvent,
  serialFlash,
  flashPins,
  windowControl,
  resets,
  pads,
  chipReset,
  startClock: (mcu) => mcu.clkSys === 6_500_000,
};

test('every patch has a check', () => assert.deepEqual(Object.keys(CHECKS), Object.keys(PATCHES)));
for (const [name, check] of Object.entries(CHECKS)) {
  test(`${name}: the emulator is wrong without the patch`, () => assert.equal(check(chip()), false, `mended upstream; remove it: ${PATCHES[name].wrong}`));
  test(`${name}: right with the patch`, () => assert.equal(check(chip(name)), true));
}
