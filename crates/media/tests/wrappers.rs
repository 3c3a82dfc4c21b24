//! What each wrapper does to a source, and that they compose.

#![allow(clippy::unwrap_used, clippy::panic)]

use pursuit_geometry::Size;
use pursuit_imaging::{Frame, Image};
use pursuit_media::depth::{DepthCoding, DepthFacts, DepthOptions, Pairing, PairingFacts, WithDepthFolder};
use pursuit_media::input::{Cancel, Frames, StopHandle};
use pursuit_media::wrappers::{
    Connect, Faults, Faulty, Patience, Prefetch, Reconnecting, Recorded, Retimed, StreamStats, Strided, Throttled,
    Trimmed, WithDepth, write_png,
};
use pursuit_media::{MediaError, OpenOptions, Result, Source, SourceInfo, Truth, View, open};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// `count` grey frames, 20 ms apart, every pixel the frame's number.
struct Counting {
    info: SourceInfo,
    next: u64,
    count: u64,
    fail_at: Option<u64>,
}

fn info(count: Option<u64>, live: bool) -> SourceInfo {
    let info = SourceInfo::new("counting", Size::new(4, 3), "test");
    SourceInfo { fps: Some(50.0), frame_count: count, live, ..info }
}

fn counting(count: u64) -> Counting {
    Counting { info: info(Some(count), false), next: 0, count, fail_at: None }
}

fn frame(index: u64) -> Frame {
    Frame::new(index, index as f64 * 0.02, Image::filled(4, 3, index as u8).unwrap())
}

impl Source for Counting {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.fail_at == Some(self.next) {
            self.count = 0;
            return Err(MediaError::Broken { name: "counting".into(), frame: self.next, reason: "told to".into() });
        }
        if self.next >= self.count {
            return Ok(None);
        }
        self.next += 1;
        Ok(Some(frame(self.next - 1)))
    }
}

fn indices(mut source: impl Source) -> (Vec<u64>, Option<MediaError>) {
    let mut seen = Vec::new();
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => seen.push(frame.index()),
            Ok(None) => return (seen, None),
            Err(error) => {
                assert!(source.next_frame().unwrap().is_none(), "after an error comes the end");
                return (seen, Some(error));
            }
        }
    }
}

#[test]
fn prefetching_changes_nothing_but_who_waits() {
    let prefetch = Prefetch::new(Box::new(counting(100)), 3).unwrap();
    let stats = prefetch.stats();
    assert_eq!(indices(prefetch), ((0..100).collect(), None));
    assert_eq!((stats.decoded_frames(), stats.dropped_frames()), (100, 0));
}

#[test]
fn prefetched_errors_keep_their_place() {
    let source = Counting { fail_at: Some(7), ..counting(100) };
    let (seen, error) = indices(Prefetch::new(Box::new(source), 20).unwrap());
    assert_eq!(seen, (0..7).collect::<Vec<_>>());
    assert_eq!(error.unwrap().frame(), Some(7));
}

#[test]
fn the_queue_is_bounded() {
    let prefetch = Prefetch::new(Box::new(counting(100)), 5).unwrap();
    let stats = prefetch.stats();
    std::thread::sleep(Duration::from_millis(100));
    // Five in the queue, one in the thread's hands.
    assert!(stats.decoded_frames() <= 6, "{}", stats.decoded_frames());
}

#[test]
fn in_step_nothing_is_decoded_before_it_is_asked_for() {
    let mut prefetch = Prefetch::new(Box::new(counting(100)), 0).unwrap();
    let stats = prefetch.stats();
    for asked in 0..20 {
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(stats.decoded_frames(), asked);
        assert_eq!(prefetch.next_frame().unwrap().unwrap().index(), asked);
    }
    assert_eq!(indices(prefetch), ((20..100).collect(), None));
    let source = Counting { fail_at: Some(7), ..counting(100) };
    let (seen, error) = indices(Prefetch::new(Box::new(source), 0).unwrap());
    assert_eq!((seen, error.unwrap().frame()), ((0..7).collect(), Some(7)));
    // Of a live source the newest frame is there for whoever comes.
    let camera = camera();
    let line = camera.hang_up.clone();
    let mut prefetch = Prefetch::new(Box::new(camera), 0).unwrap();
    line.lock().unwrap().as_ref().unwrap().send(frame(0)).unwrap();
    assert_eq!(prefetch.next_frame().unwrap().unwrap().index(), 0);
}

