//! The dialogue of a trim: the user moves the servo and says which angles the joint has.

use std::collections::VecDeque;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TryRecvError};

use joint_loop::control::trim::STEP_S;
use joint_loop::tuning::{Action, Outcome};
use joint_loop::{LoopError, RobotConfig, ServoMap, SupervisorState};
use joint_units::{Joint, Period, PulseMicros};

use super::board::{Seen, Trimmed};
use super::line::{HELP, Line};
use super::solution::{LEAST_SPAN_DEG, Point, solve};
use crate::failure::Failure;

/// Ticks after which the last jog is repeated: a board ends a trim whose host is silent.
const REPEAT: u32 = 1_000;

/// Ticks after which servos that report the same pulses have come to where the board leads them: many steps of a trim.
const STANDS: u32 = 500;

/// Ticks of two servo frames: a pulse that the board reports goes to the servo in the next frame, which has ended by then.
const TWO_FRAMES: u32 = 40;

/// A trim of one joint.
pub(super) struct Session<B, W> {
    board: B,
    joint: Joint,
    robot: RobotConfig,
    lines: Receiver<io::Result<String>>,
    /// Lines of a script wait until they can be obeyed; a person gets an answer at once.
    is_script: bool,
    waiting: VecDeque<String>,
    /// The board was asked for a trim.
    is_chosen: bool,
    out: W,
    /// Pulse that the servo moves to; nothing outside a trim.
    goal: Option<PulseMicros>,
    /// The servo is on its way; false as soon as the program has said that it is there.
    is_moving: bool,
    /// Tick in which the board took the goal: a report of before is of the way to another.
    moved: u32,
    /// Tick since which the board reports the goal.
    reported: Option<u32>,
    /// Tick of the last jog.
    jogged: u32,
    /// On the way to the park pose: the last pulses, and the tick since which they are the same.
    returning: Option<([PulseMicros; Joint::COUNT], u32)>,
    last_move: i32,
    points: Vec<Point>,
}

impl<B: Trimmed, W: Write> Session<B, W> {
    pub(super) fn new(
        board: B,
        joint: Joint,
        robot: RobotConfig,
        lines: Receiver<io::Result<String>>,
        is_script: bool,
        out: W,
    ) -> Self {
        let (waiting, points) = (VecDeque::new(), Vec::new());
        let (is_chosen, is_moving, goal, reported) = (false, false, None, None);
        Self {
            board,
            joint,
            robot,
            lines,
            is_script,
            waiting,
            is_chosen,
            out,
            goal,
            is_moving,
            moved: 0,
            reported,
            jogged: 0,
            returning: None,
            last_move: 1,
            points,
        }
    }

    /// Talks until the user is done. The board is out of trim afterwards, however this ends.
    ///
    /// # Errors
    /// The user quits, the answers end, or the board refuses, fails or is silent.
    pub(super) fn run(mut self) -> Result<Vec<Point>, Failure> {
        let ended = self.talk();
        if !self.is_chosen {
            return ended.map(|()| self.points);
        }
        // From trimming to trim_ready, and from there to disarmed.
        let left = self.board.ask(Action::Stop).and_then(|_| self.board.ask(Action::Stop));
        if ended.is_ok() {
            left?;
        }
        ended.map(|()| self.points)
    }

    fn talk(&mut self) -> Result<(), Failure> {
        // A board that has not started takes no request.
        while self.board.listen()?.is_none() {}
        self.choose()?;
        loop {
            let Some(seen) = self.board.listen()? else { continue };
            match seen.state {
                SupervisorState::Trimming if self.goal.is_none() => self.begin(&seen)?,
                SupervisorState::Trimming => {
                    self.arrive(&seen)?;
                    self.keep_going(&seen)?;
                }
                _ if self.goal.is_some() => self.pause(&seen)?,
                // A fault that was acknowledged: the next hold of the button would arm a walk.
                SupervisorState::Disarmed => self.choose()?,
                _ => {}
            }
            if self.take_line(&seen)? {
                return Ok(());
            }
        }
    }

