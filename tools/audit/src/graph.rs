//! The calls of an image: which function can reach which, and on what way.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use anyhow::{Context, Result, bail};
use petgraph::graph::{DiGraph, NodeIndex};

use crate::code::{Disassembler, Effects};
use crate::image::Image;
use crate::indirect::POINTERS;

/// Every function of an image, and its calls. A function is named by its place in [`Image::functions`].
#[derive(Debug)]
pub struct Calls {
    /// What each function does.
    pub effects: Vec<Effects>,
    /// The functions that each one calls, branches to, or reaches through a pointer.
    pub callees: Vec<Vec<usize>>,
    /// Functions with a call through a pointer that [`POINTERS`] does not list.
    unknown: Vec<usize>,
}

impl Calls {
    /// Reads all code of the image.
    ///
    /// # Errors
    ///
    /// As [`Disassembler::effects`]; and when a function branches to something that is none.
    pub fn of(image: &Image) -> Result<Self> {
        let disassembler = Disassembler::new()?;
        let (mut effects, mut callees, mut unknown) = (Vec::new(), Vec::new(), Vec::new());
        for (index, function) in image.functions.iter().enumerate() {
            let own = disassembler.effects(function)?;
            let mut called = Vec::new();
            for &target in &own.targets {
                called.push(image.function_at(target).with_context(|| {
                    format!("{} branches to {target:#010x}, which is in no function", function.name())
                })?);
            }
            if !own.indirect.is_empty() {
                let listed: Vec<_> = POINTERS.iter().filter(|pointer| function.is(pointer.within)).collect();
                if listed.is_empty() {
                    unknown.push(index);
                }
                for part in listed.iter().flat_map(|pointer| pointer.to) {
                    called.extend(image.named(part));
                }
            }
            called.sort_unstable();
            called.dedup();
            effects.push(own);
            callees.push(called);
        }
        Ok(Self { effects, callees, unknown })
    }

    /// Every function that can be reached from the root, with the one that calls it first; the root itself has none.
    ///
    /// # Errors
    ///
    /// When one of them calls through a pointer that is not listed in [`POINTERS`].
    pub fn reached(&self, image: &Image, root: usize) -> Result<BTreeMap<usize, Option<usize>>> {
        let mut callers = BTreeMap::from([(root, None)]);
        let mut open = std::collections::VecDeque::from([root]);
        while let Some(caller) = open.pop_front() {
            if self.unknown.contains(&caller) {
                let at: Vec<String> = self.effects[caller].indirect.iter().map(|at| format!("{at:#010x}")).collect();
                bail!(
                    "{} calls through a pointer (at {}); list in tools/audit/src/indirect.rs where that can lead\n{}",
                    image.functions[caller].name(),
                    at.join(", "),
                    way(image, &callers, caller)
                );
            }
            for &callee in &self.callees[caller] {
                callers.entry(callee).or_insert_with(|| {
                    open.push_back(callee);
                    Some(caller)
                });
            }
        }
        Ok(callers)
    }

    /// The calls for algorithms on graphs; the nodes are in the order of the functions.
    #[must_use]
    pub fn graph(&self) -> DiGraph<(), ()> {
        let mut graph = DiGraph::new();
        for _ in &self.callees {
            graph.add_node(());
        }
        for (caller, callees) in self.callees.iter().enumerate() {
            for &callee in callees {
                graph.add_edge(NodeIndex::new(caller), NodeIndex::new(callee), ());
            }
        }
        graph
    }
}

/// The calls that lead from the root to a function, one a line.
#[must_use]
pub fn way(image: &Image, callers: &BTreeMap<usize, Option<usize>>, to: usize) -> String {
    let mut names = Vec::new();
    let mut at = Some(to);
    while let Some(index) = at {
        names.push(image.functions[index].name());
        at = callers.get(&index).copied().flatten();
    }
    let mut text = String::new();
    for (depth, name) in names.iter().rev().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:indent$}{name}", "", indent = 2 + depth);
    }
    text
}
