//! Records between firmware and host in the link proof: any bytes are decoded, any record is encoded, as a board does it. Messages of
//! errors, and records in printed logs, are for the host and not part of the proof.

use core::hint::black_box;

use joint_loop::tuning::{Answer, Settings as Values};
use joint_loop::{SENSORS, Sample};
use wire::{
    Answered, Call, Frame, Inputs, MAX_BYTES, MAX_FRAME_BYTES, Port, Record, Refused, Settings, Subject, Unframer,
    decode, decode_request, encode, frame_record,
};

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
    send(&Record::Port(black_box(Port::default())));
    let [tick, generator, robot] = black_box([0; 3]);
    let settings = Settings { tick, generator, robot, values: black_box(Values::default()) };
    send(&Record::Settings(settings));
    received();
}

/// Any byte after any others on the serial line.
fn received() {
    let mut unframer = black_box(Unframer::default());
    if let Some(Ok(payload)) = unframer.push(black_box(0)) {
        let _ = black_box(decode_request(payload));
    }
    black_box(&unframer);
}

/// What a board logs of a tick.
pub(crate) fn of_tick(
    sample: &Sample<SENSORS>,
    frame: &joint_loop::Frame<SENSORS>,
    answers: impl Iterator<Item = Answer>,
) {
    answers.for_each(|answer| send(&Record::Answered(Answered::from(answer))));
    send(&Record::Frame(Frame::from(frame)));
    let mut inputs = Inputs { first_tick: frame.tick, ..Inputs::default() };
    let _ = inputs.calls.push(Call::of(sample, black_box(SENSORS)));
    send(&Record::Inputs(inputs));
}

fn send(record: &Record) {
    let mut buffer = [0; MAX_BYTES];
    black_box(encode(black_box(record), black_box(&mut buffer)));
    let mut buffer = [0; MAX_FRAME_BYTES];
    black_box(frame_record(black_box(record), black_box(&mut buffer)));
}
