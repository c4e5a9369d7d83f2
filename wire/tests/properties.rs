//! Every record makes an exact round trip, and no bytes make the decoder panic.

use cpg_core::entrainment::{Lock, SensorFault};
use hgod_adc::Validity;
use joint_loop::tuning::{Action, Outcome, Parameter, Request, Settings as Values};
use joint_loop::{Cause, SENSORS, SupervisorState};
use joint_units::{Joint, PulseMicros};
use proptest::prelude::*;
use proptest::sample::select;
use wire::*;

/// Any bits, those that are not numbers included.
fn float() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

fn few<T: std::fmt::Debug + Clone, const N: usize>(
    item: impl Strategy<Value = T>,
) -> impl Strategy<Value = heapless::Vec<T, N>> {
    prop::collection::vec(item, 0..=N).prop_map(|items| heapless::Vec::from_slice(&items).expect("N at most"))
}

fn text<const N: usize>() -> impl Strategy<Value = heapless::String<N>> {
    "\\PC{0,5}".prop_map(|text| heapless::String::try_from(text.as_str()).unwrap_or_default())
}

fn record_id() -> impl Strategy<Value = Option<RecordId>> {
    prop::option::of(("\\PC{0,6}", any::<u32>()).prop_map(|(name, crc)| RecordId::new(&name, crc)))
}

fn boot() -> impl Strategy<Value = Record> {
    let names = (text(), text(), select(&Reset::ALL[..]));
    let numbers = (any::<u32>(), any::<u16>(), float(), (record_id(), record_id(), record_id()));
    let last = (prop::array::uniform4(any::<u16>()), any::<bool>(), any::<u32>())
        .prop_map(|(pulses_us, on, cut)| LastOutputs { pulses_us, on, cut });
    let last = prop::option::of(last);
    let levels = prop::array::uniform2(any::<u8>()).prop_map(|[level, wanted]| BrownOut { level, wanted });
    let image = (prop::option::of(any::<bool>()), levels);
    (names, numbers, any::<bool>(), any::<bool>(), last, image).prop_map(
        |(names, numbers, sensor_required, shadow, last, image)| {
            let (sealed, brown_out) = image;
            let ((board, chip, reset), (streak, reference_cal, min_supply_v, (generator, sensors, robot))) =
                (names, numbers);
            Record::Boot(Boot {
                version: VERSION,
                board,
                chip,
                reset,
                streak,
                reference_cal,
                min_supply_v,
                sensor_required,
                generator,
                sensors,
                robot,
                shadow,
                last_outputs: last,
                sealed,
                brown_out,
            })
        },
    )
}

fn inputs() -> impl Strategy<Value = Record> {
    let flags = any::<u16>().prop_filter_map("known bits", |bits| Flags::from_bits(bits & Flags::ALL));
    let rest = (flags, prop::option::of(any::<u32>()), prop::option::of(request()));
    let call = (few::<u16, SENSORS>(any::<u16>()), any::<u16>(), any::<u8>(), rest).prop_map(
        |(codes, reference, elapsed, (flags, watchdog_hz, request))| Call {
            codes,
            reference,
            elapsed,
            flags,
            watchdog_hz,
            request,
        },
    );
    (any::<u32>(), few::<Call, CALLS>(call))
        .prop_map(|(first_tick, calls)| Record::Inputs(Inputs { first_tick, calls }))
}

fn request() -> impl Strategy<Value = Request> {
    let set = (select(&Parameter::ALL[..]), any::<i32>())
        .prop_map(|(parameter, thousandths)| Action::Set { parameter, thousandths });
    let trim = select(&Joint::ALL[..]).prop_map(|joint| Action::Trim { joint });
    let jog = any::<u16>().prop_map(|pulse| Action::Jog { pulse: PulseMicros(pulse) });
    let action = prop_oneof![Just(Action::Stop), Just(Action::Undo), set, trim, jog];
    (any::<u16>(), action).prop_map(|(number, action)| Request { number, action })
}

fn frame() -> impl Strategy<Value = Record> {
    let reading =
        (float(), select(&Validity::ALL[..])).prop_map(|(angle_rad, validity)| Reading { angle_rad, validity });
    let follow =
        (select(&Lock::ALL[..]), prop::option::of(select(&SensorFault::ALL[..])), prop::array::uniform3(float()))
            .prop_map(|(state, fault, [phase_error_rad, stride_s, confidence])| Follow {
                state,
                fault,
                phase_error_rad,
                stride_s,
                confidence,
            });
    let head = (any::<u32>(), any::<u32>(), select(&SupervisorState::ALL[..]), select(&Cause::ALL[..]));
    let middle =
        (prop::array::uniform4(prop::option::of(reading)), prop::option::of(follow), prop::array::uniform4(float()));
    let tail = (prop::array::uniform4(any::<u16>()), prop::array::uniform4(any::<u32>()), any::<u8>(), any::<u64>());
    (head, middle, tail).prop_map(|(head, (sensors, following, setpoints_rad), tail)| {
        let ((tick, seq, state, cause), (pulses_us, counters, limited, setpoint_hash)) = (head, tail);
        let [late, missed, overruns, limited_ticks] = counters;
        Record::Frame(Frame {
            tick,
            seq,
            state,
            cause,
            sensors,
            following,
            setpoints_rad,
            pulses_us,
            late,
            missed,
            overruns,
            limited,
            limited_ticks,
            setpoint_hash,
        })
    })
}

