//! USART2 as an asynchronous port: data and status registers, baud rate, DMA requests (RM0090 chapter 30).
//!
//! A character takes the time of its bits at the programmed rate; the level of the line during a character is not modelled, and a character is
//! never damaged. Parity, 9 bits, synchronous mode, LIN, smartcard, IrDA, half duplex, flow control, mute mode and break characters are not
//! modelled; selecting one of them makes a lint.

use std::collections::VecDeque;

use crate::lint::LintKind;

const SR: u32 = 0x00;
const DR: u32 = 0x04;
const BRR: u32 = 0x08;
const CR1: u32 = 0x0C;
const CR2: u32 = 0x10;
const CR3: u32 = 0x14;
const GTPR: u32 = 0x18;

// SR, and the enables of CR1 at the same bits.
const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;
const SBK: u32 = 1;
const RWU: u32 = 1 << 1;
const RE: u32 = 1 << 2;
const TE: u32 = 1 << 3;
const PCE: u32 = 1 << 10;
const M: u32 = 1 << 12;
const UE: u32 = 1 << 13;
const OVER8: u32 = 1 << 15;
const STOP: u32 = 3 << 12;
const EIE: u32 = 1;
const DMAR: u32 = 1 << 6;
const DMAT: u32 = 1 << 7;

/// Function 7 of a pin is USART2 (data sheet table 9): port and number of the pins that send, and of those that receive.
pub(crate) const SERIAL_OUT: [(usize, u8); 2] = [(0, 2), (3, 5)];
pub(crate) const SERIAL_IN: [(usize, u8); 2] = [(0, 3), (3, 6)];

/// Registers and shift registers of the port.
#[derive(Debug, Clone)]
pub(crate) struct Usart {
    sr: u32,
    received: u8,
    to_send: Option<u8>,
    brr: u32,
    cr1: u32,
    cr2: u32,
    cr3: u32,
    gtpr: u32,
    /// SR was read: an access to DR completes the sequence that clears flags.
    sr_read: bool,
    /// The character in the transmit shift register, and the cycle of its end.
    shifting: Option<(u8, u64)>,
    /// The transmitter's first frame is idle: cycle of its end (30.3.2).
    idle_frame_until: u64,
    /// Characters on their way, and the cycle of the end of the first.
    incoming: VecDeque<u8>,
    arrives_at: u64,
    /// Cycle at which the line has been idle for a frame after a character.
    idle_at: u64,
    sent: Vec<u8>,
    /// HCLK cycles per cycle of the bus clock.
    divider: u64,
}

impl Usart {
    pub(crate) fn new() -> Self {
        Usart {
            sr: TXE | TC,
            received: 0,
            to_send: None,
            brr: 0,
            cr1: 0,
            cr2: 0,
            cr3: 0,
            gtpr: 0,
            sr_read: false,
            shifting: None,
            idle_frame_until: 0,
            incoming: VecDeque::new(),
            arrives_at: u64::MAX,
            idle_at: u64::MAX,
            sent: Vec::new(),
            divider: 1,
        }
    }

    /// Sets the HCLK cycles per cycle of the bus clock. Characters under way keep their time.
    pub(crate) fn set_divider(&mut self, divider: u64) {
        self.divider = divider;
    }

    /// HCLK cycles of one character: a start bit, 8 data bits and the stop bits. None without a baud rate.
    fn character(&self) -> Option<u64> {
        // 30.3.4: the rate is f / (8 (2 - OVER8) USARTDIV). By 16, BRR is USARTDIV in sixteenths; by 8, its three lowest bits are eighths.
        let bit = match self.cr1 & OVER8 {
            0 => self.brr,
            _ => (self.brr >> 4) * 8 + (self.brr & 7),
        };
        // 30.6.5: STOP 0 is one bit, 2 is two.
        let bits = if self.cr2 & STOP == 2 << 12 { 11 } else { 10 };
        (bit > 0).then(|| u64::from(bit) * bits * self.divider)
    }

    fn transmits(&self) -> bool {
        self.cr1 & (UE | TE) == UE | TE
    }