    /// Makes the next hold of the button begin a trim.
    fn choose(&mut self) -> Result<(), Failure> {
        let name = self.joint.name();
        match self.board.ask(Action::Trim { joint: self.joint })?.outcome {
            Outcome::Staged => self.is_chosen = true,
            Outcome::NotAtRest => {
                return Err(Failure::run(
                    "the board is not at rest: end the walk, or acknowledge the fault, with its button, or wait 5 s for the end of another trim; \
                     then run this again",
                ));
            }
            other => return Err(Failure::run(format!("the board refused the trim: {}", other.name()))),
        }
        // The state of before the answer is no longer that of the board.
        while self.board.listen()?.is_none_or(|seen| seen.state == SupervisorState::Disarmed) {}
        self.tell(format_args!(
            "{name}: hold the board's button for half a second; after a boot, press the emergency stop and release it before. At the release of the button all \
             servos get pulses: they go to the park pose. Keep clear; a press switches them off at once."
        ))
    }

    /// Begins when the servos are in the park pose. Where the last pulses were elsewhere the board leads them there slowly.
    fn begin(&mut self, seen: &Seen) -> Result<(), Failure> {
        let parked = self.parked()?;
        if seen.pulses != parked {
            if self.returning.is_none_or(|(pulses, _)| pulses != seen.pulses) {
                if self.returning.is_none() {
                    self.tell(format_args!("the servos go to the park pose first, from where their pulses ended"))?;
                }
                self.returning = Some((seen.pulses, seen.tick));
            }
            let stands = self.returning.is_some_and(|(_, since)| seen.tick.wrapping_sub(since) >= STANDS);
            if stands {
                let [board, file] = [seen.pulses, parked].map(|pulses| pulses.map(|pulse| pulse.0));
                return Err(Failure::run(format!(
                    "the board has the record of another robot: its park pose is {board:?} us, that of the robot file {file:?} us; flash the file first: \
                     cargo xtask flash --keep --robot FILE"
                )));
            }
            return Ok(());
        }
        self.returning = None;
        let pulse = parked[self.joint as usize];
        (self.goal, self.moved, self.jogged) = (Some(pulse), seen.tick, seen.tick);
        self.tell(format_args!(
            "{} is at {} us. Move it to 0 degrees and type `angle 0`, then to another angle, {LEAST_SPAN_DEG} degrees away or more.\n{HELP}",
            self.joint.name(),
            pulse.0
        ))
    }

    /// Pulses of the park pose by the robot file.
    fn parked(&self) -> Result<[PulseMicros; Joint::COUNT], Failure> {
        let robot = self.robot.build(Period::MILLISECOND).map_err(Failure::input)?;
        ServoMap::pulses(&robot.servos, self.robot.park).ok_or(LoopError::Park).map_err(Failure::input)
    }

    fn arrive(&mut self, seen: &Seen) -> Result<(), Failure> {
        let pulse = seen.pulses[self.joint as usize];
        let is_later = seen.tick.wrapping_sub(self.moved) as i32 >= 0;
        let is_goal = is_later && self.goal == Some(pulse);
        self.reported = self.reported.filter(|_| is_goal).or(is_goal.then_some(seen.tick));
        if self.is_moving && self.is_there(seen) {
            self.is_moving = false;
            self.tell(format_args!("at {} us", pulse.0))?;
        }
        Ok(())
    }

    /// The servo has got the pulse of the goal.
    fn is_there(&self, seen: &Seen) -> bool {
        self.reported.is_some_and(|since| seen.tick.wrapping_sub(since) >= TWO_FRAMES)
    }

    fn keep_going(&mut self, seen: &Seen) -> Result<(), Failure> {
        match self.goal.filter(|_| seen.tick.wrapping_sub(self.jogged) >= REPEAT) {
            Some(pulse) => {
                self.jogged = seen.tick;
                self.jog(pulse)
            }
            None => Ok(()),
        }
    }

