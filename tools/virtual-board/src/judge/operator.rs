//! What the operator allowed, seen at the pins of the button and of the emergency stop: without regard to what the firmware says.
//!
//! The rules are those of the operator's page, with tolerances towards the firmware: its tick reads a pin each millisecond. A pulse is allowed
//! from a deliberate hold on, after a test of the emergency stop since the boot; no longer after a stop, a reset, or a pause of the pulses.

/// A level counts after this time without a change: 20 readings of one millisecond, s.
const STABLE_S: f64 = 0.018;
/// A contact that opens for a shorter time may do so between two readings, s.
const READING_S: f64 = 1.05e-3;
/// Shortest hold that arms: 300 readings, s.
const HOLD_LEAST_S: f64 = 0.297;
/// A stop that is pressed for so long in a hold is seen by the tick: the hold does not arm, s.
const STOP_SEEN_S: f64 = 2e-3;
/// Longest hold that arms, s.
const HOLD_MOST_S: f64 = 1.55;
/// After a hold the first pulse starts within this time, s: the tick, two servo frames, and the supply.
const BEGINS_S: f64 = 0.25;
/// The break input ends the outputs within this time, s.
const BREAK_S: f64 = 50e-6;
/// After a press the pulses end within the time of a stop and this one: the tick, two servo frames, the rounding of the levels, s.
const STOP_ENDS_S: f64 = 0.2;
/// Outputs that gave no pulse for so long were stopped, s: five servo frames.
const PAUSE_S: f64 = 0.1;
/// A pulse may start so long after the tick that ends the outputs, s: a servo frame.
const LAST_FRAME_S: f64 = 0.025;

/// Test of the emergency stop since the boot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StopTest {
    /// Not seen released yet.
    Boot,
    Released,
    Pressed,
    Done,
}

/// A press of the button, from the time at which it was stable.
#[derive(Debug, Clone, Copy)]
struct Press {
    /// `None`: not stable yet.
    accepted: Option<f64>,
    /// Longest time without a released reading, s.
    steadiest: f64,
    /// The emergency stop was pressed meanwhile.
    is_stopped: bool,
}

/// Time in which pulses may start, s.
#[derive(Debug, Clone, Copy)]
struct Permission {
    from: f64,
    /// The first of them starts until then.
    first_until: f64,
    to: f64,
    is_used: bool,
    /// Why it ended.
    ended_by: &'static str,
}

/// State of the operator's inputs.
#[derive(Debug, Clone)]
pub(super) struct Operator {
    /// Level and its last change: the button is high while pressed, the stop while released.
    button: (bool, f64),
    stop: (bool, f64),
    /// When the button was pressed that is released now, s.
    pressed_at: f64,
    /// The button was seen released since the boot.
    has_been_released: bool,
    press: Option<Press>,
    test: StopTest,
    permission: Option<Permission>,
    last_pulse: f64,
    /// Last moment at which the emergency stop went low, s.
    pub(super) stopped: f64,
}

impl Operator {
    pub(super) const fn new() -> Self {
        Operator {
            button: (false, 0.0),
            stop: (true, 0.0),
            pressed_at: 0.0,
            has_been_released: false,
            press: None,
            test: StopTest::Boot,
            permission: None,
            last_pulse: f64::NEG_INFINITY,
            stopped: f64::NEG_INFINITY,
        }
    }

    /// Takes a reset of the chip: the firmware forgets everything.
    pub(super) fn reset(&mut self, seconds: f64) {
        self.end_permission(seconds, "the chip was reset");
        // What was held or pressed before counts from now on.
        *self = Operator {
            button: (self.button.0, seconds),
            stop: (self.stop.0, seconds),
            permission: self.permission,
            last_pulse: self.last_pulse,
            stopped: self.stopped,
            ..Self::new()
        };
    }

    /// The servos' supply was switched off.
    pub(super) fn supply_off(&mut self, seconds: f64) {
        self.end_permission(seconds, "the servos' supply was switched off");
    }

