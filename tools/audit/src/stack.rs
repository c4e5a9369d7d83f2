//! A bound of the stack: the deepest chain of calls of the thread, and on top of it one interrupt of each priority.
//!
//! The frames are those of the code of the image ([`crate::code`]), the calls those of [`crate::graph`]. A chain of calls that comes back to
//! its beginning has no bound by itself: [`RECURSIONS`] says how often it can.

use std::collections::BTreeMap;

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
    /// How often the circle is passed at most.
    pub times: u32,
    /// Why no more often.
    pub why: &'static str,
}

/// Every circle of calls in the image.
pub const RECURSIONS: &[Recursion] = &[];

/// The bound, in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// The deepest chain of the thread: `main` and all that it calls, the start of the program too.
    pub thread: u32,
    /// Of it, what the program takes after its start: `main`, the executor, and the deepest task.
    pub running: u32,
    /// Frame of `main`, which never returns.
    pub main: u32,
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
    let frame = entry.iter().chain([&main]).map(|&index| calls.bodies[index].frame).sum();
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
        interrupts: levels.into_iter().map(|(priority, (name, bytes))| (priority, name, bytes)).collect(),
        non_maskable: handler("NonMaskableInt")?,
    })
}

/// The deepest chain of calls from each function; `None` where a circle is not listed.
struct Depths(Vec<Result<u32, String>>);

impl Depths {
    fn of(image: &Image, calls: &Calls) -> Self {
        let mut depths: Vec<Result<u32, String>> = vec![Ok(0); image.functions.len()];
        // Callees come before their callers.
        for circle in tarjan_scc(&calls.graph()) {
            let members: Vec<usize> = circle.iter().map(|node| node.index()).collect();
            let own: u32 = members.iter().map(|&at| calls.bodies[at].frame).sum();
            let outside = members.iter().flat_map(|&at| &calls.callees[at]).filter(|callee| !members.contains(callee));
            let below = outside.map(|&callee| depths[callee].clone()).try_fold(0, |most, depth| Ok(depth?.max(most)));
            let is_circle = members.len() > 1 || calls.callees[members[0]].contains(&members[0]);
            let depth = match (below, is_circle) {
                (Ok(below), false) => Ok(below + own),
                (Ok(below), true) => {
                    let listed = RECURSIONS
                        .iter()
                        .find(|recursion| members.iter().any(|&at| image.functions[at].is(recursion.through)));
                    let names: Vec<&str> = members.iter().map(|&at| image.functions[at].name()).collect();
                    listed.map(|recursion| below + own * recursion.times).ok_or_else(|| names.join(", "))
                }
                (unknown, _) => unknown,
            };
            for at in members {
                depths[at].clone_from(&depth);
            }
        }
        Self(depths)
    }

    fn at(&self, image: &Image, function: usize) -> Result<u32> {
        let depth = self.0[function].clone().map_err(|circle| {
            anyhow::anyhow!("these call each other in a circle: {circle}; list in tools/audit/src/stack.rs how often")
        });
        depth.with_context(|| format!("in the calls of {}", image.functions[function].name()))
    }
}
