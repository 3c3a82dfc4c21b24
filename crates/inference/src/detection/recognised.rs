//! What a network is, told from the shape of its answer and the names in its file, where nothing beside it says so.

use super::config::{BoxCoding, DetectionConfig, Family};
use super::names;
use crate::{InferenceError, Network, Result};

/// What a file says of itself, as exporters write it (`metadata_props`).
#[derive(Debug, Clone, Default)]
pub(super) struct Said {
    /// Names of its classes.
    pub names: Option<Vec<String>>,
    /// What it was trained for, in the words of its exporter: `detect`, `segment` …
    pub task: Option<String>,
    /// Width and height of its image.
    pub image: Option<(usize, usize)>,
}

impl Said {
    pub fn read(metadata: &[(String, String)]) -> Self {
        let of = |key: &str| metadata.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str());
        // Rows and columns, `[480, 640]`, or one number for both.
        let image = of("imgsz").and_then(|text| {
            let sides = text.trim().trim_matches(['[', ']', '(', ')']).split(',').map(|side| side.trim().parse().ok());
            match *sides.collect::<Option<Vec<usize>>>()? {
                [both] => Some((both, both)),
                [rows, columns] => Some((columns, rows)),
                _ => None,
            }
        });
        let image = image.filter(|&(columns, rows)| [columns, rows].iter().all(|side| (1..=4096).contains(side)));
        Self { names: of("names").and_then(names::parsed), task: of("task").map(str::to_owned), image }
    }
}

/// Numbers of boxes of grids of 8, 16 and 32 pixels, and of those of large images with 64 too.
fn cells((width, height): (usize, usize)) -> [usize; 2] {
    let of = |strides: &[usize]| strides.iter().map(|s| (width / s) * (height / s)).sum();
    [of(&[8, 16, 32]), of(&[8, 16, 32, 64])]
}

/// What the network may be, with how many classes; `None` where the shape does not say.
fn candidates(shape: [usize; 2], image: (usize, usize)) -> Vec<(Family, Option<usize>)> {
    let cells = cells(image);
    let once = |boxes: usize| boxes > 0 && cells.contains(&boxes);
    let thrice = |boxes: usize| boxes > 0 && cells.map(|c| 3 * c).contains(&boxes);
    let mut found = Vec::new();
    let mut add = |family, numbers: usize, besides: usize| {
        if numbers > besides {
            found.push((family, Some(numbers - besides)));
        }
    };
    let [first, second] = shape;
    if once(second) {
        add(Family::Yolov8, first, 4);
    }
    if once(first) {
        add(Family::Yolox, second, 5);
        add(Family::Yolov8, second, 4);
    }
    if thrice(first) {
        add(Family::Yolov5, second, 5);
    }
    if !once(first) && !thrice(first) && !once(second) {
        // Boxes that come from no grid: few, and chosen.
        add(Family::RtDetr, second, 4);
        if second == 6 {
            found.push((Family::EndToEnd, None));
        }
    }
    found
}

/// Whether the answer to an empty image speaks against a family.
fn is_against(family: Family, answer: &[f32], [boxes, numbers]: [usize; 2]) -> bool {
    let mut rows = answer.chunks_exact(numbers.max(1)).take(boxes);
    let fraction = |v: &f32| (-0.5..=1.5).contains(v);
    match family {
        Family::RtDetr => !rows.all(|row| row.iter().all(fraction)),
        Family::EndToEnd => !rows.all(|row| match *row {
            [.., score, class] => (0.0..=1.0).contains(&score) && class >= 0.0 && class.fract() == 0.0,
            _ => false,
        }),
        Family::Yolox | Family::Yolov5 | Family::Yolov8 => false,
    }
}

/// Whether boxes that should be relative to their cells are in pixels: most lie where their cell does. Relative ones are within a
/// few cells of the upper left corner, wherever their own is.
fn in_pixels(answer: &[f32], [boxes, numbers]: [usize; 2], (width, height): (usize, usize)) -> bool {
    let of_stride = |s: usize| (0..height / s).flat_map(move |y| (0..width / s).map(move |x| (x, y, s as f32)));
    let cells = [8, 16, 32, 64].into_iter().flat_map(of_stride).take(boxes);
    let near = |place: f32, cell: usize, side: f32| (place - (cell as f32 + 0.5) * side).abs() <= 2.0 * side;
    let there = cells.zip(answer.chunks_exact(numbers.max(1))).filter(|((x, y, s), row)| match **row {
        [across, down, ..] => near(across, *x, *s) && near(down, *y, *s),
        _ => false,
    });
    2 * there.count() > boxes
}

/// What is not clear, and what would make it so.
type Unclear = (String, String);

