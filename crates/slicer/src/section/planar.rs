//! The cut by a plane: straight through every facet, one crossing at most on a side.

use geom::grid::snap;
use geom::region::Ring;
use nalgebra::{Point2, Point3};

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
        cutter.surface.flatten(&at)
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
            Chain { points: corners(points, *closed), closed: *closed }
        })
        .collect()
}

/// A point within this of the line between its neighbours is no corner, mm: far more than the rounding
/// of crossings, far less than a step of the grid.
const STRAIGHT_MM: f64 = 1e-9;

/// An outline on the grid, without its points on straight lines.
///
/// Where it crosses from one facet of a flat face to the next is another place on every layer; without
/// these, layers of an upright wall have the same outline to the last bit.
fn corners(mut points: Vec<Point2<f64>>, closed: bool) -> Ring {
    // Of points as good as equal the directions between them would mean nothing.
    let is_same = |a: &Point2<f64>, b: &Point2<f64>| (b - a).norm_squared() <= STRAIGHT_MM.powi(2);
    points.dedup_by(|next, last| is_same(last, next));
    while closed && points.len() > 1 && is_same(&points[0], &points[points.len() - 1]) {
        points.pop();
    }
    let n = points.len();
    let is_corner = |i: usize| {
        if !closed && (i == 0 || i + 1 == n) {
            return true;
        }
        let (before, after) = (points[(i + n - 1) % n], points[(i + 1) % n]);
        let (into, out) = (points[i] - before, after - points[i]);
        let across = into.perp(&out);
        into.dot(&out) <= 0.0
            || across * across > STRAIGHT_MM.powi(2) * (after - before).norm_squared()
    };
    (0..n).filter(|&i| is_corner(i)).map(|i| snap(&points[i])).collect()
}
