//! Records between firmware and host in the link proof: any bytes are decoded, any record is encoded, as a board does it.

use core::fmt::{self, Write};
use core::hint::black_box;

use joint_loop::{SENSORS, Sample};
use wire::{Call, Frame, Inputs, MAX_BYTES, Record, Refused, Subject, bytes_in, decode, encode};

/// A record of any kind, since the optimiser knows nothing of the bytes.
pub(crate) fn prove() {
    let bytes: &[u8] = black_box(&[]);
    match decode(bytes) {
        Ok(record) => {
            black_box((record.kind(), record.kind().name()));
            send(&record);
            if let Record::Inputs(inputs) = &record {
                inputs.ticks().for_each(|(tick, call)| {
                    black_box((tick, call.sample()));
                });
            }
        }
        Err(error) => {
            let _ = write!(Nowhere, "{error}");
        }
    }
    let line: &str = black_box("");
    match bytes_in(line) {
        Some(Ok(bytes)) => {
            black_box(bytes);
        }
        Some(Err(error)) => {
            let _ = write!(Nowhere, "{error}");
        }
        None => {}
    }
    let refused = Refused::new(black_box(Subject::ALL[0]), black_box("no reason"));
    send(&Record::Refused(refused));
}

/// What a board logs of a tick.
pub(crate) fn of_tick(sample: &Sample<SENSORS>, frame: &joint_loop::Frame<SENSORS>) {
    send(&Record::Frame(Frame::from(frame)));
    let mut inputs = Inputs { first_tick: frame.tick, ..Inputs::default() };
    let _ = inputs.calls.push(Call::of(sample, black_box(SENSORS)));
    send(&Record::Inputs(inputs));
}

fn send(record: &Record) {
    let mut buffer = [0; MAX_BYTES];
    black_box(encode(black_box(record), black_box(&mut buffer)));
}

/// Takes text and keeps none of it.
struct Nowhere;

impl Write for Nowhere {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        black_box(text);
        Ok(())
    }
}