/// What `network` is, whose image has so many pixels: its configuration, or what is not clear and what would make it so. `names` are
/// those of its classes, where they are known, and `said` is what its file says.
pub(super) fn recognised(
    network: &dyn Network,
    image: (usize, usize),
    names: Option<Vec<String>>,
    said: &Said,
) -> Result<DetectionConfig> {
    let toml = std::path::Path::new(network.name()).with_extension("toml");
    let beside = format!("in a file {} beside it", toml.display());
    let unclear = |(why, mend): Unclear| InferenceError::Model { what: network.name().to_owned(), why, mend };
    if let Some(task) = said.task.as_deref().filter(|task| *task != "detect") {
        let task: String = task.chars().take(40).collect();
        let why = format!("it was exported for the task `{task}`, not to detect objects");
        return Err(unclear((why, "export one that was trained to detect".into())));
    }
    let shape = network.outputs().first().map(|p| p.shape.clone()).unwrap_or_default();
    let [1, boxes, numbers] = *shape.as_slice() else {
        let why = format!("nothing describes it, and its output is {shape:?}, as no detector known answers");
        return Err(unclear((why, "export it with boxes and scores in one output, 1 x boxes x numbers".into())));
    };
    let shape = [boxes, numbers];
    let family = family(shape, image, network.output(0), names.as_ref().map(Vec::len), &beside).map_err(unclear)?;
    let of_family = DetectionConfig::of(family);
    let config = DetectionConfig { classes: names.unwrap_or_else(|| of_family.classes.clone()), ..of_family };
    // A network for large images has a grid more.
    let large = config.boxes == BoxCoding::Grid && cells(image)[1] == boxes;
    let strides = if large { vec![8, 16, 32, 64] } else { config.strides.clone() };
    let config = DetectionConfig { strides, ..config };
    let mend = || format!("write `classes = [\"…\", …]` {beside}");
    config.check().map_err(|why| unclear((format!("its file names its classes, but {why}"), mend())))?;
    Ok(config)
}

/// The one family that answers in this shape, where `named` classes have names.
fn family(
    shape: [usize; 2],
    image: (usize, usize),
    answer: &[f32],
    named: Option<usize>,
    beside: &str,
) -> Result<Family, Unclear> {
    let output = format!("its output is 1 x {} x {}", shape[0], shape[1]);
    let quoted = |f: &Family| format!("\"{}\"", f.as_str());
    let listed = |families: &[Family], between: &str| families.iter().map(quoted).collect::<Vec<_>>().join(between);
    let mut found = candidates(shape, image);
    found.retain(|&(family, _)| !is_against(family, answer, shape));
    let wanted = named.unwrap_or(super::COCO.len());
    let fitting: Vec<Family> =
        found.iter().filter(|(_, classes)| classes.is_none_or(|c| c == wanted)).map(|f| f.0).collect();
    match (fitting.as_slice(), named) {
        ([Family::EndToEnd], None) => Err((
            "its boxes come with the numbers of their classes, and nothing names those".to_owned(),
            format!("write `classes = [\"…\", …]` {beside}"),
        )),
        ([Family::Yolox], _) if in_pixels(answer, shape, image) => Err((
            format!("{output} with boxes in pixels, which may be YOLOv6 or YOLOX decoded in the network"),
            format!(
                "write {beside} `family = \"yolov5\"` for YOLOv6, `family = \"yolox\"` and `boxes = \"pixels\"` for YOLOX"
            ),
        )),
        (&[family], _) => Ok(family),
        ([], _) if found.is_empty() => Err((
            format!("nothing describes it, and {output} for an image of {} x {}", image.0, image.1),
            format!(
                "write `family = …` (one of {}), or how it answers, and `classes = [\"…\", …]` {beside}",
                listed(Family::ALL, ", ")
            ),
        )),
        ([], _) => {
            let of = |classes: Option<usize>| classes.map_or_else(|| "any number of".into(), |c| c.to_string());
            let may = found.iter().map(|(family, c)| format!("{} of {} classes", quoted(family), of(*c)));
            let has = named.map_or_else(|| "nothing names its classes".into(), |n| format!("{n} classes are named"));
            Err((
                format!("{output}, which may be {}, and {has}", may.collect::<Vec<_>>().join(" or ")),
                format!("write `family = \"…\"` and `classes = [\"…\", …]` {beside}"),
            ))
        }
        (several, _) => Err((
            format!("{output}, which may be {}", listed(several, " or ")),
            format!("write `family = …` {beside}, one of these"),
        )),
    }
}

/// What a network was taken for, in a line.
pub(super) fn in_words(name: &str, config: &DetectionConfig, image: (usize, usize)) -> String {
    let like = match config.family {
        Family::Yolox => "YOLOX",
        Family::Yolov5 => "YOLOv5 (or v7)",
        Family::Yolov8 => "YOLOv8 (or v9, 11, 12)",
        Family::RtDetr => "RT-DETR",
        Family::EndToEnd => "a YOLO that chooses among its boxes itself (v10, 26, or exported with suppression)",
    };
    let classes = &config.classes;
    let some = classes.iter().take(3).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = if classes.len() > 3 { ", …" } else { "" };
    let (columns, rows) = image;
    format!("{name} is taken for {like}: {} classes ({some}{more}), images of {columns} x {rows}", classes.len())
}
