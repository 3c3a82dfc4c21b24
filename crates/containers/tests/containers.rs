//! Containers made in memory, whole and spoiled, read back.
#![allow(clippy::unwrap_used, clippy::panic)]

use pursuit_containers::avi::AviReader;
use pursuit_containers::bytes::RandomAccess;
use pursuit_containers::mp4::{Codec, EncodedSample, Movie, Writer};
use pursuit_containers::y4m::{Planes, Y4mReader};
use pursuit_containers::{ContainerError, Result, limits, mjpeg};
use std::io::Cursor;

/// An MP4 of `times_s.len()` pictures, every fifth a keyframe; picture k holds k + 1 bytes of value k.
fn mp4(times_s: &[f64]) -> Vec<u8> {
    let mut storage = Cursor::new(Vec::new());
    let mut writer = Writer::new(64, 48, times_s[0]);
    for (k, time_s) in times_s.iter().enumerate() {
        let parameter_sets = (k == 0).then(|| (vec![0x67, 66, 0, 30], vec![0x68, 1]));
        let sample = EncodedSample { data: vec![k as u8; k + 1], keyframe: k % 5 == 0, parameter_sets };
        writer.add(&sample, *time_s, &mut storage).unwrap();
    }
    writer.close(0.04, &mut storage).unwrap();
    storage.into_inner()
}

fn movie(bytes: &[u8]) -> Result<Movie> {
    Movie::read(RandomAccess::new(Box::new(Cursor::new(bytes.to_vec()))).unwrap())
}

#[test]
fn mp4_round_trip_keeps_samples_times_and_parameters() {
    let times: Vec<f64> = (0..23).map(|k| 7.0 + f64::from(k) * 0.04 + if k > 11 { 0.5 } else { 0.0 }).collect();
    let bytes = mp4(&times);
    let Movie { mut input, track, flaw } = movie(&bytes).unwrap();
    assert_eq!(flaw, None);
    assert_eq!((track.time_scale, track.samples.len(), input.len()), (90_000, 23, bytes.len() as u64));
    assert_eq!(track.matrix, [0x1_0000, 0, 0, 0x1_0000]);
    let Codec::Avc(config) = &track.codec else { panic!("{:?}", track.codec) };
    assert_eq!(
        (config.length_bytes, &config.sps, &config.pps),
        (4, &vec![vec![0x67, 66, 0, 30]], &vec![vec![0x68, 1]])
    );
    let mut data = Vec::new();
    for (k, sample) in track.samples.iter().enumerate() {
        input.read_at(sample.offset, sample.size.into(), &mut data).unwrap();
        assert_eq!(data, vec![k as u8; k + 1]);
        let ticks = ((times[k] - times[0]) * 90_000.0).round() as i64;
        assert_eq!(track.edits.shown_at(sample.composition_time), Some(ticks), "picture {k}");
    }
}

#[test]
fn repeated_times_advance_and_keyframes_fall_due() {
    let samples = movie(&mp4(&[1.0, 1.0, 0.5, f64::NAN, 2.0])).unwrap().track.samples;
    let times: Vec<i64> = samples.iter().map(|s| s.composition_time).collect();
    assert_eq!(times, [0, 1, 2, 3, 90_000]);
    let mut storage = Cursor::new(Vec::new());
    let mut writer = Writer::new(64, 48, 0.0);
    let parameter_sets = Some((vec![1], vec![2]));
    writer.add(&EncodedSample { data: vec![1], keyframe: true, parameter_sets }, 0.0, &mut storage).unwrap();
    assert!(!writer.keyframe_due(1.99) && writer.keyframe_due(2.0));
}

#[test]
fn cut_files_give_whole_fragments_or_clear_errors() {
    let bytes = mp4(&(0..40).map(|k| f64::from(k) * 0.04).collect::<Vec<_>>());
    let header = bytes.windows(4).position(|w| w == b"moof").unwrap() - 4;
    let mut seen = 0;
    for end in 0..bytes.len() {
        match movie(&bytes[..end]) {
            Ok(movie) => {
                assert!(end >= header);
                assert!(movie.track.samples.len() >= seen, "fewer at byte {end}");
                seen = movie.track.samples.len();
            }
            Err(error) => {
                assert!(end < header, "byte {end}: {error}");
                assert!(error.to_string().contains("index"), "{error}");
            }
        }
    }
    assert_eq!(seen, 40);
}

