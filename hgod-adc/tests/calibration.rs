//! The calibration table: refusals by name, and what both interpolations promise for every table that is accepted.

use hgod_adc::{Calibration, CalibrationError, CalibrationPoint, Interpolation, MAX_POINTS, OutOfTable, rk09k};
use joint_units::{Radians, Volts};
use proptest::prelude::*;

const BOTH: [Interpolation; 2] = [Interpolation::Linear, Interpolation::MonotoneCubic];

fn table(points: &[(f32, f32)]) -> Vec<CalibrationPoint> {
    points.iter().map(|&(v, deg)| CalibrationPoint { volts: Volts(v), angle: Radians::from_degrees(deg) }).collect()
}

fn build(points: &[(f32, f32)]) -> Result<Calibration, CalibrationError> {
    let both = BOTH.map(|interpolation| Calibration::new(&table(points), interpolation));
    assert_eq!(both[0].is_ok(), both[1].is_ok());
    let [linear, _] = both;
    linear
}

#[test]
fn each_kind_of_bad_table_is_refused_by_name() {
    let refused = |points: &[(f32, f32)]| {
        let error = build(points).expect_err("refused");
        let kind = format!("{error:?}").split([' ', '{']).next().unwrap_or_default().to_owned();
        (kind, error.index(), error.field().unwrap_or(""))
    };
    let is = |kind: &str, index: usize, field| (kind.to_owned(), Some(index), field);
    let count = ("Count".to_owned(), None, "");
    assert_eq!(refused(&[]), count);
    assert_eq!(refused(&[(1.0, 0.0)]), count);
    let long: Vec<_> = (0..=MAX_POINTS).map(|i| (i as f32 * 0.1, i as f32)).collect();
    assert_eq!(refused(&long), count);
    assert!(build(&long[..MAX_POINTS]).is_ok());

    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(refused(&[(0.5, 0.0), (bad, 10.0), (1.5, 20.0)]), is("NotFinite", 1, "volts"));
        assert_eq!(refused(&[(0.5, bad), (1.0, 10.0), (1.5, 20.0)]), is("NotFinite", 0, "angle"));
        assert_eq!(refused(&[(0.5, 0.0), (1.0, 10.0), (1.5, bad)]), is("NotFinite", 2, "angle"));
    }
    assert_eq!(refused(&[(-0.1, 0.0), (1.0, 10.0)]), is("VoltsRange", 0, "volts"));
    assert_eq!(refused(&[(0.1, 0.0), (30.1, 10.0)]), is("VoltsRange", 1, "volts"));
    assert_eq!(refused(&[(0.1, -60.1), (1.0, 10.0)]), is("Anatomy", 0, "angle"));
    assert_eq!(refused(&[(0.1, 0.0), (1.0, 170.1)]), is("Anatomy", 1, "angle"));
    // Not sorted, doubled, and closer than a code.
    assert_eq!(refused(&[(0.1, 0.0), (1.0, 10.0), (0.9, 20.0)]), is("VoltsStep", 2, "volts"));
    assert_eq!(refused(&[(0.1, 0.0), (1.0, 10.0), (1.0, 20.0)]), is("VoltsStep", 2, "volts"));
    assert_eq!(refused(&[(0.1, 0.0), (0.1009, 0.2)]), is("VoltsStep", 1, "volts"));
    assert_eq!(refused(&[(0.1, 10.0), (1.0, 10.0)]), is("AngleStep", 1, "angle"));
    assert_eq!(refused(&[(0.1, 0.0), (1.0, 10.0), (2.0, 10.04)]), is("AngleStep", 2, "angle"));
    assert_eq!(refused(&[(0.1, 0.0), (1.0, 10.0), (2.0, 9.0)]), is("AngleOrder", 2, "angle"));
    assert_eq!(refused(&[(0.1, 0.0), (1.0, -10.0), (2.0, 9.0)]), is("AngleOrder", 2, "angle"));
    assert_eq!(refused(&[(0.1, 0.0), (1.0, 10.0), (1.05, 35.0)]), is("Saturated", 2, "volts"));
}

#[test]
fn a_refusal_says_where_and_what_is_allowed() {
    let text = |points| build(points).unwrap_err().to_string();
    assert_eq!(text(&[(0.1, 0.0)]), "1 points: allowed is 2 to 32");
    assert_eq!(text(&[(0.1, 0.0), (1.0, 200.0)]), "points[1].angle: 200.00 degrees: allowed is -60 to 170 degrees");
    assert_eq!(
        text(&[(0.5, 0.0), (0.5, 10.0)]),
        "points[1].volts: 0 V more than the point before: must be at least 0.001 V"
    );
    assert_eq!(
        text(&[(0.5, 0.0), (1.5, 10.0), (2.5, 8.0)]),
        "points[2].angle: -2.0000 degrees from the point before, against the direction of the table: \
         must rise throughout or fall throughout"
    );
}

