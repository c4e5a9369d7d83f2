//! Encodes a record as firmware does and decodes it as a host does: `cargo run -p wire --example hello`.

use wire::{Change, DecodeError, MAX_BYTES, Record, decode, encode};

fn main() -> Result<(), DecodeError> {
    // On the board: one record, one buffer on the stack.
    let change = Change { tick: 2_310, state: joint_loop::SupervisorState::Walking, cause: joint_loop::Cause::Button };
    let mut buffer = [0; MAX_BYTES];
    let bytes = encode(&Record::Change(change), &mut buffer).expect("a buffer of MAX_BYTES holds any record");
    println!("{} bytes: {bytes:02x?}", bytes.len());

    // On the host.
    match decode(bytes)? {
        Record::Change(change) => println!("tick {}: {} ({})", change.tick, change.state.name(), change.cause.name()),
        other => println!("{other:?}"),
    }

    // Bytes that are no record are refused in words.
    for damaged in [&bytes[..2], &[9, 9, 9], &[0, 1]] {
        println!("{damaged:02x?}: {}", decode(damaged).expect_err("damaged"));
    }
    Ok(())
}
