// A computer at the USB of the boot ROM, as far as copying a file to the drive RPI-RP2 needs one: bulk-only transport with SCSI commands, and FAT16.

import { DescriptorType, getDescriptorPacket, setDeviceAddressPacket, setDeviceConfigurationPacket } from 'rp2040js';

const [IN, OUT] = [1, 2];
const SECTOR = 512;
const [SIGNATURE, STATUS_SIGNATURE] = [0x43425355, 0x53425355];
const [READ_CAPACITY, READ, WRITE] = [0x25, 0x28, 0x2a];
/** A reset of the bus by rp2040js. */
const RESET_NS = 10e6;
/** Sectors of one command. */
const AT_ONCE = 64;

export class Computer {
  /** What it does with the drive: a generator, `yield*` with the methods below. */
  constructor(work) {
    this.work = work;
    this.ended = false;
    this.toSend = [];
    this.room = [];
  }

  /** Plugs the board in. */
  attach(mcu) {
    const { usbCtrl: usb } = mcu;
    this.usb = usb;
    [this.toSend, this.room] = [[], []];
    usb.hostReads = () => true;
    let resetAt = Infinity;
    usb.onUSBEnabled = () => {
      resetAt = mcu.clock.nanos + RESET_NS;
      usb.resetDevice();
    };
    usb.onResetReceived = () => {
      // The ROM clears the flag of a reset before there was one, too.
      if (this.session !== undefined || mcu.clock.nanos < resetAt) return;
      this.session = this.all();
      this.session.next();
    };
    usb.onEndpointWrite = (endpoint, bytes) => {
      if (endpoint !== this.awaits) return;
      this.awaits = undefined;
      this.ended = this.session.next(bytes).done;
    };
    usb.onEndpointRead = (endpoint, size) => {
      if (endpoint === 0) return usb.endpointReadDone(0, new Uint8Array());
      // The third is that of PICOBOOT, which nobody uses here.
      if (endpoint === OUT) this.room.push(size);
      this.feed();
    };
  }

  *all() {
    yield* this.control(setDeviceAddressPacket(1));
    const configuration = yield* this.control(getDescriptorPacket(DescriptorType.Configration, 64));
    // The first interface: mass storage, SCSI, bulk only.
    const [, , , , , storage, scsi, bulkOnly] = configuration.subarray(9);
    if ([storage, scsi, bulkOnly].join() !== '8,6,80') throw new Error(`no drive: ${configuration}`);
    yield* this.control(setDeviceConfigurationPacket(1));
    yield* this.work(this);
  }

  *control(packet) {
    this.usb.sendSetupPacket(packet);
    return yield* this.from(0);
  }

  /** Waits for a packet of an endpoint. */
  *from(endpoint) {
    this.awaits = endpoint;
    return yield;
  }

  /** Sends in packets of 64 bytes. */
  send(bytes) {
    for (let at = 0; at < bytes.length; at += 64) this.toSend.push(bytes.subarray(at, at + 64));
    this.feed();
  }

  feed() {
    if (this.room.length === 0 || this.toSend.length === 0) return;
    this.room.shift();
    this.usb.endpointReadDone(OUT, this.toSend.shift());
  }

  /** One SCSI command; returns its answer. */
  *command(code, block, count, answer, data) {
    const wrapper = new DataView(new ArrayBuffer(31));
    wrapper.setUint32(0, SIGNATURE, true);
    wrapper.setUint32(8, data?.length ?? answer, true);
    wrapper.setUint8(12, data === undefined ? 0x80 : 0);
    wrapper.setUint8(14, 10);
    wrapper.setUint8(15, code);
    wrapper.setUint32(17, block);
    wrapper.setUint16(22, count);
    this.send(new Uint8Array(wrapper.buffer));
    if (data !== undefined) this.send(data);
    const received = [];
    while (received.length < answer) received.push(...(yield* this.from(IN)));
    const status = new DataView((yield* this.from(IN)).buffer);
    if (status.getUint32(0, true) !== STATUS_SIGNATURE || status.getUint8(12) !== 0) throw new Error(`command ${code} failed`);
    return Uint8Array.from(received);
  }

  *read(sector, count = 1) {
    return yield* this.command(READ, sector, count, count * SECTOR);
  }

  /** The drive: where its parts begin, in sectors, and its files. */
  *mount() {
    const capacity = new DataView((yield* this.command(READ_CAPACITY, 0, 0, 8)).buffer);
    if (capacity.getUint32(4) !== SECTOR) throw new Error('sectors of another size');
    const table = new DataView((yield* this.read(0)).buffer);
    const volume = table.getUint32(446 + 8, true);
    const boot = new DataView((yield* this.read(volume)).buffer);
    const fats = boot.getUint16(14, true) + boot.getUint8(16) * boot.getUint16(22, true);
    const [clusterSectors, entries] = [boot.getUint8(13), boot.getUint16(17, true)];
    const root = volume + fats;
    const data = root + (entries * 32) / SECTOR;
    const cluster = (n) => data + (n - 2) * clusterSectors;
    const directory = yield* this.read(root);
    const files = {};
    for (let at = 0; directory[at] !== 0; at += 32) {
      const name = String.fromCharCode(...directory.subarray(at, at + 11));
      const entry = new DataView(directory.buffer, at, 32);
      if (!(directory[at + 11] & 0x08)) files[name] = { sector: cluster(entry.getUint16(26, true)), size: entry.getUint32(28, true) };
    }
    // What follows the clusters of the files is free.
    return { files, free: cluster(2 + Object.keys(files).length) };
  }

  /** The text of a file of one sector. */
  *text({ sector, size }) {
    return String.fromCharCode(...(yield* this.read(sector)).subarray(0, size));
  }

  /** Writes a file's content into free sectors. Its entry in the directory is left out: the ROM ignores it. */
  *write(first, bytes) {
    for (let at = 0; at < bytes.length; at += AT_ONCE * SECTOR) {
      const piece = bytes.subarray(at, at + AT_ONCE * SECTOR);
      yield* this.command(WRITE, first + at / SECTOR, piece.length / SECTOR, 0, piece);
    }
  }
}
