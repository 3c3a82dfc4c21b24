//! Hypotheses in the frame being looked at.

/// A copy of hypotheses, carried to the frame being looked at. It is no state: what is kept becomes what was carried only once
/// that frame has been judged.
#[derive(Debug, Clone)]
pub(crate) struct Ahead<T> {
    copy: Option<T>,
    fresh: bool,
}

impl<T> Default for Ahead<T> {
    fn default() -> Self {
        Self { copy: None, fresh: false }
    }
}

impl<T: Clone> Ahead<T> {
    /// Carries a copy of what is `kept` to a frame, by `step`.
    ///
    /// # Errors
    /// Those of `step`; nothing is carried then.
    pub fn carry<E>(&mut self, kept: &T, step: impl FnOnce(&mut T) -> Result<(), E>) -> Result<(), E> {
        self.fresh = false;
        let copy = match &mut self.copy {
            Some(copy) => {
                copy.clone_from(kept);
                copy
            }
            none => none.insert(kept.clone()),
        };
        step(copy)?;
        self.fresh = true;
        Ok(())
    }

    /// What was carried to the frame, until it was judged.
    pub fn get(&self) -> Option<&T> {
        self.copy.as_ref().filter(|_| self.fresh)
    }

    /// The frame was judged: what was carried is kept.
    pub fn settle(&mut self, kept: &mut T) {
        if let Some(copy) = self.copy.as_mut().filter(|_| self.fresh) {
            std::mem::swap(kept, copy);
        }
        self.fresh = false;
    }
}
