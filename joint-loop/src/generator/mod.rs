//! The generators that a board can run, selected by parameters at run time.
//!
//! Each kind has one file: its configuration in SI units, its range checks, its flash record, its part of a generator file (TOML,
//! with the feature `serde`) and how it is built. The list `board_generators!` below makes everything that handles all kinds:
//! [`GeneratorConfig`], [`BoardGenerator`] and `GeneratorSet`. `docs/architecture.md` shows how a kind is added.
//!
//! The same generator file builds the same bits on the host and on the board; [`crate::store::generator_record`] carries it there.

#[cfg(feature = "serde")]
mod file;
pub mod follow;
mod kind;
pub mod phase_coupled;
pub mod shape;
pub mod spline;
pub mod thesis;

use cpg_core::entrainment::FollowStatus;
use cpg_core::{BuildError, Follow, Generator, StateFault};
use joint_units::{Joint, Period, Phase, RadPerSec, Radians};

#[cfg(feature = "serde")]
pub use file::{Allowed, KeyPath, SetError, Unit, one_of};
pub(crate) use kind::BoardKind;

use crate::store::flash_record::{WordError, WordReader, WordWriter};

macro_rules! board_generators {
    ($($(#[$doc:meta])* $variant:ident => $module:ident,)+) => {
        /// Parameters of a generator, in SI units.
        // There is one value, and no heap for the largest variant.
        #[allow(clippy::large_enum_variant)]
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[non_exhaustive]
        pub enum GeneratorConfig {
            $($(#[$doc])* $variant($module::Config),)+
        }

        /// A built generator.
        // As above.
        #[allow(clippy::large_enum_variant)]
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[non_exhaustive]
        pub enum BoardGenerator {
            $($(#[$doc])* $variant($module::Built),)+
        }

        /// Parameters of a generator as its file has them: degrees, seconds, and numbers that read back to the same bits.
        #[cfg(feature = "serde")]
        // As above.
        #[allow(clippy::large_enum_variant)]
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        pub enum GeneratorSet {
            $($(#[$doc])* $variant($module::Set),)+
        }

        impl GeneratorConfig {
            /// Number of each kind in a record, and its number of words.
            pub(crate) const RECORD_KINDS: &[(u16, usize)] =
                &[$((<$module::Config as BoardKind>::RECORD_KIND, <$module::Config as BoardKind>::WORDS),)+];

            /// Names of the kinds.
            pub const NAMES: &[&str] = &[$(<$module::Config as BoardKind>::NAME,)+];

            /// Name of the kind on the command line, in the generator file and in the boot record.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => <$module::Config as BoardKind>::NAME,)+
                }
            }

            /// The joint whose sensor the generator follows; `None` if it is no follower.
            #[must_use]
            pub fn follows(&self) -> Option<Joint> {
                match self {
                    $(Self::$variant(config) => BoardKind::follows(config),)+
                }
            }

            /// Checks every parameter and builds the generator for one control period.
            ///
            /// ```
            /// use cpg_core::Generator;
            /// use cpg_core::gait::default_walk::default_walk;
            /// use joint_loop::GeneratorConfig;
            /// use joint_units::Period;
            /// let mut generator = GeneratorConfig::default_walk().build(Period::MILLISECOND)?;
            /// let mut walk = default_walk(Period::MILLISECOND)?;
            /// for _ in 0..5_000 {
            ///     generator.step();
            ///     walk.step();
            /// }
            /// assert_eq!(generator.angles(), walk.angles());
            /// # Ok::<(), cpg_core::BuildError>(())
            /// ```
            ///
            /// # Errors
            /// [`BuildError`] names the first parameter that is not allowed.
            pub fn build(&self, period: Period) -> Result<BoardGenerator, BuildError> {
                Ok(match self {
                    $(Self::$variant(config) => BoardGenerator::$variant(BoardKind::build(config, period)?),)+
                })
            }

            /// The `use` lines that a configuration needs which is written as Rust source.
            #[cfg(feature = "serde")]
            #[must_use]
            pub const fn rust_imports(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => <$module::Set as file::KindSet>::RUST_IMPORTS,)+
                }
            }

            /// Number of the kind in a record.
            pub(crate) const fn record_kind(&self) -> u16 {
                match self {
                    $(Self::$variant(_) => <$module::Config as BoardKind>::RECORD_KIND,)+
                }
            }

            /// Writes the words of a record.
            pub(crate) fn write(&self, words: &mut WordWriter<'_>) {
                match self {
                    $(Self::$variant(config) => BoardKind::write(config, words),)+
                }
            }

            /// Reads the words of a record; `None` if there is no such kind.
            pub(crate) fn read(kind: u16, words: &mut WordReader<'_>) -> Option<Result<Self, WordError>> {
                $(if kind == <$module::Config as BoardKind>::RECORD_KIND {
                    return Some(<$module::Config as BoardKind>::read(words).map(Self::$variant));
                })+
                None
            }
        }

        impl Generator<{ Joint::COUNT }> for BoardGenerator {
            fn step(&mut self) {
                match self {
                    $(Self::$variant(generator) => generator.step(),)+
                }
            }

            fn angles(&self) -> [Radians; Joint::COUNT] {
                match self {
                    $(Self::$variant(generator) => generator.angles(),)+
                }
            }

            fn rates(&self) -> [RadPerSec; Joint::COUNT] {
                match self {
                    $(Self::$variant(generator) => generator.rates(),)+
                }
            }

            fn phase(&self) -> Phase {
                match self {
                    $(Self::$variant(generator) => generator.phase(),)+
                }
            }

            fn amplitude(&self) -> f32 {
                match self {
                    $(Self::$variant(generator) => generator.amplitude(),)+
                }
            }

            fn check(&self) -> Result<(), StateFault> {
                match self {
                    $(Self::$variant(generator) => generator.check(),)+
                }
            }

            fn reset(&mut self) {
                match self {
                    $(Self::$variant(generator) => generator.reset(),)+
                }
            }
        }

        impl Follow for BoardGenerator {
            fn observe(&mut self, angle: Option<Radians>) {
                match self {
                    $(Self::$variant(generator) => <$module::Config as BoardKind>::observe(generator, angle),)+
                }
            }

            fn heel_strike(&mut self) {
                match self {
                    $(Self::$variant(generator) => <$module::Config as BoardKind>::heel_strike(generator),)+
                }
            }

            fn follow_status(&self) -> Option<FollowStatus> {
                match self {
                    $(Self::$variant(generator) => <$module::Config as BoardKind>::follow_status(generator),)+
                }
            }
        }

        #[cfg(feature = "serde")]
        impl GeneratorSet {
            /// Name of the kind.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => <$module::Config as BoardKind>::NAME,)+
                }
            }

            /// The configuration, in SI units.
            #[must_use]
            pub fn config(&self) -> GeneratorConfig {
                match self {
                    $(Self::$variant(set) => GeneratorConfig::$variant(file::KindSet::config(set)),)+
                }
            }

            /// The generator as the board runs it.
            ///
            /// # Errors
            /// [`BuildError`] names the first parameter that is not allowed.
            pub fn build(&self, period: Period) -> Result<BoardGenerator, BuildError> {
                self.config().build(period)
            }

            /// About how long a stride is, seconds.
            #[must_use]
            pub fn stride_guess_s(&self) -> f64 {
                match self {
                    $(Self::$variant(set) => file::KindSet::stride_guess_s(set),)+
                }
            }

            /// Checks every parameter, with the ranges of the configuration's own build at a period of 1 ms.
            ///
            /// # Errors
            /// [`SetError`] names the first key that is not allowed, and what is allowed.
            pub fn check(&self) -> Result<(), SetError> {
                match self {
                    $(Self::$variant(set) => file::check(set),)+
                }
            }

            /// Reads the table of a kind; `None` if there is no kind of this name.
            ///
            /// # Errors
            /// What the deserializer finds wrong with the table.
            pub fn deserialize<'de, D: serde::Deserializer<'de>>(name: &str, table: D) -> Option<Result<Self, D::Error>> {
                $(if name == <$module::Config as BoardKind>::NAME {
                    return Some(serde::Deserialize::deserialize(table).map(Self::$variant));
                })+
                None
            }
        }

        /// As the table of its kind.
        #[cfg(feature = "serde")]
        impl serde::Serialize for GeneratorSet {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                match self {
                    $(Self::$variant(set) => set.serialize(serializer),)+
                }
            }
        }
    };
}

board_generators! {
    /// R1: phase-coupled oscillators, see [`cpg_core::network::phase_coupled`].
    PhaseCoupled => phase_coupled,
    /// The thesis' network, see [`cpg_core::network::thesis`].
    Thesis => thesis,
    /// One phase and a Fourier series for each joint, see [`cpg_core::waveform::shape`].
    Shape => shape,
    /// The same, with the phase locked to a person's, see [`cpg_core::entrainment`].
    Follow => follow,
    /// One phase and a periodic spline for each joint, see [`cpg_core::waveform::shape::SplineShape`].
    Spline => spline,
}

impl GeneratorConfig {
    /// The default: the walk of [`cpg_core::gait::default_walk`].
    #[must_use]
    pub const fn default_walk() -> Self {
        Self::PhaseCoupled(cpg_core::gait::default_walk::default_config())
    }

    /// Words of the longest record.
    pub(crate) const MAX_WORDS: usize = {
        let (mut most, mut place) = (0, 0);
        while place < Self::RECORD_KINDS.len() {
            if Self::RECORD_KINDS[place].1 > most {
                most = Self::RECORD_KINDS[place].1;
            }
            place += 1;
        }
        most
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_record_numbers_are_distinct() {
        for (place, name) in GeneratorConfig::NAMES.iter().enumerate() {
            assert!(!GeneratorConfig::NAMES[..place].contains(name), "{name}");
        }
        let kinds: Vec<u16> = GeneratorConfig::RECORD_KINDS.iter().map(|kind| kind.0).collect();
        for (place, kind) in kinds.iter().enumerate() {
            assert!(!kinds[..place].contains(kind), "{kind}");
        }
    }
}
