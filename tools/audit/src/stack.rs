//! A bound of the stack: the deepest chain of calls of the thread, and on top of it one interrupt of each priority.
//!
//! The frames are those of the code of the image ([`crate::code`]), the calls those of [`crate::graph`]. A chain of calls that comes back to
//! its beginning has no bound by itself: [`RECURSIONS`] says how often it can.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::{Context, Result, bail};
use firmware::interrupts::ENABLED;
use petgraph::algo::tarjan_scc;

use crate::graph::Calls;
use crate::image::Image;

/// What the core stores when it takes an exception: eight words, 16 floating-point registers, their status and a reserved word, and four
/// bytes to align (ARMv7-M, B1.5.6 and B1.5.7).
pub const EXCEPTION_FRAME: u32 = 26 * 4 + 4;

/// Functions that call each other in a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recursion {
    /// Part of the name of one of the functions in the circle.
    pub through: &'static str,
    /// Parts of the names of those that can be more than once in a chain of calls. Each other one is in it at most once.
    pub again: &'static [&'static str],
    /// How often these are in a chain at most.
    pub times: u32,
    /// Why no more often, and the others once.
    pub why: &'static str,
}

/// Every circle of calls in the image.
pub const RECURSIONS: &[Recursion] = &[Recursion {
    through: "core::fmt::write",
    again: &["core::fmt::write", "core::fmt::Formatter>::write_fmt"],
    times: 8,
    why: "an error that keeps the board off is shown with the error in it: parameters, record, configuration, joint, sensor, calibration, \
          range, number; no type of error holds itself, and what shows a number or a text writes it and is done",
}];

/// The bound, in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// The deepest chain of the thread: `main` and all that it calls, the start of the program too.
    pub thread: u32,
    /// Of it, what the program takes after its start: `main`, the executor, and the deepest task.
    pub running: u32,
    /// Frame of `main`, which never returns.
    pub main: u32,
    /// The deepest chain of the thread: each function with its frame. Functions in a circle are one line.
    pub deepest: Vec<(String, u32)>,
    /// For each priority with an interrupt the deepest handler with the frame of the exception; most urgent first.
    pub interrupts: Vec<(u8, &'static str, u32)>,
    /// The non-maskable interrupt, with the frame of the exception.
    pub non_maskable: u32,
}

impl Bound {
    /// The deepest that the stack can be.
    #[must_use]
    pub fn total(&self) -> u32 {
        self.thread + self.interrupts.iter().map(|(_, _, bytes)| bytes).sum::<u32>() + self.non_maskable
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:>6} B  thread, start of the program included", self.thread)?;
        for (priority, name, bytes) in &self.interrupts {
            writeln!(f, "{bytes:>6} B  priority {priority}: {name}")?;
        }
        writeln!(f, "{:>6} B  non-maskable interrupt", self.non_maskable)?;
        writeln!(f, "{:>6} B  in all", self.total())?;
        writeln!(
            f,
            "{:>6} B  of it the thread after the start, {} B of that in `main` for ever",
            self.running, self.main
        )?;
        writeln!(f, "deepest calls of the thread:")?;
        self.deepest.iter().try_for_each(|(name, bytes)| writeln!(f, "{bytes:>6} B  {name}"))
    }
}

