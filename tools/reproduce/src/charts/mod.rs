//! Charts of generators that run: a building block, the hexapod, four joints. The commands of `footfall` draw them too.

pub mod block;
pub mod legs;
pub mod motion;