    /// The trim has ended on the board.
    fn pause(&mut self, seen: &Seen) -> Result<(), Failure> {
        (self.goal, self.is_moving, self.reported, self.returning) = (None, false, None, None);
        let cause = seen.cause.name();
        if seen.state == SupervisorState::Fault {
            return self.tell(format_args!(
                "fault, cause {cause}: the outputs are off. A hold of half a second acknowledges it; or `quit`"
            ));
        }
        self.tell(format_args!(
            "the outputs are off, cause {cause}. A hold of half a second goes on from the park pose; the angles so far are kept; or `quit`, `done`"
        ))
    }

    fn jog(&mut self, pulse: PulseMicros) -> Result<(), Failure> {
        let answer = self.board.ask(Action::Jog { pulse })?;
        match answer.outcome {
            Outcome::InEffect if self.goal == Some(pulse) => {}
            Outcome::InEffect => (self.goal, self.moved) = (Some(pulse), answer.tick),
            // It has ended in the meantime, which its state will show.
            Outcome::NotTrimming => {}
            other => self.tell(format_args!("the board refuses {} us: {}", pulse.0, other.name()))?,
        }
        Ok(())
    }

    /// Takes the next line, if there is one that can be answered now. True if it was the last: `done`.
    fn take_line(&mut self, seen: &Seen) -> Result<bool, Failure> {
        match self.lines.try_recv() {
            Ok(line) => self.waiting.push_back(line.map_err(Failure::run)?),
            Err(TryRecvError::Disconnected) if self.waiting.is_empty() => {
                return Err(Failure::input("the answers end; allowed is `done` or `quit`"));
            }
            Err(_) => {}
        }
        let Some(text) = self.waiting.front().cloned() else { return Ok(false) };
        let line = Line::read(&text);
        let too_early = match (line, self.goal) {
            (Some(Line::Angle(_) | Line::Move(_) | Line::To(_) | Line::Repeat), None) => {
                Some("the servo gets no pulses: hold the button for half a second first".to_owned())
            }
            (Some(Line::Angle(_)), Some(goal)) if !self.is_there(seen) => {
                Some(format!("the servo is still on its way to {} us; say the angle when it is there", goal.0))
            }
            _ => None,
        };
        if too_early.is_some() && self.is_script {
            return Ok(false);
        }
        self.waiting.pop_front();
        if let Some(why) = too_early {
            self.tell(why)?;
            return Ok(false);
        }
        match line {
            None => self.tell(format_args!("`{text}` is not understood; allowed are\n{HELP}"))?,
            Some(Line::Help) => self.tell(HELP)?,
            Some(Line::Quit) => return Err(Failure::run("ended without a map; nothing is written")),
            Some(Line::Done) => match solve(&self.points) {
                Ok(_) => return Ok(true),
                Err(why) => self.tell(why)?,
            },
            Some(Line::Undo) => match self.points.pop() {
                Some(point) => self.tell(format_args!("forgotten: {point}"))?,
                None => self.tell("there is no angle to forget")?,
            },
            Some(Line::Angle(angle_deg)) => {
                let point = Point { pulse: seen.pulses[self.joint as usize], angle_deg };
                self.points.push(point);
                self.tell(point)?;
            }
            Some(Line::Move(by)) => {
                self.last_move = by;
                self.move_by(by)?;
            }
            Some(Line::Repeat) => self.move_by(self.last_move)?,
            Some(Line::To(pulse)) => self.move_to(pulse.into())?,
        }
        Ok(false)
    }

    fn move_by(&mut self, by: i32) -> Result<(), Failure> {
        let from = self.goal.unwrap_or_default();
        self.move_to(i32::from(from.0) + by)
    }

