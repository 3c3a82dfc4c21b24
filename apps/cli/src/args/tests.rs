//! Everything that lists commands is held to the one table of them.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::Cli;
use crate::commands::{completion_script, manual};
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use pursuit::config::RunConfig;
use pursuit::publish::PublishOptions;
use std::path::{Path, PathBuf};

fn root() -> Command {
    let mut root = Cli::command();
    root.build();
    root
}

/// Whole names of all commands below `command`: `track`, `ptz follow` …
fn names(command: &Command, parent: &str) -> Vec<String> {
    let own = command.get_subcommands().filter(|c| c.get_name() != "help");
    let below = own.flat_map(|sub| {
        let name = format!("{parent} {}", sub.get_name()).trim().to_owned();
        let mut all = names(sub, &name);
        all.push(name);
        all
    });
    below.collect()
}

#[test]
fn help_man_and_completions_name_every_command() {
    let root = root();
    let man = String::from_utf8(manual(&root).unwrap()).unwrap().replace('\\', "");
    let scripts = [Shell::Bash, Shell::Zsh, Shell::Fish].map(|s| String::from_utf8(completion_script(s)).unwrap());
    let help = root.clone().render_long_help().to_string();
    for name in names(&root, "") {
        assert!(man.contains(&format!("pursuit {name}")) || man.contains(&format!("pursuit-{name}")), "man: {name}");
        for word in name.split(' ') {
            assert!(scripts.iter().all(|script| script.contains(word)), "completions: {name}");
        }
        assert!(name.contains(' ') || help.contains(&format!("  {name}")), "help: {name}");
    }
}

/// Two options under one name inside would each take what the other was given; `clap` itself looks only in builds of its own
/// with assertions.
#[test]
fn every_option_is_one_of_its_own() {
    fn check(command: &Command, name: &str) {
        let mut seen = std::collections::BTreeSet::new();
        for argument in command.get_arguments() {
            assert!(
                seen.insert(argument.get_id().to_string()),
                "{name}: two arguments are `{}` inside",
                argument.get_id()
            );
            for long in argument.get_long_and_visible_aliases().into_iter().flatten() {
                assert!(seen.insert(format!("--{long}")), "{name}: two options are called --{long}");
            }
            if let Some(short) = argument.get_short() {
                assert!(seen.insert(format!("-{short}")), "{name}: two options are called -{short}");
            }
        }
        command.get_subcommands().for_each(|sub| check(sub, &format!("{name} {}", sub.get_name())));
    }
    check(&root(), "pursuit");
}

/// README and all documents, with their texts.
fn documents() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let book = ["docs/book", "docs/book/first-hour", "docs/book/how", "examples"];
    let folders = ["docs", "docs/guide", "docs/papers", "bindings/python", "apps/studio"].into_iter().chain(book);
    let pages = folders.flat_map(|f| std::fs::read_dir(root.join(f)).unwrap()).map(|e| e.unwrap().path());
    let pages = pages.chain([root.join("README.md")]).filter(|p| p.extension().is_some_and(|e| e == "md"));
    pages.map(|p| (p.clone(), std::fs::read_to_string(p).unwrap())).collect()
}

/// Calls of `pursuit` in a text: lines of code that begin with it, and words between back ticks.
fn calls(text: &str) -> Vec<String> {
    let lines = text.lines().map(|l| l.trim_start().trim_start_matches("$ ")).filter(|l| !l.contains('`'));
    let spans = text.lines().flat_map(|l| l.split('`').skip(1).step_by(2));
    let ours = lines.chain(spans).filter_map(|call| call.trim().strip_prefix("pursuit "));
    ours.map(|call| call.split(['#', '|', '>', ';', '&']).next().unwrap_or_default().to_owned()).collect()
}

/// What a call says that the command line does not know.
fn unknown(root: &Command, call: &str) -> Option<String> {
    let (mut command, mut known, mut commands_end) = (root, Vec::new(), false);
    known.extend(root.get_arguments());
    let mut words = call.split_whitespace().map(|w| w.trim_matches(['[', ']', '(', ')', ',', '"', '\\']));
    while let Some(word) = words.next() {
        if let Some(option) = word.strip_prefix("--").filter(|o| !o.is_empty()) {
            let name = option.split(['=', ']']).next().unwrap_or_default();
            let Some(arg) = known.iter().find(|a| a.get_long() == Some(name)) else { return Some(word.to_owned()) };
            if arg.get_action().takes_values() && name == option {
                words.next();
            }
        } else if !word.starts_with('-') && !commands_end {
            match command.find_subcommand(word) {
                Some(sub) => command = sub,
                None if command.get_name() == "pursuit" => return Some(word.to_owned()),
                None => commands_end = true,
            }
            known.extend(command.get_arguments());
        }
    }
    None
}

/// Without the features that bring commands the documents name more than there is.
#[test]
#[cfg(all(feature = "reproduce", feature = "studio"))]
fn documents_call_only_what_there_is() {
    let root = root();
    let faults = documents().into_iter().flat_map(|(page, text)| {
        let unknown = calls(&text).into_iter().filter_map(|call| Some((unknown(&root, &call)?, call)));
        unknown.map(|(word, call)| format!("{}: {word} in `pursuit {call}`", page.display())).collect::<Vec<_>>()
    });
    assert_eq!(faults.collect::<Vec<_>>(), Vec::<String>::new());
}

#[test]
fn every_command_stands_in_a_document() {
    let text: String = documents().into_iter().map(|(_, text)| text).collect();
    let missing: Vec<String> =
        names(&root(), "").into_iter().filter(|n| !text.contains(&format!("pursuit {n}"))).collect();
    assert_eq!(missing, Vec::<String>::new());
}

#[test]
fn unknown_words_of_a_call_are_found() {
    let root = root();
    assert_eq!(unknown(&root, "-q --threads 1 track CLIP --box 1,2,3,4 --set a=b -v"), None);
    assert_eq!(unknown(&root, "trail CLIP"), Some("trail".to_owned()));
    assert_eq!(unknown(&root, "track CLIP --bix 1"), Some("--bix".to_owned()));
    assert_eq!(calls("    pursuit track a # b\nsay `pursuit eval c`, pursuit"), ["track a ", "eval c"]);
}

#[test]
fn every_run_option_has_its_flag() {
    let command = Cli::command();
    let track = command.find_subcommand("track").unwrap();
    let flags: Vec<&str> = track.get_arguments().filter_map(clap::Arg::get_long).collect();
    let flag = |option: &str| match option {
        "boxes" => "box".to_owned(),
        "depth_options" => "depth-coding".to_owned(),
        "video" => "no-video".to_owned(),
        "formats" => "format".to_owned(),
        "measure_options" => "measure-method".to_owned(),
        "publish_options" => "publish-every".to_owned(),
        "parameters" => "set".to_owned(),
        other => other.replace('_', "-"),
    };
    let run = RunConfig::OPTIONS.iter().map(|(name, _)| flag(name)).filter(|flag| flag != "input");
    let publish = PublishOptions::OPTIONS.iter().map(|(name, _)| format!("publish-{}", name.trim_end_matches("_file")));
    for flag in run.chain(publish) {
        assert!(flags.contains(&flag.as_str()), "`pursuit track` lacks --{flag}");
    }
}
