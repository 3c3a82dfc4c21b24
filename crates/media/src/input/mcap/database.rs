//! Bags of ROS 2 in SQLite (`.db3`), as they are recorded up to the distribution Humble.

use super::message::Reading;
use super::records::{Channel, Gap, Message, checked};
use crate::input::fault::Fault;
use crate::input::limits::MAX_SAMPLE_BYTES;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The first bytes of every database.
const MAGIC: &[u8] = b"SQLite format 3\0";

/// Topics at most; a recording has some hundred.
const MOST_TOPICS: usize = 10_000;

/// Steps of SQLite's machine between two looks at whether it goes in circles.
const STEPS: i32 = 10_000;

/// The messages of one file.
pub(super) struct Database {
    connection: Connection,
    pub channels: BTreeMap<i64, Channel>,
    /// The last message that was read.
    last: i64,
    message: Vec<u8>,
}

impl From<rusqlite::Error> for Gap {
    fn from(error: rusqlite::Error) -> Self {
        Fault::malformed(match error.sqlite_error_code() {
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => {
                "the recording is cut off or damaged; what was before is read".to_owned()
            }
            // In the middle of a page it is a read that comes short.
            Some(ErrorCode::SystemIoFailure) => {
                "the recording is cut off, or its disk fails; what was before is read".to_owned()
            }
            Some(ErrorCode::OperationInterrupted) => "it is damaged and leads in circles".to_owned(),
            Some(ErrorCode::TooBig) => "a message of it is too large to be right".to_owned(),
            _ => error.to_string(),
        })
        .into()
    }
}

impl Database {
    /// Whether a file is one.
    pub fn is_one(path: &Path) -> Result<bool, Fault> {
        let mut head = Vec::new();
        File::open(path)?.take(MAGIC.len() as u64).read_to_end(&mut head)?;
        Ok(head == MAGIC)
    }

    /// Opens a bag, of which nothing is taken on trust.
    pub fn open(path: &Path) -> Result<Self, Gap> {
        let length = path.metadata().map_err(Fault::from)?.len();
        let mut connection =
            Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX)?;
        connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_SAMPLE_BYTES as i32)?;
        connection.pragma_update(None, "trusted_schema", false)?;
        connection.pragma_update(None, "cell_size_check", true)?;
        // Nothing is written; but a file that is shorter than it says is read at all only so.
        connection.pragma_update(None, "writable_schema", true)?;
        // A row takes some bytes of the file and some steps; tables that lead in circles take more.
        let (mut left, all) = (0, length.saturating_mul(4) / STEPS as u64 + 100);
        connection.progress_handler(
            STEPS,
            Some(move || {
                left += 1;
                left > all
            }),
        )?;
        let tables = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND sql LIKE 'CREATE TABLE%' AND name IN ('topics', 'messages')";
        if connection.query_row(tables, [], |row| row.get::<_, i64>(0))? != 2 {
            return Err(Fault::malformed("it is a database, but no bag of ROS 2").into());
        }
        let channels = channels(&connection)?;
        Ok(Self { connection, channels, last: i64::MIN, message: Vec::new() })
    }

    /// How many messages each topic has, and whether all could be counted.
    pub fn counts(&self) -> (BTreeMap<i64, u64>, bool) {
        let mut counts = BTreeMap::new();
        let counted = self.connection.prepare("SELECT topic_id FROM messages").and_then(|mut statement| {
            let mut rows = statement.query([])?;
            while let Some(row) = rows.next()? {
                let id: i64 = row.get(0)?;
                if self.channels.contains_key(&id) {
                    *counts.entry(id).or_insert(0) += 1;
                }
            }
            Ok(())
        });
        (counts, counted.is_ok())
    }

    /// The next message of a channel that is `wanted`.
    pub fn next(&mut self, wanted: impl Fn(&Channel) -> bool) -> Result<Option<Message<'_>>, Gap> {
        let wanted = self.channels.iter().filter(|(_, channel)| wanted(channel));
        let ids: Vec<String> = wanted.map(|(id, _)| id.to_string()).collect();
        let (id, topic, logged_ns) = {
            let mut statement = self.connection.prepare_cached(&format!(
                "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ?1 AND topic_id IN ({}) ORDER BY id LIMIT 1",
                ids.join(",")
            ))?;
            let mut rows = statement.query([self.last])?;
            let Some(row) = rows.next()? else { return Ok(None) };
            self.message.clear();
            if let ValueRef::Blob(data) = row.get_ref(3)? {
                self.message.extend_from_slice(data);
            }
            (row.get::<_, i64>(0)?, row.get::<_, i64>(1)?, row.get::<_, i64>(2)?)
        };
        if id <= self.last {
            return Err(Fault::malformed("its messages are in no order").into());
        }
        self.last = id;
        let channel = self.channels.get(&topic);
        Ok(channel.map(|channel| Message { channel, logged_ns, data: &self.message }))
    }
}

fn channels(connection: &Connection) -> Result<BTreeMap<i64, Channel>, Gap> {
    let mut statement = connection.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = statement.query([])?;
    let mut channels = BTreeMap::new();
    while let Some(row) = rows.next()? {
        let reading = Reading::of(&checked(row.get(2)?)?, &checked(row.get(3)?)?);
        channels.insert(row.get(0)?, Channel { topic: checked(row.get(1)?)?, reading });
        if channels.len() > MOST_TOPICS {
            return Err(Fault::malformed(format!("more than {MOST_TOPICS} topics cannot be right")).into());
        }
    }
    Ok(channels)
}
