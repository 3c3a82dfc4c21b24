//! `survey.html`: one file without external resources, in the style of the evaluation's report.

use super::{Survey, interval, pictures, span};
use crate::Results;
use crate::report::{SCRIPT, STYLE, escape, figure};
use pursuit_charts::page_style;
use std::fmt::Write as _;

/// The page.
pub(super) fn page(survey: &Survey, results: &Results) -> String {
    let (trackers, families) = (survey.trackers.len(), survey.families.len());
    let sequences = survey.trackers.iter().map(|l| l.score.sequences).max().unwrap_or(0);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n<title>pursuit · survey</title>\n\
         <style>\n{}{STYLE}</style>\n</head>\n<body>\n<header><p class=\"brand\">pursuit · survey</p>\
         <h1>{trackers} trackers of {families} families on {sequences} sequences</h1>\
         <p class=\"lead\"><b>{}</b>: a rank is a span, from behind every tracker that is clearly better to ahead of every one that \
         is clearly worse; <a href=\"report.html\">the report</a> has every sequence.</p></header>\n<main>\n",
        page_style(),
        results.protocol,
    );
    if results.interrupted {
        page.push_str("<p class=\"error\">Stopped before everything had run; the same call again finishes it.</p>\n");
    }
    page.push_str(&family_section(survey));
    page.push_str(&tracker_section(survey));
    page.push_str(&chart_section(survey, results));
    page.push_str(&between_section(survey));
    if !results.problems.is_empty() {
        let items: String = results.problems.iter().map(|p| format!("<li>{}</li>", escape(p))).collect();
        let _ = write!(page, "<section><h2>Left out</h2>\n<ul class=\"error\">{items}</ul></section>\n");
    }
    let _ = write!(page, "{GLOSSARY}</main>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n");
    page
}

/// A name in the colour of its family.
fn named(survey: &Survey, family: &str, name: &str) -> String {
    let number = survey.number(family);
    format!(
        "<th scope=\"row\"><button type=\"button\" class=\"who t{}\" data-t=\"{number}\" title=\"hide or show\">\
         <i class=\"dot\"></i>{}</button></th>",
        number % 8,
        escape(name)
    )
}

fn table(title: &str, note: &str, heads: &[&str], rows: &str) -> String {
    let heads: String = heads.iter().map(|h| format!("<th>{h}</th>")).collect();
    format!(
        "<section><h2>{title}</h2>\n<p class=\"note\">{note}</p>\n<div class=\"scroll\"><table class=\"sortable\"><thead><tr>\
         {heads}</tr></thead><tbody>\n{rows}</tbody></table></div></section>\n"
    )
}

/// A rank that sorts by its better end.
fn rank_cell(rank: Option<[usize; 2]>) -> String {
    match rank {
        Some([low, _]) => format!("<td data-v=\"{low}\">{}</td>", span(rank)),
        None => figure(None, 0),
    }
}

fn interval_cell(ends: Option<[f64; 2]>) -> String {
    match ends {
        Some([low, _]) => format!("<td data-v=\"{low}\">{}</td>", interval(ends)),
        None => figure(None, 0),
    }
}

fn family_section(survey: &Survey) -> String {
    let mut rows = String::new();
    for line in &survey.families {
        let best = line.members.first().map_or("–", String::as_str);
        let _ = write!(rows, "<tr>{}<td>{}</td>", named(survey, &line.family, &line.family), escape(best));
        rows.push_str(&rank_cell(line.rank));
        rows.push_str(&figure(Some(line.auc), 3));
        rows.push_str(&interval_cell(line.auc_interval));
        rows.push_str(&figure(line.fps, 0));
        let _ = write!(rows, "<td data-v=\"{0}\">{0}</td>", line.members.len());
        rows.push_str(&figure(Some(line.mean_auc), 3));
        let fastest = line.fastest.as_ref().map_or_else(
            || figure(None, 0),
            |(name, fps)| format!("<td data-v=\"{fps}\">{} {fps:.0}</td>", escape(name)),
        );
        rows.push_str(&fastest);
        rows.push_str("</tr>\n");
    }
    let sentences: String = survey
        .families
        .iter()
        .filter(|l| !l.sentence.is_empty())
        .map(|l| format!("<p class=\"note\"><b>{}</b>: {}</p>\n", escape(&l.family), escape(&l.sentence)))
        .collect();
    let heads = ["family", "best", "rank", "AUC", "95 %", "fps", "trackers", "mean AUC", "fastest"];
    let note = "Ranked by its best tracker, whose figures stand beside it.";
    table("Families", note, &heads, &rows) + &sentences
}

fn tracker_section(survey: &Survey) -> String {
    let mut rows = String::new();
    for line in &survey.trackers {
        let score = &line.score;
        let _ = write!(rows, "<tr>{}<td>{}</td>", named(survey, &line.family, &line.tracker), escape(&line.family));
        rows.push_str(&rank_cell(score.rank));
        rows.push_str(&figure(Some(score.auc), 3));
        rows.push_str(&interval_cell(score.auc_interval));
        rows.push_str(&[score.precision20, score.success50].map(|v| figure(Some(v), 3)).concat());
        rows.push_str(&figure(score.fps, 0));
        rows.push_str(&figure(score.calibration_error, 3));
        let _ = writeln!(rows, "<td data-v=\"{0}\">{0}</td></tr>", score.sequences);
    }
    let heads = ["tracker", "family", "rank", "AUC", "95 %", "P20", "SR50", "fps", "ECE", "sequences"];
    table("Trackers", "In the colours of their families.", &heads, &rows)
}

fn chart_section(survey: &Survey, results: &Results) -> String {
    let mut html = String::from("<section><h2>Charts</h2>\n<div class=\"plots\">\n");
    let speed = pictures::speed(survey);
    if !speed.is_empty() {
        let _ = writeln!(
            html,
            "<figure class=\"plot\"><figcaption><b>Speed and accuracy</b> up and to the right is better</figcaption>{}</figure>",
            speed.to_element()
        );
    }
    if let Some(radar) = pictures::attributes(survey, results).filter(|r| !r.is_empty()) {
        let _ = writeln!(
            html,
            "<figure class=\"plot\"><figcaption><b>By attribute</b> success AUC of the best tracker of each family</figcaption>{}\
             </figure>",
            radar.to_element()
        );
    }
    html.push_str("</div></section>\n");
    html
}

fn between_section(survey: &Survey) -> String {
    if survey.between.is_empty() {
        return String::new();
    }
    let mut rows = String::new();
    for c in &survey.between {
        let [low, high] = c.interval;
        let _ = write!(
            rows,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td data-v=\"{n}\">{n}</td>",
            escape(&c.tracker),
            escape(&c.against),
            n = c.sequences
        );
        rows.push_str(&[c.difference, low, high].map(|v| figure(Some(v), 3)).concat());
        let _ = writeln!(rows, "<td>{}</td></tr>", c.judgement);
    }
    let heads = ["tracker", "against", "sequences", "difference", "from", "to", "is"];
    let note = "The best tracker of each family against that of each family below it: differences of the success AUC on the same \
                sequences, 95 % intervals by resampling sequences.";
    table("Family against family", note, &heads, &rows)
}

const GLOSSARY: &str = "<section class=\"glossary\"><h2>What the figures mean</h2>\n<p><b>AUC</b>, <b>P20</b>, <b>SR50</b>, \
<b>ECE</b> and <b>fps</b> are those of the report. A <b>rank</b> is a span because differences between trackers are differences on \
these sequences: two trackers whose paired difference could be zero share ranks. Fewer than six sequences allow no \
judgement.</p></section>\n";
