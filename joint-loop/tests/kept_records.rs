//! Flash records as an earlier build wrote them, one of each schema and kind: each is still read with the values that it was made of.
//!
//! `records/*.bin` are never changed. A change of what a word means needs a new schema number; the files of that number are added by
//! `FOOTFALL_WRITE_RECORDS=1 cargo test -p joint-loop --test kept_records`, and those of the old number must then be refused.

use std::fs;
use std::path::{Path, PathBuf};

use cpg_core::entrainment::{Corrections, EventSource};
use cpg_core::network::thesis::ThesisConfig;
use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
use joint_loop::generator::spline::{SPLINE_KNOTS, SplineConfig};
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{
    FollowConfig, GeneratorConfig, JointSensor, JointSensors, RecordName, RobotConfig, SERIES_HARMONICS, SeriesConfig,
    ShapeConfig,
};
use joint_units::{Joint, Radians, Volts};

/// Schemas of generator, sensor and robot records, as in the names of the files.
const SCHEMAS: [(&str, u16); 3] = [("generator", 2), ("sensors", 2), ("robot", 2)];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/records")
}

/// The values of a record as text, each number with all of its bits, and the record that is made of them again.
fn read(record: &[u8]) -> (String, Vec<u8>) {
    match record.get(..4) {
        Some(magic) if magic == generator_record::MAGIC => {
            let stored = generator_record::read(record).expect("a generator").expect("not erased");
            (format!("{stored:#?}\n"), generator_record::record_of(&stored.config, &stored.name).bytes().to_vec())
        }
        Some(magic) if magic == sensor_record::MAGIC => {
            let stored = sensor_record::read(record).expect("sensors").expect("not erased");
            let sensors = stored.sensors.iter().map(|sensor| {
                let calibration = &sensor.calibration;
                let (points, interpolation) = (calibration.points(), calibration.interpolation());
                format!("{:?}, divider {:?}, {interpolation:?} {points:#?}\n", sensor.joint, sensor.divider)
            });
            let text = format!("{:?}\n{}", stored.name, sensors.collect::<String>());
            (text, sensor_record::record_of(&stored.sensors, &stored.name).bytes().to_vec())
        }
        Some(magic) if magic == robot_record::MAGIC => {
            let stored = robot_record::read(record).expect("a robot").expect("not erased");
            (format!("{stored:#?}\n"), robot_record::record_of(&stored.robot, &stored.name).bytes().to_vec())
        }
        magic => panic!("{magic:?} is no magic word of a record"),
    }
}

/// No two numbers of a record are equal where the rules allow it: words that change places change the values.
fn counted<const N: usize>(from: f32) -> [f32; N] {
    core::array::from_fn(|n| from + 0.01 * n as f32)
}

fn generators() -> Vec<GeneratorConfig> {
    let series =
        |mean: f32| SeriesConfig { mean: Radians(mean), cos: counted::<SERIES_HARMONICS>(0.1), sin: counted(-0.2) };
    let shape = ShapeConfig { stride_s: 1.25, joints: [0.1, 0.2, 0.3, 0.4].map(series) };
    let mut corrections = Corrections { usual_innovation: Radians(0.03), ..Corrections::NONE };
    let gains = corrections.gains.as_flattened_mut().as_flattened_mut();
    gains.iter_mut().zip(0_u16..).for_each(|(gain, n)| *gain = 0.01 * f32::from(n));
    let knots = [0.0, 0.2, 0.4, 0.6].map(|from| counted::<SPLINE_KNOTS>(from).map(Radians));
    vec![
        GeneratorConfig::default_walk(),
        GeneratorConfig::Thesis(ThesisConfig::set_s()),
        GeneratorConfig::Shape(shape),
        GeneratorConfig::Follow(FollowConfig {
            sensor: Joint::RightHip,
            events: EventSource::FootSwitch,
            shape,
            corrections,
        }),
        GeneratorConfig::Spline(SplineConfig { stride_s: 1.5, knots }),
    ]
}

