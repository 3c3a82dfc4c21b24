//! Depth in an overlay: small, in false colours, in the corner that is farthest from the targets.

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Image, ImageView, Rgb8};

/// The inset's sides as a share of the picture's.
const SHARE: usize = 4;
/// What is nearer or farther than these quantiles of the depths has the first or the last colour.
const QUANTILES: (f64, f64) = (0.02, 0.98);
/// A pixel without data.
const UNKNOWN: Rgb8 = [0, 0, 0];
const FRAME: Rgb8 = [255, 255, 255];

/// Near is red, then yellow, green, cyan, and far is blue.
fn false_color(share: f64) -> Rgb8 {
    let hue = 4.0 * share.clamp(0.0, 1.0);
    let rising = |low: f64| (255.0 * (hue - low).clamp(0.0, 1.0)) as u8;
    let falling = |low: f64| 255 - rising(low);
    [falling(1.0), if hue < 3.0 { rising(0.0) } else { falling(3.0) }, rising(2.0)]
}

/// The corner, as (right, bottom), whose middle is farthest from the nearest of `boxes`.
fn corner(width: f64, height: f64, boxes: &[BBox]) -> (bool, bool) {
    let away = |&(right, bottom): &(bool, bool)| {
        let at = |n: f64, far: bool| if far { n * 7.0 / 8.0 } else { n / 8.0 };
        let middle = Point::new(at(width, right), at(height, bottom));
        boxes.iter().map(|b| b.center().distance(middle)).fold(f64::INFINITY, f64::min)
    };
    // The last of equals, where the words of a label seldom are.
    let corners = [(false, false), (true, false), (false, true), (true, true)];
    corners.into_iter().max_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or((true, true))
}

/// Draws `depth`, in millimetres, into a corner of `picture`, away from `boxes`.
pub(super) fn draw(picture: &mut Image<Rgb8>, depth: ImageView<'_, u16>, boxes: impl Iterator<Item = BBox>) {
    let (own, from) = (picture.size(), depth.size());
    let (width, height) = (own.width / SHARE, own.height / SHARE);
    if width < 8 || height < 8 || from.area() == 0 {
        return;
    }
    // Every fourth pixel each way, which is what is shown.
    let sample = |x: usize, y: usize| depth.row(y * from.height / height)[x * from.width / width];
    let mut known: Vec<u16> =
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| sample(x, y)).collect();
    known.retain(|mm| *mm > 0);
    known.sort_unstable();
    let quantile =
        |q: f64| known.get((q * known.len().saturating_sub(1) as f64) as usize).map_or(0.0, |mm| f64::from(*mm));
    let (near, far) = (quantile(QUANTILES.0), quantile(QUANTILES.1));
    let (right, bottom) = corner(own.width as f64, own.height as f64, &boxes.collect::<Vec<_>>());
    let (left, top) = (if right { own.width - width } else { 0 }, if bottom { own.height - height } else { 0 });
    let pixels = picture.as_mut_slice();
    for y in 0..height {
        for (x, out) in pixels[(top + y) * own.width + left..][..width].iter_mut().enumerate() {
            let border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
            *out = match sample(x, y) {
                _ if border => FRAME,
                0 => UNKNOWN,
                mm => false_color((f64::from(mm) - near) / (far - near).max(1.0)),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_red_and_far_is_blue() {
        assert_eq!(false_color(-1.0), [255, 0, 0]);
        assert_eq!(false_color(0.25), [255, 255, 0]);
        assert_eq!(false_color(0.5), [0, 255, 0]);
        assert_eq!(false_color(0.75), [0, 255, 255]);
        assert_eq!(false_color(9.0), [0, 0, 255]);
    }

    #[test]
    fn the_inset_keeps_away_from_the_target() {
        let at = |x: f64, y: f64| BBox::from_center_size(Point::new(x, y), 10.0, 10.0);
        assert_eq!(corner(400.0, 300.0, &[at(390.0, 290.0)]), (false, false));
        assert_eq!(corner(400.0, 300.0, &[at(10.0, 290.0)]), (true, false));
        assert_eq!(corner(400.0, 300.0, &[]), (true, true));
    }

    #[test]
    fn a_quarter_of_the_picture_shows_the_depth() {
        let depth = Image::from_fn(80, 60, |x, y| match (x, y) {
            (_, 0..8) => 0,
            (0..40, _) => 1000,
            _ => 3000,
        });
        let mut picture = Image::filled(80, 60, [7, 7, 7]).unwrap();
        draw(&mut picture, depth.unwrap().view(), [BBox::from_ltwh(60.0, 45.0, 9.0, 9.0)].into_iter());
        let at = |x: usize, y: usize| picture.as_slice()[y * 80 + x];
        assert_eq!((at(0, 0), at(19, 14), at(20, 5), at(5, 15)), (FRAME, FRAME, [7; 3], [7; 3]));
        assert_eq!((at(5, 1), at(5, 8), at(15, 8)), (UNKNOWN, [255, 0, 0], [0, 0, 255]));
        // A picture too small for an inset stays as it is.
        let mut tiny = Image::filled(20, 20, [7, 7, 7]).unwrap();
        draw(&mut tiny, Image::filled(20, 20, 900_u16).unwrap().view(), std::iter::empty());
        assert!(tiny.as_slice().iter().all(|p| *p == [7; 3]));
    }
}