/// Bounds the stack of an image. A hard fault is not in it: its handler starts a new stack.
///
/// # Errors
///
/// When a pointer or a circle of calls is not listed, or a function is missing.
pub fn bound(image: &Image, calls: &Calls) -> Result<Bound> {
    let main = image.only("main")?;
    // Finds the calls through pointers that are not listed.
    calls.reached(image, main)?;
    let depths = Depths::of(image, calls);
    let running = image.named("embassy_executor::platform::thread::Executor>::run");
    let [running] = running.as_slice() else { bail!("the image has no executor of the thread") };
    let entry = image.named("__cortex_m_rt_main");
    let frame = entry.iter().chain([&main]).map(|&index| calls.effects[index].frame).sum();
    let handler = |name: &str| -> Result<u32> {
        let root = image.only(name)?;
        calls.reached(image, root)?;
        Ok(depths.at(image, root)? + EXCEPTION_FRAME)
    };
    let mut levels: BTreeMap<u8, (&'static str, u32)> = BTreeMap::new();
    for interrupt in &ENABLED {
        let bytes = handler(interrupt.name)?;
        let deepest = levels.entry(interrupt.priority).or_insert((interrupt.name, bytes));
        if bytes > deepest.1 {
            *deepest = (interrupt.name, bytes);
        }
    }
    Ok(Bound {
        thread: depths.at(image, main)?,
        running: frame + depths.at(image, *running)?,
        main: frame,
        deepest: depths.chain(main),
        interrupts: levels.into_iter().map(|(priority, (name, bytes))| (priority, name, bytes)).collect(),
        non_maskable: handler("NonMaskableInt")?,
    })
}

/// Bytes of those functions of a circle that are in a chain more than once, for the second time and on; `None` if the circle is not listed.
fn passed(image: &Image, calls: &Calls, members: &[usize]) -> Option<u32> {
    let through = |recursion: &&Recursion| members.iter().any(|&at| image.functions[at].is(recursion.through));
    let listed = RECURSIONS.iter().find(through)?;
    let again = |&&at: &&usize| listed.again.iter().any(|part| image.functions[at].is(part));
    let frames: u32 = members.iter().filter(again).map(|&at| calls.effects[at].frame).sum();
    Some(frames * (listed.times - 1))
}

/// The deepest chain of calls from each function, or the circle that is not listed.
struct Depths {
    depths: Vec<Result<u32, String>>,
    /// For each function the name and the frame of its circle, or of itself.
    own: Vec<(String, u32)>,
    /// For each function the callee with the deepest chain, outside of its circle.
    next: Vec<Option<usize>>,
}

impl Depths {
    fn of(image: &Image, calls: &Calls) -> Self {
        let count = image.functions.len();
        let mut depths: Vec<Result<u32, String>> = vec![Ok(0); count];
        let (mut owns, mut nexts) = (vec![(String::new(), 0); count], vec![None; count]);
        // Callees come before their callers.
        for circle in tarjan_scc(&calls.graph()) {
            let members: Vec<usize> = circle.iter().map(|node| node.index()).collect();
            let names: Vec<&str> = members.iter().map(|&at| image.functions[at].name()).collect();
            let frames: u32 = members.iter().map(|&at| calls.effects[at].frame).sum();
            let is_circle = members.len() > 1 || calls.callees[members[0]].contains(&members[0]);
            let own = if is_circle { passed(image, calls, &members).map(|more| frames + more) } else { Some(frames) };
            let outside = members.iter().flat_map(|&at| &calls.callees[at]).filter(|callee| !members.contains(callee));
            // What is not known is deeper than everything else.
            let next = outside.copied().max_by_key(|&callee| depths[callee].as_ref().map_or(u32::MAX, |depth| *depth));
            let below = next.map_or(Ok(0), |callee| depths[callee].clone());
            let depth = below.and_then(|below| Ok(below + own.ok_or_else(|| names.join(", "))?));
            for &at in &members {
                depths[at].clone_from(&depth);
                let more = if is_circle { format!(", in a circle of {}", members.len()) } else { String::new() };
                owns[at] = (format!("{}{more}", image.functions[at].name()), own.unwrap_or(frames));
                nexts[at] = next;
            }
        }
        Self { depths, own: owns, next: nexts }
    }

    fn chain(&self, from: usize) -> Vec<(String, u32)> {
        std::iter::successors(Some(from), |&at| self.next[at]).map(|at| self.own[at].clone()).collect()
    }

    fn at(&self, image: &Image, function: usize) -> Result<u32> {
        let depth = self.depths[function].clone().map_err(|circle| {
            anyhow::anyhow!("these call each other in a circle: {circle}; list in tools/audit/src/stack.rs how often")
        });
        depth.with_context(|| format!("in the calls of {}", image.functions[function].name()))
    }
}
