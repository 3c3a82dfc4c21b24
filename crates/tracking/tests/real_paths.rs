//! Motion models on the paths of real targets, where these lie beside the checkout: how far the centre predicted for the next frame lies
//! from the true one, of the model `gao2007` against constant velocity. Nothing is looked at: the true boxes are the measurements, each
//! with a normal error of a fiftieth of the target's size, as if 30 frames came in a second.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may panic, and says what it skips and measures")]

use pursuit_geometry::BBox;
use pursuit_tracking::motion::{
    Gao2007Params, HeldOrWhite, Motion, MotionFilter as _, MotionModel, MotionParams, Sight,
};
use rand_core::Rng as _;
use std::path::{Path, PathBuf};

const DT_S: f64 = 1.0 / 30.0;
/// Standard deviation of a measured centre, target sizes.
const SIGMA: f64 = 0.02;
/// Predictions before a filter has settled.
const SETTLED: usize = 8;
/// A path with fewer predictions than this says nothing.
const LEAST: usize = 30;
/// Errors that differ by less are equal.
const SAME: f64 = 0.02;

/// What a path is of, and its boxes; none where the target is away.
struct Course {
    thermal: bool,
    boxes: Vec<Option<BBox>>,
}

/// Files of truth below `folder`.
fn truths(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = folder.read_dir() else { return };
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            truths(&path, found);
        } else if name.ends_with(".csv") || name == "groundtruth.txt" {
            found.push(path);
        }
    }
}

/// The last four numbers of each line are left, top, width and height.
fn course(path: &Path) -> Course {
    let text = std::fs::read_to_string(path).unwrap();
    let numbers = |line: &str| {
        let fields: Vec<&str> = line.split([',', ' ', '\t']).filter(|f| !f.is_empty()).collect();
        let last = fields.get(fields.len().checked_sub(4)?..)?;
        last.iter().map(|f| f.trim().parse::<f64>().ok()).collect::<Option<Vec<f64>>>()
    };
    let boxes = text.lines().filter_map(numbers).map(|n| {
        let bbox = BBox::from_ltwh(n[0], n[1], n[2], n[3]);
        Some(bbox).filter(|b| b.is_finite() && !b.is_empty())
    });
    let name = path.to_string_lossy().into_owned();
    Course { thermal: name.contains("IR") || name.contains("/ir/"), boxes: boxes.collect() }
}

/// The change of a path's step over the step, root mean squares: 0 straight on, 1.7 a target that stands and boxes that shake.
fn unevenness(course: &Course) -> f64 {
    let (mut steps, mut changes) = (0.0, 0.0);
    for three in course.boxes.windows(3) {
        if let [Some(a), Some(b), Some(c)] = three {
            let (a, b, c) = (a.center(), b.center(), c.center());
            steps += (c.x - b.x).powi(2) + (c.y - b.y).powi(2);
            changes += (c.x - 2.0 * b.x + a.x).powi(2) + (c.y - 2.0 * b.y + a.y).powi(2);
        }
    }
    (changes / f64::max(steps, 1e-12)).sqrt()
}

/// Root mean square distance of the predicted centres from the true ones, target sizes.
fn error_of(course: &Course, params: &MotionParams) -> Option<f64> {
    let mut random = rand_pcg::Pcg64::new(1, 1);
    // Twelve uniform numbers are near enough to a normal one.
    let mut normal = || (0..12).map(|_| f64::from(random.next_u32()) / f64::from(u32::MAX)).sum::<f64>() - 6.0;
    let (mut motion, mut age): (Option<Motion>, usize) = (None, 0);
    let (mut squares, mut count) = (0.0, 0_usize);
    for truth in &course.boxes {
        let Some(truth) = truth else {
            motion = None;
            continue;
        };
        let size = truth.area().sqrt();
        let measured = truth.translated(SIGMA * size * normal(), SIGMA * size * normal());
        let Some(motion) = &mut motion else {
            (motion, age) = (Some(Motion::new(params.clone(), measured).unwrap()), 0);
            continue;
        };
        let prior = motion.predict(DT_S).unwrap();
        age += 1;
        if age > SETTLED {
            squares += (prior.bbox.center().distance(truth.center()) / size).powi(2);
            count += 1;
        }
        motion.correct(&Sight::of(measured, None)).unwrap();
    }
    (count >= LEAST).then(|| (squares / count as f64).sqrt())
}

fn models() -> Vec<(&'static str, MotionParams)> {
    let of = |model| MotionParams { model, ..MotionParams::default() };
    let gao = |noise, guard| MotionParams {
        gao2007: Gao2007Params { noise, guard, ..Gao2007Params::default() },
        ..of(MotionModel::Gao2007)
    };
    vec![
        ("constant-velocity", of(MotionModel::ConstantVelocity)),
        ("gao2007", of(MotionModel::Gao2007)),
        ("gao2007, no guard", gao(HeldOrWhite::White, 0.0)),
        ("gao2007, held, no guard", gao(HeldOrWhite::Held, 0.0)),
        ("zhu2014", of(MotionModel::Zhu2014)),
        ("imm", of(MotionModel::Imm)),
    ]
}

/// The geometric mean of the errors over those of constant velocity, and on how many paths they are smaller, and larger.
fn summary(errors: &[Vec<f64>], model: usize) -> (f64, usize, usize) {
    let ratios: Vec<f64> = errors.iter().map(|e| e[model] / e[0]).collect();
    let mean = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
    let count = |counts: &dyn Fn(f64) -> bool| ratios.iter().filter(|r| counts(**r)).count();
    (mean, count(&|r| r < 1.0 - SAME), count(&|r| r > 1.0 + SAME))
}

#[test]
fn the_guarded_regression_predicts_real_paths_better_than_constant_velocity() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let mut files = Vec::new();
    for folder in ["ir", "sot", "sot2", "sot3"] {
        truths(&data.join(folder), &mut files);
    }
    if files.is_empty() {
        eprintln!("skipped: no paths in {}", data.display());
        return;
    }
    let models = models();
    let mut kinds: [(&str, Vec<Vec<f64>>); 4] = [
        ("thermal", Vec::new()),
        ("even: the step changes by less than .35 of itself", Vec::new()),
        ("uneven: by .35 to .9", Vec::new()),
        ("jumps, or stands: by .9 and more", Vec::new()),
    ];
    for course in files.iter().map(|f| course(f)) {
        let errors: Option<Vec<f64>> = models.iter().map(|(_, params)| error_of(&course, params)).collect();
        let Some(errors) = errors.filter(|e| e[0] > 0.0) else { continue };
        let kind = match unevenness(&course) {
            _ if course.thermal => 0,
            u if u < 0.35 => 1,
            u if u < 0.9 => 2,
            _ => 3,
        };
        kinds[kind].1.push(errors);
    }
    for (kind, errors) in kinds.iter().filter(|(_, errors)| !errors.is_empty()) {
        eprintln!("{kind}, {} paths", errors.len());
        for (model, (name, _)) in models.iter().enumerate() {
            let (mean, better, worse) = summary(errors, model);
            eprintln!("  {name:<24} {mean:.3}, better on {better}, worse on {worse}");
        }
    }
    let all: Vec<Vec<f64>> = kinds.into_iter().flat_map(|(_, errors)| errors).collect();
    let (guarded, better, worse) = summary(&all, 1);
    let (held, ..) = summary(&all, 3);
    assert!(
        guarded < 0.99 && better > 3 * worse,
        "{guarded:.3}, better on {better} and worse on {worse} of {}",
        all.len()
    );
    assert!(held > guarded, "{held:.3}: what is believed nearly as it is makes the velocity swing");
}