/// The end of a real goniometer's table: 12 bit codes 3865, 3950, 3962 for 50, 40, 30 degrees.
#[test]
fn a_table_that_reaches_saturation_is_refused() {
    let volts = |code: f32| code / 4095.0 * 3.3;
    let points = [(volts(3780.0), 60.0), (volts(3865.0), 50.0), (volts(3950.0), 40.0), (volts(3962.0), 30.0)];
    let error = build(&points).unwrap_err();
    assert!(matches!(error, CalibrationError::Saturated { index: 3, .. }), "{error:?}");
    assert!(error.to_string().starts_with("points[3].volts: 1034 degrees a volt"), "{error}");
    let kept = build(&points[..3]).unwrap();
    assert_eq!(kept.angle(Volts(volts(3951.0))), Err(OutOfTable::Above));
    assert_eq!(kept.volts(Radians::from_degrees(35.0)), Err(OutOfTable::Below));
}

#[test]
fn a_calibration_shows_what_it_was_built_from() {
    let points = table(&[(0.5, 90.0), (1.0, 50.0), (2.0, -10.0)]);
    for interpolation in BOTH {
        let calibration = Calibration::new(&points, interpolation).unwrap();
        assert_eq!(calibration.points(), points);
        assert_eq!(calibration.span(), (points[2].angle, points[0].angle));
        assert_eq!(calibration.volts_span(), (Volts(0.5), Volts(2.0)));
        assert_eq!(calibration.interpolation(), interpolation);
    }
}

/// The formula that the makers of the ERC joint published for the Alps RK09K potentiometer, in degrees, a as a 10 bit code.
fn rk09k_degrees(a: f64) -> f64 {
    let x = a - 512.0;
    0.2097 * x + 2.243e-6 * x.powi(2) + 1.095e-7 * x.powi(3)
}

/// A table of that formula from a = 260 to 980, at 3.3 V.
fn published(points: usize, interpolation: Interpolation) -> Calibration {
    let table: Vec<_> = (0..points)
        .map(|i| 260.0 + 720.0 * i as f64 / (points - 1) as f64)
        .map(|a| ((a / 1023.0 * 3.3) as f32, rk09k_degrees(a) as f32))
        .collect();
    Calibration::new(&self::table(&table), interpolation).unwrap()
}