#[test]
fn the_index_names_where_to_enter() {
    let bytes = mp4(&(0..20).map(|k| f64::from(k) * 0.04).collect::<Vec<_>>());
    let moofs: Vec<u64> = (4..bytes.len()).filter(|&i| bytes[i..].starts_with(b"moof")).map(|i| i as u64 - 4).collect();
    let tfra = bytes.windows(4).position(|w| w == b"tfra").unwrap();
    let field = |at: usize, len: usize| bytes[at..at + len].iter().fold(0u64, |n, b| n << 8 | u64::from(*b));
    let entries: Vec<(u64, u64)> = (0..field(tfra + 16, 4) as usize)
        .map(|k| (field(tfra + 20 + 19 * k, 8), field(tfra + 28 + 19 * k, 8)))
        .collect();
    // Keyframes 0, 5, 10, 15 begin fragments; those of eight frames between them do not.
    assert_eq!(entries.iter().map(|e| e.0).collect::<Vec<_>>(), [0, 18_000, 36_000, 54_000]);
    assert!(entries.iter().all(|e| moofs.contains(&e.1)), "{entries:?} {moofs:?}");
    let mehd = bytes.windows(4).position(|w| w == b"mehd").unwrap();
    assert_eq!(field(mehd + 8, 8), 20 * 3600);
}

#[test]
fn missing_parameters_and_full_disks_are_errors() {
    let mut storage = Cursor::new(Vec::new());
    let error = Writer::new(64, 48, 0.0).add(&EncodedSample::default(), 0.0, &mut storage).unwrap_err();
    assert!(matches!(&error, ContainerError::Unwritable { reason } if reason.contains("parameter sets")), "{error}");
    assert!(storage.get_ref().is_empty());
}

