use super::cascade::{Cascade, Knowledge, Place};
use super::clusters::Clusters;
use super::ferns::Ferns;
use super::grid::Grid;
use super::integrator::{Followed, Integrator, Joined};
use super::learning::{Learner, Scratch};
use super::params::TldParams;
use super::trust::Trust;
use super::view::View;
use crate::appearance::ObjectModel;
use crate::flow::Follower;
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::{Figure, Figures, Localizer, LocalizerRecipe, Measurement, Outcome, Result, Search, Weighed};
use serde::{Deserialize, Serialize};

/// Tracking-learning-detection: a follower of points and a detector, each putting the other right (kalal2012).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct TldLocalizer {
    state: State,
    grid: Grid,
    scratch: Work,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct State {
    params: TldParams,
    view: View,
    follower: Follower,
    ferns: Ferns,
    model: ObjectModel,
    /// Windows of less variance are left out, grey codes squared.
    least_variance: f64,
    random: u64,
    /// Frames since the motion model was started anew.
    since_restart: usize,
    /// Frames since the start, by which parts of the frame are scanned in turn.
    turn: usize,
    /// What was believed lately.
    trust: Trust,
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Work {
    cascade: Cascade,
    clusters: Clusters,
    learning: Scratch,
    /// Which scan the cascade holds, counted from the start.
    scans: u64,
}

/// What a scan found, and which one it was.
#[derive(Debug, Clone)]
pub struct TldFinding {
    joined: Joined,
    search: Search,
    scan: u64,
}

pursuit_tracking::figures! {
    /// What follower and detector say.
    struct TldFigures {
        /// Conservative similarity to the object.
        conservative;
        /// Relative similarity to the object.
        relative;
        /// Whether the trajectory is trusted, 0 or 1.
        valid;
        /// Whether the box was followed, 0 or 1; else it was detected.
        followed;
        /// Whether follower and detector agree, 0 or 1.
        agreed;
        /// Median correlation of the points' patches.
        correlation;
        /// Median forward-backward error of the points, in window sizes.
        error;
        /// Windows that were scanned.
        windows;
        /// Windows that the ferns take for the object.
        candidates;
        /// Patches that the nearest-neighbour classifier knows.
        patches;
    }
}

/// What is stored.
#[derive(Clone, Serialize, Deserialize)]
struct Raw {
    state: State,
    frame: (usize, usize),
}

impl From<TldLocalizer> for Raw {
    fn from(it: TldLocalizer) -> Self {
        Self { frame: (it.grid.frame().width, it.grid.frame().height), state: it.state }
    }
}

impl TryFrom<Raw> for TldLocalizer {
    type Error = String;

    fn try_from(Raw { state, frame }: Raw) -> Result<Self, Self::Error> {
        state.params.check_all().map_err(|(name, problem)| format!("`{name}` {problem}"))?;
        let side = state.params.neighbor.side;
        let fits = state.ferns.fits(&state.params.ferns) && state.model.patch_len() == side * side;
        if !fits || state.least_variance.is_nan() {
            return Err("its classifiers do not fit its parameters".to_owned());
        }
        let grid = Grid::new(Size::new(frame.0, frame.1), state.view.window_size(), &state.params.scan);
        Ok(Self { state, grid, scratch: Work::default() })
    }
}

impl LocalizerRecipe for TldParams {
    type Localizer = TldLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<TldLocalizer> {
        let view = View::new(&bbox, self.scan.least_view_px);
        let grid = Grid::new(frame.size(), view.window_size(), &self.scan);
        let follower = Follower::new(self.flow.clone(), frame, bbox)?;
        let mut random = self.learning.seed;
        let ferns = Ferns::new(&self.ferns, &mut random);
        let side = self.neighbor.side;
        let model = ObjectModel::new(side * side, self.neighbor.capacity, random);
        let mut scratch = Work::default();
        let (gray, window) = (frame.gray(), view.window(&bbox));
        scratch.cascade.prepare(gray, &window, 1.0);
        let least_variance = self.ferns.variance * scratch.cascade.variance(&window);
        let state = State {
            params: self.clone(),
            view,
            follower,
            ferns,
            model,
            least_variance,
            random,
            since_restart: 0,
            turn: 0,
            trust: Trust::new(),
        };
        let mut localizer = TldLocalizer { state, grid, scratch };
        let (mut learner, cascade) = localizer.learner();
        learner.bootstrap(cascade, gray, &window);
        Ok(localizer)
    }
}

impl TldLocalizer {
    /// What the object looks like, and what does not.
    pub const fn model(&self) -> &ObjectModel {
        &self.state.model
    }

    /// Number of windows of a whole scan.
    pub fn windows(&self) -> usize {
        self.grid.windows()
    }

    /// What learns, and the cascade whose last scan it learns from.
    fn learner(&mut self) -> (Learner<'_>, &mut Cascade) {
        let Self { state: State { params, ferns, model, least_variance, random, .. }, grid, scratch } = self;
        let (least_variance, scratch, cascade) = (*least_variance, &mut scratch.learning, &mut scratch.cascade);
        (Learner { params, grid, ferns, model, least_variance, random, scratch }, cascade)
    }

    /// Scans what `search` says and joins that with where the points went.
    fn join(&mut self, frame: &Frame, search: &Search) -> Result<Option<Joined>> {
        self.scratch.scans = self.scratch.scans.wrapping_add(1);
        let motion = self.state.follower.follow(frame, &search.expected)?;
        let followed = motion.map(|m| {
            let window = self.state.view.window(&m.bbox);
            Followed { window, correlation: m.correlation, error: m.forward_backward_px / window.area().sqrt() }
        });
        let Self { state: State { params, view, ferns, model, least_variance, trust, turn, .. }, grid, scratch } = self;
        let known = Knowledge { params, grid, ferns, model, least_variance: *least_variance };
        let (region, expected) = (view.region(&search.region), view.window(&search.expected));
        let at = Place { region, expected, turn: Some(*turn) };
        scratch.cascade.scan(frame.gray(), &known, &at, params.ferns.most_windows);
        let compares = turn.is_multiple_of(params.neighbor.compare_every);
        let integrator = Integrator { known, trust, compares };
        Ok(integrator.join(frame.gray(), followed, &mut scratch.cascade, &mut scratch.clusters))
    }

    fn measurement(&self, joined: &Joined) -> Measurement {
        let form = self.state.params.neighbor.similarity;
        let (conservative, relative) = (joined.similarity.conservative(form), joined.similarity.relative(form));
        let log_odds = self.state.params.score.bias + self.state.params.score.conservative * conservative;
        let (positives, negatives) = self.state.model.len();
        let cascade = &self.scratch.cascade;
        Measurement {
            diagnostics: TldFigures {
                conservative,
                relative,
                valid: f64::from(joined.valid),
                followed: f64::from(joined.followed.is_some()),
                agreed: f64::from(joined.agreed),
                correlation: joined.followed.map_or(0.0, |f| f.correlation),
                error: joined.followed.map_or(0.0, |f| f.error),
                windows: cascade.windows() as f64,
                candidates: cascade.candidates().len() as f64,
                patches: (positives + negatives) as f64,
            }
            .into(),
            ..Measurement::new(self.state.view.bbox(&joined.window), sigmoid(log_odds))
        }
    }
}

impl Localizer for TldLocalizer {
    type Finding = TldFinding;

    const FIGURES: &[&[Figure]] = &[TldFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, TldFinding)>> {
        let Some(joined) = self.join(frame, search)? else { return Ok(None) };
        let finding = TldFinding { joined, search: search.clone(), scan: self.scratch.scans };
        Ok(Some((self.measurement(&joined), finding)))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &TldFinding) -> Result<()> {
        if !finding.joined.valid || bbox.clipped_to(frame.size()).is_none() {
            return Ok(());
        }
        if self.scratch.scans != finding.scan {
            // The candidates to learn from are those of another look: they are found once more.
            self.join(frame, &finding.search)?;
        }
        let window = self.state.view.window(&bbox);
        let (mut learner, cascade) = self.learner();
        learner.update(cascade, frame.gray(), &window);
        Ok(())
    }

    /// Whether the filtered box is to replace the one followed, or the filter is to start anew (zhu2014, claim 3).
    fn weigh(&mut self, frame: &Frame, finding: &TldFinding, filtered: &BBox) -> Result<Weighed> {
        let guide = &self.state.params.guide;
        if guide.restart_every > 0 && self.state.since_restart >= guide.restart_every {
            self.state.since_restart = 0;
            return Ok(Weighed::Restarted);
        }
        if guide.replace_above > 1.0 && guide.restart_below <= 0.0 {
            return Ok(Weighed::Measured);
        }
        let Self { state: State { params, view, ferns, model, least_variance, .. }, grid, scratch } = self;
        let known = Knowledge { params, grid, ferns, model, least_variance: *least_variance };
        let similarity = scratch.cascade.similarity(frame.gray(), &known, &view.window(filtered));
        let sure = similarity.conservative(params.neighbor.similarity);
        let found = finding.joined.similarity.conservative(params.neighbor.similarity);
        let least = if params.guide.no_worse { found } else { 0.0 };
        Ok(if sure > params.guide.replace_above && sure >= least {
            Weighed::Filtered
        } else if sure < params.guide.restart_below {
            self.state.since_restart = 0;
            Weighed::Restarted
        } else {
            Weighed::Measured
        })
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, TldFinding>) -> Result<()> {
        self.state.since_restart = self.state.since_restart.saturating_add(1);
        self.state.turn = self.state.turn.wrapping_add(1);
        let followed = outcome.found.zip(outcome.followed);
        let joined = followed.map(|((_, finding), _)| &finding.joined);
        self.state.trust.take(joined, outcome.state, outcome.dt_s, &self.state.params.neighbor);
        followed.map_or(Ok(()), |(_, bbox)| self.state.follower.keep(frame, bbox))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = self.state.params.localizer(frame, bbox)?;
        Ok(())
    }
}
