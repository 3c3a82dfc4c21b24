#![no_main]

use pursuit_containers::{avi::AviReader, bytes::RandomAccess, mjpeg, mp4::Movie, y4m::Y4mReader};
use std::io::Cursor;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(mut movie) = RandomAccess::new(Box::new(Cursor::new(bytes.to_vec())))
        .map(Movie::read)
        .and_then(|m| m.map_err(std::io::Error::other))
    {
        let mut data = Vec::new();
        for sample in movie.track.samples.iter().take(256) {
            let _ = movie.input.read_at(sample.offset, sample.size.into(), &mut data);
        }
    }
    if let Ok(mut reader) = AviReader::new(Box::new(Cursor::new(bytes.to_vec()))) {
        while let Ok(true) = reader.next_chunk() {}
    }
    let mut rest = bytes;
    while let Ok(Some(_)) = mjpeg::next_image(&mut rest) {}
    if let Ok(mut reader) = Y4mReader::new(bytes) {
        while let Ok(Some(_)) = reader.next_planes() {}
    }
});
