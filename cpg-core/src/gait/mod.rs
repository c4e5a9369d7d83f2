//! Ready-made generators of hips and knees: named gaits, and every model of this crate with fitted numbers.
//!
//! | to | see |
//! |---|---|
//! | walk, with the default generator | [`default_walk`] |
//! | choose a gait by name, and change it while it runs | [`named`] |
//! | know how fast a gait may be played within rate limits | [`speed_limit`] |
//! | walk with ankles, or with ankles and arms | [`six_and_eight_joints`] |
//! | walk and run as people do, at a cadence, with start and stop | [`family`] |
//! | compare the models at one stride | [`catalogue`] |
//! | see the fitted numbers and their recording | [`fitted`] |

pub mod catalogue;
pub mod default_walk;
pub mod family;
pub mod fitted;
pub mod named;
pub mod six_and_eight_joints;
pub mod speed_limit;
