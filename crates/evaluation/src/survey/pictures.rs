use super::Survey;
use crate::Results;
use pursuit_charts::{Axis, Chart, Color, Radar, Series};

/// Attributes of fewer sequences than this have no spoke: a mean of two says little.
const FEWEST_SEQUENCES: usize = 3;

/// Speed against accuracy, a colour for each family.
pub(super) fn speed(survey: &Survey) -> Chart {
    let empty = Chart::new(
        "Speed and accuracy, one thread",
        Axis::new("updates a second").logarithmic(),
        Axis::new("success AUC").over(0.0, 1.0),
    )
    .sized(900.0, 460.0);
    let dot = |line: &super::SurveyLine| {
        let at = vec![(line.score.fps?, line.score.auc)];
        Some(Series::named(line.tracker.as_str(), Color::Number(survey.number(&line.family)), at))
    };
    survey.trackers.iter().filter_map(dot).fold(empty, Chart::with)
}

/// Success AUC by attribute of the best tracker of each family; none of sequences with fewer than three attributes.
pub(super) fn attributes(survey: &Survey, results: &Results) -> Option<Radar> {
    let of = |tracker: &str, attribute: &str| results.trackers.get(tracker)?.attributes.get(attribute);
    let bests: Vec<(&str, &str)> =
        survey.families.iter().filter_map(|l| Some((l.family.as_str(), l.members.first()?.as_str()))).collect();
    let known = |attribute: &&str| {
        bests.iter().any(|(_, tracker)| of(tracker, attribute).is_some_and(|s| s.sequences >= FEWEST_SEQUENCES))
    };
    let attributes: Vec<&str> = results.attributes().into_iter().filter(known).collect();
    if attributes.len() < 3 {
        return None;
    }
    let spokes = attributes.iter().map(|a| (*a).to_owned()).collect();
    let values: Vec<Vec<Option<f64>>> =
        bests.iter().map(|(_, tracker)| attributes.iter().map(|a| of(tracker, a).map(|s| s.auc)).collect()).collect();
    let most = values.iter().flatten().flatten().copied().fold(0.0, f64::max);
    // A round end, so that the rings have round values.
    let most = ((most * 5.0).ceil() / 5.0).clamp(0.2, 1.0);
    let empty = Radar::new("Success AUC by attribute, the best tracker of each family", spokes, most);
    let radar = bests.iter().zip(&values).fold(empty, |radar, ((family, tracker), values)| {
        radar.with(format!("{tracker} ({family})"), Color::Number(survey.number(family)), values)
    });
    Some(radar)
}
