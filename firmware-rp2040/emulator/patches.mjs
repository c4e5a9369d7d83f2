// Mends, by name, what rp2040js 1.4.1 does otherwise than the chip and this program needs. Each patch has a check in patches.test.mjs that fails
// when the emulator itself is mended: then the patch goes.

import { BasePeripheral } from 'rp2040js';
import { flashPins, serialFlash, windowControl } from './flash.mjs';

/** The patches: what is wrong without each, and what mends it in one chip. */
export const PATCHES = {
  adcRoundRobin: {
    wrong: 'round robin: the setter of the channel masks with a shift count, so that channel 0 is always read, and after channel 4 channel 0 is left out',
    apply(mcu) {
      const { get } = Object.getOwnPropertyDescriptor(Object.getPrototypeOf(mcu.adc), 'activeChannel');
      // Only the round robin sets it: the next channel of the mask, whatever was computed.
      Object.defineProperty(mcu.adc, 'activeChannel', {
        get,
        set() {
          const mask = (this.cs >> 16) & 0x1f;
          let next = this.activeChannel;
          do next = (next + 1) % this.numChannels;
          while (!(mask & (1 << next)));
          this.cs = (this.cs & ~(0x7 << 12)) | (next << 12);
        },
      });
    },
  },
  nonMaskableInterrupt: {
    wrong: 'SYSCFG.PROC0_NMI_MASK is kept and has no effect (RP2040 datasheet, 2.3.3)',
    apply(mcu) {
      const { core } = mcu;
      const setInterrupt = core.setInterrupt;
      core.setInterrupt = function (irq, value) {
        if (this.interruptNMIMask & (1 << irq)) {
          if (value && !this.nmiLine) {
            this.pendingNMI = true;
            this.interruptsUpdated = true;
            this.waiting = false;
          }
          this.nmiLine = value;
        }
        return setInterrupt.call(this, irq, value);
      };
    },
  },
  usbBuffers: {
    wrong:
      'USB: a buffer counts as taken or filled when the program makes it available, not when the host takes or fills it (RP2040 datasheet, 4.1.2.5), ' +
      'and the second of two buffers is used with the first',
    apply(mcu) {
      const [AVAILABLE, SELECT_FIRST, FULL, LENGTH] = [1 << 10, 1 << 12, 1 << 15, 0x3ff];
      const [FIRST, LAST] = [0x80, 0xfc];
      const DOUBLE = 1 << 30;
      const [BUFF_STATUS, CPU_SHOULD_HANDLE] = [0x58, 0x5c];
      // A packet of 64 bytes with its frame at 12 Mbit/s, and the time after which a host that does not read asks again.
      const [PACKET_NS, AGAIN_NS] = [51_000, 1_000_000];
      const { usbCtrl: usb, usbDPRAMView: view } = mcu;
      let second = 0;
      /** One direction of an endpoint: its one or two buffers, which take turns. */
      class Line {
        constructor(number) {
          this.endpoint = number >> 1;
          this.isOut = (number & 1) === 1;
          this.bit = 1 << number;
          this.control = FIRST + 4 * number;
          this.next = 0;
          this.offered = false;
          this.alarm = mcu.clock.createAlarm(() => this.take());
        }
        get isDouble() {
          return this.endpoint !== 0 && (usb.readEndpointControlReg(this.endpoint, this.isOut) & DOUBLE) !== 0;
        }
        get half() {
          return view.getUint16(this.control + 2 * this.next, true);
        }
        set half(value) {
          view.setUint16(this.control + 2 * this.next, value, true);
        }
        get buffer() {
          return usb.getEndpointBufferOffset(this.endpoint, this.isOut) + 64 * this.next;
        }
        /** Offers the next buffer to the host, if it is available. */
        offer() {
          const first = view.getUint16(this.control, true);
          if (first & SELECT_FIRST) {
            view.setUint16(this.control, first & ~SELECT_FIRST, true);
            [this.next, this.offered] = [0, false];
          }
          if (!(this.half & AVAILABLE)) this.offered = false;
          // The status of a buffer is kept until the program has seen it.
          else if (!this.offered && !(this.isDouble && usb.buffStatus & this.bit)) {
            this.offered = true;
            if (this.isOut) usb.onEndpointRead?.(this.endpoint, this.half & LENGTH);
            else this.alarm.schedule(PACKET_NS);
          }
        }
        done() {
          second = this.next === 1 ? second | this.bit : second & ~this.bit;
          this.offered = false;
          if (this.isDouble) this.next ^= 1;
          usb.indicateBufferReady(this.endpoint, this.isOut);
        }
        take() {
          const value = this.half;
          if (!(value & AVAILABLE)) return;
          if (usb.hostReads && !usb.hostReads(this.endpoint)) return this.alarm.schedule(AGAIN_NS);
          const bytes = mcu.usbDPRAM.slice(this.buffer, this.buffer + (value & LENGTH));
          this.half = value & ~(AVAILABLE | FULL);
          this.done();
          usb.onEndpointWrite?.(this.endpoint, bytes);
        }
        fill(bytes) {
          const value = this.half;
          if (!(value & AVAILABLE)) return;
          const length = Math.min(bytes.length, value & LENGTH);
          mcu.usbDPRAM.set(bytes.subarray(0, length), this.buffer);
          this.half = (value & ~(AVAILABLE | LENGTH)) | FULL | length;
          this.done();
        }
      }
      const lines = Array.from({ length: (LAST - FIRST) / 4 + 1 }, (_, number) => new Line(number));
      usb.DPRAMUpdated = (offset) => {
        if (offset >= FIRST && offset <= LAST) lines[(offset - FIRST) >> 2].offer();
      };
      usb.finishRead = (endpoint, bytes) => lines[2 * endpoint + 1].fill(bytes);
      const { readUint32, writeUint32 } = usb;
      usb.readUint32 = (offset) => (offset === CPU_SHOULD_HANDLE ? second >>> 0 : readUint32.call(usb, offset));
      usb.writeUint32 = (offset, value) => {
        writeUint32.call(usb, offset, value);
        if (offset === BUFF_STATUS) for (const line of lines) if (line.isDouble) line.offer();
      };
    },
  },
  sendEvent: {
    wrong: 'SEV sets no event: a wake-up that is made between a check and WFE is lost',
    apply(mcu) {
      const { core } = mcu;
      const executeInstruction = core.executeInstruction;
      const SEV = 0b1011111101000000;
      core.executeInstruction = function () {
        const isSev = this.readUint16(this.PC & ~1) === SEV;
        const cycles = executeInstruction.call(this);
        if (isSev) this.eventRegistered = true;
        return cycles;
      };
    },
  },
  serialFlash: { wrong: 'the SSI has no flash chip: each byte of an answer is that of the status (RP2040 datasheet, 4.10)', apply: serialFlash },
  flashPins: { wrong: 'IO_QSPI is missing: the boot ROM cannot select the flash chip, and BOOTSEL reads as pressed', apply: flashPins },
  windowControl: { wrong: 'XIP_CTRL is missing: the flush of the cache is an access to nothing (RP2040 datasheet, 2.6.3)', apply: windowControl },
  resets: {
    wrong: 'RESETS keeps its word and does nothing: no block is in reset after power-on, none loses its registers (RP2040 datasheet, 2.14)',
    apply(mcu) {
      const resets = mcu.peripherals[0x4000c];
      const blocks = blocksOf(mcu);
      const stateAtReset = blocks.map(({ parts }) => remember(parts, mcu));
      const read = resets.readUint32;
      const write = resets.writeUint32;
      const [RESET, RESET_DONE] = [0x0, 0x8];
      /** Puts blocks into reset and takes others out of it, each by its bit. */
      const set = (word) => {
        const changed = word ^ resets.reset;
        blocks.forEach(({ name, addresses, parts, changed: then }, bit) => {
          if (!(changed & (1 << bit))) return;
          if (word & (1 << bit)) {
            stateAtReset[bit]();
            then?.();
            for (const address of addresses) mcu.peripherals[address] = new Held(mcu, name);
          } else {
            addresses.forEach((address, n) => (mcu.peripherals[address] = parts[n]));
            then?.();
          }
        });
        resets.reset = word;
      };
      resets.readUint32 = (offset) => (offset === RESET_DONE ? ~resets.reset & ALL_BLOCKS : read.call(resets, offset));
      resets.writeUint32 = (offset, value) => (offset === RESET ? set(value & ALL_BLOCKS) : write.call(resets, offset, value));
      set(ALL_BLOCKS);
    },
  },
  pads: {
    wrong: 'a pad starts with 0x36: without its input, and with another drive strength than the chip (RP2040 datasheet, 2.19.6.3 and 2.19.6.4)',
    apply(mcu) {
      for (const pin of mcu.gpio) pin.padValue = PAD;
      mcu.qspi.forEach((pin, n) => (pin.padValue = QSPI_PADS[n]));
    },
  },
  chipReset: {
    wrong: 'VREG_AND_CHIP_RESET is missing: a boot reads ones (RP2040 datasheet, 2.10.6 and 2.12.8)',
    apply(mcu) {
      const [VREG, BOD, CHIP_RESET] = [0x0, 0x4, 0x8];
      const [REGULATED, POWER_ON] = [1 << 12, 1 << 8];
      const words = { [VREG]: 0xb1, [BOD]: 0x91, [CHIP_RESET]: POWER_ON };
      const block = new BasePeripheral(mcu, 'VREG_AND_CHIP_RESET');
      block.readUint32 = (offset) => (offset === VREG ? words[VREG] | REGULATED : words[offset]);
      // The flags of CHIP_RESET can only be read, but for that of a debugger's restart, which does not come.
      block.writeUint32 = (offset, value) => offset !== CHIP_RESET && (words[offset] = value);
      mcu.peripherals[0x40064] = block;
    },
  },
  startClock: {
    wrong: 'the core begins at 125 MHz, and not with the ring oscillator (RP2040 datasheet, 2.15.1)',
    apply: (mcu) => mcu.updateClocks(),
  },
};

