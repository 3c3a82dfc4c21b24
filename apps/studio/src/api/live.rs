//! The live picture: every message a frame, its boxes and where the trial is. A viewer of stills takes the newest message when
//! it has dealt with the one before; a viewer of video takes them in order, and goes on with the next key frame when it is
//! late. Messages are kept for nobody.

use crate::error::Refusal;
use crate::studio::Studio;
use crate::trial::{Order, Packet, Trial, Wish};
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, Query, State};
use axum::response::Response;
use serde::Deserialize;
use std::sync::Arc;
use std::time::Duration;

/// A viewer that takes nothing for this long is gone.
const PATIENCE: Duration = Duration::from_secs(20);
/// Viewers say little.
const LONGEST_MESSAGE: usize = 4 << 10;
/// Viewers of all trials at most.
const MOST_VIEWERS: usize = 64;
/// What a viewer says who cannot go on without a key frame.
const KEY: &str = "key";

#[derive(Deserialize)]
pub(crate) struct Wanted {
    #[serde(default)]
    video: Wish,
}

pub(crate) async fn live(
    State(studio): State<Arc<Studio>>,
    Path(number): Path<u64>,
    Query(Wanted { video }): Query<Wanted>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Refusal> {
    let trial = studio.trial(number)?;
    if studio.count().1 >= MOST_VIEWERS {
        return Err(Refusal::too_many(format!("{MOST_VIEWERS} viewers look already")));
    }
    let upgrade = upgrade.max_message_size(LONGEST_MESSAGE).max_frame_size(LONGEST_MESSAGE);
    Ok(upgrade.on_upgrade(async move |socket| {
        show(socket, &studio, trial, video).await;
        studio.left(number);
    }))
}

async fn show(mut socket: WebSocket, studio: &Studio, trial: Arc<Trial>, wish: Wish) {
    let mut viewer = trial.viewer(wish);
    // Has what is to be seen now shown, also to whoever comes when nothing moves.
    let told = trial.order(Order::Tell).await;
    // A viewer does not keep a trial open that the user closed.
    drop(trial);
    if told.is_err() {
        return;
    }
    loop {
        tokio::select! {
            packet = viewer.next() => {
                let Some(packet) = packet else { break };
                let bytes = Bytes::from_owner(Shared(packet));
                studio.metrics.sent(bytes.len());
                let sending = socket.send(Message::Binary(bytes));
                if !matches!(tokio::time::timeout(PATIENCE, sending).await, Ok(Ok(()))) {
                    return;
                }
            }
            received = socket.recv() => match received {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(Message::Text(text))) if text.as_str() == KEY => viewer.ask_for_key(),
                Some(Ok(_)) => {}
            },
        }
    }
    let _ = tokio::time::timeout(PATIENCE, socket.send(Message::Close(None))).await;
}

/// One packet for all viewers.
struct Shared(Arc<Packet>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        self.0.as_ref().as_ref()
    }
}
