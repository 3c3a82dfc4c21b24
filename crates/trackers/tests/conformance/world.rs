//! A small world that suits colour and texture alike: a textured orange target over a textured greyish background.

use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, Pixels, Rgb8};
use pursuit_testkit::{PixelTable, lattice, value_noise};
use std::sync::OnceLock;

/// Size of every frame.
pub const SIZE: Size = Size::new(200, 150);
/// Frames per second.
pub const FPS: f64 = 25.0;

/// What the frames carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Color,
    Gray,
    Gray16,
}

/// A target that stands at `start` and moves by `step` pixels a frame; `shift` moves the whole world.
#[derive(Debug, Clone, Copy)]
pub struct World {
    pub start: BBox,
    pub step: (f64, f64),
    pub shift: (i32, i32),
    pub kind: Kind,
    pub size: Size,
    pub fps: f64,
}

impl World {
    /// The target 36 x 30 in the middle, at rest.
    pub fn still() -> Self {
        let start = BBox::from_ltwh(80.0, 60.0, 36.0, 30.0);
        Self { start, step: (0.0, 0.0), shift: (0, 0), kind: Kind::Color, size: SIZE, fps: FPS }
    }

    /// The target in slow motion.
    pub fn moving() -> Self {
        Self { start: BBox::from_ltwh(50.0, 50.0, 36.0, 30.0), step: (2.0, 1.0), ..Self::still() }
    }

    pub fn truth(&self, index: u64) -> BBox {
        let k = index as f64;
        let (dx, dy) = (f64::from(self.shift.0), f64::from(self.shift.1));
        self.start.translated(k * self.step.0 + dx, k * self.step.1 + dy)
    }

    pub fn frame(&self, index: u64) -> Frame {
        self.frame_at(index, index as f64 / self.fps, true)
    }

    /// The frame without the target.
    pub fn empty_frame(&self, index: u64) -> Frame {
        self.frame_at(index, index as f64 / self.fps, false)
    }

    pub fn frame_at(&self, index: u64, time_s: f64, with_target: bool) -> Frame {
        let truth = self.truth(index);
        let color = |x: usize, y: usize| {
            let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
            let inside = with_target && truth.contains(pursuit_geometry::Point::new(u, v));
            if inside {
                target_color(u - truth.left(), v - truth.top())
            } else {
                background_color(u - f64::from(self.shift.0), v - f64::from(self.shift.1))
            }
        };
        let luma = |x, y| {
            let [r, g, b] = color(x, y).map(f64::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        let Size { width, height } = self.size;
        let pixels = match self.kind {
            Kind::Color => Pixels::Rgb8(Image::from_fn(width, height, color).unwrap().into()),
            Kind::Gray => Pixels::Gray8(Image::from_fn(width, height, |x, y| luma(x, y) as u8).unwrap().into()),
            Kind::Gray16 => Pixels::Gray16(
                Image::from_fn(width, height, |x, y| (20_000.0 + 40.0 * luma(x, y)) as u16).unwrap().into(),
            ),
        };
        Frame::new(index, time_s, pixels)
    }
}

fn target_color(x: f64, y: f64) -> Rgb8 {
    static KNOWN: OnceLock<PixelTable<Rgb8>> = OnceLock::new();
    let known = KNOWN.get_or_init(|| PixelTable::new((0, 0), (80, 80), fresh_target_color));
    known.get(x, y).unwrap_or_else(|| fresh_target_color(x, y))
}

fn fresh_target_color(x: f64, y: f64) -> Rgb8 {
    // Shading as strong as the eye of a texture tracker needs, hue and saturation those of one colour.
    let shade = 0.62 + 0.38 * texture(x, y, 5.0, 11);
    [240.0 * shade, 120.0 * shade, 20.0 * shade].map(|c| c as u8)
}

pub fn background_color(x: f64, y: f64) -> Rgb8 {
    static KNOWN: OnceLock<PixelTable<Rgb8>> = OnceLock::new();
    let known = KNOWN.get_or_init(|| PixelTable::new((-40, -40), (320, 280), fresh_background_color));
    known.get(x, y).unwrap_or_else(|| fresh_background_color(x, y))
}

fn fresh_background_color(x: f64, y: f64) -> Rgb8 {
    let gray = 60.0 + 110.0 * texture(x, y, 9.0, 3) + 30.0 * texture(x, y, 4.0, 5);
    [gray, gray * 1.01, gray * 0.97].map(|c| c.clamp(0.0, 255.0) as u8)
}

/// Smooth value noise in [0, 1] with cells of `cell` pixels.
fn texture(x: f64, y: f64, cell: f64, seed: u64) -> f64 {
    value_noise((x, y), cell, |t| t * t * (3.0 - 2.0 * t), |i, j| lattice(i, j, seed))
}
