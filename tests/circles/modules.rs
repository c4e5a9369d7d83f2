//! Reads the modules of a library or a program: the files that they are in, their items, imports and code.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::TokenStream;
use quote::ToTokens;
use syn::{Attribute, Item, UseTree, Visibility};

/// A module's path: the empty one is the crate's root.
pub(crate) type ModulePath = Vec<String>;

/// A name that a module imports.
#[derive(Debug, Clone)]
pub(crate) struct Import {
    /// `None` for a glob.
    pub(crate) name: Option<String>,
    pub(crate) path: Vec<String>,
    pub(crate) is_public: bool,
}

#[derive(Debug, Default)]
pub(crate) struct Module {
    /// Index of its file.
    pub(crate) file: usize,
    pub(crate) items: BTreeSet<String>,
    pub(crate) imports: Vec<Import>,
    /// Everything but the imports.
    pub(crate) code: TokenStream,
}

/// The modules of one target and the files that they are in.
#[derive(Debug, Default)]
pub(crate) struct Target {
    pub(crate) files: Vec<PathBuf>,
    pub(crate) modules: BTreeMap<ModulePath, Module>,
    /// Exported macros, by the index of their file.
    pub(crate) macros: BTreeMap<String, usize>,
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || attribute.path().is_ident("cfg")
                && attribute.meta.to_token_stream().to_string().replace(' ', "").starts_with("cfg(test")
    })
}

/// `#[path = "..."]`.
fn given_path(attributes: &[Attribute]) -> Option<String> {
    let attribute = attributes.iter().find(|attribute| attribute.path().is_ident("path"))?;
    let syn::Meta::NameValue(pair) = &attribute.meta else { return None };
    let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) = &pair.value else { return None };
    Some(text.value())
}

fn imports(tree: &UseTree, before: &[String], is_public: bool, all: &mut Vec<Import>) {
    let with = |name: String| before.iter().cloned().chain([name]).collect::<Vec<_>>();
    match tree {
        UseTree::Path(path) => imports(&path.tree, &with(path.ident.to_string()), is_public, all),
        UseTree::Group(group) => group.items.iter().for_each(|tree| imports(tree, before, is_public, all)),
        UseTree::Glob(_) => all.push(Import { name: None, path: before.to_vec(), is_public }),
        UseTree::Name(name) if name.ident == "self" => {
            all.push(Import { name: before.last().cloned(), path: before.to_vec(), is_public });
        }
        UseTree::Name(name) => {
            all.push(Import { name: Some(name.ident.to_string()), path: with(name.ident.to_string()), is_public });
        }
        UseTree::Rename(rename) => {
            let path = if rename.ident == "self" { before.to_vec() } else { with(rename.ident.to_string()) };
            all.push(Import { name: Some(rename.rename.to_string()), path, is_public });
        }
    }
}

/// Name and attributes of an item that can be used by its path.
fn named(item: &Item) -> (Option<String>, &[Attribute]) {
    let (ident, attributes) = match item {
        Item::Const(item) => (Some(&item.ident), &item.attrs),
        Item::Enum(item) => (Some(&item.ident), &item.attrs),
        Item::Fn(item) => (Some(&item.sig.ident), &item.attrs),
        Item::Macro(item) => (item.ident.as_ref(), &item.attrs),
        Item::Mod(item) => (Some(&item.ident), &item.attrs),
        Item::Static(item) => (Some(&item.ident), &item.attrs),
        Item::Struct(item) => (Some(&item.ident), &item.attrs),
        Item::Trait(item) => (Some(&item.ident), &item.attrs),
        Item::TraitAlias(item) => (Some(&item.ident), &item.attrs),
        Item::Type(item) => (Some(&item.ident), &item.attrs),
        Item::Union(item) => (Some(&item.ident), &item.attrs),
        Item::Impl(item) => (None, &item.attrs),
        Item::Use(item) => (None, &item.attrs),
        _ => (None, const { &Vec::new() }),
    };
    (ident.map(ToString::to_string), attributes)
}

impl Target {
    pub(crate) fn open(root_file: &Path) -> Self {
        let mut target = Self::default();
        let folder = root_file.parent().expect("a file is in a folder").to_owned();
        target.file(root_file.to_owned(), &folder, vec![]);
        target
    }

    /// Reads a file as a module; files of its children are in `folder`.
    fn file(&mut self, path: PathBuf, folder: &Path, module: ModulePath) {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        self.files.push(path);
        self.module(self.files.len() - 1, folder, module, parsed.items);
    }

    fn module(&mut self, file: usize, folder: &Path, path: ModulePath, items: Vec<Item>) {
        let mut module = Module { file, ..Module::default() };
        let mut children = Vec::new();
        for item in items {
            let (name, attributes) = named(&item);
            if is_for_tests(attributes) {
                continue;
            }
            match item {
                Item::Use(item) => {
                    imports(&item.tree, &[], !matches!(item.vis, Visibility::Inherited), &mut module.imports);
                }
                Item::Mod(item) => children.push(item),
                Item::Macro(item) if item.ident.is_some() => {
                    let name = name.unwrap_or_default();
                    if item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export")) {
                        self.macros.insert(name.clone(), file);
                    }
                    module.items.insert(name);
                    item.to_tokens(&mut module.code);
                }
                item => {
                    module.items.extend(name);
                    item.to_tokens(&mut module.code);
                }
            }
        }
        self.modules.insert(path.clone(), module);
        for child in children {
            let name = child.ident.to_string();
            let inside = path.iter().cloned().chain([name.clone()]).collect();
            if let Some((_, items)) = child.content {
                self.module(file, &folder.join(name), inside, items);
                continue;
            }
            let in_file = folder.join(format!("{name}.rs"));
            if let Some(given) = given_path(&child.attrs) {
                let of_file = self.files[file].parent().expect("a file is in a folder").join(given);
                let beside = of_file.parent().expect("a file is in a folder").to_owned();
                self.file(of_file, &beside, inside);
            } else if in_file.is_file() {
                self.file(in_file, &folder.join(name), inside);
            } else {
                self.file(folder.join(&name).join("mod.rs"), &folder.join(name), inside);
            }
        }
    }
}
