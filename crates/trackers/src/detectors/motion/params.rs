use super::ghost;
use pursuit_geometry::Size;
use pursuit_vision::background::{LightingParams, Mog2Params, RunningAverageParams, TemporalMedianParams};
use pursuit_vision::region_features::FeatureRanges;

pursuit_parameters::choices! {
    /// The model of the background.
    pub enum BackgroundKind {
        /// Adaptive mixture of Gaussians with shadows.
        Mog2 = "mog2",
        /// Median of samples of the past.
        Median = "median",
        /// Running average.
        RunningAverage = "running-average",
        /// The first frame: the paper's background frame difference.
        Fixed = "fixed",
        /// Difference to the two last frames; sees only what moves, and only its edges.
        ThreeFrame = "three-frame",
    }
}

pursuit_parameters::parameters! {
    /// Parameters of the motion detector.
    pub struct MotionDetectorParams {
        /// The model of the background.
        pub background: BackgroundKind = BackgroundKind::Mog2, source "zivkovic2006";
        /// A picture whose shorter side is longer is looked at coarser, each pixel the mean of a square, as few as make it no longer. 0: every
        /// picture is looked at as it is.
        pub sight_px: usize = 720, in 0..=65_536, unit "px", source "ours";
        /// How long the background is remembered: time constant of `mog2` and `running-average`, span of the samples of `median`.
        pub history_s: f64 = 20.0, in above(0.0).at_most(86_400.0), unit "s", source "OpenCV: 500 frames, at 25 a second";
        /// For so long at first everything is learnt that is not followed.
        pub learn_s: f64 = 2.0, in 0.0..=86_400.0, unit "s", source "ours";
        /// What stands out of the background is not learnt before it has done so for this long, nor while it is followed.
        pub hold_s: f64 = 5.0, in 0.0..=86_400.0, unit "s", source "ours";
        /// A pixel has changed when a channel differs by more: from the background (but of `mog2`), from the frame before.
        pub threshold: usize = 25, in 1..=254, unit "codes", source "ours";
        /// Of `mog2`: squared distance from a Gaussian, in variances, up to which a value is background.
        pub background_distance: f64 = 36.0, in above(0.0).at_most(1e4), source "ours; zivkovic2006: 16";
        /// Of `mog2`: squared distance, in variances, up to which a value belongs to a Gaussian.
        pub match_distance: f64 = 25.0, in above(0.0).at_most(1e4), source "ours; zivkovic2006: 9";
        /// Of `mog2`: the Gaussians that together weigh this are background.
        pub background_ratio: f64 = 0.7, in 0.0..=1.0, source "ours; OpenCV: 0.9";
        /// Of `mog2`: how dark a shadow may be against the background. 1: shadows are foreground.
        pub shadow_ratio: f64 = 0.75, in above(0.0).at_most(1.0), source "ours; OpenCV: 0.5";
        /// Radius of the opening that removes noise.
        pub opening: f64 = 0.0025, in 0.0..=0.1, unit "frame heights", source "ours";
        /// Radius of the closing that joins the parts of a thing, after that.
        pub closing: f64 = 0.004, in 0.0..=0.1, unit "frame heights", source "ours";
        /// Regions above one another that are no farther apart are one thing.
        pub join: f64 = 0.06, in 0.0..=1.0, unit "of the height of both together", source "ours";
        /// Regions that a side of the picture cuts are one thing when they are no farther apart than this: what is between them may
        /// be outside.
        pub join_cut: f64 = 0.5, in 0.0..=1.0, unit "of the height of both together", source "ours";
        /// Regions are above one another when they share this much of the narrower one's width.
        pub above: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// A thing's parts may be this many times smaller than the least area.
        pub parts: f64 = 4.0, in 1.0..=1000.0, source "ours";
        /// Of `median`: samples of the past, spread over `history_s`.
        pub samples: usize = 25, in 1..=255, source "ours";
        /// What nobody follows starts a target only when this share of its pixels has changed, by `threshold`, since the frame
        /// before: it moves.
        pub stirred: f64 = 0.05, in 0.0..=1.0, source "ours";
        /// The background is trusted, and what moves is told, after so many frames.
        pub settled_frames: usize = 5, in 1..=10_000, unit "frames", source "ours";
        /// Ghosts: background that a thing uncovers.
        pub ghost: GhostParams = GhostParams::default();
        /// Another light on the background.
        pub shade: ShadeParams = ShadeParams::default();
        /// Several targets in one region.
        pub grouping: GroupingParams = GroupingParams::default();
        /// What starts a target.
        pub start: StartParams = StartParams::default();
        /// Colours, by which one is told from another.
        pub colors: ColorsParams = ColorsParams::default();
        /// Steps of the light.
        pub light: LightParams = LightParams::default();
        /// The matching rule.
        pub rule: MatchingParams = MatchingParams::default();
    }
}

