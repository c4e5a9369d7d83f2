//! Whether the servo frames keep their distance from the clock: both count microseconds by one crystal, so it never changes.
//!
//! A count that jumps makes a pulse of another width, and moves the frames towards the ticks, which write the widths.

/// Servo frame, us: 50 Hz.
pub const FRAME_US: u32 = 20_000;

/// The two reads are less than this apart, us.
const APART_US: u32 = 2;

/// The distance since the first comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FramePhase {
    /// When a frame began by the clock, with the distance of the first comparison, us; `None`: nothing was compared yet.
    began_us: Option<u32>,
}

impl FramePhase {
    /// Compares the clock with the count of the frame, which is read after it. Call it once in 71 minutes at least.
    ///
    /// ```
    /// use firmware_shared::frame_phase::FramePhase;
    /// let mut phase = FramePhase::default();
    /// assert!(phase.is_kept(100_000, 340) && phase.is_kept(101_000, 1_341));
    /// assert!(!phase.is_kept(102_000, 2_600));
    /// ```
    pub fn is_kept(&mut self, now_us: u32, frame_us: u32) -> bool {
        let frame_us = if frame_us < FRAME_US { frame_us } else { frame_us % FRAME_US };
        let began_us = self.began_us.unwrap_or(now_us.wrapping_sub(frame_us));
        // The clock wraps, and so does the difference.
        let since_us = now_us.wrapping_sub(began_us);
        let into_us = if since_us < FRAME_US { since_us } else { since_us % FRAME_US };
        self.began_us = Some(now_us.wrapping_sub(into_us));
        // One less where the first of all reads was the slower one. Between the two reads a frame may begin.
        let later_us = (frame_us + APART_US).wrapping_sub(into_us);
        let is_near = |us: u32| us <= 2 * APART_US;
        is_near(later_us) || is_near(later_us.wrapping_add(FRAME_US)) || is_near(later_us.wrapping_sub(FRAME_US))
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
