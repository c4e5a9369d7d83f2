//! Signals that a program outside gives piece by piece while the board runs: voltages, supplies, levels of inputs.
//!
//! The peripherals may be behind the processor, so what has been given is kept until they have passed it.

use std::collections::BTreeMap;

use stm32f4_model::Pin;

use crate::tables::{LevelTable, VoltageColumn};

/// A contact, which is off until it is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Contact {
    /// The user button: on while pressed.
    Button,
    /// The emergency stop: on while pressed.
    Stop,
    /// Another input: on while high.
    Pin(Pin),
}

/// A voltage over a piece of time: linear from the first to the last value, which is held.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    from_s: f64,
    to_s: f64,
    volts: [f64; 2],
}

impl Piece {
    fn at(&self, seconds: f64) -> f64 {
        let [first, last] = self.volts;
        if seconds >= self.to_s {
            return last;
        }
        // As a table of voltages has it, to the bit.
        first + (last - first) * (seconds - self.from_s) / (self.to_s - self.from_s)
    }
}

/// Signals up to the end of the last piece.
#[derive(Debug, Clone, Default)]
pub(crate) struct Feed {
    volts: BTreeMap<VoltageColumn, Vec<Piece>>,
    contacts: BTreeMap<Contact, LevelTable>,
    /// Supply of the chip, V; `None`: not given.
    pub(crate) chip_supply: Option<f64>,
}

impl Feed {
    /// Gives a voltage from a time on, s: it goes to the second value by the other time, and stays there.
    pub(crate) fn give_volts(&mut self, column: VoltageColumn, from_s: f64, to_s: f64, volts: [f64; 2]) {
        self.volts.entry(column).or_default().push(Piece { from_s, to_s, volts });
    }

    /// Gives the state of a contact from a time on, s. Returns whether it is another one than before.
    pub(crate) fn give_contact(&mut self, contact: Contact, from_s: f64, on: bool) -> bool {
        let table = self.contacts.entry(contact).or_default();
        let is_other = table.at(from_s) != on;
        if is_other {
            table.push(from_s, on);
        }
        is_other
    }

    /// Drops what ends before a time, s, that the peripherals have passed.
    pub(crate) fn forget_before(&mut self, seconds: f64) {
        for pieces in self.volts.values_mut() {
            let passed = pieces.iter().skip(1).take_while(|next| next.from_s <= seconds).count();
            pieces.drain(..passed);
        }
        self.contacts.values_mut().for_each(|table| table.forget_before(seconds));
    }

    /// A voltage at a time, s; `None`: it was not given.
    pub(crate) fn volts(&self, column: VoltageColumn, seconds: f64) -> Option<f64> {
        let pieces = self.volts.get(&column)?;
        pieces.iter().rev().find(|piece| piece.from_s <= seconds).map(|piece| piece.at(seconds))
    }

    /// Whether a contact is on at a time, s.
    pub(crate) fn is_on(&self, contact: Contact, seconds: f64) -> bool {
        self.contacts.get(&contact).is_some_and(|table| table.at(seconds))
    }

    /// The next change of each contact after a time, s.
    pub(crate) fn edges_after(&self, seconds: f64) -> impl Iterator<Item = f64> {
        self.contacts.values().filter_map(move |table| table.next_edge(seconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::VoltageTable;

    fn pin(name: &str) -> VoltageColumn {
        VoltageColumn::Pin(name.parse().unwrap())
    }

    #[test]
    fn pieces_between_the_rows_of_a_table_are_the_table_to_the_bit() {
        let value = |n: u32| (f64::from(n) * 0.7).sin() * 1.1 + 1.3;
        let rows: String = (0..50).map(|n| format!("{},{}\n", f64::from(n * 1_300) / 1e6, value(n))).collect();
        let table = VoltageTable::parse(format!("time_s,PA1\n{rows}").as_bytes(), false).unwrap();
        let mut feed = Feed::default();
        for n in 0..49 {
            let [from, to] = [n, n + 1].map(|row| f64::from(row * 1_300) / 1e6);
            feed.give_volts(pin("PA1"), from, to, [value(n), value(n + 1)]);
        }
        for n in 0..64_000 {
            let seconds = f64::from(n) * 1e-6 + 1.7e-9;
            assert_eq!(feed.volts(pin("PA1"), seconds), Some(table.at("PA1".parse().unwrap(), seconds)), "{seconds}");
            feed.forget_before(seconds - 3e-3);
        }
        assert!(feed.volts[&pin("PA1")].len() < 6, "what has passed is dropped");
        assert_eq!(feed.volts(pin("PC1"), 1.0), None);
    }

    #[test]
    fn a_voltage_is_held_after_its_piece() {
        let mut feed = Feed::default();
        feed.give_volts(pin("PA1"), 0.0, 0.001, [1.0, 2.0]);
        feed.give_volts(pin("PA1"), 0.005, 0.006, [0.5, 0.5]);
        let at = |seconds| feed.volts(pin("PA1"), seconds).unwrap();
        assert_eq!([0.0, 0.0005, 0.001, 0.004, 0.005, 9.0].map(at), [1.0, 1.5, 2.0, 2.0, 0.5, 0.5]);
    }

    #[test]
    fn a_contact_holds_until_the_next_change() {
        let foot = Contact::Pin("PC5".parse().unwrap());
        let mut feed = Feed::default();
        assert!(!feed.give_contact(foot, 0.0, false) && feed.give_contact(foot, 0.001, true), "off before the first");
        assert!(!feed.give_contact(foot, 0.002, true) && feed.give_contact(foot, 0.003, false));
        assert_eq!([0.0, 0.001, 0.0025, 0.003].map(|at| feed.is_on(foot, at)), [false, true, true, false]);
        assert_eq!(feed.edges_after(0.001).collect::<Vec<_>>(), [0.003]);
        feed.forget_before(0.002);
        assert_eq!([0.002, 0.003].map(|at| feed.is_on(foot, at)), [true, false]);
        assert!(!feed.is_on(Contact::Stop, 1.0));
    }
}
