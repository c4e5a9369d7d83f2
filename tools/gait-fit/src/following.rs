//! A follower that is played over a recorded person, and how well it follows.
//!
//! | module | content |
//! |---|---|
//! | [`learn`] | the templates of a person, and the phase of every sample |
//! | [`tick`] | one tick of a run |
//! | [`run`] | a run over a recording, and its errors |
//! | [`breaks`] | phase slips and false stops of a run |
//! | [`corrected`] | a run with corrections that were learned from other strides |
//! | [`possible`] | the errors beside what any follower of that sensor can reach |

pub mod breaks;
pub mod corrected;
pub mod learn;
pub mod possible;
pub mod run;
pub mod tick;
