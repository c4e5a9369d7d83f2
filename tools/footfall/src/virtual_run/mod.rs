//! A run of a firmware image on the virtual board: prepared, shown, recorded, and compared with the host.

mod prepare;
pub mod run;
pub mod settings;
mod tuned;
