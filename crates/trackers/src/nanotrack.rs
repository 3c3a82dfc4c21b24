//! The Siamese network tracker `nanotrack`: NanoTrack v3, its network written out in `pursuit-inference`, in the one loop
//! with state, calibrated score and re-detection. See `docs/papers/nanotrack.md`.

use crate::siamese::{DOUBT_STAYS, ScoreWeights, SiameseLocalizer, SiameseModel, built_in, recipe};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_inference::nanotrack::NanoTrackV3;
use pursuit_inference::siamese::{Location, SiameseConfig};
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the Siamese network tracker.
    pub struct NanoTrackParams {
        /// Weight of the cosine window against the network's score.
        pub window_weight: f64 = 0.455, in 0.0..=1.0, source "NanoTrack v3, configv3.yaml";
        /// Penalty on changes of size and shape.
        pub penalty: f64 = 0.138, in 0.0..=10.0, source "NanoTrack v3, configv3.yaml";
        /// How fast the size follows.
        pub size_rate: f64 = 0.348, in 0.0..=1.0, source "NanoTrack v3, configv3.yaml";
        /// Least width and height of a box.
        pub min_side_px: f64 = 4.0, in above(0.0), unit "px", source "NanoTrack v3: 10; ours: 4, for small targets";
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = -7.6, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the log odds of the network's score.
        pub score_weight: f64 = 0.34, in 0.0.., source "ours, fitted";
        /// Score: weight of the likeness of the network's features in the box to those in the first one.
        pub score_embedding: f64 = 7.9, in Bounds::default(), source "ours, fitted";
    }
    renamed { "window" => ["window_weight"] }
}

/// The localizer of `nanotrack`.
pub type NanoTrackLocalizer = SiameseLocalizer<NanoTrackParams>;

impl SiameseModel for NanoTrackParams {
    type Network = NanoTrackV3;

    const NAME: &'static str = "nanotrack";

    fn open(&self) -> Result<(NanoTrackV3, SiameseConfig)> {
        let config = SiameseConfig::nanotrack_v3()
            .in_double_precision()
            .with_weights(self.window_weight, self.penalty, self.size_rate)
            .and_then(|config| config.with_min_side_px(self.min_side_px));
        built_in(Self::NAME, NanoTrackV3::new(), config)
    }

    fn score_weights(&self) -> ScoreWeights {
        ScoreWeights { bias: self.score_bias, score: self.score_weight, embedding: self.score_embedding }
    }
}

impl LocalizerRecipe for NanoTrackParams {
    type Localizer = NanoTrackLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<NanoTrackLocalizer> {
        SiameseLocalizer::remembering(self, frame, bbox)
    }
}

impl NanoTrackLocalizer {
    /// What was found about `about` in a picture of `size`, as large as if as many more `frames` in which the network was not
    /// asked had shown the same.
    pub(crate) fn caught_up(&self, found: Location, about: &BBox, frames: usize, size: Size) -> Location {
        let share = found.penalty * found.score * self.params.size_rate;
        if frames == 0 || share <= 0.0 {
            return found;
        }
        // Of what is still missing each frame makes up the same share.
        let more = (1.0 - (1.0 - share).powf(frames as f64 + 1.0)) / share;
        let side =
            |old: f64, new: f64, most: usize| (old + more * (new - old)).min(most as f64).max(self.params.min_side_px);
        let width = side(about.width(), found.bbox.width(), size.width);
        let height = side(about.height(), found.bbox.height(), size.height);
        Location { bbox: BBox::from_center_size(found.bbox.center(), width, height), ..found }
    }

    /// The best score of the last look of the points next to `place`; `None` where it saw nothing of that.
    pub(crate) fn score_at(&self, place: Point) -> Option<f64> {
        let (config, about) = (self.tracker.config(), self.looked.as_ref()?);
        let n = config.answer_side as isize;
        let context = config.context * (about.width() + about.height());
        let side = ((about.width() + context) * (about.height() + context)).sqrt();
        let cells = config.template_side_px as f64 / side / config.stride_px;
        let cell = |d: f64| (d * cells).round() as isize + n / 2;
        let (column, row) = (cell(place.x - about.center().x), cell(place.y - about.center().y));
        let inside = |k: isize| (0..n).contains(&k);
        (inside(column) && inside(row)).then(|| {
            let near = |(i, s): (usize, f64)| {
                let (y, x) = (i as isize / n, i as isize % n);
                ((y - row).abs() <= 1 && (x - column).abs() <= 1).then_some(s)
            };
            self.tracker.scores().enumerate().filter_map(near).fold(0.0, f64::max)
        })
    }
}

