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

/** Whether a buffer for the host is available until the host has had the time to take it, and then not. */
function usbBuffers(mcu) {
  const CONTROL = 0x50100080;
  const AVAILABLE = 1 << 10;
  mcu.writeUint32(CONTROL, AVAILABLE | (1 << 15) | 5);
  const before = mcu.readUint32(CONTROL) & AVAILABLE;
  mcu.clock.tick(60_000);
  return before !== 0 && (mcu.readUint32(CONTROL) & AVAILABLE) === 0;
}

const CHECKS = {
  adcRoundRobin: (mcu) => roundRobin(mcu).join() === '0,1,2,4,0,1,2,4',
  nonMaskableInterrupt: nonMaskable,
  usbBuffers,
  sendEvent,
};

test('every patch has a check', () => assert.deepEqual(Object.keys(CHECKS), Object.keys(PATCHES)));
for (const [name, check] of Object.entries(CHECKS)) {
  test(`${name}: the emulator is wrong without the patch`, () => assert.equal(check(chip()), false, `mended upstream; remove it: ${PATCHES[name].wrong}`));
  test(`${name}: right with the patch`, () => assert.equal(check(chip(name)), true));
}
