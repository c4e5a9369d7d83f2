//! DMA1 and DMA2: streams, transfers, flags (RM0090 chapter 10).
//!
//! A request is served in its own cycle: arbitration, bus cycles and the delay of the FIFO are not modelled. The FIFO has no effect where
//! both sides have one width. Packing between widths, bursts, peripheral flow control and memory to memory are not modelled; selecting
//! one of them makes a lint.

use crate::bus::Width;
use crate::lint::LintKind;

// SxCR.
const EN: u32 = 1;
const TEIE: u32 = 1 << 2;
const HTIE: u32 = 1 << 3;
const TCIE: u32 = 1 << 4;
const PFCTRL: u32 = 1 << 5;
const CIRC: u32 = 1 << 8;
const PINC: u32 = 1 << 9;
const MINC: u32 = 1 << 10;
const PINCOS: u32 = 1 << 15;
const DBM: u32 = 1 << 18;
const CT: u32 = 1 << 19;
// Flags of a stream within its six bits.
const TEIF: u32 = 1 << 3;
const HTIF: u32 = 1 << 4;
const TCIF: u32 = 1 << 5;

/// Bit offset of a stream's six flags in LISR or HISR (10.5.1).
const FLAG_SHIFT: [u32; 4] = [0, 6, 16, 22];

/// Origin of a DMA request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DmaSource {
    /// ADC 0 to 2.
    Adc(usize),
    /// Update of a timer.
    Update(usize),
    /// Compare match of a timer's channel 0 to 3.
    Compare(usize, u8),
    /// A character that USART2 received.
    Received,
    /// A character that USART2 can take.
    ToSend,
}

/// Connections of a request source: controller (0 is DMA1), stream, channel (10.3.3, tables 42 and 43).
#[rustfmt::skip]
pub(crate) const fn connections(source: DmaSource) -> &'static [(usize, usize, u32)] {
    match source {
        DmaSource::Adc(0) => &[(1, 0, 0), (1, 4, 0)],
        DmaSource::Adc(1) => &[(1, 2, 1), (1, 3, 1)],
        DmaSource::Received => &[(0, 5, 4)],
        DmaSource::ToSend => &[(0, 6, 4)],
        DmaSource::Adc(2) => &[(1, 0, 2), (1, 1, 2)],
        DmaSource::Update(1) => &[(1, 5, 6)],
        DmaSource::Update(2) => &[(0, 1, 3), (0, 7, 3)],
        DmaSource::Update(3) => &[(0, 2, 5)],
        DmaSource::Update(4) => &[(0, 6, 2)],
        DmaSource::Update(5) => &[(0, 0, 6), (0, 6, 6)],
        DmaSource::Update(6) => &[(0, 1, 7)],
        DmaSource::Update(7) => &[(0, 2, 1), (0, 4, 1)],
        DmaSource::Update(8) => &[(1, 1, 7)],
        DmaSource::Compare(1, 0) => &[(1, 1, 6), (1, 3, 6), (1, 6, 0)],
        DmaSource::Compare(1, 1) => &[(1, 2, 6), (1, 6, 0)],
        DmaSource::Compare(1, 2) => &[(1, 6, 0), (1, 6, 6)],
        DmaSource::Compare(1, 3) => &[(1, 4, 6)],
        DmaSource::Compare(2, 0) => &[(0, 5, 3)],
        DmaSource::Compare(2, 1) => &[(0, 6, 3)],
        DmaSource::Compare(2, 2) => &[(0, 1, 3)],
        DmaSource::Compare(2, 3) => &[(0, 6, 3), (0, 7, 3)],
        DmaSource::Compare(3, 0) => &[(0, 4, 5)],
        DmaSource::Compare(3, 1) => &[(0, 5, 5)],
        DmaSource::Compare(3, 2) => &[(0, 7, 5)],
        DmaSource::Compare(3, 3) => &[(0, 2, 5)],
        DmaSource::Compare(4, 0) => &[(0, 0, 2)],
        DmaSource::Compare(4, 1) => &[(0, 3, 2)],
        DmaSource::Compare(4, 2) => &[(0, 7, 2)],
        DmaSource::Compare(5, 0) => &[(0, 2, 6)],
        DmaSource::Compare(5, 1) => &[(0, 4, 6)],
        DmaSource::Compare(5, 2) => &[(0, 0, 6)],
        DmaSource::Compare(5, 3) => &[(0, 1, 6), (0, 3, 6)],
        DmaSource::Compare(8, 0) => &[(1, 2, 7), (1, 2, 0)],
        DmaSource::Compare(8, 1) => &[(1, 3, 7), (1, 2, 0)],
        DmaSource::Compare(8, 2) => &[(1, 4, 7), (1, 2, 0)],
        DmaSource::Compare(8, 3) => &[(1, 7, 7)],
        DmaSource::Adc(_) | DmaSource::Update(_) | DmaSource::Compare(..) => &[],
    }
}

