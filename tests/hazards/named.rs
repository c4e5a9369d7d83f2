//! Finds a test function by its name, `FILE::FUNCTION`, and where it runs.
//!
//! A test is one of these, by the tokens of its file:
//! - a function behind `#[test]` that is not ignored: it runs on the host;
//! - a function in a list `tests![...]`: on the virtual board if it needs an image to run, by what is linked if it needs images as files,
//!   otherwise on the host;
//! - the function of a step of `cargo xtask test`: a step that needs the virtual board runs there, one that needs the board's compiler alone
//!   ends with the link.

use std::path::Path;

use footfall_tests::workspace::{files, root};
use proc_macro2::{Delimiter, TokenStream, TokenTree};

use crate::entry::Place;

/// Where the named test runs.
///
/// # Errors
/// There is no such file, no such function in it, or the function is no test.
pub(crate) fn place_of(name: &str) -> Result<Place, String> {
    let allowed = "allowed is FILE::FUNCTION, with a file of this repository";
    let (file, function) = name.rsplit_once("::").ok_or_else(|| format!("`{name}` is no test; {allowed}"))?;
    if !files().any(|known| known == file) {
        return Err(format!("`{name}`: there is no file {file}; {allowed}"));
    }
    let text = std::fs::read_to_string(root().join(Path::new(file))).map_err(|error| format!("{file}: {error}"))?;
    place_in(&text, function).map_err(|error| format!("`{name}`: {error}"))
}

/// The same for a function of a text.
fn place_in(text: &str, function: &str) -> Result<Place, String> {
    let tokens: TokenStream = text.parse().map_err(|error| format!("the file is no Rust: {error}"))?;
    let mut found = Found::default();
    found.search(tokens, function);
    match found {
        Found { defined: false, .. } => Err(format!("the file has no function {function}")),
        Found { ignored: true, .. } => Err("the test is ignored".to_owned()),
        Found { place: None, .. } => {
            Err("the function is no test: no #[test] above it, in no list tests![...], no step of xtask".to_owned())
        }
        Found { place: Some(place), .. } => Ok(place),
    }
}

/// What a file says about a function.
#[derive(Default)]
struct Found {
    defined: bool,
    ignored: bool,
    place: Option<Place>,
}

impl Found {
    fn search(&mut self, tokens: TokenStream, function: &str) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        for (index, token) in tokens.iter().enumerate() {
            let before = |back: usize| index.checked_sub(back).map(|at| &tokens[at]);
            match token {
                TokenTree::Ident(name) if name == function && before(1).is_some_and(|token| is(token, "fn")) => {
                    self.defined = true;
                    let attributes = attributes(&tokens[..index - 1]);
                    self.ignored |= attributes.iter().any(|text| text.starts_with("ignore"));
                    if attributes.iter().any(|text| text == "test") {
                        self.place = Some(Place::Host);
                    }
                }
                TokenTree::Group(group) => {
                    let is_list = before(1).is_some_and(|token| is(token, "!"))
                        && before(2).is_some_and(|token| is(token, "tests"));
                    let is_step =
                        group.delimiter() == Delimiter::Brace && before(1).is_some_and(|token| is(token, "Step"));
                    let listed = match (is_list, is_step) {
                        (true, _) => listed(group.stream(), function),
                        (_, true) => step(group.stream(), function),
                        _ => None,
                    };
                    self.place = listed.or(self.place);
                    self.search(group.stream(), function);
                }
                _ => {}
            }
        }
    }
}

fn is(token: &TokenTree, text: &str) -> bool {
    token.to_string() == text
}

/// The texts of the attributes at the end of these tokens, before words such as `pub`.
fn attributes(tokens: &[TokenTree]) -> Vec<String> {
    let mut end = tokens.len();
    while end > 0 && matches!(&tokens[end - 1], TokenTree::Ident(_)) {
        end -= 1;
    }
    let mut found = Vec::new();
    while let [.., TokenTree::Punct(mark), TokenTree::Group(group)] = &tokens[..end] {
        if mark.as_char() != '#' {
            break;
        }
        found.push(group.stream().to_string());
        end -= 2;
    }
    found
}

