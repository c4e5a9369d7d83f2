//! The bytes of version 9, an example of each record. A change here is another version: raise [`wire::VERSION`].

use cpg_core::entrainment::{Lock, SensorFault};
use hgod_adc::Validity;
use joint_loop::tuning::{Action, Outcome, Parameter, Request, Settings as Values};
use joint_loop::{Cause, Sample, SupervisorState};
use joint_units::Joint;
use wire::*;

fn vec<T: Clone, const N: usize>(items: &[T]) -> heapless::Vec<T, N> {
    heapless::Vec::from_slice(items).expect("it fits")
}

fn call(codes: &[u16], flags: u16) -> Call {
    Call {
        codes: vec(codes),
        reference: 1502,
        elapsed: 1,
        flags: Flags::from_bits(flags).expect("known bits"),
        watchdog_hz: None,
        request: None,
    }
}

/// An example of each record with its bytes in version 9.
fn examples() -> [(Record, Vec<u8>); 12] {
    let boot = Boot {
        version: 9,
        board: "f4-discovery".try_into().expect("it fits"),
        chip: "STM32F407VGTx".try_into().expect("it fits"),
        reset: Reset::IndependentWatchdog,
        streak: 2,
        reference_cal: 1502,
        min_supply_v: 2.75,
        sensor_required: true,
        generator: Some(RecordId::new("walk", 0x00c0_ffee)),
        sensors: None,
        robot: Some(RecordId::new("", 1)),
        shadow: false,
        last_outputs: Some(LastOutputs { pulses_us: [1500, 1520, 1056, 0], on: true, cut: 3 }),
        sealed: Some(true),
        brown_out: BrownOut { level: 3, wanted: 2 },
    };
    let frame = Frame {
        tick: 300,
        seq: 299,
        state: SupervisorState::Walking,
        cause: Cause::Button,
        sensors: [
            Some(Reading { angle_rad: 0.5, validity: Validity::Good }),
            Some(Reading { angle_rad: -0.25, validity: Validity::Rate }),
            None,
            None,
        ],
        following: Some(Follow {
            state: Lock::Locked,
            fault: Some(SensorFault::Stuck),
            phase_error_rad: -0.5,
            stride_s: 1.125,
            confidence: 1.0,
        }),
        setpoints_rad: [0.0, -0.0, 1.0, 0.1],
        pulses_us: [1500, 1520, 1056, 0],
        late: 1,
        missed: 2,
        overruns: 3,
        limited: 4,
        limited_ticks: 5,
        setpoint_hash: 0x0123_4567_89ab_cdef,
    };
    let still = Frame { sensors: [None; 4], following: None, ..frame };
    assert!(matches!(round(&Record::Frame(still)), Record::Frame(still) if still.following.is_none()));
    let action = Action::Set { parameter: Parameter::Speed, thousandths: -1_250 };
    let asked =
        Call { request: Some(Request { number: 300, action }), watchdog_hz: Some(32_000), ..call(&[127], 0x701) };
    let inputs = Inputs { first_tick: 300, calls: vec(&[call(&[2048], 0), asked]) };
    let set = |of: Values, parameter, thousandths| of.with(parameter, thousandths).expect("in its range");
    let settings = set(set(Values::default(), Parameter::Speed, 1_250), Parameter::Offset(Joint::RightKnee), -2);
    [
        (
            Record::Boot(boot),
            [
                &[0, 9, 12][..],
                b"f4-discovery",
                &[13],
                b"STM32F407VGTx",
                &[2, 2, 0xde, 0x0b, 0, 0, 0x30, 0x40, 1, 1, 4],
                b"walk",
                &[0xee, 0xff, 0x83, 0x06, 0, 1, 0, 1, 0, 1, 0xdc, 0x0b, 0xf0, 0x0b, 0xa0, 8, 0, 1, 3, 1, 1, 3, 2],
            ]
            .concat(),
        ),
        (Record::Refused(Refused::new(Subject::Clock, "no HSE")), [&[1, 4, 6][..], b"no HSE"].concat()),
        (
            Record::Change(Change { tick: 128, state: SupervisorState::Fault, cause: Cause::Board }),
            vec![2, 0x80, 1, 5, 19],
        ),
        (
            Record::Inputs(inputs),
            [
                &[3, 0xac, 2, 2][..],
                &[1, 0x80, 0x10, 0xde, 0x0b, 1, 0, 0, 0],
                &[1, 0x7f, 0xde, 0x0b, 1, 0x81, 0x0e, 1, 0x80, 0xfa, 1, 1, 0xac, 2, 3, 0xc3, 0x13],
            ]
            .concat(),
        ),
        (
            Record::Frame(frame),
            [
                &[4, 0xac, 2, 0xab, 2, 3, 1][..],
                &[1, 0, 0, 0, 0x3f, 0, 1, 0, 0, 0x80, 0xbe, 6, 0, 0],
                &[1, 2, 1, 2, 0, 0, 0, 0xbf, 0, 0, 0x90, 0x3f, 0, 0, 0x80, 0x3f],
                &[0, 0, 0, 0, 0, 0, 0, 0x80, 0, 0, 0x80, 0x3f, 0xcd, 0xcc, 0xcc, 0x3d],
                &[0xdc, 0x0b, 0xf0, 0x0b, 0xa0, 8, 0],
                &[1, 2, 3, 4, 5, 0xef, 0xcd, 0xab, 0x89, 0x67, 0x45, 0x23, 1],
            ]
            .concat(),
        ),
        (
            Record::Edge(Edge { tick: 1200, offset_us: -250, high: true, lost_before: true }),
            vec![5, 0xb0, 9, 0xf3, 3, 1, 1],
        ),
        (
            Record::Cost(Cost {
                longest_cycles: 9100,
                latest_start_us: 38,
                dropped: 2,
                stack_used: 900,
                stack_size: 90_000,
                truncated: 3,
            }),
            vec![6, 0x8c, 0x47, 38, 2, 0x84, 7, 0x90, 0xbf, 5, 3],
        ),
        (
            Record::Environment(Environment {
                die_c: Some(31.25),
                supply_v: None,
                watchdog_hz: Some(32_000),
                debugger: true,
                warnings: Warnings::BROWN_OUT.with(Warnings::CATCHES),
            }),
            vec![7, 1, 0, 0, 0xfa, 0x41, 0, 1, 0x80, 0xfa, 1, 1, 0x0a],
        ),
        (Record::Answered(Answered { tick: 300, number: 7, outcome: Outcome::OutOfRange }), vec![8, 0xac, 2, 7, 2]),
        (
            Record::Port(Port { requests: 1, malformed: 300, other_version: 2, too_many: 3, not_sent: 4 }),
            vec![9, 1, 0xac, 2, 2, 3, 4],
        ),
        (
            Record::Settings(Settings { tick: 300, generator: 1, robot: 2, values: settings }),
            vec![
                10, 0xac, 2, 1, 2, 0, 0xc4, 0x13, 0xd0, 0x0f, 0xd0, 0x0f, 0xd0, 0x0f, 0xd0, 0x0f, 0, 0, 0, 3, 0xd0,
                0x0f, 0xc0, 0x9a, 0x0c,
            ],
        ),
        (
            Record::Conditions(Conditions {
                tick: 300,
                supply_dips: 5,
                sensors: [Some(Validities { changes: 200, bad: [1, 2, 3, 4, 5, 6, 7, 300] }), None, None, None],
            }),
            vec![11, 0xac, 2, 5, 1, 0xc8, 1, 1, 2, 3, 4, 5, 6, 7, 0xac, 2, 0, 0, 0],
        ),
    ]
}