    fn move_to(&mut self, micros: i32) -> Result<(), Failure> {
        let servo = self.robot.servos[self.joint as usize];
        let (shortest, longest) = (servo.shortest.0, servo.longest.0);
        match u16::try_from(micros).ok().filter(|micros| (shortest..=longest).contains(micros)) {
            Some(micros) => {
                let way = self.goal.map_or(0, |from| from.0.abs_diff(micros));
                self.tell(format_args!("to {micros} us, {:.1} s", f32::from(way) * STEP_S))?;
                (self.is_moving, self.reported) = (true, None);
                self.jog(PulseMicros(micros))
            }
            None => self.tell(format_args!(
                "{micros} us: allowed are {shortest} to {longest} us, shortest_us and longest_us of the robot file"
            )),
        }
    }

    fn tell(&mut self, what: impl Display) -> Result<(), Failure> {
        writeln!(self.out, "{what}").and_then(|()| self.out.flush()).map_err(Failure::run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
    use joint_loop::tuning::Request;
    use joint_loop::{BoardFaults, Cause, Sample, WatchdogHz};
    use joint_units::{AdcCode, Volts};
    use std::sync::mpsc::{Sender, channel};
    use wire::Answered;

    /// The loop of a board, with holds of its button from these ticks on and a fault at one.
    struct Loop {
        joints: BoardLoop,
        presses: Vec<u32>,
        fault_at: Option<u32>,
        /// Of the left hip, in each tick.
        pulses: Vec<PulseMicros>,
    }

    impl Loop {
        fn new(presses: &[u32]) -> Self {
            let default = Parameters::with_defaults(None, None, RobotConfig::default_biped()).unwrap();
            let joints = board_loop(&default, AdcCode(1501), Volts(2.7), false).unwrap();
            let mut board = Self { joints, presses: presses.into(), fault_at: None, pulses: Vec::new() };
            board.tick(None);
            board
        }

        fn tick(&mut self, request: Option<Request>) {
            let now = self.joints.frame().tick;
            let button = self.presses.iter().any(|at| (*at..at + 400).contains(&now));
            // After the boot the emergency stop is tested.
            let faults = match now {
                50..100 => BoardFaults::BREAK_INPUT,
                _ if self.fault_at == Some(now) => BoardFaults::CLOCK,
                _ => BoardFaults::NONE,
            };
            let watchdog_clock = Some(WatchdogHz(32_000));
            let vrefint = AdcCode(1501);
            self.joints.tick(&Sample { button, faults, request, vrefint, watchdog_clock, ..Sample::default() });
            self.pulses.push(self.joints.frame().pulses[0]);
        }
    }

    impl Trimmed for &mut Loop {
        fn ask(&mut self, action: Action) -> Result<Answered, Failure> {
            self.tick(Some(Request { number: 1, action }));
            Ok(self.joints.answers().next().unwrap().into())
        }

        fn listen(&mut self) -> Result<Option<Seen>, Failure> {
            (0..10).for_each(|_| self.tick(None));
            let frame = self.joints.frame();
            if frame.tick > 200_000 {
                return Err(Failure::run("too long"));
            }
            Ok(Some(Seen { tick: frame.tick, state: frame.state, cause: frame.cause, pulses: frame.pulses }))
        }
    }

    fn session(board: &mut Loop, robot: RobotConfig, lines: &str) -> (Result<Vec<Point>, String>, String) {
        let mut said = Vec::new();
        let (sender, answers) = channel();
        lines.lines().for_each(|line| sender.send(Ok(line.to_owned())).unwrap());
        drop(sender);
        let ended = Session::new(board, Joint::LeftHip, robot, answers, true, &mut said).run();
        (ended.map_err(|failure| failure.to_string()), String::from_utf8(said).unwrap())
    }

    const DEFAULT: RobotConfig = RobotConfig::default_biped();

    fn points(of: &[(u16, f64)]) -> Vec<Point> {
        of.iter().map(|(pulse, angle_deg)| Point { pulse: PulseMicros(*pulse), angle_deg: *angle_deg }).collect()
    }

    #[test]
    fn angles_are_taken_where_the_servo_has_come_to() {
        let mut board = Loop::new(&[500]);
        let (ended, said) = session(&mut board, DEFAULT, "=1480\nangle 0\n-100\n\n\nangle 30\nangle 99\nundo\ndone\n");
        assert_eq!(ended, Ok(points(&[(1_480, 0.0), (1_180, 30.0)])), "{said}");
        assert_eq!((board.joints.state(), board.joints.frame().cause), (SupervisorState::Disarmed, Cause::Request));
        assert!(
            said.contains("hold the board's button") && said.contains("forgotten: 1180 us is 99 degrees"),
            "{said}"
        );
    }

    /// A frame of the servos begins every 20 ms: what the board reports is at the servo later.
    #[test]
    fn an_angle_is_that_of_a_pulse_that_the_servo_has_had() {
        let mut board = Loop::new(&[500]);
        let (ended, said) = session(&mut board, DEFAULT, "=1480\nangle 0\n=1380\nangle 10\ndone\n");
        assert!(ended.is_ok(), "{said}");
        for goal in [1_480, 1_380] {
            let ticks = board.pulses.iter().filter(|pulse| pulse.0 == goal).count();
            assert!(ticks >= 40, "{ticks} ticks at {goal} us");
        }
    }

    /// Five reports a second: the board has moved on from the pulse of its last report when the user goes back to it.
    #[test]
    fn a_report_of_the_way_to_another_pulse_is_not_that_of_the_goal() {
        struct Rarely<'a> {
            board: &'a mut Loop,
            last: Option<Seen>,
            user: Sender<io::Result<String>>,
            back_to: Option<PulseMicros>,
        }
        impl Trimmed for &mut Rarely<'_> {
            fn ask(&mut self, action: Action) -> Result<Answered, Failure> {
                (&mut *self.board).ask(action)
            }

            fn listen(&mut self) -> Result<Option<Seen>, Failure> {
                let seen = (&mut *self.board).listen()?;
                let now = self.board.joints.frame().tick;
                if self.last.is_none_or(|last| now >= last.tick + 200) {
                    self.last = seen;
                }
                let on_its_way = |last: &Seen| last.pulses[0].0 > 1_400 && last.pulses[0].0 < 1_500;
                if let Some(last) = self.last.filter(|last| on_its_way(last) && now >= last.tick + 100)
                    && self.back_to.is_none()
                {
                    self.back_to = Some(last.pulses[0]);
                    let lines = [format!("={}", last.pulses[0].0), "angle 0".into(), "quit".into()];
                    lines.into_iter().for_each(|line| self.user.send(Ok(line)).unwrap());
                }
                Ok(self.last)
            }
        }
        let mut board = Loop::new(&[500]);
        let (user, lines) = channel();
        user.send(Ok("=1400".into())).unwrap();
        let mut rarely = Rarely { board: &mut board, last: None, user, back_to: None };
        let mut said = Vec::new();
        let ended = Session::new(&mut rarely, Joint::LeftHip, DEFAULT, lines, true, &mut said).run();
        let (goal, said) = (rarely.back_to.unwrap(), String::from_utf8(said).unwrap());
        assert!(ended.unwrap_err().to_string().contains("ended without a map"), "{said}");
        assert!(said.contains(&format!("at {} us", goal.0)), "{said}");
        let stays = board.pulses.chunk_by(|one, next| one == next).filter(|stay| stay[0] == goal);
        let longest = stays.map(<[_]>::len).max();
        assert!(longest >= Some(40), "{longest:?} ticks at {} us: {said}", goal.0);
    }

