//! Many targets at once: ids, coming and going, and that company changes nothing.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_scenes::{Scene, open};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, MultiTracker, Recipe, TargetId, TargetSet, TrackingError};

const FRAMES: u64 = 12;

/// Frames with six targets, and their true boxes.
fn film() -> (Vec<Frame>, Vec<Vec<BBox>>) {
    let scene: Box<dyn Scene> = open("scene:crowd?targets=6&width=480&height=320&size=40&speed=40").unwrap();
    let shot = |k: u64| {
        let moment = scene.render(scene.frame_time_s(k));
        let boxes = moment.targets.iter().map(|t| t.extent.unwrap()).collect();
        (Frame::new(k, scene.frame_time_s(k), moment.image), boxes)
    };
    (0..FRAMES).map(shot).unzip()
}

fn recipe(name: &str) -> Box<dyn Recipe> {
    registry::tracker(name).unwrap().recipe(&toml::Table::new()).unwrap()
}

fn look(set: &mut TargetSet, frame: &Frame) -> Vec<(TargetId, Estimate)> {
    let mut tracks = Vec::new();
    set.step(frame, &mut tracks).unwrap();
    tracks.into_iter().map(|t| (t.id, t.estimate.unwrap())).collect()
}

#[test]
fn company_and_threads_change_nothing() {
    let (frames, truth) = film();
    for name in ["kcf", "mosse", "pursuit"] {
        let recipe = recipe(name);
        let alone: Vec<Vec<Estimate>> = truth[0]
            .iter()
            .map(|bbox| {
                let mut tracker = recipe.init(&frames[0], *bbox).unwrap();
                frames[1..].iter().map(|f| tracker.update(f).unwrap()).collect()
            })
            .collect();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let together = pool.install(|| {
                let mut set = TargetSet::new();
                for bbox in &truth[0] {
                    set.add(&*recipe, &frames[0], *bbox).unwrap();
                }
                frames[1..].iter().map(|f| look(&mut set, f)).collect::<Vec<_>>()
            });
            for (k, estimates) in together.iter().enumerate() {
                for (i, (id, estimate)) in estimates.iter().enumerate() {
                    assert_eq!((id.0, estimate), (i as u64 + 1, &alone[i][k]), "{name}, frame {}", k + 1);
                    assert!(estimate.bbox.iou(&truth[k + 1][i]) > 0.5, "{name}, target {id}, frame {}", k + 1);
                }
            }
        }
    }
}

#[test]
fn ids_are_never_used_again() {
    let (frames, truth) = film();
    let recipe = recipe("kcf");
    let mut set = TargetSet::new();
    assert!(look(&mut set, &frames[0]).is_empty());
    let ids: Vec<TargetId> = (0..3).map(|i| set.add(&*recipe, &frames[0], truth[0][i]).unwrap()).collect();
    assert_eq!(ids, [TargetId(1), TargetId(2), TargetId(3)]);
    look(&mut set, &frames[1]);

    let mut second = set.take(ids[1]).unwrap();
    assert!(matches!(set.remove(ids[1]), Err(TrackingError::UnknownTarget { id: 2 })));
    assert_eq!(set.ids(), [ids[0], ids[2]]);
    // A tracker that has left goes on by itself.
    assert!(second.update(&frames[2]).unwrap().bbox.iou(&truth[2][1]) > 0.5);
    look(&mut set, &frames[2]);

    let late = set.add(&*recipe, &frames[2], truth[2][4]).unwrap();
    assert_eq!(late, TargetId(4));
    let outside = BBox::from_ltwh(9000.0, 0.0, 5.0, 5.0);
    assert!(matches!(set.add(&*recipe, &frames[2], outside), Err(TrackingError::StartBox { .. })));
    assert_eq!(set.len(), 3);
    let back = set.insert(second);
    assert_eq!(back, TargetId(5), "the refused box took no id, and 2 is not used again");

    let truth_of = [(ids[0], 0), (ids[2], 2), (late, 4), (back, 1)];
    for k in 3..FRAMES as usize {
        let said = look(&mut set, &frames[k]);
        assert_eq!(said.len(), truth_of.len());
        for ((id, estimate), (expected, target)) in said.iter().zip(truth_of) {
            assert_eq!(*id, expected);
            assert!(estimate.bbox.iou(&truth[k][target]) > 0.5, "target {id}, frame {k}");
        }
    }

    // One of them is put onto another target, in place.
    set.get_mut(late).unwrap().reinit(&frames[FRAMES as usize - 1], truth[FRAMES as usize - 1][5]).unwrap();
    assert!(set.get_mut(TargetId(2)).is_none());
    ids.iter().chain([&late, &back]).for_each(|id| drop(set.take(*id)));
    assert!(set.is_empty());
}