    /// Takes the levels of the two pins; a press ends the motion by a stop that takes at most so long, s.
    pub(super) fn observe(&mut self, seconds: f64, button: bool, stop: bool, stop_s: f64) {
        if stop != self.stop.0 {
            self.stop = (stop, seconds);
            if !stop {
                self.stopped = seconds;
                self.end_permission(seconds + BREAK_S, "the emergency stop was pressed");
            }
        }
        let stable = |(_, since): (bool, f64)| seconds - since >= STABLE_S;
        if stable(self.stop) {
            self.test = match (self.test, self.stop.0) {
                (StopTest::Boot, true) => StopTest::Released,
                (StopTest::Released, false) => StopTest::Pressed,
                (StopTest::Pressed, true) => StopTest::Done,
                (test, _) => test,
            };
        }
        if button != self.button.0 {
            let (is_between_readings, since) = (seconds - self.button.1 < READING_S, self.button.1);
            self.button = (button, if button && is_between_readings { self.pressed_at } else { seconds });
            if !button {
                self.pressed_at = since;
            }
            if button && self.has_been_released && self.press.is_none() {
                self.press = Some(Press { accepted: None, steadiest: 0.0, is_stopped: false });
            }
        }
        if let Some(Press { accepted: Some(accepted), is_stopped, .. }) = &mut self.press
            && !self.stop.0
        {
            *is_stopped |= seconds - accepted.max(self.stop.1) >= STOP_SEEN_S;
        }
        match &mut self.press {
            Some(press) if button => {
                let steady = seconds - self.button.1;
                press.steadiest = press.steadiest.max(steady);
                if steady >= STABLE_S && press.accepted.is_none() {
                    press.accepted = Some(seconds);
                    self.end_permission(seconds + stop_s + STOP_ENDS_S, "the button was pressed");
                }
            }
            _ if button || !stable(self.button) => {}
            press => {
                self.has_been_released = true;
                if let Some(press) = press.take() {
                    self.released(seconds, press);
                }
            }
        }
    }

    /// Takes the end of a press.
    fn released(&mut self, seconds: f64, press: Press) {
        let Some(accepted) = press.accepted else { return };
        let is_hold = !press.is_stopped && press.steadiest >= HOLD_LEAST_S && seconds - accepted <= HOLD_MOST_S;
        let stopped_a_motion = self.last_pulse > accepted + LAST_FRAME_S;
        if is_hold && !stopped_a_motion && self.stop.0 && self.test == StopTest::Done {
            self.permission = Some(Permission {
                from: seconds,
                first_until: seconds + BEGINS_S,
                to: f64::INFINITY,
                is_used: false,
                ended_by: "",
            });
        }
    }

    fn end_permission(&mut self, seconds: f64, why: &'static str) {
        if let Some(permission) = &mut self.permission
            && seconds < permission.to
        {
            (permission.to, permission.ended_by) = (seconds, why);
        }
    }

    /// Takes a pulse that started at this time; why it is not allowed.
    pub(super) fn pulse(&mut self, started: f64) -> Result<(), &'static str> {
        let pause = started - self.last_pulse;
        self.last_pulse = self.last_pulse.max(started);
        let Some(permission) = &mut self.permission else { return Err("no hold of the button armed it") };
        if started < permission.from {
            return Err("no hold of the button armed it");
        }
        if started > permission.to {
            return Err(permission.ended_by);
        }
        if permission.is_used && pause > PAUSE_S {
            (permission.to, permission.ended_by) = (started - pause, "the pulses had paused");
            return Err(permission.ended_by);
        }
        if !permission.is_used && started > permission.first_until {
            return Err("the hold was long ago");
        }
        permission.is_used = true;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a board's inputs up to a time: pressed in these intervals, s.
    fn inputs(operator: &mut Operator, from_s: f64, to_s: f64, button: &[[f64; 2]], stop: &[[f64; 2]]) {
        let is_on = |all: &[[f64; 2]], at: f64| all.iter().any(|[from, to]| (*from..*to).contains(&at));
        for ms in (from_s * 1e3) as u32..(to_s * 1e3) as u32 {
            let at = f64::from(ms) * 1e-3;
            operator.observe(at, is_on(button, at), !is_on(stop, at), 1.0);
        }
    }

    const TEST: [f64; 2] = [0.1, 0.2];

    /// Armed at 0.72 s: tested, then held from 0.3 to 0.7 s.
    fn armed() -> Operator {
        let mut operator = Operator::new();
        inputs(&mut operator, 0.0, 0.75, &[[0.3, 0.7]], &[TEST]);
        operator
    }

    #[test]
    fn a_hold_after_the_test_of_the_stop_allows_pulses() {
        assert_eq!(armed().pulse(0.74), Ok(()));
        for (button, stop, why) in [
            (&[[0.3, 0.7]][..], &[][..], "the stop was not tested"),
            (&[], &[TEST], "no hold"),
            (&[[0.3, 0.55]], &[TEST], "too short"),
            (&[[0.3, 0.5], [0.51, 0.7]], &[TEST], "a contact that opens makes no hold"),
            (&[[0.0, 0.7]], &[TEST], "held at boot"),
            (&[[0.3, 0.7]], &[TEST, [0.65, 2.0]], "the stop is pressed"),
            (&[[0.3, 0.7]], &[[0.4, 0.5]], "the stop is tested in the hold"),
            (&[[0.3, 0.7]], &[TEST, [0.5, 0.505]], "the stop is pressed in the hold"),
        ] {
            let mut operator = Operator::new();
            inputs(&mut operator, 0.0, 0.75, button, stop);
            assert_eq!(operator.pulse(0.74), Err("no hold of the button armed it"), "{why}");
        }
        let mut operator = Operator::new();
        inputs(&mut operator, 0.0, 2.45, &[[0.3, 2.4]], &[TEST]);
        assert!(operator.pulse(2.44).is_err(), "too long");
    }