/// Any value that each parameter allows.
fn settings() -> impl Strategy<Value = Record> {
    (prop::array::uniform3(any::<u32>()), prop::array::uniform12(0.0..=1.0)).prop_map(
        |([tick, generator, robot], shares)| {
            let values =
                Parameter::ALL.into_iter().zip(shares).fold(Values::default(), |values, (parameter, share)| {
                    let [least, most, _] = parameter.range();
                    let thousandths = least + (f64::from(most - least) * share) as i32;
                    let step = if parameter.is_whole() { 1_000 } else { 1 };
                    values.with(parameter, thousandths / step * step).expect("inside its range")
                });
            Record::Settings(Settings { tick, generator, robot, values })
        },
    )
}

fn record() -> impl Strategy<Value = Record> {
    let refused = (select(&Subject::ALL[..]), "\\PC{0,200}")
        .prop_map(|(subject, reason)| Record::Refused(Refused::new(subject, reason)));
    let change = (any::<u32>(), select(&SupervisorState::ALL[..]), select(&Cause::ALL[..]))
        .prop_map(|(tick, state, cause)| Record::Change(Change { tick, state, cause }));
    let edge = (any::<u32>(), any::<i32>(), any::<bool>(), any::<bool>())
        .prop_map(|(tick, offset_us, high, lost_before)| Record::Edge(Edge { tick, offset_us, high, lost_before }));
    let cost = prop::array::uniform6(any::<u32>()).prop_map(|[a, b, c, d, e, f]| {
        Record::Cost(Cost {
            longest_cycles: a,
            latest_start_us: b,
            dropped: c,
            stack_used: d,
            stack_size: e,
            truncated: f,
        })
    });
    let warnings = (0..16_u8).prop_filter_map("known bits", Warnings::from_bits);
    let volts = prop::array::uniform2(prop::option::of(float()));
    let environment = (volts, prop::option::of(any::<u32>()), any::<bool>(), warnings).prop_map(
        |([die_c, supply_v], watchdog_hz, debugger, warnings)| {
            Record::Environment(Environment { die_c, supply_v, watchdog_hz, debugger, warnings })
        },
    );
    let answered = (any::<u32>(), any::<u16>(), select(&Outcome::ALL[..]))
        .prop_map(|(tick, number, outcome)| Record::Answered(Answered { tick, number, outcome }));
    let port = prop::array::uniform5(any::<u32>()).prop_map(|[a, b, c, d, e]| {
        Record::Port(Port { requests: a, malformed: b, other_version: c, too_many: d, not_sent: e })
    });
    let validities =
        (any::<u32>(), prop::array::uniform8(any::<u32>())).prop_map(|(changes, bad)| Validities { changes, bad });
    let conditions = (any::<u32>(), any::<u32>(), prop::array::uniform4(prop::option::of(validities)))
        .prop_map(|(tick, supply_dips, sensors)| Record::Conditions(Conditions { tick, supply_dips, sensors }));
    prop_oneof![
        conditions,
        boot(),
        refused,
        change,
        inputs(),
        frame(),
        edge,
        cost,
        environment,
        answered,
        port,
        settings()
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn every_record_makes_an_exact_round_trip(record in record()) {
        let mut buffer = [0; MAX_BYTES];
        let bytes = encode(&record, &mut buffer).expect("it fits");
        let back = decode(bytes).expect("a record");
        // By their bytes: a number that is not one is not equal to itself.
        let mut again = [0; MAX_BYTES];
        prop_assert_eq!(encode(&back, &mut again), Some(bytes));
        prop_assert_eq!(format!("{back:?}"), format!("{record:?}"));
    }

    #[test]
    fn no_truncation_and_no_addition_is_a_record(record in record()) {
        let mut buffer = [0; MAX_BYTES + 1];
        let length = encode(&record, &mut buffer).expect("it fits").len();
        for short in 0..length {
            prop_assert!(decode(&buffer[..short]).is_err(), "{} of {} bytes", short, length);
        }
        prop_assert!(decode(&buffer[..=length]).is_err());
    }
}

/// 200,000 strings of random bytes; half of them begin as a record does.
#[test]
fn no_bytes_panic() {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed
    };
    let mut accepted = 0;
    for round in 0..200_000_u32 {
        let length = random() as usize % (MAX_BYTES + 8);
        let mut bytes: Vec<u8> = (0..length).map(|_| (random() >> 24) as u8).collect();
        if let (0, Some(first)) = (round % 2, bytes.first_mut()) {
            *first %= 10;
        }
        if let Ok(record) = decode(&bytes) {
            accepted += 1;
            // What is accepted is what would be sent, or a longer form of the same numbers.
            let mut buffer = [0; MAX_BYTES];
            let written = encode(&record, &mut buffer).expect("it fits");
            assert!(written.len() <= bytes.len());
        }
    }
    println!("{accepted} of 200000 strings are records");
}
