//! MCAP files and ROS 2 bags, written here by the library that others use.
#![cfg(feature = "mcap")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "a test may panic")]

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use pursuit_media::{MediaError, OpenOptions, Source, open};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// The bytes of a message in CDR.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn number<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
        self
    }

    fn u32(self, value: u32) -> Self {
        self.number(value.to_le_bytes())
    }

    fn bytes(self, bytes: &[u8]) -> Self {
        let mut all = self.u32(bytes.len() as u32);
        all.0.extend(bytes);
        all
    }

    fn header(self, seconds: f64) -> Self {
        let nanoseconds = (seconds.fract() * 1e9).round() as u32;
        self.u32(seconds as u32).u32(nanoseconds).bytes(b"camera\0")
    }

    fn whole(self) -> Vec<u8> {
        [&[0, 1, 0, 0], &self.0[..]].concat()
    }
}

/// A grey picture whose pixels say which it is.
fn image(k: u32, stamp_s: f64) -> Vec<u8> {
    let data: Vec<u8> = (0..12 * 8).map(|i| (k * 10 + i % 7) as u8).collect();
    Cdr::default().header(stamp_s).u32(8).u32(12).bytes(b"mono8\0").number([0]).u32(12).bytes(&data).whole()
}

struct Bag {
    compression: Option<Compression>,
    topics: Vec<&'static str>,
    stamped: bool,
    /// Which messages are no images, though their channel says so.
    rubbish: Vec<u32>,
}

impl Default for Bag {
    fn default() -> Self {
        Self { compression: None, topics: vec!["/camera/image"], stamped: true, rubbish: Vec::new() }
    }
}

impl Bag {
    fn write(&self, path: &Path, frames: std::ops::Range<u32>) {
        let options = WriteOptions::new().compression(self.compression).chunk_size(Some(600)).profile("ros2");
        self.write_with(options, path, frames);
    }

    fn write_with(&self, options: WriteOptions, path: &Path, frames: std::ops::Range<u32>) {
        let mut writer = options.create(BufWriter::new(File::create(path).unwrap())).unwrap();
        let schema = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", b"").unwrap();
        let other = writer.add_schema("std_msgs/msg/String", "ros2msg", b"").unwrap();
        let none = BTreeMap::new();
        let chatter = writer.add_channel(other, "/chatter", "cdr", &none).unwrap();
        let channels: Vec<u16> =
            self.topics.iter().map(|topic| writer.add_channel(schema, topic, "cdr", &none).unwrap()).collect();
        for k in frames {
            let log_time = 5_000_000_000 + u64::from(k) * 50_000_000;
            let stamp_s = if self.stamped { 100.0 + f64::from(k) * 0.04 } else { 0.0 };
            let header = |channel_id| MessageHeader { channel_id, sequence: k, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header(chatter), &Cdr::default().bytes(b"hello\0").whole()).unwrap();
            for channel in &channels {
                let message = if self.rubbish.contains(&k) { vec![0, 1, 0, 0, 7] } else { image(k, stamp_s) };
                writer.write_to_known_channel(&header(*channel), &message).unwrap();
            }
        }
        writer.finish().unwrap();
    }
}

fn opened(input: &str) -> Box<dyn Source> {
    open(input, &OpenOptions::default()).unwrap()
}

/// Number, time and first pixel of every frame, and what ended it.
fn read(source: &mut dyn Source) -> (Vec<(u64, f64, u8)>, Vec<MediaError>) {
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => frames.push((frame.index(), frame.time_s(), frame.gray().row(0)[0])),
            Ok(None) => return (frames, errors),
            Err(error) => errors.push(error),
        }
    }
}

#[test]
fn images_come_with_the_times_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        Bag { compression, ..Bag::default() }.write(&path, 0..10);
        let mut source = opened(path.to_str().unwrap());
        let info = source.info().clone();
        assert_eq!((info.size.width, info.size.height, info.frame_count, info.seekable), (12, 8, Some(10), true));
        assert!((info.fps.unwrap() - 25.0).abs() < 1e-3);
        let (frames, errors) = read(&mut *source);
        assert!(errors.is_empty());
        assert_eq!(frames.len(), 10);
        for (k, (index, time_s, pixel)) in frames.iter().enumerate() {
            assert_eq!((*index, usize::from(*pixel)), (k as u64, k * 10));
            assert!((time_s - k as f64 * 0.04).abs() < 1e-6);
        }
        source.seek(7).unwrap();
        assert_eq!(source.next_frame().unwrap().unwrap().index(), 7);
        source.seek(2).unwrap();
        let frame = source.next_frame().unwrap().unwrap();
        assert!(frame.index() == 2 && (frame.time_s() - 0.08).abs() < 1e-6);
        assert!(source.seek(10).is_err());
    }
}

#[test]
fn without_stamps_the_recorder_says_when() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag { stamped: false, ..Bag::default() }.write(&path, 0..3);
    let (frames, _) = read(&mut *opened(path.to_str().unwrap()));
    assert!((frames[2].1 - 0.1).abs() < 1e-6);
}