fn round(record: &Record) -> Record {
    let mut buffer = [0; MAX_BYTES];
    decode(encode(record, &mut buffer).expect("it fits")).expect("a record")
}

#[test]
fn the_bytes_are_those_of_the_version() {
    assert_eq!(VERSION, 9);
    for (place, (record, bytes)) in examples().into_iter().enumerate() {
        let mut buffer = [0; MAX_BYTES];
        let name = record.kind().name();
        assert_eq!((record.kind() as usize, usize::from(bytes[0])), (place, place), "{name}");
        assert_eq!(encode(&record, &mut buffer), Some(&bytes[..]), "{name}");
        assert_eq!(decode(&bytes), Ok(record), "{name}");
    }
}

#[test]
fn the_numbers_of_states_are_those_of_version_7() {
    // What the lists of the cores hold, in order: another order is another version.
    let names = |all: &[&str]| all.join(" ");
    assert_eq!(
        names(&SupervisorState::ALL.map(SupervisorState::name)),
        "boot disarmed arming walking stopping fault trim_ready trimming"
    );
    assert_eq!(
        names(&Cause::ALL.map(Cause::name)),
        "none button sensor_open sensor_short sensor_saturated sensor_stuck sensor_spike sensor_rate sensor_out_of_table \
         sensor_supply_low adc_overrun pose generator gap non_finite break_input clock watchdog outputs board request host_silent supply late \
         hold_short hold_long presses person_stands stop_untested watchdog_clock debugger program memory"
    );
    assert_eq!(
        names(&Validity::ALL.map(Validity::name)),
        "good open short saturated stuck spike rate out_of_table supply_low"
    );
    assert_eq!(names(&Lock::ALL.map(Lock::name)), "stopped seeking locked holding");
    assert_eq!(names(&SensorFault::ALL.map(SensorFault::name)), "missing erratic stuck amplitude innovation");
    assert_eq!(names(&Reset::ALL.map(Reset::name)), "power_on brown_out iwdg wwdg software low_power pin");
    assert_eq!(
        names(&Subject::ALL.map(Subject::name)),
        "generator_record sensor_record robot_record configuration clock arming"
    );
    assert_eq!(
        names(&Outcome::ALL.map(Outcome::name)),
        "staged in_effect out_of_range not_a_follower follows_a_person nothing_to_undo gait_not_possible not_at_rest not_trimming"
    );
    assert_eq!(
        names(&Parameter::ALL.map(Parameter::name)),
        "gait speed amplitude_left_hip amplitude_right_hip amplitude_left_knee amplitude_right_knee offset_left_hip offset_right_hip \
         offset_left_knee offset_right_knee follow record_rate"
    );
    for (place, (reset, subject)) in Reset::ALL.into_iter().zip(Subject::ALL).enumerate() {
        assert_eq!((reset as usize, subject as usize), (place, place));
    }
    assert_eq!(Kind::ALL.map(|kind| kind as usize), [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
}

#[test]
fn another_version_is_refused_in_words() {
    // Only kind and version are as in every version; what follows may be anything, or nothing.
    for rest in [&[][..], &[1, 2, 3], &[0xff; 100]] {
        let bytes = [&[0, 7][..], rest].concat();
        assert_eq!(decode(&bytes), Err(DecodeError::Version { board: 7 }));
    }
    assert_eq!(decode(&[0, 0xff, 0xff, 3]), Err(DecodeError::Version { board: 65_535 }));
    assert_eq!(
        DecodeError::Version { board: 7 }.to_string(),
        "the board sends records of version 7, this program reads version 9: flash the image of this checkout, or use the `footfall` \
         of the checkout that the board's image was built from"
    );
}

#[test]
fn bytes_that_are_no_record_are_refused_in_words() {
    for (bytes, words) in [
        (&[][..], "record of 0 bytes; allowed are 1 to 357"),
        (
            &[12, 1, 2],
            "unknown record kind 12 (3 bytes); version 9 has the kinds 0 boot, 1 refused, 2 change, 3 inputs, 4 frame, 5 edge, 6 cost, \
             7 environment, 8 answered, 9 port, 10 settings, 11 conditions",
        ),
        (&[0xff], "unknown record kind 255 (1 bytes)"),
        (&[5, 7], "edge record ends inside a field after 2 bytes; allowed is a whole record of version 9"),
        (&[0], "boot record ends inside a field after 1 bytes"),
        (&[5, 7, 5, 2, 0], "edge record of 5 bytes holds a value that no field of version 9 can have"),
        (&[2, 7, 8, 0], "change record of 4 bytes holds a value"),
        (&[2, 7, 5, 33], "change record of 4 bytes holds a value"),
        // A gait beyond the list.
        (
            &[10, 7, 1, 2, 0x90, 0x4e, 0xd0, 0x0f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xd0, 0x0f],
            "settings record of 19 bytes holds a value",
        ),
        (&[3, 1, 1, 0, 0, 1, 0x80, 0x20, 0], "inputs record of 9 bytes holds a value"),
        // Eleven calls.
        (&[&[3, 1, 11][..], &[0; 66]].concat(), "inputs record of 69 bytes holds a value"),
        (&[5, 7, 5, 1, 0, 9, 9], "edge record of 7 bytes; this one ends after 5, allowed is nothing behind it"),
    ] {
        let error = decode(bytes).unwrap_err().to_string();
        assert!(error.starts_with(words), "{bytes:02x?}: {error}");
    }
}

#[test]
fn every_truncation_is_refused() {
    for (record, bytes) in examples() {
        for length in 1..bytes.len() {
            let kind = record.kind();
            assert_eq!(decode(&bytes[..length]), Err(DecodeError::Truncated { kind, length }));
        }
        let longer = [&bytes[..], &[0]].concat();
        let (kind, length, record) = (record.kind(), longer.len(), bytes.len());
        assert_eq!(decode(&longer), Err(DecodeError::Trailing { kind, length, record }));
    }
}

#[test]
fn the_longest_record_fills_the_buffer() {
    let action = Action::Set { parameter: Parameter::Speed, thousandths: i32::MIN };
    let most = Call {
        codes: vec(&[u16::MAX; 4]),
        reference: u16::MAX,
        elapsed: 255,
        flags: Flags::from_bits(Flags::ALL).unwrap(),
        watchdog_hz: Some(u32::MAX),
        request: Some(Request { number: u16::MAX, action }),
    };
    let inputs = Record::Inputs(Inputs { first_tick: u32::MAX, calls: vec(&vec![most; CALLS]) });
    let mut buffer = [0; MAX_BYTES + 1];
    assert_eq!(encode(&inputs, &mut buffer).unwrap().len(), MAX_BYTES);
    for length in 0..MAX_BYTES {
        assert_eq!(encode(&inputs, &mut buffer[..length]), None);
    }
    let refused = Record::Refused(Refused::new(Subject::Arming, "x".repeat(500)));
    assert!(encode(&refused, &mut [0; MAX_BYTES]).is_some());
}

#[test]
fn a_sample_comes_back_whole() {
    for bits in 0..=Flags::ALL {
        // A debugger that is refused is attached.
        let Some(flags) = Flags::from_bits(bits) else {
            assert_eq!(bits >> 9 & 3, 2);
            continue;
        };
        let watchdog_hz = (bits % 3 == 0).then_some(bits.into());
        let request = (bits % 2 == 0).then_some(Request { number: bits, action: Action::Undo });
        let call = Call { codes: vec(&[1, 2, 3, 4]), reference: 9, elapsed: 255, flags, watchdog_hz, request };
        let sample = call.sample();
        assert_eq!((Flags::of(&sample).bits(), Call::of(&sample, 4)), (bits, call));
    }
    let many = Sample { elapsed: 1_000, ..Sample::default() };
    assert_eq!((Call::of(&many, 1).elapsed, Call::of(&many, 9).codes.len()), (255, 4));
}
