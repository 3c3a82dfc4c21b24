//! What the tests of sessions and sinks share.
#![allow(dead_code, clippy::unwrap_used, reason = "not every test uses everything; a test may panic")]

use pursuit::geometry::{BBox, Size};
use pursuit::imaging::{Frame, Image, Pixels};
use pursuit::media::input::StopHandle;
use pursuit::media::{MediaError, Source, SourceInfo};
use pursuit::sinks::{Moment, Sink};
use pursuit::tracking::many::Elapsed;
use pursuit::tracking::{Estimate, Forecast, MultiTracker, Recipe, Result, TargetId, Track, TrackState, TrackingError};
use pursuit::{Record, RunError};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

pub fn at(x: f64) -> BBox {
    BBox::from_ltwh(x, 10.0, 8.0, 8.0)
}

/// Blank frames, 40 ms apart, that can be entered anywhere; it breaks off where told.
pub struct Book {
    pub info: SourceInfo,
    pub next: u64,
    pub broken_at: Option<u64>,
}

pub fn book(count: u64) -> Book {
    let (fps, frame_count) = (Some(25.0), Some(count));
    let info = SourceInfo { fps, frame_count, seekable: true, ..SourceInfo::new("book", Size::new(64, 48), "test") };
    Book { info, next: 0, broken_at: None }
}

pub fn blank(index: u64) -> Frame {
    Frame::new(index, index as f64 * 0.04, Pixels::Gray8(Image::filled(64, 48, 30).unwrap().into()))
}

impl Source for Book {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> pursuit::media::Result<Option<Frame>> {
        if self.broken_at == Some(self.next) {
            return Err(MediaError::Broken { name: "book".into(), frame: self.next, reason: "torn".into() });
        }
        if Some(self.next) >= self.info.frame_count {
            return Ok(None);
        }
        self.next += 1;
        Ok(Some(blank(self.next - 1)))
    }

    fn seek(&mut self, index: u64) -> pursuit::media::Result<()> {
        self.info.check_seek(index)?;
        self.next = index;
        Ok(())
    }
}

/// A camera: frames come when the test sends them; stopping it hangs up.
pub struct Camera {
    info: SourceInfo,
    frames: Receiver<Frame>,
    hang_up: Arc<Mutex<Option<Sender<Frame>>>>,
}

/// The camera and a clone of what hangs up.
pub fn camera() -> (Camera, Sender<Frame>) {
    let (sender, frames) = channel();
    let kept = Arc::new(Mutex::new(None));
    (
        Camera {
            info: SourceInfo { live: true, frame_count: None, seekable: false, ..book(1).info },
            frames,
            hang_up: kept,
        },
        sender,
    )
}

impl Source for Camera {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> pursuit::media::Result<Option<Frame>> {
        loop {
            match self.frames.recv_timeout(std::time::Duration::from_millis(5)) {
                Ok(frame) => return Ok(Some(frame)),
                Err(_) if self.hang_up.lock().unwrap().is_some() => return Ok(None),
                Err(_) => {}
            }
        }
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let hang_up = self.hang_up.clone();
        Some(StopHandle::new(move || *hang_up.lock().unwrap() = Some(channel().0)))
    }
}

/// What was asked of the targets, in words.
pub type Asked = Arc<Mutex<Vec<String>>>;

/// Targets that stay where they were put; target 2 is lost, target 3 is still sought.
#[derive(Default)]
pub struct Still {
    pub targets: Vec<(TargetId, BBox)>,
    pub last: u64,
    pub asked: Asked,
}

impl Still {
    fn find(&mut self, id: TargetId) -> Result<usize> {
        let at = self.targets.iter().position(|t| t.0 == id);
        at.ok_or(TrackingError::UnknownTarget { id: id.0 })
    }

    fn say(&self, what: String) {
        self.asked.lock().unwrap().push(what);
    }
}

impl MultiTracker for Still {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        tracks.clear();
        self.say(format!("step {}", frame.index()));
        for (id, bbox) in &self.targets {
            let mut estimate = Estimate::started(frame.time_s(), *bbox, 0.5);
            if id.0 == 2 {
                estimate.state = TrackState::Lost;
            }
            let estimate = Some(estimate).filter(|_| id.0 != 3);
            tracks.push(Track {
                id: *id,
                estimate,
                started: false,
                elapsed: Elapsed { wall_ms: 2.0, thread_ms: 1.0 },
                class: None,
                detection: None,
            });
        }
        Ok(())
    }

    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        self.last += 1;
        self.targets.push((TargetId(self.last), bbox));
        self.say(format!("add {} by {} on {}", self.last, recipe.name(), frame.index()));
        Ok(TargetId(self.last))
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        let at = self.find(id)?;
        self.targets.remove(at);
        Ok(())
    }

    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        let at = self.find(id)?;
        self.targets[at].1 = bbox;
        self.say(format!("reinit {id} on {}", frame.index()));
        Ok(())
    }

    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        self.say(format!("change {} to {}", id.map_or("all".into(), |i| i.to_string()), changes.to_string().trim()));
        Ok(())
    }

    /// Everything is about to go to the right, 10 px a second.
    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        let target = self.targets.iter().find(|t| t.0 == id).ok_or(TrackingError::UnknownTarget { id: id.0 })?;
        let bbox = target.1.translated(10.0 * seconds, 0.0);
        Ok(Forecast { time_s: seconds, bbox, covariance: None, velocity: None })
    }

    fn ids(&self) -> Vec<TargetId> {
        self.targets.iter().map(|t| t.0).collect()
    }

    fn save(&self) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }
}

/// What a [`Memory`] sink took: the number of each frame with its records; `None` for its end.
pub type Taken = Arc<Mutex<Vec<Option<(u64, Vec<Record>)>>>>;

/// Keeps what it is given; fails where told.
#[derive(Default)]
pub struct Memory {
    pub taken: Taken,
    pub fails_at: Option<u64>,
    pub fails_to_finish: bool,
}

impl Sink for Memory {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let frame = moment.frame.index();
        if self.fails_at == Some(frame) {
            return Err(full("disk"));
        }
        self.taken.lock().unwrap().push(Some((frame, moment.records.to_vec())));
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.taken.lock().unwrap().push(None);
        if self.fails_to_finish { Err(full("end")) } else { Ok(()) }
    }
}

pub fn full(path: &str) -> RunError {
    RunError::output(PathBuf::from(path))(std::io::Error::other("full"))
}
