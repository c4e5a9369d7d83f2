//! Headers of oscilloscopes and loggers as their programs write them: times and volts equal the printed numbers to the last digit, and
//! volts are never taken for angles.

mod support;

use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions, Rules, condition};
use joint_units::Volts;
use support::calibration;

const SIGLENT: &str = "Record Length,Analog:140000\nSample Interval,CH1:0.0000020000000\nVertical Units,CH1:V,,,\nVertical Scale,CH1:0.50,,,\nVertical Offset,CH1:-1.00000,,,\nHorizontal Units,us,,,\nHorizontal Scale,0.0020000000000\nModel Number,SDS1202X-E\nSerial Number,0\nSoftware Version,1.3.26\nSource,CH1\nSecond,Volt\n0.00000000000,1.16000\n0.00000200000,1.18000\n0.00000400000,1.20000\n";
const RIGOL_STEPS: &str = "CH1,CH2,Start,Increment,\nVolt,Volt,-5.50000e+00,5.00000e-02\n8.00000e-01,2.52000e+01,\n8.20000e-01,2.48000e+01,\n";
const RIGOL_BLANKS: &str = "-1.18e-07   8.00e-01\n-1.17e-07   8.40e-01\n-1.16e-07   1.20e+00\n";
const SALEAE: &str = "Time [s],ADC,FUENTE CORRIENTE\n0.000067442,0.612,-0.011\n0.000195442,0.617,-0.010\n";
const KEYSIGHT: &str =
    "sec,Volt1,Volt2,Volt3\n-5.000000E-03,8.054398E-01,1.1,1.2\n-4.999000E-03,8.154398E-01,1.1,1.2\n";
const KEYSIGHT_AXIS: &str = "x_axis,channel_2\n-4.992,0.803\n-4.991,0.8112\n";
const KEYSIGHT_UNITS: &str = "x-axis,1\nsecond,Volt\n-5.0E-03,+8.05E-01\n-4.5E-03,+8.15E-01\n";
const PICO: &str =
    "Time,Channel A\n(ms),(mV)\n\n-0.10000000,812.34500000\n0.00000000,815.10000000\n0.10000000,817.77700000\n";

