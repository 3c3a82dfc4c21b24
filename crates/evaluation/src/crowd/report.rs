//! The page: figures, comparisons, and for every sequence and tracker who found which true target when.

use super::{CrowdFigures, CrowdResults, CrowdSequence, Judged};
use crate::metrics::many::Match;
use crate::report::{SCRIPT, STYLE, escape, figure};
use pursuit_charts::page_style;
use std::collections::BTreeMap;
use std::fmt::Write as _;

const TIMELINE_STYLE: &str = include_str!("timeline.css");
const TIMELINE_SCRIPT: &str = include_str!("timeline.js");
/// Height of a target's row, and width of the picture, in units of the drawing.
const ROW: usize = 14;
const WIDTH: f64 = 1000.0;
/// A drawing with more stretches than this is cut off, and says so: browsers have to stay usable.
const MOST_STRETCHES: usize = 5_000;

/// The whole page.
pub(super) fn page(
    results: &CrowdResults,
    sequences: &[CrowdSequence],
    judged: &BTreeMap<String, Vec<Judged>>,
) -> String {
    let (trackers, count) = (results.trackers.len(), sequences.len());
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n<title>pursuit · many targets</title>\n\
         <style>\n{}{STYLE}{TIMELINE_STYLE}</style>\n</head>\n<body>\n<header><p class=\"brand\">pursuit · many targets</p>\
         <h1>trackers: {trackers}, sequences: {count}</h1><p class=\"lead\"><b>mot</b>: HOTA, CLEAR MOT and IDF1 as TrackEval \
         computes them; the sequences of a set are combined, sets are averaged.</p></header>\n<main>\n",
        page_style(),
    );
    leaderboard(results, &mut page);
    comparisons(results, &mut page);
    by_sequence(results, sequences, &mut page);
    for (place, sequence) in sequences.iter().enumerate() {
        timelines(place, sequence, results, judged, &mut page);
    }
    let _ = write!(
        page,
        "</section>\n<p id=\"said\" role=\"status\" aria-live=\"polite\">Press a stretch or a switch.</p>\n{GLOSSARY}</main>\n\
         <script>\n{SCRIPT}{TIMELINE_SCRIPT}</script>\n</body>\n</html>\n"
    );
    page
}

const NAMES: [&str; 13] =
    ["HOTA", "DetA", "AssA", "LocA", "MOTA", "MOTP", "IDF1", "IDSW", "Frag", "FP", "FN", "MT", "ML"];

fn cells(f: &CrowdFigures) -> String {
    let shares = [f.HOTA, f.DetA, f.AssA, f.LocA, f.MOTA, f.MOTP, f.IDF1].map(|v| figure(Some(100.0 * v), 2));
    shares.concat() + &[f.IDSW, f.Frag, f.FP, f.FN, f.MT, f.ML].map(|n| figure(Some(n as f64), 0)).concat()
}

fn head(first: &[&str]) -> String {
    let names: String = first.iter().chain(&NAMES).map(|n| format!("<th>{n}</th>")).collect();
    format!("<div class=\"scroll\"><table class=\"sortable\"><thead><tr>{names}</tr></thead><tbody>\n")
}

fn leaderboard(results: &CrowdResults, page: &mut String) {
    page.push_str("<section><h2>Trackers</h2>\n");
    page.push_str(&head(&["tracker", "set"]));
    let mut row = |name: &str, set: &str, f: &CrowdFigures| {
        let _ = writeln!(page, "<tr><th scope=\"row\">{}</th><td>{}</td>{}</tr>", escape(name), escape(set), cells(f));
    };
    for (name, tracker) in results.ranked() {
        if tracker.sets.len() > 1 {
            row(name, "mean", &tracker.mean);
        }
        tracker.sets.iter().for_each(|(set, f)| row(name, set, f));
        for (class, sets) in &tracker.classes {
            sets.iter().for_each(|(set, f)| row(name, &format!("{set} · {class}"), f));
        }
    }
    page.push_str("</tbody></table></div></section>\n");
}

