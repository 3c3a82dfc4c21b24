use crate::args::PtzSimulate;
use crate::commands::print;
use pursuit_ptz::simulation::{Contender, Figures, Study, Walk};
use std::fmt::Write;
use std::process::ExitCode;

/// The figures of one controller on one walk.
struct Row {
    walk: Walk,
    contender: Contender,
    figures: Figures,
}

/// `pursuit ptz simulate`.
pub fn run(args: &PtzSimulate) -> anyhow::Result<ExitCode> {
    let study: Study = match &args.head {
        None => Study::default(),
        Some(path) => super::read(path, "is no simulation of a head")?,
    };
    let asked = |names: &[String], name: &str| names.is_empty() || names.iter().any(|asked| asked == name);
    let mut rows = Vec::new();
    for walk in Walk::ALL.into_iter().filter(|walk| asked(&args.walk, walk.name())) {
        for contender in Contender::ALL.into_iter().filter(|c| asked(&args.controller, c.name())) {
            let figures = Figures::mean(&study.run(walk, contender, args.seeds)?);
            rows.push(Row { walk, contender, figures });
        }
    }
    let text = if args.json { json(&rows, args.seeds)? } else { table(&rows, args.seeds)? };
    print(text.as_bytes())
}

fn table(rows: &[Row], seeds: u64) -> anyhow::Result<String> {
    let mut text = format!(
        "Means over {seeds} seeds. central: within the central 20 % of the picture; rms: off the middle; shown: in the picture.\n\n\
         {:<10} {:<13} {:>9} {:>8} {:>9} {:>16}\n",
        "walk", "controller", "central", "rms", "shown", "longest absence"
    );
    for Row { walk, contender, figures } in rows {
        let (central, shown) = (100.0 * figures.central, 100.0 * figures.shown);
        let (walk, name, absence) = (walk.name(), contender.name(), figures.longest_absence_s);
        writeln!(
            text,
            "{walk:<10} {name:<13} {central:>7.1} % {:>7.2}° {shown:>7.1} % {absence:>14.2} s",
            figures.rms_deg
        )?;
    }
    Ok(text)
}

fn json(rows: &[Row], seeds: u64) -> anyhow::Result<String> {
    let rows: Vec<serde_json::Value> = rows
        .iter()
        .map(|row| {
            serde_json::json!({
                "walk": row.walk.name(),
                "controller": row.contender.name(),
                "central": row.figures.central,
                "rms_deg": row.figures.rms_deg,
                "shown": row.figures.shown,
                "longest_absence_s": row.figures.longest_absence_s,
            })
        })
        .collect();
    Ok(serde_json::to_string_pretty(&serde_json::json!({ "seeds": seeds, "runs": rows }))? + "\n")
}
