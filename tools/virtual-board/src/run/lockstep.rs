//! The board runs step by step: each request of a program says how far, with the inputs on the way. What happened is its answer.
//!
//! The board never looks at an input after the end of a step. It stops before the block of instructions that would pass the end, or sleeps at it.
//! The peripherals, which may be behind, go on with the next step. So the steps change nothing of what the board does.

use std::io::Write;

use anyhow::{Context as _, Result};
use stm32f4_model::Pin;

use super::conversation::Lockstep;
use super::{BoardRun, ROUNDING_S};
use crate::feed::Contact;
use crate::judge::Joint;
use crate::lockstep::{Given, Line, Refusal, Request, Requests, Step, VERSION};
use crate::plant::EMERGENCY_STOP;
use crate::pulses::PinEdge;
use crate::report::{self, LampChange, MountedJoint, ReportLine, StepEnd};

/// The joints in the order of the servo pins.
const JOINTS: [&str; 4] = ["left_hip", "right_hip", "left_knee", "right_knee"];

/// A time in s. Division rounds once, so that 1000 us are what the text `0.001` is.
fn seconds(us: u64) -> f64 {
    us as f64 / 1e6
}

/// Refuses a contact that something else sets, and pins that have a key of their own.
fn check_contact(given: Given, button: Pin, has_line: impl Fn(Pin) -> bool) -> Result<(), Refusal> {
    let (pin, field) = match given {
        Given::Contact(Contact::Pin(pin), _) => (pin, format!("levels.{pin}")),
        Given::Contact(Contact::Stop, _) => (EMERGENCY_STOP, "stop".into()),
        _ => return Ok(()),
    };
    let own = [(button, "button"), (EMERGENCY_STOP, "stop")].into_iter().find(|(special, _)| *special == pin);
    if let Some((_, key)) = own.filter(|(_, key)| *key != field) {
        return Err(Refusal::new(field, format!("{pin} has a key of its own: `{key}`, true while pressed")));
    }
    if has_line(pin) {
        return Err(Refusal::new(field, format!("{pin} is set by --level or --edges; remove that option, or the key")));
    }
    Ok(())
}

