//! Which part of an island's interior is solid: bottoms, tops and the layers behind them.
//!
//! A place stays sparse only when it is covered by every one of the next `top_layers` layers above
//! and `bottom_layers` below; everything else is solid. All those layers and the interior are laid
//! over each other in one sweep.
//!
//! Slivers change sides so that both kinds can be filled: sparse places into which no line fits
//! become solid, and solid places thinner than a bead become sparse.

use geom::grid::GridPoint;
use geom::region::{GridBounds, Island, Region};

/// How many layers close the part, and when a small place is not worth leaving sparse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinParams {
    /// Solid layers under a surface that is seen from above.
    pub top_layers: usize,
    /// Solid layers over a surface that is seen from below.
    pub bottom_layers: usize,
    /// Sparse places smaller than this become solid, mm².
    pub solid_below_area: f64,
    /// Whether everything is solid.
    pub all_solid: bool,
}

/// An interior taken apart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skins {
    /// Solid and seen from above.
    pub top: Region,
    /// Solid otherwise.
    pub solid: Region,
    /// The rest.
    pub sparse: Region,
}

/// The layers next to one, as far as its skins depend on them. The nearest comes first; a missing
/// layer (beyond the part) ends the list.
#[derive(Debug, Clone, Default)]
pub struct Neighbours<'a> {
    /// Regions of the layers above.
    pub above: Vec<&'a Region>,
    /// Regions of the layers below.
    pub below: Vec<&'a Region>,
}

/// Takes an island's interior apart; `spacing` is that of the solid lines, mm.
#[must_use]
pub fn skins(
    interior: &Region,
    neighbours: &Neighbours<'_>,
    spacing: f64,
    params: &SkinParams,
) -> Skins {
    let Some(bounds) = interior.bounds() else { return Skins::default() };
    let covered = |layers: &[&Region], wanted: usize| -> Option<Vec<Region>> {
        (layers.len() >= wanted)
            .then(|| layers[..wanted].iter().map(|layer| near(layer, &bounds)).collect())
    };
    let sparse = match (
        covered(&neighbours.above, params.top_layers),
        covered(&neighbours.below, params.bottom_layers),
    ) {
        (Some(above), Some(below)) if !params.all_solid => {
            let layers: Vec<&Region> =
                std::iter::once(interior).chain(&above).chain(&below).collect();
            Region::common_to(&layers)
        }
        _ => Region::default(),
    };
    let open_above = exposed(interior, neighbours.above.first().copied(), &bounds, spacing);
    let sparse = if sparse.is_empty() {
        sparse
    } else {
        let open_below = exposed(interior, neighbours.below.first().copied(), &bounds, spacing);
        sparse
            .difference(&open_above)
            .difference(&open_below)
            .opened(spacing)
            .without_small_islands(params.solid_below_area)
    };
    let (solid, sparse) = if sparse.is_empty() {
        (interior.clone(), sparse)
    } else {
        let solid = interior.difference(&sparse).opened(LEAST_SOLID_SHARE * spacing);
        let sparse = interior.difference(&solid);
        (solid, sparse)
    };
    if open_above.is_empty() || params.top_layers == 0 {
        return Skins { top: Region::default(), solid, sparse };
    }
    Skins { top: solid.intersection(&open_above), solid: solid.difference(&open_above), sparse }
}

/// Solid places thinner than about one spacing hold no line: half of that, less what rounding may
/// take, is the radius of the disc that must fit.
const LEAST_SOLID_SHARE: f64 = 0.49;

/// What of the interior the next layer does not cover, grown by two lines: the walls of the next
/// layer, which run along its edge, then stand on solid ground.
fn exposed(interior: &Region, next: Option<&Region>, bounds: &GridBounds, spacing: f64) -> Region {
    let Some(next) = next else { return interior.clone() };
    let open = interior.difference(&near(next, bounds)).opened(spacing / 2.0);
    if open.is_empty() { open } else { open.outset(2.0 * spacing).intersection(interior) }
}

