//! Counts the instructions of calls in the log that QEMU writes with `-d exec,nochain` where each of its translated blocks is one instruction.
//!
//! | line | meaning |
//! |---|---|
//! | `Trace 0: HOST [BASE/ADDRESS/FLAGS/FLAGS] NAME` | the instruction at this address begins |
//! | `Stopped execution of TB chain before HOST [ADDRESS] NAME` | it did not run after all, and comes again |
//! | another one | a message of QEMU |
//!
//! A call begins where the first instruction of the function follows a call instruction, and ends where the instruction after that one follows. An
//! instruction in an IT block is a block of its own, also where its condition does not hold.

use std::collections::HashMap;

use anyhow::{Context, Result, bail, ensure};

use crate::image;

/// A function that was called and has not returned.
struct Open {
    function: usize,
    return_to: u32,
    /// Instructions of the program before it.
    before: u64,
}

/// Counts the calls of some functions.
pub(super) struct Counter {
    elf: Vec<u8>,
    names: Vec<String>,
    functions: HashMap<u32, usize>,
    /// The instruction of the last line, which the next line may take back.
    begun: Option<u32>,
    /// The instruction before it.
    before: Option<u32>,
    instructions: u64,
    open: Vec<Open>,
    calls: Vec<Vec<u64>>,
}

impl Counter {
    /// Looks the functions up.
    pub(super) fn new(elf: Vec<u8>, names: &[String]) -> Result<Self> {
        let all = image::functions(&elf)?;
        let mut functions = HashMap::new();
        for (place, name) in names.iter().enumerate() {
            let found = all.iter().find(|(symbol, _)| symbol == name);
            let (_, address) = found.with_context(|| format!("the program has no function `{name}`"))?;
            let other = functions.insert(*address, place);
            ensure!(other.is_none(), "`{name}` has the code of another function, so its calls are not its own");
        }
        let calls = names.iter().map(|_| Vec::new()).collect();
        let names = names.to_vec();
        Ok(Self { elf, names, functions, begun: None, before: None, instructions: 0, open: Vec::new(), calls })
    }

    /// Takes a line with its end; false if it is none of the log, but a message.
    pub(super) fn line(&mut self, line: &[u8]) -> Result<bool> {
        let text = || String::from_utf8_lossy(line).trim_end().to_owned();
        ensure!(line.ends_with(b"\n"), "QEMU's log is cut short: `{}`", text());
        if line.starts_with(b"Trace ") {
            let address = field(line, 1).with_context(|| format!("not a line of QEMU's log: `{}`", text()))?;
            self.complete()?;
            self.begun = Some(address);
        } else if line.starts_with(b"Stopped execution of TB chain before ") {
            let address = field(line, 0).with_context(|| format!("not a line of QEMU's log: `{}`", text()))?;
            ensure!(self.begun == Some(address), "QEMU takes an instruction back that has not begun: `{}`", text());
            self.begun = None;
        } else {
            return Ok(false);
        }
        Ok(true)
    }

    /// Instructions of each call, by function; and those of the whole program.
    pub(super) fn finish(mut self) -> Result<(Vec<Vec<u64>>, u64)> {
        self.complete()?;
        if let Some(open) = self.open.last() {
            let name = &self.names[open.function];
            bail!("call {} of `{name}` does not return on QEMU", self.calls[open.function].len() + 1);
        }
        Ok((self.calls, self.instructions))
    }

    /// Counts the instruction of the last line, which has run.
    fn complete(&mut self) -> Result<()> {
        let Some(address) = self.begun.take() else { return Ok(()) };
        if let Some(open) = self.open.pop_if(|open| open.return_to == address) {
            self.calls[open.function].push(self.instructions - open.before);
        }
        if let Some(&function) = self.functions.get(&address)
            && let Some(return_to) = self.before.map(|before| after_call(&self.elf, before)).transpose()?.flatten()
        {
            self.open.push(Open { function, return_to, before: self.instructions });
        }
        self.instructions += 1;
        self.before = Some(address);
        Ok(())
    }
}

/// A hexadecimal number between the brackets of a line.
fn field(line: &[u8], number: usize) -> Option<u32> {
    let open = line.iter().position(|&byte| byte == b'[')?;
    let length = line[open..].iter().position(|&byte| byte == b']')?;
    let inside = std::str::from_utf8(&line[open + 1..open + length]).ok()?;
    u32::from_str_radix(inside.split('/').nth(number)?, 16).ok()
}

