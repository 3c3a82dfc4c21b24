//! A mask that guides a correlation filter: what it learns, and how large the target is.

use super::localizer::{CorrelationLocalizer, untaught};
use super::search_window::SearchWindow;
use super::spec::in_cells;
use crate::appearance::Support;
use crate::masks::{AnySegmenter, MaskModel, MaskParams};
use pursuit_geometry::{BBox, Mask, Point, Size};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::{Result, TrackState};
use serde::{Deserialize, Serialize};

/// A mask moves the size by at most this factor per frame.
const MOST_GROWTH: f64 = 1.1;
/// Points along a side of a cell that are asked for.
const POINTS: usize = 2;

pursuit_parameters::parameters! {
    /// A mask of the target that guides the filter. A mask whose share of the box is not about as usual is not believed: then the
    /// filter is learnt from the whole box, and the size is the other means'.
    pub struct GuideParams {
        /// Whether the filter is confined to the target's pixels.
        pub learning: bool = true, source "lukezic2017, section 3.1";
        /// How far the filter reaches beyond the target's pixels.
        pub margin: usize = 2, in 0..=16, unit "cells", source "lukezic2017, released code: 1; ours: 2";
        /// How far the size follows the mask's area: 0 not at all, 1 as the area says.
        pub size: f64 = 0.0, in 0.0..=1.0, source "ours";
        /// A mask is believed where its share of the box is at most this many times the usual one, and at least that part of it.
        pub believed_within: f64 = 2.0, in 1.0..=100.0, source "ours";
        /// Share of a believed mask in the usual share of the box.
        pub usual_rate: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// Which pixels are the target's.
        pub mask: MaskParams = MaskParams { model: MaskModel::Colors, ..MaskParams::default() };
    }
}

impl GuideParams {
    /// The box itself: no mask, nothing beyond it.
    pub fn none() -> Self {
        Self { margin: 0, mask: MaskParams::default(), ..Self::default() }
    }
}

/// What guides.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Guide")]
pub(super) struct Guide {
    params: GuideParams,
    /// `None` where nothing says which pixels are the target's.
    segmenter: Option<AnySegmenter>,
    /// The usual share of the box that is the target's; `None` before the first mask.
    usual: Option<f64>,
}

pursuit_estimation::checked!(Guide);

impl Guide {
    fn restored(self) -> Result<Self, &'static str> {
        let sound = self.params.check_all().is_ok() && self.usual.is_none_or(|share| share > 0.0 && share.is_finite());
        if sound { Ok(self) } else { Err("its guide is out of range") }
    }

    /// One for the target at `bbox`.
    fn new(params: &GuideParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let segmenter = params.mask.segmenter("guide.mask", frame, &bbox)?;
        Ok(Self { params: params.clone(), segmenter, usual: None })
    }

    /// Whether the size follows the mask.
    pub(super) fn sizes(&self) -> bool {
        self.params.size > 0.0
    }

    /// The mask of the target at `bbox`, if it is to be believed, and its share of the box.
    fn look(&mut self, frame: &Frame, bbox: &BBox, state: TrackState) -> Result<Option<(Mask, f64)>> {
        let Some(seen) = bbox.clipped_to(frame.size()) else { return Ok(None) };
        let Some(segmenter) = &mut self.segmenter else { return Ok(None) };
        let mask = segmenter.look(frame, bbox, state)?;
        Ok(mask.and_then(|mask| {
            let share = mask.area() as f64 / seen.area().max(1.0);
            let ratio = self.usual.map_or(1.0, |usual| share / usual);
            let within = 1.0 / self.params.believed_within..=self.params.believed_within;
            (share > 0.0 && within.contains(&ratio)).then_some((mask, share))
        }))
    }
}

