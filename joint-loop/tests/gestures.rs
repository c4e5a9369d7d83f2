//! Gestures of the button: motion begins by a deliberate hold alone, one for each, and ends at the edge of a press, around every transition.

mod support;

use joint_loop::{BoardFaults, Cause, JointLoop, Sample, SupervisorState};
use support::{Walk, default_loop, good, reach};

type Board = JointLoop<Walk, 1>;

/// Ticks of a debounced edge, and the shortest and the longest hold that arms.
const STABLE: usize = 20;
const HOLD: [usize; 2] = [300, 1_500];

/// A loop, with all that it was given and what it came to.
struct Watched {
    joints: Board,
    levels: Vec<bool>,
    states: Vec<SupervisorState>,
}

impl Watched {
    /// In this state, with the button released.
    fn in_state(state: SupervisorState) -> Self {
        Self { joints: reach(&default_loop(), state), levels: vec![], states: vec![state] }
    }

    fn tick(&mut self, button: bool, faults: BoardFaults) {
        let tick = self.levels.len() as u32;
        self.joints.tick(&Sample { button, faults, ..good(tick) });
        self.levels.push(button);
        self.states.push(self.joints.state());
    }

    fn ticks(&mut self, ticks: usize, button: bool) {
        (0..ticks).for_each(|_| self.tick(button, BoardFaults::NONE));
    }

    /// So many times the joints began to move. Each was by the letter of the rule: the button was released for 20 ms after a hold of 0.3 to 1.5 s,
    /// and the state was the same from the press on.
    fn armings(&self) -> usize {
        let begun = |place: &usize| !self.states[*place].moving() && self.states[*place + 1].moving();
        let all: Vec<usize> = (0..self.levels.len()).filter(begun).collect();
        for &at in &all {
            let released = at + 1 - STABLE;
            assert!(self.levels[released..=at].iter().all(|held| !held), "not released at {at}");
            let pressed = self.levels[..released].iter().rposition(|held| !held).map_or(0, |before| before + 1);
            assert!((HOLD[0]..=HOLD[1]).contains(&(released - pressed)), "held for {}", released - pressed);
            let since = &self.states[pressed + STABLE..=at];
            assert!(since.iter().all(|state| *state == since[0]), "{:?} to {:?}", since[0], self.states[at]);
        }
        all.len()
    }
}

const STATES: [SupervisorState; 7] = [
    SupervisorState::Disarmed,
    SupervisorState::Arming,
    SupervisorState::Walking,
    SupervisorState::Stopping,
    SupervisorState::Fault,
    SupervisorState::TrimReady,
    SupervisorState::Trimming,
];

/// A contact that opens and closes at 1 to 200 Hz, with any share of the time closed.
#[test]
fn chatter_of_short_holds_arms_from_no_state() {
    for state in STATES {
        for hz in [2, 3, 5, 8, 10, 16, 20, 25, 33, 50, 66, 100, 125, 200] {
            for percent in [10, 50, 90] {
                let period = 1_000 / hz;
                let closed = (period * percent / 100).max(1);
                if closed >= HOLD[0] {
                    continue;
                }
                let mut board = Watched::in_state(state);
                for tick in 0..15_000 {
                    board.tick(tick % period < closed, BoardFaults::NONE);
                }
                board.ticks(5_000, false);
                assert_eq!(board.armings(), 0, "{state:?} {hz} Hz {percent} %");
                assert!(!board.joints.state().moving() || closed < STABLE, "{state:?} {hz} Hz {percent} %");
            }
        }
    }
}

/// At 1 Hz each closed half is a deliberate hold: the first arms, the second stops, and from the third on they are too many.
#[test]
fn chatter_of_long_holds_arms_once() {
    for state in STATES {
        let mut board = Watched::in_state(state);
        for tick in 0..60_000 {
            board.tick(tick % 1_000 < 500, BoardFaults::NONE);
        }
        // In fault the first acknowledges, and the second arms.
        assert!(board.armings() <= 1, "{state:?}: {}", board.armings());
        assert!(!board.joints.state().moving(), "{state:?}");
        let moved = state.moving() || board.armings() == 1;
        assert!(moved || state == SupervisorState::Fault, "{state:?}");
    }
}

/// A hold that begins or ends near a transition: the end of a stop, the end of the ramp, a fault.
#[test]
fn a_hold_around_a_transition_acts_on_one_state() {
    for (state, ticks) in [
        (SupervisorState::Arming, 1_300_usize),
        (SupervisorState::Stopping, 705),
        (SupervisorState::Disarmed, 1_000),
        (SupervisorState::Walking, 1_000),
    ] {
        for held in [40, 290, 300, 400, 1_500, 1_520] {
            for early in
                (0..=ticks).step_by(if held == 400 { 3 } else { 67 }).chain(ticks.saturating_sub(30)..=ticks + 5)
            {
                let mut board = Watched::in_state(state);
                for tick in 0..ticks + 2_000 {
                    // A fault in the middle of the course, unless the transition is that of a ramp.
                    let has_fault =
                        tick == ticks && matches!(state, SupervisorState::Disarmed | SupervisorState::Walking);
                    let faults = if has_fault { BoardFaults::CLOCK } else { BoardFaults::NONE };
                    board.tick((early..early + held).contains(&tick), faults);
                }
                let armings = board.armings();
                assert!(armings <= 1, "{state:?} {held} {early}");
                let last = board.joints.frame();
                if last.state == SupervisorState::Fault {
                    assert_eq!(last.cause, Cause::Clock, "{state:?} {held} {early}");
                }
            }
        }
    }
}

/// A press stops at its debounced edge, in every moving state, also when presses are refused.
#[test]
fn a_press_stops_at_once_even_when_it_is_refused() {
    for state in [SupervisorState::Arming, SupervisorState::Walking, SupervisorState::Trimming] {
        let mut board = Watched::in_state(state);
        board.ticks(STABLE - 1, true);
        assert_eq!(board.joints.state(), state);
        board.ticks(1, true);
        assert_ne!(board.joints.state(), state);
        // Released after a hold: nothing more happens.
        board.ticks(400, true);
        board.ticks(20_000, false);
        assert_eq!((board.armings(), board.joints.frame().cause), (0, Cause::Button), "{state:?}");
    }
    // Armed by the second of two holds; the press that stops is the third.
    let mut board = Watched::in_state(SupervisorState::Disarmed);
    for (held, then) in [(100, 100), (400, 300)] {
        board.ticks(held, true);
        board.ticks(then, false);
    }
    assert_eq!(board.joints.state(), SupervisorState::Arming);
    board.ticks(STABLE, true);
    assert_eq!(board.joints.state(), SupervisorState::Stopping);
}

#[test]
fn the_cause_says_why_a_press_did_not_arm() {
    for (holds, cause) in [
        (&[299][..], Cause::HoldShort),
        (&[1_501], Cause::HoldLong),
        (&[100, 100, 400], Cause::Presses),
        (&[400], Cause::None),
    ] {
        let mut board = Watched::in_state(SupervisorState::Disarmed);
        for held in holds {
            board.ticks(*held, true);
            board.ticks(STABLE, false);
        }
        assert_eq!(board.joints.frame().cause, cause);
        assert_eq!(board.armings(), usize::from(cause == Cause::None), "{holds:?}");
    }
}
