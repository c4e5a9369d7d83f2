//! Tags, addresses and places of a page of HTML, or of a picture.

use std::cell::RefCell;
use std::collections::BTreeSet;

use html5ever::tendril::StrTendril;
use html5ever::tokenizer::states::RawKind;
use html5ever::tokenizer::{BufferQueue, TagKind, Token, TokenSink, TokenSinkResult, Tokenizer, TokenizerOpts};

/// A start tag.
pub(crate) struct Tag {
    pub(crate) name: String,
    attributes: Vec<(String, String)>,
}

impl Tag {
    /// The value of an attribute.
    pub(crate) fn value(&self, name: &str) -> Option<&str> {
        // The parser of HTML makes names of attributes small.
        self.attributes.iter().find(|(own, _)| own.eq_ignore_ascii_case(name)).map(|(_, value)| value.as_str())
    }
}

/// What a page has.
pub(crate) struct Page {
    pub(crate) tags: Vec<Tag>,
    /// Where its links lead and its pictures, scripts and styles are.
    pub(crate) links: Vec<String>,
    /// The places that a link can lead to.
    pub(crate) ids: BTreeSet<String>,
}

impl Page {
    /// Reads a page.
    pub(crate) fn read(text: &str) -> Self {
        let tokenizer = Tokenizer::new(Tags::default(), TokenizerOpts::default());
        let input = BufferQueue::default();
        input.push_back(StrTendril::from(text));
        let _ = tokenizer.feed(&input);
        tokenizer.end();
        let tags = tokenizer.sink.0.into_inner();
        let of = |tag: &Tag, names: &[&str]| names.iter().find_map(|name| tag.value(name)).map(str::to_owned);
        let links = tags.iter().filter_map(|tag| of(tag, &["href", "src"])).collect();
        let ids = tags.iter().filter_map(|tag| of(tag, &["id"])).collect();
        Self { tags, links, ids }
    }

    /// The attribute of the first tag of this name.
    pub(crate) fn first(&self, tag: &str, attribute: &str) -> Option<&str> {
        self.tags.iter().find(|own| own.name == tag)?.value(attribute)
    }
}

/// Collects the start tags.
#[derive(Default)]
struct Tags(RefCell<Vec<Tag>>);

impl TokenSink for Tags {
    type Handle = ();

    fn process_token(&self, token: Token, _line: u64) -> TokenSinkResult<()> {
        let Token::TagToken(tag) = token else { return TokenSinkResult::Continue };
        if tag.kind != TagKind::StartTag {
            return TokenSinkResult::Continue;
        }
        let attributes = tag.attrs.iter().map(|a| (a.name.local.to_string(), a.value.to_string())).collect();
        self.0.borrow_mut().push(Tag { name: tag.name.to_string(), attributes });
        // What looks like a tag within a script is none.
        match &*tag.name {
            "script" => TokenSinkResult::RawData(RawKind::ScriptData),
            "style" => TokenSinkResult::RawData(RawKind::Rawtext),
            _ => TokenSinkResult::Continue,
        }
    }
}
