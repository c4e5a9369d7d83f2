//! Recorded walkers with their templates and their phase: who is followed, on the host and on the virtual board.

use crate::traces::{many, shipped};
use cpg_core::entrainment::{Entrained, EventSource};
use cpg_core::phase_lock::Template;
use footfall::entrain::learn::{Learned, learn};
use footfall::entrain::run::{self, Tick, phase_error_deg};
use footfall::entrain::shipped_walker;
use gait_trace::{Channel, Recording, csv_file};
use joint_loop::{FollowConfig, SeriesConfig, ShapeConfig, WalkerConfig};
use joint_units::{Joint, Radians};

/// The two long recordings of walkers.
pub const WALKERS: [&str; 2] = ["gaitprint_young_overground", "gaitprint_middle_overground"];

/// A recording with its templates and its phase.
#[derive(Debug, Clone)]
pub struct Walker {
    /// Name of the recording.
    pub name: String,
    /// The recording.
    pub recording: Recording,
    /// What was learned from its first 12 s: templates, stride, and the phase of every row.
    pub learned: Learned,
    /// The four templates; those of joints that were not recorded are the shipped walker's.
    pub templates: [Template; Joint::COUNT],
}

impl Walker {
    /// Learns a recording of which one joint is to be measured.
    ///
    /// # Panics
    /// It does not walk.
    #[must_use]
    pub fn of(name: &str, recording: Recording, sensor: Joint) -> Self {
        let learned = learn(&recording, sensor, 12.0).expect("walks");
        let learned = learned.completed(&shipped_walker(sensor).expect("ships"), sensor).expect("turned");
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

    /// The core that follows this walker.
    ///
    /// # Panics
    /// The core refuses a template that was learned.
    #[must_use]
    pub fn legs(&self, sensor: Joint) -> Entrained {
        run::legs(self.templates, sensor, self.learned.stride_s).expect("built")
    }

    /// The same as parameters for a board. `stride_s` is the stride that it looks for first: [`Learned::stride_s`], or another one.
    #[must_use]
    pub fn follower(&self, sensor: Joint, stride_s: f64) -> WalkerConfig {
        let series = |template: Template| {
            let (mean, cos, sin) = template.coefficients();
            SeriesConfig { mean: Radians(mean), cos: *cos, sin: *sin }
        };
        let shape = ShapeConfig { stride_s: stride_s as f32, joints: self.templates.map(series) };
        WalkerConfig::Follow(FollowConfig { sensor, events: EventSource::None, shape })
    }

    /// Phase of the walker less the driven one at the tick of this number, degrees.
    #[must_use]
    pub fn off(&self, tick: &Tick, at: usize) -> f64 {
        phase_error_deg(tick, self.learned.phase_at(at as f64 * 1e-3))
    }
}

/// The two long recordings, if they are there; `what` is left out otherwise.
///
/// # Panics
/// One of them is not as it must be.
#[must_use]
pub fn walkers(what: &str, sensor: Joint) -> Vec<Walker> {
    walkers_of(&WALKERS, what, sensor)
}

/// Recordings of these names from the folder of many, if it is there; `what` is left out otherwise.
///
/// # Panics
/// One of them is not as it must be.
#[must_use]
pub fn walkers_of(names: &[&str], what: &str, sensor: Joint) -> Vec<Walker> {
    let Some(folder) = many(what) else { return vec![] };
    let read = |name: &&str| {
        let recording = csv_file::read(&folder.join(format!("{name}.csv"))).expect("a good recording");
        Walker::of(name, recording, sensor)
    };
    names.iter().map(read).collect()
}

/// The shipped recording, looped for so many seconds: the same two strides over and over.
///
/// # Panics
/// It cannot be read.
#[must_use]
pub fn shipped_loop(sensor: Joint, secs: f64) -> Walker {
    let looped = shipped().looped(1000.0).expect("it walks").recording;
    let rows = (secs * 1000.0) as usize;
    let times = (0..rows).map(|n| n as f64 * 1e-3).collect();
    let channels = looped.channels().iter().map(|channel| {
        let round = channel.values().len() - 1;
        let values = (0..rows).map(|n| channel.values()[n % round]).collect();
        Channel::new(channel.name(), channel.quantity(), values)
    });
    Walker::of("shipped", Recording::build(times, channels.collect()).expect("a table"), sensor)
}
