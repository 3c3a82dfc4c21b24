//! The parts of the page.

use super::RankedTrajectory;
use super::html::{escape, figure, shown};
use crate::columns::filled;
use crate::{Results, Sequence, Truth};
use pursuit_charts::{Axis, Chart, Color, Series, page_style};
use std::fmt::Write as _;

pub(crate) const STYLE: &str = include_str!("style.css");
pub(crate) const SCRIPT: &str = include_str!("script.js");
/// Points of a line over time: more cannot be told apart at the chart's width.
const TIME_POINTS: usize = 460;
/// A gap in a line.
const GAP: (f64, f64) = (f64::NAN, f64::NAN);

/// Points in order; [`GAP`] interrupts the line.
type Points = Vec<(f64, f64)>;

/// Everything before the first table.
pub(super) fn head(results: &Results, sequences: usize) -> String {
    let trackers = results.trackers.len();
    let what = match results.protocol {
        crate::Protocol::Ope => "one pass, started on the first annotated frame and never helped",
        crate::Protocol::LongTerm => "one pass with absences; what is claimed while the target is away counts",
        crate::Protocol::Reset => "started again five frames after every failure",
        crate::Protocol::Sre => "twelve passes from shifted and scaled starts; the first pass is drawn",
        crate::Protocol::Tre => "twenty passes from starts spread over the sequence; the first pass is drawn",
    };
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n<title>pursuit · evaluation</title>\n\
         <style>\n{charts}{STYLE}</style>\n</head>\n<body>\n<header><p class=\"brand\">pursuit · evaluation</p>\
         <h1>{trackers} {} on {sequences} {}</h1>\
         <p class=\"lead\"><b>{}</b>: {what}.</p></header>\n<main>\n",
        plural(trackers, "tracker"),
        plural(sequences, "sequence"),
        results.protocol,
        charts = page_style(),
    );
    if results.interrupted {
        page.push_str("<p class=\"error\">Stopped before everything had run; the same call again finishes it.</p>\n");
    }
    page
}

fn plural(count: usize, word: &str) -> String {
    if count == 1 { word.to_owned() } else { format!("{word}s") }
}

