//! `rhumb completions`: what a shell offers behind `rhumb`.

use clap::CommandFactory;

use super::{DONE, say};
use crate::args::{Arguments, Completions};
use crate::failure::Failure;

pub(super) fn run(arguments: &Completions) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "rhumb", &mut script);
    say(&String::from_utf8_lossy(&script))?;
    Ok(DONE)
}