/// A camera: frames come when the test sends them.
struct Camera {
    info: SourceInfo,
    frames: Receiver<Frame>,
    /// Ends the wait for a frame, as closing a connection does.
    hang_up: Arc<Mutex<Option<Sender<Frame>>>>,
}

fn camera() -> Camera {
    let (sender, frames) = channel();
    Camera { info: info(None, true), frames, hang_up: Arc::new(Mutex::new(Some(sender))) }
}

impl Source for Camera {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        Ok(self.frames.recv().ok())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let line = self.hang_up.clone();
        Some(StopHandle::new(move || drop(line.lock().unwrap().take())))
    }
}

#[test]
fn a_live_source_loses_its_oldest_frames_and_counts_them() {
    let camera = camera();
    let line = camera.hang_up.clone();
    let prefetch = Prefetch::new(Box::new(camera), 4).unwrap();
    let stats = prefetch.stats();
    for index in 0..50 {
        line.lock().unwrap().as_ref().unwrap().send(frame(index)).unwrap();
    }
    line.lock().unwrap().take();
    while stats.decoded_frames() < 50 || stats.dropped_frames() < 46 {
        std::thread::yield_now();
    }
    assert_eq!(indices(prefetch), ((46..50).collect(), None));
    assert_eq!(stats.dropped_frames(), 46);
}

#[test]
fn dropping_stops_a_source_that_waits_for_ever() {
    let camera = camera();
    let line = camera.hang_up.clone();
    let mut prefetch = Prefetch::new(Box::new(camera), 4).unwrap();
    let stop = prefetch.stop_handle().unwrap();
    let stopper = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(50));
        stop.stop();
    });
    assert!(prefetch.next_frame().unwrap().is_none(), "stopping ends the wait");
    stopper.join().unwrap();
    drop(prefetch);
    assert!(line.lock().unwrap().is_none());
}

#[test]
fn a_panicking_decoder_is_an_error() {
    struct Panicking(SourceInfo);
    impl Source for Panicking {
        fn info(&self) -> &SourceInfo {
            &self.0
        }
        fn next_frame(&mut self) -> Result<Option<Frame>> {
            panic!("a defect, on purpose")
        }
    }
    let mut prefetch = Prefetch::new(Box::new(Panicking(info(None, false))), 2).unwrap();
    assert!(prefetch.next_frame().is_err());
    assert!(prefetch.next_frame().unwrap().is_none());
}

#[test]
fn throttling_keeps_time() {
    let start = Instant::now();
    // Nine gaps of 20 ms at double speed; only the lower bound can be promised.
    assert_eq!(indices(Throttled::new(counting(10), 2.0)).0.len(), 10);
    assert!(start.elapsed() >= Duration::from_millis(90));
}

#[test]
fn trimming_keeps_numbers_and_times() {
    let mut trimmed = Trimmed::new(counting(10), 3, Some(5)).unwrap();
    assert_eq!(trimmed.info().frame_count, Some(3));
    let first = trimmed.next_frame().unwrap().unwrap();
    assert_eq!((first.index(), first.time_s()), (3, 0.06));
    assert_eq!(indices(trimmed).0, [4, 5]);
    assert_eq!(indices(Trimmed::new(counting(10), 8, None).unwrap()).0, [8, 9]);
    for (from, to) in [(10, None), (5, Some(4))] {
        let error = Trimmed::new(counting(10), from, to).err().unwrap().to_string();
        assert!(error.contains("counting") && error.contains(&from.to_string()), "{error}");
    }
}