fn sensors() -> JointSensors {
    let points = [(0.4, -0.1), (1.1, 0.7), (2.3, 1.9)]
        .map(|(volts, angle)| CalibrationPoint { volts: Volts(volts), angle: Radians(angle) });
    let calibration = Calibration::new(&points, Interpolation::MonotoneCubic).expect("monotone");
    let own = JointSensor { joint: Joint::LeftKnee, divider: 1.5, calibration };
    JointSensors::build([JointSensor::uncalibrated(Joint::RightHip).expect("monotone"), own]).expect("two joints")
}

/// The files of today's schemas: name and record.
fn of_today() -> Vec<(String, Vec<u8>)> {
    let name = RecordName::new("kept").expect("short");
    let [generator, sensor, robot] = SCHEMAS.map(|(kind, schema)| format!("{kind}-{schema}"));
    let mut all: Vec<_> = generators()
        .iter()
        .map(|config| {
            let record = generator_record::record_of(config, &name);
            (format!("{generator}-{}", config.name()), record.bytes().to_vec())
        })
        .collect();
    all.push((sensor, sensor_record::record_of(&sensors(), &name).bytes().to_vec()));
    let with_feedback = RobotConfig { feedback: [-0.1, 0.2, 0.3, -0.4], ..RobotConfig::default_biped() };
    let with_brown_out = RobotConfig { require_brown_out_reset: true, ..RobotConfig::default_biped() };
    for (end, config) in
        [("", RobotConfig::default_biped()), ("-feedback", with_feedback), ("-brown-out", with_brown_out)]
    {
        all.push((format!("{robot}{end}"), robot_record::record_of(&config, &name).bytes().to_vec()));
    }
    all
}

/// Every kind of every schema of today has its file. One that is missing is written if that is asked for.
#[test]
fn every_kind_of_record_is_kept() {
    let names: Vec<&str> = generators().iter().map(GeneratorConfig::name).collect();
    assert_eq!(names, GeneratorConfig::NAMES, "a record of each kind");
    for (name, record) in of_today() {
        let file = folder().join(&name).with_extension("bin");
        if !file.exists() && std::env::var_os("FOOTFALL_WRITE_RECORDS").is_some() {
            fs::create_dir_all(folder()).expect("the folder");
            fs::write(&file, &record).expect("written");
            fs::write(file.with_extension("txt"), read(&record).0).expect("written");
        }
        let kept = fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let number = u16::from_le_bytes([kept[4], kept[5]]);
        let (kind, schema) = SCHEMAS.into_iter().find(|(kind, _)| name.starts_with(kind)).expect("a kind");
        assert_eq!(number, schema, "{kind}: the schema number in {}", file.display());
        assert_eq!(u16::from_le_bytes([record[4], record[5]]), schema, "{kind}: a new schema number needs new files");
    }
}

/// Each file of a schema of today gives the values beside it, and they the same bytes; another number is refused.
#[test]
fn a_kept_record_has_the_values_that_it_was_made_of() {
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder()).expect("the folder").map(|file| file.expect("one").path()).collect();
    files.retain(|file| file.extension().is_some_and(|end| end == "bin"));
    files.sort();
    assert!(files.len() >= of_today().len(), "{files:?}");
    for file in files {
        let kept = fs::read(&file).expect("a record");
        let stem = file.file_stem().and_then(|stem| stem.to_str()).expect("a name");
        let number = u16::from_le_bytes([kept[4], kept[5]]);
        if !SCHEMAS.iter().any(|(kind, schema)| stem.starts_with(kind) && number == *schema) {
            assert!(
                generator_record::read(&kept).is_err()
                    && sensor_record::read(&kept).is_err()
                    && robot_record::read(&kept).is_err()
            );
            continue;
        }
        let (values, again) = read(&kept);
        let expected = fs::read_to_string(file.with_extension("txt")).expect("its values");
        assert!(
            values == expected,
            "{stem} reads otherwise than it was written: a new meaning needs a new schema number\n{values}"
        );
        assert!(again == kept, "{stem}: the same values make other bytes");
    }
}
