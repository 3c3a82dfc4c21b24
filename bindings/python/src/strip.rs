//! A strip of small pictures of a clip, for notebooks.

use pursuit::media::output::encode_jpeg;
use pursuit::{Frame, View};

/// Columns of a picture, at most.
const WIDTH: usize = 320;
/// Most pictures. When there are more, every second one goes, and half as many are taken from then on.
const MOST: usize = 48;
const JPEG_QUALITY: u8 = 75;

/// Pictures of frames that are spread evenly over what was followed so far.
#[derive(Debug)]
pub struct Strip {
    /// The frames' numbers, and JPEG files.
    pictures: Vec<(u64, Vec<u8>)>,
    place: [f64; 4],
    /// Frames seen, and of how many one is taken.
    seen: u64,
    every: u64,
}

impl Default for Strip {
    fn default() -> Self {
        Self { pictures: Vec::new(), place: [0.0, 0.0, 1.0, 1.0], seen: 0, every: 1 }
    }
}

impl Strip {
    /// The frames' numbers and JPEG files, in order.
    pub fn pictures(&self) -> &[(u64, Vec<u8>)] {
        &self.pictures
    }

    /// Where the pictures lie in the input: left, top, and how many pixels of the input one of theirs is, along x and y.
    pub const fn place(&self) -> [f64; 4] {
        self.place
    }

    /// Takes a picture of `frame`, of which the input shows `view`, if it is its turn.
    pub fn note(&mut self, frame: &Frame, view: Option<View>) {
        let turn = self.seen.is_multiple_of(self.every);
        self.seen += 1;
        if !turn {
            return;
        }
        if self.pictures.len() >= MOST {
            let mut number = 0;
            self.pictures.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
        let color = frame.color();
        let step = color.width().div_ceil(WIDTH).max(1);
        // Every so many-th pixel of every so many-th row.
        let small =
            pursuit::imaging::Image::from_fn(color.width().div_ceil(step), color.height().div_ceil(step), |x, y| {
                color.row(step * y)[step * x]
            });
        // A picture that cannot be made is one picture less.
        let Some(jpeg) = small.ok().and_then(|small| encode_jpeg(small.view(), JPEG_QUALITY).ok()) else { return };
        let ([x, y], [sx, sy]) = view.map_or(([0.0; 2], [1.0; 2]), |view| (view.origin(), view.scale()));
        self.place = [x, y, step as f64 / sx, step as f64 / sy];
        self.pictures.push((frame.index(), jpeg));
    }
}