#[test]
fn of_several_topics_one_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag { topics: vec!["/left", "/right"], ..Bag::default() }.write(&path, 0..3);
    let name = path.to_str().unwrap();
    assert_eq!(read(&mut *opened(&format!("{name}?topic=/right"))).0.len(), 3);
    for (input, says) in
        [(name.to_owned(), "FILE?topic=NAME: /left, /right"), (format!("{name}?topic=/up"), "/left, /right")]
    {
        let error = open(&*input, &OpenOptions::default()).err().unwrap().to_string();
        assert!(error.contains(says), "{error}");
    }
    Bag { topics: Vec::new(), ..Bag::default() }.write(&path, 0..3);
    let error = open(name, &OpenOptions::default()).err().unwrap().to_string();
    assert!(error.contains("no images") && error.contains("/chatter"), "{error}");
}

#[test]
fn a_cut_recording_is_read_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag::default().write(&path, 0..40);
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let mut source = opened(path.to_str().unwrap());
    assert_eq!(source.info().frame_count, None);
    let (frames, errors) = read(&mut *source);
    assert!((10..35).contains(&frames.len()), "{}", frames.len());
    assert!(matches!(&errors[..], [MediaError::Broken { .. }]), "{errors:?}");
}

#[test]
fn one_message_that_is_no_image_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag { rubbish: vec![0, 4], ..Bag::default() }.write(&path, 0..8);
    let (frames, errors) = read(&mut *opened(path.to_str().unwrap()));
    assert_eq!(frames.iter().map(|f| f.0).collect::<Vec<_>>(), [1, 2, 3, 5, 6, 7]);
    assert!(errors.len() == 2 && errors.iter().all(MediaError::is_damage));
}

#[test]
fn a_bag_in_several_files_is_one_input() {
    let folder = tempfile::tempdir().unwrap();
    let bag = Bag::default();
    bag.write(&folder.path().join("bag_0.mcap"), 0..5);
    bag.write(&folder.path().join("bag_1.mcap"), 5..9);
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - bag_0.mcap\n    - bag_1.mcap\n";
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let mut source = opened(folder.path().to_str().unwrap());
    assert_eq!(source.info().frame_count, Some(9));
    let (frames, errors) = read(&mut *source);
    assert!(errors.is_empty() && frames.len() == 9 && (frames[8].1 - 0.32).abs() < 1e-6);
    source.seek(6).unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().index(), 6);
    assert_eq!(read(&mut *opened(&format!("{}?topic=/camera/image", folder.path().display()))).0.len(), 4 + 5);
}

#[test]
fn a_bag_without_its_metadata_is_read_too() {
    let folder = tempfile::tempdir().unwrap();
    let bag = Bag::default();
    // Ten comes behind nine.
    for (name, frames) in [("bag_9.mcap", 0..4), ("bag_10.mcap", 4..7)] {
        bag.write(&folder.path().join(name), frames);
    }
    let (frames, errors) = read(&mut *opened(folder.path().to_str().unwrap()));
    assert!(errors.is_empty() && frames.len() == 7 && (frames[6].1 - 0.24).abs() < 1e-6);
}

#[test]
fn what_a_bag_lacks_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let metadata = folder.path().join("metadata.yaml");
    for (files, says) in
        [("- x.db3.zstd", "convert"), ("- gone.mcap", "lists gone.mcap"), ("- ../../etc/x.mcap", "not there")]
    {
        std::fs::write(&metadata, format!("rosbag2_bagfile_information:\n  relative_file_paths:\n  {files}\n"))
            .unwrap();
        let error = open(folder.path().to_str().unwrap(), &OpenOptions::default()).err().unwrap().to_string();
        assert!(error.contains(says), "{error}");
    }
    let database = folder.path().join("bag_0.db3");
    std::fs::write(&database, b"SQLite format 3\0and so on").unwrap();
    let error = open(database.to_str().unwrap(), &OpenOptions::default()).err().unwrap().to_string();
    assert!(cfg!(feature = "db3") || error.contains("ros2 bag convert"), "{error}");
}

#[test]
fn a_truth_beside_the_file_comes_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag::default().write(&path, 0..2);
    std::fs::write(folder.path().join("a.csv"), "index,x,y,w,h\n0,1,2,3,4\n1,2,2,3,4\n").unwrap();
    assert!(opened(path.to_str().unwrap()).info().truth_at(1).bbox().is_some());
}

#[test]
fn a_file_may_be_called_as_if_it_named_a_topic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap?topic=b");
    Bag::default().write(&path, 0..3);
    assert_eq!(read(&mut *opened(path.to_str().unwrap())).0.len(), 3);
}

#[test]
fn what_is_skipped_may_be_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag { rubbish: vec![2], ..Bag::default() }.write(&path, 0..6);
    let mut source = opened(path.to_str().unwrap());
    source.seek(4).unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert!(frame.index() == 4 && (frame.time_s() - 0.16).abs() < 1e-6);
}

