//! Going to a frame: what can, what cannot, and that wrappers pass it on.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use pursuit_geometry::Size;
use pursuit_imaging::{Frame, Image, Pixels};
use pursuit_media::wrappers::{Faults, Faulty, Prefetch, Recorded, Retimed, Throttled, Trimmed, WithDepth, write_png};
use pursuit_media::{MediaError, OpenOptions, Result, Source, SourceInfo, open};

/// `count` frames of 16-bit grey, 20 ms apart, every pixel the frame's number; can be entered anywhere.
struct Book {
    info: SourceInfo,
    next: u64,
    torn_at: Option<u64>,
}

fn book(count: u64) -> Book {
    let (fps, frame_count) = (Some(50.0), Some(count));
    let info = SourceInfo { fps, frame_count, seekable: true, ..SourceInfo::new("book", Size::new(4, 3), "test") };
    Book { info, next: 0, torn_at: None }
}

impl Source for Book {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let index = self.next;
        if self.torn_at == Some(index) {
            return Err(MediaError::Broken { name: "book".into(), frame: index, reason: "torn".into() });
        }
        if Some(index) >= self.info.frame_count {
            return Ok(None);
        }
        self.next += 1;
        Ok(Some(Frame::new(
            index,
            index as f64 * 0.02,
            Pixels::Gray16(Image::filled(4, 3, index as u16).unwrap().into()),
        )))
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.info.check_seek(index)?;
        self.next = index;
        Ok(())
    }
}

/// A source that takes the default: front to back.
struct Scroll(Book);

fn scroll() -> Scroll {
    let mut book = book(20);
    book.info.seekable = false;
    Scroll(book)
}

impl Source for Scroll {
    fn info(&self) -> &SourceInfo {
        self.0.info()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        self.0.next_frame()
    }
}

fn index(source: &mut impl Source) -> Option<u64> {
    source.next_frame().unwrap().map(|f| f.index())
}

fn refused(result: Result<()>, frame: u64) {
    assert!(matches!(&result, Err(MediaError::NotSeekable { frame: f, .. }) if *f == frame), "{result:?}");
}

/// What every seekable source of 20 frames owes.
fn goes_anywhere(mut source: impl Source) {
    assert!(source.info().seekable);
    assert_eq!((index(&mut source), index(&mut source)), (Some(0), Some(1)));
    for to in [7, 3, 3, 0, 19] {
        source.seek(to).unwrap();
        assert_eq!(index(&mut source), Some(to));
    }
    assert_eq!(index(&mut source), None);
    source.seek(18).unwrap();
    assert_eq!((index(&mut source), index(&mut source), index(&mut source)), (Some(18), Some(19), None));
    source.seek(5).unwrap();
    refused(source.seek(20), 20);
    assert_eq!(index(&mut source), Some(5), "what is refused changes nothing");
}

#[test]
fn sources_and_wrappers_go_anywhere() {
    goes_anywhere(book(20));
    goes_anywhere(Box::new(book(20)) as Box<dyn Source>);
    goes_anywhere(Recorded::new(book(20), |_| Ok(())));
    goes_anywhere(Retimed::new(book(20), 10.0).unwrap());
    goes_anywhere(Throttled::new(book(20), 1e6));
    goes_anywhere(Faulty::new(book(20), Faults::default()));
    goes_anywhere(Trimmed::new(book(30), 0, Some(19)).unwrap());
    goes_anywhere(WithDepth::new(book(20), book(20)).unwrap());
    for ahead in [1, 8, 100] {
        goes_anywhere(Prefetch::new(Box::new(book(20)), ahead).unwrap());
    }
}

#[test]
fn what_can_only_be_read_from_front_to_back_says_so() {
    let scrolls: Vec<Box<dyn Source>> = vec![
        Box::new(scroll()),
        Box::new(Recorded::new(scroll(), |_| Ok(()))),
        Box::new(Trimmed::new(scroll(), 0, None).unwrap()),
        Box::new(WithDepth::new(scroll(), book(20)).unwrap()),
        Box::new(WithDepth::new(book(20), scroll()).unwrap()),
        Box::new(Prefetch::new(Box::new(scroll()), 4).unwrap()),
    ];
    for mut scroll in scrolls {
        assert!(!scroll.info().seekable);
        assert_eq!(index(&mut scroll), Some(0));
        refused(scroll.seek(0), 0);
        assert_eq!(index(&mut scroll), Some(1));
    }
    let message = scroll().seek(4).unwrap_err().to_string();
    assert_eq!(message, "book cannot go to frame 4: it can only be read from front to back");
}

#[test]
fn frames_keep_their_numbers_and_times_wherever_they_are_entered() {
    let mut source = Retimed::new(book(20), 10.0).unwrap();
    source.seek(7).unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().time_s(), 0.7);
    let mut source = WithDepth::new(book(20), book(25)).unwrap();
    source.seek(9).unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!((frame.index(), frame.depth_mm().unwrap().row(0)[0]), (9, 9), "the depth goes along");
    let mut short = WithDepth::new(book(20), book(10)).unwrap();
    refused(short.seek(12), 12);
    assert_eq!(index(&mut short), Some(0));
}

#[test]
fn a_part_is_left_by_nobody() {
    let mut part = Trimmed::new(book(30), 10, Some(14)).unwrap();
    for outside in [9, 15, 40] {
        refused(part.seek(outside), outside);
    }
    part.seek(14).unwrap();
    assert_eq!((index(&mut part), index(&mut part)), (Some(14), None));
    part.seek(10).unwrap();
    assert_eq!(index(&mut part), Some(10));
}

#[test]
fn decoding_ahead_goes_on_after_an_error_elsewhere() {
    let mut source = Prefetch::new(Box::new(Book { torn_at: Some(3), ..book(20) }), 2).unwrap();
    assert_eq!((index(&mut source), index(&mut source), index(&mut source)), (Some(0), Some(1), Some(2)));
    assert_eq!(source.next_frame().unwrap_err().frame(), Some(3));
    assert_eq!(index(&mut source), None);
    source.seek(4).unwrap();
    assert_eq!((index(&mut source), index(&mut source)), (Some(4), Some(5)));
    source.stop_handle().unwrap().stop();
    refused(source.seek(0), 0);
    assert!(index(&mut source).is_none());
}

#[test]
fn folders_of_images_can_be_entered_anywhere_and_video_files_cannot() {
    let folder = std::env::temp_dir().join(format!("pursuit-seek-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for i in 0..20u8 {
        let frame = Frame::new(0, 0.0, Pixels::Gray8(Image::filled(4, 3, 10 * i).unwrap().into()));
        write_png(&frame, &folder.join(format!("{i}.png"))).unwrap();
    }
    goes_anywhere(open(&folder, &OpenOptions::default()).unwrap());
    let mut source = open(&folder, &OpenOptions::default()).unwrap();
    source.seek(12).unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!((frame.gray().row(0)[0], frame.time_s()), (120, 0.4));

    let list: String = (0..20).map(|i| format!("{i},{i}.png,1,2,3,4\n")).collect();
    std::fs::write(folder.join("frames.csv"), format!("index,image,x,y,w,h\n{list}")).unwrap();
    goes_anywhere(open(&folder, &OpenOptions::default()).unwrap());
    std::fs::remove_dir_all(&folder).unwrap();
}
