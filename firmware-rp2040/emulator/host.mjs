// The host at the USB: rp2040js's enumerates the board as a CDC-ACM device; here are what a program does with its port, and what a host may do wrong.

import { DataDirection, SetupRecipient, SetupType, USBCDC, createSetupPacket } from 'rp2040js';

const SET_CONTROL_LINE_STATE = 0x22;
const DTR_AND_RTS = 0b11;

export class Host {
  constructor() {
    /** Bytes of the board. */
    this.received = [];
    /** How often the board was enumerated. */
    this.connections = 0;
    /** What a program wants of the port: open, and read. */
    this.isOpen = false;
    this.reads = true;
    this.toSend = [];
  }

  /** Plugs the board in; also after its reset. */
  attach(mcu) {
    this.usb = mcu.usbCtrl;
    this.room = null;
    this.enumerate();
  }

  /** Unplugs the board and plugs it in again: the host resets the bus and enumerates. */
  replug() {
    this.isOpen = false;
    this.enumerate();
    this.usb.resetDevice();
  }

  enumerate() {
    const { usb } = this;
    const cdc = new USBCDC(usb);
    // rp2040js asks the device, where the request belongs to the interface (CDC PSTN 1.2, 6.3.12): no program has opened the port yet.
    cdc.cdcSetControlLineState = () => (cdc.initialized = true);
    cdc.onDeviceConnected = () => {
      this.connections += 1;
      if (this.isOpen) this.setLines(DTR_AND_RTS);
    };
    cdc.onSerialData = (bytes) => this.received.push(...bytes);
    usb.hostReads = (endpoint) => endpoint === 0 || this.reads;
    usb.onEndpointRead = (endpoint, size) => {
      if (endpoint === 0) return usb.endpointReadDone(0, new Uint8Array());
      this.room = { endpoint, size };
      this.feed();
    };
  }

  /** What a program does: `open`, `close`, `hold` (stop reading), `read` (read again), `replug`, or `send` these bytes. */
  do(action, bytes) {
    if (action === 'open' || action === 'close') {
      this.isOpen = action === 'open';
      this.setLines(this.isOpen ? DTR_AND_RTS : 0);
    } else if (action === 'hold' || action === 'read') this.reads = action === 'read';
    else if (action === 'replug') this.replug();
    else if (action === 'send') {
      this.toSend.push(...bytes);
      this.feed();
    } else throw new Error(`the host does not know how to ${action}`);
  }

  /** A host sends while it has something and the board has room. */
  feed() {
    if (this.room === null || this.toSend.length === 0) return;
    const { endpoint, size } = this.room;
    this.room = null;
    this.usb.endpointReadDone(endpoint, Uint8Array.from(this.toSend.splice(0, size)));
  }

  setLines(wValue) {
    const [dataDirection, type, recipient] = [DataDirection.HostToDevice, SetupType.Class, SetupRecipient.Interface];
    this.usb.sendSetupPacket(
      createSetupPacket({ dataDirection, type, recipient, bRequest: SET_CONTROL_LINE_STATE, wValue, wIndex: 0, wLength: 0 }),
    );
  }
}
