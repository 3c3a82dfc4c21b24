//! Commands from elsewhere, obeyed between two steps.

use super::placing::of_input;
use super::{Command, Ended, Session};
use crate::RunError;
use pursuit_tracking::TargetId;

impl Session {
    /// Obeys one command now, between two steps.
    ///
    /// A box, in pixels of the whole input, belongs to the frame looked at last. Before the first frame, and after [`Command::Seek`], it belongs to the
    /// frame that comes next: then [`Command::Add`] has no id to return yet.
    ///
    /// # Errors
    /// A target that there is not, a box or a parameter that cannot be used, a source that can only be read from front to
    /// back; everything is then as before.
    pub fn apply(&mut self, command: Command) -> Result<Option<TargetId>, RunError> {
        match command {
            Command::Add { bbox, recipe } => return self.add(recipe, of_input(self.view, bbox)),
            Command::Remove(id) => self.targets.remove(id)?,
            Command::Reinit { target, bbox } => self.reinit(target, of_input(self.view, bbox))?,
            Command::Change { target, parameters } => self.change(target, &parameters)?,
            Command::Pause => self.paused = true,
            Command::Resume => self.paused = false,
            Command::Seek(frame) => self.seek(frame)?,
        }
        Ok(None)
    }

    fn change(&mut self, target: Option<TargetId>, parameters: &toml::Table) -> Result<(), RunError> {
        // Targets added later are to have the changes too.
        let recipe = match target {
            None if self.by_recipe => Some(self.recipe.with(parameters)?),
            _ => None,
        };
        self.targets.change(target, parameters)?;
        if let Some(recipe) = recipe {
            self.recipe = recipe;
        }
        Ok(())
    }

    fn seek(&mut self, frame: u64) -> Result<(), RunError> {
        self.source.seek(frame)?;
        self.frame = None;
        self.ready = false;
        if self.ended == Some(Ended::Input) {
            self.ended = None;
        }
        Ok(())
    }

    /// Obeys everything that has come from elsewhere.
    pub(super) fn obey(&mut self) {
        while let Some(request) = self.inbox.next() {
            request.answer(|command| self.apply(command));
        }
        self.heed_stop();
    }

    /// Waits for a command from elsewhere, and obeys it.
    pub(super) fn wait(&mut self) {
        if let Some(request) = self.inbox.wait() {
            request.answer(|command| self.apply(command));
        }
        self.heed_stop();
    }

    fn heed_stop(&mut self) {
        if self.remote.is_stopped() && self.ended.is_none() {
            self.ended = Some(Ended::Stopped);
        }
    }
}