/** Bits of RESETS. */
const ALL_BLOCKS = 0x01ffffff;
/** A pad after its reset: input on, hysteresis, 4 mA, pull-down. */
const PAD = 0x56;
/** The same of the flash's: SCLK, SS, SD0 to SD3. */
const QSPI_PADS = [0x56, 0x5a, 0x52, 0x52, 0x52, 0x52];

/** What a program meets at the registers of a block that is held in reset. The boot ROM knows what it does. */
class Held extends BasePeripheral {
  readUint32(offset) {
    this.says(`read from 0x${offset.toString(16)}`);
    return 0;
  }
  writeUint32Atomic(offset) {
    this.says(`write to 0x${offset.toString(16)}`);
  }
  says(what) {
    const { bootrom, core } = this.rp2040;
    if (core.PC >= bootrom.byteLength) this.error(`${what} while the block is in reset`);
  }
}

/** The blocks of RESETS by their bits: registers, what has the state, and what follows from a reset and from its end. */
function blocksOf(mcu) {
  const block = (name, addresses, changed) => ({ name, addresses, changed, parts: addresses.map((address) => mcu.peripherals[address]) });
  const pins = (list) => list.forEach((pin) => (pin.checkForUpdates(), pin.refreshInput()));
  const timer = mcu.peripherals[0x40054];
  // The microseconds count from the end of the reset.
  let begun = 0;
  timer.clock = Object.create(mcu.clock, { nanos: { get: () => mcu.clock.nanos - begun } });
  const ioBank0 = () => {
    for (const pin of mcu.gpio) Object.assign(pin, { ctrl: 0x1f, irqEnableMask: 0, irqForceMask: 0, irqStatus: 0 });
    pins(mcu.gpio);
    mcu.updateIOInterrupt();
  };
  const padsBank0 = () => {
    for (const pin of mcu.gpio) pin.padValue = PAD;
    pins(mcu.gpio);
  };
  const onlyAtReset = (name, address, act) => block(name, [address], () => mcu.peripherals[address] instanceof Held || act());
  return [
    block('ADC', [0x4004c]),
    block('BUSCTRL', [0x40030]),
    block('DMA', [0x50000]),
    block('I2C0', [0x40044]),
    block('I2C1', [0x40048]),
    onlyAtReset('IO_BANK0', 0x40014, ioBank0),
    onlyAtReset('IO_QSPI', 0x40018, () => mcu.qspi.forEach((pin) => (pin.ctrl = 0x1f))),
    block('JTAG', []),
    onlyAtReset('PADS_BANK0', 0x4001c, padsBank0),
    onlyAtReset('PADS_QSPI', 0x40020, () => mcu.qspi.forEach((pin, n) => (pin.padValue = QSPI_PADS[n]))),
    block('PIO0', [0x50200]),
    block('PIO1', [0x50300]),
    block('PLL_SYS', [0x40028], () => mcu.updateClocks()),
    block('PLL_USB', [0x4002c], () => mcu.updateClocks()),
    block('PWM', [0x40050], () => mcu.gpio.forEach((pin) => pin.checkForUpdates())),
    block('RTC', [0x4005c]),
    block('SPI0', [0x4003c]),
    block('SPI1', [0x40040]),
    block('SYSCFG', [0x40004], () => (mcu.core.interruptNMIMask = 0)),
    // Constants: the ROM reads both in reset.
    block('SYSINFO', []),
    block('TBMAN', []),
    block('TIMER', [0x40054], () => (begun = mcu.clock.nanos)),
    block('UART0', [0x40034]),
    block('UART1', [0x40038]),
    block('USBCTRL', [0x50110]),
  ];
}

