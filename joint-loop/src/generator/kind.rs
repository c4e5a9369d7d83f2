//! The trait of one kind of generator: name, build, and codec of its flash record.

use cpg_core::entrainment::FollowStatus;
use cpg_core::{BuildError, Generator};
use joint_units::{Joint, Period, Radians};

use crate::store::flash_record::{WordError, WordReader, WordWriter};

/// Implemented by the configuration of each kind, in SI units. The list in [`crate::generator`] combines the kinds.
pub(crate) trait BoardKind: Sized {
    /// The generator that it builds.
    type Built: Generator<{ Joint::COUNT }>;
    /// Name on the command line, in the generator file and in the boot record.
    const NAME: &'static str;
    /// Number of the kind in a flash record. A number is never used again for another kind.
    const RECORD_KIND: u16;
    /// Number of words in a flash record.
    const WORDS: usize;

    /// Checks every parameter and builds the generator for one control period.
    fn build(&self, period: Period) -> Result<Self::Built, BuildError>;
    /// Writes [`BoardKind::WORDS`] words.
    fn write(&self, words: &mut WordWriter<'_>);
    /// Reads the words in the order in which [`BoardKind::write`] writes them; [`BoardKind::build`] checks the numbers.
    fn read(words: &mut WordReader<'_>) -> Result<Self, WordError>;

    /// The joint whose sensor the generator follows; `None` if it is no follower.
    fn follows(&self) -> Option<Joint> {
        None
    }
    /// Passes the measured angle to a follower; `None` if the sample is not valid.
    fn observe(_built: &mut Self::Built, _angle: Option<Radians>) {}
    /// Passes a heel strike to a follower.
    fn heel_strike(_built: &mut Self::Built) {}
    /// Tracking status of a follower.
    fn follow_status(_built: &Self::Built) -> Option<FollowStatus> {
        None
    }
}