    #[test]
    fn a_pulse_before_the_hold_and_one_long_after_it_are_not_allowed() {
        assert_eq!(armed().pulse(0.71), Err("no hold of the button armed it"));
        assert_eq!(armed().pulse(1.2), Err("the hold was long ago"));
    }

    /// An armed board that has given pulses up to a time.
    fn moving(to_s: f64) -> Operator {
        let mut operator = armed();
        let mut at = 0.74;
        while at < to_s {
            assert_eq!(operator.pulse(at), Ok(()));
            at += 0.02;
        }
        operator
    }

    #[test]
    fn what_was_stopped_needs_another_hold() {
        let mut paused = moving(2.0);
        assert_eq!(paused.pulse(2.2), Err("the pulses had paused"));
        assert_eq!(paused.pulse(2.22), Err("the pulses had paused"));

        let mut off = moving(2.0);
        off.supply_off(2.001);
        assert_eq!(off.pulse(2.02), Err("the servos' supply was switched off"));

        let mut reset = moving(2.0);
        reset.reset(2.001);
        assert_eq!(reset.pulse(2.0), Ok(()), "it started before the reset");
        assert_eq!(reset.pulse(2.02), Err("the chip was reset"));
        // After a reset the stop has to be tested again.
        inputs(&mut reset, 2.002, 3.0, &[[2.3, 2.8]], &[]);
        assert!(reset.pulse(2.84).is_err());

        let mut stopped = moving(2.0);
        inputs(&mut stopped, 2.0, 2.01, &[], &[[2.001, 9.0]]);
        assert_eq!(stopped.pulse(2.02), Err("the emergency stop was pressed"));
    }

    /// A press in the quarter of a second between a hold and its first pulse.
    #[test]
    fn a_press_before_the_first_pulse_ends_the_motion_too() {
        let mut operator = armed();
        inputs(&mut operator, 0.75, 0.8, &[[0.75, 9.0]], &[]);
        assert_eq!(operator.pulse(0.8), Ok(()));
        for frame in 0..70 {
            let from = 0.8 + 0.02 * f64::from(frame);
            inputs(&mut operator, from, from + 0.02, &[[0.75, 9.0]], &[]);
            let expected = if from < 1.95 { Ok(()) } else { Err("the button was pressed") };
            assert!(operator.pulse(from + 0.001) == expected || (1.95..2.0).contains(&from), "{from}");
        }
    }

    /// The firmware reads the contact each millisecond and may miss a shorter opening.
    #[test]
    fn an_opening_between_two_readings_may_be_missed() {
        for (open_s, arms) in [(0.2e-3, true), (0.9e-3, true), (1.2e-3, false)] {
            let mut operator = Operator::new();
            inputs(&mut operator, 0.0, 0.25, &[], &[TEST]);
            let mut at = 0.25;
            while at < 0.75 {
                let is_pressed = (0.3..0.5).contains(&at) || (0.5 + open_s..0.7).contains(&at);
                operator.observe(at, is_pressed, true, 1.0);
                at += 1e-4;
            }
            assert_eq!(operator.pulse(0.74).is_ok(), arms, "{open_s}");
        }
    }

    #[test]
    fn a_press_ends_a_motion_and_its_release_does_not_arm() {
        let mut operator = moving(2.0);
        let press = [2.0, 2.5];
        for frame in 0..55 {
            let from = 2.0 + 0.02 * f64::from(frame);
            inputs(&mut operator, from, from + 0.02, &[press], &[]);
            assert_eq!(operator.pulse(from + 0.001), Ok(()), "the ramp to the park pose");
        }
        inputs(&mut operator, 3.1, 3.3, &[press], &[]);
        assert_eq!(operator.pulse(3.16), Ok(()));
        assert_eq!(operator.pulse(3.25), Err("the button was pressed"));
        inputs(&mut operator, 3.3, 4.0, &[press, [3.5, 3.9]], &[]);
        assert_eq!(operator.pulse(3.95), Ok(()), "another hold arms");
    }
}