/// An AVI of one video stream with these chunks.
fn avi(codec: &[u8; 4], chunks: &[&[u8]]) -> Vec<u8> {
    let chunk = |kind: &[u8], body: &[u8]| {
        let pad = vec![0; body.len() % 2];
        [kind, &(body.len() as u32).to_le_bytes(), body, &pad].concat()
    };
    let words = |values: &[u32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let strh = [&b"vids"[..], codec, &words(&[0, 0, 0, 2, 50, 0, chunks.len() as u32])].concat();
    let strf = [words(&[40, 64, 48, 0x18_0001]), codec.to_vec(), words(&[0; 5])].concat();
    let strl = [&b"strl"[..], &chunk(b"strh", &strh), &chunk(b"strf", &strf)].concat();
    let hdrl = [&b"hdrl"[..], &chunk(b"avih", &[0; 56]), &chunk(b"LIST", &strl)].concat();
    let frames: Vec<u8> = chunks.iter().flat_map(|c| [chunk(b"00dc", c), chunk(b"01wb", &[9; 3])].concat()).collect();
    let movi = [&b"movi"[..], &frames].concat();
    let body = [&b"AVI "[..], &chunk(b"LIST", &hdrl), &chunk(b"LIST", &movi)].concat();
    chunk(b"RIFF", &body)
}

fn avi_reader(bytes: &[u8]) -> Result<AviReader> {
    AviReader::new(Box::new(Cursor::new(bytes.to_vec())))
}

#[test]
fn empty_avi_chunks_count_as_time() {
    let bytes = avi(b"MJPG", &[&[1, 2, 3], &[], &[4; 6]]);
    let mut reader = avi_reader(&bytes).unwrap();
    let stream = reader.stream();
    assert_eq!((&stream.codec, stream.size, stream.fps, stream.length), (b"MJPG", extent(64, 48), 25.0, 3));
    for _ in 0..2 {
        assert!(reader.next_chunk().unwrap());
        assert_eq!((reader.chunk(), reader.slots()), (&[1, 2, 3][..], 1));
        assert!(reader.next_chunk().unwrap());
        assert_eq!((reader.chunk(), reader.slots()), (&[4; 6][..], 3));
        assert!(!reader.next_chunk().unwrap());
        reader.rewind();
    }
    for (bytes, words) in
        [(avi(b"MJPG", &[])[..100].to_vec(), "ends early"), (b"RIFF\0\0\0\0AVI ".to_vec(), "no header")]
    {
        let error = avi_reader(&bytes).err().unwrap_or_else(|| panic!("{words}"));
        assert!(error.to_string().contains(words), "{error}");
    }
}

const fn extent(width: usize, height: usize) -> limits::Extent {
    limits::Extent { width, height }
}

#[test]
fn y4m_gives_planes_of_every_layout() {
    let stream = |layout: &str, frame: &[u8]| {
        let head = format!("YUV4MPEG2 W3 H2 F30000:1001 {layout} XCOLORRANGE=FULL\n");
        [head.as_bytes(), b"FRAME\n", frame, b"FRAME Ixyz\n", frame].concat()
    };
    let samples: Vec<u8> = (0..12).collect();
    let cases = [
        ("C420jpeg", 10, Planes::Yuv420([samples[..6].to_vec(), samples[6..8].to_vec(), samples[8..10].to_vec()])),
        ("Cmono", 6, Planes::Gray8(samples[..6].to_vec())),
        ("Cmono16", 12, Planes::Gray16(vec![256, 770, 1284, 1798, 2312, 2826])),
    ];
    for (layout, bytes, planes) in cases {
        let stream = stream(layout, &samples[..bytes]);
        let mut reader = Y4mReader::new(&stream[..]).unwrap();
        assert_eq!((reader.header.size, reader.header.full_range), (extent(3, 2), Some(true)));
        assert!((reader.header.fps.unwrap() - 29.97).abs() < 0.01);
        assert_eq!(reader.next_planes().unwrap(), Some(planes.clone()), "{layout}");
        assert_eq!(reader.next_planes().unwrap(), Some(planes), "{layout}");
        assert_eq!(reader.next_planes().unwrap(), None);
        let mut cut = Y4mReader::new(&stream[..stream.len() - 1]).unwrap();
        assert!(cut.next_planes().is_ok());
        assert!(cut.next_planes().unwrap_err().to_string().contains("middle of a frame"));
        let plain =
            [format!("YUV4MPEG2 W3 H2 {layout}\n").as_bytes(), &[b"FRAME\n", &samples[..bytes]].concat()].concat();
        let header = Y4mReader::new(&plain[..]).unwrap().header;
        assert_eq!(header.frames_in(plain.len() as u64), Some(1));
        assert_eq!((header.frames_in(plain.len() as u64 - 1), header.fps, header.full_range), (None, None, None));
    }
}

#[test]
fn y4m_that_is_none_is_told() {
    for (text, words) in [
        ("", "empty"),
        ("YUV4MPEG2 W3 H2", "no end"),
        ("JPEG\n", "does not begin"),
        ("YUV4MPEG2 Wx H2\n", "size"),
        ("YUV4MPEG2 W0 H2\n", "no image"),
        ("YUV4MPEG2 W99999 H2\n", "too large"),
        ("YUV4MPEG2 W3 H2 C444\n", "444"),
    ] {
        let Err(error) = Y4mReader::new(text.as_bytes()) else { panic!("{text}") };
        assert!(error.to_string().contains(words), "{text}: {error}");
        assert_eq!(matches!(error, ContainerError::Unsupported { .. }), text.contains("C444"));
    }
    let mut reader = Y4mReader::new(&b"YUV4MPEG2 W1 H1 Cmono\nFRUME\n\0"[..]).unwrap();
    assert!(reader.next_planes().unwrap_err().to_string().contains("damaged"));
}

/// A JPEG's markers: a segment that holds a thumbnail, and entropy-coded data with a stuffed byte and a restart.
const JPEG: [u8; 22] =
    [0xFF, 0xD8, 0xFF, 0xE1, 0, 6, 0xFF, 0xD8, 0xFF, 0xD9, 0xFF, 0xDA, 0, 2, 7, 0xFF, 0, 8, 0xFF, 0xD0, 0xFF, 0xD9];

#[test]
fn jpegs_are_split_despite_thumbnails() {
    let stream = [&b"\r\n"[..], &JPEG, b"\n\xFF\n", &JPEG, b"rest"].concat();
    let mut reader = &stream[..];
    for _ in 0..2 {
        assert_eq!(mjpeg::next_image(&mut reader).unwrap().as_deref(), Some(&JPEG[..]));
    }
    assert_eq!(mjpeg::next_image(&mut reader).unwrap(), None);
    for end in 2..JPEG.len() {
        let error = mjpeg::next_image(&mut &JPEG[..end]).unwrap_err();
        assert!(error.to_string().contains("middle of a frame"), "{end}: {error}");
    }
}

/// A xorshift generator: the same spoiled files every time.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

#[test]
fn spoiled_files_never_panic_hang_or_swell() {
    let seeds = [
        mp4(&(0..30).map(|k| f64::from(k) * 0.04).collect::<Vec<_>>()),
        avi(b"MJPG", &[&JPEG, &[], &JPEG]),
        [&JPEG[..], &JPEG].concat(),
        b"YUV4MPEG2 W3 H2 F25:1 Cmono\nFRAME\n123456FRAME\n123456".to_vec(),
    ];
    let mut random = Random(2026);
    for round in 0..4000 {
        let mut bytes = seeds[round % seeds.len()].clone();
        for _ in 0..=random.below(4) {
            let at = random.below(bytes.len());
            match random.below(4) {
                0 => bytes[at] ^= 1 << random.below(8),
                1 => bytes[at] = [0, 0xFF, 0x7F, 0x80][random.below(4)],
                2 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, random.below(256) as u8),
            }
        }
        if let Ok(mut movie) = movie(&bytes) {
            let mut data = Vec::new();
            for sample in movie.track.samples.iter().take(1000) {
                let _ = movie.input.read_at(sample.offset, sample.size.into(), &mut data);
                assert!(data.len() <= bytes.len());
            }
        }
        if let Ok(mut reader) = avi_reader(&bytes) {
            while let Ok(true) = reader.next_chunk() {
                assert!(reader.chunk().len() <= bytes.len());
            }
        }
        let mut rest = &bytes[..];
        while let Ok(Some(image)) = mjpeg::next_image(&mut rest) {
            assert!(image.len() <= bytes.len());
        }
        if let Ok(mut reader) = Y4mReader::new(&bytes[..]) {
            while let Ok(Some(_)) = reader.next_planes() {}
        }
    }
}
