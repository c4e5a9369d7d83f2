#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod boot;
mod codec;
mod conditions;
mod events;
mod flags;
mod frame;
mod inputs;
mod link;
mod load;
mod number;
mod request;
mod settings;

pub use boot::{Boot, BrownOut, LastOutputs, RecordId, Refused, Reset, Subject};
pub use codec::{DecodeError, Kind, MAX_BYTES, Record, decode, encode};
pub use conditions::{Conditions, Validities};
pub use events::{Change, Edge};
pub use flags::Flags;
pub use frame::{Follow, Frame, Reading};
pub use inputs::{CALLS, Call, Inputs};
pub use link::{
    FrameError, MAX_FRAME_BYTES, RequestError, Unframer, decode_framed, decode_request, frame_record, frame_request,
};
pub use load::{Cost, Environment, Warnings};
pub use request::{Answered, Port};
pub use settings::Settings;

/// Version of the records in this crate. It changes whenever any byte of any record changes its place or its meaning: a new field, a new
/// record, another order of the variants of an enum that is sent.
pub const VERSION: u16 = 9;
