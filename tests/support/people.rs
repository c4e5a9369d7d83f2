//! Recorded people with their templates and their phase: who is followed, on the host and on the virtual board.

use crate::recordings::default_trace;
use cpg_core::entrainment::phase_lock::Template;
use cpg_core::entrainment::{Corrections, EventSource, Follower};
use footfall::command::entrain::default_generator;
use gait_fit::following::learn::{Learned, learn};
use gait_fit::following::run;
use gait_fit::following::tick::{Tick, phase_error_deg};
use gait_trace::format::csv_file;
use gait_trace::{Channel, Recording};
use joint_loop::{FollowConfig, GeneratorConfig, SeriesConfig, ShapeConfig};
use joint_units::{Joint, Radians};
use test_suite::traces_folder;

/// The two long recordings.
pub const PEOPLE: [&str; 2] = ["gaitprint_young_overground", "gaitprint_middle_overground"];

/// A recording with its templates and its phase.
#[derive(Debug, Clone)]
pub struct Person {
    /// Name of the recording.
    pub name: String,
    /// The recording.
    pub recording: Recording,
    /// What was learned from its first 12 s: templates, stride, and the phase of every row.
    pub learned: Learned,
    /// The four templates; those of joints that were not recorded are the default generator's.
    pub templates: [Template; Joint::COUNT],
}

impl Person {
    /// Learns a recording of which one joint is to be measured.
    ///
    /// # Panics
    /// It does not walk.
    #[must_use]
    pub fn of(name: &str, recording: Recording, sensor: Joint) -> Self {
        let learned = learn(&recording, sensor, 12.0).expect("walks");
        let learned =
            learned.completed(&default_generator(sensor).expect("a default generator"), sensor).expect("turned");
        let templates = learned.templates.map(|template| template.expect("completed"));
        Self { name: name.into(), recording, learned, templates }
    }

    /// What the joint's sensor sees at 1 kHz, degrees.
    ///
    /// # Panics
    /// The joint was not recorded.
    #[must_use]
    pub fn samples(&self, sensor: Joint) -> Vec<f64> {
        run::samples(&self.recording, sensor).expect("a channel")
    }

    /// The core that follows this person.
    ///
    /// # Panics
    /// The core refuses a template that was learned.
    #[must_use]
    pub fn legs(&self, sensor: Joint) -> Follower {
        run::follower(self.templates, sensor, self.learned.stride_s).expect("built")
    }

    /// The same as parameters for a board. `stride_s` is the stride that it looks for first: [`Learned::stride_s`], or another one.
    #[must_use]
    pub fn follower(&self, sensor: Joint, stride_s: f64) -> GeneratorConfig {
        let series = |template: Template| {
            let (mean, cos, sin) = template.coefficients();
            SeriesConfig { mean: Radians(mean), cos: *cos, sin: *sin }
        };
        let shape = ShapeConfig { stride_s: stride_s as f32, joints: self.templates.map(series) };
        GeneratorConfig::Follow(FollowConfig {
            sensor,
            events: EventSource::None,
            shape,
            corrections: Corrections::NONE,
        })
    }

    /// Phase of the person less that of the follower at the tick of this number, degrees.
    #[must_use]
    pub fn off(&self, tick: &Tick, at: usize) -> f64 {
        phase_error_deg(tick, self.learned.phase_at(at as f64 * 1e-3))
    }
}

/// The people of the two long recordings in [`test_suite::traces_folder`].
///
/// # Panics
/// A recording is missing or cannot be read.
#[must_use]
pub fn people(sensor: Joint) -> Vec<Person> {
    people_of(&PEOPLE, sensor)
}

/// The people of the recordings of these names in [`test_suite::traces_folder`].
///
/// # Panics
/// A recording is missing or cannot be read.
#[must_use]
pub fn people_of(names: &[&str], sensor: Joint) -> Vec<Person> {
    let folder = traces_folder();
    let read = |name: &&str| {
        let recording = csv_file::read(&folder.join(format!("{name}.csv"))).expect("a good recording");
        Person::of(name, recording, sensor)
    };
    names.iter().map(read).collect()
}

/// The default recording, looped for so many seconds: the same two strides over and over.
///
/// # Panics
/// It cannot be read.
#[must_use]
pub fn default_loop(sensor: Joint, secs: f64) -> Person {
    let looped = default_trace().looped(1000.0).expect("it walks").recording;
    let rows = (secs * 1000.0) as usize;
    let times = (0..rows).map(|n| n as f64 * 1e-3).collect();
    let channels = looped.channels().iter().map(|channel| {
        let round = channel.values().len() - 1;
        let values = (0..rows).map(|n| channel.values()[n % round]).collect();
        Channel::new(channel.name(), channel.quantity(), values)
    });
    Person::of("default", Recording::build(times, channels.collect()).expect("a table"), sensor)
}
