#![no_main]

use pursuit::tracking::{MultiTracker, TargetSet};
use pursuit::{BBox, Frame, imaging::Image};
use std::sync::LazyLock;

const NAMES: [&str; 4] = ["mosse", "kcf", "ball", "staple"];

fn frame(index: u64) -> Frame {
    let ball = |x: usize, y: usize| {
        let (dx, dy) = (x as i64 - 60 - index as i64, y as i64 - 50);
        if dx * dx + dy * dy < 150 { [240, 200, 20] } else { [(x * 7 % 90) as u8, (y * 5 % 90) as u8, 60] }
    };
    Frame::new(index, index as f64 / 30.0, Image::from_fn(160, 120, ball).expect("a size"))
}

static FRAMES: LazyLock<[Frame; 3]> = LazyLock::new(|| [0, 1, 2].map(frame));

/// Trackers and a set of them, saved after two frames.
static SAVED: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let start = BBox::from_ltwh(47.0, 37.0, 26.0, 26.0);
    let [first, second, _] = &*FRAMES;
    let saved = |name: &str| {
        let mut tracker = pursuit::recipe(name).and_then(|r| Ok(r.init(first, start)?)).expect("a start");
        tracker.update(second).expect("a frame");
        tracker.save().expect("a state")
    };
    let mut set = TargetSet::new();
    for name in ["mosse", "ball"] {
        set.add(&*pursuit::recipe(name).expect("a name"), first, start).expect("a start");
    }
    NAMES.into_iter().map(saved).chain([set.save().expect("a state")]).collect()
});

// States with some bytes changed, cut or put in: refused, or trackers that go on.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&which, edits)) = bytes.split_first() else { return };
    let which = usize::from(which) % SAVED.len();
    let mut state = SAVED[which].clone();
    for edit in edits.chunks_exact(4) {
        // Headers and lengths stand in front: half of the changes go there.
        let reach = if edit[3] & 1 == 0 { 128.min(state.len()) } else { state.len() };
        let at = usize::from(edit[0]) << 8 | usize::from(edit[1]);
        if reach == 0 {
            break;
        }
        match edit[3] >> 1 & 7 {
            0 => state.truncate(at % reach),
            1 => state.insert(at % reach, edit[2]),
            2 => {
                state.remove(at % reach);
            }
            _ => state[at % reach] = edit[2],
        }
    }
    let frame = &FRAMES[2];
    if let Some(name) = NAMES.get(which) {
        if let Ok(mut tracker) = pursuit::recipe(name).and_then(|r| Ok(r.restore(&state)?)) {
            let _ = tracker.update(frame);
        }
    } else {
        let recipe_of = |name: &str| Ok(pursuit::trackers::registry::tracker(name)?.default_recipe());
        if let Ok(mut set) = TargetSet::restore(&state, &recipe_of) {
            let _ = set.step(frame, &mut Vec::new());
        }
    }
});
