//! Loops that follow the outline of an area inwards.

use geom::grid::mm;
use geom::region::Region;
use nalgebra::Point2;

use crate::chart::Chart;
use crate::walls::split_thin;

/// Returns loops from `first` (mm) inside the edge, then every `spacing` mm.
pub(super) fn sparse(
    area: &Region,
    chart: &Chart,
    first: f64,
    spacing: f64,
) -> Vec<Vec<Point2<f64>>> {
    let mut loops = Vec::new();
    // Every loop is taken from the outline itself: no error adds up.
    for k in 0_u32.. {
        let inset = chart.inset(area, first + f64::from(k) * spacing);
        if inset.is_empty() {
            break;
        }
        loops.extend(centrelines(&inset));
    }
    loops
}

/// Returns loops side by side, and the places between them that are too thin for two.
pub(super) fn solid(
    area: &Region,
    chart: &Chart,
    spacing: f64,
) -> (Vec<Vec<Point2<f64>>>, Vec<Region>) {
    let (mut loops, mut thin) = (Vec::new(), Vec::new());
    let mut left = area.clone();
    while !left.is_empty() {
        let split = split_thin(&left, chart, spacing);
        loops.extend(centrelines(&chart.inset(&split.thick, spacing / 2.0)));
        if !split.thin.is_empty() {
            thin.push(split.thin);
        }
        left = split.core;
    }
    (loops, thin)
}

fn centrelines(region: &Region) -> impl Iterator<Item = Vec<Point2<f64>>> + '_ {
    region.rings().map(|ring| ring.iter().map(|&p| mm(p)).collect())
}