/// The islands of a region whose boxes meet `bounds`.
fn near(region: &Region, bounds: &GridBounds) -> Region {
    let meets = |island: &&Island| {
        let outer = island.first().map_or(&[][..], Vec::as_slice);
        let (min, max) = corners(outer);
        min.x <= bounds.max.x
            && bounds.min.x <= max.x
            && min.y <= bounds.max.y
            && bounds.min.y <= max.y
    };
    region.filtered(meets)
}

fn corners(ring: &[GridPoint]) -> (GridPoint, GridPoint) {
    let start = (GridPoint::new(i32::MAX, i32::MAX), GridPoint::new(i32::MIN, i32::MIN));
    ring.iter().fold(start, |(min, max), p| {
        (
            GridPoint::new(min.x.min(p.x), min.y.min(p.y)),
            GridPoint::new(max.x.max(p.x), max.y.max(p.y)),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use nalgebra::Point2;

    const PARAMS: SkinParams =
        SkinParams { top_layers: 3, bottom_layers: 2, solid_below_area: 0.0, all_solid: false };

    fn square(size: f64) -> Region {
        let half = size / 2.0;
        let ring = [[-half, -half], [half, -half], [half, half], [-half, half]].map(Point2::from);
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    fn check(skins: &Skins, interior: &Region) {
        let parts = [&skins.top, &skins.solid, &skins.sparse];
        let sum: f64 = parts.iter().map(|part| part.area()).sum();
        assert!((sum - interior.area()).abs() < 0.01 * interior.area() + 0.1, "{sum}");
    }

    #[test]
    fn deep_inside_all_is_sparse() {
        let (interior, outline) = (square(18.0), square(20.0));
        let neighbours = Neighbours { above: vec![&outline; 3], below: vec![&outline; 2] };
        let skins = skins(&interior, &neighbours, 0.4, &PARAMS);
        assert!(skins.top.is_empty() && skins.solid.is_empty());
        assert!((skins.sparse.area() - 324.0).abs() < 0.1);
    }

    #[test]
    fn too_few_layers_above_or_below_make_it_solid() {
        let (interior, outline) = (square(18.0), square(20.0));
        let near_top = Neighbours { above: vec![&outline; 2], below: vec![&outline; 5] };
        let near_top = skins(&interior, &near_top, 0.4, &PARAMS);
        assert!(near_top.sparse.is_empty() && near_top.top.is_empty());
        check(&near_top, &interior);
        let topmost = Neighbours { above: vec![], below: vec![&outline; 5] };
        let topmost = skins(&interior, &topmost, 0.4, &PARAMS);
        assert!((topmost.top.area() - interior.area()).abs() < 1e-6);
        let bottom = Neighbours { above: vec![&outline; 3], below: vec![] };
        let bottom = skins(&interior, &bottom, 0.4, &PARAMS);
        assert!(bottom.top.is_empty() && bottom.sparse.is_empty());
    }

    #[test]
    fn a_step_is_solid_around_and_seen_from_above() {
        let (interior, outline, smaller) = (square(18.0), square(20.0), square(10.0));
        let neighbours = Neighbours { above: vec![&smaller; 3], below: vec![&outline; 2] };
        let parts = skins(&interior, &neighbours, 0.4, &PARAMS);
        check(&parts, &interior);
        // Two lines of 0.4 mm reach under the walls of the step.
        let covered = (10.0_f64 - 4.0 * 0.4).powi(2);
        assert!((parts.sparse.area() - covered).abs() < 1.0, "{}", parts.sparse.area());
        assert!((parts.top.area() - (324.0 - covered)).abs() < 1.0, "{}", parts.top.area());
    }

    #[test]
    fn all_solid_leaves_nothing_sparse() {
        let (interior, outline) = (square(18.0), square(20.0));
        let neighbours = Neighbours { above: vec![&outline; 3], below: vec![&outline; 2] };
        let parts = skins(&interior, &neighbours, 0.4, &SkinParams { all_solid: true, ..PARAMS });
        assert!(parts.sparse.is_empty() && parts.top.is_empty());
        check(&parts, &interior);
    }
}
