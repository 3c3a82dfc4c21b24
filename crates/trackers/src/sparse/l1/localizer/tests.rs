use super::*;
use pursuit_geometry::Point;
use pursuit_imaging::Image;

fn target(k: u64) -> BBox {
    BBox::from_ltwh(40.0 + 2.0 * k as f64, 30.0 + k as f64, 30.0, 24.0)
}

/// A textured target before another texture; `covered`: something bright over part of it.
fn frame(k: u64, covered: f64) -> Frame {
    let b = target(k);
    let image = Image::from_fn(200, 140, |x, y| {
        let p = Point::new(x as f64 + 0.5, y as f64 + 0.5);
        if b.contains(p) {
            let (u, v) = (p.x - b.left(), p.y - b.top());
            if u < covered * b.width() {
                return 250;
            }
            return (130.0 + 60.0 * (u / 4.0).sin() + 50.0 * (v / 5.0).cos()) as u8;
        }
        (90.0 + 40.0 * (p.x / 9.0).sin() * (p.y / 7.0).cos()) as u8
    });
    Frame::new(k, k as f64 / 30.0, image.unwrap())
}

fn small() -> L1Params {
    L1Params { samples: 120, ..L1Params::default() }
}

/// What is left out weighs less than half of one's share of the whole.
#[test]
fn the_bound_leaves_out_only_what_is_not_drawn_again() {
    let all = L1Params { code: super::super::L1CodeParams { bounded: false, ..small().code }, ..small() };
    let [mut quick, mut slow] = [small(), all].map(|p| L1Tracker::new(&p, &frame(0, 0.0), target(0)).unwrap());
    for k in 1..4 {
        quick.look_ahead(&frame(k, 0.0), 1.0 / 30.0).unwrap();
        slow.look_ahead(&frame(k, 0.0), 1.0 / 30.0).unwrap();
        let (got, want) = (&quick.buffers.likelihoods, &slow.buffers.likelihoods);
        let sum: f64 = want.iter().map(|l| l.exp()).sum();
        let mut left_out = 0;
        for (got, want) in got.iter().zip(want) {
            if *got == f64::NEG_INFINITY {
                left_out += 1;
                assert!(want.exp() <= sum / 240.0 * 1.000_001, "frame {k}");
            } else {
                assert_eq!(got, want, "frame {k}");
            }
        }
        assert!(left_out > 20, "frame {k}: {left_out}");
        // Both go on from the same samples.
        quick.ahead.settle(&mut quick.samples);
        slow.samples = quick.samples.clone();
    }
}

#[test]
fn what_covers_the_target_shows_and_keeps_templates() {
    let mut tracker = L1Tracker::new(&small(), &frame(0, 0.0), target(0)).unwrap();
    let at = |k: u64| state(&target(k), (30.0, 24.0), &small().moves);
    let clear = tracker.judge(&frame(1, 0.0), &at(1)).unwrap();
    let half = tracker.judge(&frame(1, 0.5), &at(1)).unwrap();
    assert!(clear.error < 0.2 && clear.covered < 0.1 && clear.likeness > 0.9);
    assert!(half.covered > 0.3 && half.error > clear.error && half.likeness < clear.likeness);
    let finding = L1Finding { by_samples: true, state: at(1), is_covered: true };
    let outcome = Outcome {
        state: TrackState::Tracking,
        bbox: target(1),
        found: Some((target(1), &finding)),
        followed: Some(target(1)),
        dt_s: 0.03,
    };
    tracker.observe(&frame(1, 0.5), &outcome).unwrap();
    assert_eq!((tracker.hold, tracker.mu()), (5, 0.0));
    let before: Vec<f32> = tracker.templates.rows().flatten().copied().collect();
    let clear = L1Finding { is_covered: false, ..finding };
    tracker.adapt(&frame(2, 0.5), target(1).translated(9.0, 0.0), &clear).unwrap();
    assert_eq!(before, tracker.templates.rows().flatten().copied().collect::<Vec<f32>>());
    tracker.hold = 0;
    tracker.adapt(&frame(2, 0.5), target(1).translated(9.0, 0.0), &clear).unwrap();
    assert_ne!(before, tracker.templates.rows().flatten().copied().collect::<Vec<f32>>());
}

#[test]
fn states_that_cannot_be_are_refused() {
    let back = |t: &L1Tracker| postcard::from_bytes::<L1Tracker>(&postcard::to_stdvec(t).unwrap());
    let whole = L1Tracker::new(&small(), &frame(0, 0.0), target(0)).unwrap();
    assert!(back(&whole).is_ok());
    assert!(back(&L1Tracker { first_px: (0.0, 3.0), ..whole.clone() }).is_err());
    assert!(back(&L1Tracker { hold: 99, ..whole.clone() }).is_err());
    let mut other = whole.clone();
    other.params.samples = 10;
    assert!(back(&other).is_err());
    let mut other = whole;
    other.params.rows = 14;
    assert!(back(&other).is_err());
}
