//! The records of an MCAP file in order, in bounded memory: schemas are kept as names, of messages only the one that is looked at.

use super::message::Reading;
use crate::input::fault::Fault;
use crate::input::limits::MAX_SAMPLE_BYTES;
use ::mcap::McapError;
use ::mcap::records::{Record, op};
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// The longest name of a topic or a type that is believed: a file may state 65 536 of each.
const LONGEST_NAME: usize = 512;

/// What follows the summary: an opcode, a length, where the summary begins, where its offsets do, a checksum, the magic bytes.
const FOOTER_BYTES: usize = 1 + 8 + 8 + 8 + 4 + 8;

/// Where messages of a kind come from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Channel {
    pub topic: String,
    /// How its messages are read, where they are images.
    pub reading: Option<Reading>,
}

/// A message, as long as the next one is not asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Message<'a> {
    pub channel: &'a Channel,
    /// When it was recorded, in nanoseconds.
    pub logged_ns: i64,
    pub data: &'a [u8],
}

/// Why there is no message, and whether others may come behind it.
#[derive(Debug, PartialEq)]
pub(super) struct Gap {
    pub fault: Fault,
    pub goes_on: bool,
}

impl From<Fault> for Gap {
    fn from(fault: Fault) -> Self {
        Self { fault, goes_on: false }
    }
}

impl From<McapError> for Gap {
    fn from(error: McapError) -> Self {
        let goes_on = matches!(error, McapError::BadChunkCrc { .. });
        let fault = Fault::malformed(match error {
            McapError::UnexpectedEof | McapError::UnexpectedEoc => {
                "the recording is cut off; what was before is read".to_owned()
            }
            McapError::BadChunkCrc { .. } => "bytes around it are not what was recorded: a checksum differs".to_owned(),
            McapError::BadMagic => "where an MCAP file has its mark is something else".to_owned(),
            McapError::RecordTooLarge { len, .. } | McapError::ChunkTooLarge(len) => {
                format!("a record of {len} bytes cannot be right")
            }
            McapError::UnsupportedCompression(name) => {
                format!("its compression `{name}` is not read; `mcap compress` makes it zstd or lz4")
            }
            other => other.to_string(),
        });
        Self { fault, goes_on }
    }
}

/// The records of one file.
pub(super) struct Records {
    source: BufReader<File>,
    reader: LinearReader,
    schemas: BTreeMap<u16, String>,
    pub channels: BTreeMap<u16, Channel>,
    /// How many messages each channel has, where the file has said so.
    pub counts: Option<BTreeMap<u16, u64>>,
    message: Vec<u8>,
}

impl Records {
    /// From the beginning of a file on. Its end is not looked at: a recording that was cut off is read as far as it goes.
    pub fn open(path: &Path) -> Result<Self, Fault> {
        Ok(Self::new(File::open(path)?, LinearReaderOptions::default().with_validate_chunk_crcs(true)))
    }

    fn new(file: File, options: LinearReaderOptions) -> Self {
        Self {
            source: BufReader::with_capacity(1 << 16, file),
            reader: LinearReader::new_with_options(options.with_record_length_limit(MAX_SAMPLE_BYTES as usize)),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            counts: None,
            message: Vec::new(),
        }
    }

    /// What a file that was closed properly says of itself at its end: its channels, and how many messages each has.
    pub fn summary(path: &Path) -> Result<Option<Self>, Fault> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        let Some(footer_at) = length.checked_sub(FOOTER_BYTES as u64) else { return Ok(None) };
        file.seek(SeekFrom::Start(footer_at))?;
        let mut footer = [0; FOOTER_BYTES];
        file.read_exact(&mut footer)?;
        let start = footer[9..17].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        if footer[0] != op::FOOTER || !footer.ends_with(::mcap::MAGIC) || start == 0 || start >= footer_at {
            return Ok(None);
        }
        file.seek(SeekFrom::Start(start))?;
        let mut records = Self::new(file, LinearReaderOptions::default().with_skip_start_magic(true));
        // There are no messages in it; whatever is wrong with it, the file itself says the same.
        let is_sound = matches!(records.next(|_| false), Ok(None));
        let counted = |counts: &BTreeMap<u16, u64>| counts.keys().all(|id| records.channels.contains_key(id));
        let says_all = records.counts.as_ref().is_some_and(counted);
        Ok((is_sound && says_all).then_some(records))
    }

    /// The next message of a channel that is `wanted`.
    pub fn next(&mut self, wanted: impl Fn(&Channel) -> bool) -> Result<Option<Message<'_>>, Gap> {
        let (id, logged_ns) = loop {
            let (opcode, data) = match self.reader.next_event().transpose()? {
                None => return Ok(None),
                Some(LinearReadEvent::ReadRequest(need)) => {
                    let count = match self.source.read(self.reader.insert(need)) {
                        Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                        read => read.map_err(Fault::from)?,
                    };
                    self.reader.notify_read(count);
                    continue;
                }
                Some(LinearReadEvent::Record { opcode, data }) => (opcode, data),
            };
            // All others have nothing to say here, and may be large.
            if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::STATISTICS) {
                continue;
            }
            match ::mcap::parse_record(opcode, data)? {
                Record::Schema { header, .. } => {
                    self.schemas.insert(header.id, checked(header.name)?);
                }
                Record::Channel(channel) => {
                    let schema = self.schemas.get(&channel.schema_id);
                    let reading = schema.and_then(|schema| Reading::of(schema, &channel.message_encoding));
                    self.channels.insert(channel.id, Channel { topic: checked(channel.topic)?, reading });
                }
                Record::Message { header, data } => match self.channels.get(&header.channel_id) {
                    Some(channel) if wanted(channel) => {
                        self.message.clear();
                        self.message.extend_from_slice(&data);
                        break (header.channel_id, i64::try_from(header.log_time).unwrap_or(i64::MAX));
                    }
                    Some(_) => {}
                    None => return Err(Fault::malformed("a message belongs to a channel that was not stated").into()),
                },
                Record::Statistics(statistics) => self.counts = Some(statistics.channel_message_counts),
                _ => {}
            }
        };
        let channel = self.channels.get(&id);
        Ok(channel.map(|channel| Message { channel, logged_ns, data: &self.message }))
    }
}

/// A name, unless it is too long to be one.
pub(super) fn checked(name: String) -> Result<String, Fault> {
    match name.len() {
        0..=LONGEST_NAME => Ok(name),
        length => Err(Fault::malformed(format!("a name of {length} bytes cannot be right"))),
    }
}
