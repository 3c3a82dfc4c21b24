//! The paper's comparison: the tracker, the paper alone, plain KCF and ACPF, on clips of the scene `rgbd-occlusion` and on
//! sequences of the user's.

use super::again::{Again, Count, windows};
use super::clip::{Followed, Shown, follow};
use super::clips::{ClipFigures, figures, scene_frames};
use crate::ExperimentError;
use crate::result::{Bar, Finding, Row};
use crate::table::number;
use pursuit_charts::{Axis, Chart, Color, Series};
use pursuit_evaluation::metrics::one_pass::{precision, success_curve};
use pursuit_evaluation::{Dataset, Footage, Sequence};
use pursuit_geometry::Truth;
use pursuit_imaging::Frame;
use pursuit_media::Source;
use pursuit_trackers::depth_occlusion::DepthOcclusionParams;
use pursuit_tracking::Recipe;
use rayon::prelude::*;
use std::path::Path;

/// What the paper's Table 1 and its text say of a tracker. MI, FT and MT, in percent there, are read as the Princeton
/// benchmark's types III, II and I: the text explains MT alone, as the share of frames in which tracking fails.
#[derive(Debug, Clone, Copy)]
struct Printed {
    auc: f64,
    center_px: f64,
    missing: Option<f64>,
    false_box: Option<f64>,
    wrong_box: f64,
    fps: f64,
}

