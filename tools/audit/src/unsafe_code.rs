//! Unsafe code of each crate of the workspace, counted in the parsed source.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

/// Unsafe blocks, functions and implementations in a source file, those in the arguments of macros included.
///
/// # Errors
///
/// When the text is no Rust.
pub fn in_text(text: &str) -> Result<u64> {
    let file = syn::parse_file(text).context("parsing")?;
    let mut count = Count(0);
    count.visit_file(&file);
    Ok(count.0)
}

struct Count(u64);

impl<'a> Visit<'a> for Count {
    fn visit_expr_unsafe(&mut self, block: &'a syn::ExprUnsafe) {
        self.0 += 1;
        visit::visit_expr_unsafe(self, block);
    }

    fn visit_item_impl(&mut self, item: &'a syn::ItemImpl) {
        self.0 += u64::from(item.unsafety.is_some());
        visit::visit_item_impl(self, item);
    }

    fn visit_signature(&mut self, signature: &'a syn::Signature) {
        self.0 += u64::from(signature.unsafety.is_some());
        visit::visit_signature(self, signature);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        // What a macro makes of its arguments is not parsed; the word in them counts.
        self.0 += words(call.tokens.clone());
    }
}

/// How often the word stands in tokens, not in texts.
fn words(tokens: TokenStream) -> u64 {
    let count = |token| match token {
        TokenTree::Group(group) => words(group.stream()),
        TokenTree::Ident(word) => u64::from(word == "unsafe"),
        TokenTree::Punct(_) | TokenTree::Literal(_) => 0,
    };
    tokens.into_iter().map(count).sum()
}

/// A folder of a crate beside its `src` whose files other crates compile; they count as the crate's.
const COMPILED_BY_OTHERS: &str = "program";

/// The count of each crate of the workspace in this folder, by its name without the folders before it.
///
/// # Errors
///
/// When a file cannot be read or parsed.
pub fn by_crate(root: &Path) -> Result<BTreeMap<String, u64>> {
    let manifest = root.join("Cargo.toml");
    let text = std::fs::read_to_string(&manifest).with_context(|| format!("reading {}", manifest.display()))?;
    let manifest: toml::Table = text.parse().context("reading the workspace's Cargo.toml")?;
    let members = manifest["workspace"]["members"].as_array().context("the workspace lists no members")?;
    let mut counts = BTreeMap::new();
    for member in members.iter().filter_map(toml::Value::as_str) {
        // A crate inside of another one's folder is not in its `src`.
        let count = in_files(&root.join(member).join("src"))? + in_files(&root.join(member).join(COMPILED_BY_OTHERS))?;
        counts.insert(member.rsplit('/').next().unwrap_or(member).to_owned(), count);
    }
    Ok(counts)
}

/// The count of all Rust files in a folder and those below it.
fn in_files(folder: &Path) -> Result<u64> {
    let mut count = 0;
    for file in files(folder)? {
        let text = std::fs::read_to_string(&file).with_context(|| format!("reading {}", file.display()))?;
        count += in_text(&text).with_context(|| format!("in {}", file.display()))?;
    }
    Ok(count)
}

/// The Rust files in a folder and those below it; none where there is no such folder.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    if !folder.is_dir() {
        return Ok(found);
    }
    for entry in std::fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_functions_implementations_and_macros_count() {
        let text = "// unsafe in a comment\nfn a() { let _ = \"unsafe\"; unsafe { unsafe { b() } } }\nunsafe fn b() {}\n\
                    unsafe impl Sync for A {}\nm! { unsafe { c() }, \"unsafe\" }";
        assert_eq!(in_text(text).unwrap(), 5);
        assert_eq!(in_text("fn a() {}").unwrap(), 0);
        assert!(in_text("fn {").is_err());
    }

    /// This crate forbids it, and no core has any.
    #[test]
    fn the_cores_have_none() {
        let counts = by_crate(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
        for core in ["joint-units", "hgod-adc", "cpg-core", "joint-loop", "wire", "audit"] {
            assert_eq!(counts[core], 0, "{core}");
        }
        assert!(counts["firmware"] > 10 && counts["firmware-shared"] > 0, "{counts:?}");
    }
}
