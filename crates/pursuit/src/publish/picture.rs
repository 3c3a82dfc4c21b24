//! A picture of what happened, small enough to be sent.

use crate::events::Kind;
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_media::output::encode_jpeg;

/// Wider pictures are made smaller by leaving pixels out.
const MOST_COLUMNS: usize = 1280;
/// 1 to 100.
const QUALITY: u8 = 80;
/// What stands around whom it is about, and how thick, pixels of the picture that is sent.
const MARK: (Rgb8, f64) = ([255, 176, 0], 3.0);

/// Whether somebody wants to see this.
pub(super) const fn is_shown(kind: Kind) -> bool {
    match kind {
        Kind::Appear | Kind::Enter | Kind::Dwell => true,
        Kind::Leave | Kind::Lost | Kind::Found | Kind::Gone => false,
    }
}

/// The frame as JPEG with these boxes (pixels of the frame) drawn in it; none where it cannot be made.
pub(super) fn picture_of(frame: &Frame, boxes: &[BBox]) -> Option<Vec<u8>> {
    let (size, colors) = (frame.size(), frame.color());
    let every = size.width.div_ceil(MOST_COLUMNS).max(1);
    let is_edge = |x: f64, y: f64| {
        let inside = |b: &BBox, wider: f64| {
            (b.left() - wider..=b.right() + wider).contains(&x) && (b.top() - wider..=b.bottom() + wider).contains(&y)
        };
        boxes.iter().any(|b| inside(b, MARK.1 * every as f64) && !inside(b, 0.0))
    };
    let pixel = |x: usize, y: usize| {
        let (x, y) = (x * every, y * every);
        if is_edge(x as f64 + 0.5, y as f64 + 0.5) { MARK.0 } else { colors.row(y)[x] }
    };
    let small = Image::from_fn(size.width / every, size.height / every, pixel).ok()?;
    encode_jpeg(small.view(), QUALITY).ok()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn a_large_frame_is_made_smaller_and_its_box_is_drawn() {
        let frame = Frame::new(0, 0.0, Image::filled(3000, 200, [10, 10, 10]).unwrap());
        let bytes = picture_of(&frame, &[BBox::from_ltwh(600.0, 60.0, 90.0, 60.0)]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("0001.jpg"), &bytes).unwrap();
        let mut source = crate::open(folder.path().to_str().unwrap()).unwrap();
        let shown = source.next_frame().unwrap().unwrap();
        assert_eq!((shown.size().width, shown.size().height), (1000, 66));
        let bright = |x: usize, y: usize| shown.color().row(y)[x][0] > 150;
        // The box is 200..230 across and 20..40 down, its mark three pixels around it.
        assert!(bright(198, 30) && bright(215, 18) && bright(231, 30) && bright(215, 41));
        assert!(!bright(215, 30) && !bright(190, 30) && !bright(215, 50));
    }
}
