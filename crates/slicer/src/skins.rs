//! Which part of an island's interior is solid: bottoms, tops and the layers behind them.
//!
//! A place stays sparse only when it is covered by every one of the next `top_layers` layers above
//! and `bottom_layers` below; everything else is solid.
//!
//! Slivers change sides so that both kinds can be filled: sparse places into which no line fits
//! become solid, and solid places thinner than a bead become sparse.

use geom::region::Region;

use crate::bridge::unsupported;
use crate::chart::Chart;
use crate::support::Column;

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
    /// One layer of this many is solid throughout; 0 for none.
    pub solid_every: usize,
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
    /// Where nothing is below, whatever of the above that place is.
    pub unsupported: Region,
}

/// The layers next to one, as far as its skins depend on them. The nearest comes first; a missing
/// layer (beyond the part) ends the list.
#[derive(Debug, Clone, Default)]
pub struct Neighbours<'a> {
    /// Regions of the layers above.
    pub above: Vec<&'a Region>,
    /// Regions of the layers below.
    pub below: Vec<&'a Region>,
    /// The supports of this layer, as they are seen along the axis.
    pub support: Option<&'a Column>,
}

/// How closely skins follow outlines, mm: lines that begin 10 µm sooner or later are the same lines,
/// and every step here costs in proportion to the points of its outlines.
pub const SKIN_TOLERANCE_MM: f64 = 0.01;

/// Solid places thinner than about one spacing hold no line: half of that, less what rounding may
/// take, is the radius of the disc that must fit.
const LEAST_SOLID_SHARE: f64 = 0.49;

/// Area that a layer may take from the interior and still count as covering it, mm²: what
/// simplified outlines of a vertical wall differ by.
const NEGLIGIBLE_MM2: f64 = 0.01;

/// Takes an island's interior apart; `spacing` is that of the solid lines, mm.
#[must_use]
pub fn skins(
    interior: &Region,
    chart: &Chart,
    neighbours: &Neighbours<'_>,
    spacing: f64,
    params: &SkinParams,
) -> Skins {
    if interior.is_empty() {
        return Skins::default();
    }
    let unsupported = match neighbours.below.first() {
        Some(below) if params.bottom_layers > 0 => unsupported(interior, below, chart, spacing),
        _ => Region::default(),
    };
    let above = Cover::new(interior, chart, &neighbours.above, params.top_layers, spacing);
    let sparse = if params.all_solid || !above.is_complete {
        Region::default()
    } else {
        let below = Cover::new(interior, chart, &neighbours.below, params.bottom_layers, spacing);
        if below.is_complete {
            let covered = above
                .common
                .intersection(&below.common)
                .difference(&above.open)
                .difference(&below.open);
            chart.opened(&covered, spacing).without_small_islands(params.solid_below_area)
        } else {
            Region::default()
        }
    };
    let (solid, sparse) = if sparse.is_empty() {
        (interior.clone(), sparse)
    } else {
        let solid = chart.opened(&interior.difference(&sparse), LEAST_SOLID_SHARE * spacing);
        let sparse = interior.difference(&solid);
        (solid, sparse)
    };
    if above.open.is_empty() || params.top_layers == 0 {
        return Skins { top: Region::default(), solid, sparse, unsupported };
    }
    let top = solid.intersection(&above.open);
    Skins { top, solid: solid.difference(&above.open), sparse, unsupported }
}

/// How the layers on one side cover an interior.
struct Cover {
    /// Whether there are as many layers as are asked for.
    is_complete: bool,
    /// What all of them cover.
    common: Region,
    /// What the nearest leaves open, grown by two lines: the walls of that layer, which run along
    /// the edge, then stand on solid ground.
    open: Region,
}

impl Cover {
    fn new(
        interior: &Region,
        chart: &Chart,
        layers: &[&Region],
        wanted: usize,
        spacing: f64,
    ) -> Self {
        let is_complete = layers.len() >= wanted;
        let Some(nearest) = layers.first() else {
            return Self { is_complete, common: Region::default(), open: interior.clone() };
        };
        let mut common = interior.intersection(nearest);
        let open = if interior.area() - common.area() <= NEGLIGIBLE_MM2 {
            Region::default()
        } else {
            let bare = chart.opened(&interior.difference(nearest), spacing / 2.0);
            if bare.is_empty() {
                bare
            } else {
                chart.outset(&bare, 2.0 * spacing).intersection(interior)
            }
        };
        if wanted == 0 {
            return Self { is_complete, common: interior.clone(), open: Region::default() };
        }
        if is_complete {
            for pair in layers[..wanted].windows(2) {
                // Layers of an upright wall are equal to the last bit.
                if pair[0] != pair[1] && !common.is_empty() {
                    common = common.intersection(pair[1]);
                }
            }
        }
        Self { is_complete, common, open }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use nalgebra::Point2;

    const PARAMS: SkinParams = SkinParams {
        top_layers: 3,
        bottom_layers: 2,
        solid_below_area: 0.0,
        all_solid: false,
        solid_every: 0,
    };

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
        let neighbours =
            Neighbours { above: vec![&outline; 3], below: vec![&outline; 2], support: None };
        let skins = skins(&interior, &Chart::Plane, &neighbours, 0.4, &PARAMS);
        assert!(skins.top.is_empty() && skins.solid.is_empty());
        assert!((skins.sparse.area() - 324.0).abs() < 0.1);
    }

    #[test]
    fn too_few_layers_above_or_below_make_it_solid() {
        let (interior, outline) = (square(18.0), square(20.0));
        let near_top =
            Neighbours { above: vec![&outline; 2], below: vec![&outline; 5], support: None };
        let near_top = skins(&interior, &Chart::Plane, &near_top, 0.4, &PARAMS);
        assert!(near_top.sparse.is_empty() && near_top.top.is_empty());
        check(&near_top, &interior);
        let topmost = Neighbours { above: vec![], below: vec![&outline; 5], support: None };
        let topmost = skins(&interior, &Chart::Plane, &topmost, 0.4, &PARAMS);
        assert!((topmost.top.area() - interior.area()).abs() < 1e-6);
        let bottom = Neighbours { above: vec![&outline; 3], below: vec![], support: None };
        let bottom = skins(&interior, &Chart::Plane, &bottom, 0.4, &PARAMS);
        assert!(bottom.top.is_empty() && bottom.sparse.is_empty());
    }

    #[test]
    fn a_step_is_solid_around_and_seen_from_above() {
        let (interior, outline, smaller) = (square(18.0), square(20.0), square(10.0));
        let neighbours =
            Neighbours { above: vec![&smaller; 3], below: vec![&outline; 2], support: None };
        let parts = skins(&interior, &Chart::Plane, &neighbours, 0.4, &PARAMS);
        check(&parts, &interior);
        // Two lines of 0.4 mm reach under the walls of the step.
        let covered = (10.0_f64 - 4.0 * 0.4).powi(2);
        assert!((parts.sparse.area() - covered).abs() < 1.0, "{}", parts.sparse.area());
        assert!((parts.top.area() - (324.0 - covered)).abs() < 1.0, "{}", parts.top.area());
    }

    #[test]
    fn all_solid_leaves_nothing_sparse() {
        let (interior, outline) = (square(18.0), square(20.0));
        let neighbours =
            Neighbours { above: vec![&outline; 3], below: vec![&outline; 2], support: None };
        let parts = skins(
            &interior,
            &Chart::Plane,
            &neighbours,
            0.4,
            &SkinParams { all_solid: true, ..PARAMS },
        );
        assert!(parts.sparse.is_empty() && parts.top.is_empty());
        check(&parts, &interior);
    }
}
