//! The mesh cut along a level: closed outlines of the material.
//!
//! Every vertex is either below the level or not; one exactly on it counts as above, so a cut
//! through a vertex, a side or a whole facet is the cut just underneath, and no case is special.
//! Outlines pass from facet to facet through the sides; each side belongs to two facets that run it
//! in opposite directions, and what leaves one enters the next: on a closed mesh every outline
//! closes, whatever the rounding. Material lies to the left of outlines, seen from above.
//!
//! `planar` cuts by planes, straight through each facet; `curved` by cones and spheres, along
//! exact arcs that `arc` replaces by chords; `chain` puts the pieces in order. Points on sides
//! are computed from the lower-numbered vertex to the other, so both facets get the same bits.
//! Overlapping shells are merged by the nonzero rule when outlines become regions.
//!
//! On an open mesh chains are left over. They are joined end to nearest begin while the gap is at
//! most [`LARGEST_GAP_MM`]; the rest is dropped and reported.

mod arc;
mod chain;
mod curved;
mod planar;
#[cfg(test)]
mod vectors;

use chain::{Chain, Step, close_chains, trails};
use curved::{CurvedCut, Field};
use geom::region::{Fill, Region, Ring};
use geom::simplify::simplify_ring;
use mesh::topology::Solid;
use rayon::prelude::*;

use crate::level::Level;
use crate::surface::{Form, LayerSurface};

/// The widest gap in an outline that is closed by a straight line, mm. Holes of a mesh are closed
/// long before; what is left are tears. Wider, and unrelated outlines would be joined.
pub const LARGEST_GAP_MM: f64 = 2.0;

/// The material of one layer.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// The material, in the chart of the layer.
    pub region: Region,
    /// What was wrong with its outlines.
    pub tears: Tears,
}

/// Outlines that did not close by themselves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tears {
    /// Number of gaps that were closed by a straight line.
    pub closed: usize,
    /// The widest of them, mm.
    pub widest: f64,
    /// Number of chains that were dropped.
    pub dropped: usize,
    /// Their length together, mm.
    pub dropped_length: f64,
}

/// The share of the tolerance that chords of curves in facets take; outlines are thinned out with
/// the rest, which decides how many points later steps have to handle.
const CURVE_SHARE: f64 = 0.25;

/// A planar step has nothing to do with its facet once the sides are known.
const NO_FACET: u32 = u32::MAX;

/// A solid made ready to be cut at many levels.
pub struct Cutter<'a> {
    solid: &'a Solid,
    surface: &'a dyn LayerSurface,
    form: Form,
    cuts: Vec<f64>,
    /// Level of every vertex, computed once: two expressions for it could disagree in a last bit.
    vertex_levels: Vec<f64>,
    /// Facets by cut: those of cut `k` are `facets[starts[k]..starts[k + 1]]`, ascending.
    starts: Vec<usize>,
    facets: Vec<u32>,
}

impl<'a> Cutter<'a> {
    /// Sorts the facets of a solid by the layers whose middle they meet.
    #[must_use]
    pub fn new(solid: &'a Solid, surface: &'a dyn LayerSurface, levels: &[Level]) -> Self {
        Self::at_levels(solid, surface, levels.iter().map(Level::middle).collect())
    }

    /// As [`new`](Self::new), to cut at `cuts` (mm of level, ascending).
    #[must_use]
    pub fn at_levels(solid: &'a Solid, surface: &'a dyn LayerSurface, cuts: Vec<f64>) -> Self {
        let reach = Reach::new(solid, surface);
        let ranges: Vec<(u32, u32)> = (0..solid.mesh().triangles.len() as u32)
            .into_par_iter()
            .map(|facet| crossed(&cuts, reach.of_facet(solid, facet)))
            .collect();
        let (starts, facets) = by_cut(&ranges, cuts.len());
        let Reach { form, vertex_levels } = reach;
        Self { solid, surface, form, cuts, vertex_levels, starts, facets }
    }

