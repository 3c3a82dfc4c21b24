//! Which of the two filters judges a place: depth where there is depth, the picture where there is none, both where a target is
//! found again.

use super::localizer::Seen;
use super::{DepthFinding, DepthLocalizer};
use crate::depth::BoxDepth;
use pursuit_estimation::{logit, sigmoid};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, ImageView};
use pursuit_tracking::{Localizer, Look, Measurement, Result, Search};

impl DepthLocalizer {
    /// By depth, or by the picture where the target's place has none.
    pub(super) fn locate_by_place(
        &mut self,
        frame: &Frame,
        depth: ImageView<'_, u16>,
        search: &Search,
    ) -> Result<Seen> {
        let found = self.locate_in_depth(frame, depth, search)?;
        // A sweep is rough; its best place is looked at again.
        if search.look == Look::Sweep {
            return Ok(found);
        }
        let found = match found {
            Some(found) if self.hidden && self.has_depth(depth, &found.0.bbox) => {
                Some(self.with_the_picture(frame, search, found)?)
            }
            other => other,
        };
        let scarce = |bbox: &BBox| !self.has_depth(depth, bbox);
        if !scarce(&search.expected) && !found.as_ref().is_some_and(|(seen, _)| scarce(&seen.bbox)) {
            return Ok(found);
        }
        let by_picture = self.locate_in_hole(frame, depth, search)?;
        let likelier = |a: &(Measurement, DepthFinding), b: &(Measurement, DepthFinding)| {
            a.0.confidence.total_cmp(&b.0.confidence)
        };
        Ok(found.into_iter().chain(by_picture).max_by(likelier))
    }

    /// Whether enough of a box has depth for depth to judge it.
    fn has_depth(&self, depth: ImageView<'_, u16>, bbox: &BBox) -> bool {
        BoxDepth::of(&self.params.region, depth, bbox, 0.0).valid >= self.params.scarce_depth
    }

    /// What the filter on the picture finds where there is no depth, if it is there. Of a target that was out of sight less is believed:
    /// there are holes everywhere.
    fn locate_in_hole(&mut self, frame: &Frame, depth: ImageView<'_, u16>, search: &Search) -> Result<Seen> {
        /// How much larger than the box the place is whose border is looked at.
        const BORDER: f64 = 1.5;
        let found = self.locate_in_picture(frame, search)?;
        let Some((mut seen, finding)) = found.filter(|(seen, _)| !self.has_depth(depth, &seen.bbox)) else {
            return Ok(None);
        };
        if let (true, Some(part)) = (self.hidden, &self.depth) {
            let nearer_than = part.target.surface_m() - self.params.nearer_by;
            let border = BoxDepth::of(&self.params.region, depth, &seen.bbox.scaled(BORDER), nearer_than);
            seen.confidence = sigmoid(logit(seen.confidence) - self.params.hole_doubt * (1.0 - border.nearer));
        }
        Ok(Some((seen, finding)))
    }

    /// What depth found of a target that was out of sight, and what the picture says of that.
    fn with_the_picture(
        &mut self,
        frame: &Frame,
        search: &Search,
        (mut seen, finding): (Measurement, DepthFinding),
    ) -> Result<(Measurement, DepthFinding)> {
        /// Neither of the two decides alone: what each may say, nats.
        const MOST: f64 = 3.0;
        /// What the picture may say against it, nats: depth is for when the light has changed.
        const LEAST: f64 = -1.0;
        /// Where depth says less than this, nats, the picture says nothing for it.
        const RULES_OUT: f64 = -1.0;
        /// How far from there it may see the target, target sizes.
        const APART: f64 = 0.5;
        let place = seen.bbox;
        if self.params.picture_again <= 0.0 || !shows_something(frame, &place) {
            return Ok((seen, finding));
        }
        let there = Search { expected: place, look: Look::Near, ..search.clone() };
        let is_there = |bbox: &BBox| bbox.center().distance(place.center()) <= APART * place.area().sqrt();
        let picture = self.locate_in_picture(frame, &there)?.filter(|(seen, _)| is_there(&seen.bbox));
        let says = picture.map_or(LEAST, |(seen, _)| logit(seen.confidence).clamp(LEAST, MOST));
        let depth_says = logit(seen.confidence).clamp(-MOST, MOST);
        // What depth rules out is not the target, however much it looks like it.
        let says = if depth_says < RULES_OUT { says.min(0.0) } else { says };
        seen.confidence = sigmoid(depth_says + self.params.picture_again * says);
        Ok((seen, finding))
    }

