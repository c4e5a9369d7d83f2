//! Calibration from rows: the whole way through the command line, against sensors whose curve is known.

mod page;

use footfall::cli;
use footfall::command::calibrate::fit;
use footfall::command::calibrate::fit::{Fit, LeftOut, Settings, What};
use footfall::command::calibrate::rows::{Reading, Row, Rows, Scale, parse};
use footfall::file::calibration_file;
use generator_file::toml_file::TomlFile;
use hgod_adc::{Calibration, Interpolation, OutOfTable, Reference, ReferenceConfig, Supply, rk09k};
use joint_units::{AdcCode, Radians, Volts};
use page::{check_structure, rows as page_rows};
use proptest::prelude::*;
use std::ffi::OsString;
use std::path::Path;

const SUPPLY: Volts = Volts(3.3);

/// A small generator of noise whose numbers are the same everywhere (splitmix64).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }

    /// Standard normal, as a sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// The published cubic's fraction of the supply at an angle: bisection of a rising curve.
fn rk09k_fraction(degrees: f64) -> f64 {
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let a = middle * 1023.0 - 512.0;
        let pivot = a * (0.2097 + a * (2.243e-6 + a * 1.095e-7));
        if pivot < degrees { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Rows of codes: each angle in turn, `count` samples with noise of `sd` codes, rounded as a converter does.
fn code_rows(angles: &[f64], count: usize, sd: f64, code_at: impl Fn(f64, usize) -> f64) -> String {
    let mut noise = Noise(7);
    let mut text = String::from("angle_deg,code\n");
    for (index, &angle) in angles.iter().enumerate() {
        for _ in 0..count {
            let code = (code_at(angle, index) + sd * noise.normal()).round().clamp(0.0, 4095.0);
            text += &format!("{angle},{code}\n");
        }
    }
    text
}

fn read(text: &str) -> Rows {
    let reading = Reading { scale: Scale::Supply(SUPPLY.0.into()), ..Reading::default() };
    parse("rows.csv", text.as_bytes(), &reading).unwrap()
}

fn steps(from: f64, to: f64, step: f64) -> Vec<f64> {
    let count = ((to - from) / step).round() as i64;
    (0..=count.abs()).map(|k| from + (to - from) * k as f64 / count.abs() as f64).collect()
}

fn up_and_down(from: f64, to: f64, step: f64) -> Vec<f64> {
    let mut angles = steps(from, to, step);
    angles.extend(angles.clone().iter().rev().skip(1));
    angles
}

fn reference() -> (Reference, Supply) {
    (ReferenceConfig::stm32f4(AdcCode(1502)).build().unwrap(), Supply::new(SUPPLY).unwrap())
}

/// The largest error of angle, volts by `volts_at`, code of 12 bit, volts, table, angle; every angle has to be in the table.
fn round_trip(table: &Calibration, (from, to): (f64, f64), volts_at: impl Fn(f64) -> f64) -> f64 {
    let (reference, supply) = reference();
    steps(from, to, 0.05)
        .into_iter()
        .map(|degrees| {
            let code = reference.code(Volts(volts_at(degrees) as f32), supply);
            let angle = table.angle(reference.volts(code, supply)).unwrap_or_else(|why| panic!("{degrees} is {why}"));
            (f64::from(angle.degrees()) - degrees).abs()
        })
        .fold(0.0, f64::max)
}

fn call(arguments: &[&str]) -> (u8, String) {
    match cli::call(
        std::iter::once("footfall").chain(["calibrate"]).chain(arguments.iter().copied()).map(OsString::from),
    ) {
        Ok(()) => (0, String::new()),
        Err(failure) => (failure.exit_code(), failure.to_string()),
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A fall of 100 codes for 10 degrees that dies out at the low angles: 3865, 3950, 3962 at 50, 40, 30 degrees, and on.
fn saturating(degrees: f64) -> f64 {
    let table = [(10.0, 3966.0), (20.0, 3964.0), (30.0, 3962.0), (40.0, 3950.0), (50.0, 3865.0), (60.0, 3750.0)];
    if degrees >= 60.0 {
        return 3750.0 - 12.5 * (degrees - 60.0);
    }
    let right = table.iter().position(|&(angle, _)| angle > degrees).unwrap_or(table.len() - 1).max(1);
    let ((a, at_a), (b, at_b)) = (table[right - 1], table[right]);
    at_a + (at_b - at_a) * (degrees - a) / (b - a)
}

#[test]
fn the_published_cubic_comes_back_through_a_12_bit_converter() {
    let code = |degrees: f64, _| rk09k_fraction(degrees) * 4095.0;
    let volts = |degrees: f64| rk09k_fraction(degrees) * f64::from(SUPPLY.0);
    for (sd, count, interpolation, bound) in [
        (0.0, 1, Interpolation::MonotoneCubic, 0.08),
        (1.0, 50, Interpolation::MonotoneCubic, 0.1),
        (2.0, 50, Interpolation::MonotoneCubic, 0.1),
        (2.0, 50, Interpolation::Linear, 0.1),
    ] {
        let rows = read(&code_rows(&steps(-50.0, 110.0, 10.0), count, sd, code));
        let fit = fit::fit(&rows, &Settings { interpolation, ..Settings::default() }).unwrap();
        let worst = round_trip(&fit.calibration, (-49.9, 109.9), volts);
        println!("RK09K, noise {sd} codes, {interpolation:?}: round trip {worst:.4} degrees at worst");
        assert!(worst < bound && bound < 0.3, "{worst} with noise of {sd}");
        assert!(fit.left_out.iter().all(Option::is_none));
        for outside in [-53.0, 113.0] {
            assert!(fit.calibration.angle(Volts(volts(outside) as f32)).is_err());
        }
        // One degree is 15 codes here.
        assert!((0.04..0.08).contains(&fit.code_deg), "{}", fit.code_deg);
        assert!(sd == 0.0 || (fit.noise_v.unwrap() * 4095.0 / 3.3 - sd).abs() < 0.15 * sd);
    }
}

/// Another way to the same curve: the authors' own table of codes of 10 bit and angles, at 5 V, with their headings.
#[test]
fn the_authors_own_table_is_taken_with_its_own_headings() {
    // Codes and pivot angles of the published table, as far as a joint goes.
    let published = "adc_10bit,voltage_v_at_5v_ref,pivot_angle_deg\n\
        256,1.2512,-55.373\n320,1.5640,-40.955\n384,1.8768,-27.034\n448,2.1896,-13.440\n512,2.5024,0.000\n\
        576,2.8152,13.459\n640,3.1281,27.108\n704,3.4409,41.120\n768,3.7537,55.667\n832,4.0665,70.922\n\
        896,4.3793,87.056\n960,4.6921,104.242\n1023,5.0000,122.353\n";
    let folder = tempfile::tempdir().unwrap();
    let (rows, out) = (folder.path().join("rows.csv"), folder.path().join("rk09k.toml"));
    std::fs::write(&rows, published).unwrap();
    let columns = ["--volts-column", "voltage_v_at_5v_ref", "--angle-column", "pivot_angle_deg"];
    assert_eq!(call(&[&[text(&rows), "-o", text(&out), "--name", "RK09K"], &columns[..]].concat()), (0, String::new()));
    let sensor = calibration_file::read(&out).unwrap();
    for (index, degrees) in steps(-55.0, 122.0, 0.25).into_iter().enumerate() {
        let volts = Volts((rk09k_fraction(degrees) * 5.0) as f32);
        let off = f64::from(sensor.calibration.angle(volts).unwrap().degrees()) - degrees;
        assert!(off.abs() < 0.05, "{off} at {degrees} ({index})");
    }
    assert!((rk09k::pivot(rk09k_fraction(87.056) as f32).degrees() - 87.056).abs() < 1e-3, "two inverses agree");
}

#[test]
fn a_saturated_end_is_left_out_and_reads_as_out_of_the_table() {
    let angles = up_and_down(10.0, 150.0, 10.0);
    for sd in [0.0, 1.0, 2.0] {
        let rows = read(&code_rows(&angles, 40, sd, |degrees, _| saturating(degrees)));
        let fit = fit::fit(&rows, &Settings { interpolation: Interpolation::Linear, ..Settings::default() }).unwrap();
        let out: Vec<(f64, LeftOut)> =
            fit.poses.iter().zip(&fit.left_out).filter_map(|(pose, why)| Some((pose.angle_deg, (*why)?))).collect();
        let (least, most) = fit.calibration.span();
        // Without noise the 40 degrees are outside of the flat end; 12 codes are also more than 4 standard deviations of 2.
        assert_eq!(out, [10.0, 20.0, 30.0].map(|angle| (angle, LeftOut::Saturated)), "noise {sd}");
        assert!((least.degrees() - 40.0).abs() < 0.01 && (most.degrees() - 150.0).abs() < 0.01);
        assert_eq!(fit.inside, 0);
        let volts = |degrees: f64| saturating(degrees) / 4095.0 * f64::from(SUPPLY.0);
        let worst = round_trip(&fit.calibration, (40.5, 149.5), volts);
        println!("saturated end, noise {sd} codes: round trip {worst:.4} degrees at worst");
        assert!(worst < 0.3, "{worst}");
        // Each code that the saturated poses can give, noise of 4 standard deviations and all.
        let (reference, supply) = reference();
        for code in (3962.0 - 4.0 * sd) as u16..=3975 {
            let said = fit.calibration.angle(reference.volts(AdcCode(code), supply));
            assert_eq!(said, Err(OutOfTable::Above), "code {code}");
        }
    }
}

/// With noise of 4 codes the 40 degrees, 12 codes from the flat end, are not distinguishable from it.
#[test]
fn an_angle_that_noise_could_take_for_a_saturated_one_is_left_out_too() {
    let rows = read(&code_rows(&up_and_down(10.0, 150.0, 10.0), 40, 4.0, |degrees, _| saturating(degrees)));
    let fit = fit::fit(&rows, &Settings::default()).unwrap();
    let at = |degrees: f64| fit.poses.iter().position(|pose| pose.angle_deg == degrees).unwrap();
    assert_eq!(fit.left_out[at(40.0)], Some(LeftOut::NearTheEnd));
    assert_eq!((fit.left_out[at(50.0)], fit.inside), (None, 0));
}

#[test]
fn both_ends_can_be_flat_and_the_converters_end_is_one() {
    let code = |degrees: f64, _| (2000.0 + 40.0 * (degrees - 40.0)).clamp(300.0, 4095.0);
    let rows = read(&code_rows(&steps(-30.0, 120.0, 10.0), 10, 1.0, code));
    let fit = fit::fit(&rows, &Settings::default()).unwrap();
    let whys: Vec<Option<LeftOut>> = fit.left_out.clone();
    // 300 is reached at -2.5 degrees, 4095 at 92.4. From -10 to 0 degrees the volts move again, but -10 reads as -20 does.
    let low = [LeftOut::Saturated, LeftOut::Saturated, LeftOut::NearTheEnd].map(Some);
    assert_eq!(whys[..3], low);
    assert!(whys[13..].iter().all(|why| *why == Some(LeftOut::Clipped)), "{whys:?}");
    assert!(whys[3..13].iter().all(Option::is_none), "{whys:?}");
    assert_eq!(fit.inside, 0);
}

/// Up lies 15 codes above down everywhere but at the ends, where the sweep turns; 15 codes are 0.857 degrees of 17.5 codes each.
#[test]
fn hysteresis_is_the_distance_of_the_sweeps() {
    let angles = up_and_down(0.0, 100.0, 10.0);
    let turn = angles.len() / 2;
    let code = |degrees: f64, index: usize| 1000.0 + 17.5 * degrees + if index <= turn { 7.5 } else { -7.5 };
    let fit = fit::fit(&read(&code_rows(&angles, 100, 1.0, code)), &Settings::default()).unwrap();
    let hysteresis = fit.hysteresis.unwrap();
    println!("hysteresis {hysteresis:?}");
    assert!((hysteresis.mean - 0.857).abs() < 0.04 && (hysteresis.largest - 0.857).abs() < 0.08, "{hysteresis:?}");
    // Of a row it is half of that, and the noise.
    assert!((fit.rms_deg - (0.4286_f64.powi(2) + (1.04_f64 / 17.5).powi(2)).sqrt()).abs() < 0.05, "{}", fit.rms_deg);
    let one_way = fit::fit(&read(&code_rows(&steps(0.0, 100.0, 10.0), 10, 1.0, code)), &Settings::default()).unwrap();
    assert_eq!(one_way.hysteresis, None);
}

#[test]
fn each_fault_of_the_rows_has_its_name_and_its_line() {
    let fault = |text: &str| {
        let fault = fit::fit(&read(text), &Settings::default()).unwrap_err();
        (fault.line, fault.what.to_string())
    };
    let head = "angle_deg,code\n";
    let straight = |degrees: f64, _: usize| 1000.0 + 20.0 * degrees;
    let (line, what) = fault(&format!("{head}0,1000\n0,1001\n10,1200\n"));
    assert_eq!((line, what.as_str()), (None, "too few poses: 2; allowed are 3 angles and more"));

    let (line, what) = fault(&code_rows(&steps(0.0, 90.0, 10.0), 10, 1.0, |_, _| 2048.0));
    assert!(line == Some(2) && what.starts_with("stuck: over 90.0 degrees"), "{what}");

    // A row of another angle among those of 30 degrees, which are lines 32 to 41.
    let text = code_rows(&steps(0.0, 90.0, 10.0), 10, 1.0, straight);
    let bad: Vec<&str> = text.lines().enumerate().map(|(k, row)| if k == 33 { "30,2700" } else { row }).collect();
    let (line, what) = fault(&bad.join("\n"));
    assert!(line == Some(32) && what.starts_with("unsteady: at 30 degrees"), "{line:?} {what}");

    // A sensor that turns back at 70 degrees: 70 and 80 have one voltage.
    let (line, what) =
        fault(&code_rows(&steps(0.0, 90.0, 10.0), 5, 1.0, |degrees, _| 1000.0 + 20.0 * degrees.min(140.0 - degrees)));
    assert!(line == Some(42) && what.starts_with("not monotone: from 70 to 80 degrees"), "{line:?} {what}");

    // Two angles that were written down the wrong way round.
    let (_, what) = fault(&code_rows(&[0.0, 10.0, 30.0, 20.0, 40.0], 5, 1.0, |_, index| 1000.0 + 200.0 * index as f64));
    assert!(what.starts_with("not monotone: from 20 to 30 degrees"), "{what}");

    let (line, what) = fault(&code_rows(&steps(0.0, 90.0, 10.0), 5, 0.0, |degrees, _| {
        1000.0 + 20.0 * if degrees < 40.0 { degrees } else { (degrees - 20.0).max(41.0) }
    }));
    assert!(line == Some(27) && what.starts_with("dead zone: from 40 to 50 degrees"), "{line:?} {what}");

    let (_, what) =
        fault(&code_rows(&[0.0, 10.0, 20.0, 30.0, 40.0], 5, 0.0, |degrees, _| 1000.0 + 20.0 * degrees.min(10.0)));
    assert!(what.starts_with("saturated: 3 of 5 poses") || what.starts_with("saturated: 4 of 5"), "{what}");

    // What the settings allow is refused by the table's own rule in the end.
    let tight = Settings { points: 2, ..Settings::default() };
    assert!(fit::fit(&read(&code_rows(&steps(0.0, 90.0, 10.0), 5, 1.0, straight)), &tight).is_ok());
    assert!(
        matches!(fit::fit(&read(head_only()), &tight), Err(fault) if matches!(fault.what, What::TooFewPoses { poses: 1 }))
    );
}

fn head_only() -> &'static str {
    "angle_deg,code\n5,5\n"
}

#[test]
fn a_bad_file_is_refused_with_line_and_column_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (rows, out) = (folder.path().join("rows.csv"), folder.path().join("knee.toml"));
    let (html, svg) = (folder.path().join("knee.html"), folder.path().join("knee.svg"));
    for (content, arguments, place, words) in [
        (&b""[..], &[][..], ": ", &["is empty"][..]),
        (b"angle_deg,volts\n", &[], ": ", &["has no rows"]),
        (b"angle,volts\n0,1\n", &[], ":1: ", &["no column of angles", "`angle_deg` or `angle_rad`"]),
        (b"angle_deg,angle_rad,volts\n0,0,1\n", &[], ":1: ", &["two columns of angles"]),
        (b"angle_deg,volts,volts\n0,1,1\n", &[], ":1: ", &["`volts` is there twice"]),
        (b"angle_deg,volts,code\n0,1,1\n", &[], ":1: ", &["two columns of the sensor's signal"]),
        (b"angle_deg,code\n0,1\n", &[], ":1: ", &["--supply VOLTS", "--vrefint-cal CODE"]),
        (b"angle_deg,code\n0,1\n", &["--vrefint-cal", "1502"], ":1: ", &["no column of the reference", "`vrefint`"]),
        (b"# x\nangle_deg,volts\n0,1\nx,1\n", &[], ":4: ", &["column 1 `angle_deg`", "`x` is not a number"]),
        (b"angle_deg,volts\n0,1\n1,inf\n", &[], ":3: ", &["column 2 `volts`", "`inf` is not finite"]),
        (b"angle_deg;volts\n0;1\n1;1,5\n", &[], ":3: ", &["column 2 `volts`", "with a decimal point"]),
        (b"angle_deg,volts\n0,1\n1,31\n", &[], ":3: ", &["column 2 `volts`", "31", "0 to 30 V"]),
        (b"angle_deg,volts\n0,1\n171,3\n", &[], ":3: ", &["column 1 `angle_deg`", "171", "-60 to 170 degrees"]),
        (b"angle_rad,volts\n0,1\n3.2,3\n", &[], ":3: ", &["column 1 `angle_rad`", "183.35 degrees", "-60 to 170"]),
        (b"angle_deg,code\n0,1\n1,4096\n", &["--supply", "3.3"], ":3: ", &["column 2 `code`", "0 to 4095"]),
        (
            b"angle_deg,code,vrefint\n0,1,1500\n1,4,0\n",
            &["--vrefint-cal", "1502"],
            ":3: ",
            &["column 3 `vrefint`", "code 0 of the internal reference"],
        ),
        (b"angle_deg,volts\n0,1\n1\n", &[], ":3: ", &["has 1 fields; allowed are 2"]),
        (b"angle_deg,volts,direction\n0,1,up\n1,1,left\n", &[], ":3: ", &["column 3 `direction`", "`up` or `down`"]),
        (b"angle_deg,volts\n0,1\n1,\xff\n", &[], ":3: ", &["is not text"]),
        (b"angle_deg,volts\n0,1\n10,1\n20,1\n", &[], ":2: ", &["column `volts`", "stuck"]),
        (b"angle_deg,volts\n0,1\n10,2\n20,1.5\n30,3\n", &[], ":4: ", &["column `volts`", "not monotone", "allowed"]),
    ] {
        std::fs::write(&rows, content).unwrap();
        let fixed = [text(&rows), "-o", text(&out), "--report", text(&html), "--svg", text(&svg)];
        let (code, said) = call(&[&fixed[..], arguments].concat());
        assert_eq!(code, 2, "{said}");
        assert!(said.starts_with(&format!("{}{place}", text(&rows))), "{said}");
        for word in words {
            assert!(said.contains(word), "{said} does not say {word}");
        }
        assert!(["allowed", "must be"].iter().any(|word| said.contains(word)), "{said}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "something was written");
    }
    std::fs::write(&rows, "angle_deg,volts\n0,1\n10,2\n20,3\n").unwrap();
    for arguments in [
        &["--points", "33"][..],
        &["--points", "1"],
        &["--date", "2026-02-30"],
        &["--name", ""],
        &["--divider", "0"],
        &["--supply", "5"],
        &["--vrefint-cal", "65535"],
        &["--supply", "3.3", "--vrefint-cal", "1502"],
        &["--guide"],
        &["--samples", "10"],
    ] {
        assert_eq!(call(&[&[text(&rows), "-o", text(&out)], arguments].concat()).0, 2, "{arguments:?}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "something was written");
    }
}

#[test]
fn the_command_writes_a_table_that_is_read_back_exactly_and_a_page_with_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let (rows, out) = (folder.path().join("rows.csv"), folder.path().join("knee.toml"));
    let (html, svg) = (folder.path().join("knee.html"), folder.path().join("knee.svg"));
    std::fs::write(&rows, code_rows(&up_and_down(10.0, 150.0, 10.0), 40, 1.0, |degrees, _| saturating(degrees)))
        .unwrap();
    let arguments = ["--supply", "3.3", "--divider", "2", "--name", "knee <3>", "--date", "2026-03-04", "--json"];
    let files = [text(&rows), "-o", text(&out), "--report", text(&html), "--svg", text(&svg)];
    assert_eq!(call(&[&files[..], &arguments].concat()), (0, String::new()));
    let written = std::fs::read_to_string(&out).unwrap();
    let file = calibration_file::parse_whole(&TomlFile::of_text("knee.toml", written.clone())).unwrap();
    let measured = file.measured.unwrap();
    assert_eq!(calibration_file::to_text(&file.sensor, Some(&measured)), written, "exact round trip");
    assert_eq!((measured.sensor.as_str(), measured.date.as_str()), ("knee <3>", "2026-03-04"));
    assert!(
        file.sensor.divider == 2.0 && (file.sensor.calibration.volts_span().1.0 - 3950.0 / 4095.0 * 6.6).abs() < 2e-3
    );
    assert!(measured.rms_deg > 0.05 && measured.worst_deg < 1.0 && measured.hysteresis.is_some(), "{measured:?}");
    // The same table comes of the same rows, and without a date the day is today's, whatever that is.
    let again = folder.path().join("again.toml");
    let arguments = [text(&rows), "-o", text(&again), "--supply", "3.3"];
    assert_eq!(call(&arguments).0, 0);
    assert!(calibration_file::read(&again).is_ok());
    let page = std::fs::read_to_string(&html).unwrap();
    assert!(page.contains("knee &lt;3&gt;, 2026-03-04") && page.contains("saturated: 10, 20, 30 degrees"), "{page}");
    // Its pictures are in the colours of the page, which a dark screen changes, and every column has a head.
    let all = check_structure(&page);
    let pictures = all.iter().filter(|element| element.attribute("role") == Some("img"));
    assert_eq!((pictures.count(), page.matches("fill=\"#").count()), (2, 0));
    assert!(page_rows(&all, "Poses").iter().all(|row| row.len() == 9) && page.contains(">left out</th>"));
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg"));
    // A single digit of a point.
    let changed = written.replacen("angle_deg = 60", "angle_deg = 61", 1);
    std::fs::write(&out, &changed).unwrap();
    let said = calibration_file::read(&out).unwrap_err().to_string();
    assert!(changed != written && said.contains("field `crc`: ") && said.contains("as computed from"), "{said}");
}

#[test]
fn the_supply_of_each_row_is_that_of_its_reference() {
    // The sensor stays where it is; the supply sags from 3.3 to 3.0 V, and every code rises with that.
    let mut text = String::from("angle_deg,code,vrefint\n");
    let (reference, _) = reference();
    let volts = |degrees: f64| 0.5 + 0.02 * degrees;
    for (k, degrees) in steps(0.0, 100.0, 10.0).into_iter().enumerate() {
        let supply = Supply::new(Volts(3.3 - 0.03 * k as f32)).unwrap();
        let code = reference.code(Volts(volts(degrees) as f32), supply);
        text += &format!("{degrees},{},{}\n", code.0, reference.vrefint(supply).0);
    }
    let reading = Reading { scale: Scale::Reference(reference), ..Reading::default() };
    let rows = parse("rows.csv", text.as_bytes(), &reading).unwrap();
    for row in &rows.rows {
        assert!((row.volts - volts(row.angle_deg)).abs() < 1.5e-3, "{row:?}");
    }
}

#[test]
fn the_guide_ends_in_the_same_fit() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("kept.csv");
    // What the guide keeps is what a file of rows is.
    let text = code_rows(&steps(0.0, 60.0, 10.0), 20, 1.0, |degrees, _| 900.0 + 20.0 * degrees);
    let codes: String = text.lines().skip(1).map(|row| format!("{}\n", row.split_once(',').unwrap().1)).collect();
    let plan =
        footfall::command::calibrate::guide::Plan { angles_deg: steps(0.0, 60.0, 10.0), samples: 20, most_sd: 8.0 };
    let (codes, answers) = (std::io::Cursor::new(codes), std::io::Cursor::new("\n".repeat(7)));
    let guided = footfall::command::calibrate::guide::ask(
        &plan,
        codes,
        footfall::command::calibrate::guide::Codes::Kept,
        answers,
        std::io::sink(),
    )
    .unwrap();
    assert_eq!(guided, text);
    std::fs::write(&kept, guided).unwrap();
    let out = folder.path().join("knee.toml");
    let path = kept.to_str().unwrap();
    assert_eq!(call(&[path, "-o", out.to_str().unwrap(), "--supply", "3.3"]), (0, String::new()));
}

/// What a person reads: which way the sensor goes, what noise had turned round, and where it is saturated.
#[test]
fn monotonicity_and_saturation_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (rows, out) = (folder.path().join("rows.csv"), folder.path().join("knee.toml"));
    let text_of = |angles: &[f64], sd: f64, code_at: &dyn Fn(f64, usize) -> f64| {
        std::fs::write(&rows, code_rows(angles, 40, sd, code_at)).unwrap();
        let mut footfall = std::process::Command::new(env!("CARGO_BIN_EXE_footfall"));
        let output =
            footfall.args(["calibrate", "--force", "--supply", "3.3"]).arg(&rows).arg("-o").arg(&out).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let text = text_of(&up_and_down(10.0, 150.0, 10.0), 1.0, &|degrees, _| saturating(degrees));
    assert!(text.contains("monotone: volts fall with the angle, no poses joined"), "{text}");
    assert!(text.contains("saturation: left out of the table: 10, 20, 30 degrees"), "{text}");
    // Poses that are nearer to each other than what noise leaves of their means.
    let text = text_of(&steps(0.0, 60.0, 0.2), 30.0, &|degrees, _| 600.0 + 25.0 * degrees);
    assert!(
        text.contains("monotone: volts rise with the angle, ") && text.contains(" poses joined because noise"),
        "{text}"
    );
    assert!(text.contains("saturation: none"), "{text}");
}

/// Volts of a smooth sensor: steps of random steepness, within a factor of 3, smoothed; rising or falling.
#[derive(Debug, Clone)]
struct Curve {
    amplitude: f64,
    turns: f64,
    falling: bool,
    span_v: f64,
}

impl Curve {
    /// Slope between 1 - amplitude and 1 + amplitude of the mean.
    fn volts(&self, degrees: f64) -> f64 {
        let x = (degrees + 20.0) / 140.0;
        let wave = std::f64::consts::TAU * self.turns;
        let y = x + self.amplitude / wave * (wave * x).sin();
        0.2 + self.span_v * if self.falling { 1.5 - y } else { y }
    }
}

fn curve() -> impl Strategy<Value = Curve> {
    (0.0_f64..0.5, 0.2_f64..1.5, any::<bool>(), 1.0_f64..2.2).prop_map(|(amplitude, turns, falling, span_v)| Curve {
        amplitude,
        turns,
        falling,
        span_v,
    })
}

fn noisy(curve: &Curve, step: f64, count: usize, sd_v: f64, seed: u64) -> Rows {
    let mut noise = Noise(seed);
    let mut rows = Vec::new();
    for angle_deg in up_and_down(-20.0, 120.0, step) {
        for _ in 0..count {
            let volts = curve.volts(angle_deg) + sd_v * noise.normal();
            rows.push(Row { line: rows.len() as u64 + 2, angle_deg, volts, clipped: false, direction: None });
        }
    }
    Rows { rows, signal: "volts".into(), code_v: 0.0, notes: vec![] }
}

/// The largest error of a table against the curve, between its ends.
fn off(fit: &Fit, curve: &Curve) -> f64 {
    let (low, high) = fit.calibration.span();
    steps(f64::from(low.degrees()) + 0.2, f64::from(high.degrees()) - 0.2, 0.25)
        .into_iter()
        .filter_map(|degrees| {
            let angle: Radians = fit.calibration.angle(Volts(curve.volts(degrees) as f32)).ok()?;
            Some((f64::from(angle.degrees()) - degrees).abs())
        })
        .fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Poses of 10 degrees, 40 rows with 1.6 mV (2 codes): the interpolation of the curve is off by 0.35 degrees at most, a mean
    /// of 40 rows by 4 standard errors of 1 mV, which at 140 degrees a volt and twice the mean slope is 0.28 degrees.
    #[test]
    fn any_smooth_monotone_curve_with_noise_is_recovered(curve in curve(), seed in any::<u64>()) {
        let fit = fit::fit(&noisy(&curve, 10.0, 40, 1.6e-3, seed), &Settings::default()).unwrap();
        prop_assert!(fit.left_out.iter().all(Option::is_none));
        let worst = off(&fit, &curve);
        prop_assert!(worst < 0.6, "{}", worst);
        prop_assert!((fit.noise_v.unwrap() - 1.6e-3).abs() < 2e-4);
        prop_assert!(fit.worst_pose_deg < 1e-2, "each pose is a point");
    }

    /// A pose every degree, noise of 5 mV that turns neighbours round: pooled, not refused, and 32 points suffice.
    #[test]
    fn noise_that_turns_neighbours_round_is_pooled(curve in curve(), seed in any::<u64>()) {
        let fit = fit::fit(&noisy(&curve, 1.0, 4, 5e-3, seed), &Settings::default());
        let fit = match fit { Ok(fit) => fit, Err(fault) => return Err(TestCaseError::fail(fault.what.to_string())) };
        prop_assert!(fit.calibration.points().len() <= 32);
        let worst = off(&fit, &curve);
        prop_assert!(worst < 3.0, "{}", worst);
    }

    /// Whatever the rows are, there is a table that the board accepts or a fault; what is written is read back.
    #[test]
    fn no_rows_panic(
        pairs in prop::collection::vec((-60.0_f64..170.0, 0.0_f64..30.0), 1..40),
        points in 2_usize..=32,
        same_deg in 0.05_f64..10.0,
    ) {
        let row = |(k, &(angle_deg, volts)): (usize, &(f64, f64))| Row {
            line: k as u64 + 2, angle_deg, volts, clipped: volts > 29.0, direction: None,
        };
        let mut sorted = pairs.clone();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut volts: Vec<f64> = pairs.iter().map(|pair| pair.1).collect();
        volts.sort_by(f64::total_cmp);
        let rising: Vec<(f64, f64)> = sorted.iter().zip(volts).map(|(pair, volts)| (pair.0, volts)).collect();
        for pairs in [&pairs, &sorted, &rising] {
            let rows = Rows { rows: pairs.iter().enumerate().map(row).collect(), signal: "volts".into(), code_v: 0.0, notes: vec![] };
            if let Ok(fit) = fit::fit(&rows, &Settings { points, same_deg, ..Settings::default() }) {
                prop_assert!(fit.calibration.points().len() <= points);
                prop_assert!(fit.rms_deg.is_finite() && fit.worst_deg.0 >= fit.rms_deg * 0.999);
            }
        }
    }

    #[test]
    fn no_bytes_panic(text in "(angle_deg|volts|code|,|\n|[0-9]{1,4}|\\.|-|#|\"|;| |up){0,60}") {
        let reading = Reading { scale: Scale::Supply(3.3), ..Reading::default() };
        let _ = parse("rows.csv", text.as_bytes(), &reading);
        let _ = parse("rows.csv", format!("angle_deg,code\n{text}").as_bytes(), &reading);
    }
}
