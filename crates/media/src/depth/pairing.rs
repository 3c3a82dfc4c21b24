use serde::Serialize;
use std::path::{Path, PathBuf};

/// How depth images were put beside the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pairing {
    /// Of the same number, as the names tell.
    FrameId,
    /// Nearest in time, as the names tell.
    NearestTime,
    /// In their order.
    Order,
    /// As a list says.
    List,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PairingFacts {
    /// How they were paired.
    pub pairing: Pairing,
    /// Frames with a depth image.
    pub paired: usize,
    /// Frames without: those are followed by the picture alone.
    pub unpaired: usize,
    /// The largest difference between the times of a frame and its depth image, in seconds, where the names tell times.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_offset_s: Option<f64>,
    /// The mean of those differences, depth less picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_offset_s: Option<f64>,
}

/// Time in microseconds and number of a frame, as the Princeton benchmark names its files: `r-TIME-ID.png`, `d-TIME-ID.png`.
fn stamp(path: &Path) -> Option<(f64, u64)> {
    let stem = path.file_stem()?.to_str()?;
    let mut parts = stem.split('-');
    let (kind, time, id) = (parts.next()?, parts.next()?, parts.next()?);
    let named = matches!(kind, "r" | "d") && parts.next().is_none();
    named.then_some(())?;
    Some((time.parse::<u64>().ok()? as f64, id.parse().ok()?))
}

/// The number at the end of a name.
fn number(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.len() - stem.bytes().rev().take_while(u8::is_ascii_digit).count();
    stem[digits..].parse().ok()
}

/// The seconds at the start or end of a name such as `1305031102.175304.png` (the TUM benchmark).
fn seconds(path: &Path) -> Option<f64> {
    let stem = path.file_stem()?.to_str()?;
    stem.contains('.').then(|| stem.parse::<f64>().ok().filter(|s| s.is_finite())).flatten()
}

/// Which of `depth` belongs to each of `images`, both in natural order: by frame number where that is unmistakable, else by
/// time, else by order. Depth farther than a frame and a half in time belongs to none.
pub(crate) fn pair(images: &[PathBuf], depth: &[PathBuf]) -> (Vec<Option<PathBuf>>, PairingFacts) {
    let stamps = |files: &[PathBuf]| files.iter().map(|p| stamp(p)).collect::<Option<Vec<_>>>();
    if let (Some(a), Some(b)) = (stamps(images), stamps(depth)) {
        let (ids, times) = (|s: &[(f64, u64)]| s.iter().map(|s| s.1).collect::<Vec<_>>(), 1e-6);
        let time = |s: &[(f64, u64)]| s.iter().map(|s| s.0 * times).collect::<Vec<_>>();
        if let Some(found) = by_id(&ids(&a), &ids(&b)) {
            return told(found, depth, Pairing::FrameId, Some((&time(&a), &time(&b))));
        }
        let (a, b) = (time(&a), time(&b));
        return told(by_time(&a, &b), depth, Pairing::NearestTime, Some((&a, &b)));
    }
    let times = |files: &[PathBuf]| files.iter().map(|p| seconds(p)).collect::<Option<Vec<_>>>();
    if let (Some(a), Some(b)) = (times(images), times(depth)) {
        return told(by_time(&a, &b), depth, Pairing::NearestTime, Some((&a, &b)));
    }
    let numbers = |files: &[PathBuf]| files.iter().map(|p| number(p)).collect::<Option<Vec<_>>>();
    if let (Some(a), Some(b)) = (numbers(images), numbers(depth))
        && let Some(found) = by_id(&a, &b)
    {
        return told(found, depth, Pairing::FrameId, None);
    }
    let found = (0..images.len()).map(|k| (k < depth.len()).then_some(k)).collect();
    told(found, depth, Pairing::Order, None)
}

/// By number; `None` where numbers repeat, or fewer than half find theirs.
fn by_id(images: &[u64], depth: &[u64]) -> Option<Vec<Option<usize>>> {
    let mut of: std::collections::HashMap<u64, usize> = std::collections::HashMap::with_capacity(depth.len());
    for (k, id) in depth.iter().enumerate() {
        if of.insert(*id, k).is_some() {
            return None;
        }
    }
    let found: Vec<Option<usize>> = images.iter().map(|id| of.get(id).copied()).collect();
    (2 * found.iter().flatten().count() >= images.len()).then_some(found)
}

