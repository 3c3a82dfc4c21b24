//! The default tracker's two witnesses: agreement, shares, what is gone, what comes back.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_trackers::registry;
use pursuit_tracking::{Doubt, Estimate, Measurement, TrackState, Tracker};

const SIZE: Size = Size::new(320, 240);

const FACE: [u8; 3] = [230, 190, 60];

/// A disc with a face of its own over a background of slow stripes.
fn frame(k: u64, target: Option<BBox>) -> Frame {
    painted(k, target, FACE)
}

/// The same with a face of another colour.
fn painted(k: u64, target: Option<BBox>, face: [u8; 3]) -> Frame {
    let image = Image::from_fn(SIZE.width, SIZE.height, |x, y| {
        let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
        let back = 110.0 + 25.0 * (0.11 * x + 0.05 * y).sin() + 20.0 * (0.13 * y - 0.04 * x).cos();
        let inside = target.filter(|b| {
            let (u, v) = ((x - b.center().x) / (b.width() / 2.0), (y - b.center().y) / (b.height() / 2.0));
            u * u + v * v < 1.0
        });
        match inside {
            Some(b) => {
                let (u, v) = ((x - b.left()) / b.width(), (y - b.top()) / b.height());
                let eye = ((u - 0.3).hypot(v - 0.35) < 0.1) || ((u - 0.7).hypot(v - 0.35) < 0.1);
                let mouth = (v - 0.7).abs() < 0.05 && (u - 0.5).abs() < 0.2;
                if eye || mouth { [20, 10, 10] } else { face }
            }
            None => [back as u8, (back * 0.9) as u8, (back * 0.8) as u8],
        }
    });
    Frame::new(k, k as f64 / 25.0, image.unwrap())
}

fn place(k: u64) -> BBox {
    BBox::from_ltwh(60.0 + 2.0 * k as f64, 70.0 + 10.0 * (k as f64 / 9.0).sin(), 48.0, 56.0)
}

fn start(set: &[(&str, f64)]) -> Box<dyn Tracker> {
    let table = set.iter().map(|(k, v)| ((*k).to_owned(), toml::Value::from(*v))).collect();
    let recipe = registry::tracker("pursuit").unwrap().recipe(&table).unwrap();
    recipe.init(&frame(0, Some(place(0))), place(0)).unwrap()
}

fn figure(seen: &Measurement, name: &str) -> f64 {
    seen.diagnostics.get(name).unwrap_or_else(|| panic!("no {name} in {:?}", seen.diagnostics))
}

fn claimed(seen: &Measurement, witness: &str) -> BBox {
    let [x, y, w, h] = ["x", "y", "w", "h"].map(|k| figure(seen, &format!("{witness}_{k}")));
    BBox::from_ltwh(x, y, w, h)
}

#[test]
fn both_witnesses_agree_on_what_only_moves() {
    let mut tracker = start(&[]);
    for k in 1..12 {
        let seen = tracker.peek(&frame(k, Some(place(k)))).unwrap().unwrap();
        assert_eq!(figure(&seen, "agreed"), 1.0, "frame {k}: {seen:?}");
        let (filter, network) = (claimed(&seen, "filter"), claimed(&seen, "network"));
        assert!(filter.iou(&place(k)) > 0.6 && network.iou(&place(k)) > 0.6, "frame {k}: {filter} {network}");
        let estimate = tracker.update(&frame(k, Some(place(k)))).unwrap();
        assert!(
            estimate.state == TrackState::Tracking && estimate.bbox.iou(&place(k)) > 0.7,
            "frame {k}: {estimate:?}"
        );
    }
}

#[test]
fn shares_say_whose_box_is_reported() {
    for (share, witness) in [(0.0, "filter"), (1.0, "network")] {
        // What agrees at all is as good as the other here.
        let set = [("fusion.network_center", share), ("fusion.network_size", share), ("fusion.same_from", 0.4)];
        let mut tracker = start(&set);
        for k in 1..5 {
            let seen = tracker.peek(&frame(k, Some(place(k)))).unwrap().unwrap();
            let overlap = seen.bbox.iou(&claimed(&seen, witness));
            assert!(overlap > 1.0 - 1e-9, "{witness}, frame {k}: {overlap}");
            tracker.update(&frame(k, Some(place(k)))).unwrap();
        }
    }
    // Below `same_from` the network's box counts for more, down to `agree_from`.
    let halves = [("fusion.network_center", 0.0), ("fusion.network_size", 0.0), ("fusion.same_from", 1.0)];
    let mut tracker = start(&[halves.as_slice(), &[("fusion.agree_from", 0.2)]].concat());
    let seen = tracker.peek(&frame(1, Some(place(1)))).unwrap().unwrap();
    let (filter, network) = (claimed(&seen, "filter"), claimed(&seen, "network"));
    let share = (1.0 - filter.iou(&network)) / 0.8;
    let want = filter.width() + share * (network.width() - filter.width());
    assert!((seen.bbox.width() - want).abs() < 1e-6, "{} {want}", seen.bbox);
}

