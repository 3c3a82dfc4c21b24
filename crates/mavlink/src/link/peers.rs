use std::net::SocketAddr;
use std::time::{Duration, Instant};

/// Who has sent something valid to a port, and is answered there.
#[derive(Debug, Default)]
pub(super) struct Peers(Vec<(SocketAddr, Instant)>);

impl Peers {
    /// A ground station says every second that it is there.
    const SILENCE: Duration = Duration::from_secs(30);
    /// More than these are not answered: an address can be made up.
    const MOST: usize = 16;

    /// Something valid came from there.
    pub fn heard(&mut self, from: SocketAddr, now: Instant) {
        self.0.retain(|(address, heard)| *address != from && now.saturating_duration_since(*heard) < Self::SILENCE);
        if self.0.len() < Self::MOST {
            self.0.push((from, now));
        }
    }

    pub fn all(&self, now: Instant) -> impl Iterator<Item = SocketAddr> + '_ {
        let hears = move |heard: Instant| now.saturating_duration_since(heard) < Self::SILENCE;
        self.0.iter().filter(move |(_, heard)| hears(*heard)).map(|(address, _)| *address)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_silent_or_one_too_many_is_left_out() {
        let (mut peers, began) = (Peers::default(), Instant::now());
        let at = |port: u16| SocketAddr::from(([127, 0, 0, 1], port));
        for port in 1..=20 {
            peers.heard(at(port), began);
            peers.heard(at(1), began);
        }
        assert_eq!(peers.all(began).count(), Peers::MOST);
        let later = began + Duration::from_secs(40);
        peers.heard(at(1), later);
        assert_eq!(peers.all(later).collect::<Vec<_>>(), [at(1)]);
    }
}