/// The cells of `window` at `center` and `scale` that `mask` covers by half and more, of cells of `cell_px`.
fn cells_of(mask: &Mask, window: &SearchWindow, (center, scale): (Point, f64), cell_px: usize, grid: Size) -> Vec<f32> {
    let (step, patch) = (window.step(scale), window.patch());
    let part = cell_px as f64 / POINTS as f64;
    // Where the `k`-th part of a cell's side is, in pixels of the frame.
    let at = |middle: f64, cell: usize, k: usize, side: usize| {
        middle + ((cell * cell_px) as f64 + (k as f64 + 0.5) * part - side as f64 / 2.0) * step
    };
    let is_set = |x: f64, y: f64| x >= 0.0 && y >= 0.0 && mask.contains(x as u32, y as u32);
    let cell = |k: usize| {
        let (column, row) = (k % grid.width, k / grid.width);
        let points = (0..POINTS * POINTS).filter(|p| {
            is_set(at(center.x, column, p % POINTS, patch.width), at(center.y, row, p / POINTS, patch.height))
        });
        if 2 * points.count() >= POINTS * POINTS { 1.0 } else { 0.0 }
    };
    (0..grid.area()).map(cell).collect()
}

/// The cells of a plane that are `margin` cells or less from one that is 1, along either side.
fn grown(cells: &[f32], grid: Size, margin: usize) -> Vec<f32> {
    let near = |at: usize, side: usize| at.saturating_sub(margin)..(at + margin + 1).min(side);
    let is_near = |k: usize| {
        let (x, y) = (k % grid.width, k / grid.width);
        near(y, grid.height).any(|y| near(x, grid.width).any(|x| cells[y * grid.width + x] > 0.0))
    };
    (0..grid.area()).map(|k| if is_near(k) { 1.0 } else { 0.0 }).collect()
}

impl CorrelationLocalizer {
    /// The same, which has just been started on the target at `bbox`, guided by a mask.
    ///
    /// # Errors
    /// When what makes the mask cannot be had or cannot be run.
    pub fn guided(mut self, params: &GuideParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        // A mask that guides nothing is not made.
        if (params.learning || params.size > 0.0) && (params.mask.model != MaskModel::None || params.margin > 0) {
            self.start_guide(Guide::new(params, frame, bbox)?, frame, &bbox)?;
        }
        Ok(self)
    }

    /// Starts a guide that was another target's anew.
    pub(super) fn restart_guide(&mut self, mut guide: Guide, frame: &Frame, bbox: BBox) -> Result<()> {
        use pursuit_tracking::Segmenter;
        if let Some(segmenter) = &mut guide.segmenter {
            segmenter.restart(frame, bbox)?;
        }
        guide.usual = None;
        self.start_guide(guide, frame, &bbox)
    }

    /// Learns the target's first picture again, of the cells that the guide says.
    fn start_guide(&mut self, guide: Guide, frame: &Frame, bbox: &BBox) -> Result<()> {
        self.guide = Some(Box::new(guide));
        self.filter = untaught(&self.spec, &self.window, &self.scratch.features);
        self.confine(frame, bbox)?;
        self.scratch.extract(frame, &self.window.window(bbox.center(), self.window.scale_of(bbox)));
        self.filter.learn(&self.scratch.windowed, 1.0);
        Ok(())
    }

    /// Asks the guide what of the target at `bbox` the filter is to learn.
    pub(super) fn confine(&mut self, frame: &Frame, bbox: &BBox) -> Result<()> {
        let Some(guide) = &mut self.guide else { return Ok(()) };
        let found = guide.look(frame, bbox, TrackState::Tracking)?;
        if let Some((_, share)) = &found {
            let usual = guide.usual.get_or_insert(*share);
            *usual += guide.params.usual_rate * (share - *usual);
        }
        let (grid, cell_px) = (self.filter.shape().0, self.scratch.features.cell_px());
        let seen = found
            .filter(|_| guide.params.learning)
            .map(|(mask, _)| cells_of(&mask, &self.window, (bbox.center(), self.window.scale_of(bbox)), cell_px, grid));
        let believed = seen.filter(|cells| cells.iter().any(|cell| *cell > 0.0));
        let whole = || Support::middle(in_cells(self.window.target_in_patch(), cell_px), grid).cells(grid);
        self.filter.confine(&grown(&believed.unwrap_or_else(whole), grid, guide.params.margin));
        Ok(())
    }