    /// The user thinks for a minute: the program keeps the trim going.
    #[test]
    fn a_slow_user_loses_nothing() {
        type Answer = io::Result<String>;
        struct Slowly<'a>(&'a mut Loop, Sender<Answer>, Vec<(u32, &'static str)>);
        impl Trimmed for Slowly<'_> {
            fn ask(&mut self, action: Action) -> Result<Answered, Failure> {
                (&mut *self.0).ask(action)
            }

            fn listen(&mut self) -> Result<Option<Seen>, Failure> {
                let seen = (&mut *self.0).listen()?;
                if self.2.first().is_some_and(|(at, _)| self.0.joints.frame().tick >= *at) {
                    self.1.send(Ok(self.2.remove(0).1.into())).unwrap();
                }
                Ok(seen)
            }
        }
        let mut board = Loop::new(&[500]);
        let (sender, answers) = channel();
        let lines = vec![
            (100, "+10"),
            (60_000, "angle 0"),
            (120_000, "+100"),
            (120_100, "angle 14"),
            (180_000, "angle 15"),
            (180_200, "done"),
        ];
        let mut said = Vec::new();
        let ended =
            Session::new(Slowly(&mut board, sender, lines), Joint::LeftHip, DEFAULT, answers, false, &mut said).run();
        assert_eq!(ended.unwrap(), points(&[(1_500, 0.0), (1_600, 15.0)]));
        let said = String::from_utf8(said).unwrap();
        // A person gets an answer, and nothing that was said too early happens later.
        assert!(
            said.contains("hold the button for half a second first") && said.contains("still on its way to 1600 us"),
            "{said}"
        );
        assert!(said.contains("to 1600 us, 1.0 s\nthe servo is still") && said.contains("\nat 1600 us\n"), "{said}");
    }

