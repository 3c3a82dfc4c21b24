//! What a run begins with: boxes, a detector, or what an earlier run left.

use crate::RunError;
use crate::config::{ACQUIRE_PREFIX, MANY_PREFIX, Methods, RunConfig};
use crate::run::RecipeFacts;
use crate::session::Session;
use pursuit_geometry::{BBox, Truth};
use pursuit_parameters::Parameters;
use pursuit_trackers::registry;
use pursuit_tracking::MultiTracker;
use pursuit_tracking::many::{Acquiring, Associating, TargetSet};

/// What stands for the detector in `run.json` where a file says what is found.
const FROM_FILE: &str = "detections";

/// What starts a run that has both the truth's first box and a detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preference {
    Truth,
    Detector,
}

/// How a run gets its first targets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Start {
    /// In the frame of this number.
    Boxes(Vec<BBox>, u64),
    Detector,
    Many(Vec<BBox>),
}

impl Start {
    /// Boxes given, else the truth's first box from the first frame on, else the detector. Where everything that the detector
    /// finds is followed, the truth's box says nothing.
    pub fn choose(
        config: &RunConfig,
        truth: Option<&[Truth]>,
        prefer: Preference,
        input: &str,
    ) -> Result<Self, RunError> {
        let (boxes, detector) = (config.start_boxes(), config.detects());
        if config.follows_all() {
            return Ok(Self::Many(boxes));
        }
        if !boxes.is_empty() {
            return Ok(Self::Boxes(boxes, 0));
        }
        let from = config.from.unwrap_or(0);
        // A target that is not there yet is followed from when it comes.
        let known = (0..).zip(truth.unwrap_or_default()).skip_while(|(frame, _)| *frame < from);
        match known.into_iter().find_map(|(frame, truth)| Some((frame, truth.bbox()?))) {
            Some((frame, bbox)) if prefer == Preference::Truth || !detector => Ok(Self::Boxes(vec![bbox], frame)),
            _ if detector => Ok(Self::Detector),
            _ => Err(RunError::usage(format!(
                "nothing to track in {input}: give a box, `--box LEFT,TOP,WIDTH,HEIGHT` in pixels of frame {from}, or a detector, `--detect ball`"
            ))),
        }
    }

    /// The tracker with every parameter, and what starts it.
    pub fn recipe_facts(&self, config: &RunConfig, methods: &Methods) -> Result<RecipeFacts, RunError> {
        let boxes = match self {
            Self::Boxes(boxes, _) | Self::Many(boxes) => boxes.as_slice(),
            Self::Detector => &[],
        };
        let detects = !matches!(self, Self::Boxes(..));
        let acquire = matches!(self, Self::Detector).then(|| methods.acquire.to_table(ACQUIRE_PREFIX));
        let many = matches!(self, Self::Many(_)).then(|| methods.many.to_table(MANY_PREFIX));
        Ok(RecipeFacts {
            tracker: methods.recipe.name().to_owned(),
            parameters: methods.recipe.parameters()?,
            detector: config
                .detect
                .clone()
                .or_else(|| config.detections.as_ref().map(|_| FROM_FILE.to_owned()))
                .filter(|_| detects),
            detector_parameters: methods.detector_parameters.clone().filter(|_| detects),
            acquire: acquire.transpose()?,
            many: many.transpose()?,
            boxes: boxes.iter().map(|b| b.ltwh().into()).collect(),
        })
    }

    /// Tells the session what to follow.
    pub fn begin(self, session: Session, methods: Methods, config: &RunConfig) -> Result<Session, RunError> {
        Ok(match (self, methods.detector) {
            (Self::Detector, Some(detector)) => session.finding(detector, methods.acquire)?,
            (Self::Many(boxes), Some(detector)) => {
                let mut targets = Associating::new(detector, methods.many)?;
                if config.tracker.is_some() {
                    targets = targets.with_appearance(methods.recipe);
                }
                session.following(Box::new(targets)).starting_on(boxes)
            }
            (Self::Boxes(boxes, frame), _) => session.starting_at(frame, boxes),
            (Self::Many(boxes), None) => session.starting_on(boxes),
            // Nothing starts by a detector that is not there.
            (Self::Detector, None) => session,
        })
    }

    /// Gives the session the targets of an earlier one.
    pub fn go_on(&self, session: Session, state: &[u8], methods: Methods) -> Result<Session, RunError> {
        let recipe_of = |name: &str| registry::tracker(name).map(|entry| entry.default_recipe());
        let targets: Box<dyn MultiTracker> = match (self, methods.detector) {
            (Self::Detector, Some(detector)) => Box::new(Acquiring::restore(state, detector, &recipe_of)?),
            (Self::Many(_), Some(detector)) => Box::new(Associating::restore(state, detector, &recipe_of)?),
            _ => Box::new(TargetSet::restore(state, &recipe_of)?),
        };
        Ok(session.continuing(targets, !matches!(self, Self::Many(_))))
    }
}
