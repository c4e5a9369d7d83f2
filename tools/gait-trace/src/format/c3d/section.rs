//! Parses header and parameter section of a C3D file: place, number, format and names of the points.
//!
//! Header (512 bytes; words of 16 bit): byte 0 the block of the parameter section, byte 1 the key 0x50, word 1 points per
//! frame, word 2 analog values per frame, words 3 and 4 first and last frame, words 6-7 scale (negative: the points are
//! floats), word 8 the block of the data, words 10-11 frames per second. Blocks count from 1 and have 512 bytes.
//! Parameters: a chain of records; groups have negative numbers, parameters the positive number of their group.

use super::bytes::Ctx;
use super::processor::Processor;
use crate::fault::TraceError;
use crate::format::text_table::listed;
use std::collections::{HashMap, HashSet};

const BLOCK: usize = 512;
/// The key byte of header and parameter section.
pub(crate) const KEY: u8 = 0x50;
/// Largest number of records in a parameter section: 255 blocks hold no more of the shortest ones.
const MAX_RECORDS: usize = 255 * BLOCK / 8;
/// Largest number of entries read from a text parameter: the header's 16-bit word cannot count more points.
const MOST_ENTRIES: usize = 65535;
/// Highest frame rate.
const MAX_RATE_HZ: f32 = 100_000.0;

/// Type, dimensions and place of a parameter's data.
#[derive(Debug, Clone)]
struct Parameter {
    /// -1 text, 1 bytes, 2 integers of 16 bit, 4 floats.
    kind: i8,
    dims: Vec<usize>,
    offset: usize,
}

/// All parameters by `GROUP:NAME` in upper case.
pub(crate) struct Parameters {
    pub(crate) processor: Processor,
    found: HashMap<String, Parameter>,
}

impl Parameters {
    pub(crate) fn parse(ctx: &Ctx<'_>) -> Result<Self, TraceError> {
        let [block, key] = ctx.at(0, "the header")?;
        if key != KEY {
            return Err(ctx.bad(1, "the key of the header", &format!("{key:#04x}"), "0x50: is this a C3D file?"));
        }
        if block < 1 {
            return Err(ctx.bad(0, "the pointer to the parameter section", "block 0", "block 1 or later, usually 2"));
        }
        let start = (usize::from(block) - 1) * BLOCK;
        let [_, _, blocks, kind] = ctx.at(start, "the parameter section")?;
        let processor = Processor::of_byte(kind).ok_or_else(|| {
            let allowed = "84 (Intel), 85 (DEC) or 86 (MIPS)";
            ctx.bad(start + 3, "the processor", &kind.to_string(), allowed)
        })?;
        // Some programs write too few blocks, or 0; everything before the data is parameters.
        let data = (usize::from(processor.u16(ctx.at(16, "the pointer to the data")?)) * BLOCK).saturating_sub(BLOCK);
        let end = (start + usize::from(blocks) * BLOCK).max(data).min(ctx.bytes.len());
        let mut groups: HashMap<i8, String> = HashMap::new();
        let mut parameters: Vec<(i8, String, Parameter)> = Vec::new();
        let mut at = start + 4;
        for _ in 0..MAX_RECORDS {
            let Some(&[name_len, group]) = ctx.bytes.get(at..at + 2).filter(|_| at + 2 <= end) else { break };
            // A negative length means a locked parameter; the length is its absolute value.
            let (name_len, group) = (usize::from((name_len as i8).unsigned_abs()), group as i8);
            if name_len == 0 || group == 0 {
                break;
            }
            let name_at = at + 2;
            let link_at = name_at + name_len;
            let name = ctx.bytes.get(name_at..link_at).unwrap_or_default();
            let name = String::from_utf8_lossy(name).trim().to_ascii_uppercase();
            let link = usize::from(processor.u16(ctx.at(link_at, "the link of a parameter")?));
            if group < 0 {
                groups.insert(group, name);
            } else {
                let parameter = Parameter::parse(ctx, link_at + 2, &name)?;
                parameters.push((group, name, parameter));
            }
            if link == 0 {
                break;
            }
            if link_at + link > end {
                let found = format!("{link}, beyond the section's end at {end}");
                return Err(ctx.bad(
                    link_at,
                    "the link to the next parameter",
                    &found,
                    "a place inside of the section",
                ));
            }
            at = link_at + link;
        }
        let mut found = HashMap::new();
        for (group, name, parameter) in parameters {
            // A parameter of an undefined group has no full name, so it is dropped.
            if let Some(group) = groups.get(&-group) {
                found.insert(format!("{group}:{name}"), parameter);
            }
        }
        Ok(Self { processor, found })
    }