/// The address after the call instruction at an address; `None` if there is another instruction (ARMv7-M ARM, A7.7.18: BL, and A7.7.19: BLX).
fn after_call(elf: &[u8], address: u32) -> Result<Option<u32>> {
    let half = |address: u32| -> Result<u16> {
        let place = image::place(elf, address, 2)?;
        let place = place.with_context(|| format!("QEMU runs {address:#010x}, where the program has no code"))?;
        Ok(u16::from_le_bytes([elf[place.start], elf[place.start + 1]]))
    };
    let first = half(address)?;
    if first & 0xFF87 == 0x4780 {
        return Ok(Some(address + 2));
    }
    let is_branch_with_link = first & 0xF800 == 0xF000 && half(address + 2)? & 0xD000 == 0xD000;
    Ok(is_branch_with_link.then_some(address + 4))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::tests::with_functions;

    /// `main` at 0 calls `outer` at 0x10 by BL and again by BLX, which calls `inner` at 0x20.
    fn program() -> Vec<u8> {
        let mut code = [0_u8; 0x30];
        // main: bl outer; blx r0; nop
        code[0..8].copy_from_slice(&[0x00, 0xF0, 0x06, 0xF8, 0x80, 0x47, 0x00, 0xBF]);
        // outer: push {lr}; bl inner; pop {pc}
        code[0x10..0x18].copy_from_slice(&[0x00, 0xB5, 0x00, 0xF0, 0x05, 0xF8, 0x00, 0xBD]);
        // inner: nop; bx lr
        code[0x20..0x24].copy_from_slice(&[0x00, 0xBF, 0x70, 0x47]);
        with_functions(0x0800_0000, &code, &[("main", 1), ("outer", 0x11), ("inner", 0x21)])
    }

    fn trace(offset: u32) -> String {
        format!("Trace 0: 0x7f24a4063a00 [00800400/{:08x}/00000010/ff000201] a_name\n", 0x0800_0000 + offset)
    }

    fn stopped(offset: u32) -> String {
        format!("Stopped execution of TB chain before 0x7f24a4063a00 [{:08x}] a_name\n", 0x0800_0000 + offset)
    }

    const OUTER: [u32; 5] = [0x10, 0x12, 0x20, 0x22, 0x16];

    fn count(lines: &[String]) -> Result<(Vec<Vec<u64>>, u64)> {
        let (elf, names) = (program(), ["outer".to_owned(), "inner".to_owned()]);
        let mut counter = Counter::new(elf, &names)?;
        for line in lines {
            counter.line(line.as_bytes())?;
        }
        counter.finish()
    }

    /// The whole run.
    fn run() -> Vec<String> {
        [&[0][..], &OUTER, &[4], &OUTER, &[6]].concat().into_iter().map(trace).collect()
    }

    #[test]
    fn a_call_counts_with_the_calls_in_it() {
        assert_eq!(count(&run()).unwrap(), (vec![vec![5, 5], vec![2, 2]], 13));
    }

    #[test]
    fn a_jump_to_a_function_is_no_call() {
        let lines = [0x20, 0x22, 0x10, 0x12].map(trace);
        assert_eq!(count(&lines).unwrap(), (vec![vec![], vec![]], 4));
    }

    #[test]
    fn an_instruction_that_is_taken_back_counts_once() {
        for place in 1..run().len() {
            let mut lines = run();
            let again = lines[place - 1].clone();
            let address = u32::from_str_radix(&again[34..42], 16).unwrap() - 0x0800_0000;
            lines.splice(place..place, [stopped(address), again]);
            assert_eq!(count(&lines).unwrap(), count(&run()).unwrap(), "{place}");
        }
        let error = count(&[trace(0), stopped(2)]).unwrap_err().to_string();
        assert!(error.contains("has not begun"), "{error}");
    }

    #[test]
    fn a_lost_line_changes_a_count_or_fails() {
        let calls = |lines: &[String]| count(lines).map(|(calls, _)| calls).ok();
        for place in 2..run().len() - 1 {
            let mut lines = run();
            lines.remove(place);
            assert!(calls(&lines) != calls(&run()), "{place}");
        }
    }

    #[test]
    fn a_call_without_its_return_is_named() {
        let lines = &run()[..9];
        assert_eq!(count(lines).unwrap_err().to_string(), "call 2 of `outer` does not return on QEMU");
        let lines = &run()[..4];
        assert_eq!(count(lines).unwrap_err().to_string(), "call 1 of `inner` does not return on QEMU");
    }

    #[test]
    fn a_line_that_is_cut_short_is_refused_and_a_message_is_none() {
        let (elf, names) = (program(), []);
        let whole = trace(0);
        for length in 1..whole.len() {
            let mut counter = Counter::new(elf.clone(), &names).unwrap();
            assert!(counter.line(&whole.as_bytes()[..length]).is_err(), "{length}");
        }
        let mut counter = Counter::new(elf.clone(), &names).unwrap();
        assert!(counter.line(b"Trace 0: 0x7f24 [00800400/0800\n").is_err());
        assert!(!counter.line(b"qemu-system-arm: a warning\n").unwrap());
        assert!(Counter::new(elf, &["other".to_owned()]).is_err());
    }
}
