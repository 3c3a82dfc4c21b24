//! What a run begins with: boxes, a detector, or what an earlier run left.

use crate::RunError;
use crate::config::{ACQUIRE_PREFIX, MANY_PREFIX, Methods, RunConfig};
use crate::run::{ComparedRecipe, RecipeFacts};
use crate::session::Session;
use pursuit_geometry::{BBox, Truth};
use pursuit_parameters::Parameters;
use pursuit_trackers::registry;
use pursuit_tracking::MultiTracker;
use pursuit_tracking::many::{Acquiring, Associating, TargetSet};

/// What stands for the detector in `run.json` where a file says what is found.
const FROM_FILE: &str = "detections";

pursuit_parameters::choices! {
    /// What a run may be told to start from, where it is given no box.
    pub enum StartFrom {
        /// The truth's first box.
        Truth = "truth",
        /// What the detector finds.
        Detector = "detector",
        /// Nothing, until somebody says what to follow.
        Command = "command",
    }
}

/// How a run gets its first targets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Start {
    /// In the frame of this number.
    Boxes(Vec<BBox>, u64),
    /// The truth's first box, in the frame of this number.
    Truth(BBox, u64),
    Detector,
    Many(Vec<BBox>),
    /// Nothing, until somebody says what to follow.
    Command,
}

