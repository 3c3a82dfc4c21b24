//! The live picture: every message a frame, its boxes and where the trial is. A viewer takes the newest message when it has
//! dealt with the one before; messages in between are not kept for anybody.

use crate::error::Refusal;
use crate::studio::Studio;
use crate::trial::{Order, Trial};
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, State};
use axum::response::Response;
use std::sync::Arc;
use std::time::Duration;

/// A viewer that takes nothing for this long is gone.
const PATIENCE: Duration = Duration::from_secs(20);
/// Viewers say nothing but that they are still there.
const LONGEST_MESSAGE: usize = 4 << 10;
/// Viewers of all trials at most.
const MOST_VIEWERS: usize = 64;

pub(crate) async fn live(
    State(studio): State<Arc<Studio>>,
    Path(number): Path<u64>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Refusal> {
    let trial = studio.trial(number)?;
    if studio.count().1 >= MOST_VIEWERS {
        return Err(Refusal::too_many(format!("{MOST_VIEWERS} viewers look already")));
    }
    let upgrade = upgrade.max_message_size(LONGEST_MESSAGE).max_frame_size(LONGEST_MESSAGE);
    Ok(upgrade.on_upgrade(async move |socket| show(socket, &studio, trial).await))
}

async fn show(mut socket: WebSocket, studio: &Studio, trial: Arc<Trial>) {
    let mut viewer = trial.viewer();
    // Has what is to be seen now shown, also to whoever comes when nothing moves.
    let told = trial.order(Order::Tell).await;
    // A viewer does not keep a trial open that the user closed.
    drop(trial);
    if told.is_err() {
        return;
    }
    loop {
        tokio::select! {
            changed = viewer.packets.changed() => {
                let packet = viewer.packets.borrow_and_update().clone();
                if changed.is_err() || packet.is_empty() {
                    break;
                }
                studio.metrics.sent(packet.len());
                let sending = socket.send(Message::Binary(Bytes::from_owner(Shared(packet))));
                if !matches!(tokio::time::timeout(PATIENCE, sending).await, Ok(Ok(()))) {
                    return;
                }
            }
            received = socket.recv() => match received {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {}
            },
        }
    }
    let _ = tokio::time::timeout(PATIENCE, socket.send(Message::Close(None))).await;
}

/// One packet for all viewers.
struct Shared(crate::trial::Packet);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}
