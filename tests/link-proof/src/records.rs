//! Records between firmware and host in the link proof: any bytes are decoded, any record is encoded, as a board does it. Messages of
//! errors, and records in printed logs, are for the host and not part of the proof.

use core::hint::black_box;

use joint_loop::{SENSORS, Sample};
use wire::{Call, Frame, Inputs, MAX_BYTES, Record, Refused, Subject, decode, encode};

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
            black_box(error);
        }
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
