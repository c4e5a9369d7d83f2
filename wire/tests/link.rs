//! Frames on a serial line: exact round trips, every damage refused, the next frame unharmed, and no request that arms.

use joint_loop::tuning::{Action, Parameter, Request};
use joint_units::{Joint, PulseMicros};
use proptest::prelude::*;
use wire::*;

fn request() -> impl Strategy<Value = Request> {
    let set = (0..Parameter::COUNT, any::<i32>())
        .prop_map(|(place, thousandths)| Action::Set { parameter: Parameter::ALL[place], thousandths });
    let action = prop_oneof![Just(Action::Stop), Just(Action::Undo), set];
    (any::<u16>(), action).prop_map(|(number, action)| Request { number, action })
}

fn framed(request: &Request) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    frame_request(request, &mut buffer).expect("it fits").to_vec()
}

/// Everything that a stream of bytes holds.
fn found(bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
    let mut unframer = Unframer::default();
    bytes.iter().filter_map(|byte| unframer.push(*byte).map(|payload| payload.map(<[u8]>::to_vec))).collect()
}

fn requests(bytes: &[u8]) -> Vec<Request> {
    found(bytes).into_iter().flatten().filter_map(|payload| decode_request(&payload).ok()).collect()
}

/// COBS by the definition of the paper, and CRC-32 bit by bit: an independent framing.
fn by_definition(payload: &[u8]) -> Vec<u8> {
    let crc = payload.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
    });
    let data = [payload, &(!crc).to_le_bytes()].concat();
    let mut out = Vec::new();
    let groups: Vec<&[u8]> = data.split(|byte| *byte == 0).collect();
    for group in groups {
        let mut rest = group;
        while rest.len() >= 254 {
            out.push(255);
            out.extend(&rest[..254]);
            rest = &rest[254..];
        }
        out.push(rest.len() as u8 + 1);
        out.extend(rest);
    }
    out.push(0);
    out
}

#[test]
fn a_frame_is_as_the_paper_defines_it() {
    let action = Action::Set { parameter: Parameter::Speed, thousandths: 1_000 };
    let payload = [9, 7, 3, 0xd0, 0x0f];
    assert_eq!(framed(&Request { number: 7, action }), by_definition(&payload));
    assert_eq!(framed(&Request { number: 7, action: Action::Stop }), by_definition(&[9, 7, 0, 0]));
    let trim = Action::Trim { joint: Joint::RightKnee };
    assert_eq!(framed(&Request { number: 7, action: trim }), by_definition(&[9, 7, 254, 6]));
    let jog = Action::Jog { pulse: PulseMicros(1_501) };
    assert_eq!(framed(&Request { number: 7, action: jog }), by_definition(&[9, 7, 255, 0xba, 0x17]));
    let record = Record::Edge(Edge { tick: 0, offset_us: 0, high: false, lost_before: false });
    let mut buffer = [0; MAX_FRAME_BYTES];
    assert_eq!(frame_record(&record, &mut buffer), Some(&by_definition(&[9, 5, 0, 0, 0, 0])[..]));
}

#[test]
fn the_longest_record_fits_and_a_shorter_buffer_is_refused() {
    let refused = Record::Refused(Refused::new(Subject::Clock, "x".repeat(160)));
    let mut buffer = [0; MAX_FRAME_BYTES];
    let length = frame_record(&refused, &mut buffer).expect("it fits").len();
    for short in 0..length {
        assert_eq!(frame_record(&refused, &mut buffer[..short]), None, "{short}");
    }
    let call =
        Call { codes: [u16::MAX; 4].into_iter().collect(), reference: u16::MAX, elapsed: 255, ..Call::default() };
    let action = Action::Set { parameter: Parameter::Speed, thousandths: i32::MIN };
    let call =
        Call { flags: Flags::from_bits(Flags::ALL).unwrap(), request: Some(Request { number: !0, action }), ..call };
    let inputs = Record::Inputs(Inputs { first_tick: u32::MAX, calls: vec![call; CALLS].into_iter().collect() });
    assert!(frame_record(&inputs, &mut buffer).is_some());
}

/// A board that is reset in the middle of a frame says nothing of the rest.
#[test]
fn a_boot_record_survives_a_frame_that_the_reset_cut() {
    let (mut cut, mut buffer) = ([0; MAX_FRAME_BYTES], [0; MAX_FRAME_BYTES]);
    let edge = Record::Edge(Edge { tick: 1 << 20, offset_us: 300, high: true, lost_before: false });
    let cut = frame_record(&edge, &mut cut).expect("it fits");
    let boot = Record::Boot(Boot {
        version: VERSION,
        board: "f4-discovery".try_into().expect("it fits"),
        chip: "STM32F407VGTx".try_into().expect("it fits"),
        reset: Reset::Pin,
        streak: 0,
        reference_cal: 1_502,
        min_supply_v: 2.75,
        sensor_required: true,
        generator: None,
        sensors: None,
        robot: None,
        shadow: false,
        last_outputs: None,
        sealed: None,
        brown_out: BrownOut { level: 2, wanted: 2 },
    });
    let whole = frame_record(&boot, &mut buffer).expect("it fits");
    for length in 0..=cut.len() {
        let last = found(&[&cut[..length], whole].concat()).pop().expect("frames").expect("the boot record's");
        assert_eq!(decode_framed(&last).as_ref(), Ok(&boot), "cut after {length} bytes");
    }
}