/// A name, the registry's, settings, and the paper's figures.
type Compared = (&'static str, &'static str, &'static str, Option<Printed>);
/// Pictures by file name.
type Charts = Vec<(String, Chart)>;

const PRINTED: Printed =
    Printed { auc: 0.6923, center_px: 14.258, missing: Some(0.0), false_box: Some(0.018), wrong_box: 0.0, fps: 25.381 };
const PRINTED_KCF: Printed =
    Printed { auc: 0.53628, center_px: 54.53524, missing: None, false_box: None, wrong_box: 0.31, fps: 69.725 };
const PRINTED_ACPF: Printed =
    Printed { auc: 0.45127, center_px: 43.27308, missing: None, false_box: None, wrong_box: 0.33, fps: 20.153 };

/// Who is compared: name in the tables, in the registry, settings, and the paper's figures.
const COMPARED: [Compared; 6] = [
    ("depth-occlusion", "depth-occlusion", "", Some(PRINTED)),
    (
        "depth-occlusion, the paper alone",
        "depth-occlusion",
        "min_clear = 0.2\ndrop_clear = 0.2\ncover_weight = 0.0\nlearn_covered = 1.0\nvelocity_doubt = 0.0\noccluder_edges = false\nscale_from_depth = false",
        None,
    ),
    ("depth-occlusion-fused", "depth-occlusion-fused", "", None),
    ("plain KCF on depth", "kcf-depth", "policy.model = 'always'", Some(PRINTED_KCF)),
    ("plain KCF on colour", "kcf", "policy.model = 'always'", None),
    ("acpf", "acpf", "", Some(PRINTED_ACPF)),
];
/// The one that has bars, and the one it is measured against.
const OURS: usize = 0;
const PLAIN: usize = 3;
/// Seeds from here on chose nothing: the thresholds were fitted on seeds below 100.
const FIRST_SEED: u64 = 10_000;

/// Keys of the clip of a seed: 15 to 30 frames wholly hidden, 0.3 to 1.5 m before the target, by a board or by what looks
/// almost like it, with a camera that stands or sweeps.
pub(crate) fn keys(seed: u64) -> String {
    let nearer = [300, 500, 900, 1500][(seed % 4) as usize];
    let occluder = if (seed / 4).is_multiple_of(2) { "board" } else { "similar" };
    let pan = if seed.is_multiple_of(3) { 40 } else { 0 };
    format!("duration=4&hidden={}&nearer={nearer}&occluder={occluder}&pan={pan}", 15 + seed % 16)
}

fn recipes() -> Result<Vec<Box<dyn Recipe>>, ExperimentError> {
    let recipe = |(_, name, settings, _): &Compared| {
        let settings = settings.parse::<toml::Table>().map_err(|e| ExperimentError::usage(e.to_string()))?;
        Ok(pursuit_trackers::registry::tracker(name)?.recipe(&settings)?)
    };
    COMPARED.iter().map(recipe).collect()
}

/// Every tracker on the same frames.
fn compare(recipes: &[Box<dyn Recipe>], frames: &[(Frame, Shown)]) -> Result<Vec<Followed>, ExperimentError> {
    recipes.iter().map(|r| follow(&**r, frames.iter().map(|(f, s)| (f.undecorated(), *s)))).collect()
}

/// Table 1 of clips made here; pictures are of the first.
pub(super) fn on_scenes(clips: u32) -> Result<(Vec<Row>, Vec<Finding>, Charts), ExperimentError> {
    let recipes = recipes()?;
    let seeds = FIRST_SEED..FIRST_SEED + u64::from(clips);
    let all: Vec<Vec<Followed>> = seeds
        .into_par_iter()
        .map(|seed| {
            let query = format!("scene:rgbd-occlusion?seed={seed}&{}", keys(seed));
            compare(&recipes, &scene_frames(&query)?.collect::<Vec<_>>())
        })
        .collect::<Result<_, _>>()?;
    let of =
        |k: usize| -> ClipFigures { figures(&all.iter().filter_map(|clip| clip.get(k).cloned()).collect::<Vec<_>>()) };
    let each: Vec<ClipFigures> = (0..COMPARED.len()).map(of).collect();
    let mut rows = Vec::new();
    for (k, (figures, (name, _, _, paper))) in each.iter().zip(&COMPARED).enumerate() {
        let setting = format!("{clips} clips with an occlusion: {name}");
        rows.extend(table(&setting, figures, *paper, k == OURS));
    }
    let (ours, plain) = (&each[OURS], &each[PLAIN]);
    let setting = "depth-occlusion over plain KCF on depth";
    let ratio = |a: f64, b: f64| a / b.max(1e-9);
    rows.push(
        Row::new(setting, "AUC", ratio(ours.auc, plain.auc))
            .paper(PRINTED.auc / PRINTED_KCF.auc)
            .bar(Bar::AtLeast(1.29)),
    );
    rows.push(
        Row::new(setting, "centre error", ratio(ours.center_px[2], plain.center_px[2]))
            .paper(PRINTED.center_px / PRINTED_KCF.center_px)
            .bar(Bar::AtMost(0.26)),
    );
    rows.extend(found_again(clips)?);
    let paper_alone = &each[1];
    let findings = vec![Finding::new(
        "depth tells occlusions, and the frozen filter finds the target again",
        paper_alone.told >= 0.9 && paper_alone.relocked >= 0.5,
        format!(
            "the paper's rules alone tell {} of the hidden frames, call {} of the others hidden and are back within five \
             frames in {} of the clips; with the cover, the occluder's edges and the size by distance: {}, {} and {}",
            number(paper_alone.told),
            number(paper_alone.false_alarms),
            number(paper_alone.relocked),
            number(ours.told),
            number(ours.false_alarms),
            number(ours.relocked)
        ),
    )];
    let charts = all.first().map_or_else(Vec::new, |first| pictures("clip", first));
    Ok((rows, findings, charts))
}

/// Equation (30) on windows of the same clips, with the bars of the reference.
fn found_again(clips: u32) -> Result<Vec<Row>, ExperimentError> {
    let seeds = FIRST_SEED..FIRST_SEED + u64::from(clips);
    let mut rows = Vec::new();
    for (name, params, judged) in [
        ("as it is", DepthOcclusionParams::default(), true),
        ("the paper alone", DepthOcclusionParams::zhai2024(), false),
    ] {
        let windows = |seed| windows(&params, &format!("scene:rgbd-occlusion?seed={seed}&{}", keys(seed)), seed);
        let again: Vec<Again> = seeds.clone().into_par_iter().map(windows).collect::<Result<_, _>>()?;
        let again = again.into_iter().fold(Again::default(), Again::and);
        let setting = format!("windows taken for the target once it was hidden, equation (30), {name}");
        let row = |what: &str, count: Count, reference: f64, bar| {
            Row::new(setting.as_str(), format!("{what}, of {}", count.all), count.rate())
                .reference(reference)
                .bar_if(judged.then_some(bar))
        };
        rows.push(row("the target, wholly back", again.target, 0.998, Bar::AtLeast(0.97)));
        rows.push(row("background", again.background, 0.0, Bar::AtMost(0.01)));
        rows.push(row("what hides it", again.occluder, 0.0, Bar::AtMost(0.01)));
    }
    Ok(rows)
}

/// The rows of one tracker.
fn table(setting: &str, f: &ClipFigures, paper: Option<Printed>, judged: bool) -> Vec<Row> {
    let row = |figure: &str, value: f64, bar: Bar| Row::new(setting, figure, value).bar_if(judged.then_some(bar));
    let free = |figure: &str, value: f64| Row::new(setting, figure, value);
    let with = |row: Row, value: Option<f64>| match value {
        Some(value) => row.paper(value),
        None => row,
    };
    vec![
        with(free("AUC", f.auc), paper.map(|p| p.auc)),
        with(free("centre error, px", f.center_px[2]), paper.map(|p| p.center_px)),
        free("centre error along x, px", f.center_px[0]),
        free("centre error along y, px", f.center_px[1]),
        row("precision (overlap above one half)", f.precision, Bar::AtLeast(0.857)),
        row("clips at whose end it is not followed", f.missed, Bar::AtMost(0.0)),
        row("hidden frames told", f.told, Bar::AtLeast(0.9)),
        row("frames in sight called hidden", f.false_alarms, Bar::AtMost(0.01)),
        row("followed within five frames of being back", f.relocked, Bar::AtLeast(0.9)),
        with(free("MT, share of frames: wrong box (Princeton type I)", f.types.wrong_box), paper.map(|p| p.wrong_box)),
        with(
            free("FT, share of frames: a box of nothing (type II)", f.types.false_box),
            paper.and_then(|p| p.false_box),
        ),
        with(free("MI, share of frames: no box (type III)", f.types.missing_box), paper.and_then(|p| p.missing)),
    ]
}

/// Like the paper's Figures 1 and 3: x and y against time for each tracker; success and centre error curves.
fn pictures(name: &str, followed: &[Followed]) -> Vec<(String, Chart)> {
    let colors = [Color::Estimate, Color::Predicted, Color::Other];
    let shown: Vec<_> = [OURS, PLAIN, COMPARED.len() - 1]
        .into_iter()
        .zip(colors)
        .filter_map(|(k, color)| Some((COMPARED.get(k)?.0, followed.get(k)?, color)))
        .collect();
    let axis = |label: &str, pick: fn(&pursuit_geometry::BBox) -> f64| {
        let mut chart = Chart::new(format!("zhai2024: {label} of the centre"), Axis::new("frame"), Axis::new(label));
        if let Some((_, first, _)) = shown.first() {
            let truth =
                first.frames.iter().enumerate().filter_map(|(k, (s, _))| Some(((k + 1) as f64, pick(&s.bbox?))));
            chart = chart.with(Series::line("true", Color::Truth, truth.collect()));
        }
        for (name, followed, color) in &shown {
            let points = followed.frames.iter().enumerate().map(|(k, (_, said))| ((k + 1) as f64, pick(&said.bbox)));
            chart = chart.with(Series::line(*name, *color, points.collect()));
        }
        chart
    };
    let mut success = Chart::new("zhai2024: success", Axis::new("overlap above"), Axis::new("share of visible frames"));
    let mut error =
        Chart::new("zhai2024: centre error", Axis::new("at most, px"), Axis::new("share of visible frames"));
    for (name, followed, color) in &shown {
        let curve = success_curve(&followed.overlaps());
        let points = curve.iter().enumerate().map(|(k, v)| (k as f64 / (curve.len() - 1) as f64, *v)).collect();
        success = success.with(Series::line(*name, *color, points));
        let errors: Vec<f64> = followed.center_errors().iter().map(|e| e[2]).collect();
        let points = (0..=50).map(|px| (f64::from(px), precision(&errors, f64::from(px)))).collect();
        error = error.with(Series::line(*name, *color, points));
    }
    vec![
        (format!("{name}_x"), axis("x, px", |b| b.center().x)),
        (format!("{name}_y"), axis("y, px", |b| b.center().y)),
        (format!("{name}_success"), success),
        (format!("{name}_centre_error"), error),
    ]
}

/// Table 1 of the sequences below `folder`: those of the Princeton benchmark, or any others with depth.
pub(super) fn on_dataset(folder: &Path) -> Result<(Vec<Row>, Charts), ExperimentError> {
    let wrong = |e: pursuit_evaluation::EvaluationError| ExperimentError::usage(e.to_string());
    let dataset = Dataset::discover(folder, &pursuit_media::OpenOptions::default()).map_err(wrong)?;
    if let (true, Some(problem)) = (dataset.sequences.is_empty(), dataset.problems.into_iter().next()) {
        return Err(wrong(problem));
    }
    if dataset.sequences.is_empty() {
        let folder = folder.display();
        return Err(ExperimentError::usage(format!(
            "{folder} holds no sequence; give a folder of the Princeton Tracking Benchmark (rgb/, depth/, init.txt), whose \
             images have to be had from its authors"
        )));
    }
    let recipes = recipes()?;
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for sequence in &dataset.sequences {
        let frames = sequence_frames(sequence)?;
        let followed = compare(&recipes, &frames)?;
        for (followed, (name, _, _, paper)) in followed.iter().zip(&COMPARED) {
            let figures = figures(std::slice::from_ref(followed));
            let setting = format!("{}: {name}", sequence.name());
            // The paper's table is of this sequence.
            let paper = paper.filter(|_| sequence.name().ends_with("new_ex_occ4"));
            rows.extend(table(&setting, &figures, paper, false));
            let speed = Row::new(setting, "updates per second", figures.fps);
            rows.push(match paper {
                Some(paper) => speed.paper(paper.fps),
                None => speed,
            });
        }
        charts.extend(pictures(&sequence.name().replace('/', "_"), &followed));
    }
    Ok((rows, charts))
}

/// The frames of a sequence from its first box on; frames of which nothing is known are left out of the counts.
fn sequence_frames(sequence: &Sequence) -> Result<Vec<(Frame, Shown)>, ExperimentError> {
    let first = sequence.first_visible().map_or(0, |(k, _)| k);
    let Footage::Input { path, first: skipped } = sequence.footage() else { return Ok(Vec::new()) };
    let unreadable = |e: pursuit_media::MediaError| ExperimentError::usage(e.to_string());
    let open = pursuit_media::OpenOptions::default();
    let mut source = pursuit_media::open(path, &open).map_err(unreadable)?;
    let mut frames = Vec::new();
    for k in 0..skipped + sequence.truth().len() {
        let Some(frame) = source.next_frame().map_err(unreadable)? else { break };
        let Some(truth) = k.checked_sub(*skipped).filter(|k| *k >= first).and_then(|k| sequence.truth().get(k)) else {
            continue;
        };
        let shown = match truth {
            Truth::Visible(bbox) => Shown { bbox: Some(*bbox), visible: 1.0 },
            Truth::Absent => Shown { bbox: None, visible: 0.0 },
            Truth::Unknown => Shown { bbox: None, visible: f64::NAN },
        };
        frames.push((frame, shown));
    }
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_differ_as_they_should() {
        let all: std::collections::BTreeSet<String> = (FIRST_SEED..FIRST_SEED + 100).map(keys).collect();
        assert_eq!(all.len(), 32, "sixteen of them with either camera");
        for (words, least) in [("nearer=300", 20), ("occluder=similar", 40), ("pan=40", 30), ("hidden=30", 3)] {
            let count = (FIRST_SEED..FIRST_SEED + 100).filter(|s| keys(*s).contains(words)).count();
            assert!(count >= least, "{words}: {count}");
        }
        assert!(pursuit_scenes::open(&format!("scene:rgbd-occlusion?seed=1&{}", keys(7))).is_ok());
    }

    #[test]
    fn everyone_follows_the_same_clip() {
        let (rows, _, charts) = on_scenes(1).unwrap();
        assert_eq!(rows.len(), 12 * COMPARED.len() + 2 + 6);
        assert!(rows.iter().all(|r| r.ours.value.is_finite()));
        assert_eq!(charts.len(), 4);
        let value = |setting: &str, figure: &str| {
            let found = rows.iter().find(|r| r.setting.ends_with(setting) && r.figure == figure);
            found.unwrap().ours.value
        };
        assert!(value(": depth-occlusion", "AUC") > 0.6 && value("plain KCF on depth", "AUC") < 0.6);
        assert!(on_dataset(Path::new("/no/such/folder")).is_err());
    }
}
