// Mends, by name, what rp2040js 1.4.1 does otherwise than the chip and this program needs. Each patch has a check in patches.test.mjs that fails
// when the emulator itself is mended: then the patch goes.

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
    wrong: 'USB: a buffer counts as taken or filled when the program makes it available, not when the host takes or fills it (RP2040 datasheet, 4.1.2.5)',
    apply(mcu) {
      const AVAILABLE = 1 << 10;
      const FULL = 1 << 15;
      const LENGTH = 0x3ff;
      const [FIRST, LAST] = [0x80, 0xfc];
      // A packet of 64 bytes with its frame at 12 Mbit/s, and the time after which a host that does not read asks again.
      const [PACKET_NS, AGAIN_NS] = [51_000, 1_000_000];
      const { usbCtrl: usb, usbDPRAMView: view } = mcu;
      const control = (offset) => view.getUint32(offset, true);
      const clear = (offset, bits) => view.setUint32(offset, control(offset) & ~bits, true);
      const take = Array.from({ length: 16 }, (_, endpoint) => {
        const offset = FIRST + 8 * endpoint;
        const alarm = mcu.clock.createAlarm(() => {
          const value = control(offset);
          if (!(value & AVAILABLE)) return;
          if (usb.hostReads && !usb.hostReads(endpoint)) return alarm.schedule(AGAIN_NS);
          const at = usb.getEndpointBufferOffset(endpoint, false);
          const bytes = mcu.usbDPRAM.slice(at, at + (value & LENGTH));
          clear(offset, AVAILABLE | FULL);
          usb.indicateBufferReady(endpoint, false);
          usb.onEndpointWrite?.(endpoint, bytes);
        });
        return alarm;
      });
      usb.DPRAMUpdated = (offset, value) => {
        if (!(value & AVAILABLE) || offset < FIRST || offset > LAST) return;
        const endpoint = (offset - FIRST) >> 3;
        if (offset & 4) usb.onEndpointRead?.(endpoint, value & LENGTH);
        else take[endpoint].schedule(PACKET_NS);
      };
      const { finishRead } = usb;
      usb.finishRead = (endpoint, bytes) => {
        clear(FIRST + 4 + 8 * endpoint, AVAILABLE);
        finishRead.call(usb, endpoint, bytes);
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
};

/** Applies every patch to a chip. */
export function patch(mcu) {
  for (const { apply } of Object.values(PATCHES)) apply(mcu);
}
