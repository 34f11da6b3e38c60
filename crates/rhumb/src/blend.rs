//! From planar layers to cones: layers that are each a little steeper than the one below.

use mesh::mesh::Mesh;
use slicer::level::Level;
use slicer::lift::LEAST_WEDGE_SHARE;
use slicer::stacking::{BlendLayer, Side, blend};
use slicer::surface::{Cone, LayerSurface, SurfaceError};

use crate::failure::Failure;
use crate::levels;
use crate::settings::Job;
use crate::stages::{LayerKind, Stage, extent, unfit};

/// Returns the stage that leads from the planar layers, which end at `floor` mm, to those of `kind`;
/// `None` where there is none to lead to, or none is wanted.
///
/// # Errors
///
/// `OutOfEnvelope` when layers cannot be of different thickness, `LimitExceeded` when it takes too
/// many.
pub(crate) fn stage(
    part: &Mesh,
    kind: LayerKind,
    floor: f64,
    job: &Job,
) -> Result<Option<Stage>, Failure> {
    let LayerKind::Conical(angle) = kind else { return Ok(None) };
    if !job.morph || angle == 0.0 {
        return Ok(None);
    }
    let limits = limits(job);
    if limits[0] >= limits[1] {
        return Err(Failure::new(
            "OutOfEnvelope",
            format!("layers that are all {} mm thick cannot grow steeper", limits[0]),
        )
        .hint("min_layer_height_mm must be less than max_layer_height_mm, or set blend = none"));
    }
    let radius = extent(part).radius;
    levels::check_count(radius * angle.tan().abs().asinh() / (limits[1] - limits[0]))?;
    let cones = blend(angle.tan(), radius, limits).map_err(|error| unfit(&error))?;
    laid_out(&cones, floor, f64::midpoint(limits[0], limits[1]), job).map_err(|error| unfit(&error))
}

/// How thin and how thick its layers may be, mm: as thin and as thick as beads of a wedge are, within
/// what the printer can lay.
fn limits(job: &Job) -> [f64; 2] {
    let params = &job.schedule;
    let share = |share: f64| share * params.layer_height;
    [
        params.least_height.max(share(LEAST_WEDGE_SHARE)),
        params.greatest_height.min(share(1.0 + LEAST_WEDGE_SHARE)),
    ]
}

/// The layers of a blend with those below and above that decide on their skins.
fn laid_out(
    cones: &[BlendLayer],
    floor: f64,
    mean: f64,
    job: &Job,
) -> Result<Option<Stage>, SurfaceError> {
    let Some(last) = cones.last() else { return Ok(None) };
    let (step, skins) = (job.schedule.layer_height, &job.paths.skins);
    let (below, above) = (skins.bottom_layers.max(1), skins.top_layers.max(1));
    let flat = Cone::from_slope(0.0)?;
    let planes = (0..=below).rev().map(|k| Side { cone: flat, level: floor - step * k as f64 });
    let blended = cones.iter().map(|layer| Side { cone: layer.cone, level: floor + layer.level });
    let beyond = (1..=above).map(|k| {
        let rise = last.cone.level_step(step) * k as f64;
        Side { cone: last.cone, level: floor + last.level + rise }
    });
    let sides: Vec<Side> = planes.chain(blended).chain(beyond).collect();
    let levels = sides[1..].iter().enumerate().map(|(k, side)| Level {
        index: (job.base_layers + k).saturating_sub(below),
        // Beads are laid as far apart as in a layer of the mean thickness.
        lower: side.level - side.cone.level_step(mean),
        upper: side.level,
    });
    Ok(Some(Stage {
        surface: Box::new(last.cone),
        kind: LayerKind::Conical(last.cone.angle()),
        levels: levels.collect(),
        printed: below..below + cones.len(),
        floor: None,
        ceiling: None,
        morph: Some(sides),
    }))
}
