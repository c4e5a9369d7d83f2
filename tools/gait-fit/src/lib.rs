//! Fits generators to recorded gait: parameters, errors on strides that were not fitted, certificate, report.
//!
//! | module | content |
//! |---|---|
//! | [`fit`](mod@fit) | from a recording as read to a generator file, with all results |
//! | [`series`] | the phase-and-shape generator, by linear least squares |
//! | [`search`] | the oscillator networks, by CMA-ES and Levenberg-Marquardt |
//! | [`generator_cycle`](mod@generator_cycle) | one stride of a generator as the board computes it |
//! | [`causal`](mod@causal) | the error with which a joint can be estimated from the past of another one |
//! | [`six_joints`] | a phase-coupled network of hips, knees and ankles |
//! | [`following`] | a follower that is played over a recorded person, and how well it follows |
//! | [`judge`](mod@judge) | errors of a fit, compared with the person's own variability |
//! | [`report`] | the results as one self-contained HTML page |
//! | [`html`] | parts of such pages |
#![forbid(unsafe_code)]

pub mod causal;
pub mod contact;
pub mod corrections;
pub mod fit;
pub mod following;
pub mod generator_cycle;
pub mod html;
pub mod judge;
pub mod measures;
pub mod normative;
pub mod report;
pub mod search;
pub mod series;
pub mod six_joints;
