//! The serial port over USB: records out and requests in, as a CDC-ACM device, which every system shows as a serial port without a driver of ours.
//!
//! ```text
//! telemetry --> OUT --> usb_send_task ------> host
//! telemetry <-- IN  <-- usb_receive_task <--- host
//! ```
//! Everything here runs in the thread of telemetry, below the ticks; the interrupt of the USB only wakes its tasks, and a tick interrupts it. A
//! record for which `OUT` has no space is dropped and counted, so a host that does not read delays nothing. While `IN` is full the chip answers the
//! host that it has to wait.
//!
//! A port is open while the host sets DTR, as systems do when a program opens it. The first record after that is the one of the boot, so a program that
//! comes late knows the board. While no program has it open nothing is sent, and nothing counts as lost.

use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::peripherals::USB;
use embassy_rp::usb::{Driver, InterruptHandler};
use embassy_rp::{Peri, bind_interrupts};
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_usb::class::cdc_acm::{CdcAcmClass, ControlChanged, Receiver, Sender, State};
use embassy_usb::{Builder, Config, UsbDevice};
use heapless::Vec;
use static_cell::{ConstStaticCell, StaticCell};
use wire::{MAX_FRAME_BYTES, Record, Unframer, frame_record};

use crate::requests::Requests;

/// Number for devices that are not sold (<https://pid.codes/1209/0001/>). Who sells boards needs one of his own.
const VENDOR: u16 = 0x1209;
const PRODUCT: u16 = 0x0001;
/// Most that the board takes from the USB, mA. The servos have a supply of their own.
const MOST_MILLIAMPERES: u16 = 250;

/// Longest packet of a bulk endpoint at full speed.
const PACKET: usize = 64;
/// A packet shorter than the longest ends a transfer: the host passes it on at once.
const SHORT_PACKET: usize = PACKET - 1;

/// Records on their way out: 0.1 s of them.
static OUT: Pipe<ThreadModeRawMutex, 4096> = Pipe::new();
/// Bytes of the host: what telemetry takes in a round, at most.
static IN: Pipe<ThreadModeRawMutex, 256> = Pipe::new();

bind_interrupts!(struct Interrupts {
    USBCTRL_IRQ => InterruptHandler<USB>;
});

type Bus = Driver<'static, USB>;

/// What the tasks of the port run.
pub(crate) struct Tasks {
    pub(crate) device: UsbDevice<'static, Bus>,
    pub(crate) sender: Sender<'static, Bus>,
    pub(crate) receiver: Receiver<'static, Bus>,
}

/// The port. [`start`] makes the one that there is.
pub(crate) struct Port {
    control: ControlChanged<'static>,
    /// A program had the port open in the last round.
    is_open: bool,
    /// The frame of the boot record.
    boot: Vec<u8, MAX_FRAME_BYTES>,
    unframer: Unframer,
    pub(crate) requests: Requests,
}

/// Makes the device and its tasks. The host sees it when the tasks run.
#[inline(never)]
pub(crate) fn start(usb: Peri<'static, USB>, requests: Requests) -> (Port, Tasks) {
    static CONFIGURATION: ConstStaticCell<[u8; 128]> = ConstStaticCell::new([0; 128]);
    static CAPABILITIES: ConstStaticCell<[u8; 32]> = ConstStaticCell::new([0; 32]);
    static CONTROL: ConstStaticCell<[u8; PACKET]> = ConstStaticCell::new([0; PACKET]);
    static STATE: StaticCell<State<'static>> = StaticCell::new();

    interrupt::USBCTRL_IRQ.set_priority(Priority::P3);
    let mut config = Config::new(VENDOR, PRODUCT);
    config.manufacturer = Some("Footfall");
    config.product = Some("Footfall on Raspberry Pi Pico");
    config.max_power = MOST_MILLIAMPERES;
    let mut builder = Builder::new(
        Driver::new(usb, Interrupts),
        config,
        CONFIGURATION.take(),
        CAPABILITIES.take(),
        &mut [],
        CONTROL.take(),
    );
    let class = CdcAcmClass::new(&mut builder, STATE.init(State::new()), PACKET as u16);
    let (sender, receiver, control) = class.split_with_control();
    let port = Port { control, is_open: false, boot: Vec::new(), unframer: Unframer::default(), requests };
    (port, Tasks { device: builder.build(), sender, receiver })
}