    /// The entries of a text parameter, without surrounding blanks.
    pub(crate) fn text(&self, ctx: &Ctx<'_>, name: &str) -> Vec<String> {
        let Some(Parameter { kind: -1, dims, offset }) = self.found.get(name) else { return Vec::new() };
        let (length, count) = match dims.as_slice() {
            [] => (1, 1),
            [length] => (*length, 1),
            [length, counts @ ..] => (*length, counts.iter().product()),
        };
        // Entries of length 0 take no bytes, so their announced number would be unbounded.
        if length == 0 {
            return Vec::new();
        }
        let entry = |n: usize| {
            let bytes = ctx.bytes.get(offset + n * length..offset + (n + 1) * length).unwrap_or_default();
            String::from_utf8_lossy(bytes).trim_matches(['\0', ' ', '\t']).to_owned()
        };
        (0..count.min(MOST_ENTRIES)).map(entry).collect()
    }

    /// The first number of a parameter; integers are read as unsigned counts.
    pub(crate) fn number(&self, ctx: &Ctx<'_>, name: &str) -> Option<f64> {
        self.nth_number(ctx, name, 0)
    }

    pub(crate) fn nth_number(&self, ctx: &Ctx<'_>, name: &str, n: usize) -> Option<f64> {
        let Parameter { kind, dims, offset } = self.found.get(name)?;
        if n >= dims.iter().product::<usize>() {
            return None;
        }
        match kind {
            1 => ctx.bytes.get(offset + n).map(|&byte| f64::from(byte)),
            2 => ctx.at(offset + 2 * n, name).ok().map(|bytes| f64::from(self.processor.u16(bytes))),
            4 => ctx.at(offset + 4 * n, name).ok().map(|bytes| f64::from(self.processor.f32(bytes))),
            _ => None,
        }
    }
}

impl Parameter {
    fn parse(ctx: &Ctx<'_>, at: usize, name: &str) -> Result<Self, TraceError> {
        let [kind, rank] = ctx.at(at, name)?;
        let kind = kind as i8;
        if !matches!(kind, -1 | 1 | 2 | 4) {
            return Err(ctx.bad(at, &format!("the type of parameter {name}"), &kind.to_string(), "-1, 1, 2 or 4"));
        }
        if rank > 7 {
            let field = format!("the number of dimensions of parameter {name}");
            return Err(ctx.bad(at + 1, &field, &rank.to_string(), "0 to 7"));
        }
        let offset = at + 2 + usize::from(rank);
        let Some(dims) = ctx.bytes.get(at + 2..offset) else {
            return Err(ctx.bad(
                at + 2,
                &format!("parameter {name}"),
                "cut by the end of the file",
                "the complete parameter: is the file cut off?",
            ));
        };
        let dims: Vec<usize> = dims.iter().map(|&dim| usize::from(dim)).collect();
        // Seven dimensions of 255 overflow a usize of 32 bit.
        let size = dims.iter().try_fold(usize::from(kind.unsigned_abs()), |size, &dim| size.checked_mul(dim));
        let end = size.and_then(|size| offset.checked_add(size)).filter(|&end| end <= ctx.bytes.len());
        if end.is_none() {
            let found = format!("{dims:?}, more than the rest of the file");
            return Err(ctx.bad(
                at + 2,
                &format!("the size of parameter {name}"),
                &found,
                "a size that fits into the file: is it cut off?",
            ));
        }
        Ok(Self { kind, dims, offset })
    }
}

