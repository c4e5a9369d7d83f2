//! A walker: a generator's parameters as a file that says where they came from, and the certificate that goes with them.
//!
//! ```
//! use generator_file::file::{GeneratorSet, GeneratorFile};
//! let file = GeneratorFile::default_of("phase-coupled").expect("the default walk");
//! let text = file.to_toml();
//! assert_eq!(GeneratorFile::parse("generator.toml", &text).expect("what was written can be read"), file);
//! assert!(matches!(file.set, GeneratorSet::PhaseCoupled(_)));
//! ```

pub mod certificate;
pub mod entrainment;
pub mod file;
pub mod following;
pub mod gait_error;
mod in_single;
mod random;
mod specimen;
pub mod toml_file;
pub mod toml_table;
