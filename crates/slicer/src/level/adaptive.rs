//! Layer heights by the slope of the surface.
//!
//! A layer of height `h` leaves a stair step (cusp) of `h |cos|` on a facet, where `cos` is the
//! cosine of the angle between the facet's normal and the direction in which layers grow. So a
//! facet bears layers up to `cusp / |cos|` at the levels that it covers. Facets that lie in a layer
//! (`|cos| > `[`FLAT_COSINE`]) have no stair steps: a layer must end on them, see [`super`].
//!
//! Two readings of the limit, after the sources of the utility model: the thinnest layer that any
//! facet of a level asks for, or the one that all facets there bear except for a share of their
//! area. Source of the cusp height: A. Dolenc, I. Mäkelä (1994), "Slicing procedures for layered
//! manufacturing techniques", Computer-Aided Design 26(2).
//!
//! Neighbouring layers of very different heights are seen on the part: [`smoothed`] lowers caps
//! until they change by no more than a share of the way along the levels.

use mesh::mesh::Mesh;
use nalgebra::Point3;
use rayon::prelude::*;

use super::{Increments, ScheduleParams};
use crate::surface::LayerSurface;

/// Facets nearer to the direction of a layer than this (0.8°) are flat faces. Less, and the facets
/// of a flat face that is rough by some micrometres would ask for layers of `cusp`.
pub const FLAT_COSINE: f64 = 0.9999;

/// What slopes bear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveParams {
    /// Highest stair step, mm, measured at right angles to the facet.
    pub cusp: f64,
    /// Share of the area of a level, 0 to 1, that may have higher ones.
    pub area_share: f64,
    /// How much thicker the next layer may be, per mm of level; infinity for any.
    pub growth: f64,
}

/// A facet as the levels see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The least level of its corners.
    pub lower: f64,
    /// The greatest.
    pub upper: f64,
    /// Cosine of the angle between its normal and the direction of growth; the sign means nothing.
    pub cosine: f64,
    /// Its area, mm².
    pub area: f64,
}

/// Returns a facet of a mesh under a layer surface, seen from its centre.
#[must_use]
pub fn slope(mesh: &Mesh, facet: u32, surface: &dyn LayerSurface) -> Slope {
    let corners = mesh.corners(facet);
    let levels = corners.map(|p| surface.level(&p));
    let centre =
        Point3::from(corners.iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0);
    let twice = mesh.area_vector(facet);
    let growth = surface.gradient(&centre).normalize();
    Slope {
        lower: levels.iter().copied().fold(f64::INFINITY, f64::min),
        upper: levels.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        cosine: twice.try_normalize(0.0).map_or(0.0, |normal| normal.dot(&growth)),
        area: twice.norm() / 2.0,
    }
}

/// Returns the thickest layer, in increments, by cell of one increment from level 0 to `top`, for
/// the facets of a mesh.
#[must_use]
pub fn caps(
    mesh: &Mesh,
    surface: &dyn LayerSurface,
    top: f64,
    params: &ScheduleParams,
    adaptive: &AdaptiveParams,
) -> Vec<u32> {
    let facets = (0..mesh.triangles.len() as u32).into_par_iter();
    let slopes = facets.map(|facet| slope(mesh, facet, surface));
    caps_of(slopes, top, &Increments::of(params), adaptive)
}

/// Returns the caps that some facets ask for, in any order.
#[must_use]
pub fn caps_of(
    slopes: impl ParallelIterator<Item = Slope>,
    top: f64,
    grid: &Increments,
    params: &AdaptiveParams,
) -> Vec<u32> {
    let n = (top / grid.size).ceil().clamp(0.0, f64::from(u32::MAX / 4)) as u32;
    let spans: Vec<Span> =
        slopes.filter_map(|slope| Span::of(&slope, n, grid, params.cusp)).collect();
    smoothed(&sweep(spans, n, grid, params.area_share), grid.least, params.growth)
}

/// The cells that a facet covers, and what it bears there.
#[derive(Debug, Clone, Copy)]
struct Span {
    from: u32,
    to: u32,
    cap: u32,
    /// Area in each of the cells, nm² · 10³ (10⁻⁹ mm²): whole numbers, so that taking facets out
    /// again leaves nothing behind.
    area: u64,
}

impl Span {
    /// Returns `None` for facets that do not care.
    fn of(slope: &Slope, n: u32, grid: &Increments, cusp: f64) -> Option<Self> {
        const PER_MM2: f64 = 1e9;
        // Facets that end on a bound of cells, but for the noise of their rotation, end there.
        const NOISE: f64 = 1e-6;
        let cosine = slope.cosine.abs();
        // Upright facets bear anything, and count in the share of the area.
        let bears = cusp / cosine / grid.size;
        if cosine > FLAT_COSINE || slope.area <= 0.0 {
            return None;
        }
        let from = ((slope.lower / grid.size + NOISE).floor().max(0.0) as u32).min(n);
        let to = ((slope.upper / grid.size - NOISE).ceil().max(0.0) as u32).min(n);
        let cells = to.saturating_sub(from);
        if cells == 0 {
            return None;
        }
        let cap = (bears + NOISE).floor().clamp(f64::from(grid.least), f64::from(grid.greatest));
        let area = (slope.area / f64::from(cells) * PER_MM2).round();
        Some(Self { from, to, cap: cap as u32, area: area.clamp(1.0, 1e15) as u64 })
    }
}

