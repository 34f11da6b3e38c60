//! `rhumb preview`: pictures of a program, drawn from what the twin replayed.

use twin::picture::layer::{LayerSink, layer_svg};
use twin::picture::print::{PrintSink, Shade, print_svg};

use super::verify::job_of;
use super::{DONE, write_file};
use crate::args::{Coloring, Preview};
use crate::check::check;
use crate::failure::Failure;
use crate::input;

/// Pieces that are drawn of a whole print: about a megabyte of picture, and more than a page shows.
const MOST_PIECES: usize = 20_000;

pub(super) fn run(arguments: &Preview) -> Result<u8, Failure> {
    if arguments.output.extension().is_none_or(|extension| extension != "svg") {
        return Err(Failure::new(
            "Usage",
            format!("{} does not end in .svg", arguments.output.display()),
        )
        .hint("pictures are written as SVG"));
    }
    let program = input::read(&arguments.program)?;
    let job = job_of(&program, &arguments.settings)?;
    let printer = &job.printer;
    let picture = match arguments.layer {
        Some(layer) => {
            let mut sink = LayerSink::new(layer, printer);
            check(program.as_slice(), &job, None, false, |segment| sink.add(segment))?;
            layer_svg(sink, printer)
        }
        None => {
            let mut sink = PrintSink::new(MOST_PIECES, printer);
            check(program.as_slice(), &job, None, false, |segment| sink.add(segment))?;
            let shade = match arguments.color_by {
                Coloring::Height => Shade::Height,
                Coloring::Role => Shade::Role,
            };
            print_svg(sink, shade)
        }
    };
    write_file(&arguments.output, &[&arguments.program], picture.as_bytes())?;
    Ok(DONE)
}
