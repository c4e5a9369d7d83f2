//! Unix time.

use std::time::{SystemTime, UNIX_EPOCH};

/// Nanoseconds since the beginning of 1970, by the host's clock; 0 if that is set to an earlier time.
pub(crate) fn unix_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}