/// Place, number and format of the points.
pub(crate) struct Layout {
    pub(crate) labels: Vec<String>,
    pub(crate) frames: usize,
    pub(crate) rate_hz: f64,
    /// Scale of integer points; `None` for floats.
    pub(crate) scale: Option<f32>,
    pub(crate) data_at: usize,
    pub(crate) frame_bytes: usize,
}

impl Layout {
    pub(crate) fn parse(ctx: &Ctx<'_>, parameters: &Parameters, notes: &mut Vec<String>) -> Result<Self, TraceError> {
        let processor = parameters.processor;
        let word = |n: usize| ctx.at(2 * n, "the header").map(|bytes| processor.u16(bytes));
        let float = |n: usize| ctx.at(2 * n, "the header").map(|bytes| processor.f32(bytes));
        let points = usize::from(word(1)?);
        if let Some(used) = parameters.number(ctx, "POINT:USED")
            && used != points as f64
        {
            let allowed = format!("{used}, as POINT:USED says");
            return Err(ctx.bad(2, "the number of points", &points.to_string(), &allowed));
        }
        if points == 0 {
            return Err(ctx.bad(2, "the number of points", "0", "1 or more"));
        }
        let analogs = usize::from(word(2)?);

        let scale = match parameters.number(ctx, "POINT:SCALE") {
            Some(scale) => scale as f32,
            None => float(6)?,
        };
        if !scale.is_finite() || scale == 0.0 {
            let allowed = "below 0 for floats, above 0 for integers";
            return Err(ctx.bad(12, "the scale of the points", &scale.to_string(), allowed));
        }
        let rate = match parameters.number(ctx, "POINT:RATE") {
            Some(rate) if rate > 0.0 => {
                let (rate, of_header) = (rate as f32, float(10)?);
                if of_header != rate {
                    notes.push(format!(
                        "The header gives {of_header} Hz, POINT:RATE gives {rate} Hz; the latter is used."
                    ));
                }
                rate
            }
            _ => float(10)?,
        };
        if !(rate > 0.0 && rate <= MAX_RATE_HZ) {
            let allowed = format!("above 0 and up to {MAX_RATE_HZ} Hz");
            return Err(ctx.bad(20, "the frame rate", &rate.to_string(), &allowed));
        }
        let size = if scale < 0.0 { 4 } else { 2 };
        let frame_bytes = (points * 4 + analogs) * size;

        let header_block = word(8)?;
        let block = match parameters.number(ctx, "POINT:DATA_START") {
            Some(block) if block >= 1.0 => {
                if block != f64::from(header_block) {
                    notes.push(format!("The header gives block {header_block} as the start of the data, POINT:DATA_START gives {block}; the latter is used."));
                }
                block as usize
            }
            _ => usize::from(header_block),
        };
        let data_at = block.checked_sub(1).map(|block| block * BLOCK).filter(|&at| at >= BLOCK && at < ctx.bytes.len());
        let Some(data_at) = data_at else {
            let found = format!("block {block} of a file of {} bytes", ctx.bytes.len());
            return Err(ctx.bad(
                16,
                "the pointer to the data",
                &found,
                "a block after the header and inside of the file",
            ));
        };
        let last = word(4)?;
        let announced = Self::frames(ctx, parameters, word(3)?, last, notes)?;
        let there = (ctx.bytes.len() - data_at) / frame_bytes;
        let frames = Self::beyond_the_word((announced, last), &ctx.bytes[data_at..], frame_bytes, notes);
        if frames > there {
            let found = format!("{frames} of {frame_bytes} bytes each, with data for {there} (truncated?)");
            return Err(ctx.bad(6, "the number of frames", &found, &format!("up to {there}")));
        }
        let labels = Self::labels(ctx, parameters, points, notes)?;
        let scale = (scale > 0.0).then_some(scale);
        Ok(Self { labels, frames, rate_hz: f64::from(rate), scale, data_at, frame_bytes })
    }

