//! Generator files: the parameters of a generator with their provenance, and the certificate of what the generator does.
//!
//! ```
//! use generator_file::file::{GeneratorSet, GeneratorFile};
//! let file = GeneratorFile::default_of("phase-coupled").expect("the default walk");
//! let text = file.to_toml();
//! assert_eq!(GeneratorFile::parse("generator.toml", &text).expect("what was written can be read"), file);
//! assert!(matches!(file.set, GeneratorSet::PhaseCoupled(_)));
//! ```

pub mod certificate;
pub mod drive;
pub mod entrainment;
pub mod file;
pub mod following;
pub mod gait_error;
pub mod inside_limits;
mod led;
pub mod limits;
mod model;
mod orbit;
mod random;
pub mod returns;
mod single_precision;
pub mod status;
pub mod subject;
pub mod toml_file;
pub mod toml_table;
