//! The tracker: TLD, with the patent's filter, and with either of its two improvements left out, on scenes with known truth.

use crate::ExperimentError;
use crate::result::{Bar, Finding, Row};
use crate::table::number;
use pursuit_evaluation::metrics::long_term::{ScoredFrame, detection, false_alive, reacquisition};
use pursuit_evaluation::metrics::mean;
use pursuit_evaluation::metrics::one_pass::success_auc;
use pursuit_tracking::{Recipe, TrackState};
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;

/// Who is compared: name in the table, in the registry, settings.
const COMPARED: [(&str, &str, &str); 5] = [
    ("tld", "tld", ""),
    ("kalman-tld", "kalman-tld", ""),
    (
        "kalman-tld without the filtered box",
        "kalman-tld",
        "guide.replace_above = 2.0\nguide.restart_below = 0.0\nguide.restart_every = 0",
    ),
    ("kalman-tld without the gate", "kalman-tld", "search.model = 'everywhere'"),
    (
        "kalman-tld to the letter",
        "kalman-tld",
        "guide.no_worse = false\nscan.gate_by = 'intersection'\nscan.turn_frames = 0",
    ),
];
const TLD: usize = 0;
const KALMAN: usize = 1;
/// What is followed: the first two have spans without the target.
const SCENES: [&str; 4] = ["leave-and-return", "occluding-bar", "scale-ramp", "camera-pan"];
/// Seeds from here on chose nothing.
const FIRST_SEED: u64 = 20_000;
/// From this visible share on a target counts as visible.
const VISIBLE: f64 = 0.5;
/// Overlap of a box that is right.
const RIGHT: f64 = 0.5;

/// One clip as one tracker followed it.
#[derive(Debug, Clone, Default)]
struct Followed {
    judged: Vec<ScoredFrame>,
    /// Windows scanned, frame by frame.
    windows: Vec<f64>,
    seconds: f64,
}

fn follow(recipe: &dyn Recipe, query: &str) -> Result<Followed, ExperimentError> {
    let scene = pursuit_scenes::open(query).map_err(|e| ExperimentError::usage(e.to_string()))?;
    let view = scene.home();
    let mut followed = Followed::default();
    let mut tracker = None;
    for k in 0..scene.frame_count() {
        let time_s = scene.frame_time_s(k);
        let moment = scene.render(time_s);
        let truth = moment.targets.first().copied().unwrap_or(pursuit_scenes::TargetTruth::ABSENT);
        let shown = truth.extent.filter(|_| truth.visible_fraction >= VISIBLE);
        let frame = moment.into_frame(k, time_s, &view);
        let Some(tracker) = &mut tracker else {
            tracker = shown.map(|bbox| recipe.init(&frame, bbox)).transpose()?;
            continue;
        };
        let start = Instant::now();
        let estimate = tracker.update(&frame)?;
        followed.seconds += start.elapsed().as_secs_f64();
        followed.windows.push(estimate.diagnostics.get("windows").unwrap_or(0.0));
        let overlap = shown.filter(|_| estimate.state != TrackState::Lost).map_or(0.0, |b| b.iou(&estimate.bbox));
        let alive = estimate.state == TrackState::Tracking;
        followed.judged.push(ScoredFrame { visible: shown.is_some(), alive, overlap, score: estimate.score });
    }
    Ok(followed)
}

fn recipes() -> Result<Vec<Box<dyn Recipe>>, ExperimentError> {
    let recipe = |(_, name, settings): &(&str, &str, &str)| {
        let settings = settings.parse::<toml::Table>().map_err(|e| ExperimentError::usage(e.to_string()))?;
        Ok(pursuit_trackers::registry::tracker(name)?.recipe(&settings)?)
    };
    COMPARED.iter().map(recipe).collect()
}

/// What the table says of one tracker over many clips.
#[derive(Debug, Clone, Copy)]
struct Figures {
    f: f64,
    auc: f64,
    windows: f64,
    fps: f64,
}