/// Every first action byte: stop, undo, the table, trim and jog; nothing else is a request. So none arms.
#[test]
fn no_byte_is_a_request_to_arm() {
    let mut accepted = Vec::new();
    for action in 0..=u8::MAX {
        for value in [0, 1, 2, 127] {
            match decode_request(&[VERSION as u8, 1, action, value]) {
                Ok(Request { action: Action::Stop, .. }) => assert_eq!((action, value), (0, 0)),
                Ok(Request { action: Action::Undo, .. }) => assert_eq!((action, value), (1, 0)),
                Ok(Request { action: Action::Set { parameter, .. }, .. }) => {
                    assert_eq!(parameter.place() + 2, usize::from(action));
                    accepted.push(action);
                }
                // A value is sent in zigzag: 0, -1, 1, -64.
                Ok(Request { action: Action::Trim { joint }, .. }) => {
                    assert_eq!((action, 2 * joint as usize), (254, usize::from(value)));
                }
                Ok(Request { action: Action::Jog { pulse }, .. }) => {
                    assert_eq!((action, 2 * pulse.0), (255, u16::from(value)));
                }
                Err(error) => assert_eq!(error, RequestError::Malformed, "{action} {value}"),
            }
        }
    }
    accepted.dedup();
    assert_eq!(accepted, (2..2 + Parameter::COUNT as u8).collect::<Vec<_>>());
}

#[test]
fn a_record_comes_back_from_its_frame() {
    let record = Record::Port(Port { requests: 1, malformed: 0, other_version: 300, too_many: 0, not_sent: 254 });
    let mut buffer = [0; MAX_FRAME_BYTES];
    let payloads = found(frame_record(&record, &mut buffer).expect("it fits"));
    assert_eq!(payloads.len(), 1);
    let payload = payloads[0].as_ref().expect("a frame");
    assert_eq!(decode_framed(payload), Ok(record));
    assert_eq!(decode_framed(&[7]), Err(DecodeError::Version { board: 7 }));
    assert_eq!(decode_framed(&[]), Err(DecodeError::Empty));
}

#[test]
fn another_version_is_refused_in_words() {
    for rest in [&[][..], &[1, 2, 3], &[0xff; 40]] {
        let payload = [&[7][..], rest].concat();
        assert_eq!(decode_request(&payload), Err(RequestError::Version { host: 7 }));
    }
    let words = "a request of version 7; this board takes version 9: use the `footfall` of the checkout that its image was built from";
    assert_eq!(RequestError::Version { host: 7 }.to_string(), words);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn every_request_makes_an_exact_round_trip(request in request(), noise in prop::collection::vec(1..=u8::MAX, 0..400)) {
        let bytes = framed(&request);
        prop_assert_eq!(requests(&bytes), [request]);
        prop_assert!(bytes[..bytes.len() - 1].iter().all(|byte| *byte != 0));
        // After any bytes and a zero.
        let after: Vec<u8> = noise.into_iter().chain([0]).chain(bytes).collect();
        prop_assert_eq!(requests(&after).pop(), Some(request));
    }

    /// One changed, lost or added byte, and every shorter piece: refused, and the frame after it is read.
    #[test]
    fn a_damaged_frame_is_refused(request in request(), at in any::<prop::sample::Index>(), change in 1..=u8::MAX) {
        let bytes = framed(&request);
        let at = at.index(bytes.len() - 1);
        let mut changed = bytes.clone();
        changed[at] ^= change;
        let (mut lost, mut added) = (bytes.clone(), bytes.clone());
        lost.remove(at);
        added.insert(at, change);
        for damaged in [changed, lost, added, [&bytes[..at], &[0]].concat()] {
            let mut stream = damaged.clone();
            stream.extend(&bytes);
            let got = requests(&stream);
            // An added byte may equal its neighbour's place in the stuffing: then the check sum refuses it.
            prop_assert_eq!(got, [request], "{:02x?}", damaged);
        }
    }

    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        for payload in found(&bytes).into_iter().flatten() {
            let _ = decode_request(&payload);
        }
        let _ = decode_request(&bytes);
    }
}

/// 1,000 malformed frames of every sort: none is a request, each is refused, and the good frame after them is read.
#[test]
fn a_thousand_malformed_frames_are_refused() {
    let good = framed(&Request { number: 1, action: Action::Stop });
    let mut stream = Vec::new();
    let mut refused = 0;
    for round in 0..1_000_u32 {
        let byte = round.wrapping_mul(2_654_435_761) >> 24;
        let frame = match round % 4 {
            0 => good[..1 + round as usize % (good.len() - 2)].to_vec(),
            1 => vec![0xff; 1 + round as usize % 700],
            2 => by_definition(&[VERSION as u8, 1, 14 + (byte as u8 % 200), 0])[..].split_last().unwrap().1.to_vec(),
            _ => {
                let mut frame = good[..good.len() - 1].to_vec();
                let at = round as usize % frame.len();
                frame[at] = frame[at].wrapping_add(1).max(1);
                frame
            }
        };
        stream.extend(&frame);
        stream.push(0);
        refused += 1;
    }
    let all = found(&stream);
    assert_eq!(all.len(), refused);
    assert!(all.iter().all(|found| match found {
        Ok(payload) => decode_request(payload).is_err(),
        Err(_) => true,
    }));
    stream.extend(&good);
    assert_eq!(requests(&stream), [Request { number: 1, action: Action::Stop }]);
}
