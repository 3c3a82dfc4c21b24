//! What is in a recording, and in which files.

#[cfg(feature = "db3")]
use super::database::Database;
use super::records::{Channel, Gap, Message, Records};
use crate::input::fault::Fault;
use crate::input::folder::natural_order;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Topics that a message names at most.
const MOST_NAMED: usize = 20;

/// What mends a bag whose files are not read.
#[cfg(not(feature = "db3"))]
const CONVERT: &str = crate::input::sniff::WITHOUT_DB3;
#[cfg(feature = "db3")]
const CONVERT: &str = "files that were compressed as a whole are to be decompressed, for example by `rosbags-convert --src BAG --dst NEW`";

/// The largest `metadata.yaml` that is looked at.
const MOST_METADATA_BYTES: u64 = 16 << 20;

/// Files of a bag end so.
const ENDINGS: &[&str] = if cfg!(feature = "db3") { &["mcap", "db3"] } else { &["mcap"] };

/// One file that is read.
pub(super) enum Reader {
    Mcap(Box<Records>),
    #[cfg(feature = "db3")]
    Database(Box<Database>),
}

impl Reader {
    /// From the beginning of a file on.
    pub fn open(path: &Path) -> Result<Self, Gap> {
        #[cfg(feature = "db3")]
        if Database::is_one(path)? {
            return Ok(Self::Database(Box::new(Database::open(path)?)));
        }
        Ok(Self::Mcap(Box::new(Records::open(path)?)))
    }

    /// The next message of a channel that is `wanted`.
    pub fn next(&mut self, wanted: impl Fn(&Channel) -> bool) -> Result<Option<Message<'_>>, Gap> {
        match self {
            Self::Mcap(records) => records.next(wanted),
            #[cfg(feature = "db3")]
            Self::Database(database) => database.next(wanted),
        }
    }
}

/// What is in the files.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// Topics with images, and how many each has.
    pub images: BTreeMap<String, u64>,
    others: BTreeSet<String>,
    /// Whether all of it was seen; the numbers are of no use otherwise.
    pub is_whole: bool,
}

/// Looks through the files: at what stands at their ends, or, where that is missing, at their messages until one of the topic that is
/// asked for has come.
pub(super) fn look_through(files: &[PathBuf], asked: Option<&str>) -> Result<Contents, Fault> {
    let mut contents = Contents { is_whole: true, ..Contents::default() };
    for path in files {
        #[cfg(feature = "db3")]
        if Database::is_one(path)? {
            contents.add_database(&Database::open(path).map_err(|gap| gap.fault)?);
            continue;
        }
        if let Some(summary) = Records::summary(path)? {
            for (id, channel) in &summary.channels {
                let count = summary.counts.as_ref().and_then(|counts| counts.get(id)).copied().unwrap_or(0);
                contents.add(channel, count);
            }
            continue;
        }
        let mut records = Records::open(path)?;
        loop {
            match records.next(|_| true) {
                Ok(Some(message)) => contents.add(message.channel, 1),
                Ok(None) => break,
                Err(gap) if gap.goes_on => {}
                // What is behind it cannot be told apart from rubbish.
                Err(_) => {
                    contents.is_whole = false;
                    break;
                }
            }
            if asked.is_some_and(|asked| contents.images.contains_key(asked)) {
                contents.is_whole = false;
                return Ok(contents);
            }
        }
    }
    Ok(contents)
}

impl Contents {
    #[cfg(feature = "db3")]
    fn add_database(&mut self, database: &Database) {
        let (counts, is_whole) = database.counts();
        self.is_whole &= is_whole;
        for (id, channel) in &database.channels {
            self.add(channel, counts.get(id).copied().unwrap_or(0));
        }
    }

    fn add(&mut self, channel: &Channel, count: u64) {
        match self.images.get_mut(&channel.topic) {
            Some(images) => *images = images.saturating_add(count),
            None if channel.reading.is_some() && count > 0 => {
                self.images.insert(channel.topic.clone(), count);
            }
            None if self.others.len() <= MOST_NAMED => {
                self.others.insert(channel.topic.clone());
            }
            None => {}
        }
    }

    /// The topic that is asked for, or the only one there is.
    pub fn choose(&self, asked: Option<&str>) -> Result<(String, u64), String> {
        let images = || list(self.images.keys());
        match (asked, self.images.iter().next()) {
            (Some(name), _) => match self.images.get(name) {
                Some(count) => Ok((name.to_owned(), *count)),
                None => Err(format!("it has no images under the topic {name}; topics with images: {}", images())),
            },
            (None, Some((name, count))) if self.images.len() == 1 => Ok((name.clone(), *count)),
            (None, Some(_)) => {
                Err(format!("it has several topics with images; name one, as in FILE?topic=NAME: {}", images()))
            }
            (None, None) => Err(format!(
                "it has no images (sensor_msgs/Image, sensor_msgs/CompressedImage); its topics: {}",
                list(self.others.iter())
            )),
        }
    }
}

/// The first of some names, in words.
fn list<'a>(names: impl ExactSizeIterator<Item = &'a String>) -> String {
    let others = if names.len() > MOST_NAMED { " and others" } else { "" };
    let named: Vec<&str> = names.take(MOST_NAMED).map(String::as_str).collect();
    if named.is_empty() { "none".to_owned() } else { format!("{}{others}", named.join(", ")) }
}

/// The files of a bag's folder in their order; `None` for a folder that is no bag.
pub(super) fn files_of(folder: &Path) -> Option<Result<Vec<PathBuf>, String>> {
    match metadata(folder) {
        Some(metadata) if metadata.contains("rosbag2_bagfile_information") => Some(listed(folder, &metadata)),
        // A recorder that was killed has not written it yet.
        _ => unlisted(folder).map(Ok),
    }
}

fn metadata(folder: &Path) -> Option<String> {
    let mut text = String::new();
    File::open(folder.join("metadata.yaml")).ok()?.take(MOST_METADATA_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
}

/// The files that `metadata.yaml` lists in the order of their recording: `- NAME.mcap`.
fn listed(folder: &Path, metadata: &str) -> Result<Vec<PathBuf>, String> {
    let entries = metadata.lines().filter_map(|line| line.trim().strip_prefix("- "));
    let names = entries.map(|name| name.trim().trim_matches(['"', '\''])).filter(|name| !name.contains(": "));
    let mut files: Vec<PathBuf> = Vec::new();
    for name in names {
        // A name does not lead out of the folder.
        let Some(path) = Path::new(name).file_name().map(|name| folder.join(name)) else { continue };
        if !is_part(&path) {
            continue;
        }
        if !path.is_file() {
            return Err(format!(
                "its metadata.yaml lists {name}, which is not there; copy it, or name one of its files"
            ));
        }
        if !files.contains(&path) {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(format!("it is a bag without files that this build reads ({}); {CONVERT}", ENDINGS.join(", ")));
    }
    Ok(files)
}

fn is_part(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// The files of a bag in a folder in which nothing else is to be looked at: no list, no images.
fn unlisted(folder: &Path) -> Option<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).ok()?.flatten() {
        let path = entry.path();
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("csv" | "jpg" | "jpeg" | "png") => return None,
            _ if is_part(&path) => files.push(path),
            _ => {}
        }
    }
    files.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    (!files.is_empty()).then_some(files)
}
