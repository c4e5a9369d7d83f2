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
