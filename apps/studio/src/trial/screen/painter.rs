use super::packet::{Kind, Packet};
use super::viewer::Wish;
use super::{PICTURE_EVERY, Screen};
use pursuit::Frame;
use pursuit::geometry::Size;
use pursuit::imaging::{Image, Rgb8};
use pursuit::media::output::{WireEncoder, WirePicture, encode_jpeg, h264_for_wire};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Of JPEG, from 1 to 100.
const QUALITY: u8 = 82;
/// Wider pictures are made smaller before they are sent; boxes stay in the pixels of the input.
const MOST_COLUMNS: usize = 1920;
/// Key frames that somebody asked for are never nearer to each other: those who lose packets all the time are not to make
/// the video larger for everybody.
const KEY_EVERY: Duration = Duration::from_millis(400);
/// Pictures a second that the video states.
const RATE: f64 = 30.0;

/// Makes pictures of what is shown, on a thread of its own.
///
/// While a run goes on, video: a tenth of the bytes. Of what stands still, a JPEG: it is sharp at once, can be made sense of
/// without what came before, and no decoder holds it back until the next picture comes.
pub(super) struct Painter {
    screen: Arc<Screen>,
    /// The frame painted last as JPEG.
    jpeg: Option<(Arc<Frame>, Vec<u8>)>,
    video: Video,
}

#[derive(Default)]
struct Video {
    encoder: Option<(Size, Box<dyn WireEncoder>)>,
    /// Pictures of this size cannot be encoded.
    beyond: Option<Size>,
    picture: Option<Image<Rgb8>>,
    /// The frame that was encoded last.
    frame: Option<Arc<Frame>>,
    key_at: Option<Instant>,
    codec: String,
}

impl Painter {
    pub fn new(screen: Arc<Screen>) -> Self {
        Self { screen, jpeg: None, video: Video::default() }
    }

    /// Until the screen is closed.
    pub fn paint(mut self) {
        let mut painted = 0;
        while let Some(shown) = self.screen.next(&mut painted) {
            let (began, facts) = (Instant::now(), (shown.facts)());
            if self.screen.looks(Wish::Stills) {
                let packet = self.still(facts.clone(), &shown.frame, Kind::Still);
                self.screen.stills.send_replace(Some(packet));
            }
            if self.screen.looks(Wish::Video) {
                let packet = match shown.running {
                    true => self.moving(facts, &shown.frame),
                    false => self.still(facts, &shown.frame, Kind::Still),
                };
                // It fails when nobody looks any more.
                let _ = self.screen.video.send(Some(packet));
            }
            std::thread::sleep(PICTURE_EVERY.saturating_sub(began.elapsed()));
        }
        self.screen.slot().shown = None;
        self.screen.stills.send_replace(None);
        let _ = self.screen.video.send(None);
    }

    fn still(&mut self, facts: Value, frame: &Arc<Frame>, kind: Kind) -> Arc<Packet> {
        // The same frame is shown again with other facts.
        let same = self.jpeg.take().filter(|(last, _)| Arc::ptr_eq(last, frame));
        let made = same.unwrap_or_else(|| (frame.clone(), jpeg(frame).unwrap_or_default()));
        let packet = Packet::new(facts, about(frame, "jpeg"), &made.1, kind);
        self.jpeg = Some(made);
        Arc::new(packet)
    }

    /// The next picture of the video; a JPEG in its place where there can be none.
    fn moving(&mut self, facts: Value, frame: &Arc<Frame>) -> Arc<Packet> {
        if self.video.frame.as_ref().is_some_and(|last| Arc::ptr_eq(last, frame)) {
            return Arc::new(Packet::new(facts, about(frame, "none"), &[], Kind::Delta));
        }
        let wanted = self.screen.key_wanted.load(Ordering::Relaxed);
        let key = wanted && self.video.key_at.is_none_or(|at| at.elapsed() >= KEY_EVERY);
        let Some(picture) = self.video.encode(frame, key) else { return self.still(facts, frame, Kind::Key) };
        if picture.keyframe {
            self.screen.key_wanted.store(false, Ordering::Relaxed);
        }
        let mut about = about(frame, "h264");
        (about["key"], about["codec"]) = (picture.keyframe.into(), self.video.codec.as_str().into());
        if let Some(Size { width, height }) = self.video.picture.as_ref().map(Image::size) {
            (about["width"], about["height"]) = (width.into(), height.into());
        }
        let kind = if picture.keyframe { Kind::Key } else { Kind::Delta };
        Arc::new(Packet::new(facts, about, &picture.data, kind))
    }
}

impl Video {
    /// `None` where it cannot be done: this build has no encoder, or the pictures are too large for it.
    fn encode(&mut self, frame: &Arc<Frame>, key: bool) -> Option<WirePicture> {
        let picture = match &mut self.picture {
            Some(picture) => picture,
            none => none.insert(Image::filled(1, 1, [0; 3]).ok()?),
        };
        if !reduce(frame, picture) || self.beyond == Some(picture.size()) {
            return None;
        }
        let size = picture.size();
        if self.encoder.as_ref().is_none_or(|(own, _)| *own != size) {
            self.encoder = None;
            match h264_for_wire(size, RATE) {
                Ok(encoder) => self.encoder = Some((size, encoder)),
                Err(why) => {
                    tracing::debug!("pictures go out as JPEG: {why}");
                    self.beyond = Some(size);
                    return None;
                }
            }
        }
        match self.encoder.as_mut()?.1.encode(picture.view(), key) {
            Ok(picture) => {
                self.frame = Some(frame.clone());
                if picture.keyframe {
                    self.key_at = Some(Instant::now());
                }
                if let Some(codec) = &picture.codec {
                    self.codec.clone_from(codec);
                }
                Some(picture)
            }
            Err(why) => {
                tracing::debug!("pictures go out as JPEG: {why}");
                (self.encoder, self.frame, self.beyond) = (None, None, Some(size));
                None
            }
        }
    }
}

fn about(frame: &Frame, kind: &str) -> Value {
    json!({ "kind": kind, "frame": frame.index(), "time_s": frame.time_s() })
}

/// The picture, made smaller by a whole factor where it is wide; whether it could be made.
fn reduce(frame: &Frame, picture: &mut Image<Rgb8>) -> bool {
    let size = frame.size();
    let step = size.width.div_ceil(MOST_COLUMNS).max(1);
    // Converted for this alone: frames that are kept do not keep their colour as well.
    frame.reduced_color([0, 0, size.width, size.height], step, picture).unwrap_or(false)
}

pub(crate) fn jpeg(frame: &Frame) -> Option<Vec<u8>> {
    let mut picture = Image::filled(1, 1, [0; 3]).ok()?;
    if reduce(frame, &mut picture) { encode_jpeg(picture.view(), QUALITY).ok() } else { None }
}