fn figures(clips: &[Followed]) -> Figures {
    let over = |value: &dyn Fn(&Followed) -> f64| mean(&clips.iter().map(value).collect::<Vec<_>>());
    let auc = |c: &Followed| success_auc(&c.judged.iter().filter(|j| j.visible).map(|j| j.overlap).collect::<Vec<_>>());
    // Frames in which nothing was found say nothing of windows.
    let windows: Vec<f64> = clips.iter().flat_map(|c| &c.windows).copied().filter(|w| *w > 0.0).collect();
    let (frames, seconds) = clips.iter().fold((0, 0.0), |sum, c| (sum.0 + c.judged.len(), sum.1 + c.seconds));
    Figures {
        f: over(&|c| detection(&c.judged, RIGHT).f()),
        auc: over(&auc),
        windows: mean(&windows),
        fps: if seconds > 0.0 { frames as f64 / seconds } else { 0.0 },
    }
}

/// All recipes on the clips of one scene.
fn on_clips(
    recipes: &[&dyn Recipe],
    scene: &str,
    keys: &str,
    clips: u64,
) -> Result<Vec<Vec<Followed>>, ExperimentError> {
    let seeds: Vec<u64> = (FIRST_SEED..FIRST_SEED + clips).collect();
    recipes
        .iter()
        .map(|recipe| seeds.par_iter().map(|s| follow(*recipe, &format!("scene:{scene}?seed={s}{keys}"))).collect())
        .collect()
}

/// One clip whose target leaves and comes back elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct AbsenceClip {
    /// The scene's seed.
    pub seed: u64,
    /// Share of the frames without the target in which it is called seen.
    pub false_alive: f64,
    /// For each return, the frames until the box was right again; none where that never came.
    pub back: Vec<Option<usize>>,
}

impl AbsenceClip {
    /// Whether no frame without the target is called `tracking`.
    pub fn honest(&self) -> bool {
        self.false_alive <= 0.0
    }

    /// Whether every return was noticed within five frames.
    pub fn found(&self) -> bool {
        self.back.iter().all(|frames| frames.is_some_and(|frames| frames <= 5))
    }
}

/// Follows the target of `leave-and-return`, which is gone for 80 frames and back 280 px away, for each of `seeds`, with
/// further `keys` (`&key=value`) of the scene.
///
/// # Errors
/// A key or value that the scene does not have, or an error of the tracker.
pub fn absence_clips(recipe: &dyn Recipe, seeds: Range<u64>, keys: &str) -> Result<Vec<AbsenceClip>, ExperimentError> {
    let clip = |seed| {
        let judged = follow(recipe, &format!("scene:leave-and-return?seed={seed}{keys}"))?.judged;
        Ok(AbsenceClip { seed, false_alive: false_alive(&judged).unwrap_or(0.0), back: reacquisition(&judged) })
    };
    seeds.into_par_iter().map(clip).collect()
}

/// The rows of the two trackers on clips whose target leaves for 80 frames and comes back elsewhere.
fn absences(recipes: &[&dyn Recipe], clips: u64) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    let seeds = FIRST_SEED..FIRST_SEED + clips;
    for (recipe, (name, ..)) in recipes.iter().zip(COMPARED) {
        let alone = absence_clips(*recipe, seeds.clone(), "")?;
        let accompanied = absence_clips(*recipe, seeds.clone(), "&look_alike=1")?;
        let setting = format!("{clips} targets gone for 80 frames, back 280 px away: {name}");
        let share = |clips: &[AbsenceClip], of: fn(&AbsenceClip) -> bool| {
            mean(&clips.iter().map(|c| f64::from(u8::from(of(c)))).collect::<Vec<_>>())
        };
        rows.extend([
            Row::new(&setting, "clips in which no absent frame is called tracking", share(&alone, AbsenceClip::honest))
                .bar(Bar::AtLeast(0.9)),
            Row::new(&setting, "clips in which it is found within five frames", share(&alone, AbsenceClip::found))
                .bar(Bar::AtLeast(0.9)),
            Row::new(
                &setting,
                "clips in which a look-alike is not adopted meanwhile",
                share(&accompanied, AbsenceClip::honest),
            )
            .bar(Bar::AtLeast(0.9)),
        ]);
    }
    Ok(rows)
}

