//! Writes MCAP (<https://mcap.dev/spec>): chunks of messages, compressed with zstd, each in one piece, and an index at the end.
//!
//! The crate `mcap` writes compressed chunks through libzstd, in C; this file puts the same records around chunks that `ruzstd` compresses,
//! which needs Rust alone. A program without the feature `analysis` writes chunks that are not compressed, which are as valid.

use binrw::BinWrite;
use mcap::MAGIC;
use mcap::records::{
    Channel, ChunkHeader, ChunkIndex, DataEnd, Footer, Header, MessageHeader, MessageIndex, MessageIndexEntry,
    Metadata, MetadataIndex, SchemaHeader, Statistics, op,
};
use std::collections::BTreeMap;
use std::io::{self, Cursor, Write};

/// How chunks are compressed, as MCAP names it.
pub(crate) const COMPRESSION: &str = if cfg!(feature = "analysis") { "zstd" } else { "" };

/// A file that is being written.
pub(crate) struct McapWriter<W> {
    out: W,
    /// Bytes written so far.
    position: u64,
    /// Records of schemas and channels: in the first chunk, and again at the end.
    definitions: Vec<u8>,
    schemas: u16,
    channels: u16,
    /// The chunk that is not written yet.
    chunk: Vec<u8>,
    entries: BTreeMap<u16, Vec<MessageIndexEntry>>,
    chunks: Vec<ChunkIndex>,
    metadata: Vec<MetadataIndex>,
    counts: BTreeMap<u16, u64>,
}

impl<W: Write> McapWriter<W> {
    /// Begins a file; `library` is the name of the program.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn begin(out: W, library: &str) -> io::Result<Self> {
        let mut writer = Self {
            out,
            position: 0,
            definitions: Vec::new(),
            schemas: 0,
            channels: 0,
            chunk: Vec::new(),
            entries: BTreeMap::new(),
            chunks: Vec::new(),
            metadata: Vec::new(),
            counts: BTreeMap::new(),
        };
        writer.raw(MAGIC)?;
        writer.raw(&record(op::HEADER, &Header { profile: String::new(), library: library.into() }, &[])?)?;
        Ok(writer)
    }

    /// Adds a channel and its schema; returns its number.
    ///
    /// # Errors
    /// A text is too long.
    pub(crate) fn add_channel(
        &mut self,
        topic: &str,
        message_encoding: &str,
        [name, encoding, definition]: [&str; 3],
    ) -> io::Result<u16> {
        self.schemas += 1;
        self.channels += 1;
        let schema = SchemaHeader { id: self.schemas, name: name.into(), encoding: encoding.into() };
        let length = u32::try_from(definition.len()).map_err(io::Error::other)?;
        let tail = [&length.to_le_bytes(), definition.as_bytes()].concat();
        let channel = Channel {
            id: self.channels,
            schema_id: self.schemas,
            topic: topic.into(),
            message_encoding: message_encoding.into(),
            metadata: BTreeMap::new(),
        };
        let records = [record(op::SCHEMA, &schema, &tail)?, record(op::CHANNEL, &channel, &[])?].concat();
        self.chunk.extend(&records);
        self.definitions.extend(records);
        Ok(self.channels)
    }

    /// Adds a message; `time_ns` is in nanoseconds of the Unix epoch.
    ///
    /// # Errors
    /// A text is too long.
    pub(crate) fn message(&mut self, channel_id: u16, sequence: u32, time_ns: u64, data: &[u8]) -> io::Result<()> {
        let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
        let entry = MessageIndexEntry { log_time: time_ns, offset: self.chunk.len() as u64 };
        self.entries.entry(channel_id).or_default().push(entry);
        self.chunk.extend(record(op::MESSAGE, &header, data)?);
        *self.counts.entry(channel_id).or_default() += 1;
        Ok(())
    }

    /// Writes metadata at once, before the chunk that is not written yet.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> io::Result<()> {
        let bytes = record(op::METADATA, &Metadata { name: name.into(), metadata }, &[])?;
        self.metadata.push(MetadataIndex { offset: self.position, length: bytes.len() as u64, name: name.into() });
        self.raw(&bytes)?;
        self.out.flush()
    }

    /// Writes the chunk so far, in one piece: a program that is killed leaves whole chunks.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        let entries = std::mem::take(&mut self.entries);
        if chunk.is_empty() {
            return Ok(());
        }
        let times = || entries.values().flatten().map(|entry| entry.log_time);
        let (start, end) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        let compressed = compress(&chunk);
        let header = ChunkHeader {
            message_start_time: start,
            message_end_time: end,
            uncompressed_size: chunk.len() as u64,
            uncompressed_crc: crc32fast::hash(&chunk),
            compression: COMPRESSION.into(),
            compressed_size: compressed.len() as u64,
        };
        let chunk_start_offset = self.position;
        self.raw(&record(op::CHUNK, &header, &compressed)?)?;
        let indexes_at = self.position;
        let mut message_index_offsets = BTreeMap::new();
        for (channel_id, records) in entries {
            message_index_offsets.insert(channel_id, self.position);
            self.raw(&record(op::MESSAGE_INDEX, &MessageIndex { channel_id, records }, &[])?)?;
        }
        self.chunks.push(ChunkIndex {
            message_start_time: start,
            message_end_time: end,
            chunk_start_offset,
            chunk_length: indexes_at - chunk_start_offset,
            message_index_offsets,
            message_index_length: self.position - indexes_at,
            compression: COMPRESSION.into(),
            compressed_size: header.compressed_size,
            uncompressed_size: header.uncompressed_size,
        });
        self.out.flush()
    }

    /// Writes the rest and the index.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        self.flush()?;
        self.raw(&record(op::DATA_END, &DataEnd::default(), &[])?)?;
        let summary_start = self.position;
        let with_messages = || self.chunks.iter().filter(|chunk| !chunk.message_index_offsets.is_empty());
        let statistics = Statistics {
            message_count: self.counts.values().sum(),
            schema_count: self.schemas,
            channel_count: self.channels.into(),
            attachment_count: 0,
            metadata_count: self.metadata.len() as u32,
            chunk_count: self.chunks.len() as u32,
            message_start_time: with_messages().map(|chunk| chunk.message_start_time).min().unwrap_or(0),
            message_end_time: with_messages().map(|chunk| chunk.message_end_time).max().unwrap_or(0),
            channel_message_counts: std::mem::take(&mut self.counts),
        };
        let mut summary = std::mem::take(&mut self.definitions);
        summary.extend(record(op::STATISTICS, &statistics, &[])?);
        for chunk in &self.chunks {
            summary.extend(record(op::CHUNK_INDEX, chunk, &[])?);
        }
        for metadata in &self.metadata {
            summary.extend(record(op::METADATA_INDEX, metadata, &[])?);
        }
        self.raw(&summary)?;
        // A check sum of 0 says that there is none.
        let footer = Footer { summary_start, summary_offset_start: 0, summary_crc: 0 };
        self.raw(&record(op::FOOTER, &footer, &[])?)?;
        self.raw(MAGIC)?;
        self.out.flush()
    }

    fn raw(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.position += bytes.len() as u64;
        self.out.write_all(bytes)
    }
}

