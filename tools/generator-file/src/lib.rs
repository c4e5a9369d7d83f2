//! Generator files: the parameters of a generator with their provenance, and the certificate of what the generator does. Robot files.
//!
//! ```
//! use generator_file::file::{GeneratorSet, GeneratorFile};
//! let file = GeneratorFile::default_of("phase-coupled").expect("the default walk");
//! let text = file.to_toml();
//! assert_eq!(GeneratorFile::parse("generator.toml", &text).expect("what was written can be read"), file);
//! assert!(matches!(file.set, GeneratorSet::PhaseCoupled(_)));
//! ```

#[cfg(feature = "certificate")]
pub mod certificate;
#[cfg(feature = "certificate")]
pub mod corrected;
pub mod degrees;
#[cfg(feature = "certificate")]
pub mod drive;
#[cfg(feature = "certificate")]
pub mod entrainment;
pub mod file;
#[cfg(feature = "certificate")]
pub mod following;
#[cfg(feature = "certificate")]
pub mod gait_error;
#[cfg(feature = "certificate")]
pub mod host_motion;
#[cfg(feature = "certificate")]
pub mod inside_limits;
#[cfg(feature = "certificate")]
mod led;
#[cfg(feature = "certificate")]
pub mod limits;
#[cfg(feature = "certificate")]
pub mod model;
#[cfg(feature = "certificate")]
pub mod network_certificate;
pub mod network_file;
#[cfg(feature = "certificate")]
pub mod orbit;
#[cfg(feature = "certificate")]
pub mod random;
#[cfg(feature = "certificate")]
pub mod returns;
pub mod robot_file;
#[cfg(feature = "certificate")]
mod single_precision;
#[cfg(feature = "certificate")]
pub mod status;
#[cfg(feature = "certificate")]
pub mod subject;
pub mod toml_file;
pub mod word;
