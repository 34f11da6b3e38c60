//! Runs the hostile corpus, the real models and the orientation vectors of the folder `shared`
//! beside the repository. A clone without that folder skips them, and says so; the same rules are
//! tested by inputs built in code in the other tests.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Write as _;
use std::path::{Path, PathBuf};

mod corpus;
mod models;
mod orientation;

/// Finds a file or folder below `shared` beside the repository.
fn shared(name: &str) -> Option<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let found = here.ancestors().map(|dir| dir.join("shared").join(name)).find(|p| p.exists());
    if found.is_none() {
        say(&format!("skipped: there is no shared/{name} beside the repository"));
    }
    found
}

/// Says something in the log of the test.
fn say(text: &str) {
    writeln!(std::io::stderr(), "{text}").expect("the log can be written");
}
