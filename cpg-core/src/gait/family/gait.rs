//! The family as one generator: stands, starts, walks at a cadence, changes to a run and back, stops.

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::gait::family::{Member, START, STOP};
use crate::transition::{JointLimits, Smooth, TransitionConfig};
use crate::waveform::shape::{FourierShape, PhaseShape};
use crate::{BuildError, Generator, StateFault};

/// The pose of a stand: legs straight, knees at 5 degrees.
pub const STAND: [Radians; 4] = [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)];

/// Half a stride.
const HALF: Phase = Phase(1 << 31);

/// The leg that swings first at a start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstLeg {
    /// The left one, as in the recorded start.
    Left,
    /// The right one.
    Right,
}

/// What the generator does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Standing,
    Walking,
    /// Walks on to the phase of a stop.
    Stopping,
}

/// A generator of the family. Every change is smooth and inside the limits of the joints ([`crate::transition`], with its default acceleration
/// and settling time).
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::family::{FamilyGait, FirstLeg, Member, STAND};
/// use cpg_core::transition::JointLimits;
/// use joint_units::Period;
/// let mut gait = FamilyGait::build(Member::Walk, 105.0, [JointLimits::WIDEST; 4], Period::MILLISECOND)?;
/// gait.start(FirstLeg::Left);
/// for tick in 0..10_000_u16 {
///     // Faster by 2 steps a minute in each second.
///     gait.set_cadence(105.0 + 0.002 * f32::from(tick))?;
///     gait.step();
/// }
/// assert!(gait.set_cadence(140.0).is_err() && gait.cadence() > 124.9);
/// gait.change(Member::Run, 160.0)?;
/// gait.stop();
/// for _ in 0..3_000 {
///     gait.step();
/// }
/// assert!(gait.is_standing() && gait.angles() == STAND);
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FamilyGait {
    member: Member,
    cadence: f32,
    state: State,
    smooth: Smooth<PhaseShape<FourierShape<6>, 4>, 4>,
}

impl FamilyGait {
    /// A member at a cadence in steps a minute, for joints with these limits; it stands at [`STAND`] until [`FamilyGait::start`].
    ///
    /// # Errors
    /// As [`Member::at_cadence`] and [`TransitionConfig::build`]; `pose` where a joint cannot stand at [`STAND`].
    pub fn build(member: Member, cadence: f32, limits: [JointLimits; 4], period: Period) -> Result<Self, BuildError> {
        let shape = member.at_cadence(cadence)?.build(period)?;
        let mut smooth = TransitionConfig::default().build(shape, limits, period)?;
        smooth.hold(STAND)?;
        Ok(Self { member, cadence, state: State::Standing, smooth })
    }

    /// Starts from the stand with a leg, at the phase of the recorded start. Ends a stop that has not begun; a gait that goes on is not
    /// changed.
    pub fn start(&mut self, first: FirstLeg) {
        if self.state == State::Standing {
            let phase = match first {
                FirstLeg::Left => START,
                FirstLeg::Right => START + HALF,
            };
            self.smooth.change(|shape| shape.set_phase(phase));
            self.smooth.resume();
        }
        self.state = State::Walking;
    }

    /// Stops: walks on to the phase of the recorded stop, at most half a stride, and then stands.
    pub fn stop(&mut self) {
        if self.state == State::Walking {
            self.state = State::Stopping;
        }
    }

    /// Sets the cadence in steps a minute, at any tick.
    ///
    /// # Errors
    /// As [`Member::at_cadence`]; the gait then goes on unchanged.
    pub fn set_cadence(&mut self, cadence: f32) -> Result<(), BuildError> {
        self.change(self.member, cadence)
    }

    /// Changes to a member at a cadence, at any tick and at the same phase.
    ///
    /// # Errors
    /// As [`Member::at_cadence`]; the gait then goes on unchanged.
    pub fn change(&mut self, member: Member, cadence: f32) -> Result<(), BuildError> {
        let to = member.at_cadence(cadence)?;
        self.smooth.change(|shape| {
            shape.set_shapes(to.shapes);
            shape.set_stride(to.stride_s)
        })?;
        (self.member, self.cadence) = (member, cadence);
        Ok(())
    }

    /// The member.
    #[must_use]
    pub const fn member(&self) -> Member {
        self.member
    }

    /// The cadence, steps a minute.
    #[must_use]
    pub const fn cadence(&self) -> f32 {
        self.cadence
    }

    /// Whether it stands and has come to rest.
    #[must_use]
    pub fn is_standing(&self) -> bool {
        self.state == State::Standing && !self.smooth.is_changing()
    }
}

impl Generator<4> for FamilyGait {
    fn step(&mut self) {
        let before = self.phase();
        self.smooth.step();
        let now = self.phase();
        // Of the two phases one is passed if it lies within the last step.
        let passed = |phase: Phase| (phase - before).0.wrapping_sub(1) < (now - before).0;
        if self.state == State::Stopping && (passed(STOP) || passed(STOP + HALF)) {
            // `build` has tried the pose.
            if self.smooth.stop(STAND).is_ok() {
                self.state = State::Standing;
            }
        }
    }

    fn angles(&self) -> [Radians; 4] {
        self.smooth.angles()
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.smooth.rates()
    }

    fn phase(&self) -> Phase {
        self.smooth.phase()
    }

    fn amplitude(&self) -> f32 {
        self.smooth.amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.smooth.check()
    }

    /// Back to the stand.
    fn reset(&mut self) {
        self.smooth.reset();
        if self.smooth.hold(STAND).is_ok() {
            self.state = State::Standing;
        }
    }
}
