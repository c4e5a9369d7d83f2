//! Names that nothing has: no identifier, no key of a file, no file and no folder.

use std::collections::BTreeSet;

use footfall_tests::name_parts::{joined, parts};
use footfall_tests::workspace::{assert_none, files, files_ending, read};
use proc_macro2::{TokenStream, TokenTree};

/// Words that are no part of a name of a program, and their plurals: a generator is no person, an image no part of one.
const NAME_PARTS: [(&str, &str); 7] =
    [("wal", "ker"), ("rhy", "thm"), ("do", "or"), ("ro", "om"), ("hou", "se"), ("wo", "rn"), ("ship", "ped")];

/// Names that have such a part for a reason: where the file's path begins, the name, why.
const ALLOWED_NAMES: [(&str, &str, &str); 0] = [];

#[test]
fn names_are_split_into_their_parts() {
    for (name, want) in [
        ("stride_clock", vec!["stride", "clock"]),
        ("PhaseLock", vec!["phase", "lock"]),
        ("HTTPServer", vec!["http", "server"]),
        ("everybody", vec!["everybody"]),
        ("A_LONG_NAME2", vec!["a", "long", "name"]),
        ("link-proof", vec!["link", "proof"]),
    ] {
        assert_eq!(parts(name), want, "{name}");
    }
}

/// The part of a name that nothing has, with or without the plural's s.
fn bad_part(name: &str, bad: &[String]) -> Option<String> {
    let singular = |part: &String| match part.strip_suffix("ies") {
        Some(stem) => format!("{stem}y"),
        None => part.strip_suffix('s').unwrap_or(part).to_owned(),
    };
    parts(name).into_iter().find(|part| bad.contains(part) || bad.contains(&singular(part)))
}

fn is_allowed(file: &str, name: &str) -> bool {
    ALLOWED_NAMES.iter().any(|(place, allowed, _)| file.starts_with(place) && name == *allowed)
}

/// Calls `each` with every identifier and its line. Comments and literals are none; lifetimes are.
fn identifiers(tokens: TokenStream, each: &mut impl FnMut(String, usize)) {
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => each(ident.to_string(), ident.span().start().line),
            TokenTree::Group(group) => identifiers(group.stream(), each),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

fn keys(value: &toml::Value, each: &mut impl FnMut(&str)) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                each(key);
                keys(value, each);
            }
        }
        toml::Value::Array(values) => values.iter().for_each(|value| keys(value, each)),
        _ => {}
    }
}

#[test]
fn no_identifier_has_one_of_some_parts() {
    let bad = joined(&NAME_PARTS);
    let mut found = BTreeSet::new();
    for file in files_ending(&[".rs"]) {
        let tokens: TokenStream = read(file).parse().unwrap_or_else(|error| panic!("{file}: {error}"));
        identifiers(tokens, &mut |name, line| {
            if bad_part(&name, &bad).is_some() && !is_allowed(file, &name) {
                found.insert(format!("{file}:{line}: `{name}`"));
            }
        });
    }
    let found: Vec<String> = found.into_iter().collect();
    assert_none(&found, "identifiers with a part that no name has (see `NAME_PARTS`)");
}

#[test]
fn no_key_of_a_file_has_one_of_these_parts() {
    let bad = joined(&NAME_PARTS);
    let mut found = Vec::new();
    for file in files_ending(&[".toml"]) {
        let table: toml::Table = read(file).parse().unwrap_or_else(|error| panic!("{file}: {error}"));
        keys(&toml::Value::Table(table), &mut |key| {
            if bad_part(key, &bad).is_some() && !is_allowed(file, key) {
                found.push(format!("{file}: `{key}`"));
            }
        });
    }
    assert_none(&found, "keys with a part that no name has (see `NAME_PARTS`)");
}

#[test]
fn no_file_or_folder_has_one_of_these_parts() {
    let bad = joined(&NAME_PARTS);
    let is_bad = |name: &&str| bad_part(name, &bad).is_some() && !is_allowed(name, name);
    let found: Vec<String> = files().filter(is_bad).map(str::to_owned).collect();
    assert_none(&found, "files with a part that no name has (see `NAME_PARTS`)");
}

#[test]
fn no_allowed_name_is_left_over() {
    let bad = joined(&NAME_PARTS);
    for (place, name, reason) in ALLOWED_NAMES {
        assert!(!reason.is_empty() && bad_part(name, &bad).is_some(), "{name} needs no permission");
        let uses = |file: &&str| file.starts_with(place) && (*file == name || read(file).contains(name));
        assert!(files_ending(&[".rs", ".toml"]).any(|file| uses(&file)), "{name} does not occur in {place} any more");
    }
}