impl Start {
    /// Boxes given, else the detector where there is one, else the truth's first box from the first frame on; that one before the
    /// detector where the configuration asks for it.
    pub fn choose(config: &RunConfig, truth: Option<&[Truth]>, input: &str) -> Result<Self, RunError> {
        let by_truth = config.start == Some(StartFrom::Truth);
        config.check_start()?;
        let (boxes, detector) = (config.start_boxes(), config.detects());
        if config.start == Some(StartFrom::Command) {
            return Ok(Self::Command);
        }
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
            Some((frame, bbox)) if by_truth || !detector => Ok(Self::Truth(bbox, frame)),
            None if by_truth => Err(RunError::usage(format!(
                "no truth came with {input} that has a box from frame {from} on; leave `--start truth` out, or put it beside the input"
            ))),
            _ if detector => Ok(Self::Detector),
            _ => Err(RunError::usage(format!(
                "nothing to track in {input}: draw a box in the browser, `--pick`, give one, `--box LEFT,TOP,WIDTH,HEIGHT` in pixels of frame {from}, or name a detector, `--detect ball`"
            ))),
        }
    }

    /// The tracker with every parameter, and what starts it.
    pub fn recipe_facts(&self, config: &RunConfig, methods: &Methods) -> Result<RecipeFacts, RunError> {
        let boxes = match self {
            Self::Boxes(boxes, _) | Self::Many(boxes) => boxes.as_slice(),
            Self::Truth(bbox, _) => std::slice::from_ref(bbox),
            Self::Detector | Self::Command => &[],
        };
        let detects = !matches!(self, Self::Boxes(..) | Self::Truth(..) | Self::Command);
        let acquire = matches!(self, Self::Detector).then(|| methods.acquire.to_table(ACQUIRE_PREFIX));
        let many = matches!(self, Self::Many(_)).then(|| methods.many.to_table(MANY_PREFIX));
        Ok(RecipeFacts {
            tracker: methods.recipe.name().to_owned(),
            start: match self {
                Self::Boxes(..) => "box",
                Self::Truth(..) => "truth",
                Self::Many(boxes) if !boxes.is_empty() => "box",
                Self::Many(_) | Self::Detector => "detector",
                Self::Command => "command",
            },
            start_frame: match self {
                Self::Boxes(_, frame) | Self::Truth(_, frame) => Some(*frame),
                Self::Many(_) | Self::Detector | Self::Command => None,
            },
            parameters: methods.recipe.parameters()?,
            detector: config
                .detect
                .clone()
                .or_else(|| config.detections.as_ref().map(|_| FROM_FILE.to_owned()))
                .filter(|_| detects),
            detector_parameters: methods.detector_parameters.clone().filter(|_| detects),
            acquire: acquire.transpose()?,
            many: many.transpose()?,
            compared: methods
                .compared
                .iter()
                .map(|recipe| {
                    Ok(ComparedRecipe { tracker: recipe.name().to_owned(), parameters: recipe.parameters()? })
                })
                .collect::<Result<_, RunError>>()?,
            boxes: boxes.iter().map(|b| b.ltwh().into()).collect(),
        })
    }

    /// Tells the session what to follow.
    pub fn begin(self, session: Session, methods: Methods, config: &RunConfig) -> Result<Session, RunError> {
        if !methods.compared.is_empty() {
            let all = std::iter::once(methods.recipe).chain(methods.compared).collect();
            return match self {
                Self::Boxes(boxes, frame) => Ok(session.comparing_at(frame, boxes, all)),
                Self::Truth(bbox, frame) => Ok(session.comparing_at(frame, vec![bbox], all)),
                _ => Err(RunError::usage("trackers are compared from a box; give it with `--box` or `--pick`")),
            };
        }
        Ok(match (self, methods.detector) {
            (Self::Detector, Some(detector)) => session.finding(detector, methods.acquire)?,
            (Self::Many(boxes), Some(detector)) => {
                let mut targets = Associating::new(session.clocked(detector), methods.many)?;
                targets = targets.with_embedder(methods.embedder);
                if config.tracker.is_some() {
                    targets = targets.with_appearance(methods.recipe);
                }
                session.following(Box::new(targets)).starting_on(boxes)
            }
            (Self::Boxes(boxes, frame), _) => session.starting_at(frame, boxes),
            (Self::Truth(bbox, frame), _) => session.starting_at(frame, vec![bbox]),
            (Self::Many(boxes), None) => session.starting_on(boxes),
            // Nothing starts by a detector that is not there.
            (Self::Detector, None) | (Self::Command, _) => session,
        })
    }

    /// Gives the session the targets of an earlier one.
    pub fn go_on(&self, session: Session, state: &[u8], methods: Methods) -> Result<Session, RunError> {
        let recipe_of = |name: &str| registry::tracker(name).map(|entry| entry.default_recipe());
        let detector = methods.detector.map(|detector| session.clocked(detector));
        let targets: Box<dyn MultiTracker> = match (self, detector) {
            (Self::Detector, Some(detector)) => Box::new(Acquiring::restore(state, detector, &recipe_of)?),
            (Self::Many(_), Some(detector)) => {
                Box::new(Associating::restore(state, detector, &recipe_of)?.with_embedder(methods.embedder))
            }
            _ => Box::new(TargetSet::restore(state, &recipe_of)?),
        };
        Ok(session.continuing(targets, !matches!(self, Self::Many(_))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(text: &str, truth: Option<&[Truth]>) -> Result<Start, String> {
        let config: RunConfig = toml::from_str(text).unwrap();
        Start::choose(&config, truth, "clip.mp4").map_err(|e| e.to_string())
    }

    fn truth() -> [Truth; 2] {
        [Truth::Absent, Truth::Visible(BBox::from_ltwh(1.0, 2.0, 12.0, 62.0))]
    }

    #[test]
    fn a_detector_named_starts_though_there_is_truth() {
        assert_eq!(chosen("detect = 'motion'", Some(&truth())), Ok(Start::Detector));
        assert_eq!(chosen("detect = 'motion'\nstart = 'detector'", Some(&truth())), Ok(Start::Detector));
        assert_eq!(chosen("detect = 'motion'\nmany = true", Some(&truth())), Ok(Start::Many(Vec::new())));
    }

    #[test]
    fn truth_starts_when_asked_or_alone() {
        let first = Start::Truth(BBox::from_ltwh(1.0, 2.0, 12.0, 62.0), 1);
        for text in ["detect = 'motion'\nstart = 'truth'", "start = 'truth'", ""] {
            assert_eq!(chosen(text, Some(&truth())), Ok(first.clone()), "{text}");
        }
        let given = chosen("boxes = [[5, 6, 7, 8]]\ndetect = 'motion'", Some(&truth()));
        assert_eq!(given, Ok(Start::Boxes(vec![BBox::from_ltwh(5.0, 6.0, 7.0, 8.0)], 0)));
    }

    #[test]
    fn what_is_not_there_starts_nothing() {
        for (text, truth, says) in [
            ("start = 'truth'", None, "no truth came with clip.mp4"),
            ("detect = 'motion'\nstart = 'truth'", Some(&[Truth::Absent][..]), "no truth came with clip.mp4"),
            ("detect = 'motion'\nmany = true\nstart = 'truth'", None, "leave `--start truth` or `--many` out"),
            ("boxes = [[5, 6, 7, 8]]\nstart = 'truth'", None, "leave `--start` or `--box` out"),
            ("start = 'detector'", None, "no detector is named"),
            ("", None, "nothing to track in clip.mp4"),
        ] {
            let error = chosen(text, truth).unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
