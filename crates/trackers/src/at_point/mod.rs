//! What is at a point of the picture: a person points, and a box is wanted.

mod moves;
mod patch;
mod stands_out;

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_parameters::{Parameters, parameters};
use std::collections::VecDeque;
use std::sync::Arc;

parameters! {
    /// How a point becomes a box.
    #[derive(Copy)]
    pub struct AtPointParams {
        /// Half the side of the box where nothing at the point moves or stands out and no radius is said, as a fraction of the
        /// picture's shorter side.
        pub radius: f64 = 0.05, in above(0.0).at_most(0.5);
        /// The largest thing looked for, as a fraction of the picture's shorter side.
        pub largest: f64 = 0.5, in above(0.05).at_most(1.0);
        /// How far back pictures are compared to see what moves.
        pub back_s: f64 = 0.25, in 0.02..=2.0, unit "s";
        /// By how much grey values differ where something has moved.
        pub contrast: u32 = 16, in 1..=255;
    }
}

/// What told the box at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Because {
    /// Something moves there.
    Moves,
    /// Something there has other colours than what is around it.
    StandsOut,
    /// Nothing does: the box is as large as was said, or as usual.
    Radius,
}

impl Because {
    /// In words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Moves => "it moves",
            Self::StandsOut => "it stands out",
            Self::Radius => "the radius",
        }
    }
}

/// Finds what is at a point of the newest picture; it remembers a few pictures before that.
#[derive(Debug, Clone)]
pub struct AtPoint {
    params: AtPointParams,
    now: Option<Arc<Frame>>,
    /// Oldest first.
    older: VecDeque<Arc<Frame>>,
}

impl AtPoint {
    /// How many pictures before the newest are kept: those of twice the time back, two in each.
    const OLDER: usize = 5;

    /// With these parameters.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn new(params: AtPointParams) -> Result<Self, pursuit_parameters::ParameterError> {
        params.validate("at_point")?;
        Ok(Self { params, now: None, older: VecDeque::new() })
    }

    /// The newest picture. It is kept, not copied.
    pub fn see(&mut self, frame: &Arc<Frame>) {
        if let Some(before) = self.now.replace(frame.clone()) {
            if before.size() != frame.size() || before.time_s() >= frame.time_s() {
                self.older.clear();
                return;
            }
            let apart_s = 0.5 * self.params.back_s;
            if self.older.back().is_none_or(|last| before.time_s() - last.time_s() >= apart_s - 1e-9) {
                self.older.push_back(before);
            }
            if self.older.len() > Self::OLDER {
                self.older.pop_front();
            }
        }
    }

    /// The box of what is at `point`, in pixels, inside of the picture; `radius_px` is how large it is where
    /// nothing else tells. `None` before the first picture and for a point outside of it.
    pub fn find(&self, point: Point, radius_px: Option<f64>) -> Option<(BBox, Because)> {
        let now = self.now.as_deref()?;
        let Size { width, height } = now.size();
        let inside = (0.0..=width as f64).contains(&point.x) && (0.0..=height as f64).contains(&point.y);
        if !inside {
            return None;
        }
        let whole = BBox::from_ltrb(0.0, 0.0, width as f64, height as f64);
        let shorter = width.min(height) as f64;
        let largest = self.params.largest * shorter;
        let moves = || self.back().and_then(|back| moves::find(back, now, point, largest, &self.params));
        let found = stands_out::find(now, point, largest)
            .map(|bbox| (bbox, Because::StandsOut))
            .or_else(|| moves().map(|bbox| (bbox, Because::Moves)));
        let usual = radius_px.filter(|radius| *radius > 1.0).unwrap_or(self.params.radius * shorter);
        let (bbox, because) =
            found.unwrap_or_else(|| (BBox::from_center_size(point, 2.0 * usual, 2.0 * usual), Because::Radius));
        Some((bbox.intersection(&whole)?, because))
    }

    /// The pictures one and two steps back, where there are such.
    fn back(&self) -> Option<[&Frame; 2]> {
        let now_s = self.now.as_ref()?.time_s();
        let nearest = |steps: f64| {
            let off = |frame: &&Arc<Frame>| (frame.time_s() - (now_s - steps * self.params.back_s)).abs();
            self.older.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|frame| &**frame)
        };
        let (one, two) = (nearest(1.0)?, nearest(2.0)?);
        (one.index() != two.index()).then_some([one, two])
    }
}
