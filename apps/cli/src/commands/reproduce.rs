use super::print;
use crate::args::Reproduce;
use pursuit_experiments::{self as experiments, Options, Reproduction};
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// `pursuit reproduce PAPER`.
pub fn run(args: &Reproduce) -> anyhow::Result<ExitCode> {
    let paper = args.paper;
    let out = match &args.out {
        Some(folder) => folder.clone(),
        None => PathBuf::from(format!("pursuit-out/reproduce-{}", paper.name())),
    };
    let all = args.full || args.check;
    let seeds = args.seeds.unwrap_or(if all { paper.default_seeds() } else { paper.quick_seeds() });
    let reproduction = experiments::run(paper, &Options { seeds: Some(seeds), dataset: args.dataset.clone() })?;
    reproduction.write(&out)?;
    let text = if args.json { reproduction.to_json()? } else { summary(&reproduction, &out)? };
    print(text.as_bytes())?;
    if args.check && reproduction.seeds < paper.default_seeds() {
        tracing::warn!(
            "the bars are those of {} seeds; of {} the figures stray, and a bar may be missed or reached by chance",
            paper.default_seeds(),
            reproduction.seeds
        );
    }
    let missed = reproduction.missed().count();
    if args.check && missed > 0 {
        anstream::eprintln!("{}: {missed} figures of {} miss their bar", crate::console::ERROR, paper.name());
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

fn summary(reproduction: &Reproduction, out: &std::path::Path) -> anyhow::Result<String> {
    let mut text = reproduction.to_string();
    let all = reproduction.paper.default_seeds();
    if reproduction.seeds < all {
        writeln!(text, "Of {} seeds in place of {all}: figures stray; `--full` takes them all.", reproduction.seeds)?;
    }
    writeln!(text, "Results and pictures: {}", out.display())?;
    Ok(text)
}