/// The table of the trackers; `seeds` are those of the filter, of which a sixth are clips of absences and a hundredth those of
/// each scene.
pub(super) fn run(seeds: u32) -> Result<(Vec<Row>, Vec<Finding>), ExperimentError> {
    let recipes = recipes()?;
    let recipes: Vec<&dyn Recipe> = recipes.iter().map(|r| &**r).collect();
    let clips = u64::from(seeds / 100).max(1);
    let mut all: Vec<Vec<Followed>> = vec![Vec::new(); recipes.len()];
    for scene in SCENES {
        for (all, clips) in all.iter_mut().zip(on_clips(&recipes, scene, "", clips)?) {
            all.extend(clips);
        }
    }
    let each: Vec<Figures> = all.iter().map(|clips| figures(clips)).collect();
    let mut rows = Vec::new();
    for (figures, (name, _, _)) in each.iter().zip(&COMPARED) {
        let setting = format!("{} clips of scenes: {name}", clips as usize * SCENES.len());
        rows.extend([
            Row::new(&setting, "F, overlap above one half", figures.f),
            Row::new(&setting, "mean success AUC", figures.auc),
            Row::new(&setting, "windows scanned a frame", figures.windows),
            Row::new(&setting, "frames a second (varies from run to run)", figures.fps),
        ]);
    }
    let share = each[KALMAN].windows / each[TLD].windows;
    let setting = "kalman-tld over tld";
    rows.push(Row::new(setting, "windows scanned a frame", share).bar(Bar::AtMost(0.15)));
    rows.push(Row::new(setting, "frames a second (varies from run to run)", each[KALMAN].fps / each[TLD].fps));
    rows.extend(absences(&recipes[..=KALMAN], u64::from(seeds / 6).max(1))?);
    let findings = vec![Finding::new(
        "claims 3 and 6: the filtered box is steadier, the gate is quicker, and neither costs accuracy",
        each[KALMAN].auc >= each[TLD].auc && share < 1.0,
        format!(
            "AUC {} against {} of TLD, {} without the filtered box, {} without the gate, {} to the letter; {} of the windows",
            number(each[KALMAN].auc),
            number(each[TLD].auc),
            number(each[2].auc),
            number(each[3].auc),
            number(each[4].auc),
            number(share)
        ),
    )];
    Ok((rows, findings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_the_frames() {
        let judged = |visible, alive, overlap| ScoredFrame { visible, alive, overlap, score: 0.5 };
        let clip = |windows: f64| Followed {
            judged: vec![judged(true, true, 0.8), judged(true, false, 0.2), judged(false, true, 0.0)],
            windows: vec![windows, 0.0, 2.0 * windows],
            seconds: 0.5,
        };
        let got = figures(&[clip(100.0), clip(300.0)]);
        // One right box of two claimed and two visible.
        assert!((got.f - 0.5).abs() < 1e-12);
        assert_eq!((got.windows, got.fps), (300.0, 6.0));
        assert!((got.auc - success_auc(&[0.8, 0.2])).abs() < 1e-12);
    }

    #[test]
    fn every_compared_tracker_exists_and_follows() {
        for recipe in recipes().unwrap() {
            let followed = follow(&*recipe, "scene:leave-and-return?seed=1&duration=0.2").unwrap();
            assert!(followed.judged.len() >= 4 && followed.judged.iter().all(|j| j.overlap > 0.5), "{}", recipe.name());
            assert!(followed.windows.iter().all(|w| *w > 0.0));
        }
    }
}