    /// Cuts the solid along the middle of layer `k`; outlines lie within `tolerance` mm of the
    /// exact curves.
    #[must_use]
    pub fn section(&self, k: usize, tolerance: f64) -> Section {
        let curve_share = if self.form.is_flat() { 0.0 } else { CURVE_SHARE };
        let (outlines, tears) = self.outlines(k, curve_share * tolerance);
        let mut rings: Vec<Ring> = Vec::new();
        for mut ring in outlines {
            // Points that fall on the same place of the grid would be corners without direction.
            ring.dedup();
            while ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            let ring = simplify_ring(&ring, (1.0 - curve_share) * tolerance);
            if ring.len() >= 3 {
                rings.push(ring);
            }
        }
        Section { region: Region::from_grid_rings(&rings, Fill::NonZero), tears }
    }

    /// The outlines of one cut as rings on the grid of the chart.
    fn outlines(&self, k: usize, tolerance: f64) -> (Vec<Ring>, Tears) {
        let facets = &self.facets[self.starts[k]..self.starts[k + 1]];
        let chains = if self.form.is_flat() {
            let cut = self.cuts[k];
            let step = |&facet: &u32| planar::step(self, facet, cut);
            planar::chains(self, &trails(facets.iter().filter_map(step).collect()), cut)
        } else {
            self.curved_chains(facets, k, tolerance)
        };
        let mut rings = Vec::new();
        let tears = close_chains(chains, &mut rings);
        (rings, tears)
    }

    fn field(&self) -> Field<'_> {
        let Self { solid, form, vertex_levels, .. } = self;
        Field { solid, form, vertex_levels }
    }

    fn curved_chains(&self, facets: &[u32], k: usize, tolerance: f64) -> Vec<Chain> {
        let cut = CurvedCut::new(self, self.cuts[k], tolerance);
        let mut steps: Vec<Step> = Vec::with_capacity(facets.len());
        let mut closed = Vec::new();
        for &facet in facets {
            cut.steps(facet, &mut steps, &mut closed);
        }
        cut.chains(&trails(steps), &closed)
    }
}

/// Returns the least and the greatest level of a solid, mm; `None` when it has no facets.
#[must_use]
pub fn level_range(solid: &Solid, surface: &dyn LayerSurface) -> Option<[f64; 2]> {
    let reach = Reach::new(solid, surface);
    (0..solid.mesh().triangles.len() as u32)
        .into_par_iter()
        .map(|facet| reach.of_facet(solid, facet))
        .reduce_with(|[a, b], [c, d]| [a.min(c), b.max(d)])
}

/// How far the parts of a solid reach over the levels.
struct Reach {
    form: Form,
    vertex_levels: Vec<f64>,
}

impl Reach {
    fn new(solid: &Solid, surface: &dyn LayerSurface) -> Self {
        let form = surface.form();
        let vertex_levels: Vec<f64> =
            solid.mesh().vertices.par_iter().map(|p| surface.level(p)).collect();
        Self { form, vertex_levels }
    }

    /// The least and the greatest level of a facet.
    fn of_facet(&self, solid: &Solid, facet: u32) -> [f64; 2] {
        let corners = solid.mesh().triangles[facet as usize];
        let levels = corners.map(|v| self.vertex_levels[v as usize]);
        let low = levels.into_iter().fold(f64::INFINITY, f64::min);
        let high = levels.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if self.form.is_flat() {
            return [low, high];
        }
        let field = Field { solid, form: &self.form, vertex_levels: &self.vertex_levels };
        let Some(least) = field.low(facet) else { return [low, high] };
        let beyond = self.form.value_of_level(least);
        [low.min(beyond), high.max(beyond)]
    }
}

