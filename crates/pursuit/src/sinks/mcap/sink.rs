use super::cdr;
use crate::RunError;
use crate::sinks::{Moment, Sink, create, jsonl_object};
use ::mcap::records::MessageHeader;
use ::mcap::{McapError, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Where the detections are.
const DETECTIONS: &str = "/pursuit/detections";
/// Where the state of every target is, the lost ones too.
const STATES: &str = "/pursuit/states";
const DETECTION_ARRAY: &[u8] = include_bytes!("detection_array.msg");
const STATE_SCHEMA: &[u8] = br#"{"type":"object","properties":{"targets":{"type":"array","items":{"type":"object"}}}}"#;

/// Frames gathered before they are written as one chunk; a crash loses at most these (the CSV loses none).
const FRAMES_A_CHUNK: u32 = 100;

/// Writes `trajectory.mcap`: the targets in the picture as `vision_msgs/msg/Detection2DArray`, and what is known of all of them, those
/// that are lost too, as JSON. Times are those of the frames.
pub struct McapSink {
    path: PathBuf,
    writer: Option<Writer<BufWriter<File>>>,
    channels: [u16; 2],
    sequence: u32,
}

impl McapSink {
    /// Creates the file.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn create(path: &Path) -> Result<Self, RunError> {
        let failed = |e: McapError| RunError::output(path)(std::io::Error::other(e));
        let options = WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(concat!("pursuit ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(BufWriter::new(create(path)?)).map_err(failed)?;
        let none = BTreeMap::new();
        let of_ros =
            writer.add_schema("vision_msgs/msg/Detection2DArray", "ros2msg", DETECTION_ARRAY).map_err(failed)?;
        let of_states = writer.add_schema("pursuit.States", "jsonschema", STATE_SCHEMA).map_err(failed)?;
        let detections = writer.add_channel(of_ros, DETECTIONS, "cdr", &none).map_err(failed)?;
        let states = writer.add_channel(of_states, STATES, "json", &none).map_err(failed)?;
        Ok(Self { path: path.to_path_buf(), writer: Some(writer), channels: [detections, states], sequence: 0 })
    }
}

impl Sink for McapSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let log_time = (moment.frame.time_s().max(0.0) * 1e9).round() as u64;
        let states: Vec<_> = moment.records.iter().map(jsonl_object).collect();
        let states =
            serde_json::json!({ "frame": moment.frame.index(), "time_s": moment.frame.time_s(), "targets": states });
        let messages = [cdr::detections(log_time, moment.records), states.to_string().into_bytes()];
        for (channel_id, message) in self.channels.into_iter().zip(messages) {
            let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
            let written = writer.write_to_known_channel(&header, &message);
            written.map_err(|e| RunError::output(&self.path)(std::io::Error::other(e)))?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        if self.sequence.is_multiple_of(FRAMES_A_CHUNK) {
            writer.flush().map_err(|e| RunError::output(&self.path)(std::io::Error::other(e)))?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        match self.writer.take().map(|mut writer| writer.finish()) {
            Some(Err(e)) => Err(RunError::output(&self.path)(std::io::Error::other(e))),
            _ => Ok(()),
        }
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Record;
    use ::mcap::io::MessageReader;
    use pursuit_geometry::BBox;
    use pursuit_imaging::{Frame, Image};
    use pursuit_tracking::{Estimate, TargetId, TrackState};
    use std::sync::Arc;

    #[test]
    fn lost_targets_are_states_and_no_detections() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mcap");
        let mut sink = McapSink::create(&path).unwrap();
        let frame = Arc::new(Frame::new(3, 0.12, Image::from_fn(4, 4, |_, _| 0_u8).unwrap()));
        let record = |target, state| {
            let estimate = Estimate { state, ..Estimate::started(0.12, BBox::from_ltwh(10.0, 20.0, 30.0, 40.0), 0.75) };
            Record {
                frame: 3,
                time_s: 0.12,
                target: TargetId(target),
                class: None,
                estimate: Some(estimate),
                update_ms: None,
            }
        };
        let records = [record(1, TrackState::Tracking), record(2, TrackState::Lost)];
        sink.write(&Moment::recorded(&frame, &records)).unwrap();
        sink.finish().unwrap();
        sink.finish().unwrap();
        let read = MessageReader::new(File::open(&path).unwrap()).collect::<Result<Vec<_>, _>>().unwrap();
        assert_eq!(read.len(), 2);
        let (detections, states) = (&read[0], &read[1]);
        assert_eq!((detections.channel.topic.as_str(), detections.log_time), (DETECTIONS, 120_000_000));
        // Header, length of the array, and the one that is in the picture: its id is the last text.
        assert_eq!(detections.data[4 + 20..][..4], [1, 0, 0, 0]);
        assert_eq!(detections.data[detections.data.len() - 2..], [b'1', 0]);
        let states: serde_json::Value = serde_json::from_slice(&states.data).unwrap();
        assert_eq!(states["targets"][1]["state"], "lost");
        assert_eq!(states["targets"][0]["box"], serde_json::json!([10.0, 20.0, 30.0, 40.0]));
    }

    #[test]
    fn a_crash_loses_at_most_one_chunk() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mcap");
        let mut sink = McapSink::create(&path).unwrap();
        for k in 0..FRAMES_A_CHUNK + 20 {
            let frame = Frame::new(u64::from(k), f64::from(k), Image::from_fn(4, 4, |_, _| 0_u8).unwrap());
            sink.write(&Moment::recorded(&Arc::new(frame), &[])).unwrap();
        }
        // What is in the file before it is finished.
        let read = MessageReader::new(File::open(&path).unwrap()).map_while(Result::ok).count();
        assert_eq!(read, 2 * FRAMES_A_CHUNK as usize);
    }
}
