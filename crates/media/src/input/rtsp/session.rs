use crate::input::cancel::Cancel;
use crate::input::fault::Fault;
use crate::input::source::StopHandle;
use futures_util::StreamExt;
use pursuit_address::Locator;
use retina::client::{Credentials, PlayOptions, SessionOptions, SetupOptions};
use retina::codec::CodecItem;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use tokio::sync::Notify;
use url::Url;

/// Samples that may wait to be decoded; what is more waits in the network.
const WAITING: usize = 32;
/// The longest message of a server that is passed on.
const LONGEST_REASON: usize = 200;

/// How the pictures of a stream are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Coding {
    /// With parameters before each picture that needs no other, and the length before each unit.
    H264,
    Jpeg,
}

/// One coded picture.
pub(super) struct Sample {
    pub data: Vec<u8>,
    /// Its time, in units of the stream's clock.
    pub time: i64,
    /// Whether it needs none before it.
    pub is_entry: bool,
    /// Whether packets were lost before it.
    pub lost: bool,
}

/// What is known before the first sample.
#[derive(Clone, Copy)]
struct Described {
    coding: Coding,
    clock_rate_hz: u32,
    fps: Option<f32>,
}

/// A connection to a camera, on a thread of its own: nothing outside of it is asynchronous.
pub(super) struct Session {
    described: Described,
    samples: Receiver<Result<Sample, Fault>>,
    stop: StopHandle,
}

impl Session {
    /// Connects, and lets the camera send.
    pub fn open(locator: &Locator, cancel: &Cancel) -> Result<Self, Fault> {
        let (announce, announced) = sync_channel(1);
        let (send, samples) = sync_channel(WAITING);
        let (stopped, locator) = (Arc::new(Notify::new()), locator.clone());
        let notify = stopped.clone();
        let stop = StopHandle::new(move || notify.notify_one());
        cancel.by(stop.clone());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let talk = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = stopped.notified() => {}
                    ended = talk(&locator, &announce, &send) => {
                        if let Err(fault) = ended {
                            // Whichever of the two is still listened to.
                            _ = announce.try_send(Err(fault.clone()));
                            _ = send.send(Err(fault));
                        }
                    }
                }
            });
        };
        std::thread::Builder::new().name("rtsp".to_owned()).spawn(talk)?;
        match announced.recv() {
            Ok(described) => Ok(Self { described: described?, samples, stop }),
            Err(_) => Err(Fault::malformed("the connection was given up")),
        }
    }

    pub const fn coding(&self) -> Coding {
        self.described.coding
    }

    /// Units of time in a second.
    pub fn clock_rate(&self) -> f64 {
        f64::from(self.described.clock_rate_hz.max(1))
    }

    pub fn fps(&self) -> Option<f64> {
        self.described.fps.map(f64::from).filter(|fps| fps.is_finite() && *fps > 0.0)
    }

    /// The next sample; `None` when the camera sends no more.
    pub fn next(&mut self) -> Result<Option<Sample>, Fault> {
        self.samples.recv().map_or(Ok(None), |sample| sample.map(Some))
    }

    pub fn stop_handle(&self) -> StopHandle {
        self.stop.clone()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.stop.stop();
    }
}

/// Speaks with the camera until it ends the stream, or nobody takes samples any more.
async fn talk(
    locator: &Locator,
    announce: &SyncSender<Result<Described, Fault>>,
    send: &SyncSender<Result<Sample, Fault>>,
) -> Result<(), Fault> {
    let said = |error: retina::Error| Fault::malformed(reason(locator, &error));
    let url = Url::parse(&locator.address()).map_err(|e| Fault::malformed(format!("it is no address ({e})")))?;
    let credentials = locator.credentials().map(|(username, password)| Credentials { username, password });
    let options = SessionOptions::default().creds(credentials).user_agent("pursuit".to_owned());
    let mut session = retina::client::Session::describe(url, options).await.map_err(said)?;
    let streams = session.streams();
    let video = streams.iter().position(|s| s.media() == "video");
    let video = video.ok_or_else(|| Fault::malformed("the camera offers no video"))?;
    let stream = &streams[video];
    let coding = match stream.encoding_name() {
        "h264" => Coding::H264,
        "jpeg" => Coding::Jpeg,
        other => return Err(Fault::unsupported(format!("RTSP with {}", other.to_uppercase()))),
    };
    let described = Described { coding, clock_rate_hz: stream.clock_rate_hz(), fps: stream.framerate() };
    session.setup(video, SetupOptions::default()).await.map_err(said)?;
    let playing = session.play(PlayOptions::default()).await.map_err(said)?;
    let mut items = playing.demuxed().map_err(said)?;
    if announce.send(Ok(described)).is_err() {
        return Ok(());
    }
    while let Some(item) = items.next().await {
        let CodecItem::VideoFrame(frame) = item.map_err(said)? else { continue };
        let sample = Sample {
            time: frame.timestamp().timestamp(),
            is_entry: frame.is_random_access_point(),
            lost: frame.loss() > 0,
            data: frame.into_data(),
        };
        if send.send(Ok(sample)).is_err() {
            return Ok(());
        }
    }
    Ok(())
}

/// What went wrong, in one line, without secrets.
fn reason(locator: &Locator, error: &retina::Error) -> String {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    locator.redact(&line.chars().filter(|c| !c.is_control()).take(LONGEST_REASON).collect::<String>())
}