/// The cuts that a facet meets: from the first above its least level to the last not above its
/// greatest.
fn crossed(cuts: &[f64], [low, high]: [f64; 2]) -> (u32, u32) {
    let from = cuts.partition_point(|&cut| cut <= low);
    let to = cuts.partition_point(|&cut| cut <= high);
    // Cuts are fewer than 2^32: the schedule is limited long before.
    (from as u32, to.max(from) as u32)
}

/// Facets by cut, from the cuts by facet: where each cut begins, and the facets.
fn by_cut(ranges: &[(u32, u32)], n_cuts: usize) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0; n_cuts + 1];
    for &(from, to) in ranges {
        for cut in from..to {
            starts[cut as usize + 1] += 1;
        }
    }
    for k in 0..n_cuts {
        starts[k + 1] += starts[k];
    }
    let mut next = starts.clone();
    let mut facets = vec![0; starts[n_cuts]];
    for (facet, &(from, to)) in (0_u32..).zip(ranges) {
        for slot in &mut next[from as usize..to as usize] {
            facets[*slot] = facet;
            *slot += 1;
        }
    }
    (starts, facets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Plane;
    use mesh::shapes;

    /// Planes have a path of their own for speed; the general one gives the same outlines.
    #[test]
    fn planes_are_cut_alike_by_both_ways() {
        let tilt = nalgebra::Rotation3::new(nalgebra::Vector3::new(0.3, 0.5, 0.0));
        for name in shapes::NAMES {
            let mesh = shapes::by_name(name).unwrap();
            for solid in [Solid::new(mesh.clone()), Solid::new(mesh).moved(|p| tilt * p)] {
                let [low, high] = level_range(&solid, &Plane).unwrap();
                let cuts: Vec<f64> =
                    (0..=20).map(|k| low + (high - low) * f64::from(k) / 20.0).collect();
                let cutter = Cutter::at_levels(&solid, &Plane, cuts.clone());
                for k in 0..cuts.len() {
                    let mut rings = Vec::new();
                    let facets = &cutter.facets[cutter.starts[k]..cutter.starts[k + 1]];
                    let tears = close_chains(cutter.curved_chains(facets, k, 0.001), &mut rings);
                    let planar = cutter.outlines(k, 0.001);
                    assert_eq!((rings.len(), tears), (planar.0.len(), planar.1), "{name}, cut {k}");
                    for (all, corners) in rings.iter().zip(&planar.0) {
                        same_but_for_straight_points(all, corners);
                    }
                }
            }
        }
    }

    /// One way keeps points on straight lines, the other does not.
    fn same_but_for_straight_points(all: &Ring, corners: &Ring) {
        // Point and corners are each rounded to the grid, by half its diagonal at most.
        const ROUNDED_MM: f64 = 1.5 / geom::grid::STEPS_PER_MM;
        let line: Vec<_> = corners.iter().map(|p| geom::grid::mm(*p)).collect();
        let mut left = corners.iter().peekable();
        for p in all {
            if left.next_if_eq(&p).is_none() {
                let nearest = geom::polyline::nearest_on_ring(&line, &geom::grid::mm(*p)).unwrap();
                assert!(nearest.distance <= ROUNDED_MM, "{} mm off", nearest.distance);
            }
        }
        assert_eq!(left.next(), None, "a corner that the other way does not have");
    }

    /// The diagonals of upright faces cross every layer at another place.
    #[test]
    fn layers_of_an_upright_wall_are_equal_to_the_last_bit() {
        for (name, z) in [("cube", 1.0..19.0), ("gear", 1.0..7.0)] {
            let solid = Solid::new(shapes::by_name(name).unwrap());
            let cuts = (0..40).map(|k| z.start + (z.end - z.start) * f64::from(k) / 40.0).collect();
            let cutter = Cutter::at_levels(&solid, &Plane, cuts);
            let first = cutter.section(0, 0.002).region;
            assert!(!first.is_empty());
            for k in 1..40 {
                assert_eq!(cutter.section(k, 0.002).region, first, "{name}, layer {k}");
            }
        }
    }
}
