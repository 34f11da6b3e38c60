//! Loops that follow the outline of an area inwards.

use geom::grid::mm;
use geom::region::Region;
use nalgebra::Point2;

use crate::chart::Chart;
use crate::walls::split_thin;

/// Returns loops from `first` (mm) inside the edge, half a bead, then every `spacing` mm. Where loops from
/// both sides would lie on each other there is one, if it is closed without the other.
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
        for island in inset.islands() {
            let whole = Region::from_island(island.clone());
            if !chart.opened(&whole, first).is_empty() {
                loops.extend(centrelines(&whole));
            } else if let [outer, _, ..] = island.as_slice() {
                loops.push(outer.iter().map(|&p| mm(p)).collect());
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;

    #[test]
    fn loops_from_both_sides_of_a_ring_never_lie_on_each_other() {
        let disc = |radius: f64| {
            let corner = |k: u32| {
                let angle = std::f64::consts::TAU * f64::from(k) / 90.0;
                Point2::new(radius * angle.cos(), radius * angle.sin())
            };
            let ring: Vec<Point2<f64>> = (0..90).map(corner).collect();
            Region::from_rings([ring.as_slice()], Fill::NonZero)
        };
        // The second loops meet in the middle at 3 mm, as far as the corners of the circles go.
        for hole in [0.5, 0.6, 0.65, 0.7, 0.75, 0.9] {
            let area = disc(5.5).difference(&disc(hole));
            let loops = sparse(&area, &Chart::Plane, 0.2, 2.2);
            let mut radii: Vec<f64> = loops.iter().map(|l| l[0].coords.norm()).collect();
            radii.sort_by(f64::total_cmp);
            assert!(radii.windows(2).all(|pair| pair[1] - pair[0] > 0.39), "{hole}: {radii:?}");
            assert!(
                radii.iter().any(|r| (2.5..3.5).contains(r)) || hole >= 0.7,
                "{hole}: {radii:?}"
            );
        }
    }
}
