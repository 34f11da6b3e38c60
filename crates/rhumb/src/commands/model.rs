//! `rhumb model`: the built-in models.

use std::path::PathBuf;

use mesh::{shapes, stl};

use super::{DONE, say, write_file};
use crate::args::Model;
use crate::failure::Failure;

pub(super) fn run(arguments: &Model) -> Result<u8, Failure> {
    let Some(name) = &arguments.name else {
        say(&format!("{}\n", shapes::NAMES.join("\n")))?;
        return Ok(DONE);
    };
    let mesh = shapes::by_name(name).ok_or_else(|| {
        Failure::new("Usage", format!("there is no built-in model {name:?}"))
            .hint(format!("there are {}", shapes::NAMES.join(", ")))
    })?;
    let target = arguments.output.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.stl")));
    write_file(&target, &[], &stl::write(&mesh))?;
    Ok(DONE)
}
