use crate::args::PtzSimulate;
use crate::commands::print;
use anyhow::Context;
use pursuit::RunError;
use pursuit::head::grid_map;
use pursuit::ptz::simulation::{Contender, Grid, Pair, Study};
use std::fmt::Write;
use std::process::ExitCode;

/// `pursuit ptz simulate --grid`.
pub fn run(args: &PtzSimulate, study: &Study) -> anyhow::Result<ExitCode> {
    let (judged, other) = contenders(&args.controller)?;
    let grid = Grid { walks: super::simulate::walks(args, false), ..Grid::default() };
    let seeds = args.first_seed..args.first_seed + args.seeds.unwrap_or(3);
    let pairs = grid.run(study, judged, other, &seeds)?;
    let title = format!("Points by which {} is better than {}: delay ± jitter (s)", judged.name(), other.name());
    let file = &args.heat_map;
    grid_map(&title, &pairs)
        .write(file)
        .with_context(|| format!("the heat map cannot be written to {}", file.display()))?;
    let text = if args.json { json(&pairs)? } else { table(&pairs, other)? + &format!("{}\n", file.display()) };
    print(text.as_bytes())
}

/// The controller that is judged and the one that it is compared with.
fn contenders(named: &[String]) -> anyhow::Result<(Contender, Contender)> {
    let find = |name: &String| Contender::ALL.into_iter().find(|contender| contender.name() == name);
    match named {
        [] => Ok((Contender::Velocity, Contender::Unpredicted)),
        [judged, other] if judged != other => find(judged).zip(find(other)).context("no such controller"),
        _ => Err(RunError::usage("--grid compares two: name two controllers, for example velocity,unpredicted").into()),
    }
}

fn table(pairs: &[Pair], other: Contender) -> anyhow::Result<String> {
    let mut text = format!(
        "{:<9} {:>6} {:>7} {:>6} {:>9} {:>12} {:>9} {:>12}\n",
        "walk", "delay", "jitter", "lost", "central", "gain", "shown", "gain"
    );
    let percent = |part: f64| 100.0 * part;
    let gain = |part: f64, error: Option<f64>| {
        let error = error.map(|error| format!(" ±{:.1}", percent(error))).unwrap_or_default();
        format!("{:+.1}{error}", percent(part))
    };
    for pair in pairs {
        let (cell, (central, shown)) = (&pair.cell, pair.gains());
        writeln!(
            text,
            "{:<9} {:>4.1} s {:>5.1} s {:>4.0} % {:>7.1} % {:>12} {:>7.1} % {:>12}{}",
            cell.walk.name(),
            cell.delay_s,
            cell.jitter_s,
            percent(cell.loss),
            percent(pair.judged.central),
            gain(central, pair.errors.map(|errors| errors.0)),
            percent(pair.judged.shown),
            gain(shown, pair.errors.map(|errors| errors.1)),
            match (pair.is_worse(), pair.is_surely_worse()) {
                (false, _) => "",
                (true, false) => "  worse",
                (true, true) => "  worse, surely",
            }
        )?;
    }
    let worse = pairs.iter().filter(|pair| pair.is_worse()).count();
    let surely = pairs.iter().filter(|pair| pair.is_surely_worse()).count();
    writeln!(
        text,
        "{worse} of {} are worse than {} by more than 2 points, {surely} of them by two standard errors (±) more",
        pairs.len(),
        other.name()
    )?;
    Ok(text)
}

fn json(pairs: &[Pair]) -> anyhow::Result<String> {
    let rows = pairs.iter().map(|pair| {
        let (cell, (central_gain, shown_gain)) = (&pair.cell, pair.gains());
        serde_json::json!({
            "walk": cell.walk, "delay_s": cell.delay_s, "jitter_s": cell.jitter_s, "loss": cell.loss,
            "judged": pair.judged, "other": pair.other,
            "central_gain": central_gain, "shown_gain": shown_gain, "worse": pair.is_worse(),
            "central_gain_error": pair.errors.map(|errors| errors.0), "shown_gain_error": pair.errors.map(|errors| errors.1),
            "surely_worse": pair.is_surely_worse(),
        })
    });
    Ok(serde_json::to_string_pretty(&rows.collect::<Vec<_>>())? + "\n")
}