/// Worst difference in degrees from the formula, over every 12 bit code inside the table.
fn worst_against_formula(calibration: &Calibration) -> f64 {
    let (least, greatest) = calibration.volts_span();
    let codes = (0..=4095).map(|code| Volts(code as f32 / 4095.0 * 3.3));
    codes
        .filter(|volts| (least..=greatest).contains(volts))
        .map(|volts| {
            let degrees = f64::from(calibration.angle(volts).unwrap().degrees());
            (degrees - rk09k_degrees(f64::from(volts.0) / 3.3 * 1023.0)).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn a_published_sensor_curve_is_met_and_goes_back() {
    for interpolation in BOTH {
        for points in [17, 32] {
            let calibration = published(points, interpolation);
            let worst = worst_against_formula(&calibration);
            let (low, high) = calibration.span();
            let mut round_trip = 0.0_f64;
            for step in 0..=4000 {
                let degrees = low.degrees() + (high.degrees() - low.degrees()) * step as f32 / 4000.0;
                let angle = Radians(Radians::from_degrees(degrees).0.max(low.0).min(high.0));
                // Forth by the table, to the nearest 12 bit code, back by the formula.
                let code = (f64::from(calibration.volts(angle).unwrap().0) / 3.3 * 4095.0).round();
                let back = rk09k_degrees(code / 4095.0 * 1023.0);
                round_trip = round_trip.max((back - f64::from(angle.degrees())).abs());
            }
            println!(
                "RK09K, {points} points, {interpolation:?}: worst {worst:.5} deg, round trip by code {round_trip:.4} deg"
            );
            assert!(worst < 0.15 && round_trip < 0.3, "{worst} {round_trip}");
        }
    }
}

#[test]
fn the_curve_of_the_crate_is_the_published_one() {
    for a in 0..=1023 {
        let fraction = a as f32 / 1023.0;
        let error = f64::from(rk09k::pivot(fraction).degrees()) - rk09k_degrees(f64::from(a));
        assert!(error.abs() < 5e-5, "{a}: {error}");
    }
    let points = rk09k::points::<5>(Volts(3.3), 0.3, 0.9);
    assert_eq!(points.map(|p| p.angle), [0.3, 0.45, 0.6, 0.75, 0.9].map(rk09k::pivot));
    assert!(points.iter().zip([0.99, 1.485, 1.98, 2.475, 2.97]).all(|(p, volts)| (p.volts.0 - volts).abs() < 1e-6));
}

#[test]
fn errors_fall_with_the_order_of_the_interpolation() {
    let ratio = |interpolation| {
        worst_against_formula(&published(9, interpolation)) / worst_against_formula(&published(17, interpolation))
    };
    let (linear, cubic) = (ratio(Interpolation::Linear), ratio(Interpolation::MonotoneCubic));
    println!("halving the spacing divides the error by {linear:.2} (linear), {cubic:.2} (cubic)");
    // Second order, with the curvature greatest at the ends; third order at the ends of the cubic.
    assert!((3.4..4.4).contains(&linear) && (6.8..10.0).contains(&cubic));
}

/// The three-point slopes make the cubic exact for a parabola wherever the circle does not cut them.
#[test]
fn a_parabola_is_reproduced() {
    let parabola = |v: f32| 10.0 + 20.0 * v + 4.0 * v * v;
    for direction in [1.0, -1.0] {
        let points: Vec<_> = [0.2, 0.5, 0.9, 1.6, 2.0, 2.9].map(|v| (v, direction * 0.5 * parabola(v))).into();
        let calibration = Calibration::new(&table(&points), Interpolation::MonotoneCubic).unwrap();
        for step in 0..=2700 {
            let v = (0.2 + step as f32 * 1e-3).min(2.9);
            let angle = calibration.angle(Volts(v)).unwrap().degrees();
            assert!((angle - direction * 0.5 * parabola(v)).abs() < 2e-5, "{angle} at {v}");
        }
    }
}

#[test]
fn the_cubics_slope_is_continuous_and_the_lines_is_not() {
    let jump = |interpolation| {
        let calibration = published(9, interpolation);
        let rate =
            |v: f32, h: f32| (calibration.angle(Volts(v + h)).unwrap().0 - calibration.angle(Volts(v)).unwrap().0) / h;
        let knots = calibration.points();
        let inner = &knots[1..knots.len() - 1];
        inner.iter().map(|p| (rate(p.volts.0, 2e-3) / rate(p.volts.0, -2e-3) - 1.0).abs()).fold(0.0, f32::max)
    };
    let (linear, cubic) = (jump(Interpolation::Linear), jump(Interpolation::MonotoneCubic));
    assert!(cubic < 4e-3 && linear > 0.05, "{cubic} {linear}");
}

/// Any table that is accepted: 2 to 32 points, rising or falling, evenly or very unevenly spaced, up to `max_volts`.
fn any_table(max_volts: f32) -> impl Strategy<Value = Vec<CalibrationPoint>> {
    let steps = proptest::collection::vec((0.0..1.0_f32, 0.001..1.0_f32), 1..MAX_POINTS);
    (steps, 0.0..0.3_f32, 5.0..220.0_f32, any::<bool>()).prop_map(move |(steps, first, span, rising)| {
        let (wide, angles) = steps.iter().fold((0.0, 0.0), |(v, a), step| (v + step.0.powi(3) + 1e-3, a + step.1));
        let margin = max_volts - first - 0.06;
        let mut point = (first, if rising { -55.0 } else { 168.0 });
        let mut points = vec![point];
        for (v, a) in steps {
            let rise = 1.1e-3 + margin * 0.95 * (v.powi(3) + 1e-3) / wide;
            let change = (span * a / angles).max(0.06).min(390.0 * rise);
            point = (point.0 + rise, point.1 + if rising { change } else { -change });
            points.push(point);
        }
        table(&points)
    })
}

/// Fractions of the volts between the ends of a table.
fn at(calibration: &Calibration, fraction: f32) -> Volts {
    let (least, greatest) = calibration.volts_span();
    Volts((least.0 + fraction * (greatest.0 - least.0)).max(least.0).min(greatest.0))
}

/// How far rounding may turn back an interpolant, in radians.
fn slack(interpolation: Interpolation) -> f32 {
    match interpolation {
        Interpolation::Linear => 0.0,
        Interpolation::MonotoneCubic => Radians::from_degrees(0.0001).0,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_point_is_met_exactly_and_its_neighbourhood_does_not_pass_it(points in any_table(3.6)) {
        for interpolation in BOTH {
            let calibration = Calibration::new(&points, interpolation).unwrap();
            let sign = (points[1].angle.0 - points[0].angle.0).signum();
            for point in &points {
                prop_assert_eq!(calibration.angle(point.volts), Ok(point.angle));
                let before = calibration.angle(Volts(point.volts.0.next_down()));
                prop_assert!(before.is_err() || sign * before.unwrap().0 <= sign * point.angle.0);
                let after = calibration.angle(Volts(point.volts.0.next_up()));
                prop_assert!(after.is_err() || sign * after.unwrap().0 >= sign * point.angle.0);
            }
        }
    }

    #[test]
    fn the_interpolant_is_monotone_and_between_its_two_points(
        points in any_table(30.0), mut fractions in proptest::collection::vec(0.0..=1.0_f32, 2..100),
    ) {
        fractions.sort_by(f32::total_cmp);
        for interpolation in BOTH {
            let calibration = Calibration::new(&points, interpolation).unwrap();
            let sign = (points[1].angle.0 - points[0].angle.0).signum();
            let mut before = f32::NEG_INFINITY;
            for fraction in &fractions {
                let volts = at(&calibration, *fraction);
                let angle = calibration.angle(volts).unwrap().0;
                prop_assert!(sign * angle >= before - slack(interpolation), "{angle} after {before}");
                before = before.max(sign * angle);
                let right = points.iter().position(|p| p.volts > volts).unwrap_or(points.len() - 1);
                let (a, b) = (points[right - 1].angle.0, points[right].angle.0);
                prop_assert!((a.min(b)..=a.max(b)).contains(&angle));
            }
        }
    }

    /// Neighbouring floats, where rounding has its best chance to turn the curve back.
    #[test]
    fn rounding_turns_a_line_never_and_a_cubic_by_less_than_stated(points in any_table(3.6), fraction in 0.0..1.0_f32) {
        for interpolation in BOTH {
            let calibration = Calibration::new(&points, interpolation).unwrap();
            let sign = (points[1].angle.0 - points[0].angle.0).signum();
            let mut volts = at(&calibration, fraction);
            let mut before = sign * calibration.angle(volts).unwrap().0;
            for _ in 0..100 {
                volts = Volts(volts.0.next_up());
                let Ok(angle) = calibration.angle(volts) else { break };
                prop_assert!(sign * angle.0 >= before - slack(interpolation));
                before = before.max(sign * angle.0);
            }
        }
    }

    #[test]
    fn outside_the_table_any_number_is_refused(points in any_table(3.6), bits in any::<u32>(), near in -0.2..1.2_f32) {
        for interpolation in BOTH {
            let calibration = Calibration::new(&points, interpolation).unwrap();
            let (least, greatest) = calibration.volts_span();
            let (low, high) = calibration.span();
            for volts in [f32::from_bits(bits), least.0 + near * (greatest.0 - least.0), least.0.next_down(), greatest.0.next_up()] {
                let want = if volts.is_nan() { Some(OutOfTable::NotANumber) }
                    else if volts < least.0 { Some(OutOfTable::Below) }
                    else if volts > greatest.0 { Some(OutOfTable::Above) }
                    else { None };
                prop_assert_eq!(calibration.angle(Volts(volts)).err(), want);
            }
            for angle in [f32::from_bits(bits), low.0 + near * (high.0 - low.0), low.0.next_down(), high.0.next_up()] {
                let inside = (low.0..=high.0).contains(&angle);
                prop_assert_eq!(calibration.volts(Radians(angle)).is_ok(), inside);
            }
        }
    }

    #[test]
    fn the_inverse_comes_back(low_points in any_table(3.6), high_points in any_table(30.0), fraction in 0.0..=1.0_f32) {
        for (points, degrees) in [(low_points, 0.0003), (high_points, 0.003)] {
            for interpolation in BOTH {
                let calibration = Calibration::new(&points, interpolation).unwrap();
                let (low, high) = calibration.span();
                let angle = Radians((low.0 + fraction * (high.0 - low.0)).min(high.0));
                let volts = calibration.volts(angle).unwrap();
                let back = calibration.angle(volts).unwrap();
                prop_assert!((back.degrees() - angle.degrees()).abs() < degrees, "{:?} {:?} by {:?}", angle, back, volts);
                for end in [low, high] {
                    let back = calibration.angle(calibration.volts(end).unwrap()).unwrap();
                    prop_assert!((back.degrees() - end.degrees()).abs() < degrees);
                }
            }
        }
    }

    /// Turning a table's sign turns its answers' sign, bit for bit: neither direction is favoured.
    #[test]
    fn rising_and_falling_are_mirror_images(points in any_table(3.6), fraction in 0.0..=1.0_f32) {
        let halved = |sign: f32| points.iter().map(|p| CalibrationPoint { angle: Radians(sign * 0.25 * p.angle.0), ..*p }).collect::<Vec<_>>();
        for interpolation in BOTH {
            let (Ok(one), Ok(other)) = (Calibration::new(&halved(1.0), interpolation), Calibration::new(&halved(-1.0), interpolation)) else {
                continue; // a quarter of the angle may be too small a step
            };
            let volts = at(&one, fraction);
            let angle = one.angle(volts).unwrap();
            prop_assert_eq!(other.angle(volts), Ok(Radians(-angle.0)));
            prop_assert_eq!(one.volts(angle), other.volts(Radians(-angle.0)));
        }
    }
}
