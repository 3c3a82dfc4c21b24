#![no_main]

use pursuit::evaluation::boxes::{BoxFormat, parse_boxes};
use pursuit::geometry::Size;
use std::path::Path;

// Files of boxes in every form: what is read is finite, has a place, and is in order of frames.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&form, mut bytes)) = bytes.split_first() else { return };
    let format = BoxFormat::ALL[usize::from(form) % BoxFormat::ALL.len()];
    if let Ok(boxes) = parse_boxes(&mut bytes, Path::new("boxes"), format, Some(Size::new(640, 480))) {
        let boxes = boxes.in_pixels();
        assert!(boxes.rows().is_sorted_by_key(|row| row.frame));
        assert!(boxes.rows().iter().all(|row| row.bbox.is_finite() && row.score.is_finite()));
        assert!(boxes.rows().iter().all(|row| boxes.of(row.frame).contains(row)));
    }
});
