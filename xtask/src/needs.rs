//! What the steps of the suite need beside Rust: looked for before the first step starts, and installed only after that was
//! said.

use crate::{browser, peers, run};
use anyhow::{Result, bail};
use std::fmt;

/// Something that a step cannot do without.
pub struct Need {
    /// Its name.
    pub what: &'static str,
    there: fn() -> bool,
    bring: Bring,
}

/// How something that is missing can be had.
enum Bring {
    /// Packages of Debian, which the superuser can install.
    System(&'static [&'static str]),
    /// Packages of this registry, put into this folder of the build by this.
    Folder(&'static str, &'static str, fn() -> Result<()>),
    /// The user has to install it; how.
    User(&'static str),
}

impl Need {
    const fn system(what: &'static str, there: fn() -> bool, packages: &'static [&'static str]) -> Self {
        Self { what, there, bring: Bring::System(packages) }
    }

    const fn folder(
        what: &'static str,
        there: fn() -> bool,
        registry: &'static str,
        folder: &'static str,
        fetch: fn() -> Result<()>,
    ) -> Self {
        Self { what, there, bring: Bring::Folder(registry, folder, fetch) }
    }

    const fn user(what: &'static str, there: fn() -> bool, how: &'static str) -> Self {
        Self { what, there, bring: Bring::User(how) }
    }

    /// Whether it is there already.
    pub fn is_there(&self) -> bool {
        (self.there)()
    }

    /// Whether it is missing and can be installed.
    pub fn is_within_reach(&self, allowed: Allowed) -> bool {
        let can = match self.bring {
            Bring::System(_) => allowed.system,
            Bring::Folder(..) => allowed.folders,
            Bring::User(_) => false,
        };
        can && !self.is_there()
    }

    /// Installs packages of the system, and says so.
    pub fn bring(&self) {
        if let Bring::System(packages) = self.bring {
            eprintln!("\ninstalling {}, for want of {}", packages.join(", "), self.what);
            let apt =
                |arguments: &[&str]| run::program("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
            // Whether that worked is seen by whether it is there.
            let _ = apt(&["update"]).works()
                && apt(&["install", "--yes", "--no-install-recommends"]).args(packages).works();
        }
    }

    /// Puts packages of a registry into their folder, where they are not there yet. What goes wrong is left to the step that
    /// needs them, which tries again and says why it cannot.
    pub fn fetch(&self) {
        if let Bring::Folder(.., fetch) = self.bring
            && !self.is_there()
        {
            let _ = fetch();
        }
    }

    /// Whether it comes from a registry into a folder of the build.
    pub fn is_of_registry(&self) -> bool {
        matches!(self.bring, Bring::Folder(..))
    }

    /// Whether it changes the system, and not only the folder of the build.
    pub fn is_of_system(&self) -> bool {
        matches!(self.bring, Bring::System(_))
    }
}

/// What is missing, and where it would come from.
impl fmt::Display for Need {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.what)?;
        match self.bring {
            Bring::System(packages) => write!(f, "`apt-get install {}`", packages.join(" ")),
            Bring::Folder(registry, folder, _) => write!(f, "from {registry} into target/{folder}"),
            Bring::User(how) => write!(f, "{how}"),
        }
    }
}

/// What may be installed.
#[derive(Clone, Copy)]
pub struct Allowed {
    /// Packages of the system.
    pub system: bool,
    /// Packages of registries, into folders of the build.
    pub folders: bool,
}

impl Allowed {
    /// All that this machine allows, or nothing.
    pub fn new(install: bool) -> Self {
        let is_superuser = || run::program("id").arg("-u").said().is_some_and(|id| id == "0");
        Self { system: install && is_program("apt-get") && is_superuser(), folders: install }
    }
}

/// Installs what is missing of the system and says so before; an error where something cannot be had.
pub fn bring_all(needs: &[&Need]) -> Result<()> {
    for need in needs.iter().filter(|need| !need.is_there()) {
        let within_reach = need.is_within_reach(Allowed::new(true));
        if within_reach {
            need.bring();
        }
        if !within_reach || need.is_of_system() && !need.is_there() {
            bail!("there is no {need}");
        }
    }
    Ok(())
}

/// Whether a program is on the path; Debian puts some where only the superuser's path leads.
fn is_program(name: &str) -> bool {
    run::program("sh").args(["-c", "PATH=$PATH:/usr/sbin; command -v \"$0\"", name]).works()
}

fn is_compiler() -> bool {
    run::program(std::env::var_os("CXX").unwrap_or_else(|| "c++".into())).arg("--version").works()
}

const PYPI: &str = "pypi.org";
const NPM_REGISTRY: &str = "registry.npmjs.org";
const COMPONENTS: &str = "`rustup component add rustfmt clippy`, or the packages of Rust's tools";

pub static RUSTFMT: Need = Need::user("rustfmt", || run::cargo("fmt").arg("--version").works(), COMPONENTS);
pub static CLIPPY: Need = Need::user("clippy", || run::cargo("clippy").arg("--version").works(), COMPONENTS);
pub static GIT: Need = Need::user(
    "a checkout of git",
    || run::program("git").args(["rev-parse", "--git-dir"]).works(),
    "install `git`, and clone",
);
pub static COMPILER: Need = Need::user("a C++ compiler", is_compiler, "install `g++`");
pub static MOSQUITTO: Need = Need::system(
    "Mosquitto",
    || is_program("mosquitto") && is_program("mosquitto_sub"),
    &["mosquitto", "mosquitto-clients"],
);
pub static NATS: Need = Need::system("a NATS server", || is_program("nats-server"), &["nats-server"]);
pub static NPM: Need = Need::system("npm", || is_program("npm"), &["nodejs", "npm"]);
pub static CHROMIUM: Need = Need::system("Chromium", || browser::chromium().is_some(), &["chromium"]);
pub static NODE: Need = Need::folder(
    "Node.js 20 or newer (`node@22`)",
    || browser::node().is_some(),
    NPM_REGISTRY,
    "browser",
    browser::fetch,
);
pub static PLAYWRIGHT: Need =
    Need::folder("playwright-core and typescript", browser::is_installed, NPM_REGISTRY, "browser", browser::fetch);
pub static PYTHON: Need = Need::user("python3 with venv", peers::is_python, "install `python3` and `python3-venv`");

/// The packages of one of the virtual environments of Python.
macro_rules! packages {
    ($($name:ident = $folder:literal, $list:literal;)*) => {
        $(pub static $name: Need = Need::folder(
            concat!("the packages of xtask/peers/", $list),
            || peers::is_installed($folder, $list),
            PYPI,
            $folder,
            || peers::environment($folder, $list).map(drop),
        );)*
    };
}

packages! {
    TOOLS = "peers", "requirements.txt";
    TOOLKITS = "peers-toolkits", "toolkits.txt";
    STREAMS = "peers-streams", "streams.txt";
    DRONES = "peers-drones", "drones.txt";
    SCHEMAS = "peers-onvif", "onvif.txt";
    FRAMES = "peers-frames", "frames.txt";
    CLUSTER = "peers-ray", "ray.txt";
    API = "peers-api", "api.txt";
    BOOK = "book-builder", "book.txt";
    WHEEL = "wheel-builder", "wheel.txt";
    DELIVERY = "peers-delivery", "delivery.txt";
}
/// The wheel is tested in a virtual environment that is made anew each time.
pub static FRESH: Need = Need::folder("numpy and pytest, anew each time", || false, PYPI, "wheel-test", || Ok(()));