    #[test]
    fn a_press_pauses_and_a_fault_does_not_lead_to_a_walk() {
        let lines = "=1520\nangle 0\n=1600\nangle 20\ndone\n";
        // The second press ends the trim on the way to 1600 us, the third, so late that it is not one of too many, begins it again from the park
        // pose.
        let mut board = Loop::new(&[500, 1_500, 6_000]);
        let (ended, said) = session(&mut board, DEFAULT, lines);
        assert!(said.contains("the outputs are off, cause button"), "{said}");
        // What was on its way is asked for again by the user, who sees that the servo is parked: here, nobody does.
        assert_eq!(ended, Ok(points(&[(1_520, 0.0), (1_500, 20.0)])), "{said}");
        // A fault, its acknowledgement, and a hold that would arm, were the trim not chosen again.
        let mut board = Loop { fault_at: Some(1_100), ..Loop::new(&[500, 1_500, 6_000]) };
        let (ended, said) = session(&mut board, DEFAULT, "=1530\nangle 0\n=1630\nangle 20\ndone\n");
        assert!(said.contains("fault, cause clock") && ended.is_ok(), "{ended:?} {said}");
        assert_eq!(board.joints.state(), SupervisorState::Disarmed);
    }

    #[test]
    fn what_cannot_be_is_said_and_the_board_is_left_at_rest() {
        let mut other = DEFAULT;
        other.servos[0].neutral = PulseMicros(1_400);
        let cases = [
            (DEFAULT, "quit\n", "ended without a map"),
            (DEFAULT, "=1480\n", "the answers end; allowed is `done` or `quit`"),
            (other, "=1480\n", "the board has the record of another robot"),
        ];
        for (robot, lines, words) in cases {
            let mut board = Loop::new(&[500]);
            let error = session(&mut board, robot, lines).0.unwrap_err();
            assert!(error.contains(words), "{error}");
            assert_eq!(board.joints.state(), SupervisorState::Disarmed, "{words}");
        }
        let mut board = Loop::new(&[500]);
        let (_, said) = session(&mut board, DEFAULT, "=400\n+2000\n1500\ndone\nundo\nquit\n");
        for words in [
            "400 us: allowed are 500 to 2500 us",
            "3500 us: allowed are",
            "`1500` is not understood; allowed are",
            "no angle was given; allowed are two or more",
            "there is no angle to forget",
        ] {
            assert!(said.contains(words), "{words}: {said}");
        }
        // A board that walks is not trimmed.
        let mut board = Loop::new(&[500]);
        (0..3_000).for_each(|_| board.tick(None));
        assert_eq!(board.joints.state(), SupervisorState::Walking);
        let error = session(&mut board, DEFAULT, "").0.unwrap_err();
        assert!(error.contains("not at rest"), "{error}");
        assert_eq!(board.joints.state(), SupervisorState::Walking);
    }
}
