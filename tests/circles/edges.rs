//! Which files of a target use each other, and the circles among them. The rules are those of `main.rs`.

use std::collections::BTreeSet;

use footfall_tests::workspace::root;
use proc_macro2::{TokenStream, TokenTree};

use crate::modules::{ModulePath, Target};

/// Files that use each other, directly or not: each set once, by name.
pub(crate) fn circles(target: &Target) -> Vec<Vec<String>> {
    let edges = target.edges();
    let reach: Vec<BTreeSet<usize>> = (0..edges.len())
        .map(|from| {
            let (mut seen, mut next) = (BTreeSet::new(), edges[from].iter().copied().collect::<Vec<_>>());
            while let Some(file) = next.pop() {
                if seen.insert(file) {
                    next.extend(&edges[file]);
                }
            }
            seen
        })
        .collect();
    let mut circles: Vec<Vec<usize>> = (0..edges.len())
        .filter(|&file| reach[file].contains(&file))
        .map(|file| reach[file].iter().copied().filter(|&other| reach[other].contains(&file)).collect())
        .collect();
    circles.sort();
    circles.dedup();
    let name =
        |file: usize| target.files[file].strip_prefix(root()).unwrap_or(&target.files[file]).display().to_string();
    let with_edges = |circle: &Vec<usize>, file: usize| {
        let inside: Vec<String> =
            edges[file].iter().copied().filter(|other| circle.contains(other)).map(name).collect();
        format!("{} -> {}", name(file), inside.join(", "))
    };
    circles.iter().map(|circle| circle.iter().map(|&file| with_edges(circle, file)).collect()).collect()
}

impl Target {
    /// The file that defines what `path` names in `module`; `None` if it is of another crate.
    fn definition(&self, module: &[String], path: &[String], depth: usize) -> Option<usize> {
        let first = path.first()?;
        let (start, rest) = match first.as_str() {
            "crate" => (vec![], &path[1..]),
            "self" => (module.to_vec(), &path[1..]),
            "super" => (module.split_last()?.1.to_vec(), &path[1..]),
            _ => (module.to_vec(), path),
        };
        if rest.first().is_some_and(|next| next == "super") {
            return self.definition(&start, rest, depth);
        }
        // A name with no prefix may be another crate's; one with a prefix is this crate's.
        self.within(&start, rest, rest.len() < path.len(), depth)
    }

    fn within(&self, start: &[String], path: &[String], is_ours: bool, depth: usize) -> Option<usize> {
        let module = self.modules.get(start)?;
        let Some((first, rest)) = path.split_first() else { return Some(module.file) };
        let child: ModulePath = start.iter().cloned().chain([first.clone()]).collect();
        if self.modules.contains_key(&child) {
            return self.within(&child, rest, true, depth);
        }
        if module.items.contains(first) {
            return Some(module.file);
        }
        if start.is_empty() && self.macros.contains_key(first) {
            return self.macros.get(first).copied();
        }
        if depth > 0 {
            if let Some(import) = module.imports.iter().find(|import| import.name.as_ref() == Some(first)) {
                let whole: Vec<String> = import.path.iter().chain(rest).cloned().collect();
                return self.definition(start, &whole, depth - 1);
            }
            for glob in module.imports.iter().filter(|import| import.name.is_none()) {
                let whole: Vec<String> = glob.path.iter().chain(path).cloned().collect();
                if let Some(file) = self.definition(start, &whole, depth - 1) {
                    return Some(file);
                }
            }
        }
        is_ours.then_some(module.file)
    }

    /// For each file the files that it uses.
    fn edges(&self) -> Vec<BTreeSet<usize>> {
        let mut edges = vec![BTreeSet::new(); self.files.len()];
        for (path, module) in &self.modules {
            let mut uses: BTreeSet<Vec<String>> = BTreeSet::new();
            let private = module.imports.iter().filter(|import| !import.is_public);
            uses.extend(private.map(|import| import.path.clone()));
            let mut in_code = BTreeSet::new();
            paths(module.code.clone(), &mut in_code);
            for used in in_code {
                let is_prefixed = ["crate", "super", "self"].contains(&used[0].as_str()) && used.len() > 1;
                let is_child = self.modules.contains_key(&[path.as_slice(), &used[..1]].concat()) && used.len() > 1;
                let is_imported = module.imports.iter().any(|import| import.name.as_ref() == Some(&used[0]));
                if is_prefixed || is_child || is_imported {
                    uses.insert(used);
                }
            }
            let used = uses.iter().filter_map(|used| self.definition(path, used, 16));
            edges[module.file].extend(used.filter(|&file| file != module.file));
        }
        edges
    }
}

/// Every path `a::b::c` in code, each name alone too; what follows a dot is a field or a method.
fn paths(tokens: TokenStream, all: &mut BTreeSet<Vec<String>>) {
    let (mut path, mut colons, mut after_dot) = (Vec::<String>::new(), 0, false);
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => {
                if colons != 2 && !path.is_empty() {
                    all.insert(std::mem::take(&mut path));
                }
                if !after_dot {
                    path.push(ident.to_string());
                }
                (colons, after_dot) = (0, false);
            }
            TokenTree::Punct(punct) => {
                colons = if punct.as_char() == ':' { colons + 1 } else { 0 };
                after_dot = punct.as_char() == '.';
                if colons == 0 && !path.is_empty() {
                    all.insert(std::mem::take(&mut path));
                }
            }
            TokenTree::Group(group) => {
                if !path.is_empty() {
                    all.insert(std::mem::take(&mut path));
                }
                (colons, after_dot) = (0, false);
                paths(group.stream(), all);
            }
            TokenTree::Literal(_) => (colons, after_dot) = (0, false),
        }
    }
    if !path.is_empty() {
        all.insert(path);
    }
}
