//! The relation of two clocks: a straight line through pairs of times.
//!
//! ```text
//! recorder time = offset + (1 + drift) board time
//! ```

use gait_trace::{root_mean_square, upper_median};
use serde_json::{Map, Value};

use crate::line_fit::line_fit;

/// The straight line from the board's clock to the recorder's, and its residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clocks {
    /// Recorder time at board time 0, s.
    pub offset_s: f64,
    /// How much faster the recorder's clock runs, parts per million.
    pub drift_ppm: f64,
    /// Root mean square of the residuals, s.
    pub rms_s: f64,
    /// Largest residual, s.
    pub worst_s: f64,
}

impl Clocks {
    /// By least squares through (board time, recorder time).
    pub(super) fn of(points: &[(f64, f64)]) -> Self {
        let (offset, slope) = line_fit(points);
        let residual = |(x, y): &(f64, f64)| y - offset - slope * x;
        let squares: f64 = points.iter().map(|point| residual(point).powi(2)).sum();
        Self {
            offset_s: offset,
            drift_ppm: (slope - 1.0) * 1e6,
            rms_s: (squares / points.len() as f64).sqrt(),
            worst_s: points.iter().map(|point| residual(point).abs()).fold(0.0, f64::max),
        }
    }

    /// Two lines of text.
    pub(super) fn as_text(&self) -> String {
        format!(
            "recorder time = {:.6} s + {:.9} x board time  (drift {:+.2} ppm)\n\
             residuals: rms {:.3} ms, worst {:.3} ms\n",
            self.offset_s,
            1.0 + self.drift_ppm * 1e-6,
            self.drift_ppm,
            self.rms_s * 1e3,
            self.worst_s * 1e3,
        )
    }

    /// As JSON, with more fields.
    pub(super) fn with(&self, more: Value) -> Value {
        let mut object = Map::new();
        for (key, number) in [
            ("offset_s", self.offset_s),
            ("drift_ppm", self.drift_ppm),
            ("rms_s", self.rms_s),
            ("worst_s", self.worst_s),
        ] {
            object.insert(key.into(), number.into());
        }
        if let Value::Object(more) = more {
            object.extend(more);
        }
        Value::Object(object)
    }
}

/// Outlier threshold of a line, s: resolution + max(6 x median, 3 x rms) of the residuals.
///
/// A pair that is further from the line is of two different pulses, or of one that began before the recording.
pub(super) fn outlier_s(points: &[(f64, f64)], (offset, slope): (f64, f64)) -> f64 {
    /// Error that every time stamp may have, s.
    const RESOLUTION_S: f64 = 1e-5;
    let off: Vec<f64> = points.iter().map(|(x, y)| (offset + slope * x - y).abs()).collect();
    let (median, rms) = (upper_median(off.iter().copied()), root_mean_square(&off));
    RESOLUTION_S + (6.0 * median).max(3.0 * rms)
}
