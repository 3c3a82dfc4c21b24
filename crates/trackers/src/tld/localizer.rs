use super::cascade::{Candidate, Cascade, Knowledge};
use super::clusters::{Cluster, Clusters, mean};
use super::ferns::Ferns;
use super::grid::Grid;
use super::learning::{Learner, Scratch};
use super::params::TldParams;
use super::view::View;
use crate::appearance::{ObjectModel, Similarity};
use crate::correlation::probability;
use crate::flow::Follower;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{Diagnostics, Localizer, LocalizerRecipe, Measurement, Outcome, Result, Search, Weighed};
use serde::{Deserialize, Serialize};

/// Tracking-learning-detection: a follower of points and a detector, each putting the other right (kalal2012).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct TldLocalizer {
    params: TldParams,
    view: View,
    follower: Follower,
    ferns: Ferns,
    model: ObjectModel,
    /// Windows of less variance are left out, grey codes squared.
    least_variance: f64,
    random: u64,
    /// Whether the trajectory is trusted enough to be learned from.
    valid: bool,
    /// Frames since the motion model was started anew.
    since_restart: usize,
    grid: Grid,
    scratch: Work,
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Work {
    cascade: Cascade,
    clusters: Clusters,
    learning: Scratch,
}

/// What is stored.
#[derive(Clone, Serialize, Deserialize)]
struct Raw {
    params: TldParams,
    view: View,
    follower: Follower,
    ferns: Ferns,
    model: ObjectModel,
    least_variance: f64,
    random: u64,
    valid: bool,
    since_restart: usize,
    frame: (usize, usize),
}

impl From<TldLocalizer> for Raw {
    fn from(it: TldLocalizer) -> Self {
        let TldLocalizer { params, view, follower, ferns, model, least_variance, random, valid, since_restart, .. } =
            it;
        let frame = (it.grid.frame().width, it.grid.frame().height);
        Self { params, view, follower, ferns, model, least_variance, random, valid, since_restart, frame }
    }
}

impl TryFrom<Raw> for TldLocalizer {
    type Error = String;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, view, follower, ferns, model, least_variance, random, valid, since_restart, frame } = raw;
        params.check_all().map_err(|(name, problem)| format!("`{name}` {problem}"))?;
        let side = params.neighbor.side;
        if !ferns.fits(&params.ferns) || model.patch_len() != side * side || least_variance.is_nan() {
            return Err("its classifiers do not fit its parameters".to_owned());
        }
        let grid = Grid::new(Size::new(frame.0, frame.1), view.window_size(), &params.scan);
        let scratch = Work::default();
        Ok(Self { params, view, follower, ferns, model, least_variance, random, valid, since_restart, grid, scratch })
    }
}

impl LocalizerRecipe for TldParams {
    type Localizer = TldLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<TldLocalizer> {
        let view = View::new(&bbox);
        let grid = Grid::new(frame.size(), view.window_size(), &self.scan);
        let follower = Follower::new(self.flow.clone(), frame, bbox)?;
        let mut random = self.learning.seed;
        let mut ferns = Ferns::new(&self.ferns, &mut random);
        let side = self.neighbor.side;
        let mut model = ObjectModel::new(side * side, self.neighbor.capacity, random);
        let mut scratch = Work::default();
        let (gray, window) = (frame.gray(), view.window(&bbox));
        scratch.cascade.prepare(gray, &window, 1.0);
        let least_variance = self.ferns.variance * scratch.cascade.variance(&window);
        let mut learner = Learner {
            params: self,
            grid: &grid,
            ferns: &mut ferns,
            model: &mut model,
            least_variance,
            random: &mut random,
            scratch: &mut scratch.learning,
        };
        learner.bootstrap(&mut scratch.cascade, gray, &window);
        let params = self.clone();
        let (valid, since_restart) = (true, 0);
        Ok(TldLocalizer {
            params,
            view,
            follower,
            ferns,
            model,
            least_variance,
            random,
            valid,
            since_restart,
            grid,
            scratch,
        })
    }
}

/// What follower and detector agreed on.
#[derive(Debug, Clone, Copy)]
struct Joined {
    /// A window, which may be larger than the target.
    window: BBox,
    similarity: Similarity,
    /// Whether the trajectory goes on being trusted.
    valid: bool,
    /// Whether it is where the points went.
    followed: bool,
    /// Whether follower and detector agree.
    agreed: bool,
}

impl TldLocalizer {
    /// What the object looks like, and what does not.
    pub const fn model(&self) -> &ObjectModel {
        &self.model
    }

    /// Number of windows of a whole scan.
    pub fn windows(&self) -> usize {
        self.grid.windows()
    }

