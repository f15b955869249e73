//! The suites: what `--suite NAME` measures. A further suite is one more entry.

use anyhow::Result;

use super::{
    error_time, exact, omissions, scaling,
    session::{Session, Source},
    stability,
};

/// Scenes and runs that belong together.
struct Suite {
    name: &'static str,
    run: fn(&mut Session<'_>) -> Result<()>,
}

/// The three sizes of Sun, Gong and Pan.
const PAPER: [&str; 3] = ["room-1022", "room-8621", "room-42879"];

static SUITES: [Suite; 10] = [
    Suite {
        name: "paper",
        run: |session| on_builtins(session, &PAPER),
    },
    Suite {
        name: "cornell",
        run: |session| on_builtins(session, &["cornell"]),
    },
    Suite {
        name: "soup",
        run: |session| on_builtins(session, &["soup"]),
    },
    Suite {
        name: "gallery",
        run: |session| on_builtins(session, &["gallery"]),
    },
    Suite {
        name: "all",
        run: |session| {
            let [small, middle, large] = PAPER;
            on_builtins(
                session,
                &["cornell", small, middle, large, "soup", "gallery"],
            )
        },
    },
    Suite {
        name: "scaling",
        run: scaling::scale,
    },
    Suite {
        name: "stability",
        run: stability::try_cases,
    },
    Suite {
        name: "exact",
        run: exact::try_all,
    },
    Suite {
        name: "cie171",
        run: exact::try_cie171,
    },
    Suite {
        name: "plan",
        run: omissions::compare,
    },
];

/// The names of all suites.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    SUITES.iter().map(|suite| suite.name)
}

/// Run a suite by its name, which the command line has checked.
pub(super) fn run(name: &str, session: &mut Session<'_>) -> Result<()> {
    match SUITES.iter().find(|suite| suite.name == name) {
        Some(suite) => (suite.run)(session),
        None => Ok(()),
    }
}

/// Error against run time on built-in scenes.
fn on_builtins(session: &mut Session<'_>, names: &[&str]) -> Result<()> {
    let sources: Vec<Source> = names
        .iter()
        .map(|name| Source::Builtin((*name).to_owned()))
        .collect();
    error_time::compare(session, &sources)
}
