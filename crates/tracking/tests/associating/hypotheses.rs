//! What is decided some frames later.

use super::*;
use pursuit_parameters::Parameters;
use pursuit_tracking::many::{Looked, OfflineParams, offline};

/// Somebody walks to the right and begins to turn just where something else is detected beside him, nearer to where he would be.
fn turning() -> Vec<Looked> {
    let walker = |k: usize| at(40.0 + 3.0 * k as f64, 80.0 + 1.5 * k.saturating_sub(24) as f64);
    let look = |k: usize| {
        let mut detections = vec![Detection::new(walker(k), 0.9)];
        if k == 25 {
            detections.insert(0, Detection::new(at(40.0 + 3.0 * k as f64, 79.0), 0.9));
        }
        Looked { time_s: k as f64 / 25.0, detections }
    };
    (0..35).map(look).collect()
}

fn placed(model: &str) -> Vec<Vec<(u64, Option<usize>)>> {
    let params =
        ManyParams::default().with("many", &format!("association.model = '{model}'").parse().unwrap()).unwrap();
    let placed = offline(params, &OfflineParams::default(), None, &turning()).unwrap();
    placed.iter().map(|frame| frame.iter().map(|p| (p.id.0, p.detection)).collect()).collect()
}

#[test]
fn a_whole_clip_is_put_right() {
    let (nearest, hypotheses) = (placed("nearest"), placed("hypotheses"));
    assert_eq!(nearest[25], [(1, Some(0))], "what is nearer is taken");
    assert_eq!(hypotheses[25], [(1, Some(1))], "where it went since says which it was");
    for (k, frame) in hypotheses.iter().enumerate() {
        assert_eq!(frame.len(), 1, "frame {k}: {frame:?}");
    }
}

#[test]
fn nothing_put_off_is_the_nearest() {
    let params = |changes: &str| ManyParams::default().with("many", &changes.parse().unwrap()).unwrap();
    let mut nearest = Associating::fed(params("")).unwrap();
    let mut at_once =
        Associating::fed(params("association.model = 'hypotheses'\nassociation.hypotheses.n_scan = 0")).unwrap();
    let street = street::Street { missed: 0.1, false_alarms: 0.5, jitter_px: 2.0, ..street::crossing() };
    for k in 0..150 {
        let found = street.detections(k, 3);
        let said = |many: &mut Associating| {
            let tracks = many.update(k as f64 / common::FPS, None, &found).unwrap();
            tracks.iter().map(|t| (t.id, t.detection)).collect::<Vec<_>>()
        };
        assert_eq!(said(&mut at_once), said(&mut nearest), "frame {k}");
    }
}