/// One line for every tracker.
pub(super) fn leaderboard(results: &Results, ranking: &[&str]) -> String {
    let columns = filled(results.trackers.values().map(|t| &t.mean));
    let mut html =
        "<section><h2>Trackers</h2>\n<div class=\"scroll\"><table class=\"sortable\"><thead><tr><th>tracker</th>"
            .to_owned();
    for column in &columns {
        let _ = write!(html, "<th title=\"{}\">{}</th>", column.title, column.head);
    }
    html.push_str("</tr></thead><tbody>\n");
    for (number, name) in ranking.iter().enumerate() {
        let Some(tracker) = results.trackers.get(*name) else { continue };
        let _ = write!(html, "<tr>{}", name_cell(number, name));
        for column in &columns {
            html.push_str(&shown(column.value(&tracker.mean), column.text(&tracker.mean)));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div></section>\n");
    html
}

/// A tracker's name with its colour; pressing it hides and shows its lines everywhere.
fn button(number: usize, name: &str) -> String {
    let (colour, name) = (number % 8, escape(name));
    format!(
        r#"<button type="button" class="who t{colour}" data-t="{number}" title="hide or show"><i class="dot"></i>{name}</button>"#
    )
}

fn name_cell(number: usize, name: &str) -> String {
    format!("<th scope=\"row\">{}</th>", button(number, name))
}

/// Who is better than whom.
pub(super) fn comparisons(results: &Results) -> String {
    if results.comparisons.is_empty() {
        return String::new();
    }
    let mut html = "<section><h2>Comparisons</h2>\n<p class=\"note\">Differences of the success AUC on the sequences that both \
                    have; 95 % intervals by resampling sequences.</p>\n<div class=\"scroll\"><table class=\"sortable\"><thead>\
                    <tr><th>tracker</th><th>against</th><th>sequences</th><th>difference</th><th>from</th><th>to</th>\
                    <th>is</th></tr></thead><tbody>\n"
        .to_owned();
    for c in &results.comparisons {
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td data-v=\"{n}\">{n}</td>",
            escape(&c.tracker),
            escape(&c.against),
            n = c.sequences
        );
        let [low, high] = c.interval;
        html.push_str(&[c.difference, low, high].map(|v| figure(Some(v), 3)).concat());
        let _ = writeln!(html, "<td>{}</td></tr>", c.judgement);
    }
    html.push_str("</tbody></table></div></section>\n");
    html
}

/// The plots over all sequences.
pub(super) fn curves(results: &Results, ranking: &[&str]) -> String {
    let legend: String = ranking.iter().enumerate().map(|(number, name)| button(number, name)).collect();
    let mut html = format!("<section><h2>Curves</h2>\n<p class=\"legend\">{legend}</p>\n<div class=\"plots\">\n");
    for curves in crate::curves::all(results) {
        let (title, note, svg) = (curves.title, curves.note, curves.chart.to_element());
        let _ = writeln!(html, "<figure class=\"plot\"><figcaption><b>{title}</b> {note}</figcaption>{svg}</figure>");
    }
    html.push_str("</div></section>\n");
    html
}

/// Success AUC of every tracker over the sequences with each attribute.
pub(super) fn attribute_table(results: &Results, ranking: &[&str]) -> String {
    let attributes = results.attributes();
    if attributes.is_empty() {
        return String::new();
    }
    let mut html =
        "<section><h2>Attributes</h2>\n<p class=\"note\">Success AUC over the sequences that have an attribute; \
                    the darker, the better.</p>\n<div class=\"scroll\"><table class=\"sortable heat\"><thead><tr>\
                    <th>attribute</th><th>sequences</th>"
            .to_owned();
    for name in ranking {
        let _ = write!(html, "<th>{}</th>", escape(name));
    }
    html.push_str("</tr></thead><tbody>\n");
    for attribute in attributes {
        let of = |name: &str| results.trackers.get(name).and_then(|t| t.attributes.get(attribute));
        let sequences = ranking.iter().filter_map(|name| of(name)).map(|s| s.sequences).max().unwrap_or(0);
        let _ = write!(html, "<tr><th scope=\"row\">{}</th>", escape(attribute));
        let _ = write!(html, "<td data-v=\"{sequences}\">{sequences}</td>");
        html.extend(ranking.iter().map(|name| heat_cell(of(name).map(|s| s.auc), "")));
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div></section>\n");
    html
}

/// Success AUC of every tracker on every sequence.
pub(super) fn sequence_table(results: &Results, ranking: &[&str], sequences: &[Sequence]) -> String {
    let mut html =
        "<section><h2>Sequences</h2>\n<p class=\"note\">Success AUC; the darker, the better. Press a name for the \
                    frames, a heading to sort.</p>\n<div class=\"scroll\"><table class=\"sortable heat\"><thead><tr>\
                    <th>sequence</th><th>frames</th>"
            .to_owned();
    for name in ranking {
        let _ = write!(html, "<th>{}</th>", escape(name));
    }
    html.push_str("</tr></thead><tbody>\n");
    for (i, sequence) in sequences.iter().enumerate() {
        let length = sequence.truth().len();
        let _ = write!(
            html,
            "<tr><th scope=\"row\"><a href=\"#s{i}\">{}</a></th><td data-v=\"{length}\">{length}</td>",
            escape(sequence.name())
        );
        for name in ranking {
            let score = results.trackers.get(*name).and_then(|t| t.sequences.get(sequence.name()));
            let mark = match score.is_some_and(|s| s.error.is_some()) {
                true => " <abbr title=\"stopped early\">!</abbr>",
                false => "",
            };
            html.push_str(&heat_cell(score.map(|s| s.auc), mark));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div></section>\n<section><h2>Frame by frame</h2>\n");
    html
}

/// A success AUC, coloured by how high it is, with a mark behind it.
fn heat_cell(auc: Option<f64>, mark: &str) -> String {
    let Some(auc) = auc else { return figure(None, 0) };
    let strength = (auc * 75.0).clamp(0.0, 75.0);
    format!("<td class=\"h\" style=\"--h:{strength:.0}%\" data-v=\"{auc}\">{auc:.3}{mark}</td>")
}

/// One sequence: overlap over time, figures, and the worst frames.
pub(super) fn drill_down(
    number: usize,
    sequence: &Sequence,
    results: &Results,
    trajectories: &[RankedTrajectory<'_>],
    pictures: &str,
) -> String {
    let best = trajectories.first().and_then(|e| results.trackers.get(e.name)?.sequences.get(sequence.name()));
    let summary = best.map_or_else(String::new, |s| format!("{:.3}", s.auc));
    let mut html = format!(
        "<details id=\"s{number}\"><summary><span>{}</span><span class=\"note\">{} frames · {summary}</span></summary>\n",
        escape(sequence.name()),
        sequence.truth().len()
    );
    html.push_str("<figure class=\"plot wide\">");
    html.push_str(&over_time(sequence, trajectories));
    html.push_str("</figure>\n<div class=\"scroll\"><table class=\"sortable\"><thead><tr><th>tracker</th><th>AUC</th><th>P20</th>\
                   <th>SR50</th><th>fps</th><th>p99 ms</th><th>lost</th><th>F</th><th>false alive</th></tr></thead><tbody>\n");
    for ranked in trajectories {
        let Some(score) = results.trackers.get(ranked.name).and_then(|t| t.sequences.get(sequence.name())) else {
            continue;
        };
        let long = score.long_term.as_ref();
        let _ = write!(html, "<tr>{}", name_cell(ranked.number, ranked.name));
        html.push_str(&[score.auc, score.precision20, score.success50].map(|v| figure(Some(v), 3)).concat());
        html.push_str(&figure(score.fps, 1));
        html.push_str(&figure(score.update.map(|u| u.p99_ms), 2));
        html.push_str(&figure(Some(score.lost), 3));
        html.push_str(&figure(long.map(|l| l.f), 3));
        html.push_str(&figure(long.and_then(|l| l.false_alive), 3));
        html.push_str("</tr>\n");
        if let Some(error) = &score.error {
            let _ = writeln!(html, "<tr class=\"error\"><td colspan=\"9\">{}</td></tr>", escape(error));
        }
    }
    html.push_str("</tbody></table></div>\n");
    if !pictures.is_empty() {
        let _ = write!(
            html,
            "<h3>Worst frames <span class=\"note\">truth dotted in white</span></h3><div class=\"pictures\">{pictures}</div>"
        );
    }
    html.push_str("</details>\n");
    html
}

/// Overlap over time, the frames without the target shaded.
fn over_time(sequence: &Sequence, trajectories: &[RankedTrajectory<'_>]) -> String {
    let length = sequence.truth().len();
    let series = trajectories.iter().map(|ranked| {
        let mut by_frame = vec![None; length];
        for (i, overlap) in ranked.judged_frames(sequence) {
            by_frame[i] = Some(overlap);
        }
        Series::line(ranked.name, Color::Number(ranked.number), thinned(&by_frame))
    });
    let frames = Axis::new("frame").whole().over(0.0, length.saturating_sub(1).max(1) as f64);
    let title = format!("overlap over time on {}", sequence.name());
    let empty = Chart::new(title, frames, Axis::new("overlap").over(0.0, 1.0)).sized(800.0, 250.0);
    let shaded =
        absences(sequence.truth()).into_iter().fold(empty, |c, (from, to)| c.with_band(from, to, "target away"));
    series.fold(shaded, Chart::with).to_element()
}

/// At most so many points that they can be told apart: the worst of every few frames, which is what one looks for.
fn thinned(by_frame: &[Option<f64>]) -> Points {
    let every = by_frame.len().div_ceil(TIME_POINTS).max(1);
    let worst = |(n, frames): (usize, &[Option<f64>])| {
        let seen = frames.iter().enumerate().filter_map(|(i, o)| o.map(|o| ((n * every + i) as f64, o)));
        seen.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(GAP)
    };
    by_frame.chunks(every).enumerate().map(worst).collect()
}

fn absences(truth: &[Truth]) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for (i, _) in truth.iter().enumerate().filter(|(_, t)| **t == Truth::Absent) {
        let i = i as f64;
        match spans.last_mut() {
            Some((_, end)) if *end == i => *end = i + 1.0,
            _ => spans.push((i, i + 1.0)),
        }
    }
    spans
}

/// What the figures mean, what was left out, and the end of the page.
pub(super) fn foot(results: &Results) -> String {
    let mut html = "</section>\n".to_owned();
    if !results.problems.is_empty() {
        html.push_str("<section><h2>Left out</h2>\n<ul class=\"error\">");
        for problem in &results.problems {
            let _ = write!(html, "<li>{}</li>", escape(problem));
        }
        html.push_str("</ul></section>\n");
    }
    let _ = write!(html, "{GLOSSARY}</main>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n");
    html
}

const GLOSSARY: &str = "<section class=\"glossary\"><h2>What the figures mean</h2>\n<p><b>AUC</b> is the mean, over the \
overlap thresholds 0, .05, …, 1, of the fraction of annotated frames whose overlap exceeds the threshold (OTB). The first \
frame counts; a frame reported lost has no box and overlap 0; frames without the target do not count. <b>P20</b> is the \
fraction of frames whose centre is at most 20 pixels off. <b>fps</b> is one over the mean time of an update on one thread, \
frames decoded beforehand, the start apart; means are geometric. <b>ECE</b>: scores are put into ten bins, and the gap \
between a bin's mean score and the fraction of its frames with overlap of at least one half is averaged over frames. \
<b>F</b> joins long-term precision and recall, where a box is claimed in the frames reported as tracking (VOT-LT); \
<b>false alive</b> is the fraction of the frames without the target in which one is claimed.</p></section>\n";