pursuit_parameters::parameters! {
    /// How the background that a thing uncovers is told from a thing.
    pub struct GhostParams {
        /// A region is a ghost when the background has this many times the edges that the frame has along its outline.
        pub ratio: f64 = 1.6, in above(1.0), source "ours";
        /// … and this many times those that the background has beside it.
        pub own: f64 = 1.3, in 0.0.., source "ours";
        /// Edges weaker than this, summed over the channels, are noise in both.
        pub noise: f64 = 6.0, in above(0.0), unit "codes", source "ours";
        /// Edges are looked for between pixels so far to either side: a mask is seldom exact to the pixel.
        pub reach_px: usize = 2, in 1..=64, unit "px", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// How another light on the background is told from a thing before it: by the grain of the background, the differences between
    /// neighbouring pixels.
    pub struct ShadeParams {
        /// How alike the grain of the frame must be to that of the background (the cosine of the angle between both). Above 1: nothing
        /// is taken for another light.
        pub alike: f64 = 0.4, in 0.0..=2.0, source "ours";
        /// Least grain, as root mean square: what is plainer tells nothing.
        pub grain: f64 = 1.5, in 0.0..=255.0, unit "codes", source "ours";
        /// The side of the blocks in which it is looked for.
        pub block: f64 = 0.02, in above(0.0).at_most(1.0), unit "frame heights", source "ours";
        /// Least gain of the light.
        pub darkest: f64 = 0.2, in 0.0..=1.0, source "ours";
        /// Greatest gain of the light.
        pub brightest: f64 = 1.8, in 1.0..=100.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// How a region in which several targets are expected is divided among them.
    pub struct GroupingParams {
        /// A target of whose expected box this share lies in a region has a part in it.
        pub share: f64 = 0.5, in above(0.0).at_most(1.0), source "ours";
        /// Of several, one that is expected to be less than this share of the largest has no part in it: it is a part of another.
        pub peer: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// Pixels farther from the expected centre than this are nobody's.
        pub reach: f64 = 0.7, in above(0.0), unit "widths and heights", source "ours";
        /// A part of less than this share of the expected box's area is no sight of the target.
        pub least_part: f64 = 0.25, in 0.0..=1.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// How it is said what somebody wears: histograms of colours, band by band from head to feet.
    pub struct ColorsParams {
        /// Bands above one another, each with a histogram of its own, 3 for people; 0: nothing is said of colours.
        pub bands: usize = 0, in 0..=16, source "ours";
        /// Bins a channel.
        pub bins: usize = 6, in 2..=8, source "ours";
        /// Where less stands out nothing is said.
        pub least_px: usize = 40, in 1..=1_000_000, unit "px", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// What may start a target.
    pub struct StartParams {
        /// Overlap (IoU) with a target from which on a region is that target.
        pub known: f64 = 0.3, in 0.0..=1.0, source "ours";
        /// A region of which more than this share lies within a target's box is a part of it, or its shadow.
        pub part: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// So is one that is smaller than this share of the box …
        pub small: f64 = 0.35, in 0.0..=1.0, source "ours";
        /// … and no farther from it than this.
        pub near: f64 = 0.1, in 0.0.., unit "of the box's sides", source "ours";
        /// What the confidence in something new that does not move is worth.
        pub still: f64 = 0.49, in 0.0..=1.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// When the light has changed, not the scene.
    pub struct LightParams {
        /// Share of the picture that must have changed.
        pub changed: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// Share of what changed that one gain must explain.
        pub explained: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Share of the picture from which on the background is learnt anew whatever the reason.
        pub replaced: f64 = 0.8, in 0.0..=1.0, source "ours";
        /// How near a pixel must be to what the gain says.
        pub tolerance: usize = 20, in 0..=255, unit "codes", source "ours";
        /// Whether the camera's exposure is followed in every frame, by a gain and an offset a channel between the background in
        /// sight and the frame.
        pub exposure: bool = true, source "ours";
        /// How far a camera that shakes may shift the picture; 0: it stands still.
        pub shake: f64 = 0.015, in 0.0..=0.1, unit "of the longer side", source "ours";
        /// Standard deviation of the sensor's noise that is tolerated: where there is more, every pixel is seen as the mean of those
        /// about it, of as many as bring the noise down to this; 0: frames are seen as they are.
        pub noise: f64 = 4.0, in 0.0..=255.0, unit "codes", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The matching rule of qu2010, section 2: the ranges in which the features of a region lie. The paper names the
    /// features; the ranges are ours.
    pub struct MatchingParams {
        /// Least area.
        pub least_area: f64 = 0.0012, in 0.0..=1.0, unit "of the frame", source "ours";
        /// Greatest area.
        pub most_area: f64 = 0.5, in 0.0..=1.0, unit "of the frame", source "ours";
        /// Least perimeter.
        pub least_perimeter: f64 = 0.1, in 0.0.., unit "frame heights", source "ours";
        /// Greatest perimeter.
        pub most_perimeter: f64 = 12.0, in 0.0.., unit "frame heights", source "ours";
        /// Least height over width. Doors, cars and shadows along the floor are wider than high.
        pub least_aspect: f64 = 0.5, in 0.0.., source "ours";
        /// Greatest height over width.
        pub most_aspect: f64 = 8.0, in 0.0.., source "ours";
        /// Least perimeter²/area: a disk has 13.
        pub least_complexity: f64 = 10.0, in 0.0.., source "ours";
        /// Greatest perimeter²/area: noise and seams of light are ragged or thin.
        pub most_complexity: f64 = 150.0, in 0.0.., source "ours";
    }
    ordered {
        least_area <= most_area,
        least_perimeter <= most_perimeter,
        least_aspect <= most_aspect,
        least_complexity <= most_complexity,
    }
}

impl MatchingParams {
    /// The ranges in pixels of a frame.
    pub(super) fn ranges(&self, frame: Size) -> FeatureRanges {
        let (area, height) = (frame.area() as f64, frame.height as f64);
        FeatureRanges {
            area_px: self.least_area * area..=self.most_area * area,
            perimeter_px: self.least_perimeter * height..=self.most_perimeter * height,
            aspect_ratio: self.least_aspect..=self.most_aspect,
            complexity: self.least_complexity..=self.most_complexity,
        }
    }
}

impl MotionDetectorParams {
    pub(super) fn lighting(&self) -> LightingParams {
        LightingParams {
            changed: self.light.changed,
            explained: self.light.explained,
            replaced: self.light.replaced,
            tolerance: self.light.tolerance.min(255) as u8,
            settled_frames: u32::try_from(self.settled_frames).unwrap_or(u32::MAX),
            exposure: self.light.exposure,
            shake: self.light.shake,
            noise: self.light.noise,
        }
    }

    pub(super) fn mog2(&self) -> Mog2Params {
        Mog2Params {
            background_distance: self.background_distance,
            match_distance: self.match_distance,
            background_ratio: self.background_ratio,
            shadow_ratio: (self.shadow_ratio < 1.0).then_some(self.shadow_ratio),
            ..Mog2Params::default()
        }
    }

    pub(super) fn average(&self) -> RunningAverageParams {
        RunningAverageParams { threshold: self.codes(), ..RunningAverageParams::default() }
    }

    /// A sample at each call of the model that learns: how often that is, [`sample_s`](Self::sample_s) says.
    pub(super) fn median(&self) -> TemporalMedianParams {
        TemporalMedianParams { samples: self.samples, every: 1, threshold: self.codes() }
    }

    /// Time between samples of the median.
    pub(super) fn sample_s(&self) -> f64 {
        self.history_s / self.samples as f64
    }

    /// Radii of the opening and of the closing in a mask of so many rows, in pixels.
    pub(super) fn radii(&self, rows: usize) -> (usize, usize) {
        let radius = |share: f64| (share * rows as f64).round() as usize;
        (radius(self.opening), radius(self.closing))
    }

    /// How far from what stands out of it the background of so many rows is looked at, in pixels: beside outlines, of what a closing has
    /// filled too.
    pub(super) fn reach_px(&self, rows: usize) -> usize {
        let (open, close) = self.radii(rows);
        open + close + ghost::farthest_px(&self.ghost)
    }

    pub(super) fn codes(&self) -> u8 {
        self.threshold.min(254) as u8
    }
}
