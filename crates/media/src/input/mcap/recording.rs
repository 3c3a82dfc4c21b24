//! The files of a recording, and the messages of one topic in them.

use super::message::Reading;
use crate::input::fault::Fault;
use ::mcap::io::MessageReader;
use ::mcap::sans_io::LinearReaderOptions;
use ::mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use ::mcap::{McapError, Message, Summary};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::{Path, PathBuf};

/// The largest message: a frame of 8K in four channels of 16 bits.
const MOST_BYTES: usize = 512 << 20;

/// The largest record of what stands at the end of a file.
const MOST_SUMMARY_BYTES: usize = 64 << 20;

/// The messages of one file in order.
type Messages = MessageReader<BufReader<File>>;

/// Opens one file from its beginning. Its end is not looked at: a recording that was cut off is read as far as it goes.
pub(super) fn open(path: &Path) -> Result<Messages, Fault> {
    let file = BufReader::with_capacity(1 << 16, File::open(path)?);
    let options = LinearReaderOptions::default().with_record_length_limit(MOST_BYTES).with_validate_chunk_crcs(true);
    Ok(MessageReader::new_with_options(file, options))
}

/// What is wrong with a file.
pub(super) fn fault(error: &McapError) -> Fault {
    match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => {
            Fault::malformed("the recording is cut off; what was before is read")
        }
        other => Fault::malformed(other.to_string()),
    }
}

/// A topic with images.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Topic {
    pub reading: Reading,
    pub messages: u64,
}

/// What is in the files.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// Topics with images.
    pub images: BTreeMap<String, Topic>,
    /// All others.
    pub others: Vec<String>,
    /// Whether all files could be read to their ends.
    pub is_whole: bool,
}

/// What stands at the end of a file that was closed properly: its channels and how many messages they have.
fn summary(path: &Path) -> Result<Option<Summary>, Fault> {
    let mut file = File::open(path)?;
    let options = SummaryReaderOptions::default().with_record_length_limit(MOST_SUMMARY_BYTES);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(SummaryReadEvent::ReadRequest(need)) => {
                let count = file.read(reader.insert(need.min(MOST_SUMMARY_BYTES)))?;
                reader.notify_read(count);
            }
            Ok(SummaryReadEvent::SeekRequest(to)) => match file.seek(to) {
                Ok(position) => reader.notify_seeked(position),
                // A file too short to have an end.
                Err(_) => return Ok(None),
            },
            Err(_) => return Ok(None),
        }
    }
    Ok(reader.finish().filter(|summary| summary.stats.is_some()))
}

/// Looks through the files: at what stands at their ends, or, where that is missing, at all of them once.
pub(super) fn look_through(files: &[PathBuf]) -> Result<Contents, Fault> {
    let mut contents = Contents { is_whole: true, ..Contents::default() };
    for path in files {
        if let Some(summary) = summary(path)? {
            contents.add_summary(&summary);
            continue;
        }
        for message in open(path)? {
            match message {
                Ok(message) => contents.add(&message),
                // What is behind it cannot be told apart from rubbish.
                Err(_) => {
                    contents.is_whole = false;
                    break;
                }
            }
        }
    }
    Ok(contents)
}

impl Contents {
    fn add_summary(&mut self, summary: &Summary) {
        let counts = summary.stats.as_ref().map(|stats| &stats.channel_message_counts);
        for (id, channel) in &summary.channels {
            let messages = counts.and_then(|counts| counts.get(id)).copied().unwrap_or(0);
            match channel.schema.as_ref().and_then(|schema| Reading::of(&schema.name, &channel.message_encoding)) {
                Some(reading) if messages > 0 => {
                    let topic = self.images.entry(channel.topic.clone()).or_insert(Topic { reading, messages: 0 });
                    topic.messages += messages;
                }
                _ => self.others.push(channel.topic.clone()),
            }
        }
    }

    fn add(&mut self, message: &Message<'_>) {
        let channel = &message.channel;
        if let Some(topic) = self.images.get_mut(&channel.topic) {
            topic.messages += 1;
        } else if let Some(reading) = reading(message) {
            self.images.insert(channel.topic.clone(), Topic { reading, messages: 1 });
        } else if !self.others.contains(&channel.topic) && self.others.len() < 1000 {
            self.others.push(channel.topic.clone());
        }
    }

    /// The topic that is asked for, or the only one there is.
    pub fn choose(&self, asked: Option<&str>) -> Result<(String, Topic), String> {
        let list = |names: Vec<&str>| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let images = || list(self.images.keys().map(String::as_str).collect());
        match (asked, self.images.iter().next()) {
            (Some(name), _) => match self.images.get(name) {
                Some(topic) => Ok((name.to_owned(), topic.clone())),
                None => Err(format!("it has no images under the topic {name}; topics with images: {}", images())),
            },
            (None, Some((name, topic))) if self.images.len() == 1 => Ok((name.clone(), topic.clone())),
            (None, Some(_)) => {
                Err(format!("it has several topics with images; name one, as in FILE?topic=NAME: {}", images()))
            }
            (None, None) => Err(format!(
                "it has no images (sensor_msgs/Image, sensor_msgs/CompressedImage); its topics: {}",
                list(self.others.iter().map(String::as_str).collect())
            )),
        }
    }
}

/// How the images of a message's channel are read, where they are some.
pub(super) fn reading(message: &Message<'_>) -> Option<Reading> {
    let schema = message.channel.schema.as_ref()?;
    Reading::of(&schema.name, &message.channel.message_encoding)
}

/// The files of a bag's folder in their order; `None` for a folder that is no bag.
pub(super) fn files_of(folder: &Path) -> Option<Result<Vec<PathBuf>, String>> {
    let metadata = std::fs::read_to_string(folder.join("metadata.yaml")).ok()?;
    if !metadata.contains("rosbag2_bagfile_information") {
        return None;
    }
    // The list of files is in the order of their recording: `- NAME.mcap`.
    let named =
        metadata.lines().filter_map(|line| line.trim().strip_prefix("- ")).map(|name| name.trim_matches(['"', '\'']));
    let mut files: Vec<PathBuf> = Vec::new();
    for name in named.filter(|name| name.ends_with(".mcap")) {
        // A name does not lead out of the folder.
        let path = Path::new(name).file_name().map(|name| folder.join(name));
        files.extend(path.filter(|path| path.is_file() && !files.contains(path)));
    }
    Some(if files.is_empty() {
        Err("it is a bag without MCAP files; convert it, for example by `ros2 bag convert` or `rosbags-convert --dst-storage mcap`"
            .to_owned())
    } else {
        Ok(files)
    })
}