    pub(super) fn locate_in_picture(&mut self, frame: &Frame, search: &Search) -> Result<Seen> {
        let found = self.picture.locate(frame, search)?;
        Ok(found.map(|(measurement, peak)| (measurement, DepthFinding { peak, penalised: None })))
    }
}

/// Whether the picture shows anything in a box; in the dark it does not.
fn shows_something(frame: &Frame, bbox: &BBox) -> bool {
    /// Grey level below which a camera shows nothing but its own noise.
    const BLACK: u8 = 12;
    let gray = frame.gray();
    let within = |at: f64, most: usize| (at.max(0.0) as usize).min(most);
    let columns = within(bbox.left(), gray.width())..within(bbox.right().ceil(), gray.width());
    let rows = within(bbox.top(), gray.height())..within(bbox.bottom().ceil(), gray.height());
    rows.into_iter().any(|y| gray.row(y)[columns.clone()].iter().any(|&level| level > BLACK))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::depth_occlusion::{DepthOcclusionParams, depth_occlusion};
    use pursuit_geometry::Point;
    use pursuit_imaging::Image;
    use pursuit_tracking::{Estimate, Recipe, TrackState};

    const FRAMES: u64 = 40;

    fn place(k: u64) -> BBox {
        BBox::from_center_size(Point::new(60.0 + 2.0 * k as f64, 70.0), 36.0, 32.0)
    }

    /// A patterned target at 2 m before a wall at 3 m, without depth from frame 12 on.
    fn frame(k: u64) -> Frame {
        let bbox = place(k);
        let own = |x: usize, y: usize| bbox.contains(Point::new(x as f64 + 0.5, y as f64 + 0.5));
        let picture = Image::from_fn(220, 140, |x, y| {
            if own(x, y) {
                let (u, v) = (x as i64 - bbox.left() as i64, y as i64 - bbox.top() as i64);
                if (u / 6 + v / 8) % 2 == 0 { 230 } else { (40 + 3 * u) as u8 }
            } else {
                ((x * 7919 + y * 104_729) / 64 % 50 + 90) as u8
            }
        });
        let depth = Image::from_fn(220, 140, |x, y| match own(x, y) {
            true if k >= 12 => 0_u16,
            true => 2000,
            false => 3000,
        });
        Frame::new(k, k as f64 / 30.0, picture.unwrap()).with_depth(depth.unwrap()).unwrap()
    }

    fn followed(params: DepthOcclusionParams) -> Vec<Estimate> {
        let mut recipe = depth_occlusion("depth-occlusion");
        recipe.localizer = params;
        let mut tracker = recipe.init(&frame(0), place(0)).unwrap();
        (1..FRAMES).map(|k| tracker.update(&frame(k)).unwrap()).collect()
    }

    #[test]
    fn a_target_without_depth_is_followed_by_the_picture() {
        let told = followed(DepthOcclusionParams::default());
        for (k, said) in (1..FRAMES).zip(&told) {
            assert!(said.state == TrackState::Tracking && said.bbox.iou(&place(k)) > 0.7, "{k}: {said:?}");
        }
        let by_depth_alone = followed(DepthOcclusionParams { scarce_depth: 0.0, ..DepthOcclusionParams::default() });
        assert!(by_depth_alone.iter().any(|said| said.state != TrackState::Tracking));
    }
}