    /// The number of frames. The header's words end at 65535; longer files have the number in parameters.
    fn frames(
        ctx: &Ctx<'_>,
        parameters: &Parameters,
        first: u16,
        last: u16,
        notes: &mut Vec<String>,
    ) -> Result<usize, TraceError> {
        let number = |name: &str| parameters.number(ctx, name).filter(|frames| *frames >= 1.0 && *frames < 4e9);
        let field = |name: &str| {
            let word = |n| parameters.nth_number(ctx, name, n);
            Some(word(0)? + 65536.0 * word(1)?)
        };
        let header = (last >= first && first > 0).then(|| usize::from(last - first) + 1);
        if let Some(header) = header.filter(|_| last < u16::MAX) {
            if let Some(frames) = number("POINT:FRAMES").filter(|frames| *frames != header as f64) {
                notes.push(format!(
                    "The header gives {header} frames, POINT:FRAMES gives {frames}; the header is used."
                ));
            }
            return Ok(header);
        }
        let trial = match (field("TRIAL:ACTUAL_START_FIELD"), field("TRIAL:ACTUAL_END_FIELD")) {
            (Some(start), Some(end)) if end >= start => Some((end - start) as usize + 1),
            _ => None,
        };
        let long = || number("POINT:LONG_FRAMES").or_else(|| number("POINT:FRAMES")).map(|frames| frames as usize);
        trial.or_else(long).or(header).ok_or_else(|| {
            ctx.bad(
                6,
                "the first and last frame",
                &format!("{first} and {last}"),
                "a first frame of 1 or more and a last frame not before it",
            )
        })
    }

    /// The number of frames of a file that announces the most that a word can hold and has data for more, as some programs write a long
    /// recording; else that which is announced. Bytes of 0 behind the last frame fill up a block.
    fn beyond_the_word(
        (announced, last): (usize, u16),
        data: &[u8],
        frame_bytes: usize,
        notes: &mut Vec<String>,
    ) -> usize {
        let filled = data.len() - data.iter().rev().take(BLOCK).take_while(|byte| **byte == 0).count();
        // The last numbers of a frame may be 0 themselves.
        let there = filled.div_ceil(frame_bytes).min(data.len() / frame_bytes);
        if last != u16::MAX || announced > usize::from(u16::MAX) || there <= announced {
            return announced;
        }
        notes.push(format!(
            "Header and parameters give {announced} frames, up to frame 65535, the last that a word can hold; the file has data for {there}, and all of them are read."
        ));
        there
    }

    /// The name of each point; those beyond 255 are in further parameters.
    fn labels(
        ctx: &Ctx<'_>,
        parameters: &Parameters,
        points: usize,
        notes: &mut Vec<String>,
    ) -> Result<Vec<String>, TraceError> {
        let mut labels = parameters.text(ctx, "POINT:LABELS");
        for n in 2..=points.div_ceil(255) {
            labels.extend(parameters.text(ctx, &format!("POINT:LABELS{n}")));
        }
        if labels.is_empty() {
            let allowed = "the names of the points";
            return Err(ctx.bad(0, "POINT:LABELS", "missing", allowed));
        }
        if labels.len() < points {
            notes.push(format!("Only {} of {points} points have names.", labels.len()));
        }
        let mut seen = HashSet::new();
        if let Some(label) = labels.iter().find(|label| !label.is_empty() && !seen.insert(label.as_str())) {
            notes.push(format!("Several points have the name {}; the first is used.", listed(&[label])));
        }
        labels.truncate(points);
        Ok(labels)
    }
}
