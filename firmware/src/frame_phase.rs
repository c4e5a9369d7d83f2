//! Whether the servo frames keep their distance from the clock: both count microseconds by one crystal, so it never changes.
//!
//! A count that jumps makes a pulse of another width, and moves the frames towards the ticks, which write the widths.

/// Servo frame, us: 50 Hz.
pub const FRAME_US: u32 = 20_000;

/// The two reads are less than this apart, us.
const APART_US: u32 = 2;

/// What a wrap of the clock's 32 bits adds to the distance, us.
const WRAP_US: u32 = (u32::MAX % FRAME_US + 1) % FRAME_US;

/// The distance since the first comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FramePhase {
    /// From the clock to the frame, 0 to [`FRAME_US`]; `None`: nothing was compared yet.
    distance_us: Option<u32>,
    last_us: u32,
}

impl FramePhase {
    /// Compares the clock with the count of the frame, which is read after it. Call it once in 71 minutes at least.
    ///
    /// ```
    /// use firmware::frame_phase::FramePhase;
    /// let mut phase = FramePhase::default();
    /// assert!(phase.is_kept(100_000, 340) && phase.is_kept(101_000, 1_341));
    /// assert!(!phase.is_kept(102_000, 2_600));
    /// ```
    pub fn is_kept(&mut self, now_us: u32, frame_us: u32) -> bool {
        let wrapped = if now_us < self.last_us { WRAP_US } else { 0 };
        self.last_us = now_us;
        let distance_us = (frame_us % FRAME_US + FRAME_US - now_us % FRAME_US) % FRAME_US;
        let kept = self.distance_us.map_or(distance_us, |kept| (kept + wrapped) % FRAME_US);
        self.distance_us = Some(kept);
        // One less where the first of all reads was the slower one.
        (distance_us + FRAME_US + APART_US - kept) % FRAME_US <= 2 * APART_US
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The clock and the frame of a true time, us, read one after the other.
    fn at(time: u64, apart: u64) -> (u32, u32) {
        (time as u32, ((time + 7_123 + apart) % u64::from(FRAME_US)) as u32)
    }

    #[test]
    fn it_is_kept_over_wraps_of_the_clock() {
        let mut phase = FramePhase::default();
        let wrap = 1_u64 << 32;
        for wraps in 1..4 {
            for tick in 0..40_000 {
                let (now, frame) = at(wraps * wrap - 20_000_000 + tick * 1_000 + tick % 7, tick % 2);
                assert!(phase.is_kept(now, frame), "wrap {wraps}, tick {tick}");
            }
        }
    }

    #[test]
    fn a_jump_is_found_and_stays_found() {
        for jump in (5..FRAME_US - 5).step_by(13) {
            let mut phase = FramePhase::default();
            for tick in 0..100 {
                let (now, frame) = at(tick * 1_000, 0);
                assert!(phase.is_kept(now, frame));
            }
            for tick in 100..140 {
                let (now, frame) = at(tick * 1_000, 0);
                assert!(!phase.is_kept(now, (frame + jump) % FRAME_US), "{jump} us");
            }
        }
    }
}