impl<W: Write> BoardRun<'_, W> {
    /// Lets a program step the board.
    pub(crate) fn follow_requests(&mut self, requests: Requests) {
        self.cpu.machine().plant.pulses.record_lamps();
        self.cpu.machine().set_horizon(0.0);
        self.lockstep = Some(Lockstep::new(requests));
    }

    /// Says which protocol this is, and how the servos are mounted.
    pub(super) fn greet(&mut self) {
        if self.lockstep.is_none() {
            return;
        }
        let joints = Joint::of_flash(&self.image.flash).map(|joints| {
            std::array::from_fn(|n| MountedJoint {
                pin: self.image.board.wiring().servos[n].to_string(),
                joint: JOINTS[n],
                neutral_us: joints[n].neutral_us,
                deg_at_neutral: joints[n].angle_at_neutral.to_degrees(),
                us_per_deg: joints[n].us_per_radian.to_radians(),
            })
        });
        self.report.line(&ReportLine::Lockstep { version: VERSION, joints });
    }

    /// At the end of a step: answers, and waits for the next request. Without a conversation it does nothing.
    pub(super) fn exchange(&mut self) -> Result<()> {
        self.answer();
        loop {
            self.report.flush();
            let Some(lockstep) = &mut self.lockstep else { return Ok(()) };
            let line = lockstep.requests.next().context("cannot read the requests on standard input")?;
            let refusal = match line {
                Line::Whole(line) => match Request::parse(&line).and_then(|request| self.carry_out(request)) {
                    Ok(()) => return Ok(()),
                    Err(refusal) => refusal,
                },
                Line::TooLong => Refusal::new("", format!("the line is longer than {} bytes", Line::LONGEST)),
                Line::End => {
                    self.let_go();
                    return Ok(());
                }
                Line::Cut => {
                    lockstep.is_cut = true;
                    let text = "the input ended in the middle of a line, which was not carried out; end each line with a line feed";
                    self.refuse(Refusal::new("", text));
                    self.let_go();
                    return Ok(());
                }
            };
            self.refuse(refusal);
        }
    }

    /// The same before a sleep that would pass the end of the step. Returns whether the core may sleep: no input has changed.
    pub(super) fn exchange_before_sleep(&mut self) -> Result<bool> {
        let mut may_sleep = true;
        while may_sleep && self.cpu.machine().sleeps_past_horizon() {
            self.exchange()?;
            may_sleep = !self.lockstep.as_ref().is_some_and(|lockstep| lockstep.has_changed_input);
        }
        Ok(may_sleep)
    }

    fn refuse(&mut self, Refusal { field, text }: Refusal) {
        self.report.line(&ReportLine::Error { field, text });
    }

    fn answer(&mut self) {
        let Some(lockstep) = self.lockstep.as_mut().filter(|lockstep| lockstep.owes_answer) else { return };
        lockstep.owes_answer = false;
        let t_us = lockstep.until_us;
        let (lamps, state) = {
            let mut board = self.cpu.machine();
            (board.plant.pulses.take_lamps(), board.plant.pulses.state())
        };
        let changed = |edge: PinEdge| LampChange {
            t_s: report::seconds(edge.seconds),
            pin: edge.pin.to_string(),
            on: edge.level,
        };
        // A copy: the servos themselves move when the pulses of a frame have come.
        let servos = self.servos.clone().map(|mut servos| {
            servos.take(&[], &[], seconds(t_us), false);
            servos
        });
        self.report.line(&ReportLine::Step(Box::new(StepEnd {
            t_us,
            armed: state.armed,
            rail: state.rail,
            lamps: lamps.into_iter().map(changed).collect(),
            deg: servos.as_ref().map(|servos| servos.degrees().map(report::degrees)),
            torque: servos.as_ref().map(|servos| servos.torque().map(report::degrees)),
        })));
    }

    fn carry_out(&mut self, request: Request) -> Result<(), Refusal> {
        match request {
            Request::Step(step) => self.begin_step(&step),
            Request::End => {
                self.let_go();
                Ok(())
            }
        }
    }

    /// Takes the inputs of a step. Nothing has changed if it is refused.
    fn begin_step(&mut self, step: &Step) -> Result<(), Refusal> {
        let Some(lockstep) = &mut self.lockstep else { return Ok(()) };
        let button = self.image.board.wiring().button;
        let mut board = self.cpu.machine();
        for given in &step.given {
            check_contact(*given, button, |pin| board.plant.has_line(pin))?;
        }
        let (from_s, to_s) = (seconds(lockstep.until_us), seconds(lockstep.until_us + step.us));
        let passed_s = board.soc.seconds(board.soc.now());
        board.plant.feed().forget_before(passed_s);
        let mut is_other = false;
        for given in &step.given {
            match *given {
                Given::Volts(column, volts) => board.plant.feed().give_volts(column, from_s, to_s, volts),
                Given::Contact(contact, on) => is_other |= board.plant.give_contact(contact, from_s, on),
                Given::ChipSupply(volts) => {
                    is_other |= board.plant.feed().chip_supply.replace(volts) != Some(volts);
                    lockstep.supply = Some((from_s, volts));
                }
            }
        }
        lockstep.has_changed_input = is_other;
        lockstep.until_us += step.us;
        lockstep.owes_answer = true;
        board.set_horizon(to_s);
        drop(board);
        if is_other {
            self.schedule_stop();
            self.cpu.machine().expect_change();
        }
        Ok(())
    }

    /// The conversation has ended: the run does so at the next whole millisecond, with the inputs as they are.
    fn let_go(&mut self) {
        let Some(lockstep) = &self.lockstep else { return };
        self.options.secs = Some(seconds(lockstep.until_us));
        self.cpu.machine().set_horizon(f64::INFINITY);
    }

    /// Applies a supply of the chip that is due.
    pub(super) fn apply_given_supply(&mut self) {
        let now = self.cpu.machine().seconds() + ROUNDING_S;
        let Some(lockstep) = &mut self.lockstep else { return };
        let Some((_, volts)) = lockstep.supply.take_if(|(at, _)| *at <= now) else { return };
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        board.soc.set_supply(volts);
        board.sync(&mut memory);
        drop(board);
        self.schedule_stop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_has_one_key() {
        const BUTTON: Pin = crate::modelled_board::ModelledBoard::F4Discovery.wiring().button;
        let pin = |name: &str| Given::Contact(Contact::Pin(name.parse().unwrap()), true);
        let none = |_| false;
        assert_eq!(check_contact(pin("PC5"), BUTTON, none), Ok(()));
        assert_eq!(check_contact(Given::Contact(Contact::Stop, true), BUTTON, none), Ok(()));
        for (given, has_line, field, words) in [
            (pin("PA0"), false, "levels.PA0", "`button`, true while pressed"),
            (pin("PB12"), false, "levels.PB12", "`stop`, true while pressed"),
            (pin("PC6"), true, "levels.PC6", "set by --level or --edges"),
            (Given::Contact(Contact::Stop, true), true, "stop", "PB12 is set by --level or --edges"),
        ] {
            let refusal = check_contact(given, BUTTON, |_| has_line).unwrap_err();
            assert!(refusal.field == field && refusal.text.contains(words), "{refusal:?}");
        }
    }
}
