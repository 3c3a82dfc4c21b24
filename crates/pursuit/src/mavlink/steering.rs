use crate::session::Reply;
use crate::{Command, Remote};
use pursuit_geometry::BBox;
use pursuit_mavlink::{Request, Verdict};
use pursuit_tracking::TargetId;

/// What is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Doing {
    /// Nothing, because somebody said so.
    Nothing,
    /// What the run was started with, if anything.
    AsStarted,
    /// What somebody asked for.
    Following(TargetId),
}

/// Makes commands to a run of what ground stations ask, and answers them once the run has obeyed.
pub(super) struct Steering {
    remote: Remote,
    doing: Doing,
    /// What the run was told and has not obeyed yet.
    under_way: Option<UnderWay>,
}

struct UnderWay {
    request: Request,
    reply: Reply,
    /// The answer's second parameter.
    how: i32,
}

impl Steering {
    /// Of a run that begins with nothing to follow, or with what it was started with.
    pub fn new(remote: Remote, starts: bool) -> Self {
        let doing = if starts { Doing::AsStarted } else { Doing::Nothing };
        Self { remote, doing, under_way: None }
    }

    pub const fn doing(&self) -> Doing {
        self.doing
    }

    /// Follow this instead; `how` is said in the answer.
    pub fn start(&mut self, request: Request, bbox: BBox, how: i32) {
        let reply = self.remote.send(Command::Add { bbox, recipe: None });
        self.under_way = Some(UnderWay { request, reply, how });
    }

    /// Follow nothing.
    pub fn stop(&mut self, request: Request) {
        self.let_go();
        self.doing = Doing::Nothing;
        request.answer(Verdict::Done(0));
    }

    /// What is followed now need not be followed any more. Nobody waits for that: a target that is gone already is no matter.
    fn let_go(&self) {
        if let Doing::Following(id) = self.doing {
            self.remote.send(Command::Remove(id));
        }
    }

    /// Answers what the run has obeyed meanwhile.
    pub fn settle(&mut self) {
        let Some(UnderWay { request, reply, how }) = self.under_way.take() else { return };
        match reply.poll() {
            Err(reply) => self.under_way = Some(UnderWay { request, reply, how }),
            Ok(Ok(Some(id))) => {
                self.let_go();
                self.doing = Doing::Following(id);
                request.answer(Verdict::Done(how));
            }
            // What was followed before goes on being followed.
            Ok(Ok(None)) => request.answer(Verdict::NotNow),
            Ok(Err(error)) => {
                tracing::warn!("{error}");
                request.answer(Verdict::Failed);
            }
        }
    }
}
