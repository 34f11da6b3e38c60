//! The cut by a curved layer: up to two crossings on a side, curves inside facets.
//!
//! All in convex coordinates (see [`Form`]), where the layer bounds a convex solid K. A vertex is
//! in K or not; the one exactly on the layer counts as above it. A side with one end in K is
//! crossed once; with both, never; with none, twice when it dips into K at its least place, or not
//! at all. A crossing is the number of the side doubled, plus one where the side, run from its lower
//! vertex to the higher, leaves K.
//!
//! Around a facet crossings alternate. Each that leaves K is joined with the next, which enters: in
//! between the boundary of K runs through the facet. As each crossing leaves K in one facet of the
//! side and enters it in the other, it has one successor and one predecessor, and every outline
//! closes, whatever the rounding. A facet without crossings may still hold a closed curve around
//! its own least place.

use mesh::topology::Solid;
use nalgebra::Point3;
use rayon::prelude::*;

use super::Cutter;
use super::arc::Cut;
use super::chain::{Chain, Step, Trails};
use crate::surface::Form;
use geom::grid::snap;
use geom::region::Ring;

/// The least places of F on sides and in facets, where that is not at their ends.
#[derive(Debug, Default)]
pub(super) struct Lows {
    /// F at the least place inside each side; infinite where there is none.
    pub(super) sides: Vec<f64>,
    /// Those inside facets, ascending by facet.
    facets: Vec<FacetLow>,
}

#[derive(Debug, Clone, Copy)]
struct FacetLow {
    facet: u32,
    at: Point3<f64>,
    value: f64,
}

/// How far F at a computed crossing may be from that of the layer, relative to 1 mm more than its
/// own size: ten times what rounding makes of well-conditioned crossings. Beyond it, the crossing
/// is found again by bisection.
const RESIDUAL: f64 = 1e-10;

/// Bisections from a whole side down to its last bit.
const BISECTIONS: u32 = 60;

impl Lows {
    /// `values` are F at the vertices.
    pub(super) fn new(solid: &Solid, form: &Form, vertex_levels: &[f64]) -> Self {
        let vertices = &solid.mesh().vertices;
        let value = |v: u32| form.value_of_level(vertex_levels[v as usize]);
        let at = |v: u32| form.convex(&vertices[v as usize]);
        let side_low = |side: u32| {
            let [low, high] = solid.ends(side);
            let (a, b) = (at(low), at(high));
            let least = form.lowest_on_line(&a, &(b - a)).filter(|t| 0.0 < *t && *t < 1.0);
            least
                .map(|t| form.value(&a.lerp(&b, t)))
                .filter(|least| *least < value(low).min(value(high)))
                .unwrap_or(f64::INFINITY)
        };
        let facet_low = |facet: u32| {
            let corners = solid.mesh().triangles[facet as usize].map(at);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let lowest = form.lowest_in_plane(&corners[0], &normal)?;
            let is_inside = (0..3).all(|k| {
                let side = corners[(k + 1) % 3] - corners[k];
                side.cross(&(lowest - corners[k])).dot(&normal) > 0.0
            });
            is_inside.then(|| FacetLow { facet, at: lowest, value: form.value(&lowest) })
        };
        let (sides, facets) = rayon::join(
            || (0..solid.n_sides() as u32).into_par_iter().map(side_low).collect(),
            || {
                let facets = 0..solid.mesh().triangles.len() as u32;
                facets.into_par_iter().filter_map(facet_low).collect()
            },
        );
        Self { sides, facets }
    }

    /// The least F of a facet that is not at one of its corners.
    pub(super) fn of_facet(&self, facet: u32, sides: [u32; 3]) -> f64 {
        let inner = self.facet(facet).map_or(f64::INFINITY, |low| low.value);
        sides.iter().map(|side| self.sides[*side as usize]).fold(inner, f64::min)
    }

    fn facet(&self, facet: u32) -> Option<&FacetLow> {
        let at = self.facets.binary_search_by_key(&facet, |low| low.facet).ok()?;
        Some(&self.facets[at])
    }
}

/// One cut of a solid by a curved layer.
pub(super) struct CurvedCut<'a> {
    cutter: &'a Cutter<'a>,
    form: &'a Form,
    /// Level of the layer.
    level: f64,
    /// F of the layer.
    pub(super) value: f64,
    /// How far outlines may lie from the curves, mm.
    tolerance: f64,
}

impl<'a> CurvedCut<'a> {
    pub(super) fn new(cutter: &'a Cutter<'a>, level: f64, tolerance: f64) -> Self {
        let form = &cutter.form;
        Self { cutter, form, level, value: form.value_of_level(level), tolerance }
    }

    /// Appends the ways of the outlines through a facet, and the facet itself to `closed` when it
    /// holds a closed curve.
    pub(super) fn steps(&self, facet: u32, steps: &mut Vec<Step>, closed: &mut Vec<u32>) {
        let corners = self.cutter.solid.mesh().triangles[facet as usize];
        let inside = corners.map(|v| self.holds_vertex(v));
        if inside == [true; 3] {
            return;
        }
        let sides = self.cutter.solid.sides()[facet as usize];
        let mut crossings = [(0, false); 6];
        let mut count = 0;
        let mut add = |side: u32, is_backwards: bool, leaves: bool| {
            crossings[count] = (2 * side + u32::from(leaves != is_backwards), leaves);
            count += 1;
        };
        for (from, to, side) in self.round() {
            let is_backwards = corners[from] > corners[to];
            match (inside[from], inside[to]) {
                (true, true) => {}
                (true, false) => add(sides[side], is_backwards, true),
                (false, true) => add(sides[side], is_backwards, false),
                (false, false) => {
                    if self.cutter.lows.sides[sides[side] as usize] < self.value {
                        add(sides[side], is_backwards, false);
                        add(sides[side], is_backwards, true);
                    }
                }
            }
        }
        for (k, &(leave, leaves)) in crossings[..count].iter().enumerate() {
            if leaves {
                let (enter, _) = crossings[(k + 1) % count];
                steps.push(Step { enter, leave, facet });
            }
        }
        if count == 0 && self.cutter.lows.facet(facet).is_some_and(|low| low.value < self.value) {
            closed.push(facet);
        }
    }