/// Walks up the cells with the areas of the facets there, by what they bear.
fn sweep(mut spans: Vec<Span>, n: u32, grid: &Increments, share: f64) -> Vec<u32> {
    spans.par_sort_unstable_by_key(|span| span.from);
    let mut ends: Vec<(u32, u32, u64)> =
        spans.par_iter().map(|span| (span.to, span.cap, span.area)).collect();
    ends.par_sort_unstable();
    let mut areas = vec![0_u128; (grid.greatest - grid.least + 1) as usize];
    let mut total = 0_u128;
    let slot = |cap: u32| (cap - grid.least) as usize;
    let (mut begun, mut ended) = (0, 0);
    (0..n)
        .map(|cell| {
            while let Some(span) = spans.get(begun).filter(|span| span.from <= cell) {
                areas[slot(span.cap)] += u128::from(span.area);
                total += u128::from(span.area);
                begun += 1;
            }
            while let Some((_, cap, area)) = ends.get(ended).filter(|end| end.0 <= cell) {
                areas[slot(*cap)] -= u128::from(*area);
                total -= u128::from(*area);
                ended += 1;
            }
            let spared = (total as f64 * share) as u128;
            let mut below = 0;
            let first = areas.iter().position(|area| {
                below += area;
                below > spared
            });
            first.map_or(grid.greatest, |k| grid.least + k as u32)
        })
        .collect()
}

/// Returns caps that change by at most `growth` from cell to cell; none is raised.
#[must_use]
pub fn smoothed(caps: &[u32], least: u32, growth: f64) -> Vec<u32> {
    let mut smooth: Vec<f64> = caps.iter().map(|cap| f64::from(*cap)).collect();
    for i in 1..smooth.len() {
        smooth[i] = smooth[i].min(smooth[i - 1] + growth);
    }
    for i in (1..smooth.len()).rev() {
        smooth[i - 1] = smooth[i - 1].min(smooth[i] + growth);
    }
    smooth.iter().map(|cap| (cap.floor() as u32).max(least)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::{Extent, Snap, schedule};
    use crate::surface::Plane;
    use mesh::shapes;

    const GRID: Increments = Increments { size: 0.01, least: 4, greatest: 32 };
    const ANY: AdaptiveParams =
        AdaptiveParams { cusp: 0.1, area_share: 0.0, growth: f64::INFINITY };

    fn params(adaptive: AdaptiveParams) -> ScheduleParams {
        ScheduleParams {
            first_layer_height: 0.2,
            layer_height: 0.2,
            least_height: 0.04,
            greatest_height: 0.32,
            increment: 0.01,
            snap: Snap::Optimal,
            adaptive: Some(adaptive),
        }
    }

    #[test]
    fn a_cube_bears_the_thickest_layers_and_a_cone_the_same_everywhere() {
        let caps_of = |mesh: &Mesh| caps(mesh, &Plane, mesh.bounds().max.z, &params(ANY), &ANY);
        assert!(caps_of(&shapes::cube(10.0)).iter().all(|cap| *cap == 32));
        // A cone of 45°: cusp / cos 45°.
        let cone = caps_of(&shapes::cone(10.0, 10.0, 96));
        assert!(cone.iter().all(|cap| *cap == 14), "{cone:?}");
    }

    #[test]
    fn stair_steps_of_a_dome_stay_within_the_cusp() {
        let dome = shapes::dome(15.0, 72);
        let top = dome.bounds().max.z;
        let adaptive = AdaptiveParams { growth: 0.1, ..ANY };
        let params = params(adaptive);
        let caps = caps(&dome, &Plane, top, &params, &adaptive);
        let levels = schedule(&Extent { top, flats: &[], caps: &caps }, &params);
        for facet in 0..dome.triangles.len() as u32 {
            let slope = slope(&dome, facet, &Plane);
            if slope.cosine.abs() > FLAT_COSINE {
                continue;
            }
            for level in &levels[1..] {
                let covers = level.lower < slope.upper - 1e-9 && level.upper > slope.lower + 1e-9;
                let step = level.thickness() * slope.cosine.abs();
                assert!(!covers || step <= 0.1 + 1e-9 || level.thickness() <= 0.04, "{level:?}");
            }
        }
        let change = |pair: &[crate::level::Level]| pair[1].thickness() / pair[0].thickness();
        assert!(levels.windows(2).skip(1).all(|pair| (0.8..1.25).contains(&change(pair))));
    }

    #[test]
    fn a_share_of_the_area_may_have_higher_steps() {
        let upright = Slope { lower: 0.0, upper: 1.0, cosine: 0.0, area: 95.0 };
        let sloping = Slope { lower: 0.0, upper: 1.0, cosine: 1.0 / 1.5, area: 5.0 };
        let cap = |area_share: f64| {
            let slopes = [upright, sloping].into_par_iter();
            caps_of(slopes, 1.0, &GRID, &AdaptiveParams { area_share, ..ANY })[50]
        };
        assert_eq!([cap(0.0), cap(0.04), cap(0.06)], [15, 15, 32]);
    }

    #[test]
    fn smoothing_only_lowers() {
        let caps = [32, 32, 10, 32, 32, 32];
        assert_eq!(smoothed(&caps, 4, f64::INFINITY), caps);
        assert_eq!(smoothed(&caps, 4, 5.0), [20, 15, 10, 15, 20, 25]);
    }
}