/// Answers the host: what the device is, whether a program has the port open.
#[embassy_executor::task]
pub(crate) async fn usb_device_task(mut device: UsbDevice<'static, Bus>) -> ! {
    device.run().await
}

/// Sends what telemetry has written.
#[embassy_executor::task]
pub(crate) async fn usb_send_task(mut sender: Sender<'static, Bus>) -> ! {
    let mut packet = [0; SHORT_PACKET];
    loop {
        sender.wait_connection().await;
        loop {
            let length = OUT.read(&mut packet).await;
            let bytes = packet.get(..length).unwrap_or_default();
            if sender.write_packet(bytes).await.is_err() {
                break;
            }
        }
    }
}

/// Takes what the host sends.
#[embassy_executor::task]
pub(crate) async fn usb_receive_task(mut receiver: Receiver<'static, Bus>) -> ! {
    let mut packet = [0; PACKET];
    loop {
        receiver.wait_connection().await;
        while let Ok(length) = receiver.read_packet(&mut packet).await {
            IN.write_all(packet.get(..length).unwrap_or_default()).await;
        }
    }
}

/// Writes a frame, or nothing where it does not fit.
fn put(frame: &[u8]) -> bool {
    let mut rest = frame;
    if OUT.free_capacity() < rest.len() {
        return false;
    }
    // The pipe takes up to its end first.
    while !rest.is_empty() {
        let Ok(taken) = OUT.try_write(rest) else { return false };
        rest = rest.get(taken..).unwrap_or_default();
    }
    true
}

impl Port {
    /// Hands a record on, or counts that there was no space.
    #[inline(never)]
    pub(crate) fn send(&mut self, record: &Record) {
        let is_boot = matches!(record, Record::Boot(_));
        if !self.is_open && !is_boot {
            return;
        }
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = frame_record(record, &mut buffer).unwrap_or_default();
        if is_boot {
            self.boot = Vec::from_slice(frame).unwrap_or_default();
        } else {
            self.send_frame(frame);
        }
    }

    /// The same for a record's frame, but that of the boot.
    pub(crate) fn send_frame(&mut self, frame: &[u8]) {
        if self.is_open && (frame.is_empty() || !put(frame)) {
            self.drop_records(1);
        }
    }

    /// Counts records that are not sent.
    pub(crate) fn drop_records(&mut self, records: u32) {
        if self.is_open {
            let counts = &mut self.requests.counts;
            counts.not_sent = counts.not_sent.wrapping_add(records);
        }
    }

    /// Begins with the boot record when a program opens the port.
    pub(crate) fn pump(&mut self) {
        let is_open = self.control.dtr();
        if is_open && !self.is_open {
            OUT.clear();
            self.unframer = Unframer::default();
            // The zero ends what may be left in the chip of the program before.
            if !(put(&[0]) && put(&self.boot)) {
                let counts = &mut self.requests.counts;
                counts.not_sent = counts.not_sent.wrapping_add(1);
            }
        }
        self.is_open = is_open;
    }

    /// Takes what was received, and hands the requests in it to the loop.
    pub(crate) fn receive(&mut self) {
        let mut bytes = [0; PACKET];
        for _ in 0..IN.capacity() / PACKET {
            let Ok(length) = IN.try_read(&mut bytes) else { return };
            for byte in bytes.iter().take(length) {
                self.requests.take(&mut self.unframer, *byte);
            }
        }
    }
}
