//! What is taken from each recording of the family: the cadence and the mean stride.

use std::path::Path;

use cpg_core::gait::family::{Member, SOURCES, Source};

use gait_trace::format::open::of_bytes;
use gait_trace::stride::strides::segment;
use gait_trace::{Conditioned, Cycle, LowPass, ReadOptions, Rules, condition};
use sha2::{Digest, Sha256};

use crate::gait_family::leg::Leg;

/// What is taken from a recording.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// The recording.
    pub source: Source,
    /// Steps a minute: two a stride.
    pub cadence: f64,
    /// Number of whole strides.
    pub strides: usize,
    /// The mean stride of four joints, low-passed as is customary in gait laboratories.
    pub mean: Cycle,
    /// Both legs of the mean stride as one.
    pub leg: Leg,
}

/// Reads all recordings of a member, [`Member::Walk`] or [`Member::RunUnscaled`]; the slowest first.
///
/// # Errors
/// A recording is missing, has other bytes than those that were fitted, or has no strides; the text names it.
pub fn recorded(folder: &Path, member: Member) -> Result<Vec<Recorded>, String> {
    let of_member = SOURCES.into_iter().filter(|source| source.member == member);
    let mut all = of_member.map(|source| strides_of(folder, source)).collect::<Result<Vec<_>, _>>()?;
    all.sort_by(|a, b| a.cadence.total_cmp(&b.cadence));
    Ok(all)
}

fn strides_of(folder: &Path, source: Source) -> Result<Recorded, String> {
    let strides = segment(&joints_of(folder, &source)?).map_err(|error| format!("{}: {error}", source.name))?;
    let mean = strides.mean();
    let leg = Leg::of(&mean);
    Ok(Recorded { source, cadence: 120.0 / strides.period_s, strides: strides.spans.len(), mean, leg })
}

/// The joints of a recording, repaired, and low-passed as is customary.
///
/// # Errors
/// As [`recorded`].
pub fn joints_of(folder: &Path, source: &Source) -> Result<Conditioned, String> {
    let path = folder.join(format!("{}.csv", source.name));
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let sha256: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    if sha256 != source.sha256 {
        return Err(format!("{}: SHA-256 {sha256}; the family was fitted to {}", path.display(), source.sha256));
    }
    let raw = of_bytes(source.name, &bytes, &ReadOptions::default()).map_err(|error| error.to_string())?;
    let rules = Rules { low_pass: LowPass::Customary, ..Rules::default() };
    condition(&raw, &rules).map_err(|error| format!("{}: {error}", source.name))
}