#[test]
fn strides_keep_numbers_and_times_and_make_up_for_what_is_missing() {
    let of = |n: u64| std::num::NonZeroU64::new(n).unwrap();
    let strided = Strided::new(counting(10), of(4));
    assert_eq!((strided.info().frame_count, strided.info().fps), (Some(3), Some(12.5)));
    assert_eq!(indices(strided), (vec![0, 4, 8], None));
    assert_eq!(indices(Strided::new(Trimmed::new(counting(9), 2, None).unwrap(), of(3))).0, [2, 5, 8]);
    let faulty = Faulty::new(counting(60), Faults { drop: 0.3, seed: 4, ..Faults::default() });
    let there = indices(faulty).0;
    let faulty = Faulty::new(counting(60), Faults { drop: 0.3, seed: 4, ..Faults::default() });
    let seen = indices(Strided::new(faulty, of(5))).0;
    let first = there[0];
    let wanted: Vec<u64> = (0..60 / 5)
        .filter_map(|k| there.iter().copied().find(|i| (first + 5 * k..first + 5 * k + 5).contains(i)))
        .collect();
    assert_eq!(seen, wanted);
    assert_eq!(indices(Strided::new(counting(3), of(u64::MAX))).0, [0]);
}

#[test]
fn retiming_replaces_times() {
    let mut retimed = Retimed::new(counting(3), 10.0).unwrap();
    assert_eq!(retimed.info().fps, Some(10.0));
    retimed.next_frame().unwrap();
    assert_eq!(retimed.next_frame().unwrap().unwrap().time_s(), 0.1);
    assert!(Retimed::new(counting(3), 0.0).is_err());
    assert!(Retimed::new(counting(3), f64::NAN).is_err());
}

#[test]
fn recordings_read_back_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(indices(Recorded::to_folder(counting(12), folder.path()).unwrap()).0.len(), 12);
    let mut back = open(folder.path().to_str().unwrap(), &OpenOptions::default()).unwrap();
    for index in 0..12 {
        assert_eq!(back.next_frame().unwrap().unwrap().gray().row(2), [index; 4]);
    }
    let inside_a_file = folder.path().join("000000.png").join("x");
    let error = Recorded::to_folder(counting(1), &inside_a_file).err().unwrap();
    assert!(error.is_output() && error.to_string().contains("000000.png"), "{error}");
}

#[test]
fn faults_are_those_asked_for_and_repeat() {
    let spoil = |faults| indices(Faulty::new(counting(1000), faults));
    assert_eq!(spoil(Faults::default()).0.len(), 1000);
    let dropping = Faults { seed: 7, drop: 0.3, ..Faults::default() };
    let kept = spoil(dropping).0;
    assert!((600..800).contains(&kept.len()), "{}", kept.len());
    assert_eq!(kept, spoil(dropping).0);
    assert_ne!(kept, spoil(Faults { seed: 8, ..dropping }).0);
    let (seen, error) = spoil(Faults { fail_at: Some(9), ..Faults::default() });
    assert_eq!((seen.len(), error.unwrap().frame()), (9, Some(9)));

    let pixels = |faults| {
        let mut source = Faulty::new(Trimmed::new(counting(9), 8, None).unwrap(), faults);
        source.next_frame().unwrap().unwrap().gray().to_image().into_vec()
    };
    assert_eq!(pixels(Faults { black: 1.0, ..Faults::default() }), [0; 12]);
    let noisy = pixels(Faults { corrupt: 1.0, ..Faults::default() });
    assert_eq!((&noisy[..4], &noisy[8..]), (&[8; 4][..], &[8; 4][..]));
    assert_ne!(noisy[4..8], [8; 4]);
}

/// Frames with these numbers as codes; those that are none are damaged.
struct Numbered(SourceInfo, Vec<Result<u64, u64>>);

impl Numbered {
    fn new(frames: &[Result<u64, u64>]) -> Self {
        Self(info(None, false), frames.iter().rev().copied().collect())
    }
}

impl Source for Numbered {
    fn info(&self) -> &SourceInfo {
        &self.0
    }
    fn next_frame(&mut self) -> Result<Option<Frame>, MediaError> {
        match self.1.pop() {
            Some(Ok(n)) => Ok(Some(Frame::new(n, n as f64, Image::filled(4, 3, n as u16 + 1).unwrap()))),
            Some(Err(frame)) => Err(MediaError::Damaged { name: "depth".into(), frame, reason: "torn".into() }),
            None => Ok(None),
        }
    }
}