/// Interrupt numbers of the streams of both controllers.
pub(crate) const IRQS: [[u8; 8]; 2] = [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];

/// One transfer of a single item: addresses, width, direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DmaTransfer {
    pub(crate) peripheral: u32,
    pub(crate) memory: u32,
    pub(crate) width: Width,
    pub(crate) to_memory: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct DmaStream {
    cr: u32,
    ndtr: u32,
    par: u32,
    memory: [u32; 2],
    fcr: u32,
    flags: u32,
    /// NDTR when the stream was enabled; circular mode reloads it.
    total: u32,
    /// Items transferred since then.
    moved: u32,
    /// The next transfer fails with a bus error.
    fail_next_transfer: bool,
    /// Its requests are not served.
    is_stalled: bool,
    /// The next request is taken without a transfer.
    loses_next_request: bool,
}

/// Registers of one controller.
#[derive(Debug, Clone)]
pub(crate) struct Dma {
    streams: [DmaStream; 8],
    /// Registers of a stream that is on change too: a disturbance.
    is_unprotected: bool,
}

impl Dma {
    pub(crate) fn new() -> Self {
        Dma { streams: [DmaStream { fcr: 0x21, ..DmaStream::default() }; 8], is_unprotected: false }
    }

    /// Takes the write protection of streams that are on away, or restores it; returns how it was.
    pub(crate) fn unprotect(&mut self, unprotected: bool) -> bool {
        std::mem::replace(&mut self.is_unprotected, unprotected)
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 | 0x04 => {
                let first = offset as usize;
                FLAG_SHIFT
                    .iter()
                    .enumerate()
                    .fold(0, |all, (index, shift)| all | self.streams[first + index].flags << shift)
            }
            0x08 | 0x0C => 0,
            0x10..=0xCC => {
                let stream = &self.streams[(offset as usize - 0x10) / 0x18];
                match (offset - 0x10) % 0x18 {
                    0x00 => stream.cr,
                    0x04 => stream.ndtr,
                    0x08 => stream.par,
                    0x0C => stream.memory[0],
                    0x10 => stream.memory[1],
                    _ => stream.fcr,
                }
            }
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, controller: usize, lints: &mut Vec<LintKind>) {
        match offset {
            0x00 | 0x04 => {
                lints.push(LintKind::Misuse("DMA status registers are read only: clear flags in LIFCR, HIFCR"))
            }
            0x08 | 0x0C => {
                for (index, shift) in FLAG_SHIFT.iter().enumerate() {
                    self.streams[offset as usize - 8 + index].flags &= !(value >> shift & 0x3D);
                }
            }
            0x10..=0xCC => {
                let unprotected = self.is_unprotected;
                let stream = &mut self.streams[(offset as usize - 0x10) / 0x18];
                let on = stream.cr & EN != 0 && !unprotected;
                match (offset - 0x10) % 0x18 {
                    0x00 => stream.write_cr(value, unprotected, controller, lints),
                    // 10.5.6 to 10.5.9: write-protected while the stream is on, except the memory address that is not the present target.
                    0x10 if on && stream.cr & (DBM | CT) == DBM => stream.memory[1] = value,
                    0x0C if on && stream.cr & (DBM | CT) == DBM | CT => stream.memory[0] = value,
                    _ if on => {
                        lints.push(LintKind::Misuse("registers of a DMA stream are write-protected while it is on"))
                    }
                    0x04 => stream.ndtr = value & 0xFFFF,
                    0x08 => stream.par = value,
                    0x0C => stream.memory[0] = value,
                    0x10 => stream.memory[1] = value,
                    _ => stream.fcr = (value & 0x87) | 0x20,
                }
            }
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    /// The transfer that a stream makes for a request on `channel`; `None` if the stream is off or has selected another channel.
    pub(crate) fn transfer(&self, stream: usize, channel: u32) -> Option<DmaTransfer> {
        let stream = &self.streams[stream];
        if stream.is_stalled || stream.cr & EN == 0 || stream.cr >> 25 & 7 != channel || stream.ndtr == 0 {
            return None;
        }
        let width = stream.width();
        let peripheral_step = match stream.cr & (PINC | PINCOS) {
            0 | PINCOS => 0,
            PINC => width.bytes(),
            _ => 4,
        };
        let memory_step = if stream.cr & MINC != 0 { width.bytes() } else { 0 };
        let memory = stream.memory[usize::from(stream.cr & (DBM | CT) == DBM | CT)];
        Some(DmaTransfer {
            peripheral: stream.par.wrapping_add(stream.moved.wrapping_mul(peripheral_step)),
            memory: memory.wrapping_add(stream.moved.wrapping_mul(memory_step)),
            width,
            to_memory: stream.cr >> 6 & 3 == 0,
        })
    }

    /// Updates a stream after a transfer; `good` is false if there was no memory at its address.
    /// Returns true for the last item of the buffer.
    pub(crate) fn transferred(&mut self, stream: usize, good: bool) -> bool {
        let stream = &mut self.streams[stream];
        if std::mem::take(&mut stream.fail_next_transfer) || !good {
            // 10.3.19: a transfer error switches the stream off.
            stream.flags |= TEIF;
            stream.cr &= !EN;
            return true;
        }
        stream.ndtr = stream.ndtr.saturating_sub(1);
        stream.moved += 1;
        if stream.moved == stream.total / 2 {
            stream.flags |= HTIF;
        }
        if stream.ndtr > 0 {
            return false;
        }
        stream.flags |= TCIF;
        stream.ndtr = stream.total;
        stream.moved = 0;
        if stream.cr & DBM != 0 {
            stream.cr ^= CT;
        } else if stream.cr & CIRC == 0 {
            stream.ndtr = 0;
            stream.cr &= !EN;
        }
        true
    }

    /// Makes the next transfer of a stream fail.
    pub(crate) fn fail_next_transfer(&mut self, stream: usize) {
        self.streams[stream].fail_next_transfer = true;
    }

    /// Stops serving the requests of a stream, or serves them again. They stay with their source meanwhile.
    pub(crate) fn stall(&mut self, stream: usize, is_stalled: bool) {
        self.streams[stream].is_stalled = is_stalled;
    }

    /// Makes a stream take its next request without a transfer.
    pub(crate) fn lose_next_request(&mut self, stream: usize) {
        self.streams[stream].loses_next_request = true;
    }

    /// Whether the request that a stream serves now is lost; only once.
    pub(crate) fn takes_lost_request(&mut self, stream: usize) -> bool {
        std::mem::take(&mut self.streams[stream].loses_next_request)
    }

    /// True if a stream has a flag; without one no interrupt line is high.
    pub(crate) fn has_flags(&self) -> bool {
        self.streams.iter().any(|stream| stream.flags != 0)
    }

    /// Whether a stream can raise its interrupt line.
    pub(crate) fn has_interrupts(&self, stream: usize) -> bool {
        self.streams[stream].cr & (TEIE | HTIE | TCIE) != 0
    }

    /// Level of the interrupt line of a stream.
    pub(crate) fn interrupt(&self, stream: usize) -> bool {
        let stream = &self.streams[stream];
        [(TEIF, TEIE), (HTIF, HTIE), (TCIF, TCIE)]
            .iter()
            .any(|&(flag, enable)| stream.flags & flag != 0 && stream.cr & enable != 0)
    }
}

impl DmaStream {
    /// Width of one item, the same on both sides.
    fn width(&self) -> Width {
        match self.cr >> 11 & 3 {
            0 => Width::Byte,
            1 => Width::Half,
            _ => Width::Word,
        }
    }

    fn write_cr(&mut self, value: u32, unprotected: bool, controller: usize, lints: &mut Vec<LintKind>) {
        let value = value & 0x0FEF_FFFF;
        let (was_on, is_on) = (self.cr & EN != 0, value & EN != 0);
        if was_on && is_on {
            if unprotected {
                self.cr = value;
                return;
            }
            // 10.5.5: only the interrupt enables can be written while the stream is on.
            let free = 0x1E;
            if (value ^ self.cr) & !free != 0 {
                lints.push(LintKind::Misuse("registers of a DMA stream are write-protected while it is on"));
            }
            self.cr = (self.cr & !free) | (value & free);
            return;
        }
        self.cr = value;
        if was_on {
            // 10.3.14: a stream that is switched off before its end raises TCIF.
            self.flags |= TCIF;
            return;
        }
        if is_on {
            self.check(controller, lints);
            self.total = self.ndtr;
            self.moved = 0;
        }
    }

    fn check(&mut self, controller: usize, lints: &mut Vec<LintKind>) {
        const DMDIS: u32 = 1 << 2;
        let (peripheral, memory) = (self.cr >> 11 & 3, self.cr >> 13 & 3);
        if self.cr >> 6 & 3 > 1 {
            lints.push(LintKind::Mode(match controller {
                0 => "DMA1 has no memory to memory transfers",
                _ => "DMA memory to memory",
            }));
        }
        if self.cr & PFCTRL != 0 {
            lints.push(LintKind::Mode("DMA flow control by the peripheral"));
        }
        if self.cr >> 21 & 0xF != 0 {
            lints.push(LintKind::Mode("DMA bursts"));
        }
        // 10.3.10: direct mode uses PSIZE for both sides; only the FIFO packs.
        if self.fcr & DMDIS != 0 && peripheral != memory {
            lints.push(LintKind::Mode("DMA FIFO packing between widths"));
        }
        if self.ndtr == 0 {
            lints.push(LintKind::Misuse("a DMA stream is switched on with NDTR = 0: write the number of items first"));
        }
        // 10.3.17: flags of an earlier transfer must be cleared before the stream is switched on.
        if self.flags != 0 {
            lints.push(LintKind::Misuse(
                "a DMA stream is switched on with flags set and stays off: clear them in LIFCR, HIFCR first",
            ));
            self.cr &= !EN;
        }
    }
}