/** What no reset changes: the clock of a counter, and the voltages at the converter. */
const KEPT = new Set(['baseFreq', 'channelValues']);

/** Remembers the state of objects with all that they are made of, and returns what puts it back: alarms do not ring any more. */
export function remember(parts, mcu) {
  const seen = new Set([mcu, mcu.clock, mcu.core, mcu.logger].filter((object) => !parts.includes(object)));
  const steps = [];
  const visit = (object) => {
    if (seen.has(object)) return;
    seen.add(object);
    if (ArrayBuffer.isView(object)) {
      const copy = object.slice();
      steps.push(() => object.set(copy));
      return;
    }
    if (typeof object.cancel === 'function' && 'scheduled' in object) {
      steps.push(() => object.cancel());
      return;
    }
    if (Array.isArray(object)) {
      const { length } = object;
      steps.push(() => (object.length = length));
    }
    for (const [key, value] of Object.entries(object)) {
      if (KEPT.has(key) || typeof value === 'function') continue;
      if (value !== null && typeof value === 'object') visit(value);
      else steps.push(() => (object[key] = value));
    }
  };
  parts.forEach(visit);
  return () => {
    steps.forEach((step) => step());
    for (const part of parts) part.checkInterrupts?.();
  };
}

/** Applies every patch to a chip. */
export function patch(mcu) {
  for (const { apply } of Object.values(PATCHES)) apply(mcu);
}