#[test]
fn depth_is_paired_frame_by_frame() {
    let mut both = WithDepth::new(counting(3), Numbered::new(&[Ok(0), Ok(1)])).unwrap();
    assert_eq!(both.next_frame().unwrap().unwrap().depth_mm().unwrap().row(0), [1; 4]);
    assert_eq!(both.next_frame().unwrap().unwrap().depth_mm().unwrap().row(0), [2; 4]);
    assert_eq!(both.next_frame().unwrap_err().frame(), Some(2));
}

#[test]
fn numbers_pair_frames_and_depth_where_one_of_them_is_damaged() {
    let pairs = |frames: &[Result<u64, u64>], depth: &[Result<u64, u64>]| {
        let mut both = WithDepth::new(Numbered::new(frames), Numbered::new(depth)).unwrap();
        let mut seen = Vec::new();
        loop {
            match both.next_frame() {
                Ok(Some(frame)) => seen.push(Ok((frame.index(), frame.depth_mm().map(|d| d.row(0)[0] - 1)))),
                Ok(None) => return seen,
                Err(error) => {
                    assert!(error.is_damage(), "{error}");
                    seen.push(Err(error.frame().unwrap()));
                }
            }
        }
    };
    let whole = [Ok(0), Ok(1), Ok(2), Ok(3)];
    // A frame is left out with its depth, an entry further on finds its own.
    assert_eq!(
        pairs(&[Ok(0), Err(1), Ok(3)], &whole),
        [Ok((0, Some(0))), Err(1), Ok((3, Some(3)))],
        "frames are missing"
    );
    // A frame whose depth is damaged is left out; one that has none goes without.
    assert_eq!(
        pairs(&whole, &[Ok(0), Err(1), Ok(2), Ok(3)]),
        [Ok((0, Some(0))), Err(1), Ok((2, Some(2))), Ok((3, Some(3)))]
    );
    assert_eq!(
        pairs(&whole, &[Ok(0), Ok(2), Ok(3)]),
        [Ok((0, Some(0))), Ok((1, None)), Ok((2, Some(2))), Ok((3, Some(3)))]
    );
}

#[test]
fn depth_of_another_size_is_refused() {
    let small = SourceInfo { size: Size::new(2, 2), ..info(None, false) };
    assert!(WithDepth::new(counting(3), Numbered(small, Vec::new())).is_err());
}

#[test]
fn frames_of_a_program_are_a_source() {
    let made = || (0..4).map(|index| Ok(frame(index)));
    let mut source = Frames::new("made", made()).unwrap();
    source.info_mut().fps = Some(50.0);
    let wanted = SourceInfo { fps: Some(50.0), ..SourceInfo::new("made", Size::new(4, 3), "frames of the program") };
    assert_eq!(source.info(), &SourceInfo { frame_count: Some(4), ..wanted });
    assert_eq!(indices(source), (vec![0, 1, 2, 3], None));
    assert_eq!(Frames::new("made", made().filter(|_| true)).unwrap().info().frame_count, None);
    let none = Frames::new("made", std::iter::empty()).err().unwrap();
    assert_eq!(none.to_string(), "cannot read made: it has no frames");
    // Behind a damaged frame it goes on, behind any other error it does not.
    let with = |error: MediaError| Frames::new("made", [Ok(frame(0)), Err(error), Ok(frame(2))]).unwrap();
    let mut damaged = with(MediaError::Damaged { name: "made".into(), frame: 1, reason: "torn".into() });
    damaged.next_frame().unwrap();
    assert!(damaged.next_frame().unwrap_err().is_damage());
    assert_eq!(indices(damaged), (vec![2], None));
    let broken = with(MediaError::Broken { name: "made".into(), frame: 1, reason: "torn".into() });
    assert_eq!(indices(broken).1.unwrap().frame(), Some(1));
}

