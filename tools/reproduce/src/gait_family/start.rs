//! A recorded start and stop, and the phases at which a gait does the same by [`cpg_core::transition::Smooth`].
//!
//! One recording has both: a person who stands, walks fast and stands again. Steady walking is that person's own mean stride, so that only
//! the change is judged. The time at which the change begins and the phase of the gait there are searched for the smallest error over a fixed
//! span of time, with the default settling time, and for comparison with others.

use std::path::Path;

use cpg_core::Generator;
use cpg_core::gait::family::{Member, START_AND_STOP};
use cpg_core::transition::{JointLimits, TransitionConfig};
use cpg_core::waveform::shape::{FourierShape, PhaseShape, PhaseShapeConfig};
use gait_fit::series::Series;
use joint_units::{Joint, Period, Phase, Radians};

use crate::gait_family::leg::Leg;
use crate::gait_family::recorded::{joints_of, recorded};

/// Spans of the recording, seconds: the start from before the first movement to the second step, the stop from the last whole stride to the
/// stand.
pub const SPANS_S: [(f64, f64); 2] = [(3.6, 5.0), (11.6, 13.4)];
/// Parts of them in which the person stands, seconds.
const STANDS_S: [(f64, f64); 2] = [(3.6, 3.85), (13.2, 13.4)];
/// Settling times that are tried, seconds; one is the default.
pub const SETTLING_S: [f32; 6] = [0.15, 0.25, 0.35, 0.5, 0.7, 1.0];
/// Step of the times of the change, seconds, and number of phases that are tried.
const STEP_S: f64 = 0.02;
const PHASES: u32 = 64;

/// The best change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Time at which it begins, seconds of the recording.
    pub at_s: f64,
    /// Phase of the gait at that time, in cycles, from the phase 0 of the family.
    pub phase: f64,
    /// Root mean square error over the span and the four joints, with the default settling time, degrees.
    pub rmse_deg: f64,
    /// The same at the worst phase, the time being the best for it.
    pub worst_rmse_deg: f64,
    /// The settling time of [`SETTLING_S`] with the smallest error at its own best time and phase, seconds, and that error.
    pub other: (f32, f64),
}

/// Start and stop. `origin` is the phase 0 of the family on a leg whose phase is that of [`Leg::of`], in cycles.
///
/// # Errors
/// A recording is missing or cannot be used.
pub fn start_and_stop(folder: &Path, origin: f64) -> Result<[Change; 2], String> {
    let joints = joints_of(folder, &START_AND_STOP)?;
    let walks = recorded(folder, Member::Walk)?;
    let own = walks.iter().find(|one| one.source.person == START_AND_STOP.person).ok_or("no walk of this person")?;
    let gait = gait(&own.leg.from_phase(origin), own.cadence)?;
    let at = |s: f64| (s * joints.rate_hz).round() as usize;
    let rows = |(from, to): (f64, f64)| -> Result<Vec<[f64; 4]>, String> {
        let values = Joint::ALL.map(|joint| joints.joint(joint).and_then(|x| x.get(at(from)..at(to))));
        let [Some(a), Some(b), Some(c), Some(d)] = values else { return Err("the recording is too short".into()) };
        Ok((0..a.len()).map(|n| [a[n], b[n], c[n], d[n]]).collect())
    };
    let change = |which: usize| -> Result<Change, String> {
        let stand = rows(STANDS_S[which])?;
        let pose = std::array::from_fn(|j| {
            Radians::from_degrees((stand.iter().map(|row| row[j]).sum::<f64>() / stand.len() as f64) as f32)
        });
        let span = Span {
            rows: rows(SPANS_S[which])?,
            rate_hz: joints.rate_hz,
            pose,
            gait,
            stride_s: 120.0 / own.cadence,
            stops: which == 1,
        };
        Ok(span.best(SPANS_S[which].0))
    };
    Ok([change(0)?, change(1)?])
}

type Gait = PhaseShape<FourierShape<6>, 4>;

