//! Outlines moved so that the printed part has the size of the model.
//!
//! Beads swell and holes shrink; the first layer is squeezed onto the bed. What a printer does
//! wrong is measured on a print and set right here, before anything else is made of a section.

use geom::region::{Fill, Island, Region, Ring};

use crate::chart::Chart;
use crate::polyhole::PolyholeParams;

/// How far outlines move, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CompensationParams {
    /// All outlines, outwards; negative for inwards: the part grows and its holes shrink.
    pub all: f64,
    /// Outlines of holes besides, into the material; negative for smaller holes.
    pub holes: f64,
    /// Outlines of the first layer, inwards.
    pub first_layer: f64,
    /// Which round holes become polygons before that, if any do.
    pub polyholes: Option<PolyholeParams>,
}

impl CompensationParams {
    /// Returns how far outlines move at most: more than zero when any moves outwards, less when all
    /// move inwards.
    #[must_use]
    pub fn greatest(&self) -> f64 {
        let polyholes = self.polyholes.map_or(0.0, |how| how.greatest());
        let by = self.all.abs() + self.holes.abs().max(self.first_layer) + polyholes;
        if self.all > 0.0 || self.holes < 0.0 { by } else { -by }
    }
}

/// Moves the outlines of a section.
#[must_use]
pub fn compensated(
    section: Region,
    is_first: bool,
    chart: &Chart,
    params: &CompensationParams,
) -> Region {
    let inwards = if is_first { params.first_layer } else { 0.0 } - params.all;
    let with_holes = if params.holes == 0.0 {
        section
    } else {
        let islands = section.islands().iter().map(|island| widened(island, chart, params.holes));
        islands.fold(Region::default(), |all, island| all.union(&island))
    };
    if inwards > 0.0 {
        keeping_thin(&with_holes, chart, inwards)
    } else if inwards < 0.0 {
        chart.outset(&with_holes, -inwards)
    } else {
        with_holes
    }
}

/// Places that would vanish keep this much of their width, mm: a bead.
const KEPT_MM: f64 = 0.4;

/// A region moved inwards, without losing what is too thin for it.
fn keeping_thin(region: &Region, chart: &Chart, distance: f64) -> Region {
    let inset = chart.inset(region, distance);
    let thick = chart.opened(region, distance + KEPT_MM / 2.0);
    let thin = region.difference(&chart.outset(&thick, distance));
    // An opening cuts corners off; those are no thin places.
    let thin = chart.opened(&thin, KEPT_MM / 4.0);
    if thin.is_empty() { inset } else { inset.union(&thin) }
}

/// An island whose holes are wider.
fn widened(island: &Island, chart: &Chart, by: f64) -> Region {
    let Some((outer, holes)) = island.split_first() else { return Region::default() };
    let outer = Region::from_island(vec![outer.clone()]);
    let reversed = |ring: &Ring| -> Ring { ring.iter().rev().copied().collect() };
    let holes: Vec<Ring> = holes.iter().map(reversed).collect();
    let holes = Region::from_grid_rings(&holes, Fill::NonZero);
    let moved = if by > 0.0 { chart.outset(&holes, by) } else { chart.inset(&holes, -by) };
    outer.difference(&moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn square(half: f64) -> Region {
        let ring = [[-half, -half], [half, -half], [half, half], [-half, half]].map(Point2::from);
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    fn moved(is_first: bool, params: CompensationParams) -> [f64; 2] {
        let frame = square(10.0).difference(&square(4.0));
        let moved = compensated(frame, is_first, &Chart::Plane, &params);
        // Sides of the outline and of the hole, by their longest extents.
        [0, 1].map(|k| {
            let ring = &moved.islands()[0][k];
            let reach = ring.iter().map(|p| geom::grid::mm(*p).x).fold(0.0, f64::max);
            2.0 * reach
        })
    }

    #[test]
    fn outlines_holes_and_the_first_layer_move_as_told() {
        let none = CompensationParams::default();
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-3;
        assert!(close(moved(true, none), [20.0, 8.0]));
        assert!(close(moved(false, CompensationParams { all: 0.1, ..none }), [20.2, 7.8]));
        assert!(close(moved(false, CompensationParams { all: -0.1, ..none }), [19.8, 8.2]));
        assert!(close(moved(false, CompensationParams { holes: 0.1, ..none }), [20.0, 8.2]));
        assert!(close(moved(false, CompensationParams { holes: -0.1, ..none }), [20.0, 7.8]));
        let squeezed = CompensationParams { first_layer: 0.2, ..none };
        assert!(close(moved(true, squeezed), [19.6, 8.4]));
        assert!(close(moved(false, squeezed), [20.0, 8.0]));
    }

    #[test]
    fn thin_places_of_the_first_layer_stay() {
        let ring = [[0.0, 0.0], [10.0, 0.0], [10.0, 0.45], [0.0, 0.45]].map(Point2::from);
        let strip = Region::from_rings([ring.as_slice()], Fill::NonZero);
        let params = CompensationParams { first_layer: 0.2, ..CompensationParams::default() };
        let left = compensated(strip.clone(), true, &Chart::Plane, &params);
        assert!(left.area() > 0.9 * strip.area());
    }
}