/// The place of a function in a list `tests![...]`.
fn listed(list: TokenStream, function: &str) -> Option<Place> {
    let tokens: Vec<TokenTree> = list.into_iter().collect();
    tokens.windows(2).find_map(|pair| match pair {
        [name, TokenTree::Group(needs)] if is(name, function) => {
            let needs_one_of =
                |names: &[&str]| needs.stream().into_iter().any(|need| names.iter().any(|name| is(&need, name)));
            Some(if needs_one_of(&["Image", "ShadowImage", "NoSensorImage", "BlackPillImage"]) {
                Place::VirtualBoard
            } else if needs_one_of(&["ImageFiles"]) {
                Place::Link
            } else {
                Place::Host
            })
        }
        _ => None,
    })
}

/// The place of a function that is the one of a step.
fn step(fields: TokenStream, function: &str) -> Option<Place> {
    let tokens: Vec<TokenTree> = fields.into_iter().collect();
    let runs = tokens.windows(3).any(|three| is(&three[0], "run") && is(&three[1], ":") && is(&three[2], function));
    let needs = tokens.iter().position(|token| is(token, "needs")).and_then(|at| tokens[at..].iter().find_map(group));
    let needs = needs.unwrap_or_default().to_string();
    let place = match (needs.contains("VirtualBoard"), needs.contains("BoardCompiler")) {
        (true, _) => Place::VirtualBoard,
        (_, true) => Place::Link,
        _ => Place::Host,
    };
    runs.then_some(place)
}

fn group(token: &TokenTree) -> Option<TokenStream> {
    match token {
        TokenTree::Group(group) => Some(group.stream()),
        _ => None,
    }
}

#[test]
fn tests_differ_from_other_functions() {
    let file = r##"
        fn main() {
            run(tests![on_the_board(Image), without_pulses(ShadowImage, Program), beside_it(Traces), of_its_code(ImageFiles)])
        }
        fn of_its_code() {}
        fn on_the_board() {}
        fn without_pulses() {}
        fn beside_it() {}
        mod tests {
            /// Words.
            #[test]
            #[should_panic(expected = "x")]
            pub fn plain() { fn inner() {} }
            #[test]
            #[ignore = "long"]
            fn left_out() {}
            proptest! { #[test] fn of_a_macro(x in 0..2) {} }
            // #[test] fn in_a_comment() {}
            const TEXT: &str = "#[test] fn in_a_text() {}";
        }
        const STEPS: [Step; 3] = [
            Step { name: "a", needs: &[Need::BoardCompiler], uses: &[], run: link },
            Step { name: "b", needs: &[Need::BoardCompiler, Need::VirtualBoard], run: board },
            Step { name: "c", needs: &[], run: host },
        ];
        fn link() {} fn board() {} fn host() {}
    "##;
    for (function, place) in [
        ("on_the_board", Place::VirtualBoard),
        ("without_pulses", Place::VirtualBoard),
        ("beside_it", Place::Host),
        ("of_its_code", Place::Link),
        ("plain", Place::Host),
        ("of_a_macro", Place::Host),
        ("link", Place::Link),
        ("board", Place::VirtualBoard),
        ("host", Place::Host),
    ] {
        assert_eq!(place_in(file, function), Ok(place), "{function}");
    }
    for (function, words) in [
        ("main", "is no test"),
        ("inner", "is no test"),
        ("left_out", "is ignored"),
        ("in_a_comment", "no function"),
        ("in_a_text", "no function"),
        ("plai", "no function"),
    ] {
        let error = place_in(file, function).expect_err(function);
        assert!(error.contains(words), "{function}: {error}");
    }
    for (name, words) in [("nowhere", "allowed is FILE::FUNCTION"), ("tests/none.rs::f", "there is no file")] {
        let error = place_of(name).expect_err(name);
        assert!(error.contains(words), "{name}: {error}");
    }
}
