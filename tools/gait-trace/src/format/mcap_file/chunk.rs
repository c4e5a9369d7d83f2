//! The records of a chunk, unpacked and compared with the chunk's check sum.

use mcap::McapError;
use mcap::records::ChunkHeader;
use std::borrow::Cow;

/// Most bytes of one unpacked chunk. Recorders write chunks of about a megabyte.
const MAX_CHUNK: u64 = 64 << 20;
/// Most bytes of all unpacked chunks together: a capture of as many ticks as a table may have rows.
const MAX_UNPACKED: u64 = 10 << 30;

/// Unpacks chunks, with a limit on all of them together.
#[derive(Default)]
pub(super) struct Unpacker {
    unpacked: u64,
}

impl Unpacker {
    /// The records of a chunk. Memory grows with the bytes that are unpacked, not with the size that the chunk announces.
    pub(super) fn unpack<'a>(&mut self, header: &ChunkHeader, data: &'a [u8]) -> Result<Cow<'a, [u8]>, String> {
        let records = match header.compression.as_str() {
            "" => Cow::Borrowed(data),
            how => {
                let size = header.uncompressed_size;
                self.unpacked = self.unpacked.saturating_add(size);
                if size > MAX_CHUNK {
                    return Err(format!("a chunk of {size} bytes when unpacked; allowed are up to {MAX_CHUNK}"));
                }
                if self.unpacked > MAX_UNPACKED {
                    return Err(format!(
                        "chunks of more than {MAX_UNPACKED} bytes when unpacked; allowed are up to that: keep the topic of the joints alone with `mcap filter`"
                    ));
                }
                let records = packed::unpack(how, data, size)?;
                if records.len() as u64 != size {
                    let found = if records.len() as u64 > size { "more".to_owned() } else { records.len().to_string() };
                    return Err(format!(
                        "a chunk announces {size} bytes and has {found}; allowed are as many as it announces"
                    ));
                }
                Cow::Owned(records)
            }
        };
        let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&records));
        if saved != 0 && saved != calculated {
            return Err(McapError::BadChunkCrc { saved, calculated }.to_string());
        }
        Ok(records)
    }
}

fn unknown(how: &str, allowed: &str) -> String {
    format!(
        "a chunk is compressed with {how}; allowed are {allowed}: convert it with `mcap compress --compression none`",
        how = crate::format::text_table::short(how)
    )
}

#[cfg(feature = "interchange")]
mod packed {
    use std::io::Read;

    /// The bytes of a compressed chunk, and at most one more than it announces.
    pub(super) fn unpack(how: &str, mut data: &[u8], size: u64) -> Result<Vec<u8>, String> {
        let broken = |error: String| {
            format!("a chunk that is compressed with {how} is damaged: {error}; allowed is an undamaged chunk")
        };
        let mut records = Vec::new();
        // A chunk is one frame or several in a row.
        while !data.is_empty() && records.len() as u64 <= size {
            let rest = size + 1 - records.len() as u64;
            let before = data.len();
            let read = match how {
                "zstd" => {
                    let mut frame = ruzstd::decoding::StreamingDecoder::new(&mut data)
                        .map_err(|error| broken(error.to_string()))?;
                    frame.by_ref().take(rest).read_to_end(&mut records)
                }
                "lz4" => lz4_flex::frame::FrameDecoder::new(&mut data).take(rest).read_to_end(&mut records),
                _ => return Err(super::unknown(how, "none, zstd and lz4")),
            };
            read.map_err(|error| broken(error.to_string()))?;
            if data.len() == before {
                return Err(broken("its frames do not end".into()));
            }
        }
        Ok(records)
    }
}

#[cfg(not(feature = "interchange"))]
mod packed {
    pub(super) fn unpack(how: &str, _: &[u8], _: u64) -> Result<Vec<u8>, String> {
        Err(super::unknown(how, "uncompressed chunks in this build of the program"))
    }
}
