use super::Watched;
use super::options::ClipRules;
use crate::RunError;
use crate::segments::{CLIP, SNAPSHOT, Shelf};
use std::path::PathBuf;
use std::sync::Arc;

/// Pictures of events are this far apart at least, seconds.
const BETWEEN_PICTURES_S: f64 = 1.0;

/// Says which frames belong to which clip.
pub(crate) struct ClipPlan {
    rules: ClipRules,
    shelf: Shelf,
    /// The clip in the making, when it ends, and when it ends at the latest.
    current: Option<(Arc<PathBuf>, f64, f64)>,
    pictured_s: Option<f64>,
}

impl ClipPlan {
    /// Of clips that lie on `shelf`.
    pub const fn new(rules: ClipRules, shelf: Shelf) -> Self {
        Self { rules, shelf, current: None, pictured_s: None }
    }

    /// Goes on by the events of a frame.
    ///
    /// # Errors
    /// [`RunError::Output`] when a clip cannot be written down.
    pub fn go_on(&mut self, time_s: f64, watched: &mut Watched) -> Result<(), RunError> {
        // A clock that leaps back ends a clip, too.
        let begins_s = |latest: f64| latest - self.rules.longest_s - 1.0;
        self.current.take_if(|(_, end, latest)| time_s > *end || time_s < begins_s(*latest));
        let wanted = watched.events.iter().any(|event| self.rules.on.contains(&event.kind));
        watched.snapshot = None;
        if wanted {
            let ends = time_s + self.rules.after_s;
            match &mut self.current {
                Some((_, end, latest)) => *end = ends.min(*latest),
                none => {
                    let path = Arc::new(self.shelf.add(CLIP, time_s)?);
                    *none = Some((path, ends, time_s + self.rules.longest_s));
                }
            }
            if self.pictured_s.is_none_or(|last| !(0.0..BETWEEN_PICTURES_S).contains(&(time_s - last))) {
                self.pictured_s = Some(time_s);
                watched.snapshot = Some(self.shelf.add(SNAPSHOT, time_s)?);
            }
        }
        watched.clip = self.current.as_ref().map(|(path, ..)| path.clone());
        Ok(())
    }
}
