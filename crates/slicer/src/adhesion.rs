//! What surrounds the part on the bed: skirt and brim.
//!
//! A brim is loops around the first layer that hold on to it. A skirt is loops around its convex
//! hull at a distance; it primes the nozzle and shows whether the first layer sticks.

use geom::circle::convex_hull;
use geom::grid::mm;
use geom::region::{Fill, Region};
use nalgebra::Point2;

/// Loops around the first layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdhesionParams {
    /// Number of skirt loops; 0 for none.
    pub skirts: usize,
    /// Distance of the innermost skirt loop from part or brim, mm.
    pub skirt_distance: f64,
    /// Width of the brim, mm; 0 for none.
    pub brim_width: f64,
    /// Whether the brim lies around the part.
    pub brim_outside: bool,
    /// Whether it lies in the holes of the part.
    pub brim_inside: bool,
    /// Gap between brim and part, mm.
    pub brim_separation: f64,
    /// No loop reaches farther than this from the rotation axis, mm.
    pub reach: f64,
}

/// Loops, and whether the reach of the machine left some out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Adhesion {
    /// Closed centrelines, mm, the outermost first: the nozzle is primed when it gets to the part.
    pub loops: Vec<Vec<Point2<f64>>>,
    /// Number of loops that would have been out of reach.
    pub out_of_reach: usize,
}

/// Returns the loops around the first layer for lines `width` wide and `spacing` apart, mm.
#[must_use]
pub fn around(first_layer: &Region, width: f64, spacing: f64, params: &AdhesionParams) -> Adhesion {
    let mut adhesion = Adhesion::default();
    if first_layer.is_empty() {
        return adhesion;
    }
    let mut outwards = Vec::new();
    let brim_loops = (params.brim_width / spacing).round() as usize;
    // Islands of the part keep their holes free of brim: only outer borders are followed.
    let filled = outer_borders(first_layer);
    let distance = |k: usize| params.brim_separation + width / 2.0 + spacing * k as f64;
    if params.brim_inside {
        let holes = filled.difference(first_layer);
        let loops = (0..brim_loops).map(|k| holes.inset(distance(k)));
        outwards.extend(loops.flat_map(|region| rings(&region).collect::<Vec<_>>()));
    }
    let outer_loops = if params.brim_outside { brim_loops } else { 0 };
    for k in 0..outer_loops {
        outwards.extend(rings(&outer_borders(&filled.outset(distance(k)))));
    }
    let brim_edge = params.brim_separation * f64::from(u8::from(outer_loops > 0))
        + spacing * outer_loops as f64;
    let hull = hull_of(&filled);
    for k in 0..params.skirts {
        let distance = brim_edge + params.skirt_distance + width / 2.0 + spacing * k as f64;
        outwards.extend(rings(&hull.outset(distance)));
    }
    let within_reach = |points: &Vec<Point2<f64>>| {
        points.iter().all(|p| p.coords.norm() + width / 2.0 <= params.reach)
    };
    let wanted = outwards.len();
    outwards.retain(within_reach);
    adhesion.out_of_reach = wanted - outwards.len();
    outwards.reverse();
    adhesion.loops = outwards;
    adhesion
}

fn rings(region: &Region) -> impl Iterator<Item = Vec<Point2<f64>>> + '_ {
    region.rings().map(|ring| ring.iter().map(|&p| mm(p)).collect())
}

fn outer_borders(region: &Region) -> Region {
    let outer: Vec<_> = region.islands().iter().filter_map(|i| i.first().cloned()).collect();
    Region::from_grid_rings(&outer, Fill::Positive)
}

fn hull_of(region: &Region) -> Region {
    let points: Vec<Point2<f64>> = region.rings().flatten().map(|&p| mm(p)).collect();
    Region::from_rings([convex_hull(&points).as_slice()], Fill::NonZero)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMS: AdhesionParams = AdhesionParams {
        skirts: 2,
        skirt_distance: 6.0,
        brim_width: 0.0,
        brim_outside: true,
        brim_inside: false,
        brim_separation: 0.1,
        reach: 100.0,
    };

    fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Region {
        let ring =
            [[x, y], [x + width, y], [x + width, y + height], [x, y + height]].map(Point2::from);
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    #[test]
    fn skirt_loops_surround_all_islands() {
        let two = rectangle(-20.0, 0.0, 5.0, 5.0).union(&rectangle(15.0, 0.0, 5.0, 5.0));
        let adhesion = around(&two, 0.45, 0.4, &PARAMS);
        assert_eq!(adhesion.loops.len(), 2);
        let reach = |k: usize| adhesion.loops[k].iter().map(|p| p.x).fold(0.0, f64::max);
        assert!((reach(1) - 26.225).abs() < 0.01 && reach(0) > reach(1), "outermost first");
    }

    #[test]
    fn brim_lies_against_the_part() {
        let params = AdhesionParams { skirts: 0, brim_width: 2.0, ..PARAMS };
        let adhesion = around(&rectangle(0.0, 0.0, 10.0, 10.0), 0.45, 0.4, &params);
        assert_eq!(adhesion.loops.len(), 5);
        let innermost = adhesion.loops.last().unwrap();
        let gap = -innermost.iter().map(|p| p.x).fold(f64::INFINITY, f64::min) - 0.225;
        assert!((gap - 0.1).abs() < 1e-4, "{gap}");
    }

    #[test]
    fn a_brim_may_lie_in_holes() {
        let ring =
            rectangle(-20.0, -20.0, 40.0, 40.0).difference(&rectangle(-8.0, -8.0, 16.0, 16.0));
        let reach = |params: &AdhesionParams| -> Vec<f64> {
            let loops = around(&ring, 0.45, 0.4, params).loops;
            loops.iter().map(|l| l.iter().map(|p| p.x).fold(0.0, f64::max)).collect()
        };
        let inside = AdhesionParams { skirts: 0, brim_width: 2.0, brim_inside: true, ..PARAMS };
        let both = reach(&inside);
        assert_eq!(both.len(), 10);
        let inner: Vec<&f64> = both.iter().filter(|x| **x < 8.0).collect();
        assert_eq!(inner.len(), 5);
        assert!(inner.iter().all(|x| (5.9..7.7).contains(*x)), "{inner:?}");
        assert!(reach(&AdhesionParams { brim_outside: false, ..inside }).iter().all(|x| *x < 8.0));
    }

    #[test]
    fn loops_out_of_reach_are_left_out_and_counted() {
        let params = AdhesionParams { reach: 16.0, ..PARAMS };
        let adhesion = around(&rectangle(-9.0, -9.0, 18.0, 18.0), 0.45, 0.4, &params);
        assert_eq!((adhesion.loops.len(), adhesion.out_of_reach), (0, 2));
        assert!(around(&Region::default(), 0.45, 0.4, &params).loops.is_empty());
    }
}