    /// The corners of a facet in pairs with their side, counter-clockwise in convex coordinates.
    fn round(&self) -> [(usize, usize, usize); 3] {
        if self.form.is_mirrored() {
            [(0, 2, 2), (2, 1, 1), (1, 0, 0)]
        } else {
            [(0, 1, 0), (1, 2, 1), (2, 0, 2)]
        }
    }

    /// Whether a vertex lies in K.
    pub(super) fn holds_vertex(&self, v: u32) -> bool {
        (self.cutter.vertex_levels[v as usize] < self.level) != self.form.is_mirrored()
    }

    /// The outlines in the chart.
    pub(super) fn chains(&self, trails: &Trails, closed: &[u32]) -> Vec<Chain> {
        let mut inner = Vec::new();
        let outlines = trails.outlines.iter().map(|(range, is_closed)| {
            let steps = &trails.steps[range.clone()];
            Chain { points: self.points(steps, *is_closed, &mut inner), closed: *is_closed }
        });
        let mut chains: Vec<Chain> = outlines.collect();
        chains.extend(closed.iter().filter_map(|&facet| {
            let low = self.cutter.lows.facet(facet)?;
            let curve = self.cut(facet).closed_curve(&low.at);
            Some(Chain { points: curve.iter().map(|p| self.chart(p)).collect(), closed: true })
        }));
        chains
    }

    fn points(&self, steps: &[Step], is_closed: bool, inner: &mut Vec<Point3<f64>>) -> Ring {
        let mut ring = Ring::with_capacity(steps.len() + 1);
        let Some(&first) = steps.first() else { return ring };
        let begin = self.crossing(first.enter);
        let mut enter = begin;
        for (k, step) in steps.iter().enumerate() {
            let is_last = k + 1 == steps.len();
            let leave = if is_last && is_closed { begin } else { self.crossing(step.leave) };
            ring.push(self.chart(&enter));
            inner.clear();
            let sides = [step.enter, step.leave].map(|crossing| self.place(step.facet, crossing));
            self.cut(step.facet).between((&enter, sides[0]), (&leave, sides[1]), inner);
            ring.extend(inner.iter().map(|p| self.chart(p)));
            if is_last && !is_closed {
                ring.push(self.chart(&leave));
            }
            enter = leave;
        }
        ring
    }

    /// Which side of the facet, counted as [`round`](Self::round) does, a crossing lies on.
    pub(super) fn place(&self, facet: u32, crossing: u32) -> usize {
        let sides = self.cutter.solid.sides()[facet as usize];
        self.round().iter().position(|&(_, _, side)| sides[side] == crossing / 2).unwrap_or(0)
    }

    pub(super) fn cut(&self, facet: u32) -> Cut<'_> {
        let mesh = self.cutter.solid.mesh();
        let corners = mesh.triangles[facet as usize];
        let at = |k: usize| self.form.convex(&mesh.vertices[corners[k] as usize]);
        let ordered = self.round().map(|(from, _, _)| at(from));
        Cut::new(self.form, self.value, ordered, self.tolerance)
    }

    fn chart(&self, p: &Point3<f64>) -> geom::grid::GridPoint {
        snap(&self.cutter.surface.flatten(&self.form.convex(p)))
    }

    /// Where a side meets the layer; computed from its lower vertex to its higher, so that both
    /// facets get the same bits.
    pub(super) fn crossing(&self, crossing: u32) -> Point3<f64> {
        let [low, high] = self.cutter.solid.ends(crossing / 2);
        let vertices = &self.cutter.solid.mesh().vertices;
        let (a, b) =
            (self.form.convex(&vertices[low as usize]), self.form.convex(&vertices[high as usize]));
        let leaves = crossing % 2 == 1;
        let along = b - a;
        let quadratic = self.form.quadratic(self.value, &a, &along);
        let (mut from, mut to) = (0.0, 1.0);
        if !self.holds_vertex(low) && !self.holds_vertex(high) {
            let least = self.form.lowest_on_line(&a, &along).unwrap_or(0.5);
            if leaves {
                from = least;
            } else {
                to = least;
            }
        }
        let t = if leaves { quadratic.leaves() } else { quadratic.enters() };
        let near = a.lerp(&b, t.clamp(from, to));
        let residual = (self.form.value(&near) - self.value).abs();
        if residual <= RESIDUAL * (1.0 + self.value.abs()) {
            return near;
        }
        a.lerp(&b, self.bisected(&a, &b, from, to, leaves))
    }

    fn bisected(
        &self,
        a: &Point3<f64>,
        b: &Point3<f64>,
        mut from: f64,
        mut to: f64,
        leaves: bool,
    ) -> f64 {
        for _ in 0..BISECTIONS {
            let middle = f64::midpoint(from, to);
            let is_in = self.form.value(&a.lerp(b, middle)) < self.value;
            if is_in == leaves {
                from = middle;
            } else {
                to = middle;
            }
        }
        f64::midpoint(from, to)
    }
}
