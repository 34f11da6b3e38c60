//! The supports of a whole print. What stands below a layer depends on all layers above it, so they
//! are looked at once before any is filled; kept are outlines as they are seen along the axis.

use mesh::topology::Solid;
use slicer::support::{Column, Shade, columns};

use crate::failure::Failure;
use crate::filling::WINDOW;
use crate::pipeline::Watch;
use crate::settings::Job;
use crate::shelf::{Shelf, Use};
use crate::stack::Stack;
use crate::stages::Stage;

/// Returns the supports of every layer printed, by stage; nothing where none are wanted. Sections are put
/// by for who fills the layers.
///
/// # Errors
///
/// When the user interrupts.
pub(crate) fn supports(
    solid: &Solid,
    (stages, shelves): (&[Stage], &[Shelf]),
    job: &Job,
    watch: &mut Watch<'_>,
) -> Result<Vec<Vec<Column>>, Failure> {
    let Some(params) = &job.paths.support else {
        return Ok(vec![Vec::new(); stages.len()]);
    };
    let count: usize = stages.iter().map(|stage| stage.printed.len()).sum();
    watch.progress.stage("supports", count as u64);
    let mut shades: Vec<Shade> = Vec::with_capacity(count);
    for (index, stage) in stages.iter().enumerate() {
        let below = index.checked_sub(1).map(|below| &stages[below]);
        let mut stack = Stack::new(solid, stage, below, job);
        stack.share(Use::PutBy(&shelves[index]));
        for start in stage.printed.clone().step_by(WINDOW) {
            watch.interrupt.check()?;
            let window = start..(start + WINDOW).min(stage.printed.end);
            stack.reach(&window, |_| {});
            watch.progress.advance(window.len() as u64);
            shades.extend(stack.shades(window, params));
        }
    }
    let mut all = columns(&shades, params).into_iter();
    Ok(stages.iter().map(|stage| all.by_ref().take(stage.printed.len()).collect()).collect())
}
