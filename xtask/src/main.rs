//! Everything a contributor runs, as `cargo xtask …`.

#![allow(clippy::disallowed_methods, reason = "a tool for contributors may look at its surroundings")]

mod anchors;
mod api;
mod book;
mod browser;
mod changed;
mod delivery;
mod features;
mod figures;
mod fuzz;
mod layers;
mod licences;
mod metadata;
mod mutants;
mod names;
mod needs;
mod notices;
mod peers;
mod pictures;
mod release;
mod run;
mod snippets;
mod soak;
mod suite;
mod weights;
mod wheel;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Everything a contributor runs", arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Pass what a change must pass: format, lints, floors, licences, documentation, tests, the release suite, book, browser and wheel
    Test {
        /// Only what a commit should pass: the checks that take seconds, lints, and the tests of the crates that differ from main
        #[arg(long)]
        quick: bool,
        /// Also what is looked at once a week and before a release: the papers with all their seeds, all combinations of features, a live
        /// source that breaks off, and the comparisons with independent tools
        #[arg(long, conflicts_with = "quick")]
        whole: bool,
        /// Install nothing, and skip what would need it
        #[arg(long)]
        no_install: bool,
        /// Seconds to run each fuzz target; with 0 they are compiled and not run
        #[arg(long, default_value_t = 0)]
        fuzz_seconds: u32,
    },
    /// Check that every crate imports only from floors below its own
    Layers,
    /// Check that paths, types, keys, links and headings which the documents name exist, and that their figures and pictures are those of
    /// today
    Names,
    /// Write the README's table of trackers and its chart, from docs/figures.json
    Figures,
    /// Make the pictures of the README and the book, from our own scenes (Python, for the film)
    Pictures {
        /// Only these files
        files: Vec<String>,
    },
    /// Build the book into target/book (Python; installs mkdocs into target/book-builder)
    Book,
    /// Run the commands of the book, and hold its pieces of Rust to the programs in examples
    Snippets,
    /// Check that every dependency has a licence we can live with, and that `pursuit licences` names them all
    Licences,
    /// Write the notices that `pursuit licences` prints
    Notices,
    /// Check the combinations of features that users pick
    Features,
    /// Change modules in small ways and see whether their tests notice (installs cargo-mutants into target/; takes hours)
    Mutants {
        /// Mutants to test at once
        #[arg(long, default_value_t = 1)]
        jobs: usize,
        /// Only these modules
        modules: Vec<String>,
    },
    /// Build the documentation, with broken links as errors
    Docs,
    /// Run the fuzz targets, each for a bounded time (needs a C++ compiler)
    Fuzz {
        /// Seconds to run each target
        #[arg(long, default_value_t = 60)]
        seconds: u32,
        /// Run only the targets of this name
        target: Option<String>,
    },
    /// Follow a live source at 100 frames a second that breaks off every 30 seconds: memory, threads and files stay as they were
    Soak {
        /// Seconds to run
        #[arg(long, default_value_t = 7200)]
        seconds: u32,
        /// In place of that: two cameras for so many hours of their own time, faster than real, in segments that are kept for a while,
        /// with clips of events, one of them on a bad head
        #[arg(long, conflicts_with = "seconds")]
        hours: Option<f64>,
    },
    /// Compare with independent tools (Python; installs them into target/peers and target/peers-toolkits)
    Peers {
        #[command(subcommand)]
        which: Option<peers::Comparison>,
    },
    /// Fit the judge of `pursuit` on annotated sequences, with sources left out in turn (Python)
    Tune {
        /// Arguments of xtask/peers/tune_judge.py, the folders of sequences first
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
        arguments: Vec<std::ffi::OsString>,
    },
    /// Make the weights of a network that is built in from the ONNX files of its authors
    Weights {
        /// Which network
        network: weights::Network,
        /// Folder with the files that its ORIGIN.md names
        folder: std::path::PathBuf,
        /// Compare with the weights that are there instead of writing them
        #[arg(long)]
        check: bool,
    },
    /// Use the studio's page in a real browser (Node.js and Chromium; installs the rest into target/browser)
    Browser,
    /// Ask the studio everything that schemathesis can make up from the description of its calls (Python; installs the rest
    /// into target/peers-api)
    Api,
    /// Build the Python wheel into target/wheels and test it in a fresh virtual environment, with numpy alone
    Wheel {
        /// Test it beside FilterPy and the toolkits of benchmarks too (installs them into target/peers…)
        #[arg(long)]
        peers: bool,
        /// Leave out the optimisation across crates, which takes longest
        #[arg(long)]
        quick: bool,
    },
    /// Run the benches
    Bench {
        /// Arguments for `cargo bench`
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
}

fn main() -> Result<()> {
    match Cli::parse().command {
        Task::Test { quick, whole, no_install, fuzz_seconds } => {
            let extent = match (quick, whole) {
                (true, _) => suite::Extent::Quick,
                (_, true) => suite::Extent::Whole,
                _ => suite::Extent::Usual,
            };
            suite::test(extent, fuzz_seconds, !no_install)
        }
        Task::Layers => layers::check(),
        Task::Names => names::check(),
        Task::Figures => figures::write(),
        Task::Pictures { files } => pictures::make(&files),
        Task::Book => book::build(),
        Task::Snippets => snippets::check(),
        Task::Licences => {
            licences::check()?;
            notices::check()
        }
        Task::Notices => notices::write(),
        Task::Features => {
            features::check(features::USUAL)?;
            features::check(features::WHOLE)
        }
        Task::Mutants { jobs, modules } => mutants::run(&modules, jobs),
        Task::Docs => suite::docs(),
        Task::Fuzz { seconds, target } => fuzz::run(seconds, target.as_deref()),
        Task::Soak { hours: Some(hours), .. } => soak::days(hours),
        Task::Soak { seconds, .. } => soak::run(seconds),
        Task::Peers { which } => peers::compare(which),
        Task::Tune { arguments } => peers::tune(&arguments),
        Task::Weights { network, folder, check } => weights::make(network, &folder, check),
        Task::Browser => browser::test_or_fail(),
        Task::Api => api::test_or_fail(),
        Task::Wheel { peers, quick } => wheel::make(quick, peers),
        Task::Bench { arguments } => run::cargo("bench").arg("--workspace").args(arguments).run(),
    }
}