    /// The scale of the target at `center` as its mask says, from the one that was measured otherwise.
    pub(super) fn guided_scale(&mut self, frame: &Frame, center: Point, scale: f64) -> Result<f64> {
        let Some(guide) = self.guide.as_mut().filter(|guide| guide.sizes()) else { return Ok(scale) };
        let Some(usual) = guide.usual else { return Ok(scale) };
        let found = guide.look(frame, &self.window.bbox(center, scale), TrackState::Unsure)?;
        let growth = found.map_or(1.0, |(_, share)| (share / usual).sqrt().powf(guide.params.size));
        Ok(self.window.within_bounds(scale * growth.clamp(1.0 / MOST_GROWTH, MOST_GROWTH)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::filters::FilterKind;
    use crate::correlation::{CorrelationSpec, ReliabilityParams, WindowParams};
    use crate::features::FeatureKind;
    use crate::masks::MaskModel;
    use pursuit_imaging::Image;
    use pursuit_tracking::{Localizer, Look, Search};

    const SIZE: Size = Size::new(160, 120);

    /// A bright disk of this radius before stripes.
    fn disk(radius: f64) -> (Frame, BBox) {
        let center = Point::new(83.0, 61.0);
        let image = Image::from_fn(SIZE.width, SIZE.height, |x, y| {
            let inside = (x as f64 + 0.5 - center.x).hypot(y as f64 + 0.5 - center.y) < radius;
            if inside { [210, (150 + x % 3 * 10) as u8, 40] } else { [40, (60 + (x / 5 + y / 7) % 3 * 20) as u8, 90] }
        });
        (Frame::new(0, 0.0, image.unwrap()), BBox::from_center_size(center, 2.0 * radius, 2.0 * radius))
    }

    /// Without a filter along scale.
    fn localizer(guide: &GuideParams, frame: &Frame, bbox: BBox) -> CorrelationLocalizer {
        let reliable = FilterKind::Reliable(ReliabilityParams::default());
        let spec = CorrelationSpec {
            window: WindowParams { padding: 2.0, ..WindowParams::default() },
            learning_rate: 0.1,
            ..CorrelationSpec::new(FeatureKind::HogGray, reliable)
        };
        CorrelationLocalizer::new(spec, frame, &bbox).guided(guide, frame, bbox).unwrap()
    }

    fn cells(localizer: &CorrelationLocalizer) -> Vec<f32> {
        match &localizer.filter {
            crate::correlation::filters::Filter::Reliable(filter) => filter.cells().to_vec(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn cells_are_those_that_the_mask_covers() {
        let bbox = BBox::from_ltwh(60.0, 40.0, 40.0, 40.0);
        // Four times as many pixels as there are patch pixels, cells of 4 patch pixels: 8 pixels of the frame a side.
        let params =
            WindowParams { padding: 3.0, smallest_area_px: 6400.0, largest_area_px: 6400.0, ..WindowParams::default() };
        let window = SearchWindow::new(&bbox, &params, 4);
        let patch = window.patch();
        let grid = Size::new(patch.width / 4, patch.height / 4);
        let side = window.step(1.0) * 4.0;
        let (left, top) = (80.0 - side * grid.width as f64 / 2.0, 60.0 - side * grid.height as f64 / 2.0);
        let mask = Mask::from_fn(SIZE, |x, y| x > 78 && y < 63);
        let got = cells_of(&mask, &window, (bbox.center(), 1.0), 4, grid);
        for (k, cell) in got.iter().enumerate() {
            let (x, y) = (left + side * (k % grid.width) as f64, top + side * (k / grid.width) as f64);
            let covered = BBox::from_ltwh(x, y, side, side).intersection(&BBox::from_ltwh(79.0, 0.0, 81.0, 63.0));
            let share = covered.map_or(0.0, |both| both.area()) / (side * side);
            assert!((*cell > 0.0) == (share > 0.5) || (0.2..0.8).contains(&share), "cell {k}: {cell}, {share} covered");
        }
        assert!(got.iter().any(|cell| *cell > 0.0) && got.contains(&0.0));
    }

    #[test]
    fn a_margin_grows_both_ways_and_stays_on_the_grid() {
        let grid = Size::new(5, 4);
        let mut plane = vec![0.0; 20];
        plane[0] = 1.0;
        let want = |far: usize| (0..20).map(|k| f32::from(k % 5 <= far && k / 5 <= far)).collect::<Vec<_>>();
        assert_eq!(grown(&plane, grid, 0), want(0));
        assert_eq!(grown(&plane, grid, 1), want(1));
        assert_eq!(grown(&plane, grid, 9), vec![1.0; 20]);
    }

    #[test]
    fn a_disk_is_learnt_without_the_corners_of_its_box() {
        let (frame, bbox) = disk(24.0);
        let area = |params: &GuideParams| cells(&localizer(params, &frame, bbox)).iter().sum::<f32>();
        let tight = GuideParams { margin: 0, ..GuideParams::default() };
        let whole = area(&GuideParams { learning: false, ..tight.clone() });
        let share = area(&tight) / whole;
        assert!((share - std::f32::consts::FRAC_PI_4).abs() < 0.08, "{share} of {whole} cells");
        assert!(area(&GuideParams::default()) > whole * share);
        assert_eq!(area(&GuideParams { learning: false, margin: 0, ..GuideParams::default() }), whole);
    }

    #[test]
    fn a_mask_unlike_the_usual_one_is_not_believed() {
        let (frame, bbox) = disk(24.0);
        let params = GuideParams { margin: 0, believed_within: 1.5, ..GuideParams::default() };
        let mut guided = localizer(&params, &frame, bbox);
        let usual = guided.guide.as_ref().and_then(|guide| guide.usual).unwrap();
        assert!((usual - std::f64::consts::FRAC_PI_4).abs() < 0.08, "{usual}");
        // A quarter of the disk is left.
        let (small, _) = disk(12.0);
        guided.confine(&small, &bbox).unwrap();
        let whole = cells(&localizer(&GuideParams { learning: false, ..params }, &frame, bbox));
        assert_eq!(cells(&guided), whole);
        assert_eq!(guided.guide.as_ref().and_then(|guide| guide.usual), Some(usual));
        guided.confine(&frame, &bbox).unwrap();
        assert_ne!(cells(&guided), whole);
    }

    #[test]
    fn the_size_follows_the_mask_where_it_is_asked_to() {
        let (frame, bbox) = disk(22.0);
        let sides = |size: f64| {
            let mut guided = localizer(&GuideParams { size, ..GuideParams::default() }, &frame, bbox);
            let mut last = bbox;
            for k in 1..=8 {
                let (frame, _) = disk(22.0 + 0.5 * f64::from(k));
                let search = Search { expected: last, region: last, gate: None, look: Look::Near, keep_inside: false };
                let (mut found, mut finding) = guided.locate(&frame, &search).unwrap().unwrap();
                guided.refine(&frame, &search, &mut found, &mut finding).unwrap();
                guided.adapt(&frame, found.bbox, &finding).unwrap();
                last = found.bbox;
            }
            last.width()
        };
        assert!((sides(0.0) - 44.0).abs() < 1e-9);
        assert!((sides(1.0) - 52.0).abs() < 2.5, "{}", sides(1.0));
    }

    #[test]
    fn a_network_that_is_not_named_is_asked_for_by_the_guides_own_parameter() {
        let (frame, bbox) = disk(24.0);
        let mask = MaskParams { model: MaskModel::Network, ..MaskParams::default() };
        let params = GuideParams { mask, ..GuideParams::default() };
        let started = localizer(&GuideParams::none(), &frame, bbox).guided(&params, &frame, bbox);
        let error = started.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("guide.mask.network.model="), "{error}");
    }

    #[test]
    fn without_a_mask_and_a_margin_there_is_no_guide() {
        let (frame, bbox) = disk(24.0);
        assert!(localizer(&GuideParams::none(), &frame, bbox).guide.is_none());
        let mut guided = localizer(&GuideParams::default(), &frame, bbox);
        guided.restart(&frame, bbox.scaled(0.9)).unwrap();
        assert!(guided.guide.is_some_and(|guide| guide.params.mask.model == MaskModel::Colors));
    }
}