#[test]
fn a_target_back_elsewhere_is_found() {
    // Doubt counts as absence here: the stripes resemble the face a little.
    let mut tracker = start(&[("policy.calibrated.lost_below", 0.6)]);
    for k in 1..15 {
        tracker.update(&frame(k, Some(place(k)))).unwrap();
    }
    let gone: Vec<Estimate> = (15..70).map(|k| tracker.update(&frame(k, None)).unwrap()).collect();
    let claims = gone.iter().filter(|e| e.state == TrackState::Tracking).count();
    assert!(claims <= 1, "tracked nothing in {claims} frames");
    assert_eq!(gone.last().unwrap().state, TrackState::Lost);
    assert_eq!(gone.last().unwrap().doubt, Some(Doubt::Gone));
    for estimate in &gone {
        assert_eq!(estimate.doubt.is_none(), estimate.state == TrackState::Tracking, "{estimate:?}");
    }
    let back = BBox::from_ltwh(210.0, 150.0, 48.0, 56.0);
    let found = (70..120).position(|k| {
        let estimate = tracker.update(&frame(k, Some(back))).unwrap();
        estimate.state == TrackState::Tracking && estimate.bbox.iou(&back) > 0.5
    });
    assert!(found.is_some_and(|after| after < 40), "found after {found:?} frames");
}

#[test]
fn what_comes_back_in_other_colors_is_not_the_target() {
    // As bright as its own, and not yellow.
    for (face, is_target) in [(FACE, true), ([120, 190, 255], false)] {
        let mut tracker = start(&[]);
        let shown = |k: u64| match k {
            0..30 => frame(k, Some(place(k))),
            30..60 => frame(k, None),
            _ => painted(k, Some(place(k)), face),
        };
        let told: Vec<bool> =
            (1..75).map(|k| tracker.update(&shown(k)).unwrap().state == TrackState::Tracking).collect();
        assert!(told[..29].iter().all(|&told| told) && !told[40..59].iter().any(|&told| told), "{told:?}");
        assert_eq!(told[59..].iter().any(|&told| told), is_target, "{face:?}: {told:?}");
    }
}

#[test]
fn a_saved_tracker_goes_on_alike() {
    let mut tracker = start(&[]);
    for k in 1..6 {
        tracker.update(&frame(k, Some(place(k)))).unwrap();
    }
    let recipe = registry::tracker("pursuit").unwrap().recipe(&toml::Table::new()).unwrap();
    let mut restored = recipe.restore(&tracker.save().unwrap()).unwrap();
    for k in 6..12 {
        let now = frame(k, Some(place(k)));
        assert_eq!(tracker.update(&now).unwrap(), restored.update(&now).unwrap(), "frame {k}");
    }
    let bad = toml::Table::from_iter([("fusion.agree_from".to_owned(), toml::Value::from(1.5))]);
    let error = registry::tracker("pursuit").unwrap().recipe(&bad).err().unwrap().to_string();
    assert!(error.contains("agree_from"), "{error}");
}

#[test]
fn a_network_asked_rarely_says_the_same() {
    let set = [("fusion.ask_every", toml::Value::from(6)), ("fusion.sure_from", toml::Value::from(0.6))];
    let table = set.map(|(k, v)| (k.to_owned(), v)).into_iter().collect();
    let recipe = registry::tracker("pursuit").unwrap().recipe(&table).unwrap();
    let mut tracker = recipe.init(&frame(0, Some(place(0))), place(0)).unwrap();
    let mut scores = Vec::new();
    for k in 1..37 {
        let estimate = tracker.update(&frame(k, Some(place(k)))).unwrap();
        assert!(
            estimate.state == TrackState::Tracking && estimate.bbox.iou(&place(k)) > 0.7,
            "frame {k}: {estimate:?}"
        );
        scores.push(estimate.diagnostics.get("network_score").unwrap());
        if k == 20 {
            // Between two questions too.
            tracker = recipe.restore(&tracker.save().unwrap()).unwrap();
        }
    }
    let asked = 1 + scores.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!((6..=12).contains(&asked), "asked in {asked} of 36 frames: {scores:?}");
    let gone: Vec<Estimate> = (37..90).map(|k| tracker.update(&frame(k, None)).unwrap()).collect();
    let claims = gone.iter().filter(|e| e.state == TrackState::Tracking).count();
    assert!(claims <= 1 && gone.last().unwrap().state == TrackState::Lost, "tracked nothing in {claims} frames");
}

/// In how many of 30 frames LightFC is asked, if it is in every tenth and in every `doubtful`-th in doubt: where boxes overlap by
/// less than `agree_from`.
fn asked(agree_from: f64, doubtful: i64) -> usize {
    let set: [(&str, toml::Value); 4] = [
        ("fusion.agree_from", agree_from.into()),
        ("fusion.same_from", 1.0.into()),
        ("networks.lightfc_every", 10.into()),
        ("networks.lightfc_doubtful_every", doubtful.into()),
    ];
    let table = set.map(|(k, v)| (k.to_owned(), v)).into_iter().collect();
    let mut tracker = registry::tracker("pursuit")
        .unwrap()
        .recipe(&table)
        .unwrap()
        .init(&frame(0, Some(place(0))), place(0))
        .unwrap();
    let mut said =
        |k: u64| tracker.update(&frame(k, Some(place(k)))).unwrap().diagnostics.get("network_lightfc").unwrap();
    let scores: Vec<f64> = (1..31).map(&mut said).collect();
    scores.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

#[test]
fn lightfc_is_asked_sooner_in_doubt() {
    let (all_differ, none) = (0.999, 0.1);
    assert!((14..=15).contains(&asked(all_differ, 2)));
    assert!((9..=10).contains(&asked(all_differ, 3)));
    assert!((2..=3).contains(&asked(none, 2)));
}
