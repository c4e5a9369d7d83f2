// The chip: rp2040js with its patches and with the boot ROM, which every reset begins in; and what a reset by the watchdog keeps.

import { RP2040 } from 'rp2040js';
import uf2 from 'uf2';
import { patch, remember } from './patches.mjs';
import { ROM } from './rom.mjs';

const { decodeBlock, familyMap } = uf2;

/** First address of the flash, and what the Pico's has. */
export const FLASH = 0x10000000;
export const FLASH_BYTES = 2 << 20;
const RAM = 0x20000000;
/** The select line among the flash's pins, which is BOOTSEL too. */
const SELECT = 1;

/** What a UF2 file writes to flash: [address, bytes]. */
export function pages(uf2) {
  const found = [];
  for (let at = 0; at < uf2.length; at += 512) {
    const block = decodeBlock(uf2.subarray(at, at + 512));
    if (block.blockNumber !== at / 512 || block.totalBlocks !== uf2.length / 512) throw new Error(`block ${at / 512} is numbered otherwise`);
    if (familyMap.get(block.boardFamily) !== 'Raspberry Pi RP2040') throw new Error(`block ${at / 512} is of another family`);
    found.push([block.flashAddress, block.payload]);
  }
  return found;
}

/** A logger that keeps each warning and error once, instead of printing it. */
class Messages {
  constructor() {
    this.seen = new Set();
  }
  debug() {}
  info() {}
  warn(part, message) {
    this.seen.add(`${part}: ${message}`);
  }
  error(part, message) {
    this.seen.add(`${part}: ${message}`);
  }
}

export class Chip {
  /** `parts`: what is in flash, [address, bytes]; `wire(mcu, chip)` connects the pins, also after a reset; `bootsel`: the button is held. */
  constructor(parts, wire, { bootsel = false } = {}) {
    this.wire = wire;
    this.bootsel = bootsel;
    this.messages = new Messages();
    this.resets = [];
    this.rtt = null;
    /** What came of the up channels of RTT: the log for people, the records. */
    this.channels = [[], []];
    this.cycles = 0;
    this.start(new RP2040());
    this.write(parts);
    this.begin();
  }

  /** Puts bytes into flash, past the ROM. */
  write(parts) {
    for (const [address, bytes] of parts) this.mcu.flash.set(bytes, address - FLASH);
  }

  start(mcu) {
    this.mcu = mcu;
    mcu.logger = this.messages;
    mcu.bootrom.set(ROM);
    this.coreAtReset = remember([mcu.core, mcu.ppb], mcu);
    patch(mcu);
    mcu.qspi[SELECT].setInputValue(!this.bootsel);
    const watchdog = mcu.peripherals[0x40058];
    watchdog.onWatchdogTrigger = () => {
      // Without this the alarm fires again for ever within one tick of the clock.
      watchdog.timer.enable = false;
      watchdog.alarm.enable = false;
      this.resetBy = watchdog.reason;
    };
    this.watchdog = watchdog;
    this.wire(mcu, this);
  }

  begin() {
    this.mcu.core.reset();
    this.rtt = null;
  }

  /** What a debugger's reset does, and the core's own by SYSRESETREQ: the core begins again, and nothing else of the chip does. */
  resetCore() {
    const { core } = this.mcu;
    const { interruptNMIMask, pendingInterrupts } = core;
    this.drain();
    this.coreAtReset();
    Object.assign(core, { interruptNMIMask, pendingInterrupts });
    this.begin();
  }

  /** Emulated time since the start, ns. */
  get nanos() {
    return this.mcu.clock.nanos;
  }

  /** The watchdog's reset of all but the two oscillators: RAM, flash, scratch registers and the reason stay. */
  reset() {
    const { sram, flash, clock } = this.mcu;
    const { scratchData, reason } = this.watchdog;
    this.drain();
    this.resetAt = clock.nanos;
    this.resets.push({ s: clock.nanos / 1e9, reason: reason === 1 ? 'timer' : 'force' });
    const next = new RP2040();
    next.clock.tick(clock.nanos);
    this.start(next);
    next.sram.set(sram);
    next.flash.set(flash);
    this.watchdog.scratchData.set(scratchData);
    this.watchdog.reason = reason;
    this.resetBy = undefined;
    this.begin();
  }

  /** Runs until `nanos`. */
  runTo(nanos) {
    while (this.mcu.clock.nanos < nanos) {
      const { mcu } = this;
      const { core, clock } = mcu;
      if (core.waiting) {
        const wait = clock.nanosToNextAlarm;
        clock.tick(wait > 0 ? Math.min(wait, nanos - clock.nanos) : 1000);
      } else {
        const cycles = core.executeInstruction();
        clock.tick((cycles * 1e9) / mcu.clkSys);
      }
      if (this.resetBy !== undefined) this.reset();
    }
  }

  /** Takes what is in the up channels of RTT. */
  drain() {
    const { sram, sramView } = this.mcu;
    if (this.rtt === null) {
      const at = Buffer.from(sram.buffer, sram.byteOffset, sram.length).indexOf('SEGGER RTT\0', 0, 'latin1');
      if (at < 0) return;
      this.rtt = at + 24;
    }
    this.channels.forEach((bytes, channel) => {
      const at = this.rtt + 24 * channel;
      const field = (n) => sramView.getUint32(at + 4 * n, true);
      const [buffer, size, write] = [field(1) - RAM, field(2), field(3)];
      let read = field(4);
      while (read !== write) {
        bytes.push(sram[buffer + read]);
        read = (read + 1) % size;
      }
      sramView.setUint32(at + 16, read, true);
    });
  }
}