/// A record with its code, its length, and bytes behind its fields.
fn record<R: for<'a> BinWrite<Args<'a> = ()>>(code: u8, fields: &R, tail: &[u8]) -> io::Result<Vec<u8>> {
    let mut content = Cursor::new(Vec::new());
    fields.write_le(&mut content).map_err(io::Error::other)?;
    let mut content = content.into_inner();
    // The length of a chunk's records is the last field of its header.
    content.extend(tail);
    let mut bytes = vec![code];
    bytes.extend((content.len() as u64).to_le_bytes());
    bytes.append(&mut content);
    Ok(bytes)
}

#[cfg(feature = "analysis")]
fn compress(chunk: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(chunk, ruzstd::encoding::CompressionLevel::Fastest)
}

#[cfg(not(feature = "analysis"))]
fn compress(chunk: &[u8]) -> Vec<u8> {
    chunk.to_vec()
}

#[cfg(all(test, feature = "analysis"))]
mod tests {
    use super::*;

    /// The crate `mcap` reads index, channels and metadata; the chunk is a frame of zstd (RFC 8878, 3.1.1).
    #[test]
    fn the_index_leads_to_every_chunk() {
        let mut bytes = Vec::new();
        let mut writer = McapWriter::begin(&mut bytes, "a test").unwrap();
        let channel = writer.add_channel("/a", "json", ["a.A", "jsonschema", "{}"]).unwrap();
        writer.metadata("about", BTreeMap::from([("key".into(), "value".into())])).unwrap();
        for n in 0..20 {
            writer.message(channel, n, 1_000 + u64::from(n), b"{\"x\": 1}").unwrap();
            if n == 9 {
                writer.flush().unwrap();
            }
        }
        writer.finish().unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let statistics = summary.stats.unwrap();
        assert_eq!((statistics.message_count, statistics.chunk_count, statistics.metadata_count), (20, 2, 1));
        assert_eq!((statistics.message_start_time, statistics.message_end_time), (1_000, 1_019));
        assert_eq!(summary.channels[&channel].topic, "/a");
        assert_eq!(summary.channels[&channel].schema.as_ref().unwrap().name, "a.A");
        let sizes = summary.chunk_indexes.iter().map(|chunk| chunk.message_index_offsets.len());
        assert_eq!(sizes.collect::<Vec<_>>(), [1, 1]);
        for chunk in &summary.chunk_indexes {
            let at = chunk.compressed_data_offset().unwrap() as usize;
            assert_eq!((chunk.compression.as_str(), &bytes[at..at + 4]), ("zstd", &[0x28, 0xb5, 0x2f, 0xfd][..]));
        }
        let at = &summary.metadata_indexes[0];
        assert_eq!(bytes[at.offset as usize], op::METADATA);
    }
}