    /// The integrator (kalal2012, section 5.6).
    fn join(&mut self, frame: &Frame, followed: Option<BBox>, search: &Search) -> Option<Joined> {
        let Self { params, view, ferns, model, least_variance, valid, grid, scratch, .. } = self;
        let known = Knowledge { params, grid, ferns, model, least_variance: *least_variance };
        let (gray, form, integrator) = (frame.gray(), params.neighbor.similarity, &params.integrator);
        let Work { cascade, clusters, .. } = scratch;
        let (region, expected) = (view.region(&search.region), view.window(&search.expected));
        cascade.scan(gray, &known, &region, &expected, params.ferns.most_windows);
        cascade.judge(gray, &known);
        let followed = followed.map(|bbox| cascade.refine(gray, &known, &view.window(&bbox)));
        let followed = followed.filter(|(_, s)| s.conservative(form) >= params.neighbor.followed);
        let detections = detections(cascade.candidates(), params);
        let clusters = clusters.of(detections, form, integrator.same_from);
        let Some((window, similarity)) = followed else {
            let only = outstanding(clusters, params)?;
            let (window, similarity) = cascade.refine(gray, &known, &only.bbox);
            return Some(Joined { window, similarity, valid: false, followed: false, agreed: false });
        };
        let sure = similarity.conservative(form);
        let better = |c: &Cluster| c.bbox.iou(&window) < integrator.elsewhere && c.similarity.conservative(form) > sure;
        if let Some(other) = outstanding(clusters, params).filter(|c| better(c)) {
            let (window, similarity) = cascade.refine(gray, &known, &other.bbox);
            return Some(Joined { window, similarity, valid: false, followed: false, agreed: false });
        }
        let near = || detections.iter().map(|d| d.window).filter(|w| w.iou(&window) > integrator.near);
        let agreed = near().next().is_some();
        let all = near().map(|w| (w, 1.0)).chain([(window, integrator.followed_weight)]);
        let window = mean(all).unwrap_or(window);
        let valid = (*valid || sure > params.neighbor.valid) && sure >= params.neighbor.invalid;
        Some(Joined { window, similarity, valid, followed: true, agreed })
    }

    fn measurement(&self, joined: &Joined) -> Measurement {
        let form = self.params.neighbor.similarity;
        let (conservative, relative) = (joined.similarity.conservative(form), joined.similarity.relative(form));
        let score = &self.params.score;
        let log_odds = score.bias
            + score.conservative * conservative
            + score.relative * relative
            + score.valid * f64::from(joined.valid);
        let (positives, negatives) = self.model.len();
        let cascade = &self.scratch.cascade;
        Measurement {
            valid: joined.valid,
            diagnostics: Diagnostics::default()
                .with("conservative", conservative)
                .with("relative", relative)
                .with("valid", f64::from(joined.valid))
                .with("followed", f64::from(joined.followed))
                .with("agreed", f64::from(joined.agreed))
                .with("windows", cascade.windows() as f64)
                .with("candidates", cascade.candidates().len() as f64)
                .with("patches", (positives + negatives) as f64),
            ..Measurement::new(self.view.bbox(&joined.window), probability(log_odds))
        }
    }
}

/// The group that resembles the object most, unless another resembles it nearly as much: places that look alike are none.
fn outstanding<'a>(clusters: &'a [Cluster], params: &TldParams) -> Option<&'a Cluster> {
    let sure = |c: &Cluster| c.similarity.conservative(params.neighbor.similarity);
    let best = clusters.iter().max_by(|a, b| sure(a).total_cmp(&sure(b)))?;
    let rivals = clusters.iter().filter(|c| sure(c) >= sure(best) - params.neighbor.margin).count();
    (rivals == 1).then_some(best)
}

/// The candidates that the classifier takes for the object; they come first.
fn detections<'a>(candidates: &'a [Candidate], params: &TldParams) -> &'a [Candidate] {
    let (form, threshold) = (params.neighbor.similarity, params.neighbor.threshold);
    let count = candidates.iter().take_while(|c| c.similarity.relative(form) > threshold).count();
    candidates.get(..count).unwrap_or_default()
}

impl Localizer for TldLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let followed = self.follower.follow(frame)?.map(|motion| motion.bbox);
        let joined = self.join(frame, followed, search);
        Ok(joined.map(|joined| self.measurement(&joined)))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, measurement: &Measurement) -> Result<()> {
        if !measurement.valid || bbox.clipped_to(frame.size()).is_none() {
            return Ok(());
        }
        let window = self.view.window(&bbox);
        let mut learner = Learner {
            params: &self.params,
            grid: &self.grid,
            ferns: &mut self.ferns,
            model: &mut self.model,
            least_variance: self.least_variance,
            random: &mut self.random,
            scratch: &mut self.scratch.learning,
        };
        learner.update(&mut self.scratch.cascade, frame.gray(), &window);
        Ok(())
    }

    /// Whether the filtered box is to replace the one followed, or the filter is to start anew (zhu2014, claim 3).
    fn weigh(&mut self, frame: &Frame, _: &Measurement, filtered: &BBox) -> Result<Weighed> {
        let guide = &self.params.guide;
        if guide.restart_every > 0 && self.since_restart >= guide.restart_every {
            self.since_restart = 0;
            return Ok(Weighed::Restarted);
        }
        if guide.replace_above > 1.0 && guide.restart_below <= 0.0 {
            return Ok(Weighed::Measured);
        }
        let Self { params, view, ferns, model, least_variance, grid, scratch, .. } = self;
        let known = Knowledge { params, grid, ferns, model, least_variance: *least_variance };
        let similarity = scratch.cascade.similarity(frame.gray(), &known, &view.window(filtered));
        let sure = similarity.conservative(params.neighbor.similarity);
        Ok(if sure > params.guide.replace_above {
            Weighed::Filtered
        } else if sure < params.guide.restart_below {
            self.since_restart = 0;
            Weighed::Restarted
        } else {
            Weighed::Measured
        })
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_>) -> Result<()> {
        self.since_restart = self.since_restart.saturating_add(1);
        let followed = outcome.found.zip(outcome.followed);
        self.valid = followed.is_some_and(|(m, _)| m.valid);
        followed.map_or(Ok(()), |(_, bbox)| self.follower.keep(frame, bbox))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = self.params.localizer(frame, bbox)?;
        Ok(())
    }
}