    fn receives(&self) -> bool {
        self.cr1 & (UE | RE) == UE | RE
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            SR => self.sr,
            DR => self.received.into(),
            BRR => self.brr,
            CR1 => self.cr1,
            CR2 => self.cr2,
            CR3 => self.cr3,
            GTPR => self.gtpr,
            _ => return None,
        })
    }

    /// Effects of a read (30.6.1, 30.6.2).
    pub(crate) fn after_read(&mut self, offset: u32) {
        match offset {
            SR => self.sr_read = true,
            DR => {
                self.sr &= !RXNE;
                if std::mem::take(&mut self.sr_read) {
                    self.sr &= !(ORE | IDLE);
                }
            }
            _ => {}
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64, lints: &mut Vec<LintKind>) {
        match offset {
            // 30.6.1: of these flags, RXNE and TC are cleared by writing 0.
            SR => self.sr &= value | !(RXNE | TC),
            DR => {
                if std::mem::take(&mut self.sr_read) {
                    self.sr &= !TC;
                }
                if self.sr & TXE == 0 {
                    lints.push(LintKind::Misuse("USART_DR is written while TXE is 0: the character before is lost"));
                }
                self.to_send = Some(value as u8);
                self.sr &= !TXE;
                self.load(now);
            }
            BRR => self.brr = value & 0xFFFF,
            CR1 => {
                if value & (PCE | M | RWU | SBK) != 0 {
                    lints.push(LintKind::Mode("USART parity, 9 bits, mute mode or break"));
                }
                let before = self.cr1;
                self.cr1 = value & 0xBFFF;
                if self.transmits() && before & (UE | TE) != UE | TE {
                    if self.brr < 16 {
                        lints.push(LintKind::Misuse("the USART is switched on with USARTDIV below 1: write BRR first"));
                    }
                    self.idle_frame_until = now + self.character().unwrap_or(0);
                }
                if self.receives() && self.arrives_at == u64::MAX {
                    self.schedule_arrival(now);
                }
                self.load(now);
            }
            CR2 => {
                if value & !STOP != 0 || value & STOP == 1 << 12 || value & STOP == 3 << 12 {
                    lints.push(LintKind::Mode("USART clock output, LIN or half stop bits"));
                }
                self.cr2 = value & 0x7F7F;
            }
            CR3 => {
                if value & 0x0F3E != 0 && value & 0x0F3E != 0x0800 {
                    lints.push(LintKind::Mode("USART flow control, smartcard, half duplex or IrDA"));
                }
                self.cr3 = value & 0x0FFF;
            }
            GTPR => self.gtpr = value & 0xFFFF,
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    /// Moves a waiting character to the shift register (30.3.2: TXE is then set).
    fn load(&mut self, now: u64) {
        let (true, None, Some(character), Some(data)) =
            (self.transmits(), self.shifting, self.character(), self.to_send)
        else {
            return;
        };
        self.to_send = None;
        self.sr |= TXE;
        self.shifting = Some((data, now.max(self.idle_frame_until) + character));
    }

    fn schedule_arrival(&mut self, from: u64) {
        let next = self.character().filter(|_| self.receives() && !self.incoming.is_empty());
        self.arrives_at = next.map_or(u64::MAX, |character| from + character);
    }

    /// Puts characters on the line to the chip, one after the other; those that come while the receiver is off are lost.
    pub(crate) fn put(&mut self, bytes: &[u8], now: u64) {
        if !self.receives() {
            return;
        }
        self.incoming.extend(bytes);
        if self.arrives_at == u64::MAX {
            self.schedule_arrival(now);
        }
    }

    /// Takes the characters that were sent completely.
    pub(crate) fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.sent)
    }

    /// Cycle of the next end of a character, or of an idle line.
    pub(crate) fn next_event(&self) -> u64 {
        self.shifting.map_or(u64::MAX, |(_, end)| end).min(self.arrives_at).min(self.idle_at)
    }

    /// Carries out what is due.
    pub(crate) fn run_to(&mut self, now: u64) {
        if let Some((data, end)) = self.shifting
            && end <= now
        {
            self.sent.push(data);
            self.shifting = None;
            self.load(end);
            if self.shifting.is_none() {
                self.sr |= TC;
            }
        }
        if self.arrives_at <= now {
            let end = self.arrives_at;
            if let Some(data) = self.incoming.pop_front() {
                // 30.3.3: with RXNE set the new character is lost, and RDR keeps the one before.
                if self.sr & RXNE != 0 {
                    self.sr |= ORE;
                } else {
                    self.received = data;
                    self.sr |= RXNE;
                }
                self.idle_at = u64::MAX;
            }
            self.schedule_arrival(end);
            if self.arrives_at == u64::MAX {
                self.idle_at = self.character().map_or(u64::MAX, |character| end + character);
            }
        }
        if self.idle_at <= now {
            self.idle_at = u64::MAX;
            self.sr |= IDLE;
        }
    }

    /// A DMA request for the next character to send (30.3.13).
    pub(crate) fn requests_data(&self) -> bool {
        self.transmits() && self.cr3 & DMAT != 0 && self.sr & TXE != 0
    }

    /// A DMA request for the character received.
    pub(crate) fn offers_data(&self) -> bool {
        self.receives() && self.cr3 & DMAR != 0 && self.sr & RXNE != 0
    }

    /// Whether an interrupt of the port is enabled.
    pub(crate) fn has_interrupts(&self) -> bool {
        self.cr1 & (IDLE | RXNE | TC | TXE) != 0 || self.cr3 & EIE != 0
    }

    /// Level of the interrupt line (30.4, table 148): an overrun is reported with RXNEIE, and with EIE in DMA reception.
    pub(crate) fn interrupt(&self) -> bool {
        let overrun = self.cr1 & RXNE != 0 || self.cr3 & (EIE | DMAR) == EIE | DMAR;
        self.sr & self.cr1 & (IDLE | RXNE | TC | TXE) != 0 || self.sr & ORE != 0 && overrun
    }
}