/// The nearest in time within a frame and a half.
fn by_time(images: &[f64], depth: &[f64]) -> Vec<Option<usize>> {
    let mut sorted: Vec<(f64, usize)> = depth.iter().copied().zip(0..).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut steps: Vec<f64> = images.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let most = steps.get(steps.len().saturating_sub(1) / 2).map_or(f64::INFINITY, |step| 1.5 * step.abs());
    let nearest = |time: &f64| {
        let at = sorted.partition_point(|(t, _)| t < time);
        let around = [at.checked_sub(1), Some(at)].into_iter().flatten().filter_map(|k| sorted.get(k));
        let best = around.min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs()))?;
        ((best.0 - time).abs() <= most).then_some(best.1)
    };
    images.iter().map(nearest).collect()
}

/// The files that were found, and what is to be said of it.
fn told(
    found: Vec<Option<usize>>,
    depth: &[PathBuf],
    pairing: Pairing,
    times: Option<(&[f64], &[f64])>,
) -> (Vec<Option<PathBuf>>, PairingFacts) {
    let offsets: Option<Vec<f64>> = times.map(|(a, b)| {
        let offset = |(k, at): (usize, &Option<usize>)| at.map(|at| b[at] - a[k]);
        found.iter().enumerate().filter_map(offset).collect()
    });
    let offsets = offsets.filter(|o| !o.is_empty());
    let paired = found.iter().flatten().count();
    let facts = PairingFacts {
        pairing,
        paired,
        unpaired: found.len() - paired,
        largest_offset_s: offsets.as_ref().map(|o| o.iter().fold(0.0, |most: f64, v| most.max(v.abs()))),
        mean_offset_s: offsets.as_ref().map(|o| o.iter().sum::<f64>() / o.len() as f64),
    };
    (found.into_iter().map(|at| at.and_then(|at| depth.get(at).cloned())).collect(), facts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    fn paired(images: &[&str], depth: &[&str]) -> (Vec<Option<String>>, PairingFacts) {
        let (found, facts) = pair(&paths(images), &paths(depth));
        (found.into_iter().map(|p| p.map(|p| p.display().to_string())).collect(), facts)
    }

    fn some(names: &[&str]) -> Vec<Option<String>> {
        names.iter().map(|n| (!n.is_empty()).then(|| (*n).to_owned())).collect()
    }

    #[test]
    fn princeton_frames_go_by_their_number_and_the_offset_is_told() {
        let images = ["r-0-1.png", "r-33369-2.png", "r-66739-3.png"];
        let (found, facts) = paired(&images, &["d-5000-1.png", "d-38369-2.png", "d-100108-4.png"]);
        assert_eq!(found, some(&["d-5000-1.png", "d-38369-2.png", ""]));
        assert_eq!((facts.pairing, facts.paired, facts.unpaired), (Pairing::FrameId, 2, 1));
        assert!((facts.largest_offset_s.unwrap() - 0.005).abs() < 1e-12);
        assert!((facts.mean_offset_s.unwrap() - 0.005).abs() < 1e-12);
    }

    #[test]
    fn times_decide_where_numbers_do_not() {
        let images = ["r-0-1.png", "r-33000-2.png", "r-66000-3.png", "r-99000-4.png"];
        // Counted from another number, shifted by ten milliseconds; the last one is too far away.
        let (found, facts) =
            paired(&images, &["d-10000-71.png", "d-43000-72.png", "d-76000-73.png", "d-190000-74.png"]);
        assert_eq!(found, some(&["d-10000-71.png", "d-43000-72.png", "d-76000-73.png", "d-76000-73.png"]));
        assert_eq!(facts.pairing, Pairing::NearestTime);
        assert!((facts.largest_offset_s.unwrap() - 0.023).abs() < 1e-12);
        let (found, facts) = paired(&["100.00.png", "100.04.png", "100.50.png"], &["100.01.png", "100.05.png"]);
        assert_eq!(found, some(&["100.01.png", "100.05.png", ""]));
        assert_eq!((facts.pairing, facts.unpaired), (Pairing::NearestTime, 1));
    }

    #[test]
    fn plain_numbers_and_order() {
        let (found, facts) = paired(&["00000001.jpg", "00000002.jpg"], &["00000001.png", "00000002.png"]);
        assert_eq!(found, some(&["00000001.png", "00000002.png"]));
        assert_eq!((facts.pairing, facts.largest_offset_s), (Pairing::FrameId, None));
        let (found, facts) = paired(&["a1.jpg", "a2.jpg", "a3.jpg"], &["x7.png", "x8.png"]);
        assert_eq!(found, some(&["x7.png", "x8.png", ""]));
        assert_eq!((facts.pairing, facts.paired, facts.unpaired), (Pairing::Order, 2, 1));
        assert_eq!(paired(&["a.jpg", "b.jpg"], &["c.png", "d.png"]).1.pairing, Pairing::Order);
        assert_eq!(paired(&["a1.jpg", "b1.jpg"], &["c1.png", "d1.png"]).1.pairing, Pairing::Order, "numbers repeat");
    }
}