fn comparisons(results: &CrowdResults, page: &mut String) {
    if results.comparisons.is_empty() {
        return;
    }
    page.push_str(
        "<section><h2>Comparisons</h2>\n<p class=\"note\">Differences over sequences, in points; 95 % intervals by resampling \
         sequences.</p>\n<div class=\"scroll\"><table class=\"sortable\"><thead><tr><th>tracker</th><th>against</th>\
         <th>figure</th><th>sequences</th><th>difference</th><th>from</th><th>to</th><th>is</th></tr></thead><tbody>\n",
    );
    for c in &results.comparisons {
        let [low, high] = c.interval;
        let figures = [c.difference, low, high].map(|v| figure(Some(100.0 * v), 2)).concat();
        let _ = writeln!(
            page,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td data-v=\"{n}\">{n}</td>{figures}<td>{}</td></tr>",
            escape(&c.tracker),
            escape(&c.against),
            c.figure,
            c.judgement,
            n = c.sequences
        );
    }
    page.push_str("</tbody></table></div></section>\n");
}

fn by_sequence(results: &CrowdResults, sequences: &[CrowdSequence], page: &mut String) {
    page.push_str("<section><h2>Sequences</h2>\n<p class=\"note\">Press a name for its ids over time.</p>\n");
    page.push_str(&head(&["sequence", "tracker"]));
    for (place, sequence) in sequences.iter().enumerate() {
        for (name, tracker) in results.ranked() {
            let Some(f) = tracker.sequences.get(&sequence.title()) else { continue };
            let (title, name) = (escape(&sequence.title()), escape(name));
            let _ = writeln!(
                page,
                "<tr><th scope=\"row\"><a href=\"#s{place}\">{title}</a></th><td>{name}</td>{}</tr>",
                cells(f)
            );
        }
    }
    page.push_str(
        "</tbody></table></div></section>\n<section><h2>Ids over time</h2>\n<p class=\"note\">A row is a true target, \
                   a grey line the time it is there, a colour whoever finds it. A mark is a switch.</p>\n",
    );
}

fn timelines(
    place: usize,
    sequence: &CrowdSequence,
    results: &CrowdResults,
    judged: &BTreeMap<String, Vec<Judged>>,
    page: &mut String,
) {
    let title = sequence.title();
    let _ = writeln!(page, "<details id=\"s{place}\"><summary><span>{}</span></summary>", escape(&title));
    for (name, tracker) in results.ranked() {
        let one = judged.get(name).and_then(|all| all.iter().find(|one| one.title == title));
        let (Some(one), Some(f)) = (one, tracker.sequences.get(&title)) else { continue };
        let hota = 100.0 * f.HOTA;
        let _ = writeln!(
            page,
            "<h3>{} <span class=\"note\">HOTA {hota:.2} · switches: {} · fragments: {}</span></h3>",
            escape(name),
            f.IDSW,
            f.Frag
        );
        drawing(one, page);
    }
    page.push_str("</details>\n");
}

/// A time in which one true target is found by the same id in all its frames.
struct Stretch {
    from: u64,
    to: u64,
    said: u64,
    switched_from: Option<u64>,
}