/// Every fact that a source can know, none of them the one it has by default.
fn all_facts() -> SourceInfo {
    let pairing =
        PairingFacts { pairing: Pairing::Order, paired: 8, unpaired: 2, largest_offset_s: None, mean_offset_s: None };
    SourceInfo {
        name: "knowing".to_owned(),
        size: Size::new(4, 3),
        fps: Some(50.0),
        frame_count: Some(10),
        duration_s: Some(0.2),
        live: true,
        decoder: "test".to_owned(),
        truth: Some(vec![Truth::Absent; 10]),
        seekable: true,
        view: Some(View { input: Size::new(64, 48), region: [8, 6, 8, 6], size: [4, 3] }),
        pixel_aspect: Some((4, 3)),
        depth: Some(DepthFacts {
            coding: DepthCoding::Millimetres,
            coding_detected: true,
            pairing,
            registered: true,
            registration_detected: true,
            intrinsics: None,
        }),
        stream: Some(StreamStats::default()),
    }
}

#[test]
fn wrappers_change_only_their_own_facts() {
    let all = all_facts();
    let knowing = || Numbered(all.clone(), Vec::new());
    let strict = SourceInfo { live: false, ..all.clone() };
    let by = |n: u64| std::num::NonZeroU64::new(n).unwrap();
    let front_to_back = Numbered::new(&[]);
    let connect: Connect =
        Arc::new(|_: &Cancel| Err(MediaError::Unreadable { name: "gone".into(), reason: "gone".into() }));
    let reconnecting = Reconnecting::new(Box::new(knowing()), connect, Patience::default()).unwrap();
    let counted = reconnecting.info().stream.clone();
    let folder = tempfile::tempdir().unwrap();
    let millimetres = Frame::new(0, 0.0, Image::filled(4, 3, 500_u16).unwrap());
    write_png(&millimetres, &folder.path().join("0.png")).unwrap();
    let paired = WithDepthFolder::new(knowing(), folder.path(), &DepthOptions::default()).unwrap();
    let facts = paired.info().depth.clone();
    let table: Vec<(&str, Box<dyn Source>, SourceInfo)> = vec![
        ("box", Box::new(Box::new(knowing()) as Box<dyn Source>), all.clone()),
        ("recorded", Box::new(Recorded::new(knowing(), |_| Ok(()))), all.clone()),
        ("throttled", Box::new(Throttled::new(knowing(), 1.0)), all.clone()),
        ("faulty", Box::new(Faulty::new(knowing(), Faults::default())), all.clone()),
        ("prefetch", Box::new(Prefetch::new(Box::new(knowing()), 2).unwrap()), all.clone()),
        ("depth", Box::new(WithDepth::new(knowing(), knowing()).unwrap()), all.clone()),
        // Frames get other times.
        (
            "retimed",
            Box::new(Retimed::new(knowing(), 10.0).unwrap()),
            SourceInfo { fps: Some(10.0), duration_s: None, ..all.clone() },
        ),
        // There are fewer frames; they keep their numbers, so the truth stays.
        (
            "trimmed",
            Box::new(Trimmed::new(knowing(), 2, Some(5)).unwrap()),
            SourceInfo { frame_count: Some(4), duration_s: None, ..all.clone() },
        ),
        (
            "strided",
            Box::new(Strided::new(knowing(), by(4))),
            SourceInfo { fps: Some(12.5), frame_count: Some(3), ..all.clone() },
        ),
        // It goes where both can go.
        (
            "depth from front to back",
            Box::new(WithDepth::new(knowing(), front_to_back).unwrap()),
            SourceInfo { seekable: false, ..all.clone() },
        ),
        // Its frames have the folder's depth.
        ("depth folder", Box::new(paired), SourceInfo { depth: facts, ..all.clone() }),
        // A camera has no end, cannot be entered anywhere, and has its connections counted.
        (
            "reconnecting",
            Box::new(reconnecting),
            SourceInfo { frame_count: None, duration_s: None, seekable: false, stream: counted, ..all.clone() },
        ),
    ];
    for (wrapper, source, wanted) in table {
        assert_eq!(source.info(), &wanted, "{wrapper}");
    }
    let queue = Prefetch::new(Box::new(Numbered(strict.clone(), Vec::new())), 0).unwrap();
    assert_eq!(queue.info(), &strict);
}