/// `nanotrack`. The released tracker looks where the target was, and so does this one.
pub fn nanotrack(name: &'static str) -> TrackerRecipe<NanoTrackParams> {
    let mut recipe = recipe(name, NanoTrackParams::default());
    recipe.groups.policy.calibrated.lost_below = DOUBT_STAYS;
    recipe
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;
    use pursuit_tracking::{Localizer, Look, Search};

    /// A striped square of 40 px in the middle of a smooth ground, or the ground alone.
    fn scene(has_target: bool) -> Frame {
        let pixel = |x: usize, y: usize| {
            if has_target && (100..140).contains(&x) && (80..120).contains(&y) {
                [if (x / 8).is_multiple_of(2) { 230 } else { 60 }, (y * 6 % 250) as u8, 40]
            } else {
                [(90 + x / 8) as u8, (100 + y / 6) as u8, (110 + (x + y) / 16) as u8]
            }
        };
        Frame::new(0, 0.0, Image::from_fn(320, 240, pixel).unwrap())
    }

    #[test]
    fn what_looks_like_the_target_to_the_network_counts_and_is_remembered() {
        let bbox = BBox::from_ltwh(100.0, 80.0, 40.0, 40.0);
        let search =
            Search { expected: bbox, region: bbox.scaled(4.0), gate: None, look: Look::Near, keep_inside: false };
        let mut localizer = NanoTrackParams::default().localizer(&scene(true), bbox).unwrap();
        let embedding = |localizer: &mut NanoTrackLocalizer, has_target| {
            let (measurement, _) = localizer.locate(&scene(has_target), &search).unwrap().unwrap();
            (measurement.diagnostics.get("embedding").unwrap(), measurement.confidence)
        };
        let (target, ground) = (embedding(&mut localizer, true), embedding(&mut localizer, false));
        assert!(target.0 > 0.95 && target.1 > 0.8, "{target:?}");
        assert!(ground.0 < 0.8 && ground.1 < 0.1, "{ground:?}");
        // Of two trackers that see the same ground with the same score, the one that remembers nothing believes more.
        let mut forgetful = NanoTrackLocalizer::new(&localizer.params, &scene(true), bbox).unwrap();
        let unknown = embedding(&mut forgetful, false);
        assert!(unknown.0 == 0.0 && unknown.1 > ground.1, "{unknown:?}");
        // What is remembered is stored, and refused where it is another network's.
        let saved = serde_json::to_value(&localizer).unwrap();
        let mut restored: NanoTrackLocalizer = serde_json::from_value(saved.clone()).unwrap();
        assert_eq!(embedding(&mut restored, true), target);
        let mut broken = saved;
        broken["first"].as_array_mut().unwrap().pop();
        let error = serde_json::from_value::<NanoTrackLocalizer>(broken).unwrap_err().to_string();
        assert!(error.contains("not of this network"), "{error}");
    }

    #[test]
    fn a_size_catches_up_with_frames_not_asked() {
        let picture = Image::from_fn(96, 64, |x, y| ((x * 7) ^ (y * 5)) as u8).unwrap();
        let frame = Frame::new(0, 0.0, picture);
        let about = BBox::from_ltwh(20.0, 10.0, 24.0, 30.0);
        let localizer = NanoTrackParams::default().localizer(&frame, about).unwrap();
        let raw = BBox::from_ltwh(22.0, 13.0, 36.0, 20.0);
        let share = 0.9 * 0.8 * localizer.params.size_rate;
        let smoothed = |b: &BBox| {
            let side = |old: f64, new: f64| old + share * (new - old);
            BBox::from_center_size(raw.center(), side(b.width(), raw.width()), side(b.height(), raw.height()))
        };
        let once = smoothed(&about);
        let found = Location { bbox: once, raw, score: 0.9, penalty: 0.8, point: (7, 7) };
        let after = |frames| localizer.caught_up(found, &about, frames, frame.size()).bbox;
        assert_eq!(after(0), found.bbox);
        assert!(after(1).iou(&smoothed(&once)) > 1.0 - 1e-9, "{}", after(1));
        assert!(after(2).iou(&smoothed(&smoothed(&once))) > 1.0 - 1e-9, "{}", after(2));
        // No larger than the picture, no smaller than a target may be.
        let growing = Location { bbox: BBox::from_center_size(raw.center(), 90.0, 60.0), ..found };
        let largest = localizer.caught_up(growing, &about, 50, frame.size()).bbox;
        assert_eq!((largest.width(), largest.height()), (96.0, 64.0));
        let shrinking = Location { bbox: BBox::from_center_size(raw.center(), 18.0, 23.0), ..found };
        let least = localizer.caught_up(shrinking, &about, 50, frame.size()).bbox;
        assert_eq!((least.width(), least.height()), (localizer.params.min_side_px, localizer.params.min_side_px));
        let silent = Location { score: 0.0, ..found };
        assert_eq!(localizer.caught_up(silent, &about, 5, frame.size()), silent);
    }
}