fn drawing(one: &Judged, page: &mut String) {
    // When each true target is there, and its stretches in order of time.
    let mut rows: BTreeMap<u64, (u64, u64, Vec<Stretch>)> = BTreeMap::new();
    for b in &one.truth {
        let row = rows.entry(b.target).or_insert((b.frame, b.frame, Vec::new()));
        (row.0, row.1) = (row.0.min(b.frame), row.1.max(b.frame));
    }
    let mut matches: Vec<&Match> = one.matches.iter().collect();
    matches.sort_by_key(|m| (m.truth, m.frame));
    for m in matches {
        let Some((_, _, stretches)) = rows.get_mut(&m.truth) else { continue };
        match stretches.last_mut() {
            Some(last) if last.said == m.said && last.to + 1 == m.frame => last.to = m.frame,
            _ => stretches.push(Stretch { from: m.frame, to: m.frame, said: m.said, switched_from: m.switched_from }),
        }
    }
    let length = rows.values().map(|r| r.1 + 1).max().unwrap_or(1) as f64;
    let at = |frame: u64| frame as f64 / length * WIDTH;
    let height = rows.len().max(1) * ROW;
    let _ = writeln!(page, "<div class=\"scroll\"><svg class=\"ids\" viewBox=\"-60 0 1060 {height}\" role=\"group\">");
    let mut drawn = 0;
    for (place, (target, (first, last, stretches))) in rows.iter().enumerate() {
        let top = place * ROW;
        let (x, w) = (at(*first), at(last + 1) - at(*first));
        let _ = writeln!(
            page,
            "<text x=\"-6\" y=\"{}\">{target}</text><rect class=\"there\" x=\"{x:.1}\" y=\"{}\" width=\"{w:.1}\" height=\"2\"/>",
            top + 11,
            top + 6
        );
        for s in stretches {
            drawn += 1;
            if drawn > MOST_STRETCHES {
                continue;
            }
            stretch(s, *target, top, &at, page);
        }
    }
    page.push_str("</svg></div>\n");
    if drawn > MOST_STRETCHES {
        let _ = writeln!(page, "<p class=\"note\">The first {MOST_STRETCHES} of {drawn} stretches are drawn.</p>");
    }
}

fn stretch(s: &Stretch, target: u64, top: usize, at: &dyn Fn(u64) -> f64, page: &mut String) {
    let (x, w) = (at(s.from), (at(s.to + 1) - at(s.from)).max(0.8));
    let hue = s.said.wrapping_mul(137) % 360;
    let told = format!("target {target} is found by id {}, frames {} to {}", s.said, s.from, s.to);
    let _ = writeln!(
        page,
        "<rect class=\"by\" tabindex=\"0\" role=\"button\" data-said=\"{}\" data-told=\"{told}\" style=\"--hue:{hue}\" x=\"{x:.1}\" \
         y=\"{}\" width=\"{w:.1}\" height=\"10\"><title>{told}</title></rect>",
        s.said,
        top + 2
    );
    if let Some(before) = s.switched_from {
        let told = format!("frame {}: target {target} switches from id {before} to id {}", s.from, s.said);
        let _ = writeln!(
            page,
            "<path class=\"switch\" tabindex=\"0\" role=\"button\" data-said=\"{}\" data-before=\"{before}\" data-told=\"{told}\" \
             d=\"M{x:.1} {top}l4 0-4 7-4-7z\"><title>{told}</title></path>",
            s.said
        );
    }
}

const GLOSSARY: &str = "<section class=\"glossary\"><h2>What the figures mean</h2>\n<p>Shares are in per cent. <b>HOTA</b> is the \
mean, over the overlaps .05 to .95 from which on a box may be a match, of the geometric mean of <b>DetA</b> (matches of all \
that is true or said) and <b>AssA</b> (over matches, how much of their time the two targets are together); <b>LocA</b> is the \
mean overlap of matches (Luiten et al. 2021). <b>MOTA</b> is one less misses (<b>FN</b>), boxes that are no true one's \
(<b>FP</b>) and switches (<b>IDSW</b>) per true box, <b>MOTP</b> the mean overlap (Bernardin and Stiefelhagen 2008). \
<b>IDF1</b> is the F1 of boxes when each true target is told to be one of those said for the whole sequence (Ristani et al. \
2016). <b>Frag</b> counts how often a target was found again; <b>MT</b> and <b>ML</b> are targets found in more than 80 % and \
in less than 20 % of their boxes.</p></section>\n";
