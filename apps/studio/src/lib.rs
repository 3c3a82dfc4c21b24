//! The studio: the paper's "motion prediction test system" (Qu et al. 2010, figure 4) in the browser. Pick a target by
//! dragging a box, follow it, look at what the tracker thinks, correct it where it went wrong, compare methods, and take the
//! trajectory away.
//!
//! The page and everything it needs are part of the program. What the page does goes through the HTTP and WebSocket calls
//! that `/api/openapi.json` describes; a trial of the studio is a [`Session`](pursuit::Session) of the facade, by steps.

mod api;
mod assets;
mod error;
mod export;
mod guard;
mod measuring;
mod metrics;
mod options;
mod recording;
mod root;
mod runs;
mod server;
mod studio;
mod trial;
mod uploads;
mod watch;

pub use error::StudioError;
pub use options::{Options, Picked};
pub use server::Server;
pub use watch::Watch;
