//! Fault scripts: what happens to the board at which moment, as TOML. The campaign uses the same words.

mod event;
mod inject;
mod target;
mod values;
mod watcher;

pub(crate) use event::{Moment, On, Script};
pub(crate) use inject::Inject;
pub(crate) use values::{CoreRegister, HIGHEST_LSI_HZ, Memory, RttReader, Stream};
pub(crate) use watcher::Watcher;