fn gait(leg: &Leg, cadence: f64) -> Result<Gait, String> {
    let shape = |series: &Series| {
        let radians = |of: fn(&(f64, f64)) -> f64| {
            std::array::from_fn(|k| series.terms.get(k).map_or(0.0, |term| of(term).to_radians() as f32))
        };
        FourierShape::new(Radians::from_degrees(series.mean as f32), radians(|term| term.0), radians(|term| term.1))
            .map_err(|error| error.to_string())
    };
    let later = leg.from_phase(0.5);
    let shapes = [shape(&leg.hip)?, shape(&later.hip)?, shape(&leg.knee)?, shape(&later.knee)?];
    let config = PhaseShapeConfig { shapes, stride_s: (120.0 / cadence) as f32 };
    config.build(Period::MILLISECOND).map_err(|error| error.to_string())
}

/// A span of the recording, and what is tried on it.
struct Span {
    rows: Vec<[f64; 4]>,
    rate_hz: f64,
    pose: [Radians; 4],
    gait: Gait,
    stride_s: f64,
    stops: bool,
}

impl Span {
    fn best(&self, from_s: f64) -> Change {
        let length_s = self.rows.len() as f64 / self.rate_hz;
        let times = (1..(length_s / STEP_S) as u32).map(|n| f64::from(n) * STEP_S);
        let times: Vec<f64> = times.filter(|time| (0.1 * length_s..0.8 * length_s).contains(time)).collect();
        let default = TransitionConfig::default().settling_s;
        let mut best =
            Change { at_s: 0.0, phase: 0.0, rmse_deg: f64::MAX, worst_rmse_deg: 0.0, other: (default, f64::MAX) };
        for k in 0..PHASES {
            let phase = f64::from(k) / f64::from(PHASES);
            let mut at_default = f64::MAX;
            for settling_s in SETTLING_S {
                for &time in &times {
                    let rmse_deg = self.rmse_deg(time, phase, settling_s);
                    if rmse_deg < best.other.1 {
                        best.other = (settling_s, rmse_deg);
                    }
                    if settling_s == default {
                        at_default = at_default.min(rmse_deg);
                        if rmse_deg < best.rmse_deg {
                            best = Change { at_s: from_s + time, phase, rmse_deg, ..best };
                        }
                    }
                }
            }
            best.worst_rmse_deg = best.worst_rmse_deg.max(at_default);
        }
        best
    }

    /// Error if the change begins at a time of the span, where the gait has a phase.
    fn rmse_deg(&self, time: f64, phase: f64, settling_s: f32) -> f64 {
        let (ticks, change) = ((self.rows.len() as f64 / self.rate_hz * 1e3) as u32, (time * 1e3).round() as u32);
        // Back from the change to the beginning of the span.
        let cycles = phase - time / self.stride_s;
        let mut gait = self.gait;
        gait.set_phase(Phase::from_cycles(cycles.rem_euclid(1.0) as f32));
        let config = TransitionConfig { settling_s, ..TransitionConfig::default() };
        let Ok(mut smooth) = config.build(gait, [JointLimits::WIDEST; 4], Period::MILLISECOND) else {
            return f64::INFINITY;
        };
        if !self.stops && smooth.hold(self.pose).is_err() {
            return f64::INFINITY;
        }
        let (mut squares, mut count, mut row) = (0.0, 0.0, 0);
        for tick in 0..ticks {
            if tick == change {
                if !self.stops {
                    smooth.resume();
                } else if smooth.stop(self.pose).is_err() {
                    return f64::INFINITY;
                }
            }
            if f64::from(tick) * 1e-3 * self.rate_hz >= row as f64 {
                let Some(wanted) = self.rows.get(row) else { break };
                for (angle, wanted) in smooth.angles().iter().zip(wanted) {
                    squares += (f64::from(angle.degrees()) - wanted).powi(2);
                    count += 1.0;
                }
                row += 1;
            }
            smooth.step();
        }
        (squares / f64::max(count, 1.0)).sqrt()
    }
}