/// Header, channel, times in seconds, volts.
type Case = (&'static str, &'static str, &'static str, &'static [f64], &'static [f64]);
const CASES: [Case; 9] = [
    ("Siglent", SIGLENT, "CH1", &[0.0, 0.000_002, 0.000_004], &[1.16, 1.18, 1.2]),
    ("Rigol, start and increment", RIGOL_STEPS, "CH1", &[-5.5, -5.45], &[0.8, 0.82]),
    ("Rigol, blanks", RIGOL_BLANKS, "CH1", &[-1.18e-7, -1.17e-7, -1.16e-7], &[0.8, 0.84, 1.2]),
    ("Rigol, blanks, by number", RIGOL_BLANKS, "2", &[-1.18e-7, -1.17e-7, -1.16e-7], &[0.8, 0.84, 1.2]),
    ("Saleae", SALEAE, "ADC", &[0.000_067_442, 0.000_195_442], &[0.612, 0.617]),
    ("Keysight, one line", KEYSIGHT, "Volt1", &[-0.005, -0.004_999], &[0.805_439_8, 0.815_439_8]),
    ("Keysight, axis", KEYSIGHT_AXIS, "channel_2", &[-4.992, -4.991], &[0.803, 0.8112]),
    ("Keysight, units", KEYSIGHT_UNITS, "CH1", &[-0.005, -0.0045], &[0.805, 0.815]),
    ("PicoScope", PICO, "Channel A", &[-0.0001, 0.0, 0.0001], &[0.812_345, 0.8151, 0.817_777]),
];

fn read(text: &str, map: &str, change: impl FnOnce(&mut ReadOptions<'_>)) -> Result<RawJoints, String> {
    let calibration = calibration();
    let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    if !map.is_empty() {
        how.add_map(map).unwrap();
    }
    change(&mut how);
    open::of_bytes("a.csv", text.as_bytes(), &how).map_err(|error| error.to_string())
}

fn angles(volts: &[f64]) -> Vec<f64> {
    let calibration = calibration();
    volts.iter().map(|&volts| f64::from(calibration.angle(Volts(volts as f32)).unwrap().degrees())).collect()
}

fn left_knee(raw: &RawJoints) -> &[f64] {
    &raw.joints[2].as_ref().unwrap().angle_deg
}

#[test]
fn times_and_volts_equal_the_printed_numbers() {
    for (name, text, channel, times, volts) in CASES {
        for text in [text.to_owned(), text.replace('\n', "\r\n")] {
            let raw = read(&text, &format!("left_knee={channel}"), |_| ()).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(raw.time_s, times, "{name}");
            assert_eq!(left_knee(&raw), angles(volts), "{name}");
        }
    }
}

#[test]
fn no_volts_become_angles_without_a_calibration() {
    for (name, text, channel, ..) in CASES {
        // Enough rows for a unit to be inferred from.
        let mut text = text.to_owned();
        let row = text.lines().last().unwrap().to_owned() + "\n";
        text += &row.repeat(30);
        for unit in [None, Some(AngleUnit::Degrees)] {
            let read = read(&text, &format!("left_knee={channel}"), |how| {
                (how.calibration, how.unit) = (None, unit);
                if name.starts_with("Rigol, blanks") {
                    how.time = Some("1".into());
                    how.map[0].1 = "2".into();
                }
            });
            match read {
                // A caller who names the unit of a column without one is obeyed.
                Ok(_) => assert!(unit.is_some() && (name.starts_with("Saleae") || name.contains("blanks")), "{name}"),
                Err(error) => assert!(error.contains("--calibration"), "{name}: {error}"),
            }
        }
    }
}

/// The header's own counts and screen units do not matter; a step that differs from the announced one is reported.
#[test]
fn a_siglent_header_is_compared_with_its_rows() {
    let notes = |text: &str| read(text, "left_knee=CH1", |_| ()).unwrap().notes;
    let said = notes(SIGLENT);
    assert!(said.len() == 1 && said[0].starts_with("`Record Length`: the header announces 140000 rows"), "{said:?}");
    let said = notes(&SIGLENT.replace("CH1:0.0000020000000", "CH1:0.002").replace("140000", "3"));
    assert!(said.len() == 1 && said[0].starts_with("`Sample Interval` announces 0.002 s, but the rows"), "{said:?}");
}

#[test]
fn a_calibration_is_used_or_refused() {
    let rows = "0,10,1\n0.01,11,1\n0.02,12,1\n";
    let table = |header: &str| format!("{header}\n{rows}");
    // Degrees or radians by name.
    for (header, said) in [("time_s,left_knee_deg,x", "degrees"), ("time_s,left_knee [rad],x", "radians")] {
        let error = read(&table(header), "", |_| ()).unwrap_err();
        assert!(error.starts_with("a.csv:1: column 2 `left_knee"), "{error}");
        assert!(error.contains(&format!("no column is in volts: the file says that this one is {said}")), "{error}");
    }
    // No unit: volts, with a note.
    let raw = read("time_s,left_knee\n0,0.7\n0.01,0.9\n0.02,1.1\n", "", |_| ()).unwrap();
    assert_eq!(left_knee(&raw), angles(&[0.7, 0.9, 1.1]));
    assert_eq!(raw.notes, ["`left_knee` names no unit; it is read as volts, because a calibration is given."]);
    // Millivolts.
    for header in ["time_s,knee (mV)", "time_s,knee_mV", "time_s,left_knee [mV]"] {
        let raw = read(&format!("{header}\n0,700\n0.01,900\n0.02,1100\n"), "left_knee=2", |_| ()).unwrap();
        assert_eq!(left_knee(&raw), angles(&[0.7, 0.9, 1.1]), "{header}");
    }
    let raw = read("time_s,knee (mV)\n0,700\n0.01,900\n", "", |_| ()).unwrap();
    assert!(raw.notes[0].contains("names no side; it is read as left_knee"), "{:?}", raw.notes);
    // Angles go before volts of the same joint; a speed is neither.
    let both = "time_s,left_knee (mV),left_knee_deg,left_knee_v\n0,700,10,3\n0.01,900,11,3\n";
    assert_eq!(left_knee(&read(both, "", |how| how.calibration = None).unwrap()), [10.0, 11.0]);
    // A unit and a calibration for one column.
    let error = read("time_s,left_knee\n0,0.7\n0.01,0.9\n", "", |how| how.unit = Some(AngleUnit::Radians)).unwrap_err();
    assert!(error.contains("both `--calibration` and `--unit radians` are given"), "{error}");
    let error =
        read("time_s,left_knee (mV)\n0,700\n0.01,900\n", "", |how| how.unit = Some(AngleUnit::Degrees)).unwrap_err();
    assert!(error.contains("both `--calibration` and `--unit degrees` are given"), "{error}");
    // One column in volts, one in degrees, one without unit.
    let mixed = "time_s,knee (V),left_hip_deg,right_hip\n0,0.7,10,20\n0.01,0.9,11,21\n";
    let error = read(mixed, "left_knee=2", |_| ()).unwrap_err();
    assert!(
        error.contains("column 4 `right_hip`: the unit of the angles is unknown, and another column is in volts"),
        "{error}"
    );
    let raw = read(mixed, "left_knee=2", |how| how.unit = Some(AngleUnit::Degrees)).unwrap();
    assert_eq!(left_knee(&raw), angles(&[0.7, 0.9]));
    assert_eq!(raw.joints[1].as_ref().unwrap().angle_deg, [20.0, 21.0]);
    // OpenSim and C3D hold angles.
    let mot = support::mot(&support::walk(), 1, "\t", true);
    let c3d = support::c3d_of_angles(support::c3d_writer::Format::Intel, None).bytes();
    let calibration = calibration();
    let how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    for (name, bytes) in
        [("a.mot", mot.as_bytes()), ("a.mot", mot.replace("inDegrees", "x").as_bytes()), ("a.c3d", &c3d)]
    {
        let error = open::of_bytes(name, bytes, &how).unwrap_err().to_string();
        assert!(error.contains("a calibration is given (`--calibration`), but no column is in volts"), "{error}");
    }
}

/// A current clamp beside the goniometer, and a map that names the times.
#[test]
fn what_is_neither_an_angle_nor_volts_is_refused() {
    for unit in ["(mA)", "(kV)", "Pa"] {
        let text = format!("Time,Channel A\n(ms),{unit}\n\n0,812.345\n0.1,815.1\n0.2,817.777\n");
        let error = read(&text, "left_knee=Channel A", |_| ()).unwrap_err();
        assert!(error.starts_with("a.csv:2: column 2 `Channel A`: `the unit` is `"), "{error}");
        assert!(error.ends_with("allowed is degrees, radians, V, mV or uV"), "{error}");
    }
    let error = read("time_s,knee\n0,1\n0.01,2\n", "left_knee=time_s", |_| ()).unwrap_err();
    assert!(error.contains("column 1 `time_s`: the column of the times is mapped to left_knee"), "{error}");
}

/// A pin has the divided volts of the sensor; an oscilloscope measures at the sensor.
#[test]
fn the_divider_of_a_calibration_is_for_pins() {
    let halved = |how: &mut ReadOptions<'_>| how.divider = Some(2.0);
    let raw = read("time_s,PA1\n0,0.4\n0.01,0.5\n", "left_knee=PA1", halved).unwrap();
    assert_eq!(left_knee(&raw), angles(&[0.8, 1.0]));
    assert!(raw.notes.iter().any(|note| note.contains("multiplied by 2, the divider of the calibration")));
    let raw = read("time_s,knee (V)\n0,0.8\n0.01,1.0\n", "left_knee=2", halved).unwrap();
    assert_eq!(left_knee(&raw), angles(&[0.8, 1.0]));
    assert!(raw.notes.iter().any(|note| note.contains("read as volts at the sensor")), "{:?}", raw.notes);
}

#[test]
fn a_percent_of_a_cycle_is_a_time() {
    for header in ["time", "percent", "% gait cycle"] {
        let rows: String = (0..=100).map(|n| format!("{n},{}\n", 30.0 + f64::from(n % 50))).collect();
        let raw = read(&format!("{header},left_knee_deg\n{rows}"), "", |how| how.calibration = None).unwrap();
        assert_eq!((raw.time_s[0], raw.time_s[100]), (0.0, 100.0));
        assert!(
            raw.notes.iter().any(|note| note.contains("runs from 0 to 100, as percent of a cycle")),
            "{:?}",
            raw.notes
        );
    }
    let rows: String = (0..=120).map(|n| format!("{},{}\n", 0.1 * f64::from(n), 30.0 + f64::from(n % 50))).collect();
    let error = read(&format!("time [%],left_knee_deg\n{rows}"), "", |how| how.calibration = None).unwrap_err();
    assert!(error.contains("`time [%]` is from 0 to 12; allowed is one cycle"), "{error}");
}

#[test]
fn frames_need_a_rate_and_times_refuse_one() {
    let frames = "Frame,left_knee_deg\n1,5\n2,6\n4,7\n";
    let no_calibration = |text: &str, map: &str, rate_hz: Option<f64>| {
        read(text, map, |how| (how.calibration, how.rate_hz) = (None, rate_hz))
    };
    let error = no_calibration(frames, "", None).unwrap_err();
    assert!(error.starts_with("a.csv:1: column 1 `Frame`: the column counts frames; allowed is with"), "{error}");
    assert!(error.contains("--rate HZ"), "{error}");
    assert_eq!(no_calibration(frames, "", Some(100.0)).unwrap().time_s, [0.01, 0.02, 0.04]);
    assert_eq!(
        no_calibration(frames, "time=Frame", Some(120.0)).unwrap().time_s,
        [1.0 / 120.0, 2.0 / 120.0, 4.0 / 120.0]
    );
    // Rows without a time.
    let rows = "left_knee_deg,x\n5,0\n6,0\n7,0\n";
    assert!(no_calibration(rows, "", None).unwrap_err().contains("`--rate HZ` for rows at equal time steps"));
    assert_eq!(no_calibration(rows, "", Some(50.0)).unwrap().time_s, [0.0, 0.02, 0.04]);
    let bare = "5 0\n6 0\n7 0\n";
    let raw = read(bare, "left_knee=1", |how| {
        (how.calibration, how.rate_hz, how.unit) = (None, Some(50.0), Some(AngleUnit::Degrees));
    });
    assert_eq!(left_knee(&raw.unwrap()), [5.0, 6.0, 7.0]);
    // Times of the file's own.
    for text in [SIGLENT, RIGOL_STEPS] {
        let error = no_calibration(text, "left_knee=CH1", Some(100.0)).unwrap_err();
        assert!(error.contains("a rate is given (`--rate`), but the file has its own time"), "{error}");
    }
    // A rate that agrees with the times replaces them, another one is an error.
    let mot = support::mot(&support::walk(), 1, "\t", true);
    for text in [mot.as_str(), "time_s,left_knee_deg\n0,5\n0.01,6\n0.01,7\n0.02,8\n"] {
        let rate_hz = if text == mot { 150.0 } else { 200.0 };
        let raw = no_calibration(text, "", Some(rate_hz)).unwrap();
        assert!(
            raw.time_s.windows(2).all(|pair| (pair[1] - pair[0] - 1.0 / rate_hz).abs() < 1e-12),
            "{:?}",
            raw.time_s
        );
        assert!(raw.notes.iter().any(|note| note.contains("as requested; `time")), "{:?}", raw.notes);
        let error = no_calibration(text, "", Some(50.0)).unwrap_err();
        assert!(
            error.contains("a rate is given (`--rate 50`), but the times of `time") && error.contains("Hz"),
            "{error}"
        );
    }
}

#[test]
fn times_in_any_unit_are_exact() {
    for (header, fields, times) in [
        ("time_ms", ["1.1", "12.3", "23.5"], [0.0011, 0.0123, 0.0235]),
        ("Time [us]", ["100", "1.7e3", "3500"], [0.0001, 0.0017, 0.0035]),
        ("time (µs)", ["100", "1.7e3", "3500"], [0.0001, 0.0017, 0.0035]),
        ("time_ns", ["7", "1000", "2000.5"], [7e-9, 1e-6, 2.0005e-6]),
        ("seconds", ["0.1", "0.2", "0.3"], [0.1, 0.2, 0.3]),
        ("in s", ["0.1", "0.2", "0.3"], [0.1, 0.2, 0.3]),
    ] {
        let rows: String = fields.iter().map(|field| format!("{field},5\n")).collect();
        let raw = read(&format!("{header},left_knee_deg\n{rows}"), "", |how| how.calibration = None).unwrap();
        assert_eq!(raw.time_s, times, "{header}");
    }
}

/// Reads a text without options.
fn plain(text: &str) -> Result<RawJoints, String> {
    open::of_bytes("a.csv", text.as_bytes(), &ReadOptions::default()).map_err(|error| error.to_string())
}

/// Milliseconds under the heading of seconds, and in formats that have seconds.
#[test]
fn times_that_are_no_seconds_of_a_gait_are_refused() {
    let rows = |step: u32| -> String { (0..40).map(|n| format!("{},5\n", n * step)).collect() };
    for (heading, step, likely, right) in [
        ("time_s", 10, "milliseconds?", "`time_ms`"),
        ("time_s", 1, "milliseconds, or numbers of frames?", "`frame` with `--rate HZ`"),
        ("time", 5000, "microseconds?", "`time_us`"),
        ("time_ms", 10_000, "milliseconds?", "`time_ms`"),
    ] {
        let error = plain(&format!("{heading},left_knee_deg\n{}", rows(step))).unwrap_err();
        assert!(error.starts_with(&format!("a.csv:1: column 1 `{heading}`: read as seconds")), "{error}");
        assert!(error.contains(likely) && error.contains(right), "{error}");
    }
    let mot = format!(
        "walk\nversion=1\nnRows=40\nnColumns=2\ninDegrees=yes\nendheader\ntime\tknee_angle_l\n{}",
        rows(10).replace(',', "\t")
    );
    let raw = open::of_bytes("a.mot", mot.as_bytes(), &ReadOptions::default()).unwrap();
    let error = condition(&raw, &Rules::default()).unwrap_err().to_string();
    assert_eq!(
        error,
        "a.mot: the median time step is 10 s, too long for a gait (milliseconds?); allowed are times in seconds, or a heading with the right unit, such as `time_ms`"
    );
}

#[test]
fn decimal_commas_are_named() {
    let quoted = "time_s,left_knee_deg\n\"0,00\",\"5,1\"\n\"0,01\",\"5,2\"\n";
    let error = plain(quoted).unwrap_err();
    assert!(
        error.starts_with("a.csv:2: column 1 `time_s`: `0,00` has a decimal comma; allowed is a decimal point"),
        "{error}"
    );
    let bare = "time_s,left_knee_deg\n0,00,5,1\n0,01,5,2\n";
    let error = plain(bare).unwrap_err();
    assert!(
        error.starts_with("a.csv:2: 4 fields of whole numbers; allowed are 2") && error.contains("decimal comma"),
        "{error}"
    );
    let thousands = "time_ms,left_knee_deg\n\"1,000.5\",5\n\"1,001.5\",5\n";
    assert!(plain(thousands).unwrap_err().contains("`1,000.5` is not a number"));
}

/// A number in a map is that of the column, with that of the time, in CSV and in files of oscilloscopes.
#[test]
fn numbers_in_a_map_are_those_of_columns() {
    for (text, number, volts) in
        [(SALEAE, 2, 0.612), (KEYSIGHT, 2, 0.805_439_8), (KEYSIGHT, 4, 1.2), (SIGLENT, 2, 1.16)]
    {
        let raw = read(text, &format!("left_knee={number}"), |_| ()).unwrap();
        assert_eq!(left_knee(&raw)[0], angles(&[volts])[0]);
    }
    let error = read(KEYSIGHT, "left_knee=1", |_| ()).unwrap_err();
    assert!(error.contains("the column of the times is mapped to left_knee"), "{error}");
    let error = read(KEYSIGHT, "left_knee=5", |_| ()).unwrap_err();
    assert!(error.contains("`Volt1` in column 2, `Volt2` in column 3, `Volt3` in column 4"), "{error}");
}