#[test]
fn a_damaged_chunk_does_not_end_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    Bag::default().write(&path, 0..20);
    let mut bytes = std::fs::read(&path).unwrap();
    // The pixels of a picture: its second row repeats the first.
    let row: Vec<u8> = (0..12).map(|i| (70 + i % 7) as u8).collect();
    let at = bytes.windows(12).position(|window| window == row).unwrap();
    bytes[at + 5] ^= 64;
    std::fs::write(&path, &bytes).unwrap();
    let (frames, errors) = read(&mut *opened(path.to_str().unwrap()));
    assert_eq!(frames.len(), 20);
    assert!(errors.len() == 1 && errors[0].is_damage() && errors[0].to_string().contains("checksum"), "{errors:?}");
}

#[test]
fn a_summary_without_channels_is_no_summary() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let options = WriteOptions::new().compression(None).repeat_channels(false);
    Bag::default().write_with(options, &path, 0..5);
    let mut source = opened(path.to_str().unwrap());
    assert_eq!((source.info().frame_count, read(&mut *source).0.len()), (Some(5), 5));
}

#[test]
fn changed_bytes_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        Bag { compression, ..Bag::default() }.write(&path, 0..4);
        let whole = std::fs::read(&path).unwrap();
        let mut random = 12_345_u32;
        for _ in 0..400 {
            let mut bytes = whole.clone();
            for _ in 0..3 {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let at = (random >> 8) as usize % bytes.len();
                bytes[at] = (random >> 3) as u8;
            }
            std::fs::write(&path, &bytes).unwrap();
            if let Ok(mut source) = open(path.to_str().unwrap(), &OpenOptions::default()) {
                assert!(read(&mut *source).0.len() <= 4);
            }
        }
    }
}

#[cfg(feature = "db3")]
mod databases {
    use super::*;
    use rusqlite::Connection;

    /// A bag as ROS 2 recorded them up to the distribution Humble.
    fn write(path: &Path, count: u32) {
        let connection = Connection::open(path).unwrap();
        let tables = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
            CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
            CREATE INDEX timestamp_idx ON messages (timestamp ASC);
            INSERT INTO topics VALUES (1, '/chatter', 'std_msgs/msg/String', 'cdr', ''), (2, '/camera/image', 'sensor_msgs/msg/Image', 'cdr', '');
            BEGIN;";
        connection.execute_batch(tables).unwrap();
        let insert = |topic: i64, k: u32, data: Vec<u8>| {
            let time = 5_000_000_000 + i64::from(k) * 50_000_000;
            let sql = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
            connection.execute(sql, (topic, time, data)).unwrap();
        };
        for k in 0..count {
            insert(1, k, Cdr::default().bytes(b"hello\0").whole());
            insert(2, k, image(k, 100.0 + f64::from(k) * 0.04));
        }
        connection.execute_batch("COMMIT").unwrap();
    }

    #[test]
    fn a_bag_of_sqlite_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag_0.db3");
        write(&path, 10);
        let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - bag_0.db3\n";
        std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
        for input in [path.display().to_string(), folder.path().display().to_string()] {
            let mut source = opened(&format!("{input}?topic=/camera/image"));
            assert_eq!(source.info().frame_count, Some(10));
            let (frames, errors) = read(&mut *source);
            assert!(errors.is_empty() && frames.len() == 10 && frames[9] == (9, 0.36, 90), "{frames:?} {errors:?}");
            source.seek(6).unwrap();
            assert_eq!(source.next_frame().unwrap().unwrap().index(), 6);
            assert_eq!(opened(&input).info().size.width, 12);
        }
        let error = open(format!("{}?topic=/up", path.display()), &OpenOptions::default()).err().unwrap();
        assert!(error.to_string().contains("/camera/image"), "{error}");
    }

    #[test]
    fn a_cut_database_is_read_as_far_as_it_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.db3");
        write(&path, 400);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        let mut source = opened(path.to_str().unwrap());
        assert_eq!(source.info().frame_count, None);
        let (frames, errors) = read(&mut *source);
        assert!((100..300).contains(&frames.len()), "{} {errors:?}", frames.len());
        assert!(matches!(&errors[..], [MediaError::Broken { .. }]), "{errors:?}");
    }

    #[test]
    fn other_databases_are_no_bags() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("other.db");
        let tables = "CREATE TABLE topics(id); CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) SELECT id FROM n";
        Connection::open(&path).unwrap().execute_batch(tables).unwrap();
        let error = open(path.to_str().unwrap(), &OpenOptions::default()).err().unwrap().to_string();
        assert!(error.contains("no bag"), "{error}");
    }

    #[test]
    fn changed_bytes_of_databases_do_no_harm() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.db3");
        write(&path, 60);
        let whole = std::fs::read(&path).unwrap();
        let mut random = 12_345_u32;
        for _ in 0..400 {
            let mut bytes = whole.clone();
            for _ in 0..8 {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let at = (random >> 8) as usize % bytes.len();
                bytes[at] = (random >> 3) as u8;
            }
            std::fs::write(&path, &bytes).unwrap();
            if let Ok(mut source) = open(path.to_str().unwrap(), &OpenOptions::default()) {
                read(&mut *source);
            }
        }
    }
}
