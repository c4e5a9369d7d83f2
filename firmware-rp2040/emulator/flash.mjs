// The flash chip on its serial bus, as the boot ROM and the second boot stage speak to it: the controller (SSI), the pins' overrides, by which the ROM
// selects the chip, and the chip's commands. Reads of the processor go past all of this to `mcu.flash`.

import { BasePeripheral } from 'rp2040js';

const PAGE = 256;
const SECTOR = 4096;

/** A W25Q16JV, as far as it is used: commands of one byte, bits on one line. An erasure and a page take no time. */
export class FlashChip {
  constructor(bytes) {
    this.bytes = bytes;
    this.status = [0, 0x02];
    this.deselect();
    this.mayWrite = false;
    /** First addresses of the sectors that were erased, in order. */
    this.erased = [];
  }

  /** The chip's select line rises: a command that erases or programs takes effect. */
  deselect() {
    const { command, received = [], address } = this;
    if (this.mayWrite && [0x20, 0x02, 0x01, 0x31].includes(command)) {
      if (command === 0x20 && received.length === 3) {
        const sector = address & ~(SECTOR - 1);
        this.bytes.fill(0xff, sector, sector + SECTOR);
        this.erased.push(sector);
      } else if (command === 0x02) {
        // A bit becomes 0 and never 1; beyond the end of the page it goes on at the page's start.
        received.slice(3).forEach((byte, n) => {
          this.bytes[(address & ~(PAGE - 1)) | ((address + n) & (PAGE - 1))] &= byte;
        });
      } else if (command === 0x01) received.forEach((byte, n) => (this.status[n] = byte & ~0b11));
      else if (command === 0x31) this.status[1] = received[0];
      this.mayWrite = false;
    }
    this.command = undefined;
    this.received = [];
    this.address = 0;
  }

  /** A byte to the chip, and the byte that comes back meanwhile. */
  exchange(byte) {
    if (this.command === undefined) {
      this.command = byte;
      if (byte === 0x06) this.mayWrite = true;
      if (byte === 0x04) this.mayWrite = false;
      return 0xff;
    }
    const place = this.received.push(byte) - 1;
    if (place < 3) this.address = ((this.address << 8) | byte) & 0xffffff;
    switch (this.command) {
      case 0x03:
        return place < 3 ? 0xff : this.bytes[(this.address + place - 3) % this.bytes.length];
      case 0x05:
        return this.status[0] | (this.mayWrite ? 0b10 : 0);
      case 0x35:
        return this.status[1];
      default:
        return 0xff;
    }
  }
}

/** The controller: standard frames of 8 bits go to the chip, each brings a byte into the queue. Others are reads of the processor's window. */
export function serialFlash(mcu) {
  const ssi = mcu.peripherals[0x18000];
  const { readUint32, writeUint32 } = ssi;
  const [CTRLR0, SSIENR, SER, TXFLR, RXFLR, SR, ICR, DR0] = [0x00, 0x08, 0x10, 0x20, 0x24, 0x28, 0x48, 0x60];
  const [FRAME_BITS, FRAME_FORMAT] = [0x1f << 16, 0b11 << 21];
  const [NOT_FULL, EMPTY, RECEIVED] = [1 << 1, 1 << 2, 1 << 3];
  const chip = new FlashChip(mcu.flash);
  let queue = [];
  let control = 0;
  // Selected by the override of the pin, or by the controller while a transfer is under way.
  let forced = null;
  mcu.flashChip = chip;
  mcu.selectFlash = (low) => {
    if (forced === true && low !== true) chip.deselect();
    forced = low;
  };
  const ended = () => forced === null && chip.deselect();
  ssi.readUint32 = (offset) => {
    switch (offset) {
      case TXFLR:
      case ICR:
        return 0;
      case RXFLR:
        return queue.length;
      case SR:
        ended();
        return NOT_FULL | EMPTY | (queue.length > 0 ? RECEIVED : 0);
      case DR0:
        return queue.shift() ?? 0;
      case SER:
        return 1;
      default:
        return readUint32.call(ssi, offset);
    }
  };
  ssi.writeUint32 = (offset, value) => {
    if (offset === SER) return;
    if (offset === CTRLR0) control = value;
    if (offset === SSIENR && !(value & 1)) {
      ended();
      queue = [];
    }
    if (offset !== DR0) return writeUint32.call(ssi, offset, value);
    const isStandard = (control & FRAME_FORMAT) === 0 && (control & FRAME_BITS) === 7 << 16;
    // High, the chip does not listen; the controller receives what the pulled line has.
    queue.push(isStandard && forced !== false ? chip.exchange(value & 0xff) : 0xff);
  };
}

/** The pins of the flash: functions and overrides; the override of the select line selects the chip. */
export function flashPins(mcu) {
  const [SELECT, LOW, HIGH] = [1, 2, 3];
  const block = new BasePeripheral(mcu, 'IO_QSPI');
  const pin = (offset) => (offset < 8 * mcu.qspi.length ? mcu.qspi[offset >> 3] : undefined);
  block.readUint32 = (offset) => (offset & 4 ? pin(offset)?.ctrl : pin(offset)?.status) ?? 0;
  block.writeUint32 = (offset, value) => {
    if (!(offset & 4) || pin(offset) === undefined) return;
    pin(offset).ctrl = value;
    if (offset >> 3 !== SELECT) return;
    const override = (value >> 8) & 0b11;
    mcu.selectFlash?.(override === LOW ? true : override === HIGH ? false : null);
  };
  mcu.peripherals[0x40018] = block;
  // Pulled up, as on the board; the button BOOTSEL pulls it down.
  mcu.qspi[SELECT].rawInputValue = true;
}

/** The control of the window and its cache: a flush has always ended, nothing is cached. The memory of the cache is there, the ROM counts in it. */
export function windowControl(mcu) {
  const [CTRL, FLUSH, STAT] = [0x00, 0x04, 0x08];
  const words = { [CTRL]: 0b11 };
  const block = new BasePeripheral(mcu, 'XIP_CTRL');
  block.readUint32 = (offset) => (offset === STAT ? 0b110 : offset === FLUSH ? 0 : (words[offset] ?? 0));
  block.writeUint32 = (offset, value) => offset !== FLUSH && (words[offset] = value);
  mcu.peripherals[0x14000] = block;
  const [CACHE, CACHE_BYTES] = [0x15000000, 16 * 1024];
  const memory = new DataView(new ArrayBuffer(CACHE_BYTES));
  const cache = new BasePeripheral(mcu, 'XIP_SRAM');
  cache.readUint32 = (offset) => memory.getUint32(offset, true);
  for (const [access, put] of [
    ['writeUint32', 'setUint32'],
    ['writeUint16', 'setUint16'],
    ['writeUint8', 'setUint8'],
  ]) {
    const write = mcu[access];
    mcu[access] = function (address, value) {
      const at = (address >>> 0) - CACHE;
      if (at >= 0 && at < CACHE_BYTES) memory[put](at, value, true);
      else write.call(this, address, value);
    };
  }
  mcu.peripherals[0x15000] = cache;
}
