//! The cut by a plane: straight through every facet, one crossing at most on a side.

use geom::grid::snap;
use nalgebra::Point3;

use super::chain::{Chain, Step, Trails};
use super::{Cutter, NO_FACET};

/// How the outline passes through a facet; `None` when it does not.
pub(super) fn step(cutter: &Cutter<'_>, facet: u32, cut: f64) -> Option<Step> {
    let corners = cutter.solid.mesh().triangles[facet as usize];
    let below = corners.map(|v| cutter.vertex_levels[v as usize] < cut);
    let sides = cutter.solid.sides()[facet as usize];
    // Walking round the facet counter-clockwise seen from outside, the level is left behind
    // through `up` and met again through `down`. The outline runs the other way, which seen
    // from above keeps the material to its left.
    let up = (0..3).find(|&k| below[k] && !below[(k + 1) % 3])?;
    let down = (0..3).find(|&k| !below[k] && below[(k + 1) % 3])?;
    Some(Step { enter: sides[down], leave: sides[up], facet: NO_FACET })
}

/// The outlines in the chart.
pub(super) fn chains(cutter: &Cutter<'_>, trails: &Trails, cut: f64) -> Vec<Chain> {
    let point = |side: u32| {
        let [low, high] = cutter.solid.ends(side).map(|v| v as usize);
        let (a, b) = (cutter.vertex_levels[low], cutter.vertex_levels[high]);
        let share = ((cut - a) / (b - a)).clamp(0.0, 1.0);
        let vertices = &cutter.solid.mesh().vertices;
        let at = Point3::from(vertices[low].coords.lerp(&vertices[high].coords, share));
        snap(&cutter.surface.flatten(&at))
    };
    trails
        .outlines
        .iter()
        .map(|(range, closed)| {
            let steps = &trails.steps[range.clone()];
            let mut points = Vec::with_capacity(steps.len() + 1);
            points.extend(steps.iter().map(|step| point(step.enter)));
            if let (false, Some(last)) = (closed, steps.last()) {
                points.push(point(last.leave));
            }
            Chain { points, closed: *closed }
        })
        .collect()
}
