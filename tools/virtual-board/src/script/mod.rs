//! Fault scripts: what happens to the board at which moment, as TOML. The campaign uses the same words.

mod event;
mod inject;
mod watcher;

pub(crate) use event::{Moment, On, Script};
pub(crate) use inject::{CoreRegister, Inject, Memory, RttReader, Stream};
pub(crate) use watcher::Watcher;
